//! Textures of whole builds: read back from their files and from the arrays they were made from.

use crate::command::{Built, build, program};
use crate::good::files;
use affine_atlas::geometry::connectivity::Connectivity;
use affine_atlas::job::texture::{TextureParams, TexturedAsset, TileSize, texture as lay};
use affine_atlas::read::flat::{FlatSurface, read_flat};
use affine_atlas::texture::{Field, Tile, as_it_is, fit, flat_area};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::Output;

#[path = "../../fixtures/generate/pattern.rs"]
mod pattern;

const WAVES: &str = "fixtures/patterns/waves.png";
/// Eight cones, all multiples of π/2.
const QUARTERS: [&str; 2] = ["cones.count=8", "cones.quantum=1/2"];

fn fixture(name: &str, settings: &[&str]) -> Built {
    build(&Path::new("fixtures/good").join(name), settings)
}

fn run(folder: &Path, into: &Path, pattern: &Path, more: &[&str]) -> Output {
    let mut command = program();
    command.arg("texture").arg(folder).arg("--out").arg(into);
    command.arg("--pattern").arg(pattern);
    command.args(more).output().expect("the program starts")
}

fn laid(folder: &Path, tile: TileSize, size: usize) -> TexturedAsset {
    let params = TextureParams {
        pattern: PathBuf::from(WAVES),
        tile,
        size,
    };
    lay(folder, &params).expect("a texture")
}

/// Number of cut edges; across every edge coordinates must be the same, or across the cut a quarter turn and a whole translation.
/// Found from the coordinates alone. The second number is that of cut edges where they are not.
fn crossed(surface: &FlatSurface, field: &Field) -> [usize; 2] {
    let mut halfedges = HashMap::new();
    for (f, face) in surface.faces.iter().enumerate() {
        for k in 0..3 {
            halfedges.insert((face[k], face[(k + 1) % 3]), (f, k));
        }
    }
    let sub = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
    let turned = |p: [f64; 2], turns: usize| match turns {
        0 => p,
        1 => [-p[1], p[0]],
        2 => [-p[0], -p[1]],
        _ => [p[1], -p[0]],
    };
    let near = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]) < 1e-9;
    let mut counts = [0, 0];
    for (&(a, b), &(f, k)) in &halfedges {
        let Some(&(g, m)) = halfedges.get(&(b, a)) else {
            continue;
        };
        let ours = [field.corners[f][k], field.corners[f][(k + 1) % 3]];
        let theirs = [field.corners[g][(m + 1) % 3], field.corners[g][m]];
        if surface.segment[f][(k + 2) % 3] == u32::MAX {
            assert!(
                near(ours[0], theirs[0]) && near(ours[1], theirs[1]),
                "{a} {b}"
            );
            continue;
        }
        counts[0] += 1;
        let is_whole = (0..4).any(|turns| {
            let [p, q] = ours.map(|p| turned(p, turns));
            let by = sub(theirs[0], p);
            near(sub(theirs[1], q), by) && near(by, by.map(f64::round))
        });
        counts[1] += usize::from(!is_whole);
    }
    counts
}

fn doubled_area([a, b, c]: [[f64; 2]; 3]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[test]
fn coordinates_differ_by_quarter_turns_and_whole_translations_across_the_cut() {
    for (name, settings) in [
        ("genus-0-animal.ply", &QUARTERS[..]),
        ("genus-1-mug.off", &["cones.strategy=none"]),
        ("genus-0-cube.obj", &QUARTERS),
    ] {
        let built = fixture(name, settings);
        let surface = read_flat(&built.atlas()).expect("a surface");
        let count = surface.positions.len();
        let connectivity = Connectivity::from_faces(&surface.faces, count).expect("a surface");
        for repeat in [6.0, 20.5] {
            let tile = Tile {
                width: flat_area(&surface).sqrt() / repeat,
                aspect: 1.0,
            };
            let field = fit(&surface, &connectivity, tile)
                .expect("fits")
                .expect("quarter turns");
            let fitted = field.fitted.as_ref().expect("fitted");
            let [edges, bad] = crossed(&surface, &field);
            assert!(edges > 10 && bad == 0, "{name}: {bad} of {edges}");
            assert!(fitted.largest_misfit < 1e-9);
            let flipped = (field.corners.iter().zip(&surface.central_uv))
                .filter(|(f, z)| doubled_area(**f) <= 0.0 && doubled_area(**z) > 0.0);
            assert_eq!(fitted.flipped, flipped.count(), "{name}");
            assert!(fitted.stretch < 0.15, "{name}: {}", fitted.stretch);
            // The same test sees that flat coordinates themselves do not fit.
            let [_, bad] = crossed(&surface, &as_it_is(&surface, tile));
            assert!(bad > edges / 2, "{name}: {bad} of {edges}");
        }
    }
}

/// With tiles as large as its sides, a cube has one tile on each: cones are centres of rotation, corners or middles of tiles.
#[test]
fn a_cube_shows_one_tile_a_side() {
    // The pattern is the formula that colours are compared with.
    assert_eq!(std::fs::read(WAVES).expect("committed"), pattern::png());
    let built = fixture("genus-0-cube.obj", &QUARTERS);
    let asset = laid(&built.atlas(), TileSize::Width(1.0), 512);
    let [component] = &asset.components[..] else {
        panic!("one component")
    };
    assert!((component.tile_width() - 1.0).abs() < 1e-6);
    assert!((component.tiles() - 6.0).abs() < 1e-4);
    let surface = &component.surface;
    let (mut texels, mut worst) = (0, [0.0_f64; 2]);
    for (f, face) in surface.faces.iter().enumerate() {
        let packed = surface.packed(f);
        let corners = packed.map(|[u, v]| [512.0 * u, 512.0 * (1.0 - v)]);
        let area = doubled_area(corners);
        let range = |i: usize| {
            let values = corners.map(|p| p[i]);
            let low = values.into_iter().fold(f64::INFINITY, f64::min);
            low as usize..values.into_iter().fold(0.0, f64::max) as usize + 1
        };
        for row in range(1) {
            for column in range(0) {
                let p = [column as f64 + 0.5, row as f64 + 0.5];
                let weights = [0, 1, 2].map(|k| {
                    let [a, b] = [corners[(k + 1) % 3], corners[(k + 2) % 3]];
                    doubled_area([p, a, b]) / area
                });
                if weights.iter().any(|&w| w < 1e-6) {
                    continue;
                }
                let place: [f64; 3] = std::array::from_fn(|i| {
                    (0..3)
                        .map(|k| weights[k] * surface.positions[face[k] as usize][i])
                        .sum()
                });
                // The side that the point lies on, and where on it.
                let is_end = |x: f64| !(1e-4..=1.0 - 1e-4).contains(&x);
                let Some(axis) = (0..3).find(|&i| is_end(place[i])) else {
                    panic!("{place:?} is not on the cube")
                };
                let [x, y] = [place[(axis + 1) % 3], place[(axis + 2) % 3]];
                let found = component.painted.texels[512 * row + column];
                assert_eq!(found[3], 255);
                for (shift, worst) in [0.0, 0.5].into_iter().zip(&mut worst) {
                    let expected = pattern::colour(x + shift, y + shift);
                    for i in 0..3 {
                        *worst = worst.max((255.0 * expected[i] - f64::from(found[i])).abs());
                    }
                }
                texels += 1;
            }
        }
    }
    assert!(texels > 50_000, "{texels}");
    assert!(worst[0].min(worst[1]) < 3.0, "{worst:?}");
    assert!(worst[0].max(worst[1]) > 100.0, "{worst:?}");
}

#[test]
fn seams_of_a_symmetric_pattern_do_not_show() {
    let built = fixture("genus-0-animal.ply", &QUARTERS);
    let asset = laid(&built.atlas(), TileSize::Repeat(12.0), 1024);
    let steps = asset.components[0].steps;
    let [cut, beside, seams, inside] =
        [steps.cut, steps.beside_cut, steps.seams, steps.inside].map(|s| s.expect("measured"));
    assert!((cut / beside - 1.0).abs() < 0.1, "{steps:?}");
    assert!((seams / inside - 1.0).abs() < 0.1, "{steps:?}");
}

#[test]
fn the_folder_holds_a_surface_with_its_texture_whatever_the_threads() {
    let built = fixture("genus-0-cube.obj", &QUARTERS);
    let atlas = built.atlas();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let run = |name: &str, more: &[&str]| {
        let into = folder.path().join(name);
        let output = run(&atlas, &into, Path::new(WAVES), more);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{said}");
        files(&into)
    };
    let one = run("one", &["--threads", "1", "--size", "200"]);
    // Replaces its own folder.
    run("two", &["--size", "16"]);
    let two = run("two", &["--threads", "2", "--size", "200", "--json"]);
    assert!(one == two, "bytes depend on the threads");
    let names: Vec<&str> = one.keys().map(String::as_str).collect();
    let png = "genus-0-cube.png";
    assert_eq!(
        names,
        [
            "genus-0-cube.glb",
            png,
            "genus-0-cube.preview.png",
            "texture.json"
        ]
    );
    let gltf = gltf::Gltf::from_slice(&one["genus-0-cube.glb"]).expect("a GLB");
    let blob = gltf.blob.as_deref().expect("a binary chunk");
    let mesh = gltf.meshes().next().expect("a mesh");
    let primitive = mesh.primitives().next().expect("a primitive");
    let reader = primitive.reader(|_| Some(blob));
    let indices: Vec<u32> = reader.read_indices().expect("indices").into_u32().collect();
    let coordinates = reader.read_tex_coords(0).expect("coordinates");
    let coordinates: Vec<[f32; 2]> = coordinates.into_f32().collect();
    let surface = read_flat(&atlas).expect("a surface");
    assert_eq!(indices.len(), 3 * surface.faces.len());
    for (f, corners) in indices.as_chunks::<3>().0.iter().enumerate() {
        for (&index, [u, v]) in corners.iter().zip(surface.packed(f)) {
            let [s, t] = coordinates[index as usize].map(f64::from);
            assert!((s - u).abs() < 1e-5 && (1.0 - t - v).abs() < 1e-5);
        }
    }
    let base = primitive.material().pbr_metallic_roughness();
    let texture = base.base_color_texture().expect("a texture");
    assert_eq!(texture.tex_coord(), 0);
    let gltf::image::Source::View { view, mime_type } = texture.texture().source().source() else {
        panic!("the image lies in the file")
    };
    assert_eq!(mime_type, "image/png");
    let bytes = &blob[view.offset()..view.offset() + view.length()];
    assert!(bytes == &one[png][..], "another image");
    let image = image::load_from_memory(bytes).expect("an image");
    assert_eq!((image.width(), image.height()), (200, 200));
}

#[test]
fn other_turns_and_patterns_that_do_not_repeat_are_told() {
    let built = fixture("three-boundaries-rabbit.ply", &[]);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let slope = folder.path().join("slope.png");
    let image = image::RgbImage::from_fn(32, 32, |x, y| image::Rgb([8 * x as u8, 4 * y as u8, 9]));
    image.save(&slope).expect("written");
    let json = |pattern: &Path| -> serde_json::Value {
        let into = folder.path().join("out");
        let output = run(&built.atlas(), &into, pattern, &["--size", "256", "--json"]);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{said}");
        serde_json::from_slice(&output.stdout).expect("JSON")
    };
    let waves = json(Path::new(WAVES));
    assert_eq!(waves["pattern"]["repeats"], true);
    assert_eq!(waves["pattern"]["quarter_turn"]["symmetric"], true);
    let component = &waves["components"][0];
    assert!(component["fitted"].is_null());
    let warnings = component["warnings"].as_array().expect("a list");
    assert_eq!(warnings.len(), 1);
    assert!(
        warnings[0]
            .as_str()
            .expect("text")
            .contains("are no quarter turns"),
        "{warnings:?}"
    );
    let step = |name: &str| component["colour_step"][name].as_f64().expect("measured");
    assert!(step("cut") > 1.5 * step("beside_cut"), "{component}");

    let slope = json(&slope);
    assert_eq!(slope["pattern"]["repeats"], false);
    assert_eq!(slope["pattern"]["half_turn"]["symmetric"], false);
    let warnings = slope["components"][0]["warnings"]
        .as_array()
        .expect("a list");
    let first = warnings[0].as_str().expect("text");
    assert_eq!(
        first,
        "slope.png does not repeat: its first and last columns differ by 62.0 of 255 and its first and last rows by 31.0, neighbouring ones by at most 2.0 and 1.0"
    );
}
