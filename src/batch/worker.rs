//! The worker's side: one asset, built in this process.
//!
//! *Enters:* a [`Job`] as the first line of standard input. *Leaves:* the asset's folder, its cache entry, and [`Event`]s as JSON lines on
//! standard output, of which [`Event::Finished`] is the last. Standard input stays open as a lifeline: where it ends, whoever asked for the work is
//! gone or wants it stopped, and this process removes what is half written and ends.

use super::{cache, limits};
use crate::config::Config;
use crate::export::folder::{mark_swept, remove_all_staging};
use crate::flow::step::FlowStep;
use crate::job;
use crate::observe::Observer;
use crate::outcome::AssetOutcome;
use crate::parallel;
use crate::read;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::{self, BufRead, Read, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime};

/// What a worker is told, beside the paths of input and output, which are arguments because they need not be Unicode.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Job {
    /// Name of the asset.
    pub id: String,
    /// The file as the user wrote it.
    pub given: String,
    /// Its settings.
    pub config: Config,
    /// Lines of `cones.file` that the listed cones stood on, for messages; the configuration does not carry them.
    pub cone_lines: Vec<u32>,
    /// Threads to use, at least 1.
    pub threads: usize,
    /// Cap on memory, bytes; 0: none.
    pub memory: u64,
    /// The plan that it is a part of, by its id.
    pub plan: Option<String>,
    /// The process that wants it.
    pub parent: u32,
    /// How it speaks.
    pub voice: Voice,
}

/// How a worker speaks on standard error and how often it tells of the flow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Voice {
    /// As the command's own option.
    pub quiet: bool,
    /// As the command's own option.
    pub verbose: u8,
    /// JSON instead of text.
    pub json: bool,
    /// With colours.
    pub colours: bool,
    /// Least time between two events of the flow, milliseconds; none: no such events.
    pub steps: Option<u64>,
    /// Tells how long stages and their parts took.
    pub parts: bool,
}

/// What a worker says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Event {
    /// A stage begins.
    Stage {
        /// Its name.
        name: String,
        /// Component, from 0.
        component: usize,
        /// How many there are.
        components: usize,
    },
    /// The flow took a step.
    Step(FlowStep),
    /// A stage, or a part of one, is over.
    Part(Part),
    /// Nothing follows.
    Finished(Box<AssetOutcome>),
}

/// A stretch of work.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    /// What was done.
    pub name: String,
    /// Component, from 0; of stages.
    pub component: Option<usize>,
    /// The thread: 0, one of the pool, from 1, or one beside it.
    pub thread: usize,
    /// When it began, microseconds since 1970.
    pub begin: u64,
    /// How long it took, microseconds.
    pub microseconds: u64,
}

impl Part {
    /// From `begin` until now, in this thread.
    #[must_use]
    pub fn since(name: &str, component: Option<usize>, begin: SystemTime) -> Self {
        // A clock that was set back in between says nothing.
        let microseconds = |d: Result<Duration, _>| d.map_or(0, |d: Duration| d.as_micros() as u64);
        Self {
            name: name.to_owned(),
            component,
            thread: parallel::thread_number(),
            begin: microseconds(begin.duration_since(SystemTime::UNIX_EPOCH)),
            microseconds: microseconds(begin.elapsed()),
        }
    }
}

/// Reads the job and holds this process to its limits. From here on it ends with whoever asked.
///
/// # Errors
/// Where standard input holds no job, or a limit cannot be set.
pub fn receive() -> io::Result<Job> {
    let mut line = String::new();
    let mut input = io::BufReader::new(io::stdin());
    input.read_line(&mut line)?;
    let job: Job = serde_json::from_slice(line.as_bytes())?;
    if !limits::die_with(job.parent) {
        return Err(io::Error::other("the process that wants this work is gone"));
    }
    limits::cap_memory(job.memory)?;
    std::thread::Builder::new()
        .name("lifeline".into())
        .stack_size(64 << 10)
        .spawn(move || {
            // Nothing is ever sent: reading ends when the other side does.
            let _ = io::copy(&mut input.by_ref(), &mut io::sink());
            ENDING.store(true, Ordering::SeqCst);
            remove_all_staging();
            std::process::exit(130);
        })?;
    Ok(job)
}

/// The lifeline has ended: staging folders vanish under the job, whose outcome is of no interest any more.
static ENDING: AtomicBool = AtomicBool::new(false);

/// Says something. Where nobody listens any more the lifeline ends this process.
pub fn send(event: &Event) {
    if let Ok(mut line) = serde_json::to_vec(event) {
        line.push(b'\n');
        let mut out = io::stdout().lock();
        let _ = out.write_all(&line).and_then(|()| out.flush());
    }
}

/// Does the job: builds the asset at `path` into `output` and leaves a cache entry.
#[must_use]
pub fn work(job: &Job, path: &Path, output: &Path) -> AssetOutcome {
    // The batch has done it.
    mark_swept(output);
    let mut config = job.config.clone();
    config.cones.file_lines.clone_from(&job.cone_lines);
    let before = read::fingerprint(path).ok();
    let told = Told::new(job);
    let run = || job::run(path, &job.given, output, &job.id, &config, &told);
    let mut outcome = parallel::inside(run);
    while ENDING.load(Ordering::SeqCst) {
        // What failed may have failed because its files were removed. The lifeline ends this process.
        std::thread::park();
    }
    told.leave_all();
    outcome.look_for_older(output);
    outcome.peak_memory = limits::peak_memory();
    outcome.host = limits::host();
    let after = read::fingerprint(path).ok();
    match (before, after) {
        (Some(before), Some(after)) if before == after => {
            let plan = job.plan.as_deref();
            let stored = cache::store(output, &before.hash, config.flat(), plan, &outcome);
            if let Err(error) = stored {
                tracing::warn!(asset = job.id, %error, "built, but the next run cannot know it and will build it again");
            }
        }
        // Of which bytes it was built nobody knows: the next run builds it again.
        _ => tracing::info!(asset = job.id, "the input changed while it was read"),
    }
    outcome
}

/// Of an asset of more components not every stage is told, which would take as long as the stages themselves.
const FEW: usize = 16;

/// At least that long passes between two of its stages that are told.
const INTERVAL: Duration = Duration::from_millis(50);

/// Passes on what the job tells, and logs how long each stage took.
struct Told<'j> {
    job: &'j Job,
    /// The stage of each component that is under way.
    stage: Mutex<BTreeMap<usize, (&'static str, SystemTime, Instant)>>,
    step: Mutex<Option<Instant>>,
    /// When a stage was told last.
    heard: Mutex<Option<Instant>>,
}

impl<'j> Told<'j> {
    fn new(job: &'j Job) -> Self {
        Self {
            job,
            stage: Mutex::default(),
            step: Mutex::default(),
            heard: Mutex::default(),
        }
    }

    /// The stage of a component that was under way is over.
    fn leave(&self, component: usize) {
        let mut stages = self.stage.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((name, begin, since)) = stages.remove(&component) {
            if self.job.voice.parts {
                send(&Event::Part(Part::since(name, Some(component), begin)));
            }
            tracing::info!(
                target: "affine_atlas::stages",
                asset = self.job.id,
                stage = name,
                component,
                seconds = since.elapsed().as_secs_f64(),
                "stage finished"
            );
        }
    }
}

impl Told<'_> {
    /// All stages are over.
    fn leave_all(&self) {
        let stages = self.stage.lock().unwrap_or_else(PoisonError::into_inner);
        let under_way: Vec<usize> = stages.keys().copied().collect();
        drop(stages);
        under_way
            .into_iter()
            .for_each(|component| self.leave(component));
    }
}

impl Observer for Told<'_> {
    fn stage(&self, name: &'static str, component: usize, components: usize) {
        self.leave(component);
        let mut stages = self.stage.lock().unwrap_or_else(PoisonError::into_inner);
        stages.insert(component, (name, SystemTime::now(), Instant::now()));
        drop(stages);
        if components > FEW {
            let mut heard = self.heard.lock().unwrap_or_else(PoisonError::into_inner);
            if heard.is_some_and(|heard| heard.elapsed() < INTERVAL) {
                return;
            }
            *heard = Some(Instant::now());
        }
        send(&Event::Stage {
            name: name.to_owned(),
            component,
            components,
        });
    }

    fn finished(&self, component: usize, _: usize) {
        self.leave(component);
    }

    fn flow_step(&self, step: &FlowStep) {
        tracing::debug!(
            target: "affine_atlas::stages",
            asset = self.job.id,
            iteration = step.iteration,
            max_error = step.max_error,
            energy = step.energy,
            step = step.step,
            flips = step.flips,
            "flow step"
        );
        let Some(interval) = self.job.voice.steps else {
            return;
        };
        let mut last = self.step.lock().unwrap_or_else(PoisonError::into_inner);
        if last.is_none_or(|last| last.elapsed() >= Duration::from_millis(interval)) {
            *last = Some(Instant::now());
            send(&Event::Step(*step));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::{AssetState, ComponentOutcome, Failure, FailureKind, Summary};

    #[test]
    fn jobs_and_events_survive_the_pipe() {
        let mut config = Config::default();
        config.cones.quantum = "1/2".parse().unwrap();
        config.cones.count = Some(6);
        config.patches.max_count = Some(3);
        let job = Job {
            id: "a".into(),
            given: "ä b.obj".into(),
            config,
            cone_lines: vec![3, 4],
            threads: 2,
            memory: 1 << 30,
            plan: Some("00ff".into()),
            parent: 7,
            voice: Voice::default(),
        };
        let line = serde_json::to_string(&job).unwrap();
        assert!(!line.contains('\n'));
        assert_eq!(serde_json::from_str::<Job>(&line).unwrap(), job);
        assert_eq!(
            serde_json::from_str::<Job>(&line).unwrap().config.hash(),
            job.config.hash()
        );

        let summary = Summary {
            vertices: 4,
            faces: 4,
            genus: 0,
            boundary_loops: 0,
            cones: 4,
            cells: Some(6),
            max_curvature_error: 0.1 + 0.2,
            limited_by_float64: true,
            area_distortion: 1e-300,
            folder: "out/a".into(),
        };
        let failure = Failure {
            kind: FailureKind::NotConverged,
            message: "two\nlines".into(),
        };
        let mut outcome = AssetOutcome::whole("a", AssetState::Built, 0.25);
        outcome.peak_memory = Some(1);
        for (index, result) in [Ok(summary), Err(failure.clone())].into_iter().enumerate() {
            outcome.components.push(ComponentOutcome { index, result });
        }
        for event in [
            Event::Stage {
                name: "flow".into(),
                component: 1,
                components: 2,
            },
            Event::Step(FlowStep::default()),
            Event::Part(Part::since("quantise", None, SystemTime::now())),
            Event::Finished(Box::new(outcome)),
            Event::Finished(Box::new(AssetOutcome::failed("a", failure, 1.0))),
        ] {
            let line = serde_json::to_string(&event).unwrap();
            assert!(!line.contains('\n'));
            assert_eq!(serde_json::from_str::<Event>(&line).unwrap(), event);
        }
    }
}
