//! The linear picture: log scale as a linear function of curvature.
//!
//! *Enters:* a surface's connectivity and lengths, and where curvature is prescribed. *Leaves:* log scales for curvatures, a
//! back-substitution each or several side by side.
//!
//! On a smooth surface the curvature measure of the metric e^{2u} g is exactly K + Δu (Δ ≥ 0), so u = Δ⁻¹(K̄ − K) is no
//! approximation. On a mesh it is the first Newton step of vertex scaling from u = 0: Δ is the cotangent Laplacian of the
//! intrinsic Delaunay triangulation, the Hessian there. Ben-Chen, Gotsman and Bunin 2008 place cones in this picture.
//!
//! A surface with boundary is doubled, as in the flow; a field has one value a vertex of the surface. Where the boundary is free,
//! u = 0 there and curvature need not add up to anything.

use super::candidates::Samples;
use super::cells::add;
use super::star::Star;
use crate::flow::cones::error::ConeError;
use crate::flow::delaunay::Delaunay;
use crate::flow::doubled::Doubled;
use crate::flow::laplacian::{System, Unknowns};
use crate::flow::metric::{Evaluation, Metric};
use crate::flow::solve::{LANES, Row};
use crate::geometry::ids::{NONE, VertexId, VertexVec};
use crate::geometry::mesh::{Mesh, triangle_area};

/// Looks at the curvature that a log scale really has, at most.
const LOOKS: usize = 4;
/// Standard deviation of a step, relative to that of the log scale, after which the next would be far smaller.
const REST: f64 = 3e-2;

/// A surface's Laplacian, factorised, and its area.
pub(super) struct Picture {
    system: System,
    delaunay: Delaunay,
    /// Every vertex of the double as a vertex of the surface.
    original: VertexVec<VertexId>,
    /// 1 where the curvature of the double counts for one vertex of the surface, ½ on the boundary, 0 where u stays.
    share: Vec<f64>,
    /// Copies of the surface in the double: 1 or 2.
    pub(super) copies: f64,
    /// The vertices whose u is unknown, in the order of elimination.
    pub(super) order: Vec<u32>,
    /// Where each vertex stands in it.
    pub(super) position: Vec<u32>,
    /// Area of each vertex (a third of its faces), all together 1.
    pub(super) weight: Vec<f64>,
    /// K of the surface itself, radians.
    pub(super) curvature: Vec<f64>,
    /// Of every vertex, in the Delaunay triangulation.
    pub(super) star: Vec<Star>,
}

impl Picture {
    /// Flips to the Delaunay triangulation and factorises. `is_free`: u = 0 on the boundary.
    pub(super) fn new(mesh: &Mesh, is_free: bool) -> Result<Self, ConeError> {
        let surface = &mesh.connectivity;
        let length = surface.edges().map(|e| mesh.edge_length(e)).collect();
        let doubled = Doubled::new(surface).map_err(ConeError::not_chosen)?;
        let copies = if surface.is_closed() { 1.0 } else { 2.0 };
        let base_length = doubled.on_both(surface, &length);
        let Doubled {
            connectivity,
            original,
        } = doubled;
        let mut delaunay = Delaunay::new(connectivity, &base_length, Vec::new());
        delaunay.flip_in_the_surface();
        let prescribed: VertexVec<bool> = original
            .iter()
            .map(|&v| !(is_free && surface.is_boundary_vertex(v)))
            .collect();
        let mut metric = Metric::flipping(&mut delaunay);
        let mut evaluation = Evaluation::default();
        let zero = metric.start();
        metric.evaluate(&zero, &mut evaluation);
        let weight = metric.edge_weights(&evaluation);
        let connectivity = metric.connectivity();
        let unknowns = Unknowns {
            connectivity,
            prescribed: &prescribed,
            shares: &original,
            // The constants are dealt with below, in one and the same pattern.
            scale_free: false,
            flips: 0,
        };
        let mut system = System::new(&unknowns, None).map_err(ConeError::not_chosen)?;
        let mut laplacian = system.assemble(connectivity, &weight);
        let area = vertex_areas(mesh);
        if !is_free {
            // Where the right side adds up to 0, u = 0 at this vertex; one that does not depend on numbers.
            let largest = (0..area.len()).max_by(|&v, &w| area[v].total_cmp(&area[w]));
            let ground = largest.map_or(NONE, |v| system.unknown.as_slice()[v]);
            if let Some(diagonal) = laplacian.diagonal.get_mut(ground as usize) {
                *diagonal *= 2.0;
            }
        }
        let factorized = system
            .solver
            .factorize(&laplacian.diagonal, &laplacian.off_diagonal);
        factorized.map_err(ConeError::not_chosen)?;
        let positions = system.solver.positions();
        let mut order = vec![NONE; positions.len()];
        let mut position = vec![NONE; surface.vertex_count()];
        for (v, at) in position.iter_mut().enumerate() {
            // An unknown is one vertex of the surface, and its mirror image.
            if let Some(&place) = positions.get(system.unknown.as_slice()[v] as usize) {
                *at = place;
                order[place as usize] = v as u32;
            }
        }
        let half = |v| {
            if surface.is_boundary_vertex(v) {
                0.5
            } else {
                1.0
            }
        };
        let mut faces = vec![0; surface.vertex_count()];
        let mut sum = vec![0.0; surface.vertex_count()];
        for e in connectivity.edges() {
            let ends = connectivity.edge_vertices(e).map(VertexId::index);
            for v in ends.into_iter().filter(|&v| v < surface.vertex_count()) {
                faces[v] += 1;
                sum[v] += weight[e];
            }
        }
        let vertices = surface.vertices();
        let star =
            vertices.map(|v| Star::new(faces[v.index()], evaluation.curvature[v], sum[v.index()]));
        let star = star.collect();
        let vertices = surface.vertices();
        let curvature = vertices.map(|v| evaluation.curvature[v] * half(v));
        let vertices = surface.vertices();
        let share = vertices.map(|v| if prescribed[v] { half(v) } else { 0.0 });
        Ok(Self {
            curvature: curvature.collect(),
            share: share.collect(),
            original,
            system,
            copies,
            order,
            position,
            weight: area,
            delaunay,
            star,
        })
    }

    /// Replaces changes of curvature, radians, by the change of the log scale that they cause. Where no boundary is free they must add up to
    /// 0, and the result is determined but for a constant. The fewer they are the quicker.
    pub(super) fn solve(&self, field: &mut [f64]) {
        let mut side = vec![0.0; self.order.len()];
        for (x, &v) in side.iter_mut().zip(&self.order) {
            *x = self.copies * field[v as usize];
        }
        self.system.solver.solve_ordered(&mut side);
        field.fill(0.0);
        for (x, &v) in side.iter().zip(&self.order) {
            field[v as usize] = *x;
        }
    }

    /// What a unit of curvature at each of at most [`LANES`](crate::flow::solve::LANES) vertices adds to the log scale, side by side, over
    /// [`copies`](Self::copies); a row for each vertex of [`order`](Self::order).
    pub(super) fn columns(&self, vertices: &[usize], columns: &mut Vec<Row>) {
        let positions: Vec<u32> = vertices.iter().map(|&v| self.position[v]).collect();
        self.system.solver.columns(&positions, columns);
    }

    /// Integrals of [`columns`](Self::columns) over the cells around some samples.
    pub(super) fn sums(&self, columns: &[Row], samples: &Samples, sums: &mut Vec<Row>) {
        sums.clear();
        sums.resize(samples.vertices.len(), [0.0; LANES]);
        for (&v, row) in self.order.iter().zip(columns) {
            let v = v as usize;
            if let Some(sum) = sums.get_mut(samples.nearest[v] as usize) {
                add(sum, self.weight[v], row);
            }
        }
    }

    /// What the stars of all vertices add to the log scale for changes of curvature, radians.
    pub(super) fn bent(&self, change: &[f64]) -> Vec<f64> {
        let changes = change.iter().zip(&self.share).zip(&self.star);
        let bent = changes.map(|((change, share), star)| match *share > 0.0 {
            true => star.bent(change / share),
            false => 0.0,
        });
        bent.collect()
    }

    /// The log scale for which the *mesh* has the curvature `target` (one a vertex, radians), from one near it, as far as some steps with the
    /// factor of the linear picture lead. Angles are those of the Delaunay triangulation at every u, as in the flow.
    pub(super) fn corrected(&self, start: &[f64], target: &[f64]) -> Vec<f64> {
        let mut delaunay = self.delaunay.clone();
        let mut metric = Metric::flipping(&mut delaunay);
        let mut evaluation = Evaluation::default();
        // The nearest so far, the step from there, and how large it was.
        let mut nearest = start.to_vec();
        let mut step = vec![0.0; self.weight.len()];
        let (mut least, mut length) = (f64::INFINITY, 1.0);
        for _ in 0..LOOKS {
            let u: Vec<f64> = nearest
                .iter()
                .zip(&step)
                .map(|(u, s)| u + length * s)
                .collect();
            metric.evaluate(&self.on_double(&u), &mut evaluation);
            let reached = evaluation.curvature.iter().zip(target).zip(&self.share);
            let missing = reached.map(|((k, target), share)| match *share > 0.0 {
                true => target - k * share,
                false => 0.0,
            });
            let mut chord: Vec<f64> = missing.collect();
            self.solve(&mut chord);
            let size = self.variance(&chord);
            if size.is_nan() || size >= least {
                length *= 0.5;
                continue;
            }
            (nearest, step, least, length) = (u, chord, size, 1.0);
            if size < REST * REST * self.variance(&nearest) {
                nearest.iter_mut().zip(&step).for_each(|(u, s)| *u += s);
                break;
            }
        }
        nearest
    }

    /// A field of the surface on both its copies.
    fn on_double(&self, field: &[f64]) -> VertexVec<f64> {
        self.original.iter().map(|v| field[v.index()]).collect()
    }

    /// ∫ of a field over the surface, whose area is 1.
    pub(super) fn mean(&self, field: &[f64]) -> f64 {
        self.weight.iter().zip(field).map(|(w, x)| w * x).sum()
    }

    /// Variance of a field over the surface.
    pub(super) fn variance(&self, field: &[f64]) -> f64 {
        let mean = self.mean(field);
        let squares = self.weight.iter().zip(field);
        squares.map(|(w, x)| w * (x - mean) * (x - mean)).sum()
    }
}

/// Area of the surface, squared source units.
pub(super) fn total_area(mesh: &Mesh) -> f64 {
    let faces = mesh.connectivity.faces();
    faces.map(|f| triangle_area(mesh.face_positions(f))).sum()
}

/// A third of the area of the faces at each vertex, all together 1.
fn vertex_areas(mesh: &Mesh) -> Vec<f64> {
    let c = &mesh.connectivity;
    let mut weight = vec![0.0; c.vertex_count()];
    for f in c.faces() {
        let area = triangle_area(mesh.face_positions(f)) / 3.0;
        for v in c.face_vertices(f) {
            weight[v.index()] += area;
        }
    }
    let total: f64 = weight.iter().sum();
    let share = if total > 0.0 { 1.0 / total } else { 0.0 };
    weight.iter_mut().for_each(|w| *w *= share);
    weight
}
