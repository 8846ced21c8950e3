//! How large cells are to be: everywhere the same, or smaller where the surface is curved.
//!
//! *Enters:* the surface that a grid lies on. *Leaves:* for each of its faces the side of a cell there, source units. *Guaranteed:* as many cells as of one size everywhere.
//!
//! A cell of size h that stands for a surface of curvature κ is off by about κ h². The sum of its square over the surface is least, for a number of cells ∫ h⁻², where h goes with κ to the −1/3
//! (the optimum of adaptive approximation; Nadler 1986). Curvature is the mean curvature of edges, ½ Σ l |β| over edges of length l with an angle β between normals, spread over about a cell by
//! one step of diffusion.

use super::error::GridError;
use super::params::Density;
use crate::flow::solve::SymmetricSolver;
use crate::geometry::ids::{FaceId, FaceVec, HalfedgeId, VertexVec};
use crate::geometry::mesh::{Mesh, cross, dot, norm, sub, triangle_area};
use std::collections::BTreeMap;

/// The power of the curvature that the side of a cell goes with, negative.
const POWER: f64 = 1.0 / 3.0;
/// Curvature that a place counts as having at least, part of the mean.
const FLATTEST: f64 = 0.05;
/// Cells are at most so many times as long or as short as the mean.
const MOST_RATIO: f64 = 2.5;
/// Largest cotangent of an angle that diffusion counts: those of slivers say nothing.
const MOST_COTANGENT: f64 = 10.0;
const LEAST_COTANGENT: f64 = 1e-3;

/// The side of a cell, face by face.
pub(crate) struct Units {
    size: f64,
    /// Of each face of the surface before it was divided, part of `size`; empty where all are alike.
    part: FaceVec<f64>,
}

impl Units {
    /// `size`: √(area / cells), source units.
    pub(crate) fn new(mesh: &Mesh, size: f64, density: Density) -> Result<Self, GridError> {
        let part = match density {
            Density::Uniform => FaceVec::filled(1.0, 0),
            Density::Curvature => parts(mesh, size)?,
        };
        Ok(Self { size, part })
    }

    /// In a face of the surface before it was divided.
    pub(crate) fn of(&self, parent: FaceId) -> f64 {
        match self.part.is_empty() {
            true => self.size,
            false => self.size * self.part[parent],
        }
    }
}

fn parts(mesh: &Mesh, size: f64) -> Result<FaceVec<f64>, GridError> {
    let c = &mesh.connectivity;
    let areas: FaceVec<f64> = c
        .faces()
        .map(|f| triangle_area(mesh.face_positions(f)))
        .collect();
    let curvature = curvature(mesh, &areas, size)?;
    let whole: f64 = areas.iter().sum();
    let of_face = |f: FaceId| c.face_vertices(f).map(|v| curvature[v]).iter().sum::<f64>() / 3.0;
    let mean = c.faces().map(|f| areas[f] * of_face(f)).sum::<f64>() / whole;
    let part = |f: FaceId| match mean > 0.0 {
        true => (of_face(f) / mean).max(FLATTEST).powf(-POWER),
        false => 1.0,
    };
    let mut part: FaceVec<f64> = c.faces().map(part).collect();
    let normalise = |part: &mut FaceVec<f64>| {
        let cells = c.faces().map(|f| areas[f] / (part[f] * part[f]));
        let by = (cells.sum::<f64>() / whole).sqrt();
        part.as_mut_slice().iter_mut().for_each(|p| *p *= by);
    };
    normalise(&mut part);
    part.as_mut_slice()
        .iter_mut()
        .for_each(|p| *p = p.clamp(1.0 / MOST_RATIO, MOST_RATIO));
    normalise(&mut part);
    Ok(part)
}

/// Mean curvature at vertices, spread over about `size`.
fn curvature(mesh: &Mesh, areas: &FaceVec<f64>, size: f64) -> Result<VertexVec<f64>, GridError> {
    let c = &mesh.connectivity;
    let p = |h: HalfedgeId| mesh.positions[c.tail(h)];
    // Faces of one face of the source lie in one plane: their own normals, where they are thin, say nothing.
    let mut normals: BTreeMap<u32, [f64; 3]> = BTreeMap::new();
    for f in c.faces() {
        let [a, b, d] = mesh.face_positions(f);
        let own = cross(sub(b, a), sub(d, a));
        let sum = normals.entry(mesh.source_face[f]).or_default();
        (0..3).for_each(|i| sum[i] += own[i]);
    }
    let normal = |h: HalfedgeId| normals[&mesh.source_face[c.face(h)]];
    let (mut bent, mut diagonal) = (vec![0.0; c.vertex_count()], vec![0.0; c.vertex_count()]);
    for f in c.faces() {
        for v in c.face_vertices(f) {
            diagonal[v.index()] += areas[f] / 3.0;
        }
    }
    // Of vertices without an area.
    let least = 1e-12 * areas.iter().sum::<f64>() / c.vertex_count() as f64;
    diagonal.iter_mut().for_each(|d| *d = d.max(least));
    let (mut pairs, mut weights) = (Vec::new(), Vec::new());
    for e in c.edges() {
        let h = c.edge_halfedge(e);
        let ends = c.edge_vertices(e);
        if let Some(t) = c.twin(h) {
            let (m, n) = (normal(h), normal(t));
            let angle = norm(cross(m, n)).atan2(dot(m, n));
            let length = norm(sub(p(c.next(h)), p(h)));
            ends.iter()
                .for_each(|v| bent[v.index()] += 0.25 * length * angle);
        }
        let cotangents = [Some(h), c.twin(h)].into_iter().flatten().map(|h| {
            let apex = p(c.prev(h));
            let (a, b) = (sub(p(h), apex), sub(p(c.next(h)), apex));
            let cotangent = dot(a, b) / norm(cross(a, b));
            // Of a face without area it may be no number.
            match cotangent.is_nan() {
                true => LEAST_COTANGENT,
                false => cotangent.clamp(LEAST_COTANGENT, MOST_COTANGENT),
            }
        });
        let weight = 0.5 * size * size * cotangents.sum::<f64>();
        ends.iter().for_each(|v| diagonal[v.index()] += weight);
        pairs.push(ends.map(|v| v.raw()));
        weights.push(-weight);
    }
    let mut solver = SymmetricSolver::new(diagonal.len(), &pairs)?;
    solver.factorize(&diagonal, &weights)?;
    solver.solve(&mut bent);
    Ok(bent.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::polycube::polycube;

    /// A cube of n³ cubes drawn onto an ellipsoid.
    fn ellipsoid(n: i32, axes: [f64; 3]) -> Mesh {
        let cubes = (0..n * n * n).map(|i| [i % n, i / n % n, i / (n * n)]);
        let mut mesh = polycube(cubes, |_, _, _| true);
        for p in mesh.positions.as_mut_slice() {
            let q = p.map(|x| 2.0 * x / f64::from(n) - 1.0);
            let r = norm(q);
            *p = std::array::from_fn(|i| axes[i] * q[i] / r);
        }
        mesh
    }

    fn areas(mesh: &Mesh) -> Vec<f64> {
        let faces = mesh.connectivity.faces();
        faces
            .map(|f| triangle_area(mesh.face_positions(f)))
            .collect()
    }

    #[test]
    fn there_are_as_many_cells_as_without() {
        for axes in [[1.0; 3], [4.0, 1.0, 1.0], [3.0, 2.0, 0.1]] {
            let mesh = ellipsoid(12, axes);
            let areas = areas(&mesh);
            let size = (areas.iter().sum::<f64>() / 500.0).sqrt();
            let units = Units::new(&mesh, size, Density::Curvature).expect("has sizes");
            let faces = mesh.connectivity.faces().zip(&areas);
            let cells: f64 = faces.map(|(f, a)| a / units.of(f).powi(2)).sum();
            assert!((cells - 500.0).abs() < 1e-6, "{axes:?}: {cells}");
        }
    }

    #[test]
    fn cells_go_with_the_curvature() {
        let size = 0.2;
        let sphere = ellipsoid(16, [1.0; 3]);
        let units = Units::new(&sphere, size, Density::Curvature).expect("has sizes");
        for f in sphere.connectivity.faces() {
            let part = units.of(f) / size;
            assert!((part - 1.0).abs() < 0.1, "{part}");
        }
        // Mean curvature of a spheroid: at its tips a / b², at its waist (1 / b + b / a²) / 2.
        let [a, b] = [3.0, 1.0];
        let spheroid = ellipsoid(32, [a, b, b]);
        let units = Units::new(&spheroid, size, Density::Curvature).expect("has sizes");
        let at = |p: [f64; 3]| {
            let c = &spheroid.connectivity;
            let apart = |f: FaceId| {
                let corners = spheroid.face_positions(f);
                corners.iter().map(|q| norm(sub(*q, p))).sum::<f64>()
            };
            let near = c.faces().min_by(|&f, &g| apart(f).total_cmp(&apart(g)));
            units.of(near.expect("has faces"))
        };
        let found = at([0.0, 0.0, b]) / at([a, 0.0, 0.0]);
        let tip = a / (b * b);
        let waist = 0.5 * (1.0 / b + b / (a * a));
        let wanted = (tip / waist).powf(POWER);
        // Diffusion takes some from the tip.
        assert!(
            (0.8 * wanted..1.02 * wanted).contains(&found),
            "{found} {wanted}"
        );
    }
}
