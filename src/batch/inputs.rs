//! From what the user names to files: globs, folders and list files.
//!
//! *Enters:* the entries of `input.paths` or the arguments. *Leaves:* one [`Input`] a mesh file, in the order of the entries, those of a
//! folder or glob in order of their names. A file that is found twice is one input.
//!
//! | entry | means |
//! | --- | --- |
//! | `@list.txt` | the entries in a text file, one a line, which start at its folder; blank lines and lines that begin with `#` are skipped |
//! | an existing file, or a name that is no glob | that file, whatever its extension |
//! | an existing folder | every mesh file in it and in its subfolders, but for hidden ones |
//! | a glob (`*`, `?`, `[a-z]`, `**`) | every mesh file that it matches |
//!
//! The output root is never searched. Links to folders are not followed, so that no search is without end.

use crate::config::assets::Input;
use crate::export::folder::COMPONENTS;
use crate::read::EXTENSIONS;
use crate::read::bounded::read_bounded;
use std::collections::HashSet;
use std::fs;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// What folders of results hold.
const DOCUMENTS: [&str; 4] = ["atlas.json", COMPONENTS, "fit.json", "texture.json"];
/// Bytes at the start of such a file that say whose it is.
const START: u64 = 1 << 16;

/// What the entries mean.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inputs {
    /// The files.
    pub files: Vec<Input>,
    /// List files that were read.
    pub lists: Vec<PathBuf>,
    /// One sentence for each entry that nothing was found for, and each folder that could not be searched.
    pub notes: Vec<String>,
}

/// Why entries have no meaning.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InputError {
    /// A list file that cannot be read.
    #[error("the list {} cannot be read: {reason}", path.display())]
    List {
        /// Which.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// A list in a list.
    #[error("line {line} of the list {} names another list", path.display())]
    ListInList {
        /// Which.
        path: PathBuf,
        /// From 1.
        line: usize,
    },
    /// No glob.
    #[error("`{glob}` is no glob: {reason}")]
    Glob {
        /// As given.
        glob: String,
        /// What is wrong with it.
        reason: String,
    },
}

impl InputError {
    /// What to change.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::List { .. } => {
                "`@FILE` names a text file with a mesh, folder or glob on each line: check the name and that it is UTF-8 text"
            }
            Self::ListInList { .. } => "put its lines in place of its name",
            Self::Glob { .. } => {
                "`*` stands for any part of a name, `**` for any folders, `?` for one character, `[abc]` for one of these; write `[[]` for a bracket"
            }
        }
    }
}

/// Finds the files. Relative entries start at `base`; `output` is not searched.
///
/// # Errors
/// [`InputError`] for a list that cannot be read and a glob that is none.
pub fn expand(entries: &[PathBuf], base: &Path, output: &Path) -> Result<Inputs, InputError> {
    let mut search = Search {
        output: output.canonicalize().ok(),
        known: HashSet::new(),
        inputs: Inputs::default(),
    };
    for entry in entries {
        match listed(entry) {
            Some(list) if !base.join(entry).exists() => search.list(&list, base)?,
            _ => search.entry(entry, base, false)?,
        }
    }
    Ok(search.inputs)
}

/// The file that `@file` names, whatever bytes its name has.
#[cfg(unix)]
fn listed(entry: &Path) -> Option<PathBuf> {
    use std::os::unix::ffi::OsStrExt;
    let name = entry.as_os_str().as_bytes().strip_prefix(b"@")?;
    Some(std::ffi::OsStr::from_bytes(name).into())
}

#[cfg(not(unix))]
fn listed(entry: &Path) -> Option<PathBuf> {
    entry.to_str()?.strip_prefix('@').map(PathBuf::from)
}

/// Largest list of meshes that is read (bytes).
const LIST_LIMIT: u64 = 1 << 30;

struct Search {
    output: Option<PathBuf>,
    known: HashSet<PathBuf>,
    inputs: Inputs,
}

impl Search {
    fn list(&mut self, list: &Path, base: &Path) -> Result<(), InputError> {
        let path = base.join(list);
        let unreadable = |reason: String| InputError::List {
            path: path.clone(),
            reason,
        };
        let bytes =
            read_bounded(&path, LIST_LIMIT).map_err(|error| unreadable(error.to_string()))?;
        let text = String::from_utf8(bytes).map_err(|error| {
            unreadable(format!(
                "byte {} is not UTF-8 text",
                error.utf8_error().valid_up_to()
            ))
        })?;
        let folder = list.parent().unwrap_or(Path::new(""));
        for (number, line) in (1..).zip(text.lines()) {
            let line = line.trim();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            if line.starts_with('@') {
                return Err(InputError::ListInList { path, line: number });
            }
            self.entry(&folder.join(line), base, true)?;
        }
        self.inputs.lists.push(path);
        Ok(())
    }

    fn entry(&mut self, given: &Path, base: &Path, listed: bool) -> Result<(), InputError> {
        let path = base.join(given);
        if path.is_dir() {
            let before = self.inputs.files.len();
            self.folder(&path, given);
            self.note_empty(before, given, "holds no mesh file");
            return Ok(());
        }
        let is_glob = given
            .to_str()
            .is_some_and(|text| text.contains(['*', '?', '[']));
        if is_glob && !path.exists() {
            return self.glob(given, base);
        }
        // A file of a list is known by its place, like one that is found.
        let below = (listed && given.is_relative()).then(|| given.to_owned());
        self.put(path, given.to_owned(), below);
        Ok(())
    }

    fn note_empty(&mut self, before: usize, given: &Path, what: &str) {
        if self.inputs.files.len() == before {
            let extensions = EXTENSIONS.join(", ");
            let note = format!("{} {what} ({extensions})", given.display());
            self.inputs.notes.push(note);
        }
    }

    fn folder(&mut self, root: &Path, given: &Path) {
        let mut pending = vec![PathBuf::new()];
        let mut found = Vec::new();
        while let Some(below) = pending.pop() {
            let folder = root.join(&below);
            if self.is_output(&folder) {
                continue;
            }
            let entries = match fs::read_dir(&folder) {
                Ok(entries) => entries,
                Err(error) => {
                    let note = format!("{} cannot be searched: {error}", folder.display());
                    self.inputs.notes.push(note);
                    continue;
                }
            };
            let entries: Vec<fs::DirEntry> = entries.flatten().collect();
            if entries.iter().any(is_result) {
                let note = format!(
                    "{} holds results of affine-atlas: nothing in it is built",
                    folder.display()
                );
                self.inputs.notes.push(note);
                continue;
            }
            for entry in entries {
                let name = entry.file_name();
                if name.to_string_lossy().starts_with('.') {
                    continue;
                }
                let kind = entry.file_type();
                let is_link = kind.as_ref().is_ok_and(fs::FileType::is_symlink);
                let path = entry.path();
                if kind.is_ok_and(|kind| kind.is_dir()) {
                    pending.push(below.join(name));
                } else if is_link && path.is_dir() {
                    let note = format!(
                        "{} is a link to a folder, which is not searched: name the link among the inputs where its meshes are wanted",
                        path.display()
                    );
                    self.inputs.notes.push(note);
                } else if is_wanted(&path) {
                    found.push(below.join(name));
                }
            }
        }
        found.sort();
        for below in found {
            self.put(root.join(&below), given.join(&below), Some(below));
        }
    }

    fn glob(&mut self, given: &Path, base: &Path) -> Result<(), InputError> {
        let refused = |reason: String| InputError::Glob {
            glob: given.display().to_string(),
            reason,
        };
        let text = given.to_string_lossy();
        let start = match (given.is_absolute(), base.to_str()) {
            (false, Some(base)) if !base.is_empty() => format!("{}/", glob::Pattern::escape(base)),
            (false, None) => return Err(refused("its folder's name is not UTF-8 text".to_owned())),
            _ => String::new(),
        };
        let options = glob::MatchOptions {
            case_sensitive: true,
            require_literal_separator: true,
            // Asked of the library it would panic at names that are not Unicode.
            require_literal_leading_dot: false,
        };
        let matches = glob::glob_with(&format!("{start}{text}"), options);
        let matches = matches.map_err(|error| refused(error.msg.to_owned()))?;
        let fixed = fixed_part(given);
        let before = self.inputs.files.len();
        for path in matches {
            let path = match path {
                Ok(path) => path,
                Err(error) => {
                    self.inputs.notes.push(error.to_string());
                    continue;
                }
            };
            if !is_wanted(&path) || path.parent().is_some_and(|p| self.inside_output(p)) {
                continue;
            }
            let shown = path.strip_prefix(base).unwrap_or(&path).to_owned();
            let below = shown.strip_prefix(&fixed).unwrap_or(&shown).to_owned();
            if is_hidden(&below) && !is_hidden(given) {
                continue;
            }
            self.put(path, shown, Some(below));
        }
        self.note_empty(before, given, "matches no mesh file");
        Ok(())
    }

    fn put(&mut self, path: PathBuf, given: PathBuf, below: Option<PathBuf>) {
        if self.known.insert(path.clone()) {
            self.inputs.files.push(Input { path, given, below });
        }
    }

    fn is_output(&self, folder: &Path) -> bool {
        let same = |output: &PathBuf| folder.canonicalize().is_ok_and(|folder| folder == *output);
        self.output.as_ref().is_some_and(same)
    }

    fn inside_output(&self, folder: &Path) -> bool {
        let inside = |output: &PathBuf| {
            folder
                .canonicalize()
                .is_ok_and(|folder| folder.starts_with(output))
        };
        self.output.as_ref().is_some_and(inside)
    }
}

/// Whether an entry of a folder is found in those only that this program writes.
fn is_result(entry: &fs::DirEntry) -> bool {
    let (name, path) = (entry.file_name(), entry.path());
    let document = match name.to_string_lossy().starts_with("component-") {
        true => path.join("atlas.json"),
        false if DOCUMENTS.iter().any(|document| name == *document) => path,
        false => return false,
    };
    // Other programs have files of this name.
    let mut start = Vec::new();
    let read = fs::File::open(document).and_then(|file| file.take(START).read_to_end(&mut start));
    read.is_ok() && String::from_utf8_lossy(&start).contains("\"format\": \"affine-atlas")
}

/// Whether a path names a file that meshes are read from, or a link to one that is missing: that fails like any file that cannot be read.
fn is_wanted(path: &Path) -> bool {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let is_mesh = extension.is_some_and(|extension| EXTENSIONS.contains(&extension.as_str()));
    is_mesh && (path.is_file() || path.is_symlink() && !path.exists())
}

/// Whether a part of the path begins with a dot, and is not `.` or `..`.
fn is_hidden(path: &Path) -> bool {
    path.components().any(|part| match part {
        Component::Normal(name) => name.as_encoded_bytes().starts_with(b"."),
        _ => false,
    })
}

/// The folders of a glob before its first wildcard.
fn fixed_part(glob: &Path) -> PathBuf {
    let plain = |part: &std::path::Component<'_>| {
        !part.as_os_str().to_string_lossy().contains(['*', '?', '['])
    };
    glob.components().take_while(plain).collect()
}

#[cfg(test)]
mod tests;
