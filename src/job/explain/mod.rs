//! Why an asset failed, or where and why it is distorted: what `affine-atlas explain` says.
//!
//! *Enters:* a mesh file with a configuration, or a folder that a build wrote. *Leaves:* an [`Explanation`]: sentences with the faces
//! and vertices at fault and what to change, and the same faces in colour as a GLB.
//!
//! A mesh goes through the stages of a build up to the flat metric, so that what stops it stops here too; what a later stage
//! refuses is not found (the manifest has its sentence).

mod distortion;
mod failure;
mod turns;

use super::flatten::{Flattened, flatten, prepared_at_first, prescribed};
use super::listing::{MOST_LISTED, counted, left_out};
use super::{BuildError, shares};
use crate::atlas::patch::Domain;
use crate::config::Config;
use crate::export::ExportError;
use crate::export::glb::marked::{self, Marked};
use crate::export::manifest::{Manifest, Record, State};
use crate::flow::cones;
use crate::flow::cones::Requests;
use crate::geometry::mesh::Soup;
use crate::outcome::{Failure, FailureKind};
use crate::read::atlas::{FolderError, component_folders};
use crate::read::metric::read_metric;
use crate::repair::Component;
use crate::{read, repair};
use distortion::Flat;
use std::fmt;
use std::path::Path;

/// What is said of one asset.
#[derive(Clone, Debug, Default)]
pub struct Explanation {
    lines: Vec<String>,
    surfaces: Vec<Marked>,
    failed: bool,
}

impl Explanation {
    /// Whether a part of it could not be built.
    #[must_use]
    pub fn failed(&self) -> bool {
        self.failed
    }

    /// The surfaces with the faces at fault in colour; `None` where no face stands out.
    pub fn glb(&self) -> Option<Result<Vec<u8>, ExportError>> {
        let any = self.surfaces.iter().any(Marked::has_marks);
        any.then(|| marked::encode(&self.surfaces))
    }

    /// The line that begins a component, where there are several, and by what its others are indented.
    fn head(&mut self, name: &str, count: usize) -> &'static str {
        if count == 1 {
            return "";
        }
        self.lines.push(format!("{name}:"));
        "  "
    }

    fn say(&mut self, indent: &str, lines: Vec<String>) {
        self.lines
            .extend(lines.into_iter().map(|line| format!("{indent}{line}")));
    }

    /// A failure, and the faces of the file that it names.
    fn refuse(&mut self, indent: &str, name: String, error: &BuildError, soup: &Soup) {
        self.failed = true;
        self.lines
            .push(format!("{indent}fails ({}): {error}", error.kind().name()));
        let places = failure::places(error);
        self.say(indent, failure::describe(&places, soup));
        self.surfaces.push(failure::marked(name, &places, soup));
    }
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.lines.iter().try_for_each(|line| writeln!(f, "{line}"))
    }
}

/// Explains a mesh: runs every check that a build runs, and flattens it.
///
/// # Errors
/// A file that cannot be read: then there is no surface to show.
pub fn mesh(path: &Path, config: &Config) -> Result<Explanation, BuildError> {
    let config = &config.clone().resolved()?;
    let otherwise = &config.on_flat_patches();
    let asset = read::read(path, &config.limits)?;
    let soup = &asset.soup;
    let mut explanation = Explanation::default();
    let repaired = match repair::repair(soup, &config.repair) {
        Ok(repaired) => repaired,
        Err(error) => {
            let log = failure::log_without_limits(soup, &config.repair);
            explanation.refuse("", "mesh".into(), &error.into(), soup);
            if let Some(log) = log {
                explanation.say("", failure::repairs(&log));
                if let Some(surface) = explanation.surfaces.last_mut() {
                    failure::mark_repairs(surface, &log);
                }
            }
            return Ok(explanation);
        }
    };
    if !repaired.log.is_empty() {
        explanation.say("", failure::repairs(&repaired.log));
    }
    let assigned = |c: &Config| cones::assign(&repaired, &c.cones, &c.boundary, &c.features);
    let both = assigned(config).and_then(|own| Ok((own, assigned(otherwise)?)));
    let (requests, of_flat) = match both {
        Ok(both) => both,
        Err(error) => {
            explanation.refuse("", "mesh".into(), &error.into(), soup);
            return Ok(explanation);
        }
    };
    let count = repaired.components.len();
    let shares = shares::shares(&repaired.components);
    let parts = repaired.components.into_iter().zip(shares);
    let parts = parts.zip(requests.into_iter().zip(of_flat));
    let mut others = 0;
    for (i, ((component, share), (requests, of_flat))) in parts.enumerate() {
        let config = &shares::of_share(config, share)?;
        let name = format!("component {i}");
        let before = explanation.lines.len();
        let mut is_listed = i < MOST_LISTED;
        let indent = explanation.head(&name, count);
        let flattened = match config.domain() {
            Domain::Flat => flat(component, &requests, config),
            // As a build does.
            Domain::Grid => flat(component.clone(), &requests, config).or_else(|error| {
                let flattened = flat(component, &of_flat, otherwise)?;
                explanation.say(indent, vec![format!("no grid: {error}")]);
                is_listed = true;
                Ok(flattened)
            }),
        };
        match flattened {
            Ok((flat, turns)) => {
                let (lines, surface) = flat.explain(name);
                explanation.say(indent, lines);
                explanation.say(indent, turns);
                explanation.surfaces.push(surface);
            }
            Err(error) => {
                explanation.refuse(indent, name, &error, soup);
                is_listed = true;
            }
        }
        if !is_listed {
            explanation.lines.truncate(before);
            others += 1;
        }
    }
    if others > 0 {
        explanation.lines.push(left_out(others));
    }
    Ok(explanation)
}

/// Everything up to the flat metric, and what is said of its quarter turns.
fn flat(
    component: Component,
    requests: &Requests,
    config: &Config,
) -> Result<(Flat, Vec<String>), BuildError> {
    let frame = component.frame;
    let mesh = prepared_at_first(component.mesh?, requests, config)?;
    let prescription = prescribed(&mesh, requests, config)?;
    let Flattened {
        mesh,
        metric,
        prescription,
        ..
    } = flatten(mesh, prescription, config, &(), &|_| Ok(()))?;
    let turns = metric.quarter_turns.as_ref();
    let turns = turns.map_or_else(Vec::new, |met| turns::describe(&turns::of(met, &mesh)));
    let domain = config.domain();
    let flat = Flat::of(&mesh, &metric, &prescription, &frame, domain);
    Ok((flat, turns))
}

/// Explains what a build wrote: where the atlas is distorted.
///
/// # Errors
/// A folder without an atlas, or one that is damaged.
pub fn folder(folder: &Path) -> Result<Explanation, FolderError> {
    let mut explanation = Explanation::default();
    let folders = component_folders(folder)?;
    let count = folders.len();
    for (i, path) in folders.into_iter().enumerate() {
        let name = match count {
            1 => "surface".to_owned(),
            _ => path.file_name().map_or_else(
                || format!("component {i}"),
                |name| name.to_string_lossy().into_owned(),
            ),
        };
        let before = explanation.lines.len();
        let indent = explanation.head(&name, count);
        let stored = read_metric(&path)?;
        let turns = stored.turns.as_ref().map_or_else(Vec::new, turns::describe);
        let (lines, surface) = Flat::stored(stored).explain(name);
        explanation.say(indent, lines);
        explanation.say(indent, turns);
        explanation.surfaces.push(surface);
        if i >= MOST_LISTED {
            explanation.lines.truncate(before);
        }
    }
    if let Some(others) = count.checked_sub(MOST_LISTED).filter(|n| *n > 0) {
        let more = counted(others, "more component", "more components");
        let how = "explain OUT/ASSET/component-NNN tells of one";
        explanation.lines.push(format!("{more}: {how}"));
    }
    Ok(explanation)
}

/// Explains whatever is named: a mesh file, an asset's folder, or an asset of which an output root has only a record.
///
/// # Errors
/// What is neither, and files that cannot be read.
pub fn asset(path: &Path, config: &Config) -> Result<Explanation, Failure> {
    if path.is_file() {
        return mesh(path, config).map_err(|error| Failure::from(&error));
    }
    let record = recorded(path);
    let mut explanation = match (path.is_dir(), &record) {
        (true, _) => folder(path).map_err(|error| refused(error.to_string()))?,
        (false, Some(_)) => Explanation::default(),
        (false, None) => {
            return Err(refused(format!(
                "{} is neither a mesh nor a folder, and no manifest.jsonl beside it names it; give a mesh, or OUT/NAME of a build",
                path.display()
            )));
        }
    };
    if let Some(record) = record.filter(|record| record.state == State::Failed) {
        let kind = record.kind.map_or("no kind", |kind| kind.name());
        let error = record.error.as_deref().unwrap_or("no reason was recorded");
        let mut lines = vec![
            format!("the last build failed ({kind}): {error}"),
            "for the faces at fault: affine-atlas explain MESH -o FILE.glb".to_owned(),
        ];
        if !explanation.lines.is_empty() {
            lines.push("the atlas of an earlier build is still in place:".to_owned());
        }
        explanation.lines.splice(0..0, lines);
        explanation.failed = true;
    }
    Ok(explanation)
}

/// What the manifest of the output root says of an asset.
fn recorded(path: &Path) -> Option<Record> {
    let id = path.file_name()?.to_str()?;
    let (manifest, _) = Manifest::load(path.parent()?).ok()?;
    manifest.get(id).cloned()
}

fn refused(message: String) -> Failure {
    Failure {
        kind: FailureKind::Input,
        message,
    }
}

#[cfg(test)]
mod tests;
