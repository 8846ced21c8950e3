//! Where cones are best: the best of a pool of places, then of places nearer and nearer to those.
//!
//! *Enters:* how many cones there may be. *Leaves:* vertices and curvatures.
//!
//! Where a little curvature would gain most is told by the force p = ∂J/∂K, one back-substitution for all vertices: it is
//! smooth but at the cones, so it has few extremes. They make up the pool with the extremes of the log scale and places spread over the
//! surface. The best of them are moved ([`moves`](super::moves)).

use super::candidates::{Samples, extremes};
use super::moves::RADII;
use super::placement::Placement;
use super::pool::{Cones, Pool, Rule, Set};
use crate::flow::cones::params::DEFAULT_COUNT;
use crate::geometry::ids::VertexId;

/// Places spread over the surface, extremes of the log scale and of the force in the first pool at least, and for each cone wanted.
const SPREAD: [f64; 2] = [24.0, 1.0];
const EXTREMES: [f64; 2] = [16.0, 1.0];
/// Rounds of widening the pool by extremes of the force, each of which must gain …
const ROUNDS: usize = 2;
/// … so much of the objective.
pub(super) const ROUND_GAIN: f64 = 1e-2;
/// How many of the radii many cones do without: they are as near to each other as these are wide.
const WIDE: usize = 1;
/// Local optima that are followed, and shares of the objective by which they may be worse than the best; on a small mesh more.
const OPTIMA: [usize; 2] = [2, 8];
const CLOSE: [f64; 2] = [0.05, 0.5];
/// Cones up to which the wider rings are tried: many cones are as near to each other as these are wide.
const FEW: usize = 48;
/// Cones of which one at a time is looked at as idle.
const MANY: usize = 32;
/// Square root of the objective under which a cone is idle, whatever it gains.
pub(super) const EVEN: f64 = 2e-6;

/// How many cones.
#[derive(Clone, Copy)]
pub(super) struct Count {
    /// Needed to meet the total.
    pub(super) least: usize,
    /// As many as pay a little.
    pub(super) wanted: usize,
    /// As many as pay much.
    pub(super) most: usize,
}

/// What one of eight cones must lower the square root of the objective by, as a share of it, to be kept …
const PAYS: f64 = 0.01;
/// … and beyond the number that is wanted, …
const PAYS_MUCH: f64 = 0.04;
/// … where that is above this: twice a standard deviation of the log scale of a quarter.
const GOOD: f64 = 0.5;
/// How many cones more are looked at together: one of several legs may gain little alone.
const AHEAD: [usize; 3] = [2, 4, 8];

impl Placement<'_> {
    /// Places that may be worth a cone beside none.
    pub(super) fn first_pool(&mut self, count: usize) -> Pool {
        let [spread, extreme] = [SPREAD, EXTREMES].map(|[least, each]| number(least, each, count));
        let base = self.base.clone();
        let level = self.mean(&base);
        let force = self.force(&base);
        let (c, allowed) = (&self.neighbours, &self.allowed);
        let regions = Samples::new(c, allowed, &base, spread);
        let mut places = extremes(c, allowed, &base, level, &regions, extreme);
        let middle = self.mean(&force);
        places.extend(extremes(c, allowed, &force, middle, &regions, extreme));
        places.extend(&regions.vertices);
        unique(&mut places);
        self.regions = regions;
        // Cones will even out what is uneven now.
        let even = vec![0.0; base.len()];
        Pool::new(self, places, &even)
    }

    /// A pool of what is in one and of the extremes of the force that each of some sets makes, with the sets in it.
    fn widened(&mut self, pool: &Pool, sets: &[Set], count: usize) -> (Pool, Vec<Set>) {
        let cones: Vec<Cones> = sets.iter().map(|set| pool.cones(set)).collect();
        self.widened_around(pool.vertices.clone(), &cones, count, Rule::Best)
    }

    /// A pool of some places, among them those of some sets of cones, and of the extremes of the force that each of these makes, with the sets
    /// in it. The first set is the one that cells are made for.
    pub(super) fn widened_around(
        &mut self,
        mut places: Vec<usize>,
        sets: &[Cones],
        count: usize,
        rule: Rule,
    ) -> (Pool, Vec<Set>) {
        let extreme = number(EXTREMES[0], EXTREMES[1], count);
        let mut near = None;
        for cones in sets {
            let u = self.log_scale_of(&cones.vertices, &cones.curvature);
            let force = self.force(&u);
            let share = 1.0 / cones.vertices.len().max(1) as f64;
            let level: f64 = cones.vertices.iter().map(|&v| share * force[v]).sum();
            places.extend(extremes(
                &self.neighbours,
                &self.allowed,
                &force,
                level,
                &self.regions,
                extreme,
            ));
            near.get_or_insert(u);
        }
        unique(&mut places);
        let pool = Pool::new(self, places, &near.unwrap_or_default());
        let set =
            |cones: &Cones| pool.weigh(pool.members_of(&cones.vertices), &cones.curvature, rule);
        let sets = sets.iter().map(set).collect();
        (pool, sets)
    }

    /// Local optima of the objective that are hardly worse than the best, the best first; one at least.
    pub(super) fn search(&mut self, count: Count) -> Vec<Cones> {
        let optima = self.optima_of_a_pool(count);
        let optima = match self.is_small() {
            true => optima,
            // Moving each costs more than what the mesh itself says of them.
            false => self.really_best(optima),
        };
        self.all_moved(optima, count)
    }

    /// The first part: local optima among places of a pool that is widened as long as that pays, with as many cones as pay.
    fn optima_of_a_pool(&mut self, count: Count) -> Vec<Cones> {
        let mut pool = self.first_pool(count.wanted);
        let kind = usize::from(self.is_small());
        let mut sets = pool.best(count.wanted, OPTIMA[kind]);
        let rounds = if count.wanted <= FEW { ROUNDS } else { 1 };
        for _ in 0..rounds {
            let before = lowest(&sets);
            (pool, sets) = self.widened(&pool, &sets, count.wanted);
            sets = pool.improved(sets, count.wanted, OPTIMA[kind]);
            if lowest(&sets) > before * (1.0 - ROUND_GAIN) {
                break;
            }
        }
        let most = lowest(&sets) + CLOSE[kind] * lowest(&sets).abs();
        // The first stays, whatever it is worth.
        let worse = sets.iter().skip(1).position(|set| set.value > most);
        sets.truncate(worse.map_or(sets.len(), |first| first + 1));
        if let Some(first) = sets.first_mut() {
            *first = more(&pool, first.clone(), count);
            if first.members.len() > count.wanted {
                // Fewer cones are no longer what is looked for.
                sets.truncate(1);
            }
        }
        let sets = sets.into_iter().map(|set| fewer(&pool, set, count));
        sets.map(|set| pool.cones(&set)).collect()
    }

    /// The second: of several optima the one that is best by the log scale that the mesh really has.
    fn really_best(&self, optima: Vec<Cones>) -> Vec<Cones> {
        if optima.len() < 2 {
            return optima;
        }
        let costs = optima.into_iter().map(|cones| {
            let linear = self.log_scale_of(&cones.vertices, &cones.curvature);
            let real = self.real_log_scale(&cones.vertices, &cones.curvature, &linear);
            (self.cost(&real), cones)
        });
        let best = costs.min_by(|a, b| a.0.total_cmp(&b.0));
        best.into_iter().map(|(_, cones)| cones).collect()
    }

    /// The third: optima moved on the surface, without cones that then do not pay, the best first.
    fn all_moved(&mut self, optima: Vec<Cones>, count: Count) -> Vec<Cones> {
        let is_one = optima.len() == 1;
        let mut found = Vec::with_capacity(optima.len());
        for cones in optima {
            let radii = match cones.vertices.len() <= FEW {
                true => &RADII[..],
                false => &RADII[WIDE..],
            };
            let cones = self.approach(cones, radii, Rule::Best);
            let cones = self.without_idle(cones, count);
            let cost = match is_one {
                true => 0.0,
                false => self.cost(&self.log_scale_of(&cones.vertices, &cones.curvature)),
            };
            found.push((cost, cones));
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.into_iter().map(|(_, cones)| cones).collect()
    }

    /// The fewest cones, as far as `count` allows, with |u − mean| within `bound` on every face.
    pub(super) fn search_bounded(&mut self, count: Count, bound: f64) -> Vec<Cones> {
        let mut tried = count.least.max(1);
        loop {
            let exactly = Count {
                least: tried,
                wanted: tried,
                most: tried,
            };
            let mut found = self.search(exactly);
            found.truncate(1);
            let worst = found.iter().map(|cones| {
                let u = self.log_scale_of(&cones.vertices, &cones.curvature);
                self.largest_deviation(&u)
            });
            let worst = worst.fold(0.0, f64::max);
            if worst <= bound || tried >= count.most {
                return found;
            }
            // The deviation falls no faster than with the number of cones.
            let step = if worst > 2.0 * bound { tried / 3 } else { 0 };
            tried = (tried + step.max(1)).min(count.most);
        }
    }

    /// Equal cones far apart: for a surface of such extreme shape that nothing can be computed on it.
    pub(super) fn equal(&self, count: Count) -> Cones {
        let places = self.regions.vertices.iter().take(count.wanted.max(1));
        let vertices: Vec<usize> = places.copied().collect();
        let share = self.limits.total.unwrap_or(0.0) / vertices.len().max(1) as f64;
        Cones {
            curvature: vec![share; vertices.len()],
            vertices,
        }
    }

    /// max |u − mean| over the faces, u of a face being that of its corners on average.
    fn largest_deviation(&self, u: &[f64]) -> f64 {
        let mean = self.mean(u);
        let c = self.connectivity;
        let of = |corners: [VertexId; 3]| corners.iter().map(|v| u[v.index()]).sum::<f64>() / 3.0;
        let faces = c.faces().map(|f| (of(c.face_vertices(f)) - mean).abs());
        faces.fold(0.0, f64::max)
    }

    fn without_idle(&mut self, cones: Cones, count: Count) -> Cones {
        let u = self.log_scale_of(&cones.vertices, &cones.curvature);
        let pool = Pool::new(self, cones.vertices, &u);
        let all = (0..pool.len()).collect();
        let set = pool.weigh(all, &cones.curvature, Rule::Best);
        let set = fewer(&pool, set, count);
        pool.cones(&set)
    }
}

/// Beyond the number that is wanted, some more cones again and again, as long as each lowers much what is far from good.
fn more(pool: &Pool, mut set: Set, count: Count) -> Set {
    while set.value.sqrt() > GOOD {
        let now = set.members.len();
        let longer = AHEAD.into_iter().filter(|more| now + more <= count.most);
        let better = longer.map(|more| {
            let next = pool.grow(&set, now + more);
            let next = pool.exchange(next, Rule::Best, |_, _| true);
            // From where these are, there may be no way to where so many more would be.
            let anew = match more == AHEAD[2] {
                true => pool.best(now + more, 1),
                false => Vec::new(),
            };
            let anew = anew.into_iter().find(|anew| anew.value < next.value);
            (more, anew.unwrap_or(next))
        });
        let mut better = better.filter(|(more, next)| {
            let pays = PAYS_MUCH * share(now);
            let goal = set.value.sqrt() * (1.0 - pays).powi(*more as i32);
            next.members.len() <= now + more && next.value.sqrt() < goal
        });
        match better.next() {
            Some((_, next)) => set = next,
            None => break,
        }
    }
    set
}

/// J of the best of some sets, the first.
fn lowest(sets: &[Set]) -> f64 {
    sets.first().map_or(f64::INFINITY, |set| set.value)
}

/// How much of what one of few cones must gain one of many must: each of twice as many gains half as much.
fn share(count: usize) -> f64 {
    (DEFAULT_COUNT as f64 / count.max(1) as f64).min(1.0)
}

/// Takes away cones that do not pay, as long as more than the least number are left.
fn fewer(pool: &Pool, mut set: Set, count: Count) -> Set {
    while set.members.len() > count.least {
        let now = set.members.len();
        // Of very many, some at a time.
        let step = now.div_ceil(MANY).min(now - count.least);
        let next = pool.prune(&set, now - step);
        let pays = share(set.members.len())
            * match set.members.len() > count.wanted {
                true => PAYS_MUCH,
                false => PAYS,
            };
        let (with, without) = (set.value.max(0.0).sqrt(), next.value.max(0.0).sqrt());
        if next.members.len() >= set.members.len()
            || (without > EVEN && without > with * (1.0 + pays).powi(step as i32))
        {
            break;
        }
        set = next;
    }
    set
}

/// So many for each cone, but a least number.
fn number(least: f64, each: f64, count: usize) -> usize {
    least.max(each * count as f64) as usize
}

/// Keeps the first of equal places.
fn unique(places: &mut Vec<usize>) {
    let mut seen = std::collections::BTreeSet::new();
    places.retain(|v| seen.insert(*v));
}
