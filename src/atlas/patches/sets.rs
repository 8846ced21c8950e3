//! Sets of faces of the slit disk: membership, components, borders.

use super::slit::Slit;
use crate::geometry::ids::{FaceId, FaceVec, HalfedgeId};
use std::collections::VecDeque;

/// Sets of faces as stamps, so that membership costs one comparison and nothing is cleared.
pub(super) struct Sets<'a> {
    pub slit: &'a Slit<'a>,
    pub stamp: FaceVec<u32>,
    /// The same for copies.
    copy_stamp: Vec<u32>,
    /// Scratch space of those who divide a set.
    pub sides: FaceVec<u8>,
    pub last: u32,
}

impl<'a> Sets<'a> {
    pub(super) fn new(slit: &'a Slit<'a>) -> Self {
        Self {
            slit,
            stamp: FaceVec::filled(0, slit.connectivity.face_count()),
            copy_stamp: vec![0; slit.development.copies],
            sides: FaceVec::filled(0, slit.connectivity.face_count()),
            last: 0,
        }
    }

    /// True where a face has this stamp.
    pub(super) fn has(&self, f: FaceId, stamp: u32) -> bool {
        self.stamp[f] == stamp
    }

    /// Marks the faces with a new stamp.
    pub(super) fn mark(&mut self, faces: &[FaceId]) -> u32 {
        self.last += 1;
        for &f in faces {
            self.stamp[f] = self.last;
        }
        self.last
    }

    /// The faces of a set that have a side on its border.
    pub(super) fn border(&mut self, faces: &[FaceId]) -> Vec<FaceId> {
        let set = self.mark(faces);
        let is_inner = |f: FaceId| {
            let beside = self.slit.neighbours(f);
            beside.filter(|&n| self.stamp[n] == set).count() == 3
        };
        faces.iter().copied().filter(|&f| !is_inner(f)).collect()
    }

    /// The halfedges on the border of a set of faces, with the set on their left.
    pub(super) fn sides(&mut self, faces: &[FaceId]) -> Vec<HalfedgeId> {
        let set = self.mark(faces);
        let slit = self.slit;
        let all = faces.iter();
        let all = all.flat_map(|&f| slit.connectivity.face_halfedges(f));
        let is_outer = |&h: &HalfedgeId| slit.beside(h).is_none_or(|g| self.stamp[g] != set);
        all.filter(is_outer).collect()
    }

    /// Euler characteristic of a set of faces: 1 for a connected set that is a disk.
    pub(super) fn euler_characteristic(&mut self, faces: &[FaceId]) -> i64 {
        let (slit, set) = (self.slit, self.mark(faces));
        let (mut copies, mut inner) = (0, 0);
        for &f in faces {
            for copy in slit.copies(f) {
                copies += i64::from(std::mem::replace(&mut self.copy_stamp[copy], set) != set);
            }
            inner += slit.neighbours(f).filter(|&n| self.stamp[n] == set).count();
        }
        let edges = (3 * faces.len() - inner / 2) as i64;
        copies - edges + faces.len() as i64
    }

    /// Connected components on the slit disk, each in the order given, by their first face.
    pub(super) fn components(&mut self, faces: &[FaceId]) -> Vec<Vec<FaceId>> {
        let set = self.mark(faces);
        let first_component = self.last + 1;
        let mut components: Vec<Vec<FaceId>> = Vec::new();
        let mut stack = Vec::new();
        for &f in faces {
            if self.stamp[f] == set {
                self.last += 1;
                components.push(Vec::new());
                stack.push(f);
                self.stamp[f] = self.last;
                while let Some(g) = stack.pop() {
                    for n in self.slit.neighbours(g) {
                        if self.stamp[n] == set {
                            self.stamp[n] = self.last;
                            stack.push(n);
                        }
                    }
                }
            }
            components[(self.stamp[f] - first_component) as usize].push(f);
        }
        components
    }

    /// The face that is most steps from the border of a connected region; the lowest of equals.
    pub(super) fn innermost(&mut self, region: &[FaceId]) -> FaceId {
        let set = self.mark(region);
        self.last += 1;
        let seen = self.last;
        let mut ascending = region.to_vec();
        ascending.sort();
        let mut queue: VecDeque<(FaceId, usize)> = VecDeque::new();
        let (at_border, _) = partition(&ascending, |f| {
            let inner = self.slit.neighbours(f).filter(|&n| self.stamp[n] == set);
            inner.count() < 3
        });
        for f in at_border {
            self.stamp[f] = seen;
            queue.push_back((f, 0));
        }
        let mut best = (ascending[0], 0);
        while let Some((f, steps)) = queue.pop_front() {
            if steps > best.1 || (steps == best.1 && f < best.0) {
                best = (f, steps);
            }
            for n in self.slit.neighbours(f) {
                if self.stamp[n] == set {
                    self.stamp[n] = seen;
                    queue.push_back((n, steps + 1));
                }
            }
        }
        best.0
    }
}

/// Those of some faces that a condition holds for, and the others.
pub(super) fn partition(
    faces: &[FaceId],
    keep: impl Fn(FaceId) -> bool,
) -> (Vec<FaceId>, Vec<FaceId>) {
    faces.iter().partition(|&&f| keep(f))
}

/// Faces of every patch ascending, patches by their first face.
pub(super) fn in_order(mut patches: Vec<Vec<FaceId>>) -> Vec<Vec<FaceId>> {
    for patch in &mut patches {
        patch.sort();
    }
    patches.sort_by_key(|p| p.first().copied());
    patches
}
