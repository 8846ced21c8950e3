//! A checkerboard in flat coordinates that stays readable whatever the scale. On a grid it is that of `TEXCOORD_0`, whose squares are cells.

use super::colour::{Linear, mix};
use crate::atlas::plane::{doubled_area, rotate};
use crate::geometry::ids::FaceId;
use crate::geometry::mesh::triangle_area;
use crate::product::AffineAtlas;

/// Cells of the checkerboard along the diagonal of the surface, at its middle scale.
const CELLS: f64 = 44.0;
/// Cells may shrink and grow by these powers of two before their size is changed.
pub const CELL_RANGE: [f64; 2] = [-1.3, 1.7];

/// The checkerboard: where which cell lies, and how large cells are.
pub struct Checkerboard<'a> {
    atlas: &'a AffineAtlas,
    /// Side of a cell in flat units.
    cell: f64,
    /// log₂ of a cell's side in space at each vertex, relative to the middle.
    level: Vec<f64>,
    /// Middle side of a cell in space.
    side: f64,
}

impl Checkerboard<'_> {
    /// Measures the scale of the surface.
    pub fn new(atlas: &AffineAtlas) -> Checkerboard<'_> {
        let mesh = &atlas.mesh;
        // log₂ of flat over spatial length, a face, with the face's area.
        let mut scales: Vec<(f64, f64)> = Vec::new();
        let mut sums = vec![[0.0; 2]; mesh.positions.len()];
        for f in mesh.connectivity.faces() {
            let area = triangle_area(mesh.face_positions(f));
            let flat = match &atlas.grid {
                Some(grid) => 0.5 * doubled_area(grid.uv[f]),
                // From the flat lengths: tiny faces have no reliable area in the chart's coordinates.
                None => heron(
                    mesh.connectivity
                        .face_edges(f)
                        .map(|e| atlas.metric.length[e]),
                ),
            };
            let scale = 0.5 * (flat / area).log2();
            if scale.is_finite() && area.is_finite() {
                scales.push((scale, area));
                for v in mesh.connectivity.face_vertices(f) {
                    let sum = &mut sums[v.index()];
                    *sum = [sum[0] + area * scale, sum[1] + area];
                }
            }
        }
        scales.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (middle, side) = match &atlas.grid {
            Some(grid) => (-grid.cell_size.log2(), grid.cell_size),
            None => {
                let side = (mesh.diagonal() / CELLS).max(f64::MIN_POSITIVE);
                (weighted_quantile(&scales, 0.5), side)
            }
        };
        let level = sums
            .into_iter()
            .map(|[sum, area]| if area > 0.0 { middle - sum / area } else { 0.0 });
        Checkerboard {
            level: level.collect(),
            cell: side * middle.exp2(),
            side,
            atlas,
        }
    }

    /// Colour of a point of a face by its barycentric weights, where a pixel has the size `footprint` in source units.
    pub fn colour(&self, face: usize, weights: [f64; 3], footprint: f64) -> Linear {
        const LIGHT: Linear = [0.84, 0.80, 0.71];
        const DARK: Linear = [0.070, 0.205, 0.270];
        let f = FaceId::new(face);
        let corners = self.atlas.mesh.connectivity.face_vertices(f);
        let level: f64 = (0..3)
            .map(|k| weights[k] * self.level[corners[k].index()])
            .sum();
        let excess = excess(level);
        let step = excess.floor();
        let fade = (((excess - step) - 0.47) / 0.06).clamp(0.0, 1.0);
        let cell = self.cell * (-step).exp2();
        let at = self.place(f, weights, cell);
        let dark = (1.0 - fade) * is_dark(at, cell) + fade * is_dark(at, 0.5 * cell);
        // Where cells get as small as pixels, only their mean is left.
        let pixels = self.side * (level - step).exp2() / footprint;
        let contrast = ((pixels - 1.5) / 2.0).clamp(0.0, 1.0);
        mix(LIGHT, DARK, (0.5 + (dark - 0.5) * contrast) as f32)
    }

    /// log₂ of a cell's side in space at each vertex, relative to the middle.
    pub fn levels(&self) -> &[f64] {
        &self.level
    }

    /// Side of a cell in flat units where cells are cut into 2^`step` times smaller ones.
    pub fn cell(&self, step: f64) -> f64 {
        self.cell * (-step).exp2()
    }

    /// [`Checkerboard::place`] of the corners of a face.
    pub fn corners(&self, f: FaceId, cell: f64) -> [[f64; 2]; 3] {
        const CORNERS: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        CORNERS.map(|weights| self.place(f, weights, cell))
    }

    /// Central-chart coordinates of a point of a face, up to an even number of cells; on a grid, coordinates in its island.
    ///
    /// They are taken through the patch, which keeps full precision where the chart's own coordinates, far from its
    /// origin, could not tell the cells of a tiny face apart.
    fn place(&self, f: FaceId, weights: [f64; 3], cell: f64) -> [f64; 2] {
        let layout = &self.atlas.patches;
        if let Some(grid) = &self.atlas.grid {
            let (_, offset) = grid.islands.place[layout.face_patch[f].index()];
            let uv = &layout.uv[f];
            return std::array::from_fn(|i| {
                let at = (0..3).map(|k| weights[k] * uv[k][i]);
                at.sum::<f64>() + offset[i] as f64
            });
        }
        let patch = layout.patches.get(layout.face_patch[f].index());
        let motion = patch.and_then(|patch| patch.to_chart);
        let uv = match motion {
            Some(_) => &layout.uv[f],
            None => &self.atlas.central.uv[f],
        };
        let at: [f64; 2] = std::array::from_fn(|i| {
            let d = |k: usize| uv[k][i] - uv[0][i];
            uv[0][i] + weights[1] * d(1) + weights[2] * d(2)
        });
        let Some(motion) = motion else { return at };
        let turned = rotate(at, motion.rotation);
        std::array::from_fn(|i| motion.scale * turned[i] + motion.translation[i] % (2.0 * cell))
    }
}

/// By how many powers of two cells at this level are too large (positive) or too small: those are cut, these joined.
pub fn excess(level: f64) -> f64 {
    level - level.clamp(CELL_RANGE[0], CELL_RANGE[1])
}

/// The value below which the given share of the weight lies, of values in ascending order with their weights; 0 where
/// there is none.
pub fn weighted_quantile(values: &[(f64, f64)], share: f64) -> f64 {
    let total: f64 = values.iter().map(|v| v.1).sum();
    let mut running = 0.0;
    let found = values.iter().find(|v| {
        running += v.1;
        running >= share * total
    });
    found.or(values.last()).map_or(0.0, |v| v.0)
}

/// Area of a triangle by its sides (Kahan's arrangement of Heron's formula); NaN where there is no such triangle.
fn heron(mut sides: [f64; 3]) -> f64 {
    sides.sort_by(|x, y| y.total_cmp(x));
    let [a, b, c] = sides;
    0.25 * ((a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c))).sqrt()
}

/// 1 on the dark cells of a checkerboard, 0 on the others and where there is no board.
fn is_dark(at: [f64; 2], cell: f64) -> f64 {
    let sum = (at[0] / cell).floor() + (at[1] / cell).floor();
    let rest = sum.rem_euclid(2.0);
    if rest >= 1.0 { 1.0 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_follow_the_weights() {
        let values = [(-3.0, 1.0), (0.0, 1.0), (2.0, 6.0), (9.0, 2.0)];
        let at = |share| weighted_quantile(&values, share);
        assert_eq!(
            [at(0.0), at(0.15), at(0.5), at(0.9), at(1.0)],
            [-3.0, 0.0, 2.0, 9.0, 9.0]
        );
        assert_eq!(weighted_quantile(&[], 0.5), 0.0);
    }

    #[test]
    fn area_of_a_needle_by_its_sides() {
        assert!((heron([3.0, 5.0, 4.0]) - 6.0).abs() < 1e-14);
        // Height 1e-3 over a base of 2.
        let side = 1.0_f64.hypot(1e-3);
        assert!((heron([side, 2.0, side]) / 1e-3 - 1.0).abs() < 1e-9);
        assert!(heron([1.0, 1.0, 3.0]).is_nan());
    }
}
