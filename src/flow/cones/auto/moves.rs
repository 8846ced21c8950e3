//! Cones moved until the area distortion (9) is least.
//!
//! *Enters:* cones that keep the variance of the log scale low. *Leaves:* cones whose (9), in the linear picture, no move that is tried
//! lowers much, none of them idle.
//!
//! (9) is no quadratic function, so gains are not known for every vertex at once. Two searches in turn: [`near`](super::near) and
//! [`far`](super::far).

use super::arrangement::{Arrangement, Rule, STEPS};
use super::far::{LEAST_GAIN, Pool, far, least_of};
use super::placement::Placement;
use super::search::{IDLE, NOTHING};
use crate::geometry::mesh::Mesh;

/// Rounds of far and near moves …
const ROUNDS: usize = 2;
/// … none of which begins after as many places have been answered, each by a back-substitution: about 200 cost as much as one flow.
const ANSWERS: usize = 80;
/// Radii of the rings of near moves, first and least, in square roots of the area, while cones may go elsewhere …
const COARSE: [f64; 2] = [0.15, 0.02];
/// … and where they are all but placed: down to the neighbours.
pub(super) const FINE: [f64; 2] = [0.02, 0.0];

impl Placement<'_> {
    /// Moves the cones. What is left to gain is within the finer rings.
    pub(super) fn lower_distortion(
        &mut self,
        mesh: &Mesh,
        mut now: Arrangement,
        rule: Rule,
    ) -> Arrangement {
        if now.places.is_empty() {
            return now;
        }
        let before = self.answered;
        let mut pool = Pool::new(self, mesh);
        for _ in 0..ROUNDS {
            let elsewhere = far(self, &mut pool, &now, rule);
            let is_elsewhere = elsewhere.is_some();
            let next = match elsewhere {
                Some((places, curvature)) => self.arrange(places, &curvature, rule, STEPS),
                None => now.clone(),
            };
            let next = self.near(mesh, next, rule, COARSE);
            let goal = now.value() * (1.0 - LEAST_GAIN);
            let go_on = is_elsewhere && next.value() < goal;
            if next.value() < now.value() {
                now = next;
            }
            if !go_on || self.answered - before > ANSWERS {
                break;
            }
        }
        now
    }

    /// Takes away cones that do not pay, as long as more than `least` are left. (9) is four times the variance of the log scale where that is
    /// small, so what counts as paying is the same for both.
    pub(super) fn drop_idle_of(
        &self,
        mut now: Arrangement,
        least: usize,
        rule: Rule,
    ) -> Arrangement {
        let Some(limits) = rule.limits() else {
            return now;
        };
        while now.places.len() > least {
            let promised = self
                .points()
                .with_one_less(&now.weighed, &now.answers(), limits);
            let Some(idle) = least_of(&promised) else {
                break;
            };
            let (mut places, mut curvature) = (now.places.clone(), now.curvature().to_vec());
            places.remove(idle);
            curvature.remove(idle);
            let fewer = self.arrange(places, &curvature, rule, STEPS);
            let most = now.value() * (1.0 + IDLE).powi(2);
            if fewer.value() > most.max(4.0 * NOTHING * NOTHING) {
                break;
            }
            now = fewer;
        }
        now
    }
}
