//! The linear picture against the flow itself.

use crate::models::{self, Chosen};
use affine_atlas::flow::cones::{BoundaryCondition, ConeParams};
use affine_atlas::flow::solve::SymmetricSolver;
use affine_atlas::geometry::ids::VertexId;
use affine_atlas::geometry::mesh::Mesh;
use affine_atlas::geometry::triangle;
use std::path::Path;

/// Greatest relative difference of predicted and true standard deviation.
const PREDICTED: f64 = 0.05;
/// Step of difference quotients by curvature, radians.
const STEP: f64 = 0.02;
/// How far, radians, from the best curvature along a direction the choice may be …
const FROM_BEST: f64 = 0.25;
/// … or how much, relatively, could be gained there.
const TO_GAIN: f64 = 0.02;

/// u = Δ⁻¹(K̄ − K) varies as much as the log scale that the flow finds.
pub fn prediction(file: &Path) -> Result<(), String> {
    let mesh = models::mesh(&models::read(file));
    for count in [4, 8, 16] {
        let params = ConeParams {
            count: Some(count),
            ..ConeParams::default()
        };
        let (given, _) = models::choose(&mesh, &params, BoundaryCondition::Free)?;
        let truth = models::flow(&mesh, &given)?.log_scale;
        let truth = models::deviation(&mesh, truth.as_slice());
        let faces = models::distortion(&mesh, &given)?.std;
        let predicted = predict(&mesh, given.target.as_slice())?;
        let off = predicted / truth - 1.0;
        println!(
            "{count}: {predicted:.4} predicted, {truth:.4} true, {faces:.4} over faces, {:.1} % off",
            100.0 * off
        );
        if off.abs() > PREDICTED {
            return Err(format!(
                "{count} cones: {predicted} predicted, {truth} true"
            ));
        }
    }
    Ok(())
}

/// Standard deviation over the area of the solution of Δu = K̄ − K on a closed surface, Δ and K of its intrinsic Delaunay triangulation.
fn predict(mesh: &Mesh, target: &[f64]) -> Result<f64, String> {
    let cones = target.iter().enumerate().filter(|(_, k)| **k != 0.0);
    let cones: Vec<Chosen> = cones.map(|(v, &k)| (v as u32, k)).collect();
    let given = models::prescribe(mesh, &cones, BoundaryCondition::Free)?;
    let metric = models::flow(mesh, &given)?;
    let intrinsic = metric.intrinsic.ok_or("no flips")?;
    let (c, length) = (&intrinsic.delaunay, &intrinsic.delaunay_length);
    let n = c.vertex_count();
    let mut right: Vec<f64> = target.iter().map(|k| k - std::f64::consts::TAU).collect();
    let (mut diagonal, mut pairs, mut values) = (vec![0.0; n - 1], Vec::new(), Vec::new());
    for f in c.faces() {
        let lengths = c.face_edges(f).map(|e| length[e]);
        let angles = triangle::angles(lengths).ok_or("a broken triangle")?;
        let vertices = c.face_vertices(f).map(VertexId::index);
        let halfedges = c.face_halfedges(f);
        for k in 0..3 {
            right[vertices[k]] += angles[k];
            // The halfedge opposite to corner k.
            let h = halfedges[(k + 1) % 3];
            let [i, j] = [c.tail(h), c.head(h)].map(VertexId::index);
            let weight = 0.5 / angles[k].tan();
            if i == j {
                continue;
            }
            for v in [i, j].into_iter().filter(|&v| v < n - 1) {
                diagonal[v] += weight;
            }
            if i < n - 1 && j < n - 1 {
                pairs.push([i as u32, j as u32]);
                values.push(-weight);
            }
        }
    }
    right.pop();
    let mut solver = SymmetricSolver::new(n - 1, &pairs).map_err(|e| e.to_string())?;
    solver
        .factorize(&diagonal, &values)
        .map_err(|e| e.to_string())?;
    solver.solve(&mut right);
    right.push(0.0);
    Ok(models::deviation(mesh, &right))
}

/// Moving curvature from one cone to the next gains nothing to speak of: the choice is at a least value of what it was to make least, in
/// the true flow.
pub fn stationary(file: &Path) -> Result<(), String> {
    let mesh = models::mesh(&models::read(file));
    let params = ConeParams::default();
    let (given, chosen) = models::choose(&mesh, &params, BoundaryCondition::Free)?;
    let cost = |shift: f64, i: usize| -> Result<f64, String> {
        let mut other = chosen.clone();
        other[i].1 += shift;
        other[(i + 1) % chosen.len()].1 -= shift;
        let given = models::prescribe(&mesh, &other, BoundaryCondition::Free)?;
        Ok(models::distortion(&mesh, &given)?.cost)
    };
    let [low, high] = [params.min_curvature, params.max_curvature].map(|k| k.radians());
    let here = models::distortion(&mesh, &given)?.cost;
    let mut failed = Vec::new();
    for i in 0..chosen.len() {
        let both = [chosen[i].1, chosen[(i + 1) % chosen.len()].1];
        if both.iter().any(|&k| k < low + STEP || k > high - STEP) {
            continue;
        }
        let (less, more) = (cost(-STEP, i)?, cost(STEP, i)?);
        let slope = (more - less) / (2.0 * STEP);
        let bend = (more - 2.0 * here + less) / (STEP * STEP);
        // Where the parabola has no least value, the two measured ones count.
        let (far, gain) = match bend > 0.0 {
            true => (-slope / bend, 0.5 * slope * slope / bend / here),
            false => (f64::INFINITY, (here - less.min(more)) / here),
        };
        println!(
            "cones {i} and next: best {far:+.4} away, gains {:.3} %",
            100.0 * gain
        );
        if far.abs() > FROM_BEST && gain > TO_GAIN {
            failed.push(format!(
                "{i}: slope {slope:.4}, bend {bend:.4}, best {far:+.3} away, gains {gain:.4}"
            ));
        }
    }
    match failed.is_empty() {
        true => Ok(()),
        false => Err(failed.join("; ")),
    }
}
