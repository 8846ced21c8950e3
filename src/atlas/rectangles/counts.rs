//! How many samples each side of a rectangle gets.
//!
//! *Enters:* quads, and how their surfaces bend. *Leaves:* the columns and rows of their images. *Guaranteed:* opposite sides of a quad, and the two
//! quads on both sides of a wall, have the same number: the sides that must agree form strips through the quads, and each strip has one number.
//! *Not guaranteed:* the budget, where the least numbers use more.
//!
//! First a strip's number follows the mean length of its sides in space ([`Strips::even`]). Images of that size tell how the surface bends
//! along and across every rectangle, and with that the numbers are those for which the sum of squared errors is least ([`Strips::bent`]).

use super::quads::Quad;
use crate::atlas::texels::{Bend, Shares};
use crate::geometry::subdivision::Subdivision;
use rustc_hash::FxHashMap as Map;

/// Least samples along a side: one more than a cubic needs.
pub(super) const LEAST: usize = 5;
/// Halvings of an interval that may span all of float64.
const HALVINGS: usize = 60;

/// The strips of sides that must have one number of samples.
pub(super) struct Strips {
    /// The strip of sides 0 and 2 of a quad, and that of sides 1 and 3.
    shares: Shares,
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
        let of_image = sides.iter();
        let of_image = of_image.map(|side| [0, 1].map(|k| number[find(&mut joined, side[k])]));
        Self {
            shares: Shares {
                of_image: of_image.collect(),
                least: vec![LEAST as f64 - 1.0; total.len()],
                border: 1.0,
            },
            length: total.iter().map(|(sum, count)| sum / count).collect(),
        }
    }

    /// Texels about as large everywhere.
    pub fn even(&self, budget: usize) -> Vec<[usize; 2]> {
        self.samples(&self.shares.whole(&self.even_intervals(budget)))
    }

    /// The least error.
    pub fn bent(&self, bends: &[Bend], budget: usize) -> Vec<[usize; 2]> {
        let even = self.even_intervals(budget);
        self.samples(&self.shares.bent(bends, even, budget))
    }

    fn even_intervals(&self, budget: usize) -> Vec<f64> {
        let longest = self.length.iter().fold(f64::MIN_POSITIVE, |m, &x| m.max(x));
        let with = |density: f64| -> Vec<f64> { self.length.iter().map(|l| l * density).collect() };
        // A strip has at least one sample, and the longest one at most the budget.
        let (mut low, mut high) = (0.0, budget as f64 / longest);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if self.shares.texels(&with(middle)) > budget as f64 {
                high = middle;
            } else {
                low = middle;
            }
        }
        with(low)
    }

    fn samples(&self, intervals: &[f64]) -> Vec<[usize; 2]> {
        let images = self.shares.of_image.iter();
        images
            .map(|s| s.map(|s| intervals[s] as usize + 1))
            .collect()
    }
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
            shares: Shares {
                of_image: (0..m * n).map(|i| [i % m, m + i / m]).collect(),
                least: vec![LEAST as f64 - 1.0; m + n],
                border: 1.0,
            },
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
        strips
            .shares
            .settle(&bends, 1e-9, &[1.0; 7], &mut intervals);
        assert!(intervals.iter().all(|&k| k > 1.5 * LEAST as f64));
        let total = |intervals: &[f64]| -> f64 {
            let rows = strips.shares.of_image.iter().zip(&bends);
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
        for (bend, strips) in bends.iter_mut().zip(&strips.shares.of_image) {
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
