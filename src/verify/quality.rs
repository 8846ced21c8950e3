//! The quality figures, measured again from positions and flat lengths.

use super::Verdicts;
use super::arrays::Arrays;
use super::document::Document;
use super::formulas::{
    Worst, area_from_lengths, area3, corner_angles, distance3, doubled_area2, least_sine, lengths3,
};
use super::metric::Metric;

/// Relative agreement that is asked of a stated figure.
const AGREEMENT: f64 = 1e-3;
/// Faces whose sines are all above this are well shaped: nobody's rounding matters there.
const WELL_SHAPED: f64 = 1e-5;

pub(super) fn check(
    arrays: &Arrays,
    document: &Document,
    metric: &Metric,
    verdicts: &mut Verdicts,
) {
    let stated = &document.quality;
    let faces = arrays.faces.len();
    let source: Vec<f64> = (0..faces).map(|f| area3(arrays.triangle(f))).collect();
    let drawn = arrays.central_uv.iter().map(|t| 0.5 * doubled_area2(*t));
    let drawn: Vec<f64> = drawn.collect();
    let (source_total, drawn_total) = (source.iter().sum::<f64>(), drawn.iter().sum::<f64>());
    let distortion: f64 = (0..faces)
        .filter(|f| source[*f] > 0.0)
        .map(|f| {
            let (a, b) = (source[f] / source_total, drawn[f] / drawn_total);
            (b / a - 1.0).powi(2) * a
        })
        .sum();
    verdicts.note(
        "area distortion (9) as stated",
        (distortion - stated.area_distortion).abs() <= AGREEMENT * distortion.abs().max(1.0),
        format!("{distortion:.6}, stated {:.6}", stated.area_distortion),
    );

    if document.is_generated() {
        check_spread(arrays, document, metric, &source, verdicts);
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
fn check_spread(
    arrays: &Arrays,
    document: &Document,
    metric: &Metric,
    source: &[f64],
    verdicts: &mut Verdicts,
) {
    let stated = &document.quality;
    let faces = arrays.faces.len();
    let source_total: f64 = source.iter().sum();
    // Thin faces may be left out or counted by whoever stated the range, so it must lie between that
    // of the well-shaped faces and that of all.
    let flat: Vec<f64> = arrays
        .flat_length
        .iter()
        .map(|l| area_from_lengths(*l))
        .collect();
    let flat_total: f64 = flat.iter().sum();
    let mut well = [f64::INFINITY, f64::NEG_INFINITY];
    let mut all = well;
    let mut angle_max = [0.0f64; 2];
    let (mut mean, mut square, mut angle_mean, mut weight) = (0.0, 0.0, 0.0, 0.0);
    let mut thin_share = 0.0;
    for f in (0..faces).filter(|f| source[*f] > 0.0 && flat[*f] > 0.0) {
        let share = source[f] / source_total;
        let scale = 0.5 * ((flat[f] / flat_total).ln() - share.ln());
        let angles = corner_angles(lengths3(arrays.triangle(f)));
        let errors: [f64; 3] = std::array::from_fn(|k| (angles[k] - metric.angles[f][k]).abs());
        let error = errors[0].max(errors[1]).max(errors[2]);
        all = [all[0].min(scale), all[1].max(scale)];
        angle_max[1] = angle_max[1].max(error);
        if least_sine(angles) > WELL_SHAPED && least_sine(metric.angles[f]) > WELL_SHAPED {
            well = [well[0].min(scale), well[1].max(scale)];
            angle_max[0] = angle_max[0].max(error);
        } else {
            thin_share += share;
        }
        mean += share * scale;
        square += share * scale * scale;
        angle_mean += share * errors.iter().sum::<f64>() / 3.0;
        weight += share;
    }
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
