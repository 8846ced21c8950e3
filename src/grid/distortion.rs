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
