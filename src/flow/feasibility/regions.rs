//! The sets that break (6), by connected regions.

use super::constraint::{Constraint, Region};
use super::transport;
use super::violation::Side;
use crate::geometry::ids::{VertexId, VertexVec};

impl Constraint<'_> {
    /// The connected regions that break (6) together; none exactly where (6) holds.
    ///
    /// They are those of the *least* set with the least slack; where the least slack is zero, of one set that has it.
    pub fn offending_regions(&mut self) -> Vec<Region> {
        for set in transport::candidates(self) {
            let regions = self.connected_regions(&set);
            if !regions.is_empty() {
                return regions;
            }
        }
        Vec::new()
    }

    /// Splits a set into regions, or its complement where that is smaller or the set holds a free boundary.
    fn connected_regions(&mut self, set: &VertexVec<bool>) -> Vec<Region> {
        let c = self.connectivity();
        let holds_free = (c.vertices()).any(|v| set[v] && !self.is_prescribed(v));
        let leaves_free = (c.vertices()).any(|v| !set[v] && !self.is_prescribed(v));
        let size = set.iter().filter(|&&x| x).count();
        let complement = holds_free || (!leaves_free && 2 * size > set.len());
        let side = match complement {
            true => Side::Above,
            false => Side::Below,
        };
        let mut waiting: VertexVec<bool> = set.iter().map(|&x| x != complement).collect();
        let mut regions = Vec::new();
        for start in c.vertices() {
            if !std::mem::take(&mut waiting[start]) {
                continue;
            }
            let mut vertices = vec![start];
            let mut next = 0;
            while let Some(&v) = vertices.get(next) {
                next += 1;
                // Vertices that share a face share an edge.
                for w in c.neighbours(v) {
                    if std::mem::take(&mut waiting[w]) {
                        vertices.push(w);
                    }
                }
            }
            vertices.sort_unstable();
            if vertices.len() < c.vertex_count() {
                regions.extend(self.region(vertices, side));
            }
        }
        regions
    }

    /// The set as a region, where it breaks (6).
    fn region(&mut self, vertices: Vec<VertexId>, side: Side) -> Option<Region> {
        let [upper, lower] = self.exact_slacks(&vertices);
        let slack = match side {
            Side::Below => upper,
            Side::Above => lower,
        };
        (slack <= 0).then(|| Region {
            vertices,
            side,
            slack: self.exact().radians(slack),
        })
    }
}
