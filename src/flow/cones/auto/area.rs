//! Area distortion (9) of a log scale, and the curvatures at given places that make it least.
//!
//! *Enters:* u without cones and what a unit of curvature at each place adds to it, at points with weights (vertices of the surface, or
//! means over cells). *Leaves:* curvatures.
//!
//! With both areas normalised, (9) is F = ∫e^{4u} / (∫e^{2u})² − 1. Its logarithm ln ∫e^{4u} − 2 ln ∫e^{2u} is the difference of two convex
//! functions, smooth, and does not change with a constant in u. For small u it is four times the variance; for large u it is ruled by
//! what grows most, and a part that shrinks to nothing costs its area only. A cone of π or more has ∫e^{4u} = ∞ on a smooth
//! surface, so the distortion around it is one of the mesh.

use super::quadratic::{Limits, Quadratic};
use rayon::prelude::*;

/// Points a thread sums in one go; the sums do not depend on the number of threads.
const PIECE: usize = 4096;
/// Relative gain of F + 1 below which they are good enough.
const SETTLED: f64 = 1e-6;

/// A surface seen at points.
#[derive(Clone, Copy)]
pub(super) struct Points<'a> {
    /// Area of each, all together 1.
    pub(super) weight: &'a [f64],
    /// u without cones.
    pub(super) base: &'a [f64],
}

/// Sums over the points at one u.
struct Sums {
    /// ∫e^{2u}, ∫e^{4u}, both with u relative to its maximum.
    areas: [f64; 2],
    /// ∫ g e^{2u}, ∫ g e^{4u} of every place.
    first: Vec<[f64; 2]>,
    /// ∫ g_i g_j e^{2u}, ∫ g_i g_j e^{4u}, i ≤ j row by row; empty where not asked for.
    second: Vec<[f64; 2]>,
}

impl Points<'_> {
    /// u with cones, relative to its maximum.
    fn log_scale(&self, answers: &[&[f64]], curvature: &[f64]) -> Vec<f64> {
        let mut u = vec![0.0; self.base.len()];
        u.par_chunks_mut(PIECE).enumerate().for_each(|(piece, u)| {
            let from = piece * PIECE;
            u.copy_from_slice(&self.base[from..from + u.len()]);
            for (g, c) in answers.iter().zip(curvature) {
                u.iter_mut().zip(&g[from..]).for_each(|(u, g)| *u += c * g);
            }
        });
        let top = u.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        u.par_iter_mut().with_min_len(PIECE).for_each(|u| *u -= top);
        u
    }

    fn sums(&self, answers: &[&[f64]], curvature: &[f64], with_second: bool) -> Sums {
        let u = self.log_scale(answers, curvature);
        let k = answers.len();
        let pairs = if with_second { k * (k + 1) / 2 } else { 0 };
        let parts: Vec<Vec<[f64; 2]>> = u
            .par_chunks(PIECE)
            .enumerate()
            .map(|(piece, u)| {
                let mut sum = vec![[0.0; 2]; 1 + if with_second { k + pairs } else { 0 }];
                let mut g = vec![0.0; k];
                for (i, &u) in u.iter().enumerate() {
                    let at = piece * PIECE + i;
                    let grown = (2.0 * u).exp();
                    let w = [self.weight[at] * grown, self.weight[at] * grown * grown];
                    let add = |sum: &mut [f64; 2], x: f64| {
                        sum[0] += x * w[0];
                        sum[1] += x * w[1];
                    };
                    add(&mut sum[0], 1.0);
                    if with_second {
                        g.iter_mut().zip(answers).for_each(|(g, a)| *g = a[at]);
                        let (first, second) = sum[1..].split_at_mut(k);
                        let mut next = second.iter_mut();
                        for (i, x) in g.iter().enumerate() {
                            add(&mut first[i], *x);
                            // As many slots as pairs.
                            g[i..]
                                .iter()
                                .zip(&mut next)
                                .for_each(|(y, s)| add(s, x * y));
                        }
                    }
                }
                sum
            })
            .collect();
        let mut total = vec![[0.0; 2]; 1 + if with_second { k + pairs } else { 0 }];
        for part in parts {
            for (t, p) in total.iter_mut().zip(part) {
                *t = [t[0] + p[0], t[1] + p[1]];
            }
        }
        let second = total.split_off(total.len() - pairs);
        Sums {
            areas: total[0],
            first: total[1..].to_vec(),
            second,
        }
    }

    /// ln (F + 1).
    pub(super) fn value(&self, answers: &[&[f64]], curvature: &[f64]) -> f64 {
        let [a, q] = self.sums(answers, curvature, false).areas;
        q.ln() - 2.0 * a.ln()
    }

    /// ∂ ln(F + 1) / ∂u of every point.
    pub(super) fn derivative(&self, answers: &[&[f64]], curvature: &[f64]) -> Vec<f64> {
        let mut u = self.log_scale(answers, curvature);
        let [a, q] = self.sums(answers, curvature, false).areas;
        u.par_iter_mut()
            .zip(self.weight)
            .with_min_len(PIECE)
            .for_each(|(u, w)| {
                let grown = (2.0 * *u).exp();
                *u = 4.0 * w * grown * (grown / q - 1.0 / a);
            });
        u
    }

    /// The best curvatures that at most `steps` of Newton's method reach from `start`, and ln(F + 1) there.
    pub(super) fn curvatures(
        &self,
        answers: &[&[f64]],
        start: &[f64],
        limits: Limits,
        steps: usize,
    ) -> (Vec<f64>, f64) {
        let k = answers.len();
        let limits = limits.for_count(k);
        let mut c = limits.nearest(start);
        let mut value = self.value(answers, &c);
        for _ in 0..steps {
            let sums = self.sums(answers, &c, true);
            let [a, q] = sums.areas;
            let mean = |i: usize| [sums.first[i][0] / a, sums.first[i][1] / q];
            let slope: Vec<f64> = (0..k).map(|i| 2.0 * (mean(i)[1] - mean(i)[0])).collect();
            let left = Limits {
                range: limits.range,
                total: limits.total.map(|_| 0.0),
            };
            // The whole second derivative where that leads down, else its convex part.
            let step = [1.0, 0.0].into_iter().find_map(|concave| {
                let mut matrix = vec![0.0; k * k];
                let mut pair = sums.second.iter();
                for i in 0..k {
                    for (j, [s2, s4]) in (i..k).zip(&mut pair) {
                        let (m, n) = (mean(i), mean(j));
                        let covariance = [s2 / a - m[0] * n[0], s4 / q - m[1] * n[1]];
                        let entry = 8.0 * covariance[1] - 4.0 * concave * covariance[0];
                        matrix[i * k + j] = entry;
                        matrix[j * k + i] = entry;
                    }
                }
                let program = Quadratic {
                    slope: slope.clone(),
                    matrix,
                };
                let best = program.minimise_from(&c, left)?;
                let mut length = 1.0;
                while length > 1e-3 {
                    let next: Vec<f64> = c
                        .iter()
                        .zip(&best.curvature)
                        .map(|(c, d)| c + length * d)
                        .collect();
                    let reached = self.value(answers, &next);
                    if reached < value {
                        return Some((next, reached));
                    }
                    length *= 0.25;
                }
                None
            });
            let Some((next, reached)) = step else { break };
            let gained = value - reached;
            (c, value) = (next, reached);
            if gained < SETTLED {
                break;
            }
        }
        (c, value)
    }
}
