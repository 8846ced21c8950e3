//! Two cones moved at once.
//!
//! *Enters:* a choice that no single move improves. *Leaves:* one that no move of two of its cheapest pairs improves either.
//!
//! Where two cones share what one and another place elsewhere would do better, neither leaves alone. So pairs are taken away, those first
//! without which the variance grows least, and two places are looked for one after the other. After the first, the gain of the
//! second is known for every vertex without a solve, and most pairs end there. *Not guaranteed:* the best of all choices.

use super::placement::{Choice, Placement};

/// Pairs that are tried, for every cone.
const PAIRS: usize = 3;
/// Most pairs that are moved.
const MOVES: usize = 12;

impl Placement<'_> {
    /// Moves pairs of cones, and then single ones, as long as that gains more than `least_gain` of the energy.
    pub(super) fn exchange_pairs(&mut self, mut choice: Choice, least_gain: f64) -> Choice {
        for _ in 0..MOVES {
            let goal = choice.energy * (1.0 - least_gain);
            let Some(moved) = self.move_pair(&choice, goal) else {
                break;
            };
            choice = self.exchange(moved, least_gain, false);
        }
        choice
    }

    /// The first move of a pair that brings the energy below `goal`.
    fn move_pair(&mut self, choice: &Choice, goal: f64) -> Option<Choice> {
        let count = choice.sites.len();
        let both = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j)));
        let rest = both.filter_map(|(i, j)| {
            let mut sites = choice.sites.clone();
            sites.remove(j);
            sites.remove(i);
            self.choose(sites)
        });
        let mut rest: Vec<Choice> = rest.collect();
        // Stable: pairs of the same energy in the order of their cones.
        rest.sort_by(|a, b| a.energy.total_cmp(&b.energy));
        rest.truncate(PAIRS * count);
        rest.iter().find_map(|rest| {
            let one = self.add(rest)?;
            let found = self.best_additions(&one, None).into_iter();
            let vertices: Vec<usize> = found.filter(|v| v.1 < goal).map(|v| v.0).collect();
            let two = self.with_one_of(&one.sites, one.sites.len(), &vertices)?;
            (two.energy < goal).then_some(two)
        })
    }
}
