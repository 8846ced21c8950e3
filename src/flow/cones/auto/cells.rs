//! The surface seen coarsely, for sums that say whether another place for a cone would lower (9).
//!
//! *Enters:* places where cones are or might be. *Leaves:* a few thousand points in place of all vertices. (9) is ruled by the faces next to the
//! cones, so around every place single vertices are points of their own; elsewhere the log scale is smooth, and cells around the samples are enough.
//! *Not guaranteed:* the value of (9), only which of some choices has less; what is taken up is weighed on all vertices.

use super::area::{Points, Weighed};
use super::arrangement::{Place, Rule};
use super::placement::Placement;
use crate::flow::cones::spread;
use crate::geometry::ids::VertexId;
use rayon::prelude::*;

/// Some of the places with their best curvatures.
#[derive(Clone)]
pub(super) struct Set {
    pub(super) members: Vec<usize>,
    pub(super) weighed: Weighed,
}

/// Places, as cells see them.
pub(super) struct Coarse {
    weight: Vec<f64>,
    /// u without cones.
    base: Vec<f64>,
    /// What a unit of curvature at each place adds to u.
    pub(super) answers: Vec<Vec<f64>>,
    pub(super) rule: Rule,
}

impl Coarse {
    pub(super) fn new(placement: &Placement, places: &[Place], rule: Rule) -> Self {
        let cells = Cells::new(placement, places);
        let answers = places.par_iter().map(|p| cells.means(&p.answer));
        Self {
            answers: answers.collect(),
            base: cells.means(&placement.base),
            weight: cells.weight,
            rule,
        }
    }

    pub(super) fn points(&self) -> Points<'_> {
        Points {
            weight: &self.weight,
            base: &self.base,
        }
    }

    pub(super) fn views(&self, members: &[usize]) -> Vec<&[f64]> {
        members.iter().map(|&m| &*self.answers[m]).collect()
    }

    /// After at most `steps` of Newton's method for the curvatures.
    pub(super) fn weigh(&self, members: Vec<usize>, curvature: &[f64], steps: usize) -> Set {
        let answers = self.views(&members);
        let weighed = self.rule.apply(self.points(), &answers, curvature, steps);
        Set { members, weighed }
    }

    /// What (9) would be about with place `to` in the stead of member `i`.
    pub(super) fn moved(&self, set: &Set, i: usize, to: usize) -> f64 {
        let mut with = self.views(&set.members);
        let old = std::mem::replace(&mut with[i], &self.answers[to]);
        self.points()
            .moved(&set.weighed, &with, i, old, self.rule.limits())
    }
}

/// Single vertices around some places, cells around the samples elsewhere.
struct Cells {
    /// Cell of every vertex.
    cell: Vec<u32>,
    /// Area of every vertex and of every cell, all together 1.
    vertex_weight: Vec<f64>,
    weight: Vec<f64>,
}

impl Cells {
    fn new(placement: &Placement, places: &[Place]) -> Self {
        let c = placement.connectivity;
        let centres: Vec<usize> = placement.samples.iter().copied().step_by(2).collect();
        let mut cell = spread::nearest_of(c, &centres);
        let mut count = centres.len() as u32;
        let own = |v: usize, cell: &mut Vec<u32>, count: &mut u32| {
            // A vertex that is alone already stays so.
            if (cell[v] as usize) < centres.len() {
                cell[v] = *count;
                *count += 1;
            }
        };
        for place in places {
            let ring: Vec<VertexId> = c.neighbours(VertexId::new(place.vertex)).collect();
            own(place.vertex, &mut cell, &mut count);
            for &v in &ring {
                own(v.index(), &mut cell, &mut count);
                for w in c.neighbours(v) {
                    own(w.index(), &mut cell, &mut count);
                }
            }
        }
        let mut weight = vec![0.0; count as usize];
        for (&c, w) in cell.iter().zip(&placement.picture.weight) {
            weight[c as usize] += w;
        }
        Self {
            cell,
            vertex_weight: placement.picture.weight.clone(),
            weight,
        }
    }

    fn means(&self, field: &[f64]) -> Vec<f64> {
        let mut means = vec![0.0; self.weight.len()];
        for ((&c, w), x) in self.cell.iter().zip(&self.vertex_weight).zip(field) {
            means[c as usize] += w * x;
        }
        for (m, w) in means.iter_mut().zip(&self.weight) {
            *m = if *w > 0.0 { *m / w } else { 0.0 };
        }
        means
    }
}
