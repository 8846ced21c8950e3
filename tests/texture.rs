//! Textures of real models: no seam shows where all transitions are quarter turns.
//!
//! `AFFINE_ATLAS_CORPUS` names a folder with the models; without it they are reported as ignored. Large ones are for `--ignored`.

mod real_models;

use affine_atlas::job::texture::{TextureParams, TileSize, texture};
use affine_atlas::texture::{as_it_is, paint, steps};
use libtest_mimic::{Arguments, Failed, Trial};
use real_models::LARGE;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Quarter turns around every handle.
const SEAMLESS: &[&str] = &["cones.strategy=field", "flow.holonomy=quarter-turns"];

/// File, settings.
const MODELS: [(&str, &[&str]); 8] = [
    // Eight cones of π/2.
    ("spot.obj", &["cones.strategy=spread", "cones.count=8"]),
    ("spot.obj", &["cones.count=8", "cones.quantum=1/2"]),
    ("bunny-closed.off", &["cones.count=8", "cones.quantum=1/2"]),
    ("rocker-arm.obj", &["cones.strategy=none"]),
    ("brezel.obj", SEAMLESS),
    ("kitten.obj", SEAMLESS),
    ("fertility.off", SEAMLESS),
    ("rocker-arm.obj", SEAMLESS),
];

fn main() {
    let arguments = Arguments::from_args();
    let corpus = std::env::var_os("AFFINE_ATLAS_CORPUS").map(PathBuf::from);
    let is_ignored = corpus.is_none();
    let folder = corpus.unwrap_or_default();
    let trials = MODELS.map(|(file, settings)| {
        let model = folder.join(file);
        let name = format!("{file}/{}", settings.join(","));
        let is_long = is_ignored || LARGE.contains(&file);
        Trial::test(name, move || seamless(&model, settings)).with_ignored_flag(is_long)
    });
    libtest_mimic::run(&arguments, trials.into()).exit();
}

/// Colour steps across seams are those beside them, to three hundredths; with flat coordinates as they are, they are not.
fn seamless(model: &Path, settings: &[&str]) -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    let mut command = Command::new(env!("CARGO_BIN_EXE_affine-atlas"));
    command
        .arg("build")
        .arg("-q")
        .arg(model)
        .arg("--out")
        .arg(folder.path());
    for setting in settings.iter().chain(&["pictures.enabled=false"]) {
        command.arg("--set").arg(setting);
    }
    let output = command.output()?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned().into());
    }
    let name = model.file_stem().unwrap_or_default();
    let params = TextureParams {
        pattern: "fixtures/patterns/waves.png".into(),
        tile: TileSize::Repeat(16.0),
        size: 2048,
    };
    let asset = texture(&folder.path().join(name), &params)?;
    print!("{asset}");
    let [component] = &asset.components[..] else {
        return Err("more than one component".into());
    };
    let fitted = component.field.fitted.as_ref().ok_or("not fitted")?;
    let ratio = |a: Option<f64>, b: Option<f64>| a.zip(b).map_or(f64::NAN, |(a, b)| a / b);
    let found = component.steps;
    let ratios = [
        ratio(found.seams, found.inside),
        ratio(found.seams, found.beside_seams),
        ratio(found.cut, found.beside_cut),
    ];
    let surface = &component.surface;
    let raw = as_it_is(surface, component.asked);
    let raw = paint(surface, &raw, &asset.exemplar, 2048);
    let raw = steps(surface, &component.mesh.connectivity, &raw);
    let control = ratio(raw.cut, raw.beside_cut);
    println!("ratios {ratios:?}, as it is {control:.2}");
    // A seam shows against what lies beside it. Elsewhere tiles are smaller where handles make the cut run through wide ones.
    let is_elsewhere_alike = settings == SEAMLESS || (0.9..=1.1).contains(&ratios[0]);
    let is_good = is_elsewhere_alike
        && ratios[1..].iter().all(|r| (0.97..=1.03).contains(r))
        && fitted.largest_misfit <= 1e-9;
    match is_good && control > 2.0 {
        true => Ok(()),
        false => Err(format!("{ratios:?}, {control}, misfit {:e}", fitted.largest_misfit).into()),
    }
}
