//! Steps on the lattice: whole numbers on the sides of a [`Complex`], and what is wrong with them.
//!
//! *Enters:* a cone triangulation and the size of a cell. *Leaves:* for every side how many cells it goes in both directions; `E` = Σ |steps − wanted|² / max(|wanted|², ¼)
//! over the sides, how far they are from what was wanted; what is *missing*: 1 − twice the area where a face has less than 1, and steps along a line that are fewer than 1. *Guaranteed:* where nothing is missing and steps
//! close around every face, the surface is a grid of squares, and the map that is affine on every face is one to one.

use super::complex::{Complex, turned};
use crate::geometry::ids::{FaceId, HalfedgeId, VertexId, VertexVec};
use std::f64::consts::FRAC_PI_2;

/// A step in each of the four directions.
pub const UNIT: [[i64; 2]; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];

/// Least square of a wanted length that counts, cells².
const LEAST_SQUARE: f64 = 0.25;

/// A complex with steps.
#[derive(Clone, Debug)]
pub struct Lattice {
    /// Steps are on its sides.
    pub complex: Complex,
    /// Cells a unit of the complex' vectors.
    pub scale: f64,
    /// Whether there is a border, where walks may begin and end.
    pub(super) has_border: bool,
}

fn sum([a, b]: [i64; 2], [c, d]: [i64; 2]) -> [i64; 2] {
    [a + c, b + d]
}

fn cross([a, b]: [i64; 2], [c, d]: [i64; 2]) -> i64 {
    a * d - b * c
}

fn wide(a: i64, b: i64) -> i128 {
    i128::from(a) * i128::from(b)
}

impl Lattice {
    /// With the steps that the complex has.
    pub fn new(complex: Complex, scale: f64) -> Self {
        let has_border = complex.sides().any(|h| complex.side(h).twin.is_none());
        Self {
            complex,
            scale,
            has_border,
        }
    }

    /// With cells half as long.
    pub fn halved(mut self) -> Self {
        let sides: Vec<HalfedgeId> = self.complex.sides().collect();
        for h in sides {
            let side = self.complex.side(h);
            if side.twin.is_none_or(|t| h < t) {
                let steps = side.steps.map(|x| 2 * x);
                self.complex.set_steps(h, steps);
            }
        }
        self.scale *= 2.0;
        self
    }

    /// Where a side is to go, cells.
    pub fn wanted(&self, h: HalfedgeId) -> [f64; 2] {
        self.complex.side(h).vector.map(|x| self.scale * x)
    }

    /// Of a side of a line: the direction of [`UNIT`] that it goes in.
    pub fn direction(&self, h: HalfedgeId) -> Option<u8> {
        let side = self.complex.side(h);
        let [x, y] = side.vector;
        let direction = match x.abs() >= y.abs() {
            true if x >= 0.0 => 0,
            true => 2,
            false if y >= 0.0 => 1,
            false => 3,
        };
        side.is_line.then_some(direction)
    }

    /// E of a side with some steps.
    pub fn energy_of(&self, h: HalfedgeId, steps: [i64; 2]) -> f64 {
        let [x, y] = self.wanted(h);
        let (a, b) = (steps[0] as f64 - x, steps[1] as f64 - y);
        (a * a + b * b) / (x * x + y * y).max(LEAST_SQUARE)
    }

    /// E of the sides of a list.
    pub fn energy_on(&self, sides: impl Iterator<Item = HalfedgeId>) -> f64 {
        let energy = |h| self.energy_of(h, self.complex.side(h).steps);
        sides.map(energy).sum()
    }

    /// What is left of the steps around a face; zero where they close.
    pub fn surplus(&self, f: FaceId) -> [i64; 2] {
        let sides = (0..3).map(|k| HalfedgeId::new(3 * f.index() + k));
        let steps = sides.map(|h| self.complex.side(h).steps);
        steps.fold([0; 2], sum)
    }

    /// Twice the area of a face, cells.
    pub fn double_area(&self, f: FaceId) -> i64 {
        let h = HalfedgeId::new(3 * f.index());
        let next = self.complex.next(h);
        cross(self.complex.side(h).steps, self.complex.side(next).steps)
    }

    /// Number of cells.
    pub fn cells(&self) -> i64 {
        self.complex
            .faces()
            .map(|f| self.double_area(f))
            .sum::<i64>()
            / 2
    }

    /// What is missing of a face.
    pub fn missing(&self, f: FaceId) -> i64 {
        let sides = (0..3).map(|k| HalfedgeId::new(3 * f.index() + k));
        let steps = |h: HalfedgeId| self.complex.side(h).steps;
        let of_lines = sides
            .map(|h| self.missing_of_line(h, steps(h)))
            .sum::<i64>();
        (1 - self.double_area(f)).max(0) + of_lines
    }

    /// What is missing of a side on a line, if it had some steps.
    pub fn missing_of_line(&self, h: HalfedgeId, steps: [i64; 2]) -> i64 {
        let Some(d) = self.direction(h) else { return 0 };
        let along = turned(steps, 4 - d)[0];
        (1 - along).max(0)
    }

    /// Whether a side may change in a direction: on lines only along them.
    pub fn may_change(&self, h: HalfedgeId, direction: u8) -> bool {
        self.direction(h).is_none_or(|d| (d ^ direction) & 1 == 0)
    }

    /// The angles between lines around every vertex, in quarter turns, with steps in place of vectors where `on_lattice`; one angle where no line is.
    pub fn angles(&self, vertices: usize, on_lattice: bool) -> VertexVec<Vec<i64>> {
        let mut angles = VertexVec::filled(Vec::new(), vertices);
        for v in self.complex.vertices() {
            angles[v] = self.angles_at(v, on_lattice);
        }
        angles
    }

    fn angles_at(&self, v: VertexId, on_lattice: bool) -> Vec<i64> {
        let complex = &self.complex;
        let star = complex.star(v);
        let sectors = complex.sectors(&star, |h| match on_lattice {
            true => self.angle(h),
            false => complex.angle(h),
        });
        let quarters = sectors.iter().map(|a| (a / FRAC_PI_2).round() as i64);
        let quarters: Vec<i64> = quarters.collect();
        // Inside, a flip may let a star begin at another line.
        let is_border = complex.side(star[0]).twin.is_none();
        let turns = if is_border { 1 } else { quarters.len() };
        let turned = (0..turns).map(|i| [&quarters[i..], &quarters[..i]].concat());
        turned.min().unwrap_or_default()
    }

    /// The angle of the corner that a side leaves, on the lattice, radians.
    fn angle(&self, h: HalfedgeId) -> f64 {
        let (a, b) = (
            self.complex.side(h).steps,
            turned(self.complex.side(self.complex.prev(h)).steps, 2),
        );
        let dot = a[0] * b[0] + a[1] * b[1];
        (cross(a, b) as f64).atan2(dot as f64)
    }

    /// Flips sides whose opposite angles sum to more than π on the lattice, but lines. Returns how many.
    pub fn make_delaunay(&mut self) -> usize {
        let mut stack: Vec<HalfedgeId> = self.complex.sides().collect();
        let mut flips = 0;
        while let Some(h) = stack.pop() {
            if !self.is_wrong(h) {
                continue;
            }
            let Some(t) = self.complex.side(h).twin else {
                continue;
            };
            self.complex.flip(h);
            flips += 1;
            let around = |h| [self.complex.next(h), self.complex.prev(h)];
            stack.extend([h, t].into_iter().flat_map(around));
        }
        flips
    }

    fn is_wrong(&self, h: HalfedgeId) -> bool {
        let complex = &self.complex;
        let side = complex.side(h);
        let Some(t) = side
            .twin
            .filter(|&t| !side.is_line && complex.face(t) != complex.face(h))
        else {
            return false;
        };
        let corner = |h: HalfedgeId| {
            let (a, b) = (
                complex.side(complex.prev(h)).steps,
                complex.side(complex.next(h)).steps,
            );
            let dot = -wide(a[0], b[0]) - wide(a[1], b[1]);
            (dot, (wide(b[0], a[1]) - wide(b[1], a[0])).abs())
        };
        let ((c, s), (d, t)) = (corner(h), corner(t));
        // In the metric too: or the map from there to the lattice would turn a face over.
        c * t + d * s < 0 && complex.stays_thick(h)
    }
}
