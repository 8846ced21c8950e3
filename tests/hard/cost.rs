//! What a child process and its own children cost, as the system counts it.

use std::io;
use std::process::{Command, Output};

/// What one command cost.
#[derive(Clone, Copy)]
pub struct Cost {
    /// Of all processes, user and system.
    pub cpu_seconds: f64,
}

/// Ticks of a second in `/proc`, the same on all machines that Rust knows with it.
const TICKS: f64 = 100.0;

/// Runs a command; its cost where the system tells. No other child of this process may end meanwhile.
pub fn measured(command: &mut Command) -> io::Result<(Output, Option<Cost>)> {
    let before = children();
    let output = command.output()?;
    let cost = before.zip(children()).map(|(before, after)| Cost {
        cpu_seconds: after - before,
    });
    Ok((output, cost))
}

/// CPU seconds of all children that were waited for, and of theirs.
fn children() -> Option<f64> {
    let line = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name before may hold anything; `cutime` and `cstime` are fields 16 and 17, the one after it is field 3.
    let (_, fields) = line.rsplit_once(')')?;
    let mut ticks = fields.split_whitespace().skip(13);
    let mut next = || ticks.next()?.parse::<f64>().ok();
    Some((next()? + next()?) / TICKS)
}
