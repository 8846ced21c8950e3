//! Which curvatures are best at given places, and which places are worth having: a quadratic program in a tableau.
//!
//! *Enters:* the energy ½ cᵀHc + bᵀc of P places, what the curvatures must add up to, limits. *Leaves:* the best curvatures of some of the
//! places, and what each of the others would lower the energy by, or each exchange of one for another, without solving anything.
//!
//! The symmetric matrix of the equations, with a last row for the total, is pivoted (swept) on the places that have a curvature of their
//! own choice. What is left of the diagonal elsewhere is the second derivative along the way where all others adapt, and what is left
//! of the right side is the derivative there. Every promise is read off the entries.
//!
//! All that is read is the diagonal, the right side, and the rows of places that have a curvature: few of many. The row of a place is worked out when it
//! gets one for the first time, and what pivots did before is made up for. With R such rows a pivot costs R P operations, not P².

use std::rc::Rc;

/// The second derivatives of an energy, worked out row by row.
pub(super) trait Hessian {
    /// The rows of some places in ascending order, one after another; in each a number for every place.
    fn rows(&self, places: &[usize]) -> Vec<f64>;
}

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
        let [low, high] = self.range;
        // A margin: exactly at the limit all would be fixed.
        let range = match self.total.map(|total| total / count.max(1) as f64) {
            Some(mean) => [
                low.min(mean - mean.abs() * MARGIN),
                high.max(mean + mean.abs() * MARGIN),
            ],
            None => self.range,
        };
        Self { range, ..self }
    }

    /// Whether some curvatures are numbers that keep them up to a rounding, radians.
    pub(super) fn are_met(self, curvature: &[f64], rounding: f64) -> bool {
        let total: f64 = curvature.iter().sum();
        let [low, high] = self.for_count(curvature.len()).range;
        let within = low - rounding..=high + rounding;
        curvature.iter().all(|c| within.contains(c))
            && self.total.is_none_or(|t| (total - t).abs() <= rounding)
    }
}

/// Share of the mean curvature by which limits are widened where the cones just meet the total.
const MARGIN: f64 = 1e-11;
/// Share of a diagonal entry below which what is left of it is rounding: the place is one of the others.
const DEPENDENT: f64 = 1e-9;
/// Curvature beyond a limit that is rounding, radians.
const ROUNDING: f64 = 1e-13;

/// The equations of all places, solved for some of them.
#[derive(Clone)]
pub(super) struct Tableau<'a> {
    hessian: Rc<dyn Hessian + 'a>,
    /// Number of places; the row of the total follows them.
    places: usize,
    /// Rows of places that have or had a curvature, and of the total; others are empty.
    row: Vec<Vec<f64>>,
    /// Entries of all rows on the diagonal.
    diagonal: Vec<f64>,
    /// Of a free place minus its curvature, of another the derivative of the energy by its curvature.
    right: Vec<f64>,
    /// H_ii as it was.
    own: Vec<f64>,
    is_free: Vec<bool>,
    /// Curvature of places that are not free.
    level: Vec<f64>,
    limits: Limits,
}

impl<'a> Tableau<'a> {
    /// All places with curvature 0. `diagonal`: that of H; `slope`: the derivatives of the energy where the places have the curvatures `at`, radians.
    pub(super) fn new(
        hessian: impl Hessian + 'a,
        diagonal: Vec<f64>,
        slope: Vec<f64>,
        at: &[f64],
        limits: Limits,
    ) -> Self {
        let places = slope.len();
        let size = places + 1;
        let mut row = vec![Vec::new(); size];
        if limits.total.is_some() {
            row[places] = vec![1.0; size];
            row[places][places] = 0.0;
        }
        let mut tableau = Self {
            hessian: Rc::new(hessian),
            own: diagonal.clone(),
            is_free: vec![false; size],
            level: vec![0.0; size],
            places,
            row,
            diagonal,
            right: slope,
            limits,
        };
        tableau.diagonal.push(0.0);
        tableau.right.push(-limits.total.unwrap_or(0.0));
        let there: Vec<usize> = (0..places).filter(|&k| at[k] != 0.0).collect();
        tableau.bring(&there);
        for k in there {
            let rights = tableau.right[..places].iter_mut().zip(&tableau.row[k]);
            rights.for_each(|(r, x)| *r -= at[k] * x);
        }
        tableau
    }

    /// Works out all rows: for many questions about places without curvature.
    pub(super) fn complete(&mut self) {
        let all: Vec<usize> = (0..self.places).collect();
        self.bring(&all);
    }

    /// Sees to it that some places have their rows.
    fn bring(&mut self, places: &[usize]) {
        let new = places.iter().copied().filter(|&k| self.row[k].is_empty());
        let new: Vec<usize> = new.collect();
        if new.is_empty() {
            return;
        }
        let rows = self.hessian.rows(&new);
        let free: Vec<usize> = (0..=self.places).filter(|&f| self.is_free[f]).collect();
        let of_total = f64::from(self.limits.total.is_some());
        for (&k, own) in new.iter().zip(rows.chunks(self.places)) {
            let mut row = own.to_vec();
            row.push(of_total);
            let factors: Vec<f64> = free.iter().map(|&f| row[f]).collect();
            for (&f, factor) in free.iter().zip(&factors) {
                let entries = row.iter_mut().zip(&self.row[f]);
                entries.for_each(|(x, r)| *x -= factor * r);
            }
            free.iter().for_each(|&f| row[f] = self.row[f][k]);
            row[k] = self.diagonal[k];
            self.row[k] = row;
        }
    }

    /// An entry on the diagonal, or of a row that there is.
    fn at(&self, i: usize, j: usize) -> f64 {
        match self.row[i].get(j) {
            _ if i == j => self.diagonal[i],
            Some(entry) => *entry,
            None => self.row[j][i],
        }
    }

    /// Curvature of a place.
    pub(super) fn curvature(&self, i: usize) -> f64 {
        match self.is_free[i] {
            true => -self.right[i],
            false => self.level[i],
        }
    }

    /// Solves for `k`, or no longer.
    fn pivot(&mut self, k: usize) {
        self.bring(&[k]);
        let mut row = std::mem::take(&mut self.row[k]);
        let (pivot, right) = (row[k], self.right[k]);
        let sign = if self.is_free[k] { -1.0 } else { 1.0 };
        let others = self.row.iter_mut().zip(&row);
        for (other, x) in others.filter(|(other, _)| !other.is_empty()) {
            if *x != 0.0 {
                let factor = x / pivot;
                let entries = other.iter_mut().zip(&row);
                entries.for_each(|(x, r)| *x -= factor * r);
            }
            other[k] = sign * x / pivot;
        }
        for (i, x) in row.iter_mut().enumerate() {
            let factor = *x / pivot;
            if factor != 0.0 {
                self.diagonal[i] -= factor * *x;
                self.right[i] -= factor * right;
            }
            *x = sign * factor;
        }
        row[k] = -1.0 / pivot;
        self.diagonal[k] = row[k];
        self.right[k] = sign * right / pivot;
        self.row[k] = row;
        self.is_free[k] = !self.is_free[k];
    }

    /// Changes the curvature of a place that is not free.
    fn set(&mut self, k: usize, curvature: f64) {
        let change = curvature - self.level[k];
        if change != 0.0 {
            self.bring(&[k]);
            let rights = self.right.iter_mut().zip(&self.row[k]);
            rights.for_each(|(r, x)| *r += change * x);
            self.level[k] = curvature;
        }
    }

    /// Lets a place have what curvature is best; false where it cannot be told from those that do.
    pub(super) fn free(&mut self, k: usize) -> bool {
        if self.at(k, k) <= DEPENDENT * self.own[k] {
            return false;
        }
        self.set(k, 0.0);
        self.pivot(k);
        if self.limits.total.is_some() && !self.is_free[self.places] {
            self.pivot(self.places);
        }
        true
    }

    /// Holds a place at a curvature.
    pub(super) fn hold(&mut self, k: usize, curvature: f64) {
        if self.is_free[k] {
            self.pivot(k);
        }
        self.set(k, curvature);
    }

    fn free_count(&self) -> usize {
        self.is_free[..self.places].iter().filter(|f| **f).count()
    }

    /// The total needs one free place at least.
    fn must_stay(&self) -> bool {
        self.limits.total.is_some() && self.free_count() == 1
    }

    /// The best curvatures within the limits for the places that are free or held at one of them.
    pub(super) fn settle(&mut self) {
        let count = (0..self.places).filter(|&i| self.is_in(i)).count();
        let [low, high] = self.limits.for_count(count).range;
        // Every pass holds or frees one; a cycle can come from rounding only, and ends here.
        for _ in 0..8 * (count + 1) {
            let excess = |i: usize| {
                let c = self.curvature(i);
                (c - high).max(low - c)
            };
            let free = (0..self.places).filter(|&i| self.is_free[i]);
            let worst = free.max_by(|&i, &j| excess(i).total_cmp(&excess(j)));
            if let Some(i) = worst.filter(|&i| excess(i) > ROUNDING && !self.must_stay()) {
                let limit = self.curvature(i).clamp(low, high);
                self.hold(i, limit);
                continue;
            }
            let wish = |i: usize| match self.level[i] > 0.0 {
                true => self.right[i],
                false => -self.right[i],
            };
            let held = (0..self.places).filter(|&i| !self.is_free[i] && self.level[i] != 0.0);
            let keenest = held.max_by(|&i, &j| wish(i).total_cmp(&wish(j)));
            let scale = |i: usize| ROUNDING * self.own[i];
            match keenest.filter(|&i| wish(i) > scale(i)) {
                Some(i) => {
                    if !self.free(i) {
                        break;
                    }
                }
                None => break,
            }
        }
    }

    /// True where a place has a curvature.
    pub(super) fn is_in(&self, i: usize) -> bool {
        self.is_free[i] || self.level[i] != 0.0
    }

    /// The change of energy by a new place, the others adapting, given derivative and second derivative there.
    fn gain(&self, slope: f64, bend: f64, own: f64) -> f64 {
        let [low, high] = self.limits.range;
        let bend = bend.max(1e-6 * own);
        let c = (-slope / bend).clamp(low, high);
        c * (slope + 0.5 * c * bend)
    }

    /// The change of energy by place `j`, which has none, beside the others.
    pub(super) fn promise(&self, j: usize) -> f64 {
        match self.free_count() {
            // The first takes the total, whatever it costs.
            0 if self.limits.total.is_some() => {
                let total = self.limits.total.unwrap_or(0.0);
                total * (self.right[j] + 0.5 * total * self.own[j])
            }
            _ => self.gain(self.right[j], self.at(j, j), self.own[j]),
        }
    }

    /// The change of energy when place `i` loses its curvature and the others adapt.
    pub(super) fn loss(&self, i: usize) -> f64 {
        match self.is_free[i] {
            _ if self.is_free[i] && self.must_stay() => f64::INFINITY,
            true => -0.5 * self.right[i] * self.right[i] / self.at(i, i),
            false => {
                let c = self.level[i];
                -c * (self.right[i] - 0.5 * c * self.at(i, i))
            }
        }
    }

    /// The change of energy when place `j` has curvature in the stead of `i`.
    pub(super) fn exchange(&self, i: usize, j: usize) -> f64 {
        let (x, own) = (self.at(i, j), self.own[j]);
        let (slope, bend) = match self.is_free[i] {
            true if self.must_stay() => return self.first_instead(i, j),
            true => {
                let factor = x / self.at(i, i);
                (
                    self.right[j] - factor * self.right[i],
                    self.at(j, j) - factor * x,
                )
            }
            false => (self.right[j] - x * self.level[i], self.at(j, j)),
        };
        self.loss(i) + self.gain(slope, bend, own)
    }

    /// The same where `i` alone is free: `j` takes its curvature.
    fn first_instead(&self, i: usize, j: usize) -> f64 {
        let c = self.curvature(i);
        // With one free place and the total, a place that is not free trades curvature with it.
        c * (self.right[j] + 0.5 * c * self.at(j, j))
    }

    /// The change of energy when `j` takes the very curvature that `i` is held at.
    pub(super) fn carry(&self, i: usize, j: usize) -> f64 {
        self.shift(i, j, self.level[i])
    }

    /// The change of energy when `amount` of curvature goes from `i` to `j`, both held.
    pub(super) fn shift(&self, i: usize, j: usize, amount: f64) -> f64 {
        let bend = self.at(i, i) + self.at(j, j) - 2.0 * self.at(i, j);
        amount * (self.right[j] - self.right[i] + 0.5 * amount * bend)
    }

    /// The change of energy when the curvature of `j`, which is held, changes by `amount` and nothing else does.
    pub(super) fn change(&self, j: usize, amount: f64) -> f64 {
        amount * (self.right[j] + 0.5 * amount * self.at(j, j))
    }

    /// Puts `j` in the stead of `i`; false (and nothing done) where that cannot be told from another place.
    pub(super) fn replace(&mut self, i: usize, j: usize) -> bool {
        if self.is_free[i] && self.must_stay() {
            // Both are free for a moment, so that the total has one.
            if !self.free(j) {
                return false;
            }
            self.hold(i, 0.0);
            return true;
        }
        let before = self.curvature(i);
        let was_free = self.is_free[i];
        self.hold(i, 0.0);
        if self.free(j) {
            return true;
        }
        match was_free {
            true => {
                self.free(i);
            }
            false => self.set(i, before),
        }
        false
    }
}
