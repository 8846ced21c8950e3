//! The queue with workers that only pretend, written as shell scripts.
#![cfg(unix)]

use super::process::{Message, Process, Start};
use super::records::shard::read;
use super::shard::Shard;
use super::task::Settings;
use super::worker::Voice;
use super::{Batch, Task, Watcher, run, run_shard};
use crate::config::{Config, Limit};
use crate::outcome::{AssetOutcome, AssetState, FailureKind};
use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Of this size, with this memory cap and timeout; 0 for none.
fn task(id: &str, cost: u64, memory: u64, timeout: u64) -> Task {
    let mut config = Config::default();
    let limit = |amount| match amount {
        0 => Limit::Off,
        amount => Limit::At(amount),
    };
    config.run.memory = limit(memory);
    config.run.timeout = limit(timeout);
    let settings = Arc::new(Settings::new(config));
    Task {
        id: id.into(),
        path: id.into(),
        given: id.into(),
        input_hash: Some(id.into()),
        config_hash: settings.hash.clone(),
        cost,
        files: Vec::new(),
        settings,
    }
}

/// Says that it has built `$1`, after noting its start and end.
const BUILDS: &str = r#"read job; echo "+$1" >> "$2/trace"; sleep 0.1; echo "-$1" >> "$2/trace"
echo '{"event":"finished","id":"'$1'","state":"built","components":[],"seconds":0.1,"files":[],"input_hash":null,"notes":[]}'"#;

struct Ran {
    outcomes: Vec<AssetOutcome>,
    trace: Vec<String>,
    root: tempfile::TempDir,
}

fn play(
    script: &str,
    tasks: &[Task],
    change: impl Fn(&mut Batch<'_>),
    watcher: &dyn Watcher,
) -> Ran {
    let root = tempfile::tempdir().unwrap();
    let arguments = ["-c", script];
    let mut batch = Batch {
        output: root.path(),
        program: "/bin/sh".into(),
        arguments: &arguments,
        force: false,
        plan: None,
        jobs: 1,
        total_memory: 0,
        threads: None,
        voice: Voice::default(),
    };
    change(&mut batch);
    let (outcomes, recorded) = run(&batch, tasks, watcher);
    recorded.unwrap();
    let trace = fs::read_to_string(root.path().join("trace")).unwrap_or_default();
    Ran {
        outcomes,
        trace: trace.lines().map(str::to_owned).collect(),
        root,
    }
}

/// Most workers at a time.
fn most_at_once(trace: &[String]) -> i32 {
    let steps = trace
        .iter()
        .map(|line| if line.starts_with('+') { 1 } else { -1 });
    let counts = steps.scan(0, |now, step| {
        *now += step;
        Some(*now)
    });
    counts.max().unwrap_or(0)
}

#[test]
fn the_largest_comes_first_and_outcomes_keep_their_order() {
    let tasks = [
        task("small", 1, 0, 0),
        task("large", 9, 0, 0),
        task("middle", 5, 0, 0),
    ];
    let ran = play(BUILDS, &tasks, |_| {}, &());
    assert_eq!(
        ran.trace,
        ["+large", "-large", "+middle", "-middle", "+small", "-small"]
    );
    let ids: Vec<&str> = ran.outcomes.iter().map(|o| o.id.as_str()).collect();
    assert_eq!(ids, ["small", "large", "middle"]);
    assert!(ran.outcomes.iter().all(|o| o.state == AssetState::Built));
    let manifest = fs::read_to_string(ran.root.path().join("manifest.jsonl")).unwrap();
    assert_eq!(manifest.lines().count(), 3);
}

#[test]
fn jobs_and_memory_bound_how_many_run() {
    let tasks: Vec<Task> = (0..6).map(|i| task(&format!("a{i}"), 1, 100, 0)).collect();
    let at_once = |jobs, total_memory| {
        let ran = play(
            BUILDS,
            &tasks,
            |batch| (batch.jobs, batch.total_memory) = (jobs, total_memory),
            &(),
        );
        assert_eq!(ran.trace.len(), 12);
        most_at_once(&ran.trace)
    };
    assert_eq!(at_once(3, 1000), 3);
    assert_eq!(at_once(6, 250), 2);
    // One that would never fit is tried alone.
    assert_eq!(at_once(6, 50), 1);
}

#[test]
fn without_settings_the_machine_is_protected() {
    let task = |cost, memory, timeout| {
        let mut task = task("a", cost, 0, 0);
        let mut config = Config::default();
        (config.run.memory, config.run.timeout) = (memory, timeout);
        task.settings = Arc::new(Settings::new(config));
        task
    };
    let auto = task(1 << 20, Limit::Auto, Limit::Auto);
    // Its share, but never less than what it may well need, and nothing where the system does not tell.
    assert_eq!(auto.memory_limit(Some(64 << 30), 4), Some(16 << 30));
    assert_eq!(auto.memory_limit(Some(1 << 20), 4), Some(2 * auto.memory()));
    assert_eq!(auto.memory_limit(None, 4), None);
    let seconds = auto.time_limit().unwrap().as_secs();
    assert!((900..3_600).contains(&seconds), "{seconds}");
    let large = task(1 << 30, Limit::Auto, Limit::Auto);
    assert!(large.time_limit().unwrap().as_secs() > 100 * seconds);
    let off = task(1, Limit::Off, Limit::Off);
    assert_eq!(off.memory_limit(Some(1 << 30), 1), None);
    assert_eq!(off.time_limit(), None);
    let given = task(1, Limit::At(5), Limit::At(7));
    assert_eq!(given.memory_limit(Some(1 << 30), 1), Some(5));
    assert_eq!(given.time_limit().unwrap().as_secs(), 7);
}

#[test]
fn every_end_has_its_kind_and_the_others_go_on() {
    let script = format!(
        r#"case $1 in
        segv) read job; echo '{{"event":"stage","name":"flow","component":0,"components":1}}'; kill -SEGV $$;;
        kill) read job; kill -KILL $$;;
        allocation) read job; echo 'memory allocation of 77 bytes failed' >&2; kill -ABRT $$;;
        stack) echo "thread 'main' has overflowed its stack" >&2; kill -ABRT $$;;
        slow) read job; exec sleep 30;;
        silent) exit 3;;
        grown) read job; kill -XFSZ $$;;
        garbage) echo 'no JSON'; echo '{{"event":"finished"}}'; exit 0;;
        *) {BUILDS};;
        esac"#
    );
    let names = [
        "segv",
        "kill",
        "allocation",
        "capped allocation",
        "stack",
        "slow",
        "silent",
        "grown",
        "garbage",
        "good",
    ];
    let tasks: Vec<Task> = names
        .iter()
        .map(|&name| {
            let cap = if name.starts_with("capped") {
                1 << 40
            } else {
                0
            };
            let mut task = task(name, 1, cap, if name == "slow" { 1 } else { 0 });
            task.path = name.trim_start_matches("capped ").into();
            task
        })
        .collect();
    let ran = play(&script, &tasks, |batch| batch.jobs = 4, &());
    let of = |id: &str| {
        let outcome = ran.outcomes.iter().find(|o| o.id == id).unwrap();
        let failure = outcome
            .failures()
            .next()
            .map(|(_, failure)| failure.clone());
        failure.unwrap_or_else(|| panic!("{id} did not fail"))
    };
    for (id, kind, words) in [
        (
            "segv",
            FailureKind::Internal,
            "crashed (signal 11) in the stage `flow`",
        ),
        (
            "kill",
            FailureKind::Internal,
            "killed from outside (signal 9) before its first stage",
        ),
        (
            "allocation",
            FailureKind::Memory,
            "no memory for 77 bytes more",
        ),
        ("capped allocation", FailureKind::Memory, "run.memory"),
        ("stack", FailureKind::Internal, "stack overflow"),
        ("slow", FailureKind::Timeout, "the 1 s of run.timeout"),
        ("silent", FailureKind::Internal, "exit code 3"),
        ("grown", FailureKind::Output, "ulimit -f"),
        ("garbage", FailureKind::Internal, "exit code 0"),
    ] {
        let failure = of(id);
        assert_eq!(failure.kind, kind, "{id}: {}", failure.message);
        assert!(failure.message.contains(words), "{id}: {}", failure.message);
        let log = fs::read_to_string(super::log_path(ran.root.path(), id)).unwrap();
        assert!(log.contains(kind.name()), "{log}");
    }
    let good = ran.outcomes.iter().find(|o| o.id == "good").unwrap();
    assert_eq!(good.state, AssetState::Built);
}

/// Stops when the first asset is done.
#[derive(Default)]
struct Stops(AtomicBool);

impl Watcher for Stops {
    fn finished(&self, _: usize, _: &AssetOutcome) {
        self.0.store(true, Ordering::Relaxed);
    }
    fn cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

#[test]
fn a_stopped_run_ends_its_workers_by_their_lifeline() {
    // The last one waits for the end of its input, as every worker does.
    let script = format!("if [ $1 = waits ]; then cat >/dev/null; exit 130; fi; {BUILDS}");
    let tasks = [
        task("first", 5, 0, 0),
        task("waits", 9, 0, 0),
        task("never", 1, 0, 0),
    ];
    let ran = play(&script, &tasks, |batch| batch.jobs = 2, &Stops::default());
    let states: Vec<&str> = ran.outcomes.iter().map(AssetOutcome::state_name).collect();
    assert_eq!(states, ["built", "cancelled", "cancelled"]);
    assert_eq!(ran.trace, ["+first", "-first"]);
}

#[test]
fn a_root_that_cannot_be_written_starts_nothing() {
    let root = tempfile::tempdir().unwrap();
    let file = root.path().join("file");
    fs::write(&file, "mine").unwrap();
    let batch = Batch {
        output: &file,
        program: Path::new("/bin/sh").into(),
        arguments: &["-c", "exit 1"],
        force: false,
        plan: None,
        jobs: 1,
        total_memory: 0,
        threads: None,
        voice: Voice::default(),
    };
    let (outcomes, recorded) = run(&batch, &[task("a", 1, 0, 0)], &());
    assert!(outcomes.is_empty() && recorded.is_err());
}

#[test]
fn a_shard_writes_a_file_of_its_own_and_no_manifest() {
    let root = tempfile::tempdir().unwrap();
    let script = format!(r#"read job; echo "$job" > "$2/job"; {}"#, &BUILDS[10..]);
    let arguments = ["-c", script.as_str()];
    let batch = Batch {
        output: root.path(),
        program: "/bin/sh".into(),
        arguments: &arguments,
        force: true,
        plan: None,
        jobs: 1,
        total_memory: 0,
        threads: None,
        voice: Voice::default(),
    };
    let shard = Shard {
        number: 2,
        count: 3,
    };
    let tasks = [task("a", 1, 0, 0)];
    let (outcomes, recorded) = run_shard(&batch, "p7", shard, &tasks, &());
    recorded.unwrap();
    assert_eq!(outcomes[0].state, AssetState::Built);
    let mut found = Vec::new();
    let attempts = read(root.path(), "p7", |one| found.push(one.outcome.id)).unwrap();
    assert_eq!((attempts.len(), attempts[0].shard), (1, shard));
    assert!(attempts[0].complete);
    assert_eq!(found, ["a"]);
    assert!(!root.path().join("manifest.jsonl").exists());
    // The worker notes for which plan it builds.
    let job = fs::read_to_string(root.path().join("job")).unwrap();
    assert!(job.contains(r#""plan":"p7""#), "{job}");
}

#[test]
fn a_worker_that_an_engine_ends_with_the_run_is_cancelled_and_one_that_is_killed_failed() {
    let root = tempfile::tempdir().unwrap();
    let end = |signal: &str, stopping: bool| {
        let script = format!("read job; kill -{signal} $$");
        // What is run in the background of a script ignores interrupts, and so would the shell.
        let start = Start {
            program: Path::new("/usr/bin/env"),
            arguments: &["--default-signal=INT", "/bin/sh", "-c", &script],
            output: root.path(),
            plan: None,
            threads: 1,
            memory: None,
            voice: Voice::default(),
        };
        let (sender, receiver) = std::sync::mpsc::channel();
        let mut process = Process::start(&start, 0, &task("a", 1, 0, 0), &sender).unwrap();
        while !matches!(receiver.recv().unwrap(), Message::Closed(_)) || !process.closed() {}
        let (outcome, in_order) = process.conclude(root.path(), &|| stopping);
        assert!(!in_order);
        outcome.state_name().to_owned()
    };
    for signal in ["TERM", "INT", "HUP"] {
        assert_eq!(end(signal, true), "cancelled", "{signal}");
        assert_eq!(end(signal, false), "failed", "{signal}");
    }
    for signal in ["KILL", "SEGV", "ABRT"] {
        assert_eq!(end(signal, true), "failed", "{signal}");
    }
}
