//! Which keys an `[[asset]]` table has of its own, and which it may not have.

/// Keys of a table that say for which meshes it is.
pub(super) const SELECTORS: [&str; 2] = ["glob", "path"];
/// Keys that concern the whole run.
pub(crate) const OF_THE_RUN: [&str; 5] = [
    "asset",
    "input",
    "output.folder",
    "run.jobs",
    "run.total_memory",
];
