//! Why there is no spline surface.

/// See the module docs.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SplineError {
    /// A cell names a point that there is not.
    #[error("cell {cell} of the quad mesh has point {point} of {points}; build the atlas again")]
    Point {
        /// Row of `quads`.
        cell: usize,
        /// Number of the point.
        point: u32,
        /// How many there are.
        points: usize,
    },
    /// Cells do not make a surface.
    #[error("cell {cell} of the quad mesh has an edge from point {} to {} that another has in the same direction, or that has no length; build the atlas again", ends[0], ends[1])]
    Edge {
        /// Row of `quads`.
        cell: usize,
        /// Points.
        ends: [u32; 2],
    },
    /// A face does not lie on the cells of its block.
    #[error("face {face} lies at ({}, {}) in block {block}, which has no cell there; build the atlas again", at[0], at[1])]
    Place {
        /// Row of `faces`.
        face: usize,
        /// Its patch.
        block: u32,
        /// Patch coordinates.
        at: [f64; 2],
    },
    /// Cells that make no rectangles.
    #[error("the quad mesh has no rectangles: {0}; build the atlas again")]
    Blocks(#[from] crate::grid::GridError),
    /// The equations of the fit have no solution.
    #[error("{0}")]
    Solve(#[from] crate::flow::solve::SolveError),
}
