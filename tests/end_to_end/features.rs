//! Sharp edges as lines of the atlas, on a part with junctions of three and four of them.

use crate::command::{build, build_small, document, verify};
use crate::real_models::arrays::array;
use crate::real_models::lines::lines;
use std::collections::BTreeMap;
use std::fmt::Write as _;

const SEAMLESS: [&str; 2] = ["cones.strategy=field", "flow.holonomy=quarter-turns"];

/// Edges along the side of a cube.
const DIVISIONS: i32 = 8;

/// Four cubes in an L with one on top, such that at one corner four sharp edges meet, bent so that nothing is flat.
fn part() -> String {
    let cubes = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 1]];
    let mut number: BTreeMap<[i32; 3], usize> = BTreeMap::new();
    let mut faces = Vec::new();
    for cube in cubes {
        for axis in 0..3 {
            for up in [0, 1] {
                let mut beyond = cube;
                beyond[axis] += 2 * up - 1;
                if cubes.contains(&beyond) {
                    continue;
                }
                for i in 0..DIVISIONS {
                    for j in 0..DIVISIONS {
                        let corner = |di: i32, dj: i32| {
                            let mut p = cube.map(|c| c * DIVISIONS);
                            p[axis] += up * DIVISIONS;
                            p[(axis + 1) % 3] += i + di;
                            p[(axis + 2) % 3] += j + dj;
                            p
                        };
                        let quad = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                        let quad = quad.map(|p| {
                            let next = number.len() + 1;
                            *number.entry(p).or_insert(next)
                        });
                        let [a, b, c, d] = quad;
                        let pair = if (i + j) % 2 == 0 {
                            [[a, b, c], [a, c, d]]
                        } else {
                            [[a, b, d], [b, c, d]]
                        };
                        faces.extend(
                            pair.map(|[p, q, r]| if up == 1 { [p, q, r] } else { [p, r, q] }),
                        );
                    }
                }
            }
        }
    }
    let mut points: Vec<([i32; 3], usize)> = number.into_iter().collect();
    points.sort_by_key(|(_, n)| *n);
    let mut text = String::new();
    for (p, _) in points {
        let [x, y, z] = p.map(|c| f64::from(c) / f64::from(DIVISIONS));
        let (s, c) = (0.35 * z + 0.1 * x).sin_cos();
        let grown = 1.0 + 0.15 * (1.7 * y + z).sin();
        let bent = [c * x - s * y, s * x + c * y, z * grown + 0.1 * x * x];
        writeln!(text, "v {} {} {}", bent[0], bent[1], bent[2]).unwrap();
    }
    for [a, b, c] in faces {
        writeln!(text, "f {a} {b} {c}").unwrap();
    }
    text
}

#[test]
fn sharp_edges_of_a_part_are_lines() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mesh = folder.path().join("part.obj");
    std::fs::write(&mesh, part()).expect("writable");
    let built = build_small(&mesh, &SEAMLESS);
    assert_eq!(built.code(), Some(0), "{}", built.message());
    let atlas = built.atlas();
    verify(&atlas);
    let found = lines(&atlas);
    assert!(found.chains > 20, "{found:?}");
    assert!(
        found.junctions.contains_key(&3) && found.junctions.contains_key(&4),
        "{found:?}"
    );
    assert!(found.share() >= 0.95, "{:.3}: {found:?}", found.share());
    assert!(
        found.named >= found.length - found.on_lines - 1e-9 * found.length,
        "{found:?}"
    );
    // Without them only what follows the field by chance is straight.
    let without = build_small(&mesh, &[&SEAMLESS[..], &["features.angle=180"]].concat());
    let free = lines(&without.atlas());
    assert!(free.share() < 0.5, "{:.3}: {free:?}", free.share());
}

/// Vertices on straight edges make flips of faces without area possible, which were taken once: then no edge was a line.
#[test]
fn edges_of_a_chair_are_lines() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mesh = folder.path().join("chair.obj");
    std::fs::write(&mesh, include_str!("features/chair.obj")).expect("writable");
    let built = build(
        &mesh,
        &[
            "report.enabled=false",
            "images.domain=grid",
            "grid.cells=200",
        ],
    );
    assert_eq!(built.code(), Some(0), "{}", built.message());
    let atlas = built.atlas();
    verify(&atlas);
    let document = document(&atlas);
    let features = document["features"].as_array().expect("features");
    assert_eq!(features.len(), 28);
    let is_line = |f: &&serde_json::Value| f["is_line"] == true;
    assert_eq!(features.iter().filter(is_line).count(), 28);
}

/// Edges that a file names are lines, however smooth and few, and others are not.
#[test]
fn edges_of_a_file_are_lines() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let (mesh, edges) = (
        folder.path().join("part.obj"),
        folder.path().join("edges.txt"),
    );
    let text = part();
    std::fs::write(&mesh, &text).expect("writable");
    // An edge inside a side of a cube, where vertices have four faces and eight by turns.
    let faces: Vec<Vec<usize>> = (text.lines().filter_map(|line| line.strip_prefix("f ")))
        .map(|face| {
            face.split(' ')
                .map(|v| v.parse().expect("a number"))
                .collect()
        })
        .collect();
    let degree = |v: usize| faces.iter().filter(|face| face.contains(&v)).count();
    let inside = |face: &&Vec<usize>| face.iter().all(|&v| [4, 8].contains(&degree(v)));
    let [a, b, ..] = faces.iter().find(inside).expect("a face inside")[..] else {
        panic!("a face has three vertices");
    };
    let build = |row: &str, first: &str| {
        std::fs::write(&edges, row).expect("writable");
        let file = format!("features.file={}", edges.display());
        let first = format!("features.file_first_vertex={first}");
        let asked: [&str; 4] = [SEAMLESS[0], SEAMLESS[1], &file, &first];
        build_small(&mesh, &asked)
    };
    let built = build(&format!("{a} {b} # as in the OBJ\n"), "1");
    assert_eq!(built.code(), Some(0), "{}", built.message());
    let atlas = built.atlas();
    verify(&atlas);
    let document = document(&atlas);
    let features = document["features"].as_array().expect("features");
    assert_eq!(features.len(), 1, "{features:?}");
    assert_eq!(features[0]["is_line"], true);
    assert_eq!(features[0]["vertices"].as_array().map(Vec::len), Some(2));
    // Counted from 0 as they stand, the same numbers are other vertices.
    let far = faces.last().expect("a face")[0];
    let refused = build(&format!("{a} {b}\n{a} {far}\n"), "1");
    let message = refused.message();
    let named = format!("an edge from vertex {a} to vertex {far}, but no face");
    assert!(message.contains(&named), "{message}");
    let refused = build("0 100000\n", "0");
    let message = refused.message();
    assert!(
        message.contains("features.file names vertex 100000"),
        "{message}"
    );
    let listed = ["features.list=[[0, 1]]"];
    let message = build_small(&mesh, &listed).message();
    assert!(
        message.contains("features.list and cones.strategy = \"auto\" exclude"),
        "{message}"
    );
}

/// A torus whose vertices lie beside the crossings of its circles.
fn torus() -> String {
    let (around, across) = (36, 18);
    let mut text = String::new();
    let mut state = 7_u64;
    let mut beside = |k: i32, of: i32| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        let random = (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
        (f64::from(k) + 0.6 * random) / f64::from(of) * std::f64::consts::TAU
    };
    for i in 0..around {
        for j in 0..across {
            let (u, v) = (beside(i, around), beside(j, across));
            let (r, z) = (2.0 + 0.7 * v.cos(), 0.7 * v.sin());
            writeln!(text, "v {} {} {z}", r * u.cos(), r * u.sin()).unwrap();
        }
    }
    let at = |i: i32, j: i32| (i % around) * across + j % across + 1;
    for i in 0..around {
        for j in 0..across {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            writeln!(text, "f {a} {b} {c}\nf {a} {c} {d}").unwrap();
        }
    }
    text
}

/// Without lines the axes follow the directions of principal curvature: on a torus its circles.
#[test]
fn axes_follow_the_circles_of_a_torus() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mesh = folder.path().join("torus.obj");
    std::fs::write(&mesh, torus()).expect("writable");
    // Near conformal, so that directions do not spread.
    let built = build_small(&mesh, &[&SEAMLESS[..], &["flow.conformality=10"]].concat());
    assert_eq!(built.code(), Some(0), "{}", built.message());
    let atlas = built.atlas();
    verify(&atlas);
    let positions: Vec<f64> = array(&atlas, "positions");
    let faces: Vec<u32> = array(&atlas, "faces");
    let uv: Vec<f64> = array(&atlas, "central_uv");
    let mut sum = [0.0; 2];
    for (f, corners) in faces.chunks_exact(3).enumerate() {
        let p = |k: usize| {
            let at = 3 * corners[k] as usize;
            [positions[at], positions[at + 1], positions[at + 2]]
        };
        let q = |k: usize| [uv[6 * f + 2 * k], uv[6 * f + 2 * k + 1]];
        let [e, g] = [1, 2].map(|k| [0, 1, 2].map(|i| p(k)[i] - p(0)[i]));
        let [s, t] = [1, 2].map(|k| [0, 1].map(|i| q(k)[i] - q(0)[i]));
        // Along the large circle, as a e + b g.
        let circle = [-p(0)[1], p(0)[0], 0.0];
        let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
        let det = dot(e, e) * dot(g, g) - dot(e, g).powi(2);
        let a = (dot(circle, e) * dot(g, g) - dot(circle, g) * dot(e, g)) / det;
        let b = (dot(circle, g) * dot(e, e) - dot(circle, e) * dot(e, g)) / det;
        let angle = 4.0 * (a * s[1] + b * t[1]).atan2(a * s[0] + b * t[0]);
        let area = 0.5 * det.sqrt();
        sum[0] += area * angle.cos();
        sum[1] += area * angle.sin();
    }
    let (off, order) = (sum[1].atan2(sum[0]) / 4.0, sum[0].hypot(sum[1]));
    let area: f64 = 4.0 * std::f64::consts::PI.powi(2) * 2.0 * 0.7;
    assert!(order > 0.95 * area, "{order} of {area}");
    assert!(off.abs() < 0.01, "{off} rad");
}

/// Corners of boxes are off by as little as a file has digits. A side without vertices inside is triangulated across its borders, and where they become edges again no face may have its corners on one line: no angle can be told from
/// its lengths.
#[test]
fn sharp_edges_of_boxes_are_lines_however_little_their_corners_are_off() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (case, noise) in [0.0, 1e-6, 1e-5, 1e-4, 1e-3].into_iter().enumerate() {
        for seed in 0..3_u64 {
            let mut random = 7 * seed + 3;
            let mut text = String::new();
            for corner in 0..8 {
                let sides = [7.2, 7.2, 71.0];
                let at = [0, 1, 2].map(|k| {
                    random = random
                        .wrapping_mul(6_364_136_223_846_793_005)
                        .wrapping_add(1);
                    let off = (random >> 33) as f64 / f64::from(1_u32 << 30) - 1.0;
                    f64::from(corner >> k & 1) * sides[k] + noise * off
                });
                let [x, y, z] = at;
                writeln!(text, "v {x:.7} {y:.7} {z:.7}").expect("a string");
            }
            // Open above.
            for [a, b, c, d] in [
                [0, 2, 3, 1],
                [0, 1, 5, 4],
                [1, 3, 7, 5],
                [3, 2, 6, 7],
                [2, 0, 4, 6],
            ] {
                let [a, b, c, d] = [a, b, c, d].map(|k| k + 1);
                writeln!(text, "f {a} {b} {c} {d}").expect("a string");
            }
            let mesh = folder.path().join(format!("box-{case}-{seed}.obj"));
            std::fs::write(&mesh, text).expect("written");
            let built = build(&mesh, &["grid.cells=500", "report.enabled=false"]);
            let document = document(&built.atlas());
            let features = document["features"].as_array().expect("a list");
            let lines = features.iter().filter(|f| f["is_line"] == true).count();
            assert_eq!(
                (features.len(), lines),
                (8, 8),
                "noise {noise}, seed {seed}"
            );
        }
    }
}
