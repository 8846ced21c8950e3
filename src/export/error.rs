//! Why nothing was written.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// What an export was doing to a path when the system refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Making a folder.
    CreateFolder,
    /// Writing a file.
    Write,
    /// Reading what an earlier run left.
    Read,
    /// Putting the finished folder in its place.
    Publish,
}

impl fmt::Display for Action {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Action::CreateFolder => "create the folder",
            Action::Write => "write",
            Action::Read => "read",
            Action::Publish => "put the finished folder in place at",
        })
    }
}

/// Why nothing was written. The older output is still there, untouched.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The system refused.
    #[error("cannot {action} {}: {source}; {}", path.display(), remedy(source))]
    Io {
        /// What was being done.
        action: Action,
        /// To which path.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A file format refused the data.
    #[error("cannot encode {}: {message}; please report this as a bug", path.display())]
    Encode {
        /// File that was being written.
        path: PathBuf,
        /// What the encoder said.
        message: String,
    },
    /// A path that a text file would have to name.
    #[error(
        "the path {} is no Unicode text, and a configuration holds nothing else; rename the file and its folders",
        path.display()
    )]
    NotUnicode {
        /// The path.
        path: PathBuf,
    },
    /// The asset's name is no name of a folder.
    #[error(
        "the asset name {name:?} cannot be a folder name; rename the input so that its name is not empty, does not begin with a dot and holds no slash"
    )]
    AssetName {
        /// The name.
        name: String,
    },
    /// Something that is no folder stands where the asset's folder would go.
    #[error(
        "{} exists and is not a folder; move it away or choose another output folder", path.display()
    )]
    NotAFolder {
        /// Where the folder would go.
        path: PathBuf,
    },
    /// A folder that this program did not write stands where the asset's folder would go.
    #[error(
        "{} exists and holds nothing that this command wrote earlier, so it is not replaced; move it away or choose another output folder", path.display()
    )]
    ForeignFolder {
        /// Where the folder would go.
        path: PathBuf,
    },
    /// The run was interrupted and its unfinished folders are gone.
    #[error("interrupted: nothing was written; run the same command again to continue")]
    Interrupted,
    /// Two arrays of the atlas do not fit each other.
    #[error(
        "internal: the atlas has {found} {what} where {expected} belong; please report this as a bug"
    )]
    Inconsistent {
        /// What was counted.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// A number that goes into a file is not finite.
    #[error(
        "the atlas holds a number that is not finite at {place}; the metric is too extreme for double precision: spread the curvature over more cones"
    )]
    NotFinite {
        /// Where in the files the number would have gone.
        place: String,
    },
    /// Components that share no file, and have no folders.
    #[error(
        "32-bit floats do not hold the {components} components together, and more than {most} get no folders; set output.component_folders = {components}"
    )]
    TooFarApart {
        /// How many there are.
        components: usize,
        /// How many may have folders.
        most: usize,
    },
    /// A coordinate does not fit the single precision of images and glTF.
    #[error(
        "vertex {vertex} has the coordinate {coordinate:e}, beyond the {limit:e} that images and glTF can hold; scale the model down", limit = f32::MAX
    )]
    TooLarge {
        /// Row of `positions`.
        vertex: usize,
        /// The coordinate, relative to the image origin.
        coordinate: f64,
    },
    /// A file would exceed what its format can address.
    #[error(
        "{} would take {bytes} bytes, more than its format's limit of {limit}; decimate the model or its textures", path.display()
    )]
    TooManyBytes {
        /// The file.
        path: PathBuf,
        /// Its size.
        bytes: u64,
        /// The limit.
        limit: u64,
    },
}

impl ExportError {
    /// Wraps an error of the system with what was being done to which path.
    pub(crate) fn io(action: Action, path: &Path) -> impl FnOnce(io::Error) -> ExportError + use<> {
        let path = path.to_owned();
        move |source| ExportError::Io {
            action,
            path,
            source,
        }
    }

    /// True for errors that are no fault of the user, the disk or the input.
    pub fn is_internal(&self) -> bool {
        matches!(
            self,
            ExportError::Encode { .. } | ExportError::Inconsistent { .. }
        )
    }
}

/// What the user can change about an error of the system.
fn remedy(error: &io::Error) -> &'static str {
    match error.kind() {
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
            "free some space or choose an output folder on another disk"
        }
        io::ErrorKind::PermissionDenied => "allow writing there or choose another output folder",
        io::ErrorKind::ReadOnlyFilesystem => "choose an output folder on a writable disk",
        io::ErrorKind::NotADirectory | io::ErrorKind::AlreadyExists => {
            "move the file that stands in the way or choose another output folder"
        }
        io::ErrorKind::InvalidFilename => "choose a shorter or simpler output folder",
        _ => "check the disk or choose another output folder",
    }
}

/// Why a stream could not be encoded; becomes an [`ExportError`] once the path is known.
#[derive(Debug, thiserror::Error)]
pub enum EncodeError {
    /// The stream refused.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// The format refused.
    #[error("{0}")]
    Format(String),
    /// A number is not finite; says where.
    #[error("not finite: {0}")]
    NotFinite(String),
}

impl EncodeError {
    /// The same error with the path of the file.
    pub fn at(self, path: &Path) -> ExportError {
        match self {
            EncodeError::Io(source) => ExportError::io(Action::Write, path)(source),
            EncodeError::Format(message) => ExportError::Encode {
                path: path.to_owned(),
                message,
            },
            EncodeError::NotFinite(place) => ExportError::NotFinite { place },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn remedies_follow_the_reason() {
        let error = ExportError::Io {
            action: Action::Write,
            path: "out/spot/atlas.npz".into(),
            source: io::ErrorKind::StorageFull.into(),
        };
        let text = error.to_string();
        assert!(
            text.starts_with("cannot write out/spot/atlas.npz: "),
            "{text}"
        );
        assert!(
            text.ends_with("free some space or choose an output folder on another disk"),
            "{text}"
        );
    }
}
