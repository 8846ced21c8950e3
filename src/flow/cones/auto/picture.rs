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

use crate::flow::delaunay::Delaunay;
use crate::flow::doubled::Doubled;
use crate::flow::metric::{Evaluation, Metric};
use crate::flow::ricci::FlowError;
use crate::flow::ricci::system::{Hessian, System, Unknowns};
use crate::geometry::ids::{NONE, VertexVec};
use crate::geometry::mesh::{Mesh, triangle_area};

/// Shift of the Laplacian in the difference quotient for self-energies; the area is 1.
const SHIFT: f64 = 1e-3;

/// A surface's Laplacian, factorised, and its area.
pub(super) struct Picture {
    system: System,
    delaunay: Delaunay,
    /// Copies of the surface in the double: 1 or 2.
    copies: f64,
    /// Area of each vertex (a third of its faces), all together 1.
    pub(super) weight: Vec<f64>,
    /// ∫ g_v² over the surface, where g_v is the log scale (with mean 0) that a unit of curvature at v causes, taken from everywhere
    /// in proportion to area; where the boundary is free, taken from the boundary, and the variance of g_v.
    pub(super) self_energy: Vec<f64>,
    /// K of the surface itself, radians.
    pub(super) curvature: Vec<f64>,
}

impl Picture {
    /// Flips to the Delaunay triangulation and factorises. `is_free`: u = 0 on the boundary.
    pub(super) fn new(mesh: &Mesh, is_free: bool) -> Result<Self, FlowError> {
        let surface = &mesh.connectivity;
        let length = surface.edges().map(|e| mesh.edge_length(e)).collect();
        let doubled = Doubled::new(surface)?;
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
        let mut system = System::new(&unknowns, None)?;
        let mut laplacian = system.assemble(connectivity, &weight);
        let area = vertex_areas(mesh);
        let self_energy = self_energies(&mut system, &laplacian, &area, copies, is_free)?;
        if let (false, Some(last)) = (is_free, laplacian.diagonal.last_mut()) {
            // Where the right side adds up to 0, u = 0 at the last vertex.
            *last *= 2.0;
        }
        system.factorize(&laplacian)?;
        let half = |v| {
            if surface.is_boundary_vertex(v) {
                0.5
            } else {
                1.0
            }
        };
        let curvature = surface
            .vertices()
            .map(|v| evaluation.curvature[v] * half(v));
        Ok(Self {
            curvature: curvature.collect(),
            system,
            copies,
            weight: area,
            self_energy,
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

    /// ∫ of a field over the surface, whose area is 1.
    pub(super) fn mean(&self, field: &[f64]) -> f64 {
        self.weight.iter().zip(field).map(|(w, x)| w * x).sum()
    }

    /// Replaces a field by the density of its difference from the mean: ∂/∂u of half the variance.
    pub(super) fn centre(&self, field: &mut [f64]) {
        let mean = self.mean(field);
        for (x, w) in field.iter_mut().zip(&self.weight) {
            *x = w * (*x - mean);
        }
    }
}

/// With Δ_t = Δ + t·area, ∂/∂t Δ_t⁻¹ = −Δ_t⁻¹ area Δ_t⁻¹, whose diagonal at t = 0 is wanted. Constants add 1/t to every entry of Δ_t⁻¹
/// where they are in the kernel of Δ. The error of the difference quotient is a few [`SHIFT`] of the first eigenvalue of Δ (25 on a sphere).
fn self_energies(
    system: &mut System,
    laplacian: &Hessian,
    area: &[f64],
    copies: f64,
    is_free: bool,
) -> Result<Vec<f64>, FlowError> {
    let index = |system: &System, v: usize| {
        let i = system.unknown.as_slice()[v];
        (i != NONE).then_some(i as usize)
    };
    let mut inverse = |t: f64| -> Result<Vec<f64>, FlowError> {
        let mut shifted = laplacian.diagonal.clone();
        for (v, a) in area.iter().enumerate() {
            if let Some(i) = index(system, v) {
                shifted[i] += t * copies * a;
            }
        }
        let solver = &mut system.solver;
        solver.factorize(&shifted, &laplacian.off_diagonal)?;
        let diagonal = solver.inverse_diagonal();
        let at = |v| index(system, v).map_or(0.0, |i| copies * diagonal[i]);
        Ok((0..area.len()).map(at).collect())
    };
    if !is_free {
        let (near, far) = (inverse(SHIFT)?, inverse(2.0 * SHIFT)?);
        let constants = 0.5 / SHIFT;
        let difference = near
            .iter()
            .zip(&far)
            .map(|(a, b)| (a - b - constants) / SHIFT);
        return Ok(difference.collect());
    }
    let (far, near) = (inverse(SHIFT)?, inverse(0.0)?);
    // The factor is that of Δ now: the mean of g_v is what area answers at v.
    let mut mean = vec![0.0; system.solver.size()];
    for (v, a) in area.iter().enumerate() {
        if let Some(i) = index(system, v) {
            mean[i] = copies * a;
        }
    }
    system.solver.solve(&mut mean);
    let mean = |v| index(system, v).map_or(0.0, |i| mean[i]);
    let energies = near.iter().zip(&far).enumerate();
    Ok(energies
        .map(|(v, (a, b))| (a - b) / SHIFT - mean(v) * mean(v))
        .collect())
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
