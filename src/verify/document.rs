//! `atlas.json`: its keys, its types, and that its indices point somewhere.

use super::Verdicts;
use super::formulas::{Motion, Point2, Point3};
use crate::read::bounded::{JSON_LIMIT, is_inside, read_bounded};
use serde::Deserialize;
use serde_json::Value;
use std::collections::HashSet;
use std::path::Path;

/// Keys that must be there, by object.
const KEYS: [(&str, &[&str]); 7] = [
    (
        "source",
        &["path", "blake3", "config_blake3", "component", "components"],
    ),
    (
        "topology",
        &[
            "vertices",
            "edges",
            "faces",
            "euler_characteristic",
            "genus",
            "boundary_loops",
        ],
    ),
    ("repair", &[]),
    ("connectivity", &["splits", "flips", "hausdorff"]),
    (
        "metric",
        &[
            "scheme",
            "solver",
            "boundary",
            "iterations",
            "max_curvature_error",
            "history",
        ],
    ),
    (
        "quality",
        &[
            "area_distortion",
            "log_scale",
            "angle_error",
            "layout_closing_error",
            "cut_length",
        ],
    ),
    ("flags", &["seamless"]),
];

/// Lists that must be there.
const LISTS: [&str; 5] = ["cones", "segments", "charts", "transitions", "patches"];

/// What the checks use of `atlas.json`.
#[derive(Debug, Deserialize)]
pub(super) struct Document {
    pub generator: Option<Value>,
    pub source: Source,
    pub topology: Topology,
    pub metric: Metric,
    pub cones: Vec<Cone>,
    #[serde(default)]
    pub features: Vec<Feature>,
    pub segments: Vec<Segment>,
    pub charts: Vec<Chart>,
    pub transitions: Vec<Transition>,
    pub patches: Vec<Patch>,
    #[serde(default)]
    pub images: Images,
    pub quality: Quality,
    #[serde(default)]
    pub image_origin: Point3,
    pub flags: Flags,
    pub grid: Option<Grid>,
    pub periods: Option<[Point2; 2]>,
}

impl Document {
    /// Whether a program wrote it, which must then keep the whole format (`docs/format.md`).
    pub fn is_generated(&self) -> bool {
        self.generator.is_some()
    }
}

#[derive(Debug, Deserialize)]
pub(super) struct Source {
    pub blake3: String,
    pub config_blake3: String,
    pub component: u64,
    pub components: u64,
}

#[derive(Debug, Deserialize)]
pub(super) struct Topology {
    pub vertices: u64,
    pub edges: u64,
    pub faces: u64,
    pub euler_characteristic: i64,
    pub genus: i64,
    pub boundary_loops: i64,
}

#[derive(Debug, Deserialize)]
pub(super) struct Metric {
    pub boundary: String,
    pub max_curvature_error: f64,
    pub holonomy: Option<Holonomy>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Holonomy {
    pub loops: Vec<Loop>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Loop {
    pub residual: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct Feature {
    pub vertices: Vec<usize>,
    pub is_line: bool,
}

#[derive(Debug, Deserialize)]
pub(super) struct Cone {
    pub vertex: usize,
    pub curvature: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct Gluing {
    pub rotation: f64,
    pub translation: Point2,
    pub residual: Option<f64>,
    pub quarter_turns: Option<i64>,
}

impl Gluing {
    pub fn motion(&self) -> Motion {
        Motion::new(self.rotation, self.translation)
    }
}

#[derive(Debug, Deserialize)]
pub(super) struct Segment {
    pub id: usize,
    pub from: usize,
    pub to: usize,
    pub vertices: Vec<usize>,
    pub gluing: Gluing,
}

#[derive(Debug, Deserialize)]
pub(super) struct Chart {
    pub id: Option<usize>,
    pub kind: String,
    pub segment: Option<usize>,
    pub vertex: Option<usize>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Transition {
    pub from: usize,
    pub to: usize,
    #[serde(default)]
    pub sector: u8,
    pub rotation: f64,
    pub translation: Point2,
    pub residual: Option<f64>,
    pub faces: Option<usize>,
    pub quarter_turns: Option<i64>,
}

impl Transition {
    pub fn motion(&self) -> Motion {
        Motion::new(self.rotation, self.translation)
    }
}

#[derive(Debug, Deserialize)]
pub(super) struct Similarity {
    pub scale: f64,
    pub rotation: f64,
    pub translation: Point2,
}

#[derive(Debug, Deserialize)]
pub(super) struct Patch {
    pub id: usize,
    pub image: String,
    pub domain: String,
    pub width: usize,
    pub height: usize,
    pub texel_to_patch: [[f64; 3]; 2],
    pub patch_to_chart: Option<Similarity>,
    pub cells: Option<[usize; 2]>,
    pub samples_per_cell: Option<usize>,
    pub sides: Option<[Vec<Piece>; 4]>,
}

/// A stretch of a block's side with one neighbour.
#[derive(Debug, Deserialize)]
pub(super) struct Piece {
    pub start: usize,
    pub length: usize,
    pub patch: Option<usize>,
    pub side: Option<usize>,
    pub other_start: Option<usize>,
    pub reversed: bool,
}

impl Piece {
    /// Patch, side and first cell there of what lies across.
    pub fn across(&self) -> Option<(usize, usize, usize)> {
        Some((self.patch?, self.side?, self.other_start?))
    }
}

#[derive(Debug, Deserialize)]
pub(super) struct Grid {
    pub cells: usize,
    pub turned_over: usize,
    pub irregular: Vec<Irregular>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Irregular {
    pub quad_vertex: usize,
    pub vertex: usize,
    pub valence: usize,
}

/// What the images hold beside position and mask.
#[derive(Debug, Deserialize)]
#[serde(default)]
pub(super) struct Images {
    pub channels: Vec<String>,
    pub normal_precision: String,
    pub packed: Option<Packed>,
}

/// One image of all patches.
#[derive(Debug, Deserialize)]
pub(super) struct Packed {
    pub image: String,
    pub side: usize,
    pub corners: Vec<[usize; 2]>,
}

impl Default for Images {
    /// What they hold where `atlas.json` says nothing.
    fn default() -> Self {
        Self {
            channels: ["normal", "face", "log-scale"].map(str::to_owned).to_vec(),
            normal_precision: "float".to_owned(),
            packed: None,
        }
    }
}

impl Images {
    pub fn is_half(&self) -> bool {
        self.normal_precision == "half"
    }
}

#[derive(Debug, Deserialize)]
pub(super) struct Spread {
    pub min: f64,
    pub max: f64,
    pub std: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct MeanMax {
    pub mean: f64,
    pub max: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct Quality {
    pub area_distortion: f64,
    pub log_scale: Spread,
    pub angle_error: MeanMax,
    pub layout_closing_error: f64,
    pub cut_length: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct Flags {
    pub seamless: bool,
}

fn bytes(folder: &Path) -> Result<Vec<u8>, String> {
    read_bounded(&folder.join("atlas.json"), JSON_LIMIT).map_err(|error| error.to_string())
}

fn parse(bytes: &[u8]) -> Result<Value, String> {
    serde_json::from_slice(bytes).map_err(|error| error.to_string())
}

/// The number of the component that an atlas says it is.
pub(super) fn component(folder: &Path) -> Option<u64> {
    parse(&bytes(folder).ok()?).ok()?["source"]["component"].as_u64()
}

/// Reads `atlas.json`; `None` where it cannot be used, after a failed check that says why.
pub(super) fn read(folder: &Path, verdicts: &mut Verdicts) -> Option<Document> {
    let read = bytes(folder).and_then(|bytes| Ok((parse(&bytes)?, bytes)));
    let (value, bytes) = match read {
        Ok(read) => read,
        Err(error) => {
            verdicts.note("atlas.json can be read", false, error);
            return None;
        }
    };
    verdicts.note(
        "format",
        value["format"] == "affine-atlas" && [1, 2].map(Value::from).contains(&value["version"]),
        "",
    );
    let lacking = lacking_keys(&value);
    let complete = verdicts.note(
        "atlas.json has every key",
        lacking.is_empty(),
        lacking[..lacking.len().min(6)].join(" "),
    );
    if !complete {
        return None;
    }
    // Of very many patches the tree of values is large.
    drop(value);
    let document: Document = match serde_json::from_slice(&bytes) {
        Ok(document) => document,
        Err(error) => {
            verdicts.note("atlas.json's values have their types", false, error);
            return None;
        }
    };
    let stray = stray_ids(&document);
    let sound = verdicts.note(
        "atlas.json's ids point to its lists",
        stray.is_empty(),
        stray[..stray.len().min(4)].join(", "),
    );
    sound.then_some(document)
}

fn lacking_keys(value: &Value) -> Vec<String> {
    let mut lacking = Vec::new();
    for (object, keys) in &KEYS {
        if !value[object].is_object() {
            lacking.push((*object).to_owned());
            continue;
        }
        for key in keys.iter().filter(|key| value[object].get(**key).is_none()) {
            lacking.push(format!("{object}.{key}"));
        }
    }
    for list in LISTS.iter().filter(|list| !value[**list].is_array()) {
        lacking.push((*list).to_owned());
    }
    lacking
}

/// Ids that are not their row, and ids of rows that are not there (vertices and faces are tested elsewhere).
fn stray_ids(document: &Document) -> Vec<String> {
    let mut stray = Vec::new();
    let (segments, charts) = (document.segments.len(), document.charts.len());
    let source = &document.source;
    if source.component >= source.components {
        stray.push(format!(
            "component {} of {}",
            source.component, source.components
        ));
    }
    for (row, segment) in document.segments.iter().enumerate() {
        if segment.id != row {
            stray.push(format!("segment {} in row {row}", segment.id));
        }
        if segment.vertices.len() < 2 {
            stray.push(format!("segment {row} of fewer than two vertices"));
        }
    }
    for (row, chart) in document.charts.iter().enumerate() {
        if chart.id.is_some_and(|id| id != row) {
            stray.push(format!("another id in row {row} of charts"));
        }
        let complete = match chart.kind.as_str() {
            "central" => row == 0,
            "boundary" => chart.segment.is_some_and(|segment| segment < segments),
            "node" => chart.vertex.is_some(),
            _ => false,
        };
        if !complete {
            stray.push(format!("chart {row} of kind {}", chart.kind));
        }
    }
    for transition in &document.transitions {
        if transition.from != 0 || transition.to == 0 || transition.to >= charts {
            stray.push(format!(
                "transition from {} to {}",
                transition.from, transition.to
            ));
        }
    }
    // One that is named by many would be read for each of them.
    let mut images = HashSet::new();
    for (row, patch) in document.patches.iter().enumerate() {
        if !images.insert(patch.image.as_str()) {
            stray.push(format!("image {:?} of more than one patch", patch.image));
        }
        if patch.id != row {
            stray.push(format!("patch {} in row {row}", patch.id));
        }
        if !is_inside(&patch.image) {
            stray.push(format!("image {:?} outside the folder", patch.image));
        }
        if !["flat", "grid"].contains(&patch.domain.as_str()) {
            stray.push(format!("patch {row} of domain {}", patch.domain));
        }
    }
    if let Some(packed) = &document.images.packed
        && !is_inside(&packed.image)
    {
        stray.push(format!("image {:?} outside the folder", packed.image));
    }
    stray
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lacking_keys_are_named_with_their_object() {
        let value = serde_json::json!({ "source": { "path": "a" }, "cones": {} });
        let lacking = lacking_keys(&value);
        assert!(lacking.contains(&"source.blake3".to_owned()));
        assert!(!lacking.contains(&"source.path".to_owned()));
        assert!(lacking.contains(&"cones".to_owned()));
    }
}
