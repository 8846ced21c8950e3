//! A refinement study with a known answer.
//!
//! The torus of revolution ((R + r cos v) cos w, (R + r cos v) sin w, r sin v) is conformally flat with log scale −ln(R + r cos v) up to
//! a constant. A regular grid would be exact and prove nothing, so vertices are moved by 30 % of the spacing in both angles.

use super::models::{Model, Random};
use affine_atlas::geometry::triangle;
use std::f64::consts::TAU;

const RADII: [f64; 2] = [1.0, 0.4];
const SHIFT: f64 = 0.3;
/// Least order of convergence in L².
const ORDER: f64 = 1.8;

pub fn torus() -> Result<(), String> {
    let errors: Vec<f64> = [32, 64, 128, 256].map(error).into_iter().collect();
    let orders: Vec<f64> = errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect();
    println!("L² errors {errors:?}, orders {orders:?}");
    match orders.iter().all(|&o| o >= ORDER) {
        true => Ok(()),
        false => Err(format!("orders {orders:?}, errors {errors:?}")),
    }
}

/// Area-weighted L² error of u, both means removed, on `n` × `2n` vertices.
fn error(n: usize) -> f64 {
    let m = 2 * n;
    let [big, small] = RADII;
    let mut random = Random(17);
    let mut angles = Vec::new();
    for i in 0..n {
        for j in 0..m {
            let v = (i as f64 + random.between(-SHIFT, SHIFT)) * TAU / n as f64;
            let w = (j as f64 + random.between(-SHIFT, SHIFT)) * TAU / m as f64;
            angles.push([v, w]);
        }
    }
    let positions: Vec<[f64; 3]> = angles
        .iter()
        .map(|&[v, w]| {
            let radius = big + small * v.cos();
            [radius * w.cos(), radius * w.sin(), small * v.sin()]
        })
        .collect();
    let at = |i: usize, j: usize| ((i % n) * m + j % m) as u32;
    let mut faces = Vec::new();
    for i in 0..n {
        for j in 0..m {
            let q = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            // One diagonal may lie outside a quad of moved vertices: take that whose triangles are larger.
            let place = |k: usize| {
                let ([v, w], turns) = (angles[q[k] as usize], |x: f64| x - (x / TAU).round() * TAU);
                let [a, b] = angles[q[0] as usize];
                [turns(v - a), turns(w - b)]
            };
            let area = |a: usize, b: usize, c: usize| {
                let [[x0, y0], [x1, y1], [x2, y2]] = [a, b, c].map(place);
                (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
            };
            let one = area(0, 1, 2).min(area(0, 2, 3));
            let other = area(0, 1, 3).min(area(1, 2, 3));
            assert!(one.max(other) > 0.0);
            let split = if one >= other {
                [[0, 1, 2], [0, 2, 3]]
            } else {
                [[0, 1, 3], [1, 2, 3]]
            };
            faces.extend(split.map(|t| t.map(|k: usize| q[k])));
        }
    }
    let model = Model::new(&faces, positions);
    let flat = model.flow(&model.prescribe(&[]), 1e-11).unwrap();
    let c = &model.connectivity;
    let mut area = vec![0.0; c.vertex_count()];
    for f in c.faces() {
        let size = triangle::area(c.face_edges(f).map(|e| model.length[e])).unwrap();
        for v in c.face_vertices(f) {
            area[v.index()] += size / 3.0;
        }
    }
    let total: f64 = area.iter().sum();
    let off: Vec<f64> = angles
        .iter()
        .zip(flat.log_scale.iter())
        .map(|(&[v, _], u)| u + (big + small * v.cos()).ln())
        .collect();
    let mean = off.iter().zip(&area).map(|(x, a)| x * a).sum::<f64>() / total;
    let square = off.iter().zip(&area).map(|(x, a)| (x - mean).powi(2) * a);
    (square.sum::<f64>() / total).sqrt()
}
