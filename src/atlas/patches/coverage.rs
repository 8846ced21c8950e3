//! Where the plane is covered once by the faces of a region: what lies there overlaps nothing.
//!
//! A region of the slit disk is immersed, so that a point of the plane is covered as often as the region's border winds around it. On a grid of cells that number
//! is the same all over a cell that the border does not touch. So nearly all faces are known to overlap nothing, and only the others need to be compared.

use super::overlap::Triangle;
use std::ops::RangeInclusive;

/// Faces a cell, about.
const FACES: f64 = 4.0;
/// Most cells on a side.
const MOST: usize = 2048;

/// A grid over a region, of which cells are known to be covered once.
pub(super) struct Coverage {
    low: [f64; 2],
    /// Cells a unit.
    per_unit: f64,
    size: [usize; 2],
    is_single: Vec<bool>,
    /// Where no cell need be looked at.
    everywhere: bool,
}

impl Coverage {
    /// For a region that overlaps itself nowhere.
    pub fn everywhere() -> Self {
        Self {
            low: [0.0; 2],
            per_unit: 0.0,
            size: [0, 0],
            is_single: Vec::new(),
            everywhere: true,
        }
    }

    /// For a region of so many faces, with this border: its sides, with the region on their left.
    pub fn new(faces: usize, border: &[[[f64; 2]; 2]]) -> Self {
        let points = || border.iter().flatten();
        let least = |i: usize| points().map(|p| p[i]).fold(f64::INFINITY, f64::min);
        let most = |i: usize| points().map(|p| p[i]).fold(f64::NEG_INFINITY, f64::max);
        let low = [0, 1].map(least);
        let sides = [0, 1].map(|i| most(i) - low[i]);
        let per_unit = (faces as f64 / (FACES * sides[0] * sides[1])).sqrt();
        let per_unit = per_unit.min(MOST as f64 / sides[0].max(sides[1]));
        let mut grid = Self {
            low,
            per_unit,
            size: [0, 0],
            is_single: Vec::new(),
            everywhere: false,
        };
        // Without extent there is nothing to tell.
        if !per_unit.is_finite() || per_unit <= 0.0 {
            return grid;
        }
        grid.size = sides.map(|side| (side * per_unit) as usize + 1);
        grid.is_single = grid.winding(border).iter().map(|&n| n == 1).collect();
        for side in border {
            let [xs, ys] = grid.cells(side);
            for y in ys {
                for x in xs.clone() {
                    grid.is_single[y * grid.size[0] + x] = false;
                }
            }
        }
        grid
    }

    /// How often the border winds around the middle of every cell.
    fn winding(&self, border: &[[[f64; 2]; 2]]) -> Vec<i32> {
        let [columns, rows] = self.size;
        let mut winding = vec![0; columns * rows];
        for &[p, q] in border {
            let [p, q] = [p, q].map(|p| [0, 1].map(|i| (p[i] - self.low[i]) * self.per_unit - 0.5));
            // Rows whose middle line it crosses: those from one end up to, and without, the other.
            let (sign, bottom, top) = if p[1] < q[1] { (1, p, q) } else { (-1, q, p) };
            let first = bottom[1].ceil().max(0.0) as usize;
            let last = top[1].ceil().max(0.0) as usize;
            for row in first..last.min(rows) {
                let part = (row as f64 - bottom[1]) / (top[1] - bottom[1]);
                let x = bottom[0] + part * (top[0] - bottom[0]);
                // It counts for the cells on its left.
                let left = (x.ceil().max(0.0) as usize).min(columns);
                if left > 0 {
                    winding[row * columns + left - 1] += sign;
                }
            }
        }
        for row in winding.chunks_exact_mut(columns) {
            let mut sum = 0;
            for cell in row.iter_mut().rev() {
                sum += *cell;
                *cell = sum;
            }
        }
        winding
    }

    /// Columns and rows of the cells that the box around some points touches.
    fn cells(&self, points: &[[f64; 2]]) -> [RangeInclusive<usize>; 2] {
        [0, 1].map(|i| {
            let at = |x: f64| ((x - self.low[i]) * self.per_unit).max(0.0) as usize;
            let last = self.size[i].saturating_sub(1);
            let of = points.iter().map(|p| at(p[i]).min(last));
            let ends = of.fold((usize::MAX, 0), |(low, high), x| (low.min(x), high.max(x)));
            ends.0..=ends.1
        })
    }

    /// True where nothing else of the region lies where a face of it does. False where that is not known.
    pub fn is_single(&self, face: &Triangle) -> bool {
        if self.everywhere {
            return true;
        }
        let [xs, mut ys] = self.cells(face);
        ys.all(|y| {
            let row = y * self.size[0];
            let cells = self.is_single.get(row + xs.start()..=row + xs.end());
            cells.is_some_and(|cells| cells.iter().all(|&is_single| is_single))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::overlap::overlap;
    use super::super::placement::Placement;
    use super::super::samples::wound;
    use super::super::sets::Sets;
    use super::super::slit::Slit;
    use super::*;
    use crate::geometry::ids::FaceId;

    /// Against all pairs of faces, on strips wound around a point.
    #[test]
    fn what_is_covered_once_overlaps_nothing() {
        for (turns, least) in [(0.6, 0.4), (1.0, 0.4), (1.3, 0.1), (2.6, 0.0)] {
            let s = wound(90, 20, turns, 2.0);
            let slit = Slit::new(&s.mesh, &s.length, &s.cut, &s.development, None);
            let faces: Vec<FaceId> = s.mesh.connectivity.faces().collect();
            let placement = Placement::new(&slit, &slit.central, faces.iter().copied());
            let sides = Sets::new(&slit).sides(&faces);
            let border: Vec<[[f64; 2]; 2]> =
                sides.iter().map(|&h| placement.side(&slit, h)).collect();
            let coverage = Coverage::new(faces.len(), &border);
            let corners: Vec<Triangle> = faces
                .iter()
                .map(|&f| placement.triangle(&slit, f))
                .collect();
            let mut single = 0;
            for (i, t) in corners
                .iter()
                .enumerate()
                .filter(|row| coverage.is_single(row.1))
            {
                let others = corners.iter().enumerate().filter(|row| row.0 != i);
                let mut meets = others.filter(|row| overlap(t, row.1, placement.tolerance()));
                assert_eq!(meets.next().map(|row| row.0), None, "{turns}: face {i}");
                single += 1;
            }
            let part = f64::from(single) / faces.len() as f64;
            assert!(part >= least && part < 1.0, "{turns}: {part}");
        }
    }

    #[test]
    fn without_extent_nothing_is_known() {
        for border in [
            &[][..],
            &[[[1.0, 2.0]; 2]],
            &[[[0.0, 0.0], [1.0, 0.0]]],
            &[[[0.0, 0.0], [1e-310, 0.0]]],
        ] {
            let coverage = Coverage::new(5, border);
            assert!(!coverage.is_single(&[[0.1, 0.0], [0.2, 0.0], [0.1, 0.1]]));
        }
    }
}
