//! The cut graph: edges along which the surface is slit into one disk (tutorial 5.4, steps 1 to 3).
//!
//! *Enters:* connectivity, the lengths that the cut shall be short in, and the cones. *Leaves:* a
//! [`CutGraph`] whose complement is one open disk with no cone inside; boundary loops are part of the
//! disk's border. Guaranteed and checked before it leaves: χ of the slit surface is 1.
//! Not guaranteed: least length (that is NP-hard; Erickson, Har-Peled 2004).
//!
//! Method: boundary loops are contracted to points. Handles are opened by a greedy homotopy basis
//! (Erickson, Whittlesey 2005): a tree of shortest paths from a root, a maximum spanning tree of the dual by the
//! length of the loop that each edge closes, and the 2g edges in neither. Then cones and boundary
//! loops are joined one at a time by the shortest path to what is there (Takahashi, Matsuyama 1980),
//! and chains that end at no cone are pruned. The basis depends on the root, so several are tried.

mod contracted;
mod paths;

use crate::flow::prescription::Prescription;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, FaceVec, HalfedgeId, HalfedgeVec, NONE, VertexId, VertexVec};
use contracted::Contracted;

/// A maximal chain of cut edges between two nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// Halfedges from node to node, head to tail. Their faces lie on the *left*, their twins' on the right.
    pub halfedges: Vec<HalfedgeId>,
}

impl Segment {
    /// The vertices from node to node, one more than halfedges.
    pub fn vertices(&self, connectivity: &Connectivity) -> Vec<VertexId> {
        let tails = self.halfedges.iter().map(|&h| connectivity.tail(h));
        let last = self.halfedges.last().map(|&h| connectivity.head(h));
        tails.chain(last).collect()
    }
}

/// Edges, nodes and segments of the cut.
#[derive(Clone, Debug, PartialEq)]
pub struct CutGraph {
    /// True for the edges of the graph. Boundary edges are never in it.
    pub is_cut: EdgeVec<bool>,
    /// Number of the segment of a cut edge, `NONE` elsewhere.
    pub segment: EdgeVec<u32>,
    /// Segments, in a fixed order.
    pub segments: Vec<Segment>,
    /// Vertices of valence ≠ 2 in the graph, cones, and where it meets the boundary; ascending.
    pub nodes: Vec<VertexId>,
}

/// Why a surface could not be cut into a disk.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CutError {
    /// The complement of the graph is no disk. Not expected on any connected surface.
    #[error(
        "the surface slit along the cut graph has Euler characteristic {euler_characteristic} and {pieces} pieces, but a disk has 1 and 1: please report this mesh"
    )]
    NotADisk {
        /// χ of the slit surface.
        euler_characteristic: i64,
        /// Its connected pieces.
        pieces: usize,
    },
    /// Nothing forces a cut, but the surface is a sphere.
    #[error(
        "a closed surface of genus 0 without cones cannot be slit into a disk: prescribe at least three cones"
    )]
    NothingToCutAlong,
}

/// Finds a short cut graph through every cone and every boundary loop.
///
/// `length` (of every edge, any unit) is what the cut is short in: source lengths keep seams short in space.
pub fn cut(
    connectivity: &Connectivity,
    length: &EdgeVec<f64>,
    prescription: &Prescription,
) -> Result<CutGraph, CutError> {
    let surface = Contracted::new(connectivity, length, prescription);
    let topology = connectivity.topology();
    let is_cut = if topology.genus > 0 {
        let mut best: Option<(f64, EdgeVec<bool>)> = None;
        for root in surface.roots() {
            let mut is_cut = surface.homotopy_basis(root);
            surface.prune(&mut is_cut);
            surface.join_terminals(&mut is_cut, Some(root));
            surface.prune(&mut is_cut);
            let total = surface.total_length(&is_cut);
            if best.as_ref().is_none_or(|(least, _)| total < *least) {
                best = Some((total, is_cut));
            }
        }
        best.map(|(_, is_cut)| is_cut)
            .ok_or(CutError::NothingToCutAlong)?
    } else {
        let mut is_cut = EdgeVec::filled(false, connectivity.edge_count());
        surface.join_terminals(&mut is_cut, None);
        is_cut
    };
    check_disk(connectivity, &is_cut)?;
    Ok(split_into_segments(connectivity, is_cut, prescription))
}

/// Number of the slit vertex at every corner (by the halfedge that leaves it), and how many there are.
/// Corners of one vertex are the same copy where they meet across edges that are not cut.
pub fn slit_copies(
    connectivity: &Connectivity,
    is_cut: &EdgeVec<bool>,
) -> (HalfedgeVec<u32>, usize) {
    let c = connectivity;
    let mut copy = HalfedgeVec::filled(NONE, c.halfedge_count());
    let mut copies = 0;
    for v in c.vertices() {
        // Begin at a cut edge (or the boundary), so that no copy is met in two parts.
        let start = c.outgoing(v).find(|&h| is_cut[c.edge(h)]);
        let start = match start {
            Some(h) if !c.is_boundary_vertex(v) => h,
            _ => c.vertex_halfedge(v),
        };
        let mut at = Some(start);
        let mut first = true;
        while let Some(h) = at {
            if first || is_cut[c.edge(h)] {
                copies += 1;
            }
            first = false;
            copy[h] = (copies - 1) as u32;
            at = c.rotate_ccw(h).filter(|&n| n != start);
        }
    }
    (copy, copies)
}

fn check_disk(connectivity: &Connectivity, is_cut: &EdgeVec<bool>) -> Result<(), CutError> {
    let c = connectivity;
    let cut_edges = is_cut.iter().filter(|&&cut| cut).count();
    let (_, copies) = slit_copies(c, is_cut);
    let chi = copies as i64 - (c.edge_count() + cut_edges) as i64 + c.face_count() as i64;
    let mut reached = FaceVec::filled(false, c.face_count());
    let mut pieces = 0;
    for start in c.faces() {
        if std::mem::replace(&mut reached[start], true) {
            continue;
        }
        pieces += 1;
        let mut stack = vec![start];
        while let Some(f) = stack.pop() {
            for h in c.face_halfedges(f) {
                if let Some(t) = c.twin(h).filter(|_| !is_cut[c.edge(h)])
                    && !std::mem::replace(&mut reached[c.face(t)], true)
                {
                    stack.push(c.face(t));
                }
            }
        }
    }
    match (chi, pieces) {
        (1, 1) => Ok(()),
        (2, 1) => Err(CutError::NothingToCutAlong),
        _ => Err(CutError::NotADisk {
            euler_characteristic: chi,
            pieces,
        }),
    }
}

fn split_into_segments(
    connectivity: &Connectivity,
    is_cut: EdgeVec<bool>,
    prescription: &Prescription,
) -> CutGraph {
    let c = connectivity;
    let mut valence = VertexVec::filled(0usize, c.vertex_count());
    for (e, _) in is_cut.enumerate().filter(|&(_, &cut)| cut) {
        for v in c.edge_vertices(e) {
            valence[v] += 1;
        }
    }
    let mut is_cone = VertexVec::filled(false, c.vertex_count());
    for cone in &prescription.cones {
        is_cone[cone.vertex] = true;
    }
    let is_node =
        |v: VertexId| valence[v] > 0 && (valence[v] != 2 || is_cone[v] || c.is_boundary_vertex(v));
    let nodes: Vec<VertexId> = c.vertices().filter(|&v| is_node(v)).collect();
    let mut segment = EdgeVec::filled(NONE, c.edge_count());
    let mut segments = Vec::new();
    for &node in &nodes {
        for first in c.outgoing(node) {
            if !is_cut[c.edge(first)] || segment[c.edge(first)] != NONE {
                continue;
            }
            let id = segments.len() as u32;
            let mut halfedges = vec![first];
            segment[c.edge(first)] = id;
            let mut at = c.head(first);
            while !is_node(at) {
                // An inner vertex has two cut edges: go on along the one not taken yet.
                let Some(next) = c
                    .outgoing(at)
                    .find(|&h| is_cut[c.edge(h)] && segment[c.edge(h)] == NONE)
                else {
                    break;
                };
                segment[c.edge(next)] = id;
                halfedges.push(next);
                at = c.head(next);
            }
            segments.push(Segment { halfedges });
        }
    }
    CutGraph {
        is_cut,
        segment,
        segments,
        nodes,
    }
}
