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
mod coverage;
mod demand;
mod dissolve;
mod divide;
mod given;
mod holes;
mod lattice;
mod merge;
mod overlap;
mod packing;
mod placement;
mod places;
pub(crate) mod raster;
mod rectangle;
mod resolution;
mod seams;
mod segment;
mod sets;
mod slit;
mod teeth;

#[cfg(test)]
pub(crate) mod samples;
#[cfg(test)]
mod tests;

use crate::atlas::cut::CutGraph;
use crate::atlas::develop::{Development, Unfolded};
use crate::atlas::geometry_image::sample;
use crate::atlas::overlay::Layout;
use crate::atlas::plane::Similarity;
use crate::atlas::texels::{Bend, FINER};
use crate::geometry::ids::{EdgeVec, FaceId, FaceVec, PatchId, VertexVec};
use crate::geometry::mesh::Mesh;
pub(crate) use bend::edge_bends;
use demand::Sums;
use divide::Divider;
pub use given::charts_of;
pub(crate) use places::packed;
use places::{Placed, images, with_images};
use rayon::prelude::*;
use rectangle::{Directions, Oriented};
use resolution::Raster;
pub(crate) use seams::seams;
use slit::Slit;
pub(super) use slit::apex;
#[cfg(test)]
pub(crate) use slit::own_development_error;

/// Most texels on a side of an image.
pub const MAX_SIDE: usize = 8192;

/// Fewer texels on a side of the packed image hold no patches worth the name.
const LEAST_PACKED_SIDE: usize = 64;
/// A range of log scales that bounds nothing: lengths differ by a factor of 5·10²¹.
const WIDEST_RANGE: f64 = 50.0;

/// The domain of one geometry image.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    /// Patch coordinates to central-chart coordinates; none for a rectangle, which is no similar picture of it.
    pub to_chart: Option<Similarity>,
    /// Columns of the image.
    pub width: usize,
    /// Rows of the image.
    pub height: usize,
    /// (column, row, 1), row 0 at the top, to patch coordinates. The centre of texel (0, 0) is (0.5, 0.5), and there a flat
    /// patch is sampled; a rectangle is sampled at whole numbers, from (0, 0) at its upper left corner on.
    pub texel_to_patch: [[f64; 3]; 2],
    /// Where the patch lies in the packed unit square: `packed = uv * scale + offset`, v up.
    pub packed_scale: f64,
    /// See `packed_scale`.
    pub packed_offset: [f64; 2],
}

impl Patch {
    /// How texels lie in it.
    pub fn domain(&self) -> Domain {
        match self.to_chart {
            Some(_) => Domain::Flat,
            None => Domain::Rectangle,
        }
    }
}

/// What geometry images are sampled over.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Domain {
    /// A similarity of the central chart, sampled at texel centres, with a mask.
    #[default]
    Flat,
    /// A rectangle, sampled at grid corners from border to border: a full grid.
    Rectangle,
}

impl Domain {
    /// A map of an image as a map of (column + ½, row + ½, 1), whichever points it holds: texel centres, or grid corners.
    #[must_use]
    pub fn to_centres(self, texel_to_patch: [[f64; 3]; 2]) -> [[f64; 3]; 2] {
        match self {
            Self::Flat => texel_to_patch,
            Self::Rectangle => texel_to_patch.map(|[a, b, c]| [a, b, c - 0.5 * (a + b)]),
        }
    }
}

/// A maximal chain along which two patches meet, or a patch meets itself or the surface's boundary; or a part of the cut, wherever it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Seam {
    /// Patch on the left of the chain.
    pub left: PatchId,
    /// Patch on the right; none at a surface boundary.
    pub right: Option<PatchId>,
    /// Samples in order; the first again at the end of a closed seam.
    pub samples: Vec<SeamSample>,
}

impl Seam {
    /// Whether both sides have the same coordinates in one patch. Inside a rectangle, which may lie across the cut, this is no border; where a flat patch is slit open it is.
    pub fn is_inner(&self) -> bool {
        self.right == Some(self.left) && self.samples.iter().all(|s| s.left == s.right)
    }
}

/// A point of a seam, the same for both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeamSample {
    /// In space.
    pub position: [f64; 3],
    /// In the left patch.
    pub left: [f64; 2],
    /// In the right patch; NaN at a surface boundary.
    pub right: [f64; 2],
}

/// All patches of one component.
#[derive(Clone, Debug)]
pub struct PatchLayout {
    /// Patch of every face.
    pub face_patch: FaceVec<PatchId>,
    /// Patch coordinates of the corners of every face.
    pub uv: FaceVec<[[f64; 2]; 3]>,
    /// The patches.
    pub patches: Vec<Patch>,
    /// Their common borders.
    pub seams: Vec<Seam>,
    /// Where flat images lie in one image of all, if one was asked for.
    pub packed: Option<PackedPlaces>,
}

/// The packed square as an image: texel for texel the images of the patches, each in a place of its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PackedPlaces {
    /// Columns and rows. The unit square of packed coordinates is all of it.
    pub side: usize,
    /// Column and row, from the top, of the upper left texel of each image.
    pub corners: Vec<[usize; 2]>,
}

/// Parameters of patches and packing.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PatchParams {
    /// Largest log-scale range inside a patch (natural logarithm of the length scale).
    pub log_scale_range: f64,
    /// Texels of all images of a component together (about).
    pub texel_budget: usize,
    /// Least texels on the longer side of an image. Beyond that a patch keeps half as many, and at most 8, on its shorter side, and some inside,
    /// so that a budget too small for all patches together is exceeded.
    pub min_side: usize,
    /// Texels between patches in the packed square, and around each image.
    pub padding: usize,
    /// Most patches: where there are more, `log_scale_range` is doubled until there are not, or it is as wide as a configuration may ask for.
    pub max_count: Option<usize>,
    /// Columns and rows of one image of all flat patches. Patches get fewer texels than the budget has where they would not fit.
    pub packed_side: Option<usize>,
    /// Texels of all flat patches on one lattice of the central chart: square, parallel to its axes, each size a power of two times the others. Off: texels of each patch as
    /// long and as wide as suits it.
    pub shared_lattice: bool,
}

impl Default for PatchParams {
    fn default() -> Self {
        Self {
            log_scale_range: 2.0,
            texel_budget: 512 * 512,
            min_side: 16,
            padding: 2,
            max_count: None,
            packed_side: None,
            shared_lattice: false,
        }
    }
}

/// Why there are no patches.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PatchError {
    /// A parameter is out of its range.
    #[error("patches.{name} is {value}; set it to a number from {least} to {most}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// What was given.
        value: f64,
        /// Least allowed.
        least: f64,
        /// Most allowed.
        most: f64,
    },
    /// The central chart or the metric has no numbers for a face.
    #[error(
        "face {face} has no finite place in the plane (coordinate or flat length {value}); its scale is beyond what can be computed, use more cones or smaller ones"
    )]
    NotFinite {
        /// The face.
        face: u32,
        /// The number.
        value: f64,
    },
}

impl PatchParams {
    /// The directions that rectangles around patches may have.
    fn directions(&self) -> Directions {
        if self.shared_lattice {
            Directions::Axes
        } else {
            Directions::Any
        }
    }

    /// Refuses values that no layout can have.
    pub fn validate(&self) -> Result<(), PatchError> {
        let bounds = [
            ("log_scale_range", self.log_scale_range, 1e-3, 1e3),
            ("texel_budget", self.texel_budget as f64, 1.0, 1e9),
            ("min_side", self.min_side as f64, 1.0, 4096.0),
            ("padding", self.padding as f64, 0.0, 64.0),
            ("max_count", self.max_count.unwrap_or(1) as f64, 1.0, 1e9),
            (
                "packed_side",
                self.packed_side.unwrap_or(LEAST_PACKED_SIDE) as f64,
                LEAST_PACKED_SIDE as f64,
                MAX_SIDE as f64,
            ),
        ];
        for (name, value, least, most) in bounds {
            if !(least..=most).contains(&value) {
                return Err(PatchError::Parameter {
                    name,
                    value,
                    least,
                    most,
                });
            }
        }
        Ok(())
    }
}

/// Divides the central chart into patches, gives each an image size and a place in the packed square, and
/// finds the seams.
///
/// `length` holds the flat length of every edge, `development` the central chart of the disk that `cut` makes, `under`
/// the layout that carries them, where there is one: own coordinates of patches are developed from there. `domain` is what
/// the patches are for: images of their own, or a division into rectangles.
///
/// # Errors
/// A parameter out of range, or coordinates and lengths that are not finite.
pub fn layout(
    mesh: &Mesh,
    length: &EdgeVec<f64>,
    cut: &CutGraph,
    development: &Development,
    under: Option<(&Layout, &Unfolded)>,
    domain: Domain,
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
    let (sets, range) = segment_into(&slit, domain, params);
    let mut divider = Divider::new(&slit, params);
    let sets = match domain {
        Domain::Flat => divider.divide(sets, range),
        // All else is decided where lines may cross faces.
        Domain::Rectangle => divider.divide_along_creases(sets),
    };
    let mut face_patch = FaceVec::filled(PatchId::new(0), c.face_count());
    let mut uv = FaceVec::filled([[0.0; 2]; 3], c.face_count());
    for (i, faces) in sets.iter().enumerate() {
        faces.iter().for_each(|&f| face_patch[f] = PatchId::new(i));
    }
    let orient = |own: &mut Vec<[f64; 2]>, (i, faces): (usize, &Vec<FaceId>)| {
        let member = |f: FaceId| face_patch[f].index() == i;
        rectangle::orient(&slit, faces, member, params.directions(), own)
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
    // Rectangles have rasters of their own, and the one image of all has square texels, as has a lattice.
    (layout.patches, layout.packed) = match domain {
        Domain::Flat if params.packed_side.is_none() && !params.shared_lattice => {
            let rasters = rasters_by_bend(mesh, &layout, &oriented, &sums, params);
            images(&oriented, Placed::of(&oriented, rasters, params), params)
        }
        _ => with_images(&oriented, &sums, params),
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

/// The patches' faces: at most `max_count`, as far as the range of scale decides about that; and that range.
fn segment_into(slit: &Slit, domain: Domain, params: &PatchParams) -> (Vec<Vec<FaceId>>, f64) {
    let mut range = params.log_scale_range;
    let mut sets = segment::segment(slit, range, domain);
    while params.max_count.is_some_and(|most| sets.len() > most) && range < WIDEST_RANGE {
        range = (2.0 * range).min(WIDEST_RANGE);
        let fewer = segment::segment(slit, range, domain);
        if fewer.len() < sets.len() {
            sets = fewer;
        }
    }
    (sets, range)
}
