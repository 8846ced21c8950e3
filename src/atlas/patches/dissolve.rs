//! What is left of small patches after merging, where no neighbour can take one as a whole.
//!
//! [`dissolve`] divides a patch among several neighbours, face by face, or leaves it as it was. Every single step keeps all patches disks, injective and inside the range of log scale.

use super::borders::{around, borders};
use super::placement::place;
use super::slit::Slit;
use crate::geometry::ids::{FaceId, FaceVec, HalfedgeId};
use rustc_hash::FxHashSet as Set;

/// Patches of more faces are not divided: their neighbours would become ragged.
const DIVIDED: usize = 600;

/// Disjoint sets of faces that cover the slit disk.
struct Parts<'a> {
    slit: &'a Slit<'a>,
    label: FaceVec<u32>,
    faces: Vec<Vec<FaceId>>,
    log_scale: Vec<[f64; 2]>,
    range: f64,
}

impl<'a> Parts<'a> {
    fn new(slit: &'a Slit, patches: Vec<Vec<FaceId>>, range: f64) -> Parts<'a> {
        let mut label = FaceVec::filled(0u32, slit.connectivity.face_count());
        let mut log_scale = Vec::with_capacity(patches.len());
        for (i, faces) in (0u32..).zip(&patches) {
            let mut scale = [f64::INFINITY, f64::NEG_INFINITY];
            for &f in faces {
                label[f] = i;
                scale = joined(scale, slit.log_scale[f]);
            }
            log_scale.push(scale);
        }
        Parts {
            slit,
            label,
            faces: patches,
            log_scale,
            range,
        }
    }

    fn neighbours(&self, part: u32) -> Vec<u32> {
        let faces = &self.faces[part as usize];
        borders(self.slit, faces, &self.label, part)
            .into_keys()
            .collect()
    }

    /// Parts in the order of their size, the smallest first.
    fn by_size(&self) -> Vec<u32> {
        let mut order: Vec<u32> = (0..self.faces.len() as u32).collect();
        order.sort_by_key(|&i| (self.faces[i as usize].len(), i));
        order
    }

    fn fits(&self, f: FaceId, part: u32) -> bool {
        let [low, high] = joined(self.log_scale[part as usize], self.slit.log_scale[f]);
        high - low <= self.range
    }

    /// Sides that a face has in common with a part, and corners.
    fn shared(&self, f: FaceId, part: u32) -> (usize, usize) {
        let corners = self.slit.connectivity.face_halfedges(f);
        let beside = self.slit.neighbours(f);
        let sides = beside.filter(|&n| self.label[n] == part).count();
        let touches =
            |h: &HalfedgeId| around(self.slit, *h).any(|g| g != f && self.label[g] == part);
        (sides, corners.iter().filter(|h| touches(h)).count())
    }

    /// True where a part stays a disk when it takes a face: what they share is one path.
    fn can_take(&self, f: FaceId, part: u32) -> bool {
        let (sides, corners) = self.shared(f, part);
        sides > 0 && corners == sides + 1
    }
}

fn joined([low, high]: [f64; 2], x: f64) -> [f64; 2] {
    [low.min(x), high.max(x)]
}

/// Divides small patches among their neighbours where that is possible; `own` is scratch space, a place a copy.
pub(super) fn dissolve(
    slit: &Slit,
    patches: Vec<Vec<FaceId>>,
    range: f64,
    own: &mut [[f64; 2]],
) -> Vec<Vec<FaceId>> {
    let mut parts = Parts::new(slit, patches, range);
    for small in parts.by_size() {
        let count = parts.faces[small as usize].len();
        if count <= DIVIDED {
            divide(&mut parts, small, own);
        }
    }
    parts.faces.retain(|faces| !faces.is_empty());
    parts.faces
}

/// Gives every face of a part to a neighbour, or changes nothing.
fn divide(parts: &mut Parts, small: u32, own: &mut [[f64; 2]]) {
    let mut faces = parts.faces[small as usize].clone();
    faces.sort();
    // Faces that each neighbour has room for in the plane.
    let free: Vec<(u32, Set<FaceId>)> = parts
        .neighbours(small)
        .into_iter()
        .map(|other| (other, room(parts, &faces, small, other, own)))
        .collect();
    if faces
        .iter()
        .any(|f| free.iter().all(|(_, free)| !free.contains(f)))
    {
        return;
    }
    let before = parts.log_scale.clone();
    let mut left = faces.clone();
    loop {
        let count = left.len();
        left.retain(|&f| {
            let sides = |other: u32| parts.shared(f, other).0;
            let taker = free
                .iter()
                .filter(|(other, free)| {
                    free.contains(&f) && parts.fits(f, *other) && parts.can_take(f, *other)
                })
                .map(|(other, _)| *other)
                .min_by_key(|&other| (std::cmp::Reverse(sides(other)), other));
            if let Some(other) = taker {
                parts.label[f] = other;
                let scale = &mut parts.log_scale[other as usize];
                *scale = joined(*scale, parts.slit.log_scale[f]);
            }
            taker.is_none()
        });
        if left.is_empty() || left.len() == count {
            break;
        }
    }
    if left.is_empty() {
        for f in faces {
            let taker = parts.label[f];
            parts.faces[taker as usize].push(f);
        }
        parts.faces[small as usize].clear();
    } else {
        for f in faces {
            parts.label[f] = small;
        }
        parts.log_scale = before;
    }
}

/// The faces of a part that overlap none of its neighbour's.
fn room(
    parts: &Parts,
    faces: &[FaceId],
    small: u32,
    other: u32,
    own: &mut [[f64; 2]],
) -> Set<FaceId> {
    let slit = parts.slit;
    let theirs = &parts.faces[other as usize];
    let Some(&root) = theirs.first() else {
        return Set::default();
    };
    let highest = parts.log_scale[other as usize][1].max(parts.log_scale[small as usize][1]);
    let member = |f| [small, other].contains(&parts.label[f]);
    let placement = place(slit, theirs.iter().copied(), root, highest, member, own);
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for p in faces.iter().flat_map(|&f| placement.triangle(slit, f)) {
        for i in 0..2 {
            low[i] = low[i].min(p[i]);
            high[i] = high[i].max(p[i]);
        }
    }
    let near: Vec<FaceId> = theirs
        .iter()
        .copied()
        .filter(|&f| {
            let t = placement.triangle(slit, f);
            (0..2).all(|i| t.iter().any(|p| p[i] > low[i]) && t.iter().any(|p| p[i] < high[i]))
        })
        .collect();
    if near.is_empty() {
        return faces.iter().copied().collect();
    }
    // For triangles of both parts: a grid made for much smaller ones would have endless cells.
    let both: Vec<FaceId> = near.iter().chain(faces).copied().collect();
    let mut index = placement.index(slit, &both);
    for &f in &near {
        index.insert(placement.triangle(slit, f));
    }
    let free = |f: &FaceId| !index.overlaps(&placement.triangle(slit, *f));
    faces.iter().copied().filter(free).collect()
}
