//! Spline curves through evenly spaced samples: least squares with both ends fixed.
//!
//! *Enters:* a number of samples and a basis. *Leaves:* [`LeastSquares`], which fits any number of rows of samples.
//!
//! The normal equations of the inner control points have three diagonals on either side, so one Cholesky factor without
//! fill is all it takes. With two samples or more a knot interval they are well conditioned.
//!
//! *Guaranteed:* the curve of least squared distance from its samples, sample i against parameter i / (n − 1), among those with
//! the given ends; splines that pass through all samples are found again. *Not guaranteed:* that sample and curve are nearest to
//! each other where they are: parameters are not corrected.
//!
//! L. Piegl, W. Tiller, *The NURBS Book* (1997), 9.4.1.

use super::basis::{Basis, DEGREE, Local, ORDER};

/// Fits rows of samples.
#[derive(Clone, Debug)]
pub struct LeastSquares {
    basis: Basis,
    /// The basis at every sample.
    rows: Vec<Local>,
    /// Lower factor of the normal equations of the inner control points: entry d of row i stands d columns left of the diagonal.
    factor: Vec<[f64; ORDER]>,
}

impl LeastSquares {
    /// `None` where the samples do not determine the control points.
    pub fn new(samples: usize, basis: Basis) -> Option<Self> {
        let inner = basis.count() - 2;
        let rows: Vec<Local> = (0..samples)
            .map(|i| basis.at(parameter(i, samples)))
            .collect();
        let mut factor = vec![[0.0; ORDER]; inner];
        for row in &rows {
            for a in 0..ORDER {
                for b in 0..=a {
                    if let (Some(i), Some(_)) = (inside(row, a, inner), inside(row, b, inner)) {
                        factor[i][a - b] += row.value[a] * row.value[b];
                    }
                }
            }
        }
        for i in 0..inner {
            for d in (0..=DEGREE.min(i)).rev() {
                let j = i - d;
                // Columns left of j that both rows hold.
                let shared = (1..=DEGREE - d).filter(|&k| k <= j);
                let sum: f64 = shared.map(|k| factor[i][d + k] * factor[j][k]).sum();
                let rest = factor[i][d] - sum;
                factor[i][d] = match d {
                    0 => Some(rest).filter(|&x| x > 0.0)?.sqrt(),
                    _ => rest / factor[j][0],
                };
            }
        }
        Some(Self {
            basis,
            rows,
            factor,
        })
    }

    /// The basis at a sample.
    pub fn row(&self, sample: usize) -> &Local {
        &self.rows[sample]
    }

    /// Of the curves.
    pub fn basis(&self) -> Basis {
        self.basis
    }

    /// Control points for a row of samples, the first and last of them as given.
    pub fn fit(&self, samples: &[[f64; 3]], ends: [[f64; 3]; 2]) -> Vec<[f64; 3]> {
        let inner = self.factor.len();
        let mut x = vec![[0.0; 3]; inner];
        for (row, sample) in self.rows.iter().zip(samples) {
            let weight = |number: usize| {
                let at = number.checked_sub(row.first).filter(|&r| r < ORDER);
                at.map_or(0.0, |r| row.value[r])
            };
            let [start, end] = [weight(0), weight(inner + 1)];
            let rest: [f64; 3] =
                std::array::from_fn(|c| sample[c] - start * ends[0][c] - end * ends[1][c]);
            for r in 0..ORDER {
                if let Some(i) = inside(row, r, inner) {
                    add(&mut x[i], row.value[r], rest);
                }
            }
        }
        for i in 0..inner {
            for d in 1..=DEGREE.min(i) {
                let known = x[i - d];
                add(&mut x[i], -self.factor[i][d], known);
            }
            x[i] = x[i].map(|value| value / self.factor[i][0]);
        }
        for i in (0..inner).rev() {
            for d in 1..=DEGREE.min(inner - 1 - i) {
                let known = x[i + d];
                add(&mut x[i], -self.factor[i + d][d], known);
            }
            x[i] = x[i].map(|value| value / self.factor[i][0]);
        }
        let [start, end] = ends;
        std::iter::once(start).chain(x).chain([end]).collect()
    }
}

/// Where one of `samples` evenly spaced samples lies in [0, 1].
pub fn parameter(i: usize, samples: usize) -> f64 {
    i as f64 / (samples - 1) as f64
}

/// Number among the inner control points of function `r` of a row.
fn inside(row: &Local, r: usize, inner: usize) -> Option<usize> {
    (row.first + r).checked_sub(1).filter(|&i| i < inner)
}

fn add(to: &mut [f64; 3], factor: f64, x: [f64; 3]) {
    for (sum, x) in to.iter_mut().zip(x) {
        *sum += factor * x;
    }
}
