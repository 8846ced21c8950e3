//! One `surface.glb` of all components of an asset.

use crate::command::{build, program};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Boxes beside each other, each as a component with a material of its own.
fn boxes(sides: &[f64]) -> String {
    let mut text = String::new();
    for (i, side) in sides.iter().enumerate() {
        for corner in 0..8 {
            let [x, y, z] = [0, 1, 2].map(|k| f64::from(corner >> k & 1) * side);
            writeln!(text, "v {} {y} {z}", x + 10.0 * i as f64).expect("a string");
        }
        writeln!(text, "usemtl paint{}", i % 2).expect("a string");
        for [a, b, c, d] in [
            [0, 2, 3, 1],
            [4, 5, 7, 6],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 4, 6, 2],
            [1, 3, 7, 5],
        ] {
            let [a, b, c, d] = [a, b, c, d].map(|k| 8 * i + k + 1);
            writeln!(text, "f {a} {b} {c} {d}").expect("a string");
        }
    }
    text
}

/// Texture coordinates and corners in space of all triangles, and names of the materials.
struct Drawn {
    triangles: Vec<[([f64; 2], [f64; 3]); 3]>,
    materials: Vec<String>,
    extras: Value,
}

fn drawn(path: &Path) -> Drawn {
    let file = gltf::Gltf::open(path).expect("a GLB");
    let binary = file.blob.as_deref().expect("a binary chunk");
    let mut meshes = file.document.meshes();
    let (mesh, None) = (meshes.next().expect("a mesh"), meshes.next()) else {
        panic!("one mesh is expected")
    };
    let extras = mesh.extras().as_ref().expect("extras");
    let extras: Value = serde_json::from_str(extras.get()).expect("JSON");
    let (mut triangles, mut materials) = (Vec::new(), Vec::new());
    for primitive in mesh.primitives() {
        let name = primitive.material().name().unwrap_or_default().to_owned();
        materials.push(name);
        let reader = primitive.reader(|_| Some(binary));
        let space: Vec<[f32; 3]> = reader.read_positions().expect("positions").collect();
        let uv = reader.read_tex_coords(0).expect("TEXCOORD_0").into_f32();
        let uv: Vec<[f32; 2]> = uv.collect();
        let corners = reader.read_indices().expect("indices").into_u32();
        let corners: Vec<usize> = corners.map(|i| i as usize).collect();
        for t in corners.as_chunks::<3>().0 {
            triangles.push(t.map(|i| (uv[i].map(f64::from), space[i].map(f64::from))));
        }
    }
    Drawn {
        triangles,
        materials,
        extras: extras["affineAtlas"].clone(),
    }
}

/// √(area of texture coordinates per area in space) of some triangles together.
fn density(triangles: &[[([f64; 2], [f64; 3]); 3]]) -> f64 {
    let (mut plane, mut space) = (0.0, 0.0);
    for [(a, p), (b, q), (c, r)] in triangles {
        plane += ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs();
        let (s, t) = (
            [0, 1, 2].map(|i| q[i] - p[i]),
            [0, 1, 2].map(|i| r[i] - p[i]),
        );
        let normal = [0, 1, 2].map(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            s[j] * t[k] - s[k] * t[j]
        });
        space += normal.iter().map(|x| x * x).sum::<f64>().sqrt();
    }
    (plane / space).sqrt()
}

fn verify(folder: &Path) -> (bool, String) {
    let output = program().arg("verify").arg(folder).output();
    let output = output.expect("verify runs");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    (output.status.success(), said)
}

#[test]
fn components_share_one_square_at_equal_density() {
    let input = tempfile::tempdir().expect("a temporary folder");
    let mesh = input.path().join("boxes.obj");
    std::fs::write(&mesh, boxes(&[1.0, 3.0, 0.5, 2.0, 1.0])).expect("written");
    let built = build(&mesh, &["pictures.enabled=false", "report.enabled=false"]);
    assert_eq!(built.code(), Some(0));
    let asset = built.folder.path().join("boxes");
    let whole = drawn(&asset.join("surface.glb"));
    assert_eq!(whole.materials, ["paint0", "paint1"]);
    let listed = whole.extras["components"].as_array().expect("a list");
    assert_eq!(listed.len(), 5);
    let (mut count, mut densities) = (0, Vec::new());
    for (i, entry) in listed.iter().enumerate() {
        assert_eq!(entry["component"], i);
        let own = drawn(&asset.join(format!("component-00{i}/surface.glb")));
        count += own.triangles.len();
        // Where its coordinates went is what the file says, v up.
        let scale = entry["packed_to_whole"]["scale"]
            .as_f64()
            .expect("a number");
        let shift = [0, 1].map(|k| {
            let translation = &entry["packed_to_whole"]["translation"][k];
            translation.as_f64().expect("a number")
        });
        let moved: Vec<_> = (own.triangles.iter())
            .map(|t| {
                t.map(|([u, v], p)| {
                    let up = [u, 1.0 - v];
                    let [u, v] = [0, 1].map(|k| scale * up[k] + shift[k]);
                    ([u, 1.0 - v], p)
                })
            })
            .collect();
        let near = |a: [f64; 2], b: [f64; 2]| (0..2).all(|k| (a[k] - b[k]).abs() < 1e-6);
        let is_drawn = |t: &[([f64; 2], [f64; 3]); 3]| {
            (whole.triangles.iter()).any(|w| (0..3).all(|k| near(w[k].0, t[k].0)))
        };
        assert!(moved.iter().all(is_drawn), "component {i} lies elsewhere");
        densities.push(density(&moved));
    }
    assert_eq!(whole.triangles.len(), count);
    let (least, most) = densities
        .iter()
        .fold((f64::MAX, 0.0_f64), |(a, b), d| (a.min(*d), b.max(*d)));
    assert!(most / least < 1.0 + 1e-4, "{densities:?}");
    let (passed, said) = verify(&asset);
    assert!(
        passed && said.contains("ok    surface.glb holds every face"),
        "{said}"
    );
    // That of a component is not that of all.
    let own = asset.join("component-000/surface.glb");
    std::fs::copy(own, asset.join("surface.glb")).expect("copied");
    let (passed, said) = verify(&asset);
    assert!(
        !passed && said.contains("FAIL  surface.glb can be read  names no components"),
        "{said}"
    );
}

#[test]
fn what_failed_is_not_in_it() {
    let built = build(Path::new("fixtures/bad/one-bad-component.obj"), &[]);
    assert_eq!(built.code(), Some(1), "one of them is one-sided");
    let asset = built.folder.path().join("one-bad-component");
    let whole = drawn(&asset.join("surface.glb"));
    let listed = whole.extras["components"].as_array().expect("a list");
    let listed: Vec<&Value> = listed.iter().map(|entry| &entry["component"]).collect();
    assert_eq!(listed, [0, 2]);
    assert!(verify(&asset).0);
}

/// All files of a folder with their bytes, by their paths inside it.
fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(next).expect("a folder") {
            let path = entry.expect("an entry").path();
            match path.is_dir() {
                true => open.push(path),
                false => {
                    let inside = path.strip_prefix(folder).expect("inside").to_owned();
                    found.push((inside, std::fs::read(&path).expect("read")));
                }
            }
        }
    }
    found.sort();
    found
}

#[test]
fn many_components_have_one_page_and_picture_the_same_for_any_number_of_threads() {
    let input = tempfile::tempdir().expect("a temporary folder");
    let mesh = input.path().join("boxes.obj");
    std::fs::write(&mesh, boxes(&[1.0; 20])).expect("written");
    let of_threads = |threads: &str| {
        let pictures = ["pictures.enabled=true", "pictures.size=256"];
        let built = build(&mesh, &[pictures[0], pictures[1], threads]);
        assert_eq!(built.code(), Some(0));
        contents(&built.folder.path().join("boxes"))
    };
    let files = of_threads("run.threads=1");
    let named = |end: &str| {
        let names = files.iter().map(|(name, _)| name);
        names.filter(|name| name.ends_with(end)).collect::<Vec<_>>()
    };
    assert_eq!(named("atlas.json").len(), 20);
    assert_eq!(named("report.html"), [Path::new("report.html")]);
    assert_eq!(named("preview.png"), [Path::new("preview.png")]);
    let page = files.iter().find(|(name, _)| name.ends_with("report.html"));
    let page = String::from_utf8_lossy(&page.expect("a page").1).into_owned();
    assert_eq!(page.matches("href=\"./component-0").count(), 20);
    assert!(page.contains("more than the 16 of <code>report.max_components</code>"));
    // Each has a twentieth of the 2,000 cells, and is a box: 6 · 4² of them.
    assert_eq!(page.matches("data-value=\"96\">96</td>").count(), 20);
    assert!(files == of_threads("run.threads=3"), "bytes differ");
}

#[test]
fn few_components_have_pages_of_their_own_beside_that_of_all() {
    let built = build(
        Path::new("fixtures/bad/one-bad-component.obj"),
        &["pictures.enabled=true"],
    );
    let asset = built.folder.path().join("one-bad-component");
    let page = std::fs::read_to_string(asset.join("report.html")).expect("a page");
    for part in ["component-000", "component-002"] {
        assert!(asset.join(part).join("report.html").is_file());
        assert!(page.contains(&format!("href=\"./{part}/report.html\"")));
    }
    assert!(page.contains("of which 1 failed"));
    assert!(page.contains("<td data-value=\"1\">component-001</td><td colspan=\"10\""));
    assert!(asset.join("preview.png").is_file());
}

/// A Möbius strip of five triangles as one more component.
fn one_sided(text: &mut String, first: usize) {
    for (x, y, z) in [(0, 0, 0), (4, 0, 1), (5, 3, 2), (2, 5, 1), (-1, 3, 3)] {
        writeln!(text, "v {x} {y} {}", z + 50).expect("a string");
    }
    for i in 0..5 {
        let [a, b, c] = [i, (i + 1) % 5, (i + 2) % 5].map(|k| first + k);
        writeln!(text, "f {a} {b} {c}").expect("a string");
    }
}

#[test]
fn of_many_components_little_is_said_but_of_those_that_are_refused() {
    let input = tempfile::tempdir().expect("a temporary folder");
    let mesh = input.path().join("boxes.obj");
    let mut text = boxes(&[1.0; 20]);
    one_sided(&mut text, 8 * 20 + 1);
    std::fs::write(&mesh, text).expect("written");
    let said = |args: &[&Path]| {
        let output = program().args(args).output().expect("the program starts");
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let listed = |said: &str| {
        let numbers = said.lines().filter_map(|line| {
            let number = line
                .strip_prefix("component")?
                .trim_matches([' ', '-', ':']);
            number.parse::<usize>().ok()
        });
        numbers.collect::<Vec<_>>()
    };
    let first: Vec<usize> = (0..16).collect();
    for command in ["check", "explain"] {
        let said = said(&[Path::new(command), &mesh]);
        assert_eq!(listed(&said), [first.as_slice(), &[20]].concat(), "{said}");
        let end = "4 more components: nothing refused, and a grid wherever one is asked for";
        assert_eq!(said.lines().last(), Some(end), "{command}");
    }
    let built = build(&mesh, &["report.enabled=false"]);
    let asset = built.folder.path().join("boxes");
    let of_folder = said(&[Path::new("explain"), &asset]);
    assert_eq!(listed(&of_folder), first, "{of_folder}");
    let end = "4 more components: explain OUT/ASSET/component-NNN tells of one";
    assert_eq!(of_folder.lines().last(), Some(end));
    let one = said(&[Path::new("explain"), &asset.join("component-019")]);
    assert!(one.contains("cones: lengths are scaled by"), "{one}");

    let array = asset.join("component-018/atlas.npz");
    std::fs::remove_file(array).expect("removed");
    let (passed, said) = verify(&asset);
    assert!(
        !passed && said.contains("ok    format  in 20 folders\n"),
        "{said}"
    );
    let failed: Vec<&str> = said.lines().filter(|l| l.starts_with("FAIL")).collect();
    assert_eq!(failed.len(), 2, "{said}");
    assert!(failed[0].starts_with("FAIL  component-018: atlas.npz can be read  "));
    assert!(failed[1].contains("names component 18, of which there is no sound atlas"));
}
