//! Which files may be read: the asset itself and what lies in its folder, within its budget.

use super::bounded::open_regular;
use super::budget::Budget;
use super::error::{ReadProblem, shorten};
use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Whether a path is relative and stays inside its folder, in plain names.
pub(super) fn is_inside(path: &str) -> bool {
    // `file:`, `http:` and drive letters; a colon after the first slash is part of a name.
    let first = path.split('/').next().unwrap_or_default();
    let is_plain = !path.is_empty() && !path.contains(['\0', '\\']);
    is_plain
        && !first.contains(':')
        && !path.starts_with('/')
        && path.split('/').all(|part| part != "..")
}

/// The file of a path in a folder, links followed. Where there is none, one whose name differs in upper and lower case only, the first in order: files come from systems that see
/// no difference.
pub(super) fn find(folder: &Path, path: &str) -> io::Result<PathBuf> {
    let missing = match folder.join(path).canonicalize() {
        Ok(found) => return Ok(found),
        Err(error) => error,
    };
    let mut found = folder.to_owned();
    for name in path.split('/') {
        let same =
            |other: &OsStr| other.to_str().map(str::to_lowercase) == Some(name.to_lowercase());
        let entries = fs::read_dir(&found)?
            .flatten()
            .map(|entry| entry.file_name());
        match entries.filter(|other| same(other)).min() {
            Some(other) => found.push(other),
            None => return Err(missing),
        }
    }
    found.canonicalize()
}

/// The files of one asset, read within bounds and hashed.
pub(super) struct Folder {
    /// Resolved folder of the asset; `None` where it is in memory.
    root: Option<PathBuf>,
    /// Folder as the caller wrote it, for `files`.
    shown: PathBuf,
    files: Vec<PathBuf>,
    /// Referenced files by resolved path: a file that is named twice is read once.
    loaded: BTreeMap<PathBuf, Rc<Vec<u8>>>,
    hashes: Vec<blake3::Hash>,
}

impl Folder {
    /// Reads the asset's main file.
    pub fn open(path: &Path, budget: &mut Budget) -> Result<(Self, Vec<u8>), ReadProblem> {
        let io = |source| ReadProblem::Io { source };
        let shown = path.parent().unwrap_or(Path::new("")).to_path_buf();
        let parent = if shown.as_os_str().is_empty() {
            Path::new(".")
        } else {
            &shown
        };
        let mut folder = Self {
            root: Some(fs::canonicalize(parent).map_err(io)?),
            shown: shown.clone(),
            files: Vec::new(),
            loaded: BTreeMap::new(),
            hashes: Vec::new(),
        };
        let bytes = folder.load(path, path.to_path_buf(), budget)?;
        Ok((folder, bytes))
    }

    /// An asset that stands alone in memory.
    pub fn in_memory(name: &Path, bytes: &[u8], budget: &mut Budget) -> Result<Self, ReadProblem> {
        budget.read(bytes.len() as u64, || name.display().to_string())?;
        Ok(Self {
            root: None,
            shown: PathBuf::new(),
            files: vec![name.to_path_buf()],
            loaded: BTreeMap::new(),
            hashes: vec![blake3::hash(bytes)],
        })
    }

    /// A file that the asset refers to by a relative path, which must lie in the asset's folder after
    /// symbolic links are followed.
    pub fn referenced(
        &mut self,
        uri: &str,
        path: &str,
        budget: &mut Budget,
    ) -> Result<Rc<Vec<u8>>, ReadProblem> {
        let referenced = |source| ReadProblem::ReferencedFile {
            uri: shorten(uri.as_bytes()),
            source,
        };
        let outside = || ReadProblem::OutsideFolder {
            uri: shorten(uri.as_bytes()),
        };
        let root = self.root.as_ref().ok_or_else(|| {
            let reason = "an asset in memory has no folder";
            referenced(io::Error::new(io::ErrorKind::NotFound, reason))
        })?;
        let resolved = find(root, path).map_err(referenced)?;
        if !resolved.starts_with(root) {
            return Err(outside());
        }
        if let Some(bytes) = self.loaded.get(&resolved) {
            return Ok(bytes.clone());
        }
        let shown = self.shown.join(path);
        let bytes = self
            .load(&resolved, shown, budget)
            .map_err(|problem| match problem {
                ReadProblem::Io { source } => referenced(source),
                ReadProblem::NotAFile => referenced(io::Error::new(
                    io::ErrorKind::InvalidInput,
                    "no regular file",
                )),
                other => other,
            })?;
        let bytes = Rc::new(bytes);
        self.loaded.insert(resolved, bytes.clone());
        Ok(bytes)
    }

    fn load(
        &mut self,
        path: &Path,
        shown: PathBuf,
        budget: &mut Budget,
    ) -> Result<Vec<u8>, ReadProblem> {
        let io = |source| ReadProblem::Io { source };
        let (file, size) = open_regular(path).map_err(|source| match source.kind() {
            io::ErrorKind::InvalidInput => ReadProblem::NotAFile,
            _ => io(source),
        })?;
        budget.read(size, || shown.display().to_string())?;
        let mut bytes = Vec::with_capacity(usize::try_from(size).unwrap_or(0));
        // A file that grows while it is read stays within what was counted.
        file.take(size).read_to_end(&mut bytes).map_err(io)?;
        self.hashes.push(blake3::hash(&bytes));
        self.files.push(shown);
        Ok(bytes)
    }

    /// The hash over all files and their names, in order.
    pub fn finish(self) -> (String, Vec<PathBuf>) {
        let hash = match self.hashes.as_slice() {
            [only] => *only,
            many => {
                let mut all = blake3::Hasher::new();
                for hash in many {
                    all.update(hash.as_bytes());
                }
                all.finalize()
            }
        };
        (hash.to_hex().to_string(), self.files)
    }
}
