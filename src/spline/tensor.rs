//! The limit surface over a block of cells as one bicubic tensor-product spline.
//!
//! *Enters:* a [`Limit`] surface, a [`Block`] with irregular points at its corners only, and the parameters between which the spline is to be one piece. *Leaves:* a [`BSplineSurface`] whose parameters count cells.
//!
//! Away from irregular points the limit surface is one of bicubic pieces with continuous second derivatives, which the spline takes over exactly: its control points are the pieces' polar forms. Beside an irregular point the pieces become
//! smaller by halves, without end; of the last square at such a corner, that between the first two parameters both ways, nothing is taken. There the spline goes on with the second derivatives that it has to the one control point at the corner, which is the limit position.
//! *Guaranteed:* the limit surface to rounding but in last squares; both surfaces at a side with the same parameters are the same curve there to rounding, last squares included.

use super::cage::{Cage, CellSide};
use super::evaluator::{CORNER, Piece};
use super::limit::{Limit, from_side};
use super::surface::{BSplineSurface, ORDER, clamped, polar};
use crate::grid::blocks::Block;
use rustc_hash::FxHashMap;

/// Pieces that were taken, by number of the square in the block.
type Pieces = FxHashMap<usize, Vec<Piece>>;

/// The surface of a block. Beside irregular corners, which are counted from the bottom left counterclockwise, breaks must be such that the last square is at most a quarter of the cell.
pub(super) fn surface(
    limit: &Limit<'_>,
    block: &Block,
    irregular: [bool; 4],
    breaks: [Vec<f64>; 2],
) -> BSplineSurface {
    let knots = breaks.map(|breaks| clamped(&breaks));
    let size = [0, 1].map(|i| knots[i].len() - ORDER);
    // Spans of a control point, nearest to its middle first.
    let spans = |axis: usize, i: usize| {
        let k = &knots[axis];
        let mut spans: Vec<usize> = (i..i + ORDER).filter(|&m| k[m] < k[m + 1]).collect();
        spans.sort_by_key(|&m| ((2 * m).abs_diff(2 * i + 3), m));
        spans
    };
    let is_end = |axis: usize, m: usize| [m == ORDER - 1, m + 1 == size[axis]];
    let is_last_square = |[m, n]: [usize; 2]| {
        let ([left, right], [bottom, top]) = (is_end(0, m), is_end(1, n));
        (irregular[0] && left && bottom)
            || (irregular[1] && right && bottom)
            || (irregular[2] && right && top)
            || (irregular[3] && left && top)
    };
    let mut pieces = Pieces::default();
    let mut control = Vec::with_capacity(size[0] * size[1]);
    for j in 0..size[1] {
        let rows = spans(1, j);
        for i in 0..size[0] {
            let columns = spans(0, i);
            let pairs = columns.iter().enumerate().flat_map(|(x, &m)| {
                let rows = rows.iter().enumerate();
                rows.map(move |(y, &n)| (x + y, [m, n]))
            });
            let found = pairs.filter(|(_, pair)| !is_last_square(*pair)).min();
            let args = |axis: usize, i: usize| [1, 2, 3].map(|k| knots[axis][i + k]);
            control.push(match found {
                Some((_, pair)) => {
                    let middle = [0, 1].map(|axis| {
                        let k = &knots[axis][pair[axis]..];
                        (k[0] + k[1]) / 2.0
                    });
                    polar_form(limit, block, &mut pieces, middle, [args(0, i), args(1, j)])
                }
                // The corner of the last square.
                None => {
                    let corner = match (i == 0, j == 0) {
                        (true, true) => 0,
                        (false, true) => 1,
                        (false, false) => 2,
                        (true, false) => 3,
                    };
                    let (q, k) = corner_of(block, corner);
                    limit.at(q, CORNER[usize::from(k)]).point
                }
            });
        }
    }
    BSplineSurface { knots, control }
}

/// The cell and its corner at a corner of a block.
pub(super) fn corner_of(block: &Block, corner: usize) -> CellSide {
    let [w, h] = block.cells;
    let at = [0, w - 1, w * h - 1, w * (h - 1)][corner];
    let (q, k) = block.squares[at];
    (q, (k + corner as u8) & 3)
}

/// Which corners of a block are irregular points.
pub(super) fn irregular_corners(cage: &Cage, block: &Block, irregular: &[bool]) -> [bool; 4] {
    [0, 1, 2, 3].map(|c| irregular[cage.tail(corner_of(block, c)) as usize])
}

/// The number of the square of a block in which a place is, the cell and the place there.
pub(super) fn place_in(block: &Block, at: [f64; 2]) -> (usize, u32, [f64; 2]) {
    let [column, row] = [0, 1].map(|i| (at[i] as usize).min(block.cells[i] - 1));
    let number = row * block.cells[0] + column;
    let (cell, k) = block.squares[number];
    let place = from_side(k, [at[0] - column as f64, at[1] - row as f64]);
    (number, cell, place)
}

/// The polar form of the piece around a place of a block.
fn polar_form(
    limit: &Limit<'_>,
    block: &Block,
    pieces: &mut Pieces,
    middle: [f64; 2],
    [u, v]: [[f64; 3]; 2],
) -> [f64; 3] {
    let (number, cell, place) = place_in(block, middle);
    let own = pieces.entry(number).or_default();
    // A piece is a square of a power of two.
    let has = |piece: &Piece| {
        (0..2).all(|i| {
            let from = place[i] - piece.corner[i];
            0.0 <= from && from <= piece.side
        })
    };
    let known = own.iter().position(has).unwrap_or_else(|| {
        own.push(limit.piece(cell, place));
        own.len() - 1
    });
    let piece = &own[known];
    let corner = [number % block.cells[0], number / block.cells[0]].map(|n| n as f64);
    let [x, y] = [u.map(|t| t - corner[0]), v.map(|t| t - corner[1])];
    // Parameters of the cell.
    let back = |t: [f64; 3]| t.map(|t| 1.0 - t);
    let (s, t) = match block.squares[number].1 {
        0 => (x, y),
        1 => (back(y), x),
        2 => (back(x), back(y)),
        _ => (y, back(x)),
    };
    let weights = |at: [f64; 3], low: f64| {
        let at = at.map(|t| (t - low) / piece.side);
        polar([-2.0, -1.0, 0.0, 1.0, 2.0, 3.0], at)
    };
    let (a, b) = (weights(s, piece.corner[0]), weights(t, piece.corner[1]));
    let mut sum = [0.0; 3];
    for (i, p) in piece.control.iter().enumerate() {
        for (sum, x) in sum.iter_mut().zip(p) {
            *sum += a[i % 4] * b[i / 4] * x;
        }
    }
    sum
}

/// Points at the corners of blocks.
pub(super) struct Vertices {
    /// In space.
    pub points: Vec<[f64; 3]>,
    /// Number of that at each point of the control mesh.
    pub at: Vec<Option<u32>>,
}

/// Makes surfaces meet at the corners of their blocks to the last bit, where the first of them has its corner.
pub(super) fn join_corners(
    cage: &Cage,
    blocks: &[Block],
    surfaces: &mut [BSplineSurface],
) -> Vertices {
    let mut vertices = Vertices {
        points: Vec::new(),
        at: vec![None; cage.vertices],
    };
    for (block, surface) in blocks.iter().zip(surfaces) {
        let [columns, rows] = surface.size();
        let last = columns * rows - 1;
        for (corner, at) in [0, columns - 1, last, last + 1 - columns]
            .into_iter()
            .enumerate()
        {
            let v = cage.tail(corner_of(block, corner)) as usize;
            let number = *vertices.at[v].get_or_insert_with(|| {
                vertices.points.push(surface.control[at]);
                vertices.points.len() as u32 - 1
            });
            surface.control[at] = vertices.points[number as usize];
        }
    }
    vertices
}
