//! Spline surfaces by the program: what the folder holds, from a mesh and from the folder of its atlas.

use crate::command::{Built, build, document, program};
use crate::good::files;
use serde_json::Value;
use std::f64::consts::TAU;
use std::path::Path;
use std::process::Output;

const ANIMAL: &str = "fixtures/good/genus-0-animal.ply";
const MASK: &str = "fixtures/good/disk-mask.obj";

fn fit(input: &Path, into: &Path, more: &[&str]) -> Output {
    let mut command = program();
    command.arg("fit").arg(input).arg("--out").arg(into);
    command.args(more).output().expect("the program starts")
}

fn good(output: &Output) {
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{said}");
}

fn figures(folder: &Path) -> Value {
    let text = std::fs::read(folder.join("fit.json")).expect("there");
    serde_json::from_slice(&text).expect("JSON")
}

fn gridded(mesh: &str) -> Built {
    build(Path::new(mesh), &["grid.cells=300", "report.enabled=false"])
}

/// The same bytes for any number of threads, and no file but those that the documents name.
#[test]
fn a_mesh_becomes_a_folder_of_surfaces() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut all = Vec::new();
    for threads in ["1", "2"] {
        // The page has the name of the folder.
        let into = folder.path().join(threads).join("surface");
        good(&fit(
            Path::new(ANIMAL),
            &into,
            &["--cells", "300", "--threads", threads],
        ));
        all.push(files(&into));
    }
    assert!(all[0] == all[1], "threads change bytes");
    let names: Vec<String> = all[0].keys().cloned().collect();
    let stem = "genus-0-animal";
    let mut wanted = ["cage.obj", "glb", "step", "usda", "xml", "zebra.png"]
        .map(|e| format!("{stem}.{e}"))
        .to_vec();
    wanted.extend(["fit.html", "fit.json"].map(str::to_owned));
    wanted.sort();
    assert_eq!(names, wanted);
    let figures = figures(&folder.path().join("1/surface"));
    let component = &figures["components"][0];
    assert_eq!(component["closed"], true);
    assert_eq!(component["turned_over_area"], 0.0);
    assert!(component["step"]["normal_jump_regular"]["max_degrees"].as_f64() < Some(6e-5));
    assert!(component["both_ways"]["rms_of_diagonal"].as_f64() < Some(5e-3));
}

/// On the grid of a build the control mesh has its quads.
#[test]
fn a_folder_has_its_grid() {
    let built = gridded(MASK);
    let atlas = built.atlas();
    let folder = tempfile::tempdir().expect("a folder");
    let into = folder.path().join("mask");
    good(&fit(&atlas, &into, &[]));
    let figures = figures(&into);
    let component = &figures["components"][0];
    assert_eq!(component["closed"], false);
    assert_eq!(component["cells"], document(&atlas)["grid"]["cells"]);
    let refused = fit(&atlas, &into, &["--cells", "200"]);
    assert_eq!(refused.status.code(), Some(1));
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(
        said.contains("give the mesh in place of the folder"),
        "{said}"
    );
}

/// The largest distance is below what was asked, in a unit or as a part of the diagonal, and a smaller one takes more cells.
/// All vertices of its ends lie around them: cones of the grid need others inside.
#[test]
fn ends_of_a_cylinder_have_no_cell_with_a_corner_of_half_a_turn() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut text = String::new();
    for k in 0..96 {
        let (y, x) = (TAU * f64::from(k % 48) / 48.0).sin_cos();
        let z = 4 * (k / 48);
        text += &format!("v {x} {y} {z}\n");
    }
    for k in 0..48 {
        let (a, b) = (k + 1, (k + 1) % 48 + 1);
        text += &format!("f {a} {b} {} {}\n", b + 48, a + 48);
    }
    let ends = [(1..=48).rev().collect(), (49..=96).collect::<Vec<_>>()];
    for end in ends {
        let corners: Vec<String> = end.iter().map(i32::to_string).collect();
        text += &format!("f {}\n", corners.join(" "));
    }
    let mesh = folder.path().join("cylinder.obj");
    std::fs::write(&mesh, text).expect("written");
    let into = folder.path().join("surface");
    good(&fit(&mesh, &into, &[]));
    let figures = figures(&into);
    let component = &figures["components"][0];
    assert_eq!(component["turned_over_area"], 0.0);
    assert!(component["least_jacobian"].as_f64() > Some(0.02));
    assert!(component["from_source"]["max_of_diagonal"].as_f64() < Some(1e-3));
    // Two circles of 28 cells, although edges of the mesh do not end where cells do.
    assert!(component["crease_edges"].as_u64() >= Some(40));
    assert_eq!(component["corners"], 0);
}

/// A component without a surface does not spoil the others: it is named, and the exit code says so.
#[test]
fn a_bad_component_is_named_and_the_others_are_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let into = folder.path().join("surfaces");
    let mesh = Path::new("fixtures/bad/one-bad-component.obj");
    let output = fit(mesh, &into, &["--cells", "60"]);
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("failed: component-001"), "{said}");
    assert!(
        said.contains("one-bad-component: cones (component 1 of 3)"),
        "{said}"
    );
    let figures = figures(&into);
    let names = |key: &str| -> Vec<Value> {
        let list = figures[key].as_array().expect("a list").iter();
        list.map(|c| c["name"].clone()).collect()
    };
    assert_eq!(names("components"), ["component-000", "component-002"]);
    assert_eq!(names("unfitted"), ["component-001"]);
    let files = files(&into);
    assert!(files.contains_key("component-002.step") && !files.contains_key("component-001.step"));
    let page = std::fs::read_to_string(into.join("fit.html")).expect("there");
    assert!(page.contains("No surface:"));
}

#[test]
fn tolerances_are_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let cells_and_distance = |name: &str, tolerance: &str| {
        let into = folder.path().join(name);
        good(&fit(
            Path::new(ANIMAL),
            &into,
            &["--tolerance", tolerance, "--unit", "cm"],
        ));
        let figures = figures(&into);
        assert_eq!(figures["unit"], "centimetre");
        let component = &figures["components"][0];
        let number = |x: &Value| x.as_f64().expect("a number");
        let source = &component["from_source"];
        (
            number(&component["cells"]),
            number(&source["max_of_diagonal"]),
            number(&source["max_source_units"]),
        )
    };
    let (coarse, off, length) = cells_and_distance("coarse", "0.02");
    assert!(off <= 0.02, "{off}");
    let (fine, off, _) = cells_and_distance("fine", "0.003");
    assert!(
        off <= 0.003 && fine > coarse,
        "{off}, {fine} and {coarse} cells"
    );
    // A millimetre is a tenth of a source unit.
    let (_, _, off) = cells_and_distance("length", &format!("{}mm", 10.0 * length));
    assert!(off <= length, "{off} {length}");
}
