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
use super::tableau::{Hessian, Limits, Tableau};
use crate::flow::solve::{half_products, inner_products};

/// Newton steps at most.
const STEPS: usize = 40;
/// Steps that are made where nearly nothing is left.
const LAST_STEPS: usize = 3;
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

/// What curvature at some places does to u.
pub(super) struct Answers {
    /// In the linear picture, of a unit, at every point; place after place.
    pub(super) field: Vec<f64>,
    /// The point that each place is itself, …
    pub(super) own: Vec<usize>,
    /// … and what it does there beyond that.
    pub(super) star: Vec<Star>,
}

impl Answers {
    fn len(&self) -> usize {
        self.own.len()
    }

    fn field(&self, i: usize) -> &[f64] {
        let points = self.field.len() / self.len();
        &self.field[i * points..][..points]
    }

    /// Those of some of the places.
    pub(super) fn of(&self, places: &[usize]) -> Self {
        let fields = places.iter().flat_map(|&i| self.field(i));
        Self {
            field: fields.copied().collect(),
            own: places.iter().map(|&i| self.own[i]).collect(),
            star: places.iter().map(|&i| self.star[i]).collect(),
        }
    }
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
}

/// Inner products of tangents: the second derivative of the objective by curvature, row by row.
struct Products<'a> {
    answers: &'a Answers,
    /// What every point counts.
    by: Vec<f64>,
    /// What the star of each place adds to its tangent at the place itself.
    bent: Vec<f64>,
    /// Means of the tangents, whose products are left out.
    mean: Vec<[f64; MEANS]>,
}

/// Derivatives by the curvature of each of some places.
struct Derivatives<'a> {
    first: Vec<f64>,
    /// By the same place twice.
    second: Vec<f64>,
    mixed: Products<'a>,
}

impl<'a> Derivatives<'a> {
    /// ∂J/∂c of some places with some curvatures; ∂²J/∂c², and `blend` times that of the variance fourfold.
    fn new(
        state: &State,
        answers: &'a Answers,
        curvature: &[f64],
        weight: &[f64],
        blend: f64,
    ) -> Self {
        let [grown, shrunk] = &state.shares;
        let both = grown.iter().zip(shrunk).zip(weight);
        let by: Vec<f64> = both.map(|((a, b), w)| a + b + 2.0 * blend * w).collect();
        let stars = answers.star.iter().zip(curvature);
        let bent: Vec<f64> = stars.map(|(star, c)| star.excess_slope(*c)).collect();
        let over = [grown, shrunk, weight].concat();
        let means = inner_products(&over, &answers.field, [MEANS, answers.len()]);
        // The product of two tangents has the last mean so often.
        let root = (2.0 * blend).sqrt();
        let places = answers.len();
        let mut mean = Vec::with_capacity(places);
        let (mut first, mut second) = (Vec::with_capacity(places), Vec::with_capacity(places));
        for (i, (&own, bent)) in answers.own.iter().zip(&bent).enumerate() {
            let over = |m: usize, at: f64| means[m * places + i] + bent * at;
            let [a, b] = [over(0, grown[own]), over(1, shrunk[own])];
            let c = root * over(2, weight[own]);
            let field = answers.field(i);
            let square = squares(field, &by) + bent * by[own] * (2.0 * field[own] + bent);
            first.push(2.0 * (a - b));
            second.push(4.0 * (square - a * a - b * b - c * c));
            mean.push([a, b, c]);
        }
        Self {
            first,
            second,
            mixed: Products {
                answers,
                by,
                bent,
                mean,
            },
        }
    }
}

impl Hessian for Products<'_> {
    fn rows(&self, places: &[usize]) -> Vec<f64> {
        let all = self.answers.len();
        let mut tangents = Vec::with_capacity(places.len() * self.by.len());
        for &i in places {
            let own = tangents.len() + self.answers.own[i];
            let field = self.answers.field(i).iter().zip(&self.by);
            tangents.extend(field.map(|(g, by)| g * by));
            tangents[own] += self.bent[i] * self.by[self.answers.own[i]];
        }
        let fields = &self.answers.field;
        let mut rows = match places.len() == all {
            true => half_products(&tangents, fields, all),
            false => inner_products(&tangents, fields, [places.len(), all]),
        };
        let tangents = tangents.chunks(self.by.len().max(1));
        for ((row, tangent), &i) in rows.chunks_mut(all).zip(tangents).zip(places) {
            let [a, b, c] = self.mean[i];
            let others = self.answers.own.iter().zip(&self.bent).zip(&self.mean);
            for (x, ((&own, bent), mean)) in row.iter_mut().zip(others) {
                let means = a * mean[0] + b * mean[1] + c * mean[2];
                *x = 4.0 * (*x + bent * tangent[own] - means);
            }
        }
        if places.len() == all {
            // Half of it is the other half.
            for i in 0..all {
                (0..i).for_each(|j| rows[i * all + j] = rows[j * all + i]);
            }
        }
        rows
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
    pub(super) fn log_scale(&self, answers: &Answers, curvature: &[f64]) -> Vec<f64> {
        let mut u = self.base.to_vec();
        for (i, &c) in curvature.iter().enumerate().filter(|(_, c)| **c != 0.0) {
            let field = u.iter_mut().zip(answers.field(i));
            field.for_each(|(u, g)| *u += c * g);
            u[answers.own[i]] += answers.star[i].excess(c);
        }
        u
    }

    pub(super) fn state(&self, answers: &Answers, curvature: &[f64]) -> State {
        State::new(self.spread, &self.log_scale(answers, curvature))
    }

    /// A second-order picture of the objective around some curvatures, all of them held at 0.
    ///
    /// Where much is distorted, little area rules J and its second derivative, which then says nothing about the rest. The variance
    /// does, so a share of that is added, which falls with J: Newton's method with it converges, if more slowly.
    pub(super) fn model<'a>(
        &self,
        answers: &'a Answers,
        curvature: &[f64],
        limits: Limits,
    ) -> Tableau<'a> {
        self.model_at(&self.state(answers, curvature), answers, curvature, limits)
    }

    fn model_at<'a>(
        &self,
        state: &State,
        answers: &'a Answers,
        curvature: &[f64],
        limits: Limits,
    ) -> Tableau<'a> {
        let blend = BLEND * state.value.clamp(0.0, 1.0);
        let there = Derivatives::new(state, answers, curvature, self.weight, blend);
        Tableau::new(there.mixed, there.second, there.first, curvature, limits)
    }

    /// Four times the variance of u, which J is where it is small, as a function of the curvatures; exact, so that no place for it need be near.
    pub(super) fn variance<'a>(&self, answers: &'a Answers, limits: Limits) -> Tableau<'a> {
        let even = State {
            value: 0.0,
            shares: [self.weight.to_vec(), self.weight.to_vec()],
        };
        let none = vec![0.0; answers.len()];
        let there = Derivatives::new(&even, answers, &none, self.weight, 0.0);
        let mean = dot(self.base, self.weight);
        let by = self.base.iter().zip(self.weight);
        let by: Vec<f64> = by.map(|(u, w)| 8.0 * w * (u - mean)).collect();
        let own = answers.own.iter().zip(&there.mixed.bent);
        let slope = own
            .enumerate()
            .map(|(i, (&own, bent))| dot(answers.field(i), &by) + bent * by[own]);
        let slope: Vec<f64> = slope.collect();
        Tableau::new(there.mixed, there.second, slope, &none, limits)
    }

    /// The best curvatures from some that are near; `settled`: gain of the last step.
    pub(super) fn best(
        &self,
        answers: &Answers,
        start: &[f64],
        limits: Limits,
        settled: f64,
    ) -> Weighed {
        let mut curvature = start.to_vec();
        let mut state = self.state(answers, start);
        let mut is_feasible = limits.are_met(start, 1e-9);
        let mut last_steps = 0;
        for _ in 0..STEPS {
            let mut model = self.model_at(&state, answers, &curvature, limits);
            model.complete();
            for i in 0..answers.len() {
                model.free(i);
            }
            model.settle();
            let next: Vec<f64> = (0..answers.len()).map(|i| model.curvature(i)).collect();
            // Where nearly nothing is left, J is rounding, but its derivative is not: the last steps are not asked what they gain.
            let is_last = is_feasible && state.value < NOTHING;
            // Where the start keeps neither total nor limits there is nothing to compare with.
            if is_last || !is_feasible {
                state = self.state(answers, &next);
                (curvature, is_feasible) = (next, true);
                last_steps += usize::from(is_last);
                if last_steps == LAST_STEPS {
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

/// Σ b a² in a fixed order.
fn squares(a: &[f64], b: &[f64]) -> f64 {
    sum_of(a, b, |a, b| a * a * b)
}

/// Σ a b in a fixed order.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    sum_of(a, b, |a, b| a * b)
}

#[inline(always)]
fn sum_of(a: &[f64], b: &[f64], term: impl Fn(f64, f64) -> f64) -> f64 {
    // Eight sums side by side are quicker than one.
    let mut sums = [0.0; 8];
    let (whole_a, rest_a) = a.as_chunks::<8>();
    let (whole_b, rest_b) = b.as_chunks::<8>();
    for (a, b) in whole_a.iter().zip(whole_b) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += term(*a, *b);
        }
    }
    let rest: f64 = rest_a.iter().zip(rest_b).map(|(a, b)| term(*a, *b)).sum();
    let [a, b, c, d, e, f, g, h] = sums;
    ((a + b) + (c + d)) + ((e + f) + (g + h)) + rest
}
