//! The last digits of a flow that has arrived.
//!
//! *Enters:* a `u` within the tolerance of the target. *Leaves:* one whose error is at the floor of float64, by full Newton steps as long as
//! each at least halves the error. The layout adds up the errors of all vertices: a flow that ends at its tolerance everywhere would leave
//! central charts that do not close to the precision that is promised of them.

use super::error::FlowError;
use super::problem::Problem;
use crate::flow::laplacian::System;
use crate::flow::metric::Evaluation;
use crate::flow::scale::moved;
use crate::geometry::ids::VertexVec;

/// Quadratic convergence needs two or three.
const STEPS: usize = 8;

/// Improves `u`; `now` is its evaluation, before and after.
pub(super) fn polish(
    problem: &mut Problem,
    u: &mut VertexVec<f64>,
    now: &mut Evaluation,
) -> Result<(), FlowError> {
    let mut trial = Evaluation::default();
    for _ in 0..STEPS {
        let mut system = System::new(&problem.unknowns(), None)?;
        let weight = problem.metric.edge_weights(now);
        let hessian = system.assemble(problem.metric.connectivity(), &weight);
        let Some(direction) = system.direction(&hessian, 0.0, &problem.residual(now)) else {
            break;
        };
        let next = moved(u, &direction, 1.0);
        let before = problem.max_error(now);
        problem.metric.evaluate(&next, &mut trial);
        // NaN is no progress either.
        let is_better = problem.max_error(&trial) <= 0.5 * before;
        if !is_better {
            // The trial may have flipped edges.
            problem.metric.evaluate(u, now);
            break;
        }
        *u = next;
        std::mem::swap(now, &mut trial);
    }
    Ok(())
}
