//! Circle packings that cannot exist: what `check` and `build` say of them, and the picture of the region.

use crate::command::{build_small, program};
use std::path::Path;

const PRETZEL: &str = "fixtures/good/genus-3-pretzel.obj";

/// What `check` prints, and its exit code.
fn check(settings: &[&str], region: Option<&Path>) -> (String, Option<i32>) {
    let mut command = program();
    command.arg("check").arg(PRETZEL);
    for setting in settings {
        command.arg("--set").arg(setting);
    }
    if let Some(path) = region {
        command.arg("--region").arg(path);
    }
    let output = command.output().expect("the program starts");
    let said = String::from_utf8(output.stdout).expect("UTF-8");
    (said, output.status.code())
}

/// The line about existence.
fn verdict(said: &str) -> &str {
    let known = ["circle packing", "flat metric", "refused"];
    let of = |l: &&str| known.iter().any(|k| l.trim_start().starts_with(k));
    said.lines().rfind(of).expect("a verdict").trim()
}

#[test]
fn without_repair_the_region_is_named_and_drawn() {
    let settings = [
        "flow.scheme=tangential",
        "cones.strategy=single",
        "connectivity.enabled=false",
    ];
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("region.glb");
    let (said, code) = check(&settings, Some(&path));
    assert_eq!(code, Some(1), "{said}");
    insta::assert_snapshot!(verdict(&said), @"refused: no circle packing exists: vertex 2577 must have more than -4π of curvature by (6), but -8π is prescribed; let connectivity repair split edges there (connectivity.enabled = true), move the cones, or use the scheme `vertex-scaling` with flow.delaunay = true");
    // The build refuses in the same words.
    let built = build_small(Path::new(PRETZEL), &settings);
    assert_eq!(built.code(), Some(1));
    let reason = verdict(&said).trim_start_matches("refused: ").to_owned();
    assert!(built.message().contains(&reason), "{}", built.message());
    // The picture has every face, those of the region first, and the region's vertices.
    let file = gltf::Gltf::open(&path).expect("a GLB");
    let mesh = file.meshes().next().expect("a mesh");
    let counts: Vec<usize> = mesh
        .primitives()
        .map(|p| p.indices().map_or(0, |i| i.count() / 3))
        .collect();
    let text = std::fs::read_to_string(PRETZEL).expect("the fixture");
    let faces = text.lines().filter(|l| l.starts_with("f ")).count();
    assert_eq!(counts.iter().sum::<usize>(), faces);
    let extras = mesh.extras().as_ref().expect("extras").get();
    let extras: serde_json::Value = serde_json::from_str(extras).expect("JSON");
    let region = &extras["affineAtlas"];
    let first = region["vertices"][0].as_u64().expect("a vertex");
    assert!(said.contains(&format!("vertex {first} ")), "{said}");
    assert_eq!(region["curvature"], -8.0);
}

#[test]
fn with_repair_the_packing_exists() {
    for scheme in ["tangential", "thurston"] {
        let scheme = format!("flow.scheme={scheme}");
        let (said, code) = check(&[&scheme, "cones.strategy=single"], None);
        assert_eq!(code, Some(0), "{said}");
        let none = "circle packing: none on the connectivity as given: vertex";
        assert!(said.contains(none), "{said}");
        let exists = "circle packing: exists, (6) holds for every region";
        assert!(verdict(&said).starts_with(exists), "{said}");
    }
}

#[test]
fn other_schemes_say_what_they_need() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("region.glb");
    let (said, code) = check(&["cones.strategy=single"], Some(&path));
    assert_eq!(code, Some(0), "{said}");
    assert!(!path.exists() && said.contains("region: none to show"));
    insta::assert_snapshot!(verdict(&said), @"flat metric: exists; with flips Gauss–Bonnet and positive cone angles are all it takes, and both hold");
    let (said, _) = check(&["flow.scheme=inversive-distance"], None);
    insta::assert_snapshot!(verdict(&said), @"flat metric: Gauss–Bonnet and positive cone angles hold; whether this scheme has one on this connectivity is not known before the flow");
}
