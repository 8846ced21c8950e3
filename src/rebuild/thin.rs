//! Which points stand for a seam: the same for both sides.
//!
//! *Enters:* seams and borders. *Leaves:* a [`Chain`] a seam.
//!
//! Seam samples can lie far closer together than texels (every vertex of the surface on the chain is one), and far wider apart.
//! A chord is halved while it is longer than [`SPACING`] texels of the finer side, or while the seam leaves it by more
//! than [`PLANE`] texels on either side or, in space, by more than [`SPACE`] of its length: so corners that matter stay.
//! Then every border is tested, exactly: chords that meet get a sample more, until none do or all samples are back.
//!
//! *Guaranteed:* a border crosses or touches itself only where the seams as given do. No two chords join the same two vertices.

use super::RebuildError;
use super::border::Borders;
use super::chain::{Chain, Point, polygon};
use super::crossing::crossings;
use super::frame::Frame;
use crate::atlas::patches::Seam;
use crate::geometry::polygon::is_counterclockwise;
use crate::parallel;
use std::collections::{BTreeMap, BTreeSet};

/// Longest chord, in texels of the finer side.
const SPACING: f64 = 1.25;
/// Farthest that the seam may leave a chord in the plane, in texels.
const PLANE: f64 = 0.25;
/// Farthest in space, relative to the chord's length: less is the sagitta of a smooth curve, more is a crease.
const SPACE: f64 = 0.1;
/// A simple border on a lattice has no more edges than about two a texel.
const EDGES_A_TEXEL: f64 = 4.0;
/// … and a few more on the smallest images.
const FEW_EDGES: f64 = 256.0;

/// Chooses the points of every seam.
pub(super) fn thin<'a>(
    seams: &'a [Seam],
    frames: &[Frame],
    borders: &Borders,
) -> Result<Vec<Chain<'a>>, RebuildError> {
    let mut chains: Vec<Chain> = parallel::map(seams, |i, seam| {
        let ends = &borders.ends[i];
        let patches = [Some(seam.left), seam.right].into_iter().flatten();
        let most = patches.map(|p| most_edges(&frames[p.index()]));
        let mut chain = Chain::new(seam, frames);
        subdivide(
            &mut chain,
            ends[0] == ends[1],
            most.fold(f64::INFINITY, f64::min),
        );
        chain
    });
    part_chords_with_the_same_ends(&mut chains, borders);
    untangle(&mut chains, frames, borders)?;
    Ok(chains)
}

fn most_edges(frame: &Frame) -> f64 {
    EDGES_A_TEXEL * (frame.width * frame.height) as f64 + FEW_EDGES
}

/// Where a chord needs another point, and which. Long pieces are halved first, so that each sample is looked at a few times only.
fn halve(chain: &Chain, a: &Point, b: &Point, may_interpolate: bool) -> Option<Point> {
    const LONG: f64 = 4.0 * SPACING;
    let middle = || {
        let middle = chain.middle(a, b);
        middle.filter(|p| may_interpolate || p.fraction == 0.0)
    };
    if chain.along(a, b) > LONG
        && let Some(middle) = middle()
    {
        return Some(middle);
    }
    let deviation = chain.deviation(a, b);
    if deviation.plane > PLANE {
        return deviation.farthest.map(|i| chain.sample(i));
    }
    if deviation.space > SPACE {
        return deviation.farthest_in_space.map(|i| chain.sample(i));
    }
    (chain.length(a, b) > SPACING).then(middle).flatten()
}

/// A seam that returns to its beginning gets three chords at least. After `most` points only samples are taken.
fn subdivide(chain: &mut Chain, returns: bool, most: f64) {
    if returns {
        for _ in 0..2 {
            let chords: Vec<usize> = (0..chain.points.len() - 1).collect();
            chain.split(&chords, |chain, a, b| chain.middle(a, b));
        }
    }
    let mut points = Vec::new();
    // Points that are still ahead, the next one last.
    let mut ahead: Vec<Point> = chain.points.iter().rev().copied().collect();
    let Some(mut at) = ahead.pop() else { return };
    points.push(at);
    while let Some(&next) = ahead.last() {
        match halve(
            chain,
            &at,
            &next,
            ((points.len() + ahead.len()) as f64) < most,
        ) {
            Some(between) => ahead.push(between),
            None => {
                ahead.pop();
                at = next;
                points.push(at);
            }
        }
    }
    chain.points = points;
}

/// Two vertices may be joined by several seams; only one of these may be a single chord, or the mesh has a double edge.
fn part_chords_with_the_same_ends(chains: &mut [Chain], borders: &Borders) {
    let mut joined: BTreeMap<[usize; 2], Vec<usize>> = BTreeMap::new();
    for (id, (chain, &[a, b])) in chains.iter().zip(&borders.ends).enumerate() {
        if chain.points.len() == 2 {
            joined.entry([a.min(b), a.max(b)]).or_default().push(id);
        }
    }
    for id in joined.into_values().flat_map(|ids| ids.into_iter().skip(1)) {
        chains[id].split(&[0], |chain, a, b| chain.middle(a, b));
    }
}

/// Puts samples back until no border meets itself, or none is left to put back.
fn untangle(chains: &mut [Chain], frames: &[Frame], borders: &Borders) -> Result<(), RebuildError> {
    let mut of_seam: Vec<Vec<usize>> = vec![Vec::new(); chains.len()];
    for (patch, border) in borders.loops.iter().enumerate() {
        for side in border {
            of_seam[side.seam].push(patch);
        }
    }
    let mut dirty: Vec<usize> = (0..borders.loops.len()).collect();
    while !dirty.is_empty() {
        let tangled = parallel::map(&dirty, |_, &patch| {
            tangled_chords(patch, chains, frames, borders)
        });
        let tangled = tangled.into_iter().collect::<Result<Vec<_>, _>>()?;
        let mut flagged: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
        for (seam, chord) in tangled.into_iter().flatten() {
            flagged.entry(seam).or_default().insert(chord);
        }
        let mut changed = BTreeSet::new();
        for (seam, chords) in flagged {
            let chords: Vec<usize> = chords.into_iter().collect();
            let farthest = |chain: &Chain, a: &Point, b: &Point| {
                chain.deviation(a, b).farthest.map(|i| chain.sample(i))
            };
            if chains[seam].split(&chords, farthest) {
                changed.extend(&of_seam[seam]);
            }
        }
        dirty = changed.into_iter().collect();
    }
    Ok(())
}

/// Chords of a patch's border that meet others, as seam and number.
fn tangled_chords(
    patch: usize,
    chains: &[Chain],
    frames: &[Frame],
    borders: &Borders,
) -> Result<Vec<(usize, usize)>, RebuildError> {
    let polygon = polygon(&borders.loops[patch], chains);
    let n = polygon.texel.len();
    let frame = &frames[patch];
    let edges =
        (0..n).map(|i| crate::atlas::plane::distance(polygon.texel[i], polygon.texel[(i + 1) % n]));
    let (length, limit) = (edges.sum::<f64>(), 4.0 * most_edges(frame));
    if length > limit {
        return Err(RebuildError::BorderTooLong {
            patch,
            length,
            limit,
            width: frame.width,
            height: frame.height,
        });
    }
    let found = crossings(&polygon.uv, &polygon.texel);
    if found.is_empty() && !is_counterclockwise(&polygon.uv) {
        return Ok(polygon.chord);
    }
    Ok(found
        .into_iter()
        .flatten()
        .map(|i| polygon.chord[i])
        .collect())
}
