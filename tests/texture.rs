//! Textures of real models: no seam shows, and tiles are about equally large.
//!
//! `AFFINE_ATLAS_CORPUS` names a folder with the models; without it they are reported as ignored. The largest is for `--ignored`.

mod real_models;

use affine_atlas::job::texture::{TextureParams, TexturedAsset, texture};
use affine_atlas::texture::{Exemplar, Steps, paint, steps};
use image::{Rgba, RgbaImage};
use libtest_mimic::{Arguments, Failed, Trial};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Genus 0, 2, 4, 1, and one with a border.
const MODELS: [&str; 5] = [
    "spot.obj",
    "brezel.obj",
    "fertility.off",
    LARGEST,
    "camelhead.off",
];
const LARGEST: &str = "kitten.obj";

/// By how much a colour step across seams may differ from that beside them.
const SAME: f64 = 0.03;
/// The widest of nineteen twentieths of all tiles over the narrowest.
const EVEN: f64 = 2.0;

fn main() {
    let arguments = Arguments::from_args();
    let corpus = std::env::var_os("AFFINE_ATLAS_CORPUS").map(PathBuf::from);
    let is_ignored = corpus.is_none();
    let folder = corpus.unwrap_or_default();
    let trials = MODELS.map(|file| {
        let model = folder.join(file);
        let is_long = is_ignored || file == LARGEST;
        Trial::test(file, move || seamless(&model)).with_ignored_flag(is_long)
    });
    libtest_mimic::run(&arguments, trials.into()).exit();
}

/// Colour steps over those beside them: where the grid turns, and across seams.
fn ratios(steps: &Steps) -> [f64; 2] {
    [
        (steps.cut, steps.beside_cut),
        (steps.seams, steps.beside_seams),
    ]
    .map(|(across, beside)| across.zip(beside).map_or(f64::NAN, |(a, b)| a / b))
}

/// The same measure for a pattern that changes when it is turned, and with every second patch moved by a third of a tile: both must be seen.
fn controls(asset: &TexturedAsset, size: usize) -> [f64; 2] {
    let component = &asset.components[0];
    let (tiling, connectivity) = (&asset.tiling, &component.mesh.connectivity);
    let stripes = RgbaImage::from_fn(64, 64, |x, _| {
        let wave = (std::f64::consts::TAU * (f64::from(x) + 0.5) / 64.0).sin();
        let c = (127.5 + 127.0 * wave) as u8;
        Rgba([c, c, c, 255])
    });
    let striped = paint(&component.surface, tiling, &Exemplar::new(stripes), size);
    let striped = steps(&component.surface, connectivity, tiling, &striped);
    let mut moved = component.surface.clone();
    let patches = moved.grid_uv.iter_mut().zip(&moved.patch);
    for (corners, _) in patches.filter(|(_, patch)| **patch % 2 == 1) {
        corners.iter_mut().for_each(|p| p[0] += 1.0 / 3.0);
    }
    let painted = paint(&moved, tiling, &asset.exemplar, size);
    let moved = steps(&moved, connectivity, tiling, &painted);
    [ratios(&striped)[0], ratios(&moved)[1]]
}

fn seamless(model: &Path) -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    let mut command = Command::new(env!("CARGO_BIN_EXE_affine-atlas"));
    command.arg("build").arg("-q").arg(model);
    command.arg("--out").arg(folder.path());
    for setting in ["images.domain=grid", "pictures.enabled=false"] {
        command.arg("--set").arg(setting);
    }
    let output = command.output()?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned().into());
    }
    let name = model.file_stem().unwrap_or_default();
    let params = TextureParams {
        pattern: "fixtures/patterns/waves.png".into(),
        tiles: 1,
        size: 2048,
    };
    let asset = texture(&folder.path().join(name), &params)?;
    print!("{asset}");
    let [component] = &asset.components[..] else {
        return Err("more than one component".into());
    };
    let found = ratios(&component.steps);
    let spread = component.tile_size.p95 / component.tile_size.p05;
    let seen = controls(&asset, params.size);
    println!("steps over those beside {found:?}, tiles {spread:.3}, controls {seen:?}");
    let is_even = (1.0..=EVEN).contains(&spread);
    let is_same = |r: &f64| (1.0 - SAME..=1.0 + SAME).contains(r);
    let is_seen = seen.iter().all(|r| *r > 1.3);
    match is_even && found.iter().all(is_same) && is_seen {
        true => Ok(()),
        false => Err(format!("{found:?}, tiles {spread}, controls {seen:?}").into()),
    }
}
