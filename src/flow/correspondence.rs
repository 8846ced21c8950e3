//! Which edges of a fixed triangulation cross which edges of one that is being flipped: integers only.
//!
//! *Enters:* a triangulation (the *base*) and the flips of a copy of it (the *current* one). *Leaves:* for every base
//! edge, as a curve on the surface, the sequence of current edges that it crosses. *Guaranteed:* exact combinatorics, in minimal
//! position (no bigon), whatever the lengths were that led to the flips; an error where the integers grow too large. *Not
//! guaranteed:* anything where a flip was not told, which [`Correspondence::trace`] mostly but not always finds out.
//!
//! Normal coordinates with roundabouts (Gillespie, Sharp, Crane 2021). Surfaces with boundary are allowed: a boundary edge is
//! never flipped, so it stays a base edge and nothing crosses it.
//!
//! Within a face the pieces of base edges ("arcs") are of two kinds: an arc *cuts* a corner, or it comes *from* a corner and
//! leaves through the opposite side. Seen from the tail, a side is met first by the arcs that cut the corner of its tail, then by
//! those from the opposite corner, then by those that cut the corner of its head.

mod trace;

pub use trace::Followed;

use crate::geometry::connectivity::{Connectivity, Flip};
use crate::geometry::ids::{EdgeId, EdgeVec, HalfedgeId, HalfedgeVec, VertexVec};

/// Stored coordinates are at most this, so that sums of a few fit an `i64`.
const LIMIT: i64 = 1 << 60;

/// Stands for a current edge that is a base edge.
const COINCIDENT: i64 = -1;

/// Integers beside a triangulation that is being flipped.
#[derive(Clone, Debug, PartialEq)]
pub struct Correspondence {
    /// A current edge: how many times base edges cross it; −1 where it *is* a base edge. Never 0: all edges that cross no
    /// base edge are base edges.
    normal: EdgeVec<i64>,
    /// A current halfedge: which of the base halfedges around its tail comes first at or after it, counterclockwise. Counted
    /// from `base.vertex_halfedge`; at a boundary vertex the edge that closes the fan is the last.
    roundabout: HalfedgeVec<u32>,
    /// Number of base edges at a vertex, loops twice.
    valence: VertexVec<u32>,
    /// The first thing that went wrong; the integers are frozen from there on.
    failure: Option<CorrespondenceError>,
}

/// Why there are no curves.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CorrespondenceError {
    /// A number of crossings exceeded 2⁶⁰ during a flip.
    #[error("edge {edge} is crossed more than 2^60 times")]
    Overflow {
        /// The edge that was flipped.
        edge: EdgeId,
    },
    /// The curves have too many crossings for 32-bit positions, or for the memory.
    #[error("there are {count} crossings, which is too many to list")]
    TooManyCrossings {
        /// Number of crossings.
        count: u128,
    },
    /// The triangulations given have other numbers of vertices, edges or faces than the correspondence.
    #[error("the triangulation is not the one of this correspondence: it has another size")]
    OtherSize,
    /// The integers describe no curves on the triangulations given.
    #[error("the integers contradict the triangulations: {0}")]
    Inconsistent(&'static str),
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
    /// The crossings on every current edge: `crossing[first[e]..first[e + 1]]` are positions in `self.crossing`, ordered from
    /// the tail of `current.edge_halfedge(e)`. `current` is the triangulation that the curves were traced on. A crossing
    /// through the edge's other halfedge counts its rank from the other end: it stands at `n − 1 − rank` of `n`.
    pub fn by_current_edge(&self, current: &Connectivity) -> (Vec<u32>, Vec<u32>) {
        let mut first = vec![0u32; current.edge_count() + 1];
        for c in &self.crossing {
            first[current.edge(c.halfedge).index() + 1] += 1;
        }
        for e in 0..current.edge_count() {
            first[e + 1] += first[e];
        }
        let mut crossing = vec![0u32; self.crossing.len()];
        for (i, c) in self.crossing.iter().enumerate() {
            let e = current.edge(c.halfedge);
            let (begin, end) = (first[e.index()], first[e.index() + 1]);
            let place = if current.edge_halfedge(e) == c.halfedge {
                begin.checked_add(c.rank)
            } else {
                end.checked_sub(c.rank).and_then(|p| p.checked_sub(1))
            };
            // Always there for traced curves; hand-made ones may have any rank.
            if let Some(slot) = place.and_then(|p| crossing.get_mut(p as usize)) {
                *slot = i as u32;
            }
        }
        (first, crossing)
    }
}

impl Correspondence {
    /// The current triangulation is still the base.
    pub fn identity(base: &Connectivity) -> Self {
        let mut roundabout = HalfedgeVec::filled(0, base.halfedge_count());
        let mut valence = VertexVec::filled(0, base.vertex_count());
        for v in base.vertices() {
            for h in base.outgoing(v) {
                roundabout[h] = valence[v];
                valence[v] += 1;
            }
            valence[v] += u32::from(base.is_boundary_vertex(v));
        }
        Correspondence {
            normal: EdgeVec::filled(COINCIDENT, base.edge_count()),
            roundabout,
            valence,
            failure: None,
        }
    }

    /// Follows one flip, which the current triangulation has just undergone and is now `after`. Constant time. After an
    /// overflow nothing more is followed, and [`Self::trace`] returns that error.
    ///
    /// ```text
    ///          c                    c
    ///        /   \                / | \
    ///      a ----- b      →      a  |  b
    ///        \   /                \ | /
    ///          d                    d
    /// ```
    /// The arcs that cross `ab`, counted from `a`, leave the upper face through `ca`, then to `c`, then through `bc`; they leave the
    /// lower one through `ad`, then to `d`, then through `db`. The two sortings are by intervals, so the number of arcs of each
    /// pair of kinds is the overlap of two intervals.
    pub fn flipped(&mut self, after: &Connectivity, flip: &Flip) {
        if self.failure.is_some() {
            return;
        }
        if !self.has_size_of(after) {
            self.failure = Some(CorrespondenceError::OtherSize);
            return;
        }
        let edge = after.edge(flip.h);
        let ab = self.normal[edge];
        let [ca, ad, db, bc] = flip.moves.map(|(_, to)| self.normal[after.edge(to)]);
        let upper = Arcs::new([bc, ca, ab]); // corners a, b, c
        let lower = Arcs::new([db, ad, ab]); // corners a, b, d
        // Ends of the intervals: from 0 through ca, then to c, then through bc; likewise below.
        let (to_c, past_c) = (upper.cut[0], upper.cut[0] + upper.from[2]);
        let (to_d, past_d) = (lower.cut[0], lower.cut[0] + lower.from[2]);

        // What crosses dc: what stays in one old face but separates c, or d, from ab or comes from a or b; what runs
        // through opposite sides; ab itself.
        let mut dc = upper.cut[2] + upper.from[0] + upper.from[1];
        dc += lower.cut[2] + lower.from[0] + lower.from[1];
        dc += (to_c - past_d).max(0) + (to_d - past_c).max(0);
        dc += i64::from(ab == COINCIDENT);
        if dc > LIMIT {
            self.failure = Some(CorrespondenceError::Overflow { edge });
            return;
        }
        // Crossed by no base edge means that it is one: a base edge from d straight to c.
        self.normal[edge] = if dc == 0 { COINCIDENT } else { dc };

        // Base halfedges around d counterclockwise from db to before dc: db itself, and arcs from d that leave through bc.
        // Around c from ca to before cd: ca itself, and arcs from c that leave through ad.
        let around_d = i64::from(db == COINCIDENT) + (past_d - to_d.max(past_c)).max(0);
        let around_c = i64::from(ca == COINCIDENT) + (past_c.min(to_d) - to_c).max(0);
        let [r_ca, r_ad, r_db, r_bc] = flip.moves.map(|(from, _)| self.roundabout[from]);
        for ((_, to), r) in flip.moves.into_iter().zip([r_ca, r_ad, r_db, r_bc]) {
            self.roundabout[to] = r;
        }
        for (h, r, past) in [(flip.h, r_db, around_d), (flip.t, r_ca, around_c)] {
            let valence = i64::from(self.valence[after.tail(h)]);
            self.roundabout[h] = ((i64::from(r) + past) % valence) as u32;
        }
    }

    /// Number of crossings of base edges with current edges, all edges together.
    pub fn crossings(&self) -> Result<u128, CorrespondenceError> {
        self.failure.clone().map_or(Ok(()), Err)?;
        Ok(self.normal.iter().map(|&n| n.max(0) as u128).sum())
    }

    /// Number of crossings on one current edge; 0 where it is a base edge.
    pub fn crossings_on(&self, edge: EdgeId) -> u64 {
        self.normal[edge].max(0) as u64
    }

    /// True where the current edge is a base edge, though not necessarily the one of that number.
    pub fn is_base_edge(&self, edge: EdgeId) -> bool {
        self.normal[edge] == COINCIDENT
    }

    fn has_size_of(&self, connectivity: &Connectivity) -> bool {
        connectivity.edge_count() == self.normal.len()
            && connectivity.halfedge_count() == self.roundabout.len()
            && connectivity.vertex_count() == self.valence.len()
    }
}

/// The arcs in one face, by corner.
#[derive(Clone, Copy)]
struct Arcs {
    /// Arcs that cut the corner.
    cut: [i64; 3],
    /// Arcs from the corner to the opposite side; not zero at one corner at most, since such arcs would cross. Base edges
    /// along a side are not counted.
    from: [i64; 3],
}

impl Arcs {
    /// From the coordinates of the sides, at `k` the one opposite corner `k`.
    fn new(opposite: [i64; 3]) -> Arcs {
        let n = opposite.map(|n| n.max(0));
        // How much the two sides at corner k have more than the opposite one.
        let excess = [n[1] + n[2] - n[0], n[2] + n[0] - n[1], n[0] + n[1] - n[2]];
        let from = excess.map(|x| (-x).max(0));
        let cut = [
            (excess[0].max(0) - from[1] - from[2]) / 2,
            (excess[1].max(0) - from[2] - from[0]) / 2,
            (excess[2].max(0) - from[0] - from[1]) / 2,
        ];
        Arcs { cut, from }
    }
}

#[cfg(test)]
mod tests;
