//! One patch as triangles: lattice cells inside, and a constrained Delaunay band between them and the border.
//!
//! *Enters:* an image and the polygon of its patch's border. *Leaves:* a [`Band`].
//!
//! A cell is used whole where its four texels are in the mask, inside the border and at least [`CLEARANCE`] away from
//! it, and the border does not pass through it. What is left is triangulated in patch coordinates with the remaining such texels: the flat metric's own
//! Delaunay triangulation there.
//!
//! *Guaranteed:* the faces make a disk whose border is exactly the polygon, each positive in patch coordinates by exact predicates,
//! but for the width by which a border that touches itself is opened.

use super::chain::Polygon;
use super::crossing::{cells_along, crossings};
use super::frame::Frame;
use super::{PatchImage, RebuildError};
use crate::atlas::plane::{distance, rotate};
use crate::geometry::fill::fill;
use crate::geometry::mesh::{self, distance_to_segment};
use crate::geometry::polygon::is_counterclockwise;
use rustc_hash::FxHashMap;
use std::collections::BTreeSet;
use std::f64::consts::TAU;

/// Least distance of a used texel from the border, in texels.
const CLEARANCE: f64 = 0.4;
/// By how much a border that touches itself is opened, in texels: patches are injective up to 1e-10 of their extent
/// only, and both sides of a cut along which the surface is flat lie on each other.
const OPENING: f64 = 1e-5;
/// Edges shorter than this (texels) have no direction.
const NO_DIRECTION: f64 = 1e-9;

/// The triangles of a patch.
#[derive(Debug)]
pub(super) struct Band {
    pub polygon: Polygon,
    /// Used lattice points: i + width · k.
    pub texels: Vec<u32>,
    /// Corners: the polygon's vertices, then the used lattice points.
    pub faces: Vec<[u32; 3]>,
    /// The first faces, that are not of whole cells.
    pub band_faces: usize,
}

/// Triangulates one patch.
pub(super) fn triangulate(
    id: usize,
    patch: &PatchImage,
    frame: &Frame,
    polygon: Polygon,
) -> Result<Band, RebuildError> {
    let open = open(id, frame, &polygon)?;
    let lattice = Lattice::new(patch, frame, &open.texel);
    let n = polygon.uv.len();
    let mut number = vec![u32::MAX; frame.width * frame.height];
    let mut texels = Vec::new();
    let mut points = open.uv.clone();
    for k in 0..frame.height {
        for i in 0..frame.width {
            if lattice.good[frame.width * k + i] && !lattice.is_surrounded(i, k) {
                number[frame.width * k + i] = points.len() as u32;
                texels.push((frame.width * k + i) as u32);
                points.push(frame.centre(i, k));
            }
        }
    }
    let chords = (0..n).map(|i| [i, (i + 1) % n]);
    let outline: Vec<[usize; 2]> = lattice
        .outline()
        .map(|edge| edge.map(|at| number[at] as usize))
        .collect();
    let fixed: Vec<[usize; 2]> = chords.chain(outline).collect();
    let unfilled = |missing| RebuildError::Triangulation {
        patch: id,
        missing,
        edges: fixed.len(),
    };
    let mut faces = fill(&points, &fixed).ok_or_else(|| unfilled(fixed.len()))?;
    let missing = missing_edges(&faces, &fixed);
    if missing > 0 {
        return Err(unfilled(missing));
    }
    let band_faces = faces.len();
    let mut numbered = |at: usize| {
        if number[at] == u32::MAX {
            number[at] = (n + texels.len()) as u32;
            texels.push(at as u32);
        }
        number[at]
    };
    for [i, k] in lattice.full_cells() {
        let w = frame.width;
        let at = [
            w * k + i,
            w * k + i + 1,
            w * (k + 1) + i + 1,
            w * (k + 1) + i,
        ];
        let p = [(i, k), (i + 1, k), (i + 1, k + 1), (i, k + 1)]
            .map(|(i, k)| patch.position[frame.index(i, k)].map(f64::from));
        let [a, b, c, d] = at.map(&mut numbered);
        // The shorter diagonal in space.
        if mesh::distance(p[0], p[2]) <= mesh::distance(p[1], p[3]) {
            faces.extend([[a, b, c], [a, c, d]]);
        } else {
            faces.extend([[a, b, d], [b, c, d]]);
        }
    }
    Ok(Band {
        polygon,
        texels,
        faces,
        band_faces,
    })
}

/// A polygon that does not meet itself.
struct Open {
    uv: Vec<[f64; 2]>,
    texel: Vec<[f64; 2]>,
}

/// Moves vertices where the polygon meets itself inwards by [`OPENING`], all others stay.
fn open(id: usize, frame: &Frame, polygon: &Polygon) -> Result<Open, RebuildError> {
    let n = polygon.uv.len();
    let mut open = Open {
        uv: polygon.uv.clone(),
        texel: polygon.texel.clone(),
    };
    let mut moved = BTreeSet::new();
    loop {
        let pairs = crossings(&open.uv, &open.texel);
        if pairs.is_empty() && is_counterclockwise(&open.uv) {
            return Ok(open);
        }
        let ends = pairs.iter().flatten().flat_map(|&i| [i, (i + 1) % n]);
        let new: Vec<usize> = ends.filter(|&i| moved.insert(i)).collect();
        if new.is_empty() {
            let [i, j] = pairs.first().copied().unwrap_or([0, 0]);
            let [column, y] = polygon.texel[i];
            return Err(RebuildError::BorderCrossing {
                patch: id,
                first: polygon.chord[i].0,
                second: polygon.chord[j].0,
                column,
                row: frame.height as f64 - y,
            });
        }
        for i in new {
            let inwards = inwards(&polygon.texel, i).map(|x| OPENING * x);
            let step = frame.vector(inwards);
            for axis in 0..2 {
                open.uv[i][axis] += step[axis];
                open.texel[i][axis] += inwards[axis];
            }
        }
    }
}

/// Unit vector along the bisector of the interior angle; the angle at the end of a slit is a full turn.
fn inwards(polygon: &[[f64; 2]], i: usize) -> [f64; 2] {
    const END_OF_SLIT: f64 = 1e-7;
    let n = polygon.len();
    let p = polygon[i];
    let direction = |steps: &mut dyn Iterator<Item = usize>| {
        let q = steps
            .map(|j| polygon[j % n])
            .find(|&q| distance(p, q) > NO_DIRECTION);
        q.map_or(0.0, |q| (q[1] - p[1]).atan2(q[0] - p[0]))
    };
    let forth = direction(&mut (1..n).map(|s| i + s));
    let back = direction(&mut (1..n).map(|s| i + n - s));
    let angle = (back - forth).rem_euclid(TAU);
    let angle = if angle < END_OF_SLIT { TAU } else { angle };
    rotate([1.0, 0.0], forth + 0.5 * angle)
}

/// Which texels and cells of an image can be used.
struct Lattice {
    width: usize,
    height: usize,
    /// Texels in the mask, inside the border and not near to it; lattice order.
    good: Vec<bool>,
    /// Cells with four such texels that the border does not touch; cell (i, k) has the texels i, i + 1, k, k + 1.
    full: Vec<bool>,
}

impl Lattice {
    fn new(patch: &PatchImage, frame: &Frame, border: &[[f64; 2]]) -> Self {
        let (width, height) = (frame.width, frame.height);
        let mut good = inside(border, width, height);
        for k in 0..height {
            for i in 0..width {
                good[width * k + i] &= patch.alpha[frame.index(i, k)] > 0.0;
            }
        }
        let mut full = vec![true; width * height];
        let n = border.len();
        for at in 0..n {
            let (a, b) = (border[at], border[(at + 1) % n]);
            for [column, row] in cells_along(a, b) {
                for k in row - 1..=row + 1 {
                    for i in column - 1..=column + 1 {
                        let within = |x: i64, size: usize| (0..size as i64).contains(&x);
                        if !(within(i, width) && within(k, height)) {
                            continue;
                        }
                        let at = width * k as usize + i as usize;
                        let centre = [i as f64 + 0.5, k as f64 + 0.5];
                        good[at] &= distance_to_segment(centre, a, b) >= CLEARANCE;
                        full[at] &= !touches_cell(centre, a, b);
                    }
                }
            }
        }
        for k in 0..height {
            for i in 0..width {
                let at = width * k + i;
                let has_corners = i + 1 < width && k + 1 < height;
                full[at] &= has_corners
                    && [at, at + 1, at + width, at + width + 1]
                        .iter()
                        .all(|&c| good[c]);
            }
        }
        Self {
            width,
            height,
            good,
            full,
        }
    }

    fn is_full(&self, i: usize, k: usize) -> bool {
        i < self.width && k < self.height && self.full[self.width * k + i]
    }

    /// True where all four cells around a texel are full.
    fn is_surrounded(&self, i: usize, k: usize) -> bool {
        let (left, below) = (i.wrapping_sub(1), k.wrapping_sub(1));
        self.is_full(i, k)
            && self.is_full(left, k)
            && self.is_full(i, below)
            && self.is_full(left, below)
    }

    fn full_cells(&self) -> impl Iterator<Item = [usize; 2]> {
        let cells = (0..self.height).flat_map(|k| (0..self.width).map(move |i| [i, k]));
        cells.filter(|&[i, k]| self.is_full(i, k))
    }

    /// Sides of full cells towards cells that are not, with these on the left.
    fn outline(&self) -> impl Iterator<Item = [usize; 2]> {
        self.full_cells().flat_map(move |[i, k]| {
            let at = |i: usize, k: usize| self.width * k + i;
            let corners = [at(i, k), at(i + 1, k), at(i + 1, k + 1), at(i, k + 1)];
            let beyond = [
                (i, k.wrapping_sub(1)),
                (i + 1, k),
                (i, k + 1),
                (i.wrapping_sub(1), k),
            ];
            (0..4).filter_map(move |side| {
                let (i, k) = beyond[side];
                let edge = [corners[(side + 1) % 4], corners[side]];
                (!self.is_full(i, k)).then_some(edge)
            })
        })
    }
}

/// Whether a segment touches the unit cell whose lower left corner is given: by the axes that can separate them.
fn touches_cell(corner: [f64; 2], a: [f64; 2], b: [f64; 2]) -> bool {
    const MARGIN: f64 = 1e-6;
    let half = 0.5 + MARGIN;
    let middle = corner.map(|x| x + 0.5);
    let apart = |axis: usize| {
        let (a, b) = (a[axis] - middle[axis], b[axis] - middle[axis]);
        a.min(b) > half || a.max(b) < -half
    };
    let along = [b[0] - a[0], b[1] - a[1]];
    let off = along[0] * (middle[1] - a[1]) - along[1] * (middle[0] - a[0]);
    !apart(0) && !apart(1) && off.abs() <= half * (along[0].abs() + along[1].abs())
}

/// Which lattice points a counterclockwise polygon winds around; those on it are near it and do not matter.
fn inside(border: &[[f64; 2]], width: usize, height: usize) -> Vec<bool> {
    let n = border.len();
    // Where edges cross the rows, and whether they go down there.
    let mut crossings: Vec<Vec<(f64, i32)>> = vec![Vec::new(); height];
    for at in 0..n {
        let (a, b) = (border[at], border[(at + 1) % n]);
        let (low, high) = if a[1] <= b[1] { (a, b) } else { (b, a) };
        let row = |y: f64| (y - 0.5).ceil().clamp(0.0, height as f64) as usize;
        for (k, crossings) in (row(low[1])..row(high[1])).zip(&mut crossings[row(low[1])..]) {
            let t = (k as f64 + 0.5 - low[1]) / (high[1] - low[1]);
            let x = low[0] + t * (high[0] - low[0]);
            crossings.push((x, if b[1] < a[1] { 1 } else { -1 }));
        }
    }
    let mut inside = vec![false; width * height];
    for (k, crossings) in crossings.iter_mut().enumerate() {
        crossings.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut passed = crossings.iter().peekable();
        let mut winding = 0;
        for i in 0..width {
            while let Some((_, turn)) = passed.next_if(|(x, _)| *x < i as f64 + 0.5) {
                winding += turn;
            }
            inside[width * k + i] = winding > 0;
        }
    }
    inside
}

/// How many of the fixed edges, and of these only, faces do not end at. Whole cells fill what is beyond the outline.
fn missing_edges(faces: &[[u32; 3]], fixed: &[[usize; 2]]) -> usize {
    let mut open: FxHashMap<[u32; 2], u32> = FxHashMap::default();
    for f in faces {
        for k in 0..3 {
            let (a, b) = (f[k], f[(k + 1) % 3]);
            if open.remove(&[b, a]).is_none() {
                *open.entry([a, b]).or_default() += 1;
            }
        }
    }
    let is_missing = |edge: &&[usize; 2]| open.get(&edge.map(|v| v as u32)) != Some(&1);
    let missing = fixed.iter().filter(is_missing).count();
    missing.max(open.len().abs_diff(fixed.len()))
}
