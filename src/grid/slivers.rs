//! Faces that are too thin on the grid, or turned over, before the map is relaxed.
//!
//! *Enters:* a [`GridMap`] that is one to one but for a few thin faces, whose vertices rounding has put on the wrong side. *Leaves:* the same with these vertices moved, so that every face is as thick as
//! asked for if it can be. The surface stays: only the map to the grid changes, by less than thin faces are long. *Not guaranteed:* that it succeeds.

use super::map::{Freedom, GridMap};
use super::triangle::{is_turned_over, thickness};
use crate::geometry::ids::{FaceId, VertexId};
use std::collections::BTreeSet;

/// Rounds over the vertices of thin faces.
const MOST_ROUNDS: usize = 50;
/// Distances that a vertex is tried to be moved by: halves of the size of its star.
const HALVINGS: i32 = 24;
const DIRECTIONS: [[f64; 2]; 8] = [
    [1.0, 0.0],
    [0.7, 0.7],
    [0.0, 1.0],
    [-0.7, 0.7],
    [-1.0, 0.0],
    [-0.7, -0.7],
    [0.0, -1.0],
    [0.7, -0.7],
];

/// Moves vertices of faces that are thinner than `thick`; see the module docs. The number of faces without area that are left.
pub(crate) fn thicken(map: &mut GridMap, thick: f64) -> usize {
    let is_thin = |map: &GridMap, f: FaceId| thickness(map.corners(f)) < thick;
    let c = &map.sheet.fine.connectivity;
    let mut thin: Vec<FaceId> = c.faces().filter(|&f| is_thin(map, f)).collect();
    for _ in 0..MOST_ROUNDS {
        let c = &map.sheet.fine.connectivity;
        let vertices: BTreeSet<VertexId> = thin.iter().flat_map(|&f| c.face_vertices(f)).collect();
        let mut has_moved = false;
        let mut touched: BTreeSet<FaceId> = thin.iter().copied().collect();
        for v in vertices {
            if map.freedom[v] == Freedom::Fixed {
                continue;
            }
            if move_away(map, v, thick) {
                has_moved = true;
                let c = &map.sheet.fine.connectivity;
                touched.extend(c.outgoing(v).map(|h| c.face(h)));
            }
        }
        thin = touched.into_iter().filter(|&f| is_thin(map, f)).collect();
        if thin.is_empty() || !has_moved {
            break;
        }
    }
    let c = &map.sheet.fine.connectivity;
    let over = |f: &FaceId| is_turned_over(map.corners(*f));
    c.faces().filter(over).count()
}

/// Moves a vertex to where the thinnest of its faces is thicker. False where there is no such place.
fn move_away(map: &mut GridMap, v: VertexId, thick: f64) -> bool {
    let c = &map.sheet.fine.connectivity;
    let first = map.sheet.at(c.vertex_halfedge(v));
    // The other two corners of every face around, in the frame of the first.
    let mut star = Vec::new();
    for (h, turns, shift) in map.frames(v) {
        let others = [c.next(h), c.prev(h)].map(|h| {
            let [x, y] = map.sheet.at(h);
            let p = [x - shift[0] as f64, y - shift[1] as f64];
            super::complex::turned(p, 4 - turns)
        });
        star.push(others);
    }
    let least = |p: [f64; 2]| {
        let of_face = star.iter().map(|&[q, r]| thickness([p, q, r]));
        of_face.fold(f64::INFINITY, f64::min)
    };
    let size = star
        .iter()
        .flatten()
        .map(|q| (q[0] - first[0]).hypot(q[1] - first[1]));
    let size = size.fold(0.0, f64::max);
    let (mut best, mut place) = (least(first), None);
    if best >= thick {
        return false;
    }
    // No farther than needed.
    for k in (1..=HALVINGS).rev() {
        let radius = size * 0.5f64.powi(k);
        for [x, y] in DIRECTIONS {
            let p = match map.freedom[v] {
                Freedom::Along(0) if y == 0.0 => [first[0] + radius * x, first[1]],
                Freedom::Along(1) if x == 0.0 => [first[0], first[1] + radius * y],
                Freedom::Free => [first[0] + radius * x, first[1] + radius * y],
                _ => continue,
            };
            let there = least(p).min(2.0 * thick);
            if there > best * 1.000001 + 1e-300 {
                (best, place) = (there, Some(p));
            }
        }
    }
    let Some(place) = place else { return false };
    map.put(v, place);
    true
}
