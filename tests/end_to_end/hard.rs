//! Degenerate and extreme meshes: each is built and passes `verify`, or is refused for a reason of its own; nothing panics, and nothing wrong
//! is published.

use affine_atlas::config::Config;
use affine_atlas::flow::cones::ConeStrategy;
use affine_atlas::flow::ricci::Solver;
use affine_atlas::flow::schemes::Scheme;
use affine_atlas::job;
use affine_atlas::outcome::FailureKind;
use affine_atlas::verify::{VerifyOptions, verify};
use std::collections::HashMap;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

type Points = Vec<[f64; 3]>;
type Faces = Vec<[usize; 3]>;

/// An icosahedron, each face divided into 4 so many times, on the unit sphere.
fn sphere(divisions: usize) -> (Points, Faces) {
    let t = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut points: Points = Vec::new();
    for (a, b) in [(-1.0, t), (1.0, t), (-1.0, -t), (1.0, -t)] {
        points.push([a, b, 0.0]);
    }
    for (a, b) in [(-1.0, t), (1.0, t), (-1.0, -t), (1.0, -t)] {
        points.push([0.0, a, b]);
    }
    for (a, b) in [(t, -1.0), (t, 1.0), (-t, -1.0), (-t, 1.0)] {
        points.push([a, 0.0, b]);
    }
    let mut faces: Faces = vec![
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    let unit = |p: [f64; 3]| p.map(|x| x / (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt());
    points.iter_mut().for_each(|p| *p = unit(*p));
    for _ in 0..divisions {
        let mut middles: HashMap<[usize; 2], usize> = HashMap::new();
        let mut finer = Vec::new();
        for [a, b, c] in faces {
            let [x, y, z] = [(a, b), (b, c), (c, a)].map(|(a, b)| {
                *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    points.push(unit([0, 1, 2].map(|i| points[a][i] + points[b][i])));
                    points.len() - 1
                })
            });
            finer.extend([[a, x, z], [b, y, x], [c, z, y], [x, y, z]]);
        }
        faces = finer;
    }
    (points, faces)
}

/// A fixed sequence of numbers from 0 to 1.
fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn flattened(factor: f64) -> (Points, Faces) {
    let (points, faces) = sphere(2);
    (
        points
            .into_iter()
            .map(|[x, y, z]| [x, y, factor * z])
            .collect(),
        faces,
    )
}

fn noisy(amount: f64) -> (Points, Faces) {
    let (points, faces) = sphere(2);
    let mut random = random(3);
    let mut scaled = |p: [f64; 3]| {
        let times = (amount * (2.0 * random() - 1.0)).exp();
        p.map(|x| x * times)
    };
    (points.into_iter().map(&mut scaled).collect(), faces)
}

/// Faces with one more vertex each, this near to one of their corners.
fn with_needles(distance: f64) -> (Points, Faces) {
    let (mut points, faces) = sphere(2);
    let mut all = Vec::new();
    for [a, b, c] in faces {
        points.push([0, 1, 2].map(|i| {
            points[a][i] * (1.0 - distance) + 0.5 * distance * (points[b][i] + points[c][i])
        }));
        let x = points.len() - 1;
        all.extend([[a, b, x], [b, c, x], [c, a, x]]);
    }
    (points, all)
}

/// A tube that gets half as wide and as long from ring to ring.
fn cusp(rings: i32) -> (Points, Faces) {
    let (mut points, mut faces) = (Vec::new(), Vec::new());
    for i in 0..rings {
        let size = 0.5_f64.powi(i);
        points.extend((0..6).map(|j| {
            let (s, c) = (f64::from(j) * TAU / 6.0).sin_cos();
            [1.0 - size, size * c, size * s]
        }));
    }
    for i in 0..rings as usize - 1 {
        for j in 0..6 {
            let (a, b) = (6 * i + j, 6 * i + (j + 1) % 6);
            faces.extend([[a, a + 6, b], [b, a + 6, b + 6]]);
        }
    }
    (points, faces)
}

fn rim(sides: usize) -> impl Iterator<Item = [f64; 3]> {
    (0..sides).map(move |i| {
        let (s, c) = (i as f64 * TAU / sides as f64).sin_cos();
        [c, s, 0.0]
    })
}

fn fan(sides: usize) -> (Points, Faces) {
    let points = [[0.0; 3]].into_iter().chain(rim(sides)).collect();
    (
        points,
        (0..sides)
            .map(|i| [0, 1 + i, 1 + (i + 1) % sides])
            .collect(),
    )
}

fn polygon(sides: usize) -> (Points, Faces) {
    (
        rim(sides).collect(),
        (2..sides).map(|i| [0, i - 1, i]).collect(),
    )
}

fn bipyramid(sides: usize) -> (Points, Faces) {
    let tips = [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    let faces = (0..sides).flat_map(|i| {
        let (a, b) = (2 + i, 2 + (i + 1) % sides);
        [[0, a, b], [1, b, a]]
    });
    (
        tips.into_iter().chain(rim(sides)).collect(),
        faces.collect(),
    )
}

fn one_far(distance: f64) -> (Points, Faces) {
    let (mut points, faces) = sphere(2);
    points[5][0] += distance;
    (points, faces)
}

fn moved(offset: f64) -> (Points, Faces) {
    let (points, faces) = sphere(2);
    (
        points.into_iter().map(|p| p.map(|x| x + offset)).collect(),
        faces,
    )
}

/// Two spheres of very different size in one file.
fn of_two_sizes() -> (Points, Faces) {
    let (points, faces) = sphere(1);
    let n = points.len();
    let times = |s: f64| points.iter().map(move |p| p.map(|x| x * s));
    let second = faces.iter().map(|f| f.map(|v| v + n));
    (
        times(1e-25).chain(times(1e25)).collect(),
        faces.iter().copied().chain(second).collect(),
    )
}

fn two_tetrahedra_at_an_edge() -> (Points, Faces) {
    let points = vec![
        [0.0; 3],
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, -1.0, 0.0],
    ];
    let faces = vec![
        [0, 1, 2],
        [0, 2, 3],
        [0, 3, 1],
        [1, 3, 2],
        [0, 1, 4],
        [0, 4, 5],
        [0, 5, 1],
        [1, 5, 4],
    ];
    (points, faces)
}

fn random_positions() -> (Points, Faces) {
    let (points, faces) = sphere(2);
    let mut random = random(11);
    (
        points
            .iter()
            .map(|_| [random(), random(), random()])
            .collect(),
        faces,
    )
}

fn triangle(height: f64) -> (Points, Faces) {
    (
        vec![[0.0; 3], [1.0, 0.0, 0.0], [0.5, height, 0.0]],
        vec![[0, 1, 2]],
    )
}

fn configurations() -> Vec<(&'static str, Config)> {
    let mut base = Config::default();
    base.pictures.enabled = false;
    base.report.enabled = false;
    base.patches.texel_budget = 4096;
    let with = |change: &dyn Fn(&mut Config)| {
        let mut config = base.clone();
        change(&mut config);
        config
    };
    vec![
        ("defaults", base.clone()),
        (
            "gradient",
            with(&|c| {
                c.flow.solver = Solver::Gradient;
                c.flow.max_gradient_steps = 3000;
            }),
        ),
        ("no flips", with(&|c| c.flow.delaunay = false)),
        ("thurston", with(&|c| c.flow.scheme = Scheme::Thurston)),
        ("single", with(&|c| c.cones.strategy = ConeStrategy::Single)),
        ("narrow range", with(&|c| c.patches.log_scale_range = 0.01)),
    ]
}

fn write(path: &Path, (points, faces): &(Points, Faces)) {
    let mut text = String::new();
    for [x, y, z] in points {
        writeln!(text, "v {x:e} {y:e} {z:e}").unwrap();
    }
    for [a, b, c] in faces {
        writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).unwrap();
    }
    std::fs::write(path, text).unwrap();
}

/// Builds a mesh with every configuration; gives how many of them were built.
fn tried(name: &str, mesh: (Points, Faces)) -> usize {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mesh.obj");
    write(&path, &mesh);
    let mut built = 0;
    for (which, config) in configurations() {
        let out = folder.path().join(which);
        let outcome = job::run(&path, "mesh.obj", &out, "mesh", &config, &());
        for (_, failure) in outcome.failures() {
            assert_ne!(
                failure.kind,
                FailureKind::Internal,
                "{name}, {which}: {}",
                failure.message
            );
        }
        if outcome.state_name() == "built" {
            built += 1;
            let verdicts = verify(&out.join("mesh"), &VerifyOptions::default()).unwrap();
            assert!(verdicts.all_passed(), "{name}, {which}: {verdicts}");
        }
    }
    built
}

/// Meshes that the defaults build, and perhaps other settings.
#[test]
fn what_can_be_built_is_built() {
    let meshes = [
        ("flattened by 1e-8", flattened(1e-8)),
        ("noisy", noisy(0.5)),
        ("needles of 1e-6", with_needles(1e-6)),
        ("cusp over 2^12", cusp(12)),
        ("fan", fan(300)),
        ("polygon", polygon(300)),
        ("bipyramid", bipyramid(300)),
        ("one far vertex", one_far(1e4)),
        ("far from the origin", moved(1e8)),
        ("two sizes", of_two_sizes()),
        ("two tetrahedra", two_tetrahedra_at_an_edge()),
        ("triangle", triangle(1.0)),
    ];
    for (name, mesh) in meshes {
        assert!(tried(name, mesh) > 0, "{name}");
    }
}

/// Meshes of which nothing is asked but that no wrong atlas is published.
#[test]
fn nothing_wrong_is_published() {
    let meshes = [
        ("flattened by 1e-12", flattened(1e-12)),
        ("flat", flattened(0.0)),
        ("very noisy", noisy(4.0)),
        ("needles of 1e-12", with_needles(1e-12)),
        ("cusp over 2^300", cusp(300)),
        ("one vertex beyond", one_far(1e18)),
        ("too far from the origin", moved(1e12)),
        ("random positions", random_positions()),
        ("needle", triangle(1e-12)),
    ];
    for (name, mesh) in meshes {
        tried(name, mesh);
    }
}

/// Fans of very many needles: all of them meet in one point, so that whoever compares them pair by pair does not come to an end.
#[test]
fn tens_of_thousands_of_needles_at_one_vertex_are_built() {
    let folder = tempfile::tempdir().unwrap();
    let (_, config) = configurations().swap_remove(0);
    for (name, mesh) in [("fan", fan(30_000)), ("polygon", polygon(30_000))] {
        let path = folder.path().join(format!("{name}.obj"));
        write(&path, &mesh);
        let outcome = job::run(&path, name, folder.path(), name, &config, &());
        let messages: Vec<String> = outcome.failures().map(|f| f.1.message.clone()).collect();
        assert_eq!(outcome.state_name(), "built", "{name}: {messages:?}");
        let verdicts = verify(&folder.path().join(name), &VerifyOptions::default()).unwrap();
        assert!(verdicts.all_passed(), "{name}: {verdicts}");
    }
}

/// The overlay of two fans of n needles has n² vertices: it is refused before it is made.
#[test]
fn triangulations_that_cross_too_often_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (_, mut config) = configurations().swap_remove(0);
    config.cones.strategy = ConeStrategy::Spread;
    config.cones.count = Some(4);
    let path = folder.path().join("bipyramid.obj");
    write(&path, &bipyramid(7000));
    let outcome = job::run(&path, "bipyramid", folder.path(), "bipyramid", &config, &());
    let failures: Vec<_> = outcome.failures().collect();
    assert_eq!(failures.len(), 1);
    let failure = failures[0].1;
    assert_eq!(failure.kind, FailureKind::Input, "{}", failure.message);
    for words in [
        "21000 edges",
        "times (most: 1336000)",
        "divide the long faces",
    ] {
        assert!(failure.message.contains(words), "{}", failure.message);
    }
}
