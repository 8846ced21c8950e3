//! One flow to solve: what both solvers share, and how each of them fails.

use super::error::{FlowError, Method};
use super::params::{FlowParams, Solver};
use crate::flow::laplacian::Unknowns;
use crate::flow::metric::{Evaluation, Metric};
use crate::flow::scale::{dot, moved, spread};
use crate::flow::step::FlowStep;
use crate::geometry::ids::{FaceId, VertexId, VertexVec};
use crate::observe::Observer;

/// Most broken faces that an error lists.
const LISTED_FACES: usize = 8;

/// One flow to solve: what both solvers share.
pub(crate) struct Problem<'a> {
    pub(super) metric: Metric<'a>,
    /// K̄; with the rounding of Gauss–Bonnet spread over all vertices where everything is prescribed.
    pub(super) target: VertexVec<f64>,
    /// False where `u` stays (free boundary).
    pub(super) prescribed: VertexVec<bool>,
    /// Vertex with whose `u` that of a vertex moves: itself, or its mirror image in a double.
    pub(super) shares: VertexVec<VertexId>,
    /// True where adding a constant to `u` changes nothing.
    pub(super) scale_free: bool,
    pub(super) params: &'a FlowParams,
    pub(super) observer: &'a dyn Observer,
}

/// Where a solver ended.
pub(crate) struct Solution {
    pub(super) u: VertexVec<f64>,
    pub(super) evaluation: Evaluation,
    pub(super) history: Vec<FlowStep>,
}

impl Problem<'_> {
    pub(super) fn unknowns(&self) -> Unknowns<'_> {
        Unknowns {
            connectivity: self.metric.connectivity(),
            prescribed: &self.prescribed,
            shares: &self.shares,
            scale_free: self.scale_free,
            flips: self.metric.flips(),
        }
    }

    /// Gradient of the energy, K − K̄, radians; 0 where `u` stays.
    pub(super) fn residual(&self, evaluation: &Evaluation) -> VertexVec<f64> {
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
    pub(super) fn max_error(&self, evaluation: &Evaluation) -> f64 {
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
    pub(super) fn energy_change(
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
    pub(super) fn separate(&mut self) -> bool {
        let vertices = self.metric.connectivity().vertices();
        let own = vertices.collect();
        std::mem::replace(&mut self.shares, own) != self.shares
    }

    pub(super) fn not_converged(&self, iterations: usize, evaluation: &Evaluation) -> FlowError {
        self.failure(
            iterations,
            self.max_error(evaluation),
            &evaluation.broken_faces(),
        )
    }

    /// With flips a solution exists always: then its scales are beyond float64.
    pub(super) fn out_of_range(
        &self,
        iterations: usize,
        range: f64,
        evaluation: &Evaluation,
    ) -> FlowError {
        match self.metric.may_flip() {
            true => FlowError::ScaleRange { iterations, range },
            false => self.not_converged(iterations, evaluation),
        }
    }

    /// The tolerance is met, but a further step would still change `u` by `change`.
    pub(super) fn runaway(&self, iterations: usize, u: &VertexVec<f64>, change: f64) -> FlowError {
        FlowError::Runaway {
            method: self.method(None),
            iterations,
            range: spread(u),
            change,
        }
    }

    pub(super) fn failure(
        &self,
        iterations: usize,
        max_error: f64,
        broken: &[FaceId],
    ) -> FlowError {
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

    pub(super) fn method(&self, out_of_steps: Option<&'static str>) -> Method {
        Method {
            scheme: self.params.scheme,
            flips: self.metric.may_flip(),
            out_of_steps,
        }
    }
}
