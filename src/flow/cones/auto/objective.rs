//! What the choice makes least: the distortion of area, growing and shrinking weighed alike, of a log scale.
//!
//! *Enters:* u without cones and what a unit of curvature at each place adds to it, at points with weights. *Leaves:* the objective, its
//! derivatives by curvature, the best curvatures.
//!
//! J = ln ∫e^{2u} + ln ∫e^{−2u}, over the source area, normalised to 1. The first integral is the mean factor by which areas grow, the second the mean factor by which
//! they shrink; a constant added to u changes one against the other and J not at all, so 2 e^{J/2} is the least value that the symmetric
//! distortion ∫(e^{2u} + e^{−2u}) takes at any size of the flat surface. For small u, J is four times the variance of u; for large u it is ruled by
//! what grows or shrinks most. J is convex in u, so that curvatures at given places have one optimum. Near a cone of curvature κ
//! with |κ| < 2π both integrals are finite on a smooth surface: the optimum is not one of the mesh.

use super::star::Star;
use super::tableau::{Limits, Tableau};
use crate::flow::solve::inner_products;

/// Newton steps at most.
const STEPS: usize = 40;
/// Gain of a step, relative to the objective, after which it is the last: of curvatures that stay …
pub(super) const SETTLED: f64 = 1e-9;
/// … and of those that are only compared.
pub(super) const COMPARED: f64 = 1e-4;
/// Share of the variance's second derivative in the model where J is 1 or more.
const BLEND: f64 = 0.5;
/// Difference of two logarithms beyond which e to it times a share of an area is no ordinary number.
const WIDEST: f64 = 300.0;
/// Means of a tangent: over what grows, over what shrinks, over the area.
const MEANS: usize = 3;
/// Objective that is rounding.
pub(super) const NOTHING: f64 = 1e-12;

/// A surface seen at points.
#[derive(Clone, Copy)]
pub(super) struct Points<'a> {
    /// Area of each, all together 1.
    pub(super) weight: &'a [f64],
    /// ∫e^{2u} and ∫e^{−2u} around each, where u is 0 on average: more than its area where u is uneven there.
    pub(super) spread: [&'a [f64]; 2],
    /// u without cones.
    pub(super) base: &'a [f64],
}

/// What curvature at a place does to u.
pub(super) struct Answer {
    /// In the linear picture, of a unit, at every point.
    pub(super) field: Vec<f64>,
    /// The point that is the place itself.
    pub(super) own: usize,
    /// What it does there beyond that.
    pub(super) star: Star,
}

/// The objective at one u.
pub(super) struct State {
    /// J.
    pub(super) value: f64,
    /// Share of each point in ∫e^{2u} and in ∫e^{−2u}.
    shares: [Vec<f64>; 2],
}

impl State {
    pub(super) fn new(spread: [&[f64]; 2], u: &[f64]) -> Self {
        let [least, most] = u
            .iter()
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], &u| {
                [a.min(u), b.max(u)]
            });
        let mut grown: Vec<f64> = u.iter().map(|u| (2.0 * (u - most)).exp()).collect();
        // e^{−2u} is one over e^{2u}, where that is no number too small.
        let range = 2.0 * (most - least);
        let mut shrunk: Vec<f64> = match range < WIDEST {
            true => {
                let scale = (-range).exp();
                grown.iter().map(|e| scale / e).collect()
            }
            false => u.iter().map(|u| (2.0 * (least - u)).exp()).collect(),
        };
        let mut value = range;
        for (parts, weight) in [&mut grown, &mut shrunk].into_iter().zip(spread) {
            parts.iter_mut().zip(weight).for_each(|(p, w)| *p *= w);
            let sum: f64 = parts.iter().sum();
            value += sum.ln();
            parts.iter_mut().for_each(|p| *p /= sum);
        }
        Self {
            value,
            shares: [grown, shrunk],
        }
    }

    /// ∂J/∂u of every point.
    pub(super) fn derivative(&self) -> Vec<f64> {
        let [grown, shrunk] = &self.shares;
        let both = grown.iter().zip(shrunk);
        both.map(|(a, b)| 2.0 * (a - b)).collect()
    }

    /// ∂J/∂c of some places with some curvatures; ∂²J/∂c², row by row, and `blend` times that of the variance fourfold.
    fn derivatives(
        &self,
        answers: &[&Answer],
        curvature: &[f64],
        weight: &[f64],
        blend: f64,
    ) -> (Vec<f64>, Vec<f64>) {
        let (count, points) = (answers.len(), weight.len());
        let [grown, shrunk] = &self.shares;
        let both = grown.iter().zip(shrunk).zip(weight);
        let root: Vec<f64> = both
            .map(|((a, b), w)| (a + b + 2.0 * blend * w).sqrt())
            .collect();
        // Tangents times the root of what weighs their products; then what gives their means in the same products.
        let all = count + MEANS;
        let mut columns = Vec::with_capacity(all * points);
        for (answer, c) in answers.iter().zip(curvature) {
            let own = columns.len() + answer.own;
            columns.extend(answer.field.iter().zip(&root).map(|(g, r)| g * r));
            columns[own] += answer.star.excess_slope(*c) * root[answer.own];
        }
        for of in [grown, shrunk, weight] {
            let parts = of.iter().zip(&root);
            columns.extend(parts.map(|(x, r)| if *r > 0.0 { x / r } else { 0.0 }));
        }
        let products = inner_products(&columns, all);
        let mean = |i: usize| &products[i * all + count..][..MEANS];
        let slope = (0..count).map(|i| 2.0 * (mean(i)[0] - mean(i)[1]));
        let mut matrix = Vec::with_capacity(count * count);
        for i in 0..count {
            let a = mean(i);
            matrix.extend((0..count).map(|j| {
                let b = mean(j);
                let means = a[0] * b[0] + a[1] * b[1] + 2.0 * blend * a[2] * b[2];
                4.0 * (products[i * all + j] - means)
            }));
        }
        (slope.collect(), matrix)
    }
}

/// Curvatures at given places, and what they lead to.
pub(super) struct Weighed {
    /// Radians.
    pub(super) curvature: Vec<f64>,
    /// J.
    pub(super) value: f64,
}

impl Points<'_> {
    /// u with cones.
    pub(super) fn log_scale(&self, answers: &[&Answer], curvature: &[f64]) -> Vec<f64> {
        let mut u = self.base.to_vec();
        for (answer, &c) in answers.iter().zip(curvature).filter(|(_, c)| **c != 0.0) {
            let field = u.iter_mut().zip(&answer.field);
            field.for_each(|(u, g)| *u += c * g);
            u[answer.own] += answer.star.excess(c);
        }
        u
    }

    pub(super) fn state(&self, answers: &[&Answer], curvature: &[f64]) -> State {
        State::new(self.spread, &self.log_scale(answers, curvature))
    }

    /// A second-order picture of the objective around some curvatures, all of them held at 0.
    ///
    /// Where much is distorted, little area rules J and its second derivative, which then says nothing about the rest. The variance
    /// does, so a share of that is added, which falls with J: Newton's method with it converges, if more slowly.
    pub(super) fn model(&self, answers: &[&Answer], curvature: &[f64], limits: Limits) -> Tableau {
        self.model_at(&self.state(answers, curvature), answers, curvature, limits)
    }

    fn model_at(
        &self,
        state: &State,
        answers: &[&Answer],
        curvature: &[f64],
        limits: Limits,
    ) -> Tableau {
        let blend = BLEND * state.value.clamp(0.0, 1.0);
        let (mut slope, matrix) = state.derivatives(answers, curvature, self.weight, blend);
        let rows = matrix.chunks(answers.len().max(1));
        for (slope, row) in slope.iter_mut().zip(rows) {
            *slope -= dot(row, curvature);
        }
        Tableau::new(&matrix, &slope, limits)
    }

    /// Four times the variance of u, which J is where it is small, as a function of the curvatures; exact, so that no place for it need be near.
    pub(super) fn variance(&self, answers: &[&Answer], limits: Limits) -> Tableau {
        let even = State {
            value: 0.0,
            shares: [self.weight.to_vec(), self.weight.to_vec()],
        };
        let (_, matrix) = even.derivatives(answers, &vec![0.0; answers.len()], self.weight, 0.0);
        let mean = dot(self.base, self.weight);
        let by = self.base.iter().zip(self.weight);
        let by: Vec<f64> = by.map(|(u, w)| 8.0 * w * (u - mean)).collect();
        let slope = answers
            .iter()
            .map(|g| dot(&g.field, &by) + g.star.excess_slope(0.0) * by[g.own]);
        let slope: Vec<f64> = slope.collect();
        Tableau::new(&matrix, &slope, limits)
    }

    /// The best curvatures from some that are near; `settled`: gain of the last step.
    pub(super) fn best(
        &self,
        answers: &[&Answer],
        start: &[f64],
        limits: Limits,
        settled: f64,
    ) -> Weighed {
        let mut curvature = start.to_vec();
        let mut state = self.state(answers, start);
        let mut is_feasible = limits.are_met(start, 1e-9);
        for _ in 0..STEPS {
            let mut model = self.model_at(&state, answers, &curvature, limits);
            for i in 0..answers.len() {
                model.free(i);
            }
            model.settle();
            let next: Vec<f64> = (0..answers.len()).map(|i| model.curvature(i)).collect();
            // Where nearly nothing is left, J is rounding, but its derivative is not: the last step is not asked what it gains.
            let is_last = is_feasible && state.value < NOTHING;
            // Where the start keeps neither total nor limits there is nothing to compare with.
            if is_last || !is_feasible {
                state = self.state(answers, &next);
                (curvature, is_feasible) = (next, true);
                if is_last {
                    break;
                }
                continue;
            }
            let before = state.value;
            let mut length = 1.0;
            while length > 1e-3 {
                let pairs = curvature.iter().zip(&next);
                let tried: Vec<f64> = pairs.map(|(c, d)| c + length * (d - c)).collect();
                let there = self.state(answers, &tried);
                if there.value < state.value {
                    (curvature, state) = (tried, there);
                    break;
                }
                length *= 0.25;
            }
            if before - state.value <= settled * before.max(NOTHING) {
                break;
            }
        }
        Weighed {
            curvature,
            value: state.value,
        }
    }
}

/// Σ a b in a fixed order.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four sums side by side are quicker than one.
    let mut sums = [0.0; 4];
    let (whole_a, rest_a) = a.as_chunks::<4>();
    let (whole_b, rest_b) = b.as_chunks::<4>();
    for (a, b) in whole_a.iter().zip(whole_b) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    let rest: f64 = rest_a.iter().zip(rest_b).map(|(a, b)| a * b).sum();
    sums[0] + sums[1] + (sums[2] + sums[3]) + rest
}
