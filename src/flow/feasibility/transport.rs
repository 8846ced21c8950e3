//! Cone angles handed out to corners: the maximum flow of [`super`], and what its residual graph says.
//!
//! All amounts are integers in the unit of [`Exact`](super::exact::Exact), so the flow is a maximum one and arcs have room or have none,
//! without any tolerance. What float64 knows only saves time: the flow starts from angles that nearly fit everywhere
//! ([`starting_angles`]), and is completed in two goes. The first sends what is more than rounding. Then the rounding of all
//! nodes is gathered along spanning trees of arcs with plenty of room ([`Network::gather`]) at one node a tree, where
//! most of it cancels, since ΣΘ is exact: else it would be sent from everywhere to everywhere. The second go, to the last unit,
//! has hardly anything left to do.

use super::angles::nearest_to_equilateral;
use super::constraint::Constraint;
use super::network::Network;
use crate::geometry::ids::{VertexId, VertexVec};

/// An imbalance of a node below π times this is rounding of the start.
const ROUNDING: f64 = 1e-13;

/// Vertex sets that may break (6): if any does, one of these. In turn the least set with the least slack, the vertices
/// that lead not to the root, and those that the root leads to; empty and whole ones are left out.
///
/// The root is the free boundary, or vertex 0. A set closed under residual arcs has the least slack; where that is zero
/// and the set is neither empty nor whole, it leaves the root out, and then cannot reach it, or holds
/// it, and then holds all that the root reaches.
pub(super) fn candidates(constraint: &Constraint) -> Vec<VertexVec<bool>> {
    let c = constraint.connectivity();
    let exact = constraint.exact();
    let (vertices, faces) = (c.vertex_count(), c.face_count());
    if vertices < 2 {
        return Vec::new();
    }
    let free = c.vertices().find(|&v| !constraint.is_prescribed(v));
    let root = free.map_or(0, VertexId::index);
    let node = |v: VertexId| match constraint.is_prescribed(v) {
        true => v.index(),
        false => root,
    };
    let [source, sink] = [vertices + faces, vertices + faces + 1];

    let mut wanted = exact.wanted.as_slice().to_vec();
    if free.is_some() {
        let missing = exact.whole * faces as i128 - wanted.iter().sum::<i128>();
        wanted[root] = missing.max(0);
    }

    let angle = starting_angles(constraint, &wanted, node);
    let mut handed_out = vec![0; vertices];
    let mut held = vec![0; faces];
    let mut arcs = Vec::with_capacity(vertices + 4 * faces);
    for h in c.halfedges() {
        handed_out[node(c.tail(h))] += angle[h.index()];
        held[c.face(h).index()] += angle[h.index()];
    }
    for (v, &all) in wanted.iter().enumerate() {
        arcs.push((source, v, all, handed_out[v]));
    }
    for h in c.halfedges() {
        let face = vertices + c.face(h).index();
        let room = constraint.exact_room(h);
        arcs.push((node(c.tail(h)), face, room, angle[h.index()]));
    }
    for (f, &held) in held.iter().enumerate() {
        arcs.push((vertices + f, sink, exact.whole, held));
    }
    let mut network = Network::new(source, sink, &arcs);
    let rounding = (exact.whole as f64 * ROUNDING) as i128;
    network.saturate(rounding);
    network.gather(rounding);
    network.saturate(0);

    let set = |value: bool, reached: &[bool]| -> VertexVec<bool> {
        c.vertices().map(|v| reached[node(v)] == value).collect()
    };
    [
        set(true, &network.starved()),
        set(false, &network.leading_to(root)),
        set(true, &network.reached_from(root)),
    ]
    .into_iter()
    .filter(|set| set.iter().any(|&x| x) && !set.iter().all(|&x| x))
    .collect()
}

/// Angles within all bounds, most of them final but for rounding: those nearest to equilateral, cut off at 0 and at what the
/// corner holds, then scaled down where a vertex hands out or a face gets too much.
fn starting_angles(
    constraint: &Constraint,
    wanted: &[i128],
    node: impl Fn(VertexId) -> usize,
) -> Vec<i128> {
    let c = constraint.connectivity();
    let exact = constraint.exact();
    // Any start will do; without one only time is lost.
    let Ok(mut angle) = nearest_to_equilateral(constraint) else {
        return vec![0; c.halfedge_count()];
    };
    let mut handed_out = vec![0.0; wanted.len()];
    for h in c.halfedges() {
        let within = angle[h.index()].max(0.0).min(constraint.corner_room(h));
        angle[h.index()] = within;
        handed_out[node(c.tail(h))] += within;
    }
    let mut held = vec![0.0; c.face_count()];
    for h in c.halfedges() {
        let v = node(c.tail(h));
        let all = exact.radians(wanted[v]);
        if handed_out[v] > all {
            angle[h.index()] *= all / handed_out[v];
        }
        held[c.face(h).index()] += angle[h.index()];
    }
    for h in c.halfedges() {
        let sum = held[c.face(h).index()];
        if sum > constraint.face_room() {
            angle[h.index()] *= constraint.face_room() / sum;
        }
    }
    // Now exactly: what rounding put beyond a bound is cut off.
    let mut left_at = wanted.to_vec();
    let mut left_in = vec![exact.whole; c.face_count()];
    let mut fitted = Vec::with_capacity(angle.len());
    for h in c.halfedges() {
        let (v, f) = (node(c.tail(h)), c.face(h).index());
        let bound = left_at[v].min(left_in[f]).min(constraint.exact_room(h));
        let own = exact.units(angle[h.index()]).clamp(0, bound.max(0));
        left_at[v] -= own;
        left_in[f] -= own;
        fitted.push(own);
    }
    fitted
}
