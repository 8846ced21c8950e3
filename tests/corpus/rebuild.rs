//! Meshes rebuilt from the geometry images of real models: watertight at every resolution, and nearer the surface at the
//! rate that exact sampling gives. (Whether those of default builds are watertight is asked in `models`, which has them.)
//!
//! `AFFINE_ATLAS_CORPUS` names a folder with the models; without it every case is reported as ignored. `AFFINE_ATLAS_CHECKER` names an
//! independent checker, which is asked about grids. Large models are for `--ignored`.

use crate::real_models::watertight::watertight;
use crate::real_models::{CLEAN, LARGE, checked, comparable};
use affine_atlas::atlas::patches::{Domain, PatchParams, layout};
use affine_atlas::atlas::{geometry_image, patches::PatchLayout};
use affine_atlas::config::Config;
use affine_atlas::geometry::deviation::{Sampling, Triangles, deviation};
use affine_atlas::geometry::mesh::{Soup, bounding_box, distance, triangle_area};
use affine_atlas::outcome::AssetState;
use affine_atlas::product::AffineAtlas;
use affine_atlas::read::{ReadParams, read};
use affine_atlas::rebuild::{Images, rebuild};
use affine_atlas::{build, job};
use libtest_mimic::{Failed, Trial};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

/// Side of the square of as many texels as grids have.
const CHECKED: usize = 256;

/// What images are sampled over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Texels {
    /// Patches of the flat metric, each with texels of its own.
    Flat,
    /// Blocks of a grid.
    Grid,
}

/// Models whose faces are far smaller than the largest texels and far larger than the smallest.
const PIECEWISE_LINEAR: [&str; 5] = [
    "spot.obj",
    "bunny-closed.off",
    "rocker-arm.obj",
    "three-holes.off",
    "kitten.obj",
];

const SAMPLING: Sampling = Sampling {
    samples: 200_000,
    vertices: 0,
};

pub fn trials() -> Vec<Trial> {
    let corpus = std::env::var_os("AFFINE_ATLAS_CORPUS").map(PathBuf::from);
    let is_ignored = corpus.is_none();
    let folder = corpus.unwrap_or_default();
    let is_long = |file: &str| is_ignored || LARGE.contains(&file);
    // The longest comes first, so that no core waits for it in the end.
    let mut trials = vec![
        Trial::test("rebuild/order/smooth/720", || smooth(720, &[64, 128, 256]))
            .with_ignored_flag(true),
        Trial::test("rebuild/order/smooth/360", || smooth(360, &[32, 64, 128]))
            .with_ignored_flag(is_ignored),
    ];
    for (file, genus, loops) in CLEAN {
        // At 512², the default, the atlases of `models` are asked.
        let flat = [256, 64].map(|side| (Texels::Flat, side));
        for (texels, side) in flat.into_iter().chain([(Texels::Grid, CHECKED)]) {
            let model = folder.join(file);
            let run = move || built(&model, texels, side, genus, loops);
            let name = format!("rebuild/watertight/{texels:?}/{side}/{file}");
            trials.push(Trial::test(name, run).with_ignored_flag(is_long(file)));
        }
    }
    for file in PIECEWISE_LINEAR {
        let model = folder.join(file);
        let trial = Trial::test(format!("rebuild/order/{file}"), move || {
            let soup = read(&model, &ReadParams::default())?.soup;
            order(file, &soup, &[64, 128, 256, 512], 1.4)
        });
        trials.push(trial.with_ignored_flag(is_long(file)));
    }
    trials
}

/// The mesh rebuilt from the images of one build.
fn built(
    model: &Path,
    texels: Texels,
    side: usize,
    genus: usize,
    loops: usize,
) -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    let mut config = Config::default();
    match texels {
        Texels::Flat => {
            config.images.domain = Some(Domain::Flat);
            config.patches.texel_budget = side * side;
        }
        Texels::Grid => {
            let of_cell = config.grid.samples_per_cell.pow(2);
            config.grid.cells = side * side / of_cell;
        }
    }
    config.pictures.enabled = false;
    config.report.enabled = false;
    let outcome = job::run(model, "model", folder.path(), "asset", &config, &());
    if outcome.state != AssetState::Built {
        return Err(format!("{:?}", outcome.state).into());
    }
    let atlas = folder.path().join("asset");
    // That of flat images is asked about in `corpus`.
    if texels == Texels::Grid {
        checked(&atlas, comparable(model), None)?;
    }
    Ok(watertight(&atlas, genus, loops, true)?)
}

/// Mean texel spacing on the surface and RMS error, for one budget.
fn measure(atlas: &AffineAtlas, soup: &Soup, side: usize) -> Result<[f64; 3], Failed> {
    let params = PatchParams {
        texel_budget: side * side,
        min_side: 8,
        ..PatchParams::default()
    };
    let patches: PatchLayout = layout(
        &atlas.mesh,
        &atlas.metric.length,
        &atlas.cut,
        &atlas.central,
        None,
        &params,
    )?;
    let scale = &atlas.metric.log_scale;
    let images = geometry_image::sample(&atlas.mesh, &patches, scale, atlas.image_origin);
    let mesh = rebuild(&Images::new(&patches, &images, atlas.image_origin))?;
    let given = Triangles {
        positions: &soup.positions,
        faces: &soup.faces,
    };
    let made = Triangles {
        positions: &mesh.positions,
        faces: &mesh.faces,
    };
    let found = deviation(given, made, SAMPLING).ok_or("no area")?;
    let area: f64 = soup
        .faces
        .iter()
        .map(|f| triangle_area(f.map(|v| soup.positions[v as usize])))
        .sum();
    let covered: f32 = images.iter().flat_map(|i| &i.alpha).sum();
    let (low, high) = bounding_box(&soup.positions);
    let psnr = found.psnr(distance(low, high)).unwrap_or(f64::INFINITY);
    Ok([(area / f64::from(covered)).sqrt(), found.rms, psnr])
}

/// Least squares of ln RMS over ln spacing.
fn slope(rows: &[[f64; 3]]) -> f64 {
    let points = rows.iter().map(|r| [r[0].ln(), r[1].ln()]);
    let n = rows.len() as f64;
    let sum = |f: &dyn Fn([f64; 2]) -> f64| points.clone().map(f).sum::<f64>();
    let (x, y) = (sum(&|p| p[0]) / n, sum(&|p| p[1]) / n);
    sum(&|p| (p[0] - x) * (p[1] - y)) / sum(&|p| (p[0] - x) * (p[0] - x))
}

fn order(name: &str, soup: &Soup, sides: &[usize], least: f64) -> Result<(), Failed> {
    let config = Config::default().on_flat_patches();
    let mut atlases = build(soup, &config, &())?;
    let atlas = atlases.remove(0)?;
    let rows = sides
        .iter()
        .map(|&side| measure(&atlas, soup, side))
        .collect::<Result<Vec<_>, _>>()?;
    let found = slope(&rows);
    let mut text = format!("{name}: order {found:.2}");
    for (side, [spacing, rms, psnr]) in sides.iter().zip(&rows) {
        text += &format!("\n  {side}²: spacing {spacing:.3e}, RMS {rms:.3e}, PSNR {psnr:.2} dB");
    }
    println!("{text}");
    match found >= least {
        true => Ok(()),
        false => Err(text.into()),
    }
}

/// A torus with bumps of n² vertices, many to a texel: smooth as far as texels can tell.
fn smooth(n: u32, sides: &[usize]) -> Result<(), Failed> {
    let mut positions = Vec::new();
    let mut faces = Vec::new();
    for i in 0..n {
        for j in 0..n {
            let (s, t) = (
                TAU * f64::from(i) / f64::from(n),
                TAU * f64::from(j) / f64::from(n),
            );
            let tube = 0.4 + 0.06 * (3.0 * s).sin() * (2.0 * t).cos();
            let radius = 1.0 + tube * t.cos();
            positions.push([
                radius * s.cos(),
                radius * s.sin(),
                tube * t.sin() + 0.1 * (2.0 * s).cos(),
            ]);
            let at = |i: u32, j: u32| (i % n) * n + j % n;
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    let edges = faces.iter().flat_map(|f| {
        (0..3).map(|k| distance(positions[f[k] as usize], positions[f[(k + 1) % 3] as usize]))
    });
    let mean_edge = edges.sum::<f64>() / (3 * faces.len()) as f64;
    println!(
        "smooth: {} vertices, mean edge {mean_edge:.3e}",
        positions.len()
    );
    let soup = Soup::from_triangles(positions, faces);
    order("smooth", &soup, sides, 1.8)
}
