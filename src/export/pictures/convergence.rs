//! The course of the flow: largest curvature error, in log scale, against flow time (Fig. 7 of the tutorial).

use super::canvas::Canvas;
use super::colour::{FAINT, INK, PAPER};
use super::text::{self, Anchor, CHARACTER, LINE};
use crate::flow::ricci::Solver;
use crate::product::AffineAtlas;
use image::RgbImage;

/// Errors below this are rounding; they are drawn at it.
const FLOOR: f64 = 1e-17;
const CURVE: [u8; 3] = [24, 92, 160];
const GOAL: [u8; 3] = [200, 96, 40];

/// log₁₀ of max |K − K̄| against flow time with axes, and the bound that the flow had to reach as a dashed line;
/// `size` × ⌊5/8 `size`⌋ pixels. The gradient flow is a straight line here, Newton a curve that falls ever faster.
pub fn convergence(atlas: &AffineAtlas, size: usize) -> RgbImage {
    let size = super::size::side(size);
    let (width, height) = (size, (5 * size / 8).max(1));
    let points: Vec<[f64; 2]> = (atlas.metric.history.iter())
        .map(|step| [step.flow_time, step.max_error.max(FLOOR).log10()])
        .filter(|p| p.iter().all(|x| x.is_finite()))
        .collect();
    let goal = atlas.flow.curvature_tolerance.max(FLOOR).log10();
    let goal = if goal.is_finite() { goal } else { -10.0 };

    let errors = || points.iter().map(|p| p[1]).chain([goal]);
    let low = errors().fold(f64::INFINITY, f64::min).floor();
    let high = errors()
        .fold(f64::NEG_INFINITY, f64::max)
        .ceil()
        .max(low + 1.0);
    let last = points.iter().map(|p| p[0]).fold(0.0, f64::max);
    let last = if last > 0.0 { last } else { 1.0 };

    // Room for the labels where the picture is large enough to read them.
    let labelled = size >= 320;
    let (left, bottom, top, right) = if labelled {
        (
            (7 * CHARACTER + LINE) as f64,
            3.2 * LINE as f64,
            2.2 * LINE as f64,
            1.6 * LINE as f64,
        )
    } else {
        (8.0, 8.0, 8.0, 8.0)
    };
    let area = [width as f64 - left - right, height as f64 - top - bottom];
    let place = |p: [f64; 2]| {
        [
            left + area[0] * p[0] / last,
            top + area[1] * (high - p[1]) / (high - low),
        ]
    };

    let mut canvas = Canvas::new(width, height, PAPER);
    let decades = decades(low, high, area[1] / 34.0);
    let times = ticks(last, area[0] / 90.0);
    for &d in &decades {
        canvas.line(place([0.0, d]), place([last, d]), 1.0, FAINT);
    }
    for &t in &times {
        canvas.line(place([t, low]), place([t, high]), 1.0, FAINT);
    }
    canvas.dashes(place([0.0, goal]), place([last, goal]), 1.6, GOAL);
    canvas.line(place([0.0, low]), place([last, low]), 1.4, INK);
    canvas.line(place([0.0, low]), place([0.0, high]), 1.4, INK);
    for pair in points.windows(2) {
        canvas.line(place(pair[0]), place(pair[1]), 2.2, CURVE);
    }
    if points.len() <= 80 {
        for &p in &points {
            canvas.disc(place(p), 4.6, CURVE, PAPER);
        }
    }

    let mut image = canvas.finish();
    if labelled {
        for &d in &decades {
            let at = place([0.0, d]);
            text::write(
                &mut image,
                &format!("1e{d:.0}"),
                [at[0] - 8.0, at[1]],
                Anchor::End,
                INK,
            );
        }
        for &t in &times {
            let at = place([t, low]);
            text::write(
                &mut image,
                &short(t),
                [at[0], at[1] + 16.0],
                Anchor::Middle,
                INK,
            );
        }
        let (name, axis) = match atlas.flow.solver {
            Solver::Newton => ("Newton", "iteration"),
            Solver::Gradient => ("gradient flow", "flow time"),
        };
        let middle = place([0.5 * last, 0.5 * (low + high)]);
        let steps = atlas.metric.history.last().map_or(0, |s| s.iteration);
        let reached = atlas.metric.max_curvature_error;
        let title = format!("{name}: {steps} steps, error {reached:.1e} rad");
        text::write(
            &mut image,
            &title,
            [middle[0], 0.5 * top],
            Anchor::Middle,
            INK,
        );
        let below = height as f64 - 0.6 * LINE as f64;
        text::write(&mut image, axis, [middle[0], below], Anchor::Middle, INK);
        let beside = [0.7 * LINE as f64, middle[1]];
        text::write_upwards(&mut image, "largest curvature error, rad", beside, INK);
    }
    image
}

/// Powers of ten from `low` to `high`, at most about `most` of them.
fn decades(low: f64, high: f64, most: f64) -> Vec<f64> {
    let step = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0]
        .into_iter()
        .find(|s| (high - low) / s <= most.max(2.0))
        .unwrap_or(500.0);
    let first = (low / step).ceil();
    let count = ((high / step).floor() - first).max(0.0) as usize;
    (0..=count).map(|k| step * (first + k as f64)).collect()
}

/// Round numbers from 0 to `last`, at most about `most` of them.
fn ticks(last: f64, most: f64) -> Vec<f64> {
    let rough = last / most.max(2.0);
    let power = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|s| s * power)
        .find(|&s| s >= rough)
        .unwrap_or(10.0 * power);
    if !(step > 0.0 && step.is_finite()) {
        return vec![0.0];
    }
    (0..=(last / step * (1.0 + 1e-9)) as usize)
        .map(|k| k as f64 * step)
        .collect()
}

/// A tick's number without needless digits.
fn short(x: f64) -> String {
    if x == 0.0 {
        "0".into()
    } else if (0.01..1e5).contains(&x) {
        let text = format!("{x:.3}");
        text.trim_end_matches('0').trim_end_matches('.').into()
    } else {
        format!("{x:.0e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_few() {
        assert_eq!(ticks(7.0, 8.0), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        assert_eq!(ticks(1234.0, 4.0), [0.0, 500.0, 1000.0]);
        assert_eq!(ticks(f64::MAX, 4.0)[0], 0.0);
        assert_eq!(
            decades(-11.0, 1.0, 7.0),
            [-10.0, -8.0, -6.0, -4.0, -2.0, 0.0]
        );
        for last in [1e-300, 3e-7, 0.4, 1.0, 99.0, 1e5, 7e200] {
            let ticks = ticks(last, 6.0);
            assert!((2..=7).contains(&ticks.len()), "{last}: {ticks:?}");
        }
    }

    #[test]
    fn numbers_are_short() {
        let texts = [0.0, 5.0, 0.25, 1500.0, 1e6, 2e-5].map(short);
        assert_eq!(texts, ["0", "5", "0.25", "1500", "1e6", "2e-5"]);
    }
}
