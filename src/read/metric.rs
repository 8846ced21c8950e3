//! The flat metric of one component's folder: what tells how far it is from the surface in space.
//!
//! *Enters:* a folder that a build wrote. *Leaves:* a [`StoredMetric`].
//! *Guaranteed:* arrays fit each other, numbers are finite, vertices are in range.
//! *Not guaranteed:* that the lengths make triangles.

use super::atlas::{FolderError, checked_json};
use super::npz::Npz;
use crate::atlas::patch::Domain;
use crate::geometry::ids::NONE;
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::path::Path;

/// A vertex of prescribed curvature.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct StoredCone {
    /// Row of `positions`.
    pub vertex: usize,
    /// Vertex of the input file; absent for one that repair made.
    pub source_vertex: Option<u32>,
    /// Prescribed curvature, radians.
    pub curvature: f64,
}

/// How quarter turns were met.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StoredTurns {
    /// By how many quarter turns every loop turns, and by how much it misses that, radians.
    pub loops: Vec<(i64, f64)>,
    /// Root of the mean square and maximum, of λ.
    pub conformal_error: [f64; 2],
    /// Quarter turns moved between vertices for the sake of a grid.
    pub adjusted: usize,
    /// Quarter turns moved between cones, of which one is gone.
    pub merged: usize,
    /// Number of features that are lines.
    pub lines: usize,
    /// The others.
    pub given_up: Vec<NoLine>,
    /// Part of the length of sharp edges that is in neither.
    pub left_out: f64,
}

/// A feature that is no line.
#[derive(Clone, Debug, PartialEq)]
pub struct NoLine {
    /// Number of edges.
    pub edges: usize,
    /// Both ends.
    pub ends: [FeatureEnd; 2],
}

/// Where a feature ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeatureEnd {
    /// Vertex of the input file; absent for one that repair made.
    pub vertex: Option<u32>,
    /// Source units.
    pub position: [f64; 3],
}

/// A surface with its flat lengths.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredMetric {
    /// Source units.
    pub positions: Vec<[f64; 3]>,
    /// Counterclockwise.
    pub faces: Vec<[u32; 3]>,
    /// Flat length of the edge opposite each corner.
    pub flat_length: Vec<[f64; 3]>,
    /// Face of the input file that each face lies in.
    pub source_face: Vec<u32>,
    /// Cones.
    pub cones: Vec<StoredCone>,
    /// Where all transitions are quarter turns because that was asked for.
    pub turns: Option<StoredTurns>,
    /// What images, quads and coordinates lie on.
    pub domain: Domain,
}

#[derive(Deserialize)]
struct Document {
    cones: Vec<StoredCone>,
    #[serde(default)]
    metric: Metric,
    #[serde(default)]
    quality: Quality,
    #[serde(default)]
    features: Vec<Feature>,
    /// Absent where there is none.
    grid: Option<IgnoredAny>,
}

#[derive(Default, Deserialize)]
struct Metric {
    holonomy: Option<Holonomy>,
}

#[derive(Deserialize)]
struct Holonomy {
    loops: Vec<Loop>,
    adjusted: usize,
    #[serde(default)]
    merged: usize,
    #[serde(default)]
    left_out: f64,
}

#[derive(Deserialize)]
struct Loop {
    turns: i64,
    residual: f64,
}

#[derive(Default, Deserialize)]
struct Quality {
    conformal_error: Option<ConformalError>,
}

#[derive(Deserialize)]
struct ConformalError {
    rms: f64,
    max: f64,
}

#[derive(Deserialize)]
struct Feature {
    vertices: Vec<usize>,
    is_line: bool,
}

impl Document {
    /// `source_vertex`: the vertex of the input file of every row of `positions`.
    fn turns(
        &self,
        holonomy: &Holonomy,
        source_vertex: &[u32],
        positions: &[[f64; 3]],
    ) -> Result<StoredTurns, String> {
        let error = self.quality.conformal_error.as_ref();
        let end = |v: Option<&usize>| -> Result<FeatureEnd, String> {
            let rows = positions.len();
            let row = v.copied().filter(|&v| v < rows && v < source_vertex.len());
            let row = row.ok_or_else(|| {
                format!("atlas.json has a feature that ends in no vertex, but there are {rows}")
            })?;
            Ok(FeatureEnd {
                vertex: Some(source_vertex[row]).filter(|&v| v != NONE),
                position: positions[row],
            })
        };
        let given_up = self.features.iter().filter(|f| !f.is_line).map(|f| {
            let ends = [end(f.vertices.first())?, end(f.vertices.last())?];
            Ok(NoLine {
                edges: f.vertices.len().saturating_sub(1),
                ends,
            })
        });
        let given_up = given_up.collect::<Result<_, String>>()?;
        Ok(StoredTurns {
            left_out: holonomy.left_out,
            loops: (holonomy.loops.iter())
                .map(|l| (l.turns, l.residual))
                .collect(),
            conformal_error: error.map_or([0.0; 2], |e| [e.rms, e.max]),
            adjusted: holonomy.adjusted,
            merged: holonomy.merged,
            lines: self.features.iter().filter(|f| f.is_line).count(),
            given_up,
        })
    }
}

/// Reads the flat metric of one component.
///
/// # Errors
/// Files that are missing, damaged, or do not fit each other.
pub fn read_metric(folder: &Path) -> Result<StoredMetric, FolderError> {
    let at = |name: &str, problem| FolderError::File {
        path: folder.join(name),
        problem,
    };
    let value = checked_json(&folder.join("atlas.json"))?;
    let document = Document::deserialize(&value).map_err(|e| at("atlas.json", e.to_string()))?;
    arrays(&folder.join("atlas.npz"), document).map_err(|problem| at("atlas.npz", problem))
}

fn arrays(path: &Path, document: Document) -> Result<StoredMetric, String> {
    let mut npz = Npz::open(path)?;
    let (positions, vertices) = npz.read::<f64>("positions", &[None, Some(3)])?;
    let (faces, count) = npz.read::<u32>("faces", &[None, Some(3)])?;
    let (flat_length, _) = npz.read::<f64>("flat_length", &[Some(count), Some(3)])?;
    let (source_face, _) = npz.read::<u32>("source_face", &[Some(count)])?;
    let turns = match &document.metric.holonomy {
        Some(holonomy) => {
            let (source_vertex, _) = npz.read::<u32>("source_vertex", &[Some(vertices)])?;
            let rows = positions.as_chunks::<3>().0;
            Some(document.turns(holonomy, &source_vertex, rows)?)
        }
        None => None,
    };
    let domain = match document.grid {
        Some(_) => Domain::Grid,
        None => Domain::Flat,
    };
    let cones = document.cones;
    for (name, numbers) in [("positions", &positions), ("flat_length", &flat_length)] {
        if let Some(i) = numbers.iter().position(|x| !x.is_finite()) {
            return Err(format!(
                "row {} of {name} holds a number that is not finite",
                i / 3
            ));
        }
    }
    if let Some(i) = faces.iter().position(|&v| v as usize >= vertices) {
        return Err(format!(
            "row {} of faces names vertex {} of {vertices}",
            i / 3,
            faces[i]
        ));
    }
    if let Some(cone) = cones.iter().find(|cone| cone.vertex >= vertices) {
        return Err(format!(
            "atlas.json has a cone at vertex {}, but there are {vertices}",
            cone.vertex
        ));
    }
    Ok(StoredMetric {
        positions: positions.as_chunks::<3>().0.to_vec(),
        faces: faces.as_chunks::<3>().0.to_vec(),
        flat_length: flat_length.as_chunks::<3>().0.to_vec(),
        source_face,
        cones,
        turns,
        domain,
    })
}
