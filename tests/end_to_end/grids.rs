//! Grids: full images whose sides hold the same points, on every good fixture; checked from the files alone.

use crate::command::{build, build_into, document, verify};
use crate::good::files;
use crate::real_models::arrays::array;
use affine_atlas::read::atlas::{StoredImage, read_images};
use serde_json::Value;
use std::path::Path;

fn number(value: &Value) -> usize {
    value.as_u64().expect("a count") as usize
}

/// The texels of side s, counterclockwise; row 0 is the lowest.
fn texels(image: &StoredImage, s: usize) -> Vec<[f32; 3]> {
    let [right, top] = [image.width - 1, image.height - 1];
    let places: Vec<[usize; 2]> = match s {
        0 => (0..=right).map(|x| [x, 0]).collect(),
        1 => (0..=top).map(|y| [right, y]).collect(),
        2 => (0..=right).rev().map(|x| [x, top]).collect(),
        _ => (0..=top).rev().map(|y| [0, y]).collect(),
    };
    let at = |&[x, y]: &[usize; 2]| image.position[image.width * y + x];
    places.iter().map(at).collect()
}

/// Pieces cover every side in order, and hold to the last bit what the other image holds there. How many texels were compared.
fn assert_same_points(patches: &[Value], images: &[StoredImage]) -> usize {
    let mut compared = 0;
    for (p, patch) in patches.iter().enumerate() {
        assert_eq!(patch["domain"], "grid");
        assert!(patch["patch_to_chart"].is_null());
        let samples = number(&patch["samples_per_cell"]);
        let cells = [0, 1].map(|i| number(&patch["cells"][i]));
        for (i, size) in ["width", "height"].into_iter().enumerate() {
            assert_eq!(number(&patch[size]), cells[i] * samples + 1);
        }
        for s in 0..4 {
            let own = texels(&images[p], s);
            let mut end = 0;
            for piece in patch["sides"][s].as_array().expect("pieces") {
                let [start, length] = ["start", "length"].map(|key| number(&piece[key]));
                assert_eq!(start, end);
                end = start + length;
                if piece["patch"].is_null() {
                    continue;
                }
                let [other, side, from] =
                    ["patch", "side", "other_start"].map(|key| number(&piece[key]));
                let other = texels(&images[other], side);
                let own = own[start * samples..=end * samples].iter();
                let across = other[from * samples..=(from + length) * samples]
                    .iter()
                    .rev();
                assert!(own.clone().eq(across), "side {s} of patch {p}");
                compared += own.len();
            }
            assert_eq!(end, cells[s % 2], "side {s} of patch {p}");
        }
    }
    compared
}

/// Every image holds the points of the quad mesh at the corners of its cells.
fn assert_corners(atlas: &Path, patches: &[Value], images: &[StoredImage], origin: [f64; 3]) {
    let positions: Vec<f64> = array(atlas, "quad_positions");
    let quads: Vec<u32> = array(atlas, "quads");
    let patch: Vec<u32> = array(atlas, "quad_patch");
    let cell: Vec<u32> = array(atlas, "quad_cell");
    for (q, corners) in quads.as_chunks::<4>().0.iter().enumerate() {
        let p = patch[q] as usize;
        let samples = number(&patches[p]["samples_per_cell"]);
        let [column, row] = [0, 1].map(|i| cell[2 * q + i] as usize);
        let places = [[0, 0], [1, 0], [1, 1], [0, 1]];
        for ([i, j], v) in places.into_iter().zip(corners) {
            let at = (row + j) * samples * images[p].width + (column + i) * samples;
            let point = std::array::from_fn(|x| positions[3 * *v as usize + x] - origin[x]);
            assert_eq!(
                images[p].position[at],
                point.map(|x: f64| x as f32),
                "cell {q}"
            );
        }
    }
}

fn grid(fixture: &str) {
    let mesh = format!("fixtures/good/{fixture}");
    let built = build(Path::new(&mesh), &[]);
    let atlas = built.atlas();
    verify(&atlas);
    let described = document(&atlas);
    let patches = described["patches"].as_array().expect("a list");
    assert_eq!(described["grid"]["turned_over"], 0);
    assert_eq!(number(&described["grid"]["blocks"]), patches.len());
    let folder = read_images(&atlas).expect("readable");
    assert!(assert_same_points(patches, &folder.images) > 1000);
    assert_corners(&atlas, patches, &folder.images, folder.image_origin);
    assert!(atlas.join("quads.obj").is_file());
}

#[test]
fn genus_0_animal() {
    grid("genus-0-animal.ply");
}

#[test]
fn genus_0_cube() {
    grid("genus-0-cube.obj");
}

#[test]
fn genus_1_mug() {
    grid("genus-1-mug.off");
}

#[test]
fn genus_2_amphora() {
    grid("genus-2-amphora.glb");
}

#[test]
fn genus_3_pretzel() {
    grid("genus-3-pretzel.obj");
}

#[test]
fn disk_mask() {
    grid("disk-mask.obj");
}

#[test]
fn three_boundaries_rabbit() {
    grid("three-boundaries-rabbit.ply");
}

/// Texels of one image moved by the least there is are found.
#[test]
fn verify_compares_sides() {
    use exr::prelude::{FlatSamples, WritableImage, read_all_flat_layers_from_file};
    let built = build(Path::new("fixtures/good/genus-0-cube.obj"), &[]);
    let atlas = built.atlas();
    let path = atlas.join("images/0000.exr");
    let mut image = read_all_flat_layers_from_file(&path).expect("an image");
    for channel in &mut image.layer_data[0].channel_data.list {
        if let (true, FlatSamples::F32(values)) = (channel.name.eq("G"), &mut channel.sample_data) {
            values[0] = f32::from_bits(values[0].to_bits() ^ 1);
        }
    }
    image.write().to_file(&path).expect("written");
    let output = crate::command::program().arg("verify").arg(&atlas).output();
    let said = output.expect("the program starts").stdout;
    let said = String::from_utf8_lossy(&said);
    let name = "FAIL  images of blocks hold the same points along common sides";
    assert!(said.contains(name), "{said}");
}

/// The quad mesh as a file is that of the arrays: one that lacks a line, or has another number, is found, and so is none.
#[test]
fn verify_compares_the_quad_mesh() {
    let built = build(Path::new("fixtures/good/genus-0-cube.obj"), &[]);
    let atlas = built.atlas();
    let path = atlas.join("quads.obj");
    let text = std::fs::read_to_string(&path).expect("there");
    let (all_but_last, last) = text.trim_end().rsplit_once('\n').expect("lines");
    let corners: Vec<&str> = last.split(' ').collect();
    let turned = [0, 2, 3, 4, 1].map(|k| corners[k]).join(" ");
    for damaged in [
        Some(text.replacen("v ", "v 9", 1)),
        Some(all_but_last.to_owned()),
        Some(format!("{all_but_last}\n{turned}\n")),
        Some(format!("{text}f 1 2 3\n")),
        None,
    ] {
        match damaged {
            Some(text) => std::fs::write(&path, text).expect("writable"),
            None => std::fs::remove_file(&path).expect("there"),
        }
        let output = crate::command::program().arg("verify").arg(&atlas).output();
        let output = output.expect("the program starts");
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(
            said.contains("FAIL  quads.obj holds the quad mesh"),
            "{said}"
        );
        assert_eq!(output.status.code(), Some(1));
    }
}

/// A mesh that a build gives vertices to before it looks for cones: what `check` and `explain` say of it is what comes of it.
#[test]
fn check_and_explain_know_the_mesh_that_is_built() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mesh = folder.path().join("triangle.obj");
    std::fs::write(&mesh, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("written");
    let built = build(&mesh, &[]);
    let cones = document(&built.atlas())["cones"].clone();
    let cones = cones.as_array().expect("cones").len();
    let said = |command: &str| {
        let output = crate::command::program().arg(command).arg(&mesh).output();
        String::from_utf8_lossy(&output.expect("the program starts").stdout).into_owned()
    };
    let (check, explain) = (said("check"), said("explain"));
    assert!(!check.contains("no grid"), "{check}");
    assert!(explain.contains(&format!(" {cones} cones:")), "{explain}");
    let advice = explain.contains("images.domain = \"flat\"");
    assert!(advice, "cones.count changes nothing on a grid: {explain}");
}

/// Cells of a quad mesh: area, and curvature towards the neighbour that it bends most to (angle between normals by distance).
fn cells(atlas: &Path) -> Vec<[f64; 2]> {
    let positions: Vec<f64> = array(atlas, "quad_positions");
    let quads: Vec<u32> = array(atlas, "quads");
    let quads = quads.as_chunks::<4>().0;
    let at = |v: u32| -> [f64; 3] { std::array::from_fn(|i| positions[3 * v as usize + i]) };
    let sub = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| a[i] - b[i]) };
    let norm = |a: [f64; 3]| a.iter().map(|x| x * x).sum::<f64>().sqrt();
    let of_cell = |q: &[u32; 4]| {
        let (a, b) = (sub(at(q[2]), at(q[0])), sub(at(q[3]), at(q[1])));
        let normal = [0, 1, 2].map(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            a[j] * b[k] - a[k] * b[j]
        });
        let doubled = norm(normal);
        let centre = [0, 1, 2].map(|i| q.iter().map(|&v| at(v)[i]).sum::<f64>() / 4.0);
        (0.5 * doubled, normal.map(|x| x / doubled), centre)
    };
    let shapes: Vec<_> = quads.iter().map(of_cell).collect();
    let mut found: Vec<[f64; 2]> = shapes.iter().map(|s| [s.0, 0.0]).collect();
    let mut sides = std::collections::HashMap::new();
    for (q, corners) in quads.iter().enumerate() {
        for k in 0..4 {
            let (a, b) = (corners[k], corners[(k + 1) % 4]);
            sides.insert((a, b), q);
            if let Some(&other) = sides.get(&(b, a)) {
                let ((_, m, c), (_, n, d)) = (shapes[q], shapes[other]);
                let cosine: f64 = m.iter().zip(n).map(|(x, y)| x * y).sum();
                let curvature = cosine.clamp(-1.0, 1.0).acos() / norm(sub(c, d));
                for cell in [q, other] {
                    found[cell][1] = found[cell][1].max(curvature);
                }
            }
        }
    }
    found
}

#[test]
fn cells_are_as_long_as_asked_for() {
    let mesh = Path::new("fixtures/good/genus-3-pretzel.obj");
    for size in [0.2, 0.05] {
        let built = build(
            mesh,
            &["report.enabled=false", &format!("grid.cell_size={size}")],
        );
        let atlas = built.atlas();
        let stated = document(&atlas)["grid"]["cell_size"].as_f64();
        let areas: Vec<f64> = cells(&atlas).iter().map(|c| c[0]).collect();
        let mean = areas.iter().sum::<f64>() / areas.len() as f64;
        for (what, found) in [
            ("stated", stated.expect("a size")),
            ("measured", mean.sqrt()),
        ] {
            assert!(
                (found / size - 1.0).abs() < 0.05,
                "{found} {what} for {size}"
            );
        }
    }
}

#[test]
fn cells_are_smaller_where_the_surface_is_curved() {
    let mesh = Path::new("fixtures/good/genus-0-animal.ply");
    // The cells on the most curved fifth of the surface against all, and how many there are.
    let curved = |density: &str| {
        let settings = ["report.enabled=false", &format!("grid.density={density}")];
        let built = build(mesh, &settings);
        let mut cells = cells(&built.atlas());
        cells.sort_by(|a, b| b[1].total_cmp(&a[1]));
        let whole: f64 = cells.iter().map(|c| c[0]).sum();
        let mut area = 0.0;
        let most = cells.iter().position(|c| {
            area += c[0];
            area > 0.2 * whole
        });
        (
            area / most.expect("a fifth") as f64 / (whole / cells.len() as f64),
            cells.len(),
        )
    };
    let (uniform, by_curvature) = (curved("uniform"), curved("curvature"));
    assert_eq!(uniform.1, by_curvature.1);
    assert!(
        by_curvature.0 < 0.97 * uniform.0,
        "{by_curvature:?} against {uniform:?}"
    );
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let mesh = Path::new("fixtures/good/genus-2-amphora.glb");
    let run = |threads: &str| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let output = build_into(folder.path(), mesh, &[threads, "grid.cells=700"]);
        assert_eq!(output.status.code(), Some(0));
        folder
    };
    let (one, two) = (run("run.threads=1"), run("run.threads=2"));
    let of = |folder: &tempfile::TempDir| files(&folder.path().join("genus-2-amphora"));
    assert!(of(&one) == of(&two));
}

/// What a grid needs and what else was asked for: the flat patches that are built then, and why.
#[test]
fn prescribed_cones_give_flat_patches() {
    let mesh = Path::new("fixtures/good/genus-0-animal.ply");
    let built = build(mesh, &["cones.strategy=spread"]);
    let described = document(&built.atlas());
    assert!(described["grid"].is_null() && described["no_grid"].is_null());
    assert_eq!(described["patches"][0]["domain"], "flat");
}

/// Four vertices are fewer than the eight cones that a sphere needs.
#[test]
fn a_tetrahedron_has_a_grid() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mesh = folder.path().join("tetrahedron.obj");
    let text = "v 1 1 1\nv -1 -1 1\nv -1 1 -1\nv 1 -1 -1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    std::fs::write(&mesh, text).expect("written");
    let built = build(&mesh, &[]);
    let atlas = built.atlas();
    verify(&atlas);
    assert!(number(&document(&atlas)["grid"]["cells"]) >= 6);
}

/// Vertices on edges of faces that are flat together lie on one line, beside borders too: flat faces are not to have three of them for corners.
#[test]
fn rectangles_of_four_triangles_have_grids() {
    let mut state = 2_u64;
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005);
        state = state.wrapping_add(1442695040888963407);
        (state >> 33) as f64 / (1_u64 << 31) as f64
    };
    let mut text = String::new();
    for k in 0..40 {
        let (wide, long) = (0.05, 0.05 * (1.0 + 5.0 * random()));
        let (sin, cos) = (6.0 * random()).sin_cos();
        let inside = [0, 1].map(|_| 0.2 + 0.6 * random());
        let corners = [[0.0, 0.0], [wide, 0.0], [0.0, long], [wide, long]];
        for [x, y] in (corners.into_iter()).chain([[inside[0] * wide, inside[1] * long]]) {
            let (x, y) = (cos * x - sin * y, sin * x + cos * y);
            // Five digits: no angle is a quarter turn.
            text += &format!("v {:.5} {:.5} {:.5}\n", f64::from(k) + x, 0.8 * y, 0.6 * y);
        }
        for face in [[1, 3, 5], [3, 4, 5], [4, 2, 5], [2, 1, 5]] {
            let [a, b, c] = face.map(|v| 5 * k + v);
            text += &format!("f {a} {b} {c}\n");
        }
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mesh = folder.path().join("rectangles.obj");
    std::fs::write(&mesh, text).expect("written");
    let built = build(&mesh, &["grid.cells=8000", "report.enabled=false"]);
    let atlases = built.atlases();
    assert_eq!(atlases.len(), 40, "{}", built.message());
    for atlas in atlases {
        let no_grid = &document(&atlas)["no_grid"];
        assert!(no_grid.is_null(), "{}: {no_grid}", atlas.display());
    }
}

/// A polygon of hundreds of corners in a fan of needles: straight borders would cut it into far more faces than it has.
#[test]
fn where_no_grid_can_be_made_there_are_flat_patches_and_the_reason() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mesh = folder.path().join("fan.obj");
    let corners = 1500;
    let mut text = String::new();
    for i in 0..corners {
        let (y, x) = (std::f64::consts::TAU * f64::from(i) / f64::from(corners)).sin_cos();
        text += &format!("v {x} {y} 0\n");
    }
    for i in 2..corners {
        text += &format!("f 1 {i} {}\n", i + 1);
    }
    std::fs::write(&mesh, text).expect("written");
    // Not quietly: it warns.
    let mut command = crate::command::program();
    command
        .arg("build")
        .arg(&mesh)
        .arg("--out")
        .arg(folder.path().join("out"));
    for setting in ["report.enabled=false", "pictures.enabled=false"] {
        command.args(["--set", setting]);
    }
    let output = command.output().expect("the program starts");
    let atlas = folder.path().join("out/fan");
    verify(&atlas);
    let described = document(&atlas);
    assert!(described["grid"].is_null());
    assert_eq!(described["patches"][0]["domain"], "flat");
    let reason = described["no_grid"].as_str().expect("a sentence");
    assert!(
        reason.contains("1500 vertices of the mesh lie on its border and only 0 inside"),
        "{reason}"
    );
    let said = String::from_utf8_lossy(&output.stderr);
    let warned = format!("has flat patches instead of a grid: {reason}");
    assert!(said.contains(&warned), "{said}");
}
