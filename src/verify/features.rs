//! Features that are lines: every edge of theirs is parallel to one of the axes, on both sides and up to quarter turns; and the loops' own figures.
//!
//! All transitions of an atlas with lines are quarter turns, so the axes are the same all over the surface.

use super::Verdicts;
use super::arrays::Arrays;
use super::central::{FLOOR, Slit, at_corner};
use super::document::Document;
use super::formulas::{Worst, distance2, off_multiple, sub2};
use super::surface::Surface;
use std::f64::consts::FRAC_PI_2;

/// Largest angle between an edge of a line and an axis, radians; and between the turn of a loop and what is stated.
const TOLERANCE: f64 = 1e-8;

pub(super) fn check(
    surface: &Surface<'_>,
    arrays: &Arrays,
    document: &Document,
    slit: &Slit,
    verdicts: &mut Verdicts,
) {
    if let Some(holonomy) = &document.metric.holonomy {
        let mut worst = Worst::default();
        holonomy
            .loops
            .iter()
            .for_each(|l| worst.see(l.residual.abs()));
        verdicts.note(
            "loops turn by quarter turns",
            worst.0 < TOLERANCE,
            format!("{:.3e} rad, {} loops", worst.0, holonomy.loops.len()),
        );
    }
    let lines = || document.features.iter().filter(|f| f.is_line);
    if lines().next().is_none() {
        return;
    }
    // Edges that a line has lost to another division of the surface are not there to be tested.
    let edges = lines().flat_map(|f| f.vertices.windows(2));
    let sides = edges.flat_map(|pair| between(surface, pair[0], pair[1]));
    let (mut worst, mut count) = (Worst::default(), 0);
    for h in sides {
        let at = |corner| at_corner(&arrays.central_uv, corner);
        let ends = [at(surface.tail_corner(h)), at(surface.head_corner(h))];
        let along = sub2(ends[1], ends[0]);
        let direction = along[1].atan2(along[0]);
        let length = distance2(ends[0], ends[1]);
        let rounding = match length > 0.0 {
            true => (FLOOR * slit.diameter / length).min(TOLERANCE),
            false => f64::NAN,
        };
        worst.see((off_multiple(direction, FRAC_PI_2) - 4.0 * rounding).max(0.0));
        count += 1;
    }
    verdicts.note(
        "features that are lines are straight",
        worst.0 < TOLERANCE,
        format!("{:.3e} rad, {count} sides of edges", worst.0),
    );
}

/// The halfedges between two vertices, both ways.
fn between<'a>(surface: &'a Surface<'_>, p: usize, q: usize) -> impl Iterator<Item = usize> + 'a {
    let around = surface.corners_of(p).iter();
    around.flat_map(move |&corner| {
        let corner = corner as usize;
        let (out, back) = (surface.outgoing(corner), surface.incoming(corner));
        let out = Some(out).filter(|&h| surface.head(h) == q);
        let back = Some(back).filter(|&h| surface.tail(h) == q);
        out.into_iter().chain(back)
    })
}
