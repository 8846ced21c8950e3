//! Which curvatures are best at given places: a small quadratic program.
//!
//! *Enters:* the energy E(c) = E₀ + 2 bᵀc + cᵀBc of N cones, what they must add up to, limits. *Leaves:* the best c.
//!
//! Solved by active sets: equations for the curvatures within the limits, the others at theirs; N is some tens.

use crate::flow::solve::solve_dense;

/// What the curvatures must keep, radians.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Least and greatest curvature of a cone.
    pub(super) range: [f64; 2],
    /// Their sum, where it is fixed.
    pub(super) total: Option<f64>,
}

impl Limits {
    /// The same, so wide that `count` cones can meet the total.
    pub(super) fn for_count(self, count: usize) -> Self {
        let mean = self.total.map(|t| t / count.max(1) as f64);
        let [low, high] = self.range;
        // A margin: exactly at the limit all would be fixed.
        let range = match mean {
            Some(mean) => [
                low.min(mean - mean.abs() * 1e-9),
                high.max(mean + mean.abs() * 1e-9),
            ],
            None => self.range,
        };
        Self { range, ..self }
    }

    /// Curvatures within the limits, near those given.
    pub(super) fn nearest(self, curvature: &[f64]) -> Vec<f64> {
        let [low, high] = self.range;
        let mut c: Vec<f64> = curvature.iter().map(|x| x.clamp(low, high)).collect();
        if let Some(total) = self.total {
            // Each pass shares what is missing among those that are not at the limit in its way.
            for _ in 0..=c.len() {
                let missing = total - c.iter().sum::<f64>();
                let open = |x: f64| if missing > 0.0 { x < high } else { x > low };
                let count = c.iter().filter(|x| open(**x)).count();
                if missing == 0.0 || count == 0 {
                    break;
                }
                for x in c.iter_mut().filter(|x| open(**x)) {
                    *x = (*x + missing / count as f64).clamp(low, high);
                }
            }
        }
        c
    }
}

/// A quadratic program; see the module docs.
#[derive(Clone, Debug)]
pub(super) struct Quadratic {
    /// b.
    pub(super) slope: Vec<f64>,
    /// B, symmetric, N × N.
    pub(super) matrix: Vec<f64>,
}

/// The best curvatures.
#[derive(Clone, Debug)]
pub(super) struct Best {
    /// c, radians.
    pub(super) curvature: Vec<f64>,
    /// E − E₀ = 2 bᵀc + cᵀBc.
    pub(super) energy: f64,
    /// Multiplier of the total; 0 where it is not fixed.
    pub(super) multiplier: f64,
    /// True where a curvature is not at a limit.
    pub(super) is_inside: Vec<bool>,
}

impl Quadratic {
    /// With one variable more: its row of the matrix, its own entry there, and its slope.
    pub(super) fn with_one_more(&self, row: &[f64], own: f64, slope: f64) -> Self {
        let count = self.len();
        let mut matrix = Vec::with_capacity((count + 1) * (count + 1));
        for (i, x) in row.iter().enumerate() {
            matrix.extend_from_slice(&self.matrix[i * count..][..count]);
            matrix.push(*x);
        }
        matrix.extend_from_slice(row);
        matrix.push(own);
        let mut slopes = self.slope.clone();
        slopes.push(slope);
        Self {
            slope: slopes,
            matrix,
        }
    }

    fn len(&self) -> usize {
        self.slope.len()
    }

    fn entry(&self, i: usize, j: usize) -> f64 {
        self.matrix[i * self.len() + j]
    }

    /// The matrix of the equations for the curvatures named, with a last row and column for the total where it is fixed.
    pub(super) fn system(&self, inside: &[usize], has_total: bool) -> Vec<f64> {
        let k = inside.len();
        let size = k + usize::from(has_total);
        let mut matrix = vec![0.0; size * size];
        for (a, &i) in inside.iter().enumerate() {
            for (b, &j) in inside.iter().enumerate() {
                matrix[a * size + b] = self.entry(i, j);
            }
            if has_total {
                matrix[a * size + k] = 1.0;
                matrix[k * size + a] = 1.0;
            }
        }
        matrix
    }

    /// Half the derivative of E by curvature i.
    fn derivative(&self, c: &[f64], i: usize) -> f64 {
        self.slope[i]
            + c.iter()
                .enumerate()
                .map(|(j, c)| self.entry(i, j) * c)
                .sum::<f64>()
    }

    /// E − E₀.
    pub(super) fn energy(&self, c: &[f64]) -> f64 {
        (0..self.len())
            .map(|i| c[i] * (self.slope[i] + self.derivative(c, i)))
            .sum()
    }

    /// The least energy within the limits; `None` where the equations are singular.
    pub(super) fn minimise(&self, limits: Limits) -> Option<Best> {
        let limits = limits.for_count(self.len());
        self.within(&vec![limits.range; self.len()], limits.total)
    }

    /// The change from `start`, which is within the limits, that makes the energy of the *change* least; `limits.total` is that of the
    /// change.
    pub(super) fn minimise_from(&self, start: &[f64], limits: Limits) -> Option<Best> {
        let [low, high] = limits.range;
        let ranges: Vec<[f64; 2]> = start.iter().map(|c| [low - c, high - c]).collect();
        self.within(&ranges, limits.total)
    }

    /// The least energy with every curvature in a range of its own.
    pub(super) fn within(&self, ranges: &[[f64; 2]], total: Option<f64>) -> Option<Best> {
        let count = self.len();
        let has_total = total.is_some() && count > 0;
        let mut c = vec![0.0; count];
        let mut is_inside = vec![true; count];
        let mut multiplier = 0.0;
        // Every pass fixes or frees one; a cycle can come from rounding only, and ends here.
        for _ in 0..8 * (count + 1) {
            let inside: Vec<usize> = (0..count).filter(|&i| is_inside[i]).collect();
            let fixed = |i: usize| {
                (0..count)
                    .filter(|&j| !is_inside[j])
                    .map(|j| self.entry(i, j) * c[j])
                    .sum::<f64>()
            };
            let mut rhs: Vec<f64> = inside.iter().map(|&i| -self.slope[i] - fixed(i)).collect();
            if has_total && !inside.is_empty() {
                let rest: f64 = (0..count).filter(|&j| !is_inside[j]).map(|j| c[j]).sum();
                rhs.push(total.unwrap_or(0.0) - rest);
            }
            if !rhs.is_empty() {
                let solution = solve_dense(&self.system(&inside, has_total), &rhs)?;
                for (&i, &x) in inside.iter().zip(&solution) {
                    c[i] = x;
                }
                multiplier = if has_total {
                    solution[inside.len()]
                } else {
                    0.0
                };
            }
            let excess = |i: usize| (c[i] - ranges[i][1]).max(ranges[i][0] - c[i]);
            let worst = inside
                .into_iter()
                .max_by(|&i, &j| excess(i).total_cmp(&excess(j)));
            if let Some(i) = worst.filter(|&i| excess(i) > 1e-12) {
                c[i] = c[i].clamp(ranges[i][0], ranges[i][1]);
                is_inside[i] = false;
                continue;
            }
            // By how much a fixed curvature would like to come back inside.
            let wish = |i: usize| {
                let slope = self.derivative(&c, i) + multiplier;
                if c[i] == ranges[i][1] { slope } else { -slope }
            };
            let outside = (0..count).filter(|&i| !is_inside[i]);
            let keenest = outside.max_by(|&i, &j| wish(i).total_cmp(&wish(j)));
            match keenest.filter(|&i| wish(i) > 1e-12 * (1.0 + self.slope[i].abs())) {
                Some(i) => is_inside[i] = true,
                None => break,
            }
        }
        for (x, [low, high]) in c.iter_mut().zip(ranges) {
            *x = x.clamp(*low, *high);
        }
        if let Some(total) = total {
            // Only rounding, unless the passes ran out.
            for i in 0..count {
                let missing = total - c.iter().sum::<f64>();
                c[i] = (c[i] + missing).clamp(ranges[i][0], ranges[i][1]);
            }
        }
        Some(Best {
            energy: self.energy(&c),
            curvature: c,
            multiplier,
            is_inside,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::ricci::shapes::sequence;

    /// Σ over a few random directions that keep the total: none leads down within the limits.
    fn is_least(
        program: &Quadratic,
        best: &Best,
        limits: Limits,
        random: &mut impl FnMut() -> f64,
    ) -> bool {
        let [low, high] = limits.range;
        (0..200).all(|_| {
            let mut d: Vec<f64> = (0..program.len()).map(|_| random() - 0.5).collect();
            if limits.total.is_some() {
                let mean = d.iter().sum::<f64>() / d.len() as f64;
                d.iter_mut().for_each(|x| *x -= mean);
            }
            let moved: Vec<f64> = best
                .curvature
                .iter()
                .zip(&d)
                .map(|(c, d)| c + 1e-3 * d)
                .collect();
            let inside = moved.iter().all(|x| (low..=high).contains(x));
            !inside || program.energy(&moved) >= best.energy - 1e-12
        })
    }

    #[test]
    fn the_best_curvatures_keep_limits_and_total_and_are_best() {
        let mut random = sequence(5);
        for round in 0..400 {
            let k = 1 + round % 9;
            let convex = round % 3 != 0;
            // B = M Mᵀ, or just symmetric.
            let m: Vec<f64> = (0..k * k).map(|_| random() - 0.5).collect();
            let matrix = (0..k * k).map(|x| {
                let (i, j) = (x / k, x % k);
                match convex {
                    true => {
                        (0..k).map(|l| m[i * k + l] * m[j * k + l]).sum::<f64>()
                            + if i == j { 0.01 } else { 0.0 }
                    }
                    false => m[i * k + j] + m[j * k + i],
                }
            });
            let program = Quadratic {
                matrix: matrix.collect(),
                slope: (0..k).map(|_| 4.0 * random() - 2.0).collect(),
            };
            let range = [-0.5 - random(), 0.5 + random()];
            let total = (round % 2 == 0).then(|| (random() - 0.5) * k as f64);
            let limits = Limits { range, total };
            let best = program.minimise(limits).unwrap();
            let wide = limits.for_count(k);
            for c in &best.curvature {
                assert!(
                    *c >= wide.range[0] - 1e-12 && *c <= wide.range[1] + 1e-12,
                    "{round}: {best:?}"
                );
            }
            if let Some(total) = total {
                let sum: f64 = best.curvature.iter().sum();
                assert!((sum - total).abs() < 1e-9, "{round}: {sum} {total}");
            }
            assert!((program.energy(&best.curvature) - best.energy).abs() < 1e-9);
            if convex {
                assert!(is_least(&program, &best, wide, &mut random), "{round}");
            }
            let start = limits.for_count(k).nearest(&vec![0.3; k]);
            let change = Limits {
                range: wide.range,
                total: total.map(|_| 0.0),
            };
            let step = program.minimise_from(&start, change).unwrap();
            if total.is_some() {
                let sum: f64 = step.curvature.iter().sum();
                assert!(sum.abs() < 1e-9, "{round}: {sum} {step:?} {start:?}");
            }
        }
    }
}
