//! Patches divided where their parts hold the surface better with the same number of texels.
//!
//! *Enters:* patches, a budget of texels. *Leaves:* patches that fill their images better, vary less in scale, and meet along creases.
//!
//! What a patch costs is its error plus what its texels are worth, both by [`Demand`](super::demand::Demand) with the texel that makes the sum least. Costs add up, and a
//! division that lowers their sum lets all images together hold the surface better with as many texels: where the error falls with the square of their number,
//! the cube of the sum is what it comes to. So each division gains a number of decibels, and the best is made first, until none gains enough.
//!
//! Parts of two patches may lie well in one image where the whole ones overlapped, so neighbours are united (`unite`) afterwards while that saves anything.
//!
//! Divisions that are tried: along creases, by straight lines, and between less scale and more. Parts of what is injective and within the range of scale are so too; each is
//! kept a disk. *Not guaranteed:* the best of all divisions.

mod unite;

use super::PatchParams;
use super::bend::Bends;
use super::demand::{self, Budget, Demand, Sums};
use super::overlap::Triangle;
use super::rectangle::smallest;
use super::resolution::coarsest;
use super::segment::{CLEAR, Placement, Sets, centroid, place, rounded_ln, split_at_holes};
use super::slit::Slit;
use crate::atlas::plane::wrap_angle;
use crate::geometry::ids::{FaceId, FaceVec, NONE};
use std::cmp::Reverse;
use std::collections::VecDeque;

/// Decibels that each patch more must gain.
const LEAST_GAIN: f64 = 0.015;
/// Directions of lines, from that of the patch's rectangle on.
const DIRECTIONS: usize = 4;
/// Lines that are estimated in each direction; the ends of their strips meet no regular grid.
const LINES: usize = 40;
const OFFSET: f64 = 0.3719;
/// The best of them that are looked at closely.
const CANDIDATES: usize = 3;
/// A part with less than this share of the patch's area and of its bend goes to the other side of the line, or of the crease.
const CRUMB: f64 = 0.02;
/// Thresholds of scale that are tried lie this far apart, or a little less.
const SCALE_STEP: f64 = 0.5;

/// A patch in parts.
struct Division {
    parts: Vec<Vec<FaceId>>,
    /// What they cost less.
    saved: f64,
}

/// A patch with the division that saves most.
struct Row {
    faces: Vec<FaceId>,
    division: Option<Division>,
    /// Where it is placed like the central chart: by how much two of its faces overlap at the most. Infinite where nobody has looked.
    clear: f64,
}

/// What division needs to know of a surface, and scratch space.
pub(super) struct Divider<'a> {
    sets: Sets<'a>,
    slit: &'a Slit<'a>,
    bends: Bends,
    budget: Budget,
    params: &'a PatchParams,
    /// Scratch space of [`Divider::by_creases`].
    label: FaceVec<u32>,
    /// Whether nothing but creases divides.
    only_creases: bool,
}

/// Faces of every patch ascending, patches by their first face.
fn in_order(mut patches: Vec<Vec<FaceId>>) -> Vec<Vec<FaceId>> {
    for patch in &mut patches {
        patch.sort();
    }
    patches.sort_by_key(|p| p.first().copied());
    patches
}

impl Division {
    /// Decibels for each patch more, where all patches together cost `sum`.
    fn gain(&self, sum: f64) -> f64 {
        let more = self.parts.len().saturating_sub(1).max(1);
        let then = (sum - self.saved).max(f64::MIN_POSITIVE);
        30.0 * (sum / then).log10() / more as f64
    }
}

impl<'a> Divider<'a> {
    pub fn new(slit: &'a Slit<'a>, params: &'a PatchParams) -> Self {
        Self {
            sets: Sets::new(slit),
            slit,
            bends: Bends::new(slit),
            budget: Budget::default(),
            params,
            label: FaceVec::filled(NONE, slit.connectivity.face_count()),
            only_creases: false,
        }
    }

    /// Divides patches, and unites parts again; see the module docs. A patch may span this range of log scale; `own` is scratch space, a
    /// place a copy.
    pub fn divide(
        &mut self,
        patches: Vec<Vec<FaceId>>,
        range: f64,
        own: &mut [[f64; 2]],
    ) -> Vec<Vec<FaceId>> {
        let patches = self.in_divisions(patches, own);
        in_order(self.unite(patches, range, own))
    }

    /// Divides patches where creases are, and nowhere else.
    pub fn divide_along_creases(
        &mut self,
        patches: Vec<Vec<FaceId>>,
        own: &mut [[f64; 2]],
    ) -> Vec<Vec<FaceId>> {
        self.only_creases = true;
        in_order(self.in_divisions(patches, own))
    }

    /// Finds what a texel is worth where the images are these, and their cost together.
    fn appraise(&mut self, patches: &[Vec<FaceId>], own: &mut [[f64; 2]]) -> f64 {
        let demands: Vec<Demand> = patches
            .iter()
            .map(|faces| {
                let (sums, border) = self.sums_and_border(faces);
                let placement = self.placed(faces, &border, own);
                Outline::new(self.slit, sums, &border, &placement).demand
            })
            .collect();
        let least: Vec<f64> = demands.iter().map(|d| coarsest(d, self.params)).collect();
        self.budget = demand::budget(&demands, &least, self.params);
        demands.iter().map(|d| self.cost(d)).sum()
    }

    /// Makes the best division as long as one gains enough.
    fn in_divisions(
        &mut self,
        patches: Vec<Vec<FaceId>>,
        own: &mut [[f64; 2]],
    ) -> Vec<Vec<FaceId>> {
        let mut sum = self.appraise(&patches, own);
        let rows = patches.into_iter();
        let mut rows: Vec<Row> = rows
            .map(|faces| self.best_division(faces, f64::INFINITY, own))
            .collect();
        loop {
            let room = self
                .params
                .max_count
                .map(|most| most.saturating_sub(rows.len()));
            let fits = |d: &&Division| room.is_none_or(|room| d.parts.len() <= room + 1);
            let gain = |row: &Row| {
                let division = row.division.as_ref().filter(fits);
                division.map_or(0.0, |division| division.gain(sum))
            };
            // Rounded: the last digits must not decide.
            let best = (0..rows.len()).max_by_key(|&i| ((gain(&rows[i]) * 1e6) as i64, Reverse(i)));
            let Some(best) = best.filter(|&i| gain(&rows[i]) >= LEAST_GAIN) else {
                break;
            };
            let row = rows.swap_remove(best);
            let Some(division) = row.division else { break };
            sum -= division.saved;
            for faces in division.parts {
                rows.push(self.best_division(faces, row.clear, own));
            }
        }
        rows.into_iter().map(|row| row.faces).collect()
    }

    /// Coordinates of a patch with its border.
    fn placed<'p>(
        &mut self,
        faces: &[FaceId],
        border: &[FaceId],
        own: &'p mut [[f64; 2]],
    ) -> Placement<'p>
    where
        'a: 'p,
    {
        let slit = self.slit;
        let root = faces.iter().copied().min().unwrap_or(FaceId::new(0));
        let stamp = self.sets.mark(faces);
        let member = |f: FaceId| self.sets.has(f, stamp);
        let highest = highest(slit, faces);
        // The border is as large as the patch.
        place(slit, border.iter().copied(), root, highest, member, own)
    }

    /// How a patch is best divided, of whose faces no two overlap by more than `clear` in the central chart.
    fn best_division(&mut self, faces: Vec<FaceId>, clear: f64, own: &mut [[f64; 2]]) -> Row {
        let slit = self.slit;
        let (sums, border) = self.sums_and_border(&faces);
        let placement = self.placed(&faces, &border, own);
        let is_central = !slit.is_deep(highest(slit, &faces));
        // Elsewhere the patch has been placed anew.
        let mut clear = if is_central { clear } else { f64::INFINITY };
        let outline = Outline::new(slit, sums, &border, &placement);
        let now = self.cost(&outline.demand);
        let mut tried = Vec::new();
        for side in self.by_creases(&faces) {
            tried.extend(self.sets.components(&side));
        }
        let mut tried = vec![tried];
        if !self.only_creases {
            tried.extend(self.by_lines(&faces, &placement, &outline));
            tried.extend(self.by_scale(&faces));
        }
        let mut found: Vec<(i64, Division)> = Vec::new();
        for parts in tried {
            let division = self.in_parts(parts, now, &placement);
            found.extend(division.map(|division| {
                let share = division.saved / now.max(f64::MIN_POSITIVE);
                let more = division.parts.len() as f64 - 1.0;
                (-(share / more * 1e9) as i64, division)
            }));
        }
        // Stable: of equals the first.
        found.sort_by_key(|f| f.0);
        let mut has_looked = false;
        let mut is_injective = |faces_of_part: &Vec<FaceId>| {
            let part = faces_of_part.iter().copied();
            let part = Placement::new(slit, placement.positions, part);
            if part.tolerance() < clear && !has_looked {
                has_looked = true;
                let least = CLEAR * placement.tolerance();
                if placement.is_injective_by(slit, &faces, least) {
                    clear = least;
                }
            }
            part.tolerance() >= clear || part.is_injective(slit, faces_of_part)
        };
        let mut found = found.into_iter().map(|f| f.1);
        let division = found.find(|division| division.parts.iter().all(&mut is_injective));
        let clear = if is_central { clear } else { f64::INFINITY };
        Row {
            faces,
            division,
            clear,
        }
    }

    /// A division into the disks that connected parts are made of; `None` where there is one only, or they cost more.
    fn in_parts(
        &mut self,
        connected: Vec<Vec<FaceId>>,
        now: f64,
        placement: &Placement,
    ) -> Option<Division> {
        let mut parts = Vec::new();
        for part in connected {
            split_at_holes(&mut self.sets, part, placement, &mut parts);
        }
        if parts.len() < 2 {
            return None;
        }
        let mut saved = now;
        for faces in &parts {
            let (sums, border) = self.sums_and_border(faces);
            let outline = Outline::new(self.slit, sums, &border, placement);
            saved -= self.cost(&outline.demand);
            if saved <= 0.0 {
                return None;
            }
        }
        Some(Division { parts, saved })
    }

    /// Areas and bend of a patch.
    pub fn sums(&mut self, faces: &[FaceId]) -> Sums {
        self.sums_and_border(faces).0
    }

    /// Areas and bend of a patch, and its faces that have a side on its border.
    fn sums_and_border(&mut self, faces: &[FaceId]) -> (Sums, Vec<FaceId>) {
        let slit = self.slit;
        let stamp = self.sets.mark(faces);
        let mut border = Vec::new();
        let mut sums = Sums::default();
        for &f in faces {
            let is_inside = |g| self.sets.has(g, stamp);
            let beside = slit.neighbours(f).filter(|&g| is_inside(g));
            let own = if beside.count() == 3 {
                self.bends.of_face[f]
            } else {
                border.push(f);
                self.bends.inside(slit, f, is_inside)
            };
            sums = sums.and(own);
        }
        (sums, border)
    }

    /// Error and texels, as if they were one.
    fn cost(&self, demand: &Demand) -> f64 {
        let texel = demand
            .texel(&self.budget)
            .min(coarsest(demand, self.params));
        let cost =
            demand.error(texel) + self.budget.worth * demand.texels(texel, self.budget.margin);
        // A patch without extent has no texel.
        if cost.is_finite() { cost } else { 0.0 }
    }

    /// Parts between creases; crumbs belong to the part that is fewest faces away. None where creases enclose nothing large.
    fn by_creases(&mut self, faces: &[FaceId]) -> Vec<Vec<FaceId>> {
        let slit = self.slit;
        let c = slit.connectivity;
        let stamp = self.sets.mark(faces);
        let beside = |sets: &Sets, f: FaceId| {
            c.face_halfedges(f).map(|h| {
                let g = slit.beside(h).filter(|&g| sets.has(g, stamp));
                g.map(|g| (g, c.edge(h)))
            })
        };
        let has_crease = |f| c.face_edges(f).into_iter().any(|e| self.bends.is_crease[e]);
        if !faces.iter().any(|&f| has_crease(f)) {
            return Vec::new();
        }
        let mut parts: Vec<(Vec<FaceId>, f64)> = Vec::new();
        faces.iter().for_each(|&f| self.label[f] = NONE);
        for &first in faces {
            if self.label[first] != NONE {
                continue;
            }
            self.label[first] = 0;
            let (mut part, mut area) = (vec![first], 0.0);
            let mut next = 0;
            while let Some(&f) = part.get(next) {
                next += 1;
                area += slit.source_area[f];
                for (g, e) in beside(&self.sets, f).into_iter().flatten() {
                    if !self.bends.is_crease[e] && self.label[g] == NONE {
                        self.label[g] = 0;
                        part.push(g);
                    }
                }
            }
            parts.push((part, area));
        }
        let least = CRUMB * parts.iter().map(|part| part.1).sum::<f64>();
        parts.retain(|part| part.1 >= least);
        if parts.len() < 2 {
            return Vec::new();
        }
        faces.iter().for_each(|&f| self.label[f] = NONE);
        let mut queue: VecDeque<FaceId> = VecDeque::new();
        for (own, (part, _)) in (0u32..).zip(&parts) {
            part.iter().for_each(|&f| self.label[f] = own);
            queue.extend(part);
        }
        while let Some(f) = queue.pop_front() {
            for (g, _) in beside(&self.sets, f).into_iter().flatten() {
                if self.label[g] == NONE {
                    self.label[g] = self.label[f];
                    queue.push_back(g);
                }
            }
        }
        // In the order given, as all sets of faces are.
        let mut sides = vec![Vec::new(); parts.len()];
        for &f in faces {
            if let Some(side) = sides.get_mut(self.label[f] as usize) {
                side.push(f);
            }
        }
        sides
    }

    /// The sides of the lines that promise most, by the rectangles in their direction.
    fn by_lines(
        &mut self,
        faces: &[FaceId],
        placement: &Placement,
        outline: &Outline,
    ) -> Vec<Vec<Vec<FaceId>>> {
        let slit = self.slit;
        let triangles = faces.iter().map(|&f| placement.triangle(slit, f));
        let triangles: Vec<Triangle> = triangles.collect();
        let mut promised: Vec<(i64, usize, usize)> = Vec::new();
        let mut strips: Vec<Vec<u8>> = Vec::new();
        for direction in 0..DIRECTIONS {
            let angle = outline.angle + std::f64::consts::PI * direction as f64 / DIRECTIONS as f64;
            let axis = [angle.cos(), angle.sin()];
            let along = |p: [f64; 2]| {
                [
                    axis[0] * p[0] + axis[1] * p[1],
                    axis[0] * p[1] - axis[1] * p[0],
                ]
            };
            let mut range = Extent::default();
            outline
                .border
                .iter()
                .flatten()
                .for_each(|&p| range.add(along(p)));
            let (low, length) = (range.low[0], range.high[0] - range.low[0]);
            let mut strip = Vec::with_capacity(faces.len());
            let mut rows = vec![(Sums::default(), Extent::default()); LINES + 1];
            for (&f, t) in faces.iter().zip(&triangles) {
                let t = t.map(along);
                let at = (centroid(&t)[0] - low) / length.max(f64::MIN_POSITIVE);
                let at = (at * (LINES as f64 + OFFSET)).clamp(0.0, LINES as f64) as usize;
                strip.push(at as u8);
                rows[at].0 = rows[at].0.and(self.bends.of_face[f]);
                t.into_iter().for_each(|p| rows[at].1.add(p));
            }
            let below = self.running(rows.iter());
            let above = self.running(rows.iter().rev());
            for line in 1..=LINES {
                let (one, other) = (below[line - 1], above[LINES - line]);
                if one > 0.0 && other > 0.0 {
                    promised.push((rounded_ln(one + other), direction, line));
                }
            }
            strips.push(strip);
        }
        promised.sort_unstable();
        // One a direction: its neighbours are much the same.
        let mut seen = [false; DIRECTIONS];
        promised.retain(|&(_, direction, _)| !std::mem::replace(&mut seen[direction], true));
        promised.truncate(CANDIDATES);
        let sides = promised.into_iter().map(|(_, direction, line)| {
            let is_below = strips[direction].iter().map(|&s| usize::from(s) < line);
            let is_below: Vec<bool> = is_below.collect();
            self.without_crumbs(faces, &is_below)
        });
        sides.collect()
    }

    /// Connected parts of less scale and of more: a texel is of one width in the plane, so where scale is least the surface is held worst.
    fn by_scale(&mut self, faces: &[FaceId]) -> Vec<Vec<Vec<FaceId>>> {
        let slit = self.slit;
        let scales = faces.iter().map(|&f| slit.log_scale[f]);
        let lowest = scales.fold(f64::INFINITY, f64::min);
        let range = highest(slit, faces) - lowest;
        let steps = (range / SCALE_STEP).ceil().min(64.0) as usize;
        let thresholds = (1..steps).map(|i| lowest + range * i as f64 / steps as f64);
        let thresholds: Vec<f64> = thresholds.collect();
        let sides = thresholds.into_iter().map(|most| {
            let is_below = faces.iter().map(|&f| slit.log_scale[f] <= most);
            let is_below: Vec<bool> = is_below.collect();
            self.without_crumbs(faces, &is_below)
        });
        sides.collect()
    }

    /// Cost of the rows so far, for every number of rows.
    fn running<'r>(&self, rows: impl Iterator<Item = &'r (Sums, Extent)>) -> Vec<f64> {
        let (mut sums, mut extent) = (Sums::default(), Extent::default());
        rows.map(|row| {
            sums = sums.and(row.0);
            extent.low = [0, 1].map(|i| extent.low[i].min(row.1.low[i]));
            extent.high = [0, 1].map(|i| extent.high[i].max(row.1.high[i]));
            let sides = [0, 1].map(|i| (extent.high[i] - extent.low[i]).max(0.0));
            self.cost(&Demand { sums, sides })
        })
        .collect()
    }

    /// Connected parts of the two sides, small pieces in the side that surrounds them.
    fn without_crumbs(&mut self, faces: &[FaceId], is_below: &[bool]) -> Vec<Vec<FaceId>> {
        // Few texels hold a small piece, unless it bends most.
        let weights = |part: &[FaceId]| {
            let sums = part.iter().map(|&f| self.bends.of_face[f]);
            let sums = sums.fold(Sums::default(), Sums::and);
            [sums.area, sums.bend[1]]
        };
        let least = weights(faces).map(|weight| CRUMB * weight);
        let mut sides: [Vec<Vec<FaceId>>; 2] = Default::default();
        let mut is_whole = true;
        for side in [false, true] {
            let own = faces.iter().zip(is_below).filter(|row| *row.1 == side);
            let own: Vec<FaceId> = own.map(|row| *row.0).collect();
            for component in self.sets.components(&own) {
                let own = weights(&component);
                let is_small = own[0] < least[0] && own[1] <= least[1];
                is_whole &= !is_small;
                sides[usize::from(side != is_small)].push(component);
            }
        }
        let parts = sides.into_iter().flat_map(|side| {
            if is_whole {
                side
            } else {
                self.sets.components(&side.concat())
            }
        });
        parts.collect()
    }
}

/// What a patch asks for, and where its rectangle lies.
struct Outline {
    demand: Demand,
    /// Direction of the rectangle's longer side.
    angle: f64,
    /// The faces that have a side on the border.
    border: Vec<Triangle>,
}

impl Outline {
    fn new(slit: &Slit, sums: Sums, border: &[FaceId], placement: &Placement) -> Self {
        let border = border.iter().map(|&f| placement.triangle(slit, f));
        let border: Vec<Triangle> = border.collect();
        let rectangle = smallest(&border);
        let sides = [rectangle.width, rectangle.width * rectangle.height];
        Self {
            demand: Demand { sums, sides },
            angle: wrap_angle(rectangle.angle),
            border,
        }
    }
}

/// Greatest log scale of some faces.
fn highest(slit: &Slit, faces: &[FaceId]) -> f64 {
    let scales = faces.iter().map(|&f| slit.log_scale[f]);
    scales.fold(f64::NEG_INFINITY, f64::max)
}

/// Least and greatest coordinates.
#[derive(Clone, Copy)]
struct Extent {
    low: [f64; 2],
    high: [f64; 2],
}

impl Default for Extent {
    fn default() -> Self {
        Self {
            low: [f64::INFINITY; 2],
            high: [f64::NEG_INFINITY; 2],
        }
    }
}

impl Extent {
    fn add(&mut self, p: [f64; 2]) {
        self.low = [0, 1].map(|i| self.low[i].min(p[i]));
        self.high = [0, 1].map(|i| self.high[i].max(p[i]));
    }
}

#[cfg(test)]
mod tests;
