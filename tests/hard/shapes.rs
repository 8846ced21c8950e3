//! Degenerate and extreme meshes, made up.

// Not every test binary uses all of it.
#![allow(dead_code)]

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::Path;

pub type Points = Vec<[f64; 3]>;
pub type Faces = Vec<[usize; 3]>;

/// An icosahedron, each face divided into 4 so many times, on the unit sphere.
pub fn sphere(divisions: usize) -> (Points, Faces) {
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
pub fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

pub fn flattened(factor: f64) -> (Points, Faces) {
    let (points, faces) = sphere(2);
    (
        points
            .into_iter()
            .map(|[x, y, z]| [x, y, factor * z])
            .collect(),
        faces,
    )
}

pub fn noisy(amount: f64) -> (Points, Faces) {
    let (points, faces) = sphere(2);
    let mut random = random(3);
    let mut scaled = |p: [f64; 3]| {
        let times = (amount * (2.0 * random() - 1.0)).exp();
        p.map(|x| x * times)
    };
    (points.into_iter().map(&mut scaled).collect(), faces)
}

/// Faces with one more vertex each, this near to one of their corners.
pub fn with_needles(distance: f64) -> (Points, Faces) {
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
pub fn cusp(rings: i32) -> (Points, Faces) {
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

pub fn rim(sides: usize) -> impl Iterator<Item = [f64; 3]> {
    (0..sides).map(move |i| {
        let (s, c) = (i as f64 * TAU / sides as f64).sin_cos();
        [c, s, 0.0]
    })
}

pub fn fan(sides: usize) -> (Points, Faces) {
    let points = [[0.0; 3]].into_iter().chain(rim(sides)).collect();
    (
        points,
        (0..sides)
            .map(|i| [0, 1 + i, 1 + (i + 1) % sides])
            .collect(),
    )
}

pub fn polygon(sides: usize) -> (Points, Faces) {
    (
        rim(sides).collect(),
        (2..sides).map(|i| [0, i - 1, i]).collect(),
    )
}

/// With coordinates of nine digits.
pub fn rounded((points, faces): (Points, Faces)) -> (Points, Faces) {
    let round = |x: f64| (1e9 * x).round() / 1e9;
    (points.into_iter().map(|p| p.map(round)).collect(), faces)
}

pub fn bipyramid(sides: usize) -> (Points, Faces) {
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

pub fn one_far(distance: f64) -> (Points, Faces) {
    let (mut points, faces) = sphere(2);
    points[5][0] += distance;
    (points, faces)
}

pub fn moved(offset: f64) -> (Points, Faces) {
    let (points, faces) = sphere(2);
    (
        points.into_iter().map(|p| p.map(|x| x + offset)).collect(),
        faces,
    )
}

/// Two spheres of very different size in one file.
pub fn of_two_sizes() -> (Points, Faces) {
    let (points, faces) = sphere(1);
    let n = points.len();
    let times = |s: f64| points.iter().map(move |p| p.map(|x| x * s));
    let second = faces.iter().map(|f| f.map(|v| v + n));
    (
        times(1e-25).chain(times(1e25)).collect(),
        faces.iter().copied().chain(second).collect(),
    )
}

pub fn two_tetrahedra_at_an_edge() -> (Points, Faces) {
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

pub fn random_positions() -> (Points, Faces) {
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

pub fn triangle(height: f64) -> (Points, Faces) {
    (
        vec![[0.0; 3], [1.0, 0.0, 0.0], [0.5, height, 0.0]],
        vec![[0, 1, 2]],
    )
}

/// Tetrahedra side by side, each a component.
pub fn tetrahedra(count: usize) -> (Points, Faces) {
    let (mut points, mut faces) = (Points::new(), Faces::new());
    for i in 0..count {
        let at = [3.0 * (i % 17) as f64, 3.0 * (i / 17) as f64, 0.0];
        let first = points.len();
        for corner in [
            [1.0, 1.0, 1.0],
            [1.0, -1.0, -1.0],
            [-1.0, 1.0, -1.0],
            [-1.0, -1.0, 1.0],
        ] {
            points.push([0, 1, 2].map(|k| at[k] + 0.01 * corner[k]));
        }
        for face in [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]] {
            faces.push(face.map(|v: usize| first + v));
        }
    }
    (points, faces)
}

/// Triangles of any three of these points.
pub fn soup(points: usize, triangles: usize) -> (Points, Faces) {
    let mut random = random(5);
    let places = (0..points)
        .map(|_| [random(), random(), random()])
        .collect();
    let mut faces = Faces::new();
    while faces.len() < triangles {
        let face = [0; 3].map(|_: usize| (points as f64 * random()) as usize);
        if face[0] != face[1] && face[1] != face[2] && face[2] != face[0] {
            faces.push(face);
        }
    }
    (places, faces)
}

/// A tube of eight sides, closed at both ends, ten thousand times as long as wide.
pub fn tube(rings: usize) -> (Points, Faces) {
    let (mut points, mut faces) = (Points::new(), Faces::new());
    let step = 2.0 / rings as f64;
    for i in 0..rings {
        points.extend((0..8).map(|j| {
            let (s, c) = (f64::from(j) * TAU / 8.0).sin_cos();
            [i as f64 * step, 1e-4 * c, 1e-4 * s]
        }));
    }
    for (i, j) in (0..rings - 1).flat_map(|i| (0..8).map(move |j| (i, j))) {
        let (a, b) = (8 * i + j, 8 * i + (j + 1) % 8);
        faces.extend([[a, a + 8, b], [b, a + 8, b + 8]]);
    }
    let (first, last) = (8 * rings, 8 * rings + 1);
    points.extend([[-step, 0.0, 0.0], [2.0, 0.0, 0.0]]);
    for j in 0..8 {
        let (a, b) = (j, (j + 1) % 8);
        faces.extend([[first, a, b], [last, 8 * rings - 8 + b, 8 * rings - 8 + a]]);
    }
    (points, faces)
}

/// Writes a mesh as an OBJ file.
pub fn write(path: &Path, (points, faces): &(Points, Faces)) {
    let mut text = String::new();
    for [x, y, z] in points {
        writeln!(text, "v {x:e} {y:e} {z:e}").unwrap();
    }
    for [a, b, c] in faces {
        writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).unwrap();
    }
    std::fs::write(path, text).unwrap();
}
