//! Meshes that break other methods: squashed, full of needles, coarse.

use super::models::{Model, Random};
use super::prescriptions;
use std::collections::{BTreeSet, BinaryHeap};
use std::path::Path;

/// Prescriptions a mesh.
const SEEDS: [u64; 4] = [0, 1, 2, 3];
/// Least and greatest curvature of a cone, in units of π. On a plate a thousand times as wide as thick, cones of −6π would need scales
/// far beyond e^±300.
const RANGE: [f64; 2] = [-1.0, 0.9];
/// Factor along one axis.
const SQUASH: f64 = 1e-3;
/// Longest side over height of an inserted needle.
const ASPECT: f64 = 1e6;
/// Faces that get a needle.
const NEEDLES: usize = 60;
/// Faces that a decimated mesh has at most.
const COARSE: usize = 500;

pub fn squashed(file: &Path) -> Result<(), String> {
    let model = Model::read(file);
    let mut failures = Vec::new();
    for axis in 0..3 {
        let mut positions = model.positions.clone();
        for p in &mut positions {
            p[axis] *= SQUASH;
        }
        // A plate that lies across the axis would become a line of coinciding points.
        let squashed = Model::with(model.connectivity.clone(), positions);
        if squashed.length.iter().all(|&l| l > 0.0) {
            // Even seeds leave a boundary free. To bend the border of a strip a thousand times as long as wide into a circle takes scales
            // beyond e^±300, which is refused with that reason.
            failures.extend(converge(&squashed, [0, 2, 4, 6]).err());
        }
    }
    summary(failures)
}

pub fn needles(file: &Path) -> Result<(), String> {
    let model = Model::read(file);
    let (mut faces, mut positions) = (model.connectivity.to_faces(), model.positions.clone());
    let mut random = Random(faces.len() as u64);
    for i in 0..NEEDLES {
        let f = random.below(faces.len());
        let [a, b, c] = faces[f];
        // A cap over the middle of a side, or a needle at a corner.
        let weight = match i % 2 {
            0 => [0.5, 0.5 - 1.0 / ASPECT, 1.0 / ASPECT],
            _ => [1.0 - 2.0 / ASPECT, 1.0 / ASPECT, 1.0 / ASPECT],
        };
        let corners = [a, b, c].map(|v| positions[v as usize]);
        let m = positions.len() as u32;
        positions.push(std::array::from_fn(|k| {
            (0..3).map(|i| weight[i] * corners[i][k]).sum()
        }));
        faces[f] = [a, b, m];
        faces.extend([[b, c, m], [c, a, m]]);
    }
    summary(
        converge(&Model::new(&faces, positions), SEEDS)
            .err()
            .into_iter()
            .collect(),
    )
}

pub fn decimated(file: &Path) -> Result<(), String> {
    let model = Model::read(file);
    let coarse = decimate(&model);
    let (before, after) = (
        model.connectivity.topology(),
        coarse.connectivity.topology(),
    );
    assert_eq!(before.genus, after.genus);
    assert_eq!(before.boundary_loops, after.boundary_loops);
    summary(converge(&coarse, SEEDS).err().into_iter().collect())
}

fn converge(model: &Model, seeds: [u64; 4]) -> Result<(), String> {
    let mut failures = Vec::new();
    for seed in seeds {
        let prescription = prescriptions::random(model, seed, RANGE);
        match model.flow(&prescription, 1e-10) {
            Ok(flat) if flat.max_curvature_error <= 1e-10 => {}
            Ok(flat) => failures.push(format!("seed {seed}: {:e}", flat.max_curvature_error)),
            Err(error) => failures.push(format!("seed {seed}: {error}")),
        }
    }
    summary(failures)
}

fn summary(failures: Vec<String>) -> Result<(), String> {
    match failures.is_empty() {
        true => Ok(()),
        false => Err(failures.join("\n")),
    }
}

/// Collapses the shortest edge that may be collapsed, again and again; topology stays.
fn decimate(model: &Model) -> Model {
    let c = &model.connectivity;
    let mut faces: Vec<Option<[u32; 3]>> = c.to_faces().into_iter().map(Some).collect();
    let positions = &model.positions;
    let mut around: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); positions.len()];
    for (f, face) in faces.iter().enumerate() {
        for &v in face.iter().flatten() {
            around[v as usize].insert(f);
        }
    }
    let length = |a: u32, b: u32| {
        let (p, q) = (positions[a as usize], positions[b as usize]);
        (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt()
    };
    let mut queue = BinaryHeap::new();
    for e in c.edges() {
        let [a, b] = c.edge_vertices(e).map(|v| v.raw());
        queue.push((std::cmp::Reverse(length(a, b).to_bits()), a, b));
    }
    let mut left = faces.len();
    while left > COARSE {
        let Some((_, a, b)) = queue.pop() else { break };
        let ring = |v: u32, around: &[BTreeSet<usize>], faces: &[Option<[u32; 3]>]| {
            let mut count = std::collections::BTreeMap::new();
            for &f in &around[v as usize] {
                for w in faces[f].unwrap().into_iter().filter(|&w| w != v) {
                    *count.entry(w).or_insert(0) += 1;
                }
            }
            count
        };
        let (ring_a, ring_b) = (ring(a, &around, &faces), ring(b, &around, &faces));
        let Some(&sides) = ring_a.get(&b) else {
            continue;
        };
        let on_boundary = |r: &std::collections::BTreeMap<u32, i32>| r.values().any(|&n| n == 1);
        let both = on_boundary(&ring_a) && on_boundary(&ring_b);
        let common = ring_a.keys().filter(|w| ring_b.contains_key(w)).count();
        // The link condition, and no boundary pinched or pulled inside.
        if common != sides as usize || (both && sides == 2) {
            continue;
        }
        // What stays is a boundary vertex where there is one.
        let (stays, goes) = if on_boundary(&ring_b) && !on_boundary(&ring_a) {
            (b, a)
        } else {
            (a, b)
        };
        let (ring_stays, ring_goes) = if stays == a {
            (&ring_a, &ring_b)
        } else {
            (&ring_b, &ring_a)
        };
        // No loop of three boundary edges closes, and no valence falls below three.
        let thin = |w: &u32| ring_stays.contains_key(w) && around[*w as usize].len() <= 3;
        if ring_goes.keys().any(thin) || ring_stays.len() + ring_goes.len() < 8 {
            continue;
        }
        for f in std::mem::take(&mut around[goes as usize]) {
            let face = faces[f].unwrap();
            if face.contains(&stays) {
                for v in face {
                    around[v as usize].remove(&f);
                }
                faces[f] = None;
                left -= 1;
            } else {
                faces[f] = Some(face.map(|v| if v == goes { stays } else { v }));
                around[stays as usize].insert(f);
            }
        }
        for &w in ring_goes.keys().filter(|&&w| w != stays) {
            queue.push((std::cmp::Reverse(length(stays, w).to_bits()), stays, w));
        }
    }
    let mut index = vec![u32::MAX; positions.len()];
    let mut kept = Vec::new();
    let faces: Vec<[u32; 3]> = faces.into_iter().flatten().collect();
    let faces: Vec<[u32; 3]> = faces
        .into_iter()
        .map(|f| {
            f.map(|v| {
                if index[v as usize] == u32::MAX {
                    index[v as usize] = kept.len() as u32;
                    kept.push(positions[v as usize]);
                }
                index[v as usize]
            })
        })
        .collect();
    Model::new(&faces, kept)
}
