//! Cones moved a little, along the force on them, as long as that lowers (9).
//!
//! *Enters:* cones. *Leaves:* cones that no vertex of some rings around them would suit better.
//!
//! The derivative of (9) by curvature, p = Δ⁻¹ ∂(9)/∂u, is one back-substitution for all vertices. By symmetry of the answers a cone
//! of curvature c at x feels the force −c ∇p(x), so the vertices to try are those of some rings around x where c p is least: one a ring. All
//! that are tried at once share one sweep of back-substitutions, and [`cells`](super::cells) say what each is worth; what they all come to is
//! weighed on all vertices. The rings shrink down to the neighbours when none helps. This moves cones as Li et al. 2023 do, with sets of candidates in place of a line search.

use super::arrangement::{Arrangement, Rule, STEPS};
use super::cells::{Coarse, Set};
use super::placement::Placement;
use crate::flow::cones::spread;
use crate::geometry::ids::VertexId;
use crate::geometry::mesh::Mesh;

/// Gain of ln(F + 1), relative to itself, that a move must have.
const LEAST_GAIN: f64 = 1e-4;
/// The same of a round of moves after which another follows.
const ROUND_GAIN: f64 = 1e-3;
/// Rings around a cone that are tried at once, each half as wide as the one before.
const RINGS: usize = 3;
/// What becomes of the radius where none of them helped.
const SHRUNK: f64 = 0.125;
/// Newton steps for the curvatures after a move, after which they change little.
const MOVED_STEPS: usize = 1;

/// A vertex to which a cone might move.
struct Candidate {
    /// Which cone.
    cone: usize,
    vertex: usize,
    /// Outer radius of its ring, source units.
    radius: f64,
}

impl Placement<'_> {
    /// Moves the cones, with rings from the first to the least radius, in square roots of the area.
    pub(super) fn near(
        &mut self,
        mesh: &Mesh,
        mut now: Arrangement,
        rule: Rule,
        radii: [f64; 2],
    ) -> Arrangement {
        let size = super::picture::total_area(mesh).sqrt();
        let [first, least] = radii.map(|radius| radius * size);
        let mut radius = vec![first; now.places.len()];
        loop {
            for at_rest in radius.iter_mut().filter(|radius| **radius < least) {
                *at_rest = 0.0;
            }
            let force = self.force(&now);
            let candidates = self.candidates(mesh, &now, &force, &mut radius);
            if candidates.is_empty() {
                break;
            }
            let vertices: Vec<usize> = candidates.iter().map(|c| c.vertex).collect();
            let count = now.places.len();
            let mut places = now.places.clone();
            places.extend(self.places(&vertices));
            let coarse = Coarse::new(self, &places, rule);
            let mut set = coarse.weigh((0..count).collect(), now.curvature(), MOVED_STEPS);
            // The places of the candidates follow those of the cones.
            let tried: Vec<(Candidate, usize)> = candidates.into_iter().zip(count..).collect();
            let mut has_moved = false;
            for some in tried.chunk_by(|a, b| a.0.cone == b.0.cone) {
                let cone = some[0].0.cone;
                let taken = |v: usize| set.members.iter().any(|&m| places[m].vertex == v);
                let free = some.iter().filter(|one| !taken(one.0.vertex));
                match best_move(&coarse, &set, free) {
                    Some((next, reached)) => {
                        (set, has_moved) = (next, true);
                        radius[cone] = reached;
                    }
                    None => radius[cone] *= SHRUNK,
                }
            }
            if !has_moved {
                continue;
            }
            let places = set.members.iter().map(|&m| places[m].clone()).collect();
            let next = self.arrange(places, &set.weighed.curvature, rule, MOVED_STEPS);
            if next.value() < now.value() {
                let goal = now.value() * (1.0 - ROUND_GAIN);
                now = next;
                if now.value() > goal {
                    break;
                }
            } else {
                // The cells promised too much.
                radius.iter_mut().for_each(|r| *r *= SHRUNK);
            }
        }
        let curvature = now.weighed.curvature;
        self.arrange(now.places, &curvature, rule, STEPS)
    }

    /// One vertex a ring for every cone that is not at rest; cones whose rings are empty come to rest.
    fn candidates(
        &self,
        mesh: &Mesh,
        now: &Arrangement,
        force: &[f64],
        radius: &mut [f64],
    ) -> Vec<Candidate> {
        let mut candidates = Vec::new();
        let taken = |v: usize| now.places.iter().any(|p| p.vertex == v);
        for (cone, place) in now.places.iter().enumerate() {
            // Until there is a vertex to try, or no ring is left.
            while radius[cone] > 0.0 {
                let around = spread::around(mesh, VertexId::new(place.vertex), radius[cone]);
                if around.is_empty() {
                    radius[cone] = 0.0;
                    break;
                }
                let before = candidates.len();
                let mut outer = radius[cone];
                for _ in 0..RINGS {
                    let worth = |v: usize| now.curvature()[cone] * force[v];
                    let best = around
                        .iter()
                        .filter(|(_, d)| (0.5 * outer..=outer).contains(d))
                        .map(|(v, _)| v.index())
                        .filter(|&v| self.allowed[v] && !taken(v))
                        .reduce(|v, w| if worth(w) < worth(v) { w } else { v });
                    candidates.extend(best.map(|vertex| Candidate {
                        cone,
                        vertex,
                        radius: outer,
                    }));
                    outer *= 0.5;
                }
                if candidates.len() > before {
                    break;
                }
                radius[cone] = outer;
            }
        }
        candidates
    }
}

/// The best of some moves of one cone, and the radius of its ring; `None` where none gains enough.
fn best_move<'t>(
    coarse: &Coarse,
    set: &Set,
    tried: impl Iterator<Item = &'t (Candidate, usize)>,
) -> Option<(Set, f64)> {
    let goal = set.weighed.value * (1.0 - LEAST_GAIN);
    let promised = tried.map(|one| (coarse.moved(set, one.0.cone, one.1), one));
    let best = promised.reduce(|a, b| if b.0 < a.0 { b } else { a })?;
    let (candidate, place) = best.1;
    if best.0 >= goal {
        return None;
    }
    let mut members = set.members.clone();
    members[candidate.cone] = *place;
    let next = coarse.weigh(members, &set.weighed.curvature, MOVED_STEPS);
    (next.weighed.value < goal).then_some((next, candidate.radius))
}
