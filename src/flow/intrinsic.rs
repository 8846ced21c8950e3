//! The three triangulations of the flow with flips (`docs/method.md`, 2): A, the base mesh; B, the intrinsic Delaunay
//! triangulation of its lengths; C, the final one. They share their vertices.
//!
//! *Enters:* what the flow found. *Leaves:* a value that the overlay is made from. A surface with boundary is doubled:
//! then A, B and C are closed, and the first faces and vertices of A are the surface's own.

use crate::flow::correspondence::Correspondence;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, VertexVec};

/// What the flow with flips leaves for the overlay.
#[derive(Clone, Debug)]
pub struct Intrinsic {
    /// A. Where the surface has a boundary, its double: face `f` and halfedge `h` of the surface keep their ids,
    /// so do all its vertices; mirror images come after them.
    pub base: Connectivity,
    /// Length of every edge of A, source units.
    pub base_length: EdgeVec<f64>,
    /// Number of faces of A that are the surface's own; all of them where it is closed.
    pub front_faces: usize,
    /// B, reached from A by Euclidean flips.
    pub delaunay: Connectivity,
    /// Length of every edge of B, source units.
    pub delaunay_length: EdgeVec<f64>,
    /// ln of the length that every edge of B has at u = 0, where that is not `delaunay_length`: what is left of a change of metric
    /// that was not conformal once u is taken out of it.
    pub delaunay_penner: Option<EdgeVec<f64>>,
    /// C, reached from B by Ptolemy flips.
    pub flat: Connectivity,
    /// ln of the length that every edge of C has at u = 0 (a Penner coordinate; Ptolemy's theorem, not a distance on
    /// the source surface). The flat length of the edge ij is e^{penner + (u_i + u_j) / 2}.
    pub penner: EdgeVec<f64>,
    /// Logarithm of the scale, one a vertex of A; where the change was not conformal, the nearest to it
    /// ([`nearest_scale`](crate::flow::vertex_scale::nearest_scale)).
    pub u: VertexVec<f64>,
    /// Edges of A on B.
    pub base_on_delaunay: Correspondence,
    /// Edges of B on C.
    pub delaunay_on_flat: Correspondence,
    /// Edges of A on C.
    pub base_on_flat: Correspondence,
}
