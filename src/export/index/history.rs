//! What a run leaves for the next one to compare with: one line of JSON an asset.

use super::figures::Figures;
use crate::export::manifest::State;
use crate::export::{Action, ExportError};
use crate::read::bounded::{JSON_LIMIT, read_bounded};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io;
use std::path::Path;

/// An asset as a run left it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Past {
    /// Its id.
    pub id: String,
    /// What became of it.
    pub state: State,
    /// BLAKE3 hash of the input, hexadecimal.
    pub input_hash: Option<String>,
    /// BLAKE3 hash of the configuration, hexadecimal.
    pub config_hash: String,
    /// Figures of its atlases, where there are any.
    pub figures: Option<Figures>,
    /// Whether that run was the latest one. Assets that a run has nothing to do with stay as they are, so that a run of one asset does not make
    /// all others new to the next run of all.
    pub latest: bool,
}

/// What earlier runs left; nothing where there was none. Lines that are no records, such as those of another version, count as not there.
pub(super) fn load(path: &Path) -> Result<BTreeMap<String, Past>, ExportError> {
    let bytes = match read_bounded(path, JSON_LIMIT) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
        Err(error) => return Err(ExportError::io(Action::Read, path)(error)),
    };
    let lines = bytes.split(|&b| b == b'\n');
    let known = lines.filter_map(|line| serde_json::from_slice::<Past>(line).ok());
    Ok(known.map(|past| (past.id.clone(), past)).collect())
}

/// The text of the file: the assets of this run, and of those before what this run had nothing to do with.
pub(super) fn to_text(
    before: BTreeMap<String, Past>,
    assets: impl Iterator<Item = Past>,
) -> String {
    let mut all = before;
    for past in all.values_mut() {
        past.latest = false;
    }
    all.extend(assets.map(|past| (past.id.clone(), past)));
    let mut text = String::new();
    for past in all.values() {
        let line = serde_json::to_string(past)
            .expect("string keys and no custom serialiser, so that serialisation cannot fail");
        text.push_str(&line);
        text.push('\n');
    }
    text
}
