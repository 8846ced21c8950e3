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

pub mod error;
#[cfg(test)]
mod existence;
mod flipping;
pub mod gradient;
pub mod newton;
mod params;
#[cfg(test)]
pub(crate) mod shapes;
pub(crate) mod system;
#[cfg(test)]
mod tests;

pub use error::{FlowError, Method};
pub use params::{FlowParams, Scheme, Solver};

use crate::flow::cones::{BoundaryCondition, Prescription};
use crate::flow::feasibility::{self, Constraint};
use crate::flow::intrinsic::Intrinsic;
use crate::flow::metric::{self, Evaluation, Metric, full_angles};
use crate::flow::schemes::{ConformalStructure, Law};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, FaceId, VertexId, VertexVec};
use crate::observe::Observer;
use std::f64::consts::PI;

/// One line of the convergence record.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
pub struct FlowStep {
    /// Number of the iteration, 0 for the state before the first.
    pub iteration: usize,
    /// max |K − K̄| over the vertices that are prescribed, radians.
    pub max_error: f64,
    /// Convex energy, relative to the start.
    pub energy: f64,
    /// Step length taken to come here; 1 is a full Newton step.
    pub step: f64,
    /// Edges flipped to come here. In the first line those that make the triangulation of the surface itself Delaunay; the lines
    /// together count every flip.
    pub flips: usize,
    /// Σε for the gradient flow, the iteration for Newton.
    pub flow_time: f64,
}

/// How well a circle packing keeps the lengths in space (1).
#[derive(
    Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize, schemars::JsonSchema,
)]
pub struct PackingFit {
    /// Mean over the edges of |l − l̄| / l̄.
    pub mean_length_error: f64,
    /// Largest |l − l̄| / l̄.
    pub max_length_error: f64,
    /// Share of the edges whose Φ lies at an end of [0, π/2].
    pub clamped: f64,
}

/// A flat metric with cones, and how it was reached.
#[derive(Clone, Debug)]
pub struct FlatMetric {
    /// `u` for vertex scaling, `u − ln γ⁰` for packings, so that the lengths below follow from it and the scheme.
    pub log_scale: VertexVec<f64>,
    /// Flat length of every edge, source units: of the surface's own edges, or where there is `intrinsic`, of the edges
    /// of `intrinsic.flat`.
    pub length: EdgeVec<f64>,
    /// The triangulations that the flow with flips went through; `None` where the connectivity stayed.
    pub intrinsic: Option<Box<Intrinsic>>,
    /// Curvature reached at every vertex, radians; also where the boundary is free.
    pub curvature: VertexVec<f64>,
    /// One entry an iteration.
    pub history: Vec<FlowStep>,
    /// max |K − K̄| over the prescribed vertices, radians.
    pub max_curvature_error: f64,
    /// Fit of the packing, for circle packings that have one.
    pub fit: Option<PackingFit>,
}

/// Bound on the difference between the total of K̄ and 2πχ, radians.
pub const GAUSS_BONNET_TOLERANCE: f64 = 1e-9;
/// Most broken faces that an error lists.
const LISTED_FACES: usize = 8;

/// One flow to solve: what both solvers share.
pub(crate) struct Problem<'a> {
    metric: Metric<'a>,
    /// K̄; with the rounding of Gauss–Bonnet spread over all vertices where everything is prescribed.
    target: VertexVec<f64>,
    /// False where `u` stays (free boundary).
    prescribed: VertexVec<bool>,
    /// Vertex with whose `u` that of a vertex moves: itself, or its mirror image in a double.
    shares: VertexVec<VertexId>,
    /// True where adding a constant to `u` changes nothing.
    scale_free: bool,
    params: &'a FlowParams,
    observer: &'a dyn Observer,
}

/// Where a solver ended.
pub(crate) struct Solution {
    u: VertexVec<f64>,
    evaluation: Evaluation,
    history: Vec<FlowStep>,
}

impl Problem<'_> {
    fn unknowns(&self) -> system::Unknowns<'_> {
        system::Unknowns {
            connectivity: self.metric.connectivity(),
            prescribed: &self.prescribed,
            shares: &self.shares,
            scale_free: self.scale_free,
            flips: self.metric.flips(),
        }
    }

    /// Gradient of the energy, K − K̄, radians; 0 where `u` stays.
    fn residual(&self, evaluation: &Evaluation) -> VertexVec<f64> {
        let mut residual: VertexVec<f64> = evaluation
            .curvature
            .enumerate()
            .map(|(v, &k)| {
                if self.prescribed[v] {
                    k - self.target[v]
                } else {
                    0.0
                }
            })
            .collect();
        if self.scale_free {
            // Exactly 0 in theory; what rounding leaves must not gather at one vertex.
            let mean = residual.iter().sum::<f64>() / residual.len().max(1) as f64;
            residual.as_mut_slice().iter_mut().for_each(|r| *r -= mean);
        }
        residual
    }

    /// max |K − K̄| over the prescribed vertices, radians; infinite where some angle is no number.
    fn max_error(&self, evaluation: &Evaluation) -> f64 {
        let mut largest: f64 = 0.0;
        for (v, &k) in evaluation.curvature.enumerate() {
            if self.prescribed[v] {
                let error = (k - self.target[v]).abs();
                largest = if error.is_nan() {
                    f64::INFINITY
                } else {
                    largest.max(error)
                };
            }
        }
        largest
    }

    /// Change of energy along a straight step of `u`: ∫₀¹ Σ (K − K̄)(u + t s δ) s δ dt, by five Gauss–Legendre points on each
    /// piece that moves `u` by at most 1. `scratch` is overwritten.
    fn energy_change(
        &mut self,
        u: &VertexVec<f64>,
        direction: &VertexVec<f64>,
        step: f64,
        scratch: &mut Evaluation,
    ) -> f64 {
        let (near, far) = ((10.0_f64 / 7.0).sqrt(), 70.0_f64.sqrt());
        let inner = (5.0 - 2.0 * near).sqrt() / 6.0;
        let outer = (5.0 + 2.0 * near).sqrt() / 6.0;
        let points = [
            (0.5 - outer, (322.0 - 13.0 * far) / 1800.0),
            (0.5 - inner, (322.0 + 13.0 * far) / 1800.0),
            (0.5, 64.0 / 225.0),
            (0.5 + inner, (322.0 + 13.0 * far) / 1800.0),
            (0.5 + outer, (322.0 - 13.0 * far) / 1800.0),
        ];
        let largest = direction.iter().map(|d| d.abs()).fold(0.0, f64::max);
        let pieces = (step.abs() * largest).ceil().clamp(1.0, 32.0);
        let mut change = 0.0;
        for piece in 0..pieces as usize {
            for (t, weight) in points {
                let at = step * (piece as f64 + t) / pieces;
                self.metric.evaluate(&moved(u, direction, at), scratch);
                change += weight * step / pieces * dot(&self.residual(scratch), direction);
            }
        }
        change
    }

    /// Lets mirror images have a `u` of their own; false where all have already.
    fn separate(&mut self) -> bool {
        let vertices = self.metric.connectivity().vertices();
        let own = vertices.collect();
        std::mem::replace(&mut self.shares, own) != self.shares
    }

    fn minimise(&mut self) -> Result<Solution, FlowError> {
        match self.params.solver {
            Solver::Newton => newton::minimise(self),
            Solver::Gradient => gradient::minimise(self),
        }
    }

    fn not_converged(&self, iterations: usize, evaluation: &Evaluation) -> FlowError {
        self.failure(
            iterations,
            self.max_error(evaluation),
            &evaluation.broken_faces(),
        )
    }

    /// With flips a solution exists always: then its scales are beyond float64.
    fn out_of_range(&self, iterations: usize, range: f64, evaluation: &Evaluation) -> FlowError {
        match self.metric.may_flip() {
            true => FlowError::ScaleRange { iterations, range },
            false => self.not_converged(iterations, evaluation),
        }
    }

    /// The tolerance is met, but a further step would still change `u` by `change`.
    fn runaway(&self, iterations: usize, u: &VertexVec<f64>, change: f64) -> FlowError {
        FlowError::Runaway {
            method: self.method(None),
            iterations,
            range: newton::spread(u),
            change,
        }
    }

    fn failure(&self, iterations: usize, max_error: f64, broken: &[FaceId]) -> FlowError {
        let (most, key) = match self.params.solver {
            Solver::Newton => (self.params.max_newton_steps, "flow.max_newton_steps"),
            Solver::Gradient => (self.params.max_gradient_steps, "flow.max_gradient_steps"),
        };
        // Faces of a flipped triangulation are not those of the surface.
        let listed = match self.metric.may_flip() {
            true => 0,
            false => LISTED_FACES,
        };
        FlowError::NotConverged {
            method: self.method((iterations >= most).then_some(key)),
            iterations,
            max_error,
            tolerance: self.params.curvature_tolerance,
            broken: broken.len(),
            faces: broken.iter().copied().take(listed).collect(),
        }
    }

    fn method(&self, out_of_steps: Option<&'static str>) -> Method {
        Method {
            scheme: self.params.scheme,
            flips: self.metric.may_flip(),
            out_of_steps,
        }
    }
}

/// Dot product in the order of vertices.
fn dot(a: &VertexVec<f64>, b: &VertexVec<f64>) -> f64 {
    a.iter().zip(b.iter()).map(|(a, b)| a * b).sum()
}

pub(crate) fn moved(u: &VertexVec<f64>, direction: &VertexVec<f64>, step: f64) -> VertexVec<f64> {
    u.iter()
        .zip(direction.iter())
        .map(|(u, d)| u + step * d)
        .collect::<Vec<_>>()
        .into()
}

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
        return flipping::flow(surface, target, prescribed, params, observer);
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
    let solution = problem.minimise()?;
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
    })
}

fn shift(u: &mut VertexVec<f64>, constant: f64) {
    u.as_mut_slice().iter_mut().for_each(|u| *u += constant);
}
