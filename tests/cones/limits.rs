//! What a user may ask of the choice beside a number of cones.

use crate::models;
use affine_atlas::flow::cones::{BoundaryCondition, ConeParams, PiMultiple};
use affine_atlas::geometry::mesh::triangle_area;
use std::path::Path;

/// What the linear picture of the bound may be off by.
const PREDICTED: f64 = 1.1;

/// Fewer cones for a wider bound, and the log scale of the flow stays within it.
pub fn log_scale_bound(file: &Path) -> Result<(), String> {
    let mesh = models::mesh(&models::read(file));
    let c = &mesh.connectivity;
    let mut last = usize::MAX;
    for bound in [0.5, 0.8, 1.2] {
        let params = ConeParams {
            count: Some(64),
            log_scale_bound: Some(bound),
            ..ConeParams::default()
        };
        let (given, chosen) = models::choose(&mesh, &params, BoundaryCondition::Free)?;
        let u = models::flow(&mesh, &given)?.log_scale;
        let (mut area, mut sum) = (0.0, 0.0);
        let faces: Vec<(f64, f64)> = c
            .faces()
            .map(|f| {
                let own = c.face_vertices(f).iter().map(|&v| u[v]).sum::<f64>() / 3.0;
                (triangle_area(mesh.face_positions(f)), own)
            })
            .collect();
        for (a, x) in &faces {
            area += a;
            sum += a * x;
        }
        let mean = sum / area;
        let worst = faces.iter().map(|f| (f.1 - mean).abs()).fold(0.0, f64::max);
        println!("bound {bound}: {} cones, largest {worst:.3}", chosen.len());
        if worst > PREDICTED * bound {
            return Err(format!(
                "bound {bound}: {} cones leave {worst}",
                chosen.len()
            ));
        }
        if chosen.len() > last {
            return Err(format!(
                "bound {bound}: {} cones, a narrower one {last}",
                chosen.len()
            ));
        }
        last = chosen.len();
    }
    Ok(())
}

/// Cones keep farther from the boundary than they are by themselves where they are told to.
pub fn boundary_distance(file: &Path) -> Result<(), String> {
    let mesh = models::mesh(&models::read(file));
    let c = &mesh.connectivity;
    let area: f64 = c
        .faces()
        .map(|f| triangle_area(mesh.face_positions(f)))
        .sum();
    // Along edges, by relaxing all of them until nothing changes.
    let mut apart: Vec<f64> = c
        .vertices()
        .map(|v| match c.is_boundary_vertex(v) {
            true => 0.0,
            false => f64::INFINITY,
        })
        .collect();
    loop {
        let mut changed = false;
        for e in c.edges() {
            let [i, j] = c.edge_vertices(e).map(|v| v.index());
            let length = mesh.edge_length(e) / area.sqrt();
            for (i, j) in [(i, j), (j, i)] {
                if apart[i] + length < apart[j] {
                    apart[j] = apart[i] + length;
                    changed = true;
                }
            }
        }
        if !changed {
            break;
        }
    }
    let nearest = |share: f64| -> Result<f64, String> {
        let params = ConeParams {
            boundary_distance: share,
            ..ConeParams::default()
        };
        let (given, _) = models::choose(&mesh, &params, BoundaryCondition::Free)?;
        let cones = given.cones.iter().map(|cone| apart[cone.vertex.index()]);
        Ok(cones.fold(f64::INFINITY, f64::min))
    };
    let free = nearest(0.0)?;
    let wanted = 1.2 * free;
    let kept = nearest(wanted)?;
    match kept >= wanted - 1e-12 && kept.is_finite() {
        true => Ok(()),
        false => Err(format!(
            "{kept} away from the boundary, {free} without; {wanted} wanted"
        )),
    }
}

/// No cone is stronger than allowed.
pub fn curvatures(file: &Path) -> Result<(), String> {
    let mesh = models::mesh(&models::read(file));
    let params = ConeParams {
        count: Some(12),
        min_curvature: PiMultiple::fraction(-1, 2).ok_or("-1/2")?,
        max_curvature: PiMultiple::fraction(3, 4).ok_or("3/4")?,
        ..ConeParams::default()
    };
    let (_, chosen) = models::choose(&mesh, &params, BoundaryCondition::Free)?;
    let [low, high] = [params.min_curvature, params.max_curvature].map(|k| k.radians());
    let out = |k: f64| k < low - 1e-9 || k > high + 1e-9;
    match chosen.iter().find(|cone| out(cone.1)) {
        Some(cone) => Err(format!("{cone:?} is not within {low} to {high}")),
        None => Ok(()),
    }
}
