//! Files of an output folder: paths that stay in it, and reading up to a number of bytes.

use std::fs::File;
use std::io::Read;
use std::path::{Component, Path};

/// Whether a path stays inside the folder that it is relative to.
pub(crate) fn is_inside(path: &str) -> bool {
    let mut parts = Path::new(path).components().peekable();
    parts.peek().is_some() && parts.all(|part| matches!(part, Component::Normal(_)))
}

/// A file's bytes, if there are at most `limit` of them.
pub(crate) fn read_bounded(path: &Path, limit: u64) -> Result<Vec<u8>, String> {
    let file = File::open(path).map_err(|error| error.to_string())?;
    let mut bytes = Vec::new();
    file.take(limit + 1)
        .read_to_end(&mut bytes)
        .map_err(|error| error.to_string())?;
    if bytes.len() as u64 > limit {
        return Err(format!("is larger than {limit} bytes"));
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_must_stay_inside() {
        assert!(is_inside("images/0000.exr"));
        for path in ["", ".", "..", "/etc/passwd", "images/../../x"] {
            assert!(!is_inside(path), "{path}");
        }
    }
}
