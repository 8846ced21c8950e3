//! The smoothest field: least eigenvector of the connection Laplacian on faces, or what diffuses from the border.
//!
//! *Enters:* transport between faces, areas. *Leaves:* one complex number a face whose fourth root is the cross.
//!
//! The energy is Σ w |u_g − e^{4iρ} u_f|² over the edges, where w is the length of an edge over the distance of the centroids beside it: Dirichlet's, at any density and any shape of the
//! faces. With one weight for all, turns between the long thin faces around a pole of a sphere of rings and meridians cost nothing, and four cones lay in one place there. On a closed surface the constraint Σ A |u|² = 1 has the areas, so that the
//! field does not follow the density either. A Hermitian matrix of n rows is a real symmetric one of 2n, and inverse
//! iteration needs one factor.
//!
//! Where there is a border, boundary edges have terms |u_f − e^{4iφ}|² for their own direction φ. The minimum of all terms fades away from the border, and with it
//! what it says of the inside. So lengths are made 1 and smoothed in turn, as by diffusion (Merriman, Bence, Osher 1992; for cross fields Viertel, Osting 2019):
//! A x = b + λ M x/|x|, with the least eigenvalue λ, which damps a mode by its own and so needs no factor but that of A. The energy among fields of length 1 sinks until it settles.
//!
//! What borders say inside of a disk is z⁴ in its middle: four cones in one place, from which diffusion does not come away where the surface is symmetric. A small smooth field added to it takes them apart: z⁴ + ε.
//! That way is gone too, and taken where the energy is much less.

use super::connection::transport;
use super::{CrossField, FieldError};
use crate::flow::solve::SymmetricSolver;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, FaceId, FaceVec, HalfedgeId, HalfedgeVec};
use crate::observe::part;
use std::f64::consts::FRAC_PI_2;

/// Added to the diagonal, where every face has 3: a parallel field, on a flat torus, has energy 0, and the matrix would be singular.
const SHIFT: f64 = 1e-9;
/// The iteration ends when a step lowers the energy by less than this part of it: where two fields are nearly as smooth,
/// any mixture of both will do.
const SETTLED: f64 = 1e-2;
/// Most steps.
const MOST_STEPS: usize = 40;
/// The longest number of a smooth field that is added to the one that borders and pulls say, where these are of length 1.
const PUSH: f64 = 0.3;
/// The field that comes of that is taken where its energy is less than this part of the other's: cones in one place cost more than half of it. Fields that differ by less are as good as each other.
const CLEARLY: f64 = 0.8;
/// Largest weight of an edge, and the inverse of the least: thin faces would say what they do not know.
const MOST_WEIGHT: f64 = 10.0;
/// Steps of inverse iteration for the least eigenvalue, of which one digit is enough.
const RATE_STEPS: usize = 3;

/// The smoothest cross field of a surface, drawn to the border where it has one. `angle`: corner angles, radians; `area`: any unit. `pull`: what draws every face to a
/// cross of angle θ from its first halfedge, weight times e^{4iθ}; beside it an edge between equilateral triangles has the weight 1. `lean`: by how much less a direction shall turn across a halfedge than the angles say (its twin's is the negative), and by how much the direction that a boundary halfedge draws to differs from its own, radians.
pub fn cross_field(
    connectivity: &Connectivity,
    angle: &FaceVec<[f64; 3]>,
    area: &FaceVec<f64>,
    pull: &FaceVec<[f64; 2]>,
    lean: &HalfedgeVec<f64>,
) -> Result<CrossField, FieldError> {
    let _part = part!("cross field");
    let c = connectivity;
    let mut rho = transport(c, angle);
    for h in c.halfedges() {
        rho[h] -= lean[h];
    }
    let weight = weights(c, angle);
    let energy = Energy::new(c, &rho, area, pull, &weight);
    let root = match energy.wanted > 0.0 {
        true => energy.diffused()?,
        false => energy.least_eigenvector()?,
    };
    let direction: FaceVec<f64> = c
        .faces()
        .map(|f| 0.25 * root[2 * f.index() + 1].atan2(root[2 * f.index()]))
        .collect();
    let mut matching = HalfedgeVec::filled(0.0, c.halfedge_count());
    for e in c.edges() {
        let h = c.edge_halfedge(e);
        let beyond = c.twin(h).map_or(0.0, |t| direction[c.face(t)]);
        let turn = beyond - direction[c.face(h)] - rho[h];
        // The turn that is meant, and what the surface's own angles turn beside it.
        matching[h] = turn - (turn / FRAC_PI_2).round() * FRAC_PI_2 - lean[h];
        if let Some(t) = c.twin(h) {
            matching[t] = -matching[h];
        }
    }
    Ok(CrossField {
        direction,
        matching,
    })
}

/// Weights of edges: how long an edge is beside the distance of its faces' centroids from each other, as between finite volumes; 1 between equilateral triangles, and at the border as if the face beyond were like that on this side.
fn weights(c: &Connectivity, angle: &FaceVec<[f64; 3]>) -> EdgeVec<f64> {
    // The height of a face over an edge, in lengths of the edge.
    let height = |h: HalfedgeId| {
        let (of, k) = (angle[c.face(h)], c.corner(h));
        of[k].sin() * of[(k + 1) % 3].sin() / of[(k + 2) % 3].sin()
    };
    let weight = |e| {
        let h = c.edge_halfedge(e);
        let heights = height(h) + height(c.twin(h).unwrap_or(h));
        let weight = 3.0_f64.sqrt() / heights;
        match weight.is_nan() {
            true => 1.0,
            false => weight.clamp(1.0 / MOST_WEIGHT, MOST_WEIGHT),
        }
    };
    c.edges().map(weight).collect()
}

/// ½ xᵀ A x − bᵀ x: half the energy but for a constant; two parts a face, real and imaginary.
struct Energy {
    diagonal: Vec<f64>,
    pairs: Vec<[u32; 2]>,
    /// Entries of A, in the order of `pairs`.
    values: Vec<f64>,
    /// b: what borders and pulls ask for.
    load: Vec<f64>,
    /// Total weight of what is asked for.
    wanted: f64,
    /// Areas relative to their mean, one a part.
    mass: Vec<f64>,
}

impl Energy {
    fn new(
        c: &Connectivity,
        rho: &HalfedgeVec<f64>,
        area: &FaceVec<f64>,
        pull: &FaceVec<[f64; 2]>,
        weight: &EdgeVec<f64>,
    ) -> Self {
        let faces = c.face_count();
        let parts = |f: FaceId| [2 * f.index() as u32, 2 * f.index() as u32 + 1];
        let mut diagonal = vec![SHIFT; 2 * faces];
        let mut load = vec![0.0; 2 * faces];
        let (mut pairs, mut values) = (Vec::new(), Vec::new());
        let border = c.edges().filter(|&e| c.is_boundary_edge(e));
        let mut wanted = border.map(|e| weight[e]).sum::<f64>();
        for f in c.faces() {
            let weight = pull[f][0].hypot(pull[f][1]);
            wanted += weight;
            for (part, pull) in parts(f).into_iter().zip(pull[f]) {
                diagonal[part as usize] += weight;
                load[part as usize] += pull;
            }
            // The blocks on the diagonal are diagonal, but filled soon.
            pairs.push(parts(f));
            values.push(0.0);
        }
        for e in c.edges() {
            let h = c.edge_halfedge(e);
            let w = weight[e];
            let [x, y] = parts(c.face(h));
            let (sine, cosine) = (4.0 * rho[h]).sin_cos();
            let (sine, cosine) = (w * sine, w * cosine);
            let Some(t) = c.twin(h) else {
                // The border's direction is −ρ in the frame of the face.
                for (part, wanted) in [(x, cosine), (y, -sine)] {
                    diagonal[part as usize] += w;
                    load[part as usize] += wanted;
                }
                continue;
            };
            let [u, v] = parts(c.face(t));
            if x == u {
                // A face glued to itself: |u − e^{4iρ} u|².
                for part in [x, y] {
                    diagonal[part as usize] += 2.0 * w - 2.0 * cosine;
                }
                continue;
            }
            for part in [x, y, u, v] {
                diagonal[part as usize] += w;
            }
            pairs.extend([[u, x], [u, y], [v, x], [v, y]]);
            values.extend([-cosine, sine, -sine, -cosine]);
        }
        let total: f64 = area.iter().sum();
        let relative = area.iter().map(|a| a * faces as f64 / total);
        Self {
            wanted,
            diagonal,
            pairs,
            values,
            load,
            mass: relative.flat_map(|m| [m, m]).collect(),
        }
    }

    fn solver(&self) -> Result<SymmetricSolver, FieldError> {
        let mut solver = SymmetricSolver::with_blocks(self.diagonal.len(), 2, &self.pairs)?;
        solver.factorize(&self.diagonal, &self.values)?;
        Ok(solver)
    }

    /// M x.
    fn weighed(&self, x: &[f64]) -> Vec<f64> {
        x.iter().zip(&self.mass).map(|(x, m)| x * m).collect()
    }

    /// The next x of inverse iteration, of length 1, and its energy; `None` where it is not finite.
    fn inverse_step(&self, solver: &mut SymmetricSolver, x: &[f64]) -> Option<(Vec<f64>, f64)> {
        let load = self.weighed(x);
        let mut next = load.clone();
        solver.solve(&mut next);
        let norm = dot(&self.weighed(&next), &next);
        // The matrix times `next` is `load`.
        let energy = dot(&next, &load) / norm;
        let scale = 1.0 / norm.sqrt();
        let is_finite = scale.is_finite() && energy.is_finite();
        is_finite.then(|| (next.into_iter().map(|v| v * scale).collect(), energy))
    }

    /// Of a closed surface.
    fn least_eigenvector(&self) -> Result<Vec<f64>, FieldError> {
        let mut solver = self.solver()?;
        let mut x = start(self.diagonal.len());
        let mut energy = f64::INFINITY;
        for _ in 0..MOST_STEPS {
            let Some((next, now)) = self.inverse_step(&mut solver, &x) else {
                break;
            };
            x = next;
            let is_settled = now > (1.0 - SETTLED) * energy;
            energy = now;
            if is_settled {
                break;
            }
        }
        Ok(x)
    }

    /// Of a surface where something is asked for.
    fn diffused(&self) -> Result<Vec<f64>, FieldError> {
        let mut solver = self.solver()?;
        let mut x = self.load.clone();
        solver.solve(&mut x);
        // A smooth field that is not symmetric even where the surface is.
        let mut slowest = start(x.len());
        let mut rate = 0.0;
        for _ in 0..RATE_STEPS {
            if let Some(step) = self.inverse_step(&mut solver, &slowest) {
                (slowest, rate) = step;
            }
        }
        // What is asked for may cancel out.
        if !(dot(&x, &x) > 0.0 && rate > 0.0) {
            return self.least_eigenvector();
        }
        let longest = slowest.chunks_exact(2).map(|p| p[0].hypot(p[1]));
        let scale = PUSH / longest.fold(f64::MIN_POSITIVE, f64::max);
        let pushed = x.iter().zip(&slowest).map(|(x, s)| x + scale * s).collect();
        let fields = [x, pushed].map(|x: Vec<f64>| self.settled(&mut solver, rate, &x));
        let [plain, pushed] = fields;
        Ok(if pushed.1 < CLEARLY * plain.1 {
            pushed.0
        } else {
            plain.0
        })
    }

    /// What diffusion with lengths made 1 in turn comes to from some field, and its energy.
    fn settled(&self, solver: &mut SymmetricSolver, rate: f64, x: &[f64]) -> (Vec<f64>, f64) {
        let mut best = unit(x);
        let mut least = self.of(&best);
        for _ in 0..MOST_STEPS {
            let old = self.weighed(&best);
            let parts = self.load.iter().zip(&old);
            let mut x: Vec<f64> = parts.map(|(b, old)| b + rate * old).collect();
            solver.solve(&mut x);
            let next = unit(&x);
            let now = self.of(&next);
            let is_settled = now > (1.0 - SETTLED) * least;
            if now < least {
                (best, least) = (next, now);
            }
            if is_settled {
                break;
            }
        }
        (best, least)
    }

    /// The energy of a field.
    fn of(&self, x: &[f64]) -> f64 {
        let squares = self.diagonal.iter().zip(x).map(|(d, x)| d * x * x);
        let pairs = self.pairs.iter().zip(&self.values);
        let products = pairs.map(|(&[i, j], v)| 2.0 * v * x[i as usize] * x[j as usize]);
        // What is asked for are numbers of length 1.
        let asked = self.load.iter().zip(x).map(|(b, x)| -2.0 * b * x);
        squares.sum::<f64>() + products.sum::<f64>() + asked.sum::<f64>() + self.wanted
    }
}

/// Every face's number divided by its length.
fn unit(x: &[f64]) -> Vec<f64> {
    let of = |part: &[f64]| {
        let length = part[0].hypot(part[1]);
        match length > 0.0 {
            true => [part[0] / length, part[1] / length],
            false => [1.0, 0.0],
        }
    };
    x.chunks_exact(2).flat_map(of).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
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
