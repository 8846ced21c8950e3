//! Diagonals of the flow's cells, drawn on a rectangle's faces.
//!
//! *Enters:* a layout, and the overlay that lies on it. *Leaves:* the overlay with finer faces, each of which lies in one face of the layout. *Guaranteed:* what is linear on the
//! layout's faces, and takes none of them to its mirror image, does so with the overlay's. *Not guaranteed:* diagonals in cells so thin that rounding hides on which side their corners lie.
//!
//! Where the mirror of a doubled surface passes through a face, what is left of it is a cell of four or five corners. In the flat metric it is convex, and how it is triangulated does not
//! matter; a map to a rectangle need not keep it convex, and faces across a corner that points inwards would be turned over.

use crate::atlas::overlay::{Carrier, Layout};
use crate::atlas::patches::apex;
use crate::atlas::plane::{distance, doubled_area};
use crate::geometry::ids::{EdgeId, FaceId, FaceVec, HalfedgeId, HalfedgeVec, VertexId, VertexVec};
use crate::geometry::subdivision::Subdivision;
use std::collections::BTreeMap;

/// Where a diagonal crosses an edge.
struct Crossing {
    edge: EdgeId,
    /// From the tail of the edge's halfedge.
    fraction: f64,
    /// Along the diagonal.
    along: f64,
}

/// Draws all of them. `carrier` says where its vertices lie, and gets those of new ones.
pub(super) fn draw(fine: &mut Subdivision, layout: &Layout, carrier: &mut VertexVec<Carrier>) {
    let c = &layout.connectivity;
    let diagonals: Vec<EdgeId> = c.edges().filter(|&e| !layout.may_cut[e]).collect();
    // Flat coordinates in every cell that has one.
    let mut at: HalfedgeVec<Option<[f64; 2]>> = HalfedgeVec::filled(None, c.halfedge_count());
    for &e in &diagonals {
        lay(layout, c.face(c.edge_halfedge(e)), &mut at);
    }
    let mut cells: BTreeMap<u32, Vec<FaceId>> = BTreeMap::new();
    let mut cell: FaceVec<u32> = FaceVec::default();
    let faces: Vec<FaceId> = fine.connectivity.faces().collect();
    for f in faces {
        let corners = fine.connectivity.face_halfedges(f);
        let carriers = corners.map(|h| layout.carrier(h));
        cell.push(layout.cell[c.face(carriers[0].halfedge)]);
        let known = carriers.map(|carrier| at[carrier.halfedge]);
        if known.iter().all(Option::is_some) {
            cells.entry(cell[f]).or_default().push(f);
            for (h, carrier) in corners.into_iter().zip(carriers) {
                fine.corner[h].uv = carrier.place(c, |h| at[h].unwrap_or_default());
            }
        }
    }
    for e in diagonals {
        let h = c.edge_halfedge(e);
        let ends = [h, c.next(h)];
        let here = layout.cell[c.face(h)];
        let line = ends.map(|h| at[h].unwrap_or_default());
        let ends = ends.map(|h| c.tail(h));
        let faces = cells.entry(here).or_default();
        let found = crossings(fine, faces, &cell, here, ends, line);
        for x in found.unwrap_or_default() {
            let before = fine.connectivity.face_count();
            fine.split_edge(x.edge, x.fraction);
            for f in before..fine.connectivity.face_count() {
                cell.push(here);
                faces.push(FaceId::new(f));
            }
            carrier.push(Carrier {
                halfedge: h,
                fraction: x.along,
            });
        }
    }
    for corner in fine.corner.as_mut_slice() {
        corner.uv = [0.0; 2];
    }
}

/// Lays the faces of a cell in the plane, if that is not done.
fn lay(layout: &Layout, first: FaceId, at: &mut HalfedgeVec<Option<[f64; 2]>>) {
    let c = &layout.connectivity;
    let start = c.corner_halfedge(first, 0);
    if at[start].is_some() {
        return;
    }
    let length = |h| layout.length[c.edge(h)];
    let mut waiting = vec![(start, [0.0; 2], [length(start), 0.0])];
    while let Some((h, tail, head)) = waiting.pop() {
        let (next, prev) = (c.next(h), c.prev(h));
        let apex = apex(tail, head, [h, next, prev].map(length));
        for (h, p) in [(h, tail), (next, head), (prev, apex)] {
            at[h] = Some(p);
        }
        for (h, p, q) in [(h, tail, head), (next, head, apex), (prev, apex, tail)] {
            let across = c.twin(h).filter(|_| !layout.may_cut[c.edge(h)]);
            if let Some(t) = across.filter(|&t| at[t].is_none()) {
                waiting.push((t, q, p));
            }
        }
    }
}

/// The edges that the line between two corners of a cell crosses, in order; nothing where there is an edge between them, or no way is found.
fn crossings(
    fine: &Subdivision,
    faces: &[FaceId],
    cell: &FaceVec<u32>,
    here: u32,
    ends: [VertexId; 2],
    line: [[f64; 2]; 2],
) -> Option<Vec<Crossing>> {
    let c = &fine.connectivity;
    let uv = |h: HalfedgeId| fine.corner[h].uv;
    let side = |h: HalfedgeId| doubled_area([line[0], line[1], uv(h)]);
    let is_end = |h: HalfedgeId, k: usize| c.tail(h) == ends[k] && uv(h) == line[k];
    let corners = faces.iter().flat_map(|&f| c.face_halfedges(f));
    // The face through which the line leaves its first end.
    let mut starts = corners.filter(|&h| is_end(h, 0));
    let start = starts.find(|&h| side(c.next(h)) < 0.0 && side(c.prev(h)) > 0.0)?;
    // The halfedge that is crossed, in the face before it, from right to left.
    let mut at = c.next(start);
    let mut found = Vec::new();
    let mut last = 0.0;
    for _ in faces {
        let (p, q) = (at, c.next(at));
        let t = side(p) / (side(p) - side(q));
        let place: [f64; 2] = std::array::from_fn(|i| uv(p)[i] + t * (uv(q)[i] - uv(p)[i]));
        let along = distance(line[0], place) / distance(line[0], line[1]);
        let edge = c.edge(at);
        let is_in_order = t > 0.0 && t < 1.0 && along > last && along < 1.0;
        if !is_in_order {
            return None;
        }
        last = along;
        found.push(Crossing {
            edge,
            fraction: if c.edge_halfedge(edge) == at {
                t
            } else {
                1.0 - t
            },
            along,
        });
        let t = c.twin(at).filter(|&t| cell[c.face(t)] == here)?;
        let apex = c.prev(t);
        if is_end(apex, 1) {
            return Some(found);
        }
        // Seen from this face, `t` runs from left to right.
        at = match side(apex) {
            s if s > 0.0 => c.next(t),
            s if s < 0.0 => c.prev(t),
            _ => return None,
        };
    }
    None
}
