//! Cubic B-splines over [0, 1] on uniform knots.
//!
//! *Enters:* a number of knot intervals. *Leaves:* a [`Basis`]: its knots, and its functions and their derivatives at a parameter.
//!
//! *Guaranteed:* the functions add up to 1 everywhere, are not negative, and the first and the last are 1 at the two ends (the
//! knots are open: the ends stand four times), so that a curve begins and ends at its outer control points. *Not guaranteed:*
//! anything outside [0, 1]; parameters are taken into it.
//!
//! C. de Boor, *A Practical Guide to Splines* (1978), chapters IX and X.

/// Of every spline here.
pub const DEGREE: usize = 3;

/// Functions that are not zero in one knot interval.
pub const ORDER: usize = DEGREE + 1;

/// The cubic B-splines of uniform open knots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Basis {
    intervals: usize,
}

/// The functions that are not zero at a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local {
    /// Number of the first of them.
    pub first: usize,
    /// Values of that function and the next three.
    pub value: [f64; ORDER],
    /// Their derivatives.
    pub derivative: [f64; ORDER],
}

impl Basis {
    /// At least one interval.
    pub fn new(intervals: usize) -> Self {
        Self {
            intervals: intervals.max(1),
        }
    }

    /// The basis for samples that lie evenly from 0 to 1: an interval takes about `spacing` of their steps. There are never more
    /// functions than samples, and none at all for fewer samples than a cubic needs.
    pub fn for_samples(samples: usize, spacing: f64) -> Option<Self> {
        let most = samples.checked_sub(DEGREE).filter(|&n| n > 0)?;
        let wanted = (samples - 1) as f64 / spacing;
        Some(Self::new((wanted.round() as usize).min(most)))
    }

    /// Knot intervals.
    pub fn intervals(self) -> usize {
        self.intervals
    }

    /// Functions, and so control points.
    pub fn count(self) -> usize {
        self.intervals + DEGREE
    }

    /// Knot `i` of `count() + 4`.
    fn knot(self, i: usize) -> f64 {
        let inner = i.saturating_sub(DEGREE).min(self.intervals);
        inner as f64 / self.intervals as f64
    }

    /// All knots.
    pub fn knots(self) -> Vec<f64> {
        (0..self.count() + ORDER).map(|i| self.knot(i)).collect()
    }

    /// Values and derivatives at a parameter, by the recurrence over the degree.
    pub fn at(self, t: f64) -> Local {
        // Not a number becomes 0, too.
        let t = if t > 0.0 { t.min(1.0) } else { 0.0 };
        let first = ((t * self.intervals as f64) as usize).min(self.intervals - 1);
        let span = first + DEGREE;
        let mut value = [1.0, 0.0, 0.0, 0.0];
        let mut quadratic = value;
        for degree in 1..=DEGREE {
            quadratic = value;
            let mut carried = 0.0;
            for (r, share) in value[..degree].iter_mut().enumerate() {
                let (left, right) = (self.knot(span + 1 + r - degree), self.knot(span + 1 + r));
                let part = *share / (right - left);
                *share = carried + (right - t) * part;
                carried = (t - left) * part;
            }
            value[degree] = carried;
        }
        let slope = |r: usize| {
            // Function r of degree 2 over the knots it does not vanish on.
            let (left, right) = (self.knot(span + r + 1 - DEGREE), self.knot(span + r + 1));
            DEGREE as f64 * quadratic[r] / (right - left)
        };
        let derivative = std::array::from_fn(|r| {
            let rising = if r > 0 { slope(r - 1) } else { 0.0 };
            let falling = if r < DEGREE { slope(r) } else { 0.0 };
            rising - falling
        });
        Local {
            first,
            value,
            derivative,
        }
    }
}
