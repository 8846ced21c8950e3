//! The parent's side of one worker: started, listened to, ended in time, and what became of it put in words.
//!
//! *Enters:* a task. *Leaves:* [`Message`]s while it runs, and an [`AssetOutcome`] once it has ended, whatever ended it. Memory that
//! ran out, time that ran out and a crash are told apart by what the worker said last, by its exit status, and by whether it was this
//! program that ended it.

use super::limits;
use super::task::Task;
use super::worker::{Event, Job, Voice};
use crate::config::Limit;
use crate::outcome::{AssetOutcome, AssetState, Failure, FailureKind};
use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::Sender;
use std::time::{Duration, Instant};

/// Most heaps of a process, where the C library is that of GNU.
const HEAPS: &str = "MALLOC_ARENA_MAX";
/// There, from how many bytes on what is freed goes back to the system, and how many a worker has. Unless it is set, glibc raises it by itself up to 32 MiB, and arrays of
/// tens of megabytes leave holes: a tenth of the largest jobs' memory.
const RETURNED: (&str, usize) = ("MALLOC_MMAP_THRESHOLD_", 8 << 20);
/// There, how many free bytes at its end a heap keeps. With that above, each of the many small parts of an asset would ask the system for its memory and give it back: a
/// tenth of their time.
const KEPT: (&str, usize) = ("MALLOC_TRIM_THRESHOLD_", 16 << 20);

/// How a worker is started.
#[derive(Clone, Copy, Debug)]
pub struct Start<'a> {
    /// The program, and the arguments that make it a worker; the paths of input and output follow.
    pub program: &'a Path,
    /// See `program`.
    pub arguments: &'a [&'a str],
    /// The output root.
    pub output: &'a Path,
    /// The plan that is carried out, by its id.
    pub plan: Option<&'a str>,
    /// Threads of the worker, at least 1.
    pub threads: usize,
    /// Most memory that it may take, bytes; none: any.
    pub memory: Option<u64>,
    /// How it speaks.
    pub voice: Voice,
}

/// What comes from a worker; the number is its task's.
#[derive(Debug)]
pub enum Message {
    /// It said something.
    Event(usize, Event),
    /// A line on its standard error.
    Said(usize, String),
    /// One of its two outputs ended.
    Closed(usize),
}

/// A worker that runs.
pub struct Process {
    task: usize,
    id: String,
    child: Child,
    lifeline: Option<ChildStdin>,
    started: Instant,
    timeout: Option<Duration>,
    memory: Option<u64>,
    /// Whether `memory` is this process's share, and not a number that somebody asked for.
    is_share: bool,
    open: usize,
    stage: String,
    outcome: Option<AssetOutcome>,
    last_words: Option<String>,
    ended_by_us: Option<End>,
    ended_for_memory_before: Option<u64>,
}

/// Why this program ended a worker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// It took too long.
    Timeout,
    /// The user stopped the run.
    Cancelled,
}

/// The signal that ends a process whose file grows beyond its limit.
#[cfg(unix)]
const FILE_TOO_LARGE: Option<i32> = Some(rustix::process::Signal::XFSZ.as_raw());
#[cfg(not(unix))]
const FILE_TOO_LARGE: Option<i32> = None;

/// What the runtime says before it ends a process for want of memory.
const NO_MEMORY: &str = "memory allocation of ";
const NO_STACK: &str = "has overflowed its stack";

impl Process {
    /// Starts a worker for a task. To be called from a thread that lives as long as the run: the worker dies with it.
    ///
    /// # Errors
    /// Where the system starts no process or no thread.
    pub fn start(
        start: &Start<'_>,
        number: usize,
        task: &Task,
        to: &Sender<Message>,
    ) -> io::Result<Self> {
        let mut config = task.settings.config.clone();
        let is_share = config.run.memory == Limit::Auto;
        // Paths need not be Unicode, and the worker has its own as arguments. Cones and features are in their lists already.
        config.input = Default::default();
        config.output = config.output.anywhere();
        let files = [&mut config.cones.file, &mut config.features.file];
        for file in files.into_iter().flatten() {
            *file = file.to_string_lossy().into_owned().into();
        }
        let job = Job {
            id: task.id.clone(),
            given: task.given.to_string_lossy().into_owned(),
            cone_lines: config.cones.file_lines.clone(),
            config,
            threads: start.threads,
            memory: start.memory.unwrap_or(0),
            plan: start.plan.map(str::to_owned),
            parent: std::process::id(),
            voice: start.voice,
        };
        let mut line = serde_json::to_vec(&job)?;
        line.push(b'\n');
        let mut command = Command::new(start.program);
        command
            .args(start.arguments)
            .arg("--")
            .arg(&task.path)
            .arg(start.output)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        // By default glibc keeps eight heaps a core, and what one has freed no other uses: a seventh of the largest jobs' memory.
        if std::env::var_os(HEAPS).is_none() {
            command.env(HEAPS, job.threads.to_string());
        }
        for (name, bytes) in [RETURNED, KEPT] {
            if std::env::var_os(name).is_none() {
                command.env(name, bytes.to_string());
            }
        }
        // A group of its own, so that Ctrl-C reaches this program alone, which then stops its workers in order.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let ended_for_memory_before = limits::processes_ended_for_memory();
        let mut child = command.spawn()?;
        let mut process = Self {
            task: number,
            id: task.id.clone(),
            lifeline: child.stdin.take(),
            started: Instant::now(),
            timeout: task.time_limit(),
            memory: start.memory,
            is_share,
            open: 0,
            stage: String::new(),
            outcome: None,
            last_words: None,
            ended_by_us: None,
            ended_for_memory_before,
            child,
        };
        let listening = process.listen(to);
        if let Err(error) = listening {
            process.kill();
            let _ = process.child.wait();
            return Err(error);
        }
        if let Some(lifeline) = &mut process.lifeline {
            // A worker that is gone already tells by its exit status.
            let _ = lifeline.write_all(&line).and_then(|()| lifeline.flush());
        }
        Ok(process)
    }

    fn listen(&mut self, to: &Sender<Message>) -> io::Result<()> {
        let task = self.task;
        if let Some(out) = self.child.stdout.take() {
            let event = move |line: String| {
                let event = serde_json::from_slice(line.as_bytes()).ok()?;
                Some(Message::Event(task, event))
            };
            forward(out, to.clone(), task, event)?;
            self.open += 1;
        }
        if let Some(out) = self.child.stderr.take() {
            forward(out, to.clone(), task, move |line| {
                Some(Message::Said(task, line))
            })?;
            self.open += 1;
        }
        Ok(())
    }

    /// Its process number.
    #[must_use]
    pub fn number(&self) -> u32 {
        self.child.id()
    }

    /// When it must have ended; none where it may take as long as it likes.
    #[must_use]
    pub fn deadline(&self) -> Option<Instant> {
        let timeout = self.timeout.filter(|_| self.ended_by_us.is_none());
        timeout.and_then(|timeout| self.started.checked_add(timeout))
    }

    /// Notes an event.
    pub fn hear(&mut self, event: &Event) {
        match event {
            Event::Stage { name, .. } => self.stage.clone_from(name),
            Event::Step(_) | Event::Part(_) => {}
            Event::Finished(outcome) => self.outcome = Some((**outcome).clone()),
        }
    }

    /// Notes a line of its standard error, and says whether it is one for the user.
    pub fn overhear(&mut self, line: &str) -> bool {
        if line.starts_with(NO_MEMORY) || line.contains(NO_STACK) {
            self.last_words = Some(line.to_owned());
            return false;
        }
        // What the runtime says around it.
        !(self.last_words.is_some()
            || line.trim().is_empty()
            || line.starts_with("fatal runtime error"))
    }

    /// Notes that one of its outputs ended; true where both have.
    pub fn closed(&mut self) -> bool {
        self.open = self.open.saturating_sub(1);
        self.open == 0
    }

    /// Asks it to stop: it removes what is half written.
    pub fn ask_to_stop(&mut self) {
        self.ended_by_us = Some(End::Cancelled);
        self.lifeline = None;
    }

    /// Ends it at once.
    pub fn end(&mut self, why: End) {
        self.ended_by_us.get_or_insert(why);
        self.kill();
    }

    fn kill(&mut self) {
        if let Err(error) = self.child.kill() {
            tracing::warn!(asset = self.id, %error, "a worker could not be ended");
        }
    }

    /// What became of the asset. Waits for the process, whose outputs have ended. `stopping` says whether the whole run is being
    /// stopped, and is asked only where somebody else asked this process to end. The flag says whether it ended in good order, so
    /// that nothing of it can be left behind.
    pub fn conclude(mut self, output: &Path, stopping: &dyn Fn() -> bool) -> (AssetOutcome, bool) {
        let status = self.child.wait();
        let seconds = self.started.elapsed().as_secs_f64();
        if let Some(outcome) = self.outcome.take() {
            return (outcome, true);
        }
        let state = match self.ended_by_us {
            Some(End::Cancelled) => AssetState::Cancelled,
            Some(End::Timeout) => AssetState::Failed(self.took_too_long()),
            None if asked_to_end(status.as_ref().ok()) && stopping() => AssetState::Cancelled,
            None => AssetState::Failed(self.crashed(status.ok())),
        };
        let mut outcome = AssetOutcome::whole(&self.id, state, seconds);
        outcome.look_for_older(output);
        (outcome, false)
    }

    fn during(&self) -> String {
        match self.stage.as_str() {
            "" => "before its first stage".to_owned(),
            stage => format!("in the stage `{stage}`"),
        }
    }

    fn took_too_long(&self) -> Failure {
        Failure {
            kind: FailureKind::Timeout,
            message: format!(
                "was not finished after the {} s of run.timeout ({}): raise run.timeout, or decimate the mesh",
                self.timeout.unwrap_or_default().as_secs(),
                self.during()
            ),
        }
    }

    fn crashed(&self, status: Option<ExitStatus>) -> Failure {
        let during = self.during();
        let signal = status.and_then(signal_of);
        let ended_for_memory = match (
            self.ended_for_memory_before,
            limits::processes_ended_for_memory(),
        ) {
            (Some(before), Some(after)) => after > before,
            _ => false,
        };
        let words = self.last_words.as_deref().unwrap_or_default();
        if words.starts_with(NO_MEMORY) {
            let asked = words.trim_start_matches(NO_MEMORY);
            let asked = asked.split_whitespace().next().unwrap_or_default();
            return match self.memory {
                None => no_memory(format!(
                    "found no memory for {asked} bytes more {during}: let fewer run at a time (run.jobs, run.total_memory), or decimate the mesh"
                )),
                // How many bytes more it asked for depends on threads and on what else the heap holds: records are to be the same on every machine.
                Some(share) if self.is_share => no_memory(format!(
                    "needed more than the {share} bytes that are its share of the memory that was free ({during}): let fewer run at a time (run.jobs), set run.memory, ask for fewer cells (grid.cells) or texels (patches.texel_budget), or decimate the mesh"
                )),
                Some(cap) => no_memory(format!(
                    "needed more than the {cap} bytes of run.memory ({during}): raise run.memory, ask for fewer cells (grid.cells) or texels (patches.texel_budget), or decimate the mesh"
                )),
            };
        }
        // One that did not get as far as to take its job: there was no memory for its first thread, or for the program.
        if let (Some(cap), Some(2 | 127)) = (self.memory, status.and_then(|status| status.code())) {
            return no_memory(match self.is_share {
                true => format!(
                    "could not begin within the {cap} bytes that are its share of the memory that was free: let fewer run at a time (run.jobs), or set run.memory"
                ),
                false => format!(
                    "could not begin within the {cap} bytes of run.memory: raise run.memory"
                ),
            });
        }
        if signal == Some(9) && ended_for_memory {
            return no_memory(format!(
                "was ended by the system, whose memory ran out, {during}: let fewer run at a time (run.jobs, run.total_memory), or decimate the mesh"
            ));
        }
        if signal.is_some_and(|signal| Some(signal) == FILE_TOO_LARGE) {
            return Failure {
                kind: FailureKind::Output,
                message: format!(
                    "could not be written: a file grew beyond the largest that this process may write, {during}: raise that limit (`ulimit -f`), or lower patches.texel_budget"
                ),
            };
        }
        let report = "this is a mistake of affine-atlas and not of your mesh: please report it with the mesh and the configuration";
        let message = match (signal, status.and_then(|status| status.code())) {
            _ if words.contains(NO_STACK) => {
                format!("internal error: stack overflow {during}; {report}")
            }
            (Some(9), _) => format!(
                "its process was killed from outside (signal 9) {during}: run the same command again"
            ),
            (Some(15 | 2 | 1), _) => format!(
                "its process was ended from outside (signal {}) {during}: run the same command again",
                signal.unwrap_or_default()
            ),
            (Some(signal), _) => {
                format!("internal error: its process crashed (signal {signal}) {during}; {report}")
            }
            (None, code) => format!(
                "internal error: its process ended without a result (exit code {}) {during}; {report}",
                code.unwrap_or(-1)
            ),
        };
        Failure {
            kind: FailureKind::Internal,
            message,
        }
    }
}

fn no_memory(message: String) -> Failure {
    Failure {
        kind: FailureKind::Memory,
        message,
    }
}

/// Whether a signal asked it to end that is no crash: hang up, interrupt, terminate.
fn asked_to_end(status: Option<&ExitStatus>) -> bool {
    matches!(
        status.and_then(|&status| signal_of(status)),
        Some(1 | 2 | 15)
    )
}

#[cfg(unix)]
fn signal_of(status: ExitStatus) -> Option<i32> {
    std::os::unix::process::ExitStatusExt::signal(&status)
}

#[cfg(not(unix))]
fn signal_of(_: ExitStatus) -> Option<i32> {
    None
}

/// Sends what each line of a stream means, and at last that it ended.
fn forward(
    stream: impl Read + Send + 'static,
    to: Sender<Message>,
    task: usize,
    meaning: impl Fn(String) -> Option<Message> + Send + 'static,
) -> io::Result<()> {
    let run = move || {
        let mut reader = BufReader::new(stream);
        let mut line = Vec::new();
        while reader
            .read_until(b'\n', &mut line)
            .is_ok_and(|read| read > 0)
        {
            let text = String::from_utf8_lossy(&line);
            if let Some(message) = meaning(text.trim_end_matches(['\n', '\r']).to_owned())
                && to.send(message).is_err()
            {
                return;
            }
            line.clear();
        }
        let _ = to.send(Message::Closed(task));
    };
    let thread = std::thread::Builder::new().stack_size(256 << 10);
    thread.spawn(run).map(drop)
}
