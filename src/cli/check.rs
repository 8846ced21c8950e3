//! `affine-atlas check`.

use super::arguments::{Check, Global, LogFormat};
use super::plan::{plan, start_threads};
use super::problem::Problem;
use super::work::Work;
use super::{exit, panics, terminal};
use affine_atlas::outcome::{Failure, FailureKind};
use console::style;

/// Says for every asset what a build would do. Exit code 1 where one would be refused.
pub fn run(check: &Check, global: &Global, work: &Work) -> Result<u8, Problem> {
    let plan = plan(&check.inputs, None)?;
    start_threads(global.threads, &plan.config)?;
    let mut code = exit::GOOD;
    for asset in &plan.assets {
        let inspected =
            panics::catch(|| (work.inspect)(asset, &plan.config)).unwrap_or_else(|panic| {
                Err(Failure {
                    kind: FailureKind::Internal,
                    message: panic,
                })
            });
        match inspected {
            Ok(inspection) => {
                if inspection.refused {
                    code = code.max(exit::SOME_FAILED);
                }
                if !global.quiet {
                    let heading = style(format!("{} ({})", asset.id, asset.path.display())).bold();
                    terminal::print(&format!("{heading}\n{}\n", inspection.text.trim_end()));
                }
            }
            Err(failure) => {
                code = code.max(match failure.kind {
                    FailureKind::Internal => exit::INTERNAL,
                    _ => exit::SOME_FAILED,
                });
                show_failure(&asset.id, &failure, global.log_format);
            }
        }
    }
    Ok(code)
}

/// One line on standard error.
pub fn show_failure(what: &str, failure: &Failure, format: LogFormat) {
    match format {
        LogFormat::Text => {
            let label = style("failed").red().for_stderr();
            let kind = failure.kind.name();
            terminal::print_error(&format!("{label}: {what} ({kind}): {}\n", failure.message));
        }
        LogFormat::Json => tracing::error!(
            target: "affine_atlas",
            asset = what,
            kind = failure.kind.name(),
            "{}",
            failure.message
        ),
    }
}
