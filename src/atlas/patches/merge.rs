//! Neighbouring patches joined while their union is still a disk, injective, and within the range of
//! log scale. Smallest first, so that crumbs disappear into what surrounds them.

use super::borders::{around, borders};
use super::placement::{place, rounded_ln};
use super::slit::Slit;
use crate::geometry::ids::{FaceId, FaceVec, HalfedgeId};
use rustc_hash::FxHashSet as Set;
use std::cmp::Reverse;
use std::collections::BTreeSet;

/// A patch as its neighbours see it.
pub(super) struct Part {
    pub faces: Vec<FaceId>,
    /// Least and greatest.
    pub log_scale: [f64; 2],
    /// In space.
    pub area: f64,
}

impl Part {
    pub fn new(slit: &Slit, faces: Vec<FaceId>) -> Self {
        let mut part = Self {
            log_scale: [f64::INFINITY, f64::NEG_INFINITY],
            area: 0.0,
            faces,
        };
        for &f in &part.faces {
            let s = slit.log_scale[f];
            part.log_scale = [part.log_scale[0].min(s), part.log_scale[1].max(s)];
            part.area += slit.source_area[f];
        }
        part
    }
}

/// Rounds over all patches: a merge can make another one possible, hardly ever twice.
const ROUNDS: usize = 4;

/// Joins patches; see the module docs. `own` is scratch space, a place a copy.
pub(super) fn merge(
    slit: &Slit,
    patches: Vec<Vec<FaceId>>,
    range: f64,
    own: &mut [[f64; 2]],
) -> Vec<Vec<FaceId>> {
    let mut label = FaceVec::filled(0u32, slit.connectivity.face_count());
    let mut parts: Vec<Part> = patches
        .into_iter()
        .enumerate()
        .map(|(i, faces)| {
            faces.iter().for_each(|&f| label[f] = i as u32);
            Part::new(slit, faces)
        })
        .collect();
    let unit: f64 = parts.iter().map(|p| p.area).sum();
    // Pairs that overlap, until one of them changes.
    let mut overlapping: Set<(u32, u32)> = Set::default();
    for _ in 0..ROUNDS {
        let mut queue: BTreeSet<(i64, u32)> = (0..parts.len() as u32)
            .filter(|&i| !parts[i as usize].faces.is_empty())
            .map(|i| (rounded_ln(parts[i as usize].area / unit), i))
            .collect();
        let mut changed = false;
        while let Some((_, small)) = queue.pop_first() {
            let neighbours = borders(slit, &parts[small as usize].faces, &label, small);
            let mut candidates: Vec<(Reverse<i64>, u32)> = neighbours
                .into_iter()
                .map(|(other, length)| (Reverse(rounded_ln(length / slit.extent)), other))
                .collect();
            candidates.sort();
            let partner = candidates.into_iter().map(|c| c.1).find(|&other| {
                let pair = (small.min(other), small.max(other));
                if overlapping.contains(&pair) {
                    return false;
                }
                let (a, b) = (&parts[small as usize], &parts[other as usize]);
                let fits = within(a, b, range) && joins_to_a_disk(slit, a, &label, [small, other]);
                if !fits {
                    return false;
                }
                let free = !overlaps(slit, a, b, &label, [small, other], own);
                if !free {
                    overlapping.insert(pair);
                }
                free
            });
            let Some(partner) = partner else { continue };
            let (from, to) =
                if parts[small as usize].faces.len() <= parts[partner as usize].faces.len() {
                    (small, partner)
                } else {
                    (partner, small)
                };
            let moved = std::mem::take(&mut parts[from as usize].faces);
            for &f in &moved {
                label[f] = to;
            }
            let (area, scale) = (parts[from as usize].area, parts[from as usize].log_scale);
            let part = &mut parts[to as usize];
            queue.remove(&(rounded_ln(part.area / unit), to));
            queue.remove(&(rounded_ln(area / unit), from));
            part.faces.extend(moved);
            part.area += area;
            part.log_scale = [
                part.log_scale[0].min(scale[0]),
                part.log_scale[1].max(scale[1]),
            ];
            queue.insert((rounded_ln(part.area / unit), to));
            overlapping.retain(|p| ![p.0, p.1].contains(&to) && ![p.0, p.1].contains(&from));
            changed = true;
        }
        if !changed {
            break;
        }
    }
    let faces = parts.into_iter().map(|p| p.faces);
    faces.filter(|f| !f.is_empty()).collect()
}

/// True where two patches together stay within the range of log scale.
pub(super) fn within(a: &Part, b: &Part, range: f64) -> bool {
    let high = a.log_scale[1].max(b.log_scale[1]);
    let low = a.log_scale[0].min(b.log_scale[0]);
    high - low <= range
}

/// True where a disk and another share one path, by their labels: then their union is a disk.
/// Both are pieces of one disk, so what they share is a forest, and vertices − edges counts its trees.
pub(super) fn joins_to_a_disk(
    slit: &Slit,
    part: &Part,
    label: &FaceVec<u32>,
    labels: [u32; 2],
) -> bool {
    let c = slit.connectivity;
    let [own, other] = labels;
    let mut copies = Set::default();
    let (mut vertices, mut edges) = (0, 0);
    for &f in &part.faces {
        let halfedges = c.face_halfedges(f);
        let beside = halfedges.map(|h| slit.beside(h).map(|n| label[n]));
        if beside == [Some(own); 3] {
            continue;
        }
        for (k, h) in halfedges.into_iter().enumerate() {
            edges += usize::from(beside[k] == Some(other));
            // A corner whose both sides lie inside the part is looked at from another one of the copy's.
            let is_inside = beside[k] == Some(own) && beside[(k + 2) % 3] == Some(own);
            if !is_inside && copies.insert(slit.development.copy[h]) {
                vertices += usize::from(around(slit, h).any(|f| label[f] == other));
            }
        }
    }
    vertices == edges + 1
}

/// True where two patches, by their labels, overlap.
pub(super) fn overlaps(
    slit: &Slit,
    a: &Part,
    b: &Part,
    label: &FaceVec<u32>,
    labels: [u32; 2],
    own: &mut [[f64; 2]],
) -> bool {
    let (small, large) = if a.faces.len() <= b.faces.len() {
        (a, b)
    } else {
        (b, a)
    };
    let Some(&root) = large.faces.first() else {
        return false;
    };
    let highest = a.log_scale[1].max(b.log_scale[1]);
    let faces = a.faces.iter().chain(&b.faces).copied();
    let member = |f| labels.contains(&label[f]);
    let placement = place(slit, faces, root, highest, member, own);
    let sides: Vec<HalfedgeId> = (a.faces.iter().chain(&b.faces))
        .flat_map(|&f| slit.connectivity.face_halfedges(f))
        .filter(|&h| !slit.beside(h).is_some_and(member))
        .collect();
    if placement.has_simple_border(slit, &sides, member) {
        return false;
    }
    let mut index = placement.index(slit, &small.faces);
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for &f in &small.faces {
        let triangle = placement.triangle(slit, f);
        for p in triangle {
            for i in 0..2 {
                low[i] = low[i].min(p[i]);
                high[i] = high[i].max(p[i]);
            }
        }
        index.insert(triangle);
    }
    large.faces.iter().any(|&f| {
        let t = placement.triangle(slit, f);
        let outside =
            (0..2).any(|i| t.iter().all(|p| p[i] <= low[i]) || t.iter().all(|p| p[i] >= high[i]));
        !outside && index.overlaps(&t)
    })
}
