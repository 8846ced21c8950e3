//! The assets of a run.

use super::figures::{self, Figures};
use super::history::Past;
use crate::export::manifest::{Manifest, Record, State};
use crate::parallel;
use std::collections::BTreeMap;
use std::path::Path;

/// An asset of the run.
pub(super) struct Asset<'a> {
    /// What the manifest says.
    pub record: &'a Record,
    /// Its atlases, those of an earlier run after a failure.
    pub figures: Option<Figures>,
}

impl Asset<'_> {
    /// What the next run shall know of it.
    pub fn past(&self) -> Past {
        Past {
            id: self.record.id.clone(),
            state: self.record.state,
            input_hash: self.record.input_hash.clone(),
            config_hash: self.record.config_hash.clone(),
            figures: self.figures.clone(),
            latest: true,
        }
    }
}

/// All assets of a manifest, by id. Those kept from the run before are not read again.
pub(super) fn collect<'a>(
    output_root: &Path,
    manifest: &'a Manifest,
    before: &BTreeMap<String, Past>,
) -> Vec<Asset<'a>> {
    let records: Vec<&Record> = manifest.records().collect();
    parallel::map(&records, |_, &record| {
        let known = before.get(&record.id).filter(|past| {
            record.state == State::Cached
                && matches!(past.state, State::Built | State::Cached)
                && past.input_hash == record.input_hash
                && past.config_hash == record.config_hash
        });
        let figures = known
            .and_then(|past| past.figures.clone())
            .or_else(|| figures::read(output_root, record));
        Asset { record, figures }
    })
}
