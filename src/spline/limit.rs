//! The limit surface of a control mesh: points, tangents, normals, and the nearest point to one in space.

use super::cage::{Cage, CellSide};
use super::evaluator::{Evaluator, Piece};
use super::surface::Jet;
use crate::geometry::mesh::{cross, dot, norm, sub};
use crate::parallel;

/// A surface.
pub struct Limit<'a> {
    /// Its control mesh …
    pub cage: &'a Cage,
    /// … prepared.
    pub evaluator: &'a Evaluator,
    /// Control points.
    pub control: &'a [[f64; 3]],
    /// Of every cell its larger bicubic pieces.
    pieces: Vec<Vec<Piece>>,
}

/// Halvings after which pieces beside irregular points are computed when they are asked for.
const PIECES_DEPTH: usize = 5;

/// A place on the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The cell.
    pub cell: u32,
    /// Where in it.
    pub at: [f64; 2],
}

/// Steps of one search for the nearest point, at most.
const MOST_STEPS: usize = 4;
/// A step, at most, cells.
const MOST_STEP: f64 = 0.5;
/// A search ends where steps are shorter, cells.
const LEAST_STEP: f64 = 1e-6;
/// Cells that a step may pass.
const MOST_CELLS: usize = 4;
/// Normals beside a point without tangents are taken at this distance, cells.
const BESIDE: f64 = 1e-4;

impl<'a> Limit<'a> {
    /// The surface of a control mesh.
    pub fn new(cage: &'a Cage, evaluator: &'a Evaluator, control: &'a [[f64; 3]]) -> Self {
        let all: Vec<u32> = (0..cage.cells.len() as u32).collect();
        Self::of_cells(cage, evaluator, control, &all)
    }

    /// The same, prepared for places in some cells; others take longer.
    pub fn of_cells(
        cage: &'a Cage,
        evaluator: &'a Evaluator,
        control: &'a [[f64; 3]],
        cells: &[u32],
    ) -> Self {
        let mut pieces = vec![Vec::new(); cage.cells.len()];
        let own = parallel::map(cells, |_, &c| evaluator.pieces(control, c, PIECES_DEPTH));
        for (&cell, own) in cells.iter().zip(own) {
            pieces[cell as usize] = own;
        }
        Self {
            pieces,
            cage,
            evaluator,
            control,
        }
    }

    /// The point and tangents at a place of a cell.
    pub fn at(&self, cell: u32, place: [f64; 2]) -> Jet {
        let mut pieces = self.pieces[cell as usize].iter();
        if let Some(piece) = pieces.find(|piece| piece.contains(place)) {
            return piece.at(place);
        }
        let weights = self.evaluator.weights(cell, place);
        let points = self.evaluator.points(cell);
        let sum = |weights: &[f64]| {
            let mut sum = [0.0; 3];
            for (w, &v) in weights.iter().zip(points) {
                for (sum, x) in sum.iter_mut().zip(self.control[v as usize]) {
                    *sum += w * x;
                }
            }
            sum
        };
        Jet {
            point: sum(&weights.value),
            tangent: [sum(&weights.derivative[0]), sum(&weights.derivative[1])],
        }
    }

    /// The bicubic piece around a place that is not an irregular point.
    pub fn piece(&self, cell: u32, place: [f64; 2]) -> Piece {
        let mut pieces = self.pieces[cell as usize].iter();
        let known = pieces.find(|piece| piece.contains(place)).cloned();
        known.unwrap_or_else(|| self.evaluator.piece(self.control, cell, place))
    }

    /// The point and the unit normal; beside a point that has no tangents the normal is that of a place nearby.
    pub fn normal(&self, cell: u32, place: [f64; 2]) -> ([f64; 3], [f64; 3]) {
        let jet = self.at(cell, place);
        let of = |jet: &Jet| {
            let n = cross(jet.tangent[0], jet.tangent[1]);
            let length = norm(n);
            (length > 0.0 && length.is_finite()).then(|| n.map(|x| x / length))
        };
        let inside = || place.map(|x| x.clamp(BESIDE, 1.0 - BESIDE));
        let normal = of(&jet).or_else(|| of(&self.at(cell, inside())));
        (jet.point, normal.unwrap_or([0.0; 3]))
    }

    /// The same for a place on a side of the border, along this; gives the side it comes to, too.
    pub fn nearest_on_border(&self, point: [f64; 3], place: Place, side: u8) -> (Place, u8) {
        let mut now = (place, side);
        let mut jet = self.at(place.cell, place.at);
        for _ in 0..MOST_STEPS {
            let (off, tangent) = (sub(point, jet.point), along_side(now.1, jet.tangent));
            let mut step = dot(tangent, off) / dot(tangent, tangent);
            if !step.is_finite() || step.abs() < LEAST_STEP {
                break;
            }
            step = step.clamp(-MOST_STEP, MOST_STEP);
            let mut tries = (0..3).map(|i| {
                let next = slide(self.cage, now.0, now.1, step / 4.0f64.powi(i));
                (next, self.at(next.0.cell, next.0.at))
            });
            let nearer = tries.find(|(_, jet)| norm(sub(point, jet.point)) < norm(off));
            let Some((next, there)) = nearer else { break };
            (now, jet) = (next, there);
        }
        now
    }

    /// Moves a place nearer to being that of the nearest point of the surface; it does not cross creases.
    pub fn nearest(&self, point: [f64; 3], mut place: Place) -> Place {
        let mut jet = self.at(place.cell, place.at);
        let mut off = sub(point, jet.point);
        for _ in 0..MOST_STEPS {
            let [u, v] = jet.tangent;
            let (a, b, c) = (dot(u, u), dot(u, v), dot(v, v));
            let (x, y) = (dot(u, off), dot(v, off));
            let determinant = a * c - b * b;
            // Where tangents are nearly parallel, along the gradient.
            let mut step = match determinant > 1e-9 * a * c {
                true => [(c * x - b * y) / determinant, (a * y - b * x) / determinant],
                false if a + c > 0.0 => [x / (a + c), y / (a + c)],
                false => return place,
            };
            let longest = step[0].abs().max(step[1].abs());
            if longest < LEAST_STEP {
                break;
            }
            if longest > MOST_STEP {
                step = step.map(|x| x * MOST_STEP / longest);
            }
            let mut is_nearer = false;
            for _ in 0..3 {
                let next = walk(self.cage, place, step);
                let jet_there = self.at(next.cell, next.at);
                let off_there = sub(point, jet_there.point);
                if norm(off_there) < norm(off) {
                    (place, jet, off) = (next, jet_there, off_there);
                    is_nearer = true;
                    break;
                }
                step = step.map(|x| x / 4.0);
            }
            if !is_nearer {
                break;
            }
        }
        place
    }
}

/// Goes along the border from a place on a side of it, in the direction of the side where `step` is positive, round to the sides of other cells but not past corners.
fn slide(cage: &Cage, place: Place, side: u8, step: f64) -> (Place, u8) {
    let (mut cell, mut k) = (place.cell, side);
    let mut x = to_side(k, place.at)[0] + step;
    for _ in 0..MOST_CELLS {
        let (end, back) = match x {
            x if x > 1.0 => ((cell, (k + 1) & 3), false),
            x if x < 0.0 => ((cell, k), true),
            _ => break,
        };
        if cage.is_corner[cage.tail(end) as usize] {
            break;
        }
        // Around the end, over the cells there.
        let turn = if back { 3 } else { 1 };
        let mut next = (cell, (k + turn) & 3);
        while let Some((other, l)) = cage.across[next.0 as usize][usize::from(next.1)] {
            next = (other, (l + turn) & 3);
        }
        (cell, k) = next;
        x += if back { 1.0 } else { -1.0 };
    }
    let at = from_side(k, [x.clamp(0.0, 1.0), 0.0]);
    (Place { cell, at }, k)
}

/// The derivative along side k of a cell.
pub(super) fn along_side(k: u8, [u, v]: [[f64; 3]; 2]) -> [f64; 3] {
    match k {
        0 => u,
        1 => v,
        2 => u.map(|x| -x),
        _ => v.map(|x| -x),
    }
}

/// Along side k of a cell and away from it, of coordinates in the cell.
pub(super) fn to_side(k: u8, [s, t]: [f64; 2]) -> [f64; 2] {
    match k {
        0 => [s, t],
        1 => [t, 1.0 - s],
        2 => [1.0 - s, 1.0 - t],
        _ => [1.0 - t, s],
    }
}

/// Coordinates in a cell of those along its side k and away from it.
pub(super) fn from_side(k: u8, [along, away]: [f64; 2]) -> [f64; 2] {
    match k {
        0 => [along, away],
        1 => [1.0 - away, along],
        2 => [1.0 - along, 1.0 - away],
        _ => [away, 1.0 - along],
    }
}

/// A direction turned by quarters clockwise, from a cell to its side k; with −k back.
fn turned(k: u8, [x, y]: [f64; 2]) -> [f64; 2] {
    match k & 3 {
        0 => [x, y],
        1 => [y, -x],
        2 => [-x, -y],
        _ => [-y, x],
    }
}

/// Goes from a place in a direction across sides of cells; at creases it goes on along them.
fn walk(cage: &Cage, mut place: Place, mut step: [f64; 2]) -> Place {
    for _ in 0..MOST_CELLS {
        // The side that is met first.
        let mut first: Option<(f64, u8)> = None;
        for k in 0..4u8 {
            let [_, away] = to_side(k, place.at);
            let [_, towards] = turned(k, step);
            if towards < 0.0 && away + towards < 0.0 {
                let part = (away / -towards).max(0.0);
                if first.is_none_or(|(least, _)| part < least) {
                    first = Some((part, k));
                }
            }
        }
        let Some((part, k)) = first else {
            place.at = [0, 1].map(|i| (place.at[i] + step[i]).clamp(0.0, 1.0));
            return place;
        };
        place.at = [0, 1].map(|i| (place.at[i] + part * step[i]).clamp(0.0, 1.0));
        step = step.map(|x| x * (1.0 - part));
        let [along, towards] = turned(k, step);
        let side: CellSide = (place.cell, k);
        match cage.across[place.cell as usize][usize::from(k)].filter(|_| !cage.is_crease(side)) {
            Some((other, l)) => {
                let [at, _] = to_side(k, place.at);
                place = Place {
                    cell: other,
                    at: from_side(l, [1.0 - at, 0.0]),
                };
                step = turned((4 - l) & 3, [-along, -towards]);
            }
            None => step = turned((4 - k) & 3, [along, 0.0]),
        }
    }
    place
}
