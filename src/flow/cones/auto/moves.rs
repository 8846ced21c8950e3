//! Cones moved until the area distortion (9) is least.
//!
//! *Enters:* cones that keep the variance of the log scale low. *Leaves:* cones whose (9), in the linear picture, no move that is tried
//! lowers.
//!
//! (9) is no quadratic function, so gains are not known for every vertex at once. Two searches in turn: [`near`](super::near) and
//! [`far`](super::far).

use super::arrangement::{Arrangement, Rule, STEPS};
use super::far::{LEAST_GAIN, Pool, far};
use super::placement::Placement;
use crate::geometry::mesh::Mesh;

/// Rounds of far and near moves.
const ROUNDS: usize = 3;
/// First radius of the rings, in square roots of the area.
const FIRST_RADIUS: f64 = 0.15;
/// The same where cones are all but placed.
const LAST_RADIUS: f64 = 0.02;

impl Placement<'_> {
    /// Moves the cones at `vertices`; `curvature` is where their curvatures start.
    pub(super) fn lower_distortion(
        &mut self,
        mesh: &Mesh,
        vertices: &[usize],
        curvature: &[f64],
        rule: Rule,
    ) -> Arrangement {
        let places = self.places(vertices);
        let now = self.arrange(places, curvature, rule, STEPS);
        if vertices.is_empty() {
            return now;
        }
        let mut pool = Pool::new(self, mesh);
        let mut now = self.near(mesh, now, rule, FIRST_RADIUS);
        for _ in 0..ROUNDS {
            let Some((places, curvature)) = far(self, &mut pool, &now, rule) else {
                break;
            };
            let next = self.arrange(places, &curvature, rule, STEPS);
            let next = self.near(mesh, next, rule, FIRST_RADIUS);
            let goal = now.value() * (1.0 - LEAST_GAIN);
            let go_on = next.value() < goal;
            if next.value() < now.value() {
                now = next;
            }
            if !go_on {
                break;
            }
        }
        now
    }

    /// The best curvatures at these places and near them, after u without cones has changed.
    pub(super) fn settle_distortion(
        &mut self,
        mesh: &Mesh,
        vertices: &[usize],
        curvature: &[f64],
        rule: Rule,
    ) -> Arrangement {
        let places = self.places(vertices);
        let now = self.arrange(places, curvature, rule, STEPS);
        self.near(mesh, now, rule, LAST_RADIUS)
    }
}
