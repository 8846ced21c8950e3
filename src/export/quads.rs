//! `quads.obj`: the quad mesh of the grid, for Blender, Houdini, Maya.
//!
//! Vertices as `quad_positions`, faces as `quads`, row by row; every float with the shortest decimals that read back to the same bits. A face has the material at its middle, and, where
//! the source has texture coordinates, those of its first set beside each corner, on the face's own side of a seam.

use crate::geometry::ids::{FaceId, NONE};
use crate::geometry::mesh::{AttributeKind, CornerAttribute, Material};
use crate::grid::Grid;
use crate::product::AffineAtlas;
use std::collections::HashMap;
use std::fmt::Write;

/// How far from its corner towards its middle a cell is asked for its texture coordinates, cells.
const INSIDE: f64 = 1e-3;

/// A face and weights of its corners.
type Place = (FaceId, [f64; 3]);

/// The middle of a cell and places beside its four corners, counterclockwise from that at its column and row.
type Probes = [Option<Place>; 5];

/// The file.
pub fn text(atlas: &AffineAtlas, grid: &Grid, materials: &[Material]) -> String {
    let mut text = String::new();
    for [x, y, z] in &grid.points {
        let _ = writeln!(text, "v {x} {y} {z}");
    }
    let mut sets = atlas.mesh.attributes.iter();
    let set = sets.find(|a| a.kind == AttributeKind::TexCoord(0));
    let has_materials = atlas.mesh.face_material.iter().any(|&m| m != NONE);
    let probes = match set.is_some() || has_materials {
        true => probed(atlas, grid),
        false => vec![[None; 5]; grid.cells()],
    };
    let mut faces = String::new();
    let mut numbers: HashMap<[u32; 3], usize> = HashMap::new();
    let mut last = None;
    for (cell, probes) in grid.cells_in_blocks().iter().zip(&probes) {
        let material = probes[0].map_or(NONE, |(f, _)| atlas.mesh.face_material[f]);
        if has_materials && last != Some(material) {
            let _ = writeln!(faces, "usemtl {}", name_of(material, materials));
            last = Some(material);
        }
        let corners = cell.corners.map(|i| i + 1);
        let uv = set.and_then(|set| coordinates(set, probes));
        faces.push('f');
        for k in 0..4 {
            let _ = write!(faces, " {}", corners[k]);
            if let Some(uv) = &uv {
                let [u, v] = uv[k];
                let next = numbers.len() + 1;
                let key = [corners[k], u.to_bits(), v.to_bits()];
                let number = *numbers.entry(key).or_insert(next);
                if number == next {
                    let _ = writeln!(text, "vt {u} {v}");
                }
                let _ = write!(faces, "/{number}");
            }
        }
        faces.push('\n');
    }
    text + &faces
}

/// A word: names with spaces would end at the first.
fn name_of(material: u32, materials: &[Material]) -> String {
    let name = materials.get(material as usize);
    let name = name.and_then(|m| m.name.as_deref()).unwrap_or_default();
    let word: String = name
        .chars()
        .map(|c| {
            if c.is_whitespace() || c.is_control() {
                '_'
            } else {
                c
            }
        })
        .collect();
    match (word.is_empty(), material) {
        (false, _) => word,
        (true, NONE) => "none".to_owned(),
        (true, _) => format!("material-{material}"),
    }
}

/// Texture coordinates beside the corners, v up as OBJ has it; none where the source has none.
fn coordinates(set: &CornerAttribute, probes: &Probes) -> Option<[[f32; 2]; 4]> {
    let mut uv = [[0.0; 2]; 4];
    for (k, uv) in uv.iter_mut().enumerate() {
        let (f, weights) = probes[k + 1].or(probes[0])?;
        let at = |i: usize| -> f64 {
            let of = |corner: usize| f64::from(set.corner(f.index(), corner)[i]);
            (0..3).map(|corner| weights[corner] * of(corner)).sum()
        };
        *uv = [at(0) as f32, (1.0 - at(1)) as f32];
    }
    let is_known = uv.as_flattened().iter().all(|x| x.is_finite());
    is_known.then_some(uv)
}

/// Where the probes of every cell lie, found face by face.
fn probed(atlas: &AffineAtlas, grid: &Grid) -> Vec<Probes> {
    let mut probes: Vec<Probes> = vec![[None; 5]; grid.cells()];
    let layout = &atlas.patches;
    for f in atlas.mesh.connectivity.faces() {
        let (block, p) = (
            &grid.blocks.blocks[layout.face_patch[f].index()],
            layout.uv[f],
        );
        let [w, h] = block.cells;
        let range = |i: usize, most: usize| {
            let of = p.map(|p| p[i]);
            let low = of[0].min(of[1]).min(of[2]).floor().max(0.0) as usize;
            let high = of[0].max(of[1]).max(of[2]).ceil().max(0.0) as usize;
            low..high.min(most)
        };
        for row in range(1, h) {
            for column in range(0, w) {
                let (q, _) = block.squares[row * w + column];
                for (probe, found) in probes[q as usize].iter_mut().enumerate() {
                    if found.is_none() {
                        let [x, y] = offset(probe);
                        let at = [column as f64 + x, row as f64 + y];
                        *found = weights(p, at).map(|weights| (f, weights));
                    }
                }
            }
        }
    }
    probes
}

/// Where a probe lies in its cell.
fn offset(probe: usize) -> [f64; 2] {
    let (low, high) = (INSIDE, 1.0 - INSIDE);
    [
        [0.5, 0.5],
        [low, low],
        [high, low],
        [high, high],
        [low, high],
    ][probe]
}

/// Barycentric coordinates of a point in a counterclockwise triangle; none outside.
fn weights(p: [[f64; 2]; 3], at: [f64; 2]) -> Option<[f64; 3]> {
    let area = |a: [f64; 2], b: [f64; 2]| {
        (a[0] - at[0]) * (b[1] - at[1]) - (a[1] - at[1]) * (b[0] - at[0])
    };
    let parts = [area(p[1], p[2]), area(p[2], p[0]), area(p[0], p[1])];
    let sum: f64 = parts.iter().sum();
    (sum > 0.0 && parts.iter().all(|x| *x >= 0.0)).then(|| parts.map(|x| x / sum))
}
