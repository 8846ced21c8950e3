//! Spline surfaces of real models: how near they are, that they do not fold, and what other programs read in their files.
//!
//! `AFFINE_ATLAS_CORPUS` names a folder with the models, `AFFINE_ATLAS_READERS` (or `AFFINE_ATLAS_PYTHON`, or `python3`) an interpreter for `fixtures/read_splines.py`;
//! checks whose modules it does not have are left out. Large models are for `--ignored`.

mod real_models;

use affine_atlas::job::fit::{FitParams, FittedAsset, Size, fit};
use libtest_mimic::{Arguments, Failed, Trial};
use real_models::LARGE;
use std::ffi::OsString;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

const MODELS: [&str; 18] = [
    "beetle.obj",
    "brezel.obj",
    "bumpy-cube.obj",
    "bunny-closed.off",
    "camelhead.off",
    "elephant-genus3.obj",
    "face.obj",
    "fandisk.off",
    "fertility.off",
    "kitten.obj",
    "lego.ply",
    "lilium.obj",
    "nefertiti.obj",
    "punctured-torus.obj",
    "rocker-arm.obj",
    "spot.obj",
    "stanford-bunny.obj",
    "three-holes.off",
];

/// Smooth, and finely meshed: normals can be told.
const SMOOTH: [&str; 6] = [
    "beetle.obj",
    "bumpy-cube.obj",
    "camelhead.off",
    "kitten.obj",
    "punctured-torus.obj",
    "three-holes.off",
];

/// Read by other programs: closed, closed of genus 3, open, with creases.
const READ: [&str; 4] = [
    "spot.obj",
    "three-holes.off",
    "camelhead.off",
    "fandisk.off",
];

/// For those without a corpus.
const FIXTURES: [&str; 3] = ["genus-2-amphora.glb", "genus-0-animal.ply", "disk-mask.obj"];

fn main() {
    let arguments = Arguments::from_args();
    let corpus = std::env::var_os("AFFINE_ATLAS_CORPUS").map(PathBuf::from);
    let is_ignored = corpus.is_none();
    let folder = corpus.unwrap_or_default();
    let mut trials = Vec::new();
    for file in MODELS {
        let model = folder.join(file);
        let trial = Trial::test(format!("near/{file}"), move || is_near(&model, file));
        trials.push(trial.with_ignored_flag(is_ignored || LARGE.contains(&file)));
    }
    let has_readers = has_modules("numpy, OCP, pxr");
    for file in READ {
        let model = folder.join(file);
        let trial = Trial::test(format!("read/{file}"), move || is_read(&model, 2000));
        trials.push(trial.with_ignored_flag(is_ignored || !has_readers));
    }
    for file in FIXTURES {
        let model = Path::new("fixtures/good").join(file);
        let trial = Trial::test(format!("read/{file}"), move || is_read(&model, 2000));
        trials.push(trial.with_ignored_flag(!is_ignored || !has_readers));
    }
    let trial = Trial::test("read/hollow", hollow_is_read);
    trials.push(trial.with_ignored_flag(!has_readers));
    libtest_mimic::run(&arguments, trials).exit();
}

fn python() -> OsString {
    let named = ["AFFINE_ATLAS_READERS", "AFFINE_ATLAS_PYTHON"].map(std::env::var_os);
    let mut named = named.into_iter().flatten();
    named.next().unwrap_or_else(|| "python3".into())
}

fn has_modules(names: &str) -> bool {
    let mut command = Command::new(python());
    let output = command.args(["-c", &format!("import {names}")]).output();
    output.is_ok_and(|output| output.status.success())
}

fn fitted(model: &Path, cells: usize) -> Result<FittedAsset, Failed> {
    let params = FitParams {
        size: Size::Cells(cells),
        ..FitParams::default()
    };
    Ok(fit(model, &params, &())?)
}

/// At 2,000 and at 8,000 cells; tells all figures, so that a run makes a table.
fn is_near(model: &Path, file: &str) -> Result<(), Failed> {
    let is_plain = ["lego.ply", "beetle.obj"].contains(&file);
    let mut wrong = String::new();
    for cells in [2000, 8000] {
        let document = fitted(model, cells)?.document();
        let [component] = &document.components[..] else {
            return Err("several components".into());
        };
        let (source, normals) = (component.from_source, component.normal_deviation);
        println!(
            "{file} {cells}: {} control points, RMS {:.2e}, max {:.2e}, normals {:.2}°, turned over {:.1e}, jump {:.1e}° {:.3}° {:.3}°",
            component.control_points,
            source.rms_of_diagonal,
            source.max_of_diagonal,
            normals.p95_degrees,
            component.turned_over_area,
            component.step.normal_jump_regular.max_degrees,
            component.step.normal_jump_irregular.p95_degrees,
            component.step.normal_jump_irregular.max_degrees,
        );
        let most_rms = match (cells, is_plain) {
            (2000, true) => 1.6e-3,
            (2000, false) => 8e-4,
            _ => 2e-4,
        };
        let step = &component.step;
        let mut check = |what: &str, value: f64, most: f64| {
            if value.is_nan() || value > most {
                let _ = write!(
                    wrong,
                    "{cells} cells: {what} {value:.3e}, at most {most:.1e}; "
                );
            }
        };
        check("turned over", component.turned_over_area, 0.0);
        check("RMS", source.rms_of_diagonal, most_rms);
        let radians = |degrees: f64| degrees.to_radians();
        check(
            "jump between regular cells",
            radians(step.normal_jump_regular.max_degrees),
            1e-6,
        );
        check(
            "95 % of jumps beside irregular points",
            step.normal_jump_irregular.p95_degrees,
            0.1,
        );
        check(
            "jump beside irregular points",
            step.normal_jump_irregular.max_degrees,
            0.5,
        );
        if cells == 8000 {
            check("largest distance", source.max_of_diagonal, 3e-3);
            if SMOOTH.contains(&file) {
                check("95 % of normals", normals.p95_degrees, 5.0);
            }
        }
    }
    match wrong.is_empty() {
        true => Ok(()),
        false => Err(wrong.into()),
    }
}

/// Places of cells at which limit positions are compared.
const PLACES: [[f64; 2]; 5] = [[0.0, 0.0], [0.5, 0.0], [0.5, 0.5], [0.25, 0.75], [1.0, 1.0]];

/// A box with a cavity is one solid with two shells, as large as both surfaces together say.
fn hollow_is_read() -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    let model = folder.path().join("hollow.obj");
    let mut text = String::new();
    for [low, high] in [
        [[0.0, 0.0, 0.0], [5.0, 4.0, 3.0]],
        [[0.4; 3], [4.8, 3.5, 2.2]],
    ] {
        for i in 0..8 {
            let at = |axis: usize| {
                if i >> axis & 1 == 1 {
                    high[axis]
                } else {
                    low[axis]
                }
            };
            writeln!(text, "v {} {} {}", at(0), at(1), at(2))?;
        }
    }
    let quads = [
        [1, 3, 4, 2],
        [5, 6, 8, 7],
        [1, 2, 6, 5],
        [3, 7, 8, 4],
        [1, 5, 7, 3],
        [2, 4, 8, 6],
    ];
    for [a, b, c, d] in quads {
        writeln!(text, "f {a} {b} {c} {d}")?;
        writeln!(text, "f {} {} {} {}", d + 8, c + 8, b + 8, a + 8)?;
    }
    std::fs::write(&model, text)?;
    let document = fitted(&model, 100)?.document();
    let solids: Vec<_> = document
        .components
        .iter()
        .map(|c| c.void_of.as_deref())
        .collect();
    if solids != [None, Some("component-000")] {
        return Err(format!("cavities of {solids:?}").into());
    }
    is_read(&model, 100)
}

/// OpenCASCADE, USD, an evaluator of Catmull–Clark surfaces and G+Smo find nothing wrong.
fn is_read(model: &Path, cells: usize) -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    let asset = fitted(model, cells)?;
    asset.write(folder.path(), "fit")?;
    let mut command = Command::new(python());
    command
        .arg("fixtures/read_splines.py")
        .arg(folder.path().join("fit"));
    // Formats that the script reads, for the volume.
    if model.extension().is_some_and(|e| e == "obj" || e == "off") {
        command.args(["--mesh".as_ref(), model]);
    }
    for component in &asset.components {
        let mut lines = String::new();
        component.spline.with_limit(|limit| {
            for cell in 0..limit.cage.cells.len() as u32 {
                for at in PLACES {
                    let [x, y, z] = limit.at(cell, at).point;
                    let _ = writeln!(lines, "{cell} {} {} {x} {y} {z}", at[0], at[1]);
                }
            }
        });
        let path = folder.path().join(format!("{}.txt", component.name));
        std::fs::write(&path, lines)?;
        command
            .arg("--limits")
            .arg(format!("{}={}", component.name, path.display()));
    }
    let output = command.output()?;
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    println!("{said}");
    match output.status.success() {
        true => Ok(()),
        false => Err(format!("{said}{}", String::from_utf8_lossy(&output.stderr)).into()),
    }
}
