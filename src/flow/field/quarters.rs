//! Cones that a grid cannot have are given quarter turns from vertices near them.
//!
//! *Enters:* a field, the least cone angle. *Leaves:* the field turned by π/2 across the edges of paths between two vertices, which takes a quarter turn
//! from one and gives it to the other, and its signature. *Guaranteed:* every vertex has at least the least angle, turnings of
//! loops are those of the changed field. *Not guaranteed:* that the field stays smooth across the paths.
//!
//! Two quads around a vertex share two edges however often they are divided, so in a grid interior cones have three quarter turns or more. One of two quarter
//! turns, at a sharp tip or by chance, becomes two of three, or one beside one of five takes the turn from there.

use super::{CrossField, FieldError};
use crate::flow::holonomy::DualLoops;
use crate::flow::signature::{FULL_TURN, Infeasible, Signature};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, FaceVec, HalfedgeId, VertexId, VertexVec};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::f64::consts::FRAC_PI_2;

/// A cone of more than a full turn is worth a way this many times as long as that to a flat vertex, which would become a cone.
const CONE_PREFERENCE: f64 = 8.0;

impl CrossField {
    /// The signature with at least `least` quarter turns at every vertex, and how many quarter turns were moved for it. Of a torus whose
    /// signature no metric has, the flat one: no cones, no turning. `length`: of the edges of the field's triangulation, any unit; the other
    /// arguments as for [`signature`](Self::signature).
    pub fn grid_signature(
        &mut self,
        connectivity: &Connectivity,
        length: &EdgeVec<f64>,
        angle: &FaceVec<[f64; 3]>,
        loops: &DualLoops,
        least: i64,
    ) -> Result<(Signature, usize), FieldError> {
        let c = connectivity;
        let mut signature = self.signature(c, angle, loops)?;
        let mut moved = 0;
        for v in c.vertices() {
            while signature.cone[v] < least {
                let way = way_from_donor(c, length, &signature.cone, v, least).ok_or(
                    FieldError::TooFewVertices {
                        vertices: c.vertex_count(),
                        least,
                    },
                )?;
                for &h in &way {
                    self.matching[h] -= FRAC_PI_2;
                    if let Some(t) = c.twin(h) {
                        self.matching[t] += FRAC_PI_2;
                    }
                    signature.cone[c.tail(h)] -= 1;
                    signature.cone[c.head(h)] += 1;
                }
                moved += 1;
            }
        }
        if moved > 0 {
            signature = self.signature(c, angle, loops)?;
        }
        let on_torus = signature.check(c, loops);
        if let Err(Infeasible::FlatTorus { .. } | Infeasible::TwoConesOnTorus { .. }) = on_torus {
            signature.cone.as_mut_slice().fill(FULL_TURN);
            signature.turning.fill(0);
        }
        Ok((signature, moved))
    }
}

/// Halfedges from a vertex that has a quarter turn to spare to `to`, along the shortest way; `None` where no vertex has.
fn way_from_donor(
    c: &Connectivity,
    length: &EdgeVec<f64>,
    cone: &VertexVec<i64>,
    to: VertexId,
    least: i64,
) -> Option<Vec<HalfedgeId>> {
    // Distance and the halfedge that leads one vertex nearer, of what was reached.
    let mut reached: BTreeMap<VertexId, (f64, Option<HalfedgeId>)> = BTreeMap::new();
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
        if v != to && cone[v] > least {
            let factor = if cone[v] > FULL_TURN {
                1.0
            } else {
                CONE_PREFERENCE
            };
            let cost = factor * distance;
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, v));
            }
        }
        for h in c.outgoing(v) {
            // The halfedge before comes in from a neighbour, one an edge on a closed surface.
            let h = c.prev(h);
            let (from, through) = (c.tail(h), distance + length[c.edge(h)]);
            if reached.get(&from).is_none_or(|r| through < r.0) {
                reached.insert(from, (through, Some(h)));
                heap.push(Reverse((through.to_bits(), from)));
            }
        }
    }
    let mut v = best?.1;
    let mut way = Vec::new();
    while let Some(&(_, Some(h))) = reached.get(&v) {
        way.push(h);
        v = c.head(h);
    }
    Some(way)
}
