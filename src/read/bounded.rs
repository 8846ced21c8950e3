//! Reading within bounds: regular files only, paths that stay in their folder, and up to a number of bytes.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read};
use std::path::{Component, Path};

/// Whether a path stays inside the folder that it is relative to.
pub(crate) fn is_inside(path: &str) -> bool {
    let mut parts = Path::new(path).components().peekable();
    parts.peek().is_some() && parts.all(|part| matches!(part, Component::Normal(_)))
}

/// Largest file of JSON, or of one JSON object a line, that is read into memory (bytes).
pub(crate) const JSON_LIMIT: u64 = 1 << 30;

/// How many bytes files of `files` bytes may unpack to: `floor`, and 256 for every byte of the files, because a large Draco stream of
/// 1.2 bytes a triangle with normals and texture coordinates takes 190.
pub(crate) const fn unpacked_limit(floor: u64, files: u64) -> u64 {
    floor.saturating_add(files.saturating_mul(256))
}

/// Opens a regular file and tells its length. Links are followed.
///
/// # Errors
/// Of kind [`io::ErrorKind::InvalidInput`] for a folder, a pipe, a socket or a device, none of which is opened: that could wait for ever,
/// or give bytes without end.
pub(crate) fn open_regular(path: &Path) -> io::Result<(File, u64)> {
    let irregular = || io::Error::new(io::ErrorKind::InvalidInput, "it is no regular file");
    if !fs::metadata(path)?.is_file() {
        return Err(irregular());
    }
    let mut options = OpenOptions::new();
    options.read(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;
        // Should a pipe have taken its place since.
        options.custom_flags(rustix::fs::OFlags::NONBLOCK.bits().cast_signed());
    }
    let file = options.open(path)?;
    let data = file.metadata()?;
    match data.is_file() {
        true => Ok((file, data.len())),
        false => Err(irregular()),
    }
}

/// A file's bytes, if it is regular and there are at most `limit` of them.
///
/// # Errors
/// As [`open_regular`]; of kind [`io::ErrorKind::FileTooLarge`] where there are more.
pub(crate) fn read_bounded(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let too_large = |bytes: u64| {
        let text = format!("has {bytes} bytes, more than the {limit} that are read");
        io::Error::new(io::ErrorKind::FileTooLarge, text)
    };
    let (file, length) = open_regular(path)?;
    if length > limit {
        return Err(too_large(length));
    }
    let mut bytes = Vec::with_capacity(usize::try_from(length).unwrap_or(0));
    // It may have grown since; files of the system itself state no length.
    file.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > limit {
        true => Err(too_large(bytes.len() as u64)),
        false => Ok(bytes),
    }
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

    #[test]
    fn a_file_is_read_up_to_its_limit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a");
        fs::write(&path, b"12345").unwrap();
        assert_eq!(read_bounded(&path, 5).unwrap(), b"12345");
        let error = read_bounded(&path, 4).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::FileTooLarge);
        assert!(error.to_string().contains("5 bytes, more than the 4"));
        let error = read_bounded(folder.path(), 4).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::InvalidInput);
        let missing = read_bounded(&folder.path().join("b"), 4).unwrap_err();
        assert_eq!(missing.kind(), io::ErrorKind::NotFound);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn pipes_and_devices_are_not_opened() {
        use rustix::fs::{CWD, FileType, Mode, mknodat};
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        mknodat(CWD, &pipe, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).unwrap();
        let link = folder.path().join("link");
        std::os::unix::fs::symlink("/dev/zero", &link).unwrap();
        for path in [&pipe, &link] {
            let error = read_bounded(path, 10).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::InvalidInput, "{error}");
        }
    }
}
