//! The spline surface of a mesh on any quads, by the fit that `affine-atlas fit` has, so that quads of other programs can be held beside those of the atlas.
//!
//! ```text
//! cargo bench --bench spline_on_quads -- MESH.obj QUADS.obj SURFACE.obj
//! ```
//!
//! Reads triangles and quads near them, prints figures as JSON, and writes the surface as triangles, cell by cell. What the map says of our own quads is found by distance here:
//!
//! * places of samples: of the nearest point of the bilinear cells, normals counting too; the fit moves them on from there
//! * creases: edges of cells that sharp edges of the mesh lie along, with the rules for chains that the atlas has

use affine_atlas::geometry::deviation::Triangles;
use affine_atlas::geometry::mesh::{
    bounding_box, cross, distance_to_segment, dot, norm, sub, triangle_area,
};
use affine_atlas::spline::gridded::{ALONG, BESIDE, BLUNT, Gridded, SHARP, Sample, creased};
use affine_atlas::spline::{Spline, fit_samples};
use rayon::prelude::*;
use std::collections::HashMap;
use std::error::Error;
use std::fs::{File, read_to_string};
use std::io::{BufWriter, Write};

type Point = [f64; 3];

fn lerp(a: Point, b: Point, t: f64) -> Point {
    [0, 1, 2].map(|i| a[i] + t * (b[i] - a[i]))
}

/// Parts of a cell along a side, two triangles each.
const PARTS: usize = 4;
/// A normal that turns by a right angle counts like so much distance, in sides of a mean cell …
const TURN: f64 = 0.2;
/// … and one that turns by more like so much.
const AWAY: f64 = 4.0;
/// Triangles in a leaf of the tree.
const LEAF: usize = 4;
/// Places of an edge of cells that are looked at.
const PLACES: usize = 16;

fn main() -> Result<(), Box<dyn Error>> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let files: Vec<&str> = given.iter().map(String::as_str).collect();
    let files: Vec<&str> = files.into_iter().filter(|a| *a != "--bench").collect();
    let [mesh, quads, surface] = files[..] else {
        return Err("MESH.obj QUADS.obj SURFACE.obj".into());
    };
    let (mut positions, faces) = read::<3>(mesh)?;
    let (mut points, cells) = read::<4>(quads)?;
    // About the middle, for digits.
    let (low, high) = bounding_box(&positions);
    let middle = lerp(low, high, 0.5);
    for p in positions.iter_mut().chain(&mut points) {
        *p = sub(*p, middle);
    }
    let source = Triangles {
        positions: &positions,
        faces: &faces,
    };
    let pieces = of_cells(&points, &cells);
    let area: f64 = pieces.iter().map(|p| p.area()).sum();
    let side = (area / cells.len() as f64).sqrt();
    let sharp = [BLUNT, SHARP].map(|angle| sharp(source, angle));
    let cage = creased(points.len(), &cells, |[a, b]| {
        let ends = [points[a as usize], points[b as usize]];
        [0, 1].map(|i| covered(ends, &sharp[i]))
    })?;
    let mut samples = samples(source, side)?;
    let tree = Tree::new(pieces);
    samples.par_iter_mut().for_each(|s| {
        (s.cell, s.at) = tree.place(s, side);
    });
    let spline = fit_samples(cage, samples, source)?;
    println!("{}", figures(&spline));
    write(surface, &spline, middle)
}

type PointsAndFaces<const N: usize> = (Vec<Point>, Vec<[u32; N]>);

/// Points and polygons of an OBJ, all with as many corners.
fn read<const N: usize>(path: &str) -> Result<PointsAndFaces<N>, Box<dyn Error>> {
    let (mut points, mut polygons) = (Vec::new(), Vec::new());
    for line in read_to_string(path)?.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let numbers: Vec<f64> = words.map(str::parse).collect::<Result<_, _>>()?;
                points.push([numbers[0], numbers[1], numbers[2]]);
            }
            Some("f") => {
                let of = |w: &str| w.split('/').next().unwrap_or("").parse::<u32>();
                let numbers: Vec<u32> = words.map(of).collect::<Result<_, _>>()?;
                let corners: [u32; N] = numbers
                    .try_into()
                    .map_err(|_| format!("{path}: a polygon has not {N} corners"))?;
                polygons.push(corners.map(|v| v - 1));
            }
            _ => {}
        }
    }
    Ok((points, polygons))
}

/// Samples as dense as on the grid of a map, cells being as large as the mean one; their places are yet to be found.
fn samples(source: Triangles<'_>, side: f64) -> Result<Vec<Sample>, Box<dyn Error>> {
    // Every face by itself, its longest side along the first coordinate.
    let flat = |f: &[u32; 3]| {
        let p = f.map(|v| source.positions[v as usize]);
        let length = |k: usize| norm(sub(p[(k + 1) % 3], p[k]));
        let first = (1..3).fold(0, |l, k| if length(k) > length(l) { k } else { l });
        let (base, third) = (length(first), sub(p[(first + 2) % 3], p[first]));
        let along = sub(p[(first + 1) % 3], p[first]).map(|x| x / base);
        let (x, y) = (dot(third, along), norm(cross(third, along)));
        let mut uv = [[0.0; 2]; 3];
        uv[(first + 1) % 3] = [base / side, 0.0];
        uv[(first + 2) % 3] = [x.max(0.0) / side, y / side];
        uv
    };
    let uv: Vec<[[f64; 2]; 3]> = source.faces.iter().map(flat).collect();
    let longest = uv
        .iter()
        .flatten()
        .flatten()
        .fold(0.0, |m: f64, x| m.max(*x));
    let columns = longest.ceil() as u32 + 1;
    let cell_at = (0..columns * columns).map(|i| [i % columns, i / columns]);
    let gridded = Gridded {
        positions: source.positions.to_vec(),
        faces: source.faces.to_vec(),
        block: vec![0; source.faces.len()],
        uv,
        points: Vec::new(),
        cells: Vec::new(),
        cell_block: vec![0; (columns * columns) as usize],
        cell_at: cell_at.collect(),
    };
    Ok(gridded.samples()?)
}

/// Ends of edges along which a surface turns by more than an angle.
fn sharp(source: Triangles<'_>, angle: f64) -> Vec<[Point; 2]> {
    let normal = |f: usize| {
        let [a, b, c] = source.faces[f].map(|v| source.positions[v as usize]);
        cross(sub(b, a), sub(c, a))
    };
    let mut beside = HashMap::new();
    let mut edges = Vec::new();
    for (f, corners) in source.faces.iter().enumerate() {
        for k in 0..3 {
            let [a, b] = [corners[k], corners[(k + 1) % 3]];
            beside.insert([a, b], f);
            if let Some(&other) = beside.get(&[b, a]) {
                let (m, n) = (normal(f), normal(other));
                if norm(cross(m, n)).atan2(dot(m, n)) > angle {
                    edges.push([a, b].map(|v| source.positions[v as usize]));
                }
            }
        }
    }
    edges
}

/// The part of an edge of cells that sharp edges lie along.
fn covered([a, b]: [Point; 2], sharp: &[[Point; 2]]) -> f64 {
    let length = norm(sub(b, a));
    let middle = lerp(a, b, 0.5);
    let beside: Vec<&[Point; 2]> = sharp
        .iter()
        .filter(|[c, d]| {
            let reach = (0.5 + BESIDE) * length + norm(sub(*d, *c)) / 2.0;
            norm(sub(lerp(*c, *d, 0.5), middle)) <= reach
                && dot(sub(b, a), sub(*d, *c)).abs() >= ALONG * length * norm(sub(*d, *c))
        })
        .collect();
    let is_on = |i: &usize| {
        let p = lerp(a, b, (*i as f64 + 0.5) / PLACES as f64);
        let mut near = beside.iter();
        near.any(|[c, d]| distance_to_segment(p, *c, *d) <= BESIDE * length)
    };
    (0..PLACES).filter(is_on).count() as f64 / PLACES as f64
}

/// A triangle of a bilinear cell.
#[derive(Clone, Copy)]
struct Piece {
    corners: [Point; 3],
    /// Unit.
    normal: Point,
    cell: u32,
    /// Corners in the cell.
    at: [[f64; 2]; 3],
}

impl Piece {
    fn new(corners: [Point; 3], cell: u32, at: [[f64; 2]; 3]) -> Self {
        let [a, b, c] = corners;
        let normal = cross(sub(b, a), sub(c, a));
        let length = norm(normal);
        Self {
            corners,
            normal: normal.map(|x| if length > 0.0 { x / length } else { 0.0 }),
            cell,
            at,
        }
    }

    fn area(&self) -> f64 {
        triangle_area(self.corners)
    }

    /// Weights of the corners at the nearest point, and its squared distance.
    fn nearest(&self, p: Point) -> ([f64; 3], f64) {
        let corners = self.corners;
        let whole = |k: usize| {
            let [a, b] = [corners[(k + 1) % 3], corners[(k + 2) % 3]];
            dot(cross(sub(a, p), sub(b, p)), self.normal)
        };
        let weights = [0, 1, 2].map(whole);
        let sum: f64 = weights.iter().sum();
        let inside = sum > 0.0 && weights.iter().all(|&w| w >= 0.0);
        let off = |w: [f64; 3]| {
            let at = [0, 1, 2].map(|i| (0..3).map(|k| w[k] * corners[k][i]).sum());
            let d = sub(p, at);
            (w, dot(d, d))
        };
        if inside {
            return off(weights.map(|w| w / sum));
        }
        let along = |k: usize| {
            let [a, b] = [corners[k], corners[(k + 1) % 3]];
            let d = sub(b, a);
            let t = (dot(sub(p, a), d) / dot(d, d).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
            let mut w = [0.0; 3];
            (w[k], w[(k + 1) % 3]) = (1.0 - t, t);
            off(w)
        };
        let [first, second, third] = [0, 1, 2].map(along);
        let less = |a: ([f64; 3], f64), b: ([f64; 3], f64)| if b.1 < a.1 { b } else { a };
        less(less(first, second), third)
    }
}

/// Triangles of bilinear cells.
fn of_cells(points: &[Point], cells: &[[u32; 4]]) -> Vec<Piece> {
    let mut pieces = Vec::with_capacity(cells.len() * 2 * PARTS * PARTS);
    for (cell, corners) in (0..).zip(cells) {
        let [p, q, r, s] = corners.map(|v| points[v as usize]);
        let of = |at: [[f64; 2]; 3]| {
            let corners = at.map(|[u, v]| lerp(lerp(p, q, u), lerp(s, r, u), v));
            Piece::new(corners, cell, at)
        };
        pieces.extend(triangles(PARTS).map(of));
    }
    pieces
}

/// Corners of the triangles of a cell, two a part and row by row.
fn triangles(parts: usize) -> impl Iterator<Item = [[f64; 2]; 3]> {
    let place = move |x: usize, y: usize| [x, y].map(|i| i as f64 / parts as f64);
    (0..parts * parts).flat_map(move |i| {
        let (x, y) = (i % parts, i / parts);
        let (a, c) = (place(x, y), place(x + 1, y + 1));
        [[a, place(x + 1, y), c], [a, c, place(x, y + 1)]]
    })
}

/// Pieces in nested boxes.
struct Tree {
    pieces: Vec<Piece>,
    nodes: Vec<Node>,
}

struct Node {
    low: Point,
    high: Point,
    /// Pieces of a leaf, else none; the first child follows its parent.
    pieces: std::ops::Range<usize>,
    second: usize,
}

impl Tree {
    fn new(mut pieces: Vec<Piece>) -> Self {
        let mut nodes = Vec::new();
        let count = pieces.len();
        divide(&mut pieces, 0..count, &mut nodes);
        Self { pieces, nodes }
    }

    /// The place whose distance and normal are nearest to those of a sample.
    fn place(&self, sample: &Sample, side: f64) -> (u32, [f64; 2]) {
        let p = sample.point;
        let bound = |at: usize| {
            let node = &self.nodes[at];
            let outside = |i: usize| (node.low[i] - p[i]).max(p[i] - node.high[i]).max(0.0);
            let off = [0, 1, 2].map(outside);
            dot(off, off)
        };
        let mut best = (f64::INFINITY, (0, [0.5; 2]));
        let mut stack = vec![(bound(0), 0)];
        while let Some((least, at)) = stack.pop() {
            if least >= best.0 {
                continue;
            }
            let node = &self.nodes[at];
            for piece in &self.pieces[node.pieces.clone()] {
                let cosine = dot(piece.normal, sample.normal);
                let away = if cosine > 0.0 { 0.0 } else { AWAY * AWAY };
                let turned = (TURN * TURN * (1.0 - cosine) + away) * side * side;
                if turned >= best.0 {
                    continue;
                }
                let (w, squared) = piece.nearest(p);
                if squared + turned < best.0 {
                    let at = [0, 1].map(|i| (0..3).map(|k| w[k] * piece.at[k][i]).sum());
                    best = (squared + turned, (piece.cell, at));
                }
            }
            if node.pieces.is_empty() {
                let mut children = [at + 1, node.second].map(|child| (bound(child), child));
                if children[0].0 < children[1].0 {
                    children.swap(0, 1);
                }
                stack.extend(children);
            }
        }
        best.1
    }
}

fn divide(pieces: &mut [Piece], range: std::ops::Range<usize>, nodes: &mut Vec<Node>) {
    let own = &mut pieces[range.clone()];
    let all: Vec<Point> = own.iter().flat_map(|p| p.corners).collect();
    let (low, high) = bounding_box(&all);
    let at = nodes.len();
    let is_leaf = own.len() <= LEAF;
    nodes.push(Node {
        low,
        high,
        pieces: if is_leaf { range.clone() } else { 0..0 },
        second: 0,
    });
    if is_leaf {
        return;
    }
    let size = sub(high, low);
    let axis = (1..3).fold(0, |l, i| if size[i] > size[l] { i } else { l });
    let centre = |p: &Piece| p.corners.iter().map(|c| c[axis]).sum::<f64>();
    let half = own.len() / 2;
    own.select_nth_unstable_by(half, |a, b| centre(a).total_cmp(&centre(b)));
    let middle = range.start + half;
    divide(pieces, range.start..middle, nodes);
    nodes[at].second = nodes.len();
    divide(pieces, middle..range.end, nodes);
}

fn figures(spline: &Spline) -> String {
    let cage = &spline.cage;
    let inside = |&(c, k): &(u32, u8)| {
        cage.across[c as usize][usize::from(k)].is_some() && cage.is_crease((c, k))
    };
    let both = spline.deviation.unwrap_or_default();
    let part = |x: f64| x / spline.diagonal;
    format!(
        "{{\"cells\": {}, \"control_points\": {}, \"crease_edges\": {}, \"corners\": {}, \"from_source_rms\": {:.4e}, \"from_source_max\": {:.4e}, \"both_ways_rms\": {:.4e}, \"both_ways_max\": {:.4e}, \"turned_over\": {:.2e}}}",
        cage.cells.len(),
        cage.vertices,
        cage.edges().filter(inside).count(),
        cage.is_corner.iter().filter(|c| **c).count(),
        part(spline.errors.rms),
        part(spline.errors.max),
        part(both.rms),
        part(both.hausdorff),
        spline.shape.turned_over,
    )
}

fn write(path: &str, spline: &Spline, middle: Point) -> Result<(), Box<dyn Error>> {
    let triangles = spline.tessellation();
    let mut out = BufWriter::new(File::create(path)?);
    for p in &triangles.points {
        let [x, y, z] = [0, 1, 2].map(|i| p[i] + middle[i]);
        writeln!(out, "v {x:.9} {y:.9} {z:.9}")?;
    }
    for f in &triangles.faces {
        let [a, b, c] = f.map(|v| v + 1);
        writeln!(out, "f {a} {b} {c}")?;
    }
    Ok(out.flush()?)
}
