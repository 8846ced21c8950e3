//! `quads.obj`: the quad mesh of the grid, for Blender, Houdini, Maya.

use crate::grid::Grid;
use std::fmt::Write;

/// Vertices as `quad_positions`, faces as `quads`, row by row; every float with the shortest decimals that read back to the same 64 bits.
pub fn text(grid: &Grid) -> String {
    let mut text = String::new();
    for [x, y, z] in &grid.points {
        let _ = writeln!(text, "v {x} {y} {z}");
    }
    for cell in grid.cells_in_blocks() {
        let [a, b, c, d] = cell.corners.map(|i| i + 1);
        let _ = writeln!(text, "f {a} {b} {c} {d}");
    }
    text
}
