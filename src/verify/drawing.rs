//! Whether triangles of one drawing overlap, told from its border where that suffices.
//!
//! The border of a drawing (the directed edges that no opposite edge of the same two vertices cancels) winds around a point as often as
//! counterclockwise triangles cover it, less the clockwise ones. Where the border is made of simple closed curves that stay away from each other, and lies
//! around every point once at most, two counterclockwise triangles overlap within clockwise ones alone. So only what lies near triangles that are not
//! counterclockwise (rounding turns a few of the thinnest) is compared pair by pair; and all triangles, where the border is not of this kind.

use super::border::{keep_away, limit};
use super::formulas::{Extent2, Point2, doubled_area2, sub2};
use super::patches::{Overlap, find_overlap};
use super::surface::by_ends;

/// Edges of the border are further apart than this, which is far above rounding in the unit square.
const APART: f64 = 1e-10;
/// Cells along a side of the unit square in which the neighbourhood of turned triangles is marked.
const CELLS: usize = 512;

/// Triangles as corners of points, in or near the unit square.
pub(super) struct Drawing {
    pub corners: Vec<[u32; 3]>,
    pub points: Vec<Point2>,
}

impl Drawing {
    /// A triangle, counterclockwise whichever way it is drawn.
    fn triangle(&self, at: usize) -> [Point2; 3] {
        let mut triangle = self.corners[at].map(|p| self.points[p as usize]);
        if doubled_area2(triangle) < 0.0 {
            triangle.swap(0, 1);
        }
        triangle
    }

    /// All triangles, counterclockwise.
    pub fn triangles(&self) -> Vec<[Point2; 3]> {
        (0..self.corners.len())
            .map(|at| self.triangle(at))
            .collect()
    }

    /// Two triangles that share more than `tolerance`, if there are any.
    pub fn overlap(&self, tolerance: f64) -> Overlap {
        let Some(doubtful) = self.doubtful() else {
            return find_overlap(&self.triangles(), tolerance);
        };
        let triangles: Vec<[Point2; 3]> = doubtful.iter().map(|at| self.triangle(*at)).collect();
        match find_overlap(&triangles, tolerance) {
            Overlap::Pair(a, b) => Overlap::Pair(doubtful[a], doubtful[b]),
            other => other,
        }
    }

    /// Triangles among which every overlap is; `None` where that could be any.
    fn doubtful(&self) -> Option<Vec<usize>> {
        if !self.points.as_flattened().iter().all(|x| x.is_finite()) {
            return None;
        }
        let area = |corners: &[u32; 3]| doubled_area2(corners.map(|p| self.points[p as usize]));
        let total: f64 = self.corners.iter().map(area).sum();
        let sign = if total < 0.0 { -1.0 } else { 1.0 };
        if !winds_once(&self.border(sign < 0.0)?) {
            return None;
        }
        let turned = |at: &usize| sign * area(&self.corners[*at]) <= 0.0;
        let turned: Vec<usize> = (0..self.corners.len()).filter(turned).collect();
        if turned.is_empty() {
            return Some(turned);
        }
        let mut marked = vec![false; CELLS * CELLS];
        let mut left = CELLS * CELLS;
        for at in turned {
            let [columns, rows] = self.cells(at);
            left = left.checked_sub(columns.clone().count() * rows.clone().count())?;
            for row in rows {
                marked[CELLS * row..][columns.clone()].fill(true);
            }
        }
        let mut left = 16 * self.corners.len() + 4 * CELLS * CELLS;
        let mut near = Vec::new();
        for at in 0..self.corners.len() {
            let [columns, mut rows] = self.cells(at);
            left = left.checked_sub(columns.clone().count() * rows.clone().count())?;
            if rows.any(|row| marked[CELLS * row..][columns.clone()].contains(&true)) {
                near.push(at);
            }
        }
        Some(near)
    }

    /// Columns and rows of cells that the box of a triangle meets.
    fn cells(&self, at: usize) -> [std::ops::Range<usize>; 2] {
        let box_ = Extent2::of(self.corners[at].map(|p| self.points[p as usize]));
        // The conversion saturates, so that what lies outside goes to the outermost cells.
        let cell = |x: f64| ((x * CELLS as f64) as usize).min(CELLS - 1);
        [0, 1].map(|i| cell(box_.min[i])..cell(box_.max[i]) + 1)
    }

    /// Closed curves of the border, or of that of the mirrored drawing; `None` where a point begins two of its edges.
    fn border(&self, mirrored: bool) -> Option<Vec<Vec<Point2>>> {
        const NONE: u32 = u32::MAX;
        let mut next = vec![NONE; self.points.len()];
        let mut starts = Vec::new();
        let mut forks = false;
        by_ends(&self.corners, self.points.len(), |low, group| {
            let high = group[0].0;
            // How often the edge runs from its lower end to its higher one, less how often back.
            let forth = |h: u32| {
                let (h, corners) = (h as usize, &self.corners[h as usize / 3]);
                corners[(h % 3 + 1) % 3] == low
            };
            let balance: i64 = group
                .iter()
                .map(|(_, h)| 2 * i64::from(forth(*h)) - 1)
                .sum();
            if low == high || balance == 0 {
                return;
            }
            let (from, to) = if (balance > 0) != mirrored {
                (low, high)
            } else {
                (high, low)
            };
            forks |= balance.abs() > 1 || next[from as usize] != NONE;
            next[from as usize] = to;
            starts.push(from);
        });
        if forks {
            return None;
        }
        let mut curves = Vec::new();
        for start in starts {
            let mut curve: Vec<Point2> = Vec::new();
            let mut at = start;
            while next[at as usize] != NONE {
                let p = self.points[at as usize];
                if curve.last() != Some(&p) {
                    curve.push(p);
                }
                at = std::mem::replace(&mut next[at as usize], NONE);
            }
            // As many edges end at a point as begin there, so the walk has come back.
            while curve.len() > 1 && curve.first() == curve.last() {
                curve.pop();
            }
            if !curve.is_empty() {
                curves.push(curve);
            }
        }
        Some(curves)
    }
}

/// Whether curves are simple, stay away from each other, and wind around every point once or not at all. False also where that cannot be told in
/// bounded work.
fn winds_once(curves: &[Vec<Point2>]) -> bool {
    let edges = curves.iter().map(Vec::len).sum::<usize>();
    if (curves.len() as u64).saturating_mul(edges as u64) > limit(edges) {
        return false;
    }
    if !keep_away(curves, APART) {
        return false;
    }
    let boxes: Vec<Extent2> = (curves.iter())
        .map(|curve| Extent2::of(curve.iter().copied()))
        .collect();
    // The number is the same all along one side of a curve, and every region lies at one.
    curves.iter().enumerate().all(|(i, curve)| {
        let p = curve[0];
        let others = curves.iter().zip(&boxes).enumerate();
        let around: i32 = others
            .filter(|(j, (_, b))| *j != i && (0..2).all(|k| b.min[k] <= p[k] && p[k] <= b.max[k]))
            .map(|(_, (other, _))| winding(other, p))
            .sum();
        let area: f64 = (1..curve.len() - 1)
            .map(|k| doubled_area2([p, curve[k], curve[k + 1]]))
            .sum();
        around == i32::from(area < 0.0)
    })
}

/// How often a curve winds around a point that it stays away from.
fn winding(curve: &[Point2], p: Point2) -> i32 {
    let ends = curve.iter().zip(curve.iter().cycle().skip(1));
    ends.map(|(a, b)| {
        let (d, e) = (sub2(*b, *a), sub2(p, *a));
        let side = d[0] * e[1] - d[1] * e[0];
        match (a[1] <= p[1], b[1] <= p[1]) {
            (true, false) if side > 0.0 => 1,
            (false, true) if side < 0.0 => -1,
            _ => 0,
        }
    })
    .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid of n by n squares of two triangles each, whose points `place` puts somewhere.
    fn sheet(n: u32, place: impl Fn(f64, f64) -> Point2) -> Drawing {
        let mut drawing = Drawing {
            corners: Vec::new(),
            points: Vec::new(),
        };
        add_sheet(&mut drawing, n, place);
        drawing
    }

    fn add_sheet(drawing: &mut Drawing, n: u32, place: impl Fn(f64, f64) -> Point2) {
        let first = drawing.points.len() as u32;
        let at = |i: u32, j: u32| first + (n + 1) * i + j;
        for i in 0..=n {
            for j in 0..=n {
                let part = |i: u32| f64::from(i) / f64::from(n);
                drawing.points.push(place(part(i), part(j)));
            }
        }
        for i in 0..n {
            for j in 0..n {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                drawing.corners.extend([[a, b, c], [a, c, d]]);
            }
        }
    }

    fn agree(drawing: &Drawing) -> Overlap {
        let told = drawing.overlap(1e-6);
        let all = find_overlap(&drawing.triangles(), 1e-6);
        assert_eq!(
            told == Overlap::None,
            all == Overlap::None,
            "{told:?} {all:?}"
        );
        told
    }

    #[test]
    fn flat_sheets_are_told_from_their_border_alone() {
        for turned in [false, true] {
            let place =
                |x: f64, y: f64| [0.1 + 0.3 * x, if turned { 0.4 - 0.3 * y } else { 0.3 * y }];
            let mut drawing = sheet(8, place);
            assert_eq!(drawing.doubtful(), Some(Vec::new()));
            // Another one beside it.
            add_sheet(&mut drawing, 4, |x, y| place(2.0 + 0.2 * x, y));
            assert_eq!(drawing.doubtful(), Some(Vec::new()));
            assert_eq!(agree(&drawing), Overlap::None);
        }
    }

    #[test]
    fn a_ring_with_a_sheet_in_its_hole_does_not_overlap() {
        let ring = |x: f64, y: f64| {
            let (s, c) = (x * std::f64::consts::TAU * 0.999).sin_cos();
            [0.5 + (0.4 - 0.2 * y) * c, 0.5 + (0.4 - 0.2 * y) * s]
        };
        let mut drawing = sheet(16, ring);
        add_sheet(&mut drawing, 2, |x, y| [0.45 + 0.1 * x, 0.45 + 0.1 * y]);
        assert_eq!(drawing.doubtful(), Some(Vec::new()));
        assert_eq!(agree(&drawing), Overlap::None);
        // The hole is closed in the combinatorics too.
        let n = 16;
        for corner in drawing
            .corners
            .iter_mut()
            .flatten()
            .filter(|c| (n * (n + 1)..(n + 1) * (n + 1)).contains(*c))
        {
            *corner -= n * (n + 1);
        }
        assert_eq!(drawing.doubtful(), Some(Vec::new()));
        assert_eq!(agree(&drawing), Overlap::None);
    }

    #[test]
    fn sheets_on_each_other_overlap() {
        // Crossing, the same, inside another, and wound around a branch point.
        let place = |x: f64, y: f64| [0.1 + 0.4 * x, 0.1 + 0.4 * y];
        for (shift, size) in [([0.2, 0.1], 0.4), ([0.1, 0.1], 0.4), ([0.2, 0.2], 0.1)] {
            let mut drawing = sheet(8, place);
            add_sheet(&mut drawing, 8, |x, y| {
                [shift[0] + size * x, shift[1] + size * y]
            });
            assert_ne!(agree(&drawing), Overlap::None);
        }
        let twice = sheet(24, |x, y| {
            let (s, c) = (x * 2.0 * std::f64::consts::TAU).sin_cos();
            let r = 0.1 + 0.2 * y + 0.05 * x;
            [0.5 + r * c, 0.5 + r * s]
        });
        assert_ne!(agree(&twice), Overlap::None);
    }

    #[test]
    fn a_fold_inside_is_found_and_a_turned_sliver_is_none() {
        let flat = |x: f64, y: f64| [0.1 + 0.8 * x, 0.1 + 0.8 * y];
        let mut folded = sheet(8, flat);
        folded.points[40] = [0.7, 0.5];
        assert!(folded.doubtful().is_some_and(|near| near.len() < 128));
        assert_ne!(agree(&folded), Overlap::None);
        // A point moved over the edge opposite, by less than the tolerance.
        let mut sliver = sheet(8, flat);
        let [a, _, c] = sliver.corners[40].map(|p| sliver.points[p as usize]);
        let b = sliver.corners[40][1] as usize;
        sliver.points[b] = [0, 1].map(|i| 0.5 * (a[i] + c[i]) + [-1e-8, 1e-8][i]);
        assert!(sliver.doubtful().is_some_and(|near| !near.is_empty()));
        agree(&sliver);
    }

    #[test]
    fn separate_triangles_are_compared_all() {
        let mut drawing = sheet(4, |x, y| [x, y]);
        let points = drawing.triangles();
        drawing.points = points.as_flattened().to_vec();
        drawing.corners = (0..points.len() as u32)
            .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
            .collect();
        assert_eq!(drawing.doubtful(), None);
        assert_eq!(agree(&drawing), Overlap::None);
        drawing.points[0] = [f64::NAN, 0.0];
        assert_eq!(drawing.doubtful(), None);
    }
}
