//! Triangulations of a double that are their own mirror image.
//!
//! *Enters:* a double and a triangulation of it that mirrored flips have led to. *Leaves:* the reflection by halfedges, edges and vertices, and the front half as
//! a surface with boundary. *Guaranteed:* values that [`Reflection`] makes symmetric are so bit for bit.
//!
//! A metric with symmetric lengths on such a triangulation is symmetric whatever the lengths are, so the mirror, where the
//! reflection leaves everything in its place, is straight: borders are prescribed by the angles at their corners alone.

use super::doubled::mirrored;
use crate::geometry::connectivity::{Connectivity, ConnectivityError};
use crate::geometry::ids::{EdgeId, EdgeVec, HalfedgeId, HalfedgeVec, VertexId, VertexVec};

/// The reflection of a symmetric triangulation of a double.
#[derive(Clone, Debug, PartialEq)]
pub struct Reflection {
    /// The mirror image of a halfedge runs the other way, on the other side.
    pub halfedge: HalfedgeVec<HalfedgeId>,
    /// Itself where the edge lies on the mirror.
    pub edge: EdgeVec<EdgeId>,
    /// Itself where the vertex lies on the mirror.
    pub vertex: VertexVec<VertexId>,
}

impl Reflection {
    /// Follows the gluing of both halves from the mirror, where a halfedge's image is its twin. The first `front_faces` faces are one half; the
    /// halves must be glued alike.
    pub fn new(connectivity: &Connectivity, front_faces: usize) -> Self {
        let c = connectivity;
        let is_front = |h: HalfedgeId| c.face(h).index() < front_faces;
        let mut image: HalfedgeVec<HalfedgeId> = c.halfedges().collect();
        let mut reached = Vec::new();
        for h in c.halfedges().filter(|&h| is_front(h)) {
            if let Some(t) = c.twin(h).filter(|&t| !is_front(t)) {
                image[h] = t;
                reached.push(h);
            }
        }
        while let Some(h) = reached.pop() {
            let t = image[h];
            image[t] = h;
            let across = c.twin(h).filter(|&h| is_front(h)).zip(c.twin(t));
            for (from, to) in [(c.next(h), c.prev(t))].into_iter().chain(across) {
                if image[from] == from {
                    image[from] = to;
                    reached.push(from);
                }
            }
        }
        let edge = c.edges().map(|e| c.edge(image[c.edge_halfedge(e)]));
        let vertex = c.vertices().map(|v| c.head(image[c.vertex_halfedge(v)]));
        Self {
            edge: edge.collect(),
            vertex: vertex.collect(),
            halfedge: image,
        }
    }

    /// Gives every edge the value of the one of both with the lower id.
    pub fn symmetric<T: Copy>(&self, value: &EdgeVec<T>) -> EdgeVec<T> {
        let of = |(e, image): (EdgeId, &EdgeId)| value[e.min(*image)];
        self.edge.enumerate().map(of).collect()
    }

    /// Gives every vertex the mean of its value and its image's.
    pub fn mean(&self, value: &VertexVec<f64>) -> VertexVec<f64> {
        let of = |(v, image): (VertexId, &VertexId)| 0.5 * (value[v] + value[*image]);
        self.vertex.enumerate().map(of).collect()
    }
}

/// The front half of a triangulation of a double as a surface with boundary: faces, halfedges and vertices keep their ids, edges do not.
pub fn front(
    double: &Connectivity,
    faces: usize,
    vertices: usize,
) -> Result<Connectivity, ConnectivityError> {
    let own: Vec<HalfedgeId> = (0..3 * faces).map(HalfedgeId::new).collect();
    let is_own = |t: &HalfedgeId| t.index() < 3 * faces;
    let twin: Vec<_> = own.iter().map(|&h| double.twin(h).filter(is_own)).collect();
    let tail = own.iter().map(|&h| double.tail(h)).collect();
    Connectivity::from_gluing(tail, &twin, vertices)
}

/// The edge of a double that belongs to an edge of the surface, and its mirror image. Halves have `halfedges` halfedges each, as they were glued.
pub fn copies(
    surface: &Connectivity,
    double: &Connectivity,
    halfedges: usize,
    e: EdgeId,
) -> [EdgeId; 2] {
    let h = surface.edge_halfedge(e);
    [h, mirrored(h, halfedges)].map(|h| double.edge(h))
}
