//! Cone angles handed out to corners: the maximum flow of [`super`], and what its residual graph says.

use super::ROOM;
use super::angles::nearest_to_equilateral;
use super::constraint::Constraint;
use crate::flow::ricci::GAUSS_BONNET_TOLERANCE;
use crate::geometry::ids::{VertexId, VertexVec};
use std::collections::VecDeque;

/// Vertex sets that may break (6): if any does, one of these. In turn the least set with the least slack, the vertices
/// that lead not to the root, and those that the root leads to; empty and whole ones are left out.
///
/// The root is the free boundary, or vertex 0. A set closed under residual arcs has the least slack; where that is zero
/// and the set is neither empty nor whole, it leaves the root out, and then cannot reach it, or holds
/// it, and then holds all that the root reaches.
pub(super) fn candidates(constraint: &Constraint) -> Vec<VertexVec<bool>> {
    let c = constraint.connectivity();
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

    let mut wanted = vec![0.0; vertices];
    for v in c.vertices().filter(|&v| constraint.is_prescribed(v)) {
        wanted[v.index()] = constraint.wanted(v);
    }
    let missing = constraint.face_room() * faces as f64 - wanted.iter().sum::<f64>();
    if free.is_some() {
        wanted[root] = missing.max(0.0);
    } else if missing.abs() <= GAUSS_BONNET_TOLERANCE * constraint.face_room() {
        // Rounding of Gauss–Bonnet must not gather at one vertex.
        wanted
            .iter_mut()
            .for_each(|w| *w += missing / vertices as f64);
    }

    let angle = starting_angles(constraint, &wanted, node);
    let mut handed_out = vec![0.0; vertices];
    let mut arcs = Vec::with_capacity(vertices + 4 * faces);
    for h in c.halfedges() {
        handed_out[node(c.tail(h))] += angle[h.index()];
    }
    for (v, &all) in wanted.iter().enumerate() {
        arcs.push((source, v, all, handed_out[v].min(all)));
    }
    for h in c.halfedges() {
        let face = vertices + c.face(h).index();
        let room = constraint.corner_room(h);
        arcs.push((node(c.tail(h)), face, room, angle[h.index()]));
    }
    for f in 0..faces {
        let held: f64 = angle[3 * f..3 * f + 3].iter().sum();
        let room = constraint.face_room();
        arcs.push((vertices + f, sink, room, held.min(room)));
    }
    let mut network = Network::new(sink + 1, &arcs);
    network.saturate(source, sink);

    let set = |value: bool, reached: &[bool]| -> VertexVec<bool> {
        c.vertices()
            .map(|v| reached[node(v)] == value)
            .collect::<Vec<_>>()
            .into()
    };
    let ends = [source, sink];
    let starved: Vec<bool> = network
        .levels(source, None)
        .iter()
        .map(|l| l.is_some())
        .collect();
    [
        set(true, &starved),
        set(false, &network.connected(root, Way::Towards, ends)),
        set(true, &network.connected(root, Way::From, ends)),
    ]
    .into_iter()
    .filter(|set| set.iter().any(|&x| x) && !set.iter().all(|&x| x))
    .collect()
}

/// Angles within all bounds, most of them final: those nearest to equilateral, cut off at 0 and at what the corner holds, then
/// scaled down where a vertex hands out or a face gets too much.
fn starting_angles(
    constraint: &Constraint,
    wanted: &[f64],
    node: impl Fn(VertexId) -> usize,
) -> Vec<f64> {
    let c = constraint.connectivity();
    // Any start will do; without one only time is lost.
    let Ok(mut angle) = nearest_to_equilateral(constraint) else {
        return vec![0.0; c.halfedge_count()];
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
        if handed_out[v] > wanted[v] {
            angle[h.index()] *= wanted[v] / handed_out[v];
        }
        held[c.face(h).index()] += angle[h.index()];
    }
    for h in c.halfedges() {
        let sum = held[c.face(h).index()];
        if sum > constraint.face_room() {
            angle[h.index()] *= constraint.face_room() / sum;
        }
    }
    angle
}

/// Direction of a search.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    From,
    Towards,
}

/// A flow network with two directed arcs for each that is given: there and back.
struct Network {
    /// Where the arcs of each node begin in `arcs`.
    start: Vec<usize>,
    /// Directed arcs, node by node.
    arcs: Vec<Arc>,
}

#[derive(Clone, Copy)]
struct Arc {
    head: usize,
    /// The same arc in the other direction.
    back: usize,
    /// Capacity that is left, radians.
    room: f64,
}

impl Network {
    /// Arcs are (from, to, capacity, flow to begin with).
    fn new(nodes: usize, given: &[(usize, usize, f64, f64)]) -> Self {
        let mut start = vec![0; nodes + 1];
        for &(from, to, ..) in given {
            start[from + 1] += 1;
            start[to + 1] += 1;
        }
        for x in 0..nodes {
            start[x + 1] += start[x];
        }
        let mut next = start.clone();
        let none = Arc {
            head: 0,
            back: 0,
            room: 0.0,
        };
        let mut arcs = vec![none; 2 * given.len()];
        for &(from, to, capacity, flow) in given {
            let (there, back) = (next[from], next[to]);
            next[from] += 1;
            next[to] += 1;
            arcs[there] = Arc {
                head: to,
                back,
                room: capacity - flow,
            };
            arcs[back] = Arc {
                head: from,
                back: there,
                room: flow,
            };
        }
        Self { start, arcs }
    }

    fn arcs_of(&self, x: usize) -> &[Arc] {
        &self.arcs[self.start[x]..self.start[x + 1]]
    }

    /// Arcs with room from one node to each, fewest first; no farther than to `until`.
    fn levels(&self, from: usize, until: Option<usize>) -> Vec<Option<u32>> {
        let mut level = vec![None; self.start.len() - 1];
        level[from] = Some(0);
        let mut queue = VecDeque::from([from]);
        while let Some(x) = queue.pop_front() {
            if until.is_some_and(|t| level[t].is_some() && level[x] >= level[t]) {
                break;
            }
            for arc in self.arcs_of(x) {
                if level[arc.head].is_none() && arc.room > ROOM {
                    level[arc.head] = level[x].map(|l: u32| l + 1);
                    queue.push_back(arc.head);
                }
            }
        }
        level
    }

    /// Nodes that arcs with room lead to from `root`, or from which they lead to it, never through `without`.
    fn connected(&self, root: usize, way: Way, without: [usize; 2]) -> Vec<bool> {
        let mut found = vec![false; self.start.len() - 1];
        found[root] = true;
        let mut stack = vec![root];
        while let Some(x) = stack.pop() {
            for arc in self.arcs_of(x) {
                let room = match way {
                    Way::From => arc.room,
                    Way::Towards => self.arcs[arc.back].room,
                };
                if room > ROOM && !found[arc.head] && !without.contains(&arc.head) {
                    found[arc.head] = true;
                    stack.push(arc.head);
                }
            }
        }
        found
    }

    /// Completes the flow to a maximum one (Dinic: blocking flows along shortest paths).
    fn saturate(&mut self, source: usize, sink: usize) {
        loop {
            let level = self.levels(source, Some(sink));
            if level[sink].is_none() {
                return;
            }
            let mut next = self.start.clone();
            let mut path: Vec<usize> = Vec::new();
            loop {
                let x = path.last().map_or(source, |&arc| self.arcs[arc].head);
                if x == sink {
                    let rooms = path.iter().map(|&arc| self.arcs[arc].room);
                    let flow = rooms.fold(f64::INFINITY, f64::min);
                    for &arc in &path {
                        let back = self.arcs[arc].back;
                        self.arcs[arc].room -= flow;
                        self.arcs[back].room += flow;
                    }
                    let full = path.iter().position(|&arc| self.arcs[arc].room <= ROOM);
                    path.truncate(full.unwrap_or(0));
                } else if next[x] < self.start[x + 1] {
                    let arc = self.arcs[next[x]];
                    if arc.room > ROOM && level[arc.head] == level[x].map(|l| l + 1) {
                        path.push(next[x]);
                    } else {
                        next[x] += 1;
                    }
                } else {
                    // A dead end: go back and do not come again.
                    if path.pop().is_none() {
                        break;
                    }
                    let back = path.last().map_or(source, |&arc| self.arcs[arc].head);
                    next[back] += 1;
                }
            }
        }
    }
}
