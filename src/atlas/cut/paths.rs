//! Shortest paths along edges, from a set of sources that may grow while the search goes on.
//!
//! *Enters:* a triangulation and the length of every edge; edges of infinite length and boundary edges are no
//! way. *Leaves:* of every vertex reached its distance and the halfedge by which it was reached.
//! *Guaranteed:* vertices are settled in the order of their distance, equal ones in the order of their ids, and
//! when the search has run dry the distances are those from all sources, whenever these were added.
//!
//! Several searches are made on one surface, so the ways out of every vertex are laid out in a row once:
//! walking around a vertex on the halfedges costs a jump in memory a step.

use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, HalfedgeId, VertexId, VertexVec};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// One way from a vertex to a neighbour.
#[derive(Clone, Copy)]
struct Step {
    length: f64,
    halfedge: HalfedgeId,
    head: VertexId,
}

/// The ways out of every vertex.
pub(super) struct Ways {
    /// Where the steps of a vertex begin; one more than there are vertices.
    first: Vec<usize>,
    steps: Vec<Step>,
}

impl Ways {
    pub(super) fn new(connectivity: &Connectivity, length: &EdgeVec<f64>) -> Self {
        let c = connectivity;
        let mut first = Vec::with_capacity(c.vertex_count() + 1);
        let mut steps = Vec::with_capacity(c.halfedge_count());
        first.push(0);
        for v in c.vertices() {
            // Every inner edge at `v` has an outgoing halfedge.
            for h in c.outgoing(v).filter(|&h| c.twin(h).is_some()) {
                let length = length[c.edge(h)];
                if length < f64::INFINITY {
                    steps.push(Step {
                        length,
                        halfedge: h,
                        head: c.head(h),
                    });
                }
            }
            first.push(steps.len());
        }
        Self { first, steps }
    }

    fn of(&self, v: VertexId) -> &[Step] {
        &self.steps[self.first[v.index()]..self.first[v.index() + 1]]
    }

    /// A search without sources yet.
    pub(super) fn search(&self) -> Search<'_> {
        Search {
            ways: self,
            label: VertexVec::filled(UNREACHED, self.first.len() - 1),
            queue: BinaryHeap::new(),
        }
    }
}

/// How a vertex was reached.
#[derive(Clone, Copy)]
struct Label {
    distance: f64,
    /// Points at the vertex; none at sources and where nothing came.
    by: Option<HalfedgeId>,
}

const UNREACHED: Label = Label {
    distance: f64::INFINITY,
    by: None,
};

/// A search that goes on vertex by vertex.
pub(super) struct Search<'a> {
    ways: &'a Ways,
    label: VertexVec<Label>,
    /// Non-negative floats order as their bits do; equal distances go by vertex.
    queue: BinaryHeap<Reverse<(u64, VertexId)>>,
}

impl Search<'_> {
    /// Makes a vertex known at a distance, if it was not known at a lesser one: a source at 0.
    pub(super) fn enter(&mut self, v: VertexId, distance: f64) {
        self.improve(v, distance, None);
    }

    fn improve(&mut self, v: VertexId, distance: f64, by: Option<HalfedgeId>) {
        let label = &mut self.label[v];
        if distance < label.distance {
            *label = Label { distance, by };
            self.queue.push(Reverse((distance.to_bits(), v)));
        }
    }

    /// Settles the nearest vertex that is not settled, and tells it; none when all is done.
    pub(super) fn settle(&mut self) -> Option<VertexId> {
        while let Some(Reverse((bits, v))) = self.queue.pop() {
            let distance = f64::from_bits(bits);
            if distance > self.label[v].distance {
                continue;
            }
            let ways = self.ways;
            for step in ways.of(v) {
                self.improve(step.head, distance + step.length, Some(step.halfedge));
            }
            return Some(v);
        }
        None
    }

    /// Distance from the sources; infinite where no way leads.
    pub(super) fn distance(&self, v: VertexId) -> f64 {
        self.label[v].distance
    }

    /// The halfedge by which a vertex was reached, pointing at it.
    pub(super) fn by(&self, v: VertexId) -> Option<HalfedgeId> {
        self.label[v].by
    }

    /// Forgets by which halfedge a vertex was reached.
    pub(super) fn forget_way(&mut self, v: VertexId) {
        self.label[v].by = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of squares with unit sides, each with its diagonal.
    fn strip(n: u32) -> Connectivity {
        let faces: Vec<[u32; 3]> = (0..n)
            .flat_map(|i| {
                let (a, b) = (2 * i, 2 * i + 2);
                [[a, b, b + 1], [a, b + 1, a + 1]]
            })
            .collect();
        Connectivity::from_faces(&faces, 2 * n as usize + 2).unwrap()
    }

    fn lengths(c: &Connectivity) -> EdgeVec<f64> {
        // Different everywhere, so that there are no ties.
        c.edges()
            .map(|e| 1.0 + 0.37 * ((e.index() * 7919) % 101) as f64)
            .collect()
    }

    /// Bellman and Ford's distances from several sources.
    fn brute(c: &Connectivity, length: &EdgeVec<f64>, sources: &[VertexId]) -> Vec<f64> {
        let mut d = vec![f64::INFINITY; c.vertex_count()];
        sources.iter().for_each(|v| d[v.index()] = 0.0);
        for _ in 0..c.vertex_count() {
            for e in c.edges().filter(|&e| !c.is_boundary_edge(e)) {
                let [a, b] = c.edge_vertices(e).map(VertexId::index);
                d[a] = d[a].min(d[b] + length[e]);
                d[b] = d[b].min(d[a] + length[e]);
            }
        }
        d
    }

    #[test]
    fn sources_added_late_give_the_distances_of_sources_added_early() {
        let c = strip(40);
        let mut length = lengths(&c);
        // No way through this one.
        let wall = c.edges().filter(|&e| !c.is_boundary_edge(e)).nth(30);
        length[wall.unwrap()] = f64::INFINITY;
        let ways = Ways::new(&c, &length);
        let mut search = ways.search();
        let mut sources = Vec::new();
        for source in [3, 77, 40] {
            sources.push(VertexId::new(source));
            search.enter(VertexId::new(source), 0.0);
            let mut last = 0.0;
            while let Some(v) = search.settle() {
                assert!(search.distance(v) >= last);
                last = search.distance(v);
            }
            let expected = brute(&c, &length, &sources);
            for v in c.vertices() {
                assert_eq!(search.distance(v), expected[v.index()]);
                // The way back is as long as it says, and ends at a source.
                let (mut at, mut walked) = (v, Vec::new());
                while let Some(h) = search.by(at) {
                    walked.push(length[c.edge(h)]);
                    at = c.tail(h);
                }
                let sum = walked.iter().rev().fold(0.0, |s, l| s + l);
                assert!(!expected[v.index()].is_finite() || sum == expected[v.index()]);
                assert!(!expected[v.index()].is_finite() || sources.contains(&at));
            }
        }
    }
}
