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
    /// Name of the machine, where it has one.
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
    let mut lines = BufReader::new(File::open(path)?).split(b'\n');
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
