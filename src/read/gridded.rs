//! The surface of one component's folder with its integer grid: what lays something out in grid coordinates and in the packed square.
//!
//! *Enters:* a folder that a build with `images.domain = "grid"` wrote. *Leaves:* a [`GriddedSurface`]: grid coordinates, turns across edges, patches.
//!
//! *Guaranteed:* arrays fit each other, numbers are finite, vertices and patches are in range, every face has an area above 0 on the grid and lies in its patch as
//! it does on the grid, but for a quarter turn and a translation.
//! *Not guaranteed:* that translations are whole, and that turns are those of the coordinates.

use super::atlas::{FolderError, checked_json};
use super::npz::Npz;
use crate::grid::complex::turned;
use crate::grid::triangle::is_turned_over;
use serde::Deserialize;
use std::path::Path;

/// Farthest that sides of a face in its patch may be from those on the grid, cells.
const SAME_SIDES: f64 = 1e-6;

/// How patch coordinates lie in the packed square.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub struct Packing {
    /// Patch coordinates times this …
    pub scale: f64,
    /// … plus this are coordinates in the packed square, v up.
    pub translation: [f64; 2],
}

/// A surface with its grid.
#[derive(Clone, Debug, PartialEq)]
pub struct GriddedSurface {
    /// Source units.
    pub positions: Vec<[f64; 3]>,
    /// Counterclockwise.
    pub faces: Vec<[u32; 3]>,
    /// Grid coordinates in the frame of the face, one a corner.
    pub grid_uv: Vec<[[f64; 2]; 3]>,
    /// Quarter turns across the edge opposite each corner, 0 to 3.
    pub turns: Vec<[u8; 3]>,
    /// Patch of each face.
    pub patch: Vec<u32>,
    /// Patch coordinates in cells, one a corner.
    pub patch_uv: Vec<[[f64; 2]; 3]>,
    /// Quarter turns from the patch of each face to its frame on the grid, 0 to 3.
    pub patch_turns: Vec<u8>,
    /// Where patches lie.
    pub patches: Vec<Packing>,
    /// What positions are taken relative to before they become 32-bit floats.
    pub origin: [f64; 3],
    /// The quad mesh.
    pub quads: StoredQuads,
}

/// The quad mesh of a grid.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredQuads {
    /// Points, source units.
    pub points: Vec<[f64; 3]>,
    /// Corners of cells, counterclockwise from that at the column and row; in range.
    pub cells: Vec<[u32; 4]>,
    /// Patch of each; in range.
    pub patch: Vec<u32>,
    /// Column and row there.
    pub at: Vec<[u32; 2]>,
}

impl GriddedSurface {
    /// Coordinates of a face's corners in the packed square, v up.
    #[must_use]
    pub fn packed(&self, face: usize) -> [[f64; 2]; 3] {
        let Packing { scale, translation } = self.patches[self.patch[face] as usize];
        self.patch_uv[face].map(|p| std::array::from_fn(|i| scale * p[i] + translation[i]))
    }
}

#[derive(Deserialize)]
struct Document {
    #[serde(default)]
    grid: Option<serde::de::IgnoredAny>,
    patches: Vec<Patch>,
    #[serde(default)]
    image_origin: [f64; 3],
}

#[derive(Deserialize)]
struct Patch {
    patch_to_packed: Packing,
}

/// Reads the surface of one component.
///
/// # Errors
/// A folder without a grid, and files that are missing, damaged, or do not fit each other.
pub fn read_gridded(folder: &Path) -> Result<GriddedSurface, FolderError> {
    let path = folder.join("atlas.json");
    let value = checked_json(&path)?;
    let of_json = |problem| FolderError::File {
        path: path.clone(),
        problem,
    };
    let document = Document::deserialize(&value).map_err(|e| of_json(e.to_string()))?;
    if document.grid.is_none() {
        return Err(FolderError::NoGrid { path });
    }
    let patches: Vec<Packing> = (document.patches.iter())
        .map(|patch| patch.patch_to_packed)
        .collect();
    let is_sound = |packing: &Packing| {
        let mut numbers = packing.translation.iter().chain([&packing.scale]);
        packing.scale > 0.0 && numbers.all(|x| x.is_finite())
    };
    if let Some(id) = patches.iter().position(|packing| !is_sound(packing)) {
        let Packing { scale, translation } = patches[id];
        return Err(of_json(format!(
            "patch {id} is packed with scale {scale} and translation {translation:?}"
        )));
    }
    if let Some(value) = document.image_origin.iter().find(|x| !x.is_finite()) {
        return Err(of_json(format!("image_origin holds {value}")));
    }
    let path = folder.join("atlas.npz");
    arrays(&path, patches, document.image_origin).map_err(|problem| FolderError::File {
        path: path.clone(),
        problem,
    })
}

fn arrays(path: &Path, patches: Vec<Packing>, origin: [f64; 3]) -> Result<GriddedSurface, String> {
    let mut npz = Npz::open(path)?;
    let (positions, vertices) = npz.read::<[f64; 3]>("positions", &[None, Some(3)])?;
    let (faces, count) = npz.read::<[u32; 3]>("faces", &[None, Some(3)])?;
    let corners = [Some(count), Some(3), Some(2)];
    let (grid_uv, _) = npz.read::<[[f64; 2]; 3]>("grid_uv", &corners)?;
    let (turns, _) = npz.read::<[u8; 3]>("grid_turns", &[Some(count), Some(3)])?;
    let (patch, _) = npz.read::<u32>("patch", &[Some(count)])?;
    let (patch_uv, _) = npz.read::<[[f64; 2]; 3]>("patch_uv", &corners)?;
    let (points, point_count) = npz.read::<[f64; 3]>("quad_positions", &[None, Some(3)])?;
    let (cells, cell_count) = npz.read::<[u32; 4]>("quads", &[None, Some(4)])?;
    let (quad_patch, _) = npz.read::<u32>("quad_patch", &[Some(cell_count)])?;
    let (quad_cell, _) = npz.read::<[u32; 2]>("quad_cell", &[Some(cell_count), Some(2)])?;
    for (name, numbers, row) in [
        ("positions", positions.as_flattened(), 3),
        ("grid_uv", grid_uv.as_flattened().as_flattened(), 6),
        ("patch_uv", patch_uv.as_flattened().as_flattened(), 6),
        ("quad_positions", points.as_flattened(), 3),
    ] {
        if let Some(at) = numbers.iter().position(|x| !x.is_finite()) {
            return Err(format!("row {} of {name} holds {}", at / row, numbers[at]));
        }
    }
    for (name, values, row, limit, what) in [
        ("faces", faces.as_flattened(), 3, vertices, "vertex"),
        ("patch", &patch[..], 1, patches.len(), "patch"),
        ("quads", cells.as_flattened(), 4, point_count, "point"),
        ("quad_patch", &quad_patch[..], 1, patches.len(), "patch"),
    ] {
        if let Some(at) = values.iter().position(|&x| x as usize >= limit) {
            let (row, value) = (at / row, values[at]);
            return Err(format!(
                "row {row} of {name} names {what} {value} of {limit}"
            ));
        }
    }
    if let Some(row) = turns.iter().position(|t| t.iter().any(|&t| t > 3)) {
        let [a, b, c] = turns[row];
        return Err(format!(
            "row {row} of grid_turns holds {a}, {b}, {c}; quarter turns are 0 to 3"
        ));
    }
    if let Some(row) = grid_uv.iter().position(|&uv| is_turned_over(uv)) {
        return Err(format!(
            "row {row} of grid_uv is a face that is turned over or has no area"
        ));
    }
    let faces_in_patches = patch_uv.iter().zip(&grid_uv);
    let patch_turns = faces_in_patches.enumerate().map(|(row, (patch, grid))| {
        turns_between(*patch, *grid).ok_or_else(|| {
            format!("row {row} of patch_uv is no quarter turn and translation of that of grid_uv")
        })
    });
    let patch_turns = patch_turns.collect::<Result<_, _>>()?;
    Ok(GriddedSurface {
        positions,
        faces,
        grid_uv,
        turns,
        patch,
        patch_uv,
        patch_turns,
        patches,
        origin,
        quads: StoredQuads {
            points,
            cells,
            patch: quad_patch,
            at: quad_cell,
        },
    })
}

/// The quarter turns by which a face in its patch comes to lie as on the grid.
fn turns_between(patch: [[f64; 2]; 3], grid: [[f64; 2]; 3]) -> Option<u8> {
    let sides = |p: [[f64; 2]; 3]| [1, 2].map(|k| [p[k][0] - p[0][0], p[k][1] - p[0][1]]);
    let (from, to) = (sides(patch), sides(grid));
    let misses = (0..4u8).map(|turns| {
        let pairs = from.iter().zip(to);
        let apart = pairs.flat_map(|(&p, q)| {
            let p = turned(p, turns);
            [p[0] - q[0], p[1] - q[1]]
        });
        (apart.fold(0.0, |most: f64, x| most.max(x.abs())), turns)
    });
    let least = misses.min_by(|a, b| a.0.total_cmp(&b.0));
    least
        .filter(|(miss, _)| *miss <= SAME_SIDES)
        .map(|(_, turns)| turns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_of_patches_are_found_and_other_shapes_refused() {
        let grid = [[3.0, -1.0], [3.25, -0.5], [2.5, 0.0]];
        for turns in 0..4 {
            let patch = grid.map(|p| {
                let [x, y] = turned(p, (4 - turns) & 3);
                [x + 7.0, y - 2.0]
            });
            assert_eq!(turns_between(patch, grid), Some(turns));
            let mut wide = patch;
            wide[1][0] += 1e-3;
            assert_eq!(turns_between(wide, grid), None);
        }
        let mirrored = grid.map(|[x, y]| [y, x]);
        assert_eq!(turns_between(mirrored, grid), None);
    }
}
