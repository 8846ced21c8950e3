//! Coordinates near 1: the frame in which a surface is worked on.
//!
//! *Enters:* positions in source units, of any size and anywhere. *Leaves:* a [`Frame`], which takes them to a box at the origin whose
//! longest side lies in [1, 2), and results back.
//!
//! *Guaranteed:* taking a source position in and out again gives the same bits, unless it is so near zero beside the others that
//! float64 cannot hold the quotient. Lengths are multiplied by a power of two, which rounds nothing. So a mesh times 2^k is worked on with the same bits
//! for every k in [`EXPONENTS`], and no product of a few lengths or areas overflows or vanishes on the way.
//! *Not guaranteed:* that new points between those of the source survive the way out where the source lies far from the origin: see
//! [`Frame::resolution`].

use super::ids::VertexVec;
use super::mesh::bounding_box;
use std::ops::RangeInclusive;

/// Exponents of two that the longest side of a surface's box may have: float32, in which images and GLB hold positions, has room for
/// that size and for 2⁻²⁴ of it.
pub const EXPONENTS: RangeInclusive<i32> = -110..=120;

/// Where source coordinates are taken before they are worked on, and how they come back: p = 2^`exponent` · p′ + `origin`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Frame {
    /// Of each axis 0, or the middle of the box where the box lies so far from zero that the difference is exact.
    origin: [f64; 3],
    /// The longest side of the box is 2^`exponent` to twice that.
    exponent: i32,
    /// The largest absolute coordinate.
    reach: f64,
}

impl Frame {
    /// The frame of points, which must be finite. That of no points, or of one, changes no sizes.
    pub fn of(points: &[[f64; 3]]) -> Self {
        if points.is_empty() {
            return Self::default();
        }
        let (low, high) = bounding_box(points);
        // Halved, since sides of 1e308 on both sides of zero have no difference.
        let half = (0..3).map(|i| 0.5 * high[i] - 0.5 * low[i]);
        let half = half.fold(0.0, f64::max);
        let exponent = match half > 0.0 {
            true => exponent_of(half) + 1,
            false => 0,
        };
        let reach = low
            .iter()
            .chain(&high)
            .fold(0.0, |m: f64, x| m.max(x.abs()));
        Self {
            origin: std::array::from_fn(|i| far_middle(low[i], high[i])),
            exponent,
            reach,
        }
    }

    /// ⌊log₂⌋ of the longest side of the box, source units.
    pub fn exponent(&self) -> i32 {
        self.exponent
    }

    /// The largest absolute source coordinate.
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// The longest side of the box that float64 tells apart from none at the surface's distance from the origin, as a part of the
    /// longest side of its own box.
    pub fn resolution(&self) -> f64 {
        times_power_of_two(self.reach * f64::EPSILON, -self.exponent)
    }

    /// A source position in the frame.
    pub fn enter(&self, p: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| times_power_of_two(p[i] - self.origin[i], -self.exponent))
    }

    /// A position of the frame in source units.
    pub fn leave(&self, p: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|i| self.length(p[i]) + self.origin[i])
    }

    /// All positions of the frame in source units.
    pub fn leave_all(&self, positions: &mut VertexVec<[f64; 3]>) {
        let positions = positions.as_mut_slice().iter_mut();
        positions.for_each(|p| *p = self.leave(*p));
    }

    /// A length, or a plane coordinate, of the frame in source units.
    pub fn length(&self, l: f64) -> f64 {
        times_power_of_two(l, self.exponent)
    }

    /// A plane vector of the frame in source units.
    pub fn plane(&self, p: [f64; 2]) -> [f64; 2] {
        p.map(|x| self.length(x))
    }

    /// An area of the frame in square source units.
    pub fn area(&self, a: f64) -> f64 {
        self.length(self.length(a))
    }
}

/// The middle of an interval that lies so far from zero that each of its numbers is at least half and at most twice that: then differences
/// are exact (Sterbenz 1974). Else 0.
fn far_middle(low: f64, high: f64) -> f64 {
    let (near, far) = match low > 0.0 {
        true => (low, high),
        false => (-high, -low),
    };
    match near > 0.0 && far <= 2.0 * near {
        true => low + 0.5 * (high - low),
        false => 0.0,
    }
}

/// ⌊log₂ x⌋ of a positive number.
fn exponent_of(x: f64) -> i32 {
    let biased = |x: f64| ((x.to_bits() >> 52) & 0x7ff) as i32;
    match biased(x) {
        // Below the normal numbers: 2^64 lifts all of them above.
        0 => biased(x * 18_446_744_073_709_551_616.0) - 64 - 1023,
        b => b - 1023,
    }
}

/// x · 2^k, rounded once at most.
pub fn times_power_of_two(x: f64, k: i32) -> f64 {
    let power = |k: i32| f64::from_bits(((1023 + k) as u64) << 52);
    let (mut x, mut k) = (x, k);
    // Large factors first and the remainder last, so that only the last product rounds.
    while k > 1023 {
        x *= power(1023);
        k -= 1023;
    }
    while k < -969 {
        // 2^53 above the least normal number: no bit is lost before the last step.
        x *= power(-969);
        k += 969;
    }
    x * power(k)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn box_at(offset: [f64; 3], size: f64) -> Vec<[f64; 3]> {
        let mut points = Vec::new();
        let mut state = 7u64;
        let mut random = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64
        };
        for _ in 0..500 {
            points.push(std::array::from_fn(|i| offset[i] + size * random()));
        }
        points
    }

    #[test]
    fn positions_come_back_bit_for_bit() {
        for offset in [
            [0.0; 3],
            [1e3, -7.0, 0.3],
            [-1e12, 5e4, -0.5],
            [0.9, 1.1, 2.0],
        ] {
            for size in [1e-30, 1.0, 3.7e5] {
                let points = box_at(offset, size);
                let frame = Frame::of(&points);
                for &p in &points {
                    assert_eq!(frame.leave(frame.enter(p)), p, "{offset:?} {size}");
                }
            }
        }
    }

    #[test]
    fn a_box_becomes_one_of_unit_size_near_the_origin() {
        for exponent in [-1060, -300, -1, 0, 7, 900, 1023] {
            let size = times_power_of_two(1.3, exponent);
            let points = [[0.0; 3], [0.25 * size, size, -0.5 * size]];
            let entered = points.map(|p| Frame::of(&points).enter(p));
            let (low, high) = bounding_box(&entered);
            let longest = (0..3).map(|i| high[i] - low[i]).fold(0.0, f64::max);
            assert!((1.0..2.0).contains(&longest), "2^{exponent}: {longest}");
        }
        let far = [[f64::MAX, 0.0, 0.0], [-f64::MAX, 1.0, 0.0]];
        let entered = far.map(|p| Frame::of(&far).enter(p));
        assert!(
            entered.iter().flatten().all(|x| x.abs() <= 2.0),
            "{entered:?}"
        );
    }

    #[test]
    fn multiples_by_powers_of_two_enter_with_the_same_bits() {
        let points = box_at([5.0, -1e3, 0.0], 1.0);
        let entered: Vec<_> = points
            .iter()
            .map(|&p| Frame::of(&points).enter(p))
            .collect();
        for k in [-900, -100, -1, 1, 64, 900] {
            let times = |p: [f64; 3]| p.map(|x| times_power_of_two(x, k));
            let scaled: Vec<_> = points.iter().map(|&p| times(p)).collect();
            let frame = Frame::of(&scaled);
            let again: Vec<_> = scaled.iter().map(|&p| frame.enter(p)).collect();
            assert_eq!(again, entered, "2^{k}");
            assert_eq!(
                frame.length(1.0),
                times_power_of_two(Frame::of(&points).length(1.0), k)
            );
        }
    }

    #[test]
    fn powers_of_two_of_any_size_are_exact() {
        assert_eq!(times_power_of_two(1.5, 0), 1.5);
        assert_eq!(times_power_of_two(1.0, -1074), f64::from_bits(1));
        assert_eq!(times_power_of_two(f64::from_bits(1), 1074), 1.0);
        assert_eq!(
            times_power_of_two(f64::from_bits(1), 2000),
            times_power_of_two(1.0, 926)
        );
        assert_eq!(times_power_of_two(1.0, -1100), 0.0);
        assert_eq!(times_power_of_two(1.0, 1100), f64::INFINITY);
        // A number of 53 bits is rounded once, to even.
        let x = 1.0 + f64::EPSILON;
        assert_eq!(
            times_power_of_two(x, -1022),
            f64::MIN_POSITIVE + f64::from_bits(1)
        );
    }
}
