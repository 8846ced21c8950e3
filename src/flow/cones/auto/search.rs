//! Where cones are best: the best of a pool of places, then of places nearer and nearer to those.
//!
//! *Enters:* how many cones there may be. *Leaves:* vertices and curvatures.
//!
//! Where a little curvature would gain most is told by the force p = ∂J/∂K, one back-substitution for all vertices: it is
//! smooth but at the cones, so it has few extremes. They make up the pool with the extremes of the log scale and places spread over the
//! surface. A cone of curvature c at x feels the force −c ∇p(x), so the vertices to which it may move a little are those of some rings
//! around x where c p is least, a few a ring, narrower and narrower rings. Because J is convex in the curvature, a move from x to y gains at most
//! c (p(x) − p(y)): most places need not be looked at.

use super::candidates::{Samples, extremes};
use super::placement::Placement;
use super::pool::{LEAST_GAIN, Pool, Rule, Set};
use crate::flow::cones::params::DEFAULT_COUNT;
use crate::flow::cones::spread;
use crate::geometry::ids::VertexId;
use crate::geometry::mesh::{norm, sub, triangle_area};

/// Places spread over the surface, extremes of the log scale and of the force in the first pool at least, and for each cone wanted.
const SPREAD: [f64; 2] = [16.0, 1.0];
const EXTREMES: [f64; 2] = [16.0, 1.0];
/// Rounds of widening the pool by extremes of the force, each of which must gain …
const ROUNDS: usize = 2;
/// … so much of the objective.
pub(super) const ROUND_GAIN: f64 = 1e-2;
/// Outer radii of the rings that cones move on, in square roots of the area.
pub(super) const RADII: [f64; 4] = [0.16, 0.06, 0.02, 0.007];
/// Cones up to which the wider rings are tried: many cones are as near to each other as these are wide.
const FEW: usize = 48;
/// Rings around a cone that are tried at once, each half as wide as the one before.
const RINGS: usize = 3;
/// Vertices of a ring that are tried, those first where the force is least, …
const DIRECTIONS: usize = 3;
/// … none nearer to another than this, in outer radii.
const APART: f64 = 0.7;
/// Rings that are tried at once at most, but one for each cone.
const ALL_RINGS: usize = 96;
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

/// Chosen cones.
#[derive(Clone)]
pub(super) struct Cones {
    pub(super) vertices: Vec<usize>,
    pub(super) curvature: Vec<f64>,
}

impl Placement<'_> {
    /// Places that may be worth a cone beside none.
    pub(super) fn first_pool(&mut self, count: usize) -> Pool {
        let [spread, extreme] = [SPREAD, EXTREMES].map(|[least, each]| number(least, each, count));
        let base = self.base.clone();
        let level = self.mean(&base);
        let force = self.force(&base);
        let (c, allowed) = (self.connectivity, &self.allowed);
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

    /// A pool with the extremes of the force more, and the set in it.
    fn widened(&mut self, pool: Pool, set: &Set, count: usize) -> (Pool, Set) {
        let cones = Cones {
            vertices: pool.places(set),
            curvature: set.curvature.clone(),
        };
        self.widened_around(pool.vertices, &cones, count, Rule::Best)
    }

    /// A pool of some places, among them those of some cones, and of the extremes of the force that these make, with the cones in it.
    pub(super) fn widened_around(
        &mut self,
        mut places: Vec<usize>,
        cones: &Cones,
        count: usize,
        rule: Rule,
    ) -> (Pool, Set) {
        let u = self.log_scale_of(&cones.vertices, &cones.curvature);
        let force = self.force(&u);
        let share = 1.0 / cones.vertices.len().max(1) as f64;
        let level: f64 = cones.vertices.iter().map(|&v| share * force[v]).sum();
        let extreme = number(EXTREMES[0], EXTREMES[1], count);
        places.extend(extremes(
            self.connectivity,
            &self.allowed,
            &force,
            level,
            &self.regions,
            extreme,
        ));
        unique(&mut places);
        let pool = Pool::new(self, places, &u);
        let set = pool.weigh(pool.members_of(&cones.vertices), &cones.curvature, rule);
        (pool, set)
    }

    /// The cones that lower the objective most.
    pub(super) fn search(&mut self, count: Count) -> Cones {
        let mut pool = self.first_pool(count.wanted);
        let mut set = pool.best(count.wanted);
        let rounds = if count.wanted <= FEW { ROUNDS } else { 1 };
        for _ in 0..rounds {
            let before = set.value;
            (pool, set) = self.widened(pool, &set, count.wanted);
            set = pool.improve(set, count.wanted);
            if set.value > before * (1.0 - ROUND_GAIN) {
                break;
            }
        }
        set = more(&pool, set, count);
        set = fewer(&pool, set, count);
        let cones = Cones {
            vertices: pool.places(&set),
            curvature: set.curvature,
        };
        self.keep(&cones.vertices);
        let radii = match cones.vertices.len() <= FEW {
            true => &RADII[..],
            false => &RADII[2..],
        };
        let cones = self.approach(cones, radii, Rule::Best);
        self.without_idle(cones, count)
    }

    /// The fewest cones, as far as `count` allows, with |u − mean| within `bound` on every face.
    pub(super) fn search_bounded(&mut self, count: Count, bound: f64) -> Cones {
        let mut tried = count.least.max(1);
        loop {
            let exactly = Count {
                least: tried,
                wanted: tried,
                most: tried,
            };
            let cones = self.search(exactly);
            let u = self.log_scale_of(&cones.vertices, &cones.curvature);
            let worst = self.largest_deviation(&u);
            if worst <= bound || tried >= count.most {
                return cones;
            }
            // The deviation falls no faster than with the number of cones.
            let step = if worst > 2.0 * bound { tried / 3 } else { 0 };
            tried = (tried + step.max(1)).min(count.most);
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
        for (cone, (&v, c)) in now.vertices.iter().zip(&now.curvature).enumerate() {
            let around = spread::around(self.mesh, VertexId::new(v), radius);
            // The nearest vertices may be farther away than that.
            let around: Vec<(usize, f64)> = match around.is_empty() {
                true => {
                    let ring = self.connectivity.neighbours(VertexId::new(v));
                    ring.map(|w| (w.index(), 0.75 * radius)).collect()
                }
                false => around.iter().map(|(w, d)| (w.index(), *d)).collect(),
            };
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
                    let lowest = |a: usize, b: usize| if c * force[b] < c * force[a] { b } else { a };
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
        let pool = Pool::new(self, places, &u);
        let set = pool.weigh((0..count).collect(), &now.curvature, rule);
        let may = |i: usize, j: usize| owner[i] == owner[j];
        let set = pool.exchange(set, rule, may);
        Cones {
            vertices: pool.places(&set),
            curvature: set.curvature,
        }
    }

    fn area(&self) -> f64 {
        let faces = self.connectivity.faces();
        faces
            .map(|f| triangle_area(self.mesh.face_positions(f)))
            .sum()
    }

    fn without_idle(&mut self, cones: Cones, count: Count) -> Cones {
        let u = self.log_scale_of(&cones.vertices, &cones.curvature);
        let pool = Pool::new(self, cones.vertices, &u);
        let all = (0..pool.len()).collect();
        let set = pool.weigh(all, &cones.curvature, Rule::Best);
        let set = fewer(&pool, set, count);
        Cones {
            vertices: pool.places(&set),
            curvature: set.curvature,
        }
    }
}

/// Beyond the number that is wanted, some more cones again and again, as long as each lowers much what is far from good.
fn more(pool: &Pool, mut set: Set, count: Count) -> Set {
    while set.value.sqrt() > GOOD {
        let now = set.members.len();
        let longer = AHEAD.into_iter().filter(|more| now + more <= count.most);
        let better = longer.map(|more| {
            let next = pool.grow(set.clone(), now + more);
            let next = pool.exchange(next, Rule::Best, |_, _| true);
            // From where these are, there may be no way to where so many more would be.
            let anew = (more == AHEAD[2]).then(|| pool.best(now + more));
            let anew = anew.filter(|anew| anew.value < next.value);
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
        let next = pool.prune(set.clone(), now - step);
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
