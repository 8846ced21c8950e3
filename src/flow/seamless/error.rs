//! Why there is no seamless metric.

use crate::flow::holonomy::HolonomyError;
use crate::flow::signature::Infeasible;
use crate::flow::solve::SolveError;
use crate::geometry::ids::{EdgeId, VertexVec};

/// Errors of angles up to this, radians, that Newton's steps do not lower any more, are of rounding.
const ROUNDING: f64 = 1e-5;

/// Why there is no seamless metric.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SeamlessError {
    /// Not one length an edge.
    #[error("{given} lengths were given for {needed} edges")]
    Count {
        /// How many were given.
        given: usize,
        /// How many are needed.
        needed: usize,
    },
    /// The surface has a boundary.
    #[error(
        "seamless metrics are made on closed surfaces only: this one has {boundary_loops} boundary loops"
    )]
    NotClosed {
        /// Number of boundary loops.
        boundary_loops: usize,
    },
    /// A length is zero, negative, or no number.
    #[error("edge {edge} has length {length:e}; weld or remove the degenerate faces at it")]
    BadLength {
        /// Edge.
        edge: EdgeId,
        /// Its length.
        length: f64,
    },
    /// The loops are not on the surface.
    #[error(transparent)]
    Loops(#[from] HolonomyError),
    /// No metric has the signature.
    #[error(transparent)]
    Infeasible(#[from] Infeasible),
    /// Newton's steps became ever shorter, or too many.
    #[error(
        "no seamless metric was found: after {iterations} steps the largest error of a cone angle or a turning is {max_error:.3e} rad (bound {tolerance:.1e}), and {step:.1e} of a step was taken last; {}",
        match *max_error <= ROUNDING {
            true => "so little is what float64's 16 digits leave of angles of very thin faces: remove vertices that nearly coincide and faces without width from the mesh, or join them (repair.weld_tolerance = 1e-5)",
            false => "cones that are far from where the surface bends, or turnings far from its own, may have no metric: let the field choose them, or ask for other ones",
        }
    )]
    Stalled {
        /// Steps taken.
        iterations: usize,
        /// Largest error where it ended, radians.
        max_error: f64,
        /// What was asked for, radians.
        tolerance: f64,
        /// Part of the last Newton step that was taken; 0 where none could be.
        step: f64,
        /// What is missing at every vertex of the triangulation given: angles, radians, and differences of λ beside features.
        missing: VertexVec<f64>,
    },
    /// The angles are met, but in float64 some faces are no triangles.
    #[error(
        "the seamless metric has {faces} faces that are no triangles in float64's 16 digits: remove vertices that nearly coincide and faces without width from the mesh"
    )]
    BrokenFaces {
        /// How many.
        faces: usize,
    },
    /// The Jacobian is far from sparse.
    #[error(
        "on this mesh the angles depend on lengths that are far away, by at least {products} products in the linear system (most: {most}), since very many long thin faces lie side by side: divide the long faces, or remesh the surface with faces of similar sides"
    )]
    TooDense {
        /// Products of entries, as far as they were counted.
        products: usize,
        /// How many there may be.
        most: usize,
    },
    /// The side of a feature is no straight line where Newton begins.
    #[error(
        "edge {edge} cannot be made a straight line, since faces beside it have no width in float64's 16 digits: remove them from the mesh, or ask for fewer features (features.angle)"
    )]
    NoLine {
        /// Edge of the triangulation given.
        edge: EdgeId,
    },
    /// The linear system could not be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The observer asked to stop.
    #[error("the seamless metric was cancelled")]
    Cancelled,
}
