//! The units of a mesh, and where it stands, change nothing but lengths.

use affine_atlas::config::Config;
use affine_atlas::geometry::mesh::Soup;
use affine_atlas::job::{self, BuildError};
use affine_atlas::product::AffineAtlas;
use affine_atlas::read;
use affine_atlas::verify::{VerifyOptions, verify};
use std::path::{Path, PathBuf};

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("fixtures/good")
        .join(name)
}

fn soup(name: &str) -> Soup {
    read::read(&fixture(name), &Default::default())
        .unwrap()
        .soup
}

fn config() -> Config {
    let mut config = Config::default();
    config.patches.texel_budget = 4096;
    config
}

fn built(soup: &Soup) -> AffineAtlas {
    let mut atlases = job::build(soup, &config(), &()).unwrap();
    atlases.remove(0).unwrap()
}

fn times(soup: &Soup, factor: f64) -> Soup {
    let mut scaled = soup.clone();
    scaled
        .positions
        .iter_mut()
        .flatten()
        .for_each(|x| *x *= factor);
    scaled
}

/// Every number of `b` is `factor` times that of `a`, to the last bit.
fn scaled(
    what: &str,
    a: impl IntoIterator<Item = f64>,
    b: impl IntoIterator<Item = f64>,
    factor: f64,
) {
    let (a, b): (Vec<f64>, Vec<f64>) = (a.into_iter().collect(), b.into_iter().collect());
    assert_eq!(a.len(), b.len(), "{what}");
    for (i, (a, b)) in a.iter().zip(&b).enumerate() {
        let want = a * factor;
        assert!(
            want == *b || (want.is_nan() && b.is_nan()),
            "{what} {i}: {want:e} is {b:e}"
        );
    }
}

fn assert_scaled(a: &AffineAtlas, b: &AffineAtlas, factor: f64) {
    assert_eq!(
        a.mesh.connectivity.to_faces(),
        b.mesh.connectivity.to_faces()
    );
    assert_eq!(a.prescription.cones, b.prescription.cones);
    assert_eq!(a.cut.is_cut.as_slice(), b.cut.is_cut.as_slice());
    assert_eq!(
        a.patches.face_patch.as_slice(),
        b.patches.face_patch.as_slice()
    );
    scaled(
        "log scale",
        a.metric.log_scale.iter().copied(),
        b.metric.log_scale.iter().copied(),
        1.0,
    );
    let flat = |v: &AffineAtlas| {
        v.mesh
            .positions
            .iter()
            .flatten()
            .copied()
            .collect::<Vec<_>>()
    };
    scaled("positions", flat(a), flat(b), factor);
    scaled(
        "flat lengths",
        a.metric.length.iter().copied(),
        b.metric.length.iter().copied(),
        factor,
    );
    let uv = |v: &AffineAtlas| {
        v.central
            .uv
            .iter()
            .flatten()
            .flatten()
            .copied()
            .collect::<Vec<_>>()
    };
    scaled("central chart", uv(a), uv(b), factor);
    let uv = |v: &AffineAtlas| {
        v.patches
            .uv
            .iter()
            .flatten()
            .flatten()
            .copied()
            .collect::<Vec<_>>()
    };
    scaled("patches", uv(a), uv(b), factor);
    let charts = |v: &AffineAtlas| {
        let faces = v.charts.charts.iter().flat_map(|c| &c.faces);
        faces.flat_map(|f| f.uv).flatten().collect::<Vec<_>>()
    };
    scaled("charts", charts(a), charts(b), factor);
    assert_eq!(a.charts.transitions.len(), b.charts.transitions.len());
    for (s, t) in a.charts.transitions.iter().zip(&b.charts.transitions) {
        assert_eq!(
            (s.from, s.to, s.sector, s.motion.rotation),
            (t.from, t.to, t.sector, t.motion.rotation)
        );
        scaled(
            "translation",
            s.motion.translation,
            t.motion.translation,
            factor,
        );
    }
    assert_eq!(a.images.len(), b.images.len());
    for (s, t) in a.images.iter().zip(&b.images) {
        assert_eq!(
            (&s.alpha, &s.face, &s.normal, &s.log_scale),
            (&t.alpha, &t.face, &t.normal, &t.log_scale)
        );
        let texels = |p: &[[f32; 3]]| {
            p.iter()
                .flatten()
                .map(|x| f64::from(*x))
                .collect::<Vec<_>>()
        };
        // A coordinate of float32 may vanish beside others.
        for (i, (x, y)) in texels(&s.position)
            .iter()
            .zip(texels(&t.position))
            .enumerate()
        {
            assert!(
                (x * factor - y).abs() <= f64::from(f32::from_bits(1)),
                "texel {i}: {x:e} and {y:e}"
            );
        }
    }
    let seams = |v: &AffineAtlas| {
        let samples = v.patches.seams.iter().flat_map(|s| &s.samples);
        samples
            .flat_map(|s| s.left.into_iter().chain(s.right).chain(s.position))
            .collect::<Vec<_>>()
    };
    scaled("seams", seams(a), seams(b), factor);
    scaled(
        "length of the cut",
        [a.quality.cut_length],
        [b.quality.cut_length],
        factor,
    );
    scaled(
        "area distortion",
        [a.quality.area_distortion],
        [b.quality.area_distortion],
        1.0,
    );
}

fn every_power_of_two(name: &str) {
    let soup = soup(name);
    let one = built(&soup);
    for k in (-100..=100).step_by(20) {
        let factor = 2.0_f64.powi(k);
        assert_scaled(&one, &built(&times(&soup, factor)), factor);
    }
}

#[test]
fn a_closed_surface_in_any_units() {
    every_power_of_two("genus-0-animal.ply");
}

#[test]
fn a_surface_with_a_handle_in_any_units() {
    every_power_of_two("genus-1-mug.off");
}

#[test]
fn a_disk_in_any_units() {
    every_power_of_two("disk-mask.obj");
}

#[test]
fn a_surface_with_three_boundaries_in_any_units() {
    every_power_of_two("three-boundaries-rabbit.ply");
}

#[test]
fn the_smallest_and_the_largest_are_written_and_verified() {
    let soup = soup("genus-0-cube.obj");
    let folder = tempfile::tempdir().unwrap();
    for (name, factor) in [("small", 2.0_f64.powi(-100)), ("large", 2.0_f64.powi(100))] {
        let path = folder.path().join(name).with_extension("obj");
        let mut text = String::new();
        for [x, y, z] in times(&soup, factor).positions {
            text.push_str(&format!("v {x:e} {y:e} {z:e}\n"));
        }
        for [a, b, c] in &soup.faces {
            text.push_str(&format!("f {} {} {}\n", a + 1, b + 1, c + 1));
        }
        std::fs::write(&path, text).unwrap();
        let out = folder.path().join("out");
        let outcome = job::run(&path, name, &out, name, &config(), &());
        assert_eq!(
            outcome.state_name(),
            "built",
            "{:?}",
            outcome.failures().next()
        );
        let verdicts = verify(&out.join(name), &VerifyOptions::default()).unwrap();
        assert!(verdicts.all_passed(), "{verdicts}");
    }
}

#[test]
fn what_float32_cannot_hold_is_refused_with_the_range() {
    let soup = soup("genus-0-cube.obj");
    for k in [-1000, -120, 130, 1000] {
        let error = job::build(&times(&soup, 2.0_f64.powi(k)), &config(), &()).unwrap_err();
        assert!(matches!(error, BuildError::Repair(_)), "2^{k}: {error}");
        let said = error.to_string();
        assert!(said.contains("7.7e-34 to 1.3e36"), "2^{k}: {said}");
    }
}

#[test]
fn a_mesh_so_far_away_that_its_edges_have_no_digits_is_refused() {
    let mut soup = soup("genus-0-cube.obj");
    for p in &mut soup.positions {
        p[0] += 1e12;
    }
    let error = job::build(&soup, &config(), &()).unwrap_err().to_string();
    assert!(error.contains("from the origin"), "{error}");
}

#[test]
fn a_vertex_beyond_all_digits_is_named() {
    let mut soup = soup("genus-0-cube.obj");
    soup.positions[3] = [1e25, 3e24, -2e24];
    let error = job::build(&soup, &config(), &()).unwrap_err().to_string();
    assert!(error.starts_with("vertex 3 lies"), "{error}");
}
