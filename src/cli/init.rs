//! `affine-atlas init`.

use super::arguments::{Global, Init};
use super::problem::Problem;
use super::{exit, terminal};
use affine_atlas::batch::inputs;
use affine_atlas::config::{Config, commented_for_its_folder};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Writes the commented configuration.
pub fn run(init: &Init, global: &Global) -> Result<u8, Problem> {
    let path = if init.path.is_dir() {
        init.path.join("config.toml")
    } else {
        init.path.clone()
    };
    write(&path, init.force)?;
    if !global.quiet {
        terminal::print(&said(&path));
    }
    Ok(exit::GOOD)
}

/// Which meshes the configuration stands for, and what to do next.
fn said(path: &Path) -> String {
    let output = folder_of(path).join(Config::default().output.folder);
    let found = inputs::expand(&[PathBuf::from(".")], folder_of(path), &output);
    let found = found.map(|found| found.files).unwrap_or_default();
    let (which, first) = match &found[..] {
        [] => (
            "all meshes in and below its folder, of which there are none yet".to_owned(),
            "put meshes there or name them in `input.paths`, then run",
        ),
        [only] => {
            let mesh = only.path.strip_prefix(folder_of(path));
            let mesh = mesh.unwrap_or(&only.path);
            (mesh.display().to_string(), "next")
        }
        several => (
            format!("the {} meshes in and below its folder", several.len()),
            "next",
        ),
    };
    let command = match path == Path::new("config.toml") {
        true => "affine-atlas build".to_owned(),
        false => format!("affine-atlas build {}", path.display()),
    };
    format!("wrote {} for {which}\n{first}: {command}\n", path.display())
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// The file appears complete or not at all.
fn write(path: &Path, force: bool) -> Result<(), Problem> {
    let not_written = |reason: std::io::Error| Problem::NotWritten {
        path: path.to_owned(),
        reason: reason.kind().to_string(),
    };
    let folder = folder_of(path);
    if !force && path.exists() {
        return Err(Problem::Exists {
            path: path.to_owned(),
        });
    }
    if !folder.is_dir() {
        return Err(Problem::NotWritten {
            path: path.to_owned(),
            reason: format!("there is no folder {}", folder.display()),
        });
    }
    let mut file = builder().tempfile_in(folder).map_err(not_written)?;
    file.write_all(commented_for_its_folder().as_bytes())
        .map_err(not_written)?;
    if force {
        file.persist(path)
            .map_err(|error| not_written(error.error))?;
    } else {
        file.persist_noclobber(path)
            .map_err(|error| not_written(error.error))?;
    }
    Ok(())
}

/// Temporary files are private to their user; this one becomes an ordinary file.
#[cfg(unix)]
pub(super) fn builder() -> tempfile::Builder<'static, 'static> {
    use std::os::unix::fs::PermissionsExt;
    let mut builder = tempfile::Builder::new();
    builder.permissions(std::fs::Permissions::from_mode(0o666)); // minus the user's umask
    builder
}

#[cfg(not(unix))]
pub(super) fn builder() -> tempfile::Builder<'static, 'static> {
    tempfile::Builder::new()
}
