//! Seamless metrics: flat but for cones of k π/2, with loops that turn by multiples of π/2, on every genus (`docs/method.md`, 8).
//!
//! *Enters:* an intrinsic Delaunay triangulation with lengths, loops that generate the homology, a [`Signature`]. *Leaves:* a [`SeamlessMetric`] whose cone
//! angles and turnings are those of the signature. *Guaranteed:* both to the tolerance, or an error; the same bytes for any
//! number of threads. *Not guaranteed:* that Newton arrives wherever a metric exists: no theorem says so (Capouellez, Zorin 2024).
//!
//! Scales alone have no freedom left for the turnings: a conformal class holds one metric with given cones. So the unknowns are the
//! logarithms of *all* lengths, λ = 2 ln l, on the given triangulation; its Delaunay flips at every λ (Penner coordinates, Ptolemy's theorem) make angles that are
//! continuously differentiable in all of ℝ^E. Of the solutions of each linear step the shortest is taken, in a norm that weighs
//! edges by the size of their faces, and changes that scales could make less ([`SeamlessParams::conformality`]).
//!
//! A surface with boundary is doubled. Its triangulation need not be Delaunay, only its own mirror image ([`Start`]); the changes are kept symmetric, so every edge and vertex
//! counts together with its image, and the mirror stays straight. Features, edges that shall be straight lines, are cut open and so are borders of both sides; that both sides of each are equally
//! long is one more equation. The Delaunay triangulation may cross the mirror; then flips that keep the metric make the sides edges again
//! ([`straighten`](crate::flow::straighten)), and their lengths can be compared.

mod error;
mod jacobian;
mod newton;
mod norm;
mod normal;
mod state;
#[cfg(test)]
mod tests;

pub use error::SeamlessError;

use crate::flow::holonomy::DualLoops;
use crate::flow::metric::total_area;
use crate::flow::mirror::Reflection;
use crate::flow::signature::Signature;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeId, EdgeVec};
use crate::observe::Observer;
use newton::Reuse;
use norm::Norm;
use state::Problem;

/// The metric to start from.
#[derive(Clone, Copy, Debug)]
pub struct Start<'a> {
    /// Closed.
    pub connectivity: &'a Connectivity,
    /// Length of every edge in the surface, positive: how much its faces weigh.
    pub length: &'a EdgeVec<f64>,
    /// ln of the lengths that the surface's Delaunay triangulation has on this one (Penner coordinates); `None` where this is the Delaunay triangulation.
    pub log_length: Option<&'a EdgeVec<f64>>,
    /// The reflection of a double.
    pub reflection: Option<&'a Reflection>,
    /// Pairs of edges on the mirror that are both sides of a feature: as long as each other.
    pub glued: &'a [[EdgeId; 2]],
}

/// What may be chosen about a seamless metric.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SeamlessParams {
    /// Bound on the error of cone angles and turnings, radians.
    pub tolerance: f64,
    /// How much cheaper a change of scale is than one of shape: 0 keeps lengths as they are as well as possible, large values keep angles. At 10 the
    /// changes of shape are a quarter of what they are at 0, and the lengths change half as much again.
    pub conformality: f64,
    /// Most Newton steps; 4 to 15 are usual.
    pub max_steps: usize,
}

impl Default for SeamlessParams {
    fn default() -> Self {
        Self {
            tolerance: 1e-10,
            conformality: 0.1,
            max_steps: 100,
        }
    }
}

/// One line of the convergence record.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SeamlessStep {
    /// Number of the step, 0 for the start. Further steps with the same factor count as the same.
    pub iteration: usize,
    /// Largest error of a cone angle or a turning, radians.
    pub max_error: f64,
    /// Half the sum of squares of what is missing, radians squared.
    pub energy: f64,
    /// Part of the Newton step that was taken.
    pub step: f64,
    /// Flips between the given triangulation and the Delaunay one here.
    pub flips: usize,
}

/// A metric whose transitions are quarter turns.
#[derive(Clone, Debug)]
pub struct SeamlessMetric {
    /// λ = 2 ln l of every edge of the triangulation given: a Penner coordinate, not a distance where edges were flipped. The area is that of the lengths
    /// given.
    pub penner: EdgeVec<f64>,
    /// The Delaunay triangulation of the metric.
    pub flat: Connectivity,
    /// Lengths of its edges, unit of the lengths given.
    pub length: EdgeVec<f64>,
    /// The loops on it.
    pub loops: DualLoops,
    /// By how much the turning of every loop misses what was prescribed, radians.
    pub residual: Vec<f64>,
    /// Largest error of a cone angle or a turning, radians.
    pub max_error: f64,
    /// One entry a step.
    pub history: Vec<SeamlessStep>,
}

/// The metric with a signature nearest to the given one; see the module docs.
///
/// `loops` must be on the triangulation of `start` and generate its homology; on a double, those of
/// [`mirrored_basis`](crate::flow::holonomy::mirrored_basis) do. There the signature must be symmetric.
pub fn seamless(
    start: &Start,
    loops: &DualLoops,
    signature: &Signature,
    params: &SeamlessParams,
    observer: &dyn Observer,
) -> Result<SeamlessMetric, SeamlessError> {
    let (c, length) = (start.connectivity, start.length);
    check_lengths(c, length)?;
    loops.check(c)?;
    signature.check(c, loops)?;
    let problem = Problem::new(start, loops, signature);
    let penner = match start.log_length {
        Some(log_length) => log_length.iter().map(|l| 2.0 * l).collect(),
        None => length.iter().map(|l| 2.0 * l.ln()).collect(),
    };
    let penner = match start.reflection {
        Some(reflection) => reflection.symmetric(&penner),
        None => penner,
    };
    let norm = Norm::by_area(c, length, params.conformality).by_images(start.reflection);
    let solution = newton::solve(&problem, penner, &norm, Reuse::WhereFast, params, observer)?;
    let (mut penner, state) = (solution.penner, solution.state);
    // Flips commute with a common factor.
    let unscaled: EdgeVec<f64> = state.log_length.iter().map(|l| l.exp()).collect();
    let area = [
        total_area(c, length),
        total_area(&state.connectivity, &unscaled),
    ];
    let factor = (area[0] / area[1]).sqrt();
    let shift = 2.0 * factor.ln();
    penner.as_mut_slice().iter_mut().for_each(|l| *l += shift);
    Ok(SeamlessMetric {
        penner,
        length: unscaled.iter().map(|l| factor * l).collect(),
        flat: state.connectivity,
        residual: state.missing[problem.local_equations()..].to_vec(),
        loops: state.loops,
        max_error: state.max_error,
        history: solution.history,
    })
}

fn check_lengths(c: &Connectivity, length: &EdgeVec<f64>) -> Result<(), SeamlessError> {
    if length.len() != c.edge_count() {
        return Err(SeamlessError::Count {
            given: length.len(),
            needed: c.edge_count(),
        });
    }
    if !c.is_closed() {
        let boundary_loops = c.boundary_loops().len();
        return Err(SeamlessError::NotClosed { boundary_loops });
    }
    match length
        .enumerate()
        .find(|(_, l)| !(l.is_finite() && **l > 0.0))
    {
        Some((edge, &length)) => Err(SeamlessError::BadLength { edge, length }),
        None => Ok(()),
    }
}
