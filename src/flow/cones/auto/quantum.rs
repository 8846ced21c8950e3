//! Curvatures that are multiples of a quantum.
//!
//! *Enters:* cones of any curvature in a pool of places. *Leaves:* cones whose curvatures are whole numbers of quanta, of either sign, with
//! the same total.
//!
//! Integers take the problem out of convex programming; Li et al. 2022 round and re-optimise. Here the second-order model tells at
//! once what each step gains: a quantum goes from one place of the pool to another, or a whole cone does, with or without giving a
//! quantum away. Every step lowers the objective, so it ends.

use super::objective::NOTHING;
use super::pool::{LEAST_GAIN, Pool, Rule, Set};
use super::tableau::{Limits, Tableau};

/// Rounds of steps, each on a model of its own.
const PASSES: usize = 16;

/// Greatest numbers of quanta at a cone that are tried.
const CAPS: usize = 3;

/// Whole numbers of one quantum.
#[derive(Clone, Copy)]
pub(super) struct Quanta {
    /// One, radians.
    size: f64,
    /// Least and greatest number at a cone.
    range: [i64; 2],
    /// Their sum, where it is fixed.
    total: Option<i64>,
}

/// Numbers of quanta at the places of a pool.
type Numbers = Vec<i64>;

impl Quanta {
    /// `None` where the total is no whole number of quanta.
    pub(super) fn new(size: f64, limits: Limits) -> Option<Self> {
        let [low, high] = limits.range;
        let rounding = 1e-9;
        let total = match limits.total {
            Some(total) => {
                let count = (total / size).round();
                if (total - count * size).abs() > rounding {
                    return None;
                }
                Some(count as i64)
            }
            None => None,
        };
        Some(Self {
            size,
            range: [
                (low / size - rounding).ceil() as i64,
                (high / size + rounding).floor() as i64,
            ],
            total,
        })
    }

    /// The same with each greatest number at a cone that lets `count` cones meet the total, the smallest first.
    pub(super) fn caps(self, count: usize) -> Vec<Self> {
        let [low, high] = self.range;
        let enough = |cap: &i64| self.total.is_none_or(|total| cap * count as i64 >= total);
        let caps = (1..=high.max(1)).filter(|cap| *cap <= high && enough(cap));
        let capped = |cap: i64| Self {
            range: [low, cap],
            ..self
        };
        caps.take(CAPS).map(capped).collect()
    }

    fn allows(self, k: i64) -> bool {
        (self.range[0]..=self.range[1]).contains(&k)
    }

    /// Whole quanta with a low objective, at most `count` cones, from some cones of any curvature. `None` where the limits leave no way to meet the
    /// total.
    pub(super) fn search(self, pool: &Pool, start: &Set, count: usize) -> Option<Set> {
        let mut numbers = self.rounded(pool, start, count)?;
        let mut set = self.set(pool, &numbers);
        for _ in 0..PASSES {
            if set.value <= NOTHING {
                break;
            }
            // All steps that the model wants; then fewer, if the objective disagrees.
            let mut most = usize::MAX;
            let better = loop {
                let mut model = pool.model(&set, Rule::Fixed);
                // A quantum may go from any place to any.
                model.complete();
                let mut next = numbers.clone();
                let mut made = 0;
                while made < most && self.step(&mut model, &mut next, count, set.value) {
                    made += 1;
                }
                if made == 0 {
                    break None;
                }
                let tried = self.set(pool, &next);
                if tried.value < set.value * (1.0 - LEAST_GAIN) {
                    break Some((next, tried));
                }
                if made == 1 {
                    break None;
                }
                most = (made / 4).max(1);
            };
            match better {
                Some(better) => (numbers, set) = better,
                None => break,
            }
        }
        Some(set)
    }

    fn set(self, pool: &Pool, numbers: &Numbers) -> Set {
        let members: Vec<usize> = (0..numbers.len()).filter(|&i| numbers[i] != 0).collect();
        let curvature: Vec<f64> = members.iter().map(|&m| self.radians(numbers[m])).collect();
        pool.weigh(members, &curvature, Rule::Fixed)
    }

    fn radians(self, k: i64) -> f64 {
        k as f64 * self.size
    }

    /// Rounds, then adds or takes quanta where that costs least until the total is met.
    fn rounded(self, pool: &Pool, start: &Set, count: usize) -> Option<Numbers> {
        let [low, high] = self.range;
        let mut numbers = vec![0; pool.len()];
        for (&m, c) in start.members.iter().zip(&start.curvature) {
            numbers[m] = ((c / self.size).round() as i64).clamp(low, high);
        }
        let Some(total) = self.total else {
            return Some(numbers);
        };
        let mut model = pool.model(&self.set(pool, &numbers), Rule::Fixed);
        loop {
            let missing = total - numbers.iter().sum::<i64>();
            if missing == 0 {
                return Some(numbers);
            }
            let sign = missing.signum();
            let is_full = numbers.iter().filter(|k| **k != 0).count() >= count;
            let open = (0..pool.len())
                .filter(|&j| self.allows(numbers[j] + sign) && !(is_full && numbers[j] == 0));
            let amount = sign as f64 * self.size;
            let cost = |j: usize| model.change(j, amount);
            let best = open.min_by(|&i, &j| cost(i).total_cmp(&cost(j)))?;
            numbers[best] += sign;
            model.hold(best, self.radians(numbers[best]));
        }
    }

    /// The best step in the model; false where none gains enough.
    fn step(self, model: &mut Tableau, numbers: &mut Numbers, count: usize, value: f64) -> bool {
        let full = numbers.iter().filter(|k| **k != 0).count();
        let keeps = |i: usize, a: i64, j: usize, b: i64| {
            let new = usize::from(a != 0) + usize::from(b != 0);
            let old = usize::from(numbers[i] != 0) + usize::from(numbers[j] != 0);
            full + new - old <= count && self.allows(a) && self.allows(b)
        };
        let mut best = (-LEAST_GAIN * value, None);
        for i in 0..numbers.len() {
            for j in (0..numbers.len()).filter(|&j| j != i) {
                // All of it, or one quantum.
                for amount in [1, numbers[i]] {
                    let (a, b) = (numbers[i] - amount, numbers[j] + amount);
                    let is_nothing =
                        amount == 0 || (numbers[i] == 0 && numbers[j] == 0 && full + 2 > count);
                    if is_nothing || !keeps(i, a, j, b) {
                        continue;
                    }
                    let change = model.shift(i, j, self.radians(amount));
                    if change < best.0 {
                        best = (change, Some([(i, a), (j, b)]));
                    }
                }
            }
            if self.total.is_none() {
                for amount in [-1, 1, -numbers[i]] {
                    let k = numbers[i] + amount;
                    let new = full + usize::from(k != 0) - usize::from(numbers[i] != 0);
                    if amount == 0 || new > count || !self.allows(k) {
                        continue;
                    }
                    let change = model.change(i, self.radians(amount));
                    if change < best.0 {
                        best = (change, Some([(i, k), (i, k)]));
                    }
                }
            }
        }
        let Some(changes) = best.1 else { return false };
        for (i, k) in changes {
            numbers[i] = k;
            model.hold(i, self.radians(k));
        }
        true
    }
}
