//! What the program writes is valid by the schemas that it prints; what is broken is not.

use jsonschema::Validator;
use serde_json::{Value, json};
use std::path::Path;
use std::process::Command;

fn program() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_affine-atlas"));
    command.current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

/// The schema as the program prints it.
fn validator(of: &str) -> Validator {
    let output = program().args(["schema", of]).output().expect("it runs");
    assert!(output.status.success());
    let schema: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(
        schema["$schema"],
        "https://json-schema.org/draft/2020-12/schema"
    );
    jsonschema::meta::validate(&schema).expect("a schema of its draft");
    jsonschema::validator_for(&schema).expect("a schema")
}

fn assert_valid(validator: &Validator, value: &Value, name: &str) {
    let wrong: Vec<String> = validator
        .iter_errors(value)
        .map(|e| format!("{}: {e}", e.instance_path))
        .collect();
    assert!(wrong.is_empty(), "{name}: {wrong:#?}");
}

/// Each change at a pointer must be refused; `None` takes the key away.
fn assert_refused(validator: &Validator, good: &Value, changes: &[(&str, Option<Value>)]) {
    for (pointer, change) in changes {
        let mut broken = good.clone();
        let (parent, key) = pointer.rsplit_once('/').expect("a pointer");
        let table = broken.pointer_mut(parent).expect(parent);
        match (table, change) {
            (Value::Object(entries), Some(value)) => {
                entries.insert(key.to_owned(), value.clone());
            }
            (Value::Object(entries), None) => {
                assert!(entries.remove(key).is_some(), "there is no {pointer}");
            }
            (Value::Array(rows), Some(value)) => {
                rows[key.parse::<usize>().expect("a number")] = value.clone();
            }
            (other, _) => panic!("{pointer} is in {other}"),
        }
        assert!(
            !validator.is_valid(&broken),
            "{pointer} became {change:?}, and is valid"
        );
    }
}

/// Every fixture in one output root, good ones and bad ones, flat and grid.
fn build_all(root: &Path) {
    const FLAT: &[&str] = &["images.domain=flat", "patches.texel_budget=16384"];
    for (folder, output, settings) in [
        ("good", "1", FLAT),
        ("bad", "1", FLAT),
        ("good", "2", &["grid.cells=300"]),
    ] {
        let names = std::fs::read_dir(Path::new("fixtures").join(folder)).expect("fixtures");
        let mut paths: Vec<_> = names.flatten().map(|e| e.path()).collect();
        paths.sort();
        let mut command = program();
        command.args(["build", "--quiet", "--out"]);
        command.arg(root.join(output));
        command.args(&paths);
        let cheap = ["pictures.enabled=false", "report.enabled=false"];
        for setting in cheap.iter().chain(settings) {
            command.args(["--set", setting]);
        }
        command.output().expect("it runs");
    }
}

fn documents(folder: &Path, found: &mut Vec<(String, Value)>) {
    for entry in std::fs::read_dir(folder).expect("readable").flatten() {
        let path = entry.path();
        if path.is_dir() {
            documents(&path, found);
        } else if path.ends_with("atlas.json") {
            let text = std::fs::read(&path).expect("readable");
            let value = serde_json::from_slice(&text).expect("JSON");
            found.push((path.display().to_string(), value));
        }
    }
}

#[test]
fn what_is_written_is_valid_and_what_is_broken_is_not() {
    let root = tempfile::tempdir().expect("a folder");
    build_all(root.path());
    let atlas = validator("atlas");
    let mut found = Vec::new();
    documents(root.path(), &mut found);
    assert!(found.len() >= 14, "{} atlases", found.len());
    for (name, document) in &found {
        assert_valid(&atlas, document, name);
    }
    let (_, with_cones) = found
        .iter()
        .find(|(_, d)| !d["cones"].as_array().expect("cones").is_empty())
        .expect("one with cones");
    assert_refused(
        &atlas,
        with_cones,
        &[
            ("/format", Some(json!("another"))),
            ("/version", Some(json!(3))),
            ("/version", Some(json!("1"))),
            ("/topology", None),
            ("/topology/genus", None),
            ("/topology/faces", Some(json!(-1))),
            ("/metric/scheme", Some(json!("hyperbolic"))),
            ("/metric/history", Some(json!({}))),
            ("/metric/max_curvature_error", Some(Value::Null)),
            ("/cones/0/curvature", Some(json!("1/2"))),
            ("/cones/0/vertex", None),
            ("/charts/0/kind", Some(json!("spherical"))),
            ("/charts/0/kind", None),
            ("/patches/0/texel_to_patch", Some(json!([[0, 0, 0]]))),
            ("/patches/0/domain", Some(json!("disk"))),
            ("/quality/log_scale/std", None),
            ("/flags/seamless", Some(json!(1))),
            ("/image_origin", Some(json!([0.0, 0.0]))),
        ],
    );

    let manifest = validator("manifest");
    let mut lines = Vec::new();
    for folder in ["1", "2"] {
        let path = root.path().join(folder).join("manifest.jsonl");
        let text = std::fs::read_to_string(path).expect("a manifest");
        lines.extend(
            text.lines()
                .map(|line| serde_json::from_str::<Value>(line).expect("JSON")),
        );
    }
    assert!(lines.len() > 30, "{} lines", lines.len());
    for line in &lines {
        assert_valid(&manifest, line, &line["id"].to_string());
    }
    let failed = lines.iter().find(|l| l["state"] == "failed").expect("one");
    assert_refused(
        &manifest,
        failed,
        &[
            ("/id", None),
            ("/state", Some(json!("done"))),
            ("/kind", Some(json!("bad luck"))),
            ("/seconds", Some(json!("1 s"))),
            ("/files", Some(json!("atlas.json"))),
            ("/peak_memory", Some(json!(-1))),
        ],
    );
}

#[test]
fn plans_are_valid_and_broken_ones_are_not() {
    let validator = validator("plan");
    let root = tempfile::tempdir().expect("a folder");
    let path = root.path().join("plan.jsonl");
    let output = program()
        .args(["plan", "fixtures/good", "fixtures/bad", "--out"])
        .arg(root.path().join("out"))
        .args(["--set", "cones.list=[{ vertex = 0, curvature = \"1/2\" }]"])
        .arg("--plan")
        .arg(&path)
        .output()
        .expect("it runs");
    assert!(output.status.success());
    let text = std::fs::read_to_string(&path).expect("written");
    let lines: Vec<Value> = text
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    assert!(lines.len() > 40, "{} lines", lines.len());
    for (i, line) in lines.iter().enumerate() {
        assert_valid(&validator, line, &format!("line {}", i + 1));
    }
    let first = |record: &str| {
        lines
            .iter()
            .find(|line| line["record"] == record)
            .expect(record)
    };
    assert_refused(
        &validator,
        first("plan"),
        &[
            ("/record", Some(json!("plot"))),
            ("/format", Some(json!("another"))),
            ("/version", Some(json!(2))),
            ("/id", None),
            ("/folder", Some(json!(1))),
            ("/force", Some(json!("no"))),
        ],
    );
    assert_refused(
        &validator,
        first("configuration"),
        &[
            ("/config", None),
            ("/config", Some(json!("defaults"))),
            ("/cone_lines", Some(json!([-1]))),
        ],
    );
    assert_refused(
        &validator,
        first("asset"),
        &[
            ("/id", None),
            ("/path", None),
            ("/files", Some(json!("a.obj"))),
            ("/cost", Some(json!(-1))),
            ("/decision", Some(json!("perhaps"))),
            ("/estimate", Some(json!(0.5))),
            ("/configuration", None),
        ],
    );
    assert_refused(&validator, first("end"), &[("/blake3", None)]);
}

#[test]
fn configurations_are_valid_and_broken_ones_are_not() {
    let config = validator("config");
    let read = |text: &str| -> Value {
        serde_json::to_value(text.parse::<toml::Table>().expect("TOML")).expect("JSON")
    };
    let commented = std::fs::read_to_string("config.toml").expect("config.toml");
    let good = read(&commented);
    assert_valid(&config, &good, "config.toml");
    // What the survey of cones writes, and every key with its examples.
    let root = tempfile::tempdir().expect("a folder");
    program()
        .args([
            "cones",
            "fixtures/good/genus-0-cube.obj",
            "--counts",
            "4",
            "--quiet",
        ])
        .args(["--set", "pictures.enabled=false", "--out"])
        .arg(root.path())
        .output()
        .expect("it runs");
    let mut written = 0;
    for entry in std::fs::read_dir(root.path().join("genus-0-cube.cones")).expect("written") {
        let path = entry.expect("readable").path();
        if path.extension().is_some_and(|e| e == "toml") {
            let text = std::fs::read_to_string(&path).expect("readable");
            assert_valid(&config, &read(&text), &path.display().to_string());
            written += 1;
        }
    }
    assert!(written > 0, "no configuration was written");
    let listed = read(
        "preset = \"texture\"\n[cones]\nlist = [{ vertex = 0, curvature = \"1.5708 rad\" }, { point = [0.0, 1, -2], curvature = -0.5 }]\nquantum = \"1/2\"\n[boundary]\ntotals = [\"-8\", 2]\n[repair]\nweld_tolerance = 0.0\n",
    );
    assert_valid(&config, &listed, "listed cones");
    let some = "[[asset]]\nglob = \"*.ply\"\nflow.scheme = \"thurston\"\nrun.memory = 1000000000\n";
    assert_valid(&config, &read(some), "settings of some meshes");
    assert_refused(
        &config,
        &good,
        &[
            ("/flow/scheme", Some(json!("tangent"))),
            ("/flow/shceme", Some(json!("tangential"))),
            ("/flows", Some(json!({}))),
            ("/pictures/size", Some(json!(63))),
            ("/pictures/size", Some(json!("1024"))),
            ("/report/enabled", Some(json!(1))),
            ("/repair/weld_tolerance", Some(json!(1e-13))),
            ("/input/paths", Some(json!("a.obj"))),
            ("/cones/list", Some(json!([{ "vertex": 0 }]))),
            ("/cones/list", Some(json!([{ "curvature": "half" }]))),
            ("/cones/max_curvature", Some(json!(2))),
            ("/run/threads", Some(json!(0.5))),
            (
                "/asset",
                Some(json!([{ "glob": "*.ply", "flow": { "scheme": "tangent" } }])),
            ),
            (
                "/asset",
                Some(json!([{ "glob": "*.ply", "run": { "jobs": 2 } }])),
            ),
            (
                "/asset",
                Some(json!([{ "glob": "*.ply", "output": { "folder": "x" } }])),
            ),
        ],
    );
}

/// Figures of spline surfaces.
#[test]
fn fits_are_valid() {
    let root = tempfile::tempdir().expect("a folder");
    let into = root.path().join("surface");
    let mut command = program();
    command.args([
        "fit",
        "fixtures/good/disk-mask.obj",
        "--cells",
        "200",
        "--out",
    ]);
    assert!(
        command
            .arg(&into)
            .output()
            .expect("it runs")
            .status
            .success()
    );
    let text = std::fs::read(into.join("fit.json")).expect("readable");
    let document: Value = serde_json::from_slice(&text).expect("JSON");
    let fit = validator("fit");
    assert_valid(&fit, &document, "fit.json");
    assert_refused(
        &fit,
        &document,
        &[
            ("/unit", None),
            ("/components", Some(json!({}))),
            ("/components/0/closed", Some(json!("no"))),
            ("/components/0/from_source/rms_of_diagonal", None),
            (
                "/components/0/step/normal_jump_regular/max_degrees",
                Some(json!("0")),
            ),
        ],
    );
}
