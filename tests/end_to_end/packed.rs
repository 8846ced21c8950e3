//! One image of all patches, from the files alone.

use crate::command::{Built, build, document, program, verify};
use exr::prelude::{FlatSamples, read_all_flat_layers_from_file};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// Channels by name, and columns and rows.
fn image(path: &Path) -> (BTreeMap<String, FlatSamples>, [usize; 2]) {
    let image = read_all_flat_layers_from_file(path).expect("readable");
    let layer = image.layer_data.into_iter().next().expect("a layer");
    let list = layer.channel_data.list.into_iter();
    let channels = list.map(|c| (c.name.to_string(), c.sample_data));
    (channels.collect(), [layer.size.0, layer.size.1])
}

fn number(samples: &FlatSamples, at: usize) -> f64 {
    match samples {
        FlatSamples::F16(values) => f64::from(values[at].to_f32()),
        FlatSamples::F32(values) => f64::from(values[at]),
        FlatSamples::U32(values) => f64::from(values[at]),
    }
}

fn size(value: &Value) -> usize {
    value.as_u64().expect("a count") as usize
}

/// The packed image holds every image texel for texel, marks nothing else, has no hole, and is what the packed coordinates address.
/// Gives its side and how many texels are marked.
fn assert_packed(atlas: &Path, names: &[&str]) -> (usize, usize) {
    let described = document(atlas);
    let packed = &described["images"]["packed"];
    let side = size(&packed["side"]);
    let (all, [columns, rows]) = image(&atlas.join("images/packed.exr"));
    assert_eq!([columns, rows], [side, side]);
    assert_eq!(all.keys().collect::<Vec<_>>(), names);
    for (name, samples) in &all {
        assert!(
            (0..side * side).all(|at| number(samples, at).is_finite()),
            "{name}"
        );
    }
    let patches = described["patches"].as_array().expect("a list");
    let corners = packed["corners"].as_array().expect("a list");
    assert_eq!(patches.len(), corners.len());
    let mut owner = vec![usize::MAX; side * side];
    for (i, (patch, corner)) in patches.iter().zip(corners).enumerate() {
        let path = patch["image"].as_str().expect("a path");
        let (own, [width, height]) = image(&atlas.join(path));
        let [left, top] = [0, 1].map(|k| size(&corner[k]));
        for at in 0..width * height {
            let (x, y) = (left + at % width, top + at / width);
            assert!(x < side && y < side, "patch {i} reaches beyond the square");
            let there = side * y + x;
            assert_eq!(owner[there], usize::MAX, "patch {i} lies on another");
            owner[there] = i;
            for (name, samples) in &own {
                assert_eq!(
                    number(samples, at),
                    number(&all[name], there),
                    "{name} of patch {i}"
                );
            }
        }
        // A texel's place in the packed unit square, v up, is where it is found.
        let number = |value: &Value| value.as_f64().expect("a number");
        let matrix = [0, 1].map(|r| [0, 1, 2].map(|c| number(&patch["texel_to_patch"][r][c])));
        let packing = &patch["patch_to_packed"];
        let (column, row) = (width as f64 / 3.0, height as f64 / 4.0);
        let place = [0, 1].map(|k| {
            let p = matrix[k][0] * column + matrix[k][1] * row + matrix[k][2];
            number(&packing["scale"]) * p + number(&packing["translation"][k])
        });
        let found = [place[0] * side as f64, (1.0 - place[1]) * side as f64];
        let expected = [left as f64 + column, top as f64 + row];
        let near = (0..2).all(|k| (found[k] - expected[k]).abs() < 1e-6);
        assert!(near, "patch {i}: {found:?} {expected:?}");
    }
    let marked: Vec<usize> = (0..side * side)
        .filter(|&at| number(&all["A"], at) != 0.0)
        .collect();
    assert!(marked.iter().all(|&at| owner[at] != usize::MAX));
    (side, marked.len())
}

const OMAGE: [&str; 7] = ["A", "B", "G", "R", "normal.X", "normal.Y", "normal.Z"];

#[test]
fn object_images_have_1024_by_1024_texels() {
    for mesh in [
        "genus-2-amphora.glb",
        "genus-0-cube.obj",
        "genus-3-pretzel.obj",
    ] {
        let built = loud(&format!("fixtures/good/{mesh}"), &["preset=omage-1024"]);
        let atlas = built.atlas();
        verify(&atlas);
        let (side, marked) = assert_packed(&atlas, &OMAGE);
        assert_eq!(side, 1024, "{mesh}");
        let share = marked as f64 / (side * side) as f64;
        // Measured: 0.21 to 0.37. One large patch decides how well a square can be filled.
        assert!(share > 0.15, "{mesh}: {share}");
        assert!(!built.message().contains("WARN"), "{}", built.message());
    }
}

#[test]
fn any_side_and_any_channels_are_packed() {
    let settings = [
        "patches.packed_side=200",
        "patches.padding=0",
        "images.channels=[\"face\", \"normal\"]",
        "images.normal_precision=half",
    ];
    let built = build(Path::new("fixtures/good/genus-1-mug.off"), &settings);
    let atlas = built.atlas();
    verify(&atlas);
    let names = [&OMAGE[..], &["surface.face"]].concat();
    assert_eq!(assert_packed(&atlas, &names).0, 200);
}

/// Runs a build that says what it warns of.
fn loud(mesh: &str, settings: &[&str]) -> Built {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut command = program();
    command.args(["build", mesh, "--set", "pictures.enabled=false", "--out"]);
    command.arg(folder.path());
    for setting in settings {
        command.args(["--set", setting]);
    }
    let output = command.output().expect("the program starts");
    Built { folder, output }
}

fn patches(atlas: &Path) -> usize {
    document(atlas)["patches"].as_array().expect("a list").len()
}

#[test]
fn more_patches_than_wanted_is_a_warning_with_both_numbers() {
    const PRETZEL: &str = "fixtures/good/genus-3-pretzel.obj";
    let many = build(Path::new(PRETZEL), &["patches.log_scale_range=0.1"]);
    let many = patches(&many.atlas());
    let built = loud(
        PRETZEL,
        &["patches.log_scale_range=0.1", "patches.max_count=2"],
    );
    let (said, atlas) = (built.message(), built.atlas());
    verify(&atlas);
    let count = patches(&atlas);
    assert!(2 < count && count < many, "{count} of {many}");
    let sentence = format!("{PRETZEL} has {count} patches, more than the 2 of patches.max_count");
    assert_eq!(said.matches(&sentence).count(), 1, "{said}");
    // As many as there may be: nothing to say.
    let most = format!("patches.max_count={count}");
    let built = loud(PRETZEL, &["patches.log_scale_range=0.1", &most]);
    assert!(
        !built.message().contains("max_count"),
        "{}",
        built.message()
    );
    assert!(patches(&built.atlas()) <= count);
}

#[test]
fn a_side_too_small_is_exceeded_with_a_warning() {
    const PRETZEL: &str = "fixtures/good/genus-3-pretzel.obj";
    let built = loud(PRETZEL, &["patches.packed_side=64", "patches.min_side=64"]);
    let (said, atlas) = (built.message(), built.atlas());
    verify(&atlas);
    let names = [&OMAGE[..], &["surface.face", "surface.logScale"]].concat();
    let (side, _) = assert_packed(&atlas, &names);
    assert!(side > 64);
    let sentence = format!(
        "{PRETZEL} needs a packed image of {side} by {side} texels, more than the 64 of patches.packed_side"
    );
    assert_eq!(said.matches(&sentence).count(), 1, "{said}");
}

#[test]
fn verify_finds_a_packed_image_that_is_another() {
    let built = build(
        Path::new("fixtures/good/genus-0-cube.obj"),
        &["patches.packed_side=128"],
    );
    let atlas = built.atlas();
    let honest = document(&atlas);
    let corner = [0, 1].map(|k| size(&honest["images"]["packed"]["corners"][0][k]));
    let moved = |by: usize| json!([corner[0] + by, corner[1]]);
    type Change<'a> = (&'a str, Box<dyn Fn(&mut Value) + 'a>);
    let changes: [Change; 4] = [
        (
            "FAIL  images lie apart from each other in the packed image",
            Box::new(|a| a["images"]["packed"]["corners"][0] = moved(1000)),
        ),
        (
            "FAIL  images lie apart from each other in the packed image",
            Box::new(|a| a["images"]["packed"]["corners"] = json!([])),
        ),
        (
            "FAIL  the packed image keeps the contract's layout",
            Box::new(|a| a["images"]["packed"]["side"] = json!(129)),
        ),
        (
            "FAIL  atlas.json's ids point to its lists",
            Box::new(|a| a["images"]["packed"]["image"] = json!("../packed.exr")),
        ),
    ];
    let check = |what: &str| {
        let output = program().arg("verify").arg(&atlas).output();
        let said = output.expect("the program starts").stdout;
        let said = String::from_utf8_lossy(&said).into_owned();
        let failed: Vec<&str> = said.lines().filter(|l| l.starts_with("FAIL")).collect();
        assert!(
            failed.len() == 1 && failed[0].starts_with(what),
            "{what}: {failed:?}"
        );
    };
    for (what, change) in changes {
        let mut stated = honest.clone();
        change(&mut stated);
        std::fs::write(atlas.join("atlas.json"), stated.to_string()).expect("written");
        check(what);
    }
    std::fs::write(atlas.join("atlas.json"), honest.to_string()).expect("written");
    // One texel of a patch's own image.
    let path = atlas.join("images/0000.exr");
    let mut image = read_all_flat_layers_from_file(&path).expect("readable");
    for channel in &mut image.layer_data[0].channel_data.list {
        if let (true, FlatSamples::F32(values)) = (
            channel.name == *"surface.logScale",
            &mut channel.sample_data,
        ) {
            values[0] += 1.0;
        }
    }
    use exr::prelude::WritableImage;
    image.write().to_file(&path).expect("written");
    check("FAIL  the packed image holds the images of the patches");
}
