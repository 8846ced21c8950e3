//! `affine-atlas build`.

use super::arguments::{Build, Global, LogFormat};
use super::inputs::{Selection, select};
use super::problem::Problem;
use super::progress::Progress;
use super::work::Work;
use super::{check, exit, interrupt, summary, terminal};
use affine_atlas::batch::cache::Verdict;
use affine_atlas::batch::records::{depfile, junit};
use affine_atlas::batch::worker::Voice;
use affine_atlas::batch::{Batch, Task};
use affine_atlas::outcome::{AssetOutcome, AssetState, FailureKind};
use std::path::{Path, PathBuf};

/// What makes this program a worker.
const WORKER: &[&str] = &["worker"];

/// Builds every asset, shows what became of each, and gives the exit code.
pub fn run(build: &Build, global: &Global, work: &Work) -> Result<u8, Problem> {
    let selected = select(&build.inputs, build.out.as_deref())?;
    selected.keep_inputs(|asset| selected.folder(asset))?;
    let tasks = selected.tasks();
    let batch = Batch {
        output: &selected.output,
        program: program()?,
        arguments: WORKER,
        force: build.force,
        jobs: build.jobs.map_or(selected.config.run.jobs, usize::from),
        total_memory: selected.config.run.total_memory,
        threads: global.threads.map(usize::from),
        voice: voice(global),
    };
    if build.dry_run {
        return Ok(show_decisions(
            &tasks,
            &(work.decide)(&batch, &tasks),
            global,
        ));
    }
    let announce = !global.quiet && global.log_format == LogFormat::Text;
    interrupt::install(work.remove_staging, announce);
    let progress = Progress::new(global, tasks.len());
    let (outcomes, recorded) = (work.batch)(&batch, &tasks, &progress);
    progress.finish();
    let recorded = recorded.map_err(|failure| Problem::NotRecorded {
        path: selected.output.join("manifest.jsonl"),
        reason: failure.message,
    });
    if outcomes.is_empty() {
        recorded?;
        return Ok(exit::NOTHING_TO_DO);
    }
    if !global.quiet {
        terminal::print(&summary::results(&outcomes, terminal::stdout_width()));
    }
    if global.log_format == LogFormat::Text {
        terminal::print_error(&summary::failures(&outcomes));
    }
    recorded?;
    write_records(build, &selected, &tasks, &outcomes)?;
    Ok(exit_code(&outcomes))
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
    }
}

/// One line a mesh: what a build would do with it, and why.
fn show_decisions(tasks: &[Task], verdicts: &[Verdict], global: &Global) -> u8 {
    let width = tasks.iter().map(|task| task.id.len()).max().unwrap_or(0);
    let mut text = String::new();
    let mut builds = 0;
    for (task, verdict) in tasks.iter().zip(verdicts) {
        let id = &task.id;
        match verdict {
            Verdict::Cached(_) => text.push_str(&format!("cached  {id}\n")),
            Verdict::Build(reason) => {
                builds += 1;
                text.push_str(&format!("build   {id:width$}  {reason}\n"));
            }
        }
    }
    text.push_str(&format!("{builds} of {} would be built\n", tasks.len()));
    if !global.quiet {
        terminal::print(&text);
    }
    exit::GOOD
}

/// What other programs read.
fn write_records(
    build: &Build,
    selected: &Selection,
    tasks: &[Task],
    outcomes: &[AssetOutcome],
) -> Result<(), Problem> {
    let junit_xml = selected.output.join("junit.xml");
    check::write_whole(&junit_xml, junit(outcomes).as_bytes()).map_err(
        |problem| match problem {
            Problem::NotWritten { path, reason } => Problem::NotRecorded { path, reason },
            other => other,
        },
    )?;
    if let Some(path) = &build.depfile {
        let files = tasks.iter().flat_map(|task| &task.files);
        let files = files.chain(&selected.files).map(PathBuf::as_path);
        let text = depfile(&selected.output.join("manifest.jsonl"), files);
        check::write_whole(path, text.as_bytes())?;
    }
    Ok(())
}

/// The worst that happened.
pub(super) fn exit_code(outcomes: &[AssetOutcome]) -> u8 {
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
