//! The few formulas that the checks need, written for themselves alone.
//!
//! Corner k of a triangle has the edge k opposite, which runs from corner k+1 to corner k+2.

use std::f64::consts::{PI, TAU};

pub(super) type Point2 = [f64; 2];
pub(super) type Point3 = [f64; 3];

/// The greatest of a stream of errors; a NaN counts as infinite, so that it can never pass a bound.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Worst(pub f64);

impl Worst {
    pub fn see(&mut self, error: f64) {
        if error.is_nan() {
            self.0 = f64::INFINITY;
        } else if error > self.0 {
            self.0 = error;
        }
    }
}

/// Length of a vector, by the slower `hypot` only where squares may have overflowed or vanished. Points that two faces share are exactly equal, so most vectors
/// between them are zero.
fn length<const N: usize>(vector: [f64; N]) -> f64 {
    let square: f64 = vector.iter().map(|x| x * x).sum();
    if (1e-200..1e200).contains(&square) {
        square.sqrt()
    } else if vector == [0.0; N] {
        0.0
    } else {
        vector.iter().fold(0.0, |length: f64, x| length.hypot(*x))
    }
}

pub(super) fn sub2(a: Point2, b: Point2) -> Point2 {
    [a[0] - b[0], a[1] - b[1]]
}

pub(super) fn distance2(a: Point2, b: Point2) -> f64 {
    length(sub2(a, b))
}

pub(super) fn sub3(a: Point3, b: Point3) -> Point3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn cross3(a: Point3, b: Point3) -> Point3 {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

pub(super) fn norm3(a: Point3) -> f64 {
    length(a)
}

pub(super) fn distance3(a: Point3, b: Point3) -> f64 {
    norm3(sub3(a, b))
}

/// Weighted sum of three points.
pub(super) fn mix3(t: [Point3; 3], w: [f64; 3]) -> Point3 {
    std::array::from_fn(|i| w[0] * t[0][i] + w[1] * t[1][i] + w[2] * t[2][i])
}

/// p ↦ R(rotation) p + translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Motion {
    pub rotation: f64,
    pub translation: Point2,
    /// Of the rotation, since motions are applied to many points.
    turn: Turn,
}

impl Motion {
    pub const IDENTITY: Motion = Motion {
        rotation: 0.0,
        translation: [0.0, 0.0],
        turn: Turn {
            sine: 0.0,
            cosine: 1.0,
        },
    };

    pub fn new(rotation: f64, translation: Point2) -> Self {
        Self {
            rotation,
            translation,
            turn: Turn::by(rotation),
        }
    }

    pub fn apply(&self, p: Point2) -> Point2 {
        let q = self.turn.apply(p);
        [q[0] + self.translation[0], q[1] + self.translation[1]]
    }

    pub fn inverse_apply(&self, p: Point2) -> Point2 {
        self.turn.inverse().apply(sub2(p, self.translation))
    }

    /// First `first`, then `self`.
    pub fn after(&self, first: &Motion) -> Motion {
        let rotation = self.rotation + first.rotation;
        Motion::new(rotation, self.apply(first.translation))
    }

    pub fn inverse(&self) -> Motion {
        let turn = self.turn.inverse();
        Motion {
            rotation: -self.rotation,
            translation: turn.apply([-self.translation[0], -self.translation[1]]),
            turn,
        }
    }
}

/// A rotation about the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Turn {
    sine: f64,
    cosine: f64,
}

impl Turn {
    pub fn by(angle: f64) -> Self {
        let (sine, cosine) = angle.sin_cos();
        Self { sine, cosine }
    }

    fn inverse(self) -> Self {
        let sine = -self.sine;
        Self { sine, ..self }
    }

    pub fn apply(self, p: Point2) -> Point2 {
        let Self { sine, cosine } = self;
        [cosine * p[0] - sine * p[1], sine * p[0] + cosine * p[1]]
    }
}

/// Distance of an angle from the nearest multiple of `period`.
pub(super) fn off_multiple(angle: f64, period: f64) -> f64 {
    (angle - period * (angle / period).round()).abs()
}

/// Distance of an angle from zero modulo 2π.
pub(super) fn off_turn(angle: f64) -> f64 {
    off_multiple(angle, TAU)
}

/// Lengths of the edges opposite the corners.
pub(super) fn lengths2(t: [Point2; 3]) -> [f64; 3] {
    std::array::from_fn(|k| distance2(t[(k + 1) % 3], t[(k + 2) % 3]))
}

/// Lengths of the edges opposite the corners.
pub(super) fn lengths3(t: [Point3; 3]) -> [f64; 3] {
    std::array::from_fn(|k| distance3(t[(k + 1) % 3], t[(k + 2) % 3]))
}

pub(super) fn longest(l: [f64; 3]) -> f64 {
    l[0].max(l[1]).max(l[2])
}

pub(super) fn shortest(l: [f64; 3]) -> f64 {
    l[0].min(l[1]).min(l[2])
}

/// Twice the signed area.
pub(super) fn doubled_area2(t: [Point2; 3]) -> f64 {
    let (e, f) = (sub2(t[1], t[0]), sub2(t[2], t[0]));
    e[0] * f[1] - e[1] * f[0]
}

pub(super) fn area3(t: [Point3; 3]) -> f64 {
    0.5 * norm3(cross3(sub3(t[1], t[0]), sub3(t[2], t[0])))
}

/// Area from lengths (Heron's formula on sorted sides, which does not cancel); 0 where they span no triangle.
pub(super) fn area_from_lengths(l: [f64; 3]) -> f64 {
    let [a, b, c] = descending(l);
    let product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
    0.25 * product.max(0.0).sqrt()
}

fn descending([x, y, z]: [f64; 3]) -> [f64; 3] {
    let (high, low) = (x.max(y), x.min(y));
    [high.max(z), low.max(high.min(z)), low.min(z)]
}

/// Tangents of half the corner angles from lengths: tan²(θ/2) = (products of side differences) / (products of side sums). Infinite
/// for a straight angle.
pub(super) fn half_tangents(l: [f64; 3]) -> [f64; 3] {
    // The sum of two sides less the third, without a rounding of the sum (Kahan).
    let room = |k: usize| {
        let (b, c) = (l[(k + 1) % 3], l[(k + 2) % 3]);
        b.min(c) - (l[k] - b.max(c))
    };
    let rooms = [0, 1, 2].map(room);
    std::array::from_fn(|k| {
        let over = rooms[(k + 1) % 3] * rooms[(k + 2) % 3];
        let under = (l[0] + l[1] + l[2]) * rooms[k];
        if over > 0.0 {
            (over / under.max(0.0)).sqrt()
        } else {
            0.0
        }
    })
}

/// Angles from the tangents of their halves.
pub(super) fn angles_from(halves: [f64; 3]) -> [f64; 3] {
    halves.map(|t| 2.0 * t.atan())
}

/// Distance of two angles in [0, π/2] from their tangents: tan(α − β) = (tan α − tan β) / (1 + tan α tan β).
pub(super) fn half_angle_gap(s: f64, t: f64) -> f64 {
    let tangent = ((s - t) / (1.0 + s * t)).abs();
    if tangent < 0.125 {
        // So small, the series needs eight terms for full precision.
        let square = tangent * tangent;
        let term = |sum: f64, n: i32| 1.0 / f64::from(n) - square * sum;
        tangent * [13, 11, 9, 7, 5, 3, 1].into_iter().fold(1.0 / 15.0, term)
    } else {
        (s.atan() - t.atan()).abs()
    }
}

/// Smallest sine of the corner angles from lengths, where a thin triangle makes angles ill-conditioned: that between the two longest
/// sides, as the area tells it. The factors of the area are divided one by one, so that nothing overflows.
pub(super) fn least_sine(l: [f64; 3]) -> f64 {
    let [a, b, c] = descending(l);
    let long = ((a + (b + c)) / a) * ((a + (b - c)) / a);
    let short = ((c - (a - b)) / b) * ((c + (a - b)) / b);
    (0.5 * (long * short).max(0.0).sqrt()).min(1.0)
}

/// How far angles of a face may be off because its lengths are rounded (radians): where it is thin, by the roundings of three lengths over its height.
pub(super) fn angle_slack(l: [f64; 3]) -> f64 {
    let sine = least_sine(l);
    let thin = if sine < 1e-7 { 3e-8 } else { 4e-16 / sine };
    4e-15 * longest(l) / shortest(l) + thin
}

/// Corner angles, opposite to the lengths, by the law of cosines, and how far the contract lets them be off.
pub(super) fn angles_by_cosines(l: [f64; 3]) -> ([f64; 3], f64) {
    let angles: [f64; 3] = std::array::from_fn(|k| {
        let [a, b, c] = [l[k], l[(k + 1) % 3], l[(k + 2) % 3]];
        let cosine = (b * b + c * c - a * a) / (2.0 * b * c);
        cosine.clamp(-1.0, 1.0).acos()
    });
    let is_thin = angles.iter().any(|a| a.sin() < 1e-7);
    let slack = 4e-15 * longest(l) / shortest(l) + if is_thin { 3e-8 } else { 0.0 };
    (angles, slack)
}

/// Axis-aligned bounds of a set of points, with its diagonal and its distance from the origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent2 {
    pub min: Point2,
    pub max: Point2,
}

impl Extent2 {
    pub fn of(points: impl IntoIterator<Item = Point2>) -> Self {
        let mut extent = Extent2 {
            min: [f64::INFINITY; 2],
            max: [f64::NEG_INFINITY; 2],
        };
        for p in points {
            extent.min = [extent.min[0].min(p[0]), extent.min[1].min(p[1])];
            extent.max = [extent.max[0].max(p[0]), extent.max[1].max(p[1])];
        }
        extent
    }

    /// Length of the diagonal; 0 for no points.
    pub fn diagonal(&self) -> f64 {
        if self.min[0] > self.max[0] {
            return 0.0;
        }
        distance2(self.min, self.max)
    }

    /// Largest absolute coordinate; 0 for no points.
    pub fn reach(&self) -> f64 {
        let ends = [self.min[0], self.min[1], self.max[0], self.max[1]];
        let reach = ends.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        if reach.is_finite() { reach } else { 0.0 }
    }
}

/// Length of the diagonal of the bounding box.
pub(super) fn diagonal3<'a>(points: impl IntoIterator<Item = &'a Point3>) -> f64 {
    let (min, max) = bounds3(points);
    if min[0] > max[0] {
        return 0.0;
    }
    distance3(min, max)
}

pub(super) fn bounds3<'a>(points: impl IntoIterator<Item = &'a Point3>) -> (Point3, Point3) {
    let mut min = [f64::INFINITY; 3];
    let mut max = [f64::NEG_INFINITY; 3];
    for p in points {
        for i in 0..3 {
            min[i] = min[i].min(p[i]);
            max[i] = max[i].max(p[i]);
        }
    }
    (min, max)
}

/// Whether a face is counterclockwise, up to what double precision can tell of a sliver at coordinates as
/// large as `reach`. A face so small that its corners coincide there has no orientation.
pub(super) fn is_positive(t: [Point2; 3], reach: f64) -> bool {
    let area = doubled_area2(t);
    area > 0.0 || {
        let l = longest(lengths2(t));
        l > 0.0 && area >= -1e-14 * l * l - 1e-13 * reach * l
    }
}

/// Whether a rotation lies in (−π, π].
pub(super) fn in_half_open_turn(rotation: f64) -> bool {
    rotation > -PI && rotation <= PI
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_and_areas_of_a_three_four_five_triangle() {
        let l = [3.0, 4.0, 5.0];
        let a = angles_from(half_tangents(l));
        assert!((a[2] - PI / 2.0).abs() < 1e-15);
        assert!((a[0] - (3.0f64 / 5.0).asin()).abs() < 1e-15);
        assert!((a.iter().sum::<f64>() - PI).abs() < 1e-14);
        assert!((area_from_lengths(l) - 6.0).abs() < 1e-14);
        assert_eq!(area_from_lengths([1.0, 1.0, 3.0]), 0.0);
    }

    #[test]
    fn least_sines_are_those_of_the_angles() {
        for l in [
            [3.0, 4.0, 5.0],
            [5.0, 5.0, 1e-3],
            [1.0, 0.7, 0.4],
            [2e-200, 3e-200, 2e-200],
            [2e200, 3e200, 2e200],
        ] {
            // Scaled, as the squares in the angles overflow; the angle between long sides cancels some digits.
            let angles = angles_from(half_tangents(l.map(|x| x / longest(l))));
            let least = angles.iter().fold(1.0, |m: f64, a| m.min(a.sin()));
            assert!((least_sine(l) - least).abs() < 1e-12 * least, "{l:?}");
        }
        for l in [[1.0, 1.0, 0.0], [1.0, 1.0, 3.0], [0.0; 3], [2.0, 1.0, 1.0]] {
            assert_eq!(least_sine(l), 0.0, "{l:?}");
        }
    }

    #[test]
    fn gaps_of_angles_agree_with_their_difference() {
        let mut angles: Vec<f64> = (0..50).map(|i| f64::from(i) * PI / 100.0).collect();
        angles.extend([PI / 2.0, 1e-9, 0.3 + 1e-7]);
        for a in &angles {
            for b in &angles {
                let gap = half_angle_gap(a.tan(), b.tan());
                assert!((gap - (a - b).abs()).abs() < 1e-15, "{a} {b}: {gap}");
            }
        }
        assert_eq!(half_angle_gap(f64::INFINITY, f64::INFINITY), 0.0);
        assert_eq!(half_angle_gap(f64::INFINITY, 0.0), PI / 2.0);
    }

    #[test]
    fn motions_compose_and_invert() {
        let a = Motion::new(2.5, [1.0, -3.0]);
        let b = Motion::new(-1.25, [0.5, 0.25]);
        let p = [0.75, -2.0];
        assert!(distance2(a.after(&b).apply(p), a.apply(b.apply(p))) < 1e-14);
        assert!(distance2(a.inverse_apply(a.apply(p)), p) < 1e-14);
        assert!(distance2(a.inverse().apply(p), a.inverse_apply(p)) < 1e-14);
    }

    #[test]
    fn worst_never_forgets_a_nan() {
        let mut worst = Worst::default();
        worst.see(f64::NAN);
        worst.see(1.0);
        assert_eq!(worst.0, f64::INFINITY);
    }

    #[test]
    fn multiples_of_a_turn_are_no_distance_away() {
        assert!(off_turn(-4.0 * PI) < 1e-14);
        assert!((off_turn(-8.0 * PI + 0.25) - 0.25).abs() < 1e-13);
        assert!(off_multiple(-PI, PI / 2.0) < 1e-15);
    }

    #[test]
    fn orientation_forgives_rounding_only() {
        let good = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
        assert!(is_positive(good, 1.0));
        assert!(!is_positive([good[0], good[2], good[1]], 1.0));
        assert!(is_positive([[0.0, 0.0], [1.0, 0.0], [0.5, -1e-15]], 1.0));
        assert!(!is_positive([[0.0, 0.0], [1.0, 0.0], [0.5, -1e-9]], 1.0));
        assert!(!is_positive([[0.5, 0.25]; 3], 1.0));
    }
}
