//! The neighbours of all vertices in one array: fields are gone through many times, and each time around the halfedges costs several times as much.
//!
//! *Enters:* the mesh. *Leaves:* for every vertex the vertices that edges join it to, in order around it, and how far away they are; which vertices are near
//! one along the edges.

use crate::flow::cones::spread::Front;
use crate::geometry::ids::VertexId;
use crate::geometry::mesh::{Mesh, distance};
use std::collections::BinaryHeap;

/// Neighbours vertex after vertex.
pub(super) struct Neighbours {
    /// Where those of each vertex start, and an end.
    start: Vec<u32>,
    all: Vec<u32>,
    /// Length of the edge to each, source units.
    length: Vec<f64>,
}

impl Neighbours {
    pub(super) fn new(mesh: &Mesh) -> Self {
        let connectivity = &mesh.connectivity;
        let mut start = vec![0];
        let mut all = Vec::with_capacity(2 * connectivity.edge_count());
        let mut length = Vec::with_capacity(all.capacity());
        for v in connectivity.vertices() {
            for w in connectivity.neighbours(v) {
                all.push(w.index() as u32);
                length.push(distance(mesh.positions[v], mesh.positions[w]));
            }
            start.push(all.len() as u32);
        }
        Self { start, all, length }
    }

    /// Number of vertices.
    pub(super) fn len(&self) -> usize {
        self.start.len() - 1
    }

    fn range(&self, vertex: usize) -> std::ops::Range<usize> {
        self.start[vertex] as usize..self.start[vertex + 1] as usize
    }

    /// Those of one vertex.
    pub(super) fn of(&self, vertex: usize) -> impl Iterator<Item = usize> + '_ {
        let around = &self.all[self.range(vertex)];
        around.iter().map(|&w| w as usize)
    }

    /// The vertices within a distance along the edges of a vertex, nearest first, with their distances; itself left out. `least`: a number for every vertex, infinite
    /// before and after.
    pub(super) fn within(
        &self,
        radius: f64,
        source: usize,
        least: &mut [f64],
    ) -> Vec<(usize, f64)> {
        let mut heap = BinaryHeap::from([Front {
            distance: 0.0,
            vertex: VertexId::new(source),
        }]);
        least[source] = 0.0;
        let mut found = Vec::new();
        while let Some(front) = heap.pop() {
            let at = front.vertex.index();
            if front.distance > least[at] {
                continue;
            }
            found.push((at, front.distance));
            let edges = self.of(at).zip(&self.length[self.range(at)]);
            for (vertex, length) in edges {
                let distance = front.distance + length;
                if distance <= radius && distance < least[vertex] {
                    least[vertex] = distance;
                    heap.push(Front {
                        distance,
                        vertex: VertexId::new(vertex),
                    });
                }
            }
        }
        // Whatever was reached was found in the end.
        for (vertex, _) in &found {
            least[*vertex] = f64::INFINITY;
        }
        found.retain(|(vertex, _)| *vertex != source);
        found
    }
}
