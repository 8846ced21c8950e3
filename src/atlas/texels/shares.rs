//! The numbers of texels for which the squared error is least.
//!
//! *Enters:* which number each image has along and across, how its surface bends, and numbers that would be about even. *Leaves:* whole numbers of intervals. *Guaranteed:* none less
//! than its least, and the budget, unless the least numbers use more.
//!
//! The sum of a/m⁴ + b/n⁴ + c/m²n² over all images with m and n intervals is to be least where all texels together are given. Error and texels are sums of
//! products of powers, so in the logarithms of the numbers this is a convex problem (R. J. Duffin, E. L. Peterson, C. Zener, *Geometric
//! programming*, 1967), and going through the numbers one after another finds its solution.

use super::bend::Bend;
use crate::atlas::patch::MAX_SIDE;

/// Where nothing bends, texels are of use to normals and to what is laid over the images: none is longer than so many even ones.
const COARSEST: f64 = 2.0;
/// Halvings of the interval of prices, in logarithms.
const HALVINGS: usize = 60;
/// Most steps of Newton's method, which needs a handful.
const STEPS: usize = 60;
/// Numbers of intervals are wanted to this part of themselves.
const PRECISE: f64 = 1e-12;
/// The numbers are found when they move by less than this part of themselves.
const SETTLED: f64 = 1e-4;
/// Numbers settle long before; this many rounds would be spent on numbers that round alike.
const ROUNDS: usize = 100;

/// Which images share which numbers.
#[derive(Clone, Debug)]
pub(in crate::atlas) struct Shares {
    /// The numbers of intervals along the columns and the rows of each image, by their places in a list.
    pub of_image: Vec<[usize; 2]>,
    /// The least that each number may be.
    pub least: Vec<f64>,
    /// Texels that a row has more than intervals, and a column.
    pub border: f64,
}

impl Shares {
    /// The least error: about `even` intervals where nothing bends.
    pub fn bent(&self, bends: &[Bend], even: Vec<f64>, budget: usize) -> Vec<f64> {
        if bends.iter().all(|b| b.is_flat()) {
            return self.whole(&even);
        }
        let least: Vec<f64> = even
            .iter()
            .zip(&self.least)
            .map(|(k, least)| (k / COARSEST).max(*least))
            .collect();
        let mut intervals = even;
        // What an even image loses by one texel less, the largest one: somewhere near it the price of a texel lies.
        let losses = self.of_image.iter().zip(bends).map(|(s, bend)| {
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
        let mut best = self.whole(&best);
        self.fill(bends, budget, &mut best);
        best
    }

    /// Spends what is left of the budget, since numbers that many images share round to much less: one sample more where a texel lowers the error most, as long as there is room.
    fn fill(&self, bends: &[Bend], budget: usize, intervals: &mut [f64]) {
        let all: Vec<usize> = (0..self.of_image.len()).collect();
        let mut crossed: Vec<Vec<usize>> = vec![Vec::new(); self.least.len()];
        for (image, &[along, across]) in self.of_image.iter().enumerate() {
            crossed[along].push(image);
            if across != along {
                crossed[across].push(image);
            }
        }
        let sums = |images: &[usize], intervals: &[f64]| {
            images.iter().fold((0.0, 0.0), |(error, texels), &image| {
                let [m, n] = self.of_image[image].map(|s| intervals[s]);
                let more = (m + self.border) * (n + self.border);
                (error + bends[image].error([m, n]), texels + more)
            })
        };
        let mut left = budget as f64 - sums(&all, intervals).1;
        loop {
            let mut best: Option<(f64, usize, f64)> = None;
            for (s, images) in crossed.iter().enumerate() {
                if intervals[s] + 1.0 > self.most() {
                    continue;
                }
                let before = sums(images, intervals);
                intervals[s] += 1.0;
                let after = sums(images, intervals);
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

    /// Goes through the numbers until they are those for which one texel more lowers the error by its price.
    pub fn settle(&self, bends: &[Bend], price: f64, least: &[f64], intervals: &mut [f64]) {
        let mut crossed: Vec<Vec<(usize, usize)>> = vec![Vec::new(); self.least.len()];
        for (image, numbers) in self.of_image.iter().enumerate() {
            for k in 0..2 {
                crossed[numbers[k]].push((image, k));
            }
        }
        for _ in 0..ROUNDS {
            let mut moved = 0.0f64;
            for (s, crossed) in crossed.iter().enumerate() {
                // The derivative by the logarithm of k is cost · k − fourth / k⁴ − second / k².
                let (mut fourth, mut second, mut width) = (0.0, 0.0, 0.0);
                for &(image, k) in crossed {
                    let other = intervals[self.of_image[image][1 - k]];
                    let bend = &bends[image];
                    fourth += 4.0 * bend.along[k];
                    second += 2.0 * bend.twist / (other * other);
                    width += other + self.border;
                }
                let found = stationary(fourth, second, price * width);
                let found = found.max(least[s]).min(self.most());
                moved = moved.max((found / intervals[s] - 1.0).abs());
                intervals[s] = found;
            }
            if moved < SETTLED {
                break;
            }
        }
    }

    /// Whole numbers within their bounds.
    pub fn whole(&self, intervals: &[f64]) -> Vec<f64> {
        let rows = intervals.iter().zip(&self.least);
        rows.map(|(k, least)| k.round().max(least.ceil()).min(self.most()))
            .collect()
    }

    /// All texels with these numbers, once they are whole.
    pub fn texels(&self, intervals: &[f64]) -> f64 {
        let whole = self.whole(intervals);
        let images = self
            .of_image
            .iter()
            .map(|s| s.map(|s| whole[s] + self.border));
        images.map(|[m, n]| m * n).sum()
    }

    fn most(&self) -> f64 {
        MAX_SIDE as f64 - self.border
    }
}

/// The k > 0 for which cost · k⁵ = second · k² + fourth, none of them negative; 0 where nothing is gained.
fn stationary(fourth: f64, second: f64, cost: f64) -> f64 {
    // Either term is at most half of the left here, so this is no less than the root; from there on the difference is convex, and Newton's method falls to the root.
    let mut k = (2.0 * fourth / cost)
        .powf(0.2)
        .max((2.0 * second / cost).cbrt());
    for _ in 0..STEPS {
        let cube = k * k * k;
        let slope = 5.0 * cost * cube * k - 2.0 * second * k;
        let step = (cost * cube * k * k - second * k * k - fourth) / slope;
        // Not a number where nothing is gained: k is 0 then.
        if step.is_nan() || step <= PRECISE * k {
            break;
        }
        k -= step;
    }
    k
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stationary_numbers_solve_their_equation() {
        let values = [0.0, 1e-30, 1e-9, 0.3, 7.0, 1e12];
        for fourth in values {
            for second in values {
                for cost in [1e-20, 1e-3, 5.0, 1e15] {
                    let k = stationary(fourth, second, cost);
                    let gain = |k: f64| (fourth / (k * k) + second) / (k * k) - cost * k;
                    if fourth == 0.0 && second == 0.0 {
                        assert_eq!(k, 0.0);
                        continue;
                    }
                    let name = format!("{fourth} {second} {cost}: {k}");
                    assert!(gain(k * (1.0 - 1e-9)) > 0.0, "{name}");
                    assert!(gain(k * (1.0 + 1e-9)) < 0.0, "{name}");
                }
            }
        }
    }
}
