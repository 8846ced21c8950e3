//! Why a plan cannot be made or carried out, in the user's words.

use super::FORMAT_VERSION;
use crate::batch::cache::VERSION;
use std::path::PathBuf;

/// Why a plan cannot be made or carried out.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlanError {
    /// A path that a plan cannot hold.
    #[error("the path {} is no Unicode text, and a plan holds nothing else", path.display())]
    NotUnicode {
        /// Which.
        path: PathBuf,
    },
    /// The file cannot be read.
    #[error("the plan {} cannot be read: {reason}", path.display())]
    Unreadable {
        /// Which.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// Another sort of file.
    #[error("{} is no plan: its first line is not one that `affine-atlas plan` writes", path.display())]
    NoPlan {
        /// Which.
        path: PathBuf,
    },
    /// A later format.
    #[error("the plan {} has version {found} of its format, and this program reads version {FORMAT_VERSION}", path.display())]
    Format {
        /// Which.
        path: PathBuf,
        /// Its version.
        found: u32,
    },
    /// Another version of the program made it.
    #[error("the plan {} was made by version {found} of affine-atlas, and this is {VERSION}", path.display())]
    Version {
        /// Which.
        path: PathBuf,
        /// The version that made it.
        found: String,
    },
    /// The end is missing.
    #[error("the plan {} ends after line {lines}, and its last line is missing", path.display())]
    Cut {
        /// Which.
        path: PathBuf,
        /// Whole lines that are there.
        lines: usize,
    },
    /// A line is not what was written.
    #[error("line {line} of the plan {} is damaged: {reason}", path.display())]
    Damaged {
        /// Which.
        path: PathBuf,
        /// From 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// Every line is one, but not all are those that were written.
    #[error("the plan {} was changed: its lines have the hash {found}, and its last line says {stated}", path.display())]
    Changed {
        /// Which.
        path: PathBuf,
        /// Of the lines that are there.
        found: String,
        /// Of those that were written.
        stated: String,
    },
    /// A configuration means something else to this program.
    #[error("line {line} of the plan {}: the configuration has the hash {found} here and {stated} where the plan was made", path.display())]
    OtherConfig {
        /// Which.
        path: PathBuf,
        /// From 1.
        line: usize,
        /// Its hash here.
        found: String,
        /// Its hash in the plan.
        stated: String,
    },
    /// The current folder is not the one in which it was made.
    #[error("the plan was made in {}, and this is {}, from where {} is not to be seen", folder.display(), here.display(), missing.display())]
    Elsewhere {
        /// The plan's.
        folder: PathBuf,
        /// The current one.
        here: PathBuf,
        /// What.
        missing: PathBuf,
    },
    /// The current folder has the name of the one in which it was made, and nothing of it.
    #[error("nothing of the plan is to be seen from {}: {} is not there, nor any of the meshes", here.display(), missing.display())]
    NothingHere {
        /// The current folder.
        here: PathBuf,
        /// What should be there.
        missing: PathBuf,
    },
}

impl PlanError {
    /// What to change.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::NotUnicode { .. } => "rename it, or use `affine-atlas build`",
            Self::Unreadable { .. } => {
                "check the name; `affine-atlas plan … --plan FILE` writes one"
            }
            Self::NoPlan { .. } => "name a file that `affine-atlas plan … --plan FILE` wrote",
            Self::Format { .. } | Self::Version { .. } => {
                "plan again with this version, or carry the plan out with that one"
            }
            Self::Cut { .. } | Self::Damaged { .. } | Self::Changed { .. } => {
                "copy it again, or plan again: what is built is not built again"
            }
            Self::OtherConfig { .. } => "plan again with this program",
            Self::NothingHere { .. } => {
                "mount the file system on which the plan was made on this machine, or plan again"
            }
            Self::Elsewhere { .. } => {
                "start it in the folder in which the plan was made, wherever that is mounted on this machine, or plan again"
            }
        }
    }
}
