//! A patch, its image, and its seams: what [`patches`](super::patches) makes and images are sampled over.

use crate::atlas::plane::Similarity;
use crate::geometry::ids::{FaceVec, PatchId};

/// Most texels on a side of an image.
pub const MAX_SIDE: usize = 8192;

/// The domain of one geometry image.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    /// How texels lie in it.
    pub domain: Domain,
    /// Patch coordinates to central-chart coordinates; none for a block of the grid, which is no similar picture of it.
    pub to_chart: Option<Similarity>,
    /// Columns of the image.
    pub width: usize,
    /// Rows of the image.
    pub height: usize,
    /// (column, row, 1), row 0 at the top, to patch coordinates. The centre of texel (0, 0) is (0.5, 0.5), and there a flat
    /// patch is sampled; a block is sampled at whole numbers, and its row 0 is its lowest.
    pub texel_to_patch: [[f64; 3]; 2],
    /// Where the patch lies in the packed unit square: `packed = uv * scale + offset`, v up.
    pub packed_scale: f64,
    /// See `packed_scale`.
    pub packed_offset: [f64; 2],
}

impl Patch {
    /// Patch coordinates in the packed unit square, v up: `TEXCOORD_0` of glTF has 1 − v.
    pub fn packed(&self, uv: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|i| self.packed_scale * uv[i] + self.packed_offset[i])
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
    Flat,
    /// A block of cells of the integer grid, sampled from border to border.
    #[default]
    Grid,
}

impl Domain {
    /// A map of an image as a map of (column + ½, row + ½, 1), whichever points it holds: texel centres, or grid corners.
    #[must_use]
    pub fn to_centres(self, texel_to_patch: [[f64; 3]; 2]) -> [[f64; 3]; 2] {
        match self {
            Self::Flat => texel_to_patch,
            Self::Grid => texel_to_patch.map(|[a, b, c]| [a, b, c - 0.5 * (a + b)]),
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
    /// Whether both sides have the same coordinates in one patch. Inside a block, which may lie across the cut, this is no border; where a flat patch is slit open it is.
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
