//! The whole program on the committed fixtures, as a user runs it; its messages, its readers, its verification, and what is committed with it.

mod boundaries;
mod channels;
mod cli_messages;
mod command;
mod dependencies;
mod documents;
mod existence;
mod features;
mod fit;
mod fixtures;
mod flows;
mod folders;
mod fuzz_corpus;
mod good;
mod grids;
mod hard;
#[cfg(unix)]
mod interrupt;
mod library;
mod materials;
mod packed;
mod prescriptions;
mod profile;
mod reading;
#[path = "../real_models/mod.rs"]
mod real_models;
mod rebuild;
mod records;
mod refusals;
mod replacing;
mod rough;
mod schema;
mod shapes;
mod survey;
mod texture;
mod units;
mod verifying;
mod whole;

/// Files of the run as a whole, beside the folders of assets.
const OF_THE_RUN: [&str; 6] = [
    "manifest.jsonl",
    "index.html",
    "history.jsonl",
    "junit.xml",
    "logs",
    ".affine-atlas",
];
