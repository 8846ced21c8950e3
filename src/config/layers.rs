//! A configuration in layers.
//!
//! *Enters:* layers of a configuration, the file's first, then those of `--set`. *Leaves:* the effective [`Config`] of any mesh. A later table wins over an
//! earlier one, both over the rest of the file, `--set` over all of them; a preset lies below everything, also one that a table names.

use super::Config;
use super::check::check;
use super::error::ConfigError;
use super::overrides::{self, Override};
use super::presets::Preset;
use super::source::{Source, refused, syntax};
use toml::de::DeTable;

/// All that was written, in layers.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Layers {
    /// The file without its `[[asset]]` tables.
    pub file: toml::Table,
    /// Those of `--set`, as one.
    pub set: toml::Table,
    /// The `[[asset]]` tables.
    pub overrides: Vec<Override>,
    /// What to name where the merged layers do not fit each other.
    pub last: Option<Source>,
}

impl Layers {
    /// The configuration with these of the overrides. A cone file is not read.
    pub fn config(&self, overrides: &[usize]) -> Result<Config, ConfigError> {
        let mut own = self.file.clone();
        for &i in overrides {
            merge(&mut own, self.overrides[i].settings.clone());
        }
        merge(&mut own, self.set.clone());
        let mut merged = preset_layer(&own)?;
        merge(&mut merged, own);
        // Each layer was accepted alone and a key is replaced as a whole, so this can only fail where
        // a stage relates several of its keys.
        let nowhere = Source::new("configuration", "");
        let source = self.last.as_ref().unwrap_or(&nowhere);
        Config::of_table(&merged)
            .map_err(|reason| ConfigError::Refused {
                key: "configuration".to_owned(),
                at: source.at(0..0),
                reason,
            })?
            .resolved()
    }
}

/// What the preset sets, if one is named: it lies below everything that the user wrote, wherever its name stands.
fn preset_layer(own: &toml::Table) -> Result<toml::Table, ConfigError> {
    let Some(preset) = own.get("preset").cloned() else {
        return Ok(toml::Table::new());
    };
    let text = match preset.try_into::<Preset>() {
        Ok(preset) => preset.settings(),
        // Each layer was accepted, so the word is known.
        Err(_) => "",
    };
    Ok(parse_layer(&Source::new("preset", text))?.0)
}

/// Checks one text by itself, so that every error has a place in it. Its `[[asset]]` tables are given apart.
pub(super) fn parse_layer(
    source: &Source,
) -> Result<(toml::Table, Option<Vec<Override>>), ConfigError> {
    let checked = DeTable::parse(&source.text).map_err(|error| syntax(source, &error))?;
    check(source, checked.get_ref())?;
    toml::from_str::<Config>(&source.text).map_err(|error| refused(source, &error))?;
    let mut table = toml::from_str(&source.text).map_err(|error| syntax(source, &error))?;
    let overrides = overrides::take(source, checked.get_ref(), &mut table)?;
    Ok((table, overrides))
}

/// Later values replace earlier ones key by key; lists are replaced as a whole.
pub(super) fn merge(into: &mut toml::Table, from: toml::Table) {
    for (key, value) in from {
        match (into.get_mut(&key), value) {
            (Some(toml::Value::Table(old)), toml::Value::Table(new)) => merge(old, new),
            (_, value) => {
                into.insert(key, value);
            }
        }
    }
}
