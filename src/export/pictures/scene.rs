//! Marks in space: spheres at cones and tubes along the cut, as triangles like everything else.

use super::colour::{CUT, Linear, NEGATIVE, POSITIVE, to_linear};
use super::light::across;
use super::view::{Vec3, along, unit};
use crate::geometry::mesh::sub;

/// Triangles with smooth normals, one colour each.
#[derive(Clone, Debug, Default)]
pub struct Marks {
    /// Vertices.
    pub positions: Vec<Vec3>,
    /// Unit normals of the vertices.
    pub normals: Vec<Vec3>,
    /// Triangles.
    pub faces: Vec<[u32; 3]>,
    /// Colour of each triangle.
    pub colours: Vec<Linear>,
}

impl Marks {
    /// Rows of a ring of `n` vertices each, joined by triangles.
    fn rings(&mut self, rings: &[(Vec3, f64, f64, f64)], axis: Vec3, n: usize, colour: Linear) {
        let (u, v) = across(axis);
        let base = self.positions.len() as u32;
        for &(centre, radius, outward, forward) in rings {
            for k in 0..n {
                let (s, c) = (std::f64::consts::TAU * k as f64 / n as f64).sin_cos();
                let spoke: Vec3 = std::array::from_fn(|i| c * u[i] + s * v[i]);
                self.positions.push(along(centre, radius, spoke));
                let normal = std::array::from_fn(|i| outward * spoke[i] + forward * axis[i]);
                self.normals.push(normal);
            }
        }
        let n = n as u32;
        for ring in 1..rings.len() as u32 {
            for k in 0..n {
                let at = |ring: u32, k: u32| base + ring * n + k % n;
                let [a, b, c, d] = [
                    at(ring - 1, k),
                    at(ring - 1, k + 1),
                    at(ring, k + 1),
                    at(ring, k),
                ];
                self.faces.extend([[a, b, c], [a, c, d]]);
                self.colours.extend([colour; 2]);
            }
        }
    }

    /// A ball.
    pub fn sphere(&mut self, centre: Vec3, radius: f64, colour: Linear, fineness: usize) {
        let axis = [0.0, 1.0, 0.0];
        let rings: Vec<_> = (0..=fineness)
            .map(|k| {
                let (s, c) = (std::f64::consts::PI * k as f64 / fineness as f64).sin_cos();
                (along(centre, -radius * c, axis), radius * s, s, -c)
            })
            .collect();
        self.rings(&rings, axis, 2 * fineness, colour);
    }

    /// A round bar, open at its ends.
    pub fn bar(&mut self, from: Vec3, to: Vec3, radius: f64, colour: Linear) {
        let axis = unit(sub(to, from));
        let ring = |centre| (centre, radius, 1.0, 0.0);
        self.rings(&[ring(from), ring(to)], axis, 8, colour);
    }

    /// An edge of the cut: a bar with round ends.
    pub fn cut_edge(&mut self, from: Vec3, to: Vec3, radius: f64) {
        let colour = to_linear(CUT);
        self.bar(from, to, radius, colour);
        self.sphere(from, radius, colour, 3);
        self.sphere(to, radius, colour, 3);
    }

    /// A cone: a ball, red where the curvature is positive and blue where it is negative.
    pub fn cone(&mut self, place: Vec3, curvature: f64, radius: f64) {
        let colour = if curvature > 0.0 { POSITIVE } else { NEGATIVE };
        self.sphere(place, radius, to_linear(colour), 14);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::mesh::{cross, distance, dot, norm, triangle_area};

    #[test]
    fn a_ball_has_its_radius_normals_and_area() {
        let mut marks = Marks::default();
        let centre = [1.0, -2.0, 0.5];
        marks.sphere(centre, 0.3, [0.5; 3], 16);
        for (p, n) in marks.positions.iter().zip(&marks.normals) {
            assert!((distance(*p, centre) - 0.3).abs() < 1e-12);
            assert!(distance(along(centre, 0.3, *n), *p) < 1e-12);
        }
        let corners = |f: &[u32; 3]| f.map(|v| marks.positions[v as usize]);
        let area: f64 = marks.faces.iter().map(|f| triangle_area(corners(f))).sum();
        let exact = 4.0 * std::f64::consts::PI * 0.09;
        assert!((area / exact - 1.0).abs() < 0.02);
        for f in &marks.faces {
            let [a, b, c] = corners(f);
            let n = cross(sub(b, a), sub(c, a));
            assert!(norm(n) < 1e-9 || dot(n, sub(a, centre)) > 0.0);
        }
        assert_eq!(marks.faces.len(), marks.colours.len());
    }
}
