//! `affine-atlas merge`.

use super::arguments::{Global, Merge};
use super::batch::{exit_code, show, write_records};
use super::exit;
use super::problem::Problem;
use super::run::read;
use super::work::Work;
use affine_atlas::batch::merge::{Merged, Went, is_gone};

/// So many ids and shards are named in messages.
const NAMED: usize = 5;

/// Puts what all shards did together, shows it, and gives the exit code of a build.
pub fn run(merge: &Merge, global: &Global, work: &Work) -> Result<u8, Problem> {
    let plan = read(&merge.plan)?;
    let not_recorded = |failure: affine_atlas::outcome::Failure| Problem::NotRecorded {
        path: plan.header.output.join("manifest.jsonl"),
        reason: failure.message,
    };
    let merged = (work.collect)(&plan).map_err(not_recorded)?;
    if plan.assets.is_empty() {
        return Ok(exit::NOTHING_TO_DO);
    }
    if !merged.missing.is_empty() && !merge.incomplete {
        return Err(Problem::NotDone {
            missing: merged.missing.len(),
            all: plan.assets.len(),
            first: named(&merged.missing),
            shards: match is_gone(&plan) {
                true => "what its shards wrote is gone; a later plan was merged, or .affine-atlas was removed".to_owned(),
                false => shards(&merged),
            },
            again: again(&merged, &merge.plan.display().to_string()),
        });
    }
    if !merged.changed.is_empty() {
        tracing::warn!(
            "changed after the plan was made, and built as they were then: {}",
            listed(&merged.changed)
        );
    }
    if !merged.ambiguous.is_empty() {
        tracing::warn!(
            "built more than once with different results, any of which may be in place: {}; build them again with --force",
            listed(&merged.ambiguous)
        );
    }
    (work.merge)(&plan, &merged).map_err(not_recorded)?;
    show(&merged.outcomes, global);
    write_records(
        &plan.header.output,
        &merged.outcomes,
        merge.depfile.as_deref(),
        plan.assets.iter().map(|asset| &asset.task),
        &plan.header.files,
    )?;
    Ok(exit_code(&merged.outcomes))
}

/// How many there are, and the first of them.
fn listed(ids: &[String]) -> String {
    match ids.len() {
        1 => format!("1 mesh ({})", named(ids)),
        n => format!("{n} meshes ({})", named(ids)),
    }
}

/// The first of them.
fn named(all: &[String]) -> String {
    let first = all[..all.len().min(NAMED)].join(", ");
    match all.len() > NAMED {
        true => format!("{first}, …"),
        false => first,
    }
}

/// What is known of the shards that are not done.
fn shards(merged: &Merged) -> String {
    if merged.unfinished.is_empty() {
        return "no shard has been begun".to_owned();
    }
    let of = |state: Went, words: &str| {
        let shards = merged.unfinished.iter().filter(|(_, went)| *went == state);
        let shards: Vec<String> = shards.map(|(shard, _)| shard.to_string()).collect();
        let words = match shards.len() {
            1 => format!("shard {} {words}", named(&shards)),
            _ => format!("{} shards {words} ({})", shards.len(), named(&shards)),
        };
        (!shards.is_empty()).then_some(words)
    };
    let all = [
        of(Went::NeverBegun, "never began"),
        of(Went::NotEnded, "did not come to the end"),
        of(Went::Damaged, "left a damaged file"),
    ];
    all.into_iter().flatten().collect::<Vec<_>>().join("; ")
}

/// The command that does what is missing.
fn again(merged: &Merged, plan: &str) -> String {
    let shard = merged.unfinished.first().map(|(shard, _)| *shard);
    match shard {
        Some(shard) if shard.count > 1 => format!("affine-atlas run --plan {plan} --shard {shard}"),
        _ => format!("affine-atlas run --plan {plan}"),
    }
}
