//! The end of a plan that several machines carried out: what all shards wrote down becomes one record of the run.
//!
//! *Enters:* a [`Plan`], and the files of its shards. *Leaves:* an outcome for each asset, in the order of the plan; with [`Merged::save`] the manifest, as
//! [`run`](super::run) writes it.
//!
//! Where a shard was run several times an asset may have several outcomes: built beats cached, both beat failed, anything beats cancelled; of equals one whose
//! input was as planned, else the first by name of its file. So the result depends on the files alone, and merging again gives the same. An asset that has
//! no outcome, or was cancelled, is not done; whether to go on is the caller's business.

use super::plan::{Plan, plan_folder};
use super::records::Recorder;
use super::records::shard::{Attempt, Finished, read};
use super::shard::{Shard, assign};
use crate::export::folder::write_file_atomically;
use crate::export::index::HISTORY_NAME;
use crate::export::manifest::Record;
use crate::export::{Action, ExportError};
use crate::outcome::{AssetOutcome, AssetState};
use crate::read::bounded::{JSON_LIMIT, read_bounded};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fs;
use std::io;
use std::path::PathBuf;

/// What all shards together did.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Merged {
    /// In the order of the plan, without their lists of files.
    pub outcomes: Vec<AssetOutcome>,
    /// Assets that are not done, in the order of the plan; their outcomes are cancelled.
    pub missing: Vec<String>,
    /// Shards that these belong to, and how they went; empty where no shard has begun.
    pub unfinished: Vec<(Shard, Went)>,
    /// Assets whose input was another one than planned when it was built.
    pub changed: Vec<String>,
    /// Assets that were built several times with different results: which of them is in place is not known.
    pub ambiguous: Vec<String>,
    records: Vec<Record>,
}

/// How a shard went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Went {
    /// Nobody began it.
    NeverBegun,
    /// It has not come to its end.
    NotEnded,
    /// It came to its end, and says nothing of an asset all the same: its file was damaged.
    Damaged,
}

/// Reads what the shards of a plan wrote down. Nothing is written.
///
/// # Errors
/// Where their files cannot be read.
pub fn collect(plan: &Plan) -> Result<Merged, ExportError> {
    let output = &plan.header.output;
    let ids = plan.assets.iter().map(|asset| asset.task.id.as_str());
    let place: HashMap<&str, usize> = ids.enumerate().map(|(i, id)| (id, i)).collect();
    let mut best: Vec<Option<(Finished, Record)>> = plan.assets.iter().map(|_| None).collect();
    let mut ambiguous = BTreeSet::new();
    let attempts = read(output, &plan.header.id, |mut finished| {
        let Some(&i) = place.get(finished.outcome.id.as_str()) else {
            return;
        };
        let mut record = Record::of(&finished.outcome, &finished.config_hash);
        record.host = record.host.or_else(|| finished.host.clone());
        // They are in the record.
        finished.outcome.files = Vec::new();
        let planned = plan.assets[i].task.input_hash.as_ref();
        let rank = |finished: &Finished| {
            let state = match finished.outcome.state_name() {
                "built" => 0,
                "cached" => 1,
                "failed" => 2,
                _ => 3,
            };
            (state, finished.input_hash.as_ref() != planned)
        };
        if let Some((other, older)) = &best[i] {
            let good = rank(other).0 < 2 && rank(&finished).0 < 2;
            if good && !same_result(older, &record) {
                ambiguous.insert(i);
            }
            if rank(other) <= rank(&finished) {
                return;
            }
        }
        best[i] = Some((finished, record));
    })?;
    let mut merged = Merged::default();
    let mut missing = Vec::new();
    for (i, (found, planned)) in best.into_iter().zip(&plan.assets).enumerate() {
        let task = &planned.task;
        let done = found.filter(|(one, _)| one.outcome.state != AssetState::Cancelled);
        let (outcome, record) = match done {
            Some((one, record)) => {
                if one.input_hash != task.input_hash {
                    merged.changed.push(task.id.clone());
                }
                (one.outcome, record)
            }
            None => {
                let mut outcome = AssetOutcome::whole(&task.id, AssetState::Cancelled, 0.0);
                outcome.look_for_older(output);
                let record = Record::of(&outcome, &task.config_hash);
                outcome.files = Vec::new();
                missing.push(i);
                (outcome, record)
            }
        };
        merged.outcomes.push(outcome);
        merged.records.push(record);
    }
    let id = |&i: &usize| plan.assets[i].task.id.clone();
    merged.missing = missing.iter().map(id).collect();
    merged.ambiguous = ambiguous.iter().map(id).collect();
    merged.unfinished = unfinished(plan, &missing, &attempts);
    Ok(merged)
}

/// Whether two records say the same of everything that does not depend on who did it, when, and whether anything was left to do.
fn same_result(a: &Record, b: &Record) -> bool {
    (&a.input_hash, &a.config_hash, &a.files, &a.components)
        == (&b.input_hash, &b.config_hash, &b.files, &b.components)
}

/// Of every division into shards that was begun, those that what is missing belongs to.
fn unfinished(plan: &Plan, missing: &[usize], attempts: &[Attempt]) -> Vec<(Shard, Went)> {
    let mut went: BTreeMap<Shard, bool> = BTreeMap::new();
    for Attempt { shard, complete } in attempts {
        *went.entry(*shard).or_default() |= complete;
    }
    let counts: BTreeSet<u32> = went.keys().map(|shard| shard.count).collect();
    let mut all = Vec::new();
    for count in counts {
        let shard_of = assign(plan, count);
        let numbers: BTreeSet<u32> = missing.iter().map(|&i| shard_of[i] + 1).collect();
        all.extend(numbers.into_iter().map(|number| {
            let shard = Shard { number, count };
            let went = match went.get(&shard) {
                None => Went::NeverBegun,
                Some(false) => Went::NotEnded,
                Some(true) => Went::Damaged,
            };
            (shard, went)
        }));
    }
    all
}

/// In a plan's folder: all that it asked for was done and merged.
const MERGED: &str = "merged";

impl Merged {
    /// Puts all records into the manifest of the output root; other assets there keep theirs.
    ///
    /// # Errors
    /// Where it cannot be written.
    pub fn save(&self, plan: &Plan) -> Result<(), ExportError> {
        let mut recorder = Recorder::begin(&plan.header.output)?;
        recorder.adopt(self.records.iter().cloned());
        recorder.finish()
    }

    /// Removes what the shards of earlier plans wrote that were merged, so that nights do not add up; that of this plan stays, and if nothing is
    /// missing goes with the next. To be called when everything else is written.
    pub fn clear_up(&self, plan: &Plan) {
        let own = plan_folder(&plan.header.output, &plan.header.id);
        if self.missing.is_empty()
            && let Err(error) = fs::write(own.join(MERGED), "")
        {
            tracing::debug!(%error, "this plan will not be cleared up");
        }
        let all = own.parent().and_then(|all| fs::read_dir(all).ok());
        for entry in all.into_iter().flatten().flatten() {
            let path = entry.path();
            if path != own && path.join(MERGED).is_file() {
                // What somebody still holds open stays until next time.
                let _ = fs::remove_dir_all(path);
            }
        }
    }
}

/// Whether anything is there of what shards of a plan may have written.
#[must_use]
pub fn is_gone(plan: &Plan) -> bool {
    !plan_folder(&plan.header.output, &plan.header.id).exists()
}

/// The history of the run before this plan's, for the [`index`](crate::export::index) to compare with: set aside when a plan is merged for the
/// first time, so that merging again compares with the same.
///
/// # Errors
/// Where it cannot be read or set aside.
pub fn history_before(plan: &Plan) -> Result<PathBuf, ExportError> {
    let output = &plan.header.output;
    let aside = plan_folder(output, &plan.header.id).join(HISTORY_NAME);
    if !aside.exists() {
        let current = output.join(HISTORY_NAME);
        let bytes = match read_bounded(&current, JSON_LIMIT) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            Err(error) => return Err(ExportError::io(Action::Read, &current)(error)),
        };
        write_file_atomically(&aside, &bytes)?;
    }
    Ok(aside)
}

#[cfg(test)]
mod tests;
