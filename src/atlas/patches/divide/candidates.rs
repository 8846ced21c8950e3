//! Where a patch may be divided: along creases, by straight lines, and between less scale and more.

use super::{Divider, Outline, Scratch, highest};
use crate::atlas::patches::demand::{Demand, Sums};
use crate::atlas::patches::overlap::Triangle;
use crate::atlas::patches::placement::{Placement, centroid, rounded_ln};
use crate::atlas::patches::sets::Sets;
use crate::geometry::ids::{FaceId, FaceVec, NONE};
use std::collections::VecDeque;

/// Directions of lines, from that of the patch's rectangle on.
const DIRECTIONS: usize = 4;
/// Lines that are estimated in each direction; the ends of their strips meet no regular grid.
const LINES: usize = 40;
const OFFSET: f64 = 0.3719;
/// They are estimated by about so many faces.
const SAMPLE: usize = 16_384;
/// The best of them that are looked at closely.
const CANDIDATES: usize = 2;
/// A part with less than this share of the patch's area and of its bend goes to the other side of the line, or of the crease.
const CRUMB: f64 = 0.02;
/// Thresholds of scale that are tried lie this far apart, or a little less.
const SCALE_STEP: f64 = 0.5;

/// A way to divide a patch.
pub(super) enum Candidate {
    /// Between creases.
    Creases,
    /// Before a line across strips, and behind it.
    Line(Strips, usize),
    /// Less scale than this, and more.
    Scale(Scales, usize),
}

impl Divider<'_> {
    /// Divisions that are worth a closer look.
    pub(super) fn candidates(
        &self,
        faces: &[FaceId],
        placement: &Placement,
        outline: &Outline,
    ) -> Vec<Candidate> {
        let mut candidates = vec![Candidate::Creases];
        candidates.extend(self.lines(faces, placement, outline));
        candidates.extend(self.scale(faces, outline));
        candidates
    }

    /// The connected parts of a candidate.
    pub(super) fn connected(
        &self,
        candidate: &Candidate,
        faces: &[FaceId],
        placement: &Placement,
        outline: &Outline,
        scratch: &mut Scratch,
    ) -> Vec<Vec<FaceId>> {
        let slit = self.slit;
        let Scratch { sets, label } = scratch;
        let is_below: Vec<bool> = match candidate {
            Candidate::Creases => {
                let sides = self.by_creases(faces, sets, label);
                return sides
                    .iter()
                    .flat_map(|side| sets.components(side))
                    .collect();
            }
            Candidate::Line(strips, line) => {
                let strip = |&f: &FaceId| strips.of(&placement.triangle(slit, f));
                faces.iter().map(|f| strip(f) < *line).collect()
            }
            Candidate::Scale(scales, first) => {
                let step = |&f: &FaceId| scales.step(slit.log_scale[f]);
                faces.iter().map(|f| step(f) < *first).collect()
            }
        };
        self.without_crumbs(faces, &is_below, &outline.demand.sums, sets)
    }

    /// Parts between creases; crumbs belong to the part that is fewest faces away. None where creases enclose nothing large.
    fn by_creases(
        &self,
        faces: &[FaceId],
        sets: &mut Sets,
        label: &mut FaceVec<u32>,
    ) -> Vec<Vec<FaceId>> {
        let slit = self.slit;
        let c = slit.connectivity;
        let stamp = sets.mark(faces);
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
        faces.iter().for_each(|&f| label[f] = NONE);
        for &first in faces {
            if label[first] != NONE {
                continue;
            }
            label[first] = 0;
            let (mut part, mut area) = (vec![first], 0.0);
            let mut next = 0;
            while let Some(&f) = part.get(next) {
                next += 1;
                area += slit.source_area[f];
                for (g, e) in beside(sets, f).into_iter().flatten() {
                    if !self.bends.is_crease[e] && label[g] == NONE {
                        label[g] = 0;
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
        faces.iter().for_each(|&f| label[f] = NONE);
        let mut queue: VecDeque<FaceId> = VecDeque::new();
        for (own, (part, _)) in (0u32..).zip(&parts) {
            part.iter().for_each(|&f| label[f] = own);
            queue.extend(part);
        }
        while let Some(f) = queue.pop_front() {
            for (g, _) in beside(sets, f).into_iter().flatten() {
                if label[g] == NONE {
                    label[g] = label[f];
                    queue.push_back(g);
                }
            }
        }
        // In the order given, as all sets of faces are.
        let mut sides = vec![Vec::new(); parts.len()];
        for &f in faces {
            if let Some(side) = sides.get_mut(label[f] as usize) {
                side.push(f);
            }
        }
        sides
    }

    /// The lines that promise most, by the rectangles in their direction.
    fn lines(
        &self,
        faces: &[FaceId],
        placement: &Placement,
        outline: &Outline,
    ) -> impl Iterator<Item = Candidate> + use<> {
        let slit = self.slit;
        // By their numbers, since their order changes with the last digits of scales.
        let every = faces.len() / SAMPLE + 1;
        let is_sampled = |f: &FaceId| f.index().is_multiple_of(every);
        let sampled = faces.iter().copied().filter(is_sampled);
        let sampled = sampled.map(|f| (placement.triangle(slit, f), self.bends.of_face[f]));
        let sampled: Vec<(Triangle, Sums)> = sampled.collect();
        let each = faces.len() as f64 / sampled.len().max(1) as f64;
        let mut directions = Vec::with_capacity(DIRECTIONS);
        let mut promised: Vec<(i64, usize, usize)> = Vec::new();
        for direction in 0..DIRECTIONS {
            let angle = outline.angle + std::f64::consts::PI * direction as f64 / DIRECTIONS as f64;
            let mut strips = Strips {
                axis: [angle.cos(), angle.sin()],
                low: 0.0,
                length: 1.0,
            };
            let mut range = Extent::default();
            let border = outline.border.iter().flatten();
            border.for_each(|&p| range.add(strips.along(p)));
            strips.low = range.low[0];
            strips.length = (range.high[0] - range.low[0]).max(f64::MIN_POSITIVE);
            let mut rows = vec![(Sums::default(), Extent::default()); LINES + 1];
            for (t, sums) in &sampled {
                let row = &mut rows[strips.of(t)];
                row.0 = row.0.and(sums.times(each));
                t.iter().for_each(|&p| row.1.add(strips.along(p)));
            }
            // Strips end where the border does, and hardly any other face is sampled that shows it.
            for t in &outline.border {
                let row = &mut rows[strips.of(t)];
                t.iter().for_each(|&p| row.1.add(strips.along(p)));
            }
            let below = self.running(rows.iter());
            let above = self.running(rows.iter().rev());
            for line in 1..=LINES {
                let (one, other) = (below[line - 1], above[LINES - line]);
                if one > 0.0 && other > 0.0 {
                    promised.push((rounded_ln(one + other), direction, line));
                }
            }
            directions.push(strips);
        }
        promised.sort_unstable();
        // One a direction: its neighbours are much the same.
        let mut seen = [false; DIRECTIONS];
        promised.retain(|&(_, direction, _)| !std::mem::replace(&mut seen[direction], true));
        promised.truncate(CANDIDATES);
        let line = move |(_, direction, line)| Candidate::Line(directions[direction], line);
        promised.into_iter().map(line)
    }

    /// Where less scale and more promise most, if both fill their rectangles as the patch does: a texel is of one width in the
    /// plane, so where scale is least the surface is held worst.
    fn scale(&self, faces: &[FaceId], outline: &Outline) -> Option<Candidate> {
        let slit = self.slit;
        let scales = faces.iter().map(|&f| slit.log_scale[f]);
        let lowest = scales.fold(f64::INFINITY, f64::min);
        let range = highest(slit, faces) - lowest;
        let steps = (range / SCALE_STEP).ceil().clamp(1.0, 64.0) as usize;
        let scales = Scales {
            lowest,
            range,
            steps,
        };
        let mut rows = vec![Sums::default(); steps];
        for &f in faces {
            let row = &mut rows[scales.step(slit.log_scale[f])];
            *row = row.and(self.bends.of_face[f]);
        }
        let whole = outline.demand;
        let cost = |rows: &[Sums]| {
            let sums = rows.iter().copied().fold(Sums::default(), Sums::and);
            let part = (sums.flat / whole.sums.flat).sqrt();
            let sides = whole.sides.map(|side| side * part);
            self.cost(&Demand { sums, sides })
        };
        let promise = |&first: &usize| rounded_ln(cost(&rows[..first]) + cost(&rows[first..]));
        let first = (1..steps).min_by_key(promise)?;
        Some(Candidate::Scale(scales, first))
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
    fn without_crumbs(
        &self,
        faces: &[FaceId],
        is_below: &[bool],
        whole: &Sums,
        sets: &mut Sets,
    ) -> Vec<Vec<FaceId>> {
        // Few texels hold a small piece, unless it bends most.
        let weight = |sums: Sums| [sums.area, sums.bend[1]];
        let least = weight(*whole).map(|weight| CRUMB * weight);
        let mut sides: [Vec<Vec<FaceId>>; 2] = Default::default();
        let mut is_whole = true;
        for side in [false, true] {
            let own = faces.iter().zip(is_below).filter(|row| *row.1 == side);
            let own: Vec<FaceId> = own.map(|row| *row.0).collect();
            for component in sets.components(&own) {
                let sums = component.iter().map(|&f| self.bends.of_face[f]);
                let own = weight(sums.fold(Sums::default(), Sums::and));
                let is_small = own[0] < least[0] && own[1] <= least[1];
                is_whole &= !is_small;
                sides[usize::from(side != is_small)].push(component);
            }
        }
        let parts = sides.into_iter().flat_map(|side| {
            if is_whole {
                side
            } else {
                sets.components(&side.concat())
            }
        });
        parts.collect()
    }
}

/// Equal parts of a range of log scale.
pub(super) struct Scales {
    lowest: f64,
    range: f64,
    steps: usize,
}

impl Scales {
    fn step(&self, scale: f64) -> usize {
        let at = (scale - self.lowest) / self.range * self.steps as f64;
        (at as usize).min(self.steps - 1)
    }
}

/// Strips across an axis, one more than there are lines between them.
#[derive(Clone, Copy)]
pub(super) struct Strips {
    axis: [f64; 2],
    /// Where the first one begins, and what all measure.
    low: f64,
    length: f64,
}

impl Strips {
    /// Coordinates along the axis and across.
    fn along(&self, p: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.axis;
        [x * p[0] + y * p[1], x * p[1] - y * p[0]]
    }

    /// The strip of a triangle's middle.
    fn of(&self, t: &Triangle) -> usize {
        let at = (self.along(centroid(t))[0] - self.low) / self.length;
        (at * (LINES as f64 + OFFSET)).clamp(0.0, LINES as f64) as usize
    }
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
