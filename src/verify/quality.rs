//! The quality figures, measured again from positions and flat lengths.

use super::Verdicts;
use super::arrays::Arrays;
use super::document::Document;
use super::formulas::{Worst, distance3, doubled_area2};
use super::shapes::Shapes;

/// Relative agreement that is asked of a stated figure.
const AGREEMENT: f64 = 1e-3;

pub(super) fn check(
    arrays: &Arrays,
    document: &Document,
    shapes: &Shapes,
    verdicts: &mut Verdicts,
) {
    let stated = &document.quality;
    let faces = arrays.faces.len();
    let source = &shapes.source_area;
    let drawn = |f: usize| 0.5 * doubled_area2(arrays.central_uv[f]);
    let source_total: f64 = source.iter().sum();
    let drawn_total: f64 = (0..faces).map(drawn).sum();
    let distortion: f64 = (0..faces)
        .filter(|f| source[*f] > 0.0)
        .map(|f| {
            let (a, b) = (source[f] / source_total, drawn(f) / drawn_total);
            (b / a - 1.0).powi(2) * a
        })
        .sum();
    verdicts.note(
        "area distortion (9) as stated",
        (distortion - stated.area_distortion).abs() <= AGREEMENT * distortion.abs().max(1.0),
        format!("{distortion:.6}, stated {:.6}", stated.area_distortion),
    );

    if document.is_generated() {
        check_spread(document, shapes, source_total, verdicts);
        check_cut_length(arrays, document, verdicts);
    }
    let mut closing = Worst::default();
    closing.see(stated.layout_closing_error);
    verdicts.note(
        "layout closing error is stated",
        stated.layout_closing_error >= 0.0 && closing.0.is_finite(),
        format!("{:.3e}", stated.layout_closing_error),
    );
}

/// Log scale and angle error.
fn check_spread(document: &Document, shapes: &Shapes, source_total: f64, verdicts: &mut Verdicts) {
    let stated = &document.quality;
    // Thin faces may be left out or counted by whoever stated the range, so it must lie between that
    // of the well-shaped faces and that of all.
    let average = 0.5 * (shapes.flat_total / source_total).ln();
    let mut well = [f64::INFINITY, f64::NEG_INFINITY];
    let mut all = well;
    let (mut mean, mut square, mut weight) = (0.0, 0.0, 0.0);
    let mut thin_share = 0.0;
    let areas = shapes.source_area.iter().zip(&shapes.log_scale);
    for ((area, log_scale), is_well) in areas.zip(&shapes.is_well) {
        if !log_scale.is_finite() {
            continue;
        }
        let share = area / source_total;
        let scale = log_scale - average;
        all = [all[0].min(scale), all[1].max(scale)];
        if *is_well {
            well = [well[0].min(scale), well[1].max(scale)];
        } else {
            thin_share += share;
        }
        mean += share * scale;
        square += share * scale * scale;
        weight += share;
    }
    let (angle_mean, angle_max) = (shapes.angle_sum / source_total, shapes.angle_max);
    let std = (square / weight - (mean / weight).powi(2)).max(0.0).sqrt();
    let near = |x: f64, y: f64| (x - y).abs() <= AGREEMENT * y.abs().max(1.0) + thin_share;
    let slack = AGREEMENT * (1.0 + all[0].abs().max(all[1].abs()));
    let within = |x: f64, a: f64, b: f64| x >= a.min(b) - slack && x <= a.max(b) + slack;
    let spread = &stated.log_scale;
    verdicts.note(
        "log scale as stated",
        within(spread.min, all[0], well[0])
            && within(spread.max, well[1], all[1])
            && near(spread.std, std),
        format!(
            "{:.6} to {:.6}, std {std:.6}; stated {:.6} to {:.6}, std {:.6}",
            all[0], all[1], spread.min, spread.max, spread.std
        ),
    );
    let error = &stated.angle_error;
    // The mean of three corners and the largest of them bound whatever "mean" was taken a face.
    let mean_fits =
        error.mean >= angle_mean / 3.0 - slack && error.mean <= 3.0 * angle_mean + slack;
    verdicts.note(
        "angle error as stated",
        mean_fits && within(error.max, angle_max[0], angle_max[1]),
        format!(
            "mean {angle_mean:.4}, max {:.4} rad; stated mean {:.4}, max {:.4}",
            angle_max[1], error.mean, error.max
        ),
    );
}

/// Length of the cut in space.
fn check_cut_length(arrays: &Arrays, document: &Document, verdicts: &mut Verdicts) {
    let stated = document.quality.cut_length;
    let mut cut = 0.0;
    for (f, flags) in arrays.cut.iter().enumerate() {
        if *flags == [0; 3] {
            continue;
        }
        let corners = arrays.triangle(f);
        for k in (0..3).filter(|k| flags[*k] != 0) {
            cut += 0.5 * distance3(corners[(k + 1) % 3], corners[(k + 2) % 3]);
        }
    }
    verdicts.note(
        "cut length as stated",
        (cut - stated).abs() <= 1e-6 * cut,
        format!("{cut:.6}, stated {stated:.6}"),
    );
}
