//! Why images do not make surfaces.

use super::neighbours::PatchSide;
use crate::rebuild::RebuildError;
use std::fmt;

/// Images and seams that do not make spline surfaces, and what is wrong with them.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FitError {
    /// The images are no full grids.
    #[error(
        "patch {patch} is \"flat\", an image with a mask; splines need full grids: build the atlas again with images.domain = \"rectangle\" (`affine-atlas build MESH --set images.domain=rectangle`)"
    )]
    Flat {
        /// The first such patch.
        patch: usize,
    },
    /// There is nothing to fit.
    #[error("there are no patches to fit surfaces to")]
    NoPatches,
    /// Seams that were refused.
    #[error(transparent)]
    Seams(#[from] RebuildError),
    /// Knot intervals that are too short or no length.
    #[error(
        "a knot interval of {spacing} sample steps was asked for; it must be a number from {least} on (--spacing)"
    )]
    Spacing {
        /// As given.
        spacing: f64,
        /// Least that determines the surfaces well.
        least: f64,
    },
    /// Too few samples for a cubic.
    #[error(
        "the image of patch {patch} has {columns} columns and {rows} rows, but a bicubic surface needs at least 4 of each: build the atlas again with a larger patches.texel_budget"
    )]
    TooFewSamples {
        /// Patch.
        patch: usize,
        /// Its columns.
        columns: usize,
        /// Its rows.
        rows: usize,
    },
    /// A grid whose data has not its size.
    #[error("the grid of patch {patch} has {columns} columns and {rows} rows, but {points} points")]
    GridSize {
        /// Patch.
        patch: usize,
        /// Its columns.
        columns: usize,
        /// Its rows.
        rows: usize,
        /// Its points.
        points: usize,
    },
    /// An image that does not cover its rectangle.
    #[error(
        "texel_to_patch of patch {patch} takes its first and last texels to ({:?}) and ({:?}), which is no rectangle from the origin", .corners[0], .corners[1]
    )]
    Lattice {
        /// Patch.
        patch: usize,
        /// Lower left and upper right corner.
        corners: [[f64; 2]; 2],
    },
    /// A sample without a place.
    #[error(
        "the sample in column {column}, row {row} of patch {patch} is {value}; it must be finite and have A = 1, as the images of a build with images.domain = \"rectangle\" do"
    )]
    Sample {
        /// Patch.
        patch: usize,
        /// Column.
        column: usize,
        /// Row.
        row: usize,
        /// What it is.
        value: &'static str,
    },
    /// A seam inside a rectangle.
    #[error(
        "seam {seam} runs through patch {patch} at ({:.6}, {:.6}) of its width and height; seams of rectangles run along their sides", at[0], at[1]
    )]
    NotOnSide {
        /// Seam.
        seam: usize,
        /// Patch.
        patch: usize,
        /// Beginning of the edge, in widths and heights.
        at: [f64; 2],
    },
    /// A side without neighbour or boundary.
    #[error("no seam runs along {side}; the seams must close around every patch")]
    NoSeam {
        /// Which.
        side: PatchSide,
    },
    /// A side that is covered in part or more than once.
    #[error(
        "the seams along {side} cover {covered:.6} of it; it must be exactly 1, by a whole side of one neighbour"
    )]
    NotWhole {
        /// Which.
        side: PatchSide,
        /// In sides.
        covered: f64,
    },
    /// A side with two neighbours.
    #[error(
        "{side} meets {} and {}; it must be a whole side of one neighbour", neighbour(&across[0]), neighbour(&across[1])
    )]
    TwoNeighbours {
        /// Which.
        side: PatchSide,
        /// What lies across.
        across: [Option<PatchSide>; 2],
    },
    /// A side that is glued to itself.
    #[error("{side} meets itself; it must meet a whole side of a neighbour")]
    Folded {
        /// Which.
        side: PatchSide,
    },
    /// Sides with different numbers of samples.
    #[error(
        "{} has {} samples, but {}, which it meets, has {}; they must be equal", sides[0], samples[0], sides[1], samples[1]
    )]
    Counts {
        /// Which.
        sides: [PatchSide; 2],
        /// Of them.
        samples: [usize; 2],
    },
    /// Corners that should be one point.
    #[error(
        "corner {corner} of patch {patch} lies {distance:.2e} from the other corners at its point, {relative:.2e} of the diagonal; images and seams do not belong together"
    )]
    CornersApart {
        /// Patch.
        patch: usize,
        /// Counterclockwise from the lower left.
        corner: usize,
        /// From their mean, source units.
        distance: f64,
        /// In diagonals.
        relative: f64,
    },
    /// Control points that the samples do not determine.
    #[error(
        "{samples} samples do not determine {control_points} control points: please report this with the folder, and use a larger --spacing meanwhile"
    )]
    Undetermined {
        /// Along a side.
        samples: usize,
        /// Along it.
        control_points: usize,
    },
    /// There is no surface to measure against.
    #[error("the mesh to measure against has no faces")]
    NoSurface,
}

impl fmt::Display for PatchSide {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the {} side of patch {}", self.side.name(), self.patch)
    }
}

fn neighbour(side: &Option<PatchSide>) -> String {
    side.map_or("the boundary".to_owned(), |side| side.to_string())
}
