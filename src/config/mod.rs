//! Configuration: from `config.toml` and `--set` to checked parameters of every stage.
//!
//! *Enters:* a TOML text and overrides. *Leaves:* a [`Config`] whose every value lies in the range
//! that [`keys::KEYS`] states, or a [`ConfigError`] that names file, line, column, the offending
//! text and the nearest known key.
//!
//! [`Config`] only composes the stages' own `Params`; defaults live beside the stages. What a user
//! may write is described a second time, in words and ranges, by [`keys::KEYS`]; tests hold the
//! two and the commented `config.toml` at the top of the repository together.

pub mod assets;
mod check;
mod domain;
pub mod error;
pub mod keys;
mod layers;
mod limit;
mod load;
mod overrides;
mod presets;
pub(crate) mod scope;
mod sections;
mod source;

pub use error::{ConfigError, Location};
pub use limit::Limit;
pub use load::{Loaded, defaults, load, parse};
pub use overrides::Override;
pub use presets::Preset;
pub use sections::*;

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// The commented configuration of this repository. It parses to the resolved [`Config::default`] but for `input.paths`, which names a fixture.
pub const COMMENTED_DEFAULT: &str = include_str!("../../config.toml");

/// The commented configuration that `affine-atlas init` writes: its `input.paths` stands for all meshes in and below its own folder, however
/// many there are.
#[must_use]
pub fn commented_for_its_folder() -> String {
    let lines = COMMENTED_DEFAULT.lines().map(|line| {
        let is_paths = line.starts_with("paths = ");
        if is_paths { "paths = [\".\"]" } else { line }
    });
    lines.flat_map(|line| [line, "\n"]).collect()
}

/// Everything that a run needs to know beside the meshes themselves.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Which preset gave defaults; its values are in the other fields already, so it is never written.
    #[serde(skip_serializing)]
    pub preset: Option<Preset>,
    /// The `[[asset]]` tables as written; they are in effect through [`Loaded`] only, so this is empty in every configuration that
    /// was loaded, and never written.
    #[serde(skip_serializing)]
    pub asset: Vec<toml::Table>,
    /// Which meshes.
    pub input: InputParams,
    /// Where the atlases go.
    pub output: OutputParams,
    /// How large an input file may be.
    pub limits: ReadParams,
    /// What may be changed to make a mesh a manifold.
    pub repair: RepairParams,
    /// Where the curvature goes (5.2).
    pub cones: ConeParams,
    /// What happens on boundary loops (5.2).
    pub boundary: BoundaryParams,
    /// Which edges become lines of the atlas.
    pub features: FeatureParams,
    /// Connectivity repair around cones (5.3).
    pub connectivity: RefineParams,
    /// The Ricci flow (3.3, 3.4, 4.2).
    pub flow: FlowParams,
    /// Patches (5.5).
    pub patches: PatchParams,
    /// The integer grid.
    pub grid: GridParams,
    /// Geometry images (5.5).
    pub images: ImageParams,
    /// Pictures of the result.
    pub pictures: PictureParams,
    /// A page of each component to look at in a browser.
    pub report: ReportParams,
    /// How the program runs; never changes a result.
    pub run: RunParams,
}

impl Config {
    /// The effective configuration, resolved, without what cannot change an output byte of one asset: the
    /// list of inputs, the output folder, the number of threads, and where cones and features were read from once they are in their lists.
    #[must_use]
    pub fn canonical(&self) -> Self {
        // Settings that contradict each other have no effect: nothing is built with them.
        let own = self.clone().resolved();
        let own = own.unwrap_or_else(|_| self.clone());
        let mut cones = own.cones.clone();
        if cones.file.is_some() && !cones.list.is_empty() {
            // That it was a file matters: its curvatures count as rounded.
            cones.file = Some(PathBuf::new());
            cones.file_first_vertex = 0;
        }
        let mut features = own.features.clone();
        if !features.list.is_empty() {
            features.file = None;
            features.file_first_vertex = 0;
        }
        Self {
            cones,
            features,
            input: InputParams::default(),
            output: own.output.anywhere(),
            run: RunParams::default(),
            preset: None,
            asset: Vec::new(),
            ..own
        }
    }

    /// [`Config::canonical`] as one value a key (`flow.scheme`), in order of the keys; lists are one value.
    #[must_use]
    pub fn flat(&self) -> BTreeMap<String, serde_json::Value> {
        let mut flat = BTreeMap::new();
        let value =
            serde_json::from_slice(&self.canonical_json()).expect("what was written as JSON");
        let mut pending = vec![(String::new(), value)];
        while let Some((path, value)) = pending.pop() {
            match value {
                serde_json::Value::Object(members) => {
                    let dot = if path.is_empty() { "" } else { "." };
                    let members = members.into_iter();
                    pending
                        .extend(members.map(|(name, value)| (format!("{path}{dot}{name}"), value)));
                }
                value => {
                    flat.insert(path, value);
                }
            }
        }
        flat
    }

    /// BLAKE3 of [`Config::canonical`] as JSON, 64 hexadecimal digits (`source.config_blake3`).
    ///
    /// Fields are written in the order of the structs, so the hash depends on values only:
    /// neither comments, nor the order of keys, nor keys that repeat a default change it.
    #[must_use]
    pub fn hash(&self) -> String {
        blake3::hash(&self.canonical_json()).to_hex().to_string()
    }

    /// The configuration of a table, or what a stage does not take. Through its text: a second reader of all stages would cost as much to compile.
    fn of_table(table: &toml::Table) -> Result<Self, String> {
        toml::from_str(&table.to_string()).map_err(|error| error.message().to_owned())
    }

    fn canonical_json(&self) -> Vec<u8> {
        serde_json::to_vec(&self.canonical())
            .expect("the canonical configuration holds numbers, words and lists only")
    }
}

#[cfg(test)]
mod tests;
