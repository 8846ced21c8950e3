//! Where straight lines of the source metric cross the edges of the intrinsic Delaunay triangulation B.
//!
//! *Enters:* the halfedges of B that a base edge crosses. *Leaves:* for each the place on the base edge and on the edge of B.
//! *Guaranteed:* fractions in [0, 1], nondecreasing along the base edge. The strip of faces is unfolded by
//! multiplying edge vectors by complex ratios, so a direction is as good after a needle as before it.

use super::PositionsError;
use super::crossed::twin;
use crate::flow::correspondence::Crossing;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, HalfedgeId};
use crate::geometry::triangle;

/// A base edge crosses an edge of B.
#[derive(Clone, Copy, Debug)]
pub(super) struct StraightPoint {
    /// Fraction of the base edge, from the tail of its `edge_halfedge`.
    pub on_base: f64,
    /// Fraction of the edge of B, from the tail of its `edge_halfedge`.
    pub on_delaunay: f64,
}

type Point = [f64; 2];

fn times(a: Point, b: Point) -> Point {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}
fn plus(a: Point, b: Point) -> Point {
    [a[0] + b[0], a[1] + b[1]]
}
fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

/// For the face left of `h` = a→b with apex c: (c − a) / (b − a) and (b − c) / (b − a) as complex numbers.
fn ratios(delaunay: &Connectivity, length: &EdgeVec<f64>, h: HalfedgeId) -> [Point; 2] {
    let of = |h| length[delaunay.edge(h)];
    let (ab, bc, ca) = (of(h), of(delaunay.next(h)), of(delaunay.prev(h)));
    // The projection of c on ab is 1/2 ± this.
    let skew = 0.5 * ((ca - bc) / ab) * ((ca + bc) / ab);
    // A face without area is flat to the last bit: the lengths say no more.
    let height = 2.0 * triangle::area([ab, bc, ca]).unwrap_or(0.0) / ab / ab;
    [[0.5 + skew, height], [0.5 - skew, -height]]
}

/// Appends one point a crossing. `placed` is scratch space.
pub(super) fn straight(
    delaunay: &Connectivity,
    length: &EdgeVec<f64>,
    strip: &[Crossing],
    placed: &mut Vec<[Point; 2]>,
    points: &mut Vec<StraightPoint>,
) -> Result<(), PositionsError> {
    let Some(start) = strip.first() else {
        return Ok(());
    };
    placed.clear();
    // The curve begins in the origin; the first edge that it crosses is the unit of length. Each edge is kept as its
    // tail a and its vector b − a.
    let [ac, _] = ratios(delaunay, length, start.halfedge);
    let (mut a, mut ab) = ([-ac[0], -ac[1]], [1.0, 0.0]);
    let mut end = [0.0; 2];
    for (i, x) in strip.iter().enumerate() {
        placed.push([a, ab]);
        let t = twin(delaunay, x.halfedge)?;
        // Seen from the face beyond, which has the edge the other way round.
        let [z_bc, z_ca] = ratios(delaunay, length, t);
        let (bc, ac) = (times([-ab[0], -ab[1]], z_bc), times(ab, z_ca));
        let c = if dot(bc, bc) < dot(ac, ac) {
            plus(plus(a, ab), bc)
        } else {
            plus(a, ac)
        };
        match strip.get(i + 1) {
            None => end = c,
            Some(next) if next.halfedge == delaunay.next(t) => ab = ac,
            Some(next) if next.halfedge == delaunay.prev(t) => {
                a = c;
                ab = [-bc[0], -bc[1]];
            }
            Some(_) => return Err(PositionsError::Strip),
        }
    }
    let mut reached = 0.0f64;
    for (x, &[a, ab]) in strip.iter().zip(placed.iter()) {
        // The tail lies right of the curve, the head left.
        let t = fraction(-cross(end, a), cross(end, ab));
        let point = [a[0] + t * ab[0], a[1] + t * ab[1]];
        reached = reached.max(fraction(dot(point, end), dot(end, end)));
        let along = x.halfedge == delaunay.edge_halfedge(delaunay.edge(x.halfedge));
        points.push(StraightPoint {
            on_base: reached,
            on_delaunay: if along { t } else { 1.0 - t },
        });
    }
    Ok(())
}

/// `part / whole` kept in [0, 1]; one half where it says nothing.
pub(super) fn fraction(part: f64, whole: f64) -> f64 {
    let quotient = part / whole;
    if quotient.is_nan() {
        0.5
    } else {
        quotient.clamp(0.0, 1.0)
    }
}
