//! `affine-atlas run`.

use super::arguments::{Global, LogFormat, Run};
use super::batch::{batch, exit_code, show};
use super::problem::Problem;
use super::progress::Progress;
use super::work::Work;
use super::{exit, interrupt, terminal};
use affine_atlas::batch::Task;
use affine_atlas::batch::plan::{Plan, plan_folder};
use affine_atlas::batch::shard;
use rayon::prelude::*;
use std::path::Path;

/// Does a shard of a plan, shows what became of each of its assets, and gives the exit code.
pub fn run(run: &Run, global: &Global, work: &Work) -> Result<u8, Problem> {
    let plan = read(&run.plan)?;
    let planned = shard::select(&plan, run.shard);
    if planned.is_empty() {
        if !global.quiet {
            terminal::print(&format!(
                "shard {} has nothing to do: the plan has {} meshes\n",
                run.shard,
                plan.assets.len()
            ));
        }
        return Ok(exit::GOOD);
    }
    // Before anything takes long: as the first process of a container this one has nobody else to end it.
    let announce = !global.quiet && global.log_format == LogFormat::Text;
    interrupt::install(work.remove_staging, announce);
    // Files may have changed since the plan was made; what counts is what is there.
    let tasks: Vec<Task> = planned
        .par_iter()
        .map(|planned| planned.task.looked_at_again())
        .collect();
    for (task, planned) in tasks.iter().zip(&planned) {
        if task.input_hash != planned.task.input_hash {
            tracing::warn!(
                "{}: {} is not what it was when the plan was made; it is built as it is",
                task.id,
                task.path.display()
            );
        }
    }
    let header = &plan.header;
    let batch = batch(
        &header.output,
        header.force,
        run.jobs.map_or(header.jobs, usize::from),
        header.total_memory,
        global,
    )?;
    let progress = Progress::new(global, tasks.len());
    let (outcomes, recorded) = (work.shard)(&batch, &header.id, run.shard, &tasks, &progress);
    progress.finish();
    show(&outcomes, global);
    recorded.map_err(|failure| Problem::NotRecorded {
        path: plan_folder(&header.output, &header.id),
        reason: failure.message,
    })?;
    Ok(exit_code(&outcomes))
}

/// A plan that is for the current folder.
pub(super) fn read(path: &Path) -> Result<Plan, Problem> {
    let plan = Plan::read(path)?;
    let here = std::env::current_dir().map_err(|error| Problem::NoPlace {
        reason: error.to_string(),
    })?;
    plan.check_place(&here)?;
    Ok(plan)
}
