//! The smoothest field: least eigenvector of the connection Laplacian on faces.
//!
//! *Enters:* transport between faces, areas. *Leaves:* one complex number a face whose fourth root is the cross.
//!
//! The energy Σ |u_g − e^{4iρ} u_f|² over the edges is that of Dirichlet on a triangulation without obtuse corners, at any density of the
//! faces: both sides of an edge are about as long as the edge is apart. The constraint Σ A |u|² = 1 has the areas, so that the
//! field does not follow the density either. A Hermitian matrix of n rows is a real symmetric one of 2n, and inverse
//! iteration needs one factor.

use super::connection::transport;
use super::{CrossField, FieldError};
use crate::flow::holonomy::HolonomyError;
use crate::flow::solve::SymmetricSolver;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{FaceId, FaceVec, HalfedgeVec};
use std::f64::consts::FRAC_PI_2;

/// Added to the diagonal, where every face has 3: a parallel field, on a flat torus, has energy 0, and the matrix would be singular.
const SHIFT: f64 = 1e-9;
/// The iteration ends when a step lowers the energy by less than this part of it: where two fields are nearly as smooth,
/// any mixture of both will do.
const SETTLED: f64 = 1e-2;
/// Most steps.
const MOST_STEPS: usize = 40;

/// The smoothest cross field of a closed surface. `angle`: corner angles, radians; `area`: any unit.
pub fn cross_field(
    connectivity: &Connectivity,
    angle: &FaceVec<[f64; 3]>,
    area: &FaceVec<f64>,
) -> Result<CrossField, FieldError> {
    let c = connectivity;
    if !c.is_closed() {
        let boundary_loops = c.boundary_loops().len();
        return Err(HolonomyError::NotClosed { boundary_loops }.into());
    }
    let rho = transport(c, angle);
    let root = least_eigenvector(c, &rho, area)?;
    let direction: FaceVec<f64> = c
        .faces()
        .map(|f| 0.25 * root[2 * f.index() + 1].atan2(root[2 * f.index()]))
        .collect();
    let mut matching = HalfedgeVec::filled(0.0, c.halfedge_count());
    for e in c.edges() {
        let h = c.edge_halfedge(e);
        let Some(t) = c.twin(h) else { continue };
        let turn = direction[c.face(t)] - direction[c.face(h)] - rho[h];
        matching[h] = turn - (turn / FRAC_PI_2).round() * FRAC_PI_2;
        matching[t] = -matching[h];
    }
    Ok(CrossField {
        direction,
        matching,
    })
}

/// Real and imaginary part of every face's value.
fn least_eigenvector(
    c: &Connectivity,
    rho: &HalfedgeVec<f64>,
    area: &FaceVec<f64>,
) -> Result<Vec<f64>, FieldError> {
    let faces = c.face_count();
    let parts = |f: FaceId| [2 * f.index() as u32, 2 * f.index() as u32 + 1];
    let mut diagonal = vec![SHIFT; 2 * faces];
    let (mut pairs, mut values) = (Vec::new(), Vec::new());
    for f in c.faces() {
        // The blocks on the diagonal are diagonal, but filled soon.
        pairs.push(parts(f));
        values.push(0.0);
    }
    for e in c.edges() {
        let h = c.edge_halfedge(e);
        let Some(t) = c.twin(h) else { continue };
        let ([x, y], [u, v]) = (parts(c.face(h)), parts(c.face(t)));
        let (sine, cosine) = (4.0 * rho[h]).sin_cos();
        if x == u {
            // A face glued to itself: |u − e^{4iρ} u|².
            for part in [x, y] {
                diagonal[part as usize] += 2.0 - 2.0 * cosine;
            }
            continue;
        }
        for part in [x, y, u, v] {
            diagonal[part as usize] += 1.0;
        }
        pairs.extend([[u, x], [u, y], [v, x], [v, y]]);
        values.extend([-cosine, sine, -sine, -cosine]);
    }
    let mut solver = SymmetricSolver::with_blocks(2 * faces, 2, &pairs)?;
    solver.factorize(&diagonal, &values)?;
    let total: f64 = area.iter().sum();
    let mass = |part: usize| area[FaceId::new(part / 2)] * faces as f64 / total;
    let mut x = start(2 * faces);
    let mut energy = f64::INFINITY;
    for _ in 0..MOST_STEPS {
        let load: Vec<f64> = (0..x.len()).map(|i| mass(i) * x[i]).collect();
        let mut next = load.clone();
        solver.solve(&mut next);
        let norm: f64 = (0..x.len()).map(|i| mass(i) * next[i] * next[i]).sum();
        // The matrix times `next` is `load`.
        let now = next.iter().zip(&load).map(|(a, b)| a * b).sum::<f64>() / norm;
        let scale = 1.0 / norm.sqrt();
        if !(scale.is_finite() && now.is_finite()) {
            break;
        }
        x = next.into_iter().map(|v| v * scale).collect();
        let is_settled = now > (1.0 - SETTLED) * energy;
        energy = now;
        if is_settled {
            break;
        }
    }
    Ok(x)
}

/// Numbers without pattern, the same every time: hardly orthogonal to any field.
fn start(count: usize) -> Vec<f64> {
    let mut state: u64 = 0x9e37_79b9_7f4a_7c15;
    let mut random = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    (0..count).map(|_| random()).collect()
}
