//! From text and overrides to a [`Config`], files of cones and features included.

use super::Config;
use super::error::{ConfigError, Location};
use super::layers::{Layers, merge, parse_layer};
use super::overrides::Override;
use super::source::Source;
use crate::flow::columns::ColumnError;
use crate::flow::{cones, features};
use crate::read::bounded::read_bounded;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use toml::de::DeTable;

/// More than any configuration needs, even with thousands of cones; a mesh named by mistake is
/// refused before it is read.
const MAX_BYTES: u64 = 16 << 20;

/// A configuration and where its relative paths start.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The effective configuration; paths as written.
    pub config: Config,
    /// Folder that relative `input.paths` start from: that of the configuration file, or the
    /// current folder (empty path) where an override gave them.
    pub input_base: PathBuf,
    /// Folder that a relative `output.folder` starts from, by the same rule.
    pub output_base: PathBuf,
    /// Files that were read: the configuration, and files of cones and features.
    pub files: Vec<PathBuf>,
    /// What `config` was made of.
    layers: Layers,
    /// Folder that a relative `cones.file` starts from, by the same rule.
    cones_base: PathBuf,
    /// The same of `features.file`.
    features_base: PathBuf,
}

impl Loaded {
    /// The output folder, relative to the current folder or absolute.
    #[must_use]
    pub fn output_folder(&self) -> PathBuf {
        self.output_base.join(&self.config.output.folder)
    }

    /// The `[[asset]]` tables.
    #[must_use]
    pub fn overrides(&self) -> &[Override] {
        &self.layers.overrides
    }

    /// Which of the `[[asset]]` tables are for a mesh, by the path that the user gave.
    #[must_use]
    pub fn overrides_for(&self, given: &Path) -> Vec<usize> {
        let all = self.layers.overrides.iter().enumerate();
        all.filter(|(_, one)| one.concerns(given))
            .map(|(i, _)| i)
            .collect()
    }

    /// The effective configuration of the meshes for which these of the `[[asset]]` tables are, what files of cones and features say included.
    /// What concerns the whole run is as in `config`.
    ///
    /// # Errors
    /// As [`load`], where tables do not fit each other or the rest, or a file of cones or features cannot be used.
    pub fn config_with(&mut self, overrides: &[usize]) -> Result<Config, ConfigError> {
        if overrides.is_empty() {
            return Ok(self.config.clone());
        }
        let mut config = self.layers.config(overrides)?;
        self.files
            .extend(read_cones(&mut config, &self.cones_base)?);
        self.files
            .extend(read_features(&mut config, &self.features_base)?);
        config.input = self.config.input.clone();
        config.output.folder.clone_from(&self.config.output.folder);
        Ok(config)
    }
}

/// Reads a configuration file and applies overrides of the form `section.key=value`. A preset lies below both.
///
/// # Errors
/// [`ConfigError`] where the file cannot be read, is no TOML, or holds a key, type or value that
/// [`KEYS`](super::keys::KEYS) does not allow; likewise for each override.
pub fn load(path: &Path, overrides: &[String]) -> Result<Loaded, ConfigError> {
    let text = read_text(path)?;
    let base = path.parent().unwrap_or(Path::new("")).to_owned();
    let layers = parse_layers(&path.display().to_string(), &text, overrides)?;
    let set = |key: &str| overrides.iter().any(|given| override_key(given) == key);
    let base_of = |key: &str| {
        if set(key) {
            PathBuf::new()
        } else {
            base.clone()
        }
    };
    finish(layers, vec![path.to_owned()], base_of)
}

/// The defaults with overrides; every relative path starts at the current folder.
///
/// # Errors
/// As [`load`], but for those of reading a configuration file.
pub fn defaults(overrides: &[String]) -> Result<Loaded, ConfigError> {
    let layers = parse_layers("defaults", "", overrides)?;
    finish(layers, Vec::new(), |_| PathBuf::new())
}

fn finish(
    layers: Layers,
    mut files: Vec<PathBuf>,
    base_of: impl Fn(&str) -> PathBuf,
) -> Result<Loaded, ConfigError> {
    let mut config = layers.config(&[])?;
    let cones_base = base_of("cones.file");
    files.extend(read_cones(&mut config, &cones_base)?);
    let features_base = base_of("features.file");
    files.extend(read_features(&mut config, &features_base)?);
    Ok(Loaded {
        input_base: base_of("input.paths"),
        output_base: base_of("output.folder"),
        config,
        files,
        layers,
        cones_base,
        features_base,
    })
}

/// Puts the cones of `cones.file` into `cones.list`, from where on they are like any others. `base` is what a relative
/// path starts from. Gives the file that was read, where there is one.
fn read_cones(config: &mut Config, base: &Path) -> Result<Option<PathBuf>, ConfigError> {
    let params = &mut config.cones;
    let Some(given) = &params.file else {
        return Ok(None);
    };
    if !params.list.is_empty() {
        let (list, file) = ("cones.list", "cones.file");
        return Err(ConfigError::Both {
            one: list,
            other: file,
        });
    }
    let path = base.join(given);
    let first = params.file_first_vertex;
    let parse = |text: &str| cones::file::parse(text, first);
    let cones = read_list("cones.file", &path, parse)?;
    (params.file_lines, params.list) = cones.into_iter().unzip();
    Ok(Some(path))
}

/// Puts the edges of `features.file` into `features.list`; see [`read_cones`].
fn read_features(config: &mut Config, base: &Path) -> Result<Option<PathBuf>, ConfigError> {
    let params = &mut config.features;
    let Some(given) = &params.file else {
        return Ok(None);
    };
    if !params.list.is_empty() {
        let (list, file) = ("features.list", "features.file");
        return Err(ConfigError::Both {
            one: list,
            other: file,
        });
    }
    let path = base.join(given);
    let first = params.file_first_vertex;
    let parse = |text: &str| features::file::parse(text, first);
    params.list = read_list("features.file", &path, parse)?;
    Ok(Some(path))
}

/// What stands in a file that `key` names.
fn read_list<T>(
    key: &'static str,
    path: &Path,
    parse: impl Fn(&str) -> Result<T, ColumnError>,
) -> Result<T, ConfigError> {
    let text = read_text(path).map_err(|error| ConfigError::NoListFile {
        key,
        reason: match error {
            ConfigError::NotFound { .. } => "there is no such file".to_owned(),
            ConfigError::TooLong { bytes, limit, .. } => {
                format!("it has {bytes} bytes, but such a file has at most {limit}")
            }
            ConfigError::Unreadable { reason, .. } => reason,
            other => other.to_string(),
        },
        path: path.to_owned(),
    })?;
    parse(&text).map_err(|error| {
        let at = Location::new(&path.display().to_string(), &Arc::from(text), error.span);
        ConfigError::FileLine {
            key,
            at: Box::new(at),
            reason: error.reason,
        }
    })
}

/// Parses a configuration text; `name` is what errors call it. An empty text gives the defaults. Files of cones and features are not read, and `[[asset]]`
/// tables are checked but are not in effect.
///
/// # Errors
/// As [`load`], but for those of reading a file.
pub fn parse(name: &str, text: &str, overrides: &[String]) -> Result<Config, ConfigError> {
    parse_layers(name, text, overrides)?.config(&[])
}

/// Parses a configuration text and overrides, each checked by itself.
pub(super) fn parse_layers(name: &str, text: &str, set: &[String]) -> Result<Layers, ConfigError> {
    let file = Source::new(name, text);
    let (table, tables) = parse_layer(&file)?;
    let mut layers = Layers {
        file: table,
        set: toml::Table::new(),
        overrides: tables.unwrap_or_default(),
        last: Some(file),
    };
    for given in set {
        let source = override_source(given)?;
        let (table, tables) = parse_layer(&source)?;
        merge(&mut layers.set, table);
        if let Some(tables) = tables {
            layers.overrides = tables;
        }
        layers.last = Some(source);
    }
    Ok(layers)
}

fn read_text(path: &Path) -> Result<String, ConfigError> {
    let unreadable = |reason: String| ConfigError::Unreadable {
        path: path.to_owned(),
        reason,
    };
    let bytes = read_bounded(path, MAX_BYTES).map_err(|error| match error.kind() {
        ErrorKind::NotFound => ConfigError::NotFound {
            path: path.to_owned(),
        },
        ErrorKind::FileTooLarge => ConfigError::TooLong {
            path: path.to_owned(),
            bytes: std::fs::metadata(path).map_or(MAX_BYTES + 1, |data| data.len()),
            limit: MAX_BYTES,
        },
        _ => unreadable(error.to_string()),
    })?;
    String::from_utf8(bytes).map_err(|error| {
        unreadable(format!(
            "byte {} is not UTF-8 text",
            error.utf8_error().valid_up_to()
        ))
    })
}

fn override_key(given: &str) -> &str {
    given.split('=').next().unwrap_or(given).trim()
}

/// An override is a TOML document of one line; a bare word becomes a text.
fn override_source(given: &str) -> Result<Source, ConfigError> {
    let Some((key, value)) = given.split_once('=') else {
        return Err(ConfigError::OverrideWithoutValue {
            given: given.to_owned(),
        });
    };
    let (key, value) = (key.trim(), value.trim());
    let plain = format!("{key} = {value}");
    // A value that begins like a list, table or quoted text was meant as one: its syntax error
    // helps more than a text that nobody asked for.
    let structured = value.starts_with(['[', '{', '"', '\'']);
    let text = if structured || DeTable::parse(&plain).is_ok() {
        plain
    } else {
        format!("{key} = {}", toml::Value::String(value.to_owned()))
    };
    Ok(Source::new("--set", &text))
}
