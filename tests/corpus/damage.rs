//! Damaged, scaled and moved meshes: the program mends or refuses them, quickly, and loses no index.
//!
//! The cases run on committed fixtures, and on real models where `AFFINE_ATLAS_CORPUS` names a folder that has them;
//! without it those are reported as ignored.

use crate::command::{Built, build_small, document, verify};
use crate::real_models::arrays::array;
use libtest_mimic::{Failed, Trial};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// No atlas of a mesh this small, with small images, may take longer.
const LIMIT: Duration = Duration::from_secs(10);

pub fn trials() -> Vec<Trial> {
    let corpus = std::env::var_os("AFFINE_ATLAS_CORPUS").map(PathBuf::from);
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/good");
    let real = |name: &str| corpus.as_ref().map(|folder| folder.join(name));
    let mut trials = Vec::new();
    let mut add = |name: String, mesh: Option<PathBuf>, test: fn(&str, &Mesh)| {
        let case = name.rsplit('/').next().unwrap_or_default().to_owned();
        let ignored = mesh.is_none();
        let trial = Trial::test(name, move || run(mesh.as_deref(), &case, test));
        trials.push(trial.with_ignored_flag(ignored));
    };
    for (what, mesh) in [
        ("animal", Some(fixtures.join("genus-0-animal.ply"))),
        ("spot", real("spot.obj")),
    ] {
        for (defect, _, _) in DEFECTS {
            add(
                format!("damage/defect/{what}/{defect}"),
                mesh.clone(),
                damaged,
            );
        }
    }
    for (what, mesh) in [
        ("mug", Some(fixtures.join("genus-1-mug.off"))),
        ("rocker-arm", real("rocker-arm.obj")),
    ] {
        for (case, _, _) in SIMILARITIES {
            add(
                format!("damage/similarity/{what}/{case}"),
                mesh.clone(),
                similar,
            );
        }
    }
    trials
}

fn run(mesh: Option<&Path>, case: &str, test: fn(&str, &Mesh)) -> Result<(), Failed> {
    if let Some(path) = mesh {
        test(case, &Mesh::read(path)?);
    }
    Ok(())
}

/// Vertices and polygons as an OBJ file lists them.
#[derive(Clone)]
struct Mesh {
    positions: Vec<[f64; 3]>,
    faces: Vec<Vec<u32>>,
}

impl Mesh {
    fn read(path: &Path) -> Result<Self, Failed> {
        let soup = affine_atlas::read::read(path, &Default::default())?.soup;
        Ok(Self {
            positions: soup.positions,
            faces: soup.faces.iter().map(|f| f.to_vec()).collect(),
        })
    }

    /// Plain text, every number with 17 significant digits.
    fn obj(&self) -> String {
        let mut text = String::new();
        for [x, y, z] in &self.positions {
            writeln!(text, "v {x:.16e} {y:.16e} {z:.16e}").expect("written");
        }
        for face in &self.faces {
            let corners: Vec<String> = face.iter().map(|v| (v + 1).to_string()).collect();
            writeln!(text, "f {}", corners.join(" ")).expect("written");
        }
        text
    }

    fn build(&self, settings: &[&str]) -> Built {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("mesh.obj");
        std::fs::write(&path, self.obj()).expect("written");
        build_small(&path, settings)
    }

    fn diagonal(&self) -> f64 {
        let extent = |i: usize| {
            let values = self.positions.iter().map(|p| p[i]);
            let range = values.fold((f64::MAX, f64::MIN), |r, x| (r.0.min(x), r.1.max(x)));
            range.1 - range.0
        };
        (extent(0).powi(2) + extent(1).powi(2) + extent(2).powi(2)).sqrt()
    }

    /// A face in the middle of the list, so that what follows it would shift.
    fn middle(&self) -> usize {
        self.faces.len() / 2
    }

    fn add(&mut self, position: [f64; 3]) -> u32 {
        self.positions.push(position);
        self.positions.len() as u32 - 1
    }
}

/// What must come of a defect.
enum Outcome {
    /// So many components are built, each of which passes.
    Built(usize),
    /// The message says this.
    Refused(&'static str),
}
use Outcome::{Built as Yields, Refused};

type Defect = (&'static str, fn(&Mesh) -> Mesh, Outcome);

const DEFECTS: [Defect; 11] = [
    ("two-components", two_components, Yields(2)),
    ("zero-length-edge", zero_length_edge, Yields(1)),
    ("zero-area-face", zero_area_face, Yields(1)),
    ("reversed-face", reversed_face, Yields(1)),
    ("duplicated-face", duplicated_face, Yields(1)),
    ("repeated-corner", repeated_corner, Yields(1)),
    ("bowtie-vertex", bowtie_vertex, Yields(2)),
    ("fin", fin, Yields(2)),
    ("unreferenced-vertex", unreferenced_vertex, Yields(1)),
    ("unwelded-soup", unwelded_soup, Yields(1)),
    ("moebius-strip", moebius_strip, Refused("one-sided")),
];

fn two_components(mesh: &Mesh) -> Mesh {
    let mut both = mesh.clone();
    let (count, apart) = (mesh.positions.len() as u32, 2.0 * mesh.diagonal());
    let moved = mesh.positions.iter().map(|p| [p[0] + apart, p[1], p[2]]);
    both.positions.extend(moved);
    let shifted = mesh
        .faces
        .iter()
        .map(|f| f.iter().map(|v| v + count).collect());
    both.faces.extend(shifted.collect::<Vec<_>>());
    both
}

fn zero_length_edge(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone();
    let face = &mesh.faces[mesh.middle()];
    let (a, b) = (face[0] as usize, face[1] as usize);
    mesh.positions[a] = mesh.positions[b];
    mesh
}

/// A vertex goes onto an edge of one of its faces: the face has no area, and all its edges have a length.
fn zero_area_face(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone();
    let [a, b, c] = [0, 1, 2].map(|k| mesh.faces[mesh.middle()][k] as usize);
    let (p, q) = (mesh.positions[b], mesh.positions[c]);
    mesh.positions[a] = std::array::from_fn(|i| 0.5 * (p[i] + q[i]));
    mesh
}

fn reversed_face(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone();
    let face = mesh.middle();
    mesh.faces[face].reverse();
    mesh
}

fn duplicated_face(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone();
    let face = mesh.middle();
    mesh.faces.insert(face, mesh.faces[face].clone());
    mesh
}

/// Like `5 5 7`.
fn repeated_corner(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone();
    let face = mesh.middle();
    let [a, b] = [mesh.faces[face][0], mesh.faces[face][1]];
    mesh.faces.insert(face, vec![a, a, b]);
    mesh
}

/// The mesh and its point reflection at one vertex, which both use.
fn bowtie_vertex(mesh: &Mesh) -> Mesh {
    let mut both = mesh.clone();
    let count = mesh.positions.len();
    let shared = (0..count)
        .max_by(|&v, &w| mesh.positions[v][1].total_cmp(&mesh.positions[w][1]))
        .expect("vertices");
    let centre = mesh.positions[shared];
    let reflected = |p: &[f64; 3]| std::array::from_fn(|i| 2.0 * centre[i] - p[i]);
    both.positions.extend(mesh.positions.iter().map(reflected));
    for face in &mesh.faces {
        let twin = face.iter().rev().map(|&v| match v as usize == shared {
            true => v,
            false => v + count as u32,
        });
        both.faces.push(twin.collect());
    }
    both
}

/// A third face on an edge.
fn fin(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone();
    let face = mesh.middle();
    let [a, b] = [mesh.faces[face][0], mesh.faces[face][1]];
    let p = mesh.positions[a as usize];
    let tip = mesh.add(p.map(|x| x + 0.4 * mesh.diagonal()));
    mesh.faces.push(vec![a, b, tip]);
    mesh
}

/// In the middle of the list, so that every later vertex would shift if it were dropped.
fn unreferenced_vertex(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone();
    let at = mesh.positions.len() / 2;
    mesh.positions.insert(at, [9.0, 9.0, 9.0]);
    for v in mesh.faces.iter_mut().flatten() {
        *v += u32::from(*v as usize >= at);
    }
    mesh
}

fn unwelded_soup(mesh: &Mesh) -> Mesh {
    let corners = mesh.faces.iter().flatten();
    Mesh {
        positions: corners.map(|&v| mesh.positions[v as usize]).collect(),
        faces: (0..mesh.faces.len() as u32)
            .map(|f| vec![3 * f, 3 * f + 1, 3 * f + 2])
            .collect(),
    }
}

/// Two faces that share no vertex are removed and joined by a tube of six triangles. Joined the one way round the tube
/// is a handle; joined the other way, as here, a band along it is a Möbius strip, and the surface is one-sided.
fn moebius_strip(mesh: &Mesh) -> Mesh {
    let mut mesh = mesh.clone();
    let first = mesh.faces.remove(mesh.middle());
    let touches = |f: &&Vec<u32>| f.iter().any(|v| first.contains(v));
    let neighbours: Vec<Vec<u32>> = mesh.faces.iter().filter(touches).cloned().collect();
    let apart = |f: &Vec<u32>| !neighbours.iter().flatten().any(|v| f.contains(v));
    let at = mesh.faces.iter().position(apart).expect("a large mesh");
    let second = mesh.faces.remove(at);
    for k in 0..3 {
        let next = (k + 1) % 3;
        mesh.faces.push(vec![first[k], first[next], second[next]]);
        mesh.faces.push(vec![first[k], second[next], second[k]]);
    }
    mesh
}

fn damaged(defect: &str, mesh: &Mesh) {
    let (_, damage, outcome) = (DEFECTS.iter())
        .find(|(name, _, _)| *name == defect)
        .expect("the names come from this table");
    let damaged = damage(mesh);
    let start = Instant::now();
    let built = damaged.build(&[]);
    let taken = start.elapsed();
    let message = built.message();
    assert!(!message.contains("panic"), "{message}");
    let atlases = built.atlases();
    match outcome {
        Yields(components) => {
            assert_eq!(built.code(), Some(0), "{message}");
            assert_eq!(atlases.len(), *components, "{atlases:?}");
        }
        Refused(reason) => {
            assert_eq!(built.code(), Some(1), "{message}");
            assert!(atlases.is_empty(), "{atlases:?}");
            assert!(message.contains(reason), "{message}");
        }
    }
    for atlas in &atlases {
        verify(atlas);
        indices_are_those_of(&damaged, atlas);
    }
    assert!(taken < LIMIT, "{taken:?}");
}

/// Whether a point lies in a triangle, to 1e-9 of its area: then the three triangles with the sides fill it.
fn lies_in(p: [f64; 3], face: &[[f64; 3]]) -> bool {
    let [a, b, c] = *face else { return false };
    let area = |a: [f64; 3], b: [f64; 3], c: [f64; 3]| {
        let (u, v): ([f64; 3], [f64; 3]) = (
            std::array::from_fn(|i| b[i] - a[i]),
            std::array::from_fn(|i| c[i] - a[i]),
        );
        let normal: [f64; 3] = std::array::from_fn(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            u[j] * v[k] - u[k] * v[j]
        });
        normal.iter().map(|x| x * x).sum::<f64>().sqrt()
    };
    let whole = area(a, b, c);
    area(p, a, b) + area(p, b, c) + area(p, c, a) <= (1.0 + 1e-9) * whole
}

/// `source_vertex` and `source_face` name the input's own vertices and faces.
fn indices_are_those_of(mesh: &Mesh, atlas: &Path) {
    let positions: Vec<f64> = array(atlas, "positions");
    let source: Vec<u32> = array(atlas, "source_vertex");
    let mut kept = 0;
    for (v, &original) in source.iter().enumerate() {
        if original == u32::MAX {
            continue;
        }
        kept += 1;
        let here: [f64; 3] = std::array::from_fn(|i| positions[3 * v + i]);
        assert_eq!(here, mesh.positions[original as usize], "vertex {v}");
    }
    assert!(kept > 0, "no vertex of the input is left");

    // Every corner that comes from the input is a corner of the face it is said to come from, and every other one lies in that
    // face; as the same position may have several vertices, positions are compared.
    let faces: Vec<u32> = array(atlas, "faces");
    let source_face: Vec<u32> = array(atlas, "source_face");
    let mut placed = 0;
    for (corners, &original) in faces.chunks_exact(3).zip(&source_face) {
        let given: Vec<[f64; 3]> = mesh.faces[original as usize]
            .iter()
            .map(|&v| mesh.positions[v as usize])
            .collect();
        let good = corners.iter().all(|&v| {
            let here: [f64; 3] = std::array::from_fn(|i| positions[3 * v as usize + i]);
            match source[v as usize] {
                u32::MAX => lies_in(here, &given),
                _ => given.contains(&here),
            }
        });
        // A face that lost its area is split where its neighbours meet it.
        placed += usize::from(good);
    }
    assert!(
        2 * placed > faces.len() / 3,
        "only {placed} faces are where they were"
    );
}

/// A name, the factor, and whether the mesh is moved far away.
const SIMILARITIES: [(&str, f64, f64); 4] = [
    ("thousandth", 1e-3, 0.0),
    ("thousand", 1e3, 0.0),
    ("million", 1e6, 0.0),
    ("far-away", 1.0, 1e5),
];

fn similar(case: &str, mesh: &Mesh) {
    let (_, scale, diagonals) = (SIMILARITIES.iter())
        .find(|(name, _, _)| *name == case)
        .expect("the names come from this table");
    let mut other = mesh.clone();
    let shift = diagonals * mesh.diagonal();
    for p in &mut other.positions {
        *p = [p[0] * scale + shift, p[1] * scale, p[2] * scale - shift];
    }
    let (plain, changed) = (mesh.build(&[]), other.build(&[]));
    let (plain, changed) = (plain.atlas(), changed.atlas());
    verify(&changed);

    for name in [
        "faces",
        "source_vertex",
        "source_face",
        "segment",
        "patch",
        "seam_patch",
    ] {
        let (a, b): (Vec<u32>, Vec<u32>) = (array(&plain, name), array(&changed, name));
        assert!(a == b, "{name} differs");
    }
    let (a, b): (Vec<u8>, Vec<u8>) = (array(&plain, "cut"), array(&changed, "cut"));
    assert!(a == b, "the cut differs");
    let (a, b) = (document(&plain), document(&changed));
    let sizes = |d: &serde_json::Value| -> Vec<(u64, u64)> {
        let patches = d["patches"].as_array().expect("a list").iter();
        let size = |p: &serde_json::Value, key: &str| p[key].as_u64().expect("a number");
        patches
            .map(|p| (size(p, "width"), size(p, "height")))
            .collect()
    };
    assert_eq!(sizes(&a), sizes(&b));
    for (figure, factor) in [("area_distortion", 1.0), ("cut_length", *scale)] {
        let of = |d: &serde_json::Value| d["quality"][figure].as_f64().expect("a number");
        let relative = (of(&b) / factor / of(&a) - 1.0).abs();
        assert!(relative < 1e-6, "{figure} is off by {relative}");
    }
    same_coordinates(&plain, &changed, *scale);
}

/// The central charts are the same up to the factor, to 1e-6 of the chart.
fn same_coordinates(plain: &Path, changed: &Path, scale: f64) {
    let (a, b): (Vec<f64>, Vec<f64>) = (array(plain, "central_uv"), array(changed, "central_uv"));
    let size = a.iter().fold(0.0_f64, |size, x| size.max(x.abs()));
    let apart = a.iter().zip(&b).map(|(x, y)| (y / scale - x).abs());
    let worst = apart.fold(0.0, f64::max);
    assert!(worst <= 1e-6 * size, "{worst} of {size}");
}
