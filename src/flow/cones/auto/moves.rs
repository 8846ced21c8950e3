//! Cones moved on the surface.
//!
//! *Enters:* cones. *Leaves:* as many, at vertices nearby where the objective is lower.
//!
//! A cone of curvature c at x feels the force −c ∇p(x), p = ∂J/∂K, so the vertices to which it may move a little are those of some rings
//! around x where c p is least, a few a ring, narrower and narrower rings. Because J is convex in the curvature, a move from x to y gains at most
//! c (p(x) − p(y)): most places need not be looked at.

use super::placement::Placement;
use super::pool::{Cones, LEAST_GAIN, Pool, Rule};
use crate::geometry::ids::VertexId;
use crate::geometry::mesh::{norm, sub, triangle_area};

/// Outer radii of the rings that cones move on, in square roots of the area.
pub(super) const RADII: [f64; 3] = [0.24, 0.07, 0.02];
/// Rings around a cone that are tried at once, each half as wide as the one before.
const RINGS: usize = 3;
/// Vertices of a ring that are tried, those first where the force is least, …
const DIRECTIONS: usize = 2;
/// … none nearer to another than this, in outer radii.
const APART: f64 = 0.7;
/// Rings that are tried at once at most, but one for each cone.
const ALL_RINGS: usize = 96;

impl Placement<'_> {
    /// Moves cones on rings of some radii around them.
    pub(super) fn approach(&mut self, mut now: Cones, radii: &[f64], rule: Rule) -> Cones {
        let size = self.area().sqrt();
        for &radius in radii {
            now = self.moved(now, radius * size, rule);
        }
        now
    }

    /// One round of moves of all cones.
    fn moved(&mut self, now: Cones, radius: f64, rule: Rule) -> Cones {
        let u = self.log_scale_of(&now.vertices, &now.curvature);
        let force = self.force(&u);
        let worth = LEAST_GAIN * self.cost(&u);
        let count = now.vertices.len();
        let rings = (ALL_RINGS / count.max(1)).clamp(1, RINGS);
        let mut places = now.vertices.clone();
        let mut owner: Vec<usize> = (0..count).collect();
        let mut taken: std::collections::BTreeSet<usize> = places.iter().copied().collect();
        let mut least = vec![f64::INFINITY; self.neighbours.len()];
        for (cone, (&v, c)) in now.vertices.iter().zip(&now.curvature).enumerate() {
            let mut around = self.neighbours.within(radius, v, &mut least);
            // The nearest vertices may be farther away than that.
            if around.is_empty() {
                let ring = self.neighbours.of(v);
                around = ring.map(|w| (w, 0.75 * radius)).collect();
            }
            let mut outer = radius;
            for ring in 0..rings {
                // The last is a disk.
                let inner = if ring + 1 == rings { 0.0 } else { 0.5 * outer };
                let on = around.iter().filter(|(_, d)| (inner..=outer).contains(d));
                let open = on
                    .map(|(w, _)| *w)
                    .filter(|w| self.allowed[*w] && !taken.contains(w));
                let may_gain = |w: &usize| c * (force[v] - force[*w]) > worth;
                let mut open: Vec<usize> = open.filter(may_gain).collect();
                for _ in 0..DIRECTIONS {
                    let lowest =
                        |a: usize, b: usize| if c * force[b] < c * force[a] { b } else { a };
                    let Some(best) = open.iter().copied().reduce(lowest) else {
                        break;
                    };
                    taken.insert(best);
                    places.push(best);
                    owner.push(cone);
                    let at = self.mesh.positions[VertexId::new(best)];
                    let is_apart = |w: &usize| {
                        let there = self.mesh.positions[VertexId::new(*w)];
                        norm(sub(there, at)) > APART * outer
                    };
                    open.retain(is_apart);
                }
                outer *= 0.5;
            }
        }
        if places.len() == count {
            return now;
        }
        self.keep(&now.vertices);
        let pool = Pool::new(self, places, &u);
        let set = pool.weigh((0..count).collect(), &now.curvature, rule);
        let may = |i: usize, j: usize| owner[i] == owner[j];
        let set = pool.exchange(set, rule, may);
        pool.cones(&set)
    }

    fn area(&self) -> f64 {
        let faces = self.connectivity.faces();
        faces
            .map(|f| triangle_area(self.mesh.face_positions(f)))
            .sum()
    }
}
