//! What must not matter: the order of vertices, the place and size of the mesh, the diagonals it came with.

use super::models::{Model, Random};
use super::prescriptions;
use affine_atlas::flow::cones::Prescription;
use affine_atlas::flow::ricci::{self, FlowParams, Scheme};
use affine_atlas::geometry::ids::{VertexId, VertexVec};
use std::path::Path;

/// Bound on the difference of two u, a constant aside.
const TOLERANCE: f64 = 1e-8;
/// Below what rounding allows: the flow goes on until the residual stops falling.
const FLOOR: f64 = 1e-16;

pub fn hold(file: &Path) -> Result<(), String> {
    let model = Model::read(file);
    let mut flat = model.clone();
    for p in &mut flat.positions {
        p[1] *= 0.02;
    }
    let squashed = Model::with(flat.connectivity, flat.positions);
    for (name, model) in [("as it is", &model), ("squashed", &squashed)] {
        for seed in [3, 8] {
            let prescription = prescriptions::random(model, seed, prescriptions::RANGE);
            let u = scale(model, &prescription)?;
            let against = |what: &str, other: Vec<f64>| {
                let worst = difference(&u, &other);
                println!("{name}, seed {seed}, {what}: {worst:.1e}");
                match worst <= TOLERANCE {
                    true => Ok(()),
                    false => Err(format!(
                        "{name}, seed {seed}, {what}: u differs by {worst:e}"
                    )),
                }
            };
            against("vertices shuffled", shuffled(model, &prescription)?)?;
            against("turned and scaled", moved(model, &prescription)?)?;
            if model.connectivity.is_closed() {
                against("flipped to Delaunay", flipped(model, &prescription)?)?;
            }
        }
    }
    Ok(())
}

fn scale(model: &Model, prescription: &Prescription) -> Result<Vec<f64>, String> {
    let flat = model.flow(prescription, FLOOR).map_err(|e| e.to_string())?;
    Ok(flat.log_scale.into_vec())
}

fn difference(a: &[f64], b: &[f64]) -> f64 {
    let mean = |u: &[f64]| u.iter().sum::<f64>() / u.len() as f64;
    let (m, n) = (mean(a), mean(b));
    let pairs = a.iter().zip(b);
    pairs
        .map(|(a, b)| (a - m - b + n).abs())
        .fold(0.0, f64::max)
}

fn shuffled(model: &Model, prescription: &Prescription) -> Result<Vec<f64>, String> {
    let n = model.positions.len();
    let mut random = Random(99);
    let mut place: Vec<usize> = (0..n).collect();
    for i in (1..n).rev() {
        place.swap(i, random.below(i + 1));
    }
    let mut positions = vec![[0.0; 3]; n];
    let mut target = VertexVec::filled(0.0, n);
    for (v, &to) in place.iter().enumerate() {
        positions[to] = model.positions[v];
        target[VertexId::new(to)] = prescription.target[VertexId::new(v)];
    }
    let mut faces: Vec<[u32; 3]> = model.connectivity.to_faces();
    for i in (1..faces.len()).rev() {
        faces.swap(i, random.below(i + 1));
    }
    for (i, face) in faces.iter_mut().enumerate() {
        *face = face.map(|v| place[v as usize] as u32);
        face.rotate_left(i % 3);
    }
    let other = Model::new(&faces, positions);
    let u = scale(&other, &Prescription::new(target, prescription.boundary))?;
    Ok(place.iter().map(|&to| u[to]).collect())
}

fn moved(model: &Model, prescription: &Prescription) -> Result<Vec<f64>, String> {
    let (s, c) = 0.7_f64.sin_cos();
    let turn = |[x, y, z]: [f64; 3]| [c * x - s * y, s * x + c * y, z];
    let positions = model.positions.iter().map(|&p| {
        let [x, y, z] = turn(p);
        let [y, z, x] = turn([y, z, x]);
        [37.0 * x + 5.0, 37.0 * y - 2.0, 37.0 * z + 11.0]
    });
    let other = Model::with(model.connectivity.clone(), positions.collect());
    scale(&other, prescription)
}

/// The flow from the intrinsic Delaunay triangulation: a Δ-complex that is no mesh in space.
fn flipped(model: &Model, prescription: &Prescription) -> Result<Vec<f64>, String> {
    let flat = model.flow(prescription, 1e-10).map_err(|e| e.to_string())?;
    let intrinsic = flat.intrinsic.ok_or("no flips")?;
    let params = FlowParams {
        scheme: Scheme::VertexScaling,
        curvature_tolerance: FLOOR,
        ..Default::default()
    };
    let (c, length) = (&intrinsic.delaunay, &intrinsic.delaunay_length);
    let flat = ricci::flow(c, length, prescription, &params, &()).map_err(|e| e.to_string())?;
    Ok(flat.log_scale.into_vec())
}
