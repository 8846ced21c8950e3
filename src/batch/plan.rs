//! A plan: what a batch is to do, as a file that several machines read.
//!
//! *Enters:* tasks, and what the cache says of them. *Leaves:* a [`Plan`], as a value and as the text of `PLAN.jsonl`, which holds all that shards and their
//! merging need: nobody reads a configuration again.
//!
//! | line | holds |
//! | --- | --- |
//! | [`Header`] | which program made it, where, for which output root |
//! | [`Configuration`] | the settings of some assets; one for each distinct one |
//! | [`Planned`] | an asset: files, hashes, whether it must be built and why, what it is expected to take |
//! | [`End`] | the hash of all lines before |
//!
//! *Guaranteed:* a plan that is read is the one that was written, to the byte, by the same version, and its configurations have the
//! hashes that they had.
//! *Not guaranteed:* that inputs are still as they were; whoever does a task looks again. Paths start at the folder in which the plan was made,
//! because file systems are mounted at different places on different machines; [`Plan::check_place`] finds out whether that is here.

mod error;
mod read;

pub use error::PlanError;

use super::cache::{VERSION, Verdict};
use super::task::{Settings, Task};
use super::{limits, private_folder};
use crate::config::Config;
use crate::export::folder::unique_name;
use crate::export::{Action, ExportError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::{BTreeMap, HashMap};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

/// What a plan calls itself.
const FORMAT: &str = "affine-atlas-plan";
/// Version of the format.
const FORMAT_VERSION: u32 = 1;

/// Where a plan's shards write down what they did, below an output root.
#[must_use]
pub fn plan_folder(output: &Path, id: &str) -> PathBuf {
    private_folder(output).join("plans").join(id)
}

/// A line of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(tag = "record", rename_all = "snake_case")]
pub enum Line {
    /// The first.
    Plan(Header),
    /// Settings of assets, numbered from 0 in order.
    Configuration(Box<Configuration>),
    /// An asset.
    Asset(Box<PlannedLine>),
    /// The last.
    End(End),
}

impl Line {
    /// One line, without its line break. What is derived reads every member into a value that can hold anything first.
    fn read(bytes: &[u8]) -> serde_json::Result<Self> {
        #[derive(Deserialize)]
        struct Tagged {
            record: Tag,
        }
        #[derive(Deserialize)]
        #[serde(rename_all = "snake_case")]
        enum Tag {
            Plan,
            Configuration,
            Asset,
            End,
        }
        let Tagged { record } = serde_json::from_slice(bytes)?;
        Ok(match record {
            Tag::Plan => Self::Plan(serde_json::from_slice(bytes)?),
            Tag::Configuration => Self::Configuration(serde_json::from_slice(bytes)?),
            Tag::Asset => Self::Asset(serde_json::from_slice(bytes)?),
            Tag::End => Self::End(serde_json::from_slice(bytes)?),
        })
    }
}

/// The first line of a plan.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Header {
    /// `"affine-atlas-plan"`.
    #[schemars(extend("const" = FORMAT))]
    pub format: String,
    /// Version of the format.
    #[schemars(extend("const" = FORMAT_VERSION))]
    pub version: u32,
    /// Version of the program; another one does not carry this plan out.
    pub program_version: String,
    /// Letters and digits that no other plan has.
    pub id: String,
    /// Folder in which the plan was made, absolute: where relative paths start.
    pub folder: PathBuf,
    /// The output root.
    pub output: PathBuf,
    /// Whether all is built, also what is as it should be.
    pub force: bool,
    /// Most meshes that a shard builds at the same time; 0: one a core.
    pub jobs: usize,
    /// Memory of all processes of a shard together, bytes; 0: what its machine has left.
    pub total_memory: u64,
    /// Files that were read to make the plan, beside meshes: configuration, cone files, lists.
    pub files: Vec<PathBuf>,
    /// How many configurations follow.
    pub configurations: usize,
    /// How many assets follow.
    pub assets: usize,
}

/// Settings of some assets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Configuration {
    /// BLAKE3 of what can change an output byte, hexadecimal: `config_hash` of its assets.
    pub config_hash: String,
    /// All keys with their values.
    #[schemars(with = "BTreeMap<String, Value>")]
    pub config: Config,
    /// Lines of `cones.file` that the listed cones stood on, for messages.
    pub cone_lines: Vec<u32>,
}

/// The line of an asset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlannedLine {
    /// What is to be done.
    #[serde(flatten)]
    pub task: Task,
    /// Number of its configuration, from 0.
    pub configuration: usize,
    /// Whether it must be built.
    pub decision: Decision,
    /// Why it must be built.
    pub reason: Option<String>,
    /// Time that it is expected to take, milliseconds; for what is cached, that of looking whether it is whole.
    pub estimate: u64,
}

/// What the cache said when the plan was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Decision {
    /// It must be built.
    Build,
    /// It is as it should be.
    Cached,
}

/// The last line of a plan.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct End {
    /// BLAKE3 of all lines before, with their line breaks, hexadecimal.
    pub blake3: String,
}

/// An asset of a plan.
#[derive(Clone, Debug, PartialEq)]
pub struct Planned {
    /// What is to be done.
    pub task: Task,
    /// What the cache said when the plan was made.
    pub decision: Decision,
    /// Why it must be built.
    pub reason: Option<String>,
    /// See [`PlannedLine::estimate`].
    pub estimate: u64,
}

/// What a batch is to do; see the module docs.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// What concerns all of it.
    pub header: Header,
    /// In the order in which the user named them.
    pub assets: Vec<Planned>,
}

/// What concerns a whole plan, for [`Plan::new`].
#[derive(Clone, Debug)]
pub struct Purpose {
    /// See [`Header::folder`].
    pub folder: PathBuf,
    /// See [`Header::output`].
    pub output: PathBuf,
    /// See [`Header::force`].
    pub force: bool,
    /// See [`Header::files`].
    pub files: Vec<PathBuf>,
    /// What concerns the whole run.
    pub run: crate::config::RunParams,
}

impl Purpose {
    /// A path that is no text, of these or of tasks.
    fn not_unicode(&self, tasks: &[Task]) -> Option<PathBuf> {
        let of_tasks = tasks.iter().flat_map(|task| {
            let own = [&task.path, &task.given];
            own.into_iter().chain(&task.files)
        });
        let own = [&self.folder, &self.output].into_iter().chain(&self.files);
        let mut all = own.chain(of_tasks);
        all.find(|path| path.to_str().is_none()).cloned()
    }
}

impl Plan {
    /// Makes a plan of tasks and what the cache says of each, a verdict a task.
    ///
    /// # Errors
    /// [`PlanError::NotUnicode`].
    pub fn new(
        purpose: Purpose,
        tasks: Vec<Task>,
        verdicts: &[Verdict],
    ) -> Result<Self, PlanError> {
        if let Some(path) = purpose.not_unicode(&tasks) {
            return Err(PlanError::NotUnicode { path });
        }
        let planned = |(task, verdict): (Task, &Verdict)| {
            let (decision, reason) = match verdict {
                Verdict::Cached(_) => (Decision::Cached, None),
                Verdict::Build(reason) => (Decision::Build, Some(reason.to_string())),
            };
            Planned {
                estimate: limits::expected_time(
                    task.cost,
                    &task.settings.config,
                    decision == Decision::Build,
                ),
                task,
                decision,
                reason,
            }
        };
        let assets: Vec<Planned> = tasks.into_iter().zip(verdicts).map(planned).collect();
        let mut plan = Self {
            header: Header {
                format: FORMAT.to_owned(),
                version: FORMAT_VERSION,
                program_version: VERSION.to_owned(),
                id: String::new(),
                folder: purpose.folder,
                output: purpose.output,
                force: purpose.force,
                jobs: purpose.run.jobs,
                total_memory: purpose.run.total_memory,
                files: purpose.files,
                configurations: 0,
                assets: assets.len(),
            },
            assets,
        };
        plan.header.configurations = plan.configurations().0.len();
        plan.header.id = plan.new_id();
        Ok(plan)
    }

    /// From what it holds, and from when and by whom it is made: the same work planned again is another plan.
    fn new_id(&self) -> String {
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        let mut hasher = blake3::Hasher::new();
        hasher.update(self.to_text().as_bytes());
        hasher.update(unique_name().as_bytes());
        hasher.update(&now.map_or(0, |now| now.as_nanos()).to_le_bytes());
        hasher.finalize().to_hex()[..20].to_owned()
    }

    /// The distinct configurations, and the number of each asset's.
    fn configurations(&self) -> (Vec<Configuration>, Vec<usize>) {
        let mut by_place: HashMap<*const Settings, usize> = HashMap::new();
        let mut by_value: HashMap<String, usize> = HashMap::new();
        let mut all = Vec::new();
        let number_of = |planned: &Planned| {
            let settings = &planned.task.settings;
            // Most assets share theirs with others, and comparing is slower than looking up.
            *by_place.entry(Arc::as_ptr(settings)).or_insert_with(|| {
                let mut config = settings.config.clone();
                // What concerns the whole run is in tasks and header.
                config.input = Default::default();
                config.output = config.output.anywhere();
                let one = Configuration {
                    config_hash: settings.hash.clone(),
                    cone_lines: config.cones.file_lines.clone(),
                    config,
                };
                *by_value.entry(line_of(&one)).or_insert_with(|| {
                    all.push(one);
                    all.len() - 1
                })
            })
        };
        let numbers = self.assets.iter().map(number_of).collect();
        (all, numbers)
    }

    /// The text of the file.
    #[must_use]
    pub fn to_text(&self) -> String {
        let (configurations, numbers) = self.configurations();
        let mut text = String::new();
        let mut put = |line: Line| {
            text.push_str(&line_of(&line));
            text.push('\n');
        };
        put(Line::Plan(self.header.clone()));
        for one in configurations {
            put(Line::Configuration(Box::new(one)));
        }
        for (planned, configuration) in self.assets.iter().zip(numbers) {
            let Planned {
                task,
                decision,
                reason,
                estimate,
            } = planned.clone();
            put(Line::Asset(Box::new(PlannedLine {
                task,
                configuration,
                decision,
                reason,
                estimate,
            })));
        }
        let blake3 = blake3::hash(text.as_bytes()).to_hex().to_string();
        text.push_str(&line_of(&Line::End(End { blake3 })));
        text.push('\n');
        text
    }

    /// Makes the folder for what shards write down, by which other machines know the place.
    ///
    /// # Errors
    /// Where it cannot be made.
    pub fn mark_place(&self) -> Result<(), ExportError> {
        let own = plan_folder(&self.header.output, &self.header.id);
        fs::create_dir_all(&own).map_err(ExportError::io(Action::CreateFolder, &own))
    }

    /// Looks whether paths mean here what they meant where the plan was made: `here` is that folder, or there is the mark of
    /// [`Plan::mark_place`] and one of the inputs. The same folder may have another name on another machine, and a folder of the same name may be
    /// empty there.
    ///
    /// # Errors
    /// [`PlanError::Elsewhere`], [`PlanError::NothingHere`].
    pub fn check_place(&self, here: &Path) -> Result<(), PlanError> {
        let Header {
            folder, output, id, ..
        } = &self.header;
        let mark = plan_folder(output, id);
        let readable = self.assets.iter().map(|planned| &planned.task);
        let mut readable = readable.filter(|task| task.input_hash.is_some());
        if here == folder {
            return match mark.is_dir() || readable.any(|task| task.path.exists()) {
                true => Ok(()),
                false => Err(PlanError::NothingHere {
                    here: here.to_owned(),
                    missing: mark,
                }),
            };
        }
        let elsewhere = |missing: &Path| PlanError::Elsewhere {
            folder: folder.clone(),
            here: here.to_owned(),
            missing: missing.to_owned(),
        };
        if !mark.is_dir() {
            return Err(elsewhere(&mark));
        }
        // Absolute ones tell nothing of this folder.
        let mut relative = readable.filter(|task| task.path.is_relative());
        let Some(first) = relative.next() else {
            return Ok(());
        };
        match first.path.exists() || relative.any(|task| task.path.exists()) {
            true => Ok(()),
            false => Err(elsewhere(&first.path)),
        }
    }
}

/// A line of JSON, without its break.
fn line_of(value: &impl Serialize) -> String {
    serde_json::to_string(value)
        .expect("string keys and paths that are text, so that serialisation cannot fail")
}

#[cfg(test)]
mod tests;
