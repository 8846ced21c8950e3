//! Why there is no texture.

use crate::flow::solve::SolveError;
use crate::geometry::connectivity::ConnectivityError;
use std::path::PathBuf;

/// Why a pattern cannot be laid on a surface.
#[derive(Debug, thiserror::Error)]
pub enum TextureError {
    /// The faces of `atlas.npz` make no surface.
    #[error("the faces of atlas.npz make no surface ({0}); build the atlas again")]
    Connectivity(#[from] ConnectivityError),
    /// A cut edge that its segment does not list.
    #[error(
        "atlas.npz puts the edge from vertex {} to vertex {} into segment {segment}, but the vertices of that segment in atlas.json do not pass it; build the atlas again",
        ends[0], ends[1]
    )]
    CutEdge {
        /// Its vertices.
        ends: [u32; 2],
        /// The segment.
        segment: u32,
    },
    /// The tile is too large for its pattern to close.
    #[error(
        "no whole number of tiles of width {width:.6} fits between the cones of a flat surface of {side:.6} × {side:.6}; ask for a smaller --tile-size or a larger --repeat"
    )]
    TileTooLarge {
        /// Its width, flat units.
        width: f64,
        /// Root of the flat area.
        side: f64,
    },
    /// The flat surface has no area.
    #[error("the central chart of atlas.npz has the area {area}; build the atlas again")]
    NoArea {
        /// Its area.
        area: f64,
    },
    /// The translations are not those that were asked for.
    #[error(
        "the cut does not close: a transition is off by {largest_misfit:.1e} tiles; its quarter turns in atlas.json do not fit the segments, so build the atlas again"
    )]
    Misfit {
        /// Largest distance, widths of the tile.
        largest_misfit: f64,
    },
    /// The coordinates of the tile could not be computed.
    #[error("no tile coordinates: {0}")]
    Solve(#[from] SolveError),
}

/// Why an image is no pattern.
#[derive(Debug, thiserror::Error)]
pub enum ExemplarError {
    /// The file cannot be read.
    #[error("the pattern {} cannot be read: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// No image that is understood.
    #[error(
        "the pattern {} is no image that can be read ({problem}); give a {FORMATS} file",
        path.display()
    )]
    NoImage {
        /// The file.
        path: PathBuf,
        /// What the decoder said.
        problem: String,
    },
    /// More pixels than a pattern may have.
    #[error(
        "the pattern {} has {width} × {height} pixels; at most {limit} a side are taken, so make it smaller",
        path.display()
    )]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
        /// Most a side.
        limit: u32,
    },
}

/// Formats that are read.
const FORMATS: &str = "PNG or JPEG";
