//! Seams: where patches meet each other, themselves across the cut, or the surface's boundary.

use crate::atlas::patch::{Seam, SeamSample};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, FaceVec, HalfedgeId, PatchId, VertexVec};
use crate::geometry::mesh::Mesh;

/// All seams, in the order of their first halfedge; open ones first. The lower patch is on the left,
/// and of a boundary the surface.
pub(crate) fn seams(
    mesh: &Mesh,
    is_cut: &EdgeVec<bool>,
    face_patch: &FaceVec<PatchId>,
    uv: &FaceVec<[[f64; 2]; 3]>,
) -> Vec<Seam> {
    let c = &mesh.connectivity;
    let pair = |h: HalfedgeId| {
        let right = c.twin(h).map(|t| face_patch[c.face(t)]);
        (face_patch[c.face(h)], right)
    };
    let is_seam: EdgeVec<bool> = c
        .edges()
        .map(|e| {
            let (left, right) = pair(c.edge_halfedge(e));
            is_cut[e] || right != Some(left)
        })
        .collect();
    let mut valence = VertexVec::filled(0u32, c.vertex_count());
    for e in c.edges().filter(|&e| is_seam[e]) {
        for v in c.edge_vertices(e) {
            valence[v] += 1;
        }
    }
    // The chain goes on with the first seam edge met when turning clockwise from the left face.
    let next = |h: HalfedgeId| {
        if valence[c.head(h)] != 2 {
            return None;
        }
        let mut n = c.next(h);
        while !is_seam[c.edge(n)] {
            n = c.rotate_cw(n)?;
        }
        (pair(n) == pair(h)).then_some(n)
    };
    let forward = |h: &HalfedgeId| {
        let (left, right) = pair(*h);
        is_seam[c.edge(*h)] && right.is_none_or(|right| left <= right)
    };
    let mut used = EdgeVec::filled(false, c.edge_count());
    let mut seams = Vec::new();
    for closed in [false, true] {
        for start in c.halfedges().filter(forward) {
            let begins = closed || previous_of(c, start, &is_seam, &valence, &pair).is_none();
            if used[c.edge(start)] || !begins {
                continue;
            }
            let mut chain = Vec::new();
            let mut at = Some(start);
            while let Some(h) = at.filter(|&h| !used[c.edge(h)]) {
                used[c.edge(h)] = true;
                chain.push(h);
                at = next(h);
            }
            let (left, right) = pair(start);
            let samples = samples(mesh, &chain, uv);
            seams.push(Seam {
                left,
                right,
                samples,
            });
        }
    }
    seams
}

/// The halfedge before one in its chain: the chain of the other direction, turned.
fn previous_of(
    c: &Connectivity,
    h: HalfedgeId,
    is_seam: &EdgeVec<bool>,
    valence: &VertexVec<u32>,
    pair: &impl Fn(HalfedgeId) -> (PatchId, Option<PatchId>),
) -> Option<HalfedgeId> {
    if valence[c.tail(h)] != 2 {
        return None;
    }
    let mut p = c.prev(h);
    while !is_seam[c.edge(p)] {
        p = c.prev(c.twin(p)?);
    }
    (pair(p) == pair(h)).then_some(p)
}

fn samples(mesh: &Mesh, chain: &[HalfedgeId], uv: &FaceVec<[[f64; 2]; 3]>) -> Vec<SeamSample> {
    let c = &mesh.connectivity;
    let sample = |h: HalfedgeId, at_head: bool| {
        let corner = |h: HalfedgeId| uv[c.face(h)][c.corner(h)];
        let (vertex, left) = if at_head {
            (c.head(h), corner(c.next(h)))
        } else {
            (c.tail(h), corner(h))
        };
        let right = c
            .twin(h)
            .map(|t| corner(if at_head { t } else { c.next(t) }));
        SeamSample {
            position: mesh.positions[vertex],
            left,
            right: right.unwrap_or([f64::NAN; 2]),
        }
    };
    let tails = chain.iter().map(|&h| sample(h, false));
    let head = chain.last().map(|&h| sample(h, true));
    tails.chain(head).collect()
}
