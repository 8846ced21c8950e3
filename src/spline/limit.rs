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

/// Along side k of a cell and away from it, of coordinates in the cell.
fn to_side(k: u8, [s, t]: [f64; 2]) -> [f64; 2] {
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
