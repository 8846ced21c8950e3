//! An image of a patch.

use super::channels::Channel;

/// One sampled patch; row-major, row 0 at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct GeometryImage {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Surface point minus the image origin; dilated outside the patch.
    pub position: Vec<[f32; 3]>,
    /// 1 inside the patch, 0 elsewhere.
    pub alpha: Vec<f32>,
    /// Unit normal of the surface; dilated.
    pub normal: Vec<[f32; 3]>,
    /// Face of the mesh that the texel lies in; dilated.
    pub face: Vec<u32>,
    /// Log scale, interpolated; dilated.
    pub log_scale: Vec<f32>,
    /// Attributes of the source, where they were asked for ([`sample_attributes`](super::sample_attributes)); dilated.
    pub attributes: Vec<Sampled>,
}

/// One attribute of the source over an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Sampled {
    /// What it is.
    pub channel: Channel,
    /// The values.
    pub values: Values,
}

/// Values of all texels, row by row.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// So many numbers a texel, one after another.
    Numbers {
        /// How many.
        components: usize,
        /// Texels × components.
        values: Vec<f32>,
    },
    /// A number of something, or [`NONE`](crate::geometry::ids::NONE).
    Ids(Vec<u32>),
}

impl Values {
    /// How many texels they are for.
    #[must_use]
    pub fn texels(&self) -> usize {
        match self {
            Self::Numbers { components, values } => values.len() / (*components).max(1),
            Self::Ids(ids) => ids.len(),
        }
    }
}
