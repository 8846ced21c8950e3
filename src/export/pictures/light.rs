//! Soft light, baked: how much of the sky and of a broad lamp does each point see?
//!
//! The surface is drawn into a small depth map from each of many directions; a point sees the light from
//! there if nothing in the map is nearer. The mean over the directions is the shade.

use super::raster::{Band, NOTHING};
use super::view::{Vec3, along, finite_box, unit};
use crate::geometry::mesh::{cross, distance, dot};
use rayon::prelude::*;

/// Shares of the light that reach a point, 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shade {
    /// Of the light from all around.
    pub sky: f32,
    /// Of the lamp.
    pub lamp: f32,
}

/// Rows and columns of a depth map.
const MAP: usize = 256;
/// Directions of the sky.
const SKY: usize = 64;
/// Directions of the lamp.
const LAMP: usize = 12;

/// Depth maps of a surface from everywhere that light comes from, 40 MB whatever its size.
pub struct Lights {
    /// With its direction, and whether that is the lamp's.
    maps: Vec<(DepthMap, Vec3, bool)>,
    up: Vec3,
}

impl Lights {
    /// Looks at the faces from every direction. `lamp` and `up` are unit vectors.
    pub fn new(positions: &[Vec3], faces: &[[u32; 3]], lamp: Vec3, up: Vec3) -> Lights {
        let (low, high) = finite_box(positions);
        let centre: Vec3 = std::array::from_fn(|i| 0.5 * (low[i] + high[i]));
        let radius = (0.5 * distance(low, high)).max(f64::MIN_POSITIVE);
        let map = |direction: Vec3| DepthMap::new(direction, centre, radius, positions, faces);
        let all: Vec<(Vec3, bool)> = (sphere(SKY).into_iter().map(|d| (d, false)))
            .chain(cone(lamp, LAMP).into_iter().map(|d| (d, true)))
            .collect();
        let maps = all.into_par_iter().map(|(d, is_lamp)| (map(d), d, is_lamp));
        Lights {
            maps: maps.collect(),
            up,
        }
    }

    /// Shade of points with unit normals among the faces.
    pub fn shade(&self, points: &[(Vec3, Vec3)]) -> Vec<Shade> {
        let shade = |&(p, n): &(Vec3, Vec3)| {
            let [mut lit, mut whole, mut lamp] = [0.0_f32; 3];
            for (map, direction, is_lamp) in &self.maps {
                let facing = dot(n, *direction) as f32;
                if *is_lamp {
                    lamp += map.visible(p, n);
                } else if facing > 0.0 {
                    // Light from above counts more than light from the ground.
                    let weight = facing * (0.6 + 0.4 * dot(self.up, *direction) as f32);
                    lit += weight * map.visible(p, n);
                    whole += weight;
                }
            }
            Shade {
                sky: if whole > 0.0 { lit / whole } else { 1.0 },
                lamp: lamp / LAMP as f32,
            }
        };
        points.par_iter().map(shade).collect()
    }
}

/// Directions spread evenly over the sphere (a Fibonacci lattice).
fn sphere(count: usize) -> Vec<Vec3> {
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let direction = |k: usize| {
        let y = 1.0 - (2 * k + 1) as f64 / count as f64;
        let (s, c) = (golden * k as f64).sin_cos();
        let r = (1.0 - y * y).sqrt();
        [r * c, y, r * s]
    };
    (0..count).map(direction).collect()
}

/// Directions spread over a broad lamp.
fn cone(axis: Vec3, count: usize) -> Vec<Vec3> {
    const SPREAD: f64 = 0.26;
    let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let (u, v) = across(axis);
    let direction = |k: usize| {
        let r = SPREAD * ((k as f64 + 0.5) / count as f64).sqrt();
        let (s, c) = (golden * k as f64).sin_cos();
        unit(along(along(axis, r * c, u), r * s, v))
    };
    (0..count).map(direction).collect()
}

/// Two unit vectors orthogonal to a unit vector and to each other.
pub fn across(axis: Vec3) -> (Vec3, Vec3) {
    let least = (0..3).fold(0, |b, i| if axis[i].abs() < axis[b].abs() { i } else { b });
    let mut helper = [0.0; 3];
    helper[least] = 1.0;
    let u = unit(cross(helper, axis));
    (u, cross(axis, u))
}

/// The surface as a far lamp sees it.
struct DepthMap {
    band: Band,
    centre: Vec3,
    right: Vec3,
    up: Vec3,
    direction: Vec3,
    scale: f64,
}

impl DepthMap {
    fn new(
        direction: Vec3,
        centre: Vec3,
        radius: f64,
        positions: &[Vec3],
        faces: &[[u32; 3]],
    ) -> DepthMap {
        let (right, up) = across(direction);
        let mut map = DepthMap {
            band: Band::new(MAP, 0, MAP),
            centre,
            right,
            up,
            direction,
            scale: 0.49 * MAP as f64 / radius,
        };
        let screen: Vec<[f64; 3]> = positions.iter().map(|&p| map.place(p)).collect();
        for (f, face) in faces.iter().enumerate() {
            map.band.draw(&face.map(|v| screen[v as usize]), f as u32);
        }
        map
    }

    /// Column, row and closeness, all in texels.
    fn place(&self, p: Vec3) -> [f64; 3] {
        let d: Vec3 = std::array::from_fn(|i| self.scale * (p[i] - self.centre[i]));
        let middle = 0.5 * MAP as f64;
        [
            middle + dot(d, self.right),
            middle + dot(d, self.up),
            dot(d, self.direction),
        ]
    }

    /// Share of the four texels around a point that let its light through.
    fn visible(&self, p: Vec3, n: Vec3) -> f32 {
        // Off the surface by more than a texel, or every point would shade itself.
        let [x, y, near] = self.place(along(p, 1.6 / self.scale, n));
        // Rounded down by casts: the library's function is a call on older processors.
        let floor = |x: f64| (x as i64 - i64::from((x as i64 as f64) > x)) as f64;
        let (column, row) = (floor(x - 0.5), floor(y - 0.5));
        let (fx, fy) = ((x - 0.5 - column) as f32, (y - 0.5 - row) as f32);
        let mut sum = 0.0;
        for (dx, wx) in [(0.0, 1.0 - fx), (1.0, fx)] {
            for (dy, wy) in [(0.0, 1.0 - fy), (1.0, fy)] {
                let (c, r) = (column + dx, row + dy);
                let inside = c >= 0.0 && r >= 0.0 && c < MAP as f64 && r < MAP as f64;
                let hidden = inside && {
                    let (c, r) = (c as usize, r as usize);
                    self.band.object(c, r) != NOTHING
                        && f64::from(self.band.closeness(c, r)) > near + 1.2
                };
                if !hidden {
                    sum += wx * wy;
                }
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A horizontal plate with a smaller roof above its middle.
    #[test]
    fn a_roof_takes_the_light_from_above() {
        let plate = |half: f64, y: f64| {
            [
                [-half, y, -half],
                [-half, y, half],
                [half, y, half],
                [half, y, -half],
            ]
        };
        let positions: Vec<Vec3> = [plate(4.0, 0.0), plate(1.0, 0.5)].concat();
        let faces = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
        let up = [0.0, 1.0, 0.0];
        let points = [
            ([0.0, 0.0, 0.0], up),
            ([3.5, 0.0, 3.5], up),
            ([0.0, 0.5, 0.0], up),
            ([0.0, 0.0, 0.0], [0.0, -1.0, 0.0]),
        ];
        let shades = Lights::new(&positions, &faces, up, up).shade(&points);
        assert!(
            shades[0].sky < 0.4 && shades[0].lamp < 0.05,
            "{:?}",
            shades[0]
        );
        assert!(
            shades[1].sky > 0.9 && shades[1].lamp > 0.95,
            "{:?}",
            shades[1]
        );
        assert!(
            shades[2].sky > 0.99 && shades[2].lamp > 0.99,
            "{:?}",
            shades[2]
        );
        assert!(
            shades[3].sky > 0.9 && shades[3].lamp < 0.05,
            "{:?}",
            shades[3]
        );
    }
}
