//! The solver that was asked for.

use super::error::FlowError;
use super::params::Solver;
use super::problem::{Problem, Solution};
use super::{gradient, newton};

/// The minimum of the energy.
pub(super) fn minimise(problem: &mut Problem) -> Result<Solution, FlowError> {
    match problem.params.solver {
        Solver::Newton => newton::minimise(problem),
        Solver::Gradient => gradient::minimise(problem),
    }
}
