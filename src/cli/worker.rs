//! The hidden `worker` command: one mesh, built in this process, as [`super::build`] asks for it through a pipe.

use super::arguments::Worker;
use super::work::Work;
use super::{exit, log, panics};
use affine_atlas::batch::log_path;
use affine_atlas::batch::worker::{self, Event, Job};
use affine_atlas::outcome::{AssetOutcome, Failure, FailureKind};
use std::process::ExitCode;
use std::time::Instant;

/// Bytes of stack of a thread: as many as the first one of a program mostly has.
const STACK: usize = 8 << 20;

/// Does one job and says what became of it. A panic is the mesh's failure like any other.
pub fn run(arguments: &Worker, work: &Work) -> ExitCode {
    let start = Instant::now();
    let job = match worker::receive() {
        Ok(job) => job,
        Err(error) => {
            super::terminal::print_error(&format!(
                "`affine-atlas worker` is for `affine-atlas build` alone: {error}\n"
            ));
            return ExitCode::from(exit::USAGE);
        }
    };
    console::set_colors_enabled_stderr(job.voice.colours);
    let log = log_path(&arguments.output, &job.id);
    if let Err(error) = log::start_worker(&job.voice, &log) {
        tracing::debug!(path = %log.display(), %error, "no log");
    }
    tracing::info!(target: "affine_atlas::stages", asset = job.id, input = job.given, config = job.config.hash(), "begins");
    let outcome = match threads(&job) {
        Ok(()) => {
            let build = || (work.work)(&job, &arguments.input, &arguments.output);
            panics::catch(build).map_err(|message| Failure {
                kind: FailureKind::Internal,
                message,
            })
        }
        Err(failure) => Err(failure),
    };
    let outcome = outcome.unwrap_or_else(|failure| {
        let mut outcome = AssetOutcome::failed(&job.id, failure, start.elapsed().as_secs_f64());
        outcome.look_for_older(&arguments.output);
        outcome
    });
    log_end(&outcome);
    worker::send(&Event::Finished(Box::new(outcome)));
    ExitCode::SUCCESS
}

fn log_end(outcome: &AssetOutcome) {
    for (component, failure) in outcome.failures() {
        // Standard error has it from the parent.
        tracing::error!(
            target: "affine_atlas::stages",
            asset = outcome.id,
            component,
            kind = failure.kind.name(),
            "{}",
            failure.message
        );
    }
    tracing::info!(
        target: "affine_atlas::stages",
        asset = outcome.id,
        state = outcome.state_name(),
        seconds = outcome.seconds,
        peak_memory = outcome.peak_memory,
        "ends"
    );
}

fn threads(job: &Job) -> Result<(), Failure> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(job.threads.max(1));
    // The job runs in one of them.
    pool.stack_size(STACK).build_global().map_err(|error| Failure {
        kind: match job.memory {
            0 => FailureKind::Internal,
            _ => FailureKind::Memory,
        },
        message: format!(
            "its {} threads could not be started: {error}; raise run.memory or lower run.threads",
            job.threads
        ),
    })
}
