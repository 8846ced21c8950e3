//! What is written down about a batch: the manifest while it runs, other programs' formats at its end.
//!
//! *Enters:* an outcome at a time. *Leaves:* `manifest.jsonl`, whole at every moment. Each outcome is appended to a journal at once, and
//! the manifest is rewritten from time to time and at the end: rewriting it for each of thousands of assets would cost more than
//! they do. A journal belongs to the process that holds a lock on it; one that nobody holds is what a killed run left, and is put
//! into the manifest by the next run. Several runs in one output root take turns at the manifest, under a lock. Shards of a plan, which
//! may run on other machines, where locks are not to be relied on, have files of their own ([`shard`]).

mod depfile;
mod junit;
pub mod shard;

pub use depfile::depfile;
pub use junit::junit;
pub use shard::ShardRecorder;

use super::{Task, limits, private_folder};
use crate::export::manifest::{Manifest, Record};
use crate::export::{Action, ExportError, folder};
use crate::outcome::AssetOutcome;
use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Least time between two rewritings of the manifest.
const INTERVAL: Duration = Duration::from_secs(2);
/// Rewriting may take this part of the run's time at most.
const SHARE: u32 = 50;

/// Where outcomes are written down as they come.
pub trait Recording {
    /// Writes down one outcome.
    fn record(&mut self, task: &Task, outcome: &AssetOutcome);
}

/// Writes outcomes into the manifest.
pub struct Recorder {
    output: PathBuf,
    host: Option<String>,
    journal: Option<(File, PathBuf)>,
    unsaved: BTreeMap<String, Record>,
    saved: Instant,
    pause: Duration,
}

impl Recorder {
    /// Begins, with what killed runs left in the output root.
    ///
    /// # Errors
    /// Where the output root cannot be made or its manifest cannot be read.
    pub fn begin(output: &Path) -> Result<Self, ExportError> {
        let own = private_folder(output);
        fs::create_dir_all(&own).map_err(ExportError::io(Action::CreateFolder, &own))?;
        let mut recorder = Self {
            output: output.to_owned(),
            host: limits::host(),
            journal: None,
            unsaved: BTreeMap::new(),
            saved: Instant::now(),
            pause: INTERVAL,
        };
        recorder.absorb(&own)?;
        let path = own.join(format!("journal-{}.jsonl", folder::unique_name()));
        match open_locked(&path) {
            Ok(file) => recorder.journal = Some((file, path)),
            // Then a killed run loses what was not in the manifest yet, which the next run finds out by the cache.
            Err(error) => tracing::warn!(path = %path.display(), %error, "no journal"),
        }
        Ok(recorder)
    }

    /// Journals that nobody holds.
    fn absorb(&mut self, own: &Path) -> Result<(), ExportError> {
        let entries = fs::read_dir(own).map_err(ExportError::io(Action::Read, own))?;
        let mut left = Vec::new();
        for entry in entries.flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            if !(name.starts_with("journal-") && name.ends_with(".jsonl")) {
                continue;
            }
            // A pipe would wait for ever.
            if !entry.file_type().is_ok_and(|kind| kind.is_file()) {
                continue;
            }
            let Ok(file) = OpenOptions::new().read(true).write(true).open(entry.path()) else {
                continue;
            };
            if !lock(&file, false) {
                continue;
            }
            let text = fs::read(entry.path()).unwrap_or_default();
            // The last line may be cut.
            let records = text.split(|&b| b == b'\n');
            let records = records.filter_map(|line| serde_json::from_slice::<Record>(line).ok());
            self.unsaved
                .extend(records.map(|record| (record.id.clone(), record)));
            left.push((entry.path(), file));
        }
        if !left.is_empty() {
            self.save()?;
        }
        for (path, _held) in left {
            let _ = fs::remove_file(path);
        }
        Ok(())
    }

    /// Writes down one record.
    fn put(&mut self, mut record: Record) {
        record.host = record.host.or_else(|| self.host.clone());
        if let Some((file, path)) = &mut self.journal
            && let Ok(mut line) = serde_json::to_vec(&record)
        {
            line.push(b'\n');
            if let Err(error) = file.write_all(&line) {
                tracing::warn!(path = %path.display(), %error, "no journal from here on");
                self.journal = None;
            }
        }
        self.unsaved.insert(record.id.clone(), record);
        if self.saved.elapsed() >= self.pause
            && let Err(error) = self.save()
        {
            tracing::warn!(%error, "the manifest will be written at the end");
            self.saved = Instant::now();
        }
    }

    /// Takes records of other machines for [`Recorder::finish`] to write, as they are.
    pub fn adopt(&mut self, records: impl IntoIterator<Item = Record>) {
        let records = records.into_iter();
        self.unsaved
            .extend(records.map(|record| (record.id.clone(), record)));
    }

    /// Puts what is unsaved into the manifest.
    fn save(&mut self) -> Result<(), ExportError> {
        let start = Instant::now();
        let path = private_folder(&self.output).join("manifest.lock");
        let guard = OpenOptions::new()
            .create(true)
            .truncate(false)
            .write(true)
            .open(&path);
        let guard = guard.map_err(ExportError::io(Action::Write, &path))?;
        lock(&guard, true);
        Manifest::update(&self.output, &self.unsaved)?;
        drop(guard);
        self.unsaved.clear();
        if let Some((file, _)) = &mut self.journal {
            // A journal that is too long says the same twice.
            let _ = file.set_len(0);
        }
        self.saved = Instant::now();
        self.pause = INTERVAL.max(start.elapsed() * SHARE);
        Ok(())
    }

    /// Saves everything and removes the journal.
    ///
    /// # Errors
    /// Where the manifest cannot be written; the journal then stays for the next run.
    pub fn finish(mut self) -> Result<(), ExportError> {
        self.save()?;
        if let Some((_held, path)) = self.journal.take() {
            let _ = fs::remove_file(path);
        }
        Ok(())
    }
}

impl Recording for Recorder {
    fn record(&mut self, task: &Task, outcome: &AssetOutcome) {
        self.put(Record::of(outcome, &task.config_hash));
    }
}

/// A new file that this process holds until it ends. Lines are appended also after it was cut.
fn open_locked(path: &Path) -> io::Result<File> {
    let file = OpenOptions::new().create(true).append(true).open(path)?;
    lock(&file, false);
    Ok(file)
}

/// Holds a file until it is closed, by this process or its end. False where another one holds it and `wait` is not set. File systems
/// without locks let everybody through.
#[cfg(unix)]
fn lock(file: &File, wait: bool) -> bool {
    use rustix::fs::{FlockOperation, flock};
    let operation = match wait {
        true => FlockOperation::LockExclusive,
        false => FlockOperation::NonBlockingLockExclusive,
    };
    flock(file, operation) != Err(rustix::io::Errno::WOULDBLOCK)
}

#[cfg(not(unix))]
fn lock(_: &File, _: bool) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::{AssetOutcome, AssetState};

    fn record(id: &str) -> Record {
        Record::of(&AssetOutcome::whole(id, AssetState::Built, 1.0), "00")
    }

    fn ids(root: &Path) -> Vec<String> {
        let (manifest, broken) = Manifest::load(root).unwrap();
        assert!(broken.is_empty());
        manifest.records().map(|r| r.id.clone()).collect()
    }

    fn journals(root: &Path) -> usize {
        let entries = fs::read_dir(private_folder(root)).unwrap().flatten();
        let name = |e: fs::DirEntry| e.file_name().to_string_lossy().into_owned();
        entries
            .map(name)
            .filter(|n| n.starts_with("journal-"))
            .count()
    }

    #[test]
    fn a_killed_run_is_in_the_manifest_of_the_next() {
        let root = tempfile::tempdir().unwrap();
        let mut killed = Recorder::begin(root.path()).unwrap();
        for id in ["a", "b", "c"] {
            killed.put(record(id));
        }
        let (_, path) = killed.journal.as_ref().unwrap();
        // What a kill in the middle of a line leaves.
        let mut file = OpenOptions::new().append(true).open(path).unwrap();
        file.write_all(b"{\"id\":\"d\",").unwrap();
        drop(killed);
        assert_eq!(ids(root.path()), [""; 0]);
        let next = Recorder::begin(root.path()).unwrap();
        assert_eq!(ids(root.path()), ["a", "b", "c"]);
        next.finish().unwrap();
        assert_eq!(journals(root.path()), 0);
    }

    #[test]
    fn two_runs_in_one_root_keep_each_others_records() {
        let root = tempfile::tempdir().unwrap();
        let mut one = Recorder::begin(root.path()).unwrap();
        let mut other = Recorder::begin(root.path()).unwrap();
        one.put(record("a"));
        other.put(record("b"));
        assert_eq!(journals(root.path()), 2, "a journal that is held was taken");
        one.finish().unwrap();
        other.put(record("c"));
        other.finish().unwrap();
        assert_eq!(ids(root.path()), ["a", "b", "c"]);
        assert!(
            Manifest::load(root.path())
                .unwrap()
                .0
                .get("a")
                .unwrap()
                .host
                == limits::host()
        );
    }

    #[test]
    fn the_manifest_is_not_rewritten_for_each_asset() {
        let root = tempfile::tempdir().unwrap();
        let mut recorder = Recorder::begin(root.path()).unwrap();
        recorder.pause = Duration::from_secs(3600);
        for i in 0..100 {
            recorder.put(record(&format!("a{i}")));
        }
        assert!(!root.path().join("manifest.jsonl").exists());
        recorder.pause = Duration::ZERO;
        recorder.put(record("b"));
        assert_eq!(ids(root.path()).len(), 101);
    }
}
