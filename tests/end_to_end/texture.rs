//! Textures of whole builds: read back from their files and from the arrays they were made from.

use crate::command::{Built, build, build_small, program};
use crate::fixtures::generate::pattern;
use crate::good::files;
use affine_atlas::job::texture::{TextureParams, TexturedAsset, texture as lay};
use affine_atlas::read::gridded::{GriddedSurface, read_gridded};
use std::collections::HashMap;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::Output;

const WAVES: &str = "fixtures/patterns/waves.png";

/// With a grid of so many cells.
fn gridded(name: &str, cells: usize) -> Built {
    let cells = format!("grid.cells={cells}");
    let settings = [cells.as_str(), "report.enabled=false"];
    build(&Path::new("fixtures/good").join(name), &settings)
}

fn run(folder: &Path, into: &Path, pattern: &Path, more: &[&str]) -> Output {
    let mut command = program();
    command.arg("texture").arg(folder).arg("--out").arg(into);
    command.arg("--pattern").arg(pattern);
    command.args(more).output().expect("the program starts")
}

fn laid(folder: &Path, tiles: u32, size: usize) -> TexturedAsset {
    let params = TextureParams {
        pattern: PathBuf::from(WAVES),
        tiles,
        size,
    };
    lay(folder, &params).expect("a texture")
}

/// Number of edges across which coordinates differ: by a quarter turn, the one that is stored, and a whole translation. Found from the coordinates alone.
/// The second number is that of edges where they do not.
fn crossed(surface: &GriddedSurface) -> [usize; 2] {
    let mut halfedges = HashMap::new();
    for (f, face) in surface.faces.iter().enumerate() {
        for k in 0..3 {
            halfedges.insert((face[k], face[(k + 1) % 3]), (f, k));
        }
    }
    let sub = |a: [f64; 2], b: [f64; 2]| [a[0] - b[0], a[1] - b[1]];
    let turned = |p: [f64; 2], turns: u8| match turns {
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
        let corners = &surface.grid_uv;
        let ours = [corners[f][k], corners[f][(k + 1) % 3]];
        let theirs = [corners[g][(m + 1) % 3], corners[g][m]];
        if ours == theirs {
            continue;
        }
        counts[0] += 1;
        let [p, q] = ours.map(|p| turned(p, surface.turns[f][(k + 2) % 3]));
        let by = sub(theirs[0], p);
        let is_whole = near(sub(theirs[1], q), by) && near(by, by.map(f64::round));
        counts[1] += usize::from(!is_whole);
    }
    counts
}

fn doubled_area([a, b, c]: [[f64; 2]; 3]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[test]
fn coordinates_differ_by_quarter_turns_and_whole_translations() {
    for (name, cells) in [
        ("genus-0-animal.ply", 500),
        ("genus-1-mug.off", 300),
        ("genus-3-pretzel.obj", 2000),
        ("three-boundaries-rabbit.ply", 500),
    ] {
        let surface = read_gridded(&gridded(name, cells).atlas()).expect("a surface");
        let [edges, bad] = crossed(&surface);
        assert!(edges > 10 && bad == 0, "{name}: {bad} of {edges}");
        assert!(surface.grid_uv.iter().all(|&uv| doubled_area(uv) > 0.0));
        // The same test sees another scale.
        let mut other = surface;
        for p in other.grid_uv.iter_mut().flatten() {
            *p = p.map(|x| 0.7 * x);
        }
        let [_, bad] = crossed(&other);
        assert!(bad > edges / 2, "{name}: {bad} of {edges}");
    }
}

/// A cube on six cells has one on each side, and each of these as many tiles as asked for.
#[test]
fn a_cube_shows_whole_tiles_on_every_side() {
    // The pattern is the formula that colours are compared with.
    assert_eq!(std::fs::read(WAVES).expect("committed"), pattern::png());
    let built = gridded("genus-0-cube.obj", 6);
    let asset = laid(&built.atlas(), 2, 512);
    let [component] = &asset.components[..] else {
        panic!("one component")
    };
    assert_eq!((component.cells, component.tiles(&asset.tiling)), (6, 24));
    let size = component.tile_size;
    assert!((size.p05 - 0.5).abs() < 1e-6 && (size.p95 - 0.5).abs() < 1e-6);
    let surface = &component.surface;
    let (mut texels, mut worst) = (0, [0.0_f64; 2]);
    // Moved by half a tile, colours are others.
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
                for (shift, worst) in [0.0, 0.25].into_iter().zip(&mut worst) {
                    let expected = pattern::colour(2.0 * (x + shift), 2.0 * y);
                    for i in 0..3 {
                        *worst = worst.max((255.0 * expected[i] - f64::from(found[i])).abs());
                    }
                }
                texels += 1;
            }
        }
    }
    assert!(texels > 50_000, "{texels}");
    assert!(worst[0] < 3.0 && worst[1] > 100.0, "{worst:?}");
}

#[test]
fn seams_of_a_symmetric_pattern_do_not_show() {
    let built = gridded("genus-0-animal.ply", 300);
    for tiles in [1, 2] {
        let asset = laid(&built.atlas(), tiles, 1024);
        let steps = asset.components[0].steps;
        let [cut, beside_cut, seams, beside_seams] =
            [steps.cut, steps.beside_cut, steps.seams, steps.beside_seams]
                .map(|s| s.expect("measured"));
        assert!((cut / beside_cut - 1.0).abs() < 0.03, "{steps:?}");
        assert!((seams / beside_seams - 1.0).abs() < 0.03, "{steps:?}");
    }
}

#[test]
fn the_folder_holds_a_surface_with_its_texture_whatever_the_threads() {
    let built = gridded("genus-0-cube.obj", 24);
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
    let surface = read_gridded(&atlas).expect("a surface");
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
fn patterns_that_will_show_are_told() {
    let built = gridded("genus-0-animal.ply", 300);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let json = |pattern: &Path| -> serde_json::Value {
        let into = folder.path().join("out");
        let more = ["--size", "256", "--json", "--tiles", "2"];
        let output = run(&built.atlas(), &into, pattern, &more);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{said}");
        serde_json::from_slice(&output.stdout).expect("JSON")
    };
    let warnings = |json: &serde_json::Value| -> Vec<String> {
        let list = json["components"][0]["warnings"].as_array();
        let text = |w: &serde_json::Value| w.as_str().expect("text").to_owned();
        list.expect("a list").iter().map(text).collect()
    };
    let sloped = |name: &str, width: u32| {
        let path = folder.path().join(name);
        let colour = |x, y| image::Rgb([8 * x as u8, 4 * y as u8, 9]);
        image::RgbImage::from_fn(width, 31, colour)
            .save(&path)
            .expect("written");
        path
    };
    let waves = json(Path::new(WAVES));
    assert_eq!(waves["pattern"]["repeats"], true);
    assert_eq!(waves["pattern"]["quarter_turn"]["symmetric"], true);
    assert_eq!(
        waves["pattern"]["copies_per_tile"],
        serde_json::json!([1, 1])
    );
    assert_eq!(waves["tiles_per_cell"], 2);
    assert!(warnings(&waves).is_empty(), "{waves}");
    let component = &waves["components"][0];
    assert_eq!(
        component["tiles"].as_u64(),
        component["cells"].as_u64().map(|n| 4 * n)
    );
    let size = |name: &str| component["tile_size"][name].as_f64().expect("a number");
    assert!(
        0.0 < size("p05") && size("p05") < size("p95"),
        "{component}"
    );

    let slope = json(&sloped("slope.png", 31));
    assert_eq!(slope["pattern"]["repeats"], false);
    assert_eq!(slope["pattern"]["half_turn"]["symmetric"], false);
    let told = warnings(&slope);
    assert_eq!(told.len(), 2, "{told:?}");
    assert_eq!(
        told[0],
        "slope.png does not repeat: its first and last columns differ by 60.0 of 255 and its first and last rows by 30.0, neighbouring ones by at most 2.0 and 1.0"
    );
    assert!(
        told[1]
            .starts_with("some transitions are quarter turns, under which slope.png changes by ")
    );

    // Two to one is one beside two, 32 to 31 is stretched.
    let double = json(&sloped("double.png", 62));
    assert_eq!(
        double["pattern"]["copies_per_tile"],
        serde_json::json!([1, 2])
    );
    assert_eq!(double["pattern"]["stretched"], false);
    let wide = json(&sloped("wide.png", 32));
    assert_eq!(wide["pattern"]["stretched"], true);
    let told = warnings(&wide);
    assert!(
        told.iter().any(|w| w
            == "wide.png has 32 × 31 pixels, which is no ratio of whole numbers up to 8: it is stretched to the square of a tile"),
        "{told:?}"
    );
}

#[test]
fn folders_without_a_grid_or_with_a_damaged_one_are_refused() {
    let into = tempfile::tempdir().expect("a temporary folder");
    let refused = |atlas: &Path| {
        let output = run(atlas, &into.path().join("out"), Path::new(WAVES), &[]);
        assert_eq!(output.status.code(), Some(1));
        assert!(!into.path().join("out").exists());
        String::from_utf8(output.stderr).expect("UTF-8")
    };
    let flat = build_small(Path::new("fixtures/good/genus-0-cube.obj"), &[]);
    let said = refused(&flat.atlas());
    assert!(
        said.contains("has no grid: build with images.domain = \"grid\""),
        "{said}"
    );

    let built = gridded("genus-0-cube.obj", 24);
    let path = built.atlas().join("atlas.npz");
    let whole = std::fs::read(&path).expect("atlas.npz");
    // The first bytes of the first row follow a header of which the length stands in two bytes.
    let first = |bytes: &[u8]| 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let swap = |bytes: &mut Vec<u8>| {
        let at = first(bytes);
        let (a, b) = bytes[at..at + 32].split_at_mut(16);
        a.swap_with_slice(b);
    };
    for (name, damage, words) in [
        (
            "grid_uv",
            &swap as &dyn Fn(&mut Vec<u8>),
            "row 0 of grid_uv is a face that is turned over or has no area",
        ),
        (
            "patch_uv",
            &swap,
            "row 0 of patch_uv is no quarter turn and translation of that of grid_uv",
        ),
        (
            "grid_turns",
            &|bytes: &mut Vec<u8>| {
                let at = first(bytes);
                bytes[at] = 4;
            },
            "row 0 of grid_turns holds 4, ",
        ),
    ] {
        std::fs::write(&path, with_damaged(&whole, name, damage)).expect("written");
        let said = refused(&built.atlas());
        assert!(said.contains(words), "{name}: {said}");
    }
    std::fs::write(&path, with_damaged(&whole, "", &|_| {})).expect("written");
    read_gridded(&built.atlas()).expect("whole again");
}

/// A container in which one array is another.
fn with_damaged(container: &[u8], name: &str, damage: &dyn Fn(&mut Vec<u8>)) -> Vec<u8> {
    let mut from = zip::ZipArchive::new(std::io::Cursor::new(container)).expect("a zip file");
    let mut to = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for i in 0..from.len() {
        let mut entry = from.by_index(i).expect("an entry");
        let entry_name = entry.name().expect("a name").into_owned();
        let mut bytes = Vec::new();
        entry.read_to_end(&mut bytes).expect("readable");
        if entry_name == format!("{name}.npy") {
            damage(&mut bytes);
        }
        let options = zip::write::SimpleFileOptions::default();
        to.start_file(entry_name, options).expect("an entry");
        to.write_all(&bytes).expect("written");
    }
    to.finish().expect("written").into_inner()
}
