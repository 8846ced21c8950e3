//! Rigid motions and similarities of the plane.

use crate::geometry::mesh::PLAIN_SQUARES;
use std::f64::consts::{FRAC_PI_2, PI};

const MINUS_FRAC_PI_2: f64 = -FRAC_PI_2;

/// p ↦ R(rotation) p + translation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RigidMotion {
    /// Angle in radians, in (−π, π].
    pub rotation: f64,
    /// Added after the rotation.
    pub translation: [f64; 2],
}

impl RigidMotion {
    /// The image of a point.
    pub fn apply(&self, p: [f64; 2]) -> [f64; 2] {
        let q = rotate(p, self.rotation);
        [q[0] + self.translation[0], q[1] + self.translation[1]]
    }

    /// First `first`, then `self`.
    pub fn after(&self, first: &RigidMotion) -> RigidMotion {
        RigidMotion {
            rotation: wrap_angle(self.rotation + first.rotation),
            translation: self.apply(first.translation),
        }
    }

    /// The motion that undoes this one.
    pub fn inverse(&self) -> RigidMotion {
        let t = rotate(self.translation, -self.rotation);
        RigidMotion {
            rotation: wrap_angle(-self.rotation),
            translation: [-t[0], -t[1]],
        }
    }
}

/// p ↦ scale · R(rotation) p + translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// Positive factor.
    pub scale: f64,
    /// Angle in radians, in (−π, π].
    pub rotation: f64,
    /// Added last.
    pub translation: [f64; 2],
}

impl Similarity {
    /// The image of a point.
    pub fn apply(&self, p: [f64; 2]) -> [f64; 2] {
        let q = rotate(p, self.rotation);
        std::array::from_fn(|i| self.scale * q[i] + self.translation[i])
    }
}

/// Rotates about the origin, counterclockwise.
pub fn rotate(p: [f64; 2], angle: f64) -> [f64; 2] {
    rotation(angle)(p)
}

/// The rotation about the origin by an angle, for many points; exact by the multiples of π/2 in (−π, π].
pub fn rotation(angle: f64) -> impl Fn([f64; 2]) -> [f64; 2] {
    let (s, c) = match angle {
        0.0 => (0.0, 1.0),
        FRAC_PI_2 => (1.0, 0.0),
        MINUS_FRAC_PI_2 => (-1.0, 0.0),
        PI => (0.0, -1.0),
        _ => angle.sin_cos(),
    };
    move |p| [c * p[0] - s * p[1], s * p[0] + c * p[1]]
}

/// The same angle in (−π, π].
pub fn wrap_angle(angle: f64) -> f64 {
    use std::f64::consts::TAU;
    let r = angle - TAU * (angle / TAU).round();
    if r <= -PI { r + TAU } else { r }
}

/// Twice the signed area of a triangle.
pub fn doubled_area(t: [[f64; 2]; 3]) -> f64 {
    (t[1][0] - t[0][0]) * (t[2][1] - t[0][1]) - (t[1][1] - t[0][1]) * (t[2][0] - t[0][0])
}

/// Euclidean distance.
pub fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    let d = [b[0] - a[0], b[1] - a[1]];
    let square = d[0] * d[0] + d[1] * d[1];
    match PLAIN_SQUARES.contains(&square) {
        true => square.sqrt(),
        false => d[0].hypot(d[1]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motions_compose_and_invert() {
        let a = RigidMotion {
            rotation: 2.5,
            translation: [1.0, -3.0],
        };
        let b = RigidMotion {
            rotation: 1.7,
            translation: [0.5, 4.0],
        };
        let p = [0.3, -0.8];
        assert!(distance(a.after(&b).apply(p), a.apply(b.apply(p))) < 1e-14);
        assert!(distance(a.inverse().apply(a.apply(p)), p) < 1e-14);
    }

    #[test]
    fn quarter_turns_are_exact() {
        let mut p = [0.1, 0.7];
        for expected in [[-0.7, 0.1], [-0.1, -0.7], [0.7, -0.1], [0.1, 0.7]] {
            p = rotate(p, FRAC_PI_2);
            assert_eq!(p, expected);
        }
        assert_eq!(rotate(p, PI), [-0.1, -0.7]);
        assert_eq!(rotate(p, -FRAC_PI_2), [0.7, -0.1]);
        assert_eq!(rotate(p, 0.0), p);
    }

    #[test]
    fn angles_wrap_into_the_half_open_interval() {
        assert_eq!(wrap_angle(-PI), PI);
        assert_eq!(wrap_angle(PI), PI);
        assert!((wrap_angle(-8.0 * PI + 0.25) - 0.25).abs() < 1e-14);
    }
}
