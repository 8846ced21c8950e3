//! What a user gets who asks for nothing, beside equal cones spread by distance.

use crate::models;
use affine_atlas::flow::cones::{ConeParams, ConeStrategy};
use affine_atlas::product::AffineAtlas;
use std::path::Path;

/// The log scale of the default varies less than with the cones that `spread` (or none) gives.
pub fn beside_spread(file: &Path) -> Result<(), String> {
    let triangles = models::read(file);
    let mesh = models::mesh(&triangles);
    let topology = mesh.connectivity.topology();
    let (strategy, count) = match (topology.boundary_loops, topology.genus) {
        (0, 0) => (ConeStrategy::Spread, 8),
        (0, 1) | (1.., _) => (ConeStrategy::None, 0),
        (0, genus) => (
            ConeStrategy::Spread,
            (2 * genus - 2).unsigned_abs() as usize,
        ),
    };
    let blind = ConeParams {
        strategy,
        // Without cones there is nothing to count.
        count: Some(count).filter(|&count| count > 0),
        ..ConeParams::default()
    };
    let before = models::finished(&triangles, blind)?;
    let after = models::finished(&triangles, ConeParams::default())?;
    let name = file.file_stem().unwrap_or_default().to_string_lossy();
    println!("| {name} | {} | {} |", row(&before), row(&after));
    let (old, new) = (before.quality.log_scale.std, after.quality.log_scale.std);
    // A flat surface stays flat.
    match new < old || new < 1e-12 {
        true => Ok(()),
        false => Err(format!("{name}: std {new} by default, {old} otherwise")),
    }
}

/// Cones, (9), standard deviation and range of the log scale, length of the cut in square roots of the area.
fn row(atlas: &AffineAtlas) -> String {
    let (q, mesh) = (&atlas.quality, &atlas.mesh);
    let faces = mesh.connectivity.faces();
    let area: f64 = faces
        .map(|f| affine_atlas::geometry::mesh::triangle_area(mesh.face_positions(f)))
        .sum();
    format!(
        "{} | {:.4} | {:.4} | {:.2} to {:.2} | {:.2}",
        atlas.prescription.cones.len(),
        q.area_distortion,
        q.log_scale.std,
        q.log_scale.min,
        q.log_scale.max,
        q.cut_length / area.sqrt()
    )
}
