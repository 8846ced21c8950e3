//! Atlases that are right pass every check: alone, as components, and as assets of an output folder.

use crate::verifying::fixture::{Atlas, cone, pillow, torus, tube};
use affine_atlas::verify::{
    SourceSurface, Verdicts, VerifyError, VerifyOptions, verify, verify_against,
};
use serde_json::json;
use std::path::Path;

fn run(folder: &Path) -> Verdicts {
    verify(folder, &VerifyOptions::default()).expect("something to verify")
}

fn failed(verdicts: &Verdicts) -> Vec<&str> {
    let failed = verdicts.checks.iter().filter(|check| !check.passed);
    failed.map(|check| check.name.as_str()).collect()
}

#[test]
fn good_atlases_pass_every_check() {
    type Make = fn() -> Atlas;
    let atlases: [(&str, Make); 4] = [
        ("torus", torus),
        ("pillow", pillow),
        ("tube", tube),
        ("cone", cone),
    ];
    // Lets the folders be looked at with other checkers.
    let keep = std::env::var_os("AFFINE_ATLAS_KEEP_FIXTURES");
    for (name, make) in atlases {
        let folder = tempfile::tempdir().expect("a folder");
        let path = match &keep {
            Some(keep) => Path::new(keep).join(name),
            None => folder.path().to_owned(),
        };
        make().write(&path);
        let verdicts = run(&path);
        assert!(verdicts.all_passed(), "{name}\n{verdicts}");
        assert!(verdicts.checks.len() > 80, "{name}");
    }
}

#[test]
fn verdicts_are_printed_a_line_a_check_with_a_total() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut atlas = torus();
    atlas.json["flags"]["seamless"] = json!(false);
    atlas.write(folder.path());
    let verdicts = run(folder.path());
    let text = verdicts.to_string();
    assert!(text.starts_with("ok    format\n"), "{text}");
    assert!(text.contains("\nFAIL  seamless flag is true to the gluings  0.000e0\n"));
    let total = format!("\n{} passed, 1 failed", verdicts.checks.len() - 1);
    assert!(text.ends_with(&total), "{text}");
    let value = serde_json::to_value(&verdicts).expect("plain data");
    assert_eq!(value["checks"][0]["name"], "format");
    assert_eq!(value["checks"][0]["passed"], true);
}

#[test]
fn verdicts_do_not_depend_on_the_number_of_threads() {
    let folder = tempfile::tempdir().expect("a folder");
    torus().write(folder.path());
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads").install(|| run(folder.path()))
    };
    assert_eq!(with(1), with(4));
}

#[test]
fn components_are_verified_each() {
    let folder = tempfile::tempdir().expect("a folder");
    for (number, make) in [torus, pillow].into_iter().enumerate() {
        let mut atlas = make();
        atlas.json["source"]["component"] = json!(number);
        atlas.json["source"]["components"] = json!(2);
        atlas.write(&folder.path().join(format!("component-{number:03}")));
    }
    let verdicts = run(folder.path());
    assert!(verdicts.all_passed(), "{verdicts}");
    let parts = ["component-000: format", "component-001: format"];
    for part in parts {
        assert!(verdicts.checks.iter().any(|check| check.name == part));
    }
    let from = folder.path().join("component-001");
    std::fs::rename(&from, folder.path().join("component-007")).expect("moved");
    assert_eq!(
        failed(&run(folder.path())),
        ["component-007: component is the one its folder names"]
    );
}

#[test]
fn assets_of_a_manifest_are_verified_each() {
    let folder = tempfile::tempdir().expect("a folder");
    torus().write(&folder.path().join("a"));
    let line = |id: &str, state: &str, files: &[&str]| {
        json!({"id": id, "state": state, "files": files}).to_string() + "\n"
    };
    let write = |text: &str| {
        std::fs::write(folder.path().join("manifest.jsonl"), text).expect("written");
    };
    let good = line("a", "built", &["a/atlas.json", "a/images/0000.exr"]);
    write(&(good.clone() + &line("b", "failed", &[])));
    let verdicts = run(folder.path());
    assert!(verdicts.all_passed(), "{verdicts}");

    write(&(good.clone() + &line("b", "built", &[])));
    assert_eq!(
        failed(&run(folder.path())),
        ["b: the asset's folder is there"]
    );
    write(&line("a", "cached", &["a/atlas.json", "a/report.html"]));
    assert_eq!(
        failed(&run(folder.path())),
        ["a: files listed in the manifest exist"]
    );
    write(&(good.clone() + "{"));
    assert_eq!(
        failed(&run(folder.path())),
        ["manifest.jsonl holds one JSON object a line"]
    );
    write(&(good + &line("../a", "built", &[])));
    assert_eq!(
        failed(&run(folder.path())),
        ["manifest.jsonl names its assets"]
    );
    write("");
    assert_eq!(
        failed(&run(folder.path())),
        ["manifest.jsonl lists built assets"]
    );
}

#[test]
fn a_folder_without_an_atlas_is_an_error() {
    let folder = tempfile::tempdir().expect("a folder");
    let error = verify(folder.path(), &VerifyOptions::default());
    assert!(matches!(error, Err(VerifyError::NothingToVerify { .. })));
    let error = verify(&folder.path().join("none"), &VerifyOptions::default());
    assert!(matches!(error, Err(VerifyError::Folder { .. })));
}

#[test]
fn a_source_mesh_is_compared() {
    let folder = tempfile::tempdir().expect("a folder");
    let atlas = torus();
    atlas.write(folder.path());
    let compare = |positions: &[[f64; 3]], faces: &[[u32; 3]]| {
        let source = SourceSurface { positions, faces };
        let verdicts = verify_against(folder.path(), &VerifyOptions::default(), Some(&source));
        let verdicts = verdicts.expect("an atlas");
        failed(&verdicts).join(", ")
    };
    let (positions, faces) = (atlas.arrays.positions, atlas.arrays.faces);
    assert_eq!(compare(&positions, &faces), "");
    let mut moved = positions.clone();
    moved[40][2] += 0.3;
    assert_eq!(
        compare(&moved, &faces),
        "surface area equals the source's, source_vertex points to the input's vertices, faces lie in their source_face"
    );
    let mut longer = positions.clone();
    longer[4][0] -= 0.5;
    assert!(compare(&longer, &faces).contains("surface area equals the source's"));
    let larger: Vec<[f64; 3]> = positions.iter().map(|p| p.map(|x| 1.1 * x)).collect();
    assert!(compare(&larger, &faces).contains("bounding box equals the source's"));
    assert!(
        compare(&positions, &faces[..50]).contains("faces lie in their source_face"),
        "source_face runs beyond the file"
    );
    let mut broken = faces.clone();
    broken[0][0] = 10_000;
    assert_eq!(compare(&positions, &broken), "source mesh is sound");
    assert_eq!(compare(&[], &[]), "source mesh is sound");
}

#[test]
fn a_hand_made_atlas_may_lack_what_only_programs_write() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut atlas = torus();
    atlas.json.as_object_mut().map(|o| o.remove("generator"));
    for picture in &mut atlas.pictures {
        picture.text.clear();
        picture.floats.remove("normal.X");
    }
    for t in atlas.json["transitions"].as_array_mut().expect("a list") {
        t.as_object_mut().map(|t| t.remove("quarter_turns"));
    }
    atlas.write(folder.path());
    std::fs::remove_file(folder.path().join("surface.glb")).expect("removed");
    let verdicts = run(folder.path());
    assert!(verdicts.all_passed(), "{verdicts}");
}
