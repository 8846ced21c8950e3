//! A checkerboard in flat coordinates that stays readable whatever the scale. On a grid it is that of `TEXCOORD_0`, whose squares are cells.

use super::aspect::Spot;
use super::colour::{Linear, mix};
use crate::atlas::plane::{doubled_area, rotate};
use crate::geometry::ids::{FaceId, VertexId};
use crate::geometry::mesh::triangle_area;
use crate::geometry::triangle::area;
use crate::product::AffineAtlas;

/// Cells of the checkerboard along the diagonal of the surface, at its middle scale.
const CELLS: f64 = 44.0;
/// Cells may shrink and grow by these powers of two before their size is changed.
pub const CELL_RANGE: [f64; 2] = [-1.3, 1.7];

/// Colours of cells.
const LIGHT: Linear = [0.84, 0.80, 0.71];
const DARK: Linear = [0.070, 0.205, 0.270];

/// The checkerboard: where which cell lies, and how large cells are.
pub struct Checkerboard<'a> {
    atlas: &'a AffineAtlas,
    /// Side of a cell in flat units.
    cell: f64,
    /// log₂ of a cell's side in space at each vertex, relative to the middle.
    level: Vec<f64>,
}

impl Checkerboard<'_> {
    /// Measures the scale of the surface.
    pub fn new(atlas: &AffineAtlas) -> Checkerboard<'_> {
        let mesh = &atlas.mesh;
        // log₂ of flat over spatial length, a face, with the face's area.
        let mut scales: Vec<(f64, f64)> = Vec::new();
        let mut sums = vec![[0.0; 2]; mesh.positions.len()];
        for f in mesh.connectivity.faces() {
            let source = triangle_area(mesh.face_positions(f));
            let flat = match &atlas.grid {
                Some(grid) => 0.5 * doubled_area(grid.uv[f]),
                // From the flat lengths: tiny faces have no reliable area in the chart's coordinates.
                None => {
                    let sides = mesh.connectivity.face_edges(f);
                    area(sides.map(|e| atlas.metric.length[e])).unwrap_or(f64::NAN)
                }
            };
            let scale = 0.5 * (flat / source).log2();
            if scale.is_finite() && source.is_finite() {
                scales.push((scale, source));
                for v in mesh.connectivity.face_vertices(f) {
                    let sum = &mut sums[v.index()];
                    *sum = [sum[0] + source * scale, sum[1] + source];
                }
            }
        }
        let scales = ascending(scales.into_iter());
        let (middle, side) = match &atlas.grid {
            Some(grid) => (-grid.cell_size.log2(), grid.cell_size),
            None => {
                let side = (mesh.diagonal() / CELLS).max(f64::MIN_POSITIVE);
                (weighted_quantile(&scales, 0.5), side)
            }
        };
        let level = |[sum, area]: [f64; 2]| if area > 0.0 { middle - sum / area } else { 0.0 };
        Checkerboard {
            level: sums.into_iter().map(level).collect(),
            cell: side * middle.exp2(),
            atlas,
        }
    }

    /// What the board is on a face.
    pub fn of_face(&self, face: usize) -> FaceBoard {
        let f = FaceId::new(face);
        let [a, b, c] = self.atlas.mesh.connectivity.face_vertices(f);
        let level = |v: VertexId| self.level[v.index()];
        let mut board = FaceBoard::new(f, [level(a), level(b), level(c)]);
        board.lay(self, 0.0);
        board
    }

    /// Coordinates of the corners of a face in cells.
    pub fn in_cells(&self, f: FaceId) -> [[f64; 2]; 3] {
        let cell = self.cell(0.0);
        self.corners(f, cell).map(|p| p.map(|x| x / cell))
    }

    /// Colour of a spot of the surface, averaged over about a pixel; `board` is that of its face.
    pub fn colour(&self, board: &mut FaceBoard, spot: &Spot) -> Linear {
        let (weights, level) = (&spot.weights, &board.level);
        let excess = excess(weights[0] * level[0] + weights[1] * level[1] + weights[2] * level[2]);
        let step = floor(excess);
        if step != board.step {
            board.lay(self, step);
        }
        let [x, y] = [board.span(spot, 0), board.span(spot, 1)];
        let coarse = dark_share([x, y], board.per_cell);
        let fade = (((excess - step) - 0.47) / 0.06).clamp(0.0, 1.0);
        let dark = match fade > 0.0 {
            true => coarse + fade * (dark_share([x, y], 2.0 * board.per_cell) - coarse),
            false => coarse,
        };
        mix(LIGHT, DARK, dark as f32)
    }

    /// log₂ of a cell's side in space at each vertex, relative to the middle.
    pub fn levels(&self) -> &[f64] {
        &self.level
    }

    /// Side of a cell in flat units where cells are cut into 2^`step` times smaller ones.
    pub fn cell(&self, step: f64) -> f64 {
        self.cell * (-step).exp2()
    }

    /// Central-chart coordinates of the corners of a face, up to an even number of cells; on a grid, coordinates in its island.
    ///
    /// They are taken through the patch, which keeps full precision where the chart's own coordinates, far from its
    /// origin, could not tell the cells of a tiny face apart.
    pub fn corners(&self, f: FaceId, cell: f64) -> [[f64; 2]; 3] {
        let layout = &self.atlas.patches;
        let patch = layout.face_patch[f].index();
        if let Some(grid) = &self.atlas.grid {
            let (_, offset) = grid.islands.place[patch];
            return layout.uv[f].map(|p| [0, 1].map(|i| p[i] + offset[i] as f64));
        }
        match layout.patches.get(patch).and_then(|patch| patch.to_chart) {
            Some(motion) => layout.uv[f].map(|p| {
                let turned = rotate(p, motion.rotation);
                let shift = motion.translation.map(|x| x % (2.0 * cell));
                [0, 1].map(|i| motion.scale * turned[i] + shift[i])
            }),
            None => self.atlas.central.uv[f],
        }
    }
}

/// The board on one face, with cells of one size.
#[derive(Clone, Copy, Debug)]
pub struct FaceBoard {
    face: FaceId,
    /// log₂ of a cell's side at its corners.
    level: [f64; 3],
    /// Into how many powers of two times smaller cells these are cut.
    step: f64,
    /// Cells a flat unit.
    per_cell: f64,
    /// Of each coordinate: that of the first corner, and from there to the other two.
    at: [[f64; 3]; 2],
    /// Of each coordinate: the least and the greatest of a corner.
    ends: [[f64; 2]; 2],
}

impl FaceBoard {
    fn new(face: FaceId, level: [f64; 3]) -> Self {
        FaceBoard {
            face,
            level,
            step: 0.0,
            per_cell: 1.0,
            at: [[0.0; 3]; 2],
            ends: [[0.0; 2]; 2],
        }
    }

    /// Cells of one size, by the coordinates of the corners in cells.
    pub fn of_cells(corners: [[f64; 2]; 3]) -> Self {
        let mut board = Self::new(FaceId::new(0), [0.0; 3]);
        board.put(corners);
        board
    }

    /// Colour of a spot of a face with cells of one size, averaged over about a pixel.
    pub fn plain(&self, spot: &Spot) -> Linear {
        let span = [self.span(spot, 0), self.span(spot, 1)];
        mix(LIGHT, DARK, dark_share(span, self.per_cell) as f32)
    }

    /// Lays cells of another size.
    fn lay(&mut self, board: &Checkerboard, step: f64) {
        let cell = board.cell(step);
        self.put(board.corners(self.face, cell));
        (self.step, self.per_cell) = (step, 1.0 / cell);
    }

    fn put(&mut self, [a, b, c]: [[f64; 2]; 3]) {
        for i in 0..2 {
            self.at[i] = [a[i], b[i] - a[i], c[i] - a[i]];
            self.ends[i] = [a[i].min(b[i]).min(c[i]), a[i].max(b[i]).max(c[i])];
        }
    }

    /// What a pixel around a spot covers of a coordinate; not beyond the face, for cells need not alternate where an island ends.
    fn span(&self, spot: &Spot, i: usize) -> [f64; 2] {
        let ([first, to_b, to_c], [low, high]) = (self.at[i], self.ends[i]);
        let along = |w: &[f64; 3]| w[1] * to_b + w[2] * to_c;
        let at = first + along(&spot.weights);
        let half = 0.5 * (along(&spot.right).abs() + along(&spot.down).abs());
        [(at - half).max(low), (at + half).min(high)]
    }
}

/// Rounds down. A cast, since the library's function is a call on older processors.
fn floor(x: f64) -> f64 {
    let whole = x as i64 as f64;
    if whole > x { whole - 1.0 } else { whole }
}

/// By how many powers of two cells at this level are too large (positive) or too small: those are cut, these joined.
pub fn excess(level: f64) -> f64 {
    level - level.clamp(CELL_RANGE[0], CELL_RANGE[1])
}

/// Values with their weights in ascending order, without what is not finite.
pub fn ascending(values: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let mut sorted: Vec<_> = values
        .filter(|v| v.0.is_finite() && v.1.is_finite())
        .collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    sorted
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

/// Share of dark cells between these ends along both axes, of so many cells a unit; half where there is no board.
fn dark_share([x, y]: [[f64; 2]; 2], per_cell: f64) -> f64 {
    // Along each axis the mean of a wave of −1 and 1, from its integral; their product is the board.
    let in_cells = |[low, high]: [f64; 2]| (low * per_cell, ((high - low) * per_cell).max(1e-6));
    let ((left, wide), (bottom, high)) = (in_cells(x), in_cells(y));
    let (column, row) = (floor(left), floor(bottom));
    // Mostly there is one cell.
    if left + wide < column + 1.0 && bottom + high < row + 1.0 {
        let half = 0.5 * (column + row);
        return 2.0 * (half - floor(half));
    }
    let integral = |x: f64| (0.5 * x - floor(0.5 * x) - 0.5).abs();
    let of_x = integral(left) - integral(left + wide);
    let of_y = integral(bottom) - integral(bottom + high);
    let dark = 0.5 - 2.0 * of_x * of_y / (wide * high);
    if dark.is_finite() { dark } else { 0.5 }
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
    fn the_mean_of_many_cells_is_between_both_colours() {
        let at =
            |x: f64, width: f64| dark_share([[x - 0.5 * width, x + 0.5 * width], [0.4, 0.6]], 1.0);
        assert!(at(0.5, 0.1) < 1e-12 && at(1.5, 0.1) > 1.0 - 1e-12);
        // A box of half a cell that reaches into the next by a quarter.
        assert!((at(1.0, 0.5) - 0.5).abs() < 1e-12);
        assert!((at(0.3, 40.0) - 0.5).abs() < 0.05);
        assert_eq!(at(f64::NAN, 1.0), 0.5);
    }
}
