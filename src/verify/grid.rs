//! A uniform grid over a set of triangles or edges in the plane, to find those near a point or each other.

use super::formulas::{Extent2, Point2};

/// Cells, each with the items whose box (row by row: whose outline) comes near.
pub(super) struct Grid {
    origin: Point2,
    /// Cells per unit of length.
    density: Point2,
    columns: usize,
    rows: usize,
    start: Vec<u32>,
    items: Vec<u32>,
}

/// Why no grid was made.
#[derive(Debug, PartialEq)]
pub(super) struct TooManyEntries;

impl Grid {
    /// Sorts convex outlines (two or three corners) into about as many cells as there are outlines. Each is
    /// widened by `margin`. At most `limit` entries are made.
    pub fn new<const N: usize>(
        outlines: &[[Point2; N]],
        margin: f64,
        limit: usize,
    ) -> Result<Self, TooManyEntries> {
        let extent = Extent2::of(outlines.as_flattened().iter().copied());
        let side = ((outlines.len() as f64).sqrt().ceil() as usize).clamp(1, 2048);
        let size = [0, 1].map(|i| (extent.max[i] - extent.min[i] + 2.0 * margin).max(1e-300));
        // Cells as square as the extent allows.
        let aspect = (size[0] / size[1]).clamp(1e-3, 1e3).sqrt();
        // None narrower than the margin, which would only multiply the entries.
        let cells = |wanted: f64, size: f64| {
            let cells = wanted.ceil().min((size / margin).floor());
            (cells as usize).clamp(1, 1 << 16)
        };
        let columns = cells(side as f64 * aspect, size[0]);
        let rows = cells(side as f64 / aspect, size[1]);
        let mut grid = Self {
            origin: [extent.min[0] - margin, extent.min[1] - margin],
            density: [columns as f64 / size[0], rows as f64 / size[1]],
            columns,
            rows,
            start: vec![0; columns * rows + 1],
            items: Vec::new(),
        };
        let mut total = 0usize;
        let mut counts = std::mem::take(&mut grid.start);
        for outline in outlines {
            grid.spans(outline, margin, |row, from, to| {
                total += to - from + 1;
                // Counting more would cost too much.
                if total <= limit {
                    let cells = row * columns + from + 1..=row * columns + to + 1;
                    counts[cells].iter_mut().for_each(|count| *count += 1);
                }
                total <= limit
            });
            if total > limit {
                return Err(TooManyEntries);
            }
        }
        grid.start = counts;
        for cell in 1..grid.start.len() {
            grid.start[cell] += grid.start[cell - 1];
        }
        let mut next = grid.start.clone();
        let mut items = vec![0; total];
        for (item, outline) in (0u32..).zip(outlines) {
            grid.spans(outline, margin, |row, from, to| {
                for slot in &mut next[row * columns + from..=row * columns + to] {
                    items[*slot as usize] = item;
                    *slot += 1;
                }
                true
            });
        }
        grid.items = items;
        Ok(grid)
    }

    fn row(&self, y: f64) -> usize {
        cell((y - self.origin[1]) * self.density[1], self.rows)
    }

    fn column(&self, x: f64) -> usize {
        cell((x - self.origin[0]) * self.density[0], self.columns)
    }

    /// Tells every row of cells that an outline meets, with the first and the last column, until `tell` says no.
    fn spans<const N: usize>(
        &self,
        outline: &[Point2; N],
        margin: f64,
        mut tell: impl FnMut(usize, usize, usize) -> bool,
    ) {
        let extent = Extent2::of(outline.iter().copied());
        let (first, last) = (
            self.row(extent.min[1] - margin),
            self.row(extent.max[1] + margin),
        );
        for row in first..=last {
            // A little more than the row, so that rounding loses nothing.
            let low = self.origin[1] + (row as f64 - 1e-6) / self.density[1] - margin;
            let high = self.origin[1] + (row as f64 + 1.0 + 1e-6) / self.density[1] + margin;
            let (mut from, mut to) = (f64::INFINITY, f64::NEG_INFINITY);
            let mut meet = |x: f64| {
                from = from.min(x);
                to = to.max(x);
            };
            for i in 0..N {
                let (a, b) = (outline[i], outline[(i + 1) % N]);
                if a[1] >= low && a[1] <= high {
                    meet(a[0]);
                }
                for y in [low, high] {
                    if (a[1] < y) != (b[1] < y) {
                        let t = (y - a[1]) / (b[1] - a[1]);
                        meet(a[0] + t * (b[0] - a[0]));
                    }
                }
            }
            if from <= to {
                let (from, to) = (self.column(from - margin), self.column(to + margin));
                if !tell(row, from, to) {
                    return;
                }
            }
        }
    }

    /// Items that come near the cell of a point.
    pub fn near(&self, p: Point2) -> &[u32] {
        self.cell_items(self.row(p[1]) * self.columns + self.column(p[0]))
    }

    pub fn cells(&self) -> usize {
        self.columns * self.rows
    }

    pub fn cell_items(&self, cell: usize) -> &[u32] {
        &self.items[self.start[cell] as usize..self.start[cell + 1] as usize]
    }
}

fn cell(x: f64, count: usize) -> usize {
    // The conversion saturates, NaN becomes 0.
    (x.floor() as usize).min(count - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_of_an_outline_finds_it() {
        let outlines = [
            [[0.0, 0.0], [10.0, 1.0], [3.0, 8.0]],
            [[-2.0, 5.0], [-1.0, 5.0], [-1.5, 9.0]],
            [[4.0, 4.0], [4.0, 4.0], [4.0, 4.0]],
        ];
        let grid = Grid::new(&outlines, 1e-9, 10_000).expect("few entries");
        for (item, t) in (0u32..).zip(&outlines) {
            for i in 0..=20 {
                for j in 0..=20 - i {
                    let (u, v) = (f64::from(i) / 20.0, f64::from(j) / 20.0);
                    let w = 1.0 - u - v;
                    let p = std::array::from_fn(|k| w * t[0][k] + u * t[1][k] + v * t[2][k]);
                    assert!(grid.near(p).contains(&item), "{item} at {p:?}");
                }
            }
        }
    }

    #[test]
    fn entries_are_limited() {
        let outlines = vec![[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]; 1000];
        assert_eq!(Grid::new(&outlines, 0.0, 5000).err(), Some(TooManyEntries));
    }
}
