//! Why the command itself (not one asset) cannot go on, and how that is shown.

use super::arguments::LogFormat;
use super::{exit, terminal};
use affine_atlas::batch::inputs::InputError;
use affine_atlas::batch::plan::PlanError;
use affine_atlas::config::ConfigError;
use miette::{
    Diagnostic, GraphicalReportHandler, GraphicalTheme, LabeledSpan, NamedSource, SourceCode,
    ThemeCharacters, ThemeStyles,
};
use std::fmt;
use std::path::PathBuf;

/// Why the command cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum Problem {
    #[error(transparent)]
    Config(#[from] ConfigError),
    #[error("two configurations are named, {} and {}", first.display(), second.display())]
    TwoConfigs { first: PathBuf, second: PathBuf },
    #[error(transparent)]
    Input(#[from] InputError),
    #[error(transparent)]
    Plan(#[from] PlanError),
    #[error("the current folder cannot be found: {reason}")]
    NoPlace { reason: String },
    #[error("{missing} of {all} meshes {} not done ({first}): {shards}", if *missing == 1 { "is" } else { "are" })]
    NotDone {
        missing: usize,
        all: usize,
        first: String,
        shards: String,
        again: String,
    },
    #[error("no mesh is named: `input.paths` is empty")]
    NoInputs,
    #[error("no mesh was found: {}", notes.join("; "))]
    NothingFound { notes: Vec<String>, output: PathBuf },
    #[error(
        "the output folder {} of this run would replace the folder of its input {}",
        folder.display(), input.display()
    )]
    OverwritesInput { folder: PathBuf, input: PathBuf },
    #[error("{} exists already", path.display())]
    Exists { path: PathBuf },
    #[error("{} cannot be written: {reason}", path.display())]
    NotWritten { path: PathBuf, reason: String },
    #[error("{} cannot be written: {reason}", path.display())]
    NotRecorded { path: PathBuf, reason: String },
    #[error("standard output cannot be written: {reason}")]
    NotPrinted { reason: String },
    #[error("{} does not end in .glb, the only format that meshes are written in", path.display())]
    NotGlb { path: PathBuf },
    #[error("{} does not end in the name of a folder to write", path.display())]
    NoName { path: PathBuf },
    #[error("{}", match path.exists() {
        true => format!("{} is no folder; give one that `build` wrote", path.display()),
        false => format!("there is no folder {}", path.display()),
    })]
    NoFolder { path: PathBuf },
    #[error("the {given} threads of this run cannot be started: {reason}")]
    Threads { given: usize, reason: String },
    #[error("{0}")]
    Internal(String),
}

impl Problem {
    /// Exit code of the output format (`docs/format.md`).
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::NoInputs | Self::NothingFound { .. } => exit::NOTHING_TO_DO,
            Self::NotRecorded { .. } | Self::NotDone { .. } | Self::NotPrinted { .. } => {
                exit::SOME_FAILED
            }
            Self::Internal(_) => exit::INTERNAL,
            _ => exit::USAGE,
        }
    }

    fn remedy(&self) -> Option<String> {
        let text = match self {
            Self::Config(error) => return Some(error.remedy()),
            Self::TwoConfigs { .. } => {
                "name one; single keys can be changed with `--set key=value`"
            }
            Self::NoInputs => {
                "name a mesh: `affine-atlas build MESH`, or list meshes in `input.paths`"
            }
            Self::Input(error) => error.remedy(),
            Self::Plan(error) => error.remedy(),
            Self::NoPlace { .. } => "start the command in a folder that exists",
            Self::NotDone { again, .. } => {
                return Some(format!(
                    "wait, or run what is missing: `{again}`; or merge what is there with `--incomplete`"
                ));
            }
            Self::NothingFound { .. } => {
                "check names and folders; quotes keep the shell from replacing `*` by itself"
            }
            Self::OverwritesInput { .. } => "choose another folder with `--out`",
            Self::Exists { .. } => "choose another name, or replace it with `--force`",
            Self::NotWritten { .. } | Self::NotRecorded { .. } => {
                "check that its folder exists, may be written and has space left"
            }
            Self::NotPrinted { .. } => "check that there is space where it goes, and run it again",
            Self::NotGlb { .. } => "name the file with `--out MESH.glb`",
            Self::NoName { .. } => "name it with `--out FOLDER`",
            Self::NoFolder { .. } => "name a folder that `affine-atlas build` wrote",
            Self::Threads { .. } => "ask for fewer with `--threads`",
            Self::Internal(_) => return None,
        };
        Some(text.to_owned())
    }

    /// Writes it on standard error.
    pub fn show(&self, format: LogFormat) {
        match format {
            LogFormat::Text => terminal::print_error(&self.render()),
            LogFormat::Json => tracing::error!(
                target: "affine_atlas",
                exit_code = self.exit_code(),
                remedy = self.remedy(),
                "{self}"
            ),
        }
    }

    /// As text with the offending line, coloured where standard error is a terminal with colours.
    fn render(&self) -> String {
        let terminal = terminal::stderr_is_terminal();
        let mut characters = if terminal {
            ThemeCharacters::unicode()
        } else {
            ThemeCharacters::ascii()
        };
        characters.error = "error:".to_owned();
        characters.underline = '^';
        let theme = GraphicalTheme {
            characters,
            styles: if console::colors_enabled_stderr() {
                ThemeStyles::ansi()
            } else {
                ThemeStyles::none()
            },
        };
        let handler = GraphicalReportHandler::new_themed(theme)
            .with_width(terminal::stderr_width())
            .with_context_lines(1)
            .with_links(false);
        let mut text = String::new();
        match handler.render_report(&mut text, &Shown::new(self)) {
            Ok(()) => text,
            // The plain sentence, should a text defeat the layout.
            Err(_) => format!("error: {self}\n"),
        }
    }
}

/// A [`Problem`] in the shape that miette lays out.
#[derive(Debug)]
struct Shown {
    message: String,
    remedy: Option<String>,
    source: Option<NamedSource<String>>,
    label: Option<LabeledSpan>,
}

impl Shown {
    fn new(problem: &Problem) -> Self {
        let location = match problem {
            Problem::Config(error) => error.location(),
            _ => None,
        };
        let sentence = problem.to_string();
        let message = match location {
            // The frame around the excerpt states the place.
            Some(at) => match sentence.strip_prefix(&format!("{at}: ")) {
                Some(rest) => rest.to_owned(),
                None => sentence,
            },
            None => sentence,
        };
        Self {
            message,
            remedy: problem.remedy(),
            source: location.map(|at| NamedSource::new(&at.name, at.text.to_string())),
            label: location.map(|at| LabeledSpan::new(None, at.span.start, at.offending().len())),
        }
    }
}

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Shown {}

impl Diagnostic for Shown {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.remedy
            .as_ref()
            .map(|remedy| Box::new(remedy) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.source.as_ref().map(|source| source as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        self.label
            .clone()
            .map(|label| Box::new(std::iter::once(label)) as Box<dyn Iterator<Item = LabeledSpan>>)
    }
}
