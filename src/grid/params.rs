//! How fine the grid is.

use serde::{Deserialize, Serialize};

/// Cells of a grid, at most: a quad mesh of them takes some 500 MB.
pub const MOST_CELLS: usize = 1_000_000;

/// `[grid]`: the integer grid, where `images.domain = "grid"`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GridParams {
    /// Cells of a mesh, shared among its components by area: as near as its cones allow, which need about ten each.
    pub cells: usize,
    /// Side of a cell, source units, from which the number of cells follows.
    pub cell_size: Option<f64>,
    /// Where cells are smaller.
    pub density: Density,
    /// Texels on a side of a cell.
    pub samples_per_cell: usize,
}

/// Where cells are smaller than elsewhere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Density {
    /// Nowhere, as far as cones allow.
    #[default]
    Uniform,
    /// Where the surface is curved.
    Curvature,
}

impl GridParams {
    /// Texels of all cells, about.
    pub fn texels(&self) -> usize {
        let of_cell = self.samples_per_cell.saturating_mul(self.samples_per_cell);
        self.cells.saturating_mul(of_cell)
    }
}

impl Default for GridParams {
    fn default() -> Self {
        Self {
            cells: 2000,
            cell_size: None,
            density: Density::Uniform,
            samples_per_cell: 8,
        }
    }
}
