//! `affine-atlas fit`.

use super::arguments::{Fit, Global, LogFormat};
use super::check::show_failure;
use super::inputs::start_threads;
use super::problem::Problem;
use super::work::{FitRequest, Work};
use super::{exit, interrupt, panics, terminal};
use affine_atlas::config::Config;
use affine_atlas::outcome::{Failure, FailureKind};
use std::path::{Path, PathBuf};

/// Fits one asset. Exit code 1 where its folder does not make surfaces.
pub fn run(fit: &Fit, global: &Global, work: &Work) -> Result<u8, Problem> {
    if !fit.folder.is_dir() {
        return Err(Problem::NoFolder {
            path: fit.folder.clone(),
        });
    }
    let out = match &fit.out {
        Some(out) => out.clone(),
        None => beside(&fit.folder, ".fit"),
    };
    let no_name = || Problem::NoName { path: out.clone() };
    let name = out.file_name().ok_or_else(no_name)?;
    let root = match out.parent() {
        Some(root) if !root.as_os_str().is_empty() => root,
        _ => Path::new("."),
    };
    start_threads(global.threads, &Config::default())?;
    let announce = !global.quiet && global.log_format == LogFormat::Text;
    interrupt::install(work.remove_staging, announce);
    let request = FitRequest {
        folder: fit.folder.clone(),
        root: root.to_owned(),
        name: name.to_string_lossy().into_owned(),
        spacing: fit.spacing,
        against: fit.against.clone(),
    };
    let fitted = panics::catch(|| (work.fit)(&request)).unwrap_or_else(|panic| {
        Err(Failure {
            kind: FailureKind::Internal,
            message: panic,
        })
    });
    match fitted {
        Ok(result) => {
            if fit.json {
                terminal::print(&format!("{:#}\n", result.json));
            } else if !global.quiet {
                terminal::print(&format!("{}written to {}\n", result.text, out.display()));
            }
            Ok(exit::GOOD)
        }
        Err(failure) => {
            let name = fit.folder.display().to_string();
            show_failure(&name, &failure, global.log_format);
            Ok(match failure.kind {
                FailureKind::Internal => exit::INTERNAL,
                _ => exit::SOME_FAILED,
            })
        }
    }
}

/// The folder's name with an extension behind it.
pub(super) fn beside(folder: &Path, extension: &str) -> PathBuf {
    // `.` and `..` are names only once resolved.
    let named = match folder.file_name() {
        Some(_) => folder.to_owned(),
        None => folder.canonicalize().unwrap_or_default(),
    };
    match named.file_name() {
        Some(name) => {
            let mut name = name.to_owned();
            name.push(extension);
            named.with_file_name(name)
        }
        None => named,
    }
}
