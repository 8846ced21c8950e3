//! The common parameter of the walls: where the vertices of a shared side lie on it, the same for both rectangles.
//!
//! *Enters:* rectangles whose borders fit. *Leaves:* for every border vertex the fractions of its side before it and behind it.
//! *Guaranteed:* what is before it for one rectangle is behind it for the other, to the last bit; along a side the fractions rise from 0
//! to 1.
//!
//! The two conformal maps stretch a wall differently, and where a corner is sharp they leave next to nothing of the image to what lies far from it. So the parameter
//! is the length in space, and where a rectangle is to be sampled densely ([`density`](super::density)) as much more: both take the mean.

use super::RectangleError;
use super::flow::{Piece, Rectangle, sides};
use crate::geometry::ids::{HalfedgeVec, NONE, VertexId};
use crate::geometry::mesh::distance;
use crate::geometry::subdivision::Subdivision;
use std::ops::Range;

/// Edges get at least about this part of their side: what conformal maps crowd into less is put beyond the reach of rounding,
/// and still far within a texel.
const LEAST: f64 = 1e-10;

/// Parts of a side before a vertex and behind it.
pub(super) type Fractions = [f64; 2];

/// A side of a rectangle: its pieces, in the direction of the border.
struct Side {
    rectangle: usize,
    pieces: Range<usize>,
    /// Number of the side across.
    across: Option<usize>,
}

/// For every piece of every rectangle's border, which side (from the first corner on) it lies on, and the fractions where it begins.
pub(super) fn parameters(
    drawing: &Subdivision,
    rectangles: &[Rectangle],
) -> Result<Vec<Vec<(usize, Fractions)>>, RectangleError> {
    let mut all: Vec<Side> = Vec::with_capacity(4 * rectangles.len());
    for (rectangle, r) in rectangles.iter().enumerate() {
        let own = &r.fine.connectivity;
        let tail = |edge| own.tail(own.edge_halfedge(edge));
        let tails: Vec<VertexId> = r.border.iter().map(|piece| tail(piece.edge)).collect();
        all.extend(sides(&tails, &r.corners)?.map(|pieces| Side {
            rectangle,
            pieces,
            across: None,
        }));
    }
    join(drawing, rectangles, &mut all)?;
    let own: Vec<Vec<f64>> = all.iter().map(|side| parts(rectangles, side)).collect();
    let mut result = vec![Vec::new(); rectangles.len()];
    for (i, side) in all.iter().enumerate() {
        let common = match side.across {
            Some(j) => {
                let across = own[j].iter().rev();
                own[i]
                    .iter()
                    .zip(across)
                    .map(|(a, b)| 0.5 * (a + b))
                    .collect()
            }
            None => own[i].clone(),
        };
        let fractions = fractions(&common).into_iter();
        result[side.rectangle].extend(fractions.map(|f| (i % 4, f)));
    }
    Ok(result)
}

/// Finds the sides across, which must be whole sides with as many pieces.
fn join(
    drawing: &Subdivision,
    rectangles: &[Rectangle],
    all: &mut [Side],
) -> Result<(), RectangleError> {
    let c = &drawing.connectivity;
    let mut side_of = HalfedgeVec::filled(NONE, c.halfedge_count());
    for (i, side) in all.iter().enumerate() {
        for piece in &rectangles[side.rectangle].border[side.pieces.clone()] {
            side_of[piece.wall] = i as u32;
        }
    }
    for i in 0..all.len() {
        let mut walls = rectangles[all[i].rectangle].border[all[i].pieces.clone()].iter();
        let across = |wall| c.twin(wall).map(|t| side_of[t]).filter(|&s| s != NONE);
        let first = walls.next().and_then(|piece| across(piece.wall));
        let fits = walls.all(|piece| across(piece.wall) == first)
            && first.is_none_or(|j| all[j as usize].pieces.len() == all[i].pieces.len());
        if !fits {
            return Err(RectangleError::Inconsistent {
                what: "the two sides of a wall",
            });
        }
        all[i].across = first.map(|j| j as usize);
    }
    Ok(())
}

/// The lengths of a side's pieces times the density there, in parts of it.
fn parts(rectangles: &[Rectangle], side: &Side) -> Vec<f64> {
    let pieces = &rectangles[side.rectangle].border[side.pieces.clone()];
    let r = &rectangles[side.rectangle];
    let c = &r.fine.connectivity;
    let density = |v: VertexId| r.density.as_slice().get(v.index()).copied();
    // A side begins at a vertex of the flow; those that were added later are as dense as the one before.
    let mut last = 1.0;
    let mut weighted = |piece: &Piece| {
        let h = c.edge_halfedge(piece.edge);
        let ends = [c.tail(h), c.head(h)];
        let [p, q] = ends.map(|v| r.fine.position[v]);
        let [before, behind] = ends.map(|v| {
            last = density(v).unwrap_or(last);
            last
        });
        distance(p, q) * (before * behind).sqrt()
    };
    let lengths: Vec<f64> = pieces.iter().map(&mut weighted).collect();
    let whole: f64 = lengths.iter().sum();
    lengths.iter().map(|length| length / whole).collect()
}

/// Where pieces begin. Sums are taken from the nearer end, so that small ones keep their digits there, and the same for both directions.
fn fractions(parts: &[f64]) -> Vec<Fractions> {
    let parts = || parts.iter().map(|&x| x.max(LEAST));
    let sum = |sum: &mut f64, part: f64| {
        let before = *sum;
        *sum += part;
        Some(before)
    };
    let before: Vec<f64> = parts().scan(0.0, sum).collect();
    let mut behind: Vec<f64> = parts()
        .rev()
        .scan(0.0, |s, part| {
            *s += part;
            Some(*s)
        })
        .collect();
    behind.reverse();
    before
        .iter()
        .zip(&behind)
        .map(|(&before, &behind)| {
            let whole = before + behind;
            let least = before.min(behind) / whole;
            match before.total_cmp(&behind) {
                std::cmp::Ordering::Less => [least, 1.0 - least],
                std::cmp::Ordering::Greater => [1.0 - least, least],
                std::cmp::Ordering::Equal => [0.5; 2],
            }
        })
        .collect()
}
