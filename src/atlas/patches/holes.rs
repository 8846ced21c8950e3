//! Connected injective sets cut into disks.

use super::placement::{Placement, centroid, rounded_ln};
use super::sets::{Sets, partition};
use crate::geometry::ids::{FaceId, HalfedgeId};
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::{BTreeSet, HashMap};

/// Cuts a connected injective set into disks along straight lines through its holes.
pub(super) fn split_at_holes(
    sets: &mut Sets,
    faces: Vec<FaceId>,
    placement: &Placement,
    disks: &mut Vec<Vec<FaceId>>,
) {
    let mut stack = vec![faces];
    while let Some(faces) = stack.pop() {
        if sets.euler_characteristic(&faces) == 1 {
            disks.push(faces);
            continue;
        }
        let centre = largest_hole(sets, &faces, placement);
        let (left, right) = halves(sets, &faces, centre, placement);
        let mut parts = sets.components(&left);
        parts.extend(sets.components(&right));
        stack.extend(parts);
    }
}

/// The middle of the largest hole of a connected injective set that is no disk.
fn largest_hole(sets: &mut Sets, faces: &[FaceId], placement: &Placement) -> [f64; 2] {
    let (slit, stamp) = (sets.slit, sets.mark(faces));
    let c = slit.connectivity;
    let inner = |h: HalfedgeId| slit.across(h).filter(|&t| sets.stamp[c.face(t)] == stamp);
    let place = |h: HalfedgeId| placement.positions[slit.development.copy[h] as usize];
    let mut seen: BTreeSet<HalfedgeId> = BTreeSet::new();
    let mut cycles: Vec<(f64, [f64; 2])> = Vec::new();
    let border = faces.iter().flat_map(|&f| c.face_halfedges(f));
    for start in border.filter(|&h| inner(h).is_none()) {
        // Walk along the border, and close a simple cycle whenever a copy comes again: a set that
        // touches itself in a vertex has a hole there too.
        let mut path: Vec<HalfedgeId> = Vec::new();
        let mut at: HashMap<u32, usize> = HashMap::new();
        let mut h = start;
        while seen.insert(h) {
            let copy = slit.development.copy[h];
            if let Some(&from) = at.get(&copy) {
                cycles.push(area_and_middle(path[from..].iter().map(|&h| place(h))));
                for h in path.drain(from..) {
                    at.remove(&slit.development.copy[h]);
                }
            }
            at.insert(copy, path.len());
            path.push(h);
            h = c.next(h);
            while let Some(t) = inner(h) {
                h = c.next(t);
            }
        }
        if !path.is_empty() {
            cycles.push(area_and_middle(path.iter().map(|&h| place(h))));
        }
    }
    // The outer border is the largest cycle, the largest hole the second.
    let unit = placement.extent * placement.extent;
    cycles.sort_by_key(|cycle| Reverse(rounded_ln(cycle.0.abs() / unit)));
    let last = cycles.get(1).or(cycles.first());
    last.map_or([0.0; 2], |cycle| cycle.1)
}

/// Signed area and mean of the corners of a polygon.
fn area_and_middle(points: impl ExactSizeIterator<Item = [f64; 2]> + Clone) -> (f64, [f64; 2]) {
    let n = points.len().max(1) as f64;
    let sum = points
        .clone()
        .fold([0.0; 2], |s, p| [s[0] + p[0], s[1] + p[1]]);
    let middle = sum.map(|s| s / n);
    let relative: Vec<[f64; 2]> = points
        .map(|p| [p[0] - middle[0], p[1] - middle[1]])
        .collect();
    let doubled: f64 = (0..relative.len())
        .map(|i| {
            let (p, q) = (relative[i], relative[(i + 1) % relative.len()]);
            p[0] * q[1] - p[1] * q[0]
        })
        .sum();
    (0.5 * doubled, middle)
}

/// Directions of the lines that are tried through a hole.
const DIRECTIONS: usize = 8;
/// Faces that one thread looks at: as many for any number of threads, since sums are rounded.
const CHUNK: usize = 1 << 14;

/// The faces on both sides of the line through a point that cuts the shortest way, of eight directions.
fn halves(
    sets: &mut Sets,
    faces: &[FaceId],
    centre: [f64; 2],
    placement: &Placement,
) -> (Vec<FaceId>, Vec<FaceId>) {
    let slit = sets.slit;
    let stamp = sets.mark(faces);
    let directions: [[f64; 2]; DIRECTIONS] = std::array::from_fn(|i| {
        // An offset that no regular grid has for a direction.
        let angle = std::f64::consts::PI * i as f64 / DIRECTIONS as f64 + 0.1234;
        [angle.cos(), angle.sin()]
    });
    // A bit a line, set for the faces on its left.
    let tolerance = placement.tolerance();
    let sides = |&f: &FaceId| {
        let p = centroid(&placement.triangle(slit, f));
        let p = [p[0] - centre[0], p[1] - centre[1]];
        let is_left = |d: &[f64; 2]| d[0] * p[1] - d[1] * p[0] > -tolerance;
        let bits = directions.iter().enumerate();
        bits.fold(0, |bits, (i, d)| bits | u8::from(is_left(d)) << i)
    };
    let sides = faces.par_iter().with_min_len(CHUNK).map(sides);
    let sides: Vec<u8> = sides.collect();
    let mut count_of = [0; 1 << DIRECTIONS];
    for (&f, bits) in faces.iter().zip(sides) {
        sets.sides[f] = bits;
        count_of[usize::from(bits)] += 1;
    }
    let count: [usize; DIRECTIONS] = std::array::from_fn(|i| {
        let is_left = |bits: &usize| bits >> i & 1 == 1;
        let all = (0..count_of.len()).filter(is_left);
        all.map(|bits| count_of[bits]).sum()
    });
    let of_chunk = |faces: &[FaceId]| {
        let mut cut = [0.0; DIRECTIONS];
        for &f in faces {
            for h in slit.connectivity.face_halfedges(f) {
                let Some(n) = slit.beside(h) else { continue };
                // Hardly any two neighbours have a line between them.
                let between = sets.sides[f] & !sets.sides[n];
                if between != 0 && sets.stamp[n] == stamp {
                    for (i, cut) in cut.iter_mut().enumerate() {
                        if between >> i & 1 == 1 {
                            *cut += slit.length[slit.connectivity.edge(h)];
                        }
                    }
                }
            }
        }
        cut
    };
    let chunks: Vec<[f64; DIRECTIONS]> = faces.par_chunks(CHUNK).map(of_chunk).collect();
    let cut: [f64; DIRECTIONS] = std::array::from_fn(|i| chunks.iter().map(|cut| cut[i]).sum());
    let best = (0..DIRECTIONS)
        .filter(|&i| count[i] > 0 && count[i] < faces.len())
        .min_by_key(|&i| (rounded_ln(cut[i] / placement.extent), i));
    match best {
        Some(i) => partition(faces, |f| sets.sides[f] >> i & 1 == 1),
        // No line through the point divides them: take off one face, which is a disk.
        None => (faces[..1].to_vec(), faces[1..].to_vec()),
    }
}
