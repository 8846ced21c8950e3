//! Vertex scaling with flips, from the base mesh A to the final triangulation C (method 2, "Flips").
//!
//! *Enters:* connectivity A and its lengths, curvatures. *Leaves:* a [`FlatMetric`] with the three triangulations and the
//! correspondences between them. *Guaranteed:* in exact arithmetic a solution for every prescription that meets Gauss–Bonnet with
//! positive cone angles (Gu, Luo, Sun, Wu 2018; Springborn 2019); on a surface with boundary `u` is symmetric.
//! *Not guaranteed:* more than float64 holds: where rounding stops the flow above the tolerance, the achieved error is stated.
//!
//! A surface with boundary is doubled. A boundary vertex of curvature K̄ becomes an interior one of 2K̄; a free boundary keeps u = 0 there.

use super::{FlatMetric, FlowError, FlowParams, Problem, Solution, shift};
use crate::flow::correspondence::Correspondence;
use crate::flow::delaunay::Delaunay;
use crate::flow::doubled::Doubled;
use crate::flow::intrinsic::Intrinsic;
use crate::flow::metric::{self, Metric};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, VertexVec};
use crate::observe::Observer;

/// What flows.
pub(super) struct Surface<'a> {
    pub(super) connectivity: &'a Connectivity,
    pub(super) source_length: &'a EdgeVec<f64>,
}

/// `target` and `prescribed` as in [`Problem`], by vertices of the surface.
pub(super) fn flow(
    surface: Surface,
    target: VertexVec<f64>,
    prescribed: VertexVec<bool>,
    params: &FlowParams,
    observer: &dyn Observer,
) -> Result<FlatMetric, FlowError> {
    let doubled = Doubled::new(surface.connectivity)?;
    let base_length = doubled.on_both(surface.connectivity, surface.source_length);
    let Doubled {
        connectivity: base,
        original,
    } = doubled;
    // A to B: the surface stays, so this fixes its conformal class and not that of its accidental edges.
    let identity = Correspondence::identity(&base);
    let mut delaunay = Delaunay::new(base.clone(), &base_length, vec![identity]);
    delaunay.flip_in_the_surface();
    let b = delaunay.connectivity.clone();
    let delaunay_length = exponential(&delaunay.log_lengths());
    let base_on_delaunay = delaunay.correspondences[0].clone();
    // B to C.
    delaunay.correspondences.push(Correspondence::identity(&b));
    let on_boundary = |v| surface.connectivity.is_boundary_vertex(v);
    let mut problem = Problem {
        metric: Metric::flipping(delaunay),
        target: original
            .iter()
            .map(|&v| target[v] * if on_boundary(v) { 2.0 } else { 1.0 })
            .collect(),
        scale_free: prescribed.iter().all(|&p| p),
        prescribed: original.iter().map(|&v| prescribed[v]).collect(),
        shares: original.clone(),
        params,
        observer,
    };
    let Solution {
        mut u,
        evaluation,
        mut history,
    } = problem.minimise()?;
    // A trial that was rejected last may have flipped edges too, and no line has counted them.
    let counted: usize = history.iter().map(|step| step.flips).sum();
    if let Some(last) = history.last_mut() {
        last.flips += problem.metric.flips() - counted;
    }
    let max_curvature_error = problem.max_error(&evaluation);
    let scale_free = problem.scale_free;
    // The solvers return a metric of the kind they were given.
    let Some(mut delaunay) = problem.metric.into_delaunay() else {
        return Err(FlowError::Cancelled);
    };
    // Newton has taken u into the lengths, the gradient flow has not.
    let rest = u.iter().zip(delaunay.scale().iter()).map(|(u, s)| u - s);
    let mut rest: VertexVec<f64> = rest.collect();
    if scale_free {
        let largest = u.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        shift(&mut rest, -largest);
        delaunay.rebase(&rest);
        let flat = metric::total_area(
            &delaunay.connectivity,
            &exponential(&delaunay.log_lengths()),
        );
        let source = metric::total_area(&base, &base_length);
        let constant = 0.5 * (source / flat).ln();
        let constant = if constant.is_finite() { constant } else { 0.0 };
        rest.as_mut_slice().fill(constant);
        shift(&mut u, constant - largest);
    }
    delaunay.rebase(&rest);
    let (length, c) = (delaunay.log_lengths(), &delaunay.connectivity);
    let penner = length.enumerate().map(|(e, l)| {
        let [i, j] = c.edge_vertices(e);
        l - 0.5 * (u[i] + u[j])
    });
    let penner: EdgeVec<f64> = penner.collect();
    let own = surface.connectivity.vertex_count();
    let curvature = evaluation.curvature.enumerate().take(own);
    let curvature = curvature
        .map(|(v, k)| k * if on_boundary(v) { 0.5 } else { 1.0 })
        .collect();
    let (Some(delaunay_on_flat), Some(base_on_flat)) = (
        delaunay.correspondences.pop(),
        delaunay.correspondences.pop(),
    ) else {
        return Err(FlowError::Cancelled);
    };
    Ok(FlatMetric {
        log_scale: u.as_slice()[..own].to_vec().into(),
        length: exponential(&length),
        curvature,
        history,
        max_curvature_error,
        fit: None,
        intrinsic: Some(Box::new(Intrinsic {
            base,
            base_length,
            front_faces: surface.connectivity.face_count(),
            delaunay: b,
            delaunay_length,
            flat: delaunay.connectivity,
            penner,
            u,
            base_on_delaunay,
            delaunay_on_flat,
            base_on_flat,
        })),
    })
}

fn exponential(values: &EdgeVec<f64>) -> EdgeVec<f64> {
    values.iter().map(|l| l.exp()).collect()
}
