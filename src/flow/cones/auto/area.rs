//! Area distortion (9) of a log scale, and the curvatures at given places that make it least.
//!
//! *Enters:* u without cones and what a unit of curvature at each place adds to it, at points with weights (vertices of the surface, or
//! means over cells). *Leaves:* curvatures.
//!
//! With both areas normalised, (9) is F = ∫e^{4u} / (∫e^{2u})² − 1. Its logarithm ln ∫e^{4u} − 2 ln ∫e^{2u} is the difference of two convex
//! functions, smooth, and does not change with a constant in u. For small u it is four times the variance; for large u it is ruled by
//! what grows most, and a part that shrinks to nothing costs its area only. A cone of π or more has ∫e^{4u} = ∞ on a smooth
//! surface, so the distortion around it is one of the mesh.

use super::dot::dot;
use super::quadratic::{Limits, Quadratic};
use rayon::prelude::*;

/// Points a thread sums in one go; the sums do not depend on the number of threads.
const PIECE: usize = 4096;
/// Relative gain of F + 1 below which they are good enough.
const SETTLED: f64 = 1e-10;
/// Gain that a step promises below which rounding hides it, so that it is taken as it is.
const HIDDEN: f64 = 1e-13;

/// A surface seen at points.
#[derive(Clone, Copy)]
pub(super) struct Points<'a> {
    /// Area of each, all together 1.
    pub(super) weight: &'a [f64],
    /// u without cones.
    pub(super) base: &'a [f64],
}

/// Curvatures at given places, and what they lead to.
#[derive(Clone)]
pub(super) struct Weighed {
    /// Radians.
    pub(super) curvature: Vec<f64>,
    /// ln (F + 1).
    pub(super) value: f64,
    /// u with these cones, relative to its maximum.
    u: Vec<f64>,
    /// Half the second derivative of the value by the curvatures, from a step before; empty where they are not to change.
    matrix: Vec<f64>,
}

/// How far derivatives by curvature are wanted.
#[derive(Clone, Copy, PartialEq, PartialOrd)]
enum Order {
    Value,
    First,
    Second,
}

/// Sums over the points at one u.
struct Sums {
    /// ∫e^{2u}, ∫e^{4u}, both with u relative to its maximum.
    areas: [f64; 2],
    /// ∫ g e^{2u}, ∫ g e^{4u} of every place.
    first: Vec<[f64; 2]>,
    /// ∫ g_i g_j e^{2u}, ∫ g_i g_j e^{4u}, i ≤ j row by row.
    second: Vec<[f64; 2]>,
}

impl Sums {
    fn value(&self) -> f64 {
        self.areas[1].ln() - 2.0 * self.areas[0].ln()
    }

    /// Means of g by the flat area and by its square.
    fn mean(&self, i: usize) -> [f64; 2] {
        std::array::from_fn(|k| self.first[i][k] / self.areas[k])
    }

    /// Half the derivative of the value by each curvature.
    fn slope(&self) -> Vec<f64> {
        let by = |i| {
            let [a, q] = self.mean(i);
            2.0 * (q - a)
        };
        (0..self.first.len()).map(by).collect()
    }

    /// Half the second derivative of the value, or (`concave` 0) of its convex part.
    fn matrix(&self, concave: f64) -> Vec<f64> {
        let k = self.first.len();
        let [a, q] = self.areas;
        let mut matrix = vec![0.0; k * k];
        let mut pair = self.second.iter();
        for i in 0..k {
            for (j, [s2, s4]) in (i..k).zip(&mut pair) {
                let (m, n) = (self.mean(i), self.mean(j));
                let covariance = [s2 / a - m[0] * n[0], s4 / q - m[1] * n[1]];
                let entry = 8.0 * covariance[1] - 4.0 * concave * covariance[0];
                matrix[i * k + j] = entry;
                matrix[j * k + i] = entry;
            }
        }
        matrix
    }
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

    fn sums(&self, u: &[f64], answers: &[&[f64]], order: Order) -> Sums {
        let k = answers.len();
        let pairs = k * (k + 1) / 2;
        let count = match order {
            Order::Value => 1,
            Order::First => 1 + k,
            Order::Second => 1 + k + pairs,
        };
        let parts: Vec<Vec<[f64; 2]>> = u
            .par_chunks(PIECE)
            .enumerate()
            .map(|(piece, u)| {
                let here = piece * PIECE..piece * PIECE + u.len();
                let grown: Vec<f64> = u.iter().map(|u| (2.0 * u).exp()).collect();
                let flat = times(&grown, &self.weight[here.clone()]);
                let square = times(&grown, &flat);
                let mut sum = Vec::with_capacity(count);
                sum.push([flat.iter().sum(), square.iter().sum()]);
                if order >= Order::First {
                    let answers = answers.iter().map(|g| &g[here.clone()]);
                    sum.extend(answers.map(|g| [dot(g, &flat), dot(g, &square)]));
                }
                if order == Order::Second {
                    for (i, g) in answers.iter().enumerate() {
                        let g = &g[here.clone()];
                        let with = [times(g, &flat), times(g, &square)];
                        let others = answers[i..].iter().map(|h| &h[here.clone()]);
                        sum.extend(others.map(|h| [dot(h, &with[0]), dot(h, &with[1])]));
                    }
                }
                sum
            })
            .collect();
        let mut total = vec![[0.0; 2]; count];
        for part in parts {
            for (t, p) in total.iter_mut().zip(part) {
                *t = [t[0] + p[0], t[1] + p[1]];
            }
        }
        let second = total.split_off(total.len().min(1 + k));
        Sums {
            areas: total[0],
            first: total.split_off(1),
            second,
        }
    }

    /// ln (F + 1).
    pub(super) fn value(&self, answers: &[&[f64]], curvature: &[f64]) -> f64 {
        let u = self.log_scale(answers, curvature);
        self.sums(&u, &[], Order::Value).value()
    }

    /// ∂ ln(F + 1) / ∂u of every point.
    pub(super) fn derivative(&self, weighed: &Weighed) -> Vec<f64> {
        let [a, q] = self.sums(&weighed.u, &[], Order::Value).areas;
        let points = weighed.u.par_iter().zip(self.weight).with_min_len(PIECE);
        points
            .map(|(u, w)| {
                let grown = (2.0 * u).exp();
                4.0 * w * grown * (grown / q - 1.0 / a)
            })
            .collect()
    }

    /// These curvatures, as they are.
    pub(super) fn fixed(&self, answers: &[&[f64]], curvature: &[f64]) -> Weighed {
        let u = self.log_scale(answers, curvature);
        Weighed {
            curvature: curvature.to_vec(),
            value: self.sums(&u, &[], Order::Value).value(),
            u,
            matrix: Vec::new(),
        }
    }

    /// The best curvatures that at most `steps` of Newton's method reach from `start`.
    pub(super) fn best(
        &self,
        answers: &[&[f64]],
        start: &[f64],
        limits: Limits,
        steps: usize,
    ) -> Weighed {
        let limits = limits.for_count(answers.len());
        let mut now = self.fixed(answers, &limits.nearest(start));
        for _ in 0..steps {
            let sums = self.sums(&now.u, answers, Order::Second);
            // The whole second derivative where that leads down, else its convex part.
            let step = [1.0, 0.0].into_iter().find_map(|concave| {
                let program = Quadratic {
                    slope: sums.slope(),
                    matrix: sums.matrix(concave),
                };
                let best = program.minimise_from(&now.curvature, change(limits))?;
                let mut length = 1.0;
                while length > 1e-3 {
                    let curvature = now.curvature.iter().zip(&best.curvature);
                    let next: Vec<f64> = curvature.map(|(c, d)| c + length * d).collect();
                    let mut next = self.fixed(answers, &next);
                    if next.value < now.value || best.energy.abs() < HIDDEN {
                        next.matrix = program.matrix;
                        return Some(next);
                    }
                    length *= 0.25;
                }
                None
            });
            let Some(next) = step else {
                now.matrix = sums.matrix(0.0);
                break;
            };
            let gained = now.value - next.value;
            now = next;
            if gained < SETTLED {
                break;
            }
        }
        now
    }

    /// What the value would be about with place `i` elsewhere: exactly with these curvatures, less what one Newton step of them all would gain
    /// by the second derivative that is known. `answers`: with the new place; `old`: that of the place before.
    pub(super) fn moved(
        &self,
        weighed: &Weighed,
        answers: &[&[f64]],
        i: usize,
        old: &[f64],
        limits: Option<Limits>,
    ) -> f64 {
        let c = weighed.curvature[i];
        let mut u = weighed.u.clone();
        u.par_chunks_mut(PIECE).enumerate().for_each(|(piece, u)| {
            let from = piece * PIECE;
            let change = answers[i][from..].iter().zip(&old[from..]);
            u.iter_mut()
                .zip(change)
                .for_each(|(u, (g, h))| *u += c * (g - h));
        });
        let Some(limits) = limits.filter(|_| !weighed.matrix.is_empty()) else {
            return self.sums(&u, &[], Order::Value).value();
        };
        let sums = self.sums(&u, answers, Order::First);
        let program = Quadratic {
            slope: sums.slope(),
            matrix: weighed.matrix.clone(),
        };
        let limits = change(limits.for_count(answers.len()));
        let step = program.minimise_from(&weighed.curvature, limits);
        sums.value() + step.map_or(0.0, |best| best.energy.min(0.0))
    }

    /// What the value would be about with each of some places more, by one Newton step of all curvatures.
    pub(super) fn with_one_more(
        &self,
        weighed: &Weighed,
        answers: &[&[f64]],
        new: &[&[f64]],
        limits: Limits,
    ) -> Vec<f64> {
        let k = answers.len();
        let mut curvature = weighed.curvature.clone();
        curvature.push(0.0);
        let limits = change(limits.for_count(k + 1));
        let known = self.sums(&weighed.u, answers, Order::Second);
        let grown: Vec<f64> = weighed.u.iter().map(|u| (2.0 * u).exp()).collect();
        let flat = times(&grown, self.weight);
        let square = times(&grown, &flat);
        let promise = |&g: &&[f64]| {
            let with = [times(g, &flat), times(g, &square)];
            let with_all = answers.iter().chain([&g]);
            let last = with_all.map(|h| [dot(h, &with[0]), dot(h, &with[1])]);
            let mut last = last.collect::<Vec<_>>().into_iter();
            let mut second = Vec::with_capacity((k + 1) * (k + 2) / 2);
            let mut row = known.second.iter();
            for i in 0..k {
                second.extend(row.by_ref().take(k - i));
                second.extend(last.next());
            }
            second.extend(last);
            let mut first = known.first.clone();
            first.push([dot(g, &flat), dot(g, &square)]);
            let sums = Sums {
                areas: known.areas,
                first,
                second,
            };
            let step = [1.0, 0.0].into_iter().find_map(|concave| {
                let program = Quadratic {
                    slope: sums.slope(),
                    matrix: sums.matrix(concave),
                };
                let step = program.minimise_from(&curvature, limits)?;
                (step.energy < 0.0).then_some(step.energy)
            });
            weighed.value + step.unwrap_or(0.0)
        };
        new.par_iter().map(promise).collect()
    }

    /// What the value would be about without each of the places, by one Newton step of the other curvatures.
    pub(super) fn with_one_less(
        &self,
        weighed: &Weighed,
        answers: &[&[f64]],
        limits: Limits,
    ) -> Vec<f64> {
        let sums = self.sums(&weighed.u, answers, Order::Second);
        // The convex part: the change is large.
        let program = Quadratic {
            slope: sums.slope(),
            matrix: sums.matrix(0.0),
        };
        let [low, high] = limits.for_count(answers.len().max(2) - 1).range;
        let promise = |i: usize| {
            let ranges = weighed.curvature.iter().enumerate();
            let ranges: Vec<[f64; 2]> = ranges
                .map(|(j, c)| match i == j {
                    true => [-c, -c],
                    false => [low - c, high - c],
                })
                .collect();
            let step = program.within(&ranges, limits.total.map(|_| 0.0));
            weighed.value + step.map_or(f64::INFINITY, |best| best.energy)
        };
        (0..answers.len()).map(promise).collect()
    }
}

/// Limits of a change that keeps the total.
fn change(limits: Limits) -> Limits {
    Limits {
        total: limits.total.map(|_| 0.0),
        ..limits
    }
}

fn times(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a * b).collect()
}
