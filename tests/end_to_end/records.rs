//! What a run leaves for other programs: warnings, and what is no longer there.

use crate::command::program;
use serde_json::Value;
use std::path::Path;

const MESH: &str = "mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nusemtl red\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).expect("written by the run")
}

#[test]
fn warnings_are_kept_and_an_empty_run_leaves_no_cases() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (meshes, out) = (folder.path().join("meshes"), folder.path().join("out"));
    std::fs::create_dir(&meshes).expect("made");
    std::fs::write(meshes.join("red.obj"), MESH).expect("written");
    let run = || {
        let mut command = program();
        command.arg("build").arg(&meshes).arg("--out").arg(&out);
        command.args(["--set", "pictures.enabled=false", "--set", "grid.cells=200"]);
        command.output().expect("the program starts")
    };
    let mut checked = 0;
    for state in ["built", "cached"] {
        assert_eq!(run().status.code(), Some(0));
        let record: Value = serde_json::from_str(&read(&out.join("manifest.jsonl"))).expect("JSON");
        assert_eq!(
            (&record["state"], &record["warning_count"]),
            (&state.into(), &1.into())
        );
        let [warning] = &record["warnings"].as_array().expect("a list")[..] else {
            panic!("{record}");
        };
        let warning = warning.as_str().expect("a sentence");
        assert!(warning.contains("gone.mtl"), "{warning}");
        assert!(record["checked"].as_u64() >= Some(checked));
        checked = record["checked"].as_u64().expect("a time");
        let junit = read(&out.join("junit.xml"));
        assert!(
            junit.contains(&format!("<system-out>{state}&#10;warning: ")),
            "{junit}"
        );
        let page = read(&out.join("index.html"));
        assert!(page.contains("<b>1</b> with warnings") && page.contains("gone.mtl"));
    }
    std::fs::remove_file(meshes.join("red.obj")).expect("removed");
    assert_eq!(run().status.code(), Some(3));
    let junit = read(&out.join("junit.xml"));
    assert!(
        junit.contains("tests=\"0\"") && !junit.contains("testcase"),
        "{junit}"
    );
}
