//! A surface on the cells of its grid: the control mesh that a spline surface begins with, and samples of the surface with their places in its cells.
//!
//! *Enters:* [`Gridded`]: faces with coordinates in blocks of cells, and the quad mesh. *Leaves:* a [`Cage`] with the quad mesh's points, its creases where edges of the surface that are sharp lie along edges of cells; and [`Sample`]s.

use super::cage::Cage;
use super::creases::{BLUNT, SHARP, creased};
use super::error::SplineError;
use super::limit::{Place, from_side, to_side};
use crate::atlas::patches::PatchLayout;
use crate::geometry::disjoint_sets::UnionFind;
use crate::geometry::mesh::{Mesh, cross, dot, norm, sub};
use crate::grid::Grid;
use rustc_hash::{FxHashMap, FxHashSet};

/// A surface and its grid, as a folder has them.
#[derive(Clone, Debug)]
pub struct Gridded {
    /// Vertices, source units.
    pub positions: Vec<[f64; 3]>,
    /// Faces, counterclockwise.
    pub faces: Vec<[u32; 3]>,
    /// Block of each.
    pub block: Vec<u32>,
    /// Corners in the coordinates of the block, in cells.
    pub uv: Vec<[[f64; 2]; 3]>,
    /// Points of the quad mesh, source units.
    pub points: Vec<[f64; 3]>,
    /// Cells: corners, counterclockwise from that at the cell's column and row.
    pub cells: Vec<[u32; 4]>,
    /// Block of each.
    pub cell_block: Vec<u32>,
    /// Column and row of each.
    pub cell_at: Vec<[u32; 2]>,
}

/// A point of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// In space.
    pub point: [f64; 3],
    /// Unit normal, interpolated but across sharp edges.
    pub normal: [f64; 3],
    /// Area that it stands for.
    pub area: f64,
    /// How often it counts.
    pub weight: f64,
    /// Its cell.
    pub cell: u32,
    /// Where in it.
    pub at: [f64; 2],
    /// The side of the cell that it lies on and stays on, if it is one of the border. It stands for a strip of the surface then that other samples stand for, too.
    pub border: Option<u8>,
}

impl Sample {
    /// Where it lies.
    pub fn place(&self) -> Place {
        Place {
            cell: self.cell,
            at: self.at,
        }
    }

    /// Area that no other sample stands for.
    pub fn own_area(&self) -> f64 {
        match self.border {
            Some(_) => 0.0,
            None => self.area,
        }
    }
}

/// Faces are divided into parts that are no longer, cells.
const PART: f64 = 0.75;
/// One sample does for faces that are no longer, cells.
const SMALL: f64 = 0.25;
/// Parts along a side of a face, at most.
const MOST_PARTS: f64 = 64.0;
/// Faces whose normals differ by no more are in one plane, radians.
const FLAT: f64 = 1e-3;
/// Parts of edges of the border with samples at both ends and in the middle are no longer, cells.
const BORDER_PART: f64 = 0.5;
/// Weights of these (Simpson).
const ENDS_AND_MIDDLE: [f64; 3] = [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0];
/// So far towards the face, of the way, a point on its side is in the cell that the face is in.
const INWARD: f64 = 1e-6;
/// How far from a line of the grid an edge that lies on it may be, cells.
const ON_LINE: f64 = 1e-9;

/// Cells by block, column and row.
struct Cells(FxHashMap<(u32, [u32; 2]), u32>);

impl Cells {
    fn new(gridded: &Gridded) -> Self {
        let at = gridded.cell_block.iter().zip(&gridded.cell_at).zip(0..);
        Self(at.map(|((&b, &at), c)| ((b, at), c)).collect())
    }

    /// The cell that has a point, and the place in it; one on the border of the block belongs to the cell inside.
    fn find(&self, block: u32, p: [f64; 2]) -> Option<(u32, [f64; 2])> {
        let floor = p.map(|x| x.floor().max(0.0) as u32);
        // At the far sides of a block the cell is the one before.
        for back in [[0, 0], [1, 0], [0, 1], [1, 1]] {
            let at = [0, 1].map(|i| floor[i].wrapping_sub(back[i]));
            if let Some(&cell) = self.0.get(&(block, at)) {
                let inside = [0, 1].map(|i| (p[i] - f64::from(at[i])).clamp(0.0, 1.0));
                return Some((cell, inside));
            }
        }
        None
    }

    /// The cell and side on whose line the middle of an edge lies, and the corner of the cell; `apex` is across the edge in the face.
    fn side(&self, block: u32, p: [f64; 2], apex: [f64; 2]) -> Option<(u32, u8, [f64; 2])> {
        let inside = [0, 1].map(|i| p[i] + INWARD * (apex[i] - p[i]));
        let (cell, at) = self.find(block, inside)?;
        let corner = [0, 1].map(|i| (inside[i] - at[i]).round());
        let [s, t] = [0, 1].map(|i| p[i] - corner[i]);
        let off = [t, 1.0 - s, 1.0 - t, s];
        let side = (0..4).find(|&k| off[k].abs() <= ON_LINE)?;
        Some((cell, side as u8, corner))
    }
}

impl Gridded {
    /// A surface on its grid, in units of the mesh; `layout`: of its blocks.
    pub fn new(mesh: &Mesh, layout: &PatchLayout, grid: &Grid) -> Self {
        let faces = mesh.connectivity.faces();
        let cells = grid.cells_in_blocks();
        Self {
            positions: mesh.positions.as_slice().to_vec(),
            faces: mesh.connectivity.to_faces(),
            block: faces.map(|f| layout.face_patch[f].index() as u32).collect(),
            uv: layout.uv.as_slice().to_vec(),
            points: grid.points.clone(),
            cells: cells.iter().map(|c| c.corners).collect(),
            cell_block: cells.iter().map(|c| c.block).collect(),
            cell_at: cells.iter().map(|c| c.at).collect(),
        }
    }

    /// Least and greatest coordinates of vertices.
    pub fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let none = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        self.positions.iter().fold(none, |(low, high), p| {
            let of = |f: fn(f64, f64) -> f64, a: [f64; 3]| std::array::from_fn(|i| f(a[i], p[i]));
            (of(f64::min, low), of(f64::max, high))
        })
    }

    /// The same elsewhere in space.
    pub fn moved(&self, by: [f64; 3]) -> Self {
        let mut moved = self.clone();
        for p in moved.positions.iter_mut().chain(&mut moved.points) {
            *p = std::array::from_fn(|i| p[i] + by[i]);
        }
        moved
    }

    /// The control mesh, its points those of the quad mesh, with creases where sharp edges of the surface are on edges of cells: see [`creased`].
    ///
    /// # Errors
    /// Cells that make no surface.
    pub fn cage(&self) -> Result<Cage, SplineError> {
        let [blunt, sharp] = [BLUNT, SHARP].map(|angle| self.covered(angle));
        let part = |covered: &FxHashMap<[u32; 2], f64>, ends: [u32; 2]| {
            covered.get(&ends).copied().unwrap_or(0.0)
        };
        creased(self.points.len(), &self.cells, |ends| {
            [part(&blunt, ends), part(&sharp, ends)]
        })
    }

    /// Of edges of cells by their ends, the part of each that sharp edges of the surface cover.
    fn covered(&self, sharp: f64) -> FxHashMap<[u32; 2], f64> {
        let cells = Cells::new(self);
        let normals: Vec<[f64; 3]> = self.faces.iter().map(|f| self.doubled(f)).collect();
        let mut beside: FxHashMap<[u32; 2], u32> = FxHashMap::default();
        let mut covered: FxHashMap<[u32; 2], f64> = FxHashMap::default();
        for (f, corners) in self.faces.iter().enumerate() {
            for k in 0..3 {
                let [a, b] = [corners[k], corners[(k + 1) % 3]];
                beside.insert([a, b], f as u32);
                let Some(&other) = beside.get(&[b, a]) else {
                    continue;
                };
                let (m, n) = (normals[f], normals[other as usize]);
                if norm(cross(m, n)).atan2(dot(m, n)) <= sharp {
                    continue;
                }
                let [p, q] = [self.uv[f][k], self.uv[f][(k + 1) % 3]];
                for (ends, part) in self.on_line(&cells, self.block[f], p, q) {
                    *covered.entry(ends).or_default() += part;
                }
            }
        }
        covered
    }

    /// Faces, those side by side in one plane counted once: how many faces the mesh had before it was divided along lines of the grid, or fewer.
    pub fn facets(&self) -> usize {
        let normals: Vec<[f64; 3]> = self.faces.iter().map(|f| self.doubled(f)).collect();
        let mut beside: FxHashMap<[u32; 2], usize> = FxHashMap::default();
        let mut facets = UnionFind::new(self.faces.len());
        let mut count = self.faces.len();
        for (f, corners) in self.faces.iter().enumerate() {
            for k in 0..3 {
                let [a, b] = [corners[k], corners[(k + 1) % 3]];
                beside.insert([a, b], f);
                let Some(&other) = beside.get(&[b, a]) else {
                    continue;
                };
                let (m, n) = (normals[f], normals[other]);
                let is_flat = norm(cross(m, n)).atan2(dot(m, n)) <= FLAT;
                if is_flat && facets.join(f, other) {
                    count -= 1;
                }
            }
        }
        count
    }

    /// The edges of cells that a segment in a block lies on, and how much of each that is.
    fn on_line(&self, cells: &Cells, block: u32, p: [f64; 2], q: [f64; 2]) -> Vec<([u32; 2], f64)> {
        let on = |i: usize| {
            let line = p[i].round();
            (p[i] - line).abs() <= ON_LINE && (q[i] - line).abs() <= ON_LINE
        };
        let along = match (on(0), on(1)) {
            (true, false) => 1,
            (false, true) => 0,
            _ => return Vec::new(),
        };
        let (low, high) = (p[along].min(q[along]), p[along].max(q[along]));
        // It may pass corners of cells.
        let corners = (low.floor() as i64 + 1..high.ceil() as i64).map(|x| x as f64);
        let ends: Vec<f64> = [low].into_iter().chain(corners).chain([high]).collect();
        let of = |piece: &[f64]| {
            let mut middle = [0, 1].map(|i| (p[i] + q[i]) / 2.0);
            middle[along] = (piece[0] + piece[1]) / 2.0;
            let (cell, at) = cells.find(block, middle)?;
            let corners = self.cells[cell as usize];
            let far = at[1 - along] > 0.5;
            let ends = match (along, far) {
                (0, false) => [0, 1],
                (0, true) => [3, 2],
                (_, false) => [0, 3],
                (_, true) => [1, 2],
            };
            let [a, b] = ends.map(|k: usize| corners[k]);
            Some(([a.min(b), a.max(b)], piece[1] - piece[0]))
        };
        ends.windows(2).filter_map(of).collect()
    }

    /// Of the corners of faces, means of the normals of the faces around a vertex, by area; of those that lie within [`SHARP`] of the face.
    fn normals(&self) -> Vec<[[f64; 3]; 3]> {
        let doubled: Vec<[f64; 3]> = self.faces.iter().map(|f| self.doubled(f)).collect();
        let mut first = vec![0usize; self.positions.len() + 1];
        self.faces
            .iter()
            .flatten()
            .for_each(|&v| first[v as usize + 1] += 1);
        (0..self.positions.len()).for_each(|v| first[v + 1] += first[v]);
        let mut next = first.clone();
        let mut around = vec![0u32; 3 * self.faces.len()];
        for (f, corners) in self.faces.iter().enumerate() {
            for &v in corners {
                around[next[v as usize]] = f as u32;
                next[v as usize] += 1;
            }
        }
        let least = SHARP.cos();
        let at = |f: usize, v: u32| {
            let own = doubled[f];
            let mut sum = own;
            for &g in &around[first[v as usize]..first[v as usize + 1]] {
                let other = doubled[g as usize];
                if g as usize != f && dot(own, other) > least * norm(own) * norm(other) {
                    (0..3).for_each(|i| sum[i] += other[i]);
                }
            }
            let length = norm(sum);
            // A face without area has no samples.
            sum.map(|x| if length > 0.0 { x / length } else { 0.0 })
        };
        self.faces
            .iter()
            .enumerate()
            .map(|(f, corners)| corners.map(|v| at(f, v)))
            .collect()
    }

    /// Twice the area, along the normal.
    fn doubled(&self, corners: &[u32; 3]) -> [f64; 3] {
        let [a, b, c] = corners.map(|v| self.positions[v as usize]);
        cross(sub(b, a), sub(c, a))
    }

    /// Samples of every face: one, three of a larger one, and three of each part of one that is large beside cells; by number of the face.
    ///
    /// # Errors
    /// Faces outside the cells of their block.
    pub fn samples(&self) -> Result<Vec<Sample>, SplineError> {
        let cells = Cells::new(self);
        let normals = self.normals();
        let mut samples = Vec::with_capacity(3 * self.faces.len());
        for (face, corners) in self.faces.iter().enumerate() {
            let (uv, block) = (self.uv[face], self.block[face]);
            let area = norm(self.doubled(corners)) / 2.0;
            if area <= 0.0 {
                continue;
            }
            let longest = (0..3).map(|k| {
                let [p, q] = [uv[k], uv[(k + 1) % 3]];
                (p[0] - q[0]).hypot(p[1] - q[1])
            });
            let longest = longest.fold(0.0, f64::max);
            let parts = (longest / PART).ceil().clamp(1.0, MOST_PARTS) as usize;
            let is_small = longest <= SMALL;
            let count = if is_small { 1 } else { 3 * parts * parts };
            let place = corners.map(|v| self.positions[v as usize]);
            let middle = is_small.then_some([1.0 / 3.0; 3]);
            let inside = places(parts).take(if is_small { 0 } else { count });
            for weights in middle.into_iter().chain(inside) {
                let at = [0, 1].map(|i| (0..3).map(|k| weights[k] * uv[k][i]).sum());
                let (cell, at) =
                    cells
                        .find(block, at)
                        .ok_or(SplineError::Place { face, block, at })?;
                let mixed = |of: &[[f64; 3]; 3]| -> [f64; 3] {
                    [0, 1, 2].map(|i| (0..3).map(|k| weights[k] * of[k][i]).sum())
                };
                let normal = mixed(&normals[face]);
                let length = norm(normal);
                samples.push(Sample {
                    point: mixed(&place),
                    normal: normal.map(|x| x / length),
                    area: area / count as f64,
                    weight: 1.0,
                    cell,
                    at,
                    border: None,
                });
            }
        }
        self.add_border(&cells, &normals, &mut samples);
        Ok(samples)
    }

    /// Adds samples of the border, for a strip as wide as a cell: samples inside faces do not say where it ends. Corners of the border stand for a cell each.
    fn add_border(&self, cells: &Cells, normals: &[[[f64; 3]; 3]], samples: &mut Vec<Sample>) {
        let ends = |corners: &[u32; 3]| [0, 1, 2].map(|k| [corners[k], corners[(k + 1) % 3]]);
        let all: FxHashSet<[u32; 2]> = self.faces.iter().flat_map(ends).collect();
        let area: f64 = samples.iter().map(|s| s.area).sum();
        let width = (area / self.cells.len() as f64).sqrt();
        for (f, corners) in self.faces.iter().enumerate() {
            for (k, [a, b]) in ends(corners).into_iter().enumerate() {
                if all.contains(&[b, a]) {
                    continue;
                }
                let uv = [self.uv[f][k], self.uv[f][(k + 1) % 3]];
                let [p, q] = [a, b].map(|v| self.positions[v as usize]);
                let length = norm(sub(q, p));
                for [from, to] in pieces(uv) {
                    let along = |x: f64, i: usize| uv[0][i] + x * (uv[1][i] - uv[0][i]);
                    let middle = [0, 1].map(|i| along(0.5 * (from + to), i));
                    let Some((cell, side, corner)) =
                        cells.side(self.block[f], middle, self.uv[f][(k + 2) % 3])
                    else {
                        continue;
                    };
                    for (part, weight) in [0.0, 0.5, 1.0].into_iter().zip(ENDS_AND_MIDDLE) {
                        let x = from + part * (to - from);
                        let at = [0, 1].map(|i| (along(x, i) - corner[i]).clamp(0.0, 1.0));
                        let place = to_side(side, at)[0];
                        samples.push(Sample {
                            point: [0, 1, 2].map(|i| p[i] + x * (q[i] - p[i])),
                            normal: normals[f][k],
                            area: weight * (to - from) * length * width,
                            weight: 1.0,
                            cell,
                            at: from_side(side, [place, 0.0]),
                            border: Some(side),
                        });
                    }
                }
            }
        }
    }
}

/// Parts of a segment in a block that lie on one edge of cells and are no longer than [`BORDER_PART`], from 0 to 1.
fn pieces([p, q]: [[f64; 2]; 2]) -> Vec<[f64; 2]> {
    let span = [0, 1].map(|i| q[i] - p[i]);
    let long = usize::from(span[1].abs() > span[0].abs());
    let (from, span) = (p[long], span[long]);
    let mut ends = vec![0.0, 1.0];
    let (low, high) = (from.min(from + span), from.max(from + span));
    let lines = (low.floor() as i64 + 1..high.ceil() as i64).map(|x| (x as f64 - from) / span);
    ends.extend(lines.filter(|x| (0.0..=1.0).contains(x)));
    ends.sort_by(f64::total_cmp);
    let divided = |w: &[f64]| {
        let parts = ((w[1] - w[0]) * span.abs() / BORDER_PART).ceil().max(1.0);
        let (from, step) = (w[0], (w[1] - w[0]) / parts);
        let of = move |i: usize| [from + i as f64 * step, from + (i + 1) as f64 * step];
        (0..parts as usize).map(of)
    };
    ends.windows(2).flat_map(divided).collect()
}

/// Places of three samples in each of parts² equal parts of a triangle, by barycentric coordinates; quadratic functions are integrated exactly (Strang and Fix 1973).
fn places(parts: usize) -> impl Iterator<Item = [f64; 3]> {
    let step = 1.0 / parts as f64;
    let up = (0..parts).flat_map(move |i| (0..parts - i).map(move |j| (i, j, true)));
    let down = (0..parts)
        .flat_map(move |i| (0..(parts - i).saturating_sub(1)).map(move |j| (i, j, false)));
    up.chain(down).flat_map(move |(i, j, is_up)| {
        [0, 1, 2].map(|k| {
            let mut w = [1.0 / 6.0; 3];
            w[k] = 2.0 / 3.0;
            // The second and third coordinate; the first is what is left.
            let [x, y] = match is_up {
                true => [i as f64 + w[1], j as f64 + w[2]],
                false => [(i + 1) as f64 - w[1], (j + 1) as f64 - w[2]],
            };
            let (b, c) = (x * step, y * step);
            [1.0 - b - c, b, c]
        })
    })
}

#[cfg(test)]
#[path = "tests/border.rs"]
mod tests;
