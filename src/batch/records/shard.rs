//! What shards of a plan write down: a file each time one is run, which nobody else writes to.
//!
//! *Enters:* an outcome at a time. *Leaves:* `.affine-atlas/plans/PLAN/shard-I-of-N-UNIQUE.jsonl`: a line when it begins, one for each
//! asset as soon as it is done with, one at its end. Nothing is ever locked or written a second time, so that this also works on network file systems, and
//! beside processes that everybody takes for dead. Where a shard was killed the last line may be cut and there is no line of an end.
//!
//! *Guaranteed:* where a line could not be written none follows it, and [`ShardRecorder::finish`] fails.

use super::Recording;
use crate::batch::plan::plan_folder;
use crate::batch::shard::Shard;
use crate::batch::{Task, limits};
use crate::export::{Action, ExportError, folder};
use crate::outcome::{AssetOutcome, AssetState};
use crate::read::bounded::open_regular;
use serde::{Deserialize, Serialize};
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};

/// A line of such a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "record", rename_all = "snake_case")]
pub enum Line {
    /// The first.
    Begin {
        /// Id of the plan.
        plan: String,
        /// Which shard.
        #[serde(flatten)]
        shard: Shard,
        /// Where.
        host: Option<String>,
    },
    /// One for each asset that is done with.
    Asset(Box<Finished>),
    /// The last.
    End {
        /// How many there were.
        assets: usize,
        /// Whether it was stopped before all were done.
        stopped: bool,
    },
}

/// What became of an asset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Finished {
    /// [`Task::input_hash`] as the shard found it.
    pub input_hash: Option<String>,
    /// [`Task::config_hash`].
    pub config_hash: String,
    /// Name of the machine that says so, where it has one.
    pub host: Option<String>,
    /// What became of it, with all of its files.
    pub outcome: AssetOutcome,
}

/// Writes the outcomes of one shard down.
pub struct ShardRecorder {
    path: PathBuf,
    file: File,
    host: Option<String>,
    assets: usize,
    stopped: bool,
    trouble: Option<io::Error>,
}

impl ShardRecorder {
    /// Begins a new file.
    ///
    /// # Errors
    /// Where it cannot be made.
    pub fn begin(output: &Path, plan: &str, shard: Shard) -> Result<Self, ExportError> {
        let own = plan_folder(output, plan);
        fs::create_dir_all(&own).map_err(ExportError::io(Action::CreateFolder, &own))?;
        let Shard { number, count } = shard;
        let unique = folder::unique_name();
        let path = own.join(format!("shard-{number}-of-{count}-{unique}.jsonl"));
        let file = OpenOptions::new().create_new(true).append(true).open(&path);
        let host = limits::host();
        let mut recorder = Self {
            file: file.map_err(ExportError::io(Action::Write, &path))?,
            path,
            host: host.clone(),
            assets: 0,
            stopped: false,
            trouble: None,
        };
        recorder.append(&Line::Begin {
            plan: plan.to_owned(),
            shard,
            host,
        });
        match recorder.trouble.take() {
            None => Ok(recorder),
            Some(error) => Err(ExportError::io(Action::Write, &recorder.path)(error)),
        }
    }

    fn append(&mut self, line: &Line) {
        if self.trouble.is_some() {
            return;
        }
        let written = serde_json::to_vec(line).map_err(io::Error::from);
        let written = written.and_then(|mut line| {
            line.push(b'\n');
            self.file.write_all(&line)
        });
        if let Err(error) = written {
            tracing::warn!(path = %self.path.display(), %error, "no records from here on: run the shard again");
            self.trouble = Some(error);
        }
    }

    /// Writes the end down and waits until the disk has everything.
    ///
    /// # Errors
    /// Where a line could not be written. The shard must then be run again.
    pub fn finish(mut self) -> Result<(), ExportError> {
        self.append(&Line::End {
            assets: self.assets,
            stopped: self.stopped,
        });
        let written = match self.trouble.take() {
            Some(error) => Err(error),
            None => self.file.sync_all(),
        };
        written.map_err(ExportError::io(Action::Write, &self.path))
    }
}

impl Recording for ShardRecorder {
    fn record(&mut self, task: &Task, outcome: &AssetOutcome) {
        self.assets += 1;
        self.stopped |= outcome.state == AssetState::Cancelled;
        let finished = Finished {
            input_hash: task.input_hash.clone(),
            config_hash: task.config_hash.clone(),
            host: self.host.clone(),
            outcome: outcome.clone(),
        };
        self.append(&Line::Asset(Box::new(finished)));
    }
}

/// How one attempt at a shard went.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Attempt {
    /// Which shard.
    pub shard: Shard,
    /// Whether it came to its end, and was not stopped before.
    pub complete: bool,
}

/// Reads what the shards of a plan wrote, in order of the names of their files, and hands on each asset's line. What is cut or damaged counts
/// as not there, and so does every file that is of another plan.
///
/// # Errors
/// Where the folder or a file in it cannot be read.
pub fn read(
    output: &Path,
    plan: &str,
    mut each: impl FnMut(Finished),
) -> Result<Vec<Attempt>, ExportError> {
    let own = plan_folder(output, plan);
    let entries = match fs::read_dir(&own) {
        Ok(entries) => entries,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(ExportError::io(Action::Read, &own)(error)),
    };
    let entries = entries.collect::<io::Result<Vec<_>>>();
    let entries = entries.map_err(ExportError::io(Action::Read, &own))?;
    let mut names: Vec<String> = entries
        .iter()
        .filter_map(|entry| entry.file_name().into_string().ok())
        .filter(|name| name.starts_with("shard-") && name.ends_with(".jsonl"))
        .collect();
    names.sort_unstable();
    let mut attempts = Vec::with_capacity(names.len());
    for name in names {
        let path = own.join(name);
        let read = read_one(&path, plan, &mut each);
        attempts.extend(read.map_err(ExportError::io(Action::Read, &path))?);
    }
    Ok(attempts)
}

fn read_one(
    path: &Path,
    plan: &str,
    each: &mut impl FnMut(Finished),
) -> io::Result<Option<Attempt>> {
    let mut lines = BufReader::new(open_regular(path)?.0).split(b'\n');
    let first = match lines.next() {
        Some(line) => serde_json::from_slice(&line?).ok(),
        None => None,
    };
    let shard = match first {
        Some(Line::Begin {
            plan: of, shard, ..
        }) if of == plan => shard,
        _ => return Ok(None),
    };
    let (mut found, mut complete) = (0, false);
    for line in lines {
        match serde_json::from_slice(&line?) {
            Ok(Line::Asset(finished)) => {
                found += 1;
                each(*finished);
            }
            Ok(Line::End { assets, stopped }) => complete = !stopped && assets == found,
            Ok(Line::Begin { .. }) | Err(_) => {}
        }
    }
    Ok(Some(Attempt { shard, complete }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::batch::shard::tests::plan;

    const SHARD: Shard = Shard {
        number: 2,
        count: 3,
    };

    fn outcome(id: &str, state: AssetState) -> AssetOutcome {
        let mut outcome = AssetOutcome::whole(id, state, 0.1 + 0.2);
        outcome.files = vec!["atlas.json".into()];
        outcome
    }

    fn found(root: &Path, plan: &str) -> (Vec<String>, Vec<Attempt>) {
        let mut ids = Vec::new();
        let attempts = read(root, plan, |finished| ids.push(finished.outcome.id)).unwrap();
        (ids, attempts)
    }

    #[test]
    fn what_is_written_is_read_as_soon_as_it_is_there() {
        let root = tempfile::tempdir().unwrap();
        let plan = plan(root.path(), &[1, 1, 1]);
        let id = &plan.header.id;
        assert_eq!(found(root.path(), id), (vec![], vec![]));
        let mut recorder = ShardRecorder::begin(root.path(), id, SHARD).unwrap();
        let attempt = |complete| {
            vec![Attempt {
                shard: SHARD,
                complete,
            }]
        };
        assert_eq!(found(root.path(), id), (vec![], attempt(false)));
        let one = outcome("a001", AssetState::Built);
        recorder.record(&plan.assets[1].task, &one);
        let mut all = Vec::new();
        let attempts = read(root.path(), id, |finished| all.push(finished)).unwrap();
        assert_eq!(attempts, attempt(false));
        let expected = Finished {
            input_hash: Some("a001".into()),
            config_hash: plan.assets[1].task.config_hash.clone(),
            host: limits::host(),
            outcome: one,
        };
        assert_eq!(all, [expected]);
        recorder.finish().unwrap();
        assert_eq!(found(root.path(), id), (vec!["a001".into()], attempt(true)));
        assert_eq!(found(root.path(), "another"), (vec![], vec![]));
    }

    #[test]
    fn a_shard_that_was_stopped_is_not_complete() {
        let root = tempfile::tempdir().unwrap();
        let plan = plan(root.path(), &[1, 1]);
        let mut recorder = ShardRecorder::begin(root.path(), "p", SHARD).unwrap();
        recorder.record(&plan.assets[0].task, &outcome("a000", AssetState::Built));
        recorder.record(
            &plan.assets[1].task,
            &outcome("a001", AssetState::Cancelled),
        );
        recorder.finish().unwrap();
        let (ids, attempts) = found(root.path(), "p");
        assert_eq!(ids, ["a000", "a001"]);
        assert!(!attempts[0].complete);
    }

    #[test]
    fn cut_and_damaged_lines_count_as_not_there() {
        let root = tempfile::tempdir().unwrap();
        let plan = plan(root.path(), &[1, 1, 1]);
        let mut recorder = ShardRecorder::begin(root.path(), "p", SHARD).unwrap();
        for asset in &plan.assets {
            recorder.record(&asset.task, &outcome(&asset.task.id, AssetState::Built));
        }
        let path = recorder.path.clone();
        recorder.finish().unwrap();
        let whole = fs::read(&path).unwrap();
        for at in 0..whole.len() {
            fs::write(&path, &whole[..at]).unwrap();
            let (ids, attempts) = found(root.path(), "p");
            assert!(ids.len() <= 3);
            // The break at the very end may be missing.
            let complete = attempts.iter().any(|attempt| attempt.complete);
            assert_eq!(complete, at + 1 == whole.len(), "cut at {at}");
        }
        let text = String::from_utf8(whole).unwrap();
        fs::write(
            &path,
            text.replacen("{\"record\":\"asset\"", "{\"record\":", 1),
        )
        .unwrap();
        let (ids, attempts) = found(root.path(), "p");
        assert_eq!(ids, ["a001", "a002"]);
        assert!(!attempts[0].complete, "one line is missing");
        // Of another plan, whatever its folder is called.
        fs::write(&path, text.replacen("\"plan\":\"p\"", "\"plan\":\"q\"", 1)).unwrap();
        assert_eq!(found(root.path(), "p"), (vec![], vec![]));
    }

    #[test]
    fn two_processes_that_run_the_same_shard_write_two_files() {
        let root = tempfile::tempdir().unwrap();
        let plan = plan(root.path(), &[1]);
        let mut one = ShardRecorder::begin(root.path(), "p", SHARD).unwrap();
        let mut other = ShardRecorder::begin(root.path(), "p", SHARD).unwrap();
        for recorder in [&mut one, &mut other] {
            recorder.record(&plan.assets[0].task, &outcome("a000", AssetState::Built));
        }
        one.finish().unwrap();
        let (ids, attempts) = found(root.path(), "p");
        assert_eq!(ids.len(), 2);
        assert_eq!(attempts.iter().filter(|a| a.complete).count(), 1);
        drop(other);
    }

    #[test]
    fn no_line_follows_one_that_could_not_be_written() {
        let root = tempfile::tempdir().unwrap();
        let plan = plan(root.path(), &[1, 1]);
        let mut recorder = ShardRecorder::begin(root.path(), "p", SHARD).unwrap();
        let task = |i: usize| &plan.assets[i].task;
        recorder.record(task(0), &outcome("a000", AssetState::Built));
        // Nothing can be written to a file that is open for reading.
        let writable = std::mem::replace(&mut recorder.file, File::open(&recorder.path).unwrap());
        recorder.record(task(1), &outcome("a001", AssetState::Built));
        recorder.file = writable;
        let error = recorder.finish().unwrap_err();
        assert!(error.to_string().contains("shard-2-of-3"), "{error}");
        let (ids, attempts) = found(root.path(), "p");
        assert_eq!(ids, ["a000"]);
        assert!(!attempts[0].complete);
    }
}
