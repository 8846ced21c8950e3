//! Damaged files, byte by byte: always a failed check, never a panic, never more memory than the file can fill.

use crate::verifying::fixture::{Npy, torus, tube, write_npz};
use affine_atlas::verify::{Verdicts, VerifyOptions, verify};
use serde_json::{Value, json};
use std::io::Write;
use std::path::Path;

fn run(folder: &Path) -> Verdicts {
    verify(folder, &VerifyOptions::default()).expect("an atlas.json")
}

fn failed(verdicts: &Verdicts) -> Vec<&str> {
    let failed = verdicts.checks.iter().filter(|check| !check.passed);
    failed.map(|check| check.name.as_str()).collect()
}

/// A generator of small integers, the same in every run.
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % end as u64) as usize
    }
}

/// Verifies copies of a file that are cut short or have a few bytes changed.
fn damage(name: &str, rounds: usize) {
    let folder = tempfile::tempdir().expect("a folder");
    tube().write(folder.path());
    let path = folder.path().join(name);
    let whole = std::fs::read(&path).expect("the file");
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let mut noticed = 0;
    for round in 0..rounds {
        let mut bytes = whole.clone();
        if round % 4 == 0 {
            bytes.truncate(random.below(whole.len()));
        } else {
            for _ in 0..1 + random.below(8) {
                let at = if round % 2 == 0 {
                    random.below(whole.len())
                } else {
                    // Headers matter most.
                    random.below(whole.len().min(600))
                };
                bytes[at] = random.below(256) as u8;
            }
        }
        std::fs::write(&path, &bytes).expect("written");
        noticed += usize::from(!run(folder.path()).all_passed());
    }
    assert!(
        noticed * 10 > rounds * 3,
        "{name}: {noticed} of {rounds} noticed"
    );
}

#[test]
fn damaged_arrays_do_not_panic() {
    damage("atlas.npz", 400);
}

#[test]
fn damaged_documents_do_not_panic() {
    damage("atlas.json", 400);
}

#[test]
fn damaged_images_do_not_panic() {
    damage("images/0000.exr", 400);
}

#[test]
fn damaged_surfaces_do_not_panic() {
    damage("surface.glb", 400);
}

/// Numbers that have hurt someone before.
fn extreme(random: &mut Random, size: usize) -> Vec<u8> {
    let doubles = [
        0.0,
        -1.0,
        1e308,
        -1e308,
        5e-324,
        1e17,
        f64::NAN,
        f64::INFINITY,
    ];
    match size {
        8 => doubles[random.below(8)].to_le_bytes().to_vec(),
        4 => [0, 1, 2, 17, u32::MAX - 1, u32::MAX][random.below(6)]
            .to_le_bytes()
            .to_vec(),
        _ => vec![[0, 1, 2, 255][random.below(4)]],
    }
}

#[test]
fn extreme_values_in_arrays_do_not_panic() {
    let folder = tempfile::tempdir().expect("a folder");
    let atlas = torus();
    atlas.write(folder.path());
    let mut random = Random(77);
    let (mut noticed, rounds) = (0, 400);
    for _ in 0..rounds {
        let mut arrays = atlas.arrays.npy();
        for _ in 0..1 + random.below(3) {
            let count = arrays.len();
            let array = &mut arrays[random.below(count)];
            let size = match array.descr {
                "<f8" => 8,
                "<u4" => 4,
                _ => 1,
            };
            let at = size * random.below(array.bytes.len() / size);
            array.bytes[at..at + size].copy_from_slice(&extreme(&mut random, size));
        }
        write_npz(&folder.path().join("atlas.npz"), &arrays);
        noticed += usize::from(!run(folder.path()).all_passed());
    }
    assert!(noticed * 10 > rounds * 7, "{noticed} of {rounds} noticed");
}

/// Every number, text and flag of a document.
fn leaves(value: &mut Value) -> Vec<&mut Value> {
    match value {
        Value::Array(list) => list.iter_mut().flat_map(leaves).collect(),
        Value::Object(map) => map.values_mut().flat_map(leaves).collect(),
        leaf => vec![leaf],
    }
}

#[test]
fn extreme_values_in_documents_do_not_panic() {
    let folder = tempfile::tempdir().expect("a folder");
    let atlas = torus();
    atlas.write(folder.path());
    let mut random = Random(78);
    let (mut noticed, rounds) = (0, 600);
    for _ in 0..rounds {
        let mut json = atlas.json.clone();
        let mut all = leaves(&mut json);
        let count = all.len();
        let values = [
            json!(0),
            json!(-1),
            json!(1),
            json!(u64::MAX),
            json!(1e308),
            json!(-1e308),
            json!(0.5),
            json!(null),
            json!([]),
            json!("x"),
            json!(123_456),
        ];
        *all[random.below(count)] = values[random.below(values.len())].clone();
        std::fs::write(folder.path().join("atlas.json"), json.to_string()).expect("written");
        noticed += usize::from(!run(folder.path()).all_passed());
    }
    assert!(noticed * 10 > rounds * 7, "{noticed} of {rounds} noticed");
}

#[test]
fn missing_files_are_failed_checks() {
    for (name, check) in [
        ("atlas.npz", "atlas.npz can be read"),
        ("images/0000.exr", "images can be read"),
        ("surface.glb", "surface.glb can be read"),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        torus().write(folder.path());
        std::fs::remove_file(folder.path().join(name)).expect("removed");
        assert_eq!(failed(&run(folder.path())), [check]);
    }
}

#[test]
fn a_document_that_is_no_json_is_a_failed_check() {
    for text in ["", "[", "null", "[1, 2]", "{\"format\": NaN}", "3"] {
        let folder = tempfile::tempdir().expect("a folder");
        torus().write(folder.path());
        std::fs::write(folder.path().join("atlas.json"), text).expect("written");
        let verdicts = run(folder.path());
        assert!(!verdicts.all_passed(), "{text}");
    }
}

#[test]
fn arrays_of_other_types_and_shapes_are_failed_checks() {
    type Damage = fn(&mut Npy);
    let damages: [(&str, Damage); 8] = [
        ("positions", |a| a.descr = "<f4"),
        ("faces", |a| a.descr = "<i8"),
        ("faces", |a| a.shape = vec![a.shape[0] * 3]),
        ("positions", |a| a.shape[0] = usize::MAX / 2),
        ("positions", |a| a.shape[0] = 1 << 40),
        ("central_uv", |a| a.shape[0] -= 1),
        ("patch", |a| a.bytes.truncate(7)),
        ("chart_uv", |a| a.shape = vec![0, 3, 2]),
    ];
    for (name, damage) in damages {
        let folder = tempfile::tempdir().expect("a folder");
        let atlas = torus();
        atlas.write(folder.path());
        let mut arrays = atlas.arrays.npy();
        let at = arrays.iter().position(|a| a.name == name);
        damage(&mut arrays[at.expect("an array")]);
        write_npz(&folder.path().join("atlas.npz"), &arrays);
        assert_eq!(
            failed(&run(folder.path())),
            ["arrays have their types and shapes"],
            "{name}"
        );
    }
}

#[test]
fn an_array_that_is_not_there_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let atlas = torus();
    atlas.write(folder.path());
    let mut arrays = atlas.arrays.npy();
    arrays.retain(|a| a.name != "seam_uv" && a.name != "cut");
    write_npz(&folder.path().join("atlas.npz"), &arrays);
    let verdicts = run(folder.path());
    assert_eq!(failed(&verdicts), ["atlas.npz has every array"]);
    let last = verdicts.checks.last().expect("checks");
    assert_eq!(last.figure, "cut seam_uv");
}

#[test]
fn an_entry_larger_than_its_header_says_is_not_unpacked() {
    let folder = tempfile::tempdir().expect("a folder");
    let atlas = torus();
    atlas.write(folder.path());
    let file = std::fs::File::create(folder.path().join("atlas.npz")).expect("a file");
    let mut zip = zip::ZipWriter::new(file);
    let options = zip::write::SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Deflated);
    for array in atlas.arrays.npy() {
        zip.start_file(format!("{}.npy", array.name), options)
            .expect("an entry");
        // 64 MB of zeros, a few kB in the container.
        for _ in 0..if array.name == "positions" { 64 } else { 0 } {
            zip.write_all(&[0; 1 << 20]).expect("written");
        }
    }
    zip.finish().expect("a container");
    assert_eq!(
        failed(&run(folder.path())),
        ["arrays have their types and shapes"]
    );
}

#[test]
fn arrays_unpack_to_no_more_than_their_container_warrants() {
    let folder = tempfile::tempdir().expect("a folder");
    let atlas = torus();
    atlas.write(folder.path());
    let file = std::fs::File::create(folder.path().join("atlas.npz")).expect("a file");
    let mut zip = zip::ZipWriter::new(file);
    let options = zip::write::SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Deflated);
    for array in atlas.arrays.npy() {
        zip.start_file(format!("{}.npy", array.name), options)
            .expect("an entry");
        if array.name != "positions" {
            zip.write_all(&array.file()).expect("written");
            continue;
        }
        // 1.2 GB of zeros as their header says, 1 MB in the container.
        let mut header =
            b"\x93NUMPY\x01\0\x76\0{'descr': '<f8', 'fortran_order': False, 'shape': (50331648, 3), }".to_vec();
        header.resize(127, b' ');
        header.push(b'\n');
        zip.write_all(&header).expect("written");
        for _ in 0..1152 {
            zip.write_all(&[0; 1 << 20]).expect("written");
        }
    }
    zip.finish().expect("a container");
    let verdicts = run(folder.path());
    let last = verdicts.checks.last().expect("a check");
    assert_eq!(last.name, "arrays have their types and shapes");
    assert!(
        last.figure
            .starts_with("positions: unpacks to 1207959552 bytes, and"),
        "{}",
        last.figure
    );
}

#[test]
fn images_that_claim_more_than_their_files_warrant_are_failed_checks() {
    let folder = tempfile::tempdir().expect("a folder");
    tube().write(folder.path());
    // The size is stated twice, and the image is cut behind its header, but what it claims is 3.2 GB.
    let path = folder.path().join("atlas.json");
    let text = std::fs::read(&path).expect("written");
    let mut document: Value = serde_json::from_slice(&text).expect("JSON");
    let patch = &mut document["patches"][0];
    let image = folder.path().join(patch["image"].as_str().expect("a name"));
    let old = [&patch["width"], &patch["height"]].map(|n| n.as_u64().expect("a number") as i32 - 1);
    patch["width"] = json!(10_000);
    patch["height"] = json!(10_000);
    std::fs::write(&path, document.to_string()).expect("written");
    let mut bytes = std::fs::read(&image).expect("written");
    for name in ["dataWindow\0box2i\0", "displayWindow\0box2i\0"] {
        let at = bytes.windows(name.len()).position(|w| w == name.as_bytes());
        let at = at.expect("a window") + name.len() + 4 + 8;
        for (k, side) in old.iter().enumerate() {
            let at = at + 4 * k;
            assert_eq!(bytes[at..at + 4], side.to_le_bytes());
            bytes[at..at + 4].copy_from_slice(&9_999i32.to_le_bytes());
        }
    }
    std::fs::write(&image, bytes).expect("written");
    let verdicts = run(folder.path());
    let check = verdicts.checks.iter().find(|c| c.figure.contains("claims"));
    let check = check.expect("a check of the image");
    assert!(!check.passed);
}

#[test]
fn an_image_of_two_patches_is_a_failed_check() {
    let folder = tempfile::tempdir().expect("a folder");
    tube().write(folder.path());
    let path = folder.path().join("atlas.json");
    let text = std::fs::read(&path).expect("written");
    let mut document: Value = serde_json::from_slice(&text).expect("JSON");
    let patches = document["patches"].as_array_mut().expect("a list");
    let mut again = patches[0].clone();
    again["id"] = json!(patches.len());
    patches.push(again);
    std::fs::write(&path, document.to_string()).expect("written");
    assert_eq!(
        failed(&run(folder.path())),
        ["atlas.json's ids point to its lists"]
    );
}

/// A pipe would be waited for, and a device gives bytes without end.
#[cfg(target_os = "linux")]
#[test]
fn pipes_and_links_to_devices_are_failed_checks() {
    use rustix::fs::{CWD, FileType, Mode, mknodat};
    let image = "images/0000.exr";
    for name in [
        "atlas.json",
        "atlas.npz",
        image,
        "surface.glb",
        "manifest.jsonl",
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        tube().write(folder.path());
        let path = folder.path().join(name);
        let _ = std::fs::remove_file(&path);
        mknodat(CWD, &path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).expect("a pipe");
        let piped = verify(folder.path(), &VerifyOptions::default());
        std::fs::remove_file(&path).expect("removed");
        std::os::unix::fs::symlink("/dev/zero", &path).expect("a link");
        let linked = verify(folder.path(), &VerifyOptions::default());
        for verdicts in [piped, linked] {
            let verdicts = verdicts.expect("a folder");
            let said = verdicts.to_string();
            let refused = said.contains("it is no regular file");
            // Without a manifest that can be read the folder counts as that of an asset.
            assert_eq!(refused, name != "manifest.jsonl", "{name}: {said}");
            assert_eq!(verdicts.all_passed(), !refused, "{name}: {said}");
        }
    }
}

#[test]
fn a_surface_without_faces_is_a_failed_check() {
    let folder = tempfile::tempdir().expect("a folder");
    let atlas = torus();
    atlas.write(folder.path());
    let arrays = crate::verifying::fixture::Arrays::default();
    write_npz(&folder.path().join("atlas.npz"), &arrays.npy());
    assert_eq!(
        failed(&run(folder.path())),
        ["arrays have their types and shapes"]
    );
}
