//! `manifest.jsonl`: one line an asset, the record of what happened to it in the latest run.
//!
//! The only output file that holds wall time and memory. Lines stand in the order of the assets'
//! ids; the file is replaced in one step, so that a reader never meets half a line.

use crate::export::{Action, ExportError, folder, names};
use crate::outcome::{AssetOutcome, AssetState, ComponentOutcome, FailureKind};
use crate::read::bounded::{JSON_LIMIT, open_regular, read_bounded};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, BufRead, BufReader, Write};
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// Name of the file in the output root.
pub const FILE_NAME: &str = names::MANIFEST;

/// What became of an asset or a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum State {
    /// Computed and written.
    Built,
    /// An earlier result of the same input and configuration was kept.
    Cached,
    /// Not built; see the kind and the error.
    Failed,
    /// Stopped by the user.
    Cancelled,
}

/// The line of one asset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Record {
    /// Name of the asset, which is also its folder.
    pub id: String,
    /// BLAKE3 hash of the input, hexadecimal; absent where it could not be read.
    pub input_hash: Option<String>,
    /// BLAKE3 hash of the effective configuration, hexadecimal.
    pub config_hash: String,
    /// What became of it. An asset of several components is built only if all of them are.
    pub state: State,
    /// Why it failed.
    pub kind: Option<FailureKind>,
    /// One sentence that says what to change.
    pub error: Option<String>,
    /// What was said of it when it was built: what was left out of the input, what could not be had, much distortion; the first of many.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// How many such sentences there were.
    #[serde(default)]
    pub warning_count: usize,
    /// When this line was written, seconds since 1970; later for every run that has to do with the asset.
    #[serde(default)]
    pub checked: u64,
    /// Wall time, seconds.
    pub seconds: f64,
    /// Peak memory of the asset's process, bytes; absent where the system does not tell, or nothing was computed.
    pub peak_memory: Option<u64>,
    /// Name of the machine that did it, where it has one.
    #[serde(default)]
    pub host: Option<String>,
    /// Files of the asset, relative to the output root, ascending. After a failure those of the older result, if any.
    pub files: Vec<String>,
    /// Whether nothing was built and `files` are those of an earlier run.
    #[serde(default)]
    pub kept: bool,
    /// One entry a component, in order; empty where the input could not be read.
    pub components: Vec<ComponentRecord>,
}

/// What became of one component.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ComponentRecord {
    /// Number of the component, from 0.
    pub component: usize,
    /// What became of it.
    pub state: State,
    /// Why it failed.
    pub kind: Option<FailureKind>,
    /// One sentence that says what to change.
    pub error: Option<String>,
}

impl ComponentRecord {
    /// What is said of a component that a job has finished with.
    pub fn of(outcome: &ComponentOutcome) -> Self {
        let failure = outcome.result.as_ref().err();
        Self {
            component: outcome.index,
            state: failure.map_or(State::Built, |_| State::Failed),
            kind: failure.map(|f| f.kind),
            error: failure.map(|f| f.message.clone()),
        }
    }
}

impl Record {
    /// The line of an asset that a job has finished with.
    pub fn of(outcome: &AssetOutcome, config_hash: &str) -> Record {
        let failure = outcome.failures().next().map(|(_, failure)| failure);
        let components = outcome.components.iter().map(ComponentRecord::of);
        let now = SystemTime::now().duration_since(UNIX_EPOCH);
        Record {
            id: outcome.id.clone(),
            input_hash: outcome.input_hash.clone(),
            config_hash: config_hash.to_owned(),
            state: match (&outcome.state, failure) {
                (AssetState::Cancelled, _) => State::Cancelled,
                (_, Some(_)) => State::Failed,
                (AssetState::Cached, None) => State::Cached,
                _ => State::Built,
            },
            kind: failure.map(|f| f.kind),
            error: failure.map(|f| f.message.clone()),
            warnings: outcome.notes.iter().take(MOST_WARNINGS).cloned().collect(),
            warning_count: outcome.notes.len(),
            checked: now.map_or(0, |since| since.as_secs()),
            seconds: outcome.seconds,
            peak_memory: outcome.peak_memory,
            host: outcome.host.clone(),
            files: outcome
                .files
                .iter()
                .map(|file| format!("{}/{file}", outcome.id))
                .collect(),
            kept: outcome.kept,
            components: components.collect(),
        }
    }
}

/// Warnings that a record holds: an asset of thousands of components may have as many.
const MOST_WARNINGS: usize = 40;

/// All records of an output root.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Manifest {
    records: BTreeMap<String, Record>,
}

impl Manifest {
    /// Reads the manifest of an output root; a missing one is empty. Also gives the numbers (from 1) of lines
    /// that are no records, such as those of another version: they are lost with the next [`Manifest::save`].
    pub fn load(output_root: &Path) -> Result<(Manifest, Vec<usize>), ExportError> {
        let path = output_root.join(FILE_NAME);
        let bytes = match read_bounded(&path, JSON_LIMIT) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            Err(error) => return Err(ExportError::io(Action::Read, &path)(error)),
        };
        let mut manifest = Manifest::default();
        let mut unreadable = Vec::new();
        for (number, line) in (1..).zip(bytes.split(|&b| b == b'\n')) {
            if line.trim_ascii().is_empty() {
                continue;
            }
            match serde_json::from_slice(line) {
                Ok(record) => manifest.insert(record),
                Err(_) => unreadable.push(number),
            }
        }
        Ok((manifest, unreadable))
    }

    /// Adds a record in place of an older one of the same asset. A time that is not finite becomes 0.
    pub fn insert(&mut self, mut record: Record) {
        if !record.seconds.is_finite() {
            record.seconds = 0.0;
        }
        self.records.insert(record.id.clone(), record);
    }

    /// The records of these assets alone.
    #[must_use]
    pub fn of(mut self, ids: &BTreeSet<&str>) -> Self {
        self.records.retain(|id, _| ids.contains(id.as_str()));
        self
    }

    /// The record of an asset.
    pub fn get(&self, id: &str) -> Option<&Record> {
        self.records.get(id)
    }

    /// All records, by id.
    pub fn records(&self) -> impl ExactSizeIterator<Item = &Record> {
        self.records.values()
    }

    /// The text of the file: one line a record.
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        for record in self.records.values() {
            let line = serde_json::to_string(record)
                .expect("string keys and no custom serialiser, so that serialisation cannot fail");
            text.push_str(&line);
            text.push('\n');
        }
        text
    }

    /// Puts records into the manifest of an output root in place of older ones of the same assets, and replaces the file in one
    /// step. The older records are not held in memory, however many they are: their lines are copied, but for those that are no records.
    pub fn update(output_root: &Path, newer: &BTreeMap<String, Record>) -> Result<(), ExportError> {
        let path = output_root.join(FILE_NAME);
        let older: Box<dyn BufRead> = match open_regular(&path) {
            Ok((file, _)) => Box::new(BufReader::new(file)),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Box::new(io::empty()),
            Err(error) => return Err(ExportError::io(Action::Read, &path)(error)),
        };
        let mut sorted = true;
        folder::stream_file_atomically(&path, |out| {
            sorted = merge(older, newer, out)?;
            match sorted {
                true => Ok(()),
                // Nothing is replaced.
                false => Err(io::ErrorKind::InvalidData.into()),
            }
        })
        .or_else(|error| match sorted {
            true => Err(error),
            false => {
                let (mut manifest, _) = Manifest::load(output_root)?;
                newer
                    .values()
                    .cloned()
                    .for_each(|record| manifest.insert(record));
                manifest.save(output_root)
            }
        })
    }

    /// Replaces the file in one step.
    pub fn save(&self, output_root: &Path) -> Result<(), ExportError> {
        let path = output_root.join(FILE_NAME);
        folder::write_file_atomically(&path, self.to_text().as_bytes())
    }
}

/// The lines of both by id, newer ones in place of older. False where the older ones are not in order.
fn merge(
    older: impl BufRead,
    newer: &BTreeMap<String, Record>,
    out: &mut dyn Write,
) -> io::Result<bool> {
    #[derive(Deserialize)]
    struct Named {
        id: String,
    }
    let put = |out: &mut dyn Write, record: &Record| {
        let mut record = record.clone();
        if !record.seconds.is_finite() {
            record.seconds = 0.0;
        }
        serde_json::to_writer(&mut *out, &record)?;
        out.write_all(b"\n")
    };
    let mut newer = newer.iter().peekable();
    let mut last: Option<String> = None;
    for line in older.split(b'\n') {
        let line = line?;
        let Ok(Named { id }) = serde_json::from_slice(&line) else {
            continue;
        };
        if last.as_ref().is_some_and(|last| *last >= id) {
            return Ok(false);
        }
        while let Some((_, record)) = newer.next_if(|(newer, _)| **newer < id) {
            put(out, record)?;
        }
        match newer.next_if(|(newer, _)| **newer == id) {
            Some((_, record)) => put(out, record)?,
            None => {
                out.write_all(&line)?;
                out.write_all(b"\n")?;
            }
        }
        last = Some(id);
    }
    newer.try_for_each(|(_, record)| put(out, record))?;
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn record(id: &str, state: State) -> Record {
        Record {
            id: id.into(),
            input_hash: Some("00ff".into()),
            config_hash: "ff00".into(),
            state,
            kind: (state == State::Failed).then_some(FailureKind::NotConverged),
            error: (state == State::Failed).then(|| "raise the limit".into()),
            warnings: vec!["has flat patches".into()],
            warning_count: 1,
            checked: 1_795_996_800,
            seconds: 0.1 + 0.2,
            peak_memory: Some(1 << 30),
            host: Some("night-1".into()),
            files: vec![format!("{id}/atlas.json")],
            kept: state == State::Failed,
            components: vec![ComponentRecord {
                component: 0,
                state,
                kind: None,
                error: None,
            }],
        }
    }

    #[test]
    fn a_manifest_reads_back_the_same_in_order_of_ids() {
        let root = tempfile::tempdir().unwrap();
        let mut manifest = Manifest::default();
        for (id, state) in [
            ("spot", State::Built),
            ("cow", State::Failed),
            ("bunny", State::Cached),
        ] {
            manifest.insert(record(id, state));
        }
        manifest.save(root.path()).unwrap();
        let (back, unreadable) = Manifest::load(root.path()).unwrap();
        assert_eq!(back, manifest);
        assert!(unreadable.is_empty());
        let ids: Vec<_> = back.records().map(|r| r.id.as_str()).collect();
        assert_eq!(ids, ["bunny", "cow", "spot"]);
        let text = fs::read_to_string(root.path().join(FILE_NAME)).unwrap();
        assert!(
            text.contains(r#""state":"failed","kind":"not_converged","error":"raise the limit""#),
            "{text}"
        );
        assert_eq!(text.lines().count(), 3);
    }

    #[test]
    fn a_newer_record_replaces_the_older_one() {
        let mut manifest = Manifest::default();
        manifest.insert(record("spot", State::Failed));
        let mut newer = record("spot", State::Built);
        newer.seconds = f64::NAN;
        manifest.insert(newer);
        assert_eq!(manifest.records().len(), 1);
        assert_eq!(manifest.get("spot").unwrap().state, State::Built);
        assert_eq!(manifest.get("spot").unwrap().seconds, 0.0);
        assert!(manifest.get("cow").is_none());
    }

    #[test]
    fn updating_is_loading_inserting_and_saving() {
        let root = tempfile::tempdir().unwrap();
        let newer = |ids: &[&str]| -> BTreeMap<String, Record> {
            let records = ids.iter().map(|&id| record(id, State::Built));
            records.map(|r| (r.id.clone(), r)).collect()
        };
        let mut expected = Manifest::default();
        for ids in [&["b", "d"][..], &["a", "c", "d", "e"], &[], &["c"]] {
            let records = newer(ids);
            Manifest::update(root.path(), &records).unwrap();
            records.into_values().for_each(|r| expected.insert(r));
            let text = fs::read_to_string(root.path().join(FILE_NAME)).unwrap();
            assert_eq!(text, expected.to_text());
        }
        // Out of order, with lines that are none.
        let mut lines: Vec<String> = expected.to_text().lines().map(str::to_owned).collect();
        lines.reverse();
        lines.insert(2, "garbage".into());
        fs::write(root.path().join(FILE_NAME), lines.join("\n")).unwrap();
        Manifest::update(root.path(), &newer(&["bb"])).unwrap();
        expected.insert(record("bb", State::Built));
        let text = fs::read_to_string(root.path().join(FILE_NAME)).unwrap();
        assert_eq!(text, expected.to_text());
        assert_eq!(
            fs::read_dir(root.path()).unwrap().count(),
            1,
            "a temporary file stayed"
        );
    }

    #[test]
    fn lines_that_are_no_records_are_counted() {
        let root = tempfile::tempdir().unwrap();
        assert_eq!(
            Manifest::load(root.path()).unwrap(),
            (Manifest::default(), vec![])
        );
        let mut manifest = Manifest::default();
        manifest.insert(record("spot", State::Built));
        let text = format!("garbage\n\n{}{{\"id\":3}}\n\u{fffd}", manifest.to_text());
        fs::write(root.path().join(FILE_NAME), text).unwrap();
        let (back, unreadable) = Manifest::load(root.path()).unwrap();
        assert_eq!(back, manifest);
        assert_eq!(unreadable, [1, 4, 5]);
    }
}
