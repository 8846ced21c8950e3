//! Why a surface has no grid.

use crate::geometry::ids::{EdgeId, VertexId};

/// Why there is no grid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GridError {
    /// The sides of an edge are not a quarter turn apart.
    #[error(
        "both sides of edge {edge} are {gap:e} apart after a quarter turn: a grid needs flow.holonomy = \"quarter-turns\""
    )]
    NoQuarterTurn {
        /// Edge of the atlas.
        edge: EdgeId,
        /// What is left between them, source units.
        gap: f64,
    },
    /// An angle around a vertex is no multiple of a quarter turn.
    #[error(
        "the angle at vertex {vertex} is {quarters} quarter turns, but a grid needs whole ones, and at least one: cones.strategy = \"field\" chooses them"
    )]
    NoQuarterAngle {
        /// Vertex of the atlas.
        vertex: VertexId,
        /// The angle, quarter turns.
        quarters: f64,
    },
    /// No whole numbers were found.
    #[error(
        "no grid was found whose cells fit between the cones of the surface: ask for more cells, or for fewer cones (cones.count)"
    )]
    NoCells,
}
