//! Schemes and solvers.

use crate::command::{build_small, document, verify};
use crate::real_models::arrays::array;
use std::path::Path;

fn fixture(name: &str) -> std::path::PathBuf {
    Path::new("fixtures/good").join(name)
}

/// Slope, intercept and R² of a least-squares line.
fn line(points: &[(f64, f64)]) -> (f64, f64, f64) {
    let n = points.len() as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    let sxx = mean(&|p| (p.0 - x).powi(2));
    let syy = mean(&|p| (p.1 - y).powi(2));
    let sxy = mean(&|p| (p.0 - x) * (p.1 - y));
    let slope = sxy / sxx;
    (slope, y - slope * x, sxy * sxy / (sxx * syy))
}

#[test]
fn line_by_hand() {
    let (slope, intercept, r2) = line(&[(0.0, 5.0), (1.0, 3.0), (2.0, 1.0)]);
    assert!((slope + 2.0).abs() < 1e-14 && (intercept - 5.0).abs() < 1e-14);
    assert!((r2 - 1.0).abs() < 1e-14);
    // Means 1 and 4/3; sums of products 1, of squares 2 and 14/3: R² = 1²/(2 · 14/3).
    let (_, _, r2) = line(&[(0.0, 0.0), (1.0, 3.0), (2.0, 1.0)]);
    assert!((r2 - 3.0 / 28.0).abs() < 1e-14);
}

/// Newton and the gradient flow meet at the same u, and the error of the second decays exponentially (Fig. 7).
fn solvers_agree(name: &str, scheme: &str, cones: &str) {
    let scheme = &format!("flow.scheme={scheme}");
    let newton = build_small(&fixture(name), &["flow.solver=newton", scheme, cones]);
    let gradient = build_small(&fixture(name), &["flow.solver=gradient", scheme, cones]);
    // At the vertices of the file: where edges cross depends on the last flips.
    let log_scale = |atlas: &Path| {
        let u: Vec<f64> = array(atlas, "log_scale");
        let source: Vec<u32> = array(atlas, "source_vertex");
        let mut known: Vec<(u32, f64)> = source.into_iter().zip(u).collect();
        known.retain(|(vertex, _)| *vertex != u32::MAX);
        known.sort_by_key(|(vertex, _)| *vertex);
        let u: Vec<f64> = known.into_iter().map(|(_, u)| u).collect();
        let mean = u.iter().sum::<f64>() / u.len() as f64;
        (u, mean)
    };
    let (u, mean_u) = log_scale(&newton.atlas());
    let (w, mean_w) = log_scale(&gradient.atlas());
    assert_eq!(u.len(), w.len());
    // A closed surface's metric is unique up to one scale; both normalise it the same way, so the means agree too.
    assert!((mean_u - mean_w).abs() < 1e-7, "{mean_u} {mean_w}");
    let apart = (u.iter().zip(&w)).fold(0.0_f64, |worst, (a, b)| worst.max((a - b).abs()));
    assert!(apart < 1e-7, "{apart}");
    assert!(u.iter().any(|v| (v - mean_u).abs() > 1e-3), "nothing moved");

    let document = document(&gradient.atlas());
    assert_eq!(document["metric"]["solver"], "gradient");
    let history = document["metric"]["history"].as_array().expect("a list");
    let number = |record: &serde_json::Value, key: &str| record[key].as_f64().expect("a number");
    let end = number(history.last().expect("records"), "flow_time");
    assert!(number(history.last().expect("records"), "max_error") <= 1e-10);
    let tail: Vec<(f64, f64)> = history
        .iter()
        .filter(|record| number(record, "flow_time") >= 0.2 * end)
        .map(|record| {
            (
                number(record, "flow_time"),
                number(record, "max_error").ln(),
            )
        })
        .collect();
    assert!(tail.len() > 50, "{} records", tail.len());
    let (slope, _, r2) = line(&tail);
    assert!(slope < 0.0 && r2 >= 0.99, "slope {slope}, R² {r2}");
}

#[test]
fn solvers_agree_on_a_sphere() {
    for scheme in ["tangential", "vertex-scaling"] {
        // Away from the corners of the cube, where nothing would move.
        solvers_agree("genus-0-cube.obj", scheme, "cones.strategy=spread");
    }
}

#[test]
#[ignore = "long"]
fn solvers_agree_on_a_torus() {
    solvers_agree("genus-1-mug.off", "tangential", "cones.strategy=auto");
}

#[test]
#[ignore = "long"]
fn solvers_agree_on_a_disk() {
    solvers_agree("disk-mask.obj", "vertex-scaling", "cones.strategy=auto");
}

/// No cones on a torus: nothing turns, and the plane is tiled by two period vectors.
#[test]
fn a_flat_torus_has_translations_and_two_periods() {
    let built = build_small(&fixture("genus-1-mug.off"), &["cones.strategy=none"]);
    let document = document(&built.atlas());
    let segments = document["segments"].as_array().expect("a list");
    assert!(!segments.is_empty());
    for segment in segments {
        let rotation = segment["gluing"]["rotation"].as_f64().expect("a number");
        assert!(rotation.abs() < 1e-8, "{segment}");
    }
    let periods: Vec<[f64; 2]> =
        serde_json::from_value(document["periods"].clone()).expect("two vectors");
    assert_eq!(periods.len(), 2);
    let [p, q] = [periods[0], periods[1]];
    // The periods span the flat torus: the parallelogram has the area of all faces.
    let spanned = (p[0] * q[1] - p[1] * q[0]).abs();
    let lengths: Vec<f64> = array(&built.atlas(), "flat_length");
    let heron = |l: &[f64]| {
        let s = 0.5 * (l[0] + l[1] + l[2]);
        (s * (s - l[0]) * (s - l[1]) * (s - l[2])).sqrt()
    };
    let area: f64 = lengths.chunks_exact(3).map(heron).sum();
    assert!((spanned / area - 1.0).abs() < 1e-9, "{spanned} {area}");
}

/// An atlas that passes, or a refusal that says why: never an atlas that is wrong.
fn every_fixture_with(scheme: &str, delaunay: bool, least: usize) {
    let settings = [
        format!("flow.scheme={scheme}"),
        format!("flow.delaunay={delaunay}"),
    ];
    let settings = [settings[0].as_str(), settings[1].as_str()];
    let (mut atlases, mut flips) = (0, 0);
    let entries = std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/good"));
    for entry in entries.expect("committed").flatten() {
        let built = build_small(&entry.path(), &settings);
        let message = built.message();
        match built.code() {
            Some(0) => {
                verify(&built.atlas());
                let document = document(&built.atlas());
                assert_eq!(document["metric"]["scheme"], scheme);
                flips += document["metric"]["flips"].as_u64().expect("a number");
                atlases += 1;
            }
            Some(1) => {
                assert!(built.atlases().is_empty());
                let kinds = ["(prescription): ", "(not_converged): "];
                assert!(kinds.iter().any(|k| message.contains(k)), "{message}");
            }
            code => panic!("{code:?}: {message}"),
        }
    }
    assert!(atlases >= least, "{scheme}: only {atlases} atlases");
    assert_eq!(flips > 0, delaunay && scheme == "vertex-scaling");
}

#[test]
fn tangential() {
    every_fixture_with("tangential", true, 7);
}

#[test]
fn thurston() {
    every_fixture_with("thurston", true, 7);
}

#[test]
fn inversive_distance() {
    every_fixture_with("inversive-distance", true, 4);
}

#[test]
fn vertex_scaling_on_fixed_connectivity() {
    every_fixture_with("vertex-scaling", false, 4);
}

/// The flow that cannot fail.
#[test]
fn vertex_scaling_with_flips() {
    every_fixture_with("vertex-scaling", true, 7);
}
