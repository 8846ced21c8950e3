//! The flow: from target curvatures to a flat cone metric (tutorial 3.3, 3.4, 4.2). Never sees positions.
//!
//! *Enters:* connectivity, source lengths, prescription. *Leaves:* a [`FlatMetric`] and how it was reached.
//!
//! The energy f(u) = ∫ Σ (K_i − K̄_i) du_i of 3.4 is convex and has gradient K − K̄: [`newton`] minimises it with its
//! Hessian, [`gradient`] follows the flow (7). Where every vertex is prescribed, adding a constant to `u` changes nothing;
//! the constant is chosen so that the flat area is the source area. Where the boundary is free, `u` keeps its start
//! there and nothing is normalised (5.2).
//!
//! *Guaranteed:* max |K − K̄| within the tolerance, every face a triangle in float64, or an error. Vertex scaling with flips, the
//! default, has a solution for every prescription that meets Gauss–Bonnet with positive cone angles, as far as float64 reaches.
//! *Not guaranteed:* that another scheme has one. A packing that exists (6) is always found; vertex scaling and inversive distance on
//! a fixed connectivity may have none, and then the extended energy may even reach the tolerance with broken
//! faces: that ends in [`FlowError::NotConverged`], never in a metric.

mod along_features;
pub mod error;
#[cfg(test)]
mod existence;
mod flat_metric;
mod flipping;
pub mod gradient;
mod minimise;
pub mod newton;
mod params;
mod polish;
mod problem;
mod quarter_turns;
mod seamless_metric;
#[cfg(test)]
pub(crate) mod shapes;
#[cfg(test)]
mod tests;

pub use crate::flow::packing::PackingFit;
pub use crate::flow::schemes::Scheme;
pub use crate::flow::step::FlowStep;
pub use error::{FlowError, Method};
pub use flat_metric::{FlatMetric, QuarterTurns};
pub use params::{FlowParams, Holonomy, Solver};

use crate::flow::feasibility::{self, Constraint};
use crate::flow::metric::{self, Metric, full_angles};
use crate::flow::prescription::{BoundaryCondition, GAUSS_BONNET_TOLERANCE, Prescription};
use crate::flow::scale::shift;
use crate::flow::schemes::{ConformalStructure, Law};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, VertexVec};
use crate::observe::Observer;
use minimise::minimise;
use problem::{Problem, Solution};
use std::f64::consts::PI;

/// Flows to the prescribed curvature; see the module docs.
///
/// `source_length`: one an edge, source units. Errors name the edge, vertex, ring or faces at fault.
pub fn flow(
    connectivity: &Connectivity,
    source_length: &EdgeVec<f64>,
    prescription: &Prescription,
    params: &FlowParams,
    observer: &dyn Observer,
) -> Result<FlatMetric, FlowError> {
    check_input(connectivity, source_length, prescription)?;
    params.check()?;
    let free = prescription.boundary == BoundaryCondition::Free;
    let prescribed: VertexVec<bool> = connectivity
        .vertices()
        .map(|v| !(free && connectivity.is_boundary_vertex(v)))
        .collect();
    let scale_free = prescribed.iter().all(|&p| p);
    let mut target = prescription.target.clone();
    if scale_free {
        let required = required_total(connectivity);
        let prescribed: f64 = target.iter().sum();
        if (prescribed - required).abs() > GAUSS_BONNET_TOLERANCE {
            return Err(FlowError::GaussBonnet {
                prescribed,
                required,
            });
        }
        let share = (required - prescribed) / target.len().max(1) as f64;
        target.as_mut_slice().iter_mut().for_each(|k| *k += share);
    }
    if params.flips() {
        let surface = flipping::Surface {
            connectivity,
            source_length,
        };
        return match params.holonomy {
            Holonomy::Free => flipping::flow(surface, target, prescribed, params, observer),
            Holonomy::QuarterTurns => quarter_turns::flow(surface, prescription, params, observer),
        };
    }
    let structure = ConformalStructure::new(params.scheme, connectivity, source_length)?;
    let phi: Option<EdgeVec<f64>> = match (params.scheme, &structure.law) {
        (Scheme::Thurston, Law::Packing(cos_phi)) => {
            Some(cos_phi.iter().map(|c| c.acos()).collect())
        }
        _ => None,
    };
    if phi.is_some() || params.scheme == Scheme::Tangential {
        let boundary = prescription.boundary;
        // As it was given: the shares of Gauss–Bonnet's rounding would blur what are multiples of π.
        let given = &prescription.target;
        let mut constraint = Constraint::new(connectivity, phi.as_ref(), given, boundary, 1.0);
        feasibility::check(&mut constraint)?;
    }
    let mut problem = Problem {
        metric: Metric::new(connectivity, &structure),
        target,
        prescribed,
        shares: connectivity.vertices().collect(),
        scale_free,
        params,
        observer,
    };
    let solution = minimise(&mut problem)?;
    finish(
        &problem,
        &structure,
        source_length,
        &prescription.target,
        solution,
    )
}

/// 2πχ, radians.
fn required_total(connectivity: &Connectivity) -> f64 {
    2.0 * PI * connectivity.topology().euler_characteristic as f64
}

fn check_input(
    connectivity: &Connectivity,
    source_length: &EdgeVec<f64>,
    prescription: &Prescription,
) -> Result<(), FlowError> {
    let counts = [
        ("lengths", source_length.len(), connectivity.edge_count()),
        (
            "curvatures",
            prescription.target.len(),
            connectivity.vertex_count(),
        ),
    ];
    for (what, given, needed) in counts {
        if given != needed {
            return Err(FlowError::Count {
                what,
                given,
                needed,
            });
        }
    }
    for (edge, &length) in source_length.enumerate() {
        if !(length.is_finite() && length > 0.0) {
            return Err(FlowError::BadLength {
                edge,
                vertices: connectivity.edge_vertices(edge),
                length,
            });
        }
    }
    let full = full_angles(connectivity);
    let free = prescription.boundary == BoundaryCondition::Free;
    for (vertex, &curvature) in prescription.target.enumerate() {
        let ignored = free && connectivity.is_boundary_vertex(vertex);
        let bound = full[vertex];
        let positive_angle = curvature.is_finite() && curvature < bound;
        if !(ignored || positive_angle) {
            return Err(FlowError::BadTarget {
                vertex,
                curvature,
                bound,
            });
        }
    }
    Ok(())
}

/// Chooses the constant, computes the lengths, and checks them.
fn finish(
    problem: &Problem,
    structure: &ConformalStructure,
    source_length: &EdgeVec<f64>,
    target: &VertexVec<f64>,
    solution: Solution,
) -> Result<FlatMetric, FlowError> {
    let Solution {
        mut u,
        evaluation,
        history,
    } = solution;
    let connectivity = problem.metric.connectivity();
    let iterations = history.last().map_or(0, |s| s.iteration);
    let mut max_curvature_error: f64 = 0.0;
    for (v, &k) in evaluation.curvature.enumerate() {
        if problem.prescribed[v] {
            max_curvature_error = max_curvature_error.max((k - target[v]).abs());
        }
    }
    if problem.scale_free {
        let largest = u.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        shift(&mut u, -largest);
        let flat = metric::total_area(connectivity, &structure.lengths(connectivity, &u));
        let source = metric::total_area(connectivity, source_length);
        let constant = 0.5 * (source / flat).ln();
        if constant.is_finite() {
            shift(&mut u, constant);
        }
    }
    let length = structure.lengths(connectivity, &u);
    let broken = metric::broken_faces(connectivity, &length);
    if !broken.is_empty() {
        return Err(problem.failure(iterations, max_curvature_error, &broken));
    }
    let log_scale = u
        .iter()
        .zip(structure.start.iter())
        .map(|(u, start)| u - start)
        .collect::<Vec<_>>()
        .into();
    Ok(FlatMetric {
        log_scale,
        length,
        intrinsic: None,
        curvature: evaluation.curvature,
        history,
        max_curvature_error,
        fit: structure.fit,
        opened: None,
        quarter_turns: None,
    })
}
