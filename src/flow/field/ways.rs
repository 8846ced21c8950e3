//! Angles of cones in quarter turns, and ways along which quarter turns go from vertex to vertex.
//!
//! *Enters:* a surface and its cone angles. *Leaves:* the cheapest way from one of some vertices to another. *Guaranteed:* a way
//! follows edges of the surface's own part; the same way for the same input.

use crate::flow::looped::LoopedSurface;
use crate::flow::signature::FULL_TURN;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, HalfedgeId, VertexId, VertexVec};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

/// Least angle of a corner on the boundary, quarter turns.
const LEAST_AT_BORDER: i64 = 1;

/// One edge of a way between vertices.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub halfedge: HalfedgeId,
    /// Whether the way goes as the halfedge does. Along the boundary there is one halfedge only.
    pub is_along: bool,
}

/// What cone angles are, and what they are to be. Where features meet a vertex, each of its sectors is a vertex here.
pub(super) struct Angles<'a> {
    pub c: &'a Connectivity,
    /// The vertex of every sector.
    vertex: VertexVec<VertexId>,
    /// Angle of every sector, quarter turns.
    pub cone: VertexVec<i64>,
    /// Angle of every vertex.
    total: VertexVec<i64>,
    /// Number of sectors of every vertex.
    sectors: VertexVec<u32>,
    /// True for vertices on the border of the surface.
    is_border: VertexVec<bool>,
    /// Least angle of a vertex inside.
    least: i64,
    /// Number of cones inside the surface.
    pub inside: usize,
}

impl<'a> Angles<'a> {
    pub fn new(surface: &'a LoopedSurface<'_>, cone: VertexVec<i64>, least: i64) -> Self {
        let c = surface.own();
        let vertex: VertexVec<VertexId> = match surface.sector {
            Some(vertex) => vertex.clone(),
            None => c.vertices().collect(),
        };
        let mut total = VertexVec::filled(0, vertex.len());
        let mut sectors = VertexVec::filled(0, vertex.len());
        for (v, &of) in vertex.enumerate() {
            total[of] += cone[v];
            sectors[of] += 1;
        }
        let is_feature = surface.is_feature();
        let mut is_border = VertexVec::filled(false, vertex.len());
        for h in c.halfedges().filter(|&h| c.twin(h).is_none()) {
            if !is_feature[surface.connectivity.edge(h)] {
                is_border[vertex[c.tail(h)]] = true;
                is_border[vertex[c.head(h)]] = true;
            }
        }
        let inside = total.enumerate();
        let is_cone = |&(v, &total): &(VertexId, &i64)| total != FULL_TURN && !is_border[v];
        // Numbers beyond those of vertices have no sectors.
        let inside = inside.filter(|at| sectors[at.0] > 0 && is_cone(at));
        Self {
            inside: inside.count(),
            c,
            vertex,
            cone,
            total,
            sectors,
            is_border,
            least,
        }
    }

    pub fn turn(&mut self, step: Step) {
        let (tail, head) = (self.c.tail(step.halfedge), self.c.head(step.halfedge));
        let by = if step.is_along { 1 } else { -1 };
        for (v, by) in [(tail, -by), (head, by)] {
            let of = self.vertex[v];
            let is_cone = |total: i64| usize::from(!self.is_border[of] && total != FULL_TURN);
            self.inside -= is_cone(self.total[of]);
            self.cone[v] += by;
            self.total[of] += by;
            self.inside += is_cone(self.total[of]);
        }
    }

    /// True where a side of the border or of a feature makes a corner: not at the end of a feature inside.
    pub fn is_corner(&self, v: VertexId) -> bool {
        let of = self.vertex[v];
        self.c.is_boundary_vertex(v) && (self.sectors[of] > 1 || self.is_border[of])
    }

    /// What is missing if a sector's angle were lower by `by`.
    pub fn lacks_after(&self, v: VertexId, by: i64) -> bool {
        let of = self.vertex[v];
        let least = if self.is_corner(v) {
            LEAST_AT_BORDER
        } else {
            self.least
        };
        self.cone[v] - by < least || (!self.is_border[of] && self.total[of] - by < self.least)
    }

    pub fn lacks(&self, v: VertexId) -> bool {
        self.lacks_after(v, 0)
    }

    /// By how much a sector's angle, and with it that of its vertex, is more than without a cone: 0 where one of both is not, or one is more and the other less.
    pub fn excess(&self, v: VertexId) -> i64 {
        let of = self.vertex[v];
        let flat = |is_half: bool| match is_half {
            true => FULL_TURN / 2,
            false => FULL_TURN,
        };
        let own = self.cone[v] - flat(self.is_corner(v));
        let whole = self.total[of] - flat(self.is_border[of]);
        match own.signum() == whole.signum() {
            true => own.signum() * own.abs().min(whole.abs()),
            false => 0,
        }
    }

    /// True on the border of the surface, where a corner is no cone inside.
    pub fn is_on_border(&self, v: VertexId) -> bool {
        self.is_border[self.vertex[v]]
    }

    /// Where a step begins.
    pub fn start(&self, step: Step) -> VertexId {
        match step.is_along {
            true => self.c.tail(step.halfedge),
            false => self.c.head(step.halfedge),
        }
    }

    /// The cheapest way to `to` from a vertex to which `factor` gives a number; a way costs that times its length, which is at most `reach`, and both are in
    /// the unit of `length`. With its cost; `None` where there is no such vertex.
    pub fn way(
        &self,
        length: &EdgeVec<f64>,
        to: VertexId,
        reach: f64,
        factor: impl Fn(VertexId) -> Option<f64>,
    ) -> Option<(f64, Vec<Step>)> {
        let c = self.c;
        // Distance and the step that leads one vertex nearer, of what was reached.
        let mut reached: BTreeMap<VertexId, (f64, Option<Step>)> = BTreeMap::new();
        let mut heap = BinaryHeap::new();
        reached.insert(to, (0.0, None));
        // Positive numbers are ordered like their bits.
        heap.push(Reverse((0u64, to)));
        let mut best: Option<(f64, VertexId)> = None;
        while let Some(Reverse((bits, v))) = heap.pop() {
            let distance = f64::from_bits(bits);
            if reached.get(&v).is_some_and(|r| distance > r.0) {
                continue;
            }
            if best.is_some_and(|(cost, _)| distance >= cost) {
                break;
            }
            if let Some(factor) = factor(v).filter(|_| v != to) {
                let cost = factor * distance;
                if best.is_none_or(|(least, _)| cost < least) {
                    best = Some((cost, v));
                }
            }
            // The halfedge before comes in from a neighbour; on the boundary there is one that only goes out.
            let coming_in = c.outgoing(v).map(|h| Step {
                halfedge: c.prev(h),
                is_along: true,
            });
            let going_out = c.outgoing(v).filter(|&h| c.twin(h).is_none());
            let going_out = going_out.map(|halfedge| Step {
                halfedge,
                is_along: false,
            });
            for step in coming_in.chain(going_out) {
                let h = step.halfedge;
                let through = distance + length[c.edge(h)];
                let from = self.start(step);
                let is_nearer = reached.get(&from).is_none_or(|r| through < r.0);
                if is_nearer && through <= reach {
                    reached.insert(from, (through, Some(step)));
                    heap.push(Reverse((through.to_bits(), from)));
                }
            }
        }
        let (cost, mut v) = best?;
        let mut way = Vec::new();
        while let Some(&(_, Some(step))) = reached.get(&v) {
            way.push(step);
            let h = step.halfedge;
            v = if step.is_along { c.head(h) } else { c.tail(h) };
        }
        Some((cost, way))
    }
}
