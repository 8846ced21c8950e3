//! Bicubic tensor-product B-spline surfaces and the names of their sides.

use super::basis::{Basis, Local, ORDER};

/// A side of a parameter square.
///
/// ```text
///          north
///       3 ------- 2
///   west|         |east      v
///       |         |          |
///       0 ------- 1          +-- u
///          south
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Side {
    /// u = 0.
    West,
    /// u = 1.
    East,
    /// v = 0.
    South,
    /// v = 1.
    North,
}

impl Side {
    /// In the order in which G+Smo numbers them from 1 on.
    pub const ALL: [Side; 4] = [Side::West, Side::East, Side::South, Side::North];

    /// For readers.
    pub fn name(self) -> &'static str {
        match self {
            Side::West => "west",
            Side::East => "east",
            Side::South => "south",
            Side::North => "north",
        }
    }

    /// The parameter that runs along it: 0 is u, 1 is v.
    pub fn along(self) -> usize {
        match self {
            Side::West | Side::East => 1,
            Side::South | Side::North => 0,
        }
    }

    /// Whether the other parameter is 1 on it, not 0.
    pub fn is_far(self) -> bool {
        matches!(self, Side::East | Side::North)
    }

    /// Corners at 0 and at 1 of the parameter along it.
    pub fn corners(self) -> [usize; 2] {
        match self {
            Side::West => [0, 3],
            Side::East => [1, 2],
            Side::South => [0, 1],
            Side::North => [3, 2],
        }
    }

    /// The point of the square at a parameter along it.
    pub fn at(self, t: f64) -> [f64; 2] {
        let across = if self.is_far() { 1.0 } else { 0.0 };
        match self.along() {
            0 => [t, across],
            _ => [across, t],
        }
    }

    /// Where the points of this side stand in a grid of `columns` and `rows`, u fastest.
    pub fn grid(self, [columns, rows]: [usize; 2]) -> Vec<usize> {
        let (column, row) = (columns - 1, rows - 1);
        match self {
            Side::West => (0..rows).map(|k| k * columns).collect(),
            Side::East => (0..rows).map(|k| k * columns + column).collect(),
            Side::South => (0..columns).collect(),
            Side::North => (0..columns).map(|i| row * columns + i).collect(),
        }
    }
}

/// A surface over the unit square.
#[derive(Clone, Debug, PartialEq)]
pub struct BSplineSurface {
    /// In u and in v.
    pub basis: [Basis; 2],
    /// Control points, u fastest.
    pub control: Vec<[f64; 3]>,
}

/// A point of a surface with its tangents.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet {
    /// In space.
    pub point: [f64; 3],
    /// Derivatives by u and by v.
    pub tangent: [[f64; 3]; 2],
}

impl BSplineSurface {
    /// Control points in u and in v.
    pub fn size(&self) -> [usize; 2] {
        self.basis.map(Basis::count)
    }

    /// The point at (u, v).
    pub fn at(&self, [u, v]: [f64; 2]) -> Jet {
        self.combine(&self.basis[0].at(u), &self.basis[1].at(v))
    }

    /// The same where the bases are known.
    pub fn combine(&self, u: &Local, v: &Local) -> Jet {
        let columns = self.basis[0].count();
        let mut jet = Jet {
            point: [0.0; 3],
            tangent: [[0.0; 3]; 2],
        };
        for k in 0..ORDER {
            let row = (v.first + k) * columns + u.first;
            for (i, control) in self.control[row..row + ORDER].iter().enumerate() {
                for (c, x) in control.iter().enumerate() {
                    jet.point[c] += u.value[i] * v.value[k] * x;
                    jet.tangent[0][c] += u.derivative[i] * v.value[k] * x;
                    jet.tangent[1][c] += u.value[i] * v.derivative[k] * x;
                }
            }
        }
        jet
    }

    /// Control points of a side, in the direction of its parameter.
    pub fn side(&self, side: Side) -> Vec<[f64; 3]> {
        let grid = side.grid(self.size());
        grid.into_iter().map(|i| self.control[i]).collect()
    }
}
