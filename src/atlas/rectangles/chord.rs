//! A line across a disk, from one place on its border to another.
//!
//! *Enters:* a disk and a number for every vertex, positive on one side of the border between the two places and negative on the
//! other. *Leaves:* the edges that the zero level crosses, in order, and where.
//!
//! *Guaranteed*, whatever the numbers inside are: the line is simple, touches the border at its ends only, and separates the two
//! sides. It is what marching triangles give: each vertex has one sign, so a face is crossed at most once, and a level line can leave
//! the disk only where the border changes its sign, which is at the two places.
//!
//! The numbers are harmonic ([`harmonic`](super::harmonic)): with ±1 on the border the line is the hyperbolic geodesic between the
//! places, smooth and far from the border.

use super::RectangleError;
use super::disk::Disk;
use crate::geometry::ids::{EdgeId, EdgeVec, HalfedgeId, VertexId, VertexVec};
use crate::geometry::subdivision::Subdivision;
use crate::geometry::triangle::angles;
use std::f64::consts::FRAC_PI_2;

/// A crossing lies at least this part of an edge from its ends, so that no face becomes a sliver.
const CLEARANCE: f64 = 0.15;

/// Where a line crosses an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Crossing {
    /// Edge of the subdivision.
    pub edge: EdgeId,
    /// Fraction from the tail of its halfedge.
    pub fraction: f64,
    /// The ends of the edge in the disk, and the fraction from the first to the second.
    pub between: ([VertexId; 2], f64),
}

/// Makes a line leave a place of the border in a certain direction: where the angle there is divided as |after| : |before|, numbers
/// whose signs are those of the border ahead and behind. The vertices around it get their distances from that direction, as if the
/// fan were unfolded (linear on each face, whatever its shape); none on the border changes its sign.
pub(super) fn aim(
    disk: &Disk,
    length: &EdgeVec<f64>,
    value: &mut VertexVec<f64>,
    place: usize,
    [after, before]: [f64; 2],
) {
    let c = &disk.connectivity;
    let fan = || c.outgoing(c.tail(disk.border[place]));
    let angle = |h: HalfedgeId| {
        let angles = angles(c.face_edges(c.face(h)).map(|e| length[e]));
        angles.map_or(0.0, |a| a[c.corner(h)])
    };
    let whole: f64 = fan().map(angle).sum();
    let ahead = whole * after.abs() / (after.abs() + before.abs());
    let longest = fan().map(|h| length[c.edge(h)]).fold(0.0, f64::max);
    let mut put = |v: VertexId, turned: f64, radius: f64| {
        let from_line = (turned - ahead).clamp(-FRAC_PI_2, FRAC_PI_2).sin();
        let new = before.signum() * from_line * radius / longest;
        if new.is_finite() && new != 0.0 && (!c.is_boundary_vertex(v) || new * value[v] > 0.0) {
            value[v] = new;
        }
    };
    let mut turned = 0.0;
    for (i, h) in fan().enumerate() {
        if i == 0 {
            put(c.head(h), turned, length[c.edge(h)]);
        }
        turned += angle(h);
        put(c.apex(h), turned, length[c.edge(c.prev(h))]);
    }
}

/// The zero level of `value` from the border's place `from` to the place `to`. The border is positive from `to` on to `from`
/// (counterclockwise), and negative from `from` to `to`; what `value` says at these two places does not matter.
///
/// No crossing means that the two places are joined by an edge.
pub(super) fn zero_level(
    fine: &Subdivision,
    disk: &Disk,
    value: &VertexVec<f64>,
    from: usize,
    to: usize,
) -> Result<Vec<Crossing>, RectangleError> {
    let c = &disk.connectivity;
    let n = disk.border.len();
    let [a, b] = [from, to].map(|place| c.tail(disk.border[place]));
    // The two places count as positive: the level line begins beside `a` and ends beside `b`.
    let positive = |v| v == a || v == b || value[v] > 0.0;
    let error = || RectangleError::Inconsistent {
        what: "a line across a patch",
    };
    let mut at = disk.border[from];
    if !positive(c.tail(at)) || positive(c.head(at)) || from == to {
        return Err(error());
    }
    // Halfedges from + to −, each on the near side of the face that the line enters.
    let mut crossed = Vec::new();
    for _ in 0..c.face_count() {
        let side = match positive(c.apex(at)) {
            // The line leaves between the negative head and the apex.
            true => c.next(at),
            false => c.prev(at),
        };
        // `side` runs − to + around this face, so its twin runs + to −.
        let Some(twin) = c.twin(side) else {
            let last = disk.border[(to + n - 1) % n];
            if side != last {
                return Err(error());
            }
            break;
        };
        crossed.push(twin);
        at = twin;
    }
    let touches = |h, v| c.tail(h) == v || c.head(h) == v;
    let end = crossed.iter().position(|&h| touches(h, b));
    let end = end.unwrap_or(crossed.len());
    let start = crossed[..end].iter().rposition(|&h| touches(h, a));
    let start = start.map_or(0, |i| i + 1);
    let crossing = |&h: &HalfedgeId| {
        let (p, q) = (c.tail(h), c.head(h));
        let fraction = value[p] / (value[p] - value[q]);
        let fraction = if fraction.is_finite() { fraction } else { 0.5 };
        let fraction = fraction.clamp(CLEARANCE, 1.0 - CLEARANCE);
        let own = disk.halfedge(fine, h);
        let edge = fine.connectivity.edge(own);
        let forward = fine.connectivity.edge_halfedge(edge) == own;
        Crossing {
            edge,
            fraction: if forward { fraction } else { 1.0 - fraction },
            between: ([p, q], fraction),
        }
    };
    Ok(crossed[start..end].iter().map(crossing).collect())
}
