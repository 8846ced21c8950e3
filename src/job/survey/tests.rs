//! Surveys of small surfaces made by hand.

use super::*;
use crate::flow::step::FlowStep;
use crate::job;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A ball of rows and columns with a bump, so that some places for cones are better than others.
fn ball() -> Soup {
    let (rows, columns) = (9_u32, 12_u32);
    let mut positions = vec![[0.0, 0.0, 1.6], [0.0, 0.0, -1.0]];
    for row in 1..rows {
        let (s, z) = (PI * f64::from(row) / f64::from(rows)).sin_cos();
        for column in 0..columns {
            let (t, c) = (2.0 * PI * f64::from(column) / f64::from(columns)).sin_cos();
            let bump = if z > 0.7 { 1.4 } else { 1.0 };
            positions.push([s * c, s * t, bump * z]);
        }
    }
    let at = |row: u32, column: u32| match row {
        0 => 0,
        r if r == rows => 1,
        r => 2 + (r - 1) * columns + column % columns,
    };
    let mut faces = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let [a, b] = [at(row, column), at(row, column + 1)];
            let [c, d] = [at(row + 1, column + 1), at(row + 1, column)];
            faces.extend([[a, d, c], [a, c, b]]);
        }
    }
    faces.retain(|f| f[0] != f[1] && f[1] != f[2] && f[2] != f[0]);
    Soup::from_triangles(positions, faces)
}

/// The ball without its topmost faces.
fn bowl() -> Soup {
    let mut soup = ball();
    let faces = soup.faces.iter().copied();
    let faces: Vec<_> = faces.filter(|f| !f.contains(&0)).collect();
    soup = Soup::from_triangles(soup.positions, faces);
    soup
}

fn names(component: &ComponentSurvey) -> Vec<String> {
    component.rows.iter().map(Row::name).collect()
}

#[test]
fn what_is_compared_comes_first_and_only_what_can_exist_is_tried() {
    let only = |soup: &Soup, counts: Option<&[usize]>| {
        let mut all = survey(soup, &Config::default(), counts, &()).expect("surveyed");
        assert_eq!(all.len(), 1);
        all.remove(0)
    };
    let closed = only(&ball(), None);
    assert_eq!(
        names(&closed),
        [
            "spread 8",
            "spread 4",
            "spread 16",
            "spread 32",
            "auto 4",
            "auto 8",
            "auto 16",
            "auto 32"
        ]
    );
    assert_eq!(closed.before(16).expect("a row").name(), "spread 16");
    let open = only(&bowl(), None);
    assert_eq!(
        names(&open),
        ["none 0", "auto 4", "auto 8", "auto 16", "auto 32"].map(|n| n.replace(" 0", ""))
    );
    assert_eq!(open.before(16).expect("a row").name(), "none");
    // Only what was asked for, in order and once; what cannot be is said in its row.
    let asked = only(&ball(), Some(&[6, 0, 6, 1]));
    assert_eq!(
        names(&asked),
        ["spread 8", "spread 6", "none", "auto 1", "auto 6"]
    );
    let refused = asked.rows[2]
        .result
        .as_ref()
        .expect_err("a ball needs cones");
    assert!(
        refused
            .message
            .contains("needs cones of total curvature 4π"),
        "{}",
        refused.message
    );
    // Four corners: nothing beyond.
    let tetrahedron = Soup::from_triangles(
        vec![
            [1.0, 1.0, 1.0],
            [1.0, -1.0, -1.0],
            [-1.0, 1.0, -1.0],
            [-1.0, -1.0, 1.0],
        ],
        vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
    );
    let few = only(&tetrahedron, None);
    assert_eq!(names(&few), ["spread 4", "auto 4"]);
    assert_eq!(few.suggestion.expect("one").count, 4);
}

#[test]
fn figures_are_those_of_a_build_with_the_list() {
    for soup in [ball(), bowl()] {
        let config = Config::default();
        let surveyed = survey(&soup, &config, Some(&[8]), &()).expect("surveyed");
        for row in &surveyed[0].rows {
            let figures = row.result.as_ref().expect("flattened");
            let mut config = config.clone();
            config.cones.list = figures.list.clone().expect("every vertex has a number");
            config.cones.strategy = match figures.cones.is_empty() {
                true => ConeStrategy::None,
                false => ConeStrategy::Listed,
            };
            let built = job::build(&soup, &config, &()).expect("repaired");
            let atlas = built[0].as_ref().expect("built");
            let cones: Vec<(u32, f64)> = (atlas.prescription.cones.iter())
                .map(|cone| (atlas.mesh.source_vertex[cone.vertex], cone.curvature))
                .collect();
            assert_eq!(cones, figures.cones);
            let quality = &atlas.quality;
            assert_eq!(quality.log_scale, figures.log_scale);
            assert_eq!(quality.angle_error, figures.angle_error);
            assert_eq!(quality.cut_length, figures.cut_length);
            assert_eq!(
                atlas.metric.max_curvature_error,
                figures.max_curvature_error
            );
            let scale = &atlas.metric.log_scale.as_slice()[..figures.scene.log_scale.len()];
            assert_eq!(scale, figures.scene.log_scale);
            // Of the chart, and of the lengths: the same to rounding.
            let relative = quality.area_distortion / figures.area_distortion - 1.0;
            assert!(relative.abs() < 1e-8, "{relative:e}");
        }
    }
}

#[test]
fn curvatures_are_written_as_fractions_where_they_are_some() {
    for (radians, written) in [
        (PI / 2.0, "1/2"),
        (-2.0 * PI, "-2"),
        (2.0 / 3.0 * PI, "2/3"),
        (-3.0 * PI / 2.0, "-3/2"),
    ] {
        assert_eq!(
            multiple_of_pi(radians).expect("finite").to_string(),
            written
        );
    }
    for radians in [0.123, 1.5, -0.7, 3.141592653589794] {
        let multiple = multiple_of_pi(radians).expect("finite");
        assert!((multiple.radians() - radians).abs() <= 4.0 * f64::EPSILON * radians.abs());
        // As the text of a configuration, every bit.
        let text = multiple.to_string();
        assert_eq!(
            text.parse::<PiMultiple>().expect("read").radians(),
            multiple.radians()
        );
    }
    assert_eq!(multiple_of_pi(f64::NAN), None);
}

/// Asks to stop after some steps of the flow.
struct Stopping {
    steps: AtomicUsize,
}

impl Observer for Stopping {
    fn flow_step(&self, _: &FlowStep) {
        self.steps.fetch_add(1, Ordering::Relaxed);
    }
    fn cancelled(&self) -> bool {
        self.steps.load(Ordering::Relaxed) > 3
    }
}

#[test]
fn a_survey_stops_when_asked() {
    let observer = Stopping {
        steps: AtomicUsize::new(0),
    };
    let stopped = survey(&ball(), &Config::default(), None, &observer);
    assert!(matches!(stopped, Err(BuildError::Cancelled)));
}

#[test]
fn wrong_keys_are_refused_once() {
    let mut config = Config::default();
    config.boundary.totals = vec![PiMultiple::fraction(1, 1).expect("a fraction")];
    config.boundary.condition = Some(cones::BoundaryCondition::Free);
    let refused = survey(&bowl(), &config, None, &());
    assert!(matches!(refused, Err(BuildError::Cones(_))));
}
