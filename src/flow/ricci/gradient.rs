//! The flow (7) itself, by the iteration (8) (tutorial 3.3, 4.2).
//!
//! (8) multiplies γ by 1 + ε (K̄ − K); here γ is multiplied by e^{ε (K̄ − K)}, that is u by the explicit Euler step
//! u ← u + ε (K̄ − K). Both agree to first order in ε, this one keeps γ positive for any ε, and it is the gradient
//! descent of the energy, so that its stability follows from the Hessian: with λ its largest eigenvalue
//! any ε < 2/λ is stable. Gershgorin bounds λ by max (H_ii + Σ |H_ij|), measured anew at every step; ε is 0.95 of the
//! stable one. Near the end H hardly moves, ε is constant, and the error decays like e^{−λ₁ t} with λ₁ the
//! smallest positive eigenvalue: the straight line of Fig. 7. Where a step still raises the
//! residual's norm (H changed much on the way) ε is halved.
//!
//! Step 6 of 4.2, Π γ = const, is the subtraction of the mean of u − u⁰; nothing is normalised on a free boundary.
//!
//! A flow converges (Definition 18) when K *and* γ do. |K − K̄| ≤ tolerance alone leaves u off by that over λ₁, which
//! is large on large meshes. With λ₁ measured from the decay, the flow goes on until the remaining way in u is
//! below `REMAINING_CHANGE`, or until rounding stops the decay. What is left then is taken by some steps of Newton (`polish`), which are not in the record.

use super::error::FlowError;
use super::polish::polish;
use super::problem::{Problem, Solution};
use crate::flow::metric::Evaluation;
use crate::flow::scale::{dot, shift};
use crate::flow::step::FlowStep;
use crate::geometry::ids::VertexVec;

/// ε relative to the largest stable one.
const STABLE_SHARE: f64 = 0.95;
/// Bound on the distance in u that is left when the flow ends.
const REMAINING_CHANGE: f64 = 1e-8;
/// Change of u above which a step's energy takes more than its ends.
const LONG_STEP: f64 = 0.05;
/// Steps over which the rate of decay is measured.
const RATE_WINDOW: usize = 64;
/// Longest record. When it is full, every second line is dropped and from then on half as many are kept; the first
/// and the last are always there.
const LONGEST_RECORD: usize = 4096;

/// A record of bounded length whose lines are equally spaced in steps.
///
/// Until it is finished, `flips` of a line counts all flips so far: those of a dropped line then belong to the next.
struct Record {
    lines: Vec<FlowStep>,
    stride: usize,
}

impl Record {
    fn push(&mut self, mut line: FlowStep, flips: usize) {
        line.flips = flips;
        if !line.iteration.is_multiple_of(self.stride) {
            return;
        }
        if self.lines.len() == LONGEST_RECORD {
            self.stride *= 2;
            let stride = self.stride;
            self.lines.retain(|l| l.iteration.is_multiple_of(stride));
        }
        if line.iteration.is_multiple_of(self.stride) {
            self.lines.push(line);
        }
    }

    fn finish(mut self, mut last: FlowStep, flips: usize) -> Vec<FlowStep> {
        if self.lines.last().map(|l| l.iteration) != Some(last.iteration) {
            last.flips = flips;
            self.lines.push(last);
        }
        let mut before = 0;
        for line in &mut self.lines {
            (before, line.flips) = (line.flips, line.flips - before);
        }
        self.lines
    }
}

pub(crate) fn minimise(problem: &mut Problem) -> Result<Solution, FlowError> {
    let params = problem.params;
    let mut u = problem.metric.start();
    let start_mean = mean(&u);
    let (mut now, mut trial) = (Evaluation::default(), Evaluation::default());
    problem.metric.evaluate(&u, &mut now);
    let mut line = FlowStep {
        max_error: problem.max_error(&now),
        flips: problem.metric.flips(),
        ..FlowStep::default()
    };
    let mut flips = problem.metric.flips();
    let mut record = Record {
        lines: Vec::new(),
        stride: 1,
    };
    record.push(line, flips);
    problem.observer.flow_step(&line);
    let mut residual = problem.residual(&now);
    let mut weight = problem.metric.edge_weights(&now);
    // Time and error at the last multiple of the window, and the rate measured there.
    let (mut window, mut rate) = ((0.0, line.max_error), None);
    let mut cut = 1.0;
    loop {
        if problem.observer.cancelled() {
            return Err(FlowError::Cancelled);
        }
        if line.max_error <= params.curvature_tolerance {
            let arrived = rate.is_some_and(|r: f64| line.max_error <= REMAINING_CHANGE * r);
            let stuck = rate.is_some_and(|r: f64| r <= 0.0);
            if arrived || stuck || line.max_error == 0.0 {
                break;
            }
        }
        if line.iteration >= params.max_gradient_steps {
            if line.max_error <= params.curvature_tolerance {
                break;
            }
            return Err(problem.not_converged(line.iteration, &now));
        }
        let bound = problem
            .metric
            .diagonal(&weight)
            .enumerate()
            .filter(|(v, _)| problem.prescribed[*v])
            .map(|(_, [diagonal, row])| diagonal.abs() + row)
            .fold(f64::MIN_POSITIVE, f64::max);
        let norm = dot(&residual, &residual);
        let (epsilon, next, next_residual) = loop {
            let epsilon = cut * STABLE_SHARE * 2.0 / bound;
            let mut next: VertexVec<f64> = u
                .iter()
                .zip(residual.iter())
                .map(|(u, r)| u - epsilon * r)
                .collect::<Vec<_>>()
                .into();
            if problem.scale_free {
                let constant = start_mean - mean(&next);
                shift(&mut next, constant);
            }
            problem.metric.evaluate(&next, &mut trial);
            let next_residual = problem.residual(&trial);
            // At the floor of rounding the norm may rise a little without harm. NaN is no descent.
            let next_norm = dot(&next_residual, &next_residual);
            let falls = next_norm <= norm * (1.0 + 1e-9)
                || problem.max_error(&trial) <= params.curvature_tolerance;
            if falls {
                break (epsilon, next, next_residual);
            }
            cut *= 0.5;
            if cut < 1e-12 {
                return Err(problem.not_converged(line.iteration, &now));
            }
        };
        cut = (2.0 * cut).min(1.0);
        let next_weight = problem.metric.edge_weights(&trial);
        let largest = residual.iter().map(|r| r.abs()).fold(0.0, f64::max);
        line.energy += if problem.metric.may_flip() {
            // The old weights belong to a triangulation that may be gone.
            -0.5 * epsilon * (norm + dot(&residual, &next_residual))
        } else if epsilon * largest > LONG_STEP {
            problem.energy_change(&u, &residual, -epsilon, &mut now)
        } else {
            // ∫ (K − K̄) du along δ = −ε (K − K̄) by the corrected trapezoid, whose error is of fifth order in ε: ends of the
            // directional derivative, and of its own derivative δᵀHδ.
            let bend = dot(&residual, &problem.metric.apply_hessian(&weight, &residual))
                - dot(
                    &residual,
                    &problem.metric.apply_hessian(&next_weight, &residual),
                );
            -0.5 * epsilon * (norm + dot(&residual, &next_residual))
                + epsilon * epsilon / 12.0 * bend
        };
        u = next;
        residual = next_residual;
        weight = next_weight;
        std::mem::swap(&mut now, &mut trial);
        line.iteration += 1;
        line.max_error = problem.max_error(&now);
        line.step = epsilon;
        line.flow_time += epsilon;
        line.flips = problem.metric.flips() - flips;
        flips = problem.metric.flips();
        record.push(line, flips);
        problem.observer.flow_step(&line);
        if line.iteration.is_multiple_of(RATE_WINDOW) {
            rate = Some((window.1 / line.max_error).ln() / (line.flow_time - window.0));
            window = (line.flow_time, line.max_error);
        }
    }
    polish(problem, &mut u, &mut now)?;
    if problem.scale_free {
        let constant = start_mean - mean(&u);
        shift(&mut u, constant);
        problem.metric.evaluate(&u, &mut now);
    }
    if now.shape.iter().any(|s| s.broken) {
        return Err(problem.not_converged(line.iteration, &now));
    }
    Ok(Solution {
        u,
        evaluation: now,
        history: record.finish(line, problem.metric.flips()),
    })
}

fn mean(u: &VertexVec<f64>) -> f64 {
    u.iter().sum::<f64>() / u.len().max(1) as f64
}
