//! Whole translations near those that the flat metric has.
//!
//! *Enters:* the energy as a Hermitian form in the translations y and the scale σ, E = y* G y + 2 Re(y* g σ) + |σ|² e; it vanishes
//! where the translations are σ times the flat ones. *Leaves:* whole y and a σ of little energy relative to |σ|².
//!
//! A tile may be turned freely on the flat surface, and a little larger or smaller than asked for: directions are tried one after
//! another. For each, translations are rounded one at a time while those that follow still adapt (Babai's nearest plane, those
//! that cost most first), then improved by steps of one or two of them as long as a step gains, and then the best σ for them is found
//! in closed form.
//! *Not guaranteed:* the least energy of all; finding it is a closest-vector problem.

use super::gaussian::Complex;

/// Directions that are tried over a quarter turn. A multiple of four, so that half a right angle is among them.
const DIRECTIONS: usize = 64;
/// How often the scale is adapted and translations are rounded again.
const ROUNDS: usize = 3;
/// Steps of two translations at once are tried up to so many translations.
const PAIRED: usize = 160;
/// Part of the largest diagonal entry that is added to the diagonal: translations of the whole field cost nothing.
const RIDGE: f64 = 1e-10;
/// The tile's side may differ from what was asked for by this factor.
const SCALE_RANGE: f64 = 1.25;

/// A Hermitian form.
#[derive(Clone, Debug)]
pub(super) struct Energy {
    /// G, row by row.
    pub form: Vec<Vec<Complex>>,
    /// g.
    pub mixed: Vec<Complex>,
    /// e.
    pub flat: f64,
}

/// What was chosen.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Rounded {
    /// Whole multiples of the steps.
    pub whole: Vec<Complex>,
    /// σ: tiles a flat unit, and the turn from flat coordinates to the tile's.
    pub scale: Complex,
}

/// Rounds for tiles of about `scale` a flat unit; `steps` are the sides of a tile. `None` where no translations but those without any
/// tile between the cones are near.
pub(super) fn round(energy: &Energy, scale: f64, steps: [f64; 2]) -> Option<Rounded> {
    if energy.mixed.is_empty() {
        return Some(Rounded {
            whole: Vec::new(),
            scale: Complex::new(scale, 0.0),
        });
    }
    let rounding = Rounding::new(energy, steps);
    let mut best: Option<(f64, Rounded)> = None;
    for k in 0..DIRECTIONS {
        let angle = std::f64::consts::FRAC_PI_2 * k as f64 / DIRECTIONS as f64;
        let mut sigma = Complex::new(scale * angle.cos(), scale * angle.sin());
        for _ in 0..ROUNDS {
            let whole = rounding.improve(rounding.nearest(sigma), sigma);
            let Some((fitted, rest)) = energy.best_scale(&whole) else {
                break;
            };
            let ratio = fitted.length() / scale;
            if !(SCALE_RANGE.recip()..=SCALE_RANGE).contains(&ratio) {
                break;
            }
            // Equally good ones: the first, whatever the last bits say.
            let bound = best.as_ref().map_or(f64::INFINITY, |(rest, _)| *rest);
            if rest < bound * (1.0 - 1e-6) - 1e-13 * energy.flat {
                let scale = fitted;
                best = Some((rest, Rounded { whole, scale }));
            }
            sigma = fitted;
        }
    }
    best.map(|(_, rounded)| rounded)
}

impl Energy {
    /// The scale for which E / |σ|² is least, and that value; `None` where no scale is.
    fn best_scale(&self, whole: &[Complex]) -> Option<(Complex, f64)> {
        let own: f64 = (self.form.iter().zip(whole))
            .map(|(row, y)| y.dot(product(row, whole)))
            .sum();
        let mixed = whole.iter().zip(&self.mixed);
        let mixed = mixed.fold(Complex::ZERO, |sum, (y, &g)| sum + y.conjugate() * g);
        // With v = 1 / σ: |v|² own + 2 Re(v̄ mixed) + flat.
        let inverse = -mixed.scaled(1.0 / own);
        let is_good = own > 1e-9 * self.flat && inverse.squared() > 0.0;
        let rest = (self.flat - mixed.squared() / own).max(0.0);
        is_good.then(|| (inverse.inverse(), rest))
    }
}

fn product(row: &[Complex], x: &[Complex]) -> Complex {
    let terms = row.iter().zip(x);
    terms.fold(Complex::ZERO, |sum, (&a, &x)| sum + a * x)
}

struct Rounding<'a> {
    energy: &'a Energy,
    steps: [f64; 2],
    /// Order of elimination: those that cost least first, so that they are rounded last.
    order: Vec<usize>,
    /// Lower Cholesky factor in that order.
    factor: Vec<Vec<Complex>>,
    /// The translations that need no energy, for σ = 1, in that order.
    centre: Vec<Complex>,
}

impl<'a> Rounding<'a> {
    fn new(energy: &'a Energy, steps: [f64; 2]) -> Self {
        let count = energy.mixed.len();
        let largest = (0..count).map(|j| energy.form[j][j].re).fold(0.0, f64::max);
        let ridge = (RIDGE * largest).max(f64::MIN_POSITIVE);
        let mut rest = energy.form.clone();
        let mut left: Vec<usize> = (0..count).collect();
        let (mut order, mut factor) = (Vec::new(), vec![vec![Complex::ZERO; count]; count]);
        for (j, row) in rest.iter_mut().enumerate() {
            row[j].re += ridge;
        }
        while !left.is_empty() {
            let step = order.len();
            let cheapest = (0..left.len()).min_by(|&a, &b| {
                rest[left[a]][left[a]]
                    .re
                    .total_cmp(&rest[left[b]][left[b]].re)
            });
            let pivot = left.remove(cheapest.unwrap_or(0));
            let root = rest[pivot][pivot].re.max(ridge).sqrt();
            factor[pivot][step] = Complex::new(root, 0.0);
            for &i in &left {
                factor[i][step] = rest[i][pivot].scaled(1.0 / root);
            }
            for &i in &left {
                for &k in &left {
                    let product = factor[i][step] * factor[k][step].conjugate();
                    rest[i][k] -= product;
                }
            }
            order.push(pivot);
        }
        let factor: Vec<Vec<Complex>> = order.iter().map(|&i| factor[i].clone()).collect();
        // L L* y = −g.
        let mut centre: Vec<Complex> = order.iter().map(|&i| -energy.mixed[i]).collect();
        for i in 0..count {
            let known = product(&factor[i][..i], &centre[..i]);
            centre[i] = (centre[i] - known).scaled(1.0 / factor[i][i].re);
        }
        for i in (0..count).rev() {
            let known = (i + 1..count).fold(Complex::ZERO, |sum, k| {
                sum + factor[k][i].conjugate() * centre[k]
            });
            centre[i] = (centre[i] - known).scaled(1.0 / factor[i][i].re);
        }
        Self {
            energy,
            steps,
            order,
            factor,
            centre,
        }
    }

    /// Babai's nearest plane.
    fn nearest(&self, sigma: Complex) -> Vec<Complex> {
        let count = self.order.len();
        let mut whole = vec![Complex::ZERO; count];
        let mut off = vec![Complex::ZERO; count];
        for i in (0..count).rev() {
            let moved = (i + 1..count).fold(Complex::ZERO, |sum, k| {
                sum + self.factor[k][i].conjugate() * off[k]
            });
            let centre = sigma * self.centre[i];
            let y = (centre - moved.scaled(1.0 / self.factor[i][i].re)).rounded(self.steps);
            off[i] = y - centre;
            whole[self.order[i]] = y;
        }
        whole
    }

    /// Steps of one translation, or two, as long as they gain.
    fn improve(&self, mut whole: Vec<Complex>, sigma: Complex) -> Vec<Complex> {
        let Energy { form, mixed, flat } = self.energy;
        let count = whole.len();
        let [re, im] = self.steps;
        let moves = [(re, 0.0), (-re, 0.0), (0.0, im), (0.0, -im)].map(|(a, b)| Complex::new(a, b));
        let mut slope: Vec<Complex> = (form.iter().zip(mixed))
            .map(|(row, &g)| product(row, &whole) + sigma * g)
            .collect();
        let least = 1e-12 * sigma.squared() * flat;
        loop {
            // What a step of one gains, and the best of them.
            let cost =
                |j: usize, step: Complex| 2.0 * step.dot(slope[j]) + step.squared() * form[j][j].re;
            let mut best = (-least, Vec::new());
            for j in 0..count {
                for step in moves {
                    let gained = cost(j, step);
                    if gained < best.0 {
                        best = (gained, vec![(j, step)]);
                    }
                }
            }
            if best.1.is_empty() && count <= PAIRED {
                for (j, row) in form.iter().enumerate() {
                    for (k, &entry) in row.iter().enumerate().skip(j + 1) {
                        for step in moves {
                            for other in moves {
                                let both = 2.0 * step.dot(entry * other);
                                let gained = cost(j, step) + cost(k, other) + both;
                                if gained < best.0 {
                                    best = (gained, vec![(j, step), (k, other)]);
                                }
                            }
                        }
                    }
                }
            }
            if best.1.is_empty() {
                return whole;
            }
            for (j, step) in best.1 {
                whole[j] += step;
                for (slope, row) in slope.iter_mut().zip(form) {
                    *slope += row[j] * step;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// |A y − σ b|² as a form.
    fn form(a: &[Vec<Complex>], b: &[Complex]) -> Energy {
        let count = a[0].len();
        let column = |j: usize| a.iter().map(move |row| row[j]);
        let inner = |x: &mut dyn Iterator<Item = Complex>, y: &mut dyn Iterator<Item = Complex>| {
            x.zip(y)
                .fold(Complex::ZERO, |sum, (x, y)| sum + x.conjugate() * y)
        };
        Energy {
            form: (0..count)
                .map(|j| {
                    (0..count)
                        .map(|k| inner(&mut column(j), &mut column(k)))
                        .collect()
                })
                .collect(),
            mixed: (0..count)
                .map(|j| -inner(&mut column(j), &mut b.iter().copied()))
                .collect(),
            flat: b.iter().map(|b| b.squared()).sum(),
        }
    }

    #[test]
    fn translations_that_are_whole_already_stay() {
        let c = |re: f64, im: f64| Complex::new(re, im);
        let a = vec![
            vec![c(1.0, 0.2), c(0.3, 0.0), c(0.0, 0.0)],
            vec![c(0.0, 0.0), c(1.0, 0.0), c(0.5, -0.5)],
            vec![c(0.1, 0.0), c(0.0, 0.3), c(2.0, 0.0)],
        ];
        let whole = [c(3.0, -1.0), c(0.0, 2.0), c(-4.0, 1.0)];
        // Turned by one of the directions, and a little too large.
        let turn = Complex::new((0.1 * 1.05f64).exp(), 0.0)
            * c(
                (std::f64::consts::FRAC_PI_8).cos(),
                std::f64::consts::FRAC_PI_8.sin(),
            );
        let b: Vec<Complex> = a.iter().map(|row| product(row, &whole) * turn).collect();
        let rounded = round(&form(&a, &b), 1.0, [1.0; 2]).expect("near");
        assert!(
            (rounded.scale * turn - Complex::ONE).length() < 1e-12 || {
                // Up to a quarter turn of everything.
                let ratio = rounded.scale * turn;
                (ratio * ratio * ratio * ratio - Complex::ONE).length() < 1e-9
            }
        );
        let found = form(&a, &b).best_scale(&rounded.whole).expect("a scale");
        assert!(found.1 < 1e-9, "{found:?}");
    }

    #[test]
    fn nothing_near_is_refused() {
        let one = vec![vec![Complex::ONE]];
        // A translation of a hundredth of a tile.
        assert_eq!(
            round(&form(&one, &[Complex::new(0.01, 0.0)]), 1.0, [1.0; 2]),
            None
        );
        // A tile of half the height.
        let half = form(&one, &[Complex::new(0.0, 2.5)]);
        let rounded = round(&half, 1.0, [1.0, 0.5]).expect("near");
        assert_eq!(rounded.whole, [Complex::new(0.0, 2.5)]);
    }
}
