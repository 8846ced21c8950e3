//! The command line: reads arguments, shows progress, words results. Computes nothing.

mod arguments;
mod batch;
mod build;
mod check;
mod cones;
mod explain;
mod fit;
mod init;
mod inputs;
mod interrupt;
mod log;
mod merge;
mod panics;
mod plan;

mod problem;
mod profile;
mod progress;
mod rebuild;
mod run;
mod schema;
mod summary;
mod terminal;
mod texture;
mod verify;
pub mod work;
mod worker;

use arguments::{Arguments, Command, LogFormat};
use clap::Parser;
use problem::Problem;
use std::process::ExitCode;
use work::Work;

/// Exit codes of the output format (`docs/format.md`).
mod exit {
    /// All good.
    pub const GOOD: u8 = 0;
    /// Some assets failed, or some checks did.
    pub const SOME_FAILED: u8 = 1;
    /// Bad usage or configuration.
    pub const USAGE: u8 = 2;
    /// Nothing to do where something was asked for.
    pub const NOTHING_TO_DO: u8 = 3;
    /// An error of this program.
    pub const INTERNAL: u8 = 4;
    /// Stopped by Ctrl-C or another request, as shells number it: 128 + SIGINT.
    pub const INTERRUPTED: u8 = 130;
}

/// Runs the command and gives its exit code; never panics.
pub fn main(work: &Work) -> ExitCode {
    terminal::decide_colours();
    panics::keep_quiet();
    // Wrong arguments end here with exit code 2, `--help` and `--version` with 0.
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(message) => {
            terminal::note(message.print());
            let code = u8::try_from(message.exit_code()).unwrap_or(exit::USAGE);
            return ExitCode::from(printed(code, LogFormat::Text));
        }
    };
    if let Command::Worker(worker) = &arguments.command {
        return worker::run(worker, work);
    }
    log::start(&arguments.global);
    let code = match panics::catch(|| run(&arguments, work)) {
        Ok(Ok(code)) => code,
        Ok(Err(problem)) => {
            problem.show(arguments.global.log_format);
            problem.exit_code()
        }
        Err(panic) => {
            Problem::Internal(panic).show(arguments.global.log_format);
            exit::INTERNAL
        }
    };
    interrupt::finish();
    ExitCode::from(printed(code, arguments.global.log_format))
}

/// The exit code, after a message where results could not be written to standard output.
fn printed(code: u8, format: LogFormat) -> u8 {
    let Some(error) = terminal::unwritten() else {
        return code;
    };
    let problem = Problem::NotPrinted {
        reason: error.to_string(),
    };
    problem.show(format);
    code.max(problem.exit_code())
}

fn run(arguments: &Arguments, work: &Work) -> Result<u8, Problem> {
    let global = &arguments.global;
    match &arguments.command {
        Command::Build(build) => build::run(build, global, work),
        Command::Plan(asked) => plan::run(asked, global, work),
        Command::Run(shard) => run::run(shard, global, work),
        Command::Merge(asked) => merge::run(asked, global, work),
        Command::Check(check) => check::run(check, global, work),
        Command::Cones(cones) => cones::run(cones, global, work),
        Command::Verify(verify) => verify::run(verify, global, work),
        Command::Rebuild(rebuild) => rebuild::run(rebuild, global, work),
        Command::Fit(fit) => fit::run(fit, global, work),
        Command::Texture(texture) => texture::run(texture, global, work),
        Command::Explain(explain) => explain::run(explain, global, work),
        Command::Schema(asked) => schema::run(asked),
        Command::Init(init) => init::run(init, global),
        // Ended in `main`.
        Command::Worker(_) => Ok(exit::USAGE),
    }
}
