//! The neighbours of all vertices in one array: fields are gone through many times, and each time around the halfedges costs several times as much.
//!
//! *Enters:* the connectivity. *Leaves:* for every vertex the vertices that edges join it to, in order around it.

use crate::geometry::connectivity::Connectivity;

/// Neighbours vertex after vertex.
pub(super) struct Neighbours {
    /// Where those of each vertex start, and an end.
    start: Vec<u32>,
    all: Vec<u32>,
}

impl Neighbours {
    pub(super) fn new(connectivity: &Connectivity) -> Self {
        let mut start = vec![0];
        let mut all = Vec::with_capacity(2 * connectivity.edge_count());
        for v in connectivity.vertices() {
            all.extend(connectivity.neighbours(v).map(|w| w.index() as u32));
            start.push(all.len() as u32);
        }
        Self { start, all }
    }

    /// Number of vertices.
    pub(super) fn len(&self) -> usize {
        self.start.len() - 1
    }

    /// Those of one vertex.
    pub(super) fn of(&self, vertex: usize) -> impl Iterator<Item = usize> + '_ {
        let [from, to] = [self.start[vertex], self.start[vertex + 1]];
        let around = &self.all[from as usize..to as usize];
        around.iter().map(|&w| w as usize)
    }
}
