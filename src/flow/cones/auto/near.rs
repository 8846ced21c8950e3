//! Cones moved a little, along the force on them, as long as that lowers (9).
//!
//! *Enters:* cones. *Leaves:* cones that no vertex of some rings around them would suit better.
//!
//! The derivative of (9) by curvature, p = Δ⁻¹ ∂(9)/∂u, is one back-substitution for all vertices. By symmetry of the answers a cone
//! of curvature c at x feels the force −c ∇p(x), so the vertices to try are those of some rings around x where c p is least: one a ring. All
//! that are tried at once share one sweep of back-substitutions, and [`Points::moved`](super::area::Points::moved) says what each is worth;
//! the rings shrink down to the neighbours when none helps. This moves cones as Li et al. 2023 do, with sets of candidates in place of a line search.

use super::arrangement::{Arrangement, Place, Rule, STEPS, answers};
use super::placement::Placement;
use crate::flow::cones::spread;
use crate::geometry::ids::VertexId;
use crate::geometry::mesh::Mesh;

/// Gain of ln(F + 1), relative to itself, that a move must have.
const LEAST_GAIN: f64 = 1e-4;
/// Rings around a cone that are tried at once, each half as wide as the one before.
const RINGS: usize = 3;
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
    /// Moves the cones, starting with rings of `radius`, in square roots of the area.
    pub(super) fn near(
        &mut self,
        mesh: &Mesh,
        mut now: Arrangement,
        rule: Rule,
        radius: f64,
    ) -> Arrangement {
        let area = super::picture::total_area(mesh);
        let mut radius = vec![radius * area.sqrt(); now.places.len()];
        loop {
            let force = self.force(&now);
            let candidates = self.candidates(mesh, &now, &force, &mut radius);
            if candidates.is_empty() {
                let curvature = now.weighed.curvature;
                return self.arrange(now.places, &curvature, rule, STEPS);
            }
            let vertices: Vec<usize> = candidates.iter().map(|c| c.vertex).collect();
            let places = self.places(&vertices);
            let tried: Vec<(Candidate, Place)> = candidates.into_iter().zip(places).collect();
            for some in tried.chunk_by(|a, b| a.0.cone == b.0.cone) {
                let cone = some[0].0.cone;
                match self.best_move(&now, some, rule) {
                    Some((next, reached)) => {
                        now = next;
                        radius[cone] = reached;
                    }
                    None => radius[cone] *= 0.5f64.powi(RINGS as i32),
                }
            }
        }
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

    /// The best of some moves of one cone, and the radius of its ring; `None` where none gains enough.
    fn best_move(
        &self,
        now: &Arrangement,
        tried: &[(Candidate, Place)],
        rule: Rule,
    ) -> Option<(Arrangement, f64)> {
        let goal = now.value() * (1.0 - LEAST_GAIN);
        let promise = |(candidate, place): &(Candidate, Place)| {
            let mut with = answers(&now.places);
            let old = std::mem::replace(&mut with[candidate.cone], &place.answer);
            self.points()
                .moved(&now.weighed, &with, candidate.cone, old, rule.limits())
        };
        // Another cone may have come to the same vertex.
        let is_free = |v: usize| now.places.iter().all(|p| p.vertex != v);
        let free = tried.iter().filter(|one| is_free(one.0.vertex));
        let promised = free.map(|one| (promise(one), one));
        let best = promised.reduce(|a, b| if b.0 < a.0 { b } else { a })?;
        let (candidate, place) = best.1;
        if best.0 >= goal {
            return None;
        }
        let mut places = now.places.clone();
        places[candidate.cone] = place.clone();
        let next = self.arrange(places, now.curvature(), rule, MOVED_STEPS);
        (next.value() < goal).then_some((next, candidate.radius))
    }
}
