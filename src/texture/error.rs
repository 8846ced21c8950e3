//! Why an image is no pattern.

use std::path::PathBuf;

/// Why an image is no pattern.
#[derive(Debug, thiserror::Error)]
pub enum ExemplarError {
    /// The file cannot be read.
    #[error("the pattern {} cannot be read: {source}; give a {FORMATS} file that is there", path.display())]
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
