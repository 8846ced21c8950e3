//! Pure formulas on the three lengths of one Euclidean triangle.
//!
//! *Enters:* lengths, any positive unit; `length[k]` is opposite corner `k`. *Leaves:* angles (radians),
//! area, derivatives. *Guaranteed:* backward stable for needles and caps, no overflow of squares.
//! *Not guaranteed:* anything about lengths that break the triangle inequality; functions that
//! need it return `None`, so the caller decides what a broken face means.
//!
//! ```text
//!               corner 2
//!                 /θ2\
//!     length[1]  /    \  length[0]
//!               /      \
//!              /θ0    θ1\
//!       corner 0 ------- corner 1        counterclockwise
//!                length[2]
//! ```
//!
//! With s half the perimeter, the products below are built from s − l computed by differences of
//! *sorted* lengths (W. Kahan, "Miscalculating area and angles of a needle-like triangle"): the
//! difference of the two longest sides is taken first, which is exact where it matters.

/// True where the three lengths are positive, finite and each shorter than the sum of the others,
/// decided on the float64 values without rounding error.
pub fn is_triangle(length: [f64; 3]) -> bool {
    half_excesses(length).is_some()
}

/// `(2s, 2(s − l₀), 2(s − l₁), 2(s − l₂))` after division by the longest side, and that side.
type Halves = (f64, [f64; 3], f64);

fn half_excesses(length: [f64; 3]) -> Option<Halves> {
    let order = longest_first(length);
    let longest = length[order[0]];
    if !(length[order[2]] > 0.0 && longest.is_finite()) {
        return None;
    }
    let (middle, shortest) = (length[order[1]], length[order[2]]);
    // Where it matters the two longer sides are within a factor of two, and their difference is exact (Sterbenz).
    let gap = longest - middle;
    if gap >= shortest {
        return None;
    }
    let mut excess = [0.0; 3];
    excess[order[0]] = (shortest - gap) / longest;
    excess[order[1]] = (shortest + gap) / longest;
    excess[order[2]] = (middle + (longest - shortest)) / longest;
    let perimeter = 1.0 + (middle / longest + shortest / longest);
    (excess[order[0]] > 0.0).then_some((perimeter, excess, longest))
}

/// The same from logarithms of the sides, the longest of which is 1: the difference of the two longer sides keeps its digits
/// however thin the triangle, since it never is a difference of lengths.
fn half_excesses_of_logs(log: [f64; 3]) -> Option<Halves> {
    let order = longest_first(log);
    let (middle, shortest) = (log[order[1]].exp(), log[order[2]].exp());
    let gap = -log[order[1]].exp_m1();
    // A NaN must not pass for a triangle.
    let least = shortest - gap;
    if log[order[0]] != 0.0 || least.is_nan() || least <= 0.0 {
        return None;
    }
    let mut excess = [0.0; 3];
    excess[order[0]] = least;
    excess[order[1]] = shortest + gap;
    excess[order[2]] = middle + (1.0 - shortest);
    Some((1.0 + (middle + shortest), excess, 1.0))
}

/// Corners, that opposite the longest side first; equal sides keep their order, so the result is reproducible.
fn longest_first(side: [f64; 3]) -> [usize; 3] {
    let mut order = [0usize, 1, 2];
    for (i, j) in [(0, 1), (1, 2), (0, 1)] {
        if side[order[j]] > side[order[i]] {
            order.swap(i, j);
        }
    }
    order
}

/// Corner angles, radians; `None` where the lengths make no triangle.
///
/// tan²(θ₀/2) = (s − l₁)(s − l₂) / (s (s − l₀)).
pub fn angles(length: [f64; 3]) -> Option<[f64; 3]> {
    Some(corner_angles(half_excesses(length)?))
}

/// Both [`angles`] and [`cotangents`] from logarithms of the sides, the greatest of which must be 0; `None` where they make no
/// triangle. Angles are as accurate as the logarithms, which may come from differences of much larger numbers.
pub fn angles_and_cotangents_of_logs(log: [f64; 3]) -> Option<([f64; 3], [f64; 3])> {
    let halves = half_excesses_of_logs(log)?;
    Some((corner_angles(halves), corner_cotangents(halves)))
}

fn corner_angles((perimeter, excess, _): Halves) -> [f64; 3] {
    [0, 1, 2].map(|k| {
        let (j, m) = ((k + 1) % 3, (k + 2) % 3);
        2.0 * (excess[j] * excess[m])
            .sqrt()
            .atan2((perimeter * excess[k]).sqrt())
    })
}

/// Area, squared length unit (Heron); `None` where the lengths make no triangle.
pub fn area(length: [f64; 3]) -> Option<f64> {
    let (perimeter, excess, longest) = half_excesses(length)?;
    let root = (perimeter * excess[0] * excess[1] * excess[2]).sqrt();
    Some(0.25 * root * longest * longest)
}

/// Cotangents of the corner angles; `None` where the lengths make no triangle.
///
/// From half angles, cot θ = (1 − tan²(θ/2)) / (2 tan(θ/2)), that is
/// cot θ₀ = (s(s − l₀) − (s − l₁)(s − l₂)) / (2A).
pub fn cotangents(length: [f64; 3]) -> Option<[f64; 3]> {
    Some(corner_cotangents(half_excesses(length)?))
}

fn corner_cotangents((perimeter, excess, _): Halves) -> [f64; 3] {
    let root = (perimeter * excess[0] * excess[1] * excess[2]).sqrt();
    [0, 1, 2].map(|k| {
        let (j, m) = ((k + 1) % 3, (k + 2) % 3);
        (perimeter * excess[k] - excess[j] * excess[m]) / (2.0 * root)
    })
}

/// `∂θ_i/∂l_j` at `[i][j]`, radians per length unit; `None` where the lengths make no triangle.
///
/// Derivative of the cosine law, with A the area:
/// ∂θ_i/∂l_i = l_i / 2A, and ∂θ_i/∂l_j = −l_i cos θ_m / 2A for the third corner m.
pub fn angle_derivatives(length: [f64; 3]) -> Option<[[f64; 3]; 3]> {
    let angle = angles(length)?;
    let double_area = 2.0 * area(length)?;
    let mut derivative = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            derivative[i][j] = if i == j {
                length[i] / double_area
            } else {
                -length[i] * angle[3 - i - j].cos() / double_area
            };
        }
    }
    Some(derivative)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, FRAC_PI_6, PI};

    fn close(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() <= tolerance, "{a} against {b}");
    }

    #[test]
    fn logarithms_agree_with_lengths_and_keep_digits_in_needles() {
        for length in [[1.0, 0.7, 0.9], [0.2, 1.0, 0.95], [0.61, 0.62, 1.0]] {
            let (angle, cotangent) = angles_and_cotangents_of_logs(length.map(f64::ln)).unwrap();
            for k in 0..3 {
                close(angle[k], angles(length).unwrap()[k], 1e-14);
                close(cotangent[k], cotangents(length).unwrap()[k], 1e-13);
            }
        }
        // Sides 1, e^{−d} and s with s² = d² + (2 sin(φ/2))² e^{−d} …: a right angle between the short side and the middle one
        // needs 1 − e^{−2d} = s².
        for s in [1e-3_f64, 1e-9, 1e-15] {
            let d = -0.5 * (-s * s).ln_1p();
            let (angle, _) = angles_and_cotangents_of_logs([0.0, -d, s.ln()]).unwrap();
            close(angle[0], FRAC_PI_2, 1e-14);
            assert!((angle[2] / s - 1.0).abs() < 1e-6);
        }
        assert!(angles_and_cotangents_of_logs([0.0, -1.0, -2.0]).is_none());
        assert!(angles_and_cotangents_of_logs([0.0, f64::NAN, 0.0]).is_none());
        assert!(angles_and_cotangents_of_logs([f64::NAN; 3]).is_none());
    }

    #[test]
    fn hand_values() {
        let right = angles([3.0, 4.0, 5.0]).unwrap();
        close(right[2], FRAC_PI_2, 1e-15);
        close(right[0], 0.6_f64.asin(), 1e-15);
        close(area([3.0, 4.0, 5.0]).unwrap(), 6.0, 1e-14);
        let half = angles([1.0, 3.0_f64.sqrt(), 2.0]).unwrap();
        close(half[0], FRAC_PI_6, 1e-15);
        close(half[1], FRAC_PI_3, 1e-15);
        let cot = cotangents([1.0, 1.0, 2.0_f64.sqrt()]).unwrap();
        close(cot[0], 1.0, 1e-15);
        close(cot[2], 0.0, 1e-15);
        for k in angles([7.0; 3]).unwrap() {
            close(k, FRAC_PI_3, 1e-15);
        }
    }

    #[test]
    fn broken_lengths_are_refused() {
        for bad in [
            [1.0, 2.0, 3.0],
            [1.0, 1.0, 2.5],
            [0.0, 1.0, 1.0],
            [-1.0, 1.0, 1.0],
            [f64::NAN, 1.0, 1.0],
            [f64::INFINITY, f64::INFINITY, 1.0],
            [1.0, 1.0, 1e-17 * f64::MIN_POSITIVE],
        ] {
            assert!(!is_triangle(bad), "{bad:?}");
            assert!(angles(bad).is_none() && area(bad).is_none());
            assert!(cotangents(bad).is_none() && angle_derivatives(bad).is_none());
        }
        assert!(is_triangle([1.0, 2.0, 3.0 - 1e-15]));
    }

    #[test]
    fn needles_and_caps_keep_their_digits() {
        // A needle: two sides 1, one side 1e-9; the small angle is 2 asin(l/2).
        let needle = angles([1e-9, 1.0, 1.0]).unwrap();
        close(needle[0] / 1e-9, 1.0, 1e-14);
        close(needle[0] + needle[1] + needle[2], PI, 1e-15);
        // A cap that is flat to 2⁻⁴⁰: sides 1, 1, 2 − 2⁻⁴⁰; the base angles are acos(1 − 2⁻⁴¹).
        let slack = 2.0_f64.powi(-40);
        let cap = angles([1.0, 1.0, 2.0 - slack]).unwrap();
        let base = 2.0 * (slack / 4.0).sqrt().asin();
        close(cap[0] / base, 1.0, 1e-14);
        close(cap[1] / base, 1.0, 1e-14);
        // Any unit.
        for unit in [1e-200, 1e200] {
            let scaled = angles([3.0 * unit, 4.0 * unit, 5.0 * unit]).unwrap();
            close(scaled[2], FRAC_PI_2, 1e-15);
        }
    }

    #[test]
    fn derivatives_agree_with_finite_differences() {
        for length in [[3.0, 4.0, 5.0], [1.0, 1.1, 0.3], [2.0, 1.5, 3.2]] {
            let exact = angle_derivatives(length).unwrap();
            for j in 0..3 {
                let h = 1e-5;
                let (mut up, mut down) = (length, length);
                up[j] += h;
                down[j] -= h;
                let (up, down) = (angles(up).unwrap(), angles(down).unwrap());
                for i in 0..3 {
                    close(exact[i][j], (up[i] - down[i]) / (2.0 * h), 1e-8);
                }
            }
        }
    }

    #[test]
    fn cotangents_are_those_of_the_angles() {
        for length in [[3.0, 4.0, 5.0], [1.0, 1.1, 0.3], [2.0, 1.5, 3.2]] {
            let (cot, angle) = (cotangents(length).unwrap(), angles(length).unwrap());
            for k in 0..3 {
                close(cot[k], 1.0 / angle[k].tan(), 1e-12);
            }
        }
    }
}
