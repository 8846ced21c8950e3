//! Tiles on the grid: how many a cell has, how the pattern fills one, and how large they are on the surface.
//!
//! *Enters:* tiles along a side of a cell and the pattern's pixels; a surface. *Leaves:* a [`Tiling`], and the [`TileSize`].
//!
//! A tile is a square of the grid. A pattern that is no square is there several times in each, so that it keeps its shape; where that would
//! take more than [`MOST_COPIES`] along a side it is stretched to the square instead.

use crate::atlas::plane::doubled_area;
use crate::geometry::mesh::triangle_area;
use crate::read::gridded::GriddedSurface;

/// Most copies of a pattern along a side of a tile.
pub const MOST_COPIES: u32 = 8;

/// How a pattern lies on the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tiling {
    /// Tiles along a side of a cell.
    pub tiles_per_cell: u32,
    /// Copies of the pattern across a tile, and down it.
    pub copies: [u32; 2],
    /// True where the pattern is stretched to a square.
    pub is_stretched: bool,
}

impl Tiling {
    /// For a pattern of so many columns and rows.
    #[must_use]
    pub fn new(tiles_per_cell: u32, [columns, rows]: [usize; 2]) -> Self {
        let divisor = greatest_common_divisor(columns, rows).max(1);
        let copies = [rows / divisor, columns / divisor].map(|n| u32::try_from(n).ok());
        let few = copies.map(|n| n.filter(|n| (1..=MOST_COPIES).contains(n)));
        let (copies, is_stretched) = match few {
            [Some(across), Some(down)] => ([across, down], false),
            _ => ([1, 1], true),
        };
        Self {
            tiles_per_cell,
            copies,
            is_stretched,
        }
    }

    /// Grid coordinates to repeats of the pattern.
    #[must_use]
    pub fn repeats(&self, grid: [f64; 2]) -> [f64; 2] {
        let per_cell = f64::from(self.tiles_per_cell);
        std::array::from_fn(|i| f64::from(self.copies[i]) * per_cell * grid[i])
    }
}

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    match b {
        0 => a,
        _ => greatest_common_divisor(b, a % b),
    }
}

/// Width of tiles on the surface: roots of the area there of what is a tile's area on the grid, source units. Below `p05` are those of a twentieth of all
/// tiles, below `p95` those of nineteen twentieths.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TileSize {
    /// 5 %.
    pub p05: f64,
    /// 95 %.
    pub p95: f64,
}

/// Measures tiles face by face.
#[must_use]
pub fn tile_size(surface: &GriddedSurface, tiling: &Tiling) -> TileSize {
    let faces = surface.faces.iter().zip(&surface.grid_uv);
    let mut sizes: Vec<[f64; 2]> = faces
        .map(|(face, grid)| {
            let cells = 0.5 * doubled_area(*grid);
            let area = triangle_area(face.map(|v| surface.positions[v as usize]));
            [
                (area / cells).sqrt() / f64::from(tiling.tiles_per_cell),
                cells,
            ]
        })
        .filter(|[size, cells]| size.is_finite() && *cells > 0.0)
        .collect();
    sizes.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let all: f64 = sizes.iter().map(|s| s[1]).sum();
    let quantile = |share: f64| {
        let mut below = 0.0;
        let reached = sizes.iter().find(|[_, cells]| {
            below += cells;
            below >= share * all
        });
        reached.or(sizes.last()).map_or(0.0, |s| s[0])
    };
    TileSize {
        p05: quantile(0.05),
        p95: quantile(0.95),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_fill_a_square_in_their_own_shape_where_few_copies_do() {
        for (size, copies, is_stretched) in [
            ([128, 128], [1, 1], false),
            ([256, 128], [1, 2], false),
            ([90, 120], [4, 3], false),
            ([8, 7], [7, 8], false),
            ([9, 7], [1, 1], true),
            ([1000, 999], [1, 1], true),
            ([4096, 1], [1, 1], true),
        ] {
            let tiling = Tiling::new(3, size);
            assert_eq!((tiling.copies, tiling.is_stretched), (copies, is_stretched));
            // A copy's sides on the grid are as its pixels.
            if !is_stretched {
                let [across, down] = copies.map(f64::from);
                let [columns, rows] = size.map(|n| n as f64);
                assert_eq!(columns * across, rows * down, "{size:?}");
            }
            let [x, y] = tiling.repeats([1.0, -2.0]);
            assert_eq!(
                [x, y],
                [f64::from(3 * copies[0]), -f64::from(6 * copies[1])]
            );
        }
    }
}
