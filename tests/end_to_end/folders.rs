//! Assets of more components than get a folder each.

use crate::command::{build_into, program, verify};
use serde_json::Value;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// Tetrahedra beside each other, and at the end of them a Möbius strip where one is asked for.
fn tetrahedra(count: usize, one_sided: bool) -> String {
    let mut text = String::new();
    for i in 0..count {
        for [x, y, z] in [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]] {
            writeln!(text, "v {} {y} {z}", x + 3 * i).expect("a string");
        }
        for corners in [[1, 3, 2], [1, 2, 4], [2, 3, 4], [1, 4, 3]] {
            let [a, b, c] = corners.map(|k| 4 * i + k);
            writeln!(text, "f {a} {b} {c}").expect("a string");
        }
    }
    if one_sided {
        for (x, y, z) in [(0, 0, 0), (4, 0, 1), (5, 3, 2), (2, 5, 1), (-1, 3, 3)] {
            writeln!(text, "v {x} {y} {}", z + 50).expect("a string");
        }
        for i in 0..5 {
            let [a, b, c] = [i, i + 1, i + 2].map(|k| 4 * count + k % 5 + 1);
            writeln!(text, "f {a} {b} {c}").expect("a string");
        }
    }
    text
}

/// A folder with a mesh of five tetrahedra and perhaps a strip in it.
fn mesh(one_sided: bool) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("many.obj");
    fs::write(&path, tetrahedra(5, one_sided)).expect("written");
    (folder, path)
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder").flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}

fn listed(asset: &Path) -> Value {
    let text = fs::read(asset.join("components.json")).expect("components.json");
    serde_json::from_slice(&text).expect("JSON")
}

/// What the program says of a folder, and whether all is well.
fn said(args: &[&str], folder: &Path) -> (bool, String) {
    let output = program().args(args).arg(folder).output().expect("it runs");
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8_lossy(&said).into_owned();
    (output.status.success(), said)
}

const FEWER: &str = "output.component_folders=4";

#[test]
fn more_components_than_folders_are_asked_for_have_files_of_all_only() {
    let (input, mesh) = mesh(false);
    let (few, all) = (input.path().join("few"), input.path().join("all"));
    for (out, folders) in [(&few, FEWER), (&all, "output.component_folders=5")] {
        let output = build_into(out, &mesh, &[folders, "pictures.enabled=true"]);
        assert_eq!(output.status.code(), Some(0));
        verify(out);
    }
    let asset = few.join("many");
    assert_eq!(
        names(&asset),
        [
            "components.json",
            "preview.png",
            "report.html",
            "surface.glb"
        ]
    );
    // Where it may speak, it says so.
    let mut loud = program();
    loud.args(["build", "--set", FEWER, "--out"]);
    let output = loud.arg(input.path().join("loud")).arg(&mesh).output();
    let said = String::from_utf8_lossy(&output.expect("it runs").stderr).into_owned();
    let sentence = "has 5 components, more than the 4 of output.component_folders";
    assert_eq!(said.matches(sentence).count(), 1, "{said}");
    // Nothing is left of what was written to be checked.
    assert_eq!(names(&few).iter().filter(|n| n.contains("many")).count(), 1);
    for file in ["surface.glb", "preview.png"] {
        let of = |out: &Path| fs::read(out.join("many").join(file)).expect("there");
        assert!(of(&few) == of(&all), "{file} is another one");
    }
    let document = listed(&asset);
    let schema = program().args(["schema", "components"]).output();
    let schema: Value = serde_json::from_slice(&schema.expect("it runs").stdout).expect("JSON");
    jsonschema::validate(&schema, &document).expect("valid");
    for (i, entry) in document["components"]
        .as_array()
        .expect("a list")
        .iter()
        .enumerate()
    {
        let folder = all.join(format!("many/component-{i:03}"));
        let text = fs::read(folder.join("atlas.json")).expect("atlas.json");
        let atlas: Value = serde_json::from_slice(&text).expect("JSON");
        let figures = &entry["figures"];
        assert_eq!(entry["state"], "built");
        assert_eq!(document["source"]["blake3"], atlas["source"]["blake3"]);
        for key in ["faces", "vertices", "genus", "boundary_loops"] {
            assert_eq!(figures[key], atlas["topology"][key], "{key}");
        }
        assert_eq!(
            figures["area_distortion"],
            atlas["quality"]["area_distortion"]
        );
        assert_eq!(figures["image_psnr_db"], atlas["quality"]["image_psnr_db"]);
        assert_eq!(figures["low"][0], 3.0 * i as f64);
    }
    let page = fs::read_to_string(asset.join("report.html")).expect("a page");
    assert!(page.contains("more than the 4 of <code>output.component_folders</code>"));
    assert!(
        !page.contains("component-00"),
        "it links to folders that are not there"
    );
    // The run's page has the same figures of both but for the names of their folders.
    let index = |out: &Path| fs::read_to_string(out.join("history.jsonl")).expect("there");
    let faces = |out: &Path| {
        let text = index(out);
        let from = text.find("\"faces\":").expect("figures");
        text[from..].split(',').next().expect("a number").to_owned()
    };
    assert_eq!(faces(&few), faces(&all));
}

#[test]
fn folders_come_and_go_as_asked_for() {
    let (input, mesh) = mesh(false);
    let out = input.path().join("out");
    for (folders, count) in [("4", 0), ("256", 5), ("0", 0)] {
        let output = build_into(
            &out,
            &mesh,
            &[&format!("output.component_folders={folders}")],
        );
        assert_eq!(output.status.code(), Some(0));
        let names = names(&out.join("many"));
        assert_eq!(
            names.iter().filter(|n| n.starts_with("component-")).count(),
            count
        );
        assert_eq!(names.contains(&"components.json".to_owned()), count == 0);
    }
    // A folder of another program is not replaced.
    let foreign = input.path().join("foreign/many/components.json");
    fs::create_dir_all(foreign.parent().expect("a folder")).expect("made");
    fs::write(&foreign, "{\"style\": \"default\"}").expect("written");
    let output = build_into(&input.path().join("foreign"), &mesh, &[]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        fs::read_to_string(&foreign)
            .expect("there")
            .contains("style")
    );
    // A single component is the asset.
    let single = Path::new("fixtures/good/disk-mask.obj");
    build_into(&out, single, &["output.component_folders=0"]);
    assert!(out.join("disk-mask/atlas.json").is_file());
}

#[test]
fn what_needs_folders_says_how_to_get_them() {
    let (input, mesh) = mesh(false);
    build_into(input.path(), &mesh, &[FEWER]);
    let asset = input.path().join("many");
    let out = input.path().join("x.glb");
    let out = out.to_string_lossy();
    let pattern = "fixtures/patterns/waves.png";
    for args in [
        &["explain"][..],
        &["fit"],
        &["rebuild", "--out", &out],
        &["texture", "--out", &out, "--pattern", pattern],
    ] {
        let (good, said) = said(args, &asset);
        assert!(
            !good && said.contains("set output.component_folders=5"),
            "{args:?}: {said}"
        );
    }
}

#[test]
fn failed_components_are_listed_and_damage_is_found() {
    let (input, mesh) = mesh(true);
    let output = build_into(input.path(), &mesh, &[FEWER]);
    assert_eq!(output.status.code(), Some(1), "one of them is one-sided");
    let asset = input.path().join("many");
    let mut document = listed(&asset);
    let last = &document["components"][5];
    assert_eq!(
        (&last["state"], &last["kind"]),
        (&"failed".into(), &"input".into())
    );
    assert!(last["figures"].is_null());
    verify(&asset);
    let good = document.to_string();
    let mut damaged = |pointer: &str, value: Value, wanted: &str| {
        document = serde_json::from_str(&good).expect("JSON");
        *document.pointer_mut(pointer).expect("a member") = value;
        fs::write(asset.join("components.json"), document.to_string()).expect("written");
        let (passed, said) = said(&["verify"], &asset);
        assert!(!passed && said.contains(wanted), "{pointer}: {said}");
    };
    let unread = "FAIL  components.json can be read";
    damaged("/format", "x".into(), unread);
    damaged("/components/0/figures/faces", 1.into(), "FAIL  surface.glb");
    let many = u64::MAX.into();
    damaged("/components/0/figures/faces", many, "FAIL  surface.glb");
    damaged("/components/0/figures/low/0", (-9.0).into(), "bounding box");
    damaged("/components/1/component", 2.into(), unread);
    damaged("/components/2/state", "failed".into(), unread);
    damaged("/components/5/state", "built".into(), unread);
    fs::write(asset.join("components.json"), &good).expect("written");
    verify(&asset);
    for (option, value, passes) in [
        ("--cones", "8", true),
        ("--cones", "7", false),
        ("--source", mesh.to_str().expect("Unicode"), false),
    ] {
        let (passed, said) = said(&["verify", option, value], &asset);
        assert_eq!(passed, passes, "{option} {value}: {said}");
    }
    fs::remove_file(asset.join("surface.glb")).expect("removed");
    let (passed, said) = said(&["verify"], &asset);
    assert!(
        !passed && said.contains("FAIL  surface.glb is there"),
        "{said}"
    );
}
