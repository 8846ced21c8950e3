//! Surfaces that are measured: noise, and heights in whole numbers. Nothing of what is sharp there is an edge of a solid.

use crate::command::{document, program, verify};
use serde_json::Value;
use std::fmt::Write as _;

/// Builds heights over a square of 40 × 40 cells, see [`built_of`].
fn built(height: impl Fn(u64, u64) -> f64) -> (Value, String) {
    const SIDE: u64 = 40;
    let mut text = String::new();
    for (i, j) in (0..=SIDE).flat_map(|j| (0..=SIDE).map(move |i| (i, j))) {
        writeln!(text, "v {i} {j} {}", height(i, j)).expect("a string");
    }
    for a in (0..SIDE).flat_map(|j| (1..=SIDE).map(move |i| j * (SIDE + 1) + i)) {
        let (b, c, d) = (a + 1, a + SIDE + 2, a + SIDE + 1);
        writeln!(text, "f {a} {b} {c}\nf {a} {c} {d}").expect("a string");
    }
    built_of(&text)
}

/// Builds a mesh with defaults, but for the number of cells; what `atlas.json` says, and what the program does.
fn built_of(obj: &str) -> (Value, String) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mesh = folder.path().join("rough.obj");
    std::fs::write(&mesh, obj).expect("written");
    let mut command = program();
    command.arg("build").arg(&mesh).arg("--out");
    command.arg(folder.path().join("out"));
    for setting in [
        "pictures.enabled=false",
        "report.enabled=false",
        "grid.cells=400",
    ] {
        command.args(["--set", setting]);
    }
    let output = command.output().expect("the program starts");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{said}");
    let atlas = folder.path().join("out/rough");
    verify(&atlas);
    (document(&atlas), said)
}

fn features(document: &Value) -> usize {
    document["features"].as_array().map_or(0, Vec::len)
}

/// A number in [−1, 1) that depends on nothing but `i` (the finaliser of SplitMix64).
fn noise(i: u64) -> f64 {
    let mut x = i.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (x ^ (x >> 31)) as f64 / 2.0_f64.powi(63) - 1.0
}

#[test]
fn terraces_of_a_hill_are_no_lines() {
    let (document, said) = built(|i, j| {
        let [x, y] = [i, j].map(|at| (at as f64 - 20.0) / 20.0);
        (8.0 * (1.0 - 0.9 * (x * x + y * y)).max(0.0)).round()
    });
    // Four corners of the border, and those of a feature or two where terraces are no rings.
    let irregular = document["grid"]["irregular"].as_array().map_or(0, Vec::len);
    assert!(irregular <= 12, "{irregular} irregular points");
    assert!(features(&document) <= 6, "{}", features(&document));
    assert!(!said.contains("sharp edges"), "{said}");
}

#[test]
fn noise_is_no_line_and_many_irregular_points_are_told() {
    let irregular = |document: &Value| document["grid"]["irregular"].as_array().map_or(0, Vec::len);
    // What is smaller than a cell makes none.
    let (document, said) = built(|i, j| 0.8 * noise(i << 16 | j));
    assert_eq!(features(&document), 0);
    assert!(irregular(&document) <= 12, "{said}");
    let (document, said) = built(|i, j| 1.5 * noise(i << 16 | j));
    assert!(features(&document) <= 3, "{}", features(&document));
    assert!(!said.contains("in no feature"), "{said}");
    let irregular = irregular(&document);
    let sentence = format!("has {irregular} irregular points in ");
    assert!(
        irregular > 40 && said.contains(&sentence),
        "{irregular}: {said}"
    );
    assert!(said.contains("cones.count"), "{said}");
}

/// Rims of discs that volumes leave turn to and fro. A cylinder whose rims do so by 50° has the irregular points of any other.
#[test]
fn a_rim_that_turns_to_and_fro_has_no_corners() {
    const AROUND: u32 = 48;
    const ROWS: u32 = 12;
    let mut text = String::new();
    // Rings from the middle of the foot to that of the top; the rims are those of the cylinder itself.
    let feet = [0.3, 0.6, 0.85];
    let rings = feet.map(|r| (r, -1.0, 0.0)).into_iter();
    let rows = (0..=ROWS).map(|j| (1.0, 2.0 * f64::from(j) / f64::from(ROWS) - 1.0, 1.0));
    let tops = feet.map(|r| (r, 1.0, 0.0)).into_iter().rev();
    let rings: Vec<(f64, f64, f64)> = rings.chain(rows).chain(tops).collect();
    for &(radius, height, is_wall) in &rings {
        for i in 0..AROUND {
            let (y, x) = (f64::from(i) / f64::from(AROUND) * std::f64::consts::TAU).sin_cos();
            let is_rim = is_wall == 1.0 && height.abs() == 1.0;
            let tooth = if is_rim { 0.03 } else { 0.0 } * [1.0, -1.0][i as usize % 2];
            let z = height + tooth * height;
            writeln!(text, "v {} {} {z}", radius * x, radius * y).expect("a string");
        }
    }
    writeln!(text, "v 0 0 -1\nv 0 0 1").expect("a string");
    let count = rings.len() as u32;
    let at = |j: u32, i: u32| 1 + j * AROUND + i % AROUND;
    for i in 0..AROUND {
        for j in 1..count {
            let [a, b, c, d] = [at(j - 1, i), at(j - 1, i + 1), at(j, i + 1), at(j, i)];
            writeln!(text, "f {a} {b} {c}\nf {a} {c} {d}").expect("a string");
        }
        let (foot, top) = (count * AROUND + 1, count * AROUND + 2);
        writeln!(text, "f {foot} {} {}", at(0, i + 1), at(0, i)).expect("a string");
        writeln!(
            text,
            "f {top} {} {}",
            at(count - 1, i),
            at(count - 1, i + 1)
        )
        .expect("a string");
    }
    let (document, said) = built_of(&text);
    let irregular = document["grid"]["irregular"].as_array().map_or(0, Vec::len);
    assert_eq!((irregular, features(&document)), (8, 2), "{said}");
}
