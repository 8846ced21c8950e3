//! `affine-atlas build`.

use super::arguments::{Build, Global, LogFormat};
use super::batch::{JUNIT, batch, exit_code, show, write_records};
use super::inputs::select;
use super::problem::Problem;
use super::profile::Profile;
use super::progress::Progress;
use super::work::Work;
use super::{exit, interrupt, terminal};
use affine_atlas::batch::Task;
use affine_atlas::batch::cache::Verdict;

/// Builds every asset, shows what became of each, and gives the exit code.
pub fn run(build: &Build, global: &Global, work: &Work) -> Result<u8, Problem> {
    let selected = select(&build.inputs, build.out.as_deref());
    if let Err(Problem::NothingFound { output, .. }) = &selected
        && !build.dry_run
        && output.join(JUNIT).exists()
    {
        // What a build server reads shall not be that of an earlier run.
        write_records(output, &[], None, std::iter::empty(), &[])?;
    }
    let selected = selected?;
    selected.keep_inputs(|asset| selected.folder(asset))?;
    let tasks = selected.tasks();
    let run = &selected.config.run;
    let jobs = build.jobs.map_or(run.jobs, usize::from);
    let mut batch = batch(
        &selected.output,
        build.force,
        jobs,
        run.total_memory,
        global,
    )?;
    batch.voice.parts = build.profile.is_some();
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
    let profile = Profile::new(&progress);
    let (outcomes, recorded) = (work.batch)(&batch, &tasks, &profile);
    progress.finish();
    if let Some(path) = &build.profile {
        profile.write(path, &tasks)?;
    }
    let recorded = recorded.map_err(|failure| Problem::NotRecorded {
        path: selected.output.join("manifest.jsonl"),
        reason: failure.message,
    });
    if outcomes.is_empty() {
        recorded?;
        return Ok(exit::NOTHING_TO_DO);
    }
    show(&outcomes, global);
    recorded?;
    write_records(
        &selected.output,
        &outcomes,
        build.depfile.as_deref(),
        tasks.iter(),
        &selected.files,
    )?;
    Ok(exit_code(&outcomes))
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
