//! Reading a plan: only the whole of what was written, by the same version, is one.

use super::{
    Configuration, End, FORMAT, FORMAT_VERSION, Header, Line, Plan, PlanError, Planned, PlannedLine,
};
use crate::batch::cache::VERSION;
use crate::batch::task::Settings;
use crate::export::folder::is_asset_name;
use crate::read::bounded::open_regular;
use serde::Deserialize;
use std::collections::HashSet;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use std::sync::Arc;

/// No line is longer, bytes: another file that was named by mistake is not read into memory.
const LONGEST_LINE: u64 = 64 << 20;
/// Most letters of an id.
const LONGEST_ID: usize = 64;

impl Plan {
    /// Reads a plan.
    ///
    /// # Errors
    /// [`PlanError`] for whatever is not a whole plan of this version.
    pub fn read(path: &Path) -> Result<Self, PlanError> {
        let unreadable = |error: io::Error| PlanError::Unreadable {
            path: path.to_owned(),
            reason: match error.kind() {
                io::ErrorKind::NotFound => "there is no such file".to_owned(),
                _ => error.to_string(),
            },
        };
        let (file, _) = open_regular(path).map_err(unreadable)?;
        let mut lines = Lines {
            path,
            from: BufReader::new(file),
            hasher: blake3::Hasher::new(),
            number: 0,
        };
        let header = lines.header()?;
        let (mut configurations, mut assets) = (Vec::new(), Vec::new());
        let end = loop {
            match lines.next()? {
                Line::Configuration(one) if assets.is_empty() => {
                    configurations.push((lines.number, *one));
                }
                Line::Asset(one) => assets.push((lines.number, *one)),
                Line::End(end) => break end,
                _ => return Err(lines.damaged("it is not where it belongs")),
            }
        };
        lines.finish(&end)?;
        let settings = restore(path, configurations)?;
        let damaged = |line, reason: String| PlanError::Damaged {
            path: path.to_owned(),
            line,
            reason,
        };
        let mut known = HashSet::new();
        let mut planned = Vec::with_capacity(assets.len());
        for (line, one) in assets {
            let PlannedLine {
                mut task,
                configuration,
                decision,
                reason,
                estimate,
            } = one;
            match settings.get(configuration) {
                Some(settings) if settings.hash == task.config_hash => {
                    task.settings = Arc::clone(settings);
                }
                Some(settings) => {
                    let reason = format!(
                        "its configuration has the hash {}, not {}",
                        settings.hash, task.config_hash
                    );
                    return Err(damaged(line, reason));
                }
                None => {
                    let reason = format!(
                        "it names configuration {configuration} of {}",
                        settings.len()
                    );
                    return Err(damaged(line, reason));
                }
            }
            if !is_asset_name(&task.id) {
                return Err(damaged(
                    line,
                    format!("{:?} is no name of an asset", task.id),
                ));
            }
            if !known.insert(task.id.clone()) {
                return Err(damaged(line, format!("{} is there twice", task.id)));
            }
            planned.push(Planned {
                task,
                decision,
                reason,
                estimate,
            });
        }
        let counts = (header.configurations, header.assets);
        if counts != (settings.len(), planned.len()) {
            let reason = format!(
                "it states {} configurations and {} assets, and {} and {} follow",
                counts.0,
                counts.1,
                settings.len(),
                planned.len()
            );
            return Err(damaged(1, reason));
        }
        Ok(Self {
            header,
            assets: planned,
        })
    }
}

/// Settings as they were, of configurations with their line numbers.
fn restore(
    path: &Path,
    configurations: Vec<(usize, Configuration)>,
) -> Result<Vec<Arc<Settings>>, PlanError> {
    let one = |(line, one): (usize, Configuration)| {
        let mut config = one.config;
        config.cones.file_lines = one.cone_lines;
        let settings = Settings::new(config);
        match settings.hash == one.config_hash {
            true => Ok(Arc::new(settings)),
            false => Err(PlanError::OtherConfig {
                path: path.to_owned(),
                line,
                found: settings.hash,
                stated: one.config_hash,
            }),
        }
    };
    configurations.into_iter().map(one).collect()
}

/// Reads a plan line by line and hashes it.
struct Lines<'p> {
    path: &'p Path,
    from: BufReader<File>,
    hasher: blake3::Hasher,
    /// Of the line that was read last, from 1.
    number: usize,
}

impl Lines<'_> {
    fn damaged(&self, reason: impl ToString) -> PlanError {
        PlanError::Damaged {
            path: self.path.to_owned(),
            line: self.number,
            // To its parser every line is the first.
            reason: reason
                .to_string()
                .replace(" at line 1 column ", " at column "),
        }
    }

    /// The bytes of the next line without its break; none at the end of the file or where a line is cut or too long.
    fn bytes(&mut self) -> Result<Option<Vec<u8>>, PlanError> {
        let mut bytes = Vec::new();
        let mut limited = self.from.by_ref().take(LONGEST_LINE);
        let read = limited.read_until(b'\n', &mut bytes);
        read.map_err(|error| PlanError::Unreadable {
            path: self.path.to_owned(),
            reason: error.to_string(),
        })?;
        Ok((bytes.pop() == Some(b'\n')).then_some(bytes))
    }

    fn header(&mut self) -> Result<Header, PlanError> {
        let path = || self.path.to_owned();
        let no_plan = PlanError::NoPlan { path: path() };
        let cut = PlanError::Cut {
            path: path(),
            lines: 0,
        };
        #[derive(Deserialize)]
        struct Outline {
            format: String,
            version: u32,
        }
        let Some(bytes) = self.bytes()? else {
            return Err(no_plan);
        };
        let outline = serde_json::from_slice(&bytes);
        let Ok(Outline { format, version }) = outline else {
            return Err(match bytes.starts_with(b"{\"record\":\"plan\"") {
                true => cut,
                false => no_plan,
            });
        };
        if format != FORMAT {
            return Err(no_plan);
        }
        let path = self.path.to_owned();
        if version != FORMAT_VERSION {
            return Err(PlanError::Format {
                path,
                found: version,
            });
        }
        self.number = 1;
        self.hash(&bytes);
        let header = match Line::read(&bytes) {
            Ok(Line::Plan(header)) => header,
            Ok(_) => return Err(no_plan),
            Err(error) => return Err(self.damaged(error)),
        };
        if header.program_version != VERSION {
            return Err(PlanError::Version {
                path,
                found: header.program_version,
            });
        }
        let in_id = |c: char| c.is_ascii_alphanumeric();
        if !(1..=LONGEST_ID).contains(&header.id.len()) || !header.id.chars().all(in_id) {
            return Err(self.damaged(format!("{:?} is no id of a plan", header.id)));
        }
        Ok(header)
    }

    /// The next line, which must be there.
    fn next(&mut self) -> Result<Line, PlanError> {
        let Some(bytes) = self.bytes()? else {
            return Err(PlanError::Cut {
                path: self.path.to_owned(),
                lines: self.number,
            });
        };
        self.number += 1;
        let line = Line::read(&bytes).map_err(|error| self.damaged(error))?;
        if !matches!(line, Line::End(_)) {
            self.hash(&bytes);
        }
        Ok(line)
    }

    fn hash(&mut self, line: &[u8]) {
        self.hasher.update(line);
        self.hasher.update(b"\n");
    }

    /// Nothing may follow the end, and the hash must be that of the lines before.
    fn finish(mut self, end: &End) -> Result<(), PlanError> {
        let found = self.hasher.finalize().to_hex().to_string();
        if found != end.blake3 {
            return Err(PlanError::Changed {
                path: self.path.to_owned(),
                found,
                stated: end.blake3.clone(),
            });
        }
        let more = self.from.fill_buf().is_ok_and(|rest| !rest.is_empty());
        match more {
            false => Ok(()),
            true => {
                self.number += 1;
                Err(self.damaged("it follows the last one"))
            }
        }
    }
}
