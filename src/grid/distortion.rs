//! How far a grid is from an isometry.

use super::map::GridMap;
use super::quads::QuadMesh;
use crate::geometry::mesh::{cross, distance, norm, sub};
use serde::{Deserialize, Serialize};
use std::f64::consts::FRAC_PI_2;

/// Of the map from the surface to the grid, lengths in cells.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Distortion {
    /// ‖J‖² + ‖J⁻¹‖² of faces with an area: 4 is an isometry.
    pub symmetric_dirichlet: MeanMax,
    /// |corner of a cell − π/2|, radians.
    pub angle: MeanMax,
    /// Lengths of the quad mesh's edges over the size of a cell.
    pub edge_ratio: Quantiles,
    /// Of cells with straight edges in space.
    pub scaled_jacobian: ScaledJacobian,
}

/// The least sine of a cell's corners, seen along the mean normal of the corners (Knupp 2003): 1 for rectangles, negative where a corner is turned over.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ScaledJacobian {
    /// Of the worst cell.
    pub min: f64,
    /// Of a twentieth of the cells it is less.
    pub p05: f64,
    /// Mean.
    pub mean: f64,
    /// Number of cells where it is not positive.
    pub not_positive: usize,
}

/// Mean and maximum.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct MeanMax {
    /// Mean: of faces weighted by source area, of corners of cells alike.
    pub mean: f64,
    /// Greatest value.
    pub max: f64,
}

/// Values below which a twentieth and nineteen twentieths of all are.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Quantiles {
    /// 5 %.
    pub p05: f64,
    /// 95 %.
    pub p95: f64,
}

/// Measures.
pub(super) fn measure(
    map: &GridMap,
    mesh: &QuadMesh,
    points: &[[f64; 3]],
    cell_size: f64,
) -> Distortion {
    Distortion {
        symmetric_dirichlet: dirichlet(map, cell_size),
        angle: angles(mesh, points),
        edge_ratio: edges(mesh, points, cell_size),
        scaled_jacobian: jacobians(mesh, points),
    }
}

fn dirichlet(map: &GridMap, cell_size: f64) -> MeanMax {
    let (c, position) = (&map.sheet.fine.connectivity, &map.sheet.fine.position);
    let (mut sum, mut whole, mut max) = (0.0, 0.0, 4.0f64);
    for f in c.faces() {
        let p = c.face_vertices(f).map(|v| position[v]);
        let (e, g) = (sub(p[1], p[0]), sub(p[2], p[0]));
        let doubled = norm(cross(e, g));
        let [a, b, d] = map.corners(f);
        let (u, v) = ([b[0] - a[0], b[1] - a[1]], [d[0] - a[0], d[1] - a[1]]);
        let on_grid = super::complex::cross(u, v);
        let dot = |x: [f64; 3], y: [f64; 3]| x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
        // ‖J‖² of the map with Gram matrices of both triangles; cells have length 1 there, `cell_size` here.
        let determinant = on_grid * cell_size * cell_size / doubled;
        let flat = |i: usize| {
            let (x, y) = (u[i], v[i]);
            (x * x * dot(g, g) - 2.0 * x * y * dot(e, g) + y * y * dot(e, e)) / (doubled * doubled)
        };
        let squared = (flat(0) + flat(1)) * cell_size * cell_size;
        let value = squared * (1.0 + 1.0 / (determinant * determinant));
        if value.is_finite() {
            sum += doubled * value;
            whole += doubled;
            max = max.max(value);
        }
    }
    let mean = if whole > 0.0 { sum / whole } else { 4.0 };
    MeanMax {
        // Rounding may leave an isometry a little less.
        mean: mean.max(4.0),
        max,
    }
}

fn angles(mesh: &QuadMesh, points: &[[f64; 3]]) -> MeanMax {
    let (mut sum, mut max) = (0.0, 0.0f64);
    for corners in &mesh.quads {
        let p = corners.map(|i| points[i as usize]);
        for k in 0..4 {
            let (a, b) = (sub(p[(k + 1) % 4], p[k]), sub(p[(k + 3) % 4], p[k]));
            let dot: f64 = (0..3).map(|i| a[i] * b[i]).sum();
            let off = (norm(cross(a, b)).atan2(dot) - FRAC_PI_2).abs();
            sum += off;
            max = max.max(off);
        }
    }
    MeanMax {
        mean: sum / (4 * mesh.quads.len()).max(1) as f64,
        max,
    }
}

fn jacobians(mesh: &QuadMesh, points: &[[f64; 3]]) -> ScaledJacobian {
    let of_cell = |corners: &[u32; 4]| {
        let p = corners.map(|i| points[i as usize]);
        scaled_jacobian(p)
    };
    let mut all: Vec<f64> = mesh.quads.iter().map(of_cell).collect();
    let count = all.len().max(1);
    let mean = all.iter().sum::<f64>() / count as f64;
    all.sort_unstable_by(f64::total_cmp);
    let at = |part: f64| all.get(((count - 1) as f64 * part).round() as usize);
    ScaledJacobian {
        min: at(0.0).copied().unwrap_or(0.0),
        p05: at(0.05).copied().unwrap_or(0.0),
        mean,
        not_positive: all.iter().filter(|x| **x <= 0.0).count(),
    }
}

/// Of a cell; 0 where it has no normal or a corner no angle.
fn scaled_jacobian(p: [[f64; 3]; 4]) -> f64 {
    let edges = |k: usize| [sub(p[(k + 1) % 4], p[k]), sub(p[(k + 3) % 4], p[k])];
    let corner = [0, 1, 2, 3].map(|k| cross(edges(k)[0], edges(k)[1]));
    let normal: [f64; 3] = std::array::from_fn(|i| corner.iter().map(|n| n[i]).sum());
    let sine = |k: usize| {
        let [a, b] = edges(k);
        let along: f64 = (0..3).map(|i| corner[k][i] * normal[i]).sum();
        let sine = along / (norm(normal) * norm(a) * norm(b));
        if sine.is_finite() { sine } else { 0.0 }
    };
    (0..4).map(sine).fold(1.0, f64::min)
}

fn edges(mesh: &QuadMesh, points: &[[f64; 3]], cell_size: f64) -> Quantiles {
    let mut lengths = Vec::new();
    for (q, (corners, across)) in mesh.quads.iter().zip(&mesh.across).enumerate() {
        for k in 0..4 {
            let is_first = across[k].is_none_or(|(other, s)| (q as u32, k as u8) < (other, s));
            if is_first {
                let [a, b] = [corners[k], corners[(k + 1) % 4]].map(|i| points[i as usize]);
                lengths.push(distance(a, b) / cell_size);
            }
        }
    }
    lengths.sort_unstable_by(f64::total_cmp);
    let at = |part: f64| lengths[((lengths.len() - 1) as f64 * part).round() as usize];
    Quantiles {
        p05: at(0.05),
        p95: at(0.95),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scaled_jacobian_is_the_least_sine_of_a_corner() {
        let plane = |p: [[f64; 2]; 4]| scaled_jacobian(p.map(|[x, y]| [x, 2.0 * y, 3.0 * y]));
        // On a plane that is no axis's: sides along x and across are perpendicular there.
        assert!((plane([[0.0, 0.0], [5.0, 0.0], [5.0, 1.0], [0.0, 1.0]]) - 1.0).abs() < 1e-15);
        let flat = |p: [[f64; 2]; 4]| scaled_jacobian(p.map(|[x, y]| [x, y, 0.0]));
        let leaning = flat([[0.0, 0.0], [1.0, 0.0], [2.0, 1.0], [1.0, 1.0]]);
        assert!((leaning - 0.5f64.sqrt()).abs() < 1e-15);
        // A dart: the corner that points inwards is turned over by as much.
        let dart = flat([[0.0, 0.0], [2.0, -2.0], [1.0, 0.0], [2.0, 2.0]]);
        let inwards = -(2.0 * 1.0 * 2.0) / 5.0;
        assert!((dart - inwards).abs() < 1e-15, "{dart} {inwards}");
        // A right angle, bent along a diagonal: all corners keep their sines but for the lean of their normals.
        let bent = scaled_jacobian([
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.5],
            [0.0, 1.0, 0.0],
        ]);
        assert!(bent > 0.8 && bent < 1.0);
        assert_eq!(flat([[0.0, 0.0]; 4]), 0.0);
    }
}
