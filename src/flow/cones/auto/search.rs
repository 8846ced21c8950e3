//! Cones with little variance of the log scale.
//!
//! *Enters:* how many. *Leaves:* a choice that no move of one cone improves much.
//!
//! Greedy addition of the best vertex is Ben-Chen, Gotsman and Bunin 2008 with the least variance in place of the largest
//! value; that few cones are enough is what Soliman, Slepčev and Crane 2018 and Fang et al. 2021 show with convex relaxations.
//! Ours is the exact gain of every vertex, the exchange (each cone is taken away and put where it is worth most, until none wants to
//! move) and the detours (more cones than asked for are exchanged too before the least valuable leave). *Not guaranteed:* the best of all choices.

use super::placement::{Choice, Placement};

/// Share of the energy that an exchange must gain while the search looks for the right part of the surface …
const COARSE_GAIN: f64 = 1e-2;
/// … and at the end, for the right vertex: below this places differ by less than an edge.
const FINE_GAIN: f64 = 1e-4;
/// How many cones are added, as shares of their number, before as many are taken away again.
const MORE: [f64; 3] = [1.0, 0.5, 0.25];
/// The same at the least and at most.
const MORE_CONES: [usize; 2] = [2, 8];
/// How often that is gone through at most, until none of it helps.
const CYCLES: usize = 2;
/// A cone is idle that lowers the standard deviation of the log scale by less than this share …
pub(super) const IDLE: f64 = 0.01;
/// … and so is every one where it is below this without.
pub(super) const NOTHING: f64 = 1e-6;
/// Share of the energy that may be rounding.
const ROUNDING: f64 = 1e-7;
/// Vertices of all searches from a first cone of their own.
const STARTS: usize = 20_000;
/// Passes of exchanges over all cones, each of which must gain.
const PASSES: usize = 24;
/// The same where another search follows.
const START_PASSES: usize = 2;
/// Moves whose columns share one sweep of back-substitutions.
const TOGETHER: usize = 8;

/// A cone's move to one of some vertices.
struct Move {
    /// Which cone.
    cone: usize,
    /// The least energy that is promised.
    energy: f64,
    vertices: Vec<usize>,
}

impl Placement<'_> {
    /// Moves cones one by one to where they are worth most, anywhere or (`nearby`) uphill from where they are, until none gains more than
    /// `least_gain` of the energy.
    fn exchange(&mut self, choice: Choice, least_gain: f64, nearby: bool) -> Choice {
        self.exchange_at_most(PASSES, choice, least_gain, nearby)
    }

    fn exchange_at_most(
        &mut self,
        passes: usize,
        mut choice: Choice,
        least_gain: f64,
        nearby: bool,
    ) -> Choice {
        for _ in 0..passes {
            let promised = self.promised_moves(&choice, least_gain, nearby);
            let moved = promised
                .chunks(TOGETHER)
                .find_map(|some| self.make_moves(&choice, some, least_gain));
            match moved {
                Some(moved) => choice = moved,
                None => break,
            }
        }
        choice
    }

    /// What each cone alone promises to gain elsewhere, the best first, if it is more than `least_gain` of the energy.
    fn promised_moves(&self, choice: &Choice, least_gain: f64, nearby: bool) -> Vec<Move> {
        let goal = choice.energy * (1.0 - least_gain);
        let moves = (0..choice.sites.len()).filter_map(|cone| {
            let from = nearby.then(|| choice.sites[cone].vertex);
            let mut found = self.best_additions(&self.without(choice, cone)?, from);
            found.retain(|v| v.1 <= goal);
            Some(Move {
                cone,
                energy: found.iter().map(|v| v.1).reduce(f64::min)?,
                vertices: found.iter().map(|v| v.0).collect(),
            })
        });
        let mut moves: Vec<Move> = moves.collect();
        // Stable: of equals the first cone.
        moves.sort_by(|a, b| a.energy.total_cmp(&b.energy));
        moves
    }

    /// Makes those of some moves that gain enough one after another; `None` where none does.
    fn make_moves(&mut self, choice: &Choice, moves: &[Move], least_gain: f64) -> Option<Choice> {
        // All columns take one sweep of back-substitutions.
        let columns: Vec<usize> = moves.iter().flat_map(|m| m.vertices.clone()).collect();
        self.sites(&columns);
        let mut best: Option<Choice> = None;
        for Move { cone, vertices, .. } in moves {
            let now = best.as_ref().unwrap_or(choice);
            let goal = now.energy * (1.0 - least_gain);
            // One that moved before may have come to the same place, or have made this move worthless.
            let taken = |v: &usize| now.sites.iter().any(|s| s.vertex == *v);
            let free: Vec<usize> = vertices.iter().copied().filter(|v| !taken(v)).collect();
            let rest = self.without(now, *cone);
            let moved = rest.and_then(|rest| self.with_one_of(&rest.sites, *cone, &free));
            if let Some(moved) = moved.filter(|moved| moved.energy < goal) {
                best = Some(moved);
            }
        }
        best
    }

    /// `count` cones, or fewer where there are no more places.
    ///
    /// Exchange finds a local optimum. So more cones are added, all are exchanged, the least valuable are taken away, and what is
    /// left is exchanged once more. Many more and few more lead out of different optima.
    pub(super) fn search(&mut self, count: usize) -> Option<Choice> {
        if count == 0 {
            return self.choose(Vec::new());
        }
        let mut choice = self.first_choice(count, PASSES)?;
        let [least, most] = MORE_CONES;
        let more = |share: f64| ((share * count as f64) as usize).clamp(least, most);
        let mut more: Vec<usize> = MORE.into_iter().map(more).collect();
        more.dedup();
        let mut in_vain = 0;
        for &extra in more.iter().cycle().take(CYCLES * more.len()) {
            let before = choice.energy;
            choice = self.detour(choice, extra);
            in_vain = if choice.energy < before {
                0
            } else {
                in_vain + 1
            };
            // What did not help would do the same again.
            if in_vain == more.len() {
                break;
            }
        }
        Some(self.exchange(choice, FINE_GAIN, false))
    }

    /// `count` cones for another search to start from.
    pub(super) fn start(&mut self, count: usize) -> Option<Choice> {
        self.first_choice(count, START_PASSES)
    }

    /// Adds more cones, exchanges all, takes away as many, and exchanges what is left; keeps that if it is better.
    fn detour(&mut self, choice: Choice, more: usize) -> Choice {
        let count = choice.sites.len();
        let many = self.grow(choice.clone(), count + more);
        let many = self.exchange(many, COARSE_GAIN, false);
        let mut other = many;
        // Never less than half of them at once, and all others in their places before the next leave.
        while other.sites.len() > count {
            let fewer = count.max(other.sites.len().div_ceil(2));
            let Some(fewer) = self.prune(other, fewer) else {
                return choice;
            };
            other = self.exchange(fewer, COARSE_GAIN, false);
        }
        // Ways that end at the same places differ by rounding.
        match other.energy < choice.energy * (1.0 - ROUNDING) {
            true => other,
            false => choice,
        }
    }

    /// From nothing to cones that no single move improves much. On a small mesh, where that is cheap, the first cone is put at several places
    /// in turn.
    fn first_choice(&mut self, count: usize, passes: usize) -> Option<Choice> {
        let starts = (STARTS / self.len().max(1)).min(self.samples.len());
        let step = self.samples.len().div_ceil(starts.max(1)).max(1);
        let firsts = self.samples.iter().copied().step_by(step).take(starts);
        let mut starts = vec![Vec::new()];
        for first in firsts.collect::<Vec<usize>>() {
            starts.push(self.sites(&[first]));
        }
        let mut best: Option<Choice> = None;
        for start in starts {
            let Some(start) = self.choose(start) else {
                continue;
            };
            let start = self.grow(start, count);
            let choice = self.exchange_at_most(passes, start, COARSE_GAIN, false);
            let is_better = |b: &Choice| choice.energy < b.energy * (1.0 - ROUNDING);
            if best.as_ref().is_none_or(is_better) {
                best = Some(choice);
            }
        }
        best
    }

    /// Adds the best vertices, several at once as long as they are tops of different hills: what is not worth its place leaves by exchange.
    fn grow(&mut self, mut choice: Choice, count: usize) -> Choice {
        while choice.sites.len() < count {
            let mut new = self.additions(&choice, None, TOGETHER);
            // Stable: of equals the first found.
            new.sort_by(|a, b| a.1.total_cmp(&b.1));
            new.truncate(count - choice.sites.len());
            let vertices: Vec<usize> = new.iter().map(|v| v.0).collect();
            let mut sites = choice.sites.clone();
            sites.extend(self.sites(&vertices));
            match self.choose(sites) {
                Some(next) if !vertices.is_empty() => choice = next,
                _ => break,
            }
        }
        choice
    }

    /// Takes away the cones that are worth least, one by one, until `count` are left.
    pub(super) fn prune(&self, mut choice: Choice, count: usize) -> Option<Choice> {
        while choice.sites.len() > count {
            choice = self.cheapest_removal(&choice)?;
        }
        Some(choice)
    }

    /// The best curvatures at these places and near them, after u without cones has changed.
    pub(super) fn settle(&mut self, choice: Choice) -> Option<Choice> {
        let weighed = self.choose(choice.sites)?;
        Some(self.exchange(weighed, FINE_GAIN, true))
    }

    /// Takes away cones that do not pay, as long as more than `least` are left: those without which the standard deviation of the log
    /// scale grows by less than a share of it, or stays nothing.
    pub(super) fn drop_idle(&self, mut choice: Choice, least: usize) -> Choice {
        while choice.sites.len() > least {
            let Some(fewer) = self.cheapest_removal(&choice) else {
                break;
            };
            let (with, without) = (choice.deviation(), fewer.deviation());
            if without > NOTHING && without > with * (1.0 + IDLE) {
                break;
            }
            choice = fewer;
        }
        choice
    }

    /// The fewest cones, from `least` to `most`, with |u − mean| within `bound` on every face, or `most` of them.
    pub(super) fn search_bounded(
        &mut self,
        least: usize,
        most: usize,
        bound: f64,
    ) -> Option<Choice> {
        let mut choice = self.search(least)?;
        while self.largest_deviation(&choice) > bound && choice.sites.len() < most {
            let Some(more) = self.add(&choice) else { break };
            choice = self.exchange(more, COARSE_GAIN, false);
        }
        Some(self.exchange(choice, FINE_GAIN, false))
    }

    /// max |u − mean| over the faces, u of a face being that of its corners on average.
    fn largest_deviation(&mut self, choice: &Choice) -> f64 {
        let vertices = choice.vertices();
        let u = self.log_scale_of(vertices.iter().zip(&choice.best.curvature));
        let mean = self.picture.mean(&u);
        let faces = self.connectivity.faces();
        faces
            .map(|f| {
                let corners = self.connectivity.face_vertices(f);
                let own = corners.iter().map(|v| u[v.index()]).sum::<f64>() / 3.0;
                (own - mean).abs()
            })
            .fold(0.0, f64::max)
    }

    /// Without the cone that is worth least.
    pub(super) fn cheapest_removal(&self, choice: &Choice) -> Option<Choice> {
        (0..choice.sites.len())
            .filter_map(|i| self.without(choice, i))
            .reduce(|a, b| if b.energy < a.energy { b } else { a })
    }
}
