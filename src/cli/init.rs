//! `affine-atlas init`.

use super::arguments::{Global, Init};
use super::problem::Problem;
use super::{exit, terminal};
use affine_atlas::config::COMMENTED_DEFAULT;
use std::io::Write;
use std::path::Path;

/// Writes the commented configuration.
pub fn run(init: &Init, global: &Global) -> Result<u8, Problem> {
    let path = if init.path.is_dir() {
        init.path.join("config.toml")
    } else {
        init.path.clone()
    };
    write(&path, init.force)?;
    if !global.quiet {
        terminal::print(&format!(
            "wrote {0}\nlist your meshes in `input.paths`, then run: affine-atlas build {0}\n",
            path.display()
        ));
    }
    Ok(exit::GOOD)
}

/// The file appears complete or not at all.
fn write(path: &Path, force: bool) -> Result<(), Problem> {
    let not_written = |reason: std::io::Error| Problem::NotWritten {
        path: path.to_owned(),
        reason: reason.kind().to_string(),
    };
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
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
    file.write_all(COMMENTED_DEFAULT.as_bytes())
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
