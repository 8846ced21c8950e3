//! Cones that a grid can have, and no more than it needs.
//!
//! *Enters:* a field, and what is asked of its cones. *Leaves:* the field turned by π/2 across the edges of ways between two vertices, which takes a quarter turn
//! from one and gives it to the other, and its signature. *Guaranteed:* every vertex has at least the least angle, turnings of
//! loops are those of the changed field. *Not guaranteed:* that the field stays smooth across the ways.
//!
//! Two quads around a vertex share two edges however often they are divided, so in a grid interior cones have three quarter turns or more. One of two quarter
//! turns, at a sharp tip or by chance, becomes two of three, or one beside one of five takes the turn from there.
//!
//! Two cones of opposite curvature at a distance d change the metric at a distance r like a dipole, by about d / r. Where d is much less
//! than what the surface shows, as on noise, they cost quads and gain nothing, so they cancel each other.

use super::ways::{Angles, Step};
use super::{CrossField, FieldError};
use crate::flow::looped::LoopedSurface;
use crate::flow::signature::{FULL_TURN, Infeasible, Signature};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, FaceVec, VertexId};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f64::consts::FRAC_PI_2;

/// A cone of more than a full turn is worth a way this many times as long as that to a flat vertex, which would become a cone.
const CONE_PREFERENCE: f64 = 8.0;

/// What is asked of the cones of a field.
#[derive(Clone, Copy, Debug)]
pub struct GridCones {
    /// Least angle of a vertex inside, quarter turns.
    pub least: i64,
    /// Cones of opposite curvature that are as near as this cancel each other, in the unit of lengths.
    pub near: f64,
    /// Most cones inside.
    pub most: usize,
}

impl GridCones {
    /// Any cones of at least so many quarter turns.
    #[must_use]
    pub fn at_least(least: i64) -> Self {
        Self {
            least,
            near: 0.0,
            most: usize::MAX,
        }
    }
}

/// How many quarter turns were moved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Moved {
    /// To vertices that had too few of them.
    pub to_least: usize,
    /// Between cones, of which at least one is gone.
    pub merged: usize,
}

/// Which pairs of cones are merged.
#[derive(Clone, Copy, Debug)]
enum Reach {
    /// Those that are as near as this.
    Near(f64),
    /// All, as long as there are more cones inside.
    WhileMoreThan(usize),
}

impl CrossField {
    /// The signature with cones as they are asked for, at least one quarter turn at every vertex of the border and in every sector between features, and how many quarter turns were
    /// moved for it. Of a torus whose signature no metric has, the flat one: no cones, no turning. `angle`: corner angles of the surface's own part, radians.
    ///
    /// # Errors
    /// Where the angle does not suffice for `least`, or the cones cannot be as few as `most`.
    pub fn grid_signature(
        &mut self,
        surface: &LoopedSurface,
        angle: &FaceVec<[f64; 3]>,
        asked: &GridCones,
    ) -> Result<(Signature, Moved), FieldError> {
        let c = surface.own();
        let length = surface.own_length();
        let mut angles = Angles::new(surface, self.cones(c, angle)?, asked.least);
        let to_least = self.give_least(&mut angles, &length, asked.least)?;
        let merged = self.merge(&mut angles, &length, asked)?;
        let mut signature = self.signature(surface, angle)?;
        let on_torus = signature.check(surface.connectivity, &surface.loops);
        if let Err(Infeasible::FlatTorus { .. } | Infeasible::TwoConesOnTorus { .. }) = on_torus {
            signature.cone.as_mut_slice().fill(FULL_TURN);
            signature.turning.fill(0);
        }
        Ok((signature, Moved { to_least, merged }))
    }

    /// Gives quarter turns to the vertices that lack some.
    fn give_least(
        &mut self,
        angles: &mut Angles<'_>,
        length: &EdgeVec<f64>,
        least: i64,
    ) -> Result<usize, FieldError> {
        let c = angles.c;
        let mut moved = 0;
        for v in c.vertices() {
            while angles.lacks(v) {
                let worth = |w: VertexId| match angles.excess(w) > 0 {
                    _ if angles.lacks_after(w, 1) => None,
                    true => Some(1.0),
                    false => Some(CONE_PREFERENCE),
                };
                let way = angles.way(length, v, f64::INFINITY, worth);
                let (_, way) = way.ok_or(FieldError::TooFewVertices {
                    vertices: c.vertex_count(),
                    least,
                })?;
                self.turn_along(angles, &way);
                moved += 1;
            }
        }
        Ok(moved)
    }

    /// Cancels cones of opposite curvature that are near each other, the nearest first. Where that leaves too many it goes on further apart, then
    /// makes one of two negative cones.
    fn merge(
        &mut self,
        angles: &mut Angles<'_>,
        length: &EdgeVec<f64>,
        asked: &GridCones,
    ) -> Result<usize, FieldError> {
        let c = angles.c;
        let opposite = |angles: &Angles<'_>, to| match angles.excess(to) {
            excess if excess < 0 => -excess,
            _ => 0,
        };
        let alike = |angles: &Angles<'_>, to| match angles.excess(to) {
            excess if excess > 0 => i64::MAX,
            _ => 0,
        };
        let with = |angles: &Angles<'_>, sign: i64| -> Vec<VertexId> {
            let vertices = c.vertices();
            vertices
                .filter(|&v| angles.excess(v).signum() == sign)
                .collect()
        };
        let (near, few) = (Reach::Near(asked.near), Reach::WhileMoreThan(asked.most));
        let mut moved = 0;
        let receivers = with(angles, -1);
        moved += self.merge_each(angles, length, near, receivers, opposite);
        let receivers = with(angles, -1);
        moved += self.merge_each(angles, length, few, receivers, opposite);
        let receivers = with(angles, 1);
        moved += self.merge_each(angles, length, few, receivers, alike);
        match angles.inside > asked.most {
            true => Err(FieldError::TooManyCones {
                left: angles.inside,
                most: asked.most,
            }),
            false => Ok(moved),
        }
    }

    /// Moves quarter turns to some vertices, as many as `room` says, from the nearest cones that have more than a flat vertex; nearest pairs first.
    fn merge_each(
        &mut self,
        angles: &mut Angles<'_>,
        length: &EdgeVec<f64>,
        reach: Reach,
        receivers: Vec<VertexId>,
        room: impl Fn(&Angles<'_>, VertexId) -> i64,
    ) -> usize {
        let nearest = |angles: &Angles<'_>, to| {
            if room(angles, to) == 0 {
                return None;
            }
            let most = match reach {
                Reach::Near(distance) => distance,
                Reach::WhileMoreThan(most) if angles.inside > most => f64::INFINITY,
                Reach::WhileMoreThan(_) => return None,
            };
            // Two corners of the border are no cones inside.
            let counts = |v| matches!(reach, Reach::Near(_)) || !angles.is_on_border(v);
            let gives = |v| {
                let is_pair = counts(to) || counts(v);
                is_pair && angles.excess(v) > 0 && !angles.lacks_after(v, 1)
            };
            angles.way(length, to, most, |v| gives(v).then_some(1.0))
        };
        let mut pairs = BinaryHeap::new();
        for to in receivers {
            if let Some((distance, _)) = nearest(angles, to) {
                pairs.push(Reverse((distance.to_bits(), to)));
            }
        }
        let mut moved = 0;
        // Distances only grow as cones vanish.
        while let Some(Reverse((bits, to))) = pairs.pop() {
            let Some((distance, way)) = nearest(angles, to) else {
                continue;
            };
            if distance.to_bits() == bits {
                let from = way.first().map_or(to, |&step| angles.start(step));
                let mut left = room(angles, to).min(angles.excess(from));
                while left > 0 && !angles.lacks_after(from, 1) {
                    self.turn_along(angles, &way);
                    moved += 1;
                    left -= 1;
                }
            }
            if let Some((distance, _)) = nearest(angles, to) {
                pairs.push(Reverse((distance.to_bits(), to)));
            }
        }
        moved
    }

    fn turn_along(&mut self, angles: &mut Angles<'_>, way: &[Step]) {
        for &step in way {
            self.turn(angles.c, step);
            angles.turn(step);
        }
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
