//! What a run leaves for the next one to compare with: one line of JSON an asset.

use super::figures::Figures;
use crate::export::manifest::State;
use crate::export::{Action, ExportError};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::{fs, io};

/// An asset at the end of a run.
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
}

/// The run before; nothing where there was none. Lines that are no records, such as those of another version, count as not there.
pub(super) fn load(path: &Path) -> Result<BTreeMap<String, Past>, ExportError> {
    let bytes = match fs::read(path) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
        Err(error) => return Err(ExportError::io(Action::Read, path)(error)),
    };
    let lines = bytes.split(|&b| b == b'\n');
    let known = lines.filter_map(|line| serde_json::from_slice::<Past>(line).ok());
    Ok(known.map(|past| (past.id.clone(), past)).collect())
}

/// The text of the file.
pub(super) fn to_text(assets: impl Iterator<Item = Past>) -> String {
    let mut text = String::new();
    for past in assets {
        let line = serde_json::to_string(&past)
            .expect("string keys and no custom serialiser, so that serialisation cannot fail");
        text.push_str(&line);
        text.push('\n');
    }
    text
}
