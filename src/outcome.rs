//! What became of an asset: what a job tells the command line and the manifest.

use crate::export::folder::{COMPONENTS, list_files};
use crate::product::AffineAtlas;
use serde::{Deserialize, Serialize, Serializer};
use std::path::{Path, PathBuf};

/// Why an asset or a component was not built (`kind` in the manifest).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FailureKind {
    /// The input file was refused.
    Input,
    /// The curvature asked for cannot exist.
    Prescription,
    /// The flow did not reach the curvature asked for.
    NotConverged,
    /// What was built did not pass the checks of `verify`: it was not published.
    Unverified,
    /// Took longer than allowed.
    Timeout,
    /// Needed more memory than allowed.
    Memory,
    /// The result could not be written.
    Output,
    /// Somebody asked to stop; in a manifest that is a state, not a failure.
    Cancelled,
    /// An error of this program.
    Internal,
}

impl FailureKind {
    /// The word of the output format (`docs/format.md`).
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Input => "input",
            Self::Prescription => "prescription",
            Self::NotConverged => "not_converged",
            Self::Unverified => "unverified",
            Self::Timeout => "timeout",
            Self::Memory => "memory",
            Self::Output => "output",
            Self::Cancelled => "cancelled",
            Self::Internal => "internal",
        }
    }
}

/// A refusal or failure.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Failure {
    /// Which sort.
    pub kind: FailureKind,
    /// One sentence that says what was wrong, and what to change.
    pub message: String,
}

/// A path need not be Unicode; this one is only shown.
fn shown<S: Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&path.to_string_lossy())
}

/// The figures that the final summary shows of a built component.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Vertices of the surface the charts are defined on.
    pub vertices: usize,
    /// Its faces.
    pub faces: usize,
    /// Its genus.
    pub genus: usize,
    /// Its boundary loops.
    pub boundary_loops: usize,
    /// Cones.
    pub cones: usize,
    /// Cells of its grid; none where it has flat patches.
    #[serde(default)]
    pub cells: Option<usize>,
    /// max |K − K̄| over the prescribed vertices, radians.
    pub max_curvature_error: f64,
    /// True where that is more than the bound that was asked for, because rounding stopped the flow.
    #[serde(default)]
    pub limited_by_float64: bool,
    /// (9), both areas normalised to 1.
    pub area_distortion: f64,
    /// Folder that was written.
    #[serde(serialize_with = "shown")]
    pub folder: PathBuf,
}

impl Summary {
    /// The figures of an atlas that was written to `folder`.
    #[must_use]
    pub fn of(atlas: &AffineAtlas, folder: PathBuf) -> Self {
        Self {
            vertices: atlas.topology.vertices,
            faces: atlas.topology.faces,
            genus: atlas.topology.genus as usize,
            boundary_loops: atlas.topology.boundary_loops,
            cones: atlas.prescription.cones.len(),
            cells: atlas.grid.as_ref().map(|grid| grid.cells()),
            max_curvature_error: atlas.metric.max_curvature_error,
            limited_by_float64: atlas.limited_by_float64(),
            area_distortion: atlas.quality.area_distortion,
            folder,
        }
    }
}

/// What became of one component.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComponentOutcome {
    /// Which, from 0.
    pub index: usize,
    /// Figures, or why not.
    pub result: Result<Summary, Failure>,
}

/// What became of one asset as a whole.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AssetState {
    /// Every component was built, unless `components` says otherwise.
    Built,
    /// The outputs of an earlier run are whole, and input, configuration and version are the same.
    Cached,
    /// Nothing was built for a reason that concerns the whole file.
    Failed(Failure),
    /// Stopped by the user.
    Cancelled,
}

/// What became of one asset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AssetOutcome {
    /// Its id.
    pub id: String,
    /// As a whole.
    pub state: AssetState,
    /// Component by component; empty where the file was not even separated into components.
    pub components: Vec<ComponentOutcome>,
    /// Wall time.
    pub seconds: f64,
    /// Files of the asset, relative to its folder; after a failure those of an earlier run.
    pub files: Vec<String>,
    /// BLAKE3 hash of the input, hexadecimal; absent where it could not be read.
    pub input_hash: Option<String>,
    /// What was said of it: what the reader left out, what was asked for and could not be had, much distortion.
    pub notes: Vec<String>,
    /// Most memory that the asset's process held, bytes; absent where the system does not tell, or nothing was computed.
    #[serde(default)]
    pub peak_memory: Option<u64>,
    /// Name of the machine whose worker said this; absent where nothing was computed, or the machine has no name.
    #[serde(default)]
    pub host: Option<String>,
    /// Whether nothing was built but the result of an earlier run is still in place.
    #[serde(default)]
    pub kept: bool,
}

impl AssetOutcome {
    /// The outcome of an asset of which no component was looked at.
    #[must_use]
    pub fn whole(id: &str, state: AssetState, seconds: f64) -> Self {
        Self {
            id: id.to_owned(),
            state,
            components: Vec::new(),
            seconds,
            files: Vec::new(),
            input_hash: None,
            notes: Vec::new(),
            peak_memory: None,
            host: None,
            kept: false,
        }
    }

    /// The outcome of an asset that failed as a whole.
    #[must_use]
    pub fn failed(id: &str, failure: Failure, seconds: f64) -> Self {
        Self::whole(id, AssetState::Failed(failure), seconds)
    }

    /// Looks what is in place of an asset of which nothing was built: what an earlier run left there is kept.
    pub fn look_for_older(&mut self, output: &Path) {
        let new = matches!(self.state, AssetState::Built | AssetState::Cached)
            && (self.components.is_empty() || self.components.iter().any(|c| c.result.is_ok()));
        if !new {
            self.files = list_files(&output.join(&self.id)).unwrap_or_default();
            // A folder of something else is not replaced, but nor is it a result.
            let is_of_atlas = |file: &String| file.ends_with("atlas.json") || file == COMPONENTS;
            self.kept = self.files.iter().any(is_of_atlas);
        }
    }

    /// Every failure, with its component where it concerns only one.
    pub fn failures(&self) -> impl Iterator<Item = (Option<usize>, &Failure)> {
        let whole = match &self.state {
            AssetState::Failed(failure) => Some((None, failure)),
            AssetState::Built | AssetState::Cached | AssetState::Cancelled => None,
        };
        let parts = self.components.iter().filter_map(|component| {
            let failure = component.result.as_ref().err()?;
            Some((Some(component.index), failure))
        });
        whole.into_iter().chain(parts)
    }

    /// The word of the output format (`docs/format.md`): `built`, `cached`, `failed` (also where only a component failed)
    /// or `cancelled`.
    #[must_use]
    pub fn state_name(&self) -> &'static str {
        match self.state {
            AssetState::Cancelled => "cancelled",
            AssetState::Built if self.failures().next().is_none() => "built",
            AssetState::Cached if self.failures().next().is_none() => "cached",
            AssetState::Built | AssetState::Cached | AssetState::Failed(_) => "failed",
        }
    }
}
