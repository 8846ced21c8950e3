//! Curves as words of the halfedges they cross, rewritten at a flip piece by piece: no counting, no order on the edges.

use crate::geometry::connectivity::{Connectivity, Flip};
use crate::geometry::ids::HalfedgeId;

/// A base edge as a reduced path, up to homotopy: the current halfedge whose left corner at the tail it sets out from, the halfedges it
/// crosses, the current halfedge whose corner it ends in. Without crossings it runs along a halfedge.
#[derive(Clone, Debug, PartialEq)]
pub enum Word {
    Along(HalfedgeId),
    Across {
        start: HalfedgeId,
        crossed: Vec<HalfedgeId>,
        end: HalfedgeId,
    },
}

/// How a piece of a path enters or leaves the square of a flip.
#[derive(Clone, Copy, Debug)]
enum Gate {
    /// Old halfedge of the square's side, inside.
    Side(HalfedgeId),
    /// Corner of the square: a, d, b, c are 0 to 3.
    Corner(usize),
}

pub struct Square {
    pub flip: Flip,
}

impl Square {
    fn moved(&self, h: HalfedgeId) -> HalfedgeId {
        let found = self.flip.moves.iter().find(|m| m.0 == h);
        found.map_or(h, |m| m.1)
    }
    fn has_side(&self, h: HalfedgeId) -> bool {
        self.flip.moves.iter().any(|m| m.0 == h)
    }
    fn inside(&self, h: HalfedgeId) -> bool {
        h == self.flip.h || h == self.flip.t || self.has_side(h)
    }
    /// The corner at the tail of an old halfedge; the order of `moves` is c→a, a→d, d→b, b→c.
    fn corner(&self, h: HalfedgeId) -> usize {
        let (ca, ad, db, bc) = (0, 1, 2, 3);
        let at = self.flip.moves.iter().position(|m| m.0 == h);
        match at {
            Some(i) if i == ca => 3,
            Some(i) if i == ad => 0,
            Some(i) if i == db => 1,
            Some(i) if i == bc => 2,
            // The diagonal: h leaves a, t leaves b.
            _ if h == self.flip.h => 0,
            _ => 2,
        }
    }
    /// In which new face: left (a) or right (b) of dc; `None` at its ends.
    fn is_left(&self, gate: Gate) -> Option<bool> {
        match gate {
            Gate::Side(h) => {
                let i = self.flip.moves.iter().position(|m| m.0 == h).unwrap();
                Some(i < 2)
            }
            Gate::Corner(0) => Some(true),
            Gate::Corner(2) => Some(false),
            Gate::Corner(_) => None,
        }
    }
    /// The new halfedge that leaves a corner of the square in a new face.
    fn leaving(&self, corner: usize, left: bool) -> HalfedgeId {
        let [ca, ad, db, bc] = self.flip.moves.map(|m| m.1);
        match (corner, left) {
            (0, _) => ad,
            (1, true) => self.flip.h,
            (1, false) => db,
            (2, _) => bc,
            (_, true) => ca,
            (_, false) => self.flip.t,
        }
    }
    /// The words after the flip.
    pub fn rewrite(&self, before: &Connectivity, word: &Word) -> Word {
        let (start, crossed, end) = match word {
            Word::Along(h) if *h != self.flip.h && *h != self.flip.t => {
                return Word::Along(self.moved(*h));
            }
            Word::Along(h) => (*h, Vec::new(), before.twin(*h).unwrap()),
            Word::Across {
                start,
                crossed,
                end,
            } => (*start, crossed.clone(), *end),
        };
        // Cut into pieces inside one face or the square; each ends through a side or in the last corner.
        let mut out = Vec::new();
        let (mut new_start, mut new_end) = (self.moved(start), self.moved(end));
        let mut along = None;
        let mut entry = self.inside(start).then(|| Gate::Corner(self.corner(start)));
        let last = crossed.len();
        for (i, step) in crossed.iter().copied().map(Some).chain([None]).enumerate() {
            if step == Some(self.flip.h) || step == Some(self.flip.t) {
                continue; // still in the square
            }
            if let Some(entry) = entry {
                let exit = match step {
                    Some(s) => Gate::Side(s),
                    None => Gate::Corner(self.corner(end)),
                };
                let left = match (self.is_left(entry), self.is_left(exit)) {
                    (Some(from), Some(to)) => {
                        if from != to {
                            out.push(if from { self.flip.h } else { self.flip.t });
                        }
                        (from, to)
                    }
                    (Some(from), None) => (from, from),
                    (None, Some(to)) => (to, to),
                    (None, None) => {
                        let from_d = matches!(entry, Gate::Corner(1));
                        along = Some(if from_d { self.flip.h } else { self.flip.t });
                        (true, true)
                    }
                };
                if let Gate::Corner(c) = entry {
                    new_start = self.leaving(c, left.0);
                }
                if let Gate::Corner(c) = exit {
                    new_end = self.leaving(c, left.1);
                }
            }
            if let Some(s) = step {
                out.push(self.moved(s));
                let t = before.twin(s).unwrap();
                entry = self.has_side(t).then_some(Gate::Side(t));
            }
            assert!(step.is_some() || i == last);
        }
        match along {
            Some(h) => {
                assert!(out.is_empty());
                Word::Along(h)
            }
            None => Word::Across {
                start: new_start,
                crossed: out,
                end: new_end,
            },
        }
    }
}
