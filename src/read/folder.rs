//! Which files may be read: the asset itself and what lies in its folder, up to a number of bytes.

use super::error::{ReadProblem, shorten};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::rc::Rc;

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
    bytes: u64,
    limit: u64,
}

impl Folder {
    /// Reads the asset's main file.
    pub fn open(path: &Path, limit: u64) -> Result<(Self, Vec<u8>), ReadProblem> {
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
            bytes: 0,
            limit,
        };
        let bytes = folder.load(path, path.to_path_buf())?;
        Ok((folder, bytes))
    }

    /// An asset that stands alone in memory.
    pub fn in_memory(name: &Path, bytes: &[u8], limit: u64) -> Result<Self, ReadProblem> {
        let mut folder = Self {
            root: None,
            shown: PathBuf::new(),
            files: vec![name.to_path_buf()],
            loaded: BTreeMap::new(),
            hashes: vec![blake3::hash(bytes)],
            bytes: 0,
            limit,
        };
        folder.charge(bytes.len() as u64, || name.display().to_string())?;
        Ok(folder)
    }

    /// Counts bytes that are about to be read or unpacked.
    pub fn charge(&mut self, bytes: u64, what: impl Fn() -> String) -> Result<(), ReadProblem> {
        self.bytes = self.bytes.saturating_add(bytes);
        if self.bytes > self.limit {
            return Err(ReadProblem::TooManyBytes {
                what: what(),
                bytes: self.bytes,
                limit: self.limit,
            });
        }
        Ok(())
    }

    /// What is left of the byte budget.
    pub fn budget(&self) -> u64 {
        self.limit - self.bytes.min(self.limit)
    }

    /// A file that the asset refers to by a relative path, which must lie in the asset's folder after
    /// symbolic links are followed.
    pub fn referenced(&mut self, uri: &str, path: &str) -> Result<Rc<Vec<u8>>, ReadProblem> {
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
        let resolved = fs::canonicalize(root.join(path)).map_err(referenced)?;
        if !resolved.starts_with(root) {
            return Err(outside());
        }
        if let Some(bytes) = self.loaded.get(&resolved) {
            return Ok(bytes.clone());
        }
        let shown = self.shown.join(path);
        let bytes = self
            .load(&resolved, shown)
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

    fn load(&mut self, path: &Path, shown: PathBuf) -> Result<Vec<u8>, ReadProblem> {
        let io = |source| ReadProblem::Io { source };
        // Asked before opening: opening a pipe or device could block for ever.
        let size = fs::metadata(path).map_err(io)?;
        if !size.is_file() {
            return Err(ReadProblem::NotAFile);
        }
        let size = size.len();
        self.charge(size, || shown.display().to_string())?;
        let file = File::open(path).map_err(io)?;
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
