//! One triangle mesh from geometry images: what a reader of the images can make of them.
//!
//! *Enters:* [`Images`]: the positions and masks of all patches and the samples of their seams; nothing of the
//! surface, its faces or its coordinates. *Leaves:* a [`Rebuilt`] mesh.
//!
//! ```text
//! borders → seams thinned to about a texel → grid cells inside, a constrained Delaunay band to the border → stitched
//! ```
//!
//! *Guaranteed:* watertight by construction. A patch is a disk whose border is a closed chain of seams; both sides of
//! a seam have the same vertices, and where seams meet there is one vertex. So the mesh has the Euler characteristic
//! and the boundary loops that patches and seams imply, every edge has two faces (one at the surface's boundary), no
//! face names a vertex twice, and every face is positive in the coordinates of its patch (up to the width by which a
//! border that touches itself is opened, 1e-5 texels). The same for any number of threads.
//! *Not guaranteed:* faces of positive area in space (texels of a patch of no extent coincide), and a mesh without
//! self-intersections.
//!
//! Geometry images that stand alone (Gu, Gortler, Hoppe 2002) snap their border to the grid; charts of a
//! multi-chart image (Sander, Wood, Gortler, Snyder, Hoppe 2003) are zippered together there, which moves the surface
//! by up to half a texel and may fold it. Here the seam samples are exact and belong to both sides, so nothing moves.

mod band;
mod border;
mod chain;
mod collinear;
mod crossing;
mod error;
mod frame;
mod stitch;
mod stored;
mod thin;

#[cfg(test)]
mod tests;

pub use error::RebuildError;
pub use stored::{rebuild_stored, stored_seams};

use crate::atlas::geometry_image::GeometryImage;
use crate::atlas::patches::{Domain, PatchLayout, Seam};
use crate::geometry::connectivity::Topology;
use crate::parallel;
use frame::Frame;

/// One geometry image.
#[derive(Clone, Copy, Debug)]
pub struct PatchImage<'a> {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// What it is sampled over: a block may lie across the cut.
    pub domain: Domain,
    /// (column + ½, row + ½, 1) to patch coordinates, in either domain; see [`crate::atlas::patches::Domain::to_centres`].
    pub texel_to_patch: [[f64; 3]; 2],
    /// Surface points, row by row, row 0 at the top.
    pub position: &'a [[f32; 3]],
    /// 1 where the texel's centre lies in the patch.
    pub alpha: &'a [f32],
}

/// Everything that a rebuilding knows.
#[derive(Clone, Debug)]
pub struct Images<'a> {
    /// One a patch.
    pub patches: Vec<PatchImage<'a>>,
    /// Where they meet.
    pub seams: &'a [Seam],
    /// Added to the images' positions.
    pub origin: [f64; 3],
}

impl<'a> Images<'a> {
    /// Those of an atlas in memory.
    pub fn new(layout: &'a PatchLayout, images: &'a [GeometryImage], origin: [f64; 3]) -> Self {
        let patches = layout.patches.iter().zip(images);
        Self {
            patches: patches
                .map(|(patch, image)| PatchImage {
                    width: image.width,
                    height: image.height,
                    domain: patch.domain,
                    texel_to_patch: patch.domain.to_centres(patch.texel_to_patch),
                    position: &image.position,
                    alpha: &image.alpha,
                })
                .collect(),
            seams: &layout.seams,
            origin,
        }
    }

    /// Number of texels of all images.
    pub fn texels(&self) -> usize {
        let of = |image: &PatchImage| image.width * image.height;
        self.patches.iter().map(of).sum()
    }
}

/// A mesh made of images.
#[derive(Clone, Debug, PartialEq)]
pub struct Rebuilt {
    /// Vertices in source units.
    pub positions: Vec<[f64; 3]>,
    /// Counterclockwise.
    pub faces: Vec<[u32; 3]>,
    /// Patch of every face.
    pub face_patch: Vec<u32>,
    /// Patch coordinates of the corners of every face.
    pub patch_uv: Vec<[[f64; 2]; 3]>,
    /// Counted on the mesh.
    pub topology: Topology,
}

impl Rebuilt {
    /// Compares the mesh's topology with the one it must have.
    ///
    /// # Errors
    /// The first number that differs.
    pub fn expect_topology(
        &self,
        euler_characteristic: i64,
        genus: i64,
        boundary_loops: i64,
    ) -> Result<(), RebuildError> {
        let own = self.topology;
        let rows = [
            (
                "Euler characteristic",
                own.euler_characteristic,
                euler_characteristic,
            ),
            ("genus", own.genus, genus),
            ("boundary loops", own.boundary_loops as i64, boundary_loops),
        ];
        match rows.into_iter().find(|(_, found, stated)| found != stated) {
            Some((what, found, stated)) => Err(RebuildError::Topology {
                what,
                found,
                stated,
            }),
            None => Ok(()),
        }
    }
}

/// Rebuilds the surface.
///
/// # Errors
/// Arrays that do not fit each other, numbers that are not finite, seams that do not close around a patch, and borders
/// that cross themselves.
pub fn rebuild(images: &Images<'_>) -> Result<Rebuilt, RebuildError> {
    let frames = images
        .patches
        .iter()
        .enumerate()
        .map(|(id, patch)| Frame::new(id, patch))
        .collect::<Result<Vec<Frame>, _>>()?;
    let seams = border::checked(images, &frames)?;
    let borders = border::borders(&seams, &frames)?;
    let chains = thin::thin(&seams, &frames, &borders)?;
    let bands = parallel::map(&images.patches, |id, patch| {
        let polygon = chain::polygon(&borders.loops[id], &chains);
        band::triangulate(id, patch, &frames[id], polygon)
    });
    let bands = bands.into_iter().collect::<Result<Vec<_>, _>>()?;
    stitch::stitch(images, &frames, &borders, &chains, bands)
}
