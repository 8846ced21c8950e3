//! The flat metric of one component's folder: what tells how far it is from the surface in space.
//!
//! *Enters:* a folder that a build wrote. *Leaves:* a [`StoredMetric`].
//! *Guaranteed:* arrays fit each other, numbers are finite, vertices are in range.
//! *Not guaranteed:* that the lengths make triangles.

use super::atlas::{FolderError, checked_json};
use super::npz::Npz;
use serde::Deserialize;
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
}

#[derive(Deserialize)]
struct Document {
    cones: Vec<StoredCone>,
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
    arrays(&folder.join("atlas.npz"), document.cones).map_err(|problem| at("atlas.npz", problem))
}

fn arrays(path: &Path, cones: Vec<StoredCone>) -> Result<StoredMetric, String> {
    let mut npz = Npz::open(path)?;
    let (positions, vertices) = npz.read::<f64>("positions", &[None, Some(3)])?;
    let (faces, count) = npz.read::<u32>("faces", &[None, Some(3)])?;
    let (flat_length, _) = npz.read::<f64>("flat_length", &[Some(count), Some(3)])?;
    let (source_face, _) = npz.read::<u32>("source_face", &[Some(count)])?;
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
    })
}
