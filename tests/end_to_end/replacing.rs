//! Older output: replaced as a whole by better, kept where the new build fails.

use crate::OF_THE_RUN;
use crate::command::{build_into, document, verify};
use crate::good::files;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

fn bad(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures/bad")
        .join(name)
}

/// A reader that looks all the time sees the old folder or the new one, and never a part of one.
#[test]
fn a_second_build_replaces_the_folder_in_one_step() {
    let out = tempfile::tempdir().expect("a temporary folder");
    let cube = Path::new("fixtures/good/genus-0-cube.obj");
    let atlas = out.path().join("genus-0-cube");
    assert!(build_into(out.path(), cube, &[]).status.success());
    std::fs::write(atlas.join("left-over.txt"), "of an earlier version").expect("written");

    let done = AtomicBool::new(false);
    let looks = std::thread::scope(|scope| {
        let reader = scope.spawn(|| {
            let mut looks = 0;
            while !done.load(Ordering::Relaxed) {
                let text = std::fs::read_to_string(atlas.join("atlas.json"));
                let text = text.expect("there is always an atlas");
                serde_json::from_str::<serde_json::Value>(&text).expect("whole");
                looks += 1;
            }
            looks
        });
        let output = build_into(out.path(), cube, &["flow.scheme=thurston"]);
        done.store(true, Ordering::Relaxed);
        assert!(output.status.success());
        reader.join().expect("saw an atlas at every look")
    });
    assert!(looks > 1);
    assert_eq!(document(&atlas)["metric"]["scheme"], "thurston");
    assert!(!atlas.join("left-over.txt").exists());
    verify(&atlas);
    let names: Vec<String> = files(out.path()).into_keys().collect();
    assert!(
        names.iter().all(|n| OF_THE_RUN
            .iter()
            .any(|own| n == own || n.starts_with(&format!("{own}/")))
            || n.starts_with("genus-0-cube/")),
        "{names:?}"
    );
}

#[test]
fn a_refused_mesh_leaves_the_older_atlas_alone() {
    let out = tempfile::tempdir().expect("a temporary folder");
    let input = tempfile::tempdir().expect("a temporary folder");
    let mesh = input.path().join("mesh.obj");
    std::fs::copy(bad("zero-area-face.obj"), &mesh).expect("copied");
    assert!(build_into(out.path(), &mesh, &[]).status.success());
    let atlas = out.path().join("mesh");
    let before = files(&atlas);
    for refused in ["nan-position.obj", "moebius-strip.obj", "empty.obj"] {
        std::fs::copy(bad(refused), &mesh).expect("copied");
        let output = build_into(out.path(), &mesh, &[]);
        assert_eq!(output.status.code(), Some(1));
        assert!(files(&atlas) == before, "{refused} changed the older atlas");
    }
    let manifest = std::fs::read_to_string(out.path().join("manifest.jsonl")).expect("there");
    let record: serde_json::Value = serde_json::from_str(manifest.trim()).expect("one line");
    assert_eq!(record["state"], "failed");
}

/// Component 1 of 3 is one-sided: the others are built, and what an earlier version of it gave is kept.
#[test]
fn one_bad_component_of_three() {
    let out = tempfile::tempdir().expect("a temporary folder");
    let input = tempfile::tempdir().expect("a temporary folder");
    let mesh = input.path().join("mesh.obj");
    let text = std::fs::read_to_string(bad("one-bad-component.obj")).expect("committed");
    let atlas = out.path().join("mesh");
    let component = |i: usize| atlas.join(format!("component-00{i}"));

    // Without the faces that close the strip it is an ordinary band.
    let lines: Vec<&str> = text.lines().collect();
    let ring = lines.iter().position(|l| *l == "o ring").expect("there");
    let open = [&lines[..ring - 4], &lines[ring..]].concat().join("\n");
    std::fs::write(&mesh, open).expect("written");
    let output = build_into(out.path(), &mesh, &[]);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    let before = files(&component(1));
    assert!(before.contains_key("atlas.json"));

    std::fs::write(&mesh, text).expect("written");
    let output = build_into(out.path(), &mesh, &["flow.scheme=thurston"]);
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("component 1"), "{said}");
    assert!(files(&component(1)) == before, "the older band was touched");
    for good in [0, 2] {
        verify(&component(good));
        assert_eq!(document(&component(good))["metric"]["scheme"], "thurston");
    }

    // Into an empty folder: no trace of the bad one.
    let empty = tempfile::tempdir().expect("a temporary folder");
    let output = build_into(empty.path(), &mesh, &[]);
    assert_eq!(output.status.code(), Some(1));
    let built = empty.path().join("mesh");
    assert!(built.join("component-000/atlas.json").exists());
    assert!(!built.join("component-001").exists());
    assert!(built.join("component-002/atlas.json").exists());
}
