//! How many samples each side of a rectangle gets.
//!
//! *Enters:* quads, and how their surfaces bend. *Leaves:* the columns and rows of their images. *Guaranteed:* opposite sides of a quad, and the two
//! quads on both sides of a wall, have the same number: the sides that must agree form strips through the quads, and each strip has one number.
//! *Not guaranteed:* the budget, where the least numbers use more.
//!
//! First a strip's number follows the mean length of its sides in space ([`Strips::even`]). Images of that size tell how the surface bends
//! along and across every rectangle ([`bends`](super::bends)), and with that the numbers are those for which the sum of squared errors is least
//! ([`Strips::bent`]): a/m⁴ + b/n⁴ + c/m²n² over all rectangles with m and n intervals, where all texels together are given. Error and texels are sums of
//! products of powers, so in the logarithms of the numbers this is a convex problem (R. J. Duffin, E. L. Peterson, C. Zener, *Geometric
//! programming*, 1967), and going through the strips one after another finds its solution.

use super::bends::Bend;
use super::quads::Quad;
use super::subdivision::Subdivision;
use crate::atlas::patches::MAX_SIDE;
use rustc_hash::FxHashMap as Map;

/// Least samples along a side: one more than a cubic needs.
pub(super) const LEAST: usize = 5;
/// Where nothing bends, texels are of use to normals and to what is laid over the images: none is longer than so many even ones.
const COARSEST: f64 = 2.0;
/// Halvings of an interval of logarithms that may span all of float64.
const HALVINGS: usize = 60;
/// The numbers are found when they move by less than this part of themselves.
const SETTLED: f64 = 1e-4;
/// Strips settle long before; this many rounds would be spent on numbers that round alike.
const ROUNDS: usize = 100;

/// The strips of sides that must have one number of samples.
pub(super) struct Strips {
    /// The strip of sides 0 and 2 of a quad, and that of sides 1 and 3.
    of_quad: Vec<[usize; 2]>,
    /// Mean length of a strip's sides in space.
    length: Vec<f64>,
}

impl Strips {
    /// Follows the strips through the quads of a drawing.
    pub fn new(drawing: &Subdivision, quads: &[Quad]) -> Self {
        let mut side_of_edge = Map::default();
        let mut length: Vec<f64> = Vec::new();
        let sides: Vec<[usize; 4]> = quads
            .iter()
            .map(|quad| {
                std::array::from_fn(|k| {
                    let edges = quad.side(drawing, k);
                    // Both quads of a wall see the same edges, so the least one names it.
                    let name = edges.iter().min().copied();
                    *side_of_edge.entry(name).or_insert_with(|| {
                        length.push(edges.iter().map(|&e| drawing.edge_length(e)).sum());
                        length.len() - 1
                    })
                })
            })
            .collect();
        let mut joined: Vec<usize> = (0..length.len()).collect();
        for side in &sides {
            for k in 0..2 {
                let (a, b) = (find(&mut joined, side[k]), find(&mut joined, side[k + 2]));
                joined[a.max(b)] = a.min(b);
            }
        }
        let mut number = vec![usize::MAX; length.len()];
        let mut total: Vec<(f64, f64)> = Vec::new();
        for (i, l) in length.iter().enumerate() {
            let first = find(&mut joined, i);
            if number[first] == usize::MAX {
                number[first] = total.len();
                total.push((0.0, 0.0));
            }
            let sum = &mut total[number[first]];
            *sum = (sum.0 + l, sum.1 + 1.0);
        }
        Self {
            of_quad: sides
                .iter()
                .map(|side| [0, 1].map(|k| number[find(&mut joined, side[k])]))
                .collect(),
            length: total.iter().map(|(sum, count)| sum / count).collect(),
        }
    }

    /// Texels about as large everywhere.
    pub fn even(&self, budget: usize) -> Vec<[usize; 2]> {
        self.samples(&self.even_intervals(budget))
    }

    /// The least error.
    pub fn bent(&self, bends: &[Bend], budget: usize) -> Vec<[usize; 2]> {
        let even = self.even_intervals(budget);
        if bends.iter().all(|b| b.is_flat()) {
            return self.samples(&even);
        }
        let least: Vec<f64> = even.iter().map(|k| k / COARSEST).collect();
        let mut intervals = even;
        // What an even image loses by one texel less, the largest one: somewhere near it the price of a texel lies.
        let losses = self.of_quad.iter().zip(bends).map(|(s, bend)| {
            let [m, n] = s.map(|s| intervals[s]);
            bend.error([m, n]) / (m * n)
        });
        let typical = losses.fold(f64::MIN_POSITIVE, f64::max).ln();
        let (mut low, mut high) = (typical - 60.0, typical + 60.0);
        // Where the least numbers are too many already, they are what is left.
        let mut best = least.clone();
        for _ in 0..HALVINGS {
            let price = 0.5 * (low + high);
            self.settle(bends, price.exp(), &least, &mut intervals);
            if self.texels(&intervals) > budget as f64 {
                low = price;
            } else {
                high = price;
                best.clone_from(&intervals);
            }
        }
        self.fill(bends, budget, &mut best);
        self.samples(&best)
    }

    /// Spends what is left of the budget, since long strips round to much less: one sample more where a texel lowers the error most, as long as there is room.
    fn fill(&self, bends: &[Bend], budget: usize, intervals: &mut [f64]) {
        for k in intervals.iter_mut() {
            *k = (count(*k) - 1) as f64;
        }
        let all: Vec<usize> = (0..self.of_quad.len()).collect();
        let mut crossed: Vec<Vec<usize>> = vec![Vec::new(); self.length.len()];
        for (quad, strips) in self.of_quad.iter().enumerate() {
            crossed[strips[0]].push(quad);
            if strips[1] != strips[0] {
                crossed[strips[1]].push(quad);
            }
        }
        let sums = |quads: &[usize], intervals: &[f64]| {
            quads.iter().fold((0.0, 0.0), |(error, texels), &quad| {
                let [m, n] = self.of_quad[quad].map(|s| intervals[s]);
                let more = (m + 1.0) * (n + 1.0);
                (error + bends[quad].error([m, n]), texels + more)
            })
        };
        let mut left = budget as f64 - sums(&all, intervals).1;
        loop {
            let mut best: Option<(f64, usize, f64)> = None;
            for (s, quads) in crossed.iter().enumerate() {
                if intervals[s] + 1.0 >= MAX_SIDE as f64 {
                    continue;
                }
                let before = sums(quads, intervals);
                intervals[s] += 1.0;
                let after = sums(quads, intervals);
                intervals[s] -= 1.0;
                let cost = after.1 - before.1;
                let gain = (before.0 - after.0) / cost;
                if cost <= left && gain > 0.0 && best.is_none_or(|(most, ..)| gain > most) {
                    best = Some((gain, s, cost));
                }
            }
            let Some((_, s, cost)) = best else { break };
            intervals[s] += 1.0;
            left -= cost;
        }
    }

    fn even_intervals(&self, budget: usize) -> Vec<f64> {
        let longest = self.length.iter().fold(f64::MIN_POSITIVE, |m, &x| m.max(x));
        let with = |density: f64| -> Vec<f64> { self.length.iter().map(|l| l * density).collect() };
        // A strip has at least one sample, and the longest one at most the budget.
        let (mut low, mut high) = (0.0, budget as f64 / longest);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if self.texels(&with(middle)) > budget as f64 {
                high = middle;
            } else {
                low = middle;
            }
        }
        with(low)
    }

    /// Goes through the strips until their numbers are those for which one texel more lowers the error by its price.
    fn settle(&self, bends: &[Bend], price: f64, least: &[f64], intervals: &mut [f64]) {
        let mut crossed: Vec<Vec<(usize, usize)>> = vec![Vec::new(); self.length.len()];
        for (quad, strips) in self.of_quad.iter().enumerate() {
            for k in 0..2 {
                crossed[strips[k]].push((quad, k));
            }
        }
        for _ in 0..ROUNDS {
            let mut moved = 0.0f64;
            for (s, crossed) in crossed.iter().enumerate() {
                // The derivative by the logarithm of k is price · k · width − fourth / k⁴ − second / k².
                let (mut fourth, mut second, mut width) = (0.0, 0.0, 0.0);
                for &(quad, k) in crossed {
                    let other = intervals[self.of_quad[quad][1 - k]];
                    let bend = &bends[quad];
                    fourth += 4.0 * bend.along[k];
                    second += 2.0 * bend.twist / (other * other);
                    width += other + 1.0;
                }
                let gains = |k: f64| (fourth / (k * k) + second) / (k * k) > price * k * width;
                let bounds = [least[s].max(LEAST as f64 - 1.0), MAX_SIDE as f64 - 1.0];
                let [mut low, mut high] = bounds.map(f64::ln);
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (low + high);
                    if gains(middle.exp()) {
                        low = middle;
                    } else {
                        high = middle;
                    }
                }
                let found = low.exp();
                moved = moved.max((found / intervals[s] - 1.0).abs());
                intervals[s] = found;
            }
            if moved < SETTLED {
                break;
            }
        }
    }

    fn samples(&self, intervals: &[f64]) -> Vec<[usize; 2]> {
        let strips = self.of_quad.iter();
        strips.map(|s| s.map(|s| count(intervals[s]))).collect()
    }

    fn texels(&self, intervals: &[f64]) -> f64 {
        let images = self.of_quad.iter();
        let texels = images.map(|s| s.map(|s| count(intervals[s]) as f64));
        texels.map(|[m, n]| m * n).sum()
    }
}

/// Whole numbers: one sample more than intervals.
fn count(intervals: f64) -> usize {
    let intervals = intervals.round().min(MAX_SIDE as f64 - 1.0);
    (intervals as usize + 1).clamp(LEAST, MAX_SIDE)
}

fn find(parent: &mut [usize], mut i: usize) -> usize {
    while parent[i] != i {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    i
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A torus of m × n quads: strips around it in both directions.
    fn torus(m: usize, n: usize) -> Strips {
        Strips {
            of_quad: (0..m * n).map(|i| [i % m, m + i / m]).collect(),
            length: (0..m + n).map(|i| 1.0 + 0.3 * (i as f64).sin()).collect(),
        }
    }

    fn bends(count: usize) -> Vec<Bend> {
        let wave = |i: usize, k: f64| (2.0 * (k * i as f64).sin()).exp();
        (0..count)
            .map(|i| Bend {
                along: [wave(i, 1.7), wave(i, 2.9)],
                twist: wave(i, 0.6),
            })
            .collect()
    }

    #[test]
    fn no_other_numbers_have_a_smaller_error() {
        let strips = torus(4, 3);
        let bends = bends(12);
        let mut intervals = vec![20.0; 7];
        // A price at which no strip is at its least.
        strips.settle(&bends, 1e-9, &[1.0; 7], &mut intervals);
        assert!(intervals.iter().all(|&k| k > 1.5 * LEAST as f64));
        let total = |intervals: &[f64]| -> f64 {
            let rows = strips.of_quad.iter().zip(&bends);
            rows.map(|(s, bend)| {
                let [m, n] = s.map(|s| intervals[s]);
                bend.error([m, n]) + 1e-9 * (m + 1.0) * (n + 1.0)
            })
            .sum()
        };
        let best = total(&intervals);
        for s in 0..7 {
            for t in 0..7 {
                for (by, and) in [(1.01, 1.01), (1.01, 0.99), (0.99, 0.99), (1.01, 1.0)] {
                    let mut other = intervals.clone();
                    other[s] *= by;
                    other[t] *= and;
                    assert!(total(&other) > best * (1.0 - 1e-7), "{s} {t} {by} {and}");
                }
            }
        }
    }

    #[test]
    fn what_bends_gets_more_and_the_budget_holds() {
        let strips = torus(3, 3);
        let mut bends = bends(9);
        for (bend, strips) in bends.iter_mut().zip(&strips.of_quad) {
            if strips[0] == 1 {
                bend.along[0] *= 1e4;
            }
        }
        let budget = 9 * 30 * 30;
        let (even, bent) = (strips.even(budget), strips.bent(&bends, budget));
        for samples in [&even, &bent] {
            let texels: usize = samples.iter().map(|[m, n]| m * n).sum();
            assert!(texels <= budget && texels > budget * 9 / 10, "{texels}");
        }
        assert!(bent[1][0] > 2 * even[1][0], "{even:?} {bent:?}");
        assert!(bent[0][0] < even[0][0]);
        assert_eq!(strips.bent(&[Bend::default(); 9], budget), even);
    }
}
