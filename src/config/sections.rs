//! The sections of [`Config`](super::Config).
//!
//! Most are the stages' own parameters; `[input]`, `[output]`, `[pictures]` and `[run]` belong here.

use super::Limit;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

pub use crate::atlas::geometry_image::ImageParams;
pub use crate::atlas::patches::PatchParams;
pub use crate::export::report::ReportParams;
pub use crate::flow::cones::{BoundaryParams, ConeParams};
pub use crate::flow::features::FeatureParams;
pub use crate::flow::refine::RefineParams;
pub use crate::flow::ricci::FlowParams;
pub use crate::grid::GridParams;
pub use crate::read::ReadParams;
pub use crate::repair::RepairParams;

/// `[input]`: which meshes are turned into atlases.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct InputParams {
    /// Mesh files as written; relative ones start at the folder of the configuration file.
    pub paths: Vec<PathBuf>,
}

/// `[output]`: where the atlases go.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OutputParams {
    /// Folder that receives one folder an asset; a relative one starts at the folder of the
    /// configuration file.
    pub folder: PathBuf,
    /// Most components of an asset that get a folder each; where there are more, only files of all of them are written.
    pub component_folders: usize,
}

impl OutputParams {
    /// The same wherever the output goes: what can change a byte of it.
    #[must_use]
    pub fn anywhere(&self) -> Self {
        Self {
            folder: Self::default().folder,
            ..self.clone()
        }
    }

    /// Whether each component of an asset of so many gets a folder. A single one is the asset.
    #[must_use]
    pub fn has_component_folders(&self, components: usize) -> bool {
        components <= self.component_folders.max(1)
    }
}

impl Default for OutputParams {
    fn default() -> Self {
        Self {
            folder: PathBuf::from("affine-atlas-out"),
            component_folders: 256,
        }
    }
}

/// `[pictures]`: pictures of the result, drawn without a display.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PictureParams {
    /// Whether pictures are drawn.
    pub enabled: bool,
    /// Pixels on the longer side of a picture.
    pub size: usize,
}

impl Default for PictureParams {
    fn default() -> Self {
        Self {
            enabled: true,
            size: 1024,
        }
    }
}

/// `[run]`: how the program runs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RunParams {
    /// Meshes that are built at the same time, each by a process of its own; 0: as many as there are cores.
    pub jobs: usize,
    /// Threads of each such process; 0: the cores, shared among them.
    pub threads: usize,
    /// Most time that a mesh may take, seconds; [`Limit::Auto`]: in proportion to the size of its file.
    pub timeout: Limit,
    /// Most memory that a mesh may take, bytes; [`Limit::Auto`]: its share of what is free.
    pub memory: Limit,
    /// Memory of all processes together, bytes, within which jobs are started; 0: what is free when the run begins.
    pub total_memory: u64,
}
