//! Spline surfaces of whole builds: read back from their files and checked with formulas of their own.

use crate::command::{Built, build, document, program};
use crate::good::files;
use affine_atlas::fit::Side;
use affine_atlas::job::fit::FitParams;
use affine_atlas::read::atlas::read_images;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Output;

/// Part of the diagonal by which neighbours may be apart.
const GAP: f64 = 1e-9;

const GRID: [&str; 3] = [
    "images.domain=grid",
    "grid.cells=500",
    "report.enabled=false",
];

fn fit(folder: &Path, into: &Path, more: &[&str]) -> Output {
    let mut command = program();
    command.arg("fit").arg(folder).arg("--out").arg(into);
    command.args(more).output().expect("the program starts")
}

fn grid(fixture: &str) -> Built {
    build(&Path::new("fixtures/good").join(fixture), &GRID)
}

/// A surface as a file has it.
struct Patch {
    knots: [Vec<f64>; 2],
    control: Vec<[f64; 3]>,
}

/// What `MultiPatch` says of two sides: patch, side, patch, side, two directions and whether they are the same.
type Row = [usize; 8];

struct MultiPatch {
    patches: Vec<Patch>,
    interfaces: Vec<Row>,
    boundary: Vec<[usize; 2]>,
}

fn numbers<T: std::str::FromStr>(text: Option<&str>) -> Vec<T> {
    let words = text.unwrap_or("").split_whitespace();
    words.map(|w| w.parse().ok().expect("a number")).collect()
}

fn parse(path: &Path) -> MultiPatch {
    let text = std::fs::read_to_string(path).expect("written");
    let tree = roxmltree::Document::parse(&text).expect("XML");
    let root = tree.root_element();
    let child = |node: roxmltree::Node<'_, '_>, name: &str| {
        let mut found = node.children().filter(|c| c.has_tag_name(name));
        let one = found.next().expect("there").id();
        assert!(found.next().is_none(), "{name} twice");
        one
    };
    let get = |id| tree.get_node(id).expect("there");
    let geometries = root.children().filter(|c| c.has_tag_name("Geometry"));
    let patches: Vec<Patch> = geometries
        .enumerate()
        .map(|(i, node)| {
            assert_eq!(node.attribute("type"), Some("TensorBSpline2"));
            assert_eq!(node.attribute("id"), Some(&*i.to_string()));
            let basis = get(child(node, "Basis"));
            assert_eq!(basis.attribute("type"), Some("TensorBSplineBasis2"));
            let bases = basis.children().filter(|c| c.has_tag_name("Basis"));
            let knots: Vec<Vec<f64>> = bases
                .enumerate()
                .map(|(direction, node)| {
                    assert_eq!(node.attribute("index"), Some(&*direction.to_string()));
                    let knots = get(child(node, "KnotVector"));
                    assert_eq!(knots.attribute("degree"), Some("3"));
                    numbers(knots.text())
                })
                .collect();
            let coefs = get(child(node, "coefs"));
            assert_eq!(coefs.attribute("geoDim"), Some("3"));
            Patch {
                knots: knots.try_into().expect("two"),
                control: numbers(coefs.text()).as_chunks::<3>().0.to_vec(),
            }
        })
        .collect();
    let multi = get(child(root, "MultiPatch"));
    assert_eq!(multi.attribute("parDim"), Some("2"));
    let range = get(child(multi, "patches"));
    assert_eq!(range.attribute("type"), Some("id_range"));
    assert_eq!(numbers::<usize>(range.text()), [0, patches.len() - 1]);
    let interfaces: Vec<usize> = numbers(get(child(multi, "interfaces")).text());
    let boundary: Vec<usize> = numbers(get(child(multi, "boundary")).text());
    MultiPatch {
        patches,
        interfaces: interfaces.as_chunks::<8>().0.to_vec(),
        boundary: boundary.as_chunks::<2>().0.to_vec(),
    }
}

/// B-spline `i` of a degree, by the definition.
fn bspline(knots: &[f64], i: usize, degree: usize, t: f64) -> f64 {
    if degree == 0 {
        let is_last = t == 1.0 && knots[i] < 1.0 && knots[i + 1] == 1.0;
        return f64::from(u8::from(knots[i] <= t && t < knots[i + 1] || is_last));
    }
    let ratio = |x: f64, width: f64| if width > 0.0 { x / width } else { 0.0 };
    let (left, right) = (knots[i], knots[i + degree + 1]);
    ratio(t - left, knots[i + degree] - left) * bspline(knots, i, degree - 1, t)
        + ratio(right - t, right - knots[i + 1]) * bspline(knots, i + 1, degree - 1, t)
}

impl Patch {
    fn size(&self) -> [usize; 2] {
        [0, 1].map(|d| self.knots[d].len() - 4)
    }

    /// All functions at a parameter.
    fn functions(&self, direction: usize, t: f64) -> Vec<f64> {
        let knots = &self.knots[direction];
        (0..knots.len() - 4)
            .map(|i| bspline(knots, i, 3, t))
            .collect()
    }

    fn at(&self, u: &[f64], v: &[f64]) -> [f64; 3] {
        let mut point = [0.0; 3];
        for (row, v) in self.control.chunks(u.len()).zip(v) {
            for (control, u) in row.iter().zip(u) {
                for c in 0..3 {
                    point[c] += u * v * control[c];
                }
            }
        }
        point
    }

    fn point(&self, [u, v]: [f64; 2]) -> [f64; 3] {
        self.at(&self.functions(0, u), &self.functions(1, v))
    }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

/// Parameters in the second patch of a point on the first one's side.
fn across(row: &Row, point: [f64; 2]) -> [f64; 2] {
    let mut other = [0.0; 2];
    for direction in 0..2 {
        let (target, same) = (row[4 + direction], row[6 + direction]);
        other[target] = match (direction == (row[1] - 1) / 2, same) {
            // Away from the side: the other side says where it is.
            (true, _) => f64::from(u8::from((row[3] - 1) % 2 == 1)),
            (false, 1) => point[direction],
            (false, _) => 1.0 - point[direction],
        };
    }
    other
}

/// The point at `t` along side 1 to 4.
fn on_side(side: usize, t: f64) -> [f64; 2] {
    match side {
        1 => [0.0, t],
        2 => [1.0, t],
        3 => [t, 0.0],
        _ => [t, 1.0],
    }
}

/// Number of a corner of the parameter square.
fn corner([u, v]: [f64; 2]) -> usize {
    match (u > 0.5, v > 0.5) {
        (false, false) => 0,
        (true, false) => 1,
        (true, true) => 2,
        (false, true) => 3,
    }
}

fn find(parent: &[usize], mut at: usize) -> usize {
    while parent[at] != at {
        at = parent[at];
    }
    at
}

/// Every side once; points of both sides of an interface equal; the topology is the surface's.
fn assert_joined(multi: &MultiPatch, diagonal: f64, stated: &serde_json::Value) {
    let mut times: BTreeMap<[usize; 2], usize> = BTreeMap::new();
    let mut parent: Vec<usize> = (0..4 * multi.patches.len()).collect();
    for row in &multi.interfaces {
        *times.entry([row[0], row[1]]).or_default() += 1;
        *times.entry([row[2], row[3]]).or_default() += 1;
        // The direction across one side is the one across the other.
        assert_eq!(row[4 + (row[1] - 1) / 2], (row[3] - 1) / 2, "{row:?}");
        assert_eq!(row[4] + row[5], 1, "{row:?}");
        let differ = (row[1] - 1) % 2 != (row[3] - 1) % 2;
        assert_eq!(row[6 + (row[1] - 1) / 2], usize::from(differ), "{row:?}");
        for step in 0..=24 {
            let point = on_side(row[1], f64::from(step) / 24.0);
            let other = across(row, point);
            let gap = distance(
                multi.patches[row[0]].point(point),
                multi.patches[row[2]].point(other),
            );
            assert!(gap <= GAP * diagonal, "{row:?}: {gap:e}");
            if step % 24 == 0 {
                let ends = [4 * row[0] + corner(point), 4 * row[2] + corner(other)];
                let [a, b] = ends.map(|end| find(&parent, end));
                parent[a.max(b)] = a.min(b);
            }
        }
    }
    for &side in &multi.boundary {
        *times.entry(side).or_default() += 1;
    }
    assert_eq!(times.len(), 4 * multi.patches.len());
    assert!(times.values().all(|&n| n == 1), "{times:?}");
    let vertices = (0..parent.len()).filter(|&i| parent[i] == i).count();
    let edges = multi.interfaces.len() + multi.boundary.len();
    let euler = vertices as i64 - edges as i64 + multi.patches.len() as i64;
    assert_eq!(stated["euler_characteristic"].as_i64(), Some(euler));
    let loops = stated["boundary_loops"].as_u64();
    assert_eq!(loops == Some(0), multi.boundary.is_empty());
}

/// Knots of as many intervals as there are, evenly from 0 to 1.
fn assert_open_and_uniform(knots: &[f64]) {
    let intervals = knots.len() - 7;
    for (i, &knot) in knots.iter().enumerate() {
        let inner = i.saturating_sub(3).min(intervals);
        assert!((knot - inner as f64 / intervals as f64).abs() < 1e-15);
    }
}

/// How many blocks and how many surfaces there are.
fn fixture(name: &str) -> [usize; 2] {
    let built = grid(name);
    let atlas = built.atlas();
    let stem = atlas.file_name().expect("a name").to_str().expect("UTF-8");
    let out = built.folder.path().join("splines");
    let output = fit(&atlas, &out, &["--json"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{name}: {said}");
    let multi = parse(&out.join(format!("{stem}.xml")));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let stored = std::fs::read(out.join("fit.json")).expect("written");
    assert_eq!(
        json,
        serde_json::from_slice::<serde_json::Value>(&stored).expect("JSON")
    );
    let figures = &json["components"][0];
    let diagonal = figures["diagonal"].as_f64().expect("a number");
    assert_joined(&multi, diagonal, &document(&atlas)["topology"]);
    assert!(figures["gap"].as_f64().expect("a number") <= GAP * diagonal);

    // The file holds what the library finds, to the last bit.
    let fitted = affine_atlas::job::fit::fit(&atlas, &FitParams::default()).expect("fits");
    let fitted = &fitted.components[0].surfaces;
    assert_eq!(fitted.patches.len(), multi.patches.len());
    for (ours, read) in fitted.patches.iter().zip(&multi.patches) {
        assert_eq!(ours.control, read.control);
        assert_eq!(ours.size(), read.size());
        for knots in &read.knots {
            assert_open_and_uniform(knots);
        }
    }
    for (ours, row) in fitted.neighbours.interfaces.iter().zip(&multi.interfaces) {
        let number = |side: Side| Side::ALL.iter().position(|&s| s == side).expect("one") + 1;
        assert_eq!([ours.first.patch, number(ours.first.side)], row[..2]);
        assert_eq!([ours.second.patch, number(ours.second.side)], row[2..4]);
    }

    // Errors are those of the samples in the images, and corners are samples.
    let images = read_images(&atlas).expect("images");
    let described = document(&atlas);
    let counts = |value: &serde_json::Value| -> [usize; 2] {
        [0, 1].map(|i| value[i].as_u64().expect("a count") as usize)
    };
    let mut cells = vec![0; images.images.len()];
    for (id, patch) in multi.patches.iter().enumerate() {
        let of_part = &figures["patches"][id];
        let block = of_part["block"].as_u64().expect("a block") as usize;
        let [first, size] = [0, 1].map(|i| counts(&of_part["cells"][i]));
        cells[block] += size[0] * size[1];
        let k = described["patches"][block]["samples_per_cell"].as_u64();
        let k = k.expect("a count") as usize;
        let [columns, rows] = size.map(|n| n * k + 1);
        assert_eq!(counts(&of_part["samples"]), [columns, rows]);
        let image = &images.images[block];
        let functions = |direction: usize, n: usize| -> Vec<Vec<f64>> {
            (0..n)
                .map(|i| patch.functions(direction, i as f64 / (n - 1) as f64))
                .collect()
        };
        let (us, vs) = (functions(0, columns), functions(1, rows));
        let (mut squares, mut largest) = (0.0, 0.0f64);
        for (i, j) in (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))) {
            let sample = image.position[(first[1] * k + j) * image.width + first[0] * k + i];
            let sample = [0, 1, 2].map(|c| f64::from(sample[c]) + images.image_origin[c]);
            let off = distance(patch.at(&us[i], &vs[j]), sample);
            squares += off * off;
            largest = largest.max(off);
            if (i == 0 || i == columns - 1) && (j == 0 || j == rows - 1) {
                assert!(off < 1e-6 * diagonal, "corner of patch {id}: {off:e}");
            }
        }
        let rms = (squares / (columns * rows) as f64).sqrt();
        let stated = &of_part["sample_error"];
        let near = |a: f64, b: &serde_json::Value| {
            (a - b.as_f64().expect("a number")).abs() < 1e-9 * diagonal
        };
        assert!(near(rms, &stated["rms"]) && near(largest, &stated["max"]));
    }
    for (block, &covered) in cells.iter().enumerate() {
        let [w, h] = counts(&described["patches"][block]["cells"]);
        assert_eq!(covered, w * h, "block {block}");
    }
    let rms = figures["surface_error"]["rms"].as_f64().expect("a number");
    assert!(rms < 0.02 * diagonal, "{name}: {:e}", rms / diagonal);
    [cells.len(), multi.patches.len()]
}

#[test]
fn genus_0_cube() {
    fixture("genus-0-cube.obj");
}

#[test]
fn genus_1_mug() {
    fixture("genus-1-mug.off");
}

/// Its blocks have T-junctions.
#[test]
fn genus_3_pretzel() {
    let [blocks, surfaces] = fixture("genus-3-pretzel.obj");
    assert!(surfaces > blocks, "{surfaces} on {blocks}");
}

#[test]
fn disk_mask() {
    fixture("disk-mask.obj");
}

#[test]
fn three_boundaries_rabbit() {
    fixture("three-boundaries-rabbit.ply");
}

/// More control points are nearer, for the samples and for the mesh itself.
#[test]
fn finer_knots_are_nearer() {
    let built = grid("genus-2-amphora.glb");
    let atlas = built.atlas();
    let out = built.folder.path().join("splines");
    let against = "fixtures/good/genus-2-amphora.glb";
    let mut last = [f64::INFINITY; 2];
    for spacing in ["8", "4", "2"] {
        let options = ["--json", "--spacing", spacing, "--against", against];
        let output = fit(&atlas, &out, &options);
        assert_eq!(output.status.code(), Some(0));
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(json["against"], "genus-2-amphora.glb");
        let errors = ["sample_error", "surface_error"].map(|key| {
            json["components"][0][key]["rms"]
                .as_f64()
                .expect("a number")
        });
        assert!(
            errors[0] < last[0] && errors[1] < last[1],
            "{spacing}: {errors:?}"
        );
        last = errors;
    }
}

/// The same bytes for any number of threads, and no surface but the images is needed to fit.
#[test]
fn threads_do_not_change_a_byte() {
    let built = grid("genus-1-mug.off");
    let atlas = built.atlas();
    let run = |threads: &str| {
        let out = built.folder.path().join(threads);
        let output = fit(&atlas, &out, &["--threads", threads]);
        assert!(output.status.success());
        files(&out)
    };
    let (one, three) = (run("1"), run("3"));
    assert_eq!(one.len(), 2);
    assert!(one == three);
}

/// Every component gets a file of its own, in a folder beside that of the atlas.
#[test]
fn components_stay_apart() {
    let built = build(Path::new("fixtures/bad/one-bad-component.obj"), &GRID);
    assert_eq!(built.code(), Some(1), "one of them is one-sided");
    let folder = built.folder.path().join("one-bad-component");
    let output = program().arg("fit").arg(&folder).output();
    assert!(output.expect("the program starts").status.success());
    let found = files(&built.folder.path().join("one-bad-component.fit"));
    let expected: Vec<PathBuf> = built.atlases();
    assert_eq!(found.len(), expected.len() + 1);
    for atlas in expected {
        let name = atlas.file_name().expect("a name").to_string_lossy();
        assert!(found.contains_key(&format!("{name}.xml")), "{name}");
    }
}

/// Numbers that are not those of the grid are refused with a sentence, whatever they are.
#[test]
fn damaged_sides_are_refused() {
    let built = grid("genus-0-cube.obj");
    let atlas = built.atlas();
    let whole = document(&atlas);
    let refitted = |json: &serde_json::Value| {
        std::fs::write(atlas.join("atlas.json"), json.to_string()).expect("written");
        affine_atlas::job::fit::fit(&atlas, &FitParams::default()).map_err(|e| e.to_string())
    };
    refitted(&whole).expect("fits as it is");
    let values = [0, 1, 2, 5, 1000, u64::MAX].map(|n| serde_json::json!(n));
    let values = [
        &values[..],
        &[serde_json::json!(-1), serde_json::Value::Null],
    ]
    .concat();
    let last = whole["patches"].as_array().expect("a list").len() - 1;
    let mut changes = 0;
    for (patch, side) in [(0, 0), (last, 3)] {
        for key in ["start", "length", "patch", "side", "other_start"] {
            for value in &values {
                let mut json = whole.clone();
                let stated = &mut json["patches"][patch]["sides"][side][0][key];
                if stated == value {
                    continue;
                }
                *stated = value.clone();
                let said = refitted(&json).expect_err("refused");
                let names = format!("patches[{patch}].sides[{side}]");
                let is_number =
                    value.is_u64() || value.is_null() && key != "start" && key != "length";
                assert!(
                    !is_number || said.contains(&names),
                    "{key} = {value}: {said}"
                );
                changes += 1;
            }
        }
    }
    assert!(changes >= 70, "{changes}");
    let mut json = whole.clone();
    json["patches"][last]["cells"][1] = serde_json::json!(0);
    let said = refitted(&json).expect_err("refused");
    assert!(
        said.contains(&format!("the image of patch {last} has")),
        "{said}"
    );
}

#[test]
fn what_is_there_stays_where_the_fit_fails() {
    let settings = ["images.domain=flat"];
    let flat = build(Path::new("fixtures/good/genus-0-cube.obj"), &settings);
    let atlas = flat.atlas();
    let out = flat.folder.path().join("splines");
    let said = |output: Output, code: i32| {
        assert_eq!(output.status.code(), Some(code));
        let text = String::from_utf8(output.stderr).expect("UTF-8");
        let folder = flat.folder.path().to_str().expect("UTF-8");
        text.replace(folder, "FOLDER")
    };
    insta::assert_snapshot!(
        said(fit(&atlas, &out, &[]), 1),
        @r#"failed: FOLDER/genus-0-cube (input): genus-0-cube: patch 0 is no block of a grid; splines need images without a mask whose sides have the same samples: build the atlas again with images.domain = "grid" (`affine-atlas build MESH --set images.domain=grid`)"#
    );
    assert!(!out.exists());

    let built = grid("genus-0-cube.obj");
    let atlas_of_grid = built.atlas();
    // Neither an atlas nor what others wrote is replaced.
    std::fs::create_dir(&out).expect("created");
    std::fs::write(out.join("notes.txt"), "mine").expect("written");
    for target in [&atlas, &out] {
        let before = files(target);
        let text = said(fit(&atlas_of_grid, target, &[]), 1);
        assert!(
            text.contains("holds nothing that this command wrote earlier"),
            "{text}"
        );
        assert_eq!(files(target), before);
    }
    // An older fit is, whole, but not by one that fails.
    std::fs::remove_file(out.join("notes.txt")).expect("there");
    let first = said(fit(&atlas_of_grid, &out, &["--spacing", "2"]), 0);
    assert_eq!(first, "");
    let before = files(&out);
    said(fit(&atlas_of_grid, &out, &[]), 0);
    let after = files(&out);
    assert!(before.keys().eq(after.keys()) && before != after);
    let image = atlas_of_grid.join("images/0000.exr");
    std::fs::write(&image, b"no image").expect("written");
    said(fit(&atlas_of_grid, &out, &[]), 1);
    assert!(files(&out) == after);
}
