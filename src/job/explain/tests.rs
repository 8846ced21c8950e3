use super::*;
use crate::config::Config;
use crate::outcome::AssetState;
use std::path::PathBuf;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures")
        .join(name)
}

fn explained(name: &str, change: impl FnOnce(&mut Config)) -> Explanation {
    let mut config = Config::default();
    change(&mut config);
    mesh(&fixture(name), &config).unwrap()
}

/// How many faces of each mark the GLB has.
fn counts(explanation: &Explanation) -> serde_json::Value {
    let bytes = explanation.glb().unwrap().unwrap();
    let file = gltf::Gltf::from_slice(&bytes).unwrap();
    let drawn = file.document.meshes().next().unwrap();
    let extras: serde_json::Value =
        serde_json::from_str(drawn.extras().as_ref().unwrap().get()).unwrap();
    extras["affineAtlas"]["faces"].clone()
}

#[test]
fn a_one_sided_strip_is_shown_where_it_contradicts_itself() {
    let said = explained("bad/moebius-strip.obj", |_| {});
    assert!(said.failed());
    let text = said.to_string();
    assert!(text.contains("fails (input): the component"), "{text}");
    assert!(text.contains("at 2 faces of the file: "), "{text}");
    assert_eq!(counts(&said)["offending"], 2);
}

#[test]
fn what_strict_refuses_is_listed_and_shown() {
    let said = explained("bad/duplicated-face.obj", |config| {
        config.repair.strict = true
    });
    let text = said.to_string();
    assert!(said.failed() && text.contains("repair.strict"), "{text}");
    assert!(text.contains("has the same vertices as face"), "{text}");
    assert!(counts(&said)["offending"].as_u64().unwrap() >= 1);
}

#[test]
fn a_cone_without_an_angle_is_shown_by_the_faces_around_it() {
    let said = explained("good/genus-0-cube.obj", |config| {
        let at = |vertex, curvature: &str| crate::flow::cones::ConeSpec {
            vertex: Some(vertex),
            point: None,
            curvature: curvature.parse().unwrap(),
        };
        config.cones.list = vec![at(0, "5/2"), at(1, "3/2")];
    });
    let text = said.to_string();
    assert!(text.contains("fails (prescription): vertex 0"), "{text}");
    assert!(text.contains("at 1 vertex of the file: 0 ("), "{text}");
    assert!(counts(&said)["offending"].as_u64().unwrap() >= 3);
}

/// The folder of a build says the same as the mesh, and what both say is what the atlas states.
#[test]
fn distortion_is_that_of_the_atlas() {
    let root = tempfile::tempdir().unwrap();
    let path = fixture("good/genus-0-animal.ply");
    let mut config = Config::default();
    config.pictures.enabled = false;
    config.report.enabled = false;
    config.patches.texel_budget = 16384;
    let built = crate::job::run(&path, "animal", root.path(), "animal", &config, &());
    assert_eq!(built.state, AssetState::Built);
    let from_mesh = mesh(&path, &config).unwrap();
    let from_folder = folder(&root.path().join("animal")).unwrap();
    assert_eq!(from_mesh.to_string(), from_folder.to_string());
    assert!(!from_folder.failed());
    let text = std::fs::read(root.path().join("animal/atlas.json")).unwrap();
    let document: serde_json::Value = serde_json::from_slice(&text).unwrap();
    let of = |pointer: &str| document.pointer(pointer).unwrap().as_f64().unwrap();
    let said = from_folder.to_string();
    for words in [
        format!(
            "{:.3} to {:.3}",
            of("/quality/log_scale/min"),
            of("/quality/log_scale/max")
        ),
        format!("standard deviation {:.3})", of("/quality/log_scale/std")),
        format!("mean error {:.4} rad", of("/quality/angle_error/mean")),
        format!("largest {:.3} rad", of("/quality/angle_error/max")),
    ] {
        assert!(said.contains(&words), "{words} is not in:\n{said}");
    }
    assert!(said.contains("to change: "), "{said}");
    let counts = counts(&from_folder);
    assert!(counts["grown"].as_u64() > Some(0) && counts["shrunk"].as_u64() > Some(0));
}

#[test]
fn an_asset_that_is_only_recorded_is_told_by_its_record() {
    let root = tempfile::tempdir().unwrap();
    let line = r#"{"id":"bad","input_hash":null,"config_hash":"00","state":"failed","kind":"input","error":"mend it","seconds":0.0,"peak_memory":null,"files":[],"components":[]}"#;
    std::fs::write(root.path().join("manifest.jsonl"), line).unwrap();
    let said = asset(&root.path().join("bad"), &Config::default()).unwrap();
    assert!(said.failed());
    assert!(said.to_string().contains("failed (input): mend it"));
    assert!(said.glb().is_none());
    let failure = asset(&root.path().join("unknown"), &Config::default()).unwrap_err();
    assert!(failure.message.contains("neither a mesh nor a folder"));
}

#[test]
fn loops_and_features_of_a_seamless_metric_are_told() {
    let said = explained("good/genus-3-pretzel.obj", |config| {
        config.cones.strategy = crate::flow::cones::ConeStrategy::Field;
        config.flow.holonomy = crate::flow::ricci::Holonomy::QuarterTurns;
    });
    let text = said.to_string();
    assert!(!said.failed(), "{text}");
    assert!(text.contains("6 independent loops turn by"), "{text}");
    assert!(text.contains("nearest conformal map"), "{text}");
}

/// Settings for grids are no advice for flat patches whose turns happen to be quarters.
#[test]
fn advice_is_for_the_domain_that_is_built() {
    let on = |domain| {
        let text = explained("good/genus-3-pretzel.obj", |config| {
            config.images.domain = Some(domain);
            config.cones.strategy = crate::flow::cones::ConeStrategy::Field;
            config.flow.holonomy = crate::flow::ricci::Holonomy::QuarterTurns;
        });
        text.to_string()
    };
    let (grid, flat) = (on(Domain::Grid), on(Domain::Flat));
    assert!(grid.contains("features.angle"), "{grid}");
    assert!(!flat.contains("features.angle"), "{flat}");
    assert!(flat.contains("to change: "), "{flat}");
}
