//! From a flat metric to charts, patches and geometry images: sections 5.4 and 5.5 of the tutorial.
pub mod axes;
pub mod charted;
pub mod charts;
pub mod cut;
pub mod develop;
pub mod geometry_image;
pub mod overlay;
pub mod patch;
pub mod patches;
pub mod plane;
pub(crate) mod raster;
mod rounding;
mod texels;
