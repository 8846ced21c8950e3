//! The images of a grid: one a block, and their places in the packed square.

use super::Grid;
use super::layout::Located;
use crate::atlas::charted::Charted;
use crate::atlas::patches::{Domain, Patch, PatchLayout, seams};
use crate::geometry::ids::{FaceVec, PatchId};

/// Blocks as patches.
pub(super) fn layout(surface: &Charted, grid: &Grid, located: Located) -> PatchLayout {
    let samples = grid.samples_per_cell;
    let step = 1.0 / samples as f64;
    let islands = &grid.islands;
    let side = islands.side as f64;
    let blocks = grid.blocks.blocks.iter().zip(&islands.place);
    let patches = blocks.map(|(block, &(island, at))| Patch {
        domain: Domain::Grid,
        to_chart: None,
        width: block.cells[0] * samples + 1,
        height: block.cells[1] * samples + 1,
        texel_to_patch: [[step, 0.0, 0.0], [0.0, step, 0.0]],
        packed_scale: samples as f64 / side,
        packed_offset: [0, 1].map(|i| {
            let texel = islands.corner[island][i] + at[i] * samples;
            texel as f64 / side
        }),
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
