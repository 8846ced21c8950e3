//! The best cones among some places.
//!
//! *Enters:* places. *Leaves:* those of them that are worth a cone, with the best curvatures: found by adding, exchanging and taking away on
//! the second-order model of the objective, read off a [`Tableau`]. What comes out is weighed by the objective
//! itself, and taken up if it is better.

use super::objective::{Answers, COMPARED, NOTHING, Points, SETTLED};
use super::placement::Placement;
use super::tableau::{Limits, Tableau};

/// Gain, relative to the objective, that an exchange must have.
pub(super) const LEAST_GAIN: f64 = 1e-3;
/// Rounds of exchanges, each of which must gain: for one cone, at most, and at least.
const PASSES: [usize; 3] = [192, 24, 3];
/// Cones up to which detours are made, and up to which all of them.
const DETOURS: [usize; 2] = [48, 16];
/// How many cones are added, as shares of their number, before as many are taken away again.
const MORE: [f64; 2] = [1.0, 0.4];
/// Points of all searches from a first cone of their own.
const STARTS: usize = 2000;
/// Parts of the cones after which J is looked at anew.
const PARTS: [usize; 3] = [4, 2, 1];
/// How many more, at the least and at most.
const MORE_CONES: [usize; 2] = [2, 16];

/// Places, as cells see them.
pub(super) struct Pool {
    pub(super) vertices: Vec<usize>,
    weight: Vec<f64>,
    spread: [Vec<f64>; 2],
    /// u without cones.
    base: Vec<f64>,
    /// What curvature at each place does to u.
    answers: Answers,
    limits: Limits,
}

/// Some of the places with their best curvatures.
#[derive(Clone)]
pub(super) struct Set {
    pub(super) members: Vec<usize>,
    pub(super) curvature: Vec<f64>,
    /// J.
    pub(super) value: f64,
}

/// Members that no exchange makes better, and the second-order model around them where it was made.
struct Settled<'a> {
    set: Set,
    model: Option<Tableau<'a>>,
}

/// Chosen cones.
#[derive(Clone, Default)]
pub(super) struct Cones {
    pub(super) vertices: Vec<usize>,
    pub(super) curvature: Vec<f64>,
}

/// What the curvatures do while cones move.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Rule {
    /// They are the best within the limits.
    Best,
    /// They stay.
    Fixed,
}

impl Pool {
    /// `near`: a log scale near those that will be looked at.
    pub(super) fn new(placement: &mut Placement, vertices: Vec<usize>, near: &[f64]) -> Self {
        let weight = placement.weight().to_vec();
        let cells = placement.cells(&weight, &vertices);
        let base = cells.means(&placement.base);
        let answers = placement.answers(&vertices, &cells);
        Self {
            base,
            spread: cells.spread(near),
            weight: cells.weight,
            limits: placement.limits,
            vertices,
            answers,
        }
    }

    pub(super) fn len(&self) -> usize {
        self.vertices.len()
    }

    pub(super) fn points(&self) -> Points<'_> {
        Points {
            weight: &self.weight,
            spread: [&self.spread[0], &self.spread[1]],
            base: &self.base,
        }
    }

    /// Places as members of this pool.
    pub(super) fn members_of(&self, vertices: &[usize]) -> Vec<usize> {
        let place = |v: &usize| self.vertices.iter().position(|w| w == v);
        vertices.iter().filter_map(place).collect()
    }

    /// The places of a set, as vertices.
    pub(super) fn places(&self, set: &Set) -> Vec<usize> {
        set.members.iter().map(|&m| self.vertices[m]).collect()
    }

    /// A set as cones.
    pub(super) fn cones(&self, set: &Set) -> Cones {
        Cones {
            vertices: self.places(set),
            curvature: set.curvature.clone(),
        }
    }

    /// These members with the best curvatures, from some that are near.
    pub(super) fn weigh(&self, members: Vec<usize>, start: &[f64], rule: Rule) -> Set {
        self.weighed(members, start, rule, SETTLED)
    }

    fn weighed(&self, members: Vec<usize>, start: &[f64], rule: Rule, settled: f64) -> Set {
        let answers = self.answers.of(&members);
        let (curvature, value) = match rule {
            Rule::Best => {
                let best = self.points().best(&answers, start, self.limits, settled);
                (best.curvature, best.value)
            }
            Rule::Fixed => {
                let value = self.points().state(&answers, start).value;
                (start.to_vec(), value)
            }
        };
        // A surface beyond all measure gives no numbers, and nothing is worse.
        let value = if value.is_finite() {
            value
        } else {
            f64::INFINITY
        };
        Set {
            members,
            curvature,
            value,
        }
    }

    /// The second-order model around a set, with its members in.
    pub(super) fn model(&self, set: &Set, rule: Rule) -> Tableau<'_> {
        let mut curvature = vec![0.0; self.len()];
        for (&m, c) in set.members.iter().zip(&set.curvature) {
            curvature[m] = *c;
        }
        let mut model = self.points().model(&self.answers, &curvature, self.limits);
        for (&m, c) in set.members.iter().zip(&set.curvature) {
            match rule {
                Rule::Best => {
                    model.free(m);
                }
                Rule::Fixed => model.hold(m, *c),
            }
        }
        if rule == Rule::Best {
            model.settle();
        }
        model
    }

    /// What a model has, weighed.
    fn read(&self, model: &Tableau, rule: Rule) -> Set {
        let members: Vec<usize> = (0..self.len()).filter(|&i| model.is_in(i)).collect();
        let start: Vec<f64> = members.iter().map(|&i| model.curvature(i)).collect();
        self.weighed(members, &start, rule, COMPARED)
    }

    /// Exchanges members for other places as long as that gains; `may`: which member may go to which place.
    pub(super) fn exchange(&self, set: Set, rule: Rule, may: impl Fn(usize, usize) -> bool) -> Set {
        self.settled(set, rule, may).set
    }

    fn settled(&self, mut set: Set, rule: Rule, may: impl Fn(usize, usize) -> bool) -> Settled<'_> {
        let [all, most, least] = PASSES;
        for _ in 0..(all / set.members.len().max(1)).clamp(least, most) {
            if set.value <= NOTHING {
                break;
            }
            let model = self.model(&set, rule);
            match self.exchanged_once(&model, &set, rule, &may) {
                Some(better) => set = better,
                None => {
                    return Settled {
                        set,
                        model: Some(model),
                    };
                }
            }
        }
        Settled { set, model: None }
    }

    /// All exchanges that the model wants; then less and less of it, if the objective disagrees. `None` where nothing gains.
    fn exchanged_once<'a>(
        &'a self,
        model: &Tableau<'a>,
        set: &Set,
        rule: Rule,
        may: &impl Fn(usize, usize) -> bool,
    ) -> Option<Set> {
        let mut most = set.members.len().max(1);
        loop {
            let (tried, made) = self.exchanged(model.clone(), set.value, rule, most, may);
            if made == 0 {
                return None;
            }
            let next = self.read(&tried, rule);
            if next.value < set.value * (1.0 - LEAST_GAIN)
                && next.members.len() <= set.members.len()
            {
                return Some(next);
            }
            most = match made {
                1 => return None,
                _ => (made / 4).max(1),
            };
        }
    }

    /// At most `most` exchanges in the model, each the best there is, and how many there were.
    fn exchanged<'a>(
        &'a self,
        mut model: Tableau<'a>,
        value: f64,
        rule: Rule,
        most: usize,
        may: &impl Fn(usize, usize) -> bool,
    ) -> (Tableau<'a>, usize) {
        let mut made = 0;
        // Where a place came from, which says where it may go.
        let mut origin: Vec<usize> = (0..self.len()).collect();
        let mut refused = vec![false; self.len()];
        while made < most {
            let mut best = (-LEAST_GAIN * value, None);
            for i in (0..self.len()).filter(|&i| model.is_in(i)) {
                for j in (0..self.len()).filter(|&j| !model.is_in(j) && !refused[j]) {
                    if !may(origin[i], j) {
                        continue;
                    }
                    let change = match rule {
                        Rule::Best => model.exchange(i, j),
                        Rule::Fixed => model.carry(i, j),
                    };
                    if change < best.0 {
                        best = (change, Some((i, j)));
                    }
                }
            }
            let Some((i, j)) = best.1 else { break };
            match rule {
                Rule::Best => {
                    if !model.replace(i, j) {
                        refused[j] = true;
                        continue;
                    }
                    model.settle();
                }
                Rule::Fixed => {
                    let c = model.curvature(i);
                    model.hold(i, 0.0);
                    model.hold(j, c);
                }
            }
            origin[j] = origin[i];
            made += 1;
        }
        (model, made)
    }

    /// Adds the places that gain most, until there are `count`.
    pub(super) fn grow(&self, set: &Set, count: usize) -> Set {
        let model = self.model(set, Rule::Best);
        self.grown(model, set.members.len(), count)
    }

    /// Local optima of `count` of the places, or fewer where there are no more, the best `most` first: from those that lower the variance most, and
    /// where that is cheap from those that lower J most, some at a time.
    pub(super) fn best(&self, count: usize, most: usize) -> Vec<Set> {
        let model = self.points().variance(&self.answers, self.limits);
        let mut starts = vec![self.grown(model, 0, count)];
        if count <= DETOURS[1] {
            let mut by_parts = self.weigh(Vec::new(), &[], Rule::Fixed);
            for part in PARTS {
                by_parts = self.grow(&by_parts, count.div_ceil(part));
            }
            starts.push(by_parts);
            // On a small mesh, where that is cheap, each of several places is the first in turn.
            for first in (0..self.len()).take(STARTS / self.weight.len().max(1)) {
                let first = self.weigh(vec![first], &[0.0], Rule::Best);
                starts.push(self.grow(&first, count));
            }
        }
        self.improved(starts, count, most)
    }

    /// Sets that were improved each, the best `most` first, without those that came to the same.
    pub(super) fn improved(&self, sets: Vec<Set>, count: usize, most: usize) -> Vec<Set> {
        let mut optima: Vec<Settled> = Vec::new();
        for set in sets {
            let optimum = self.settled(self.grow(&set, count), Rule::Best, |_, _| true);
            // From the same places all goes on alike.
            if !(optima.iter()).any(|other| other.set.members == optimum.set.members) {
                optima.push(optimum);
            }
        }
        let sets = optima.into_iter();
        let sets = sets.map(|optimum| self.with_detours(optimum, count));
        let mut sets: Vec<Set> = sets.collect();
        sets.sort_by(|a, b| a.value.total_cmp(&b.value));
        sets.dedup_by(|a, b| a.members == b.members);
        sets.truncate(most);
        sets
    }

    fn grown(&self, mut model: Tableau, mut now: usize, count: usize) -> Set {
        let mut refused = vec![false; self.len()];
        while now < count {
            let others = (0..self.len()).filter(|&j| !model.is_in(j) && !refused[j]);
            let best = others.min_by(|&i, &j| model.promise(i).total_cmp(&model.promise(j)));
            let Some(j) = best else { break };
            if model.free(j) {
                model.settle();
                now += 1;
            } else {
                refused[j] = true;
            }
        }
        self.read(&model, Rule::Best)
    }

    /// Takes away the members that are worth least, until `count` are left.
    pub(super) fn prune(&self, set: &Set, count: usize) -> Set {
        self.pruned(self.model(set, Rule::Best), count)
    }

    fn pruned(&self, mut model: Tableau, count: usize) -> Set {
        let mut now = (0..self.len()).filter(|&i| model.is_in(i)).count();
        while now > count {
            let members = (0..self.len()).filter(|&i| model.is_in(i));
            let Some(i) = members.min_by(|&i, &j| model.loss(i).total_cmp(&model.loss(j))) else {
                break;
            };
            if model.loss(i).is_infinite() {
                break;
            }
            model.hold(i, 0.0);
            model.settle();
            now -= 1;
        }
        self.read(&model, Rule::Best)
    }

    /// `count` of the places, or fewer where there are no more, better than a local optimum of exchanges where that is possible.
    ///
    /// More cones are added, all are exchanged, the least valuable are taken away, and what is left is exchanged once more. Many more and few
    /// more lead out of different optima.
    fn with_detours<'a>(&'a self, mut best: Settled<'a>, count: usize) -> Set {
        let any = |_: usize, _: usize| true;
        let [least, most] = MORE_CONES;
        let detours = match count {
            _ if count <= DETOURS[1] => &MORE[..],
            _ if count <= DETOURS[0] => &MORE[1..],
            _ => &[],
        };
        for share in detours {
            let more = ((share * count as f64) as usize).clamp(least, most);
            let model = self.model_of(&mut best);
            let many = self.grown(model, best.set.members.len(), count + more);
            let mut many = self.settled(many, Rule::Best, any);
            let few = self.pruned(self.model_of(&mut many), count);
            let few = self.settled(few, Rule::Best, any);
            let is_better = few.set.value < best.set.value * (1.0 - LEAST_GAIN);
            if few.set.members.len() <= count && is_better {
                best = few;
            }
        }
        best.set
    }

    fn model_of<'a>(&'a self, settled: &mut Settled<'a>) -> Tableau<'a> {
        let Settled { set, model } = settled;
        let model = model.get_or_insert_with(|| self.model(set, Rule::Best));
        model.clone()
    }
}
