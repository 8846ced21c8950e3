//! Which sides of the faces are joined, and which faces are turned over.
//!
//! Sides are numbered `3f + k`, from corner `k` to corner `k + 1` of face `f` as the file has it.

use crate::geometry::ids::NONE;
use crate::geometry::mesh::{cross, norm, sub};
use crate::repair::clean::DraftFace;
use crate::repair::log::Change;
use rayon::prelude::*;

/// The joints between faces.
#[derive(Clone, Debug, PartialEq)]
pub struct Gluing {
    /// For every side the one it is joined to, or [`NONE`]. Joined sides run against each other once
    /// flipped faces are turned over, but where `contradiction` says otherwise.
    pub partner: Vec<u32>,
    /// True for the faces to turn over.
    pub flipped: Vec<bool>,
    /// For every non-orientable sheet: two adjacent faces that cannot both be right.
    pub contradictions: Vec<[u32; 2]>,
}

/// A part of the surface that is connected across edges with exactly two faces.
struct Sheets {
    sheet: Vec<u32>,
    flipped: Vec<bool>,
    /// Two faces that contradict each other, by sheet.
    contradiction: Vec<Option<[u32; 2]>>,
    /// True for a sheet that has an edge with one face.
    open: Vec<bool>,
}

/// The lower and the higher vertex of a side, and its number.
pub type Side = (u32, u32, u32);

/// The sides of all faces, sorted: those at one edge follow each other.
pub fn sides(faces: &[DraftFace]) -> Vec<Side> {
    let mut sides = Vec::with_capacity(3 * faces.len());
    for (f, face) in faces.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (face.vertices[k], face.vertices[(k + 1) % 3]);
            sides.push((a.min(b), a.max(b), (3 * f + k) as u32));
        }
    }
    sides.par_sort_unstable();
    sides
}

/// Joins the faces at their sides, which are sorted; see the module docs of [`crate::repair`].
pub fn glue(
    faces: &[DraftFace],
    sides: &[Side],
    positions: &[[f64; 3]],
    changes: &mut Vec<Change>,
) -> Gluing {
    let mut partner = vec![NONE; 3 * faces.len()];
    let edges = || sides.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1));
    for edge in edges().filter(|edge| edge.len() == 2) {
        let (s, t) = (edge[0].2, edge[1].2);
        partner[s as usize] = t;
        partner[t as usize] = s;
    }
    let mut sheets = orient(faces, &partner);
    for edge in edges().filter(|edge| edge.len() == 1) {
        let sheet = sheets.sheet[edge[0].2 as usize / 3];
        sheets.open[sheet as usize] = true;
    }
    for edge in edges().filter(|edge| edge.len() > 2) {
        let ends = [edge[0].0, edge[0].1];
        let around: Vec<u32> = edge.iter().map(|side| side.2).collect();
        let pairs = pair_up(&around, ends, faces, positions, &sheets);
        for &[s, t] in &pairs {
            partner[s as usize] = t;
            partner[t as usize] = s;
        }
        changes.push(Change::CutEdge {
            ends,
            faces: around.len() as u32,
            edges: (around.len() - pairs.len()) as u32,
            face: faces[around[0] as usize / 3].source,
        });
    }
    for (face, _) in faces.iter().zip(&sheets.flipped).filter(|(_, f)| **f) {
        changes.push(Change::FlippedFace { face: face.source });
    }
    Gluing {
        partner,
        flipped: sheets.flipped,
        contradictions: sheets.contradiction.into_iter().flatten().collect(),
    }
}

/// True where both sides run the same way along their edge, as the file has them.
fn run_alike(faces: &[DraftFace], s: u32, t: u32) -> bool {
    let tail = |s: u32| faces[s as usize / 3].vertices[s as usize % 3];
    tail(s) == tail(t)
}

/// Spreads the orientation of the first face of every sheet; the minority of each is to be flipped, and
/// where there is no minority the first face stays as it is.
fn orient(faces: &[DraftFace], partner: &[u32]) -> Sheets {
    let mut sheets = Sheets {
        sheet: vec![NONE; faces.len()],
        flipped: vec![false; faces.len()],
        contradiction: Vec::new(),
        open: Vec::new(),
    };
    for seed in 0..faces.len() {
        if sheets.sheet[seed] != NONE {
            continue;
        }
        let id = sheets.contradiction.len() as u32;
        let mut contradiction = None;
        sheets.sheet[seed] = id;
        let mut members = vec![seed];
        let mut next = 0;
        while next < members.len() {
            let f = members[next];
            next += 1;
            for k in 0..3 {
                let s = 3 * f + k;
                let t = partner[s];
                if t == NONE {
                    continue;
                }
                let g = t as usize / 3;
                let turned = sheets.flipped[f] != run_alike(faces, s as u32, t);
                if sheets.sheet[g] == NONE {
                    sheets.sheet[g] = id;
                    sheets.flipped[g] = turned;
                    members.push(g);
                } else if sheets.flipped[g] != turned && contradiction.is_none() {
                    contradiction = Some([f as u32, g as u32]);
                }
            }
        }
        let turned = members.iter().filter(|&&f| sheets.flipped[f]).count();
        if contradiction.is_some() {
            // No choice is right: leave the faces as they are.
            members.iter().for_each(|&f| sheets.flipped[f] = false);
        } else if 2 * turned > members.len() {
            for &f in &members {
                sheets.flipped[f] = !sheets.flipped[f];
            }
        }
        sheets.contradiction.push(contradiction);
        sheets.open.push(false);
    }
    sheets
}

/// Pairs of oppositely oriented sides at an edge where three or more faces meet.
///
/// Seen from the edge's end with the higher index, a face that runs away from that end has the solid on its
/// counterclockwise side, one that runs towards it on its clockwise side. So each face of the first kind is
/// paired with the next free one of the second kind, as brackets are: wedges of solid stay closed.
/// Sheets without open edges go first, so that a fin inside a solid does not tear it open.
/// One-sided sheets are left out: they could only spoil what they are joined to.
fn pair_up(
    around: &[u32],
    ends: [u32; 2],
    faces: &[DraftFace],
    positions: &[[f64; 3]],
    sheets: &Sheets,
) -> Vec<[u32; 2]> {
    let [low, high] = ends.map(|v| positions[v as usize]);
    let axis = unit(sub(high, low));
    let radial = |s: u32| {
        let face = &faces[s as usize / 3];
        let apex = positions[face.vertices[(s as usize % 3 + 2) % 3] as usize];
        let r = sub(apex, low);
        let along: f64 = (0..3).map(|i| r[i] * axis[i]).sum();
        unit(std::array::from_fn(|i| r[i] - along * axis[i]))
    };
    let zero = radial(around[0]);
    let quarter = cross(axis, zero);
    let angle = |s: u32| {
        let r = radial(s);
        let dot = |q: [f64; 3]| (0..3).map(|i| r[i] * q[i]).sum::<f64>();
        let a = dot(quarter).atan2(dot(zero));
        if a < 0.0 {
            a + std::f64::consts::TAU
        } else {
            a
        }
    };
    let sheet = |s: u32| sheets.sheet[s as usize / 3] as usize;
    let mut ordered: Vec<(f64, u32)> = around
        .iter()
        .filter(|&&s| sheets.contradiction[sheet(s)].is_none())
        .map(|&s| (angle(s), s))
        .collect();
    ordered.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let runs_up = |s: u32| {
        let f = s as usize / 3;
        (faces[f].vertices[s as usize % 3] == ends[0]) != sheets.flipped[f]
    };
    let mut pairs = Vec::new();
    let mut paired = vec![false; ordered.len()];
    for closed_only in [true, false] {
        let candidates: Vec<usize> = (0..ordered.len())
            .filter(|&i| !paired[i])
            .filter(|&i| !closed_only || !sheets.open[sheet(ordered[i].1)])
            .collect();
        let mut opened = Vec::new();
        // Twice around: in the second round what opens late meets what closes early.
        for first_round in [true, false] {
            for &i in candidates.iter() {
                let s = ordered[i].1;
                if !runs_up(s) {
                    if first_round {
                        opened.push(i);
                    }
                } else if !paired[i]
                    && let Some(j) = opened.pop()
                {
                    pairs.push([ordered[j].1, s]);
                    paired[i] = true;
                    paired[j] = true;
                }
            }
        }
    }
    pairs
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = norm(v);
    if length > 0.0 && length.is_finite() {
        v.map(|x| x / length)
    } else {
        [0.0; 3]
    }
}
