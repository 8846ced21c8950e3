//! Whether triangles of one drawing overlap, told from its border where that suffices.
//!
//! The border of a drawing (the directed edges that no opposite edge of the same two vertices cancels) winds around a point as often as
//! counterclockwise triangles cover it, less the clockwise ones. Where the border is made of closed curves that stay away from each other and from
//! themselves, or touch in points, and lies around every point once at most, two counterclockwise triangles overlap within clockwise ones alone. So only what lies near triangles that are not
//! counterclockwise (rounding turns a few of the thinnest) is compared pair by pair; and all triangles, where the border is not of this kind.

use super::border::{keep_away, limit};
use super::formulas::{Extent2, Point2, doubled_area2, sub2};
use super::patches::{Overlap, find_overlap};
use super::surface::by_ends;
use std::collections::HashMap;

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

    /// Closed curves of the border, or of that of the mirrored drawing; `None` where an edge has more triangles on one side than on the other by two, or where
    /// coverage around a point is no sequence of once and not at all.
    fn border(&self, mirrored: bool) -> Option<Vec<Vec<Point2>>> {
        let mut edges: Vec<[u32; 2]> = Vec::new();
        let mut heavy = false;
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
            heavy |= balance.abs() > 1;
            match balance > 0 {
                _ if low == high || balance == 0 => {}
                forth if forth != mirrored => edges.push([low, high]),
                _ => edges.push([high, low]),
            }
        });
        if heavy {
            return None;
        }
        self.weld(&mut edges);
        curves(&self.points, &edges)
    }

    /// Gives equal points one number, and takes out pairs of opposite edges: sides of a seam of other attributes.
    fn weld(&self, edges: &mut Vec<[u32; 2]>) {
        let mut first: HashMap<[u64; 2], u32> = HashMap::new();
        for end in edges.as_flattened_mut() {
            // Adding zero makes both zeros one.
            let key = self.points[*end as usize].map(|x| (x + 0.0).to_bits());
            *end = *first.entry(key).or_insert(*end);
        }
        edges.retain(|[from, to]| from != to);
        edges.sort_unstable_by_key(|&[from, to]| (from.min(to), from.max(to), from < to));
        let mut kept: Vec<[u32; 2]> = Vec::with_capacity(edges.len());
        for edge in edges.drain(..) {
            if kept.last() == Some(&[edge[1], edge[0]]) {
                kept.pop();
            } else {
                kept.push(edge);
            }
        }
        *edges = kept;
    }
}

/// Follows directed edges to closed curves. Where several pass a point, each goes on such that what is covered, to its left, lies between its own two edges;
/// `None` where edges that end and begin there do not alternate.
fn curves(points: &[Point2], edges: &[[u32; 2]]) -> Option<Vec<Vec<Point2>>> {
    const NONE: u32 = u32::MAX;
    // Every edge at both of its ends: the point, the angle, whether it begins there.
    let at = |e: u32, begins: bool| {
        let [from, to] = edges[e as usize].map(|end| points[end as usize]);
        let d = if begins {
            sub2(to, from)
        } else {
            sub2(from, to)
        };
        let end = edges[e as usize][usize::from(!begins)];
        (end, d[1].atan2(d[0]), begins, e)
    };
    let numbers = 0..edges.len() as u32;
    let mut ends: Vec<_> = numbers.flat_map(|e| [at(e, true), at(e, false)]).collect();
    ends.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut next = vec![NONE; edges.len()];
    for around in ends.chunk_by(|a, b| a.0 == b.0) {
        for (i, (_, _, begins, e)) in around.iter().enumerate() {
            let (_, _, before, other) = around[(i + around.len() - 1) % around.len()];
            if *begins == before {
                return None;
            }
            if !begins {
                next[*e as usize] = other;
            }
        }
    }
    let mut curves = Vec::new();
    for start in 0..edges.len() {
        let mut curve: Vec<Point2> = Vec::new();
        let mut e = start;
        while next[e] != NONE {
            curve.push(points[edges[e][0] as usize]);
            e = std::mem::replace(&mut next[e], NONE) as usize;
        }
        if !curve.is_empty() {
            curves.push(curve);
        }
    }
    Some(curves)
}

/// Whether curves do not cross, stay away from each other but for common points, and wind around every point once or not at all. False also where that cannot be told in
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
        // No point of another curve, where these touch.
        let p = [0, 1].map(|k| 0.5 * (curve[0][k] + curve[1][k]));
        let others = curves.iter().zip(&boxes).enumerate();
        let around: i32 = others
            .filter(|(j, (_, b))| *j != i && (0..2).all(|k| b.min[k] <= p[k] && p[k] <= b.max[k]))
            .map(|(_, (other, _))| winding(other, p))
            .sum();
        let area: f64 = (1..curve.len())
            .map(|k| doubled_area2([p, curve[k], curve[(k + 1) % curve.len()]]))
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

    /// All of its triangles are doubtful, and nearer to each other than the tolerance.
    #[test]
    fn an_island_that_is_a_point_overlaps_nothing() {
        let mut drawing = sheet(8, |x, y| [0.1 + 0.3 * x, 0.1 + 0.3 * y]);
        add_sheet(&mut drawing, 30, |_, _| [0.5, 0.5]);
        let doubtful = drawing.doubtful().expect("the border is simple");
        assert_eq!(doubtful.len(), 1800);
        assert_eq!(agree(&drawing), Overlap::None);
    }

    #[test]
    fn triangles_of_own_corners_are_joined_where_these_are_equal() {
        let mut drawing = sheet(4, |x, y| [x, y]);
        let points = drawing.triangles();
        drawing.points = points.as_flattened().to_vec();
        drawing.corners = (0..points.len() as u32)
            .map(|t| [3 * t, 3 * t + 1, 3 * t + 2])
            .collect();
        assert_eq!(drawing.doubtful(), Some(Vec::new()));
        assert_eq!(agree(&drawing), Overlap::None);
        drawing.points[0] = [0.01, 0.01];
        assert_eq!(agree(&drawing), Overlap::None);
        drawing.points[0] = [f64::NAN, 0.0];
        assert_eq!(drawing.doubtful(), None);
    }

    /// Strips of squares that turn at random: they touch in corners, lie along each other, and cross.
    #[test]
    fn strips_of_squares_agree_with_all_pairs() {
        let mut seed = 7u64;
        let mut random = |n: u64| {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1);
            (seed >> 33) % n
        };
        let mut outcomes = [0; 3];
        for _ in 0..2000 {
            let mut drawing = Drawing {
                corners: Vec::new(),
                points: Vec::new(),
            };
            for _ in 0..1 + random(3) {
                let mut at = [random(6), random(6)];
                for _ in 0..1 + random(6) {
                    let [x, y] = at.map(|k| k as f64 / 16.0);
                    let (dx, dy) = (1.0 / 16.0, 1.0 / 16.0);
                    let first = drawing.points.len() as u32;
                    drawing
                        .points
                        .extend([[x, y], [x + dx, y], [x + dx, y + dy], [x, y + dy]]);
                    drawing
                        .corners
                        .extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
                    let k = random(2) as usize;
                    at[k] = (at[k] + 5 + 2 * random(2)) % 6;
                }
            }
            let told = agree(&drawing);
            outcomes[match drawing.doubtful() {
                Some(none) if none.is_empty() => 0,
                _ if told == Overlap::None => 1,
                _ => 2,
            }] += 1;
        }
        // Every drawing without overlap is recognised as such.
        assert!(
            outcomes[0] > 300 && outcomes[1] == 0 && outcomes[2] > 300,
            "{outcomes:?}"
        );
    }
}
