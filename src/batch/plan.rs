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

use super::cache::{VERSION, Verdict};
use super::task::{Settings, Task};
use super::{limits, private_folder};
use crate::config::Config;
use crate::export::folder::{is_asset_name, unique_name};
use crate::export::{Action, ExportError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::fs::{self, File};
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::SystemTime;

/// What a plan calls itself.
const FORMAT: &str = "affine-atlas-plan";
/// Version of the format.
const FORMAT_VERSION: u32 = 1;
/// No line is longer, bytes: another file that was named by mistake is not read into memory.
const LONGEST_LINE: u64 = 64 << 20;
/// Most letters of an id.
const LONGEST_ID: usize = 64;

/// Where a plan's shards write down what they did, below an output root.
#[must_use]
pub fn plan_folder(output: &Path, id: &str) -> PathBuf {
    private_folder(output).join("plans").join(id)
}

/// A line of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "record", rename_all = "snake_case")]
pub enum Line {
    /// The first.
    Plan(Header),
    /// Settings of assets, numbered from 0 in order.
    Configuration(Configuration),
    /// An asset.
    Asset(Box<PlannedLine>),
    /// The last.
    End(End),
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

/// Why a plan cannot be made or carried out.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlanError {
    /// A path that a plan cannot hold.
    #[error("the path {} is no Unicode text, and a plan holds nothing else", path.display())]
    NotUnicode {
        /// Which.
        path: PathBuf,
    },
    /// The file cannot be read.
    #[error("the plan {} cannot be read: {reason}", path.display())]
    Unreadable {
        /// Which.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// Another sort of file.
    #[error("{} is no plan: its first line is not one that `affine-atlas plan` writes", path.display())]
    NoPlan {
        /// Which.
        path: PathBuf,
    },
    /// A later format.
    #[error("the plan {} has version {found} of its format, and this program reads version {FORMAT_VERSION}", path.display())]
    Format {
        /// Which.
        path: PathBuf,
        /// Its version.
        found: u32,
    },
    /// Another version of the program made it.
    #[error("the plan {} was made by version {found} of affine-atlas, and this is {VERSION}", path.display())]
    Version {
        /// Which.
        path: PathBuf,
        /// The version that made it.
        found: String,
    },
    /// The end is missing.
    #[error("the plan {} ends after line {lines}, and its last line is missing", path.display())]
    Cut {
        /// Which.
        path: PathBuf,
        /// Whole lines that are there.
        lines: usize,
    },
    /// A line is not what was written.
    #[error("line {line} of the plan {} is damaged: {reason}", path.display())]
    Damaged {
        /// Which.
        path: PathBuf,
        /// From 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// Every line is one, but not all are those that were written.
    #[error("the plan {} was changed: its lines have the hash {found}, and its last line says {stated}", path.display())]
    Changed {
        /// Which.
        path: PathBuf,
        /// Of the lines that are there.
        found: String,
        /// Of those that were written.
        stated: String,
    },
    /// A configuration means something else to this program.
    #[error("line {line} of the plan {}: the configuration has the hash {found} here and {stated} where the plan was made", path.display())]
    OtherConfig {
        /// Which.
        path: PathBuf,
        /// From 1.
        line: usize,
        /// Its hash here.
        found: String,
        /// Its hash in the plan.
        stated: String,
    },
    /// The current folder is not the one in which it was made.
    #[error("the plan was made in {}, and this is {}, from where {missing} is not to be seen", folder.display(), here.display())]
    Elsewhere {
        /// The plan's.
        folder: PathBuf,
        /// The current one.
        here: PathBuf,
        /// What.
        missing: String,
    },
}

impl PlanError {
    /// What to change.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::NotUnicode { .. } => "rename it, or use `affine-atlas build`",
            Self::Unreadable { .. } => {
                "check the name; `affine-atlas plan … --plan FILE` writes one"
            }
            Self::NoPlan { .. } => "name a file that `affine-atlas plan … --plan FILE` wrote",
            Self::Format { .. } | Self::Version { .. } => {
                "plan again with this version, or carry the plan out with that one"
            }
            Self::Cut { .. } | Self::Damaged { .. } | Self::Changed { .. } => {
                "copy it again, or plan again: what is built is not built again"
            }
            Self::OtherConfig { .. } => "plan again with this program",
            Self::Elsewhere { .. } => {
                "start it in the folder in which the plan was made, wherever that is mounted on this machine, or plan again"
            }
        }
    }
}

impl Plan {
    /// Makes a plan of tasks and what the cache says of each.
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
                config.output = Default::default();
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
            put(Line::Configuration(one));
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

    /// Reads a plan.
    ///
    /// # Errors
    /// [`PlanError`] for whatever is not a whole plan of this version.
    pub fn read(path: &Path) -> Result<Self, PlanError> {
        let unreadable = |error: io::Error| PlanError::Unreadable {
            path: path.to_owned(),
            reason: match error.kind() {
                io::ErrorKind::NotFound => "there is no such file".to_owned(),
                _ => error.to_string(),
            },
        };
        let file = File::open(path).map_err(unreadable)?;
        let mut lines = Lines {
            path,
            from: BufReader::new(file),
            hasher: blake3::Hasher::new(),
            number: 0,
        };
        let header = lines.header()?;
        let (mut configurations, mut assets) = (Vec::new(), Vec::new());
        let end = loop {
            match lines.next()? {
                Line::Configuration(one) if assets.is_empty() => {
                    configurations.push((lines.number, one));
                }
                Line::Asset(one) => assets.push((lines.number, *one)),
                Line::End(end) => break end,
                _ => return Err(lines.damaged("it is not where it belongs")),
            }
        };
        lines.finish(&end)?;
        let settings = restore(path, configurations)?;
        let damaged = |line, reason: String| PlanError::Damaged {
            path: path.to_owned(),
            line,
            reason,
        };
        let mut known = HashSet::new();
        let mut planned = Vec::with_capacity(assets.len());
        for (line, one) in assets {
            let PlannedLine {
                mut task,
                configuration,
                decision,
                reason,
                estimate,
            } = one;
            match settings.get(configuration) {
                Some(settings) if settings.hash == task.config_hash => {
                    task.settings = Arc::clone(settings);
                }
                Some(settings) => {
                    let reason = format!(
                        "its configuration has the hash {}, not {}",
                        settings.hash, task.config_hash
                    );
                    return Err(damaged(line, reason));
                }
                None => {
                    let reason = format!(
                        "it names configuration {configuration} of {}",
                        settings.len()
                    );
                    return Err(damaged(line, reason));
                }
            }
            if !is_asset_name(&task.id) {
                return Err(damaged(
                    line,
                    format!("{:?} is no name of an asset", task.id),
                ));
            }
            if !known.insert(task.id.clone()) {
                return Err(damaged(line, format!("{} is there twice", task.id)));
            }
            planned.push(Planned {
                task,
                decision,
                reason,
                estimate,
            });
        }
        let counts = (header.configurations, header.assets);
        if counts != (settings.len(), planned.len()) {
            let reason = format!(
                "it states {} configurations and {} assets, and {} and {} follow",
                counts.0,
                counts.1,
                settings.len(),
                planned.len()
            );
            return Err(damaged(1, reason));
        }
        Ok(Self {
            header,
            assets: planned,
        })
    }

    /// Makes the folder for what shards write down, by which other machines know the place.
    ///
    /// # Errors
    /// Where it cannot be made.
    pub fn mark_place(&self) -> Result<(), ExportError> {
        let own = plan_folder(&self.header.output, &self.header.id);
        fs::create_dir_all(&own).map_err(ExportError::io(Action::CreateFolder, &own))
    }

    /// Looks whether relative paths mean here what they meant where the plan was made: `here` is that folder, or there is the mark of
    /// [`Plan::mark_place`] and one of the inputs. The same folder may have another name on another machine.
    ///
    /// # Errors
    /// [`PlanError::Elsewhere`].
    pub fn check_place(&self, here: &Path) -> Result<(), PlanError> {
        let Header {
            folder, output, id, ..
        } = &self.header;
        if here == folder {
            return Ok(());
        }
        let elsewhere = |missing: String| PlanError::Elsewhere {
            folder: folder.clone(),
            here: here.to_owned(),
            missing,
        };
        let mark = plan_folder(output, id);
        if !mark.is_dir() {
            return Err(elsewhere(mark.display().to_string()));
        }
        let mut relative = self.assets.iter().map(|asset| &asset.task);
        let mut relative = relative
            .by_ref()
            .filter(|task| task.input_hash.is_some() && task.path.is_relative())
            .map(|task| &task.path);
        let Some(first) = relative.next() else {
            return Ok(());
        };
        match first.exists() || relative.any(|path| path.exists()) {
            true => Ok(()),
            false => Err(elsewhere(first.display().to_string())),
        }
    }
}

/// Settings as they were, of configurations with their line numbers.
fn restore(
    path: &Path,
    configurations: Vec<(usize, Configuration)>,
) -> Result<Vec<Arc<Settings>>, PlanError> {
    let one = |(line, one): (usize, Configuration)| {
        let mut config = one.config;
        config.cones.file_lines = one.cone_lines;
        let settings = Settings::new(config);
        match settings.hash == one.config_hash {
            true => Ok(Arc::new(settings)),
            false => Err(PlanError::OtherConfig {
                path: path.to_owned(),
                line,
                found: settings.hash,
                stated: one.config_hash,
            }),
        }
    };
    configurations.into_iter().map(one).collect()
}

/// A line of JSON, without its break.
fn line_of(value: &impl Serialize) -> String {
    serde_json::to_string(value)
        .expect("string keys and paths that are text, so that serialisation cannot fail")
}

/// Reads a plan line by line and hashes it.
struct Lines<'p> {
    path: &'p Path,
    from: BufReader<File>,
    hasher: blake3::Hasher,
    /// Of the line that was read last, from 1.
    number: usize,
}

impl Lines<'_> {
    fn damaged(&self, reason: impl ToString) -> PlanError {
        PlanError::Damaged {
            path: self.path.to_owned(),
            line: self.number,
            reason: reason.to_string(),
        }
    }

    /// The bytes of the next line without its break; none at the end of the file or where a line is cut or too long.
    fn bytes(&mut self) -> Result<Option<Vec<u8>>, PlanError> {
        let mut bytes = Vec::new();
        let mut limited = self.from.by_ref().take(LONGEST_LINE);
        let read = limited.read_until(b'\n', &mut bytes);
        read.map_err(|error| PlanError::Unreadable {
            path: self.path.to_owned(),
            reason: error.to_string(),
        })?;
        Ok((bytes.pop() == Some(b'\n')).then_some(bytes))
    }

    fn header(&mut self) -> Result<Header, PlanError> {
        let path = || self.path.to_owned();
        let no_plan = PlanError::NoPlan { path: path() };
        let cut = PlanError::Cut {
            path: path(),
            lines: 0,
        };
        #[derive(Deserialize)]
        struct Outline {
            format: String,
            version: u32,
        }
        let Some(bytes) = self.bytes()? else {
            return Err(no_plan);
        };
        let outline = serde_json::from_slice(&bytes);
        let Ok(Outline { format, version }) = outline else {
            return Err(match bytes.starts_with(b"{\"record\":\"plan\"") {
                true => cut,
                false => no_plan,
            });
        };
        if format != FORMAT {
            return Err(no_plan);
        }
        let path = self.path.to_owned();
        if version != FORMAT_VERSION {
            return Err(PlanError::Format {
                path,
                found: version,
            });
        }
        self.number = 1;
        self.hash(&bytes);
        let header = match serde_json::from_slice(&bytes) {
            Ok(Line::Plan(header)) => header,
            Ok(_) => return Err(no_plan),
            Err(error) => return Err(self.damaged(error)),
        };
        if header.program_version != VERSION {
            return Err(PlanError::Version {
                path,
                found: header.program_version,
            });
        }
        let in_id = |c: char| c.is_ascii_alphanumeric();
        if !(1..=LONGEST_ID).contains(&header.id.len()) || !header.id.chars().all(in_id) {
            return Err(self.damaged(format!("{:?} is no id of a plan", header.id)));
        }
        Ok(header)
    }

    /// The next line, which must be there.
    fn next(&mut self) -> Result<Line, PlanError> {
        let Some(bytes) = self.bytes()? else {
            return Err(PlanError::Cut {
                path: self.path.to_owned(),
                lines: self.number,
            });
        };
        self.number += 1;
        let line = serde_json::from_slice(&bytes).map_err(|error| self.damaged(error))?;
        if !matches!(line, Line::End(_)) {
            self.hash(&bytes);
        }
        Ok(line)
    }

    fn hash(&mut self, line: &[u8]) {
        self.hasher.update(line);
        self.hasher.update(b"\n");
    }

    /// Nothing may follow the end, and the hash must be that of the lines before.
    fn finish(mut self, end: &End) -> Result<(), PlanError> {
        let found = self.hasher.finalize().to_hex().to_string();
        if found != end.blake3 {
            return Err(PlanError::Changed {
                path: self.path.to_owned(),
                found,
                stated: end.blake3.clone(),
            });
        }
        let more = self.from.fill_buf().is_ok_and(|rest| !rest.is_empty());
        match more {
            false => Ok(()),
            true => {
                self.number += 1;
                Err(self.damaged("it follows the last one"))
            }
        }
    }
}
