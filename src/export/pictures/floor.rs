//! The floor below the surface, which takes its shadow.

use super::light::Shade;
use super::view::{Vec3, along, finite_box};
use crate::geometry::mesh::distance;

/// Points of the floor along each side, for its shadow.
const POINTS: usize = 97;
/// Full light.
const LIT: Shade = Shade {
    sky: 1.0,
    lamp: 1.0,
};

/// The shadow on a plane below the surface.
pub struct Floor {
    low: [f64; 2],
    step: f64,
    height: f64,
    /// Light on its points, row by row; without it there is no shadow.
    pub shade: Vec<Shade>,
}

impl Floor {
    /// Below the lowest point, without light yet.
    pub fn new(positions: &[Vec3]) -> Floor {
        let (low, high) = finite_box(positions);
        let reach = 1.4 * distance(low, high).max(f64::MIN_POSITIVE);
        Floor {
            low: [
                0.5 * (low[0] + high[0]) - reach,
                0.5 * (low[2] + high[2]) - reach,
            ],
            step: 2.0 * reach / (POINTS - 1) as f64,
            height: low[1] - 0.004 * reach,
            shade: Vec::new(),
        }
    }

    /// Its points with their normals, row by row.
    pub fn points(&self) -> impl Iterator<Item = (Vec3, Vec3)> + '_ {
        (0..POINTS * POINTS).map(|k| {
            let x = self.low[0] + self.step * (k % POINTS) as f64;
            let z = self.low[1] + self.step * (k / POINTS) as f64;
            ([x, self.height, z], [0.0, 1.0, 0.0])
        })
    }

    /// How dark the floor is along a line of sight: 0 in full light and beyond the floor.
    pub fn shadow(&self, eye: Vec3, sight: Vec3) -> f32 {
        let t = (self.height - eye[1]) / sight[1];
        if !(t > 0.0 && t.is_finite()) {
            return 0.0;
        }
        let hit = along(eye, t, sight);
        let x = (hit[0] - self.low[0]) / self.step;
        let y = (hit[2] - self.low[1]) / self.step;
        let end = (POINTS - 1) as f64;
        if !(x >= 0.0 && y >= 0.0 && x < end && y < end) {
            return 0.0;
        }
        let (column, row) = (x as usize, y as usize);
        let (fx, fy) = ((x - column as f64) as f32, (y - row as f64) as f32);
        let dark = |c: usize, r: usize| {
            let s = self.shade.get(r * POINTS + c).copied().unwrap_or(LIT);
            0.6 * (1.0 - s.sky) + 0.4 * (1.0 - s.lamp)
        };
        let above = dark(column, row) * (1.0 - fx) + dark(column + 1, row) * fx;
        let below = dark(column, row + 1) * (1.0 - fx) + dark(column + 1, row + 1) * fx;
        // Fades towards the floor's border, which would show otherwise.
        let off = ((x - 0.5 * end).hypot(y - 0.5 * end) / (0.5 * end)).min(1.0) as f32;
        (above * (1.0 - fy) + below * fy) * (1.0 - off * off)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shadow_lies_where_the_floor_is_dark() {
        let mut floor = Floor::new(&[[-1.0, 0.0, -1.0], [1.0, 2.0, 1.0]]);
        let eye = [0.0, 5.0, 0.0];
        let down = [0.0, -1.0, 0.0];
        assert_eq!(floor.shadow(eye, down), 0.0);
        let near = |p: Vec3| if p[0].hypot(p[2]) < 1.0 { 0.0 } else { 1.0 };
        floor.shade = (floor.points())
            .map(|(p, _)| Shade {
                sky: near(p),
                lamp: near(p),
            })
            .collect();
        assert!(floor.shadow(eye, down) > 0.9);
        assert_eq!(floor.shadow(eye, [0.5, -1.0, 0.0]), 0.0);
        assert_eq!(floor.shadow(eye, [0.0, 1.0, 0.0]), 0.0);
        assert_eq!(floor.shadow(eye, [1e9, -1.0, f64::NAN]), 0.0);
    }
}
