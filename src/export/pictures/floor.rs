//! The floor below the surface, which takes its shadow: darker where the surface is nearer.

use super::raster::{Band, NOTHING, SAMPLES};
use super::view::{Vec3, along, finite_box};
use crate::geometry::mesh::distance;

/// Cells of the floor along each side.
const CELLS: usize = 64;
/// Height at which the surface leaves no shadow, in diagonals.
const HIGH: f64 = 0.45;
/// Cells over which the shadow is blurred, to either side, twice.
const BLUR: usize = 3;

/// The shadow on a plane below the surface.
pub struct Floor {
    low: [f64; 2],
    step: f64,
    height: f64,
    /// 0 in full light to 1, cell by cell.
    dark: Vec<f32>,
}

impl Floor {
    /// Below the lowest point.
    pub fn new(positions: &[Vec3], faces: &[[u32; 3]]) -> Floor {
        let (low, high) = finite_box(positions);
        let diagonal = distance(low, high).max(f64::MIN_POSITIVE);
        let mut floor = Floor {
            low: [0, 2].map(|i| 0.5 * (low[i] + high[i]) - 0.8 * diagonal),
            step: 1.6 * diagonal / CELLS as f64,
            height: low[1] - 0.006 * diagonal,
            dark: Vec::new(),
        };
        // Seen from below.
        let below = |p: &Vec3| {
            let [x, y] = floor.cell(*p);
            [x, y, (floor.height - p[1]) / (HIGH * diagonal)]
        };
        let screen: Vec<Vec3> = positions.iter().map(below).collect();
        let band = Band::of(CELLS, 0..CELLS * SAMPLES, faces, &screen);
        let dark = |at: usize| {
            let of = |k: usize| match band.seen(at % CELLS, at / CELLS * SAMPLES + k) {
                (NOTHING, _) => 0.0,
                (_, near) => (1.0 + near).max(0.0),
            };
            (0..SAMPLES).map(of).sum::<f32>() / SAMPLES as f32
        };
        floor.dark = (0..CELLS * CELLS).map(dark).collect();
        for stride in [1, CELLS, 1, CELLS] {
            floor.dark = blurred(&floor.dark, stride);
        }
        floor
    }

    /// Column and row of a point.
    fn cell(&self, p: Vec3) -> [f64; 2] {
        [
            (p[0] - self.low[0]) / self.step,
            (p[2] - self.low[1]) / self.step,
        ]
    }

    /// How dark the floor is along a line of sight: 0 in full light and beyond the floor.
    pub fn shadow(&self, eye: Vec3, sight: Vec3) -> f32 {
        let t = (self.height - eye[1]) / sight[1];
        if !(t > 0.0 && t.is_finite()) {
            return 0.0;
        }
        let [x, y] = self.cell(along(eye, t, sight)).map(|x| x - 0.5);
        let end = (CELLS - 1) as f64;
        if !(x >= 0.0 && y >= 0.0 && x < end && y < end) {
            return 0.0;
        }
        let (column, row) = (x as usize, y as usize);
        let (fx, fy) = ((x - column as f64) as f32, (y - row as f64) as f32);
        let dark = |row: usize| {
            let at = row * CELLS + column;
            self.dark[at] * (1.0 - fx) + self.dark[at + 1] * fx
        };
        dark(row) * (1.0 - fy) + dark(row + 1) * fy
    }
}

/// The mean over neighbours along one axis.
fn blurred(cells: &[f32], stride: usize) -> Vec<f32> {
    let mean = |at: usize| {
        let position = at / stride % CELLS;
        let near = position.saturating_sub(BLUR)..=(position + BLUR).min(CELLS - 1);
        let sum: f32 = near
            .map(|k| cells[at - position * stride + k * stride])
            .sum();
        sum / (2 * BLUR + 1) as f32
    };
    (0..cells.len()).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shadow_lies_below_the_surface() {
        let plate = |y: f64| [[-1.0, y, -1.0], [1.0, y, -1.0], [0.0, y, 1.5]];
        let faces = [[0, 1, 2], [3, 4, 5]];
        let floor = Floor::new(&[plate(0.0), plate(2.0)].concat(), &faces);
        let (eye, down) = ([0.0, 5.0, 0.0], [0.0, -1.0, 0.0]);
        assert!(floor.shadow(eye, down) > 0.8);
        let high = Floor::new(&[plate(0.0), plate(2.0)].concat(), &faces[1..]);
        assert!(high.shadow(eye, down) < 0.5 * floor.shadow(eye, down));
        assert_eq!(floor.shadow(eye, [0.5, -1.0, 0.0]), 0.0);
        assert_eq!(floor.shadow(eye, [0.0, 1.0, 0.0]), 0.0);
        assert_eq!(floor.shadow(eye, [1e9, -1.0, f64::NAN]), 0.0);
    }
}
