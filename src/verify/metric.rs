//! The flat metric: one length an edge, triangles that exist, curvature as prescribed, cones as listed.

use super::arrays::Arrays;
use super::document::Document;
use super::formulas::{Worst, angle_slack, angles_by_cosines};
use super::surface::Surface;
use super::{Verdicts, VerifyOptions};
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

/// Below this a target curvature counts as flat (radians).
pub(super) const FLAT: f64 = 1e-12;

/// Largest curvature error of a converged flow (radians), beyond what rounded lengths can tell.
const CURVATURE_TOLERANCE: f64 = 1e-9;

/// What later checks need of the metric.
pub(super) struct Metric {
    /// Whether the curvature of boundary vertices is whatever it came to be.
    pub free_boundary: bool,
}

pub(super) fn check(
    surface: &Surface<'_>,
    arrays: &Arrays,
    document: &Document,
    angles: Vec<[f64; 3]>,
    options: &VerifyOptions,
    verdicts: &mut Verdicts,
) -> Metric {
    let vertices = arrays.positions.len();
    let free = document.metric.boundary == "free";
    let mut slack = f64::INFINITY;
    let mut broken = 0usize;
    for l in &arrays.flat_length {
        let perimeter: f64 = l.iter().sum();
        for k in 0..3 {
            let room = (l[(k + 1) % 3] + l[(k + 2) % 3] - l[k]) / perimeter;
            slack = slack.min(room);
            // Written so that a NaN is broken too.
            let good = l[k] > 0.0 && room > -1e-12;
            broken += usize::from(!good);
        }
    }
    verdicts.note(
        "triangle inequality",
        broken == 0,
        format!("{slack:.3e}, {broken} corners broken"),
    );
    let length = arrays.flat_length.as_flattened();
    let mut apart = Worst::default();
    for (h, t) in surface.inner_edges() {
        apart.see((length[h] - length[t]).abs() / length[h].min(length[t]));
    }
    verdicts.note(
        "one length an edge",
        apart.0 < 1e-9,
        format!("{:.3e}", apart.0),
    );

    let mut curvature: Vec<f64> = surface
        .on_boundary
        .iter()
        .map(|boundary| if *boundary { PI } else { TAU })
        .collect();
    let mut by_cosines = curvature.clone();
    let (mut blur, mut blur_by_cosines) = (vec![0.0; vertices], vec![0.0; vertices]);
    let corners = arrays.faces.iter().zip(angles);
    for ((face, angle), l) in corners.zip(&arrays.flat_length) {
        let face_slack = angle_slack(*l);
        let (cosines, slack_by_cosines) = angles_by_cosines(*l);
        for k in 0..3 {
            by_cosines[face[k] as usize] -= cosines[k];
            blur_by_cosines[face[k] as usize] += slack_by_cosines;
            curvature[face[k] as usize] -= angle[k];
            blur[face[k] as usize] += face_slack;
        }
    }
    let chi = surface.euler_characteristic() as f64;
    let excess = curvature.iter().sum::<f64>() - TAU * chi;
    let total_blur: f64 = blur.iter().sum();
    verdicts.note(
        "Gauss-Bonnet",
        excess.abs() < 1e-9 + total_blur,
        format!("{excess:.3e}"),
    );
    let target = &arrays.target_curvature;
    let (mut inner, mut border) = (Worst::default(), Worst::default());
    for v in 0..vertices {
        let error = |curvature: f64, blur: f64| ((curvature - target[v]).abs() - blur).max(0.0);
        // Readers take the formula of the textbooks, which loses more digits: they must find the same.
        let error = error(curvature[v], blur[v]).max(error(by_cosines[v], blur_by_cosines[v]));
        if free && surface.on_boundary[v] {
            border.see(error);
        } else {
            inner.see(error);
        }
    }
    verdicts.note(
        "interior curvature is the target",
        inner.0 < CURVATURE_TOLERANCE,
        format!("{:.3e}", inner.0),
    );
    verdicts.note(
        "free boundary's target is what was achieved",
        border.0 < CURVATURE_TOLERANCE,
        format!("{:.3e}", border.0),
    );
    let prescribed = target.iter().sum::<f64>() - TAU * chi;
    // On a free boundary the target takes up what the flow left over inside.
    let budget = if free {
        1e-10 * vertices as f64 + total_blur
    } else {
        0.0
    };
    verdicts.note(
        "target curvature keeps Gauss-Bonnet",
        prescribed.abs() < 1e-9 + budget,
        format!("{prescribed:.3e}"),
    );
    let stated = document.metric.max_curvature_error;
    verdicts.note(
        "stated curvature error",
        (0.0..=1e-9).contains(&stated),
        format!("{stated:.3e}"),
    );
    check_cones(surface, target, free, document, options, verdicts);
    Metric {
        free_boundary: free,
    }
}

fn check_cones(
    surface: &Surface<'_>,
    target: &[f64],
    free: bool,
    document: &Document,
    options: &VerifyOptions,
    verdicts: &mut Verdicts,
) {
    let listed: BTreeMap<usize, f64> = document
        .cones
        .iter()
        .map(|cone| (cone.vertex, cone.curvature))
        .collect();
    let present: BTreeMap<usize, f64> = (0..target.len())
        .filter(|v| target[*v].abs() > FLAT && !(free && surface.on_boundary[*v]))
        .map(|v| (v, target[v]))
        .collect();
    if let Some(most) = options.cones {
        verdicts.note(
            "no more cones than prescribed",
            listed.len() <= most,
            format!("{} of {most}", listed.len()),
        );
    }
    let agree = listed.len() == document.cones.len()
        && listed.keys().eq(present.keys())
        && listed
            .iter()
            .all(|(v, curvature)| (present[v] - curvature).abs() < 1e-9);
    verdicts.note(
        "cones listed",
        agree,
        format!("{} vs {}", present.len(), document.cones.len()),
    );
    let flat_out = (0..target.len())
        .filter(|v| target[*v] >= if surface.on_boundary[*v] { PI } else { TAU })
        .count();
    verdicts.note(
        "cone angles are positive",
        flat_out == 0,
        format!("{flat_out} vertices"),
    );
}
