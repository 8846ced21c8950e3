//! Cones with little variance of the log scale.
//!
//! *Enters:* how many. *Leaves:* a choice that no move of one cone improves much.
//!
//! Greedy addition of the best vertex is Ben-Chen, Gotsman and Bunin 2008 with the least variance in place of the largest
//! value; that few cones are enough is what Soliman, Slepčev and Crane 2018 and Fang et al. 2021 show with convex relaxations.
//! Ours is the exact gain of every vertex and the exchange: each cone in turn is taken away and put where it is worth most, until
//! none wants to move. *Not guaranteed:* the best of all choices.

use super::placement::{Choice, Placement};

/// Share of the energy that an exchange must gain while the search looks for the right part of the surface …
const COARSE_GAIN: f64 = 1e-2;
/// … and at the end, for the right vertex: below this places differ by less than an edge.
const FINE_GAIN: f64 = 1e-4;
/// Most rounds of adding and taking away.
const ROUNDS: usize = 3;
/// A cone is idle that lowers the standard deviation of the log scale by less than this share …
const IDLE: f64 = 0.01;
/// … and so is every one where it is below this without.
const NOTHING: f64 = 1e-6;
/// Share of the energy that may be rounding.
const ROUNDING: f64 = 1e-7;
/// Vertices of all searches from a first cone of their own.
const STARTS: usize = 20_000;
/// Passes of exchanges over all cones.
const PASSES: usize = 12;
impl Placement<'_> {
    /// Moves cones one by one to where they are worth most, anywhere or (`nearby`) uphill from where they are, until none gains more than
    /// `least_gain` of the energy.
    pub(super) fn exchange(&mut self, mut choice: Choice, least_gain: f64, nearby: bool) -> Choice {
        let count = choice.sites.len();
        // Cones that stayed where they were since anything moved.
        let (mut stayed, mut next) = (0, 0);
        let mut looked = 0;
        while stayed < count && looked < PASSES * count {
            looked += 1;
            let from = nearby.then(|| choice.sites[next].vertex);
            let moved = self.without(&choice, next).and_then(|rest| {
                let vertices = self.best_additions(&rest, from).into_iter();
                let vertices: Vec<usize> = vertices
                    .filter(|v| v.1 <= choice.energy * (1.0 - least_gain))
                    .map(|v| v.0)
                    .collect();
                self.with_one_of(&rest.sites, next, &vertices)
            });
            match moved.filter(|moved| moved.energy < choice.energy * (1.0 - least_gain)) {
                Some(moved) => {
                    choice = moved;
                    stayed = 0;
                }
                None => stayed += 1,
            }
            next = (next + 1) % count;
        }
        choice
    }

    /// `count` cones, or fewer where there are no more places.
    ///
    /// Exchange finds a local optimum. So as many cones again are added, the least valuable of all are taken away, and cones are
    /// exchanged once more, as long as that helps.
    pub(super) fn search(&mut self, count: usize) -> Option<Choice> {
        if count == 0 {
            return self.choose(Vec::new());
        }
        let mut choice = self.first_choice(count)?;
        for _ in 0..ROUNDS {
            let more = self.grow(choice.clone(), 2 * count.max(2));
            let Some(fewer) = self.prune(more, count) else {
                break;
            };
            let other = self.exchange(fewer, COARSE_GAIN, false);
            let gained = choice.energy - other.energy;
            let go_on = gained > COARSE_GAIN * choice.energy;
            if gained > 0.0 {
                choice = other;
            }
            if !go_on {
                break;
            }
        }
        choice = self.exchange_pairs(choice, COARSE_GAIN);
        Some(self.exchange(choice, FINE_GAIN, false))
    }

    /// From nothing to cones that no single move improves much. On a small mesh, where that is cheap, the first cone is put at several places
    /// in turn.
    fn first_choice(&mut self, count: usize) -> Option<Choice> {
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
            let choice = self.exchange(start, COARSE_GAIN, false);
            // Starts that end at the same places differ by rounding.
            let is_better = |b: &Choice| choice.energy < b.energy * (1.0 - ROUNDING);
            if best.as_ref().is_none_or(is_better) {
                best = Some(choice);
            }
        }
        best
    }

    /// Adds the best vertex again and again.
    fn grow(&mut self, mut choice: Choice, count: usize) -> Choice {
        while choice.sites.len() < count {
            let Some(next) = self.add(&choice) else { break };
            choice = next;
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
