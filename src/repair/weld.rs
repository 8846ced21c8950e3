//! Which vertices stand for which.
//!
//! Files cut a surface open wherever normals or texture coordinates jump, and some store every triangle
//! on its own. Joining all vertices at equal positions would mend both, but would also join closed
//! sheets that only touch. So a vertex is welded only where it lies on an open edge (an edge of one
//! face) of the file's own connectivity: a vertex whose fans are all complete lacks nothing. Ends of one edge
//! at one position are joined in any case, since no metric has an edge of length zero; so are those of an edge
//! that is nothing beside the others of all its faces, as Boolean operations and marching cubes leave them where
//! float32 rounds the same point twice, or where a file has six decimals.

use crate::geometry::mesh::{bounding_box, distance};
use crate::repair::RepairParams;
use crate::repair::clean::DraftFace;
use crate::repair::log::Change;
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap};

/// An edge that is shorter than this part of the longest edge of each of its faces is one point: a few units in the last place of float32 coordinates.
const NEEDLE: f64 = 2e-6;

/// So is one that is shorter than this part of the size of the mesh, a few units in the last place of coordinates that were rounded far from
/// the origin or written with six decimals, …
const ROUNDED: f64 = 2e-6;
/// … and than this part of the longest edge of each of its faces.
const THIN: f64 = 1e-4;

/// For every vertex the one that stands for it (itself, or a lower index at the same position). `faces` are those of the file, `met` pairs of vertices that are one point;
/// adds a change for each that is gone and for each that no face uses.
pub fn weld(
    positions: &[[f64; 3]],
    faces: &[[u32; 3]],
    params: &RepairParams,
    met: &[[u32; 2]],
    changes: &mut Vec<Change>,
) -> Vec<u32> {
    let mut stands_for: Vec<u32> = (0..positions.len() as u32).collect();
    if params.weld {
        let open = open_vertices(positions.len(), faces);
        if params.weld_tolerance > 0.0 {
            let (low, high) = bounding_box(positions);
            let radius = params.weld_tolerance * distance(low, high);
            weld_within(positions, &open, radius, low, &mut stands_for);
        } else {
            weld_equal(positions, &open, &mut stands_for);
        }
    }
    for face in faces {
        for k in 0..3 {
            let (a, b) = (face[k], face[(k + 1) % 3]);
            if positions[a as usize] == positions[b as usize] {
                join(&mut stands_for, a, b);
            }
        }
    }
    met.iter().for_each(|&[a, b]| join(&mut stands_for, a, b));
    join_needles(positions, faces, &mut stands_for);
    let mut used = vec![false; positions.len()];
    for &v in faces.iter().flatten() {
        used[v as usize] = true;
    }
    for v in 0..stands_for.len() as u32 {
        let onto = root(&mut stands_for, v);
        stands_for[v as usize] = onto;
        if onto != v {
            changes.push(Change::WeldedVertex { vertex: v, onto });
        } else if !used[v as usize] {
            changes.push(Change::UnreferencedVertex { vertex: v });
        }
    }
    stands_for
}

/// Every vertex on an edge that has one face only.
fn open_vertices(vertices: usize, faces: &[[u32; 3]]) -> Vec<bool> {
    let mut edges: Vec<(u32, u32)> = faces
        .iter()
        .flat_map(|f| (0..3).map(|k| (f[k], f[(k + 1) % 3])))
        .filter(|(a, b)| a != b)
        .map(|(a, b)| (a.min(b), a.max(b)))
        .collect();
    edges.par_sort_unstable();
    let mut open = vec![false; vertices];
    for same in edges.chunk_by(|a, b| a == b) {
        if same.len() == 1 {
            open[same[0].0 as usize] = true;
            open[same[0].1 as usize] = true;
        }
    }
    open
}

fn weld_equal(positions: &[[f64; 3]], open: &[bool], stands_for: &mut [u32]) {
    // Adding 0 turns −0 into 0, so that equal positions have equal bits.
    let bits = |v: u32| positions[v as usize].map(|x| (x + 0.0).to_bits());
    let mut order: Vec<u32> = (0..positions.len() as u32)
        .filter(|&v| open[v as usize])
        .collect();
    order.sort_unstable_by_key(|&v| (bits(v), v));
    for same in order.chunk_by(|&a, &b| bits(a) == bits(b)) {
        for &v in &same[1..] {
            stands_for[v as usize] = same[0];
        }
    }
}

/// Each vertex is welded to the lowest earlier survivor within the radius; not transitively, so no
/// chain of close vertices collapses to a point.
fn weld_within(
    positions: &[[f64; 3]],
    open: &[bool],
    radius: f64,
    low: [f64; 3],
    stands_for: &mut [u32],
) {
    if radius <= 0.0 {
        return weld_equal(positions, open, stands_for);
    }
    let cell = |p: [f64; 3]| -> [i64; 3] {
        std::array::from_fn(|i| ((p[i] - low[i]) / radius).floor() as i64)
    };
    let mut survivors: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    for v in (0..positions.len()).filter(|&v| open[v]) {
        let (p, home) = (positions[v], cell(positions[v]));
        let near = (0..27)
            .map(|i| {
                [
                    home[0] + i % 3 - 1,
                    home[1] + i / 3 % 3 - 1,
                    home[2] + i / 9 - 1,
                ]
            })
            .filter_map(|c| survivors.get(&c))
            .flatten()
            .copied()
            .filter(|&s| distance(positions[s as usize], p) <= radius)
            .min();
        match near {
            Some(s) => stands_for[v] = s,
            None => survivors.entry(home).or_default().push(v as u32),
        }
    }
}

/// Joins the ends of edges whose faces are all needles, shortest first; not transitively.
fn join_needles(positions: &[[f64; 3]], faces: &[[u32; 3]], stands_for: &mut [u32]) {
    let at = |v: u32| positions[v as usize];
    let corners: Vec<[f64; 3]> = faces.iter().flatten().map(|&v| at(v)).collect();
    let (low, high) = bounding_box(&corners);
    let rounded = ROUNDED * distance(low, high);
    let is_nothing = |length: f64, longest: f64| {
        length <= NEEDLE * longest || (length <= rounded && length <= THIN * longest)
    };
    let corners = |face: &[u32; 3], stands_for: &mut [u32]| face.map(|v| root(stands_for, v));
    let lengths = |f: [u32; 3]| [0, 1, 2].map(|k| distance(at(f[k]), at(f[(k + 1) % 3])));
    let longest = |lengths: [f64; 3]| lengths.into_iter().fold(0.0, f64::max);
    // Length of the edge and longest one of its faces.
    let mut needles: BTreeMap<[u32; 2], [f64; 2]> = BTreeMap::new();
    for is_last in [false, true] {
        for face in faces {
            let f = corners(face, stands_for);
            let lengths = lengths(f);
            let longest = longest(lengths);
            for (k, &length) in lengths.iter().enumerate() {
                let [a, b] = [f[k], f[(k + 1) % 3]];
                let (edge, is_needle) = ([a.min(b), a.max(b)], is_nothing(length, longest));
                match (is_last, is_needle) {
                    (false, true) if a != b => {
                        let shortest = needles.entry(edge).or_insert([length, longest]);
                        shortest[1] = shortest[1].min(longest);
                    }
                    (true, false) => {
                        needles.remove(&edge);
                    }
                    _ => {}
                }
            }
        }
        if needles.is_empty() {
            return;
        }
    }
    let mut needles: Vec<([u32; 2], [f64; 2])> = needles.into_iter().collect();
    needles.sort_by(|a, b| a.1[0].total_cmp(&b.1[0]));
    for ([a, b], [_, longest]) in needles {
        let [p, q] = [a, b].map(|v| at(root(stands_for, v)));
        if is_nothing(distance(p, q), longest) {
            join(stands_for, a, b);
        }
    }
}

/// Pairs of vertices of faces that are one point in the same way.
pub fn needles(positions: &[[f64; 3]], faces: &[DraftFace]) -> Vec<[u32; 2]> {
    let faces: Vec<[u32; 3]> = faces.iter().map(|face| face.vertices).collect();
    let mut stands_for: Vec<u32> = (0..positions.len() as u32).collect();
    join_needles(positions, &faces, &mut stands_for);
    let onto: Vec<u32> = (0..positions.len() as u32)
        .map(|v| root(&mut stands_for, v))
        .collect();
    let joined = (0..).zip(onto).filter(|(v, onto)| v != onto);
    joined.map(|(v, onto)| [onto, v]).collect()
}

/// The vertex at the end of the chain, which is halved on the way.
fn root(stands_for: &mut [u32], mut v: u32) -> u32 {
    while stands_for[v as usize] != v {
        let next = stands_for[v as usize];
        stands_for[v as usize] = stands_for[next as usize];
        v = next;
    }
    v
}

/// The lower root stands for both.
fn join(stands_for: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(stands_for, a), root(stands_for, b));
    stands_for[a.max(b) as usize] = a.min(b);
}
