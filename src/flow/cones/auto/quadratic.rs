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
        let count = self.len();
        let limits = limits.for_count(count);
        let [low, high] = limits.range;
        let has_total = limits.total.is_some() && count > 0;
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
                rhs.push(limits.total.unwrap_or(0.0) - rest);
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
            let excess = |i: usize| (c[i] - high).max(low - c[i]);
            let worst = inside
                .into_iter()
                .max_by(|&i, &j| excess(i).total_cmp(&excess(j)));
            if let Some(i) = worst.filter(|&i| excess(i) > 1e-12) {
                c[i] = c[i].clamp(low, high);
                is_inside[i] = false;
                continue;
            }
            // By how much a fixed curvature would like to come back inside.
            let wish = |i: usize| {
                let slope = self.derivative(&c, i) + multiplier;
                if c[i] == high { slope } else { -slope }
            };
            let outside = (0..count).filter(|&i| !is_inside[i]);
            let keenest = outside.max_by(|&i, &j| wish(i).total_cmp(&wish(j)));
            match keenest.filter(|&i| wish(i) > 1e-12 * (1.0 + self.slope[i].abs())) {
                Some(i) => is_inside[i] = true,
                None => break,
            }
        }
        if let Some(total) = limits.total {
            // Only rounding, unless the passes ran out.
            for i in 0..count {
                let missing = total - c.iter().sum::<f64>();
                c[i] = (c[i] + missing).clamp(low, high);
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
