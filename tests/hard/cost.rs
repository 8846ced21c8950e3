//! What a child process and its own children cost, as the shell counts it.

use std::io;
use std::process::{Command, Output};

/// What one command cost.
#[derive(Clone, Copy)]
pub struct Cost {
    /// Of all processes, user and system.
    pub cpu_seconds: f64,
}

/// Runs a command and says on a last line of its standard error what its processes took: `times` of POSIX.
const COUNTED: &str = r#""$0" "$@"; code=$?; times >&2; exit "$code""#;

/// Runs a command; its cost where there is a shell that tells. Commands that run side by side are told apart.
pub fn measured(command: &Command) -> io::Result<(Output, Option<Cost>)> {
    let mut shell = Command::new("sh");
    shell.args(["-c", COUNTED]).arg(command.get_program());
    shell.args(command.get_args()).env("LC_ALL", "C");
    for (key, value) in command.get_envs() {
        match value {
            Some(value) => shell.env(key, value),
            None => shell.env_remove(key),
        };
    }
    let output = shell.output()?;
    let said = String::from_utf8_lossy(&output.stderr);
    // The shell itself, then its children: minutes and seconds of user and system, `0m1.25s 0m0.01s`.
    let times = said.lines().next_back().unwrap_or_default();
    let seconds: Option<Vec<f64>> = times.split_whitespace().map(seconds).collect();
    let cost = seconds.filter(|s| s.len() == 2).map(|s| Cost {
        cpu_seconds: s[0] + s[1],
    });
    Ok((output, cost))
}

fn seconds(text: &str) -> Option<f64> {
    let (minutes, seconds) = text.strip_suffix('s')?.split_once('m')?;
    Some(60.0 * minutes.parse::<f64>().ok()? + seconds.parse::<f64>().ok()?)
}
