//! The sides of parameter squares, and which of them are one curve.

use std::fmt;

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

    /// In the order of `patches[].sides`: counterclockwise from the bottom.
    pub const AROUND: [Side; 4] = [Side::South, Side::East, Side::North, Side::West];

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

/// A side of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PatchSide {
    /// Surface.
    pub patch: usize,
    /// Which of its sides.
    pub side: Side,
}

impl fmt::Display for PatchSide {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the {} side of surface {}", self.side.name(), self.patch)
    }
}

/// Two sides that are one curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interface {
    /// The lesser one.
    pub first: PatchSide,
    /// The other.
    pub second: PatchSide,
    /// Whether their parameters run against each other.
    pub reversed: bool,
}
