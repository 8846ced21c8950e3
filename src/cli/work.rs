//! What the command line asks of the library.

use affine_atlas::batch::cache::Verdict;
use affine_atlas::batch::merge::Merged;
use affine_atlas::batch::plan::Plan;
use affine_atlas::batch::shard::Shard;
use affine_atlas::batch::worker::Job;
use affine_atlas::batch::{Batch, Task, Watcher};
use affine_atlas::config::Config;
use affine_atlas::config::assets::Asset;
use affine_atlas::job::fit::{FitParams, Unfitted};
use affine_atlas::job::texture::TextureParams;
use affine_atlas::observe::Observer;
use affine_atlas::outcome::{AssetOutcome, Failure};
use std::path::{Path, PathBuf};

/// Functions of the library that the commands call. Tests put their own in.
pub struct Work {
    /// Builds what is not whole, each asset in a process of its own, and writes down what became of it.
    pub batch: fn(&Batch<'_>, &[Task], &dyn Watcher) -> Recorded,
    /// The same for a shard of the plan of this id, in a file of its own.
    pub shard: fn(&Batch<'_>, &str, Shard, &[Task], &dyn Watcher) -> Recorded,
    /// Reads what all shards of a plan wrote down.
    pub collect: fn(&Plan) -> Result<Merged, Failure>,
    /// Writes it down as one batch.
    pub merge: fn(&Plan, &Merged) -> Result<(), Failure>,
    /// Says what a batch would build.
    pub decide: fn(&Batch<'_>, &[Task]) -> Vec<Verdict>,
    /// Does a worker's job: input, output root.
    pub work: fn(&Job, &Path, &Path) -> AssetOutcome,
    /// Says what a build would do, without building.
    pub inspect: fn(&Asset, &Config) -> Result<Inspection, Failure>,
    /// Flattens one asset with different numbers of cones and writes what came of it into a folder below the output folder
    /// given.
    pub survey: fn(&SurveyRequest<'_>, &dyn Observer) -> Surveyed,
    /// Name of that folder for an asset's id.
    pub survey_folder: fn(&str) -> String,
    /// Reads an output folder back and checks it.
    pub verify: fn(&VerifyRequest) -> Result<VerifyResult, Failure>,
    /// Makes a mesh again from an asset's folder.
    pub rebuild: fn(&RebuildRequest) -> Result<RebuildResult, Failure>,
    /// Fits spline surfaces to a mesh or an asset's folder and writes them into a folder.
    pub fit: fn(&FitRequest, &dyn Observer) -> Result<FitResult, Failure>,
    /// Lays a pattern over an asset's surface and writes the texture into a folder.
    pub texture: fn(&TextureRequest) -> Result<TextureResult, Failure>,
    /// Says why an asset failed or is distorted.
    pub explain: fn(&ExplainRequest) -> Result<Explained, Failure>,
    /// Removes folders that are being written. Called once before the program is stopped.
    pub remove_staging: fn(),
}

/// What became of every asset, and whether that could be written down.
pub type Recorded = (Vec<AssetOutcome>, Result<(), Failure>);

/// What `check` says of one asset.
pub struct Inspection {
    /// Topology, Gauss–Bonnet budget, what would be repaired: lines for a reader.
    pub text: String,
    /// Whether a build would be refused for what is known already.
    pub refused: bool,
    /// A GLB of the regions for which no circle packing exists, where there are any.
    pub region: Option<Vec<u8>>,
}

/// What `cones` is asked for one asset.
pub struct SurveyRequest<'a> {
    /// The asset.
    pub asset: &'a Asset,
    /// The output folder.
    pub output: &'a Path,
    /// The effective configuration.
    pub config: &'a Config,
    /// Numbers of cones, where the arguments name them.
    pub counts: Option<&'a [usize]>,
}

/// What `cones` says of one asset.
pub struct Surveyed {
    /// Topology, table and suggestion: lines for a reader. Empty where nothing could be tried.
    pub text: String,
    /// The same for programs.
    pub json: Option<serde_json::Value>,
    /// Configuration of the suggested number of cones, in the folder that was written.
    pub suggested: Option<String>,
    /// What became of the asset.
    pub outcome: AssetOutcome,
}

/// What `verify` is asked for one folder.
pub struct VerifyRequest {
    /// An asset's folder, or a folder of assets.
    pub folder: PathBuf,
    /// The mesh it was made from.
    pub source: Option<PathBuf>,
    /// How many cones there must be.
    pub cones: Option<usize>,
}

/// What `verify` found.
pub struct VerifyResult {
    /// A line a check and the totals.
    pub text: String,
    /// The same for programs.
    pub json: serde_json::Value,
    /// Checks that failed.
    pub failed: usize,
}

/// What `rebuild` is asked for.
pub struct RebuildRequest {
    /// An asset's folder.
    pub folder: PathBuf,
    /// A mesh to compare with.
    pub against: Option<PathBuf>,
}

/// What `fit` is asked for.
pub struct FitRequest {
    /// A mesh, or an asset's folder.
    pub input: PathBuf,
    /// Folder that holds the folder to write.
    pub root: PathBuf,
    /// Name of the folder to write.
    pub name: String,
    /// How.
    pub params: FitParams,
}

/// What `fit` found.
pub struct FitResult {
    /// Figures: lines for a reader.
    pub text: String,
    /// The same for programs.
    pub json: serde_json::Value,
    /// Components without a surface.
    pub unfitted: Vec<Unfitted>,
}

/// What `texture` is asked for.
pub struct TextureRequest {
    /// An asset's folder.
    pub folder: PathBuf,
    /// Folder that holds the folder to write.
    pub root: PathBuf,
    /// Name of the folder to write.
    pub name: String,
    /// The pattern and how it is laid.
    pub params: TextureParams,
}

/// What `texture` made.
pub struct TextureResult {
    /// Figures: lines for a reader.
    pub text: String,
    /// The same for programs.
    pub json: serde_json::Value,
}

/// What `explain` is asked for.
pub struct ExplainRequest {
    /// A mesh, an asset's folder, or the place where an asset's folder would be.
    pub asset: PathBuf,
    /// The effective configuration, for a mesh.
    pub config: Config,
}

/// What `explain` says.
pub struct Explained {
    /// Sentences.
    pub text: String,
    /// Whether the asset fails.
    pub failed: bool,
    /// The faces at fault in colour, where there are any.
    pub glb: Option<Vec<u8>>,
}

/// What `rebuild` made.
pub struct RebuildResult {
    /// The mesh.
    pub glb: Vec<u8>,
    /// Its figures: lines for a reader.
    pub text: String,
    /// The same for programs.
    pub json: serde_json::Value,
}
