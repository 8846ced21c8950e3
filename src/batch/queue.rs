//! Which task runs when: largest first, at most `jobs` at a time, within the memory of the machine.
//!
//! *Enters:* tasks. *Leaves:* an outcome a task, in the order of the tasks, each written down as soon as it is there. What an earlier run
//! left whole is not built again. The order in which tasks run has no influence on any output but records and logs.
//!
//! One thread starts all workers, listens to all of them and waits for them: they die with that thread. What it holds of an asset that is done is
//! its outcome without its list of files.

use super::cache::{self, Demand, Verdict};
use super::process::{End, Message, Process, Start};
use super::records::{Recorder, Recording, ShardRecorder};
use super::shard::Shard;
use super::task::Task;
use super::worker::{Event, Voice};
use super::{limits, log_path};
use crate::export::ExportError;
use crate::export::folder::{mark_swept, sweep_stale};
use crate::export::manifest::Manifest;
use crate::outcome::{AssetOutcome, AssetState, Failure, FailureKind};
use crate::parallel;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How often a request to stop is looked for.
const GLANCE: Duration = Duration::from_millis(50);
/// Assets that are looked at together.
const PART: usize = 128;
/// Time that workers get to clear up when the run is stopped.
const PATIENCE: Duration = Duration::from_secs(4);
/// An engine that stops a run may signal this process and its workers alike: the request may come so much later than a worker's end.
const TOGETHER: Duration = Duration::from_millis(300);

/// Where and how tasks are done.
#[derive(Clone, Debug)]
pub struct Batch<'a> {
    /// The output root.
    pub output: &'a Path,
    /// The program, and the arguments that make it a worker.
    pub program: PathBuf,
    /// See `program`.
    pub arguments: &'a [&'a str],
    /// Build also what is whole.
    pub force: bool,
    /// The plan that is carried out, by its id: what it has built is not built again, also with `force`.
    pub plan: Option<&'a str>,
    /// Most workers at a time; 0: one a core.
    pub jobs: usize,
    /// Memory of all workers together, bytes; 0: what the machine has left when the run begins.
    pub total_memory: u64,
    /// Threads of each worker; none: as the task's settings say.
    pub threads: Option<usize>,
    /// How workers speak.
    pub voice: Voice,
}

/// Watches a batch. Numbers are those of the tasks.
pub trait Watcher: Sync {
    /// It is known what must be built: these tasks.
    fn begin(&self, _tasks: &[Task], _to_build: &[usize]) {}
    /// A worker said something.
    fn event(&self, _task: usize, _event: &Event) {}
    /// A line on a worker's standard error.
    fn said(&self, _task: usize, _line: &str) {}
    /// An asset is done with.
    fn finished(&self, _task: usize, _outcome: &AssetOutcome) {}
    /// True where the run should stop.
    fn cancelled(&self) -> bool {
        false
    }
}

impl Watcher for () {}

/// Looks what must be built, without building it: a verdict a task.
#[must_use]
pub fn decide(batch: &Batch<'_>, tasks: &[Task], known: &Manifest) -> Vec<Verdict> {
    let demand = Demand {
        force: batch.force,
        plan: batch.plan,
    };
    parallel::map(tasks, |_, task| {
        cache::check(batch.output, task, known.get(&task.id), demand)
    })
}

/// Does all tasks, each in a process of its own, and writes down in the manifest what became of them. To be called from a thread that
/// lives until the program ends.
///
/// # Errors
/// Where the output root cannot be written, then nothing was done; or the manifest cannot, then outcomes are there all the same.
pub fn run(
    batch: &Batch<'_>,
    tasks: &[Task],
    watcher: &dyn Watcher,
) -> (Vec<AssetOutcome>, Result<(), ExportError>) {
    match Recorder::begin(batch.output) {
        Ok(mut recorder) => {
            let outcomes = do_all(batch, tasks, watcher, &mut recorder);
            (outcomes, recorder.finish())
        }
        // Where this cannot be written no atlas can: thousands of them need not be computed to find out.
        Err(error) => (Vec::new(), Err(error)),
    }
}

/// The same for a shard of a plan, whose tasks these are: what became of them is written into a file of its own, for
/// [`merge`](super::merge).
///
/// # Errors
/// As [`run`], for that file in place of the manifest.
pub fn run_shard(
    batch: &Batch<'_>,
    plan: &str,
    shard: Shard,
    tasks: &[Task],
    watcher: &dyn Watcher,
) -> (Vec<AssetOutcome>, Result<(), ExportError>) {
    let batch = Batch {
        plan: Some(plan),
        ..batch.clone()
    };
    match ShardRecorder::begin(batch.output, plan, shard) {
        Ok(mut recorder) => {
            let outcomes = do_all(&batch, tasks, watcher, &mut recorder);
            (outcomes, recorder.finish())
        }
        Err(error) => (Vec::new(), Err(error)),
    }
}

fn do_all(
    batch: &Batch<'_>,
    tasks: &[Task],
    watcher: &dyn Watcher,
    recorder: &mut dyn Recording,
) -> Vec<AssetOutcome> {
    if let Err(error) = sweep_stale(batch.output) {
        tracing::debug!(%error, "nothing to clear up");
    }
    // Nothing to clear up is no trouble.
    let _ = sweep_stale(&super::private_folder(batch.output).join("cache"));
    mark_swept(batch.output);
    let _ = std::fs::create_dir_all(batch.output.join("logs"));
    let (sender, receiver) = channel();
    let mut queue = Queue {
        batch,
        tasks,
        watcher,
        waiting: VecDeque::new(),
        running: BTreeMap::new(),
        sender,
        outcomes: tasks.iter().map(|_| None).collect(),
        jobs: 1,
        free: None,
    };
    let mut to_build = Vec::new();
    // In parts, so that what is known of thousands of assets is never in memory at once. Reasons are of no interest here, so the manifest need
    // not be read.
    for (part, some) in tasks.chunks(PART).enumerate() {
        let verdicts = decide(batch, some, &Manifest::default());
        for (number, verdict) in (part * PART..).zip(verdicts) {
            match verdict {
                Verdict::Cached(outcome) => queue.done(number, *outcome, recorder),
                Verdict::Build(_) => to_build.push(number),
            }
        }
    }
    to_build.sort_by_key(|&number| (std::cmp::Reverse(tasks[number].cost), number));
    watcher.begin(tasks, &to_build);
    queue.jobs = match batch.jobs {
        0 => limits::cores(),
        jobs => jobs,
    };
    queue.jobs = queue.jobs.clamp(1, to_build.len().max(1));
    queue.free = match batch.total_memory {
        0 => limits::available_memory(),
        bytes => Some(bytes),
    };
    queue.waiting = to_build.into();
    queue.work(&receiver, recorder);
    let missing = |task: &Task| AssetOutcome::whole(&task.id, AssetState::Cancelled, 0.0);
    let outcomes = queue.outcomes.into_iter().zip(tasks);
    let outcomes = outcomes.map(|(outcome, task)| outcome.unwrap_or_else(|| missing(task)));
    outcomes.collect()
}

struct Queue<'a> {
    batch: &'a Batch<'a>,
    tasks: &'a [Task],
    watcher: &'a dyn Watcher,
    waiting: VecDeque<usize>,
    running: BTreeMap<usize, Process>,
    sender: Sender<Message>,
    outcomes: Vec<Option<AssetOutcome>>,
    jobs: usize,
    /// Memory for all processes together, where it is known.
    free: Option<u64>,
}

impl Queue<'_> {
    fn work(&mut self, receiver: &Receiver<Message>, recorder: &mut dyn Recording) {
        let mut stopping: Option<Instant> = None;
        loop {
            if stopping.is_none() && self.watcher.cancelled() {
                stopping = Some(Instant::now());
                for process in self.running.values_mut() {
                    process.ask_to_stop();
                }
                while let Some(number) = self.waiting.pop_front() {
                    let mut outcome =
                        AssetOutcome::whole(&self.tasks[number].id, AssetState::Cancelled, 0.0);
                    outcome.look_for_older(self.batch.output);
                    self.done(number, outcome, recorder);
                }
            }
            while self.may_start() {
                self.start_next(recorder);
            }
            if self.running.is_empty() && self.waiting.is_empty() {
                return;
            }
            match receiver.recv_timeout(GLANCE) {
                Ok(Message::Event(number, event)) => {
                    if let Some(process) = self.running.get_mut(&number) {
                        process.hear(&event);
                    }
                    self.watcher.event(number, &event);
                }
                Ok(Message::Said(number, line)) => {
                    let process = self.running.get_mut(&number);
                    if process.is_some_and(|process| process.overhear(&line)) {
                        self.watcher.said(number, &line);
                    }
                }
                Ok(Message::Closed(number)) => {
                    let last = self.running.get_mut(&number).is_some_and(Process::closed);
                    if last && let Some(process) = self.running.remove(&number) {
                        self.conclude(number, process, recorder);
                    }
                }
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {}
            }
            let now = Instant::now();
            let hopeless = stopping.is_some_and(|since| now - since > PATIENCE);
            for process in self.running.values_mut() {
                if hopeless {
                    process.end(End::Cancelled);
                } else if process.deadline().is_some_and(|deadline| now >= deadline) {
                    process.end(End::Timeout);
                }
            }
        }
    }

    /// The next one may start where a place is free and its memory fits; one alone always may.
    fn may_start(&self) -> bool {
        let Some(&next) = self.waiting.front() else {
            return false;
        };
        if self.running.is_empty() {
            return true;
        }
        let taken = self
            .running
            .keys()
            .map(|&number| self.tasks[number].memory());
        let taken = taken.fold(0, u64::saturating_add);
        self.running.len() < self.jobs
            && taken.saturating_add(self.tasks[next].memory()) <= self.free.unwrap_or(u64::MAX)
    }

    fn start_next(&mut self, recorder: &mut dyn Recording) {
        let Some(number) = self.waiting.pop_front() else {
            return;
        };
        let task = &self.tasks[number];
        let threads = match self
            .batch
            .threads
            .unwrap_or(task.settings.config.run.threads)
        {
            0 => (limits::cores() / self.jobs).max(1),
            given => given,
        };
        let start = Start {
            program: &self.batch.program,
            arguments: self.batch.arguments,
            output: self.batch.output,
            plan: self.batch.plan,
            threads,
            memory: task.memory_limit(self.free, self.jobs),
            voice: self.batch.voice,
        };
        match Process::start(&start, number, task, &self.sender) {
            Ok(process) => {
                WORKERS
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .insert(process.number());
                self.running.insert(number, process);
            }
            Err(error) => {
                let failure = Failure {
                    kind: FailureKind::Internal,
                    message: format!(
                        "no process could be started for it: {error}; let fewer run at a time (run.jobs)"
                    ),
                };
                let mut outcome = AssetOutcome::failed(&task.id, failure, 0.0);
                outcome.look_for_older(self.batch.output);
                self.done(number, outcome, recorder);
            }
        }
    }

    fn conclude(&mut self, number: usize, process: Process, recorder: &mut dyn Recording) {
        let worker = process.number();
        let stopping = || {
            let since = Instant::now();
            while !self.watcher.cancelled() {
                if since.elapsed() > TOGETHER {
                    return false;
                }
                std::thread::sleep(GLANCE / 10);
            }
            true
        };
        let (outcome, in_order) = process.conclude(self.batch.output, &stopping);
        WORKERS
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .remove(&worker);
        if !in_order {
            if let Err(error) = sweep_stale(self.batch.output) {
                tracing::warn!(%error, "could not clear up after a worker");
            }
            self.log_end(&outcome);
        }
        self.done(number, outcome, recorder);
    }

    /// A worker that did not end by itself could not write the last line of its log.
    fn log_end(&self, outcome: &AssetOutcome) {
        let path = log_path(self.batch.output, &outcome.id);
        let failure = outcome.failures().next().map(|(_, failure)| failure);
        let line = serde_json::json!({
            "level": "ERROR",
            "asset": outcome.id,
            "state": outcome.state_name(),
            "kind": failure.map(|failure| failure.kind.name()),
            "seconds": outcome.seconds,
            "message": failure.map_or("stopped", |failure| failure.message.as_str()),
        });
        let file = std::fs::OpenOptions::new()
            .append(true)
            .create(true)
            .open(path);
        let _ = file.and_then(|mut file| file.write_all(format!("{line}\n").as_bytes()));
    }

    fn done(&mut self, number: usize, mut outcome: AssetOutcome, recorder: &mut dyn Recording) {
        let task = &self.tasks[number];
        recorder.record(task, &outcome);
        self.watcher.finished(number, &outcome);
        // They are written down; thousands of assets would fill memory with them.
        outcome.files = Vec::new();
        self.outcomes[number] = Some(outcome);
    }
}

/// Process numbers of all workers that run.
static WORKERS: Mutex<BTreeSet<u32>> = Mutex::new(BTreeSet::new());

/// Ends all workers at once and waits for a moment until they are gone, for a user who will not wait. What they leave half written is for
/// [`sweep_stale`].
pub fn end_workers() {
    let workers = WORKERS
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .clone();
    #[cfg(unix)]
    for &worker in &workers {
        let number = i32::try_from(worker)
            .ok()
            .and_then(rustix::process::Pid::from_raw);
        if let Some(number) = number {
            let _ = rustix::process::kill_process(number, rustix::process::Signal::KILL);
        }
    }
    for _ in 0..100 {
        if workers
            .iter()
            .all(|&worker| crate::export::folder::process_has_ended(worker))
        {
            return;
        }
        std::thread::sleep(Duration::from_millis(10));
    }
}
