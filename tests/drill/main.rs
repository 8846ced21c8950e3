//! The nightly build when things go wrong: one bad asset, one crash, one full disk or one killed machine costs nothing but itself.
//!
//! Every act begins with last night's good outputs of 60 assets and settings that have changed since, so that all must be built again;
//! something goes wrong in the middle; a rerun must complete and give the same bytes as an undisturbed run. While an act runs, a watcher looks
//! all the time whether any visible folder is half written.
//!
//! `cargo test --release --test drill` runs the acts, a plan of 60 assets on what could be several machines, and a night of
//! 100 assets, of which 5 are broken.
//! `cargo test --release --test drill -- --ignored --nocapture` runs a night of 2,000 with measurements.

// The fixtures themselves are not needed here.
#[allow(dead_code)]
#[path = "../../fixtures/generate/mod.rs"]
mod generate;

mod acts;
mod depfiles;
mod disks;
mod folders;
mod machines;
mod night;
mod stage;

use libtest_mimic::{Arguments, Failed, Trial};
use std::process::ExitCode;

/// A part of the drill: what it found, or that it cannot be tried here and why.
type Act = fn() -> Result<Option<String>, Failed>;

fn main() -> ExitCode {
    let mut arguments = Arguments::from_args();
    // Each act keeps all cores busy by itself.
    arguments.test_threads = Some(1);
    let acts: [(&str, Act); 18] = [
        ("a_worker_is_killed", acts::a_worker_is_killed),
        ("the_batch_is_killed", acts::the_batch_is_killed),
        ("ctrl_c", acts::ctrl_c),
        (
            "an_asset_runs_out_of_memory",
            acts::an_asset_runs_out_of_memory,
        ),
        ("an_asset_runs_out_of_time", acts::an_asset_runs_out_of_time),
        ("the_cache_is_corrupted", acts::the_cache_is_corrupted),
        ("two_batches_share_a_root", acts::two_batches_share_a_root),
        ("a_plan_is_carried_out", machines::a_plan_is_carried_out),
        ("forced_plans_go_on", machines::forced_plans_go_on),
        (
            "inputs_change_after_the_plan",
            machines::inputs_change_after_the_plan,
        ),
        (
            "a_plan_moves_with_its_folder",
            machines::a_plan_moves_with_its_folder,
        ),
        ("the_disk_is_full", disks::the_disk_is_full),
        ("files_may_not_grow", disks::files_may_not_grow),
        (
            "the_root_cannot_be_written",
            disks::the_root_cannot_be_written,
        ),
        (
            "an_asset_s_place_is_taken",
            disks::an_asset_s_place_is_taken,
        ),
        ("ninja_reads_the_depfile", depfiles::ninja),
        ("make_reads_the_depfile", depfiles::make),
        ("a_night_of_100", || night::night(100, None)),
    ];
    let mut trials: Vec<Trial> = acts
        .into_iter()
        .map(
            |(name, act)| match disks::impossible(name).or_else(|| depfiles::impossible(name)) {
                Some(why) => {
                    eprintln!("{name} cannot be tried here: {why}");
                    let refuse = move || Err(format!("cannot be tried here: {why}").into());
                    Trial::test(name, refuse).with_ignored_flag(true)
                }
                None => Trial::test(name, move || act().map(report)),
            },
        )
        .collect();
    let long: [(&str, Act); 2] = [
        ("a_night_of_2000", || night::night(2000, Some(50.0))),
        ("efficiency", night::efficiency),
    ];
    for (name, act) in long {
        trials.push(Trial::test(name, move || act().map(report)).with_ignored_flag(true));
    }
    let conclusion = libtest_mimic::run(&arguments, trials);
    stage::clear_up();
    conclusion.exit_code()
}

fn report(found: Option<String>) {
    if let Some(found) = found {
        eprintln!("{found}");
    }
}
