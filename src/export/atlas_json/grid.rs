//! The grid in `atlas.json`.

use crate::geometry::ids::VertexId;
use crate::grid::blocks::Piece;
use crate::grid::{Distortion, Grid as Built};
use serde::{Deserialize, Serialize};

/// The integer grid that the patches are blocks of.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Grid {
    /// Number of cells.
    pub cells: usize,
    /// Number of blocks: patches.
    pub blocks: usize,
    /// Number of islands that blocks form in `TEXCOORD_0`.
    pub islands: usize,
    /// Texels on a side of a cell.
    pub samples_per_cell: usize,
    /// √(source area / cells), source units.
    pub cell_size: f64,
    /// Faces that are turned over on the grid: none.
    pub turned_over: usize,
    /// Points of the quad mesh inside with other than 4 edges, on the border with other than 3.
    pub irregular: Vec<Irregular>,
    /// How far the map from the surface to the grid is from an isometry.
    pub distortion: Distortion,
}

/// An irregular point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Irregular {
    /// Row of `quad_positions`.
    pub quad_vertex: usize,
    /// Row of `positions`.
    pub vertex: usize,
    /// Number of edges.
    pub valence: usize,
}

/// A stretch of a block's side with one neighbour, in cells.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct SidePiece {
    /// First cell of this side, counterclockwise around the block.
    pub start: usize,
    /// Cells.
    pub length: usize,
    /// Patch across; null at a border of the surface.
    pub patch: Option<usize>,
    /// Its side: 0 bottom, 1 right, 2 top, 3 left.
    pub side: Option<usize>,
    /// Its first cell.
    pub other_start: Option<usize>,
    /// Whether the cells across run the other way: wherever there are any.
    pub reversed: bool,
}

/// Describes a grid.
pub(super) fn grid(grid: &Built) -> Grid {
    let irregular = grid.irregular().into_iter().filter_map(|point| {
        let vertex: VertexId = grid.vertex[point]?;
        Some(Irregular {
            quad_vertex: point,
            vertex: vertex.index(),
            valence: grid.quads.points[point].valence,
        })
    });
    let over = grid.uv.iter().filter(|corners| {
        let [p, q, r] = **corners;
        (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]) <= 0.0
    });
    Grid {
        cells: grid.cells(),
        blocks: grid.blocks.blocks.len(),
        islands: grid.islands.corner.len(),
        samples_per_cell: grid.samples_per_cell,
        cell_size: grid.cell_size,
        turned_over: over.count(),
        irregular: irregular.collect(),
        distortion: grid.distortion,
    }
}

/// What lies across the sides of a block.
pub(super) fn sides(grid: &Built, block: usize) -> [Vec<SidePiece>; 4] {
    let described = |piece: &Piece| SidePiece {
        start: piece.start,
        length: piece.length,
        patch: piece.across.map(|across| across.0),
        side: piece.across.map(|across| across.1),
        other_start: piece.across.map(|across| across.2),
        reversed: piece.across.is_some(),
    };
    std::array::from_fn(|s| grid.blocks.sides[block][s].iter().map(described).collect())
}
