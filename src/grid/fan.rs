//! The energy of the faces around one vertex, as that vertex moves and nothing else.
//!
//! *Enters:* faces with their places, and the vertex. *Leaves:* the sum of area (‖J‖² + ‖J⁻¹‖²) for any move δ of the vertex in its own frame, its gradient and a Hessian at δ = 0, and how far it may go.
//!
//! With one corner moving, J(δ) = J + δ wᵀ: its square N = ‖J‖² is a quadratic of δ and its determinant d is linear, so that with ‖J⁻¹‖² = N / d² all derivatives are those of N (1 + d⁻²). The Hessian is the true one where that is
//! positive definite; else N d⁻⁴ ∇d ∇dᵀ stands in it 8 times in place of 6, which makes it positive: each square x² / d² of N / d² then has the Hessian 2 (∇x / d − 2 x ∇d / d²)².

use super::complex::turned;
use super::dirichlet::Rest;

/// A face around the vertex.
pub(super) struct Around {
    area: f64,
    /// At δ = 0: rows.
    jacobian: [[f64; 2]; 2],
    /// See the module docs.
    w: [f64; 2],
    determinant: f64,
    /// Gradient of the determinant.
    slope: [f64; 2],
}

impl Around {
    /// `corner`: which of the corners moves; its frame comes to that of the face by so many quarter turns.
    pub fn new(rest: &Rest, corners: [[f64; 2]; 3], corner: usize, turns: u8) -> Self {
        let j = rest.jacobian(corners);
        let columns = [0, 1].map(|k| turned([j[0][k], j[1][k]], (4 - turns) & 3));
        let jacobian = [0, 1].map(|i| columns.map(|c| c[i]));
        let w = rest.weights(corner);
        let [[a, b], [c, d]] = jacobian;
        Self {
            area: rest.area,
            jacobian,
            w,
            determinant: a * d - b * c,
            slope: [w[0] * d - w[1] * c, w[1] * a - w[0] * b],
        }
    }

    /// After a move; infinite where the face has no area.
    fn energy(&self, [x, y]: [f64; 2]) -> f64 {
        let ([[a, b], [c, d]], [u, v]) = (self.jacobian, self.w);
        let j = [a + x * u, b + x * v, c + y * u, d + y * v];
        let determinant = self.determinant + x * self.slope[0] + y * self.slope[1];
        let squared: f64 = j.iter().map(|x| x * x).sum();
        match determinant > 0.0 {
            true => self.area * squared * (1.0 + 1.0 / (determinant * determinant)),
            false => f64::INFINITY,
        }
    }

    /// The part of a step after which it has no area.
    fn longest(&self, [x, y]: [f64; 2]) -> f64 {
        let change = x * self.slope[0] + y * self.slope[1];
        match change < 0.0 {
            true => -self.determinant / change,
            false => f64::INFINITY,
        }
    }
}

/// Gradient, Hessian, and what makes that one positive.
type Sums = ([f64; 2], [[f64; 2]; 2], [[f64; 2]; 2]);

/// The energy after a move.
pub(super) fn energy(fan: &[Around], by: [f64; 2]) -> f64 {
    fan.iter().map(|face| face.energy(by)).sum()
}

/// The part of a step after which the first face has no area; infinity where none loses it.
pub(super) fn longest(fan: &[Around], step: [f64; 2]) -> f64 {
    let of_face = fan.iter().map(|face| face.longest(step));
    of_face.fold(f64::INFINITY, f64::min)
}

fn sums(fan: &[Around]) -> Sums {
    let (mut gradient, mut hessian, mut more) = ([0.0; 2], [[0.0; 2]; 2], [[0.0; 2]; 2]);
    for face in fan {
        let (j, w, d, by_d) = (face.jacobian, face.w, face.determinant, face.slope);
        let squared: f64 = j.iter().flatten().map(|x| x * x).sum();
        let by_squared = [0, 1].map(|i| 2.0 * (j[i][0] * w[0] + j[i][1] * w[1]));
        let over = 1.0 / (d * d);
        let stiff = 2.0 * (w[0] * w[0] + w[1] * w[1]) * (1.0 + over);
        for i in 0..2 {
            let own = by_squared[i] * (1.0 + over) - 2.0 * squared * over / d * by_d[i];
            gradient[i] += face.area * own;
            for k in 0..2 {
                let mixed = by_squared[i] * by_d[k] + by_d[i] * by_squared[k];
                let same = squared * over * over * by_d[i] * by_d[k];
                let whole = if i == k { stiff } else { 0.0 };
                hessian[i][k] += face.area * (whole - 2.0 * over / d * mixed + 6.0 * same);
                more[i][k] += face.area * 2.0 * same;
            }
        }
    }
    (gradient, hessian, more)
}

/// The step of Newton's method along the axes that are free, and the slope of the energy along it; `None` where it does not fall.
pub(super) fn newton_step(fan: &[Around], is_free: [bool; 2]) -> Option<([f64; 2], f64)> {
    let (mut g, mut h, more) = sums(fan);
    for a in (0..2).filter(|&a| !is_free[a]) {
        (g[a], h[a], h[1 - a][a]) = (0.0, [0.0; 2], 0.0);
        h[a][a] = 1.0;
    }
    let determinant = |h: &[[f64; 2]; 2]| h[0][0] * h[1][1] - h[0][1] * h[1][0];
    if !(h[0][0] > 0.0 && determinant(&h) > 0.0) {
        for a in 0..2 {
            for b in 0..2 {
                let both = is_free[a] && is_free[b];
                h[a][b] += if both { more[a][b] } else { 0.0 };
            }
        }
    }
    let whole = determinant(&h);
    let step = [
        (h[0][1] * g[1] - h[1][1] * g[0]) / whole,
        (h[1][0] * g[0] - h[0][0] * g[1]) / whole,
    ];
    let slope = step[0] * g[0] + step[1] * g[1];
    (slope < 0.0).then_some((step, slope))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SPACE: [[f64; 3]; 3] = [[0.0, 0.0, 0.0], [1.0, 0.2, 0.1], [0.3, 1.1, -0.4]];
    const CORNERS: [[f64; 2]; 3] = [[0.1, 0.2], [1.3, 0.4], [0.2, 0.9]];

    fn fan() -> Vec<Around> {
        let rest = Rest::new(SPACE, 1.3, CORNERS);
        let turns = [(0, 0), (1, 1), (2, 2), (2, 3)];
        let face = |(corner, turns)| Around::new(&rest, CORNERS, corner, turns);
        turns.map(face).into_iter().collect()
    }

    #[test]
    fn a_corner_moves_as_in_the_energy_of_its_face() {
        let rest = Rest::new(SPACE, 1.3, CORNERS);
        for corner in 0..3 {
            for turns in 0..4u8 {
                let own = Around::new(&rest, CORNERS, corner, turns);
                let by = [0.07, -0.11];
                let [x, y] = turned(by, turns);
                let mut moved = CORNERS;
                moved[corner] = [CORNERS[corner][0] + x, CORNERS[corner][1] + y];
                let (found, expected) = (own.energy(by), rest.energy(moved));
                assert!((found / expected - 1.0).abs() < 1e-13, "{corner} {turns}");
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_the_energy() {
        let fan = fan();
        let (gradient, hessian, _) = sums(&fan);
        let at = |x: f64, y: f64| energy(&fan, [x, y]);
        let h = 1e-4;
        let slope = [at(h, 0.0) - at(-h, 0.0), at(0.0, h) - at(0.0, -h)].map(|x| x / (2.0 * h));
        let bend = [
            (at(h, 0.0) - 2.0 * at(0.0, 0.0) + at(-h, 0.0)) / (h * h),
            (at(0.0, h) - 2.0 * at(0.0, 0.0) + at(0.0, -h)) / (h * h),
            (at(h, h) - at(h, -h) - at(-h, h) + at(-h, -h)) / (4.0 * h * h),
        ];
        for i in 0..2 {
            assert!((gradient[i] - slope[i]).abs() < 1e-5 * gradient[i].abs());
            assert!((hessian[i][i] / bend[i] - 1.0).abs() < 1e-5);
            assert!((hessian[i][1 - i] - bend[2]).abs() < 1e-5 * hessian[0][0]);
        }
    }

    #[test]
    fn with_more_the_hessian_bends_up() {
        let rest = Rest::new(SPACE, 1.0, CORNERS);
        // A squeezed face and one that is stretched out.
        for corners in [
            [[0.0, 0.0], [1.0, 0.0], [0.5, 1e-4]],
            [[0.0, 0.0], [40.0, 1.0], [3.0, 9.0]],
        ] {
            for corner in 0..3 {
                let fan = [Around::new(&rest, corners, corner, 0)];
                let (_, h, more) = sums(&fan);
                let all: [[f64; 2]; 2] = [0, 1].map(|i| [0, 1].map(|k| h[i][k] + more[i][k]));
                let determinant = all[0][0] * all[1][1] - all[0][1] * all[1][0];
                assert!(all[0][0] > 0.0 && determinant > 0.0, "{all:?}");
                assert!(newton_step(&fan, [true; 2]).is_some());
            }
        }
    }

    #[test]
    fn steps_end_where_the_area_does() {
        let fan = fan();
        let step = [-0.4, 0.9];
        let t = longest(&fan, step);
        let at = |t: f64| energy(&fan, step.map(|x| t * x));
        assert!(at(0.999_999 * t).is_finite() && at(1.000_001 * t).is_infinite());
        assert!(newton_step(&fan, [false, true]).is_some_and(|(step, _)| step[0] == 0.0));
    }
}
