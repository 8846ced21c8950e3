//! The mesh rebuilt from the images of an atlas.

use affine_atlas::geometry::connectivity::Connectivity;
use affine_atlas::geometry::mesh::triangle_area;
use affine_atlas::job;
use affine_atlas::read::{ReadParams, read};
use std::path::Path;

/// The mesh as it is read back from its file, without welding: a surface of the right topology. In memory: no face is flipped. In the file:
/// none is without area, where that is asked for.
pub fn watertight(atlas: &Path, genus: usize, loops: usize, has_area: bool) -> Result<(), String> {
    fn said(error: impl std::fmt::Display) -> String {
        error.to_string()
    }
    let rebuilt = job::rebuild::rebuild(atlas, None).map_err(said)?;
    let [component] = &rebuilt.components[..] else {
        return Err(format!("{} components", rebuilt.components.len()));
    };
    let doubled = |t: &[[f64; 2]; 3]| {
        (t[1][0] - t[0][0]) * (t[2][1] - t[0][1]) - (t[1][1] - t[0][1]) * (t[2][0] - t[0][0])
    };
    let flipped = component.mesh.patch_uv.iter().filter(|t| doubled(t) <= 0.0);
    let flipped = flipped.count();
    let folder = tempfile::tempdir().map_err(said)?;
    let glb = folder.path().join("again.glb");
    std::fs::write(&glb, rebuilt.glb().map_err(said)?).map_err(said)?;
    let soup = read(&glb, &ReadParams::default()).map_err(said)?.soup;
    let found = Connectivity::from_faces(&soup.faces, soup.positions.len());
    let found = found.map_err(said)?.topology();
    let flat = soup.faces.iter().filter(|f| {
        let corners = f.map(|v| soup.positions[v as usize]);
        has_area && triangle_area(corners) == 0.0
    });
    let flat = flat.count();
    if (found.genus, found.boundary_loops, flipped, flat) != (genus as i64, loops, 0, 0) {
        return Err(format!("{found:?}, {flipped} flipped, {flat} without area"));
    }
    Ok(())
}
