//! A face as a picture shows it: which point of it, and which normal, lies at a place of the picture.

use super::view::{Vec3, along, is_behind, unit};

/// A point of the surface that a pixel shows.
#[derive(Clone, Copy)]
pub struct Spot {
    /// Its face.
    pub face: usize,
    /// Its barycentric weights.
    pub weights: [f64; 3],
    /// By how much these change to the next pixel to the right, …
    pub right: [f64; 3],
    /// … and to the one below.
    pub down: [f64; 3],
}

/// What pixels of one face share: weights and normal are linear on the screen, up to a common factor.
pub struct Aspect {
    pub face: u32,
    /// Whether its back is seen.
    pub is_behind: bool,
    /// Where `parts` and `normal` begin.
    origin: [f64; 2],
    /// Weight of each corner there, and by how much it grows to the right and downwards.
    parts: [[f64; 3]; 3],
    /// The same of the normal towards the eye.
    normal: [Vec3; 3],
}

impl Aspect {
    /// Of a face with these corners on the screen and unit normals there.
    pub fn new(face: u32, screen: [Vec3; 3], normals: &[Vec3; 3]) -> Aspect {
        let [a, b, c] = screen;
        let origin = [a[0], a[1]];
        // The weight of a corner is 0 along the opposite side; closeness undoes the perspective.
        let slope = |p: Vec3, q: Vec3, near: f64| [near * (p[1] - q[1]), near * (q[0] - p[0])];
        let ([of_a, of_b, of_c], d) = (
            [slope(b, c, a[2]), slope(c, a, b[2]), slope(a, b, c[2])],
            [a[0] - b[0], a[1] - b[1]],
        );
        let parts = [
            [of_a[0] * d[0] + of_a[1] * d[1], of_a[0], of_a[1]],
            [0.0, of_b[0], of_b[1]],
            [0.0, of_c[0], of_c[1]],
        ];
        let is_behind = is_behind(&screen);
        // Weights of clockwise triangles are negative.
        let sign = match is_behind == (parts[0][0] > 0.0) {
            true => -1.0,
            false => 1.0,
        };
        let normal = |i: usize| {
            let of_a = along([0.0; 3], sign * parts[0][i], normals[0]);
            let of_b = along(of_a, sign * parts[1][i], normals[1]);
            along(of_b, sign * parts[2][i], normals[2])
        };
        Aspect {
            face,
            is_behind,
            origin,
            normal: [normal(0), normal(1), normal(2)],
            parts,
        }
    }

    /// The spot at a place of the picture.
    pub fn spot(&self, at: [f64; 2]) -> Spot {
        let (x, y) = (at[0] - self.origin[0], at[1] - self.origin[1]);
        let [a, b, c] = &self.parts;
        let weight = |part: &[f64; 3]| part[0] + part[1] * x + part[2] * y;
        let [u, v, w] = [weight(a), weight(b), weight(c)];
        let sum = u + v + w;
        let (inverse, weights) = match sum != 0.0 && sum.is_finite() {
            true => {
                let inverse = 1.0 / sum;
                (inverse, [u * inverse, v * inverse, w * inverse])
            }
            false => (0.0, [1.0, 0.0, 0.0]),
        };
        let slope = |i: usize| {
            let of_sum = a[i] + b[i] + c[i];
            let of = |part: &[f64; 3], weight: f64| (part[i] - weight * of_sum) * inverse;
            [of(a, weights[0]), of(b, weights[1]), of(c, weights[2])]
        };
        Spot {
            face: self.face as usize,
            weights,
            right: slope(1),
            down: slope(2),
        }
    }

    /// The unit normal towards the eye at a place of the picture.
    pub fn normal(&self, at: [f64; 2]) -> Vec3 {
        let (x, y) = (at[0] - self.origin[0], at[1] - self.origin[1]);
        let [first, right, down] = &self.normal;
        unit(along(along(*first, x, *right), y, *down))
    }
}
