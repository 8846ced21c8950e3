//! Whether the border of a patch keeps away from itself: another way to see that no two of its faces overlap.
//!
//! Faces that are all counterclockwise cover a point of the plane as often as their border winds around that point, whatever surface they make: both sides
//! of every other edge lie at the same place and cancel. So where the border is one simple closed curve, every point is covered once at most. This takes
//! the border's edges alone, which are few; and patches of long faces that all meet in one point, where every pair of faces would have to be looked at,
//! have a short one.
//!
//! *Guaranteed:* a border is called simple only where edges without a common end are further apart than the tolerance, and those with one do not cross in it:
//! sheets that overlap exactly along the lines of a grid cross in corners alone. *Not guaranteed:* that every simple border is recognised.
//! The stage that makes patches asks the same question of exact predicates in code of its own.

use super::arrays::Arrays;
use super::central::at_corner;
use super::formulas::{Point2, distance2, sub2};
use super::grid::Grid;
use super::surface::Surface;
use std::cmp::Ordering;

/// Most pairs of edges that are compared, for each edge, and besides.
const PAIRS: (u64, u64) = (2000, 10_000_000);

/// True where the border of a patch is one closed curve that stays away from itself by more than `tolerance` (a length), or touches itself in corners. False where there are
/// several borders, where neighbours inside do not meet, or where that cannot be told in bounded work. `inside` tells halfedges across which the part goes on.
pub(super) fn is_simple(
    surface: &Surface<'_>,
    arrays: &Arrays,
    faces: &[u32],
    inside: impl Fn(usize) -> bool,
    tolerance: f64,
) -> bool {
    let halfedges = || {
        faces
            .iter()
            .flat_map(|f| 3 * *f as usize..3 * *f as usize + 3)
    };
    let at = |corner| at_corner(&arrays.patch_uv, corner);
    let meets = |h: usize| {
        surface.twin(h).is_some_and(|t| {
            let (a, b) = (surface.tail_corner(h), surface.head_corner(t));
            distance2(at(a), at(b)) <= tolerance
        })
    };
    if !halfedges().all(|h| !inside(h) || meets(h)) {
        return false;
    }
    let border: Vec<usize> = halfedges().filter(|h| !inside(*h)).collect();
    let Some(path) = around(surface, &border, &inside, 3 * faces.len()) else {
        return false;
    };
    let points: Vec<Point2> = (path.iter()).map(|h| at(surface.tail_corner(*h))).collect();
    keep_away(&[points], tolerance)
}

/// Most pairs of so many edges that are compared.
pub(super) fn limit(edges: usize) -> u64 {
    PAIRS.0 * edges as u64 + PAIRS.1
}

/// The border from its first halfedge on; `None` where it is not one closed path. Every halfedge is passed once, unless the two sides of an
/// edge tell different things of it: `most` halfedges are.
fn around(
    surface: &Surface<'_>,
    border: &[usize],
    inside: &impl Fn(usize) -> bool,
    most: usize,
) -> Option<Vec<usize>> {
    let first = *border.first()?;
    let mut path = vec![first];
    let mut left = most;
    loop {
        let mut h = surface.next(*path.last()?);
        while inside(h) {
            left = left.checked_sub(1)?;
            h = surface.next(surface.twin(h)?);
        }
        if h == first {
            return (path.len() == border.len()).then_some(path);
        }
        if path.len() == border.len() {
            return None;
        }
        path.push(h);
    }
}

/// Whether the edges of closed polygons are further than `tolerance` from each other, but near a common end, where they do not cross: a polygon may touch
/// another one and itself in corners that are equal bit by bit. False where too many edges lie near each other.
pub(super) fn keep_away(polygons: &[Vec<Point2>], tolerance: f64) -> bool {
    let mut points = polygons.iter().flatten().flatten();
    if !points.all(|x| x.is_finite()) || polygons.iter().any(|p| p.len() < 3) {
        return false;
    }
    let mut edges: Vec<[Point2; 2]> = Vec::new();
    let mut next = Vec::new();
    for polygon in polygons {
        let (first, n) = (edges.len(), polygon.len());
        edges.extend((0..n).map(|i| [polygon[i], polygon[(i + 1) % n]]));
        next.extend((0..n).map(|i| first + (i + 1) % n));
    }
    if corners_cross(&edges, &next) {
        return false;
    }
    let n = edges.len();
    let Ok(grid) = Grid::new(&edges, tolerance, 256 * n + 100_000) else {
        return false;
    };
    let in_cell = |cell| grid.cell_items(cell);
    let pairs: u64 = (0..grid.cells())
        .map(|cell| (in_cell(cell).len() as u64).pow(2))
        .sum();
    if pairs > limit(n) {
        return false;
    }
    let meet = |a: usize, b: usize| edges_meet(edges[a], edges[b], tolerance);
    (0..grid.cells()).all(|cell| {
        let items = in_cell(cell);
        items.iter().enumerate().all(|(i, a)| {
            let mut others = items[i + 1..].iter();
            !others.any(|b| meet(*a as usize, *b as usize))
        })
    })
}

/// Whether polygons cross in a common corner: of the edges that meet there, taken by angle, the two of every corner enclose both or none of any other.
fn corners_cross(edges: &[[Point2; 2]], next: &[usize]) -> bool {
    // The corner between an edge and the next one; all points are finite.
    let mut corners: Vec<usize> = (0..edges.len()).collect();
    let order = |a: &usize, b: &usize| edges[*a][1].partial_cmp(&edges[*b][1]);
    corners.sort_unstable_by(|a, b| order(a, b).unwrap_or(Ordering::Equal));
    corners
        .chunk_by(|a, b| edges[*a][1] == edges[*b][1])
        .filter(|common| common.len() > 1)
        .any(|common| {
            let directions = common.iter().flat_map(|corner| {
                let ([before, p], [_, after]) = (edges[*corner], edges[next[*corner]]);
                [before, after].map(|end| {
                    let d = sub2(end, p);
                    (d[1].atan2(d[0]), *corner)
                })
            });
            let mut directions: Vec<(f64, usize)> = directions.collect();
            directions.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
            let mut open: Vec<usize> = Vec::new();
            for (_, corner) in directions {
                if open.last() == Some(&corner) {
                    open.pop();
                } else {
                    open.push(corner);
                }
            }
            !open.is_empty()
        })
}

/// Whether two edges cross or come this near; those with a common end, away from there.
fn edges_meet(a: [Point2; 2], b: [Point2; 2], tolerance: f64) -> bool {
    for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        if a[i] == b[j] {
            return is_near(a[1 - i], b, tolerance) || is_near(b[1 - j], a, tolerance);
        }
    }
    let side = |[p, q]: [Point2; 2], r: Point2| {
        let (d, e) = (sub2(q, p), sub2(r, p));
        d[0] * e[1] - d[1] * e[0]
    };
    let divides = |a, b: [Point2; 2]| (side(a, b[0]) < 0.0) != (side(a, b[1]) < 0.0);
    let near = |a, b: [Point2; 2]| b.iter().any(|p| is_near(*p, a, tolerance));
    divides(a, b) && divides(b, a) || near(a, b) || near(b, a)
}

fn is_near(r: Point2, [p, q]: [Point2; 2], tolerance: f64) -> bool {
    let (d, e) = (sub2(q, p), sub2(r, p));
    let along = (d[0] * e[0] + d[1] * e[1]) / (d[0] * d[0] + d[1] * d[1]);
    // An edge without length is its end.
    let t = if along > 0.0 { along.min(1.0) } else { 0.0 };
    distance2(r, [p[0] + t * d[0], p[1] + t * d[1]]) <= tolerance
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn keeps_away(points: &[Point2], tolerance: f64) -> bool {
        keep_away(&[points.to_vec()], tolerance)
    }

    #[test]
    fn what_crosses_or_touches_itself_does_not_keep_away() {
        let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        let tie = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
        let notched = |y: f64| [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, y], [0.0, 2.0]];
        let back = [[0.0, 0.0], [2.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
        assert!(keeps_away(&square, 1e-9));
        assert!(!keeps_away(&tie, 1e-9));
        assert!(keeps_away(&notched(1e-8), 1e-9));
        assert!(!keeps_away(&notched(1e-10), 1e-9));
        assert!(!keeps_away(&back, 1e-9));
        assert!(!keeps_away(&[[f64::NAN; 2]; 4], 1e-9));
    }

    /// Its turning number is that of a simple curve, and it crosses itself in corners alone.
    #[test]
    fn a_strip_that_crosses_its_beginning_along_a_grid_is_found() {
        let turns: [[u32; 2]; 10] = [
            [0, 1],
            [5, 1],
            [5, 6],
            [2, 6],
            [2, 0],
            [3, 0],
            [3, 5],
            [4, 5],
            [4, 2],
            [0, 2],
        ];
        let mut points: Vec<Point2> = Vec::new();
        for (i, from) in turns.iter().enumerate() {
            let to = turns[(i + 1) % turns.len()];
            let steps = from[0].abs_diff(to[0]) + from[1].abs_diff(to[1]);
            for k in 0..steps {
                let part = f64::from(k) / f64::from(steps);
                points.push([0, 1].map(|i| {
                    let [a, b] = [from[i], to[i]].map(|x: u32| f64::from(x));
                    (a + part * (b - a)).round()
                }));
            }
        }
        let n = points.len();
        let turn = |i: usize| {
            let [p, q, r] = [0, 1, 2].map(|k| points[(i + k) % n]);
            let (a, b) = (sub2(q, p), sub2(r, q));
            (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1])
        };
        assert!(((0..n).map(turn).sum::<f64>() - TAU).abs() < 1e-12);
        assert!(!keeps_away(&points, 1e-9));
    }

    #[test]
    fn a_curve_may_touch_itself_in_a_corner_and_not_cross_there() {
        let p = [0.0, 0.0];
        let (a, b, c, d) = ([2.0, 1.0], [2.0, -1.0], [-2.0, 1.0], [-2.0, -1.0]);
        assert!(keeps_away(&[p, b, a, p, c, d], 1e-9));
        assert!(!keeps_away(&[p, b, a, p, d, c], 1e-9));
        // One triangle beside another, and one with a corner on the edge of another.
        let (apart, touching) = ([p, b, a], [p, c, d]);
        assert!(keep_away(&[apart.to_vec(), touching.to_vec()], 1e-9));
        let on_edge = [[2.0, 0.0], [3.0, -1.0], [3.0, 1.0]];
        assert!(!keep_away(&[apart.to_vec(), on_edge.to_vec()], 1e-9));
        // Crossing in their common corner alone.
        let across = [p, [1.0, 2.0], [3.0, 0.0]];
        assert!(!keep_away(&[apart.to_vec(), across.to_vec()], 1e-9));
    }

    #[test]
    fn a_curve_that_goes_round_twice_is_found() {
        let twice: Vec<Point2> = (0..40)
            .map(|i| {
                let (s, c) = (f64::from(i) * 2.0 * TAU / 40.0).sin_cos();
                let r = 1.0 + 0.01 * f64::from(i);
                [r * c, r * s]
            })
            .collect();
        assert!(!keeps_away(&twice, 1e-9));
    }
}
