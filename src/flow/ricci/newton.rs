//! Newton with a line search on the convex energy (tutorial 3.4).
//!
//! Each step solves (Hessian) δ = K̄ − K. Where a constant may be added to `u`, one vertex is left out of
//! the system, which removes the kernel without spoiling sparsity; a free boundary is left out whole. A vertex of a double and
//! its mirror image are one unknown, so `u` is symmetric exactly, unless rounding alone keeps the error above the tolerance: then they become
//! two, and `u` is symmetric up to that rounding.
//!
//! With flips every evaluation is on the Delaunay triangulation at its `u`; the energy is convex and twice continuously
//! differentiable across flips, so nothing else changes. Flips of a rejected trial stay: the next trial undoes them where it must.
//!
//! A step of length s is taken when the directional derivative Σ (K − K̄) δ at its end is still ≤ 0, so the energy fell by
//! convexity, *or* when ‖K − K̄‖₂ fell a tenth below the least so far. The second can happen only so often before the
//! norm is 0, and in between the energy falls: the iteration cannot cycle. Insisting on the sign alone halves every step near
//! the minimum, where rounding decides it, and turns quadratic convergence into a factor of ½ a step.
//!
//! After the tolerance is met, full steps are taken as long as each at least halves the error: they are cheap, and
//! the layout profits from curvatures at the floor of float64.

use super::error::FlowError;
use super::problem::{Problem, Solution};
use crate::flow::laplacian::System;
use crate::flow::metric::Evaluation;
use crate::flow::scale::{dot, moved, spread};
use crate::flow::step::{FLOAT64_FLOOR, FlowStep};
use crate::geometry::ids::VertexVec;

/// Largest change of `u` tried in one step: e^20 in scale. Beyond it the quadratic model means nothing.
const LARGEST_CHANGE: f64 = 20.0;
/// Largest range of `u`: beyond it lengths leave float64, and `u` runs away from a minimum that does not exist.
const LARGEST_RANGE: f64 = 600.0;
/// Change of `u` in one step below which an error that no longer falls is one of symmetry: rounding in flips is not symmetric, in the
/// thinnest faces that is more than the tolerance, and only a `u` that is not quite symmetric either meets it.
const SYMMETRY_FLOOR: f64 = 1e-9;
/// The line search gives up below this step.
const SMALLEST_STEP: f64 = 1e-10;
/// Error below which no further step is tried with flips, radians. There a solution exists always, so the last step need not be
/// watched for scales that run away.
const SETTLED: f64 = 1e-13;
/// Largest number of steps after the tolerance is met.
const POLISHING_STEPS: usize = 8;
/// Largest difference in what a step would still add to `u` at the end. A packing that (6) rules out by equality has curvatures
/// that reach the target only as `u` runs away, one unit a Newton step, until rounding takes it for converged.
const REMAINING_CHANGE: f64 = 0.1;
/// Shifts of the diagonal, relative to the largest row, tried in turn until a direction leads down. The first is the rule;
/// the others are for Hessians that are only semidefinite, or nearly so (all faces of a vertex broken).
const SHIFTS: [f64; 7] = [0.0, 1e-14, 1e-11, 1e-8, 1e-5, 1e-3, 1e-1];

pub(crate) fn minimise(problem: &mut Problem) -> Result<Solution, FlowError> {
    let params = problem.params;
    let mut u = problem.metric.start();
    // At the `u` that was looked at last: one for all, since it is a large part of what a flow holds.
    let mut now = Evaluation::default();
    // Of the quadrature, without flips.
    let mut scratch = Evaluation::default();
    problem.metric.evaluate(&u, &mut now);
    let mut system = System::new(&problem.unknowns(), None)?;
    let mut weight = problem.metric.edge_weights(&now);
    let mut residual = problem.residual(&now);
    let mut record = FlowStep {
        max_error: problem.max_error(&now),
        flips: problem.metric.flips(),
        ..FlowStep::default()
    };
    let mut history = vec![record];
    problem.observer.flow_step(&record);
    let mut polished = 0;
    let mut remaining: f64 = 0.0;
    let mut least = f64::INFINITY;
    loop {
        if problem.observer.cancelled() {
            return Err(FlowError::Cancelled);
        }
        let converged = record.max_error <= params.curvature_tolerance;
        let settled = problem.metric.may_flip() && record.max_error <= SETTLED;
        if converged && (settled || polished == POLISHING_STEPS) {
            break;
        }
        // Near the end a full step either lowers the error or rounding is the limit.
        let near = converged || record.max_error <= FLOAT64_FLOOR;
        if !converged && record.iteration >= params.max_newton_steps {
            if near {
                break;
            }
            return Err(problem.not_converged(record.iteration, &now));
        }
        let range = spread(&problem.metric.total(&u));
        if !converged && range > LARGEST_RANGE {
            return Err(problem.out_of_range(record.iteration, range, &now));
        }
        if system.flips != problem.metric.flips() {
            system = System::new(&problem.unknowns(), Some(system))?;
        }
        // Of no use any more where the factor needs the memory.
        let weight_now = std::mem::take(&mut weight);
        let hessian = system.assemble(problem.metric.connectivity(), &weight_now);
        drop(weight_now);
        least = least.min(dot(&residual, &residual).sqrt());
        let taken = if near {
            polished += 1;
            let falls = if converged { 0.5 } else { 1.0 };
            let direction = SHIFTS[..3]
                .iter()
                .find_map(|&shift| system.direction(&hessian, shift, &residual));
            remaining = direction.as_ref().map_or(f64::INFINITY, spread);
            direction
                .filter(|direction| {
                    let next = moved(&u, direction, 1.0);
                    problem.metric.evaluate(&next, &mut now);
                    problem.max_error(&now) < falls * record.max_error
                })
                .map(|direction| (direction, 1.0))
        } else {
            SHIFTS.iter().find_map(|&shift| {
                let direction = system.direction(&hessian, shift, &residual)?;
                let step = line_search(problem, &u, &direction, &residual, least, &mut now)?;
                Some((direction, step))
            })
        };
        let Some((direction, step)) = taken else {
            // The last trial may have flipped edges: `u` is measured anew on them.
            problem.metric.evaluate(&u, &mut now);
            if !converged && problem.separate() {
                weight = problem.metric.edge_weights(&now);
                residual = problem.residual(&now);
                record.max_error = problem.max_error(&now);
                drop(system);
                system = System::new(&problem.unknowns(), None)?;
                polished = 0;
                continue;
            }
            if near {
                break;
            }
            return Err(problem.not_converged(record.iteration, &now));
        };
        weight = problem.metric.edge_weights(&now);
        let next_residual = problem.residual(&now);
        record.energy += if problem.metric.may_flip() {
            // ∫ (K − K̄) du by the corrected trapezoid: the directional derivative at both ends, and its own derivative δᵀHδ,
            // which is minus the directional derivative at the start because δ solves the system.
            let (slope, next_slope) = (dot(&residual, &direction), dot(&next_residual, &direction));
            let next_bend = dot(
                &direction,
                &problem.metric.apply_hessian(&weight, &direction),
            );
            0.5 * step * (slope + next_slope) - step * step / 12.0 * (slope + next_bend)
        } else {
            problem.energy_change(&u, &direction, step, &mut scratch)
        };
        u = moved(&u, &direction, step);
        problem.metric.rebase(&mut u);
        residual = next_residual;
        let last_error = record.max_error;
        record.iteration += 1;
        record.max_error = problem.max_error(&now);
        record.step = step;
        record.flow_time = record.iteration as f64;
        record.flips = problem.metric.flips() - history.iter().map(|s| s.flips).sum::<usize>();
        history.push(record);
        problem.observer.flow_step(&record);
        let symmetric_floor = record.max_error > params.curvature_tolerance
            && record.max_error > 0.5 * last_error
            && spread(&direction) < SYMMETRY_FLOOR;
        if symmetric_floor && problem.separate() {
            drop(system);
            system = System::new(&problem.unknowns(), None)?;
            polished = 0;
        }
    }
    if now.shape.iter().any(|s| s.broken) {
        return Err(problem.not_converged(record.iteration, &now));
    }
    if remaining > REMAINING_CHANGE {
        let total = problem.metric.total(&u);
        return Err(problem.runaway(record.iteration, &total, remaining));
    }
    Ok(Solution {
        u: problem.metric.total(&u),
        evaluation: now,
        history,
    })
}

/// The first of 1, ½, ¼ … that is accepted (see the module docs), with its evaluation in `trial`. `least` is the least ‖K − K̄‖₂
/// of all iterates so far.
fn line_search(
    problem: &mut Problem,
    u: &VertexVec<f64>,
    direction: &VertexVec<f64>,
    residual: &VertexVec<f64>,
    least: f64,
    trial: &mut Evaluation,
) -> Option<f64> {
    let largest = direction.iter().map(|d| d.abs()).fold(0.0, f64::max);
    if !largest.is_finite() || dot(residual, direction) >= 0.0 {
        return None;
    }
    let mut step = (LARGEST_CHANGE / largest).min(1.0);
    while step >= SMALLEST_STEP {
        problem.metric.evaluate(&moved(u, direction, step), trial);
        let next = problem.residual(trial);
        if dot(&next, direction) <= 0.0 || dot(&next, &next).sqrt() <= 0.9 * least {
            return Some(step);
        }
        step *= 0.5;
    }
    None
}
