//! Cones moved to other parts of the surface, as long as that lowers (9).
//!
//! *Enters:* cones that no small move improves. *Leaves:* other cones that promise less (9).
//!
//! The places where a cone could help most are where the force p = ∂ ln(F + 1)/∂K is farthest from what it is at the cones: a little curvature there
//! gains that much. p is smooth but at the cones, so it has few extremes. They join a pool with places spread over the surface, and
//! the best of the pool are searched for on [`cells`](super::cells) of the surface, by exchange, by adding some and taking away as many: a
//! trial, with the best curvatures of all cones, costs sums over cells and no solve.

use super::arrangement::{Arrangement, Place, Rule, STEPS};
use super::cells::{Coarse, Set};
use super::placement::Placement;
use super::quadratic::Limits;
use crate::flow::cones::spread;
use crate::geometry::ids::VertexId;
use crate::geometry::mesh::Mesh;
use rayon::prelude::*;

/// Places spread over the surface.
const SPREAD: usize = 24;
/// Extremes that are added at most each time.
const EXTREMES: usize = 16;
/// Gain of ln(F + 1), relative to itself, that another choice must promise …
pub(super) const LEAST_GAIN: f64 = 1e-2;
/// … and a single step to it.
const STEP_GAIN: f64 = 1e-3;
/// Passes of exchanges.
const PASSES: usize = 12;
/// Exchanges tried in full at most, those first that promise most.
const TRIALS: usize = 6;
/// How many cones are added, as shares of their number, before as many are taken away again …
const MORE: [f64; 2] = [1.0, 0.5];
/// … and how many at most.
const MOST_MORE: usize = 8;
/// Newton steps for the curvatures after a place came or went, after which they change little.
const CHANGED_STEPS: usize = 2;

/// Places whose answers are known.
pub(super) struct Pool(Vec<Place>);

impl Pool {
    /// Places spread over the surface.
    pub(super) fn new(placement: &mut Placement, mesh: &Mesh) -> Self {
        let spread = spread::spread(mesh, SPREAD);
        let spread = spread.iter().map(|v| v.index());
        let spread: Vec<usize> = spread.filter(|&v| placement.allowed[v]).collect();
        Self(placement.places(&spread))
    }

    fn index(&self, vertex: usize) -> Option<usize> {
        self.0.iter().position(|p| p.vertex == vertex)
    }

    /// Adds the cones and the extremes of the force on them.
    fn widen(&mut self, placement: &mut Placement, now: &Arrangement) {
        let force = placement.force(now);
        let mut new = extremes(placement, now, &force);
        new.retain(|&v| self.index(v).is_none());
        self.0.extend(placement.places(&new));
        for place in &now.places {
            if self.index(place.vertex).is_none() {
                self.0.push(place.clone());
            }
        }
    }
}

/// Other places and curvatures of all cones, as the cells see them; `None` where none promises enough.
pub(super) fn far(
    placement: &mut Placement,
    pool: &mut Pool,
    now: &Arrangement,
    rule: Rule,
) -> Option<(Vec<Place>, Vec<f64>)> {
    pool.widen(placement, now);
    let search = Coarse::new(placement, &pool.0, rule);
    let vertices = now.vertices();
    let members: Option<Vec<usize>> = vertices.iter().map(|&v| pool.index(v)).collect();
    let first = search.weigh(members?, now.curvature(), STEPS);
    let least = first.weighed.value;
    let best = search.improve(first);
    (best.weighed.value < least * (1.0 - LEAST_GAIN)).then(|| {
        let places = best.members.iter().map(|&m| pool.0[m].clone());
        (places.collect(), best.weighed.curvature)
    })
}

impl Coarse {
    fn improve(&self, set: Set) -> Set {
        let count = set.members.len();
        let mut best = self.exchange(set);
        // Fixed curvatures have no total to spare for more.
        let Rule::Best(limits) = self.rule else {
            return best;
        };
        let more = MORE.map(|share| ((share * count as f64) as usize).clamp(1, MOST_MORE));
        let mut more = more.to_vec();
        more.dedup();
        for more in more {
            let many = self.grow(best.clone(), count + more, limits);
            let few = self.exchange(self.prune(many, count, limits));
            if few.members.len() <= count && few.weighed.value < best.weighed.value {
                best = few;
            }
        }
        best
    }

    fn others<'s>(&'s self, set: &'s Set) -> impl Iterator<Item = usize> + 's {
        (0..self.answers.len()).filter(|m| !set.members.contains(m))
    }

    /// Exchanges single places as long as that gains.
    fn exchange(&self, mut set: Set) -> Set {
        for _ in 0..PASSES {
            let goal = set.weighed.value * (1.0 - STEP_GAIN);
            let count = set.members.len();
            let exchanges = (0..count).flat_map(|i| self.others(&set).map(move |m| (i, m)));
            let exchanges: Vec<(usize, usize)> = exchanges.collect();
            let promise = |&(i, m): &(usize, usize)| (self.moved(&set, i, m), i, m);
            let mut promised: Vec<(f64, usize, usize)> =
                exchanges.par_iter().map(promise).collect();
            promised.retain(|p| p.0 < goal);
            // Stable: of equals the first.
            promised.sort_by(|a, b| a.0.total_cmp(&b.0));
            let better = promised.iter().take(TRIALS).find_map(|&(_, i, m)| {
                let mut members = set.members.clone();
                members[i] = m;
                let next = self.weigh(members, &set.weighed.curvature, STEPS);
                (next.weighed.value < goal).then_some(next)
            });
            match better {
                Some(better) => set = better,
                None => break,
            }
        }
        set
    }

    /// Adds the place that gains most again and again.
    fn grow(&self, mut set: Set, count: usize, limits: Limits) -> Set {
        while set.members.len() < count {
            let others: Vec<usize> = self.others(&set).collect();
            let promised = self.points().with_one_more(
                &set.weighed,
                &self.views(&set.members),
                &self.views(&others),
                limits,
            );
            let Some(best) = least_of(&promised) else {
                break;
            };
            let (mut members, mut curvature) = (set.members, set.weighed.curvature);
            members.push(others[best]);
            curvature.push(0.0);
            set = self.weigh(members, &curvature, CHANGED_STEPS);
        }
        set
    }

    /// Takes away the place that is worth least again and again.
    fn prune(&self, mut set: Set, count: usize, limits: Limits) -> Set {
        while set.members.len() > count {
            let answers = self.views(&set.members);
            let promised = self.points().with_one_less(&set.weighed, &answers, limits);
            let Some(worst) = least_of(&promised) else {
                break;
            };
            let (mut members, mut curvature) = (set.members, set.weighed.curvature);
            members.remove(worst);
            curvature.remove(worst);
            set = self.weigh(members, &curvature, CHANGED_STEPS);
        }
        set
    }
}

/// The first of the least values.
pub(super) fn least_of(values: &[f64]) -> Option<usize> {
    let order = |a: &usize, b: &usize| values[*a].total_cmp(&values[*b]);
    (0..values.len()).min_by(order)
}

/// Vertices where the force is greater than around, or less, but for cones and their neighbours; those first where it is farthest from that at the
/// cones.
fn extremes(placement: &Placement, now: &Arrangement, force: &[f64]) -> Vec<usize> {
    let c = placement.connectivity;
    let vertices = now.vertices();
    let mut is_near = vec![false; force.len()];
    let mut level = 0.0;
    for &v in &vertices {
        level += force[v] / vertices.len() as f64;
        is_near[v] = true;
        for w in c.neighbours(VertexId::new(v)) {
            is_near[w.index()] = true;
        }
    }
    let is_extreme = |v: usize| {
        let around = c.neighbours(VertexId::new(v)).map(|w| force[w.index()]);
        let [least, greatest] = around.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| {
            [a.min(x), b.max(x)]
        });
        placement.allowed[v] && !is_near[v] && !(least..=greatest).contains(&force[v])
    };
    let mut extremes: Vec<(f64, usize)> = (0..force.len())
        .filter(|&v| is_extreme(v))
        .map(|v| ((force[v] - level).abs(), v))
        .collect();
    extremes.sort_by(|a, b| b.0.total_cmp(&a.0));
    extremes.truncate(EXTREMES);
    extremes.into_iter().map(|(_, v)| v).collect()
}
