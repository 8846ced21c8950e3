//! Which texel centres a triangle covers.
//!
//! Every side is inclusive and the predicate is exact, so triangles that share corners leave no texel
//! between them uncovered, whatever the rounding of their coordinates.

use robust::{Coord, orient2d};

/// Calls `visit(column, row, weights)` for every texel whose centre (index + ½) lies in the closed
/// triangle, row by row; the weights are barycentric and sum to 1. Triangles of either orientation
/// are accepted, those without area cover nothing.
pub(crate) fn cover(
    triangle: [[f64; 2]; 3],
    width: usize,
    height: usize,
    mut visit: impl FnMut(usize, usize, [f64; 3]),
) {
    let [a, b, c] = triangle.map(|p| Coord { x: p[0], y: p[1] });
    let doubled = orient2d(a, b, c);
    if doubled == 0.0 || width == 0 || height == 0 {
        return;
    }
    let sign = doubled.signum();
    // Casts saturate, and what lies between the bounds is decided by the predicate.
    let range = |low: f64, high: f64, count: usize| {
        let first = (low - 0.5).ceil().max(0.0) as usize;
        let last = ((high - 0.5).floor().max(-1.0) + 1.0) as usize;
        first..last.min(count)
    };
    let [low, high] = [f64::min, f64::max]
        .map(|f| [0, 1].map(|i| f(f(triangle[0][i], triangle[1][i]), triangle[2][i])));
    // Far more than rounding moves where a row meets a side, far less than a texel.
    let slack = 1e-6 + 1e-12 * (low[0].abs() + high[0].abs());
    for row in range(low[1], high[1], height) {
        let y = row as f64 + 0.5;
        let mut span = [f64::INFINITY, f64::NEG_INFINITY];
        for (p, q) in [(a, b), (b, c), (c, a)] {
            if y < p.y.min(q.y) || y > p.y.max(q.y) {
                continue;
            }
            // A side along the row meets it at both ends.
            let along = (y - p.y) / (q.y - p.y);
            let ends = if p.y == q.y {
                [p.x, q.x]
            } else {
                [p.x + along * (q.x - p.x); 2]
            };
            for x in ends {
                span = [span[0].min(x), span[1].max(x)];
            }
        }
        for column in range(span[0] - slack, span[1] + slack, width) {
            let p = Coord {
                x: column as f64 + 0.5,
                y,
            };
            let w = [orient2d(b, c, p), orient2d(c, a, p), orient2d(a, b, p)].map(|w| sign * w);
            let sum = w[0] + w[1] + w[2];
            if w.iter().all(|&w| w >= 0.0) && sum > 0.0 {
                visit(column, row, w.map(|w| w / sum));
            }
        }
    }
}

/// (column, row) in texels of a point of the patch: the inverse of `texel_to_patch`.
pub(crate) fn to_texel(texel_to_patch: &[[f64; 3]; 2], p: [f64; 2]) -> [f64; 2] {
    let [[a, b, c], [d, e, f]] = *texel_to_patch;
    let det = a * e - b * d;
    let (x, y) = (p[0] - c, p[1] - f);
    [(e * x - b * y) / det, (a * y - d * x) / det]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fan_covers_every_texel_of_its_square_and_weights_reproduce_the_centre() {
        // The centre lies on a texel centre, so edges run exactly through many of them.
        let corners = [[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0]];
        let middle = [4.5, 4.5];
        let mut count = vec![0; 81];
        for k in 0..4 {
            let t = [middle, corners[k], corners[(k + 1) % 4]];
            cover(t, 9, 9, |x, y, w| {
                count[9 * y + x] += 1;
                for i in 0..2 {
                    let p: f64 = (0..3).map(|k| w[k] * t[k][i]).sum();
                    assert!((p - [x, y][i] as f64 - 0.5).abs() < 1e-14);
                }
            });
        }
        assert!(count.iter().all(|&n| n > 0));
        assert_eq!(count[9 * 4 + 4], 4, "the centre belongs to all four");
        assert_eq!(count[9 * 4 + 1], 1, "others to one");
    }

    #[test]
    fn nothing_is_covered_outside_the_image() {
        let mut seen = Vec::new();
        let t = [[-100.0, -100.0], [200.0, -100.0], [-100.0, 200.0]];
        cover(t, 3, 2, |x, y, _| seen.push((x, y)));
        assert_eq!(seen, [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1)]);
        cover([[5.0, 5.0], [6.0, 5.0], [6.0, 6.0]], 3, 2, |_, _, _| {
            panic!("outside")
        });
        cover([[-9.0, 0.0], [-6.0, 0.0], [-6.0, 3.0]], 3, 2, |_, _, _| {
            panic!("outside")
        });
    }

    #[test]
    fn texels_and_patch_coordinates_are_inverse() {
        let m = [[0.25, 0.0, -0.5], [0.0, -0.125, 3.0]];
        let [x, y] = to_texel(&m, [1.0, 2.0]);
        assert!((m[0][0] * x + m[0][2] - 1.0).abs() < 1e-15);
        assert!((m[1][1] * y + m[1][2] - 2.0).abs() < 1e-15);
    }
}
