//! Curves seen from the edges that they cross, and a loop over curves that runs in parallel.

use super::PositionsError;
use crate::flow::correspondence::Curves;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeId, HalfedgeId};
use crate::parallel;

/// Crossings of every edge of a triangulation, in order from the tail of its `edge_halfedge`.
pub(super) struct Crossed {
    first: Vec<u32>,
    crossing: Vec<u32>,
}

impl Crossed {
    /// Sorts the crossings of `curves` by the edge of `current` that they lie on.
    pub(super) fn new(curves: &Curves, current: &Connectivity) -> Result<Crossed, PositionsError> {
        let mut first = vec![0u32; current.edge_count() + 1];
        for x in &curves.crossing {
            if x.halfedge.index() >= current.halfedge_count() {
                return Err(PositionsError::Sizes);
            }
            first[current.edge(x.halfedge).index() + 1] += 1;
        }
        for e in 0..current.edge_count() {
            first[e + 1] += first[e];
        }
        let mut crossing = vec![u32::MAX; curves.crossing.len()];
        for (i, x) in curves.crossing.iter().enumerate() {
            let e = current.edge(x.halfedge);
            let (start, end) = (first[e.index()], first[e.index() + 1]);
            let error = PositionsError::Ranks { edge: e.index() };
            if x.rank >= end - start {
                return Err(error);
            }
            let place = if x.halfedge == current.edge_halfedge(e) {
                start + x.rank
            } else {
                end - 1 - x.rank
            };
            if std::mem::replace(&mut crossing[place as usize], i as u32) != u32::MAX {
                return Err(error);
            }
        }
        Ok(Crossed { first, crossing })
    }

    /// Numbers of the crossings on one edge.
    pub(super) fn on(&self, e: EdgeId) -> &[u32] {
        &self.crossing[self.first[e.index()] as usize..self.first[e.index() + 1] as usize]
    }
}

/// The twin, where the surface is closed.
pub(super) fn twin(surface: &Connectivity, h: HalfedgeId) -> Result<HalfedgeId, PositionsError> {
    surface.twin(h).ok_or(PositionsError::Open)
}

/// Calls `work` for the items `0..count` in blocks that run in parallel; it appends what it finds about an item to
/// a list, and the lists are returned in order. The result does not depend on the number of threads.
pub(super) fn gather<T: Send, S>(
    count: usize,
    scratch: impl Fn() -> S + Sync,
    work: impl Fn(usize, &mut S, &mut Vec<T>) -> Result<(), PositionsError> + Sync,
) -> Result<Vec<T>, PositionsError> {
    const BLOCK: usize = 2048;
    let blocks = parallel::map_numbers(count.div_ceil(BLOCK), |block| {
        let mut found = Vec::new();
        let mut scratch = scratch();
        for item in block * BLOCK..count.min((block + 1) * BLOCK) {
            work(item, &mut scratch, &mut found)?;
        }
        Ok::<_, PositionsError>(found)
    });
    let mut all = Vec::new();
    for block in blocks {
        all.append(&mut block?);
    }
    Ok(all)
}
