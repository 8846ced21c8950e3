//! What is to be done for one asset: a value that stands by itself, so that a plan can hold it and another machine do it.

use super::limits;
use crate::config::assets::Asset;
use crate::config::{Config, Limit};
use crate::read;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

/// What is to be done for one asset, as a line of a [plan](super::plan). Everything but `settings` is in it: these stand in a line of their own,
/// for all assets that have the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Task {
    /// Name of the asset and of its folder.
    pub id: String,
    /// The file, relative to the current folder or absolute.
    pub path: PathBuf,
    /// The file as the user wrote it.
    pub given: PathBuf,
    /// Hash of the file and all that it refers to ([`read::fingerprint()`]); absent where it cannot be read.
    pub input_hash: Option<String>,
    /// [`Config::hash`] of the asset's settings.
    pub config_hash: String,
    /// Bytes of all input files, by which time and memory are estimated.
    pub cost: u64,
    /// The file and those that it refers to.
    pub files: Vec<PathBuf>,
    /// The settings themselves.
    #[serde(skip)]
    pub settings: Arc<Settings>,
}

/// Least time that is given to any mesh where nothing else is asked for.
const LEAST_TIME: Duration = Duration::from_secs(600);

/// The effective configuration of some assets; shared by all that have the same.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// The configuration.
    pub config: Config,
    /// [`Config::hash`].
    pub hash: String,
    /// [`Config::flat`].
    pub flat: BTreeMap<String, Value>,
}

impl Settings {
    /// With hash and flat keys.
    #[must_use]
    pub fn new(config: Config) -> Self {
        Self {
            hash: config.hash(),
            flat: config.flat(),
            config,
        }
    }
}

impl Task {
    /// Looks at the files of an asset. What cannot be read gets no hash; the job will say why.
    #[must_use]
    pub fn new(asset: &Asset, settings: &Arc<Settings>) -> Self {
        let found = read::fingerprint(&asset.path).ok();
        Self {
            id: asset.id.clone(),
            path: asset.path.clone(),
            given: asset.given.clone(),
            input_hash: found.as_ref().map(|found| found.hash.clone()),
            config_hash: settings.hash.clone(),
            cost: found.as_ref().map_or(0, |found| found.bytes),
            files: found.map_or_else(|| vec![asset.path.clone()], |found| found.files),
            settings: Arc::clone(settings),
        }
    }

    /// The same, with a new look at its files.
    #[must_use]
    pub fn looked_at_again(&self) -> Self {
        let asset = Asset {
            id: self.id.clone(),
            path: self.path.clone(),
            given: self.given.clone(),
        };
        Self::new(&asset, &self.settings)
    }

    /// Most memory that building it is expected to take, bytes; see [`limits::estimate`].
    #[must_use]
    pub fn memory(&self) -> u64 {
        match self.settings.config.run.memory {
            Limit::At(cap) => cap,
            Limit::Auto | Limit::Off => limits::estimate(self.cost, &self.settings.config),
        }
    }

    /// Most memory that its process may take, bytes, where `free` bytes are there for `jobs` processes; none: any.
    #[must_use]
    pub fn memory_limit(&self, free: Option<u64>, jobs: usize) -> Option<u64> {
        match self.settings.config.run.memory {
            Limit::At(cap) => Some(cap),
            Limit::Off => None,
            Limit::Auto => {
                let share = free? / jobs.max(1) as u64;
                Some(share.max(self.memory().saturating_mul(2)))
            }
        }
    }

    /// Most time that its process may take; none: any.
    #[must_use]
    pub fn time_limit(&self) -> Option<Duration> {
        match self.settings.config.run.timeout {
            Limit::At(seconds) => Some(Duration::from_secs(seconds)),
            Limit::Off => None,
            Limit::Auto => {
                let expected = limits::expected_time(self.cost, &self.settings.config, true);
                Some(LEAST_TIME.saturating_add(Duration::from_millis(expected).saturating_mul(100)))
            }
        }
    }
}
