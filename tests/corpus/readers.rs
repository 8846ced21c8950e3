//! What was written in the hands of other programs: OpenEXR, OpenImageIO and OpenCV read the same numbers from geometry images, and the
//! example of `docs/output.md` carries coordinates across seams.
//!
//! `AFFINE_ATLAS_PYTHON` (or `python3`) is an interpreter with these three and NumPy, for the example NumPy alone; without them the cases are
//! reported as ignored.

use affine_atlas::config;
use affine_atlas::job;
use affine_atlas::outcome::AssetState;
use libtest_mimic::{Failed, Trial};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::Command;

const FIXTURE: &str = "fixtures/good/genus-0-animal.ply";

pub fn trials() -> Vec<Trial> {
    let cases = [
        ("default", "images.domain=grid"),
        ("flat", "images.domain=flat"),
        ("half", "images.normal_precision=half"),
        ("packed", "patches.packed_side=512"),
    ];
    let is_ignored = !has_modules("numpy, OpenEXR, OpenImageIO, cv2");
    let images = cases.map(|(name, key)| {
        let trial = Trial::test(format!("readers/{name}"), move || read_alike(key));
        trial.with_ignored_flag(is_ignored)
    });
    let has_numpy = has_modules("numpy");
    let seams = ["genus-1-mug.off", "genus-2-amphora.glb", "disk-mask.obj"].map(|fixture| {
        let trial = Trial::test(format!("readers/seams/{fixture}"), move || {
            seams_close(fixture)
        });
        trial.with_ignored_flag(!has_numpy)
    });
    images.into_iter().chain(seams).collect()
}

fn python() -> OsString {
    std::env::var_os("AFFINE_ATLAS_PYTHON").unwrap_or_else(|| "python3".into())
}

fn has_modules(names: &str) -> bool {
    let import = format!("import {names}");
    let output = Command::new(python()).args(["-c", &import]).output();
    output.is_ok_and(|output| output.status.success())
}

/// The example of the output reference, as it stands there.
fn example() -> Result<String, Failed> {
    let text = std::fs::read_to_string("docs/output.md")?;
    let code = text.split("```python\n").nth(1);
    let code = code.and_then(|rest| rest.split("```").next());
    Ok(code.ok_or("docs/output.md has no example")?.to_owned())
}

/// It runs, looks at every cut edge, and finds the coordinates that are stored there.
fn seams_close(fixture: &str) -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    let asset = built(
        &Path::new("fixtures/good").join(fixture),
        folder.path(),
        &[],
    )?;
    let output = Command::new(python())
        .arg("-c")
        .arg(example()?)
        .arg(&asset)
        .output()?;
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned().into());
    }
    let worst = said
        .trim()
        .strip_prefix("worst error ")
        .ok_or(said.clone())?;
    let worst: f64 = worst.parse()?;
    // Zero would mean that there was nothing to look at.
    match worst > 0.0 && worst < 1e-9 {
        true => Ok(()),
        false => Err(said.into()),
    }
}

/// Builds a mesh with few texels and no pictures.
fn built(mesh: &Path, folder: &Path, keys: &[String]) -> Result<PathBuf, Failed> {
    let on_grid = keys.iter().any(|key| key == "images.domain=grid");
    let small = match on_grid {
        true => ["grid.samples_per_cell=4".to_owned()],
        false => ["patches.texel_budget=65536".to_owned()],
    };
    let mut config = config::defaults(&[keys, &small].concat())?.config;
    config.pictures.enabled = false;
    let outcome = job::run(mesh, "model", folder, "asset", &config, &());
    match outcome.state {
        AssetState::Built => Ok(folder.join("asset")),
        state => Err(format!("{state:?}").into()),
    }
}

/// As many images as the atlas has, and the packed one, and no reader differs.
fn read_alike(key: &str) -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    let asset = built(Path::new(FIXTURE), folder.path(), &[key.into()])?;
    let output = Command::new(python())
        .arg("fixtures/read_images.py")
        .arg(&asset)
        .output()?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned().into());
    }
    let images = std::fs::read_dir(asset.join("images"))?.count();
    let lines = String::from_utf8(output.stdout)?.lines().count();
    match images > 1 && images == lines {
        true => Ok(()),
        false => Err(format!("{images} files, but {lines} were read").into()),
    }
}
