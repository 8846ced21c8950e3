//! Many assets: one worker process each, limits, cache, records.
//!
//! *Enters:* what is to be done, as a list of [`Task`]s, and a [`Batch`] that says where and how. *Leaves:* an outcome a task, the
//! folders that the workers wrote, and records of all of it.
//!
//! | module | enters → leaves |
//! | --- | --- |
//! | [`inputs`] | globs, folders, list files → files |
//! | [`task`] | a file and its settings → what is to be done, as a line of a plan |
//! | [`cache`] | a task and what earlier runs left → nothing to do, or why it must be built |
//! | [`plan`] | tasks → a file from which several machines work, and back |
//! | [`shard`] | a plan and a number → what one of these machines does |
//! | [`queue`] | tasks → outcomes: which runs when, within `jobs` and memory |
//! | [`process`] | one task → its worker process, watched and ended in time |
//! | [`worker`] | the other side: a job from standard input → events on standard output |
//! | [`limits`] | what a process may take, and what the machine has |
//! | [`records`] | outcomes → `manifest.jsonl`, JUnit, depfile, files of shards |
//! | [`merge`] | what all shards of a plan wrote down → outcomes, manifest |
//!
//! A crash, a memory cap and a timeout stay with one asset, because every asset is built by a process of its own: also
//! where there is only one. Processes talk in JSON lines over pipes; the worker writes the asset's folder and its cache entry, the
//! parent everything else. Workers die with their parent.
//!
//! Where one machine is too small, [`plan`], [`queue::run_shard`] on each of several, and [`merge`] do what [`run`] does on one. Who starts shards, and again
//! where a machine dies, is an engine's business: a shard may be run any number of times, also twice at once.
//!
//! Two batches may write into one output root at the same time: staging folders belong to a process, records are merged under a
//! lock. Where both build the same asset the later one wins, whole.
//!
//! *Rejected:* threads with `catch_unwind`, which neither memory nor a stack overflow respects; killing by `pre_exec` hooks, which need
//! `unsafe` (a worker limits itself instead, before it reads any mesh).

pub mod cache;
pub mod inputs;
pub mod limits;
pub mod merge;
pub mod plan;
pub mod process;
pub mod queue;
pub mod records;
pub mod shard;
pub mod task;
pub mod worker;

#[cfg(test)]
mod tests;

pub use queue::{Batch, Watcher, run, run_shard};
pub use task::{Settings, Task};

use std::path::{Path, PathBuf};

/// What this program keeps in an output root for itself.
#[must_use]
pub fn private_folder(output: &Path) -> PathBuf {
    output.join(".affine-atlas")
}

/// The log of an asset.
#[must_use]
pub fn log_path(output: &Path, id: &str) -> PathBuf {
    output.join("logs").join(format!("{id}.log"))
}
