//! `affine-atlas cones`: what it writes is accepted by `build` and gives what it promised.

use crate::command::{document, program};
use crate::good::files;
use serde_json::Value;
use std::path::Path;
use std::process::Output;

/// Surveys a mesh into a folder.
fn survey(folder: &Path, mesh: &str, more: &[&str]) -> Output {
    let mut command = program();
    command.args(["cones", mesh, "--out"]).arg(folder);
    command.args(["--set", "pictures.size=64"]).args(more);
    command.output().expect("the program starts")
}

fn table(folder: &Path, name: &str) -> Value {
    let text = std::fs::read(folder.join(format!("{name}.cones/cones.json"))).expect("a table");
    serde_json::from_slice(&text).expect("JSON")
}

/// Builds by a configuration alone and gives `atlas.json`.
fn built(config: &Path, more: &[&str], atlas: &Path) -> Value {
    let mut command = program();
    command.arg("build").arg(config).arg("--quiet");
    command.args(["--set", "pictures.enabled=false"]).args(more);
    let output = command.output().expect("the program starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    document(atlas)
}

/// The same cones, and the same metric as far as its figures tell, all to the last bit.
fn same(row: &Value, atlas: &Value) {
    let cones = |list: &Value| -> Vec<(u64, f64)> {
        let list = list.as_array().expect("a list");
        list.iter()
            .map(|c| {
                let vertex = c.get("source_vertex").unwrap_or(&c["vertex"]);
                (
                    vertex.as_u64().expect("a vertex"),
                    c["curvature"].as_f64().expect("a curvature"),
                )
            })
            .collect()
    };
    assert_eq!(cones(&row["cones"]), cones(&atlas["cones"]));
    for figure in ["log_scale", "angle_error", "cut_length"] {
        assert_eq!(row[figure], atlas["quality"][figure], "{figure}");
    }
}

fn round_trip(mesh: &str, name: &str, count: u64) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let root = folder.path();
    let counts = format!("{count}");
    let output = survey(
        root,
        &format!("fixtures/good/{mesh}"),
        &["--counts", &counts],
    );
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    let table = table(root, name);
    let rows = table["components"][0]["rows"].as_array().expect("rows");
    let row = rows
        .iter()
        .find(|row| row["asked"] == count && row["strategy"] != "spread")
        .expect("the row");
    let place = root.join(format!("{name}.cones"));
    let stem = format!("{name}.cones-{count}");
    let atlas = root.join(name);
    let config = place.join(format!("{stem}.toml"));
    same(row, &built(&config, &[], &atlas));
    if row["placed"] == 0 {
        assert!(!place.join(format!("{stem}.txt")).exists());
        return;
    }
    // The same by the two-column text.
    let text = root.join("by-text.toml");
    let inputs = std::fs::read_to_string(&config).expect("text");
    let paths = inputs
        .lines()
        .find(|l| l.starts_with("paths = "))
        .expect("a path");
    // The mesh is outside of this folder: the path starts at the configuration.
    let paths = paths.replacen("../", "", 1);
    std::fs::write(
        &text,
        format!("[input]\n{paths}\n[output]\nfolder = \"text\"\n[cones]\nfile = \"{name}.cones/{stem}.txt\"\n"),
    )
    .expect("written");
    same(row, &built(&text, &[], &root.join("text").join(name)));
}

#[test]
fn a_sphere() {
    round_trip("genus-0-animal.ply", "genus-0-animal", 6);
}

#[test]
fn a_torus_without_cones() {
    round_trip("genus-1-mug.off", "genus-1-mug", 0);
}

#[test]
fn a_pretzel() {
    round_trip("genus-3-pretzel.obj", "genus-3-pretzel", 4);
}

#[test]
fn a_disk_with_a_free_boundary() {
    round_trip("disk-mask.obj", "disk-mask", 0);
    round_trip("disk-mask.obj", "disk-mask", 5);
}

#[test]
fn a_folder_holds_what_the_help_says_and_the_same_for_any_number_of_threads() {
    let run = |threads: &str| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mesh = "fixtures/good/genus-0-cube.obj";
        let output = survey(
            folder.path(),
            mesh,
            &["--counts", "4,8", "--threads", threads],
        );
        assert!(output.status.success());
        folder
    };
    let (one, two) = (run("1"), run("2"));
    let place = |folder: &tempfile::TempDir| files(&folder.path().join("genus-0-cube.cones"));
    let (first, second) = (place(&one), place(&two));
    let names: Vec<&str> = first.keys().map(String::as_str).collect();
    assert_eq!(
        names,
        [
            "cones.json",
            "cones.png",
            "genus-0-cube.cones-4.png",
            "genus-0-cube.cones-4.toml",
            "genus-0-cube.cones-4.txt",
            "genus-0-cube.cones-8.png",
            "genus-0-cube.cones-8.toml",
            "genus-0-cube.cones-8.txt",
        ]
    );
    for (name, bytes) in &first {
        // The way to the mesh differs with the name of the temporary folder's depth only.
        assert!(*bytes == second[name], "{name} depends on the threads");
    }
    // Nothing but the folder, and nothing hidden.
    assert_eq!(std::fs::read_dir(one.path()).expect("a folder").count(), 1);
}

#[test]
fn a_bad_component_does_not_spoil_the_others_and_json_tells_all() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mesh = "fixtures/bad/one-bad-component.obj";
    let more = [
        "--counts",
        "4",
        "--json",
        "--quiet",
        "--set",
        "pictures.enabled=false",
    ];
    let output = survey(folder.path(), mesh, &more);
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("one-sided"), "{said}");
    let all: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let components = all[0]["components"].as_array().expect("components");
    let refused = components
        .iter()
        .filter(|c| c.get("error").is_some())
        .count();
    assert_eq!(refused, 1);
    let good = components
        .iter()
        .find(|c| c.get("rows").is_some())
        .expect("one");
    assert!(good["rows"][0]["seconds"].as_f64().expect("seconds") > 0.0);
    assert!(
        good["suggestion"]["reason"]
            .as_str()
            .expect("a sentence")
            .contains("(")
    );
    let files = files(&folder.path().join("one-bad-component.cones"));
    assert!(files.contains_key("one-bad-component.cones-4.toml"));
    let table = std::str::from_utf8(&files["cones.json"]).expect("UTF-8");
    assert!(!table.contains("seconds"));
}

#[test]
fn nothing_is_written_where_nothing_can_be_tried() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for mesh in ["fixtures/bad/empty.obj", "fixtures/bad/moebius-strip.obj"] {
        let output = survey(folder.path(), mesh, &[]);
        assert_eq!(output.status.code(), Some(1));
    }
    assert_eq!(
        std::fs::read_dir(folder.path()).expect("a folder").count(),
        0
    );
}
