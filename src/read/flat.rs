//! The flat surface of one component's folder: what lays something out in flat coordinates and in the packed square.
//!
//! *Enters:* a folder that a build wrote. *Leaves:* a [`FlatSurface`]: central chart, patches and the gluings across the cut.
//!
//! *Guaranteed:* arrays fit each other, numbers are finite, vertices, patches and segments are in range.
//! *Not guaranteed:* that coordinates make an atlas.

use super::atlas::{FolderError, checked_json};
use super::npz::Npz;
use crate::atlas::plane::Similarity;
use crate::geometry::ids::NONE;
use serde::Deserialize;
use std::path::Path;

/// A chain of cut edges and what glues its sides.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredSegment {
    /// Its vertices; its left is the left of this direction.
    pub vertices: Vec<u32>,
    /// Angle by which coordinates of the copy on its left turn to become those of the copy on its right.
    pub rotation: f64,
    /// The same as a number of quarter turns (0 to 3), where it is one.
    pub quarter_turns: Option<u8>,
}

/// Where a patch lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StoredPatch {
    /// Patch coordinates times this …
    pub packed_scale: f64,
    /// … plus this are coordinates in the packed square, v up.
    pub packed_translation: [f64; 2],
    /// Patch coordinates to those of the central chart; `None` for blocks.
    pub to_chart: Option<Similarity>,
}

/// A surface with its flat coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct FlatSurface {
    /// Source units.
    pub positions: Vec<[f64; 3]>,
    /// Counterclockwise.
    pub faces: Vec<[u32; 3]>,
    /// Central chart, one a corner.
    pub central_uv: Vec<[[f64; 2]; 3]>,
    /// Segment of the edge opposite each corner, [`NONE`] where it is not cut.
    pub segment: Vec<[u32; 3]>,
    /// Patch of each face.
    pub patch: Vec<u32>,
    /// Patch coordinates, one a corner.
    pub patch_uv: Vec<[[f64; 2]; 3]>,
    /// Segments of the cut.
    pub segments: Vec<StoredSegment>,
    /// Patches.
    pub patches: Vec<StoredPatch>,
    /// What positions are taken relative to before they become 32-bit floats.
    pub origin: [f64; 3],
}

impl FlatSurface {
    /// Coordinates of a face's corners in the packed square, v up.
    #[must_use]
    pub fn packed(&self, face: usize) -> [[f64; 2]; 3] {
        let patch = &self.patches[self.patch[face] as usize];
        self.patch_uv[face].map(|p| {
            std::array::from_fn(|i| patch.packed_scale * p[i] + patch.packed_translation[i])
        })
    }
}

#[derive(Deserialize)]
struct Document {
    segments: Vec<Segment>,
    patches: Vec<Patch>,
    #[serde(default)]
    image_origin: [f64; 3],
}

#[derive(Deserialize)]
struct Segment {
    vertices: Vec<u32>,
    gluing: Gluing,
}

#[derive(Deserialize)]
struct Gluing {
    rotation: f64,
    #[serde(default)]
    quarter_turns: Option<u8>,
}

#[derive(Deserialize)]
struct Patch {
    patch_to_packed: Packing,
    patch_to_chart: Option<Motion>,
}

#[derive(Deserialize)]
struct Packing {
    scale: f64,
    translation: [f64; 2],
}

#[derive(Deserialize)]
struct Motion {
    scale: f64,
    rotation: f64,
    translation: [f64; 2],
}

/// Reads the flat surface of one component.
///
/// # Errors
/// Files that are missing, damaged, or do not fit each other.
pub fn read_flat(folder: &Path) -> Result<FlatSurface, FolderError> {
    let path = folder.join("atlas.json");
    let value = checked_json(&path)?;
    let of_json = |problem| FolderError::File {
        path: path.clone(),
        problem,
    };
    let document = Document::deserialize(&value).map_err(|e| of_json(e.to_string()))?;
    let segments = document.segments.into_iter().map(stored_segment);
    let patches = document.patches.into_iter().enumerate().map(stored_patch);
    let segments = segments.collect();
    let patches = patches.collect::<Result<_, _>>().map_err(of_json)?;
    if let Some(value) = document.image_origin.iter().find(|x| !x.is_finite()) {
        return Err(of_json(format!("image_origin holds {value}")));
    }
    let path = folder.join("atlas.npz");
    arrays(&path, segments, patches, document.image_origin).map_err(|problem| FolderError::File {
        path: path.clone(),
        problem,
    })
}

fn stored_segment(segment: Segment) -> StoredSegment {
    StoredSegment {
        vertices: segment.vertices,
        rotation: segment.gluing.rotation,
        quarter_turns: segment.gluing.quarter_turns.filter(|&turns| turns < 4),
    }
}

fn stored_patch((id, patch): (usize, Patch)) -> Result<StoredPatch, String> {
    let Packing { scale, translation } = patch.patch_to_packed;
    let mut numbers = vec![scale, translation[0], translation[1]];
    let to_chart = patch.patch_to_chart.map(|m| Similarity {
        scale: m.scale,
        rotation: m.rotation,
        translation: m.translation,
    });
    numbers.extend(to_chart.map(|m| m.scale));
    match numbers.iter().all(|x| x.is_finite()) && scale > 0.0 {
        true => Ok(StoredPatch {
            packed_scale: scale,
            packed_translation: translation,
            to_chart,
        }),
        false => Err(format!(
            "patch {id} is packed with scale {scale} and translation {translation:?}"
        )),
    }
}

fn arrays(
    path: &Path,
    segments: Vec<StoredSegment>,
    patches: Vec<StoredPatch>,
    origin: [f64; 3],
) -> Result<FlatSurface, String> {
    let mut npz = Npz::open(path)?;
    let (positions, vertices) = npz.read::<f64>("positions", &[None, Some(3)])?;
    let (faces, count) = npz.read::<u32>("faces", &[None, Some(3)])?;
    let corners = [Some(count), Some(3), Some(2)];
    let (central, _) = npz.read::<f64>("central_uv", &corners)?;
    let (segment, _) = npz.read::<u32>("segment", &[Some(count), Some(3)])?;
    let (patch, _) = npz.read::<u32>("patch", &[Some(count)])?;
    let (patch_uv, _) = npz.read::<f64>("patch_uv", &corners)?;
    for (name, numbers, row) in [
        ("positions", &positions, 3),
        ("central_uv", &central, 6),
        ("patch_uv", &patch_uv, 6),
    ] {
        if let Some(at) = numbers.iter().position(|x| !x.is_finite()) {
            return Err(format!("row {} of {name} holds {}", at / row, numbers[at]));
        }
    }
    let beyond = |values: &[u32], limit: usize| {
        let bad = |&x: &u32| x != NONE && x as usize >= limit;
        values.iter().position(bad)
    };
    if let Some(at) = beyond(&segment, segments.len()) {
        return Err(format!(
            "row {} of segment names segment {} of {}",
            at / 3,
            segment[at],
            segments.len()
        ));
    }
    for (name, values, limit, what) in [
        ("faces", &faces, vertices, "vertex"),
        ("patch", &patch, patches.len(), "patch"),
    ] {
        if let Some(at) = values.iter().position(|&x| x as usize >= limit) {
            let row = at * count / values.len();
            return Err(format!(
                "row {row} of {name} names {what} {} of {limit}",
                values[at]
            ));
        }
    }
    let triples = |values: &[f64]| values.as_chunks::<2>().0.as_chunks::<3>().0.to_vec();
    Ok(FlatSurface {
        positions: positions.as_chunks::<3>().0.to_vec(),
        faces: faces.as_chunks::<3>().0.to_vec(),
        central_uv: triples(&central),
        segment: segment.as_chunks::<3>().0.to_vec(),
        patch,
        patch_uv: triples(&patch_uv),
        segments,
        patches,
        origin,
    })
}
