//! Closed paths from face to face, and by how much they turn (`docs/method.md`, 8).
//!
//! *Enters:* cyclic lists of passages through faces. *Leaves:* the turning of every loop as a signed sum of corner angles, and
//! loops that follow the flips of a triangulation. *Guaranteed:* a flip leaves every loop in its homotopy class on the surface
//! without its vertices, so flips in a flat quad change no turning; faces may be glued to themselves. A flip costs
//! nothing where no loop passes. *Not guaranteed:* anything where a flip was not told.
//!
//! A loop turns by minus the angle of the corner on its right, or by the angle of the corner on its left. Once counterclockwise
//! around a vertex that is its angle Θ. A metric with cone angles in (π/2)ℕ has quarter turns for transitions where 2g loops that
//! generate the homology turn by multiples of π/2.
//!
//! ```text
//!            ╱ ╲                     ╱ ╲
//!          ╱  ·──▶ leave           ╱    ╲
//!        ╱   ·   ╲          leave ◀──·    ╲
//!       ─────▲────●               ●────▲───      enter: the halfedge of this face that is crossed
//!   right of the loop ●: −θ●        left: +θ●
//! ```

mod basis;
#[cfg(test)]
mod tests;

pub use basis::{homology_basis, mirrored_basis};

use crate::geometry::connectivity::{Connectivity, Flip};
use crate::geometry::ids::{FaceId, FaceVec, HalfedgeId, NONE};

/// A loop passes through a face: both halfedges belong to it and differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Passage {
    /// The halfedge that is crossed on the way in.
    pub enter: HalfedgeId,
    /// The halfedge that is crossed on the way out; its twin is where the next passage enters.
    pub leave: HalfedgeId,
}

/// A corner that a loop turns around.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// Which loop.
    pub of: usize,
    /// The corner, by the halfedge that leaves it.
    pub corner: HalfedgeId,
    /// 1 where the corner is on the left, −1 on the right.
    pub sign: f64,
}

/// Why passages make no loops.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HolonomyError {
    /// A passage does not follow the one before, or is none.
    #[error("loop {of} is broken at passage {passage}: its face has no such way in or out")]
    Broken {
        /// Which loop.
        of: usize,
        /// Which of its passages.
        passage: usize,
    },
    /// A surface with boundary was given where a closed one is needed.
    #[error("loops are made on closed surfaces only: this one has {boundary_loops} boundary loops")]
    NotClosed {
        /// Number of boundary loops.
        boundary_loops: usize,
    },
    /// The surface is in several pieces.
    #[error("loops are made on connected surfaces only: {reached} of {faces} faces hang together")]
    NotConnected {
        /// Faces that are connected with face 0.
        reached: usize,
        /// Number of faces.
        faces: usize,
    },
}

/// Loops that follow flips. Passages are linked along their loop and within their face.
#[derive(Clone, Debug, PartialEq)]
pub struct DualLoops {
    passage: Vec<Linked>,
    /// Places in `passage` that are not in use.
    free: Vec<u32>,
    /// One passage of every loop.
    first: Vec<u32>,
    /// One passage of every face, `NONE` where no loop passes.
    in_face: FaceVec<u32>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Linked {
    way: Passage,
    of: u32,
    before: u32,
    after: u32,
    /// The next passage of the same face.
    beside: u32,
}

impl DualLoops {
    /// Loops as cyclic lists of passages.
    pub fn new(connectivity: &Connectivity, loops: &[Vec<Passage>]) -> Result<Self, HolonomyError> {
        let mut made = Self {
            passage: Vec::new(),
            free: Vec::new(),
            first: Vec::new(),
            in_face: FaceVec::filled(NONE, connectivity.face_count()),
        };
        for (of, ways) in loops.iter().enumerate() {
            let begin = made.passage.len() as u32;
            let count = ways.len() as u32;
            if count == 0 {
                return Err(HolonomyError::Broken { of, passage: 0 });
            }
            for (i, &way) in ways.iter().enumerate() {
                let next = ways[(i + 1) % ways.len()];
                let known =
                    way.enter.index().max(way.leave.index()) < connectivity.halfedge_count();
                let is_passage = known
                    && way.enter != way.leave
                    && connectivity.face(way.enter) == connectivity.face(way.leave)
                    && connectivity.twin(way.leave) == Some(next.enter);
                if !is_passage {
                    return Err(HolonomyError::Broken { of, passage: i });
                }
                let i = i as u32;
                made.passage.push(Linked {
                    way,
                    of: of as u32,
                    before: begin + (i + count - 1) % count,
                    after: begin + (i + 1) % count,
                    beside: NONE,
                });
                made.enlist(connectivity.face(way.enter), begin + i);
            }
            made.first.push(begin);
        }
        Ok(made)
    }

    /// Refuses loops that are not on `connectivity`.
    pub fn check(&self, connectivity: &Connectivity) -> Result<(), HolonomyError> {
        let loops = (0..self.len()).map(|of| self.passages(of).collect());
        let loops: Vec<Vec<Passage>> = loops.collect();
        Self::new(connectivity, &loops).map(|_| ())
    }

    /// Number of loops.
    pub fn len(&self) -> usize {
        self.first.len()
    }

    /// True where there is no loop.
    pub fn is_empty(&self) -> bool {
        self.first.is_empty()
    }

    /// The passages of one loop in order.
    pub fn passages(&self, of: usize) -> impl Iterator<Item = Passage> + '_ {
        let first = self.first[of];
        let places = std::iter::successors(Some(first), move |&p| {
            let after = self.passage[p as usize].after;
            (after != first).then_some(after)
        });
        places.map(|p| self.passage[p as usize].way)
    }

    /// The corners that loops turn around in one face.
    pub fn turns_in<'a>(
        &'a self,
        connectivity: &'a Connectivity,
        face: FaceId,
    ) -> impl Iterator<Item = Turn> + 'a {
        let first = Some(self.in_face[face]).filter(|&p| p != NONE);
        let places = std::iter::successors(first, |&p| {
            Some(self.passage[p as usize].beside).filter(|&p| p != NONE)
        });
        places.map(|p| {
            let linked = &self.passage[p as usize];
            let (corner, sign) = turn(connectivity, linked.way);
            Turn {
                of: linked.of as usize,
                corner,
                sign,
            }
        })
    }

    /// By how much every loop turns, radians. `angle`: three a face, by corner.
    pub fn turning(
        &self,
        connectivity: &Connectivity,
        angle: impl Fn(HalfedgeId) -> f64,
    ) -> Vec<f64> {
        (0..self.len())
            .map(|of| {
                let turns = self.passages(of).map(|way| turn(connectivity, way));
                turns.map(|(corner, sign)| sign * angle(corner)).sum()
            })
            .collect()
    }

    /// Follows one flip. Only the numbering of halfedges by faces is taken from `connectivity`, which flips keep.
    ///
    /// Within the quad a loop comes in through a side and goes out through the next side that it meets, straight away or
    /// across the diagonal. The same two sides lie in one face after the flip, or in two with the new diagonal between.
    pub fn flipped(&mut self, connectivity: &Connectivity, flip: &Flip) {
        let c = connectivity;
        let faces = [flip.h, flip.t].map(|h| c.face(h));
        if faces.iter().all(|&f| self.in_face[f] == NONE) {
            return;
        }
        let is_diagonal = |h: HalfedgeId| h == flip.h || h == flip.t;
        let mut coming_in = Vec::new();
        for f in faces {
            let mut p = std::mem::replace(&mut self.in_face[f], NONE);
            while p != NONE {
                let linked = &self.passage[p as usize];
                if !is_diagonal(linked.way.enter) {
                    coming_in.push(p);
                }
                p = linked.beside;
            }
        }
        let moved = |h: HalfedgeId| flip.moves.iter().find(|m| m.0 == h).map_or(h, |m| m.1);
        for p in coming_in {
            let Passage { enter, mut leave } = self.passage[p as usize].way;
            if is_diagonal(leave) {
                let q = self.passage[p as usize].after;
                leave = self.passage[q as usize].way.leave;
                self.remove_after(p);
            }
            let (enter, leave) = (moved(enter), moved(leave));
            let (f, g) = (c.face(enter), c.face(leave));
            if f == g {
                self.passage[p as usize].way = Passage { enter, leave };
            } else {
                let (there, back) = match f == c.face(flip.h) {
                    true => (flip.h, flip.t),
                    false => (flip.t, flip.h),
                };
                self.passage[p as usize].way = Passage {
                    enter,
                    leave: there,
                };
                let q = self.insert_after(p, Passage { enter: back, leave });
                self.enlist(g, q);
            }
            self.enlist(f, p);
        }
    }

    fn enlist(&mut self, face: FaceId, p: u32) {
        self.passage[p as usize].beside = self.in_face[face];
        self.in_face[face] = p;
    }

    /// Takes the passage after `p` out of its loop; it is in no face's list any more.
    fn remove_after(&mut self, p: u32) {
        let Linked { of, after: q, .. } = self.passage[p as usize];
        let next = self.passage[q as usize].after;
        self.passage[p as usize].after = next;
        self.passage[next as usize].before = p;
        if self.first[of as usize] == q {
            self.first[of as usize] = p;
        }
        self.free.push(q);
    }

    fn insert_after(&mut self, p: u32, way: Passage) -> u32 {
        let Linked {
            of, after: next, ..
        } = self.passage[p as usize];
        let linked = Linked {
            way,
            of,
            before: p,
            after: next,
            beside: NONE,
        };
        let q = match self.free.pop() {
            Some(q) => {
                self.passage[q as usize] = linked;
                q
            }
            None => {
                self.passage.push(linked);
                self.passage.len() as u32 - 1
            }
        };
        self.passage[p as usize].after = q;
        self.passage[next as usize].before = q;
        q
    }
}

/// The corner that a passage turns around, by the halfedge that leaves it, and the sign of the turn.
fn turn(connectivity: &Connectivity, way: Passage) -> (HalfedgeId, f64) {
    match way.leave == connectivity.next(way.enter) {
        true => (way.leave, -1.0),
        false => (way.enter, 1.0),
    }
}
