//! One face of the final triangulation, laid out by its lengths: distances between points on its sides.
//!
//! *Guaranteed:* full relative accuracy for any shape and any scale, since only differences along a side are ever taken: with a, b
//! the distances of two points from the corner between their sides, d² = (a − b)² + 4 sin²(θ/2) ab. Points near either end of a side keep their
//! digits, since both fractions are given, of which the smaller one is exact; and a − b is taken with what rounding has left off of a and b.

use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, FaceId};

/// A point on a side: which side, and the fractions of its length before and behind the point, from the corner where it begins.
pub(super) type OnSide = (usize, Fractions);

/// Parts of a side before a point and behind it; together 1, up to rounding.
pub(super) type Fractions = [f64; 2];

/// Lengths and corners of a flat face.
pub(super) struct FlatFace {
    /// Length of side k, from corner k to corner k + 1.
    side: [f64; 3],
    /// 4 sin²(θ/2) at corner k.
    opening: [f64; 3],
}

impl FlatFace {
    pub fn new(flat: &Connectivity, length: &EdgeVec<f64>, f: FaceId) -> Self {
        Self::from_sides(flat.face_halfedges(f).map(|h| length[flat.edge(h)]))
    }

    fn from_sides(side: [f64; 3]) -> Self {
        let opening = [0, 1, 2].map(|k| {
            let (a, b, opposite) = (side[k], side[(k + 2) % 3], side[(k + 1) % 3]);
            let (low, high) = (opposite - (a - b), opposite + (a - b));
            (low / a * (high / b)).max(0.0)
        });
        Self { side, opening }
    }

    /// Distance of two points; the same for either order.
    pub fn distance(&self, p: OnSide, q: OnSide) -> f64 {
        if p.0 == q.0 {
            // From the end that both are near to, if there is one.
            let end = usize::from(p.1[0].min(q.1[0]) > 0.5);
            let [from, to] = [p, q].map(|x| (x.1[end], rest(x.1[end], x.1[1 - end])));
            return ((to.0 - from.0) + (to.1 - from.1)).abs() * self.side[p.0];
        }
        // Let q be on the side after p's, so that they meet at the corner where q's side begins.
        let (p, q) = if q.0 == (p.0 + 1) % 3 { (p, q) } else { (q, p) };
        let (a, a_rest) = part([p.1[1], p.1[0]], self.side[p.0]);
        let (b, b_rest) = part(q.1, self.side[q.0]);
        // In a needle both are long and their difference is not.
        let apart = (a - b) + (a_rest - b_rest);
        apart.hypot((self.opening[q.0] * a).sqrt() * b.sqrt())
    }
}

/// What rounding has taken from a fraction; `other` is the rest of the side. The smaller one of both is exact.
fn rest(own: f64, other: f64) -> f64 {
    match own > 0.5 {
        true => (1.0 - own) - other,
        false => 0.0,
    }
}

/// A part of a side, and what rounding has taken from it.
fn part([own, other]: Fractions, side: f64) -> (f64, f64) {
    let length = own * side;
    (length, own.mul_add(side, -length) + rest(own, other) * side)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_agree_with_coordinates() {
        // Corners (0, 0), (4, 0), (1, 3).
        let corners = [[0.0, 0.0], [4.0, 0.0], [1.0, 3.0_f64]];
        let between = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]);
        let sides = [0, 1, 2].map(|k| between(corners[k], corners[(k + 1) % 3]));
        let face = FlatFace::from_sides(sides);
        let at = |(k, [s, _]): OnSide| -> [f64; 2] {
            let (p, q) = (corners[k], corners[(k + 1) % 3]);
            std::array::from_fn(|i| p[i] + s * (q[i] - p[i]))
        };
        let points: Vec<OnSide> = (0..12)
            .map(|i| (i % 3, (i / 3) as f64 * 0.3))
            .map(|(k, s)| (k, [s, 1.0 - s]))
            .collect();
        for &p in &points {
            for &q in &points {
                let d = face.distance(p, q);
                assert!((d - between(at(p), at(q))).abs() < 1e-14, "{p:?} {q:?}");
                assert_eq!(d.to_bits(), face.distance(q, p).to_bits());
            }
        }
    }

    /// Across a needle, far from its tip, distances are small differences of long ones.
    #[test]
    fn needles_have_all_digits_too() {
        let width = 2.0_f64.powi(-30);
        let face = FlatFace::from_sides([1.0, width, 1.0]);
        // A third of the way to the tip, which is corner 0, and a little farther on the other side.
        let s = 1.0 / 3.0;
        for step in [1e-9, 1e-12, 1e-15] {
            let t = s + step;
            // What t really is.
            let step = t - s;
            let found = face.distance((0, [s, 1.0 - s]), (2, [1.0 - t, t]));
            let expected = step.hypot(width * (s * t).sqrt());
            assert!((found / expected - 1.0).abs() < 1e-15, "{found} {expected}");
        }
    }

    /// Seen from either side of an edge, what is near one of its ends has the same shape to all digits.
    #[test]
    fn near_corners_no_digits_are_lost() {
        let face = FlatFace::from_sides([1.0, 1.0, 1.0]);
        for far in [1e-4, 1e-8, 1e-12] {
            let (near, next) = ([1.0 - far, far], [1.0 - 3.0 * far, 3.0 * far]);
            // An equilateral corner: as far from each other as from the corner.
            let across = face.distance((0, near), (1, [far, 1.0 - far]));
            assert!((across / far - 1.0).abs() < 1e-14, "{far}: {across}");
            let along = face.distance((0, near), (0, next));
            assert!((along / far - 2.0).abs() < 1e-14, "{far}: {along}");
        }
    }
}
