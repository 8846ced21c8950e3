//! `index.html`: what a run over many assets came to, for the person who looks at it in the morning.
//!
//! *Enters:* the manifest of an output root, the `atlas.json` of its assets, and the history of the run before. *Leaves:* one page
//! that needs no network, with links to folders and reports, and the history for the next run.
//!
//! *Guaranteed:* nothing but the manifest's figures and those of `atlas.json`; both files are replaced in one step each; names and messages
//! are text, whatever they hold. Like the manifest it holds times.
//! *Not guaranteed:* that anything is said of an asset whose `atlas.json` cannot be read beyond what the manifest says.

mod assets;
mod changes;
mod figures;
mod history;
mod page;

use crate::export::ExportError;
use crate::export::folder::write_file_atomically;
use crate::export::manifest::Manifest;
use crate::export::names;
use assets::Asset;
use std::path::Path;

/// Name of the page in the output root.
pub const FILE_NAME: &str = names::INDEX;
/// Name of what the next run compares with.
pub const HISTORY_NAME: &str = names::HISTORY;

/// Writes the page of a run that has ended and whose manifest is `current`.
///
/// It compares with the run before by `history.jsonl`, which this replaces: call it once at the end of a run.
pub fn write(output_root: &Path, current: &Manifest) -> Result<(), ExportError> {
    write_against(output_root, current, &output_root.join(HISTORY_NAME))
}

/// The same against another history than that of the latest run.
pub fn write_against(
    output_root: &Path,
    current: &Manifest,
    history: &Path,
) -> Result<(), ExportError> {
    let before = history::load(history)?;
    let assets = assets::collect(output_root, current, &before);
    let changes = changes::compare(&before, &assets);
    let text = page::page(&assets, &changes);
    write_file_atomically(&output_root.join(FILE_NAME), text.as_bytes())?;
    let lines = history::to_text(assets.iter().map(Asset::past));
    write_file_atomically(&output_root.join(HISTORY_NAME), lines.as_bytes())
}

#[cfg(test)]
mod tests;
