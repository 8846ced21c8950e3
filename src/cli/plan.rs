//! `affine-atlas plan`.

use super::arguments::{Global, Plan as Arguments};
use super::batch::batch;
use super::check::write_whole;
use super::inputs::select;
use super::problem::Problem;
use super::progress::in_words;
use super::work::Work;
use super::{exit, terminal};
use affine_atlas::batch::plan::{Decision, Plan, Purpose};
use affine_atlas::batch::shard;

/// Writes down what a build would do, and says how much that is.
pub fn run(arguments: &Arguments, global: &Global, work: &Work) -> Result<u8, Problem> {
    let selected = select(&arguments.inputs, arguments.out.as_deref())?;
    selected.keep_inputs(|asset| selected.folder(asset))?;
    let folder = std::env::current_dir().map_err(|error| Problem::NoPlace {
        reason: error.to_string(),
    })?;
    let tasks = selected.tasks();
    let run = &selected.config.run;
    let batch = batch(
        &selected.output,
        arguments.force,
        run.jobs,
        run.total_memory,
        global,
    )?;
    let verdicts = (work.decide)(&batch, &tasks);
    let purpose = Purpose {
        folder,
        output: selected.output.clone(),
        force: arguments.force,
        files: selected.files.clone(),
        run: run.clone(),
    };
    let plan = Plan::new(purpose, tasks, &verdicts)?;
    // First: a plan whose output root cannot be written is of no use to anybody.
    plan.mark_place().map_err(|error| Problem::NotRecorded {
        path: selected.output.clone(),
        reason: error.to_string(),
    })?;
    write_whole(&arguments.plan, plan.to_text().as_bytes())?;
    if !global.quiet {
        terminal::print(&said(&plan, arguments));
    }
    Ok(exit::GOOD)
}

fn said(plan: &Plan, arguments: &Arguments) -> String {
    let all = plan.assets.len();
    let of = |decision| plan.assets.iter().filter(move |a| a.decision == decision);
    let builds = of(Decision::Build).count();
    let total = plan
        .assets
        .iter()
        .fold(0, |sum: u64, asset| sum.saturating_add(asset.estimate));
    let seconds = |milliseconds: u64| match milliseconds {
        0..1000 => "less than 1 s".to_owned(),
        _ => format!("about {}", in_words(milliseconds as f64 / 1e3)),
    };
    let mut text = format!(
        "{builds} of {all} to build, {} of work one after the other\n",
        seconds(total)
    );
    if let Some(count) = arguments.shards {
        let loads = shard::loads(plan, count);
        let most = loads.iter().copied().max().unwrap_or(0);
        let busy: Vec<u64> = loads.into_iter().filter(|&load| load > 0).collect();
        let least = busy.iter().copied().min().unwrap_or(0);
        let empty = count as usize - busy.len();
        let even = total as f64 / f64::from(count);
        text.push_str(&format!(
            "{count} shards of {} to {}, the largest {:.2} times an equal part",
            seconds(least),
            seconds(most),
            most as f64 / even.max(1.0)
        ));
        match empty {
            0 => {}
            1 => text.push_str("; 1 has nothing to do"),
            _ => text.push_str(&format!("; {empty} have nothing to do")),
        }
        text.push('\n');
    }
    text.push_str(&format!("wrote {}\n", arguments.plan.display()));
    text
}
