//! Holonomy of the gluings, translations and periods of flat tori, quarter turns, the seamless flag.

use super::Verdicts;
use super::arrays::Arrays;
use super::central::{Slit, at_corner, quarter_turn_error};
use super::document::Document;
use super::formulas::{
    Motion, Point2, Worst, area_from_lengths, distance2, in_half_open_turn, off_multiple, off_turn,
};
use super::metric::Metric;
use super::surface::Surface;
use std::f64::consts::FRAC_PI_2;

/// Largest angle between a rotation and what it must be (radians).
const ROTATION_TOLERANCE: f64 = 1e-8;

pub(super) fn check(
    surface: &Surface<'_>,
    arrays: &Arrays,
    document: &Document,
    slit: &Slit,
    metric: &Metric,
    verdicts: &mut Verdicts,
) {
    check_holonomy(surface, arrays, document, slit, verdicts);
    check_torus(surface, arrays, document, verdicts);
    check_quarter_turns(document, verdicts);
    let off = document
        .segments
        .iter()
        .map(|s| quarter_turn_error(s.gluing.rotation))
        .fold(0.0, f64::max);
    verdicts.note(
        "seamless flag is true to the gluings",
        document.flags.seamless == (off < ROTATION_TOLERANCE),
        format!("{off:.3e}"),
    );
    let topology = &document.topology;
    let simple = topology.genus == 0 && topology.boundary_loops <= 1;
    let quarter = document
        .cones
        .iter()
        .filter(|cone| !surface.on_boundary[cone.vertex])
        .all(|cone| off_multiple(cone.curvature, FRAC_PI_2) < 1e-10);
    verdicts.note(
        "quarter-turn cones on a sphere or disk give quarter turns",
        !(simple && quarter) || off < ROTATION_TOLERANCE,
        if simple && quarter {
            format!("{off:.3e}")
        } else {
            format!("not forced here (free boundary: {})", metric.free_boundary)
        },
    );
}

/// Around an interior vertex of the cut the gluings compose to a rotation by minus its curvature (we walk
/// counterclockwise and cross every cut edge from its right to its left) about the vertex itself.
fn check_holonomy(
    surface: &Surface<'_>,
    arrays: &Arrays,
    document: &Document,
    slit: &Slit,
    verdicts: &mut Verdicts,
) {
    let mut on_cut = vec![false; arrays.positions.len()];
    for h in (0..surface.halfedges()).filter(|h| slit.is_glued(*h)) {
        on_cut[surface.tail(h)] = true;
    }
    let (mut turn, mut shift) = (Worst::default(), Worst::default());
    let (mut walked, mut open) = (0, 0);
    for v in (0..on_cut.len()).filter(|v| on_cut[*v] && !surface.on_boundary[*v]) {
        let corners = surface.corners_of(v);
        let start = corners[0] as usize;
        let mut corner = start;
        let mut motion = Motion::IDENTITY;
        let mut steps = 0;
        let closed = loop {
            let Some(next) = surface.twin(surface.incoming(corner)) else {
                break false;
            };
            if let Some((segment, along)) = slit.side(next) {
                let gluing = document.segments[segment].gluing.motion();
                motion = motion.after(&if along { gluing } else { gluing.inverse() });
            }
            corner = surface.tail_corner(next);
            steps += 1;
            if corner == start {
                break true;
            }
            if steps > corners.len() {
                break false;
            }
        };
        if !closed {
            open += 1;
            continue;
        }
        walked += 1;
        turn.see(off_turn(motion.rotation + arrays.target_curvature[v]));
        let p = at_corner(&arrays.central_uv, start);
        shift.see(distance2(motion.apply(p), p) / f64::from(steps as u32));
    }
    verdicts.note(
        "holonomy around every vertex of the cut is its curvature",
        open == 0 && turn.0 < ROTATION_TOLERANCE,
        format!("{:.3e} rad at {walked} vertices", turn.0),
    );
    verdicts.note(
        "holonomy fixes the vertex it turns about",
        shift.0 < 1e-8 * slit.diameter || walked == 0,
        format!("{:.3e} of the diameter", shift.0 / slit.diameter),
    );
}

/// A closed surface of genus 1 without cones: translations only, and two periods that tile the plane, which
/// is to say that their parallelogram has the surface's flat area.
fn check_torus(
    surface: &Surface<'_>,
    arrays: &Arrays,
    document: &Document,
    verdicts: &mut Verdicts,
) {
    let closed = !surface.on_boundary.iter().any(|b| *b);
    let flat = document.cones.is_empty() && document.topology.genus == 1;
    if !(closed && flat) {
        return;
    }
    let mut turn = Worst::default();
    for s in &document.segments {
        turn.see(off_turn(s.gluing.rotation));
    }
    verdicts.note(
        "a torus without cones has translations only",
        turn.0 < ROTATION_TOLERANCE,
        format!("{:.3e} rad", turn.0),
    );
    let area: f64 = arrays
        .flat_length
        .iter()
        .map(|l| area_from_lengths(*l))
        .sum();
    let steps: Vec<Point2> = document
        .segments
        .iter()
        .map(|s| s.gluing.translation)
        .collect();
    let mut pairs = Vec::new();
    // A cut of this surface has two or three segments; a longer list is damaged and need not be searched.
    for (i, a) in steps.iter().take(64).enumerate() {
        for b in steps.iter().take(64).skip(i + 1) {
            pairs.push((*a, *b));
        }
    }
    let cross = |a: Point2, b: Point2| a[0] * b[1] - a[1] * b[0];
    let off = |a: Point2, b: Point2| (cross(a, b).abs() / area - 1.0).abs();
    let best = pairs
        .iter()
        .copied()
        .min_by(|x, y| off(x.0, x.1).total_cmp(&off(y.0, y.1)));
    let error = best.map_or(f64::INFINITY, |(a, b)| off(a, b));
    verdicts.note(
        "two period vectors tile the plane",
        error < 1e-7,
        format!("{error:.3e} of the flat area"),
    );
    if let (Some([p, q]), Some((a, b))) = (document.periods, best) {
        let size = p.iter().chain(&q).fold(0.0, |m: f64, x| m.max(x.abs()));
        let mut worst = Worst::default();
        for period in [p, q] {
            let along = [cross(period, b), cross(a, period)].map(|x| (x / cross(a, b)).round());
            let nearest: Point2 = std::array::from_fn(|i| along[0] * a[i] + along[1] * b[i]);
            worst.see(distance2(nearest, period) / size);
        }
        verdicts.note(
            "stated periods span the same lattice",
            worst.0 < 1e-7 && off(p, q) < 1e-7,
            format!("{:.3e}", worst.0),
        );
    }
}

/// Rotations lie in (−π, π], and quarter turns are listed where there are some and nowhere else.
fn check_quarter_turns(document: &Document, verdicts: &mut Verdicts) {
    let gluings = document
        .segments
        .iter()
        .map(|s| (s.gluing.rotation, s.gluing.quarter_turns, false));
    let required = document.is_generated();
    let transitions = document
        .transitions
        .iter()
        .map(|t| (t.rotation, t.quarter_turns, required));
    let (mut outside, mut untrue, mut lacking) = (0, 0, 0);
    for (rotation, quarter_turns, required) in gluings.chain(transitions) {
        outside += usize::from(!in_half_open_turn(rotation));
        match quarter_turns {
            // Twice the bound, as the writer may have rounded its rotation across it.
            Some(n) => {
                let near = off_turn(rotation - n as f64 * FRAC_PI_2) < 2.0 * ROTATION_TOLERANCE;
                untrue += usize::from(!((0..4).contains(&n) && near));
            }
            None => {
                let is_one = quarter_turn_error(rotation) < 0.5 * ROTATION_TOLERANCE;
                lacking += usize::from(required && is_one);
            }
        }
    }
    verdicts.note(
        "rotations lie in (-pi, pi]",
        outside == 0,
        format!("{outside} outside"),
    );
    verdicts.note(
        "quarter turns are listed truthfully",
        untrue + lacking == 0,
        format!("{untrue} untrue, {lacking} lacking"),
    );
}
