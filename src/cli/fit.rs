//! `affine-atlas fit`.

use super::arguments::{Fit, Global, LogFormat, Tolerance};
use super::check::show_failure;
use super::inputs::start_threads;
use super::problem::Problem;
use super::progress::Progress;
use super::work::{FitRequest, Work};
use super::{exit, interrupt, panics, terminal};
use affine_atlas::config::Config;
use affine_atlas::export::step::LengthUnit;
use affine_atlas::job::fit::{FitParams, Size, Unfitted};
use affine_atlas::outcome::{Failure, FailureKind};
use affine_atlas::read::atlas::source;
use std::path::{Path, PathBuf};

/// Fits one asset. Exit code 1 where a component of it has no surface.
pub fn run(fit: &Fit, global: &Global, work: &Work) -> Result<u8, Problem> {
    let is_folder = fit.input.is_dir();
    let out = match &fit.out {
        Some(out) => out.clone(),
        None if is_folder => beside(&fit.input, ".fit"),
        None => PathBuf::from(
            fit.input
                .with_extension("fit")
                .file_name()
                .unwrap_or_default(),
        ),
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
    let unit = fit.unit.unwrap_or_else(|| unit_of(&fit.input));
    let size = match (fit.cells, fit.tolerance) {
        (Some(cells), _) => Size::Cells(cells as usize),
        (None, Some(Tolerance::OfDiagonal(part))) => Size::OfDiagonal(part),
        (None, Some(Tolerance::Metres(length))) => Size::Length(length / unit.metres()),
        (None, None) => Size::Default,
    };
    let request = FitRequest {
        input: fit.input.clone(),
        root: root.to_owned(),
        name: name.to_string_lossy().into_owned(),
        params: FitParams {
            size,
            angle: fit.angle.to_radians(),
            unit,
        },
    };
    let progress = Progress::new(global, 1);
    let stem = fit.input.file_stem().unwrap_or(fit.input.as_os_str());
    let stem = stem.to_string_lossy();
    let observer = progress.asset(&stem, 0);
    let fitted = panics::catch(|| (work.fit)(&request, &observer)).unwrap_or_else(|panic| {
        Err(Failure {
            kind: FailureKind::Internal,
            message: panic,
        })
    });
    progress.finish();
    match fitted {
        Ok(result) => {
            for Unfitted { name, failure } in &result.unfitted {
                show_failure(name, failure, global.log_format);
            }
            if fit.json {
                terminal::print(&format!("{:#}\n", result.json));
            } else if !global.quiet {
                terminal::print(&format!("{}written to {}\n", result.text, out.display()));
            }
            Ok(match result.unfitted.is_empty() {
                true => exit::GOOD,
                false => exit::SOME_FAILED,
            })
        }
        Err(_) if interrupt::requested() => Ok(exit::INTERRUPTED),
        Err(failure) => {
            let name = fit.input.display().to_string();
            show_failure(&name, &failure, global.log_format);
            Ok(match failure.kind {
                FailureKind::Internal => exit::INTERNAL,
                _ => exit::SOME_FAILED,
            })
        }
    }
}

/// Metres for glTF, whose unit they are, and for what was built from it; else millimetres, as CAD programs take them.
fn unit_of(input: &Path) -> LengthUnit {
    let source = match input.is_dir() {
        true => source(input).map(|source| PathBuf::from(source.path)),
        false => Some(input.to_owned()),
    };
    let extension = source.and_then(|path| Some(path.extension()?.to_ascii_lowercase()));
    match extension
        .as_deref()
        .and_then(|extension| extension.to_str())
    {
        Some("glb" | "gltf") => LengthUnit::Metre,
        _ => LengthUnit::Millimetre,
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
