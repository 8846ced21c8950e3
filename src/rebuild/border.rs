//! Which seams follow each other around each patch, and which of their ends are one vertex.
//!
//! *Enters:* the seams. *Leaves:* [`Borders`].
//!
//! *Guaranteed:* every side of every seam stands in the border of one patch, every border is one closed chain with
//! the patch on its left. Ends of seams are one vertex where a border passes from one to the other: by the
//! borders, never by position alone, since different vertices may lie at one point.
//! *Not guaranteed:* that borders do not cross themselves.

use super::frame::Frame;
use super::{Images, RebuildError};
use crate::atlas::patches::{Domain, Seam, SeamSample};
use crate::atlas::plane::distance;
use crate::geometry::disjoint_sets::UnionFind;
use crate::geometry::ids::PatchId;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Directions that differ by less (radians) are one, where several borders pass through a point.
const SAME_DIRECTION: f64 = 1e-7;
/// Texels by which a sample may lie outside its image.
const OUTSIDE: f64 = 1.0;

/// One side of a seam, walked so that the patch is on the left: the right side runs against the samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Side {
    pub seam: usize,
    pub is_right: bool,
}

/// The borders of all patches.
#[derive(Debug)]
pub(super) struct Borders {
    /// A closed chain a patch.
    pub loops: Vec<Vec<Side>>,
    /// Vertex at the first and at the last sample of every seam.
    pub ends: Vec<[usize; 2]>,
    /// Number of such vertices.
    pub vertices: usize,
}

impl Side {
    /// Samples as the border meets them.
    fn sample(self, seam: &Seam, from_start: usize) -> ([f64; 2], [f64; 3]) {
        let at = match self.is_right {
            false => from_start,
            true => seam.samples.len() - 1 - from_start,
        };
        (self.uv(&seam.samples[at]), seam.samples[at].position)
    }

    fn uv(self, sample: &SeamSample) -> [f64; 2] {
        match self.is_right {
            false => sample.left,
            true => sample.right,
        }
    }

    fn start(self, seam: &Seam) -> ([f64; 2], [f64; 3]) {
        self.sample(seam, 0)
    }

    fn end(self, seam: &Seam) -> ([f64; 2], [f64; 3]) {
        self.sample(seam, seam.samples.len() - 1)
    }

    /// Number of the seam's end (twice the seam, plus one for the last sample) where this side begins or stops.
    fn end_number(self, stops: bool) -> usize {
        2 * self.seam + usize::from(stops != self.is_right)
    }

    /// Direction at the beginning, or backwards at the end: the angle of the first sample that is elsewhere.
    fn direction(self, seam: &Seam, at_end: bool) -> f64 {
        let count = seam.samples.len();
        let sample = |i: usize| self.sample(seam, if at_end { count - 1 - i } else { i }).0;
        let from = sample(0);
        let to = (1..count).map(sample).find(|&p| p != from);
        to.map_or(0.0, |to| (to[1] - from[1]).atan2(to[0] - from[0]))
    }
}

/// Coordinates and position as bits, with one zero.
type Key = [u64; 5];

fn key((uv, position): ([f64; 2], [f64; 3])) -> Key {
    let bits = |x: f64| (x + 0.0).to_bits();
    let ([u, v], [x, y, z]) = (uv, position);
    [u, v, x, y, z].map(bits)
}

/// Checks the seams, and leaves those that are borders of patches: a flat patch may be slit open and have the same coordinates on both sides, a block is whole.
pub(super) fn checked(images: &Images, frames: &[Frame]) -> Result<Vec<Seam>, RebuildError> {
    if frames.is_empty() {
        return Err(RebuildError::NoPatches);
    }
    for (id, seam) in images.seams.iter().enumerate() {
        check(id, seam, frames)?;
    }
    let is_whole = |patch: PatchId| images.patches[patch.index()].domain != Domain::Flat;
    let is_border = |seam: &&Seam| !(is_whole(seam.left) && seam.is_inner());
    Ok(images.seams.iter().filter(is_border).cloned().collect())
}

/// Puts the sides of checked seams in order.
pub(super) fn borders(seams: &[Seam], frames: &[Frame]) -> Result<Borders, RebuildError> {
    let mut sides: Vec<Vec<Side>> = vec![Vec::new(); frames.len()];
    for (id, seam) in seams.iter().enumerate() {
        let both = [(Some(seam.left), false), (seam.right, true)];
        for (patch, is_right) in both {
            if let Some(patch) = patch {
                sides[patch.index()].push(Side { seam: id, is_right });
            }
        }
    }
    let mut sets = UnionFind::new(2 * seams.len());
    let mut loops = Vec::with_capacity(frames.len());
    for (patch, sides) in sides.iter().enumerate() {
        let border = close(patch, sides, seams, &frames[patch])?;
        for (i, &side) in border.iter().enumerate() {
            let next = border[(i + 1) % border.len()];
            sets.join(side.end_number(true), next.end_number(false));
        }
        loops.push(border);
    }
    let mut number: BTreeMap<usize, usize> = BTreeMap::new();
    let ends = (0..seams.len())
        .map(|seam| {
            [0, 1].map(|end| {
                let count = number.len();
                *number.entry(sets.find(2 * seam + end)).or_insert(count)
            })
        })
        .collect();
    Ok(Borders {
        loops,
        ends,
        vertices: number.len(),
    })
}

fn check(id: usize, seam: &Seam, frames: &[Frame]) -> Result<(), RebuildError> {
    if seam.samples.len() < 2 {
        return Err(RebuildError::SeamTooShort {
            seam: id,
            samples: seam.samples.len(),
        });
    }
    let patches: Vec<PatchId> = [Some(seam.left), seam.right]
        .into_iter()
        .flatten()
        .collect();
    if let Some(stray) = patches.iter().find(|p| p.index() >= frames.len()) {
        return Err(RebuildError::SeamPatch {
            seam: id,
            patch: stray.index(),
            patches: frames.len(),
        });
    }
    for (i, sample) in seam.samples.iter().enumerate() {
        let bad = |numbers: &[f64], what: &'static str| {
            let value = numbers.iter().copied().find(|x| !x.is_finite());
            value.map_or(Ok(()), |value| {
                Err(RebuildError::SeamNotFinite {
                    seam: id,
                    sample: i,
                    what,
                    value,
                })
            })
        };
        bad(&sample.position, "position")?;
        for (patch, uv) in patches.iter().zip([sample.left, sample.right]) {
            bad(&uv, "patch coordinate")?;
            let Frame { width, height, .. } = frames[patch.index()];
            let [x, y] = frames[patch.index()].texel(uv);
            let within = |x: f64, size: usize| (-OUTSIDE..=size as f64 + OUTSIDE).contains(&x);
            if !(within(x, width) && within(y, height)) {
                return Err(RebuildError::SeamOutside {
                    seam: id,
                    sample: i,
                    patch: patch.index(),
                    column: x,
                    row: height as f64 - y,
                    width,
                    height,
                });
            }
        }
    }
    Ok(())
}

/// The sides around one patch as one closed chain, from the first of them on.
fn close(
    patch: usize,
    sides: &[Side],
    seams: &[Seam],
    frame: &Frame,
) -> Result<Vec<Side>, RebuildError> {
    let Some(&first) = sides.first() else {
        return Err(RebuildError::NoBorder { patch });
    };
    let mut starts: BTreeMap<Key, Vec<usize>> = BTreeMap::new();
    for (i, side) in sides.iter().enumerate() {
        let at = key(side.start(&seams[side.seam]));
        starts.entry(at).or_default().push(i);
    }
    let mut used = vec![false; sides.len()];
    let mut next = Vec::with_capacity(sides.len());
    for side in sides {
        let seam = &seams[side.seam];
        let candidates = starts.get(&key(side.end(seam)));
        let candidates = candidates.map_or(&[][..], Vec::as_slice);
        let free = candidates.iter().copied().filter(|&i| !used[i]);
        // The patch lies between the border that comes and the one that goes: of several the first one met when
        // turning clockwise from where the border comes from. The same direction is a full turn: the end of a slit.
        let back = side.direction(seam, true);
        let turn = |&i: &usize| {
            let forth = sides[i].direction(&seams[sides[i].seam], false);
            let turn = (back - forth).rem_euclid(TAU);
            if turn < SAME_DIRECTION {
                turn + TAU
            } else {
                turn
            }
        };
        let Some(found) = free.min_by(|a, b| turn(a).total_cmp(&turn(b))) else {
            let end = frame.texel(side.end(seam).0);
            let gaps = sides.iter().enumerate().filter(|&(i, _)| !used[i]);
            let gaps = gaps.map(|(_, s)| distance(end, frame.texel(s.start(&seams[s.seam]).0)));
            return Err(RebuildError::BorderGap {
                patch,
                seam: side.seam,
                gap: gaps.fold(f64::INFINITY, f64::min),
            });
        };
        used[found] = true;
        next.push(found);
    }
    let mut visited = vec![false; sides.len()];
    let mut loops = 0;
    for start in 0..sides.len() {
        let mut at = start;
        loops += usize::from(!visited[at]);
        while !std::mem::replace(&mut visited[at], true) {
            at = next[at];
        }
    }
    if loops > 1 {
        return Err(RebuildError::BorderLoops { patch, loops });
    }
    let mut border = vec![first];
    let mut at = next[0];
    while at != 0 {
        border.push(sides[at]);
        at = next[at];
    }
    Ok(border)
}
