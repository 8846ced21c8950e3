//! Angles as exact numbers: everything that (6) compares, in one unit, as integers.
//!
//! *Enters:* Φ, K̄ and the margin as doubles, radians. *Leaves:* integers, in a unit of π/[`Exact::pi`].
//! *Guaranteed:* sums and differences of them are exact, so a slack is negative, zero or positive exactly.
//!
//! # Which numbers the doubles stand for
//!
//! (6) adds cone angles to multiples of π, and the double nearest to 4π is not 4π: taken literally, no prescription would ever meet
//! (6) with equality, nor Gauss–Bonnet. So what a double α stands for is decided once, here:
//!
//! 1. x = α/π in float64. Where a fraction p/q with q ≤ [`LARGEST_DENOMINATOR`] lies within two units in the last place of x
//!    (or of 1, where |x| is less), α is p/q·π. That holds for all that a user writes as a fraction of π, for
//!    uniform boundaries, for Φ = 0, π/3, π/2. A number without pattern meets such a fraction once in 10⁸ times, and then
//!    moves by two units.
//! 2. Otherwise α is x·π with the double x, to the nearest multiple of the unit, which is below 2⁻⁶²π.
//! 3. Gauss–Bonnet: where every vertex is prescribed and the total is off by no more than
//!    [`GAUSS_BONNET_TOLERANCE`], the excess is taken off the vertices of case 2 in equal parts, and what does not divide off the first
//!    of them, one unit each; off all vertices where none is of case 2.
//!
//! # Range
//!
//! The unit is 1/(2 L 2ᵏ b): L is the least common multiple of the denominators that occur (smallest first; those that would
//! take it beyond 2²⁴ go to case 2), k makes L 2ᵏ lie in (2⁶², 2⁶³], and a/b = ρ is the margin, b ≤ 100. Angles count up to
//! 2²⁰π. So one angle is below 2⁹² units, a sum over 2³² corners below 2¹²⁴, and nothing overflows an `i128`.

use crate::flow::prescription::GAUSS_BONNET_TOLERANCE;
use crate::geometry::ids::{EdgeVec, VertexVec};
use std::collections::BTreeSet;
use std::f64::consts::PI;

/// Largest denominator of a fraction of π that a double is taken for.
const LARGEST_DENOMINATOR: i64 = 4096;
/// Largest common denominator of those fractions.
const LARGEST_COMMON: i128 = 1 << 24;
/// Two units in the last place of 1.
const TWO_ULP: f64 = 2.0 * f64::EPSILON;
/// Largest angle that counts, in π.
const LARGEST_ANGLE: f64 = (1 << 20) as f64;
/// Largest denominator of the margin.
const LARGEST_MARGIN_DENOMINATOR: i64 = 100;

/// Both sides of (6) in one unit.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Exact {
    /// π, and what a face holds without a margin.
    pub pi: i128,
    /// ρπ, what a face holds.
    pub whole: i128,
    /// ρΘ of every vertex that is prescribed; 0 where the boundary is free.
    pub wanted: VertexVec<i128>,
    /// What a corner holds, by the edge opposite: π − Φ, but no less than half of `whole`.
    pub room: EdgeVec<i128>,
}

/// A double as a multiple of π.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Multiple {
    /// p/q in lowest terms.
    Fraction(i64, i64),
    /// Any other.
    Double(f64),
}

/// What [`Exact::new`] is told of a vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct ConeAngle {
    /// 2 inside, 1 on the boundary, in π.
    pub full: i64,
    /// K̄, radians.
    pub curvature: f64,
    /// False on a free boundary.
    pub prescribed: bool,
}

impl Exact {
    /// `phi` is asked for every edge, radians in [0, π/2]; `margin` is ρ, 1 to 2, to hundredths.
    pub fn new(
        vertices: &VertexVec<ConeAngle>,
        phi: Option<&EdgeVec<f64>>,
        [edges, faces]: [usize; 2],
        margin: f64,
    ) -> Self {
        let multiple = |v: &ConeAngle| match v.prescribed {
            true => Multiple::of(v.curvature),
            false => Multiple::Fraction(0, 1),
        };
        let curvature: Vec<Multiple> = vertices.iter().map(multiple).collect();
        let angle: Option<Vec<Multiple>> =
            phi.map(|phi| phi.iter().map(|&a| Multiple::of(a)).collect());
        let all = curvature.iter().chain(angle.iter().flatten());
        let scale = Scale::of(all);
        let (rho, denominator) = match fraction(margin, LARGEST_MARGIN_DENOMINATOR) {
            Some((p, q)) if p >= q => (i128::from(p), i128::from(q)),
            _ => {
                let q = LARGEST_MARGIN_DENOMINATOR;
                let p = (margin.clamp(1.0, 2.0) * q as f64).round();
                (p as i128, i128::from(q))
            }
        };
        // Twice, so that half of `whole` is a whole number.
        let (times, rho) = (2 * denominator, 2 * rho);
        let pi = scale.pi * times;
        let whole = scale.pi * rho;
        let mut cone_angle: Vec<i128> = vertices
            .iter()
            .zip(&curvature)
            .map(|(v, &k)| match v.prescribed {
                true => i128::from(v.full) * scale.pi - scale.integer(k),
                false => 0,
            })
            .collect();
        if vertices.iter().all(|v| v.prescribed) {
            let excess = cone_angle.iter().sum::<i128>() - scale.pi * faces as i128;
            let rounded: Vec<bool> = curvature.iter().map(|&k| !scale.is_exact(k)).collect();
            scale.balance(&mut cone_angle, excess, &rounded);
        }
        let room = |k: usize| {
            let phi = angle.as_ref().map_or(0, |a| scale.integer(a[k]));
            ((scale.pi - phi.max(0)) * times).max(whole / 2)
        };
        Self {
            pi,
            whole,
            wanted: cone_angle.into_iter().map(|a| a * rho).collect(),
            room: (0..edges).map(room).collect(),
        }
    }

    /// An integer of this unit in radians. Its sign is exact.
    pub fn radians(&self, units: i128) -> f64 {
        units as f64 / self.pi as f64 * PI
    }

    /// Radians in this unit, rounded; for what need not be exact.
    pub fn units(&self, radians: f64) -> i128 {
        (radians / PI * self.pi as f64) as i128
    }
}

impl Multiple {
    /// `radians` need not be finite.
    fn of(radians: f64) -> Self {
        let x = (radians / PI).clamp(-LARGEST_ANGLE, LARGEST_ANGLE);
        match fraction(x, LARGEST_DENOMINATOR) {
            Some((p, q)) => Self::Fraction(p, q),
            None => Self::Double(x),
        }
    }
}

/// The fraction with the least denominator within [`TWO_ULP`] of `x`: a convergent of its continued fraction, since p/q is one
/// where |x − p/q| < 1/(2q²). 0 for what is no number.
fn fraction(x: f64, largest: i64) -> Option<(i64, i64)> {
    if x.is_nan() {
        return Some((0, 1));
    }
    let tolerance = TWO_ULP * x.abs().max(1.0);
    let ([mut p0, mut p1], [mut q0, mut q1]) = ([0i64, 1], [1i64, 0]);
    let mut rest = x;
    loop {
        let whole = rest.floor();
        // Far beyond any denominator asked for; products below stay small.
        if whole.abs() > 2.0 * LARGEST_ANGLE {
            return None;
        }
        (p0, p1) = (p1, whole as i64 * p1 + p0);
        (q0, q1) = (q1, whole as i64 * q1 + q0);
        if q1 > largest {
            return None;
        }
        if (x - p1 as f64 / q1 as f64).abs() <= tolerance {
            return Some((p1, q1));
        }
        rest = 1.0 / (rest - whole);
    }
}

/// The unit before the margin: π is `pi` of it.
struct Scale {
    pi: i128,
    common: i128,
}

impl Scale {
    fn of<'a>(all: impl Iterator<Item = &'a Multiple>) -> Self {
        let denominators: BTreeSet<i64> = all
            .filter_map(|m| match m {
                Multiple::Fraction(_, q) => Some(*q),
                Multiple::Double(_) => None,
            })
            .collect();
        let mut common: i128 = 1;
        for q in denominators.into_iter().map(i128::from) {
            let least = common / gcd(common, q) * q;
            if least <= LARGEST_COMMON {
                common = least;
            }
        }
        let mut pi = common;
        while pi <= 1 << 62 {
            pi *= 2;
        }
        Self { pi, common }
    }

    fn is_exact(&self, m: Multiple) -> bool {
        matches!(m, Multiple::Fraction(_, q) if self.common % i128::from(q) == 0)
    }

    /// The nearest integer; of two the one farther from 0, so that opposite numbers stay opposite.
    fn integer(&self, m: Multiple) -> i128 {
        match m {
            // |p| < 2²¹ q, so the product stays below 2⁹⁶.
            Multiple::Fraction(p, q) => rounded(i128::from(p) * self.pi, i128::from(q)),
            Multiple::Double(x) => {
                // x = ±m 2^e exactly, m < 2⁵³; |x| ≤ 2²⁰.
                let bits = x.abs().to_bits();
                let (exponent, digits) = ((bits >> 52) as i32, bits & ((1 << 52) - 1));
                let (m, e) = match exponent {
                    0 => (digits, -1074),
                    _ => (digits | 1 << 52, exponent - 1075),
                };
                // Below 2⁵³ · 2⁶³.
                let product = i128::from(m) * self.pi;
                let size = match e {
                    0.. => product << e,
                    -119..0 => rounded(product, 1 << -e),
                    _ => 0,
                };
                if x < 0.0 { -size } else { size }
            }
        }
    }

    /// Takes a small excess off the vertices that were rounded, or off all; see the module docs.
    fn balance(&self, cone_angle: &mut [i128], excess: i128, rounded: &[bool]) {
        let tolerance = (GAUSS_BONNET_TOLERANCE / PI * self.pi as f64) as i128;
        if excess == 0 || excess.abs() > tolerance {
            return;
        }
        let any = rounded.iter().any(|&r| r);
        let sharing = |i: &usize| !any || rounded[*i];
        let chosen: Vec<usize> = (0..cone_angle.len()).filter(sharing).collect();
        let count = chosen.len() as i128;
        let (share, left) = (excess.div_euclid(count), excess.rem_euclid(count));
        for (k, i) in chosen.into_iter().enumerate() {
            cone_angle[i] -= share + i128::from((k as i128) < left);
        }
    }
}

/// a / b, b > 0, to the nearest integer, halves away from 0.
fn rounded(a: i128, b: i128) -> i128 {
    let size = (a.abs() + b / 2) / b;
    if a < 0 { -size } else { size }
}

fn gcd(mut a: i128, mut b: i128) -> i128 {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_of_pi_are_found_as_people_and_rounding_write_them() {
        for q in [1i64, 2, 3, 4, 5, 7, 12, 97, 723, 4093] {
            for p in [-12 * q + 1, -4 * q, -1, 0, 1, q - 1, 2 * q - 1] {
                let exact = p as f64 / q as f64;
                let common = gcd(i128::from(p.abs()), i128::from(q)).max(1) as i64;
                let lowest = Multiple::Fraction(p / common, q / common);
                assert_eq!(Multiple::of(exact * PI), lowest, "{p}/{q}");
                assert_eq!(Multiple::of(exact * PI + 1e-16), lowest, "{p}/{q}");
                assert_eq!(Multiple::of(p as f64 * PI / q as f64), lowest, "{p}/{q}");
                // Far from it in float64's eyes.
                let near = (exact + 20.0 * TWO_ULP * exact.abs().max(1.0)) * PI;
                assert!(matches!(Multiple::of(near), Multiple::Double(_)), "{p}/{q}");
            }
        }
        assert_eq!(Multiple::of((0.5_f64).acos()), Multiple::Fraction(1, 3));
        assert_eq!(Multiple::of((0.0_f64).acos()), Multiple::Fraction(1, 2));
        assert_eq!(Multiple::of(f64::NAN), Multiple::Fraction(0, 1));
        assert_eq!(
            Multiple::of(f64::NEG_INFINITY),
            Multiple::Fraction(-(1 << 20), 1)
        );
    }

    #[test]
    fn doubles_become_the_nearest_multiple_of_the_unit() {
        let scale = Scale::of([Multiple::Fraction(1, 3), Multiple::Fraction(1, 4)].iter());
        assert_eq!(scale.pi % 12, 0);
        assert!(scale.pi > 1 << 62 && scale.pi <= 1 << 63);
        for x in [1.0_f64, -0.37, 5.2e-19, -1e-30, 12345.678, 1e-310, 0.1] {
            let own = scale.integer(Multiple::Double(x)) as f64 / scale.pi as f64;
            assert!((own - x).abs() <= 1.2e-19 + 2.3e-16 * x.abs(), "{x} {own}");
            assert_eq!(
                scale.integer(Multiple::Double(-x)),
                -scale.integer(Multiple::Double(x))
            );
        }
        assert_eq!(3 * scale.integer(Multiple::Fraction(1, 3)), scale.pi);
        assert_eq!(scale.integer(Multiple::Double(0.5)) * 2, scale.pi);
    }

    fn cones(curvature: &[f64]) -> VertexVec<ConeAngle> {
        let cone = |&curvature: &f64| ConeAngle {
            full: 2,
            curvature,
            prescribed: true,
        };
        curvature.iter().map(cone).collect()
    }

    #[test]
    fn gauss_bonnet_is_exact_and_exact_fractions_stay() {
        // A sphere of four faces: totals 4π, by numbers that do not add up exactly.
        let (a, b) = (0.123_456_789_123, 0.777_777_123_4);
        let given = [a, b, 2.0 * PI / 3.0, 4.0 * PI - a - b - 2.0 * PI / 3.0];
        let exact = Exact::new(&cones(&given), None, [6, 4], 1.0);
        let total: i128 = exact.wanted.iter().sum();
        assert_eq!(total, 4 * exact.whole);
        assert_eq!(exact.wanted.as_slice()[2], 4 * exact.pi / 3);
        // With a margin everything but π grows.
        let wide = Exact::new(&cones(&given), None, [6, 4], 1.3);
        assert_eq!(10 * wide.whole, 13 * wide.pi);
        assert_eq!(wide.wanted.iter().sum::<i128>(), 4 * wide.whole);
        // A total that is truly wrong stays wrong.
        let wrong = Exact::new(&cones(&[PI, PI, PI, PI + 1e-6]), None, [6, 4], 1.0);
        assert!(wrong.wanted.iter().sum::<i128>() != 4 * wrong.whole);
    }
}
