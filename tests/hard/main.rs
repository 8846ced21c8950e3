//! Nothing wrong leaves a build, and nothing small costs much: meshes that were made to be hard, built by the program as users start it.
//!
//! Every mesh with every configuration must end *built*, and passed by `verify` and by the independent checker where there is one, or *refused* with
//! a sentence about the mesh or the configuration; never as `unverified`, `internal`, `timeout` or `memory`. No build may cost more than 60 CPU
//! seconds and 2 GB, of a file below a megabyte 1 GB.
//!
//! `cargo test --release --test hard` builds generated meshes with defaults, and where `AFFINE_ATLAS_CORPUS` names a folder with `hard/` below it,
//! its files too, but the longest (ignored otherwise). `… -- --ignored hard/` builds all of them with all configurations, which is slow;
//! `hard/CONFIGURATION/` with one of them, `hard/CONFIGURATION/FILE` one pair. Each prints a line of a table; a run with fewer threads than cores
//! says more of time. `AFFINE_ATLAS_CHECKER` and `AFFINE_ATLAS_PYTHON` as in `tests/corpus.rs`.

mod cost;
#[path = "../real_models/mod.rs"]
mod real_models;
mod shapes;

use cost::{Cost, measured};
use libtest_mimic::{Arguments, Failed, Trial};
use real_models::{atlases, checked, comparable, succeed};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Names of configurations with their settings. All but the first leave out pictures and pages, which tell nothing of an atlas.
const CONFIGURATIONS: [(&str, &[&str]); 19] = [
    ("defaults", &[]),
    ("plain", PLAIN),
    ("flat", &["images.domain=flat"]),
    ("thurston", &["flow.scheme=thurston"]),
    ("tangential", &["flow.scheme=tangential"]),
    ("inversive-distance", &["flow.scheme=inversive-distance"]),
    ("no-flips", &["flow.delaunay=false"]),
    (
        "gradient",
        &["flow.solver=gradient", "flow.max_gradient_steps=3000"],
    ),
    ("single", &["cones.strategy=single"]),
    ("spread", &["cones.strategy=spread"]),
    ("quantum", &["cones.quantum=\"1/2\""]),
    ("field", FIELD),
    (
        "packed",
        &["patches.packed_side=128", "patches.max_count=4"],
    ),
    (
        "lean",
        &[
            "patches.padding=0",
            "patches.min_side=8",
            "images.normal_precision=half",
        ],
    ),
    ("corners", &["boundary.condition=corners"]),
    ("uniform", &["boundary.condition=uniform"]),
    ("weld", &["repair.weld_tolerance=0.1"]),
    ("narrow", &["patches.log_scale_range=0.01"]),
    ("small-budget", &["patches.texel_budget=4096"]),
];

const PLAIN: &[&str] = &["pictures.enabled=false", "report.enabled=false"];

const FIELD: &[&str] = &[
    "images.domain=flat",
    "cones.strategy=field",
    "flow.holonomy=quarter-turns",
];

/// What may be wrong with a mesh or a configuration; everything else is wrong with the program, or costs too much.
const REFUSALS: [&str; 3] = ["input", "prescription", "not_converged"];

/// Of one build.
const MOST_CPU_SECONDS: f64 = 60.0;
const MOST_BYTES: u64 = 2_000_000_000;

/// Components of a file that the independent checker is asked about, where there are more; about all of them by `hard/`.
const SOME: usize = 12;

/// The independent checker takes a minute or more for larger `atlas.npz`, and is asked about them by `hard/` alone.
const MOST_CHECKED_BYTES: u64 = 30_000_000;

/// Of a build of a file below [`SMALL`] bytes.
const MOST_BYTES_OF_SMALL: u64 = 1_000_000_000;
const SMALL: u64 = 1_000_000;

/// Corners on nine digits, whose triangulation in the plane is far from that of the file.
const POLYGON: usize = 20_000;

/// Files that take more than fifteen CPU seconds with defaults, checks included: built by `hard/defaults/` alone. Generated ones of their kinds, which are
/// smaller, are always built.
const LONG: [&str; 4] = [
    "components200.obj",
    "bipyramid4000.obj",
    "random-positions.obj",
    "noisy3.obj",
];

type Mesh = fn() -> (shapes::Points, shapes::Faces);

/// Files below a megabyte that once cost more than they may, or are of a kind that could.
/// With what the message must say where they cannot be built.
const GENERATED: [(&str, Mesh, &str); 13] = [
    ("fan", || shapes::fan(2000), ""),
    ("polygon", || shapes::polygon(3000), ""),
    (
        "polygon-of-nearly-a-megabyte",
        || shapes::rounded(shapes::polygon(POLYGON)),
        "",
    ),
    ("bipyramid", || shapes::bipyramid(500), ""),
    ("components", || shapes::tetrahedra(64), ""),
    ("soup", || shapes::soup(900, 3000), ""),
    ("noise", || shapes::noisy(5.0), ""),
    ("needles", || shapes::with_needles(1e-12), ""),
    (
        "flattened",
        || shapes::flattened(1e-12),
        "times as wide as long",
    ),
    ("cusp", || shapes::cusp(300), "of its size"),
    ("tube", || shapes::tube(600), ""),
    ("far", || shapes::one_far(1e8), ""),
    ("random-positions", shapes::random_positions, ""),
];

/// Generated meshes that must be built with the cones of a field too.
const IN_A_FIELD: [&str; 6] = [
    "fan",
    "bipyramid",
    "noise",
    "tube",
    "far",
    "random-positions",
];

fn main() {
    let arguments = Arguments::from_args();
    let mut trials = Vec::new();
    for (name, mesh, words) in GENERATED {
        for (kind, is_long) in [("generated", false), ("hard/generated", true)] {
            let run = move || {
                let folder = tempfile::tempdir()?;
                let path = folder.path().join(format!("{name}.obj"));
                shapes::write(&path, &mesh());
                pair(&path, "defaults", &[], words, is_long).map(drop)
            };
            let trial = Trial::test(format!("{kind}/{name}"), run);
            trials.push(trial.with_ignored_flag(is_long));
        }
        if IN_A_FIELD.contains(&name) {
            let run = move || {
                let folder = tempfile::tempdir()?;
                let path = folder.path().join(format!("{name}.obj"));
                shapes::write(&path, &mesh());
                match pair(&path, "field", FIELD, "", false)? {
                    0 => Err("is not built".into()),
                    _ => Ok(()),
                }
            };
            trials.push(Trial::test(format!("generated/field/{name}"), run));
        }
    }
    let corpus = std::env::var_os("AFFINE_ATLAS_CORPUS").map(PathBuf::from);
    let files = corpus.iter().flat_map(|folder| files(&folder.join("hard")));
    let files: Vec<PathBuf> = files.collect();
    for file in &files {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let path = file.clone();
        let run = move || pair(&path, "defaults", &[], "", false).map(drop);
        let is_long = LONG.contains(&&*name);
        trials.push(Trial::test(format!("quick/{name}"), run).with_ignored_flag(is_long));
        for (configuration, settings) in CONFIGURATIONS {
            let path = file.clone();
            let run = move || pair(&path, configuration, settings, "", true).map(drop);
            let name = format!("hard/{configuration}/{name}");
            trials.push(Trial::test(name, run).with_ignored_flag(true));
        }
    }
    if files.is_empty() {
        let missing = || Err("AFFINE_ATLAS_CORPUS names no folder with hard/ below it".into());
        trials.push(Trial::test("quick/corpus", missing).with_ignored_flag(true));
    }
    libtest_mimic::run(&arguments, trials).exit();
}

/// Mesh files of a folder, the largest first: they take longest, and no core is to wait for them in the end.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut files: Vec<(u64, PathBuf)> = entries
        .map(|entry| entry.path())
        .filter(|path| {
            let extension = path.extension().unwrap_or_default();
            ["obj", "off", "ply", "stl", "gltf", "glb"]
                .iter()
                .any(|known| extension == *known)
        })
        .map(|path| (bytes(&path), path))
        .collect();
    files.sort();
    files.into_iter().rev().map(|(_, path)| path).collect()
}

fn bytes(path: &Path) -> u64 {
    path.metadata().map_or(0, |metadata| metadata.len())
}

fn program() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_affine-atlas"));
    command.env_remove("RUST_BACKTRACE").env("NO_COLOR", "1");
    command
}

/// Builds a mesh with a configuration, prints what it cost, and holds it to what must be. `words` are those of a refusal. Returns how many components were built.
fn pair(
    mesh: &Path,
    configuration: &str,
    settings: &[&str],
    words: &str,
    is_long: bool,
) -> Result<usize, Failed> {
    let folder = tempfile::tempdir()?;
    let mut command = program();
    command.args(["build", "--quiet", "--threads", "1", "--jobs", "1"]);
    command.arg(mesh).arg("--out").arg(folder.path());
    // Beyond any limit below; what hangs must end.
    let always = ["run.timeout=1800"].iter();
    let plain = PLAIN.iter().filter(|_| !settings.is_empty());
    for setting in always.chain(plain).chain(settings) {
        command.arg("--set").arg(setting);
    }
    let (output, cost) = measured(&command)?;
    let manifest = std::fs::read_to_string(folder.path().join("manifest.jsonl"));
    let Ok(manifest) = manifest else {
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        return Err(format!("{} without a manifest: {said}", output.status).into());
    };
    let asset: Value = serde_json::from_str(manifest.trim())?;
    let parts = parts(&asset);
    let built = parts.iter().filter(|part| part["state"] == "built").count();
    let mut kinds: Vec<&str> = parts
        .iter()
        .filter_map(|part| part["kind"].as_str())
        .collect();
    kinds.sort_unstable();
    kinds.dedup();
    let mut outcome = match built {
        0 => String::new(),
        _ => format!("built {built} of {} ", parts.len()),
    };
    outcome += &kinds.join(", ");
    let peak = asset["peak_memory"].as_u64();
    println!(
        "| {} | {configuration} | {} | {} | {} |",
        mesh.file_name().unwrap_or_default().to_string_lossy(),
        outcome.trim(),
        cost.map_or("?".into(), |cost| format!("{:.1}", cost.cpu_seconds)),
        peak.map_or("?".into(), |peak| (peak / 1_000_000).to_string()),
    );
    for part in &parts {
        judge(part, words)?;
    }
    within_limits(cost, peak, bytes(mesh))?;
    if built == 0 {
        return Ok(0);
    }
    let mut verify = program();
    succeed("verify", verify.arg("verify").arg(folder.path()))?;
    let is_asked =
        |atlas: &PathBuf| is_long || bytes(&atlas.join("atlas.npz")) <= MOST_CHECKED_BYTES;
    let all: Vec<PathBuf> = atlases(folder.path())
        .into_iter()
        .filter(is_asked)
        .collect();
    let step = match is_long {
        true => 1,
        false => all.len().div_ceil(SOME).max(1),
    };
    for atlas in all.into_iter().step_by(step) {
        // Another mesh is built where vertices a tenth of it apart are merged.
        let same = !settings
            .iter()
            .any(|s| s.starts_with("repair.weld_tolerance"));
        let source = comparable(mesh).filter(|_| same && parts.len() == 1);
        checked(&atlas, source, None)?;
    }
    Ok(built)
}

/// The components of an asset; the asset itself where it was refused before it fell into any.
fn parts(asset: &Value) -> Vec<Value> {
    match asset["components"].as_array() {
        Some(components) if !components.is_empty() => components.clone(),
        _ => vec![asset.clone()],
    }
}

/// Built, or refused with a sentence for what the user can change.
fn judge(part: &Value, words: &str) -> Result<(), Failed> {
    if part["state"] == "built" {
        return Ok(());
    }
    let kind = part["kind"].as_str().unwrap_or("no kind");
    let message = part["error"].as_str().unwrap_or_default();
    if !REFUSALS.contains(&kind) || message.is_empty() || !message.contains(words) {
        return Err(format!("{} ({kind}): {message}", part["state"]).into());
    }
    Ok(())
}

fn within_limits(cost: Option<Cost>, peak: Option<u64>, bytes: u64) -> Result<(), Failed> {
    if let Some(cost) = cost.filter(|cost| cost.cpu_seconds > MOST_CPU_SECONDS) {
        return Err(format!("took {:.1} CPU seconds", cost.cpu_seconds).into());
    }
    let most = match bytes < SMALL {
        true => MOST_BYTES_OF_SMALL,
        false => MOST_BYTES,
    };
    if let Some(peak) = peak.filter(|&peak| peak > most) {
        return Err(format!("took {peak} bytes").into());
    }
    Ok(())
}
