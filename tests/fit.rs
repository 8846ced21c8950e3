//! Spline surfaces of real models, and of a fixture beside those of SciPy.
//!
//! `AFFINE_ATLAS_CORPUS` names a folder with the models, `AFFINE_ATLAS_PYTHON` (or `python3`) an interpreter with SciPy and
//! OpenEXR; what is missing is reported as ignored. Large models are for `--ignored`.

mod real_models;

use affine_atlas::fit::DEFAULT_SPACING;
use affine_atlas::job::fit::{FitParams, FittedAsset};
use affine_atlas::outcome::AssetState;
use affine_atlas::{config, job};
use libtest_mimic::{Arguments, Failed, Trial};
use real_models::LARGE;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

/// File, Euler characteristic.
const MODELS: [(&str, i64); 10] = [
    ("spot.obj", 2),
    ("bunny-closed.off", 2),
    ("nefertiti.obj", 2),
    ("fandisk.off", 2),
    ("rocker-arm.obj", 0),
    ("brezel.obj", -2),
    ("three-holes.off", -4),
    ("camelhead.off", 1),
    ("punctured-torus.obj", -1),
    ("stanford-bunny.obj", -3),
];

/// Made by `fixtures/generate.rs`.
const FIXTURE: &str = "fixtures/good/genus-2-amphora.glb";

fn main() {
    let arguments = Arguments::from_args();
    let corpus = std::env::var_os("AFFINE_ATLAS_CORPUS").map(PathBuf::from);
    let is_ignored = corpus.is_none();
    let folder = corpus.unwrap_or_default();
    let mut trials = Vec::new();
    for (file, euler) in MODELS {
        let model = folder.join(file);
        let trial = Trial::test(format!("joined/{file}"), move || joined(&model, euler));
        trials.push(trial.with_ignored_flag(is_ignored || LARGE.contains(&file)));
    }
    let scipy = Trial::test("scipy/genus-2-amphora", beside_scipy);
    trials.push(scipy.with_ignored_flag(!has_scipy()));
    libtest_mimic::run(&arguments, trials).exit();
}

fn python() -> OsString {
    std::env::var_os("AFFINE_ATLAS_PYTHON").unwrap_or_else(|| "python3".into())
}

fn has_scipy() -> bool {
    let mut command = Command::new(python());
    let output = command.args(["-c", "import scipy, OpenEXR"]).output();
    output.is_ok_and(|output| output.status.success())
}

/// A folder of a grid and its surfaces.
fn fitted(model: &Path, folder: &Path, spacing: f64) -> Result<FittedAsset, Failed> {
    let settings = ["images.domain=grid", "pictures.enabled=false"].map(str::to_owned);
    let config = config::parse("settings", "", &settings)?;
    let outcome = job::run(model, "model", folder, "asset", &config, &());
    if outcome.state != AssetState::Built {
        return Err(format!("{:?}", outcome.state).into());
    }
    let params = FitParams {
        spacing,
        ..FitParams::default()
    };
    let asset = job::fit::fit(&folder.join("asset"), &params)?;
    match asset.components.len() {
        1 => Ok(asset),
        n => Err(format!("{n} components").into()),
    }
}

/// No gap, the right topology, and a surface that is the model's.
fn joined(model: &Path, euler: i64) -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    let asset = fitted(model, folder.path(), DEFAULT_SPACING)?;
    let component = &asset.components[0];
    let neighbours = &component.surfaces.neighbours;
    let measured = &component.measured;
    print!("{}", component);
    let sides = neighbours.interfaces.len() + neighbours.boundary.len();
    let patches = component.surfaces.patches.len();
    let found = neighbours.corners as i64 - sides as i64 + patches as i64;
    let part = |x: f64| x / measured.diagonal;
    let gap = part(measured.all_seams.gap);
    let rms = [measured.all.samples.rms, measured.all.surface.rms].map(part);
    match found == euler && gap <= 1e-9 && rms.iter().all(|&x| x < 0.01) {
        true => Ok(()),
        false => Err(format!("Euler characteristic {found}, gap {gap:e}, RMS {rms:?}").into()),
    }
}

/// SciPy fits each part for itself with the same knots, and so gets the least that can be: ours may be no nearer, and not much farther. It reads
/// the images as they are, so they are grids without holes.
fn beside_scipy() -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    let asset = fitted(Path::new(FIXTURE), folder.path(), 3.0)?;
    asset.write(folder.path(), "splines")?;
    let component = &asset.components[0];
    let output = Command::new(python())
        .arg("fixtures/fit_parts.py")
        .arg(folder.path().join("asset"))
        .arg(folder.path().join("splines"))
        .arg("3")
        .output()?;
    let said = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        return Err(said.into_owned().into());
    }
    let text = String::from_utf8(output.stdout)?;
    let ours = &component.measured.patches;
    if text.lines().count() != ours.len() {
        return Err(format!("{} parts, but SciPy printed {text}", ours.len()).into());
    }
    let (mut squares, mut least, mut samples) = (0.0, 0.0, 0.0);
    for (id, line) in text.lines().enumerate() {
        let words: Vec<&str> = line.split(' ').collect();
        let &[name, columns, rows, rms] = &words[..] else {
            return Err(line.into());
        };
        let size: [usize; 2] = [columns.parse()?, rows.parse()?];
        let rms: f64 = rms.parse()?;
        let grid = &component.grids.patches[id];
        let error = ours[id].samples.rms;
        if name != format!("images/{:04}.exr", grid.part.block)
            || size != grid.samples
            || error < rms * (1.0 - 1e-6)
        {
            return Err(format!("{line}, but ours {:?} {error:e}", grid.samples).into());
        }
        let count = (size[0] * size[1]) as f64;
        samples += count;
        squares += count * error * error;
        least += count * rms * rms;
    }
    let root = |x: f64| (x / samples).sqrt() / component.measured.diagonal;
    let [ours, least] = [squares, least].map(root);
    println!("RMS {ours:.3e} of the diagonal, SciPy {least:.3e}");
    // Shared corners and sides cost little, as both parts have the same points there.
    match ours <= 1.1 * least {
        true => Ok(()),
        false => Err(format!("RMS {ours:e}, but SciPy {least:e}").into()),
    }
}
