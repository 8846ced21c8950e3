//! The symmetric Dirichlet energy of one face, area (‖J‖² + ‖J⁻¹‖²), where J takes the surface, lengths in cells, to the grid.
//!
//! Its Hessian is made positive semidefinite by its eigenvalues, known in closed form (Smith, de Goes, Kim 2019).

use super::system::Derivatives;
use super::triangle::double_area;

/// Faces whose height in space is less than this part of their longest side are slivers, where edges of two triangulations nearly meet. They say nothing about the shape of the surface:
/// the energy is to keep them as they are at first.
const SLIVER: f64 = 1e-4;

/// A face in space, laid into a plane.
#[derive(Clone, Copy)]
pub(super) struct Rest {
    /// Area, cells.
    pub area: f64,
    /// Takes edges (p₁ − p₀, p₂ − p₀) on the grid to J: J = D · inverse.
    inverse: [[f64; 2]; 2],
}

impl Rest {
    /// `p` in space, `unit` long where it is 1 here; a sliver is as on the grid.
    pub fn new(p: [[f64; 3]; 3], unit: f64, on_grid: [[f64; 2]; 3]) -> Self {
        let rest = Self::of(p.map(|x| x.map(|x| x / unit)));
        rest.unwrap_or_else(|| {
            let flat = Self::of(on_grid.map(|[x, y]| [x, y, 0.0]));
            flat.unwrap_or_else(|| Self::plane(on_grid))
        })
    }

    /// Of a triangle that is no sliver.
    fn of(p: [[f64; 3]; 3]) -> Option<Self> {
        let sub = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| a[i] - b[i]) };
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let (e, f, g) = (sub(p[1], p[0]), sub(p[2], p[0]), sub(p[2], p[1]));
        let longest = dot(e, e).max(dot(f, f)).max(dot(g, g));
        let cross: [f64; 3] = std::array::from_fn(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            e[j] * f[k] - e[k] * f[j]
        });
        let doubled = dot(cross, cross).sqrt();
        // The first side on the first axis.
        let l = dot(e, e).sqrt();
        let (x, height) = (dot(e, f) / l, doubled / l);
        (doubled >= SLIVER * longest && longest > 0.0)
            .then(|| Self::plane([[0.0; 2], [l, 0.0], [x, height]]))
    }

    /// Of a triangle in the plane.
    fn plane([p, q, r]: [[f64; 2]; 3]) -> Self {
        let ([a, b], [c, d]) = ([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]);
        let determinant = a * d - b * c;
        Self {
            area: 0.5 * determinant,
            inverse: [
                [d / determinant, -c / determinant],
                [-b / determinant, a / determinant],
            ],
        }
    }

    /// The row w of which J gains δ wᵀ where a corner moves by δ.
    pub fn weights(&self, corner: usize) -> [f64; 2] {
        let [q, r] = self.inverse;
        [[-q[0] - r[0], -q[1] - r[1]], q, r][corner]
    }

    /// J for corners on the grid: rows.
    pub fn jacobian(&self, [p, q, r]: [[f64; 2]; 3]) -> [[f64; 2]; 2] {
        let d = [[q[0] - p[0], r[0] - p[0]], [q[1] - p[1], r[1] - p[1]]];
        let b = self.inverse;
        std::array::from_fn(|i| std::array::from_fn(|j| d[i][0] * b[0][j] + d[i][1] * b[1][j]))
    }

    pub fn energy(&self, corners: [[f64; 2]; 3]) -> f64 {
        let j = self.jacobian(corners);
        let determinant = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        let squared: f64 = j.iter().flatten().map(|x| x * x).sum();
        match determinant > 0.0 && double_area(corners) > 0.0 {
            true => self.area * squared * (1.0 + 1.0 / (determinant * determinant)),
            false => f64::INFINITY,
        }
    }

    /// Gradient and positive semidefinite Hessian by the six coordinates of the corners.
    pub fn derivatives(&self, corners: [[f64; 2]; 3]) -> Derivatives {
        let j = self.jacobian(corners);
        // J = U Σ Vᵀ with rotations U and V by angles α and β: singular values and both α − β and α + β by half sums and differences.
        let (e, f) = (0.5 * (j[0][0] + j[1][1]), 0.5 * (j[0][0] - j[1][1]));
        let (g, h) = (0.5 * (j[1][0] + j[0][1]), 0.5 * (j[1][0] - j[0][1]));
        let (q, r) = ((e * e + h * h).sqrt(), (f * f + g * g).sqrt());
        let determinant = j[0][0] * j[1][1] - j[0][1] * j[1][0];
        let s1 = q + r;
        let s2 = determinant / s1;
        let [c, s] = [e / q, h / q];
        let [x, y] = match r > 0.0 {
            true => [f / r, g / r],
            false => [1.0, 0.0],
        };
        // U M Vᵀ for M = a 1 + b Z + c S + d X, where Z mirrors the second axis, S turns by a right angle and X swaps both axes: 1 and S are turned by α − β, Z and X by α + β.
        let rotated = |[one, mirror, turn, swap]: [f64; 4]| -> [[f64; 2]; 2] {
            [
                [
                    one * c - turn * s + mirror * x - swap * y,
                    -one * s - turn * c + mirror * y + swap * x,
                ],
                [
                    one * s + turn * c + mirror * y + swap * x,
                    one * c - turn * s - mirror * x + swap * y,
                ],
            ]
        };
        // By coordinates of the corners: M : dJ with J = D B.
        let b = self.inverse;
        let by_corners = |m: [[f64; 2]; 2]| -> [f64; 6] {
            let at = |i: usize, k: usize| m[i][0] * b[k][0] + m[i][1] * b[k][1];
            let (q, r) = ([at(0, 0), at(1, 0)], [at(0, 1), at(1, 1)]);
            [-q[0] - r[0], -q[1] - r[1], q[0], q[1], r[0], r[1]]
        };
        let slope = |s: f64| 2.0 * s - 2.0 / (s * s * s);
        let (p1, p2) = (slope(s1), slope(s2));
        let gradient = by_corners(rotated([0.5 * (p1 + p2), 0.5 * (p1 - p2), 0.0, 0.0]))
            .map(|x| self.area * x);
        let cubes = (s1 * s2).powi(3);
        let half = 0.5f64.sqrt();
        let modes = [
            (2.0 + 6.0 / s1.powi(4), [0.5, 0.5, 0.0, 0.0]),
            (2.0 + 6.0 / s2.powi(4), [0.5, -0.5, 0.0, 0.0]),
            (
                2.0 - 2.0 * (s1 * s1 - s1 * s2 + s2 * s2) / cubes,
                [0.0, 0.0, half, 0.0],
            ),
            (
                2.0 + 2.0 * (s1 * s1 + s1 * s2 + s2 * s2) / cubes,
                [0.0, 0.0, 0.0, half],
            ),
        ];
        let mut hessian = [[0.0; 6]; 6];
        for (value, mode) in modes {
            if value <= 0.0 {
                continue;
            }
            let g = by_corners(rotated(mode));
            for i in 0..6 {
                for k in 0..6 {
                    hessian[i][k] += self.area * value * g[i] * g[k];
                }
            }
        }
        (gradient, hessian)
    }
}

/// The least positive t at which the triangle p + t d has no area.
pub(super) fn first_root(p: [[f64; 2]; 3], d: [[f64; 2]; 3]) -> f64 {
    let edge = |x: [[f64; 2]; 3], k: usize| [x[k][0] - x[0][0], x[k][1] - x[0][1]];
    let cross = super::complex::cross;
    let (a, b, u, v) = (edge(p, 1), edge(p, 2), edge(d, 1), edge(d, 2));
    let (zero, one, two) = (cross(a, b), cross(a, v) + cross(u, b), cross(u, v));
    // zero + one t + two t² with zero > 0, from the smaller root without cancellation.
    let discriminant = one * one - 4.0 * two * zero;
    if discriminant < 0.0 {
        return f64::INFINITY;
    }
    let s = discriminant.sqrt();
    let q = -0.5 * (one + if one < 0.0 { -s } else { s });
    let roots = [q / two, zero / q];
    let positive = roots.into_iter().filter(|t| *t > 0.0);
    positive.fold(f64::INFINITY, f64::min)
}

/// Gradient and Hessian by coordinates in frames that so many quarter turns take to the face's.
pub(super) fn turned_back(g: &[f64; 6], h: &[[f64; 6]; 6], turns: [u8; 3]) -> Derivatives {
    // Coordinate a of corner k is sign times coordinate from[a] of the face's frame.
    let source = |i: usize| -> (usize, f64) {
        let (k, a) = (i / 2, i % 2);
        match (turns[k], a) {
            (0, a) => (2 * k + a, 1.0),
            (1, 0) => (2 * k + 1, 1.0),
            (1, _) => (2 * k, -1.0),
            (2, a) => (2 * k + a, -1.0),
            (_, 0) => (2 * k + 1, -1.0),
            _ => (2 * k, 1.0),
        }
    };
    let from: [(usize, f64); 6] = std::array::from_fn(source);
    let gradient = from.map(|(i, s)| s * g[i]);
    let hessian = from.map(|(i, s)| from.map(|(j, t)| s * t * h[i][j]));
    (gradient, hessian)
}

#[cfg(test)]
mod tests {
    use super::super::complex::turned;
    use super::*;

    const FACE: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.2, 0.1], [0.3, 1.1, -0.4]];
    const CORNERS: [[f64; 2]; 3] = [[0.1, 0.2], [1.3, 0.4], [0.2, 0.9]];

    fn moved(mut corners: [[f64; 2]; 3], i: usize, by: f64) -> [[f64; 2]; 3] {
        corners[i / 2][i % 2] += by;
        corners
    }

    #[test]
    fn an_isometry_has_energy_four() {
        let flat = [[0.0; 3], [2.0, 0.0, 0.0], [0.4, 1.0, 0.0]];
        let rest = Rest::new(flat, 2.0, CORNERS);
        let corners = [[3.0, 5.0], [3.0, 6.0], [2.5, 5.2]];
        assert!((rest.energy(corners) / rest.area - 4.0).abs() < 1e-12);
        assert!((rest.area - 0.25).abs() < 1e-12);
    }

    #[test]
    fn derivatives_are_those_of_the_energy() {
        let rest = Rest::new(FACE, 1.6, CORNERS);
        let (gradient, hessian) = rest.derivatives(CORNERS);
        let h = 1e-5;
        for i in 0..6 {
            let [up, down] = [h, -h].map(|h| rest.energy(moved(CORNERS, i, h)));
            assert!((gradient[i] - (up - down) / (2.0 * h)).abs() < 1e-6);
            // This face is stretched, so that nothing is clamped.
            let [up, down] = [h, -h].map(|h| rest.derivatives(moved(CORNERS, i, h)).0);
            for k in 0..6 {
                let slope = (up[k] - down[k]) / (2.0 * h);
                assert!((hessian[i][k] - slope).abs() < 1e-5, "{i} {k}");
            }
        }
    }

    #[test]
    fn turns_of_frames_turn_derivatives() {
        let rest = Rest::new(FACE, 0.8, CORNERS);
        let turns = [1u8, 2, 3];
        let own: [[f64; 2]; 3] = std::array::from_fn(|k| turned(CORNERS[k], 4 - turns[k]));
        let energy =
            |own: [[f64; 2]; 3]| rest.energy(std::array::from_fn(|k| turned(own[k], turns[k])));
        let (g, h) = rest.derivatives(CORNERS);
        let (gradient, _) = turned_back(&g, &h, turns);
        for (i, g) in gradient.into_iter().enumerate() {
            let [up, down] = [1e-6, -1e-6].map(|h| energy(moved(own, i, h)));
            assert!((g - (up - down) / 2e-6).abs() < 1e-6);
        }
    }

    #[test]
    fn roots_are_where_the_area_ends() {
        let d = [[0.0, 0.1], [-0.5, 0.3], [0.4, -0.6]];
        let t = first_root(CORNERS, d);
        let at = |t: f64| {
            double_area(std::array::from_fn(|k| {
                [CORNERS[k][0] + t * d[k][0], CORNERS[k][1] + t * d[k][1]]
            }))
        };
        assert!(t.is_finite() && at(t).abs() < 1e-12 && at(0.5 * t) > 0.0);
        assert_eq!(first_root(CORNERS, [[1.0, 2.0]; 3]), f64::INFINITY);
    }
}
