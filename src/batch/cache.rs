//! What earlier runs left: nothing to do where input, configuration, version and outputs are the same, else the reason why not.
//!
//! *Enters:* a task and an output root. *Leaves:* [`Verdict`]. An [`Entry`] stands in `.affine-atlas/cache/ID.json` and was written
//! by the worker, after its folder was in place and only where every component was built; it ends in its own hash. Time
//! stamps are never looked at: input and outputs are read and hashed whole. What is in the folder besides the outputs is not looked at either.
//!
//! *Not cached:* failures. A refused input is refused again within milliseconds to seconds, and the reason for a failure may lie outside of the
//! input (a full disk, a cap on memory), so every run tries again.

use super::task::Task;
use crate::export::ExportError;
use crate::export::folder::{list_files, write_unsynced};
use crate::export::manifest::{Record, State};
use crate::outcome::{AssetOutcome, AssetState};
use crate::read::bounded::{JSON_LIMIT, is_inside, open_regular, read_bounded};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The version that entries are of; another version builds everything again.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// What a finished build leaves for the next run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// [`VERSION`].
    pub version: String,
    /// [`Task::input_hash`].
    pub input_hash: String,
    /// [`Config::flat`](crate::config::Config::flat).
    pub config: BTreeMap<String, Value>,
    /// [`Plan`](super::plan::Plan) by which it was built, where there was one.
    #[serde(default)]
    pub plan: Option<String>,
    /// The asset's files.
    pub outputs: Vec<Output>,
    /// What the build said.
    pub outcome: AssetOutcome,
}

/// A file that was written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Output {
    /// Relative to the asset's folder, with forward slashes.
    pub path: String,
    /// Its length.
    pub bytes: u64,
    /// BLAKE3, hexadecimal.
    pub blake3: String,
}

/// What counts as done.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Demand<'a> {
    /// Nothing that was there before; only what the same plan has built.
    pub force: bool,
    /// The plan that is carried out, by its id.
    pub plan: Option<&'a str>,
}

/// Whether an asset must be built.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// No: what an earlier run said of it. It counts as built where that was an earlier attempt at the same plan.
    Cached(Box<AssetOutcome>),
    /// Yes, and why.
    Build(Reason),
}

/// Why an asset must be built.
#[derive(Clone, Debug, PartialEq)]
pub enum Reason {
    /// Nobody built it before.
    New,
    /// The user wants everything built.
    Forced,
    /// There is no good result, because the latest run failed.
    FailedLastTime,
    /// The latest run was stopped before it was done.
    Stopped,
    /// The entry is not what was written.
    EntryDamaged,
    /// Another version wrote it.
    Version {
        /// Which.
        from: String,
    },
    /// A byte of the input is another one.
    InputChanged,
    /// The input cannot be read any more.
    InputUnreadable,
    /// Keys have other values.
    Config {
        /// The first of them.
        key: String,
        /// What it was, as JSON; nothing where it was absent.
        from: Option<Value>,
        /// What it is.
        to: Option<Value>,
        /// How many others there are.
        others: usize,
    },
    /// A file is not what was written.
    OutputDamaged {
        /// Which, relative to the asset's folder.
        file: String,
        /// Whether it is there at all.
        missing: bool,
    },
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shown = |value: &Option<Value>| match value {
            Some(value) => {
                let text = value.to_string();
                match text.char_indices().nth(40) {
                    Some((end, _)) => format!("{}…", &text[..end]),
                    None => text,
                }
            }
            None => "absent".to_owned(),
        };
        match self {
            Self::New => write!(f, "new"),
            Self::Forced => write!(f, "forced"),
            Self::FailedLastTime => write!(f, "failed last time"),
            Self::Stopped => write!(f, "stopped last time"),
            Self::EntryDamaged => write!(f, "cache entry damaged"),
            Self::Version { from } => write!(f, "built by version {from}, this is {VERSION}"),
            Self::InputChanged => write!(f, "input changed"),
            Self::InputUnreadable => write!(f, "input cannot be read"),
            Self::Config {
                key,
                from,
                to,
                others,
            } => {
                let (from, to) = (shown(from), shown(to));
                write!(f, "configuration key {key} changed from {from} to {to}")?;
                match others {
                    0 => Ok(()),
                    1 => write!(f, ", and 1 other key"),
                    n => write!(f, ", and {n} other keys"),
                }
            }
            Self::OutputDamaged { file, missing } => {
                let what = if *missing { "missing" } else { "damaged" };
                write!(f, "outputs {what}: {file}")
            }
        }
    }
}

fn entry_path(output: &Path, id: &str) -> PathBuf {
    let folder = super::private_folder(output).join("cache");
    folder.join(format!("{id}.json"))
}

/// Looks whether an asset must be built into `output`. `last` is what the manifest says of it.
#[must_use]
pub fn check(output: &Path, task: &Task, last: Option<&Record>, demand: Demand<'_>) -> Verdict {
    if demand.force && demand.plan.is_none() {
        return Verdict::Build(Reason::Forced);
    }
    match look(output, task, last) {
        Ok(entry) => {
            let mut outcome = entry.outcome;
            if demand.plan.is_some() && entry.plan.as_deref() == demand.plan {
                return Verdict::Cached(Box::new(outcome));
            }
            if demand.force {
                return Verdict::Build(Reason::Forced);
            }
            outcome.state = AssetState::Cached;
            outcome.seconds = 0.0;
            outcome.peak_memory = None;
            outcome.host = None;
            Verdict::Cached(Box::new(outcome))
        }
        Err(_) if demand.force => Verdict::Build(Reason::Forced),
        Err(reason) => Verdict::Build(reason),
    }
}

fn look(output: &Path, task: &Task, last: Option<&Record>) -> Result<Entry, Reason> {
    let bytes = match read_bounded(&entry_path(output, &task.id), JSON_LIMIT) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            return Err(match last.map(|record| record.state) {
                Some(State::Failed) => Reason::FailedLastTime,
                Some(State::Cancelled) => Reason::Stopped,
                _ => Reason::New,
            });
        }
        Err(_) => return Err(Reason::EntryDamaged),
    };
    let entry = parse(&bytes).ok_or(Reason::EntryDamaged)?;
    if entry.version != VERSION {
        return Err(Reason::Version {
            from: entry.version,
        });
    }
    match &task.input_hash {
        None => return Err(Reason::InputUnreadable),
        Some(hash) if *hash != entry.input_hash => {
            return Err(Reason::InputChanged);
        }
        Some(_) => {}
    }
    if let Some(reason) = changed_key(&entry.config, &task.settings.flat) {
        return Err(reason);
    }
    let folder = output.join(&task.id);
    for written in &entry.outputs {
        whole(&folder, written)?;
    }
    Ok(entry)
}

/// The first key whose value differs.
fn changed_key(old: &BTreeMap<String, Value>, new: &BTreeMap<String, Value>) -> Option<Reason> {
    let mut keys: Vec<&String> = old.keys().chain(new.keys()).collect();
    keys.sort_unstable();
    keys.dedup();
    keys.retain(|key| old.get(*key) != new.get(*key));
    let (first, others) = keys.split_first()?;
    Some(Reason::Config {
        key: (*first).clone(),
        from: old.get(*first).cloned(),
        to: new.get(*first).cloned(),
        others: others.len(),
    })
}

/// Whether a file is what was written.
fn whole(folder: &Path, written: &Output) -> Result<(), Reason> {
    let damaged = |missing| Reason::OutputDamaged {
        file: written.path.clone(),
        missing,
    };
    if !is_inside(&written.path) {
        return Err(Reason::EntryDamaged);
    }
    let path = folder.join(&written.path);
    let found = fs::symlink_metadata(&path).map_err(|_| damaged(true))?;
    if !found.is_file() || found.len() != written.bytes {
        return Err(damaged(false));
    }
    match hash_file(&path) {
        Ok((hash, _)) if hash == written.blake3 => Ok(()),
        _ => Err(damaged(false)),
    }
}

/// BLAKE3 in hexadecimal, and length.
fn hash_file(path: &Path) -> io::Result<(String, u64)> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(open_regular(path)?.0)?;
    Ok((hasher.finalize().to_hex().to_string(), hasher.count()))
}

/// An entry whose own hash fits.
fn parse(bytes: &[u8]) -> Option<Entry> {
    let text = std::str::from_utf8(bytes).ok()?;
    let (entry, hash) = text.strip_suffix('\n')?.rsplit_once('\n')?;
    (blake3::hash(entry.as_bytes()).to_hex().as_str() == hash).then_some(())?;
    serde_json::from_slice(entry.as_bytes()).ok()
}

/// Writes the entry of an asset whose folder is in place, built by a plan or not. A result with a failed component leaves none.
///
/// # Errors
/// Where outputs cannot be read back, or the entry cannot be written; the asset is built all the same.
pub fn store(
    output: &Path,
    input_hash: &str,
    config: BTreeMap<String, Value>,
    plan: Option<&str>,
    outcome: &AssetOutcome,
) -> Result<(), ExportError> {
    if outcome.state_name() != "built" {
        return Ok(());
    }
    let folder = output.join(&outcome.id);
    let read = |path: &Path| ExportError::io(crate::export::Action::Read, path);
    let mut outputs = Vec::new();
    for name in list_files(&folder)? {
        let path = folder.join(&name);
        let (blake3, bytes) = hash_file(&path).map_err(read(&path))?;
        outputs.push(Output {
            path: name,
            bytes,
            blake3,
        });
    }
    let entry = Entry {
        version: VERSION.to_owned(),
        input_hash: input_hash.to_owned(),
        config,
        plan: plan.map(str::to_owned),
        outputs,
        outcome: outcome.clone(),
    };
    let encode = |error: serde_json::Error| ExportError::Encode {
        path: entry_path(output, &outcome.id),
        message: error.to_string(),
    };
    let mut text = serde_json::to_string(&entry).map_err(encode)?;
    let hash = blake3::hash(text.as_bytes()).to_hex();
    text.push('\n');
    text.push_str(&hash);
    text.push('\n');
    write_unsynced(&entry_path(output, &outcome.id), text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::super::task::Settings;
    use super::*;
    use crate::config::Config;
    use crate::config::assets::Asset;
    use std::sync::Arc;

    struct Night {
        root: tempfile::TempDir,
        task: Task,
    }

    impl Night {
        /// An asset that was built.
        fn new() -> Self {
            let root = tempfile::tempdir().unwrap();
            let path = root.path().join("a.obj");
            fs::write(&path, "v 0 0 0").unwrap();
            let asset = Asset {
                id: "a".into(),
                given: path.clone(),
                path,
            };
            let task = Task::new(&asset, &Arc::new(Settings::new(Config::default())));
            fs::create_dir_all(root.path().join("a/images")).unwrap();
            fs::write(root.path().join("a/atlas.json"), "{}").unwrap();
            fs::write(root.path().join("a/images/0000.exr"), "pixels").unwrap();
            let night = Self { root, task };
            night.store(&AssetOutcome::whole("a", AssetState::Built, 3.0));
            night
        }

        fn store(&self, outcome: &AssetOutcome) {
            self.store_for(None, outcome);
        }

        fn store_for(&self, plan: Option<&str>, outcome: &AssetOutcome) {
            let hash = self.task.input_hash.clone().unwrap();
            store(
                self.root.path(),
                &hash,
                self.task.settings.flat.clone(),
                plan,
                outcome,
            )
            .unwrap();
        }

        fn entry(&self) -> PathBuf {
            entry_path(self.root.path(), "a")
        }

        fn check(&self, demand: Demand<'_>) -> Verdict {
            check(self.root.path(), &self.task, None, demand)
        }

        fn reason(&self) -> String {
            match self.check(Demand::default()) {
                Verdict::Build(reason) => reason.to_string(),
                Verdict::Cached(_) => "cached".to_owned(),
            }
        }

        fn with_config(&self, change: impl Fn(&mut Config)) -> Self {
            let mut config = Config::default();
            change(&mut config);
            let mut task = self.task.clone();
            task.settings = Arc::new(Settings::new(config));
            let root = tempfile::tempdir_in(self.root.path()).unwrap();
            Self { root, task }
        }
    }

    #[test]
    fn an_asset_that_is_whole_is_cached() {
        let night = Night::new();
        let Verdict::Cached(outcome) = night.check(Demand::default()) else {
            panic!("{}", night.reason());
        };
        assert_eq!((outcome.state_name(), outcome.seconds), ("cached", 0.0));
        fs::write(night.root.path().join("a/notes.txt"), "mine").unwrap();
        assert_eq!(night.reason(), "cached");
    }

    #[test]
    fn what_the_same_plan_has_built_counts_as_built() {
        let night = Night::new();
        let said = |force, plan| match night.check(Demand { force, plan }) {
            Verdict::Cached(outcome) => {
                let there = outcome.host.as_deref() == Some("there");
                assert_eq!(outcome.state == AssetState::Built, there);
                (outcome.state_name().to_owned(), outcome.seconds)
            }
            Verdict::Build(reason) => (reason.to_string(), 0.0),
        };
        let is = |word: &str, seconds| (word.to_owned(), seconds);
        let mut built = AssetOutcome::whole("a", AssetState::Built, 3.0);
        built.host = Some("there".into());
        assert_eq!(said(false, Some("p")), is("cached", 0.0));
        assert_eq!(said(true, Some("p")), is("forced", 0.0));
        assert_eq!(said(true, None), is("forced", 0.0));
        night.store_for(Some("p"), &built);
        assert_eq!(said(false, Some("p")), is("built", 3.0));
        assert_eq!(said(true, Some("p")), is("built", 3.0));
        assert_eq!(said(false, Some("q")), is("cached", 0.0));
        assert_eq!(said(true, Some("q")), is("forced", 0.0));
        assert_eq!(said(false, None), is("cached", 0.0));
        // Not where it is no more what was built.
        fs::write(night.root.path().join("a/atlas.json"), "[]").unwrap();
        assert_eq!(said(false, Some("p")).0, "outputs damaged: atlas.json");
        assert_eq!(said(true, Some("p")).0, "forced");
    }

    #[test]
    fn every_reason_is_told() {
        let mut night = Night::new();
        let image = night.root.path().join("a/images/0000.exr");
        fs::write(&image, "pixelz").unwrap();
        assert_eq!(night.reason(), "outputs damaged: images/0000.exr");
        fs::write(&image, "pixel").unwrap();
        assert_eq!(night.reason(), "outputs damaged: images/0000.exr");
        fs::remove_file(&image).unwrap();
        assert_eq!(night.reason(), "outputs missing: images/0000.exr");
        fs::write(&image, "pixels").unwrap();
        assert_eq!(night.reason(), "cached");

        night.task.input_hash = Some("00".into());
        assert_eq!(night.reason(), "input changed");
        night.task.input_hash = None;
        assert_eq!(night.reason(), "input cannot be read");

        let night = Night::new();
        let other = night.with_config(|config| config.cones.count = Some(6));
        let verdict = check(night.root.path(), &other.task, None, Demand::default());
        let Verdict::Build(reason) = verdict else {
            panic!("cached")
        };
        assert_eq!(
            reason.to_string(),
            "configuration key cones.count changed from absent to 6"
        );
        let other = night.with_config(|config| {
            config.features.angle = 50.0;
            config.patches.padding = 7;
            config.run.threads = 3;
        });
        let verdict = check(night.root.path(), &other.task, None, Demand::default());
        let Verdict::Build(reason) = verdict else {
            panic!("cached")
        };
        let said = reason.to_string();
        assert!(
            said.starts_with("configuration key features.angle changed from "),
            "{said}"
        );
        assert!(said.ends_with(", and 1 other key"), "{said}");
    }

    #[test]
    fn a_damaged_entry_is_never_believed() {
        let night = Night::new();
        let whole = fs::read(night.entry()).unwrap();
        for at in (0..whole.len()).step_by(7) {
            let mut damaged = whole.clone();
            damaged[at] ^= 1;
            fs::write(night.entry(), &damaged).unwrap();
            assert_eq!(night.reason(), "cache entry damaged", "byte {at}");
            fs::write(night.entry(), &whole[..at]).unwrap();
            assert_eq!(night.reason(), "cache entry damaged", "cut at {at}");
        }
        fs::write(night.entry(), &whole).unwrap();
        assert_eq!(night.reason(), "cached");
        fs::remove_file(night.entry()).unwrap();
        assert_eq!(night.reason(), "new");
    }

    #[test]
    fn failures_are_not_cached() {
        let night = Night::new();
        fs::remove_file(night.entry()).unwrap();
        let failure = crate::outcome::Failure {
            kind: crate::outcome::FailureKind::Input,
            message: "wrong".into(),
        };
        let failed = AssetOutcome::failed("a", failure, 1.0);
        night.store(&failed);
        assert_eq!(night.reason(), "new");
        let record = Record::of(&failed, "");
        let verdict = check(
            night.root.path(),
            &night.task,
            Some(&record),
            Demand::default(),
        );
        assert_eq!(verdict, Verdict::Build(Reason::FailedLastTime));
    }
}
