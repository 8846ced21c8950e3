//! Newton's method for as many equations as there are cone angles and turnings, and more unknowns.
//!
//! A step is taken where it halves the norm of what is missing, or lowers it and is still on the near side of the line's zero. The first alone
//! would refuse the long way down, the second alone halves every step near the end, where rounding decides the sign.
//!
//! Where a full step leaves a tenth of the error, its factor serves for further steps as long as each leaves a tenth again: they cost a fraction of
//! one with a factor of its own. The same after the tolerance is met, as long as each halves the error. Where no step does that before it is met, and the error is
//! what rounding makes of the angles of thin faces, that is the end as well.

use super::norm::Norm;
use super::normal::Normal;
use super::state::{Problem, State};
use super::{SeamlessError, SeamlessParams, SeamlessStep};
use crate::flow::step::{FLOAT64_FLOOR, FlowStep};
use crate::geometry::ids::EdgeVec;
use crate::observe::Observer;

/// Largest range of a step in λ: beyond it the linear model means nothing.
const LARGEST_RANGE: f64 = 2.5;
/// Where there are features, so many steps one after another that are shorter than this are the end: with fewer features longer ones are possible.
const SHORT_STEPS: usize = 3;
const SHORT: f64 = 0.02;
/// The line search gives up below this step.
const SMALLEST_STEP: f64 = 1e-8;
/// Part of the square of what is missing that a step may leave and is taken whatever lies beyond.
const GOOD_SHARE: f64 = 0.25;
/// Part of the error that a step with an old factor may leave.
const FAST_SHARE: f64 = 0.1;
/// The same after the tolerance is met, where rounding sets in.
const POLISHING_SHARE: f64 = 0.5;
/// Error below which no further step is tried, radians.
const SETTLED: f64 = 1e-12;

/// When a factor serves for further steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reuse {
    /// Where they are nearly as good as Newton's.
    WhereFast,
    /// Only when the tolerance is met: Newton's method as the textbooks have it.
    #[cfg(test)]
    AtTheEnd,
}

/// Where Newton's method ended.
pub(super) struct Solution {
    pub(super) penner: EdgeVec<f64>,
    pub(super) state: State,
    pub(super) history: Vec<SeamlessStep>,
}

pub(super) fn solve(
    problem: &Problem,
    start: EdgeVec<f64>,
    norm: &Norm,
    reuse: Reuse,
    params: &SeamlessParams,
    observer: &dyn Observer,
) -> Result<Solution, SeamlessError> {
    let mut penner = start;
    let mut state = problem.evaluate(&penner);
    if let Some(edge) = state.bent {
        return Err(SeamlessError::NoLine { edge });
    }
    let mut record = SeamlessStep::default();
    let mut history = vec![record.at(&state)];
    let mut last: Option<Normal> = None;
    let mut short = 0;
    let stalled = |iterations: usize, state: &State, step: f64| SeamlessError::Stalled {
        iterations,
        max_error: state.max_error,
        tolerance: params.tolerance,
        step,
        missing: problem.missing_at(state),
    };
    while state.max_error > params.tolerance {
        if observer.cancelled() {
            return Err(SeamlessError::Cancelled);
        }
        if record.iteration >= params.max_steps {
            return Err(stalled(record.iteration, &state, record.step));
        }
        let mut normal = Normal::new(problem, &state, norm, last.take())?;
        let (direction, change) = normal.direction(problem, norm, &state.missing);
        let is_near = state.max_error <= FLOAT64_FLOOR;
        let taken =
            line_search(problem, &penner, &state, &direction, &change).filter(|(_, found, _)| {
                !is_near || found.max_error <= POLISHING_SHARE * state.max_error
            });
        let Some((next, found, step)) = taken else {
            if is_near {
                break;
            }
            return Err(stalled(record.iteration, &state, 0.0));
        };
        let is_fast = step == 1.0 && found.max_error <= FAST_SHARE * state.max_error;
        (penner, state) = (next, found);
        record.iteration += 1;
        record.step = step;
        short = if step < SHORT { short + 1 } else { 0 };
        if short >= SHORT_STEPS && !state.glued.is_empty() {
            return Err(stalled(record.iteration, &state, step));
        }
        if reuse == Reuse::WhereFast && is_fast {
            let goal = params.tolerance;
            refine(
                problem,
                &mut normal,
                norm,
                [goal, FAST_SHARE],
                &mut penner,
                &mut state,
            );
        }
        if state.max_error <= params.tolerance {
            let goal = SETTLED;
            refine(
                problem,
                &mut normal,
                norm,
                [goal, POLISHING_SHARE],
                &mut penner,
                &mut state,
            );
        }
        let now = record.at(&state);
        tracing::trace!(
            step = now.iteration,
            length = step,
            energy = now.energy,
            error = now.max_error,
            "seamless metric"
        );
        observer.flow_step(&FlowStep::from(&now));
        history.push(now);
        last = Some(normal);
    }
    let broken = state.shape.iter().filter(|s| s.broken).count();
    match broken {
        0 => Ok(Solution {
            penner,
            state,
            history,
        }),
        faces => Err(SeamlessError::BrokenFaces { faces }),
    }
}

/// Full steps with an old factor, until the error is at most `goal` or one leaves more than `share` of it.
fn refine(
    problem: &Problem,
    normal: &mut Normal,
    norm: &Norm,
    [goal, share]: [f64; 2],
    penner: &mut EdgeVec<f64>,
    state: &mut State,
) {
    while state.max_error > goal {
        let (direction, _) = normal.direction(problem, norm, &state.missing);
        let next = moved(penner, &direction, 1.0);
        let found = problem.evaluate(&next);
        let is_better = found.max_error <= share * state.max_error;
        if !is_better {
            break;
        }
        (*penner, *state) = (next, found);
    }
}

impl From<&SeamlessStep> for FlowStep {
    fn from(step: &SeamlessStep) -> Self {
        Self {
            iteration: step.iteration,
            max_error: step.max_error,
            energy: step.energy,
            step: step.step,
            flips: step.flips,
            flow_time: step.iteration as f64,
        }
    }
}

impl SeamlessStep {
    /// The line of a state.
    fn at(self, state: &State) -> Self {
        Self {
            max_error: state.max_error,
            energy: 0.5 * dot(&state.missing, &state.missing),
            flips: state.flips.len(),
            ..self
        }
    }
}

/// The first of 1, ½, ¼ … that is taken, see the module docs, with where it leads. `change`: A d, by how much the angles would change along
/// the whole direction if they were linear.
fn line_search(
    problem: &Problem,
    penner: &EdgeVec<f64>,
    state: &State,
    direction: &EdgeVec<f64>,
    change: &[f64],
) -> Option<(EdgeVec<f64>, State, f64)> {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for &d in direction.iter() {
        (low, high) = (low.min(d), high.max(d));
    }
    let range = high - low;
    if !range.is_finite() {
        return None;
    }
    let mut step = 1.0;
    while step * range > LARGEST_RANGE {
        step *= 0.5;
    }
    let before = dot(&state.missing, &state.missing);
    while step >= SMALLEST_STEP {
        let next = moved(penner, direction, step);
        let found = problem.evaluate(&next);
        let after = dot(&found.missing, &found.missing);
        let is_near = after <= before && dot(&found.missing, change) >= 0.0;
        if found.max_error.is_finite() && (after <= GOOD_SHARE * before || is_near) {
            return Some((next, found, step));
        }
        step *= 0.5;
    }
    None
}

fn moved(penner: &EdgeVec<f64>, direction: &EdgeVec<f64>, step: f64) -> EdgeVec<f64> {
    let parts = penner.iter().zip(direction.iter());
    parts.map(|(l, d)| l + step * d).collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
