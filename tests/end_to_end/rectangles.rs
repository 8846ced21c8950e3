//! Rectangles: full grids whose sides fit and hold the same points, on every good fixture; checked from the files alone.

use crate::arrays::array;
use crate::command::{build, build_into, document, program, verify};
use crate::good::files;
use affine_atlas::read::atlas::{ImageFolder, StoredImage, read_images};
use exr::prelude::{FlatSamples, WritableImage, read_all_flat_layers_from_file};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

const RECTANGLE: &str = "images.domain=rectangle";

/// A side of a rectangle.
struct Side {
    patch: usize,
    edges: BTreeSet<[u32; 2]>,
    /// How many texels lie on it.
    samples: u64,
    /// Its vertices counterclockwise, after the fraction of the side where they lie.
    vertices: Vec<(f64, u32)>,
}

/// The four sides of every patch, in which every border edge must lie exactly.
fn sides(atlas: &Path) -> Vec<Side> {
    let described = document(atlas);
    let faces: Vec<u32> = array(atlas, "faces");
    let uv: Vec<f64> = array(atlas, "patch_uv");
    let patch: Vec<u32> = array(atlas, "patch");
    let cut: Vec<u8> = array(atlas, "cut");
    let halfedge = |h: usize| {
        let (f, k) = (h / 3, h % 3);
        [3 * f + (k + 1) % 3, 3 * f + (k + 2) % 3]
    };
    let mut by_ends: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    for h in 0..faces.len() {
        by_ends.insert(halfedge(h).map(|corner| faces[corner]), h);
    }
    let patches = described["patches"].as_array().expect("a list");
    let mut sides: Vec<Side> = Vec::new();
    for (i, p) in patches.iter().enumerate() {
        assert_eq!(p["domain"], "rectangle");
        assert!(p["patch_to_chart"].is_null());
        let [width, height] = ["width", "height"].map(|k| p[k].as_u64().expect("a count"));
        assert!(width >= 8 && height >= 8);
        for samples in [width, height, width, height] {
            sides.push(Side {
                patch: i,
                edges: BTreeSet::new(),
                samples,
                vertices: Vec::new(),
            });
        }
    }
    for h in 0..faces.len() {
        let [a, b] = halfedge(h).map(|corner| faces[corner]);
        let p = patch[h / 3] as usize;
        let across = by_ends.get(&[b, a]);
        // A rectangle may lie across the cut, and goes on there.
        let at = |corner: usize| [uv[2 * corner], uv[2 * corner + 1]];
        let goes_on = |t: usize| {
            let ([tail, head], [back, front]) = (halfedge(h), halfedge(t));
            at(tail) == at(front) && at(head) == at(back)
        };
        let is_inner =
            across.is_some_and(|&t| patch[t / 3] as usize == p && (cut[h] == 0 || goes_on(t)));
        if is_inner {
            continue;
        }
        let top = patches[p]["texel_to_patch"][1][2]
            .as_f64()
            .expect("a number");
        let ends = halfedge(h).map(|corner| [uv[2 * corner], uv[2 * corner + 1]]);
        let on = |i: usize, value: f64| ends.iter().all(|e| e[i] == value);
        let lies = [on(1, 0.0), on(0, 1.0), on(1, top), on(0, 0.0)];
        let side: Vec<usize> = (0..4).filter(|&k| lies[k]).collect();
        let &[side] = &side[..] else {
            panic!("border edge {a} {b} of patch {p} lies on sides {side:?}");
        };
        let fraction = |[u, v]: [f64; 2]| [u, v / top, 1.0 - u, 1.0 - v / top][side];
        let side = &mut sides[4 * p + side];
        side.edges.insert([a.min(b), a.max(b)]);
        side.vertices.push((fraction(ends[0]), a));
        side.vertices.push((fraction(ends[1]), b));
    }
    for side in &mut sides {
        side.vertices.sort_by(|a, b| a.0.total_cmp(&b.0));
        side.vertices.dedup_by_key(|v| v.1);
        assert_eq!(side.vertices.len(), side.edges.len() + 1);
    }
    sides
}

/// The texels of side k, counterclockwise.
fn texels(image: &StoredImage, k: usize) -> Vec<[f32; 3]> {
    let [right, bottom] = [image.width - 1, image.height - 1];
    let places: Vec<[usize; 2]> = match k {
        0 => (0..=right).map(|x| [x, bottom]).collect(),
        1 => (0..=bottom).rev().map(|y| [right, y]).collect(),
        2 => (0..=right).rev().map(|x| [x, 0]).collect(),
        _ => (0..=bottom).map(|y| [0, y]).collect(),
    };
    let at = |&[x, y]: &[usize; 2]| image.position[image.width * y + x];
    places.iter().map(at).collect()
}

/// Texel i of n along a side is the point at i / (n − 1) of it, and to the last bit texel n − 1 − i of the side across; images that meet
/// at a vertex hold it, to the last bit too. How many sides were compared.
fn assert_same_points(sides: &[Side], images: &ImageFolder, positions: &[f64]) -> usize {
    let position = |v: u32| -> [f64; 3] { std::array::from_fn(|i| positions[3 * v as usize + i]) };
    let size = positions.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let own: Vec<Vec<[f32; 3]>> = (0..sides.len())
        .map(|i| texels(&images.images[i / 4], i % 4))
        .collect();
    let mut of_edge: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    let mut at_vertex: BTreeMap<u32, [f32; 3]> = BTreeMap::new();
    let mut compared = 0;
    for (i, side) in sides.iter().enumerate() {
        let n = own[i].len();
        for (k, texel) in own[i].iter().enumerate() {
            let t = k as f64 / (n - 1) as f64;
            let after = side.vertices.partition_point(|v| v.0 <= t);
            let after = after.clamp(1, side.vertices.len() - 1);
            let ((s, p), (e, q)) = (side.vertices[after - 1], side.vertices[after]);
            let (p, q, t) = (position(p), position(q), (t - s) / (e - s));
            for x in 0..3 {
                let want = p[x] + t * (q[x] - p[x]) - images.image_origin[x];
                let error = (f64::from(texel[x]) - want).abs();
                assert!(error < 1e-6 * size, "texel {k} of side {i}: {error:e}");
            }
        }
        let corner = side.vertices[0].1;
        let held = *at_vertex.entry(corner).or_insert(own[i][0]);
        assert_eq!(held, own[i][0], "vertex {corner}");
        for &edge in &side.edges {
            let Some(across) = of_edge.insert(edge, i) else {
                continue;
            };
            assert!(own[i].iter().eq(own[across].iter().rev()), "{i} {across}");
            compared += 1;
        }
    }
    compared
}

/// Every edge of a side is on one other side or on the surface's border, and the other side has no edge that this one lacks.
fn assert_conforming(sides: &[Side], loops: u64) {
    let mut of_edge: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
    for (i, side) in sides.iter().enumerate() {
        assert!(
            !side.edges.is_empty(),
            "a side of {} is missing",
            side.patch
        );
        for &edge in &side.edges {
            of_edge.entry(edge).or_default().push(i);
        }
    }
    let mut on_border = 0;
    for (i, side) in sides.iter().enumerate() {
        let across: BTreeSet<Option<usize>> = side
            .edges
            .iter()
            .map(|edge| of_edge[edge].iter().copied().find(|&j| j != i))
            .collect();
        let across: Vec<Option<usize>> = across.into_iter().collect();
        match across[..] {
            [None] => on_border += 1,
            [Some(j)] => {
                assert_eq!(side.edges, sides[j].edges, "{i} {j}");
                assert_eq!(side.samples, sides[j].samples, "{i} {j}");
            }
            _ => panic!("side {i} of patch {} meets {across:?}", side.patch),
        }
    }
    assert_eq!(on_border > 0, loops > 0);
}

fn rectangles(fixture: &str) {
    let mesh = format!("fixtures/good/{fixture}");
    let built = build(Path::new(&mesh), &[RECTANGLE]);
    let atlas = built.atlas();
    verify(&atlas);
    let loops = document(&atlas)["topology"]["boundary_loops"].as_u64();
    let sides = sides(&atlas);
    assert_conforming(&sides, loops.expect("a count"));
    let images = read_images(&atlas).expect("readable");
    let compared = assert_same_points(&sides, &images, &array(&atlas, "positions"));
    assert!(compared > 0);
}

#[test]
fn genus_0_animal() {
    rectangles("genus-0-animal.ply");
}

#[test]
fn genus_0_cube() {
    rectangles("genus-0-cube.obj");
}

#[test]
fn genus_1_mug() {
    rectangles("genus-1-mug.off");
}

#[test]
fn genus_2_amphora() {
    rectangles("genus-2-amphora.glb");
}

#[test]
fn genus_3_pretzel() {
    rectangles("genus-3-pretzel.obj");
}

#[test]
fn disk_mask() {
    rectangles("disk-mask.obj");
}

#[test]
fn three_boundaries_rabbit() {
    rectangles("three-boundaries-rabbit.ply");
}

/// The last bit of one texel on a side.
#[test]
fn a_texel_that_differs_across_a_side_is_found() {
    let built = build(Path::new("fixtures/good/genus-0-cube.obj"), &[RECTANGLE]);
    let path = built.atlas().join("images/0000.exr");
    let mut image = read_all_flat_layers_from_file(&path).expect("readable");
    for channel in &mut image.layer_data[0].channel_data.list {
        if let (true, FlatSamples::F32(values)) = (channel.name == *"R", &mut channel.sample_data) {
            values[3] = values[3].next_up();
        }
    }
    image.write().to_file(&path).expect("writable");
    let output = program().arg("verify").arg(built.atlas()).output();
    let said = String::from_utf8(output.expect("the program starts").stdout).expect("UTF-8");
    let failed: Vec<&str> = said.lines().filter(|l| l.starts_with("FAIL")).collect();
    let [failed] = failed[..] else {
        panic!("{said}");
    };
    let name = "images of rectangles hold the same points along shared sides";
    assert!(
        failed.contains(name) && failed.contains(" 1 of "),
        "{failed}"
    );
}

/// Quads are flattened side by side; nothing depends on which comes first.
#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let run = |threads: &str| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mesh = Path::new("fixtures/good/genus-2-amphora.glb");
        let output = build_into(folder.path(), mesh, &[RECTANGLE, threads]);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{said}");
        files(&folder.path().join("genus-2-amphora"))
    };
    let (one, two) = (run("run.threads=1"), run("run.threads=2"));
    assert!(one.keys().eq(two.keys()));
    for (file, bytes) in &one {
        assert!(bytes == &two[file], "{file} depends on the threads");
    }
}
