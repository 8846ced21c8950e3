//! Plates with holes, closed and with a boundary: any genus gets cones by default that the flow reaches.

use crate::common::Triangles;
use crate::models;
use crate::real_models::plates::plate;
use affine_atlas::flow::cones::{BoundaryCondition, ConeParams};
use std::f64::consts::PI;

/// Curvature that the cones may leave to a boundary loop, radians.
const LEFT: f64 = 2.0 * PI + 1e-9;
/// Greatest J; measured: 0.1 to 0.6.
const MOST_J: f64 = 1.0;

/// By default there are cones enough, within their limits; what they leave to a boundary is at most one turn a loop; and the flow gets there
/// with little distortion.
pub fn by_default(genus: usize, is_open: bool) -> Result<(), String> {
    let (positions, faces) = plate(genus, is_open);
    let mesh = models::mesh(&Triangles { faces, positions });
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
