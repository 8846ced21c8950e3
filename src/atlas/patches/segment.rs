//! The slit disk divided into patches: connected sets of faces that lie injectively in the plane, stay
//! within a range of log scale, and are topological disks.
//!
//! 1. Take the largest part that is left. Choose the window of log scale that holds most of its area.
//! 2. In each large connected region of that window start at the face farthest from the region's
//!    border and add faces in the order of their distance, except those that overlap the patch.
//! 3. What was grown around faces of another scale has holes: split it by a straight line through
//!    the largest hole, until there is none. (The sheet itself makes no holes: an immersed disk whose
//!    border is a simple curve is embedded, so what a patch surrounds in the plane belongs to it.)
//! 4. Merge neighbours while all three conditions hold, smallest first (`merge`).
//!
//! Everything that is compared is rounded first and ties go to the lower id, so that a change in the
//! last digits of the metric does not change the patches.

use super::coverage::Coverage;
use super::holes::split_at_holes;
use super::merge::merge;
use super::overlap::Triangle;
use super::placement::{Placement, centroid, place, rounded_ln};
use super::sets::{Sets, in_order, partition};
use super::slit::Slit;
use crate::geometry::ids::FaceId;
use rayon::prelude::*;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Patches are grown in a window of this part of the allowed range. What is left of it lets them take in the
/// crumbs at the window's border afterwards, where single faces lie just outside.
const GROWTH: f64 = 0.9;

/// Divides the slit disk; every face is in exactly one set. `range` bounds the regional log scale of each.
pub(super) fn segment(slit: &Slit, range: f64) -> Vec<Vec<FaceId>> {
    let mut sets = Sets::new(slit);
    let total: f64 = slit.source_area.iter().sum();
    let mut own = vec![[0.0; 2]; slit.development.copies];
    let mut queue = BinaryHeap::new();
    let mut all: Vec<FaceId> = slit.connectivity.faces().collect();
    all.par_sort_unstable_by(|&a, &b| {
        let key = |f: FaceId| slit.log_scale[f];
        key(a).total_cmp(&key(b)).then(a.cmp(&b))
    });
    // Parts keep their faces in the order of the log scale.
    let enqueue = |queue: &mut BinaryHeap<_>, parts: Vec<Vec<FaceId>>| {
        for part in parts {
            let first = part.iter().copied().min();
            queue.push((rounded_ln(sets_area(slit, &part)), Reverse(first), part));
        }
    };
    enqueue(&mut queue, sets.components(&all));
    let mut patches = Vec::new();
    while let Some((_, _, part)) = queue.pop() {
        let window = best_window(slit, &part, GROWTH * range);
        let (inside, mut rest) = partition(&part, |f| {
            (window[0]..=window[1]).contains(&slit.log_scale[f])
        });
        let mut regions = sets.components(&inside);
        let area_of = |region: &Vec<FaceId>| sets_area(slit, region);
        let largest = regions.iter().map(area_of).fold(0.0, f64::max);
        // Small regions may suit another window better, where there is still much to divide.
        let least = if sets_area(slit, &part) > 1e-3 * total {
            0.1 * largest * (1.0 - 1e-6)
        } else {
            0.0
        };
        regions.sort_by_key(|r| r.iter().copied().min());
        for region in regions {
            if area_of(&region) < least {
                rest.extend(region);
                continue;
            }
            cover(&mut sets, region, &mut own, &mut patches, &mut rest);
        }
        // Back into the order of the log scale.
        let stamp = sets.mark(&rest);
        let (rest, _) = partition(&part, |f| sets.stamp[f] == stamp);
        enqueue(&mut queue, sets.components(&rest));
    }
    patches.sort_by_key(|p| p.iter().copied().min());
    let patches = merge(slit, patches, range, &mut own);
    // A small flat image costs less than the ragged border that a crumb leaves in its neighbours.
    in_order(patches)
}

/// Covers a connected region by disks, each injective at its own extent, and puts what is left over into `rest`.
fn cover(
    sets: &mut Sets,
    region: Vec<FaceId>,
    own: &mut [[f64; 2]],
    disks: &mut Vec<Vec<FaceId>>,
    rest: &mut Vec<FaceId>,
) {
    let slit = sets.slit;
    let mut stack = vec![region];
    while let Some(region) = stack.pop() {
        let scales = region.iter().map(|&f| slit.log_scale[f]);
        let highest = scales.fold(f64::MIN, f64::max);
        let seed = sets.innermost(&region);
        let border = sets.sides(&region);
        let stamp = sets.mark(&region);
        let member = |f| sets.stamp[f] == stamp;
        let placement = place(slit, region.iter().copied(), seed, highest, member, own);
        let coverage = if placement.has_simple_border(slit, &border, member) {
            Coverage::everywhere()
        } else {
            let border: Vec<_> = border.iter().map(|&h| placement.side(slit, h)).collect();
            Coverage::new(region.len(), &border)
        };
        let grown = grow(sets, &region, seed, stamp, &placement, &coverage);
        let stamp = sets.mark(&grown);
        let left_over = region.iter().filter(|&&f| sets.stamp[f] != stamp);
        rest.extend(left_over.copied());
        let mut found = Vec::new();
        split_at_holes(sets, grown, &placement, &mut found);
        for disk in found {
            // A disk smaller than its region is held to a smaller tolerance, and grown again where it fails:
            // then it loses a face at least.
            let positions = placement.positions;
            let closer = Placement::new(slit, positions, disk.iter().copied());
            // The growth has shown it for what is as large.
            let is_known = closer.extent == placement.extent;
            if is_known || closer.is_injective(sets, &disk) {
                disks.push(disk);
            } else {
                stack.push(disk);
            }
        }
    }
}

fn sets_area(slit: &Slit, faces: &[FaceId]) -> f64 {
    faces.iter().map(|&f| slit.source_area[f]).sum()
}

/// The window of log scale of the given length that holds most source area of faces sorted by log scale.
/// Windows that start whole lengths from the least value are preferred unless they hold much less: the
/// others leave scraps between them.
fn best_window(slit: &Slit, sorted: &[FaceId], range: f64) -> [f64; 2] {
    const NEARLY_BEST: f64 = 0.8;
    let scale = |i: usize| slit.log_scale[sorted[i]];
    let lowest = sorted.first().map_or(0.0, |_| scale(0));
    let (mut end, mut sum) = (0, 0.0);
    let (mut best, mut best_sum) = (lowest, f64::MIN);
    for start in 0..sorted.len() {
        while end < sorted.len() && scale(end) <= scale(start) + range {
            sum += slit.source_area[sorted[end]];
            end += 1;
        }
        if sum > best_sum + 1e-6 * best_sum.abs() {
            (best, best_sum) = (scale(start), sum);
        }
        sum -= slit.source_area[sorted[start]];
    }
    let (mut tile, mut tile_best, mut tile_best_sum) = (lowest, lowest, 0.0);
    let mut start = 0;
    while start < sorted.len() {
        let end = start + sorted[start..].partition_point(|&f| slit.log_scale[f] <= tile + range);
        let sum: f64 = sorted[start..end]
            .iter()
            .map(|&f| slit.source_area[f])
            .sum();
        if sum > tile_best_sum * (1.0 + 1e-6) {
            (tile_best, tile_best_sum) = (tile, sum);
        }
        // The next tile starts at a face, so that every step advances however wide the gaps are.
        start = end;
        tile = if start < sorted.len() {
            scale(start)
        } else {
            tile
        };
    }
    let low = if tile_best_sum >= NEARLY_BEST * best_sum {
        tile_best
    } else {
        best
    };
    [low, low + range]
}

/// Faces of a region (those with the stamp, which is taken from some) that lie injectively in the plane, nearest to the seed
/// first.
fn grow(
    sets: &mut Sets,
    region: &[FaceId],
    seed: FaceId,
    stamp: u32,
    placement: &Placement,
    coverage: &Coverage,
) -> Vec<FaceId> {
    let slit = sets.slit;
    let mut index = placement.index(slit, region);
    let start = centroid(&placement.triangle(slit, seed));
    let key = |t: &Triangle| {
        let d = crate::atlas::plane::distance(centroid(t), start);
        (d / placement.extent * 1e7).round() as u64
    };
    sets.last += 1;
    let seen = sets.last;
    sets.stamp[seed] = seen;
    let mut queue = BinaryHeap::from([Reverse((0, seed))]);
    let mut grown = Vec::new();
    while let Some(Reverse((_, f))) = queue.pop() {
        let triangle = placement.triangle(slit, f);
        if !coverage.is_single(&triangle) {
            // What overlaps now will always: the patch only grows.
            if index.overlaps(&triangle) {
                continue;
            }
            index.insert(triangle);
        }
        grown.push(f);
        for n in slit.neighbours(f) {
            if sets.stamp[n] == stamp {
                sets.stamp[n] = seen;
                queue.push(Reverse((key(&placement.triangle(slit, n)), n)));
            }
        }
    }
    grown
}
