//! The whole program on real models, checked by code that shares nothing with it.
//!
//! `AFFINE_ATLAS_CORPUS` names a folder with the models (`dirty/` and `gltf/` below it); without it every case is
//! reported as ignored. Large models with other settings than the defaults are for `--ignored`. `AFFINE_ATLAS_CHECKER` names an independent checker of output folders (a
//! Python script, run by `AFFINE_ATLAS_PYTHON` or `python3`); without it only the program's own `verify` is asked.

use crate::real_models::grids::{CELLS, density, grids, wanted};
use crate::real_models::lines::lines;
use crate::real_models::plates::{self, obj, rounded};
use crate::real_models::watertight::watertight;
use crate::real_models::{CLEAN, LARGE, atlases, checked, checked_by, comparable, succeed};
use libtest_mimic::{Failed, Trial};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A grid on the cones of a cross field.
const DEFAULTS: &[&str] = &[];
/// Flat patches, cones chosen automatically, vertex scaling with flips.
const FLAT: &[&str] = &["images.domain=flat"];
/// The tutorial's quick choice.
const TANGENTIAL: &[&str] = &["flow.scheme=tangential"];

/// The tutorial's own scheme.
const THURSTON: &[&str] = &["flow.scheme=thurston"];

/// Quarter turns around handles too. Pictures and large images would say nothing more.
const SEAMLESS: &[&str] = &[
    "images.domain=flat",
    "cones.strategy=field",
    "flow.holonomy=quarter-turns",
    "patches.texel_budget=16384",
    "pictures.enabled=false",
    "report.enabled=false",
];

/// Components of a file that the independent checkers are asked about, where there are more; about all of them by `every-component/`.
const SOME: usize = 12;

/// Numbers of cells beside the default.
const OTHER_CELLS: [&str; 3] = ["grid.cells=200", "grid.cells=500", "grid.cells=8000"];

/// Most Newton steps to a seamless metric, and the largest standard deviation of its log scale; measured: 2 to 15, 0.03 to 0.09, and 0.16 on the punctured torus, whose scales a conformality of 0.1 makes less even than 0 did (0.124).
const SEAMLESS_STEPS: u64 = 15;
const SEAMLESS_STD: f64 = 0.17;

/// Part of the length of sharp edges that must lie on lines.
const LEAST_ON_LINES: f64 = 0.95;

/// Models whose `TEXCOORD_0` is measured: most of 95 % over 5 % of √(texels per area), and least part of the square that is filled.
const TEXTURED: [&str; 5] = [
    "spot.obj",
    "kitten.obj",
    "three-holes.off",
    "rocker-arm.obj",
    "nefertiti.obj",
];
const MOST_UNEVEN: f64 = 1.6;
const LEAST_FILLED: f64 = 0.8;

/// What is done with the corpus' folder.
type Case = Box<dyn FnOnce(&Path) -> Result<(), Failed> + Send>;

pub fn trials() -> Vec<Trial> {
    let corpus = std::env::var_os("AFFINE_ATLAS_CORPUS").map(PathBuf::from);
    let mut trials = Vec::new();
    let mut add = |name: String, is_long: bool, run: Case| {
        let folder = corpus.clone();
        let trial = Trial::test(name, move || match folder {
            Some(folder) => run(&folder),
            None => Err("AFFINE_ATLAS_CORPUS names no folder".into()),
        });
        trials.push(trial.with_ignored_flag(is_long || corpus.is_none()));
    };
    // The longest are among these: first, so that no core waits for them in the end.
    for folder in ["dirty", "gltf"] {
        for file in corpus.iter().flat_map(|c| models(&c.join(folder))) {
            let name = file.file_name().unwrap_or_default().to_string_lossy();
            let name = format!("{folder}/{name}");
            let model = file.clone();
            let run = move |_: &Path| atlas_or_refusal(&model, &[], SOME);
            add(name.clone(), false, Box::new(run));
            let model = file.clone();
            let run = move |_: &Path| atlas_or_refusal(&model, &[], usize::MAX);
            add(format!("every-component/{name}"), true, Box::new(run));
            for cells in OTHER_CELLS {
                let model = file.clone();
                let run = move |_: &Path| atlas_or_refusal(&model, &[cells], usize::MAX);
                add(format!("{cells}/{name}"), true, Box::new(run));
            }
        }
    }
    for (file, genus, loops) in CLEAN {
        let is_large = LARGE.contains(&file);
        for (name, settings) in [
            ("clean", DEFAULTS),
            ("flat", FLAT),
            ("tangential", TANGENTIAL),
        ] {
            let run = move |corpus: &Path| clean(&corpus.join(file), genus, loops, settings);
            let is_long = is_large && !settings.is_empty();
            add(format!("{name}/{file}"), is_long, Box::new(run));
        }
        let run = move |corpus: &Path| seamless(&corpus.join(file), genus, loops);
        add(format!("seamless/{file}"), is_large, Box::new(run));
        let run = move |corpus: &Path| {
            let model = corpus.join(file);
            // The default number is that of `clean/`.
            let others = [CELLS[0], CELLS[1], CELLS[3]];
            Ok(grids(&model, &others, |settings| {
                build_one(&model, settings).map_err(failed)
            })?)
        };
        add(format!("grid/{file}"), is_large, Box::new(run));
    }
    for genus in [5, 24, 100] {
        let run = move |_: &Path| plate_on_grids(genus);
        add(format!("grid/genus{genus}"), genus > 24, Box::new(run));
    }
    add(
        "grid/genus24-open".into(),
        false,
        Box::new(|_: &Path| open_plate_on_a_grid(24)),
    );
    for genus in [5, 24, 47, 100] {
        let run = move |_: &Path| seamless_plate(genus);
        add(format!("seamless/genus{genus}"), genus > 47, Box::new(run));
    }
    for (file, curvature) in [
        ("brezel.obj", "-4"),
        ("three-holes.off", "-8"),
        ("fertility.off", "-12"),
    ] {
        for (name, settings) in [
            ("single-cone", FLAT),
            ("packed-cone", TANGENTIAL),
            ("thurston-cone", THURSTON),
        ] {
            let run = move |corpus: &Path| single_cone(&corpus.join(file), curvature, settings);
            add(format!("{name}/{file}"), false, Box::new(run));
        }
    }
    add(
        "rocker-arm/exact-lengths".into(),
        false,
        Box::new(rocker_arm),
    );
    add("spot/quarter-turns".into(), false, Box::new(quarter_turns));
    trials
}

/// Model files of a folder, by name.
fn models(folder: &Path) -> Vec<PathBuf> {
    let known = ["obj", "off", "ply", "stl", "gltf", "glb"];
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .filter_map(|entry| entry.ok().map(|e| e.path()))
        .filter(|p| p.extension().is_some_and(|e| known.iter().any(|k| e == *k)))
        .collect();
    files.sort();
    files
}

/// A finished build in a temporary folder.
struct Built {
    folder: tempfile::TempDir,
    output: Output,
}

impl Built {
    fn atlases(&self) -> Vec<PathBuf> {
        atlases(self.folder.path())
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn program() -> Command {
    Command::new(env!("CARGO_BIN_EXE_affine-atlas"))
}

fn build(model: &Path, settings: &[&str]) -> Result<Built, Failed> {
    let folder = tempfile::tempdir()?;
    let mut command = program();
    command.arg("build").arg(model);
    command.arg("--out").arg(folder.path());
    for setting in settings {
        command.arg("--set").arg(setting);
    }
    let output = command.output()?;
    Ok(Built { folder, output })
}

/// Builds a model that must give exactly one atlas; returns its folder and `atlas.json`.
fn build_one(
    model: &Path,
    settings: &[&str],
) -> Result<(Built, PathBuf, serde_json::Value), Failed> {
    let built = build(model, settings)?;
    let atlases = built.atlases();
    let [atlas] = &atlases[..] else {
        let said = text(&built.output.stdout) + &text(&built.output.stderr);
        return Err(format!("{} atlases: {said}", atlases.len()).into());
    };
    let atlas = atlas.clone();
    let json = serde_json::from_slice(&std::fs::read(atlas.join("atlas.json"))?)?;
    Ok((built, atlas, json))
}

/// Asks the program and, where there is one, the independent checker.
fn verify(atlas: &Path, source: Option<&Path>, cones: Option<usize>) -> Result<(), Failed> {
    // A build has asked itself; the command is asked all the same.
    succeed("verify", program().arg("verify").arg(atlas))?;
    Ok(checked(atlas, source, cones)?)
}

fn failed(error: Failed) -> String {
    error.message().unwrap_or("failed").to_owned()
}

fn max_error(json: &serde_json::Value) -> f64 {
    let error = &json["metric"]["max_curvature_error"];
    error.as_f64().unwrap_or(f64::INFINITY)
}

fn clean(model: &Path, genus: usize, loops: usize, settings: &[&str]) -> Result<(), Failed> {
    let (_built, atlas, json) = build_one(model, settings)?;
    if json["topology"]["genus"] != genus || json["topology"]["boundary_loops"] != loops {
        return Err(format!("topology is {}", json["topology"]).into());
    }
    if max_error(&json) > 1e-10 {
        return Err(format!("curvature error {}", max_error(&json)).into());
    }
    let cones = json["cones"].as_array().map_or(0, Vec::len);
    // None on a disk that is flat as it is; 8, and 16 more where they gain much.
    if !settings.is_empty() && cones > 24 {
        return Err(format!("{cones} cones chosen").into());
    }
    if settings.is_empty() {
        has_grid(&json)?;
        wanted(model, &json, CELLS[2])?;
        checked_by("verify_grid.py", &atlas, comparable(model))?;
        if TEXTURED.iter().any(|name| model.ends_with(name)) {
            texture_coordinates(&atlas, &json)?;
        }
    }
    if settings != TANGENTIAL {
        watertight(&atlas, genus, loops, true)?;
    }
    verify(&atlas, comparable(model), Some(cones))
}

fn has_grid(json: &serde_json::Value) -> Result<(), Failed> {
    match json["grid"]["turned_over"] == 0 {
        true => Ok(()),
        false => Err(format!("no grid: {}", json["no_grid"]).into()),
    }
}

/// Cones of a cross field, quarter turns around every handle, straight borders.
fn seamless(model: &Path, genus: usize, loops: usize) -> Result<(), Failed> {
    let (_built, atlas, json) = build_one(model, SEAMLESS)?;
    let steps = json["metric"]["iterations"].as_u64();
    let std = json["quality"]["log_scale"]["std"].as_f64();
    let is_good = json["flags"]["seamless"] == true
        && json["topology"]["genus"] == genus
        && json["topology"]["boundary_loops"] == loops
        && max_error(&json) <= 1e-10
        && steps.is_some_and(|steps| steps <= SEAMLESS_STEPS)
        && std.is_some_and(|std| std <= SEAMLESS_STD);
    let cones = json["cones"].as_array().map_or(0, Vec::len);
    // A grid has at least three quads around a vertex inside, and one in a corner of the border.
    let curvatures = json["cones"].as_array().into_iter().flatten();
    let has_room = curvatures
        .map(|cone| cone["curvature"].as_f64())
        .all(|k| k.is_some_and(|k| k < std::f64::consts::FRAC_PI_2 + 1e-9));
    println!(
        "{}: {cones} cones, {steps:?} steps, error {:.1e}, std {std:?}",
        model.display(),
        max_error(&json)
    );
    if !(is_good && has_room) {
        return Err(format!("{} {} {}", json["flags"], json["metric"], json["cones"]).into());
    }
    // Of models from design; on scanned ones what is sharp is mostly noise.
    let lines = lines(&atlas);
    println!(
        "{}: {:.4} on lines, {lines:?}",
        model.display(),
        lines.share()
    );
    let is_designed = ["fandisk.off", "lego.ply"]
        .iter()
        .any(|name| model.ends_with(name));
    if is_designed && lines.share() < LEAST_ON_LINES {
        return Err(format!("{lines:?} are on lines").into());
    }
    Ok(checked(&atlas, comparable(model), Some(cones))?)
}

/// Texels of `TEXCOORD_0` are about as dense everywhere, and waste little room.
fn texture_coordinates(atlas: &Path, json: &serde_json::Value) -> Result<(), Failed> {
    let [uneven, filled] = density(atlas, json);
    println!("{}: {uneven:.3}, {filled:.3}", atlas.display());
    match uneven <= MOST_UNEVEN && filled >= LEAST_FILLED {
        true => Ok(()),
        false => Err(format!("density {uneven:.3}, filled {filled:.3}").into()),
    }
}

/// A generated surface of higher genus in a temporary folder.
fn plate(genus: usize) -> Result<(tempfile::TempDir, PathBuf), Failed> {
    generated(&rounded(genus))
}

/// A generated surface in a temporary folder.
fn generated(
    surface: &(plates::Positions, plates::Faces),
) -> Result<(tempfile::TempDir, PathBuf), Failed> {
    let folder = tempfile::tempdir()?;
    let model = folder.path().join("generated.obj");
    std::fs::write(&model, obj(surface))?;
    Ok((folder, model))
}

/// The same on generated surfaces of higher genus.
fn seamless_plate(genus: usize) -> Result<(), Failed> {
    let (_folder, model) = plate(genus)?;
    seamless(&model, genus, 0)
}

/// Grids of several numbers of cells on these.
fn plate_on_grids(genus: usize) -> Result<(), Failed> {
    let (_folder, model) = plate(genus)?;
    let build = |settings: &[&str]| build_one(&model, settings).map_err(failed);
    Ok(grids(&model, &CELLS, build)?)
}

/// The default grid of a plate with sharp edges and a boundary. At genus 24 the first numbers that fit turn a face over.
fn open_plate_on_a_grid(genus: usize) -> Result<(), Failed> {
    let (_folder, model) = generated(&plates::plate(genus, true))?;
    let build = |settings: &[&str]| build_one(&model, settings).map_err(failed);
    Ok(grids(&model, &CELLS[2..3], build)?)
}

/// Fig. 8, 20 and 21: all curvature at one vertex.
fn single_cone(model: &Path, curvature: &str, settings: &[&str]) -> Result<(), Failed> {
    let settings = [&["cones.strategy=single"], settings].concat();
    let (_built, atlas, json) = build_one(model, &settings)?;
    let expected = curvature.parse::<f64>()? * std::f64::consts::PI;
    let given = json["cones"][0]["curvature"].as_f64();
    if given.is_none_or(|k| (k - expected).abs() > 1e-9) {
        return Err(format!("cones are {}", json["cones"]).into());
    }
    let splits_only = json["connectivity"]["hausdorff"].as_f64() == Some(0.0);
    // A packing needs room that these meshes do not have; with flips nothing is split.
    let split = json["connectivity"]["splits"].as_u64() != Some(0);
    if split != (json["metric"]["scheme"] != "vertex-scaling")
        || !splits_only
        || max_error(&json) > 1e-10
    {
        return Err(format!("{} {}", json["connectivity"], json["metric"]).into());
    }
    verify(&atlas, Some(model), Some(1))
}

/// The two schemes that keep the lengths in space exactly must agree, and with an area distortion computed elsewhere for a fixed
/// connectivity. With flips it is that of the surface itself and not of its accidental edges: close, but not the same.
fn rocker_arm(corpus: &Path) -> Result<(), Failed> {
    let model = corpus.join("rocker-arm.obj");
    let mut distortion = Vec::new();
    for (scheme, delaunay) in [
        ("vertex-scaling", false),
        ("inversive-distance", false),
        ("vertex-scaling", true),
    ] {
        let scheme_setting = format!("flow.scheme={scheme}");
        let delaunay_setting = format!("flow.delaunay={delaunay}");
        let settings = [
            "cones.strategy=none",
            scheme_setting.as_str(),
            delaunay_setting.as_str(),
        ];
        let (_built, atlas, json) = build_one(&model, &settings)?;
        let figure = json["quality"]["area_distortion"].as_f64();
        distortion.push(figure.unwrap_or(f64::NAN));
        let rotation = |s: &serde_json::Value| s["gluing"]["rotation"].as_f64();
        let segments = json["segments"].as_array().into_iter().flatten();
        let turned = segments
            .map(rotation)
            .any(|r| r.is_none_or(|r| r.abs() > 1e-8));
        if turned || json["periods"].as_array().map(Vec::len) != Some(2) {
            return Err(format!("{scheme}: no translations or no two periods").into());
        }
        let iterations = json["metric"]["iterations"].as_u64();
        let most = if delaunay { 6 } else { 12 };
        if scheme == "vertex-scaling" && iterations.is_none_or(|n| n > most) {
            return Err(format!("{iterations:?} iterations").into());
        }
        verify(&atlas, Some(&model), Some(0))?;
    }
    let [exact, other, flipped] = distortion[..] else {
        return Err(format!("area distortions {distortion:?}").into());
    };
    let agree = (exact - other).abs() <= 0.001 && (exact - flipped).abs() <= 0.05;
    if (exact - 0.978).abs() > 0.002 || !agree {
        return Err(format!("area distortions {distortion:?}").into());
    }
    Ok(())
}

/// Equal cones of π/2, and chosen ones that are multiples of it.
fn quarter_turns(corpus: &Path) -> Result<(), Failed> {
    let model = corpus.join("spot.obj");
    for setting in ["cones.strategy=spread", "cones.quantum=1/2"] {
        let (_built, atlas, json) = build_one(&model, &[setting])?;
        if json["flags"]["seamless"] != true {
            return Err(format!("{setting}: not seamless").into());
        }
        let cones = json["cones"].as_array().map_or(0, Vec::len);
        let count = match setting {
            "cones.strategy=spread" => cones == 8,
            _ => (3..=24).contains(&cones),
        };
        if !count {
            return Err(format!("{setting}: {cones} cones").into());
        }
        verify(&atlas, Some(&model), Some(cones))?;
    }
    Ok(())
}

/// Any file must end in atlases that pass, on grids, or in a refusal that says why; never in a panic. The independent checkers are asked about `most` of
/// them, spread over all.
fn atlas_or_refusal(model: &Path, settings: &[&str], most: usize) -> Result<(), Failed> {
    let settings = [&["pictures.enabled=false"], settings].concat();
    let built = build(model, &settings)?;
    let said = text(&built.output.stderr) + &text(&built.output.stdout);
    let atlases = built.atlases();
    match built.output.status.code() {
        Some(0) if !atlases.is_empty() => {}
        Some(1) if !said.contains("panic") && !said.trim().is_empty() => {}
        code => {
            let count = atlases.len();
            return Err(format!("exit {code:?} with {count} atlases: {said}").into());
        }
    }
    if !atlases.is_empty() {
        succeed("verify", program().arg("verify").arg(built.folder.path()))?;
    }
    for atlas in &atlases {
        let json = serde_json::from_slice(&std::fs::read(atlas.join("atlas.json"))?)?;
        has_grid(&json)?;
    }
    let step = atlases.len().div_ceil(most).max(1);
    for atlas in atlases.iter().step_by(step) {
        checked_by("verify_grid.py", atlas, None)?;
        checked(atlas, None, None)?;
    }
    Ok(())
}
