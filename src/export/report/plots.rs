//! Plots of the page: the course of the flow and histograms of distortion, drawn as SVG with every value in words.

use crate::export::html::figure;
use crate::export::pictures::checkerboard::{ascending, weighted_quantile};
use crate::export::pictures::convergence::{Course, short, ticks};
use crate::flow::step::FlowStep;
use std::fmt::Write as _;

/// Units of the drawings; text keeps its size on narrow screens because drawings are small.
const WIDTH: f64 = 360.0;
const HEIGHT: f64 = 240.0;
const LEFT: f64 = 66.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 14.0;
const BOTTOM: f64 = 40.0;
/// Points beyond this are not marked one by one.
const MARKED: usize = 200;
/// Bars of a histogram.
const BARS: usize = 40;
/// Share of the area beyond either end of a histogram, which its last bars count.
const BEYOND: f64 = 0.001;

fn svg(label: &str, content: &str) -> String {
    format!(
        "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{}\">\n{content}</svg>\n",
        crate::export::html::escape(label)
    )
}

fn axes(out: &mut String, horizontal: &str, upright: &str) {
    let (bottom, right) = (HEIGHT - BOTTOM, WIDTH - RIGHT);
    let _ = writeln!(
        out,
        "<path class=\"axis\" d=\"M{LEFT} {TOP}V{bottom}H{right}\"/>"
    );
    let middle = 0.5 * (LEFT + right);
    let _ = writeln!(
        out,
        "<text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">{horizontal}</text>",
        HEIGHT - 6.0
    );
    let height = 0.5 * (TOP + bottom);
    let _ = writeln!(
        out,
        "<text transform=\"translate(12 {height}) rotate(-90)\" text-anchor=\"middle\">{upright}</text>"
    );
}

fn tick_below(out: &mut String, x: f64, words: &str) {
    let y = HEIGHT - BOTTOM + 15.0;
    let _ = writeln!(
        out,
        "<text x=\"{x:.1}\" y=\"{y}\" text-anchor=\"middle\">{words}</text>"
    );
}

fn tick_beside(out: &mut String, y: f64, words: &str) {
    let (x, at) = (LEFT - 5.0, y + 4.0);
    let _ = writeln!(
        out,
        "<path class=\"grid\" d=\"M{LEFT} {y:.1}H{}\"/><text x=\"{x}\" y=\"{at:.1}\" text-anchor=\"end\">{words}</text>",
        WIDTH - RIGHT
    );
}

/// max |K − K̄| in log scale against flow time, and the bound that was asked for.
pub(super) fn convergence(history: &[FlowStep], tolerance: f64, time: &str) -> String {
    let course = Course::new(history, tolerance);
    let place = |p: [f64; 2]| {
        let [x, y] = course.place(p);
        [
            LEFT + (WIDTH - LEFT - RIGHT) * x,
            TOP + (HEIGHT - TOP - BOTTOM) * y,
        ]
    };
    let mut out = String::new();
    for decade in ticks([course.low, course.high], 1.0, 7.0) {
        tick_beside(&mut out, place([0.0, decade])[1], &format!("1e{decade:.0}"));
    }
    for t in course.time_ticks(5.0) {
        tick_below(&mut out, place([t, 0.0])[0], &short(t));
    }
    axes(&mut out, time, "max |K − K̄| [rad]");
    let y = place([0.0, course.goal])[1];
    let _ = writeln!(
        out,
        "<path class=\"goal\" d=\"M{LEFT} {y:.1}H{}\"><title>asked for: {} rad</title></path>",
        WIDTH - RIGHT,
        figure(tolerance)
    );
    let (mut path, mut dots) = (String::new(), String::new());
    for (i, &(step, p)) in course.points.iter().enumerate() {
        let [x, y] = place(p);
        let _ = write!(path, "{}{x:.1} {y:.1}", if i == 0 { 'M' } else { 'L' });
        if course.points.len() <= MARKED {
            let (number, error) = (step.iteration, figure(step.max_error));
            let _ = writeln!(
                dots,
                "<circle class=\"dot\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\"><title>step {number}: {error} rad</title></circle>"
            );
        }
    }
    let _ = write!(out, "<path class=\"curve\" d=\"{path}\"/>\n{dots}");
    svg(
        "Largest curvature error against the steps of the flow",
        &out,
    )
}

/// Shares of the area in bars of equal width.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Histogram {
    /// Ends of the bars together.
    pub range: [f64; 2],
    /// Share of each bar; the first and last also count what lies beyond.
    pub bars: Vec<f64>,
}

impl Histogram {
    /// Of values with weights.
    pub fn new(values: impl Iterator<Item = (f64, f64)>) -> Histogram {
        let values = ascending(values);
        let [low, high] = [BEYOND, 1.0 - BEYOND].map(|share| weighted_quantile(&values, share));
        // All the same: one bar in the middle.
        let is_one = high - low <= 1e-12 * high.abs().max(1e-12);
        let slack = if is_one {
            0.5e-6_f64.max(low.abs())
        } else {
            0.0
        };
        let (low, high) = (low - slack, high + slack);
        let mut bars = vec![0.0; BARS];
        let total: f64 = values.iter().map(|v| v.1).sum();
        for (value, weight) in values {
            let bar = ((value - low) / (high - low) * BARS as f64).floor();
            let bar = (bar.max(0.0) as usize).min(BARS - 1);
            bars[bar] += weight / total;
        }
        Histogram {
            range: [low, high],
            bars,
        }
    }

    /// The bars; `what` names the values, with their unit.
    pub fn draw(&self, label: &str, what: &str) -> String {
        let [low, high] = self.range;
        let most = self.bars.iter().copied().fold(0.0, f64::max);
        let most = if most > 0.0 { most } else { 1.0 };
        let wide = (WIDTH - LEFT - RIGHT) / self.bars.len().max(1) as f64;
        let tall = HEIGHT - TOP - BOTTOM;
        let mut out = String::new();
        for share in [0.5, 1.0] {
            let words = format!("{:.1}\u{a0}%", 100.0 * share * most);
            tick_beside(&mut out, TOP + tall * (1.0 - share), &words);
        }
        let step = (high - low) / self.bars.len().max(1) as f64;
        for (i, share) in self.bars.iter().enumerate() {
            let (from, to) = (low + step * i as f64, low + step * (i + 1) as f64);
            let words = match i {
                0 => format!("below {}", figure(to)),
                _ if i + 1 == self.bars.len() => format!("from {}", figure(from)),
                _ => format!("{} to {}", figure(from), figure(to)),
            };
            let height = tall * share / most;
            let _ = writeln!(
                out,
                "<rect class=\"bar\" x=\"{:.1}\" y=\"{:.2}\" width=\"{:.1}\" height=\"{height:.2}\"><title>{words}: {:.2} % of the area</title></rect>",
                LEFT + wide * i as f64 + 0.5,
                TOP + tall - height,
                wide - 1.0,
                100.0 * share
            );
        }
        for (share, value) in [(0.0, low), (0.5, 0.5 * (low + high)), (1.0, high)] {
            let x = LEFT + (WIDTH - LEFT - RIGHT) * (0.04 + 0.9 * share);
            tick_below(&mut out, x, &figure(value));
        }
        axes(&mut out, what, "share of the area");
        svg(label, &out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_add_up_to_the_whole_area() {
        let values = (0..1000).map(|i| (f64::from(i), 1.0 + f64::from(i % 7)));
        let histogram = Histogram::new(values);
        assert!((histogram.bars.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(histogram.bars.iter().all(|&share| share > 0.01));
        let same = Histogram::new([(0.25, 2.0), (0.25, 1.0), (f64::NAN, 5.0)].into_iter());
        assert_eq!(same.bars.iter().filter(|&&share| share > 0.0).count(), 1);
        assert!(same.range[0] < 0.25 && 0.25 < same.range[1]);
        let none = Histogram::new(std::iter::empty());
        assert!(none.bars.iter().all(|&share| share == 0.0));
        assert!(!none.draw("", "").contains("NaN"));
    }

    #[test]
    fn the_curve_goes_through_every_step() {
        let history: Vec<FlowStep> = (0..5)
            .map(|i| FlowStep {
                iteration: i,
                max_error: 10f64.powi(-3 * i as i32),
                flow_time: i as f64,
                ..FlowStep::default()
            })
            .collect();
        let text = convergence(&history, 1e-10, "step");
        assert_eq!(text.matches("<circle").count(), 5);
        assert!(text.contains("step 4: 1.000e-12 rad"), "{text}");
        // A surface that is flat already has one step without an error.
        assert!(!convergence(&[FlowStep::default()], 0.0, "step").contains("NaN"));
    }
}
