//! `affine-atlas check`.

use super::arguments::{Check, Global, LogFormat};
use super::inputs::{select, start_threads};
use super::problem::Problem;
use super::work::Work;
use super::{exit, panics, terminal};
use affine_atlas::outcome::{Failure, FailureKind};
use console::style;
use std::io::Write;
use std::path::Path;

/// Says for every asset what a build would do. Exit code 1 where one would be refused.
pub fn run(check: &Check, global: &Global, work: &Work) -> Result<u8, Problem> {
    let selected = select(&check.inputs, None)?;
    start_threads(global.threads, &selected.config)?;
    let mut code = exit::GOOD;
    for (asset, settings) in selected.items() {
        let inspected =
            panics::catch(|| (work.inspect)(asset, &settings.config)).unwrap_or_else(|panic| {
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
                if let Some(path) = &check.region {
                    let path = match selected.assets.len() {
                        1 => path.clone(),
                        _ => path.with_file_name(one_of_many(path, &asset.id)),
                    };
                    let said = write_region(&path, inspection.region.as_deref())?;
                    if !global.quiet {
                        terminal::print(&format!("  {said}\n"));
                    }
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

/// `region.glb` and `bunny`: `region-bunny.glb`.
pub fn one_of_many(path: &Path, id: &str) -> String {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    match extension.is_empty() {
        true => format!("{stem}-{id}"),
        false => format!("{stem}-{id}.{extension}"),
    }
}

/// Writes the region's GLB, complete or not at all, where there is one; says which.
fn write_region(path: &Path, glb: Option<&[u8]>) -> Result<String, Problem> {
    let Some(glb) = glb else {
        return Ok(format!(
            "region: none to show, {} was not written",
            path.display()
        ));
    };
    write_whole(path, glb)?;
    Ok(format!("region: written to {}", path.display()))
}

/// Writes a file, complete or not at all; an older one is replaced.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Problem> {
    let not_written = |reason: std::io::Error| Problem::NotWritten {
        path: path.to_owned(),
        reason: reason.kind().to_string(),
    };
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut file = super::init::builder()
        .tempfile_in(folder)
        .map_err(not_written)?;
    file.write_all(bytes).map_err(not_written)?;
    file.persist(path)
        .map_err(|error| not_written(error.error))?;
    Ok(())
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
