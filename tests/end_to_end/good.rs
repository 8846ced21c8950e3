//! Every good fixture becomes an atlas that passes, the same bytes for any number of threads.

use crate::command::{build, build_into, document, verify};
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::path::Path;

/// Bytes of every file of a folder, by name.
pub fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let name = entry.file_name().into_string().expect("UTF-8");
        if entry.path().is_dir() {
            let inner = self::files(&entry.path()).into_iter();
            files.extend(inner.map(|(file, bytes)| (format!("{name}/{file}"), bytes)));
        } else {
            files.insert(name, std::fs::read(entry.path()).expect("readable"));
        }
    }
    files
}

/// Multiples of π/2, at least three quarter turns around each; on a closed surface they add up to 2πχ.
fn assert_default_cones(document: &serde_json::Value, genus: u32, loops: u32) {
    let cones = document["cones"].as_array().expect("a list").iter();
    let curvature = |cone: &serde_json::Value| cone["curvature"].as_f64().expect("radians") / PI;
    let curvature: Vec<f64> = cones.map(curvature).collect();
    assert!(!curvature.is_empty());
    let is_of_grid = |k: &f64| (2.0 * k - (2.0 * k).round()).abs() < 1e-9 && *k < 0.5 + 1e-9;
    assert!(curvature.iter().all(is_of_grid), "{curvature:?}");
    let sum: f64 = curvature.iter().sum();
    let required = 4.0 - 4.0 * f64::from(genus);
    assert!(loops > 0 || (sum - required).abs() < 1e-9, "{sum}");
}

/// Every figure of the page is the one of the document.
fn assert_same_figures(report: &[u8], document: &serde_json::Value) {
    let text = std::str::from_utf8(report).expect("UTF-8");
    let mut figures = 0;
    for rest in text.split("data-key=\"").skip(1) {
        let (key, rest) = rest.split_once("\" data-value=\"").expect("a value");
        let (value, _) = rest.split_once('"').expect("an end");
        let shown: serde_json::Value = serde_json::from_str(value).expect("JSON");
        assert_eq!(Some(&shown), document.pointer(key), "{key}");
        figures += 1;
    }
    assert!(figures > 20, "{figures} figures");
    for name in ["cones", "segments", "transitions", "patches"] {
        let (_, rest) = text
            .split_once(&format!("<table id=\"{name}\""))
            .expect(name);
        let (rows, _) = rest.split_once("</tbody>").expect("an end");
        let (_, rows) = rows.split_once("<tbody>").expect("a body");
        let stated = document[name].as_array().expect("a list").len();
        assert_eq!(rows.matches("<tr>").count(), stated, "{name}");
    }
}

fn one_and_two_threads(fixture: &str, genus: u32, loops: u32) {
    let mesh = format!("fixtures/good/{fixture}");
    let run = |threads: &str| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let threads = format!("run.threads={threads}");
        let settings = ["pictures.enabled=true", "pictures.size=64", &threads];
        let output = build_into(folder.path(), Path::new(&mesh), &settings);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{said}");
        folder
    };
    let (one, two) = (run("1"), run("2"));
    let name = fixture.split('.').next().expect("a name");
    let atlas = one.path().join(name);
    verify(&atlas);
    let document = document(&atlas);
    assert_eq!(document["topology"]["genus"], genus);
    assert_eq!(document["topology"]["boundary_loops"], loops);
    assert_default_cones(&document, genus, loops);

    let (first, second) = (files(&atlas), files(&two.path().join(name)));
    assert!(first.keys().eq(second.keys()));
    for (file, bytes) in &first {
        assert!(bytes == &second[file], "{file} depends on the threads");
        assert!(!bytes.is_empty(), "{file} is empty");
    }
    for file in [
        "atlas.json",
        "atlas.npz",
        "surface.glb",
        "images/0000.exr",
        "report.html",
    ] {
        assert!(first.contains_key(file), "{file} is missing");
    }
    assert_same_figures(&first["report.html"], &document);
    for picture in ["preview", "layout", "log-scale", "convergence"] {
        assert!(first.contains_key(&format!("{picture}.png")), "{picture}");
    }
}

#[test]
fn genus_0_animal() {
    one_and_two_threads("genus-0-animal.ply", 0, 0);
}

#[test]
fn genus_0_cube() {
    one_and_two_threads("genus-0-cube.obj", 0, 0);
}

/// The eight corners hold all the curvature that a cube has: with cones there the metric stays as it is.
#[test]
fn a_cube_gets_its_corners() {
    let built = build(Path::new("fixtures/good/genus-0-cube.obj"), &[]);
    let document = document(&built.atlas());
    let cones = document["cones"].as_array().expect("a list");
    assert_eq!(cones.len(), 8);
    for cone in cones {
        let curvature = cone["curvature"].as_f64().expect("radians");
        assert!((curvature - 0.5 * PI).abs() < 1e-9, "{cone}");
    }
    let std = document["quality"]["log_scale"]["std"].as_f64();
    assert!(std.is_some_and(|std| std < 1e-9), "{std:?}");
}

#[test]
fn genus_1_mug() {
    one_and_two_threads("genus-1-mug.off", 1, 0);
}

#[test]
fn genus_2_amphora() {
    one_and_two_threads("genus-2-amphora.glb", 2, 0);
}

#[test]
fn genus_3_pretzel() {
    one_and_two_threads("genus-3-pretzel.obj", 3, 0);
}

#[test]
fn disk_mask() {
    one_and_two_threads("disk-mask.obj", 0, 1);
}

#[test]
fn three_boundaries_rabbit() {
    one_and_two_threads("three-boundaries-rabbit.ply", 0, 3);
}

/// The list above is complete.
#[test]
fn no_good_fixture_is_left_out() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/good");
    assert_eq!(std::fs::read_dir(folder).expect("committed").count(), 7);
}

#[test]
fn a_report_that_nobody_wants_is_not_there() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mesh = Path::new("fixtures/good/genus-0-cube.obj");
    let output = build_into(folder.path(), mesh, &["report.enabled=false"]);
    assert_eq!(output.status.code(), Some(0));
    let written = files(&folder.path().join("genus-0-cube"));
    assert!(written.contains_key("atlas.json") && !written.contains_key("report.html"));
    let index = std::fs::read_to_string(folder.path().join("index.html")).expect("written");
    assert!(index.contains("genus-0-cube") && !index.contains("report.html\""));
}
