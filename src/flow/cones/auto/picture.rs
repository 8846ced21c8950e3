//! The linear picture: log scale as a linear function of curvature.
//!
//! *Enters:* a surface's connectivity and lengths, and where curvature is prescribed. *Leaves:* log scales for curvatures, one
//! back-substitution each.
//!
//! On a smooth surface the curvature measure of the metric e^{2u} g is exactly K + Δu (Δ ≥ 0), so u = Δ⁻¹(K̄ − K) is no
//! approximation. On a mesh it is the first Newton step of vertex scaling from u = 0: Δ is the cotangent Laplacian of the
//! intrinsic Delaunay triangulation, the Hessian there. Ben-Chen, Gotsman and Bunin 2008 place cones in this picture.
//!
//! A surface with boundary is doubled, as in the flow; a field has one value a vertex of the surface. Where the boundary is free,
//! u = 0 there and curvature need not add up to anything.

use super::dot::dot;
use crate::flow::cones::error::ConeError;
use crate::flow::delaunay::Delaunay;
use crate::flow::doubled::Doubled;
use crate::flow::laplacian::{Hessian, System, Unknowns};
use crate::flow::metric::{Evaluation, Metric};
use crate::flow::scale::moved;
use crate::geometry::ids::{NONE, VertexId, VertexVec};
use crate::geometry::mesh::{Mesh, triangle_area};

/// Shift of the Laplacian in the difference quotient for self-energies; the area is 1. The relative error is the shift over the first
/// eigenvalue (about 25 for a ball, 0.1 for a needle a hundred times as long as wide) and 1e-8 of rounding.
const SHIFT: f64 = 1e-6;
/// Looks at the curvature that a log scale really has, at most.
const LOOKS: usize = 10;
/// Standard deviation of a step, relative to that of the log scale, after which the next would be far smaller.
const REST: f64 = 1e-2;

/// A surface's Laplacian, factorised, and its area.
pub(super) struct Picture {
    system: System,
    delaunay: Delaunay,
    /// Every vertex of the double as a vertex of the surface.
    original: VertexVec<VertexId>,
    /// 1 where the curvature of the double counts for one vertex of the surface, ½ on the boundary, 0 where u stays.
    share: Vec<f64>,
    /// False where u = 0, by vertices of the double.
    prescribed: VertexVec<bool>,
    /// Copies of the surface in the double: 1 or 2.
    copies: f64,
    /// Area of each vertex (a third of its faces), all together 1.
    pub(super) weight: Vec<f64>,
    /// ∫ p_v² over the surface, where p_v is what [`Picture::solve`] answers to a unit of curvature at v.
    square: Vec<f64>,
    /// K of the surface itself, radians.
    pub(super) curvature: Vec<f64>,
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
        let square = squares(&mut system, &laplacian, &area, copies)?;
        let half = |v| {
            if surface.is_boundary_vertex(v) {
                0.5
            } else {
                1.0
            }
        };
        let vertices = surface.vertices();
        let curvature = vertices.map(|v| evaluation.curvature[v] * half(v));
        let vertices = surface.vertices();
        let share = vertices.map(|v| if prescribed[v] { half(v) } else { 0.0 });
        Ok(Self {
            curvature: curvature.collect(),
            share: share.collect(),
            original,
            prescribed,
            system,
            copies,
            weight: area,
            square,
            delaunay,
        })
    }

    /// Number of vertices of the surface.
    pub(super) fn len(&self) -> usize {
        self.weight.len()
    }

    /// Replaces changes of curvature, radians, one field after another, by the changes of the log scale that they cause. Where no
    /// boundary is free each must add up to 0, and the result is determined but for a constant.
    pub(super) fn solve(&mut self, fields: &mut [f64]) {
        let n = self.len();
        let size = self.system.solver.size();
        let unknown = &self.system.unknown.as_slice()[..n];
        let mut rhs = vec![0.0; fields.len() / n.max(1) * size];
        for (field, rhs) in fields.chunks(n).zip(rhs.chunks_mut(size.max(1))) {
            for (&i, &k) in unknown.iter().zip(field) {
                if i != NONE {
                    rhs[i as usize] = self.copies * k;
                }
            }
        }
        self.system.solver.solve(&mut rhs);
        for (field, rhs) in fields.chunks_mut(n).zip(rhs.chunks(size.max(1))) {
            for (&i, u) in unknown.iter().zip(field) {
                *u = if i == NONE { 0.0 } else { rhs[i as usize] };
            }
        }
    }

    /// For every vertex the variance of the log scale that a unit of curvature there causes, taken from `sink` (adding up to 1, or empty
    /// where the boundary is free).
    ///
    /// That log scale is p_v − q with q the answer to the sink, but for a constant, so its variance is
    /// ∫ p_v² − 2 ∫ p_v q + ∫ q² − (mean p_v − mean q)². All p_v together: ∫ p_v q is what q, as a density, gets for an answer at v, and
    /// the mean of p_v what the area itself gets.
    pub(super) fn self_energies(&mut self, sink: &[f64]) -> Vec<f64> {
        let mut mean = self.weight.clone();
        self.solve(&mut mean);
        let mut q = match sink.is_empty() {
            true => vec![0.0; self.len()],
            false => sink.to_vec(),
        };
        self.solve(&mut q);
        let mean_q = self.mean(&q);
        let mut product: Vec<f64> = q.iter().zip(&self.weight).map(|(q, w)| q * w).collect();
        let square_q: f64 = q.iter().zip(&product).map(|(q, p)| q * p).sum();
        self.solve(&mut product);
        let terms = self.square.iter().zip(&product).zip(&mean);
        terms
            .map(|((square, product), mean)| {
                square - 2.0 * product + square_q - (mean - mean_q).powi(2)
            })
            .collect()
    }

    /// The log scale for which the *mesh* has the curvature `target` (one a vertex, radians), from one near it, as far as some Newton steps
    /// lead. Angles are those of the Delaunay triangulation at every u, and a step is taken when the energy fell, both as in the flow.
    pub(super) fn corrected(&mut self, start: &[f64], target: &[f64]) -> Vec<f64> {
        let of = |&v: &VertexId| (target[v.index()], self.share[v.index()]);
        let target: VertexVec<(f64, f64)> = self.original.iter().map(of).collect();
        let mut delaunay = self.delaunay.clone();
        let mut metric = Metric::flipping(&mut delaunay);
        let mut evaluation = Evaluation::default();
        // The nearest so far, with the square of what is missing there; the direction from there, and how far it is tried.
        let mut nearest = self.on_double(start);
        let mut least = f64::INFINITY;
        let mut direction = VertexVec::filled(0.0, nearest.len());
        let mut length = 1.0;
        let mut system = None;
        for _ in 0..LOOKS {
            let u = moved(&nearest, &direction, length);
            metric.evaluate(&u, &mut evaluation);
            let reached = evaluation.curvature.iter().zip(target.iter());
            let residual: VertexVec<f64> = reached
                .map(|(k, &(target, share))| if share > 0.0 { k - target / share } else { 0.0 })
                .collect();
            let error = dot(residual.as_slice(), residual.as_slice());
            let slope = dot(residual.as_slice(), direction.as_slice());
            if error.is_nan() || (slope > 0.0 && error > 0.8 * least) {
                length *= 0.5;
                continue;
            }
            (nearest, least) = (u, least.min(error));
            // The factor of the linear picture is good enough for a small step.
            let mut chord: Vec<f64> = residual
                .iter()
                .take(self.len())
                .zip(&self.share)
                .map(|(r, share)| -r * share)
                .collect();
            self.solve(&mut chord);
            let own = &nearest.as_slice()[..self.len()];
            if self.variance(&chord) < REST * REST * self.variance(own) {
                return own.iter().zip(&chord).map(|(u, step)| u + step).collect();
            }
            let unknowns = Unknowns {
                connectivity: metric.connectivity(),
                prescribed: &self.prescribed,
                shares: &self.original,
                scale_free: self.prescribed.iter().all(|&p| p),
                flips: metric.flips(),
            };
            let Ok(mut fresh) = System::new(&unknowns, system.take()) else {
                break;
            };
            let hessian = fresh.assemble(metric.connectivity(), &metric.edge_weights(&evaluation));
            let Some(next) = fresh.direction(&hessian, 0.0, &residual) else {
                break;
            };
            system = Some(fresh);
            (direction, length) = (next, 1.0);
        }
        nearest.as_slice()[..self.len()].to_vec()
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

    /// Replaces a field by the density of its difference from the mean: ∂/∂u of half the variance.
    pub(super) fn centre(&self, field: &mut [f64]) {
        let mean = self.mean(field);
        for (x, w) in field.iter_mut().zip(&self.weight) {
            *x = w * (*x - mean);
        }
    }
}

/// With M_t = M + t·area, ∂/∂t M_t⁻¹ = −M_t⁻¹ area M_t⁻¹, whose diagonal at t = 0 is wanted. M, unlike Δ, is regular. Leaves M
/// factorised.
fn squares(
    system: &mut System,
    matrix: &Hessian,
    area: &[f64],
    copies: f64,
) -> Result<Vec<f64>, ConeError> {
    let unknown: Vec<u32> = system.unknown.as_slice()[..area.len()].to_vec();
    let mut inverse = |t: f64| -> Result<Vec<f64>, ConeError> {
        let mut shifted = matrix.diagonal.clone();
        for (&i, a) in unknown.iter().zip(area).filter(|(i, _)| **i != NONE) {
            shifted[i as usize] += t * copies * a;
        }
        let solver = &mut system.solver;
        let factorized = solver.factorize(&shifted, &matrix.off_diagonal);
        factorized.map_err(ConeError::not_chosen)?;
        let diagonal = solver.inverse_diagonal();
        let at = |&i: &u32| match i {
            NONE => 0.0,
            i => copies * diagonal[i as usize],
        };
        Ok(unknown.iter().map(at).collect())
    };
    let less = inverse(SHIFT)?;
    let whole = inverse(0.0)?;
    let difference = whole.iter().zip(&less);
    Ok(difference.map(|(a, b)| (a - b) / SHIFT).collect())
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
