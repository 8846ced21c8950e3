//! How the surface bends in a patch, measured on an image of it.
//!
//! *Enters:* a grid of samples, with or without a mask. *Leaves:* a [`Bend`]: what the squared error of an image with m × n intervals would be.
//!
//! In a cell of such an image the surface is, up to third order, x + (a s² + 2 c s t + b t²) / 2 above the plane through its corners, where a, b and c are the normal parts
//! of second differences. Two linear triangles that hold the corners are off by a mean square of (a² + b²)/120 + a b/72 + c²/90. With k times
//! as many intervals along a side, a second difference along it is k² times smaller.

use crate::atlas::geometry_image::GeometryImage;
use crate::geometry::mesh::{cross, norm, sub};

/// The squared distance, integrated over the surface, between it and an image with m × n intervals is a/m⁴ + b/n⁴ + c/m²n².
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::atlas) struct Bend {
    /// a and b.
    pub along: [f64; 2],
    /// c, not negative.
    pub twist: f64,
}

impl Bend {
    /// Measured on an image whose patch is as wide and high as so many of its texels. Next to the mask's border there are no second differences: the rest stands for it.
    pub fn of(image: &GeometryImage, [m, n]: [f64; 2]) -> Self {
        let (width, height) = (image.width, image.height);
        let at = |column: usize, row: usize| image.position[width * row + column].map(f64::from);
        let is_inside = |column: usize, row: usize| image.alpha[width * row + column] > 0.0;
        let mut sums = [0.0; 3];
        let (mut inside, mut measured) = (0usize, 0usize);
        for row in 1..height.saturating_sub(1) {
            for column in 1..width.saturating_sub(1) {
                if !is_inside(column, row) {
                    continue;
                }
                inside += 1;
                if !(0..9).all(|i| is_inside(column + i % 3 - 1, row + i / 3 - 1)) {
                    continue;
                }
                measured += 1;
                let p = at(column, row);
                let [west, east] = [at(column - 1, row), at(column + 1, row)];
                let [north, south] = [at(column, row - 1), at(column, row + 1)];
                let normal = cross(sub(east, west), sub(south, north));
                let doubled = norm(normal);
                if doubled <= 0.0 {
                    continue;
                }
                let above = |d: [f64; 3]| (0..3).map(|i| d[i] * normal[i]).sum::<f64>() / doubled;
                let second = |before, after| above(sub(after, p)) + above(sub(before, p));
                let (a, b) = (second(west, east), second(north, south));
                let falling = sub(at(column + 1, row + 1), at(column + 1, row - 1));
                let rising = sub(at(column - 1, row + 1), at(column - 1, row - 1));
                let c = 0.25 * above(sub(falling, rising));
                let cell = 0.25 * doubled;
                sums[0] += cell * a * a / 120.0;
                sums[1] += cell * b * b / 120.0;
                sums[2] += cell * (a * b / 72.0 + c * c / 90.0);
            }
        }
        let whole = inside as f64 / measured.max(1) as f64;
        Self {
            along: [whole * sums[0] * m.powi(4), whole * sums[1] * n.powi(4)],
            twist: (whole * sums[2] * m * m * n * n).max(0.0),
        }
    }

    pub fn is_flat(&self) -> bool {
        self.along == [0.0; 2] && self.twist == 0.0
    }

    /// ∫ of the squared distance.
    pub fn error(&self, [m, n]: [f64; 2]) -> f64 {
        let (m, n) = (m * m, n * n);
        self.along[0] / (m * m) + self.along[1] / (n * n) + self.twist / (m * n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: usize, height: usize, surface: impl Fn(f64, f64) -> f64) -> GeometryImage {
        let position = (0..width * height)
            .map(|i| {
                let u = (i % width) as f64 / (width - 1) as f64;
                let v = (i / width) as f64 / (height - 1) as f64;
                [u, v, surface(u, v)].map(|x| x as f32)
            })
            .collect();
        let count = width * height;
        GeometryImage {
            width,
            height,
            position,
            alpha: vec![1.0; count],
            normal: vec![[0.0, 0.0, 1.0]; count],
            face: vec![0; count],
            log_scale: vec![0.0; count],
            attributes: Vec::new(),
        }
    }

    /// The squared error of two triangles a cell, by brute force.
    fn measured(m: usize, n: usize, surface: impl Fn(f64, f64) -> f64) -> f64 {
        const FINE: usize = 24;
        let mut sum = 0.0;
        for (i, j) in (0..m * n).map(|i| (i % m, i / m)) {
            let corner = |di: usize, dj: usize| {
                surface((i + di) as f64 / m as f64, (j + dj) as f64 / n as f64)
            };
            for k in 0..FINE * FINE {
                let s = ((k % FINE) as f64 + 0.5) / FINE as f64;
                let t = ((k / FINE) as f64 + 0.5) / FINE as f64;
                let linear = if s > t {
                    corner(0, 0) * (1.0 - s) + corner(1, 0) * (s - t) + corner(1, 1) * t
                } else {
                    corner(0, 0) * (1.0 - t) + corner(0, 1) * (t - s) + corner(1, 1) * s
                };
                let exact = surface((i as f64 + s) / m as f64, (j as f64 + t) / n as f64);
                sum += (exact - linear).powi(2);
            }
        }
        sum / (m * n * FINE * FINE) as f64
    }

    #[test]
    fn the_error_of_other_sizes_is_foretold() {
        type Surface = fn(f64, f64) -> f64;
        let surfaces: [(&str, Surface); 3] = [
            ("valley", |u, _| 0.02 * (5.0 * u).sin()),
            ("bowl", |u, v| 0.01 * (u * u + 3.0 * v * v)),
            ("waves", |u, v| 0.003 * (6.0 * u).sin() * (7.0 * v).cos()),
        ];
        for (name, surface) in surfaces {
            let bend = Bend::of(&image(65, 49, surface), [64.0, 48.0]);
            for (m, n) in [(20, 20), (40, 15), (12, 30)] {
                let ratio = bend.error([m as f64, n as f64]) / measured(m, n, surface);
                // The border has no second differences, 8 % of the image; the diagonal of a cell may run either way.
                assert!((0.8..1.25).contains(&ratio), "{name} {m} {n}: {ratio}");
            }
        }
        assert!(Bend::of(&image(9, 9, |_, _| 0.0), [8.0; 2]).error([3.0, 3.0]) < 1e-12);
    }
}
