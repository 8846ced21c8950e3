//! The layout triangulation: what is cut and developed, and how the overlay lies on it.
//!
//! *Enters:* the final triangulation of the flow and the overlay. *Leaves:* a triangulation with well-shaped flat faces, whose
//! vertices are the first vertices of the overlay, and for every overlay corner a *carrier*: a layout halfedge of its
//! own cell and the fraction along it where the corner lies. So overlay faces are placed, never developed: slivers would lose
//! the result (`docs/method.md`, 6).
//!
//! A *cell* is a convex flat polygon of one or more layout faces: a face of the final triangulation, or where the
//! mirror of a doubled surface passes through it, a part of one. Every overlay face lies in one cell.

use crate::atlas::cut::{CutGraph, Segment};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, FaceId, FaceVec, HalfedgeId, HalfedgeVec, NONE};
use crate::geometry::mesh::Mesh;

/// Where a corner of the overlay lies on the layout.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Carrier {
    /// Layout halfedge, on the border of the cell in which the overlay face lies.
    pub halfedge: HalfedgeId,
    /// Fraction of its flat length from its tail, in [0, 1].
    pub fraction: f64,
}

impl Carrier {
    /// The place in coordinates that are given for every corner of the layout.
    #[inline]
    pub fn place(self, layout: &Connectivity, at: impl Fn(HalfedgeId) -> [f64; 2]) -> [f64; 2] {
        let tail = at(self.halfedge);
        if self.fraction == 0.0 {
            return tail;
        }
        let head = at(layout.next(self.halfedge));
        std::array::from_fn(|i| (1.0 - self.fraction) * tail[i] + self.fraction * head[i])
    }
}

/// The triangulation that is cut and developed; see the module docs.
#[derive(Clone, Debug)]
pub struct Layout {
    /// A Δ-complex. Its vertices are the first ones of the overlay.
    pub connectivity: Connectivity,
    /// Flat length of every edge, source units.
    pub length: EdgeVec<f64>,
    /// False for diagonals of cells, which are no edges of the overlay.
    pub may_cut: EdgeVec<bool>,
    /// Cell of every face; the faces of a cell follow each other.
    pub cell: FaceVec<u32>,
    /// How the overlay lies on it; `None` where it is the layout itself.
    pub(super) refinement: Option<Refinement>,
}

/// An overlay finer than the layout.
#[derive(Clone, Debug)]
pub(super) struct Refinement {
    /// Of the corner that an overlay halfedge leaves.
    pub carrier: HalfedgeVec<Carrier>,
    /// Layout edge e is the chain `chain[chain_first[e]..chain_first[e + 1]]` of overlay halfedges, which
    /// run the way of `edge_halfedge(e)`; empty for diagonals.
    pub chain_first: Vec<u32>,
    pub chain: Vec<HalfedgeId>,
}

impl Layout {
    /// The layout of a surface that is its own overlay.
    pub fn identity(connectivity: &Connectivity, length: &EdgeVec<f64>) -> Self {
        Self {
            connectivity: connectivity.clone(),
            length: length.clone(),
            may_cut: EdgeVec::filled(true, connectivity.edge_count()),
            cell: (0..connectivity.face_count() as u32).collect(),
            refinement: None,
        }
    }

    /// True where the overlay is finer than the layout.
    pub fn is_refined(&self) -> bool {
        self.refinement.is_some()
    }

    /// Where the corner that an overlay halfedge leaves lies.
    #[inline]
    pub fn carrier(&self, corner: HalfedgeId) -> Carrier {
        match &self.refinement {
            Some(refinement) => refinement.carrier[corner],
            None => Carrier {
                halfedge: corner,
                fraction: 0.0,
            },
        }
    }

    /// The cell in which an overlay face lies.
    #[inline]
    pub fn cell_under(&self, overlay_face: FaceId) -> u32 {
        let corner = HalfedgeId::new(3 * overlay_face.index());
        let under = self.carrier(corner).halfedge;
        self.cell[self.connectivity.face(under)]
    }

    /// The overlay corner in coordinates that are given for every layout corner.
    #[inline]
    pub fn place(&self, corner: HalfedgeId, at: impl Fn(HalfedgeId) -> [f64; 2]) -> [f64; 2] {
        self.carrier(corner).place(&self.connectivity, at)
    }

    /// The overlay halfedges that make up a layout halfedge, in its direction; none for a diagonal.
    pub fn chain(&self, h: HalfedgeId, overlay: &Connectivity) -> Vec<HalfedgeId> {
        let Some(refinement) = &self.refinement else {
            return vec![h];
        };
        let e = self.connectivity.edge(h);
        let range = refinement.chain_first[e.index()] as usize
            ..refinement.chain_first[e.index() + 1] as usize;
        let chain = &refinement.chain[range];
        if self.connectivity.edge_halfedge(e) == h {
            chain.to_vec()
        } else {
            let backwards = chain.iter().rev();
            backwards.filter_map(|&g| overlay.twin(g)).collect()
        }
    }

    /// What a cut along every edge costs: its length in space, source units; infinite for diagonals.
    pub fn cut_cost(&self, overlay: &Mesh) -> EdgeVec<f64> {
        let c = &overlay.connectivity;
        let cost = |e| {
            if !self.may_cut[e] {
                return f64::INFINITY;
            }
            match &self.refinement {
                None => overlay.edge_length(e),
                Some(_) => {
                    let chain = self.chain(self.connectivity.edge_halfedge(e), c);
                    chain.iter().map(|&h| overlay.edge_length(c.edge(h))).sum()
                }
            }
        };
        self.connectivity.edges().map(cost).collect()
    }

    /// A cut graph of the layout as one of the overlay: segments and nodes stay the same, edges become chains.
    pub fn lift(&self, cut: &CutGraph, overlay: &Connectivity) -> CutGraph {
        let mut lifted = CutGraph {
            is_cut: EdgeVec::filled(false, overlay.edge_count()),
            segment: EdgeVec::filled(NONE, overlay.edge_count()),
            segments: Vec::with_capacity(cut.segments.len()),
            nodes: cut.nodes.clone(),
        };
        for (i, segment) in cut.segments.iter().enumerate() {
            let chains = segment.halfedges.iter().map(|&h| self.chain(h, overlay));
            let halfedges: Vec<HalfedgeId> = chains.flatten().collect();
            for &h in &halfedges {
                lifted.is_cut[overlay.edge(h)] = true;
                lifted.segment[overlay.edge(h)] = i as u32;
            }
            lifted.segments.push(Segment { halfedges });
        }
        lifted
    }
}
