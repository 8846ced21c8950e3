//! The images of a grid: one a block, and their places in the packed square.

use super::Grid;
use super::layout::Located;
use crate::atlas::charted::Charted;
use crate::atlas::patches::{Domain, Patch, PatchLayout, PatchParams, packed, seams};
use crate::geometry::ids::{FaceVec, PatchId};

/// Blocks as patches.
pub(super) fn layout(
    surface: &Charted,
    grid: &Grid,
    located: Located,
    params: &PatchParams,
) -> PatchLayout {
    let samples = grid.samples_per_cell;
    let contents: Vec<[f64; 2]> = grid
        .blocks
        .blocks
        .iter()
        .map(|block| block.cells.map(|n| (n * samples) as f64))
        .collect();
    let gutter = 2 * params.padding.max(1);
    let sizes: Vec<[usize; 2]> = contents
        .iter()
        .map(|content| content.map(|x| x as usize + gutter))
        .collect();
    let step = 1.0 / samples as f64;
    let images = grid.blocks.blocks.iter().zip(packed(&sizes, &contents));
    let patches = images.map(|(block, (scale, packed_offset))| Patch {
        domain: Domain::Grid,
        to_chart: None,
        width: block.cells[0] * samples + 1,
        height: block.cells[1] * samples + 1,
        texel_to_patch: [[step, 0.0, 0.0], [0.0, step, 0.0]],
        packed_scale: scale / block.cells[0] as f64,
        packed_offset,
    });
    let patches = patches.collect();
    let face_patch = located.block.iter().map(|&b| PatchId::new(b as usize));
    let face_patch: FaceVec<PatchId> = face_patch.collect();
    let seams = seams(&surface.mesh, &surface.cut.is_cut, &face_patch, &located.uv);
    PatchLayout {
        face_patch,
        uv: located.uv,
        patches,
        seams,
        packed: None,
    }
}
