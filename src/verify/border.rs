//! Whether the border of a patch crosses itself: another way to see that no two of its faces overlap.
//!
//! A disk whose faces are all counterclockwise covers a point of the plane as often as its border winds around that point. So where the
//! border is one simple closed curve, every point is covered once at most. This takes the border's edges alone, which are few; and patches of
//! long faces that all meet in one point, where every pair of faces would have to be looked at, have a short one. A part of a slit disk that
//! has one border is a disk.
//!
//! *Not guaranteed:* that a border which only touches itself, to the tolerance, is told from one that crosses itself there; its turning
//! number, which must be 1, tells most of these.

use super::arrays::Arrays;
use super::central::at_corner;
use super::formulas::{Point2, distance2, sub2};
use super::grid::Grid;
use super::surface::Surface;
use std::f64::consts::{PI, TAU};

/// Most pairs of edges that are compared, for each edge, and besides.
const PAIRS: (u64, u64) = (2000, 10_000_000);

/// Whether the border of a part of a slit disk is one simple closed curve, up to `tolerance` (a length). `None` where there are several borders,
/// where neighbours inside do not meet, or where that cannot be told in bounded work. `inside` tells halfedges across which the part goes on.
pub(super) fn is_simple(
    surface: &Surface<'_>,
    arrays: &Arrays,
    faces: &[u32],
    inside: impl Fn(usize) -> bool,
    tolerance: f64,
) -> Option<bool> {
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
        return None;
    }
    let border: Vec<usize> = halfedges().filter(|h| !inside(*h)).collect();
    let path = around(surface, &border, &inside, 3 * faces.len())?;
    let points: Vec<Point2> = (path.iter()).map(|h| at(surface.tail_corner(*h))).collect();
    if (turning(&points) - TAU).abs() > PI {
        return Some(false);
    }
    let edges: Vec<[Point2; 2]> = (0..points.len())
        .map(|i| [points[i], points[(i + 1) % points.len()]])
        .collect();
    crosses(&edges, tolerance).map(|crosses| !crosses)
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

/// The sum of exterior angles of a polygon, radians: 2π times its turning number.
fn turning(points: &[Point2]) -> f64 {
    let n = points.len();
    let directions = (0..n).map(|i| sub2(points[(i + 1) % n], points[i]));
    let directions: Vec<Point2> = directions.filter(|d| *d != [0.0; 2]).collect();
    let n = directions.len();
    let angle = |i: usize| {
        let (a, b) = (directions[i], directions[(i + 1) % n]);
        (a[0] * b[1] - a[1] * b[0]).atan2(a[0] * b[0] + a[1] * b[1])
    };
    (0..n).map(angle).sum()
}

/// Whether two edges cross, each having the ends of the other on either side by more than `tolerance`; `None` where there are too many near each other.
fn crosses(edges: &[[Point2; 2]], tolerance: f64) -> Option<bool> {
    let limit = 256 * edges.len() + 100_000;
    let grid = Grid::new(edges, tolerance, limit).ok()?;
    let in_cell = |cell| grid.cell_items(cell);
    let pairs: u64 = (0..grid.cells())
        .map(|cell| (in_cell(cell).len() as u64).pow(2))
        .sum();
    if pairs > PAIRS.0 * edges.len() as u64 + PAIRS.1 {
        return None;
    }
    let side = |[p, q]: [Point2; 2], r: Point2| {
        let (d, e) = (sub2(q, p), sub2(r, p));
        let height = (d[0] * e[1] - d[1] * e[0]) / distance2(p, q);
        i32::from(height > tolerance) - i32::from(height < -tolerance)
    };
    let apart = |a: [Point2; 2], b: [Point2; 2]| side(a, b[0]) * side(a, b[1]) >= 0;
    let crossing = (0..grid.cells()).any(|cell| {
        let items = in_cell(cell);
        items.iter().enumerate().any(|(i, a)| {
            items[i + 1..].iter().any(|b| {
                let (a, b) = (edges[*a as usize], edges[*b as usize]);
                !(apart(a, b) || apart(b, a))
            })
        })
    });
    Some(crossing)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polygon(points: &[Point2]) -> Vec<[Point2; 2]> {
        (0..points.len())
            .map(|i| [points[i], points[(i + 1) % points.len()]])
            .collect()
    }

    #[test]
    fn a_bow_tie_crosses_itself_and_a_notched_square_does_not() {
        let tie = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
        assert_eq!(crosses(&polygon(&tie), 1e-9), Some(true));
        assert!(turning(&tie).abs() < 1e-12);
        let notched = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 0.0], [0.0, 2.0]];
        // The notch touches the lower side.
        assert_eq!(crosses(&polygon(&notched), 1e-9), Some(false));
        assert!((turning(&notched) - TAU).abs() < 1e-12);
    }

    #[test]
    fn a_curve_that_goes_round_twice_has_another_turning_number() {
        let twice: Vec<Point2> = (0..40)
            .map(|i| {
                let (s, c) = (f64::from(i) * 2.0 * TAU / 40.0).sin_cos();
                let r = 1.0 + 0.01 * f64::from(i);
                [r * c, r * s]
            })
            .collect();
        assert!((turning(&twice) - 2.0 * TAU).abs() < 1e-9);
    }
}
