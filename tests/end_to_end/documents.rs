//! `docs/output.md` describes every key and every array that a build writes, and no others; links in the documents lead somewhere.

use super::command::{build, document, program};
use crate::real_models::arrays::Npy;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The text below a heading of `docs/output.md`.
fn section(title: &str) -> String {
    let text = std::fs::read_to_string(root().join("docs/output.md")).expect("docs/output.md");
    let start = format!("\n## {title}\n");
    let (_, after) = text
        .split_once(&start)
        .unwrap_or_else(|| panic!("no {title}"));
    let end = after.find("\n## ").unwrap_or(after.len());
    after[..end].to_owned()
}

/// The words in backquotes in the first column of the tables of a section.
fn described(section: &str) -> BTreeSet<String> {
    let rows = section.lines().filter_map(|line| line.strip_prefix("| "));
    let first = rows.filter_map(|row| row.split(" | ").next());
    let quoted = first.flat_map(|cell| cell.split('`').skip(1).step_by(2));
    quoted.map(str::to_owned).collect()
}

/// The paths of all keys of a value: `a`, `a.b`, `list[].c`.
fn keys_of(value: &Value, path: &str, keys: &mut BTreeSet<String>) {
    match value {
        Value::Object(members) => {
            for (name, member) in members {
                let path = joined(path, name);
                keys_of(member, &path, keys);
                keys.insert(path);
            }
        }
        Value::Array(entries) => {
            for entry in entries {
                keys_of(entry, &format!("{path}[]"), keys);
            }
        }
        _ => {}
    }
}

/// The paths of all keys that a schema knows.
fn keys_of_schema(schema: &Value, root: &Value, path: &str, keys: &mut BTreeSet<String>) {
    if let Some(reference) = schema["$ref"].as_str() {
        let target = root.pointer(reference.trim_start_matches('#'));
        keys_of_schema(target.expect(reference), root, path, keys);
    }
    for (name, member) in schema["properties"].as_object().into_iter().flatten() {
        let path = joined(path, name);
        keys_of_schema(member, root, &path, keys);
        keys.insert(path);
    }
    for group in ["allOf", "anyOf", "oneOf"] {
        for choice in schema[group].as_array().into_iter().flatten() {
            keys_of_schema(choice, root, path, keys);
        }
    }
    keys_of_schema_entries(schema, root, path, keys);
}

fn keys_of_schema_entries(schema: &Value, root: &Value, path: &str, keys: &mut BTreeSet<String>) {
    if schema["items"].is_object() {
        keys_of_schema(&schema["items"], root, &format!("{path}[]"), keys);
    }
}

fn joined(path: &str, name: &str) -> String {
    match path {
        "" => name.to_owned(),
        _ => format!("{path}.{name}"),
    }
}

fn schema_keys(of: &str) -> BTreeSet<String> {
    let output = program().args(["schema", of]).output().expect("it runs");
    let schema: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let mut keys = BTreeSet::new();
    keys_of_schema(&schema, &schema, "", &mut keys);
    assert!(keys.len() > 10, "{keys:?}");
    keys
}

/// Both ways: what is there and not described, and what is described and never there.
fn assert_same(there: &BTreeSet<String>, described: &BTreeSet<String>, what: &str) {
    let missing: Vec<_> = there.difference(described).collect();
    let stale: Vec<_> = described.difference(there).collect();
    assert!(missing.is_empty(), "{what} lacks {missing:#?}");
    assert!(
        stale.is_empty(),
        "{what} describes {stale:#?}, which is not there"
    );
}

fn cube(settings: &[&str]) -> super::command::Built {
    build(&root().join("fixtures/good/genus-0-cube.obj"), settings)
}

#[test]
fn every_key_of_atlas_json_is_described() {
    let mut keys = schema_keys("atlas");
    // Counts of repair are named by what is counted, which the schema does not know.
    keys_of(&document(&cube(&[]).atlas()), "", &mut keys);
    let described = described(&section("atlas.json"));
    assert_same(&keys, &described, "the section atlas.json");
}

#[test]
fn every_key_of_the_manifest_is_described() {
    let keys = schema_keys("manifest");
    let described = described(&section("manifest.jsonl"));
    assert_same(&keys, &described, "the section manifest.jsonl");
}

/// Name, shape and type, with the counts of the fixture in place of V, F, C, N, S, M, K and P.
#[test]
fn every_array_of_atlas_npz_is_described() {
    let built = cube(&["images.domain=\"grid\""]);
    let found = shapes(&built.atlas());
    let size = |name: &str| found[name].1[0];
    let counts = BTreeMap::from([
        ("V", size("positions")),
        ("F", size("faces")),
        ("C", size("chart_offset") - 1),
        ("C+1", size("chart_offset")),
        ("N", size("chart_face")),
        ("S", size("seam_patch")),
        ("S+1", size("seam_offset")),
        ("M", size("seam_position")),
        ("K", size("quads")),
        ("P", size("quad_positions")),
    ]);
    let charts = document(&built.atlas())["charts"].as_array().map(Vec::len);
    assert_eq!(charts, Some(counts["C"]));
    let text = section("atlas.npz");
    let names: BTreeSet<String> = found.keys().cloned().collect();
    assert_same(&names, &described(&text), "the section atlas.npz");
    for (name, (dtype, shape)) in &found {
        let row = text
            .lines()
            .find(|line| line.starts_with(&format!("| `{name}` |")));
        let cells: Vec<&str> = row.expect("described").split(" | ").collect();
        let numbers = cells[1].trim_matches(['(', ')']).split(',').map(str::trim);
        let numbers = numbers.filter(|n| !n.is_empty());
        let stated: Vec<usize> = numbers
            .map(|n| counts.get(n).copied().or(n.parse().ok()).expect(n))
            .collect();
        assert_eq!(&stated, shape, "{name}");
        assert_eq!(cells[2], *dtype, "{name}");
    }
}

/// Channels and label of images, the packed one too, of a mesh that has attributes.
#[test]
fn every_channel_and_key_of_an_image_is_described() {
    use exr::prelude::{ReadChannels, ReadLayers};
    let channels = r#"images.channels=["normal","face","log-scale","source-normal","color","texcoord","material"]"#;
    let small = "patches.texel_budget=16384";
    let mesh = root().join("fixtures/good/genus-2-amphora.glb");
    let atlas = build(&mesh, &[channels, small, "patches.packed_side=256"]);
    let text = section("Geometry images");
    let described = described(&text);
    for image in ["0000.exr", "packed.exr"] {
        let path = atlas.atlas().join("images").join(image);
        let read = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level();
        let read = read.all_channels().first_valid_layer().all_attributes();
        let layer = read.from_file(path).expect("an image").layer_data;
        let names = layer.channel_data.list.iter().map(|c| c.name.to_string());
        let mut keys: BTreeSet<String> = names.collect();
        assert!(keys.contains("material.id"), "{keys:?}");
        let [(name, label)] = &layer.attributes.other.iter().collect::<Vec<_>>()[..] else {
            panic!("one attribute");
        };
        assert!(text.contains(&format!("`{name}`")));
        let exr::meta::attribute::AttributeValue::Text(label) = label else {
            panic!("a text");
        };
        let label: Value = serde_json::from_str(&label.to_string()).expect("JSON");
        keys_of(&label, "", &mut keys);
        let missing: Vec<_> = keys.difference(&described).collect();
        assert!(missing.is_empty(), "{image}: {missing:?} not described");
    }
}

#[test]
fn every_attribute_and_key_of_the_glb_is_described() {
    let bytes = std::fs::read(cube(&[]).atlas().join("surface.glb")).expect("surface.glb");
    let length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
    let json: Value = serde_json::from_slice(&bytes[20..20 + length]).expect("JSON");
    let mesh = &json["meshes"][0];
    let mut keys = BTreeSet::new();
    keys_of(&mesh["extras"]["affineAtlas"], "", &mut keys);
    keys_of(&mesh["primitives"][0]["attributes"], "", &mut keys);
    assert!(keys.contains("patches[].rectangle") && keys.contains("POSITION"));
    let missing: Vec<_> = keys
        .difference(&described(&section("surface.glb")))
        .cloned()
        .collect();
    assert!(missing.is_empty(), "{missing:?} not described");
}

/// README, what lies in `docs`, and the other documents at the top.
fn documents() -> Vec<PathBuf> {
    let folders = [
        root().to_owned(),
        root().join("docs"),
        root().join("benches"),
    ];
    let entries = folders
        .iter()
        .flat_map(|f| std::fs::read_dir(f).expect("a folder"));
    let paths = entries.map(|entry| entry.expect("readable").path());
    paths
        .filter(|path| path.extension().is_some_and(|e| e == "md"))
        .collect()
}

#[test]
fn links_in_documents_lead_somewhere() {
    let mut links = 0;
    for path in documents() {
        let text = std::fs::read_to_string(&path).expect("readable");
        for link in text
            .split("](")
            .skip(1)
            .filter_map(|rest| rest.split(')').next())
        {
            let target = link.split('#').next().expect("a first part");
            if target.is_empty() || target.contains("://") {
                continue;
            }
            links += 1;
            let folder = path.parent().expect("a folder");
            assert!(folder.join(target).exists(), "{}: {link}", path.display());
        }
    }
    assert!(links > 20, "{links} links were found");
}

/// A page and a half, and the words by which people look for it.
#[test]
fn the_readme_is_short_and_says_what_it_is_for() {
    let text = std::fs::read_to_string(root().join("README.md")).expect("README.md");
    let words = text.split_whitespace().count();
    assert!(words <= 900, "{words} words");
    let lower = text.to_lowercase();
    for word in [
        "uv",
        "unwrap",
        "texture coordinates",
        "blender",
        "conformal",
        "cone metric",
    ] {
        assert!(lower.contains(word), "no word of {word}");
    }
    for command in [
        "cargo run --release -- build",
        "cargo test --release",
        "cargo install --path .",
    ] {
        assert!(text.contains(command), "no `{command}`");
    }
    // Every command is there to be found.
    let help = program().arg("--help").output().expect("it runs");
    let help = String::from_utf8(help.stdout).expect("UTF-8");
    let commands = help.split("Commands:").nth(1).expect("commands");
    let commands = commands
        .lines()
        .skip(1)
        .take_while(|line| line.starts_with("  "));
    // Lines that go on are further in.
    let named: Vec<&str> = commands
        .filter(|line| !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    assert!(named.len() > 10, "{named:?}");
    for command in named.iter().filter(|name| **name != "help") {
        let there = text.contains(&format!("affine-atlas {command}"));
        assert!(there, "no word of `affine-atlas {command}`");
    }
}

/// NumPy's name of the type and the shape of every array.
fn shapes(atlas: &Path) -> BTreeMap<String, (&'static str, Vec<usize>)> {
    let file = File::open(atlas.join("atlas.npz")).expect("atlas.npz");
    let mut archive = zip::ZipArchive::new(file).expect("a zip file");
    let mut found = BTreeMap::new();
    for i in 0..archive.len() {
        let mut entry = archive.by_index(i).expect("an entry");
        let file_name = entry.name().expect("a name").into_owned();
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).expect("readable");
        let array = Npy::new(&bytes);
        let dtype = match array.descr.as_str() {
            "<f8" => "float64",
            "<u4" => "uint32",
            "|u1" => "uint8",
            "<i8" => "int64",
            other => panic!("{file_name}: {other}"),
        };
        let name = file_name.trim_end_matches(".npy").to_owned();
        found.insert(name, (dtype, array.shape.clone()));
    }
    found
}
