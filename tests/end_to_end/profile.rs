//! `build --profile`: a trace of stages and their parts.

use crate::command::program;
use std::path::Path;

#[test]
fn a_profile_tells_of_every_stage_and_its_parts() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("trace.json");
    let mesh = Path::new("fixtures/good/genus-0-cube.obj");
    let mut command = program();
    command
        .arg("build")
        .arg(mesh)
        .arg("--out")
        .arg(folder.path());
    command.arg("--profile").arg(&path);
    let output = command.output().expect("the program starts");
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let text = std::fs::read_to_string(&path).expect("written");
    let trace: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let events = trace["traceEvents"].as_array().expect("a list");
    let time = |event: &serde_json::Value, key: &str| event[key].as_u64().expect("a number");
    let of = |name: &str| {
        let found = events.iter().find(|e| e["ph"] == "X" && e["name"] == name);
        let found = found.unwrap_or_else(|| panic!("{name} is missing: {text}"));
        [time(found, "ts"), time(found, "ts") + time(found, "dur")]
    };
    // Stages one after another.
    let stages = [
        "read", "repair", "cones", "flow", "grid", "images", "write", "verify", "pages",
    ];
    for pair in stages.windows(2) {
        let [before, after] = [of(pair[0]), of(pair[1])];
        assert!(
            before[1] <= after[0] + 1000,
            "{pair:?}: {before:?} {after:?}"
        );
    }
    // Parts inside them.
    for (part, stage) in [
        ("quantise", "grid"),
        ("relax", "grid"),
        ("npz", "write"),
        ("page", "verify"),
    ] {
        let (inner, mut outer) = (of(part), of(stage));
        if part == "page" {
            // Drawn beside the checks where there are two threads, and after them where there is one.
            outer[1] = of("pages")[1];
        }
        assert!(
            outer[0] <= inner[0] + 1000 && inner[1] <= outer[1] + 1000,
            "{part}"
        );
    }
    let named = events
        .iter()
        .find(|e| e["ph"] == "M")
        .expect("the mesh is named");
    assert_eq!(named["args"]["name"], "genus-0-cube");
    // Nothing of it is said on the terminal.
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(!said.contains("quantise"), "{said}");
}
