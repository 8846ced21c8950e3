//! Cones that a grid cannot have are given quarter turns from vertices near them.
//!
//! *Enters:* a field, the least cone angle. *Leaves:* the field turned by π/2 across the edges of paths between two vertices, which takes a quarter turn
//! from one and gives it to the other, and its signature. *Guaranteed:* every vertex has at least the least angle, turnings of
//! loops are those of the changed field. *Not guaranteed:* that the field stays smooth across the paths.
//!
//! Two quads around a vertex share two edges however often they are divided, so in a grid interior cones have three quarter turns or more. One of two quarter
//! turns, at a sharp tip or by chance, becomes two of three, or one beside one of five takes the turn from there.

use super::{CrossField, FieldError};
use crate::flow::looped::LoopedSurface;
use crate::flow::signature::{FULL_TURN, Infeasible, Signature};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, FaceVec, HalfedgeId, VertexId, VertexVec};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::f64::consts::FRAC_PI_2;

/// Least angle of a corner on the boundary, quarter turns.
const LEAST_AT_BORDER: i64 = 1;
/// A cone of more than a full turn is worth a way this many times as long as that to a flat vertex, which would become a cone.
const CONE_PREFERENCE: f64 = 8.0;

/// One edge of a way between vertices.
#[derive(Clone, Copy, Debug)]
struct Step {
    halfedge: HalfedgeId,
    /// Whether the way goes as the halfedge does. Along the boundary there is one halfedge only.
    is_along: bool,
}

/// What cone angles are, and what they are to be. Where features meet a vertex, each of its sectors is a vertex here.
struct Angles<'a> {
    c: &'a Connectivity,
    /// The vertex of every sector.
    vertex: VertexVec<VertexId>,
    /// Angle of every sector, quarter turns.
    cone: VertexVec<i64>,
    /// Angle of every vertex.
    total: VertexVec<i64>,
    /// Number of sectors of every vertex.
    sectors: VertexVec<u32>,
    /// True for vertices on the border of the surface.
    is_border: VertexVec<bool>,
    /// Least angle of a vertex inside.
    least: i64,
}

impl CrossField {
    /// The signature with at least `least` quarter turns at every vertex inside and one at every vertex of the border and in every sector between features, and how many quarter turns were
    /// moved for it. Of a torus whose signature no metric has, the flat one: no cones, no turning. `angle`: corner angles of the surface's own part, radians.
    pub fn grid_signature(
        &mut self,
        surface: &LoopedSurface,
        angle: &FaceVec<[f64; 3]>,
        least: i64,
    ) -> Result<(Signature, usize), FieldError> {
        let c = surface.own();
        let length = surface.own_length();
        let mut angles = Angles::new(surface, self.cones(c, angle)?, least);
        let mut moved = 0;
        for v in c.vertices() {
            while angles.lacks(v) {
                let way = angles.way_from_donor(&length, v);
                let way = way.ok_or(FieldError::TooFewVertices {
                    vertices: c.vertex_count(),
                    least,
                })?;
                for step in way {
                    self.turn(c, step);
                    angles.turn(step);
                }
                moved += 1;
            }
        }
        let mut signature = self.signature(surface, angle)?;
        let on_torus = signature.check(surface.connectivity, &surface.loops);
        if let Err(Infeasible::FlatTorus { .. } | Infeasible::TwoConesOnTorus { .. }) = on_torus {
            signature.cone.as_mut_slice().fill(FULL_TURN);
            signature.turning.fill(0);
        }
        Ok((signature, moved))
    }

    /// Takes a quarter turn from where a step begins and gives it to where it ends.
    fn turn(&mut self, c: &Connectivity, step: Step) {
        let h = step.halfedge;
        let turn = if step.is_along { FRAC_PI_2 } else { -FRAC_PI_2 };
        self.matching[h] -= turn;
        if let Some(t) = c.twin(h) {
            self.matching[t] += turn;
        }
    }
}

impl<'a> Angles<'a> {
    fn new(surface: &'a LoopedSurface<'_>, cone: VertexVec<i64>, least: i64) -> Self {
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
        let mut is_feature = EdgeVec::filled(false, surface.connectivity.edge_count());
        surface
            .glued
            .iter()
            .flatten()
            .for_each(|&e| is_feature[e] = true);
        let mut is_border = VertexVec::filled(false, vertex.len());
        for h in c.halfedges().filter(|&h| c.twin(h).is_none()) {
            if !is_feature[surface.connectivity.edge(h)] {
                is_border[vertex[c.tail(h)]] = true;
                is_border[vertex[c.head(h)]] = true;
            }
        }
        Self {
            c,
            vertex,
            cone,
            total,
            sectors,
            is_border,
            least,
        }
    }

    fn turn(&mut self, step: Step) {
        let (tail, head) = (self.c.tail(step.halfedge), self.c.head(step.halfedge));
        let by = if step.is_along { 1 } else { -1 };
        for (v, by) in [(tail, -by), (head, by)] {
            self.cone[v] += by;
            self.total[self.vertex[v]] += by;
        }
    }

    /// True where a side of the border or of a feature makes a corner: not at the end of a feature inside.
    fn is_corner(&self, v: VertexId) -> bool {
        let of = self.vertex[v];
        self.c.is_boundary_vertex(v) && (self.sectors[of] > 1 || self.is_border[of])
    }

    /// What is missing if a sector's angle were lower by `by`.
    fn lacks_after(&self, v: VertexId, by: i64) -> bool {
        let of = self.vertex[v];
        let least = if self.is_corner(v) {
            LEAST_AT_BORDER
        } else {
            self.least
        };
        self.cone[v] - by < least || (!self.is_border[of] && self.total[of] - by < self.least)
    }

    fn lacks(&self, v: VertexId) -> bool {
        self.lacks_after(v, 0)
    }

    /// The angle without a cone.
    fn flat(&self, v: VertexId) -> i64 {
        match self.is_corner(v) {
            true => FULL_TURN / 2,
            false => FULL_TURN,
        }
    }

    /// The shortest way from a vertex that has a quarter turn to spare to `to`; `None` where no vertex has.
    fn way_from_donor(&self, length: &EdgeVec<f64>, to: VertexId) -> Option<Vec<Step>> {
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
            if v != to && !self.lacks_after(v, 1) {
                let factor = match self.cone[v] > self.flat(v) {
                    true => 1.0,
                    false => CONE_PREFERENCE,
                };
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
                let from = if step.is_along { c.tail(h) } else { c.head(h) };
                if reached.get(&from).is_none_or(|r| through < r.0) {
                    reached.insert(from, (through, Some(step)));
                    heap.push(Reverse((through.to_bits(), from)));
                }
            }
        }
        let mut v = best?.1;
        let mut way = Vec::new();
        while let Some(&(_, Some(step))) = reached.get(&v) {
            way.push(step);
            let h = step.halfedge;
            v = if step.is_along { c.head(h) } else { c.tail(h) };
        }
        Some(way)
    }
}
