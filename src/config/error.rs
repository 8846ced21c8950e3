//! What can be wrong with a configuration, with the place in the text.

use crate::atlas::patch::Domain;
use std::fmt;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

/// A place in a configuration text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Location {
    /// The file as the user gave it, or `--set` for an override.
    pub name: String,
    /// The whole text.
    pub text: Arc<str>,
    /// The offending bytes of `text`, at character boundaries.
    pub span: Range<usize>,
    /// Line of the first offending character, from 1.
    pub line: usize,
    /// Column of the first offending character in characters, from 1.
    pub column: usize,
}

impl Location {
    /// The place of `span` in `text`; a span that does not fit is clamped.
    #[must_use]
    pub fn new(name: &str, text: &Arc<str>, span: Range<usize>) -> Self {
        let start = floor_char_boundary(text, span.start);
        let end = floor_char_boundary(text, span.end).max(start);
        let before = &text[..start];
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        Self {
            name: name.to_owned(),
            text: Arc::clone(text),
            span: start..end,
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
        }
    }

    /// The offending text, its first line only.
    #[must_use]
    pub fn offending(&self) -> &str {
        self.text[self.span.clone()].lines().next().unwrap_or("")
    }

    /// The offending line and a second line with a caret under each offending character.
    #[must_use]
    pub fn excerpt(&self) -> String {
        let line = self.text.lines().nth(self.line - 1).unwrap_or("");
        // Tabs are kept so that the carets stay under their characters.
        let indent: String = line
            .chars()
            .take(self.column - 1)
            .map(|c| if c == '\t' { '\t' } else { ' ' })
            .collect();
        let carets = self.offending().chars().count().max(1);
        format!("{line}\n{indent}{}", "^".repeat(carets))
    }
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.name, self.line, self.column)
    }
}

fn floor_char_boundary(text: &str, index: usize) -> usize {
    let mut index = index.min(text.len());
    while !text.is_char_boundary(index) {
        index -= 1;
    }
    index
}

/// Why a configuration was refused. [`fmt::Display`] gives one sentence that begins with the place;
/// [`ConfigError::remedy`] says what to change.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ConfigError {
    /// The file does not exist.
    #[error("there is no configuration file {}", path.display())]
    NotFound {
        /// As given.
        path: PathBuf,
    },
    /// The file exists but cannot be read as text.
    #[error("the configuration file {} cannot be read: {reason}", path.display())]
    Unreadable {
        /// As given.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// The file is too long to be a configuration.
    #[error("{} has {bytes} bytes, but a configuration has at most {limit}", path.display())]
    TooLong {
        /// As given.
        path: PathBuf,
        /// Its length.
        bytes: u64,
        /// Most bytes read.
        limit: u64,
    },
    /// An override without `=`.
    #[error("`--set {given}` gives no value")]
    OverrideWithoutValue {
        /// As given.
        given: String,
    },
    /// Not TOML.
    #[error("{at}: not valid TOML: {reason}")]
    Syntax {
        /// Where.
        at: Box<Location>,
        /// What the parser said.
        reason: String,
    },
    /// A key or section that does not exist.
    #[error("{at}: unknown {} `{key}`", if *section { "section" } else { "key" })]
    UnknownKey {
        /// Where.
        at: Box<Location>,
        /// Its full path.
        key: String,
        /// Whether it was written as a section.
        section: bool,
        /// The key or section that was probably meant.
        nearest: Option<&'static str>,
        /// What could stand there.
        known: Vec<&'static str>,
    },
    /// A key of an earlier version.
    #[error("{at}: there is no key `{key}` any more: {instead}")]
    RemovedKey {
        /// Where.
        at: Box<Location>,
        /// Its full path.
        key: String,
        /// What is so in its stead.
        instead: &'static str,
    },
    /// A word that a key had in an earlier version.
    #[error("{at}: `{key}` is not {word:?} any more: {instead}")]
    RemovedWord {
        /// Where.
        at: Box<Location>,
        /// Its full path.
        key: String,
        /// As given.
        word: String,
        /// What is so in its stead.
        instead: &'static str,
    },
    /// A value of another type than the key takes.
    #[error("{at}: `{key}` takes {expected}, but was given {got}")]
    WrongType {
        /// Where.
        at: Box<Location>,
        /// Its full path.
        key: String,
        /// What the key takes.
        expected: String,
        /// What was given.
        got: String,
    },
    /// A word that is not one of those listed.
    #[error("{at}: `{key}` has no choice \"{given}\"")]
    UnknownChoice {
        /// Where.
        at: Box<Location>,
        /// Its full path.
        key: String,
        /// What was given.
        given: String,
        /// What the key takes.
        allowed: String,
        /// The word that was probably meant.
        nearest: Option<&'static str>,
    },
    /// A number outside its range.
    #[error("{at}: `{key}` takes {allowed}, but was given {given}")]
    OutOfRange {
        /// Where.
        at: Box<Location>,
        /// Its full path.
        key: String,
        /// What was given.
        given: String,
        /// What the key takes.
        allowed: String,
    },
    /// A file of cones or features cannot be read.
    #[error("`{key}` names {}, which cannot be read: {reason}", path.display())]
    NoListFile {
        /// The key that names it.
        key: &'static str,
        /// Relative to the current folder or absolute.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// A line of such a file that is not understood.
    #[error("{at}: {reason}")]
    FileLine {
        /// The key that names the file.
        key: &'static str,
        /// Where.
        at: Box<Location>,
        /// Why.
        reason: String,
    },
    /// Two keys that say the same thing in different ways.
    #[error("`{one}` and `{other}` exclude each other")]
    Both {
        /// The key of one.
        one: &'static str,
        /// The key of the other.
        other: &'static str,
    },
    /// A setting that has a meaning without the domain only that was written.
    #[error(
        "`{key}` is for {}, but `images.domain` is \"{}\"",
        if *domain == Domain::Grid { "flat patches" } else { "grids" },
        if *domain == Domain::Grid { "grid" } else { "flat" }
    )]
    Domain {
        /// The key.
        key: &'static str,
        /// The domain as written.
        domain: Domain,
    },
    /// Two settings of which one has a meaning for flat patches only, the other for grids only.
    #[error("`{flat}` is for flat patches, but `{grid}` is for grids")]
    Domains {
        /// A key for flat patches.
        flat: &'static str,
        /// A key for grids.
        grid: &'static str,
    },
    /// A key of an `[[asset]]` table that no single mesh can have.
    #[error("{at}: `{key}` concerns the whole run and not single meshes")]
    NotForOneAsset {
        /// Where.
        at: Box<Location>,
        /// Its path, without that of the table.
        key: String,
    },
    /// An `[[asset]]` table for nobody.
    #[error("{at}: an `[[asset]]` table says {} `glob` {} by `path` which meshes it is for", if *both { "both by" } else { "neither by" }, if *both { "and" } else { "nor" })]
    NotOnePattern {
        /// Where.
        at: Box<Location>,
        /// Whether there are two patterns, and not none.
        both: bool,
    },
    /// A value that the stage itself refuses.
    #[error("{at}: `{key}` is not usable: {reason}")]
    Refused {
        /// Where.
        at: Box<Location>,
        /// Its full path.
        key: String,
        /// Why.
        reason: String,
    },
}

impl ConfigError {
    /// Where in which text, if the text could be read at all.
    #[must_use]
    pub fn location(&self) -> Option<&Location> {
        match self {
            Self::NotFound { .. }
            | Self::Unreadable { .. }
            | Self::TooLong { .. }
            | Self::NoListFile { .. }
            | Self::Both { .. }
            | Self::Domain { .. }
            | Self::Domains { .. }
            | Self::OverrideWithoutValue { .. } => None,
            Self::Syntax { at, .. }
            | Self::FileLine { at, .. }
            | Self::UnknownKey { at, .. }
            | Self::RemovedKey { at, .. }
            | Self::RemovedWord { at, .. }
            | Self::WrongType { at, .. }
            | Self::UnknownChoice { at, .. }
            | Self::OutOfRange { at, .. }
            | Self::NotForOneAsset { at, .. }
            | Self::NotOnePattern { at, .. }
            | Self::Refused { at, .. } => Some(at),
        }
    }

    /// What to change.
    #[must_use]
    pub fn remedy(&self) -> String {
        match self {
            Self::NotFound { .. } => "write one with `affine-atlas init`, or name a mesh file \
                 instead: `affine-atlas build MESH --out FOLDER`"
                .to_owned(),
            Self::Unreadable { .. } => {
                "check the file's permissions and that it is UTF-8 text".to_owned()
            }
            Self::TooLong { .. } => "name a TOML file such as the one `affine-atlas init` writes; \
                 meshes are named without a configuration file"
                .to_owned(),
            Self::OverrideWithoutValue { .. } => {
                "write `--set section.key=value`, for example `--set flow.scheme=thurston`"
                    .to_owned()
            }
            Self::NoListFile { key, .. } => format!(
                "`{key}` starts at the configuration's folder (with `--set` at the current one); check the name and that it is UTF-8 text"
            ),
            Self::FileLine { key, .. } => {
                let line = match *key {
                    "cones.file" => {
                        "the number of a vertex and its curvature in radians, for example `17 1.570796`"
                    }
                    _ => {
                        "two vertices or more, each joined to the next by an edge, for example `17 18 25`"
                    }
                };
                format!("each line holds {line}; `{key}_first_vertex` says where numbers begin")
            }
            Self::Both { .. } => "remove one of them".to_owned(),
            Self::Domain { key, domain } => {
                let other = match domain {
                    Domain::Grid => "flat",
                    Domain::Flat => "grid",
                };
                format!("leave `{key}` out, or set `images.domain = \"{other}\"`")
            }
            Self::Domains { flat, grid } => format!("leave `{flat}` or `{grid}` out"),
            Self::NotForOneAsset { .. } => "write it outside of the `[[asset]]` tables".to_owned(),
            Self::NotOnePattern { .. } => {
                "give one of them, for example `glob = \"scans/*.ply\"`".to_owned()
            }
            Self::Syntax { .. } => {
                "texts need quotes, lists need [ ], and each key stands once, on its own line"
                    .to_owned()
            }
            Self::UnknownKey { key, .. } if is_section_below_another(key) => {
                let section = key.rsplit('.').next().unwrap_or_default();
                format!(
                    "`{section}` is a section of its own: write `[{section}]` on a line before its keys"
                )
            }
            Self::UnknownKey {
                nearest: Some(nearest),
                ..
            } => format!("did you mean `{nearest}`?"),
            Self::UnknownKey {
                section: true,
                known,
                ..
            } => {
                format!("the sections are {}", list(known))
            }
            Self::UnknownKey { known, .. } => format!("known here: {}", list(known)),
            Self::RemovedKey { key, .. } | Self::RemovedWord { key, .. } => {
                format!("remove `{key}`")
            }
            Self::UnknownChoice {
                nearest, allowed, ..
            } => match nearest {
                Some(nearest) => format!("did you mean \"{nearest}\"? Allowed: {allowed}"),
                None => format!("allowed: {allowed}"),
            },
            Self::WrongType { key, .. }
            | Self::OutOfRange { key, .. }
            | Self::Refused { key, .. } => match super::keys::find(key) {
                Some(known) => format!("`{key}`: {}", known.describe()),
                None => {
                    "`affine-atlas init` writes a configuration that explains every key".to_owned()
                }
            },
        }
    }
}

/// `run.grid`: what follows the heading `[run]` belongs to it.
fn is_section_below_another(key: &str) -> bool {
    let below = key.split_once('.').map(|(_, below)| below);
    below.is_some_and(|below| super::keys::sections().contains(&below))
}

fn list(words: &[&str]) -> String {
    let quoted: Vec<String> = words.iter().map(|word| format!("`{word}`")).collect();
    quoted.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn location_counts_lines_and_characters() {
        let text: Arc<str> = Arc::from("[a]\nπ = \"β\"\n");
        let start = text.find('β').expect("present");
        let at = Location::new("f.toml", &text, start..start + 'β'.len_utf8());
        assert_eq!((at.line, at.column), (2, 6));
        assert_eq!(at.offending(), "β");
        assert_eq!(at.excerpt(), "π = \"β\"\n     ^");
        assert_eq!(at.to_string(), "f.toml:2:6");
    }

    #[test]
    fn location_clamps_any_span() {
        let text: Arc<str> = Arc::from("π");
        for start in 0..4 {
            for end in 0..4 {
                let at = Location::new("f", &text, Range { start, end });
                assert!(!at.excerpt().is_empty());
                assert_eq!(at.line, 1);
            }
        }
    }
}
