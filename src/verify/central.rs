//! The central chart, the cut graph with its segments and gluings, and the slit disk.

use super::arrays::{Arrays, NONE};
use super::document::Document;
use super::formulas::{
    Extent2, Point2, Worst, distance2, is_positive, lengths2, longest, off_multiple,
};
use super::surface::{Surface, UnionFind};
use super::{Verdicts, VerifyOptions};
use std::collections::BTreeSet;

/// Every edge keeps its flat length to this share of its face's longest edge, …
const LENGTH_TOLERANCE: f64 = 1e-9;
/// … or to so many times what the metric's curvature is off by: what is not flat cannot be laid out better, and paths around cones add up …
const OF_CURVATURE: f64 = 100.0;
/// … and this share of its chart's diameter: the floor of double precision.
pub(super) const FLOOR: f64 = 1e-12;

/// See above; 1e-7 at most, since curvature is off by 1e-9 at most.
pub(super) fn length_tolerance(document: &Document) -> f64 {
    let off = document.metric.max_curvature_error.clamp(0.0, 1e-9);
    LENGTH_TOLERANCE.max(OF_CURVATURE * off)
}

/// The cut and the central chart, for later checks.
pub(super) struct Slit {
    /// Diagonal of the central chart's bounding box.
    pub diameter: f64,
    /// Of a halfedge on an inner cut edge: segment + 1 where it runs along its segment (its face lies left),
    /// the negative of that where it runs against it; 0 elsewhere.
    direction: Vec<i32>,
}

impl Slit {
    /// Whether the walk along a segment passed over this halfedge or its twin.
    pub fn is_glued(&self, h: usize) -> bool {
        self.direction[h] != 0
    }

    /// The segment of a glued halfedge, and whether the halfedge runs along it.
    pub fn side(&self, h: usize) -> Option<(usize, bool)> {
        let d = self.direction[h];
        (d != 0).then(|| (d.unsigned_abs() as usize - 1, d > 0))
    }
}

/// Difference between a chart's edges and the flat lengths, in longest edges of the face, beyond the floor.
pub(super) fn length_error(uv: [Point2; 3], flat: [f64; 3], diameter: f64) -> f64 {
    let mut worst = Worst::default();
    let l = lengths2(uv);
    for k in 0..3 {
        worst.see(((l[k] - flat[k]).abs() - FLOOR * diameter).max(0.0));
    }
    worst.0 / longest(flat)
}

/// Corner of a chart that holds one coordinate a corner of every face.
pub(super) fn at_corner(uv: &[[Point2; 3]], corner: usize) -> Point2 {
    uv[corner / 3][corner % 3]
}

pub(super) fn check(
    surface: &Surface<'_>,
    arrays: &Arrays,
    document: &Document,
    options: &VerifyOptions,
    verdicts: &mut Verdicts,
) -> Slit {
    let uv = &arrays.central_uv;
    let extent = Extent2::of(uv.as_flattened().iter().copied());
    let (diameter, reach) = (extent.diagonal(), extent.reach());
    let mut worst = Worst::default();
    for (t, flat) in uv.iter().zip(&arrays.flat_length) {
        worst.see(length_error(*t, *flat, diameter));
    }
    verdicts.note(
        "central chart keeps flat lengths",
        worst.0 < length_tolerance(document),
        format!("{:.3e} of the face's longest edge", worst.0),
    );
    let flipped = uv.iter().filter(|t| !is_positive(**t, reach)).count();
    verdicts.note(
        "central chart orientation positive",
        flipped == 0,
        format!("{flipped} faces"),
    );
    check_cut_arrays(surface, arrays, verdicts);
    check_slit(surface, arrays, document, options, diameter, verdicts);
    check_segments(surface, arrays, document, options, diameter, verdicts)
}

/// The two sides of an edge must say the same of it.
fn check_cut_arrays(surface: &Surface<'_>, arrays: &Arrays, verdicts: &mut Verdicts) {
    let (cut, segment) = (arrays.cut.as_flattened(), arrays.segment.as_flattened());
    let wrong = (0..surface.halfedges())
        .filter(|h| {
            let sound = cut[*h] <= 1 && (cut[*h] == 1) == (segment[*h] != NONE);
            let same = match surface.twin(*h) {
                Some(t) => cut[t] == cut[*h] && segment[t] == segment[*h],
                None => cut[*h] == 0,
            };
            !(sound && same)
        })
        .count();
    verdicts.note(
        "cut and segment arrays agree",
        wrong == 0,
        format!("{wrong} halfedges"),
    );
}

fn check_slit(
    surface: &Surface<'_>,
    arrays: &Arrays,
    document: &Document,
    options: &VerifyOptions,
    diameter: f64,
    verdicts: &mut Verdicts,
) {
    let (uv, cut) = (&arrays.central_uv, arrays.cut.as_flattened());
    let faces = arrays.faces.len();
    let mut gap = Worst::default();
    let mut sheets = UnionFind::new(faces);
    let mut slit_edges = surface.edges() as i64;
    for (h, t) in surface.inner_edges() {
        if cut[h] != cut[t] {
            gap.see(f64::INFINITY);
        }
        if cut[h] != 0 {
            slit_edges += 1;
            continue;
        }
        sheets.join(h / 3, t / 3);
        for (a, b) in [
            (surface.tail_corner(h), surface.head_corner(t)),
            (surface.head_corner(h), surface.tail_corner(t)),
        ] {
            gap.see(distance2(at_corner(uv, a), at_corner(uv, b)));
        }
    }
    verdicts.note(
        "central chart continuous off the cut",
        gap.0 < options.tolerance * diameter,
        format!("{:.3e} of the diameter", gap.0 / diameter),
    );
    let sheets = sheets.sets();
    verdicts.note(
        "slit surface connected",
        sheets == 1,
        format!("{sheets} pieces"),
    );
    let mut touched = surface.on_boundary.clone();
    for h in (0..surface.halfedges()).filter(|h| cut[*h] != 0) {
        touched[surface.tail(h)] = true;
        touched[surface.head(h)] = true;
    }
    // Every vertex has a copy for every fan of faces into which the cut divides it.
    // Where two halfedges disagree, the lower one decides, as above.
    let uncut = |h: usize| cut[surface.twin(h).map_or(h, |t| t.min(h))] == 0;
    let copies = (0..touched.len()).map(|v| match touched[v] {
        true => surface.fans(v, uncut),
        false => surface.fans_of[v] as usize,
    });
    let chi = copies.sum::<usize>() as i64 - slit_edges + faces as i64;
    verdicts.note("slit surface is a disk", chi == 1, format!("chi {chi}"));
    let inside: Vec<usize> = document
        .cones
        .iter()
        .map(|cone| cone.vertex)
        .filter(|v| !touched[*v])
        .collect();
    verdicts.note(
        "every cone on the slit's border",
        inside.is_empty(),
        format!("{:?}", &inside[..inside.len().min(5)]),
    );
}

fn check_segments(
    surface: &Surface<'_>,
    arrays: &Arrays,
    document: &Document,
    options: &VerifyOptions,
    diameter: f64,
    verdicts: &mut Verdicts,
) -> Slit {
    let (uv, cut) = (&arrays.central_uv, arrays.cut.as_flattened());
    let segment = arrays.segment.as_flattened();
    let mut sides: Vec<(u32, usize, usize, usize)> = (0..surface.halfedges())
        .filter(|h| cut[*h] != 0 && segment[*h] != NONE)
        .map(|h| (segment[h], surface.tail(h), surface.head(h), h))
        .collect();
    sides.sort_unstable();
    let mut direction = vec![0i32; surface.halfedges()];
    let mut worst = Worst::default();
    let mut untrue = 0;
    for s in &document.segments {
        let mut residual = Worst::default();
        let motion = s.gluing.motion();
        if s.vertices.first() != Some(&s.from) || s.vertices.last() != Some(&s.to) {
            residual.see(f64::INFINITY);
        }
        for ends in s.vertices.windows(2) {
            let key = (s.id as u32, ends[0], ends[1]);
            let at = sides.partition_point(|side| (side.0, side.1, side.2) < key);
            let side = sides.get(at).filter(|side| (side.0, side.1, side.2) == key);
            let pair = side.and_then(|side| Some((side.3, surface.twin(side.3)?)));
            let Some((h, t)) = pair.filter(|(h, _)| direction[*h] == 0) else {
                residual.see(f64::INFINITY);
                continue;
            };
            let mark = s.id as i32 + 1;
            (direction[h], direction[t]) = (mark, -mark);
            for (left, right) in [
                (surface.tail_corner(h), surface.head_corner(t)),
                (surface.head_corner(h), surface.tail_corner(t)),
            ] {
                let moved = motion.apply(at_corner(uv, left));
                residual.see(distance2(moved, at_corner(uv, right)));
            }
        }
        worst.see(residual.0);
        if let Some(stated) = s.gluing.residual {
            let off = (stated - residual.0).abs();
            untrue += usize::from(off.is_nan() || off > options.tolerance * diameter);
        }
    }
    let inner_cut = (0..surface.halfedges()).filter(|h| cut[*h] != 0 && surface.twin(*h).is_some());
    let (mut all, mut seen) = (0, 0);
    for h in inner_cut {
        all += 1;
        seen += usize::from(direction[h] != 0);
    }
    verdicts.note(
        "segments cover the cut",
        seen == all && direction.iter().filter(|d| **d != 0).count() == seen,
        format!("{seen} of {all} halfedges"),
    );
    verdicts.note(
        "gluings are rigid motions",
        worst.0 < options.tolerance * diameter || document.segments.is_empty(),
        format!("{:.3e} of the diameter", worst.0 / diameter),
    );
    verdicts.note(
        "gluings state their residual",
        untrue == 0,
        format!("{untrue} segments"),
    );
    check_nodes(surface, document, &direction, verdicts);
    Slit {
        diameter,
        direction,
    }
}

/// Segments are maximal chains, their ends are nodes, and no chain dangles where there is no cone.
fn check_nodes(
    surface: &Surface<'_>,
    document: &Document,
    direction: &[i32],
    verdicts: &mut Verdicts,
) {
    let mut valence = vec![0u32; surface.on_boundary.len()];
    for h in (0..direction.len()).filter(|h| direction[*h] > 0) {
        valence[surface.tail(h)] += 1;
        valence[surface.head(h)] += 1;
    }
    let cones: BTreeSet<usize> = document.cones.iter().map(|cone| cone.vertex).collect();
    let is_special = |v: usize| cones.contains(&v) || surface.on_boundary[v];
    let (mut inner, mut ends, mut dangling) = (0, 0, 0);
    for s in &document.segments {
        let inside = s.vertices.get(1..s.vertices.len() - 1).unwrap_or(&[]);
        inner += inside
            .iter()
            .filter(|v| valence[**v] != 2 || is_special(**v))
            .count();
        for v in [s.from, s.to] {
            ends += usize::from(valence[v] == 2 && !is_special(v));
            dangling += usize::from(valence[v] == 1 && !is_special(v));
        }
    }
    verdicts.note(
        "segments run from node to node",
        inner + ends == 0,
        format!("{inner} nodes inside segments, {ends} ends that are no nodes"),
    );
    verdicts.note(
        "no chain of the cut dangles",
        dangling == 0,
        format!("{dangling} ends"),
    );
}

/// Whether a rotation is a quarter turn to 1e-8.
pub(super) fn quarter_turn_error(rotation: f64) -> f64 {
    off_multiple(rotation, std::f64::consts::FRAC_PI_2)
}
