//! The slit disk divided into patches: connected sets of faces that lie injectively in the plane, stay
//! within a range of log scale, and are topological disks.
//!
//! 1. Take the largest part that is left. Choose the window of log scale that holds most of its area.
//! 2. In each large connected region of that window start at the face farthest from the region's
//!    border and add faces in the order of their distance, except those that overlap the patch.
//! 3. What was grown around faces of another scale has holes: split it by a straight line through
//!    the largest hole, until there is none. (The sheet itself makes no holes: an immersed disk whose
//!    border is a simple curve is embedded, so what a patch surrounds in the plane belongs to it.)
//! 4. Merge neighbours while all three conditions hold, smallest first (`merge`); divide small patches
//!    among their neighbours where none can take them whole; what is still tiny and is to become rectangles grows (`dissolve`).
//!
//! Everything that is compared is rounded first and ties go to the lower id, so that a change in the
//! last digits of the metric does not change the patches.

use super::Domain;
use super::dissolve::{dissolve, widen};
use super::merge::merge;
use super::overlap::{Triangle, TriangleIndex, size};
use super::slit::Slit;
use crate::geometry::ids::{FaceId, FaceVec, HalfedgeId};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap, HashMap, VecDeque};

/// Patches are grown in a window of this part of the allowed range. What is left of it lets them take in the
/// crumbs at the window's border afterwards, where single faces lie just outside.
const GROWTH: f64 = 0.9;

/// Two sheets that overlap by no more than this part of the *patch's* extent touch. The chart's extent would
/// not do: a patch may be a thousandth of it, and what touches there overlaps in the patch.
pub(super) const TOUCHING: f64 = 1e-10;

/// Rounds of merging and dividing: each can make the other possible again, hardly ever often.
const ROUNDS: usize = 3;

/// A rounded positive number: equal up to six digits, comparable.
pub(super) fn rounded_ln(x: f64) -> i64 {
    (x.max(f64::MIN_POSITIVE).ln() * 1e6).round() as i64
}

/// Where the faces of a region lie, and what counts as touching there.
pub(super) struct Placement<'a> {
    pub positions: &'a [[f64; 2]],
    /// Diagonal of the faces' bounding box.
    pub extent: f64,
}

impl<'a> Placement<'a> {
    pub fn new(
        slit: &Slit,
        positions: &'a [[f64; 2]],
        faces: impl IntoIterator<Item = FaceId>,
    ) -> Placement<'a> {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for copy in faces.into_iter().flat_map(|f| slit.copies(f)) {
            for i in 0..2 {
                low[i] = low[i].min(positions[copy][i]);
                high[i] = high[i].max(positions[copy][i]);
            }
        }
        // A set without extent is measured by nothing, but nothing is divided by zero.
        let extent = crate::atlas::plane::distance(low, high).max(f64::MIN_POSITIVE);
        Placement { positions, extent }
    }

    pub fn triangle(&self, slit: &Slit, f: FaceId) -> Triangle {
        slit.copies(f).map(|c| self.positions[c])
    }

    pub fn tolerance(&self) -> f64 {
        TOUCHING * self.extent
    }

    /// True where no two faces of a disk overlap, of which those with a side on its border are given.
    ///
    /// They are enough: where two sheets of a disk overlap the border of one ends, and it crosses the border of the other, since an immersed disk whose border is
    /// a simple curve is embedded.
    pub fn is_injective(&self, slit: &Slit, border: &[FaceId]) -> bool {
        let mut index = self.index(slit, border);
        border.iter().all(|&f| {
            let triangle = self.triangle(slit, f);
            let free = !index.overlaps(&triangle);
            index.insert(triangle);
            free
        })
    }

    /// An index for triangles as large as those of these faces.
    pub fn index(&self, slit: &Slit, faces: &[FaceId]) -> TriangleIndex {
        let sizes = faces
            .iter()
            .fold([f64::INFINITY, 0.0f64], |[low, high], &f| {
                let s = size(&self.triangle(slit, f));
                [low.min(s), high.max(s)]
            });
        TriangleIndex::new(sizes, self.tolerance())
    }
}

/// Coordinates of a connected set of faces, central or own as its log scale asks for. `own` is
/// scratch space, a place a copy.
pub(super) fn place<'a>(
    slit: &'a Slit,
    faces: impl IntoIterator<Item = FaceId>,
    root: FaceId,
    highest: f64,
    member: impl Fn(FaceId) -> bool,
    own: &'a mut [[f64; 2]],
) -> Placement<'a> {
    let positions = if slit.is_deep(highest) {
        slit.develop(root, member, own);
        &*own
    } else {
        slit.central.as_slice()
    };
    Placement::new(slit, positions, faces)
}

/// Divides the slit disk; every face is in exactly one set. `range` bounds the regional log scale of each.
pub(super) fn segment(slit: &Slit, range: f64, domain: Domain) -> Vec<Vec<FaceId>> {
    let mut sets = Sets::new(slit);
    let total: f64 = slit.source_area.iter().sum();
    let mut own = vec![[0.0; 2]; slit.development.copies];
    let mut queue = BinaryHeap::new();
    let mut all: Vec<FaceId> = slit.connectivity.faces().collect();
    all.sort_by(|&a, &b| {
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
    for round in 0..ROUNDS {
        let count = patches.len();
        patches = merge(slit, patches, range, &mut own);
        if round > 0 && patches.len() == count {
            break;
        }
        patches = dissolve(slit, patches, range, &mut own);
        if patches.len() == count {
            break;
        }
    }
    // A small flat image costs less than the ragged border that a crumb leaves in its neighbours.
    let mut patches = match domain {
        Domain::Flat => patches,
        Domain::Rectangle => widen(slit, patches, range, &mut own),
    };
    for patch in &mut patches {
        patch.sort();
    }
    patches.sort_by_key(|p| p.first().copied());
    patches
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
        let stamp = sets.mark(&region);
        let member = |f| sets.stamp[f] == stamp;
        let placement = place(slit, region.iter().copied(), seed, highest, member, own);
        let grown = grow(sets, &region, seed, stamp, &placement);
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
            if is_known || closer.is_injective(slit, &sets.border(&disk)) {
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

fn partition(faces: &[FaceId], keep: impl Fn(FaceId) -> bool) -> (Vec<FaceId>, Vec<FaceId>) {
    faces.iter().partition(|&&f| keep(f))
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

/// Sets of faces as stamps, so that membership costs one comparison and nothing is cleared.
pub(super) struct Sets<'a> {
    slit: &'a Slit<'a>,
    stamp: FaceVec<u32>,
    /// The same for copies.
    copy_stamp: Vec<u32>,
    /// Scratch space of [`halves`].
    sides: FaceVec<u8>,
    last: u32,
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

    /// Euler characteristic of a set of faces: 1 for a connected set that is a disk.
    fn euler_characteristic(&mut self, faces: &[FaceId]) -> i64 {
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
    fn innermost(&mut self, region: &[FaceId]) -> FaceId {
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

pub(super) fn centroid(t: &Triangle) -> [f64; 2] {
    std::array::from_fn(|i| (t[0][i] + t[1][i] + t[2][i]) / 3.0)
}

/// Faces of a region (those with the stamp, which is taken from some) that lie injectively in the plane, nearest to the seed
/// first.
fn grow(
    sets: &mut Sets,
    region: &[FaceId],
    seed: FaceId,
    stamp: u32,
    placement: &Placement,
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
        // What overlaps now will always: the patch only grows.
        if index.overlaps(&triangle) {
            continue;
        }
        index.insert(triangle);
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
    let mut count = [0; DIRECTIONS];
    for &f in faces {
        let p = centroid(&placement.triangle(slit, f));
        let p = [p[0] - centre[0], p[1] - centre[1]];
        let mut sides = 0;
        for (i, d) in directions.iter().enumerate() {
            let is_left = d[0] * p[1] - d[1] * p[0] > -tolerance;
            sides |= u8::from(is_left) << i;
            count[i] += usize::from(is_left);
        }
        sets.sides[f] = sides;
    }
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
    let best = (0..DIRECTIONS)
        .filter(|&i| count[i] > 0 && count[i] < faces.len())
        .min_by_key(|&i| (rounded_ln(cut[i] / placement.extent), i));
    match best {
        Some(i) => partition(faces, |f| sets.sides[f] >> i & 1 == 1),
        // No line through the point divides them: take off one face, which is a disk.
        None => (faces[..1].to_vec(), faces[1..].to_vec()),
    }
}

/// Border length in space between a patch and each of its neighbours on the slit disk.
pub(super) fn borders(
    slit: &Slit,
    faces: &[FaceId],
    label: &FaceVec<u32>,
    own: u32,
) -> BTreeMap<u32, f64> {
    let mut borders = BTreeMap::new();
    for &f in faces {
        for h in slit.connectivity.face_halfedges(f) {
            if let Some(n) = slit.beside(h) {
                let other = label[n];
                if other != own {
                    *borders.entry(other).or_insert(0.0) += slit.source_length(h);
                }
            }
        }
    }
    borders
}
