//! Geometry images in the hands of other programs: OpenEXR, OpenImageIO and OpenCV read the same numbers from them.
//!
//! `AFFINE_ATLAS_PYTHON` (or `python3`) is an interpreter with these three and NumPy; without them the cases are reported as ignored.

use affine_atlas::config;
use affine_atlas::job;
use affine_atlas::outcome::AssetState;
use libtest_mimic::{Arguments, Failed, Trial};
use std::ffi::OsString;
use std::path::Path;
use std::process::Command;

const FIXTURE: &str = "fixtures/good/genus-0-animal.ply";

fn main() {
    let arguments = Arguments::from_args();
    let cases = [
        ("default", "images.domain=flat"),
        ("rectangle", "images.domain=rectangle"),
        ("half", "images.normal_precision=half"),
        ("packed", "patches.packed_side=512"),
    ];
    let is_ignored = !has_readers();
    let trials = cases.map(|(name, key)| {
        let trial = Trial::test(name, move || read_alike(key));
        trial.with_ignored_flag(is_ignored)
    });
    libtest_mimic::run(&arguments, trials.into()).exit();
}

fn python() -> OsString {
    std::env::var_os("AFFINE_ATLAS_PYTHON").unwrap_or_else(|| "python3".into())
}

fn has_readers() -> bool {
    let modules = "import numpy, OpenEXR, OpenImageIO, cv2";
    let output = Command::new(python()).args(["-c", modules]).output();
    output.is_ok_and(|output| output.status.success())
}

/// As many images as the atlas has, and the packed one, and no reader differs.
fn read_alike(key: &str) -> Result<(), Failed> {
    let mut config = config::defaults(&[key.into(), "patches.texel_budget=65536".into()])?.config;
    config.pictures.enabled = false;
    let folder = tempfile::tempdir()?;
    let outcome = job::run(
        Path::new(FIXTURE),
        "model",
        folder.path(),
        "asset",
        &config,
        &(),
    );
    if outcome.state != AssetState::Built {
        return Err(format!("{:?}", outcome.state).into());
    }
    let asset = folder.path().join("asset");
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
