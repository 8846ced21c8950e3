//! Faces given from both sides: duplicates, backs of flat sheets, flaps.
//!
//! Leaves, panes and paper are often given from both sides, so that they are seen from both. Welded, the two sides are a closed
//! surface without volume. Where they have the same triangles, the second of each two is a duplicate. Where they have others
//! (exporters divide a rectangle along either diagonal), the faces that lie in one plane close each other: along every edge
//! as many run one way as the other. Where both sides have the same vertices, that of the first face stays.

use crate::geometry::mesh::{cross, distance, dot, norm, sub};
use crate::repair::clean::DraftFace;
use crate::repair::glue::Side;
use crate::repair::log::{Change, RemovalReason};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Corners lie in a plane where they are nearer than this part of the mesh's size, which float32 rounds in few steps ...
const ROUNDED: f64 = 2e-6;
/// ... and than this part of the longest edge at hand: parts of models can be as small.
const FLAT: f64 = 1e-3;

/// Of faces with the same three vertices the first stays, whatever the orientation of the others, unless they are a
/// sheet that hangs on something: see `drop_flaps`.
pub fn drop_duplicates(faces: &mut Vec<DraftFace>, changes: &mut Vec<Change>) {
    let mut by_vertices: Vec<([u32; 3], u32)> = (0..)
        .zip(&*faces)
        .map(|(i, face)| (sorted(face.vertices).0, i))
        .collect();
    // By vertices, and of equals the first first.
    by_vertices.par_sort_unstable();
    let mut first_of: Vec<u32> = (0..faces.len() as u32).collect();
    let mut two_sided = vec![false; faces.len()];
    for same in by_vertices.chunk_by(|a, b| a.0 == b.0) {
        let first = same[0].1;
        let even = |i: u32| sorted(faces[i as usize].vertices).1;
        for &(_, i) in &same[1..] {
            first_of[i as usize] = first;
            two_sided[first as usize] |= even(i) != even(first);
        }
    }
    drop(by_vertices);
    let is_first = |i: usize| first_of[i] as usize == i;
    for i in (0..faces.len()).filter(|&i| !is_first(i)) {
        changes.push(Change::RemovedFace {
            face: faces[i].source,
            reason: RemovalReason::DuplicateOf(faces[first_of[i] as usize].source),
        });
    }
    let any_two_sided = two_sided.contains(&true);
    let mut at = 0..;
    two_sided.retain(|_| at.next().is_some_and(is_first));
    let mut at = 0..;
    faces.retain(|_| at.next().is_some_and(is_first));
    if any_two_sided {
        drop_flaps(faces, two_sided, changes);
    }
}

/// Ascending vertices, and whether that is an even permutation.
fn sorted([a, b, c]: [u32; 3]) -> ([u32; 3], bool) {
    let mut key = [a, b, c];
    key.sort_unstable();
    let rotated = key == [a, b, c] || key == [b, c, a] || key == [c, a, b];
    (key, rotated)
}

/// A face given from both sides is a sheet without volume. Where such sheets hang on nothing else, one side is the
/// surface. Where they hang on an edge that has two or more other faces (a flap, or the walls between cells), both sides
/// go: every edge loses two faces at a time, so what was closed stays closed.
fn drop_flaps(faces: &mut Vec<DraftFace>, two_sided: Vec<bool>, changes: &mut Vec<Change>) {
    let mut sides: Vec<(u32, u32, usize)> = faces
        .iter()
        .enumerate()
        .flat_map(|(i, f)| {
            let v = f.vertices;
            [(v[0], v[1]), (v[1], v[2]), (v[2], v[0])].map(|(a, b)| (a.min(b), a.max(b), i))
        })
        .collect();
    sides.sort_unstable();
    let mut hangs = vec![false; faces.len()];
    let mut belongs = vec![false; faces.len()];
    let mut neighbours: Vec<Vec<usize>> = vec![Vec::new(); faces.len()];
    for edge in sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let (flat, solid): (Vec<usize>, Vec<usize>) =
            edge.iter().map(|side| side.2).partition(|&i| two_sided[i]);
        for pair in flat.windows(2) {
            neighbours[pair[0]].push(pair[1]);
            neighbours[pair[1]].push(pair[0]);
        }
        for i in flat {
            hangs[i] |= solid.len() >= 2;
            belongs[i] |= solid.len() == 1;
        }
    }
    let mut goes = vec![false; faces.len()];
    let mut seen = vec![false; faces.len()];
    for seed in (0..faces.len()).filter(|&i| two_sided[i]) {
        if seen[seed] {
            continue;
        }
        let mut sheet = vec![seed];
        seen[seed] = true;
        let mut next = 0;
        while next < sheet.len() {
            for &j in &neighbours[sheet[next]] {
                if !seen[j] {
                    seen[j] = true;
                    sheet.push(j);
                }
            }
            next += 1;
        }
        if sheet.iter().any(|&i| hangs[i]) && !sheet.iter().any(|&i| belongs[i]) {
            sheet.iter().for_each(|&i| goes[i] = true);
        }
    }
    let mut i = 0;
    faces.retain(|face| {
        let stays = !goes[i];
        i += 1;
        if !stays {
            changes.push(Change::RemovedFace {
                face: face.source,
                reason: RemovalReason::Flap,
            });
        }
        stays
    });
}

/// Drops the backs of flat sheets whose two sides have other triangles, as the module docs tell; what hangs on something goes whole, see
/// `drop_flaps`. `sides` are those of `faces`, sorted. Whether anything went.
pub fn drop_backs(
    faces: &mut Vec<DraftFace>,
    sides: &[Side],
    positions: &[[f64; 3]],
    changes: &mut Vec<Change>,
) -> bool {
    let at = |v: u32| positions[v as usize];
    let corners = |f: usize| faces[f].vertices.map(at);
    let apex = |side: u32| at(faces[side as usize / 3].vertices[(side as usize % 3 + 2) % 3]);
    let edges = || sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1));
    let is_folded = |&(a, b, s): &Side, t: u32| {
        let axis = sub(at(b), at(a));
        let [p, q] = [apex(s), apex(t)].map(|apex| cross(axis, sub(apex, at(a))));
        dot(p, q) > 0.0 && norm(cross(p, q)) <= FLAT * norm(p) * norm(q)
    };
    let mut seeds: Vec<usize> = edges()
        .filter(|edge| (1..edge.len()).any(|i| is_folded(&edge[0], edge[i].2)))
        .map(|edge| edge[0].2 as usize / 3)
        .collect();
    if seeds.is_empty() {
        return false;
    }
    let size = |f: usize| norm(normal(corners(f)));
    seeds.sort_by(|&f, &g| size(g).total_cmp(&size(f)).then(f.cmp(&g)));
    let mut beside: Vec<Vec<u32>> = vec![Vec::new(); faces.len()];
    for edge in edges() {
        for pair in edge.windows(2) {
            let [f, g] = [pair[0].2 / 3, pair[1].2 / 3];
            beside[f as usize].push(g);
            beside[g as usize].push(f);
        }
    }
    let mut two_sided = vec![false; faces.len()];
    let mut is_back = vec![false; faces.len()];
    let mut sheet_of: Vec<Option<usize>> = vec![None; faces.len()];
    for (sheet, &seed) in seeds.iter().enumerate() {
        if sheet_of[seed].is_some() {
            continue;
        }
        let origin = corners(seed)[0];
        let plane = normal(corners(seed)).map(|x| x / size(seed));
        let longest = (0..3).fold(0.0, |l: f64, k| {
            l.max(distance(corners(seed)[k], corners(seed)[(k + 1) % 3]))
        });
        let within = ROUNDED.min(FLAT * longest);
        let lies_there = |p: [f64; 3]| dot(plane, sub(p, origin)).abs() <= within;
        let mut members = vec![seed];
        sheet_of[seed] = Some(sheet);
        let mut next = 0;
        while let Some(&f) = members.get(next) {
            next += 1;
            for &g in &beside[f] {
                let g = g as usize;
                if sheet_of[g].is_none() && corners(g).into_iter().all(lies_there) {
                    sheet_of[g] = Some(sheet);
                    members.push(g);
                }
            }
        }
        if !is_closed(&members, faces) {
            continue;
        }
        let up = |f: usize| dot(plane, normal(corners(f))) > 0.0;
        let vertices = |side: bool| -> BTreeSet<u32> {
            let of_side = members.iter().filter(|&&f| up(f) == side);
            of_side.flat_map(|&f| faces[f].vertices).collect()
        };
        // A body without thickness has vertices of its own on either side.
        if vertices(true) != vertices(false) {
            continue;
        }
        let first = members.iter().copied().fold(seed, usize::min);
        for f in members {
            is_back[f] = up(f) != up(first);
            two_sided[f] = true;
        }
    }
    for face in faces
        .iter()
        .zip(&is_back)
        .filter(|(_, back)| **back)
        .map(|x| x.0)
    {
        changes.push(Change::RemovedFace {
            face: face.source,
            reason: RemovalReason::Back,
        });
    }
    let before = faces.len();
    let mut at = 0..;
    two_sided.retain(|_| at.next().is_some_and(|i: usize| !is_back[i]));
    let mut at = 0..;
    faces.retain(|_| at.next().is_some_and(|i: usize| !is_back[i]));
    if faces.len() < before {
        drop_flaps(faces, two_sided, changes);
    }
    faces.len() < before
}

/// Along every edge as many of the faces run one way as the other.
fn is_closed(members: &[usize], faces: &[DraftFace]) -> bool {
    let mut ways: Vec<(u32, u32, i32)> = members
        .iter()
        .flat_map(|&f| {
            let [a, b, c] = faces[f].vertices;
            [(a, b), (b, c), (c, a)].map(|(a, b)| (a.min(b), a.max(b), if a < b { 1 } else { -1 }))
        })
        .collect();
    ways.sort_unstable();
    let mut edges = ways.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1));
    edges.all(|edge| edge.iter().map(|way| way.2).sum::<i32>() == 0)
}

fn normal([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    cross(sub(b, a), sub(c, a))
}
