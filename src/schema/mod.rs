//! JSON schemas (draft 2020-12) of what the program reads and writes: `atlas.json`, a line of `manifest.jsonl`, a
//! line of a plan, `components.json`, `fit.json`, and `config.toml`.
//!
//! *Enters:* nothing: those of the records follow from the types that are written, that of the configuration from
//! [`KEYS`](crate::config::keys::KEYS) and the words of the commented `config.toml`. *Leaves:* a schema as JSON.
//!
//! *Guaranteed:* everything that this version writes is valid. Keys may be added to the records in later versions, so unknown keys are
//! valid there; in a configuration they are not.
//! *Not guaranteed:* that a valid configuration is accepted: relations between keys are checked when it is read.

mod config;

use crate::batch::plan::Line;
use crate::export::atlas_json::Document;
use crate::export::manifest::Record;
use crate::export::{components, fit};
use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::Value;

pub use config::config;

/// What all schemas are written in.
const DRAFT: &str = "https://json-schema.org/draft/2020-12/schema";

/// The schema of `atlas.json`.
#[must_use]
pub fn atlas() -> Value {
    of::<Document>("atlas.json of affine-atlas")
}

/// The schema of `components.json`.
#[must_use]
pub fn components() -> Value {
    of::<components::Document>("components.json of affine-atlas")
}

/// The schema of one line of `manifest.jsonl`.
#[must_use]
pub fn manifest() -> Value {
    of::<Record>("A line of manifest.jsonl of affine-atlas")
}

/// The schema of `fit.json`.
#[must_use]
pub fn fit() -> Value {
    of::<fit::document::Document>("fit.json of affine-atlas")
}

/// The schema of one line of a plan.
#[must_use]
pub fn plan() -> Value {
    of::<Line>("A line of a plan of affine-atlas")
}

fn of<T: JsonSchema>(title: &str) -> Value {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    let mut schema = settings.into_generator().into_root_schema_for::<T>();
    schema.insert("title".to_owned(), title.into());
    schema.to_value()
}
