//! Which square of the quad mesh every place of a map lies in.
//!
//! *Enters:* a [`GridMap`] and the quad mesh. *Leaves:* a square for some place of every face; others are found from it, straight through the squares in between. *Guaranteed:* nothing is assumed of the map but that its faces are not turned
//! over: squares follow from the gluing of the quad mesh, beginning at one anchor. *Not guaranteed:* on which side of a lattice line a place is put that lies on it to rounding.

use super::complex::turned;
use super::map::GridMap;
use super::quads::QuadMesh;
use crate::geometry::ids::{FaceId, FaceVec};
use std::f64::consts::FRAC_PI_2;

/// A square as it is seen from a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Seen {
    /// The square.
    pub square: u32,
    /// Its corner at the lower left.
    pub corner: u8,
    /// Where that is.
    pub at: [i64; 2],
}

/// See the module docs.
pub(super) struct Squares<'a> {
    mesh: &'a QuadMesh,
    /// A place of every face, and the square there.
    known: FaceVec<([f64; 2], Seen)>,
}

impl Seen {
    /// Across its lower, right, upper or left side; itself at the border.
    fn across(self, mesh: &QuadMesh, side: u8) -> Option<Self> {
        let own = (self.corner + side) & 3;
        let (square, there) = mesh.across[self.square as usize][usize::from(own)]?;
        let [x, y] = self.at;
        let at = match side {
            0 => [x, y - 1],
            1 => [x + 1, y],
            2 => [x, y + 1],
            _ => [x - 1, y],
        };
        let corner = (there + 6 - side) & 3;
        Some(Self { square, corner, at })
    }

    /// From beyond an edge: q = R^turns p + shift.
    fn beyond(self, turns: u8, shift: [i64; 2]) -> Self {
        // Twice the middle, which stays one.
        let middle = self.at.map(|x| 2 * x + 1);
        let [x, y] = turned(middle, turns);
        Self {
            square: self.square,
            corner: (self.corner + 4 - turns) & 3,
            at: [(x + 2 * shift[0] - 1) / 2, (y + 2 * shift[1] - 1) / 2],
        }
    }

    /// The corner of the square at a lattice point of its own.
    pub fn corner_at(self, p: [i64; 2]) -> Option<u8> {
        let place = match [p[0] - self.at[0], p[1] - self.at[1]] {
            [0, 0] => 0,
            [1, 0] => 1,
            [1, 1] => 2,
            [0, 1] => 3,
            _ => return None,
        };
        Some((self.corner + place) & 3)
    }

    /// Straight from a place in (or on) it to another of the same face.
    fn walk(mut self, mesh: &QuadMesh, from: [f64; 2], to: [f64; 2]) -> Self {
        // The part of the way after which coordinate i leaves the square, and the side there.
        let leaves = |seen: Self, i: usize| {
            let low = seen.at[i] as f64;
            let (line, side) = match () {
                () if to[i] > low + 1.0 => (low + 1.0, [1, 2][i]),
                () if to[i] < low => (low, [3, 0][i]),
                () => return None,
            };
            Some(((line - from[i]) / (to[i] - from[i]), side))
        };
        loop {
            let side = match (leaves(self, 0), leaves(self, 1)) {
                (Some((a, side)), Some((b, _))) if a <= b => side,
                (_, Some((_, side))) | (Some((_, side)), None) => side,
                (None, None) => return self,
            };
            match self.across(mesh, side) {
                Some(next) => self = next,
                None => return self,
            }
        }
    }
}

impl<'a> Squares<'a> {
    /// Finds them; `None` where the map has no anchor.
    pub fn new(map: &GridMap, mesh: &'a QuadMesh) -> Option<Self> {
        let (sheet, c) = (&map.sheet, &map.sheet.fine.connectivity);
        let anchor = map.anchors.first()?;
        let (h, angle) = sheet.corner_at(anchor.vertex, map.bearing(anchor))?;
        let direction = (angle / FRAC_PI_2).round().rem_euclid(4.0) as u8;
        let p = sheet.at(h);
        // Its side begins at the point and runs in that direction, with the square on the left.
        let (square, side) = anchor.edge;
        let [x, y] = p.map(|x| x.round() as i64);
        let at = match direction {
            0 => [x, y],
            1 => [x - 1, y],
            2 => [x - 1, y - 1],
            _ => [x, y - 1],
        };
        let corner = (side + 4 - direction) & 3;
        let first = Seen { square, corner, at };
        let middle = |a: [f64; 2], b: [f64; 2]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        let mut known: FaceVec<Option<([f64; 2], Seen)>> = FaceVec::filled(None, c.face_count());
        let opposite = middle(sheet.at(c.next(h)), sheet.at(c.prev(h)));
        let inside = middle(p, opposite);
        known[c.face(h)] = Some((inside, first.walk(mesh, p, inside)));
        let mut waiting = vec![c.face(h)];
        while let Some(f) = waiting.pop() {
            let (place, seen) = known[f]?;
            for h in c.face_halfedges(f) {
                let Some(t) = c.twin(h).filter(|&t| known[c.face(t)].is_none()) else {
                    continue;
                };
                let own = middle(sheet.at(h), sheet.at(c.next(h)));
                let there = middle(sheet.at(t), sheet.at(c.next(t)));
                let seen = seen.walk(mesh, place, own);
                let seen = seen.beyond(sheet.turns[h], map.shift(h));
                known[c.face(t)] = Some((there, seen));
                waiting.push(c.face(t));
            }
        }
        let known = known.iter().copied().collect::<Option<FaceVec<_>>>()?;
        Some(Self { mesh, known })
    }

    /// The square at a place of a face.
    pub fn at(&self, f: FaceId, place: [f64; 2]) -> Seen {
        let (from, seen) = self.known[f];
        seen.walk(self.mesh, from, place)
    }
}
