//! Patches: injective, scale-bounded parts of the central chart, their seams, and their packing.
//!
//! *Enters:* a surface, its flat lengths, the cut and the central chart, an immersion that may overlap
//! itself and span any range of scale. *Leaves:* a [`PatchLayout`].
//!
//! *Guaranteed:* every face is in one patch; a patch is connected across edges that are not cut,
//! a topological disk, and injective in the plane (up to 1e-10 of its extent); its regional log scale
//! (½ ln(flat area / source area), averaged over the stars of a face's corners) stays within
//! [`PatchParams::log_scale_range`], or what [`PatchParams::max_count`] made of it; its image holds it with
//! a margin and covers at least a few texel centres; patch → chart is a similarity without reflection. The same for any number of threads, and the
//! same patches under changes of the input's last digits.
//! *Not guaranteed:* the least number of patches, and the range for the log scale of single faces: a
//! sliver differs from its surroundings by any amount.
//!
//! The tutorial has no patches: it shows one chart that overlaps itself (Fig. 19d). A geometry image needs
//! a domain that does not.

mod bend;
mod borders;
mod coverage;
mod demand;
mod divide;
mod given;
mod holes;
mod merge;
mod overlap;
mod packing;
mod params;
mod placement;
mod places;
mod rectangle;
mod resolution;
mod seams;
mod segment;
mod sets;
mod slit;

#[cfg(test)]
pub(crate) mod samples;
#[cfg(test)]
mod tests;

use crate::atlas::cut::CutGraph;
use crate::atlas::develop::{Development, Unfolded};
use crate::atlas::geometry_image::sample;
use crate::atlas::overlay::Layout;
pub use crate::atlas::patch::{
    Domain, MAX_SIDE, PackedPlaces, Patch, PatchLayout, Seam, SeamSample,
};
use crate::atlas::texels::{Bend, FINER};
use crate::geometry::ids::{EdgeVec, FaceId, FaceVec, PatchId, VertexVec};
use crate::geometry::mesh::Mesh;
use demand::Sums;
use divide::Divider;
pub use given::charts_of;
pub(crate) use packing::pack;
pub use params::{PatchError, PatchParams};
use places::{Placed, images, with_images};
use rayon::prelude::*;
use rectangle::Oriented;
use resolution::Raster;
pub(crate) use seams::seams;
use slit::Slit;
#[cfg(test)]
pub(crate) use slit::own_development_error;

/// A range of log scales that bounds nothing: lengths differ by a factor of 5·10²¹.
const WIDEST_RANGE: f64 = 50.0;

/// Divides the central chart into patches, gives each an image size and a place in the packed square, and
/// finds the seams.
///
/// `length` holds the flat length of every edge, `development` the central chart of the disk that `cut` makes, `under`
/// the layout that carries them, where there is one: own coordinates of patches are developed from there.
///
/// # Errors
/// A parameter out of range, or coordinates and lengths that are not finite.
pub fn layout(
    mesh: &Mesh,
    length: &EdgeVec<f64>,
    cut: &CutGraph,
    development: &Development,
    under: Option<(&Layout, &Unfolded)>,
    params: &PatchParams,
) -> Result<PatchLayout, PatchError> {
    params.validate()?;
    let c = &mesh.connectivity;
    for f in c.faces() {
        let lengths = c.face_edges(f).map(|e| length[e]);
        let mut numbers = development.uv[f].iter().flatten().chain(&lengths);
        if let Some(&value) = numbers.find(|x| !x.is_finite()) {
            return Err(PatchError::NotFinite {
                face: f.raw(),
                value,
            });
        }
    }
    let slit = Slit::new(mesh, length, cut, development, under);
    let sets = segment_into(&slit, params);
    let mut divider = Divider::new(&slit, params);
    let sets = divider.divide(sets);
    let mut face_patch = FaceVec::filled(PatchId::new(0), c.face_count());
    let mut uv = FaceVec::filled([[0.0; 2]; 3], c.face_count());
    for (i, faces) in sets.iter().enumerate() {
        faces.iter().for_each(|&f| face_patch[f] = PatchId::new(i));
    }
    let orient = |own: &mut Vec<[f64; 2]>, (i, faces): (usize, &Vec<FaceId>)| {
        let member = |f: FaceId| face_patch[f].index() == i;
        rectangle::orient(&slit, faces, member, own)
    };
    let rows = sets.par_iter().enumerate();
    let oriented = rows.map_init(|| vec![[0.0; 2]; development.copies], orient);
    let oriented: Vec<Oriented> = oriented.collect();
    for (faces, patch) in sets.iter().zip(&oriented) {
        for (&f, &corners) in faces.iter().zip(&patch.uv) {
            uv[f] = corners;
        }
    }
    let sums = divider.sums(&sets);
    let seams = seams(mesh, &cut.is_cut, &face_patch, &uv);
    let mut layout = PatchLayout {
        face_patch,
        uv,
        patches: Vec::new(),
        seams,
        packed: None,
    };
    // The one image of all has square texels.
    (layout.patches, layout.packed) = match params.packed_side {
        None => {
            let rasters = rasters_by_bend(mesh, &layout, &oriented, &sums, params);
            images(&oriented, Placed::of(&oriented, rasters, params), params)
        }
        Some(_) => with_images(&oriented, &sums, params),
    };
    Ok(layout)
}

/// Rasters by how the surface bends in images of square texels. The patches of `layout` have none yet.
fn rasters_by_bend(
    mesh: &Mesh,
    layout: &PatchLayout,
    oriented: &[Oriented],
    sums: &[Sums],
    params: &PatchParams,
) -> Vec<Raster> {
    let finer = PatchParams {
        texel_budget: params.texel_budget.saturating_mul(FINER),
        ..params.clone()
    };
    let fine = resolution::rasters(oriented, sums, &finer);
    let content = |(patch, raster): (&Oriented, &Raster)| raster.content(patch);
    let contents: Vec<[f64; 2]> = oriented.iter().zip(&fine).map(content).collect();
    let trial = PatchLayout {
        patches: images(oriented, Placed::of(oriented, fine, &finer), &finer).0,
        seams: Vec::new(),
        ..layout.clone()
    };
    let no_scale = VertexVec::filled(0.0, mesh.connectivity.vertex_count());
    let trial = sample(mesh, &trial, &no_scale, [0.0; 3]);
    let bends = trial.iter().zip(contents);
    let bends: Vec<Bend> = bends.map(|(image, n)| Bend::of(image, n)).collect();
    let even = resolution::rasters(oriented, sums, params);
    resolution::adapted(oriented, &even, &bends, params)
}

/// The patches' faces: at most `max_count`, as far as the range of scale decides about that.
fn segment_into(slit: &Slit, params: &PatchParams) -> Vec<Vec<FaceId>> {
    let mut range = params.log_scale_range;
    let mut sets = segment::segment(slit, range);
    while params.max_count.is_some_and(|most| sets.len() > most) && range < WIDEST_RANGE {
        range = (2.0 * range).min(WIDEST_RANGE);
        let fewer = segment::segment(slit, range);
        if fewer.len() < sets.len() {
            sets = fewer;
        }
    }
    sets
}
