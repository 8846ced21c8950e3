//! Reads an output folder back, with nothing else, and checks every invariant of an affine atlas.
//!
//! Enters: a folder that holds `atlas.json`, `atlas.npz`, `images/*.exr` and `surface.glb`, or components, or
//! assets. Leaves: [`Verdicts`], one line a check with the measured figure.
//!
//! Guaranteed: shares no code with the stages that made the data (its own halfedge pairing and
//! formulas, and readers that know file formats only), tests every face, texel and sample, never panics and never allocates more than a fixed
//! multiple of what the files hold, whatever they hold. A check that could not run because its data is
//! broken is preceded by the failed check that says so.
//!
//! Not guaranteed: that the atlas belongs to a given source mesh, unless [`verify_against`] is given one.
//!
//! A folder whose `atlas.json` has no `generator` is taken as hand-made: it may lack `surface.glb`, the text
//! attribute of the images, `quarter_turns` and seams along the surface's boundary.

mod arrays;
mod border;
mod central;
mod channels;
mod charts;
mod document;
mod drawing;
mod features;
mod formulas;
mod glb;
mod grid;
mod images;
mod lattice;
mod listed;
mod metric;
mod packed;
mod patches;
mod quality;
mod seams;
mod shapes;
mod sides;
mod source;
mod surface;
mod transitions;

use crate::read::bounded::{JSON_LIMIT, is_inside, read_bounded};
use serde::Serialize;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::fmt;
use std::path::{Path, PathBuf};

pub(crate) use glb::Extent;
pub use source::SourceSurface;

/// Options of [`verify`].
#[derive(Clone, Debug, PartialEq)]
pub struct VerifyOptions {
    /// Largest number of cones that was prescribed; an atlas with more fails. Not checked where absent.
    pub cones: Option<usize>,
    /// Largest gap across edges and gluings, relative to the chart's diameter.
    pub tolerance: f64,
    /// Largest range of the log scale inside a patch (natural logarithm of the length scale) that was asked
    /// for, over single well-shaped faces (a bound on averages over regions is weaker); where absent the range
    /// is only measured.
    pub log_scale_range: Option<f64>,
}

impl Default for VerifyOptions {
    fn default() -> Self {
        Self {
            cones: None,
            tolerance: 1e-8,
            log_scale_range: None,
        }
    }
}

/// Why nothing could be verified at all.
#[derive(Debug, thiserror::Error)]
pub enum VerifyError {
    /// The folder is not there or cannot be listed.
    #[error(
        "cannot read the folder {}: {source}; give the folder of an asset, or the output folder that holds several",
        path.display()
    )]
    Folder {
        /// As given.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The folder holds no atlas.
    #[error(
        "{} holds no atlas.json, no component-000 and no manifest.jsonl; give the folder of an asset, or the output folder that holds several",
        path.display()
    )]
    NothingToVerify {
        /// As given.
        path: PathBuf,
    },
}

/// One check.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Check {
    /// What must hold; where several atlases were verified, after the atlas's folder and `: `.
    pub name: String,
    /// Whether it holds.
    pub passed: bool,
    /// The measured figure, or what is wrong.
    pub figure: String,
}

/// Folders that may have a line each for a check that they pass.
const MOST_LINES: usize = 16;

/// All checks of one run. `Display` gives a line a check and a total; a check that more than 16 folders pass has one line for all of them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Verdicts {
    /// In the order in which they ran.
    pub checks: Vec<Check>,
}

impl Verdicts {
    /// Number of checks that failed.
    pub fn failed(&self) -> usize {
        self.checks.iter().filter(|check| !check.passed).count()
    }

    /// Whether every check passed; false where there was none.
    pub fn all_passed(&self) -> bool {
        !self.checks.is_empty() && self.failed() == 0
    }

    /// `name` has no `: `, which divides it from the folder.
    fn note(&mut self, name: &str, passed: bool, figure: impl fmt::Display) -> bool {
        self.checks.push(Check {
            name: name.to_owned(),
            passed,
            figure: figure.to_string(),
        });
        passed
    }

    fn append(&mut self, part: &str, mut other: Verdicts) {
        for check in &mut other.checks {
            check.name = format!("{part}: {}", check.name);
        }
        self.checks.append(&mut other.checks);
    }
}

impl Check {
    /// Its name without the folders before it.
    fn bare_name(&self) -> &str {
        let name = self.name.as_str();
        name.rsplit_once(": ").map_or(name, |(_, bare)| bare)
    }
}

impl fmt::Display for Verdicts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut passed_by: HashMap<&str, usize> = HashMap::new();
        for check in self.checks.iter().filter(|check| check.passed) {
            *passed_by.entry(check.bare_name()).or_default() += 1;
        }
        let mut is_told: HashSet<&str> = HashSet::new();
        for check in &self.checks {
            let bare = check.bare_name();
            if check.passed && passed_by[bare] > MOST_LINES {
                if is_told.insert(bare) {
                    writeln!(f, "ok    {bare}  in {} folders", passed_by[bare])?;
                }
                continue;
            }
            let verdict = if check.passed { "ok    " } else { "FAIL  " };
            let gap = if check.figure.is_empty() { "" } else { "  " };
            writeln!(f, "{verdict}{}{gap}{}", check.name, check.figure)?;
        }
        let failed = self.failed();
        write!(f, "{} passed, {failed} failed", self.checks.len() - failed)
    }
}

/// Verifies an asset's folder, every component of it, or every asset of an output folder.
///
/// # Errors
/// Only where there is nothing to verify; whatever is wrong with an atlas is a failed check.
pub fn verify(folder: &Path, options: &VerifyOptions) -> Result<Verdicts, VerifyError> {
    verify_against(folder, options, None)
}

/// Like [`verify`], and compares with the mesh that the atlas was made from, in the file's own vertex and
/// face order.
///
/// # Errors
/// As [`verify`].
pub fn verify_against(
    folder: &Path,
    options: &VerifyOptions,
    source: Option<&SourceSurface<'_>>,
) -> Result<Verdicts, VerifyError> {
    if folder.join("manifest.jsonl").is_file() {
        let mut verdicts = Verdicts::default();
        verify_manifest(folder, options, source, &mut verdicts);
        return Ok(verdicts);
    }
    verify_asset(folder, options, source)
}

/// An atlas, or one a component.
fn verify_asset(
    folder: &Path,
    options: &VerifyOptions,
    source: Option<&SourceSurface<'_>>,
) -> Result<Verdicts, VerifyError> {
    let unreadable = |source| VerifyError::Folder {
        path: folder.to_owned(),
        source,
    };
    let mut components = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(unreadable)? {
        let name = entry.map_err(unreadable)?.file_name();
        if let Some(name) = name.to_str().filter(|name| name.starts_with("component-")) {
            components.push(name.to_owned());
        }
    }
    components.sort();
    let mut verdicts = Verdicts::default();
    if folder.join("atlas.json").exists() {
        verdicts = verify_atlas(folder, options, source);
    } else if components.is_empty() && folder.join(listed::FILE_NAME).exists() {
        listed::check(folder, options, source.is_some(), &mut verdicts);
        return Ok(verdicts);
    } else if components.is_empty() {
        return Err(VerifyError::NothingToVerify {
            path: folder.to_owned(),
        });
    }
    let mut parts = BTreeMap::new();
    for name in components {
        let number: Option<u64> = name.trim_start_matches("component-").parse().ok();
        let path = folder.join(&name);
        let (part, extent) = verify_atlas_and_measure(&path, options, source);
        let place = number.and_then(|n| usize::try_from(n).ok());
        parts.extend(place.zip(extent));
        verdicts.append(&name, part);
        let stated = document::component(&path);
        verdicts.note(
            &format!("{name}: component is the one its folder names"),
            number.is_some() && stated == number,
            match stated {
                Some(stated) => format!("component {stated}"),
                None => "atlas.json states none".to_owned(),
            },
        );
    }
    if !parts.is_empty() {
        glb::check_whole(folder, &parts, &mut verdicts);
    }
    Ok(verdicts)
}

fn read_manifest(folder: &Path) -> Result<String, String> {
    let bytes = read_bounded(&folder.join("manifest.jsonl"), JSON_LIMIT);
    let bytes = bytes.map_err(|error| error.to_string())?;
    String::from_utf8(bytes).map_err(|error| error.to_string())
}

/// Every asset that the manifest calls built, or of which it lists files, must be there with them.
fn verify_manifest(
    folder: &Path,
    options: &VerifyOptions,
    source: Option<&SourceSurface<'_>>,
    verdicts: &mut Verdicts,
) {
    let text = match read_manifest(folder) {
        Ok(text) => text,
        Err(error) => {
            verdicts.note("manifest.jsonl can be read", false, error);
            return;
        }
    };
    let mut built = 0;
    for (row, line) in text
        .lines()
        .enumerate()
        .filter(|(_, l)| !l.trim().is_empty())
    {
        let record: serde_json::Value = match serde_json::from_str(line) {
            Ok(record) => record,
            Err(error) => {
                let figure = format!("line {}: {error}", row + 1);
                verdicts.note("manifest.jsonl holds one JSON object a line", false, figure);
                continue;
            }
        };
        let Some(id) = record["id"].as_str().filter(|id| is_inside(id)) else {
            let figure = format!("line {} has no usable id", row + 1);
            verdicts.note("manifest.jsonl names its assets", false, figure);
            continue;
        };
        let listed: Vec<&str> = record["files"]
            .as_array()
            .map(|files| files.iter().filter_map(|file| file.as_str()).collect())
            .unwrap_or_default();
        // An asset may have failed and still hold components that were built, or an older result.
        let complete = matches!(record["state"].as_str(), Some("built" | "cached"));
        if !complete && listed.is_empty() {
            continue;
        }
        built += 1;
        let absent: Vec<&str> = listed
            .iter()
            .copied()
            .filter(|file| {
                !is_inside(file)
                    || !(folder.join(file).is_file() || folder.join(id).join(file).is_file())
            })
            .collect();
        verdicts.note(
            &format!("{id}: files listed in the manifest exist"),
            absent.is_empty(),
            format!(
                "{} absent of {} {}",
                absent.len(),
                listed.len(),
                absent.join(" ")
            ),
        );
        match verify_asset(&folder.join(id), options, source) {
            Ok(part) => verdicts.append(id, part),
            Err(error) => {
                verdicts.note(&format!("{id}: the asset's folder is there"), false, error);
            }
        }
    }
    verdicts.note(
        "manifest.jsonl lists built assets",
        built > 0,
        format!("{built} built"),
    );
}

/// Verifies a folder that holds one `atlas.json`, and compares with a source where one is given.
pub fn verify_atlas(
    folder: &Path,
    options: &VerifyOptions,
    source: Option<&SourceSurface<'_>>,
) -> Verdicts {
    verify_atlas_and_measure(folder, options, source).0
}

/// The `surface.glb` of all components of an asset, by number.
pub(crate) fn verify_whole(folder: &Path, parts: &BTreeMap<usize, Extent>) -> Verdicts {
    let mut verdicts = Verdicts::default();
    glb::check_whole(folder, parts, &mut verdicts);
    verdicts
}

/// As [`verify_atlas`], with what a file of all components is compared with where the arrays can be read.
pub(crate) fn verify_atlas_and_measure(
    folder: &Path,
    options: &VerifyOptions,
    source: Option<&SourceSurface<'_>>,
) -> (Verdicts, Option<Extent>) {
    let mut verdicts = Verdicts::default();
    let Some(document) = document::read(folder, &mut verdicts) else {
        return (verdicts, None);
    };
    let Some(arrays) = arrays::read(folder, &document, &mut verdicts) else {
        return (verdicts, None);
    };
    check_arrays(folder, &arrays, &document, options, source, &mut verdicts);
    let extent = Extent::of(&arrays);
    // `surface.glb` is as large as they are, and needs no more of them.
    drop(arrays);
    glb::check(folder, &extent, &document, &mut verdicts);
    (verdicts, Some(extent))
}

/// Every check but those of `surface.glb`.
fn check_arrays(
    folder: &Path,
    arrays: &arrays::Arrays,
    document: &document::Document,
    options: &VerifyOptions,
    source: Option<&SourceSurface<'_>>,
    verdicts: &mut Verdicts,
) {
    let surface = surface::Surface::new(arrays);
    surface::check(&surface, arrays, document, verdicts);
    let (shapes, angles) = shapes::Shapes::new(arrays);
    let metric = metric::check(&surface, arrays, document, angles, options, verdicts);
    let slit = central::check(&surface, arrays, document, options, verdicts);
    let of_charts = |verdicts: &mut Verdicts| {
        transitions::check(&surface, arrays, document, &slit, &metric, verdicts);
        features::check(&surface, arrays, document, &slit, verdicts);
        charts::check(&surface, arrays, document, &slit, verdicts);
        if let Some(source) = source {
            source::check(arrays, document, source, verdicts);
        }
        quality::check(arrays, document, &shapes, verdicts);
    };
    let of_patches = |verdicts: &mut Verdicts| {
        let groups = patches::check(
            &surface, arrays, document, &shapes, options, &slit, verdicts,
        );
        let Some(groups) = groups else { return };
        let of_images = |verdicts: &mut Verdicts| {
            images::check(folder, arrays, document, &groups, verdicts);
            packed::check(folder, document, verdicts);
        };
        let of_sides = |verdicts: &mut Verdicts| {
            seams::check(&surface, arrays, document, &groups, verdicts);
            lattice::check(folder, &surface, arrays, document, verdicts);
        };
        side_by_side(verdicts, of_images, of_sides);
    };
    side_by_side(verdicts, of_charts, of_patches);
}

/// Notes what both find, that of the first before that of the second.
fn side_by_side(
    verdicts: &mut Verdicts,
    first: impl FnOnce(&mut Verdicts) + Send,
    second: impl FnOnce(&mut Verdicts) + Send,
) {
    let (first, second) = rayon::join(|| of(first), || of(second));
    verdicts.checks.extend(first.checks);
    verdicts.checks.extend(second.checks);
}

fn of(check: impl FnOnce(&mut Verdicts)) -> Verdicts {
    let mut verdicts = Verdicts::default();
    check(&mut verdicts);
    verdicts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_check_that_many_folders_pass_has_one_line() {
        let text = |folders: usize, bad: Option<usize>| {
            let mut all = Verdicts::default();
            for i in 0..folders {
                let mut one = Verdicts::default();
                one.note("finite", bad != Some(i), "");
                all.append(&format!("component-{i:03}"), one);
            }
            all.note("bounding box", true, "0.1");
            all.to_string()
        };
        assert_eq!(text(MOST_LINES, None).lines().count(), MOST_LINES + 2);
        let many = text(MOST_LINES + 3, Some(1));
        let lines: Vec<&str> = many.lines().collect();
        let expected = [
            "ok    finite  in 18 folders",
            "FAIL  component-001: finite",
            "ok    bounding box  0.1",
            "19 passed, 1 failed",
        ];
        assert_eq!(lines, expected);
    }
}
