//! Plates with holes, closed and with a boundary: any genus gets cones by default that the flow reaches.

use crate::common::Triangles;
use crate::models;
use affine_atlas::flow::cones::{BoundaryCondition, ConeParams, ConeStrategy};
use affine_atlas::flow::ricci::{self, FlowParams, Holonomy};
use affine_atlas::geometry::ids::EdgeVec;
use std::collections::HashMap;
use std::f64::consts::PI;

/// Squares along an edge of a hole.
const FINE: usize = 4;
/// Curvature that the cones may leave to a boundary loop, radians.
const LEFT: f64 = 2.0 * PI + 1e-9;
/// Greatest J; measured: 0.1 to 0.6.
const MOST_J: f64 = 1.0;

/// A square plate with `genus` square holes through it, `FINE` squares thick. `is_open`: without one square of its top.
pub fn plate(genus: usize, is_open: bool) -> Triangles {
    let side = (1..).find(|k| k * k >= genus).unwrap_or(1);
    let width = (2 * side + 1) * FINE;
    let is_hole = |i: usize, j: usize| {
        let (a, b) = (i / FINE, j / FINE);
        a % 2 == 1 && b % 2 == 1 && (a / 2) * side + b / 2 < genus
    };
    // Cells are counted from 1, so that there is one beside each.
    let is_full = |i: usize, j: usize| {
        (1..=width).contains(&i) && (1..=width).contains(&j) && !is_hole(i - 1, j - 1)
    };
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    let mut number: HashMap<[usize; 3], u32> = HashMap::new();
    let mut quad = |corners: [[usize; 3]; 4]| {
        let [a, b, c, d] = corners.map(|p| {
            *number.entry(p).or_insert_with(|| {
                positions.push(p.map(|x| x as f64 / FINE as f64));
                positions.len() as u32 - 1
            })
        });
        faces.extend([[a, b, c], [a, c, d]]);
    };
    for i in 1..=width {
        for j in (1..=width).filter(|&j| is_full(i, j)) {
            let (k, l, top) = (i + 1, j + 1, FINE);
            // The first cell of the top is the hole of an open plate.
            if !(is_open && (i, j) == (2, 2)) {
                quad([[i, j, top], [k, j, top], [k, l, top], [i, l, top]]);
            }
            quad([[i, j, 0], [i, l, 0], [k, l, 0], [k, j, 0]]);
            let sides = [
                (i - 1, j, [i, l], [i, j]),
                (i + 1, j, [k, j], [k, l]),
                (i, j - 1, [i, j], [k, j]),
                (i, j + 1, [k, l], [i, l]),
            ];
            for (_, _, p, q) in sides.into_iter().filter(|s| !is_full(s.0, s.1)) {
                for z in 0..FINE {
                    let [a, b] = [p, q].map(|[x, y]| move |z| [x, y, z]);
                    quad([a(z), b(z), b(z + 1), a(z + 1)]);
                }
            }
        }
    }
    Triangles { faces, positions }
}

/// By default there are cones enough, within their limits; what they leave to a boundary is at most one turn a loop; and the flow gets there
/// with little distortion.
pub fn by_default(genus: usize, is_open: bool) -> Result<(), String> {
    let mesh = models::mesh(&plate(genus, is_open));
    let topology = mesh.connectivity.topology();
    if topology.genus != genus as i64 || topology.boundary_loops != usize::from(is_open) {
        return Err(format!("the generator made {topology:?}"));
    }
    let params = ConeParams::default();
    let (given, chosen) = models::choose(&mesh, &params, BoundaryCondition::Free)?;
    let [low, high] = [params.min_curvature, params.max_curvature].map(|k| k.radians());
    let out = |k: f64| k < low - 1e-9 || k > high + 1e-9;
    if let Some(cone) = chosen.iter().find(|cone| out(cone.1)) {
        return Err(format!("{cone:?} is not within {low} to {high}"));
    }
    // The plate is flat where it is open.
    let total: f64 = chosen.iter().map(|cone| cone.1).sum();
    let own = 4.0 * PI * (1.0 - genus as f64);
    let left = if is_open { LEFT } else { 1e-6 };
    if (total - own).abs() > left {
        return Err(format!("cones have {total}, the surface {own}"));
    }
    let distortion = models::distortion(&mesh, &given)?;
    println!(
        "genus {genus}{}: {} cones, {distortion:?}",
        if is_open { ", open" } else { "" },
        chosen.len()
    );
    match distortion.cost < MOST_J {
        true => Ok(()),
        false => Err(format!("{} cones leave {distortion:?}", chosen.len())),
    }
}

/// Cones of a cross field and quarter turns along all 2g loops, on the closed plate.
pub fn quarter_turns(genus: usize) -> Result<(), String> {
    let mesh = models::mesh(&plate(genus, false));
    let cones = ConeParams {
        strategy: ConeStrategy::Field,
        ..ConeParams::default()
    };
    let (given, chosen) = models::choose(&mesh, &cones, BoundaryCondition::Free)?;
    let params = FlowParams {
        holonomy: Holonomy::QuarterTurns,
        ..FlowParams::default()
    };
    let c = &mesh.connectivity;
    let length: EdgeVec<f64> = c.edges().map(|e| mesh.edge_length(e)).collect();
    let metric = ricci::flow(c, &length, &given, &params, &()).map_err(|e| e.to_string())?;
    let (error, steps) = (metric.max_curvature_error, metric.history.len() - 1);
    println!(
        "genus {genus}: {} cones, {steps} steps, error {error:.1e}",
        chosen.len()
    );
    match error <= 1e-10 && steps <= 15 {
        true => Ok(()),
        false => Err(format!("error {error:e} after {steps} steps")),
    }
}
