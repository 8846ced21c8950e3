//! The course of the flow: largest curvature error, in log scale, against flow time (Fig. 7 of the tutorial).

use super::canvas::Canvas;
use super::colour::{FAINT, INK, PAPER};
use super::text::{self, CHARACTER, LINE};
use crate::flow::ricci::Solver;
use crate::flow::step::FlowStep;
use crate::product::AffineAtlas;
use image::RgbImage;

/// Errors below this are rounding; they are drawn at it.
const FLOOR: f64 = 1e-17;
const CURVE: [u8; 3] = [24, 92, 160];
const GOAL: [u8; 3] = [200, 96, 40];

/// What a plot of the course shows.
pub(crate) struct Course<'a> {
    /// The steps, each with its flow time and log₁₀ of max |K − K̄|.
    pub points: Vec<(&'a FlowStep, [f64; 2])>,
    /// log₁₀ of the bound that the flow had to reach.
    pub goal: f64,
    /// Ends of the axis of errors, whole numbers.
    pub low: f64,
    pub high: f64,
    /// End of the axis of times.
    pub last: f64,
}

impl Course<'_> {
    /// Of the steps and the largest curvature error that was asked for.
    pub fn new(history: &[FlowStep], tolerance: f64) -> Course<'_> {
        let points: Vec<(&FlowStep, [f64; 2])> = (history.iter())
            .map(|step| (step, [step.flow_time, step.max_error.max(FLOOR).log10()]))
            .filter(|(_, p)| p.iter().all(|x| x.is_finite()))
            .collect();
        let goal = tolerance.max(FLOOR).log10();
        let goal = if goal.is_finite() { goal } else { -10.0 };
        let errors = points.iter().map(|(_, p)| p[1]);
        let low = errors.clone().fold(goal, f64::min).floor();
        let high = errors.fold(goal, f64::max).ceil().max(low + 1.0);
        let last = points.iter().map(|(_, p)| p[0]).fold(0.0, f64::max);
        let last = if last > 0.0 { last } else { 1.0 };
        Course {
            points,
            goal,
            low,
            high,
            last,
        }
    }

    /// Times to be named, about so many; whole ones where all steps are at whole times, as iterations are.
    pub fn time_ticks(&self, most: f64) -> Vec<f64> {
        let are_whole = self.points.iter().all(|(_, p)| p[0].fract() == 0.0);
        ticks([0.0, self.last], f64::from(u8::from(are_whole)), most)
    }

    /// Where a point lies between left and right, and between top and bottom, 0 to 1.
    pub fn place(&self, [time, error]: [f64; 2]) -> [f64; 2] {
        [
            time / self.last,
            (self.high - error) / (self.high - self.low),
        ]
    }
}

/// log₁₀ of max |K − K̄| against flow time with axes, and the bound that the flow had to reach as a line;
/// `size` × ⌊5/8 `size`⌋ pixels. The gradient flow is a straight line here, Newton a curve that falls ever faster.
pub fn convergence(atlas: &AffineAtlas, size: usize) -> RgbImage {
    let size = super::canvas::side(size);
    let (width, height) = (size, 5 * size / 8);
    let history = &atlas.metric.history;
    let course = Course::new(history, atlas.flow.curvature_tolerance);
    let Course {
        low, high, last, ..
    } = course;
    // Room for the labels where the picture is large enough to read them.
    let labelled = size >= 320;
    let (left, bottom, top, right) = match labelled {
        true => (90.0, 64.0, 66.0, 32.0),
        false => (8.0, 8.0, 8.0, 8.0),
    };
    let area = [width as f64 - left - right, height as f64 - top - bottom];
    let place = |p: [f64; 2]| {
        let [x, y] = course.place(p);
        [left + area[0] * x, top + area[1] * y]
    };
    let mut canvas = Canvas::new(width, height, PAPER);
    let decades = ticks([low, high], 1.0, area[1] / 34.0);
    let times = course.time_ticks(area[0] / 90.0);
    let mut line = |from, to, thickness, colour| {
        canvas.line(place(from), place(to), thickness, colour);
    };
    for &d in &decades {
        line([0.0, d], [last, d], 1.0, FAINT);
    }
    for &t in &times {
        line([t, low], [t, high], 1.0, FAINT);
    }
    line([0.0, low], [last, low], 1.4, INK);
    line([0.0, low], [0.0, high], 1.4, INK);
    line([0.0, course.goal], [last, course.goal], 1.6, GOAL);
    for pair in course.points.windows(2) {
        line(pair[0].1, pair[1].1, 2.2, CURVE);
    }
    if course.points.len() <= 80 {
        for &(_, p) in &course.points {
            canvas.disc(place(p), 4.6, CURVE, PAPER);
        }
    }
    let mut image = canvas.finish();
    if labelled {
        let mut label = |words: &str, at: [f64; 2], share| {
            text::write(&mut image, words, at, share, INK);
        };
        for &d in &decades {
            let [x, y] = place([0.0, d]);
            label(&format!("1e{d:.0}"), [x - 8.0, y], 1.0);
        }
        for &t in &times {
            let [x, y] = place([t, low]);
            label(&short(t), [x, y + 16.0], 0.5);
        }
        let (name, axis) = match atlas.flow.solver {
            Solver::Newton => ("Newton", "iteration"),
            Solver::Gradient => ("gradient flow", "flow time"),
        };
        let steps = history.last().map_or(0, |s| s.iteration);
        let reached = atlas.metric.max_curvature_error;
        let title = format!("{name}: {steps} steps, error {reached:.1e} rad");
        let middle = left + 0.5 * area[0];
        label(&title, [middle, 22.0], 0.5);
        label(axis, [middle, height as f64 - 12.0], 0.5);
        let of_axis = "largest curvature error, rad";
        label(of_axis, [CHARACTER as f64, top - LINE as f64], 0.0);
    }
    image
}

/// Multiples of a round number that is at least `least`, from `low` to `high`, at most about `most` of them.
pub(crate) fn ticks([low, high]: [f64; 2], least: f64, most: f64) -> Vec<f64> {
    let rough = ((high - low) / most.max(2.0)).max(least);
    let power = 10_f64.powf(rough.log10().floor());
    let round = [1.0, 2.0, 5.0, 10.0].map(|s| s * power);
    let step = round.into_iter().find(|&s| s >= rough).unwrap_or(round[3]);
    let (first, end) = ((low / step).ceil(), (high + 1e-9 * step) / step);
    if !(step > 0.0 && (end - first).is_finite()) {
        return vec![low];
    }
    (0..=(end.floor() - first).max(0.0) as usize)
        .map(|k| (first + k as f64) * step)
        .collect()
}

/// A tick's number without needless digits.
pub(crate) fn short(x: f64) -> String {
    if x == 0.0 || (0.01..1e5).contains(&x) {
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
        let times = |last, most| ticks([0.0, last], 0.0, most);
        assert_eq!(times(3.0, 4.0), [0.0, 1.0, 2.0, 3.0]);
        assert_eq!(times(1234.0, 4.0), [0.0, 500.0, 1000.0]);
        assert_eq!(times(f64::MAX, 4.0)[0], 0.0);
        let decades = ticks([-11.0, 1.0], 1.0, 7.0);
        assert_eq!(decades, [-10.0, -8.0, -6.0, -4.0, -2.0, 0.0]);
        assert_eq!(ticks([-2.0, -1.0], 1.0, 7.0), [-2.0, -1.0]);
        for last in [1e-300, 3e-7, 0.4, 1.0, 99.0, 1e5, 7e200] {
            let ticks = times(last, 6.0);
            assert!((2..=7).contains(&ticks.len()), "{last}: {ticks:?}");
        }
    }

    #[test]
    fn numbers_are_short() {
        let texts = [0.0, 5.0, 0.25, 1500.0, 1e6, 2e-5].map(short);
        assert_eq!(texts, ["0", "5", "0.25", "1500", "1e6", "2e-5"]);
    }
}
