//! Faces that stay: no repeated vertex, no duplicate, no face without area.
//!
//! A face whose three corners lie on one line cannot just be dropped: the faces at its two short sides
//! and the face at its long side would no longer meet.
//!
//! ```text
//!          d                    d
//!        /   \                / | \          face abc has no area, b lies on side ac:
//!       /     \       →      /  |  \         it goes, and every other face at side ac
//!      a - b - c            a - b - c        is split at b. The surface stays where it is.
//! ```

use crate::geometry::mesh::distance;
use crate::repair::double_sided::drop_duplicates;
use crate::repair::log::{Change, RemovalReason};
use std::collections::{BTreeSet, HashMap};

/// A triangle is *collinear* where its two short sides together are not longer than its long side by more
/// than this fraction. The corner between them is then at most 7e-7 of the long side away from it: that much
/// the rounding of float32 coordinates moves points of a line, as Boolean operations leave them. The normal
/// of such a face is rounding too.
const COLLINEAR_EXCESS: f64 = 1e-12;

/// Two points on a line are one where they are nearer than this part of its length: what float64 rounds in some steps, such as middles of edges.
const SAME_POINT: f64 = 1e-12;

/// A face on its way to the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct DraftFace {
    /// Welded vertices, in the order of the file.
    pub vertices: [u32; 3],
    /// Face of the input that it is or lies in.
    pub source: u32,
    /// Where it is a part only: barycentric coordinates of its corners in the source face.
    pub within: Option<Box<[[f64; 3]; 3]>>,
}

/// The faces that stay, in the order of the file; parts of split faces at the end. And pairs of vertices that are one point of the line on which the corners of two faces at an edge lie: where there are any,
/// they have to be joined first.
pub fn clean(
    positions: &[[f64; 3]],
    given: &[[u32; 3]],
    stands_for: &[u32],
    changes: &mut Vec<Change>,
) -> (Vec<DraftFace>, Vec<[u32; 2]>) {
    let mut faces = Vec::with_capacity(given.len());
    for (f, corners) in given.iter().enumerate() {
        let vertices = corners.map(|v| stands_for[v as usize]);
        let [a, b, c] = vertices;
        if a == b || b == c || c == a {
            changes.push(Change::RemovedFace {
                face: f as u32,
                reason: RemovalReason::RepeatedVertex,
            });
        } else {
            faces.push(DraftFace {
                vertices,
                source: f as u32,
                within: None,
            });
        }
    }
    drop_duplicates(&mut faces, changes);
    let mut met = Vec::new();
    if faces.iter().any(|f| middle_corner(f, positions).is_some()) {
        met = take_out_collinear(&mut faces, positions, changes);
        faces.sort_by_key(|f| f.source);
        drop_duplicates(&mut faces, changes);
    }
    (faces, met)
}

/// The corner that lies on the opposite side, where the face is collinear.
fn middle_corner(face: &DraftFace, positions: &[[f64; 3]]) -> Option<usize> {
    let p = face.vertices.map(|v| positions[v as usize]);
    let opposite: [f64; 3] = std::array::from_fn(|k| distance(p[(k + 1) % 3], p[(k + 2) % 3]));
    let longest = (0..3).fold(0, |k, j| if opposite[j] > opposite[k] { j } else { k });
    let short = opposite[(longest + 1) % 3] + opposite[(longest + 2) % 3];
    (short - opposite[longest] <= COLLINEAR_EXCESS * opposite[longest]).then_some(longest)
}

fn edge(a: u32, b: u32) -> (u32, u32) {
    (a.min(b), a.max(b))
}

/// Takes out collinear faces as the module docs show, lowest first. A face that is split may become
/// collinear itself and wait in turn; the number of rounds is bounded, and what is left then stays. Pairs of vertices as [`clean`] says.
fn take_out_collinear(
    faces: &mut Vec<DraftFace>,
    positions: &[[f64; 3]],
    changes: &mut Vec<Change>,
) -> Vec<[u32; 2]> {
    let mut met = Vec::new();
    let between = |u: u32, v: u32| distance(positions[u as usize], positions[v as usize]);
    let mut slots: Vec<Option<DraftFace>> = faces.drain(..).map(Some).collect();
    let mut at_edge: HashMap<(u32, u32), BTreeSet<usize>> = HashMap::new();
    let mut waiting = BTreeSet::new();
    for (i, face) in slots.iter().enumerate() {
        let Some(face) = face else { continue };
        enlist(&mut at_edge, i, face);
        if middle_corner(face, positions).is_some() {
            waiting.insert(i);
        }
    }
    let mut rounds_left = 64 + 16 * waiting.len();
    while let Some(i) = waiting.pop_first() {
        let Some(face) = slots[i].clone() else {
            continue;
        };
        let Some(k) = middle_corner(&face, positions).filter(|_| rounds_left > 0) else {
            continue;
        };
        rounds_left -= 1;
        let (b, c, a) = (
            face.vertices[k],
            face.vertices[(k + 1) % 3],
            face.vertices[(k + 2) % 3],
        );
        remove(&mut slots, &mut at_edge, i, &face, changes);
        let others = at_edge.get(&edge(a, c)).cloned().unwrap_or_default();
        for j in others {
            let Some(other) = slots[j].clone() else {
                continue;
            };
            let apex = other.vertices.into_iter().find(|v| ![a, c].contains(v));
            if apex.is_some_and(|d| between(b, d) <= SAME_POINT * between(a, c)) {
                // The same line seen from its other side: both vanish, and all three edges lose two faces.
                met.extend(apex.filter(|&d| d != b).map(|d| [b.min(d), b.max(d)]));
                remove(&mut slots, &mut at_edge, j, &other, changes);
                continue;
            }
            delist(&mut at_edge, j, &other);
            changes.push(Change::SplitFace {
                face: other.source,
                at: b,
            });
            let [first, second] = halves(&other, [a, c], b, positions);
            for (slot, half) in [(j, first), (slots.len(), second)] {
                enlist(&mut at_edge, slot, &half);
                if middle_corner(&half, positions).is_some() {
                    waiting.insert(slot);
                }
                if slot == slots.len() {
                    slots.push(Some(half));
                } else {
                    slots[slot] = Some(half);
                }
            }
        }
    }
    faces.extend(slots.into_iter().flatten());
    met
}

fn enlist(at_edge: &mut HashMap<(u32, u32), BTreeSet<usize>>, i: usize, face: &DraftFace) {
    for k in 0..3 {
        let e = edge(face.vertices[k], face.vertices[(k + 1) % 3]);
        at_edge.entry(e).or_default().insert(i);
    }
}

fn delist(at_edge: &mut HashMap<(u32, u32), BTreeSet<usize>>, i: usize, face: &DraftFace) {
    for k in 0..3 {
        let e = edge(face.vertices[k], face.vertices[(k + 1) % 3]);
        if let Some(list) = at_edge.get_mut(&e) {
            list.remove(&i);
        }
    }
}

fn remove(
    slots: &mut [Option<DraftFace>],
    at_edge: &mut HashMap<(u32, u32), BTreeSet<usize>>,
    i: usize,
    face: &DraftFace,
    changes: &mut Vec<Change>,
) {
    delist(at_edge, i, face);
    slots[i] = None;
    changes.push(Change::RemovedFace {
        face: face.source,
        reason: RemovalReason::Collinear,
    });
}

/// The two parts of a face whose side between `ends` is split at vertex `b`; the part at `ends[0]` first.
fn halves(face: &DraftFace, ends: [u32; 2], b: u32, positions: &[[f64; 3]]) -> [DraftFace; 2] {
    let p = |v: u32| positions[v as usize];
    let corner = |v: u32| face.vertices.iter().position(|&w| w == v).unwrap_or(0);
    let [at_a, at_c] = ends.map(corner);
    let (near, far) = (distance(p(ends[0]), p(b)), distance(p(b), p(ends[1])));
    let t = if near + far > 0.0 {
        near / (near + far)
    } else {
        0.5
    };
    let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let within = face.within.as_deref().copied().unwrap_or(identity);
    let middle: [f64; 3] =
        std::array::from_fn(|i| (1.0 - t) * within[at_a][i] + t * within[at_c][i]);
    [at_c, at_a].map(|replaced| {
        let mut part = face.clone();
        let mut weights = within;
        part.vertices[replaced] = b;
        weights[replaced] = middle;
        part.within = Some(Box::new(weights));
        part
    })
}
