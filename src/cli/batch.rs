//! What `build`, `run` and `merge` have in common: how workers are started, what is shown at the end, what is written for other programs.

use super::arguments::{Global, LogFormat};
use super::problem::Problem;
use super::{check, exit, summary, terminal};
use affine_atlas::batch::records::{depfile, junit};
use affine_atlas::batch::worker::Voice;
use affine_atlas::batch::{Batch, Task};
use affine_atlas::outcome::{AssetOutcome, AssetState, FailureKind};
use std::path::{Path, PathBuf};

/// The run as test cases, in the output folder.
pub const JUNIT: &str = "junit.xml";

/// What makes this program a worker.
const WORKER: &[&str] = &["worker"];

/// A batch of workers that are this program. `jobs` and `total_memory` as in the configuration.
pub fn batch<'a>(
    output: &'a Path,
    force: bool,
    jobs: usize,
    total_memory: u64,
    global: &Global,
) -> Result<Batch<'a>, Problem> {
    Ok(Batch {
        output,
        program: program()?,
        arguments: WORKER,
        force,
        plan: None,
        jobs,
        total_memory,
        threads: global.threads.map(usize::from),
        voice: voice(global),
    })
}

/// This program itself, also where its file has been replaced since it was started.
fn program() -> Result<PathBuf, Problem> {
    let file = std::env::current_exe();
    let running = Path::new("/proc/self/exe");
    match file {
        // Linux names a file that is gone by a path that does not exist.
        Ok(file) if file.exists() => Ok(file),
        _ if running.exists() => Ok(running.to_owned()),
        file => Err(Problem::Internal(format!(
            "internal error: this program cannot find itself: {file:?}"
        ))),
    }
}

fn voice(global: &Global) -> Voice {
    let json = global.log_format == LogFormat::Json;
    let steps = match global.verbose {
        0 if terminal::stderr_is_terminal() && !global.quiet && !json => Some(100),
        0 => None,
        _ => Some(0),
    };
    Voice {
        quiet: global.quiet,
        verbose: global.verbose,
        json,
        colours: console::colors_enabled_stderr(),
        steps,
        parts: false,
    }
}

/// Shows what became of every asset.
pub fn show(outcomes: &[AssetOutcome], global: &Global) {
    if !global.quiet {
        terminal::print(&summary::results(outcomes, terminal::stdout_width()));
    }
    if global.log_format == LogFormat::Text {
        terminal::print_error(&summary::failures(outcomes));
    }
}

/// Writes what other programs read: `junit.xml`, and where `depfile` is named, the dependencies of the manifest on the tasks' files and `files`.
pub fn write_records<'t>(
    output: &Path,
    outcomes: &[AssetOutcome],
    depfile_path: Option<&Path>,
    tasks: impl Iterator<Item = &'t Task>,
    files: &[PathBuf],
) -> Result<(), Problem> {
    let junit_xml = output.join(JUNIT);
    check::write_whole(&junit_xml, junit(outcomes).as_bytes()).map_err(
        |problem| match problem {
            Problem::NotWritten { path, reason } => Problem::NotRecorded { path, reason },
            other => other,
        },
    )?;
    if let Some(path) = depfile_path {
        let read = tasks.flat_map(|task| &task.files);
        let read = read.chain(files).map(PathBuf::as_path);
        let text = depfile(&output.join("manifest.jsonl"), read);
        check::write_whole(path, text.as_bytes())?;
    }
    Ok(())
}

/// The worst that happened.
pub fn exit_code(outcomes: &[AssetOutcome]) -> u8 {
    let any = |test: &dyn Fn(&AssetOutcome) -> bool| outcomes.iter().any(test);
    if any(&|outcome| outcome.state == AssetState::Cancelled) {
        exit::INTERRUPTED
    } else if any(&|outcome| {
        outcome
            .failures()
            .any(|(_, failure)| failure.kind == FailureKind::Internal)
    }) {
        exit::INTERNAL
    } else if any(&|outcome| outcome.failures().next().is_some()) {
        exit::SOME_FAILED
    } else {
        exit::GOOD
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use affine_atlas::outcome::{ComponentOutcome, Failure};

    fn failure(kind: FailureKind) -> Failure {
        Failure {
            kind,
            message: "wrong".to_owned(),
        }
    }

    #[test]
    fn exit_codes() {
        let built = || AssetOutcome::whole("a", AssetState::Built, 0.0);
        let cached = || AssetOutcome::whole("b", AssetState::Cached, 0.0);
        let failed = |kind| AssetOutcome::failed("c", failure(kind), 0.0);
        assert_eq!(exit_code(&[built(), cached()]), exit::GOOD);
        for kind in [
            FailureKind::Input,
            FailureKind::Timeout,
            FailureKind::Memory,
            FailureKind::Output,
        ] {
            assert_eq!(exit_code(&[built(), failed(kind)]), exit::SOME_FAILED);
        }
        let mut half = built();
        half.components.push(ComponentOutcome {
            index: 3,
            result: Err(failure(FailureKind::Prescription)),
        });
        assert_eq!(exit_code(&[half]), exit::SOME_FAILED);
        let internal = failed(FailureKind::Internal);
        assert_eq!(exit_code(&[built(), internal.clone()]), exit::INTERNAL);
        let cancelled = AssetOutcome::whole("d", AssetState::Cancelled, 0.0);
        assert_eq!(exit_code(&[internal, cancelled]), exit::INTERRUPTED);
    }
}
