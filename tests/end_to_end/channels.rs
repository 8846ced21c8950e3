//! Attributes of a mesh file in its geometry images: against every face of the file, one by one, and from the files alone.

use crate::command::{Built, build, build_into, document, program, verify};
use crate::good::files;
use exr::prelude::{FlatSamples, read_all_flat_layers_from_file};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

const NONE: u32 = u32::MAX;
const ALL: &str =
    "images.channels=[\"normal\", \"source-normal\", \"color\", \"texcoord\", \"material\"]";
/// Texels are rounded to 2⁻²⁴ of the model's size, whose faces are a fifth of it.
const TOLERANCE: f64 = 1e-5;

type P3 = [f64; 3];

/// A file's faces with everything at their corners.
#[derive(Default)]
struct Source {
    position: Vec<[P3; 3]>,
    normal: Vec<[P3; 3]>,
    color: Vec<[P3; 3]>,
    /// V up, as OBJ has it.
    texcoord: Vec<[[f64; 2]; 3]>,
    material: Vec<u32>,
}

fn minus(a: P3, b: P3) -> P3 {
    [0, 1, 2].map(|i| a[i] - b[i])
}

fn dot(a: P3, b: P3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: P3, b: P3) -> P3 {
    [0, 1, 2].map(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
}

fn unit(a: P3) -> P3 {
    a.map(|x| x / dot(a, a).sqrt())
}

/// Numbers from 0 to 1 without a pattern.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        ((self.0 >> 33) % 100_000) as f64 / 100_000.0
    }
}

/// A bumpy octahedron in a file: normals and texture coordinates differ from corner to corner, colours from vertex to vertex, materials
/// from face to face; a few faces are turned over, and some have no material.
fn bumpy(path: &Path) -> Source {
    let mut random = Random(11);
    let mut points: Vec<P3> = Vec::new();
    let mut known: BTreeMap<[i32; 3], usize> = BTreeMap::new();
    let mut faces: Vec<[usize; 3]> = Vec::new();
    const N: i32 = 4;
    for signs in 0..8 {
        let sign = |i: u32| if signs >> i & 1 == 0 { 1 } else { -1 };
        let mut vertex = |i: i32, j: i32| {
            let k = N - i - j;
            let place = [i * sign(0), j * sign(1), k * sign(2)];
            *known.entry(place).or_insert_with(|| {
                let r = 0.9 + 0.2 * random.next();
                points.push(unit(place.map(f64::from)).map(|x| (1e4 * r * x).round() / 1e4));
                points.len() - 1
            })
        };
        let mut add = |a, b, c| match signs {
            0 | 3 | 5 | 6 => faces.push([a, b, c]),
            _ => faces.push([a, c, b]),
        };
        for i in 0..N {
            for j in 0..N - i {
                add(vertex(i, j), vertex(i + 1, j), vertex(i, j + 1));
                if i + j < N - 1 {
                    add(vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1));
                }
            }
        }
    }
    for f in [5, 40, 41, 90] {
        faces[f].swap(1, 2);
    }
    let colors: Vec<P3> = points
        .iter()
        .map(|_| [0; 3].map(|_| random.next()))
        .collect();
    let mut text = String::new();
    for (p, c) in points.iter().zip(&colors) {
        let numbers = p.iter().chain(c).map(|x| format!(" {x}"));
        let _ = writeln!(text, "v{}", numbers.collect::<String>());
    }
    let mut source = Source::default();
    for (f, corners) in faces.iter().enumerate() {
        let material = (f / 20) as u32;
        if f >= 20 && f % 20 == 0 {
            let _ = writeln!(text, "usemtl paint{material}");
        }
        source.material.push(match f {
            0..20 => NONE,
            _ => material - 1,
        });
        let mut normal = [[0.0; 3]; 3];
        let mut uv = [[0.0; 2]; 3];
        for k in 0..3 {
            // Any direction to the outside, whichever way the face is turned.
            let p = points[corners[k]];
            normal[k] = unit([0, 1, 2].map(|i| p[i] + 0.4 * (random.next() - 0.5)));
            uv[k] = [random.next(), random.next()];
            let [x, y, z] = normal[k];
            let _ = writeln!(text, "vn {x} {y} {z}\nvt {} {}", uv[k][0], uv[k][1]);
        }
        let corner = |k: usize| format!(" {}/{n}/{n}", corners[k] + 1, n = 3 * f + k + 1);
        let _ = writeln!(text, "f{}{}{}", corner(0), corner(1), corner(2));
        source.position.push(corners.map(|v| points[v]));
        source.color.push(corners.map(|v| colors[v]));
        source.normal.push(normal);
        source.texcoord.push(uv);
    }
    std::fs::write(path, text).expect("written");
    source
}

/// The channels of an image by name, and its columns.
fn channels(path: &Path) -> (BTreeMap<String, FlatSamples>, usize) {
    let image = read_all_flat_layers_from_file(path).expect("readable");
    let layer = image.layer_data.into_iter().next().expect("a layer");
    let list = layer.channel_data.list.into_iter();
    let channels = list.map(|c| (c.name.to_string(), c.sample_data));
    (channels.collect(), layer.size.0)
}

fn floats(channels: &BTreeMap<String, FlatSamples>, names: &[&str]) -> Vec<Vec<f64>> {
    let column = |name: &&str| match &channels[*name] {
        FlatSamples::F32(values) => values.iter().map(|&x| f64::from(x)).collect(),
        FlatSamples::F16(values) => values.iter().map(|x| f64::from(x.to_f32())).collect(),
        FlatSamples::U32(values) => values.iter().map(|&x| f64::from(x)).collect::<Vec<f64>>(),
    };
    let columns: Vec<Vec<f64>> = names.iter().map(column).collect();
    let texels = 0..columns[0].len();
    texels
        .map(|at| columns.iter().map(|c| c[at]).collect())
        .collect()
}

/// Barycentric coordinates in a triangle whose plane the point lies in.
fn weights(t: [P3; 3], p: P3) -> Option<P3> {
    let n = cross(minus(t[1], t[0]), minus(t[2], t[0]));
    let away = dot(minus(p, t[0]), unit(n)).abs();
    let part = |a: P3, b: P3| dot(cross(minus(a, p), minus(b, p)), n) / dot(n, n);
    let w = [part(t[1], t[2]), part(t[2], t[0]), part(t[0], t[1])];
    (away < 1e-6 && w.iter().all(|&w| w > -1e-6)).then_some(w)
}

/// The greatest differences of colour, texture coordinate and normal, and how many texels have another material, from what the faces
/// of the file have at the texels' positions; a texel on an edge may be of either face.
fn compare(source: &Source, path: &Path) -> (f64, usize, usize) {
    let (channels, _) = channels(path);
    let own = floats(
        &channels,
        &[
            "R",
            "G",
            "B",
            "A",
            "color.R",
            "color.G",
            "color.B",
            "color.A",
            "texcoord0.U",
            "texcoord0.V",
            "sourceNormal.X",
            "sourceNormal.Y",
            "sourceNormal.Z",
            "material.id",
        ],
    );
    let (mut worst, mut tested, mut wrong_material) = (0.0f64, 0, 0);
    for texel in own.iter().filter(|texel| texel[3] == 1.0) {
        let p = [texel[0], texel[1], texel[2]];
        let mut found: Vec<(f64, bool)> = Vec::new();
        for f in 0..source.position.len() {
            let Some(w) = weights(source.position[f], p) else {
                continue;
            };
            let mix = |value: &dyn Fn(usize) -> f64| (0..3).map(|k| w[k] * value(k)).sum::<f64>();
            let mut want: Vec<f64> = (0..3).map(|i| mix(&|k| source.color[f][k][i])).collect();
            want.push(1.0);
            want.push(mix(&|k| source.texcoord[f][k][0]));
            want.push(1.0 - mix(&|k| source.texcoord[f][k][1]));
            want.extend(unit([0, 1, 2].map(|i| mix(&|k| source.normal[f][k][i]))));
            let errors = want.iter().zip(&texel[4..]).map(|(a, b)| (a - b).abs());
            let is_material = texel[13] == f64::from(source.material[f]);
            found.push((errors.fold(0.0, f64::max), is_material));
        }
        assert!(!found.is_empty(), "{p:?} lies on no face");
        let best = found
            .iter()
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .expect("one");
        worst = worst.max(best.0);
        wrong_material += usize::from(!found.iter().any(|f| f.1));
        tested += 1;
    }
    assert_eq!(wrong_material, 0);
    (worst, tested, own.len() - tested)
}

fn images(atlas: &Path) -> Vec<std::path::PathBuf> {
    let described = document(atlas);
    let patches = described["patches"].as_array().expect("a list").iter();
    patches
        .map(|p| atlas.join(p["image"].as_str().expect("a path")))
        .collect()
}

#[test]
fn attributes_are_those_of_the_files_faces() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mesh = folder.path().join("bumpy.obj");
    let source = bumpy(&mesh);
    for (domain, size, outside) in [
        ("flat", "patches.texel_budget=40000", true),
        ("grid", "grid.cells=600", false),
    ] {
        let domain = format!("images.domain={domain}");
        let built = build(&mesh, &[ALL, &domain, size]);
        let atlas = built.atlas();
        verify(&atlas);
        let (mut worst, mut tested, mut around) = (0.0f64, 0, 0);
        for image in images(&atlas) {
            let (error, inside, other) = compare(&source, &image);
            worst = worst.max(error);
            tested += inside;
            around += other;
        }
        assert!(worst < TOLERANCE, "{domain}: {worst:e}");
        assert!(
            tested > 10_000 && (around > 0) == outside,
            "{tested} {around}"
        );
        let held = document(&atlas)["images"].clone();
        assert_eq!(
            held["channels"],
            serde_json::json!(["normal", "source-normal", "color", "texcoord", "material"])
        );
    }
}

#[test]
fn outside_the_mask_all_channels_are_those_of_the_same_texel() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mesh = folder.path().join("bumpy.obj");
    bumpy(&mesh);
    let built = build(&mesh, &[ALL, "patches.texel_budget=4096"]);
    let mut compared = 0;
    for image in images(&built.atlas()) {
        let (channels, width) = channels(&image);
        let names: Vec<&str> = channels
            .keys()
            .map(String::as_str)
            .filter(|n| *n != "A")
            .collect();
        let (alpha, texels) = (floats(&channels, &["A"]), floats(&channels, &names));
        let inside: Vec<usize> = (0..alpha.len()).filter(|&at| alpha[at][0] == 1.0).collect();
        for at in (0..alpha.len()).filter(|&at| alpha[at][0] == 0.0) {
            let squared = |other: usize| {
                let x = (other % width).abs_diff(at % width);
                let y = (other / width).abs_diff(at / width);
                x * x + y * y
            };
            let nearest = inside
                .iter()
                .map(|&i| squared(i))
                .min()
                .expect("texels inside");
            let mut sources = inside.iter().filter(|&&i| squared(i) == nearest);
            assert!(sources.any(|&i| texels[i] == texels[at]), "texel {at}");
            compared += 1;
        }
    }
    assert!(compared > 500, "{compared}");
}

/// Sizes in bytes of a number of each channel.
fn types(path: &Path) -> BTreeMap<String, usize> {
    let (channels, _) = channels(path);
    let bytes = |samples: &FlatSamples| match samples {
        FlatSamples::F16(_) => 2,
        FlatSamples::F32(_) | FlatSamples::U32(_) => 4,
    };
    channels
        .iter()
        .map(|(name, samples)| (name.clone(), bytes(samples)))
        .collect()
}

#[test]
fn half_is_for_normals_only_and_turns_them_little() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mesh = folder.path().join("bumpy.obj");
    bumpy(&mesh);
    let budget = "patches.texel_budget=10000";
    let whole = build(&mesh, &[ALL, budget]);
    let half = build(&mesh, &[ALL, budget, "images.normal_precision=half"]);
    let (whole, half) = (whole.atlas(), half.atlas());
    verify(&half);
    let mut greatest = 0.0f64;
    for (a, b) in images(&whole).iter().zip(images(&half)) {
        for (name, bytes) in types(&b) {
            let is_normal = name.starts_with("normal.") || name.starts_with("sourceNormal.");
            assert_eq!(bytes, if is_normal { 2 } else { 4 }, "{name}");
        }
        let (a, b) = (channels(a).0, channels(&b).0);
        for (name, samples) in &a {
            if types_differ(samples, &b[name]) {
                let names = [name.as_str()];
                let pairs = floats(&a, &names).into_iter().zip(floats(&b, &names));
                let differences = pairs.map(|(x, y)| (x[0] - y[0]).abs());
                greatest = differences.fold(greatest, f64::max);
            } else {
                assert_eq!(*samples, b[name], "{name}");
            }
        }
    }
    assert!(greatest > 1e-5 && greatest <= 1.0 / 4096.0, "{greatest:e}");
}

fn types_differ(a: &FlatSamples, b: &FlatSamples) -> bool {
    std::mem::discriminant(a) != std::mem::discriminant(b)
}

#[test]
fn what_a_mesh_does_not_have_is_left_out_and_said_once() {
    let mut command = program();
    let folder = tempfile::tempdir().expect("a temporary folder");
    command.args(["build", "fixtures/good/genus-3-pretzel.obj", "--out"]);
    command.arg(folder.path());
    command.args(["--set", ALL, "--set", "pictures.enabled=false"]);
    let output = command.output().expect("the program starts");
    let built = Built { folder, output };
    let said = built.message();
    for channel in ["source-normal", "color", "texcoord", "material"] {
        let sentence = format!(
            "fixtures/good/genus-3-pretzel.obj has nothing for the channel \"{channel}\" of images.channels"
        );
        assert_eq!(said.matches(&sentence).count(), 1, "{said}");
    }
    let atlas = built.atlas();
    verify(&atlas);
    assert_eq!(
        document(&atlas)["images"]["channels"],
        serde_json::json!(["normal"])
    );
    let names: Vec<String> = types(&images(&atlas)[0]).into_keys().collect();
    assert_eq!(
        names,
        ["A", "B", "G", "R", "normal.X", "normal.Y", "normal.Z"]
    );
}

#[test]
fn by_default_images_hold_what_they_always_held() {
    let built = build(Path::new("fixtures/good/genus-0-cube.obj"), &[]);
    let atlas = built.atlas();
    assert!(document(&atlas).get("images").is_none());
    let names: Vec<String> = types(&images(&atlas)[0]).into_keys().collect();
    assert_eq!(
        names,
        [
            "A",
            "B",
            "G",
            "R",
            "normal.X",
            "normal.Y",
            "normal.Z",
            "surface.face",
            "surface.logScale"
        ]
    );
}

#[test]
fn the_same_bytes_for_any_number_of_threads() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mesh = folder.path().join("bumpy.obj");
    bumpy(&mesh);
    let run = |threads: &str| {
        let out = tempfile::tempdir().expect("a temporary folder");
        let threads = format!("run.threads={threads}");
        let output = build_into(out.path(), &mesh, &[ALL, &threads]);
        assert!(output.status.success());
        files(&out.path().join("bumpy"))
    };
    assert!(run("1") == run("3"));
}

/// A channel that atlas.json promises and an image lacks is found, and one of another type.
#[test]
fn verify_misses_promised_channels() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mesh = folder.path().join("bumpy.obj");
    bumpy(&mesh);
    let built = build(
        &mesh,
        &["images.channels=[\"normal\"]", "patches.texel_budget=10000"],
    );
    let atlas = built.atlas();
    let path = atlas.join("atlas.json");
    let honest = document(&atlas);
    for (key, value, what) in [
        (
            "channels",
            serde_json::json!(["normal", "color"]),
            "lacks color.R as floats of 32 bits",
        ),
        (
            "channels",
            serde_json::json!(["normal", "material"]),
            "lacks material.id",
        ),
        (
            "channels",
            serde_json::json!(["depth"]),
            "unknown channel \"depth\"",
        ),
        (
            "normal_precision",
            serde_json::json!("half"),
            "not in the precision half",
        ),
    ] {
        let mut stated = honest.clone();
        stated["images"][key] = value;
        std::fs::write(&path, stated.to_string()).expect("written");
        let output = program().arg("verify").arg(&atlas).output();
        let said = output.expect("the program starts").stdout;
        let said = String::from_utf8_lossy(&said);
        let failed: Vec<&str> = said.lines().filter(|l| l.starts_with("FAIL")).collect();
        let [only] = failed[..] else {
            panic!("{failed:?}");
        };
        assert!(
            only.contains("images keep the contract's layout") && only.contains(what),
            "{only}"
        );
    }
}

/// Weights of a point near a triangle; none where it lies outside or beside it.
fn near(t: &[P3; 3], p: P3) -> Option<[f64; 3]> {
    let (a, b, d) = (minus(t[1], t[0]), minus(t[2], t[0]), minus(p, t[0]));
    let n = cross(a, b);
    let square = dot(n, n);
    let v = dot(cross(d, b), n) / square;
    let w = dot(cross(a, d), n) / square;
    let weights = [1.0 - v - w, v, w];
    let is_near = dot(d, n).abs() / square.sqrt() < 1e-4;
    (is_near && weights.iter().all(|x| *x > -1e-3)).then_some(weights)
}

/// Corners of quads have the texture coordinates of a face of the file that they lie in, and quads inside one face have its material.
#[test]
fn the_quad_mesh_has_materials_and_texture_coordinates() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mesh = folder.path().join("bumpy.obj");
    let source = bumpy(&mesh);
    let built = build(&mesh, &["report.enabled=false"]);
    let text = std::fs::read_to_string(built.atlas().join("quads.obj")).expect("quads.obj");
    let (mut points, mut coordinates) = (Vec::new(), Vec::new());
    let (mut material, mut names) = (String::new(), BTreeMap::new());
    let (mut corners_seen, mut inside) = (0, 0);
    for line in text.lines() {
        let (kind, rest) = line.split_once(' ').expect("words");
        let numbers = || rest.split(' ').map(|x| x.parse::<f64>().expect("a number"));
        match kind {
            "v" => points.push(<P3>::try_from(numbers().collect::<Vec<_>>()).expect("three")),
            "vt" => coordinates.push(numbers().collect::<Vec<_>>()),
            "usemtl" => material = rest.to_owned(),
            _ => {
                *names.entry(material.clone()).or_insert(0) += 1;
                let mut around: Vec<Vec<usize>> = Vec::new();
                for corner in rest.split(' ') {
                    let (v, t) = corner.split_once('/').expect("texture coordinates");
                    let [v, t] = [v, t].map(|x| x.parse::<usize>().expect("a row") - 1);
                    let mut best = f64::INFINITY;
                    around.push(Vec::new());
                    for (f, t3) in source.position.iter().enumerate() {
                        let Some(weights) = near(t3, points[v]) else {
                            continue;
                        };
                        around.last_mut().expect("a corner").push(f);
                        let of = |i: usize| -> f64 {
                            (0..3).map(|k| weights[k] * source.texcoord[f][k][i]).sum()
                        };
                        let [u, v] = [0, 1].map(|i| of(i) - coordinates[t][i]);
                        best = best.min(u.hypot(v));
                    }
                    assert!(best < 0.01, "{line}: {best}");
                    corners_seen += 1;
                }
                let face = around[0][0];
                if around.iter().all(|faces| *faces == [face]) {
                    let name = match source.material[face] {
                        NONE => "none".to_owned(),
                        m => format!("paint{}", m + 1),
                    };
                    assert_eq!(material, name, "{line}");
                    inside += 1;
                }
            }
        }
    }
    assert!(
        corners_seen > 4000 && inside > 500,
        "{corners_seen} {inside}"
    );
    assert_eq!(names.len(), 7, "{names:?}");
}
