//! Halfedge connectivity of an oriented triangulated surface, with or without boundary.
//!
//! *Enters:* faces as vertex triples. *Leaves:* traversal, flips and splits.
//! Knows no positions and no lengths.
//!
//! The structure is a Δ-complex: an edge may join a vertex to itself and two edges may share both
//! ends, as intrinsic flips produce them. So nothing here keys an edge by a pair of vertices but
//! [`Connectivity::from_faces`], whose input is a list of triples and cannot say more.
//!
//! Layout: halfedge `3f + k` runs from corner `k` to corner `k + 1` of face `f` (counterclockwise),
//! so `next`, `prev` and `face` are arithmetic; only tail, twin and edge are stored.
//!
//! ```text
//!            corner 2
//!            /    \            h = 3f + k
//!        h2 /      \ h1        next(h) = 3f + (k + 1) % 3
//!          /   f    \          opposite corner of h: corner k + 2
//!   corner 0 ------ corner 1   halfedge opposite corner k: 3f + (k + 1) % 3
//!              h0
//! ```
//!
//! A boundary halfedge has no twin. The *first* outgoing halfedge of a boundary vertex is the
//! one that lies on the boundary, so walking counterclockwise from it meets the whole fan.

mod edit;

pub use edit::{EdgeSplit, FaceSplit, Flip, HalvedFace};

use crate::geometry::ids::{
    EdgeId, EdgeVec, FaceId, HalfedgeId, HalfedgeVec, NONE, VertexId, VertexVec,
};
use std::sync::Arc;

/// Oriented triangulated surface; see the module docs. Copies share their memory until one of them is changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Connectivity {
    arrays: Arc<Arrays>,
}

#[derive(Clone, Debug, PartialEq)]
struct Arrays {
    tail: HalfedgeVec<VertexId>,
    twin: HalfedgeVec<u32>,
    edge: HalfedgeVec<EdgeId>,
    /// One halfedge of every edge.
    edge_halfedge: EdgeVec<HalfedgeId>,
    /// First outgoing halfedge of every vertex.
    vertex_halfedge: VertexVec<HalfedgeId>,
}

/// Why a list of faces is no oriented manifold surface.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConnectivityError {
    /// A face names a vertex that does not exist.
    #[error("face {face} names vertex {vertex}, but there are {vertices} vertices")]
    VertexOutOfRange {
        /// Face.
        face: usize,
        /// Vertex it names.
        vertex: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A face names one vertex twice.
    #[error("face {face} names vertex {vertex} twice")]
    DegenerateFace {
        /// Face.
        face: usize,
        /// The repeated vertex.
        vertex: u32,
    },
    /// Two faces run along the same directed edge.
    #[error(
        "faces {first} and {second} both run from vertex {tail} to vertex {head}: the edge is non-manifold or the faces are oriented against each other"
    )]
    DoubledHalfedge {
        /// First face.
        first: usize,
        /// Second face.
        second: usize,
        /// Tail of the halfedge.
        tail: u32,
        /// Head of the halfedge.
        head: u32,
    },
    /// The faces at a vertex form more than one fan.
    #[error("the faces at vertex {vertex} form more than one fan")]
    NonManifoldVertex {
        /// Vertex.
        vertex: u32,
    },
    /// A vertex belongs to no face.
    #[error("vertex {vertex} belongs to no face")]
    UnusedVertex {
        /// Vertex.
        vertex: u32,
    },
}

/// Counts that do not depend on the metric.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Topology {
    /// Number of vertices.
    pub vertices: usize,
    /// Number of edges.
    pub edges: usize,
    /// Number of faces.
    pub faces: usize,
    /// χ = V − E + F.
    pub euler_characteristic: i64,
    /// Number of handles, (2 − χ − boundary loops) / 2 for a connected surface.
    pub genus: i64,
    /// Number of boundary loops.
    pub boundary_loops: usize,
}

impl Connectivity {
    /// Builds the structure from counterclockwise vertex triples; every vertex must be used,
    /// every edge must have at most two faces, and the faces at a vertex must form one fan.
    pub fn from_faces(
        faces: &[[u32; 3]],
        vertex_count: usize,
    ) -> Result<Connectivity, ConnectivityError> {
        let mut tail: HalfedgeVec<VertexId> = HalfedgeVec::default();
        // Where the halfedges out of each vertex begin.
        let mut start = vec![0; vertex_count + 1];
        for (f, face) in faces.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (face[k], face[(k + 1) % 3]);
                if a as usize >= vertex_count {
                    return Err(ConnectivityError::VertexOutOfRange {
                        face: f,
                        vertex: a,
                        vertices: vertex_count,
                    });
                }
                if a == b {
                    return Err(ConnectivityError::DegenerateFace { face: f, vertex: a });
                }
                start[a as usize + 1] += 1;
                tail.push(VertexId::new(a as usize));
            }
        }
        for v in 0..vertex_count {
            start[v + 1] += start[v];
        }
        let head = |h: usize| faces[h / 3][(h % 3 + 1) % 3];
        let (mut end, mut outgoing) = (start.clone(), vec![(0, 0); tail.len()]);
        for (h, &a) in tail.as_slice().iter().enumerate() {
            outgoing[end[a.index()]] = (head(h), h);
            end[a.index()] += 1;
        }
        for v in 0..vertex_count {
            outgoing[start[v]..start[v + 1]].sort_unstable();
        }
        let of_one = |p: &&[(u32, usize)]| {
            p[0].0 == p[1].0 && faces[p[0].1 / 3][p[0].1 % 3] == faces[p[1].1 / 3][p[1].1 % 3]
        };
        let pairs = outgoing.windows(2).filter(of_one);
        let doubled = pairs
            .map(|pair| [pair[0].1, pair[1].1])
            .min_by_key(|pair| pair[1]);
        if let Some([first, second]) = doubled {
            return Err(ConnectivityError::DoubledHalfedge {
                first: first / 3,
                second: second / 3,
                tail: faces[second / 3][second % 3],
                head: head(second),
            });
        }
        let twin = |h: usize| {
            let to = head(h) as usize;
            let outgoing = &outgoing[start[to]..start[to + 1]];
            let from = faces[h / 3][h % 3];
            let at = outgoing
                .binary_search_by_key(&from, |&(head, _)| head)
                .ok()?;
            Some(HalfedgeId::new(outgoing[at].1))
        };
        let twin: Vec<_> = (0..tail.len()).map(twin).collect();
        Self::from_gluing(tail, &twin, vertex_count)
    }

    /// Builds the structure from the tail and the twin of every halfedge. Unlike triples this
    /// can say which of two edges between the same vertices is meant, and glue a face to itself.
    pub fn from_gluing(
        tail: HalfedgeVec<VertexId>,
        twin: &[Option<HalfedgeId>],
        vertex_count: usize,
    ) -> Result<Connectivity, ConnectivityError> {
        let mut edge = HalfedgeVec::filled(EdgeId::new(0), tail.len());
        let mut edge_halfedge = EdgeVec::default();
        for h in tail.ids() {
            match twin[h.index()] {
                Some(t) if t < h => edge[h] = edge[t],
                _ => edge[h] = edge_halfedge.push(h),
            }
        }
        let mut first = VertexVec::filled(None, vertex_count);
        let mut outgoing_count = VertexVec::filled(0usize, vertex_count);
        for (h, &v) in tail.enumerate() {
            outgoing_count[v] += 1;
            if first[v].is_none() || twin[h.index()].is_none() {
                first[v] = Some(h);
            }
        }
        let mut vertex_halfedge = VertexVec::default();
        for (v, h) in first.enumerate() {
            vertex_halfedge.push(h.ok_or(ConnectivityError::UnusedVertex { vertex: v.raw() })?);
        }
        let arrays = Arrays {
            tail,
            twin: twin
                .iter()
                .map(|t| t.map_or(NONE, HalfedgeId::raw))
                .collect(),
            edge,
            edge_halfedge,
            vertex_halfedge,
        };
        let connectivity = Connectivity {
            arrays: Arc::new(arrays),
        };
        for v in connectivity.vertices() {
            if connectivity.outgoing(v).count() != outgoing_count[v] {
                return Err(ConnectivityError::NonManifoldVertex { vertex: v.raw() });
            }
        }
        Ok(connectivity)
    }

    /// Number of vertices.
    pub fn vertex_count(&self) -> usize {
        self.arrays.vertex_halfedge.len()
    }
    /// Number of edges.
    pub fn edge_count(&self) -> usize {
        self.arrays.edge_halfedge.len()
    }
    /// Number of faces.
    pub fn face_count(&self) -> usize {
        self.arrays.tail.len() / 3
    }
    /// Number of halfedges, three a face.
    pub fn halfedge_count(&self) -> usize {
        self.arrays.tail.len()
    }
    /// All vertices.
    pub fn vertices(&self) -> impl ExactSizeIterator<Item = VertexId> + use<> {
        (0..self.vertex_count()).map(VertexId::new)
    }
    /// All edges.
    pub fn edges(&self) -> impl ExactSizeIterator<Item = EdgeId> + use<> {
        (0..self.edge_count()).map(EdgeId::new)
    }
    /// All faces.
    pub fn faces(&self) -> impl ExactSizeIterator<Item = FaceId> + use<> {
        (0..self.face_count()).map(FaceId::new)
    }
    /// All halfedges.
    pub fn halfedges(&self) -> impl ExactSizeIterator<Item = HalfedgeId> + use<> {
        (0..self.halfedge_count()).map(HalfedgeId::new)
    }

    /// The halfedge that leaves a corner.
    #[inline]
    pub fn corner_halfedge(&self, face: FaceId, corner: usize) -> HalfedgeId {
        HalfedgeId::new(3 * face.index() + corner)
    }
    /// The three halfedges of a face, from corner 0.
    #[inline]
    pub fn face_halfedges(&self, face: FaceId) -> [HalfedgeId; 3] {
        std::array::from_fn(|k| self.corner_halfedge(face, k))
    }
    /// The three vertices of a face, from corner 0.
    #[inline]
    pub fn face_vertices(&self, face: FaceId) -> [VertexId; 3] {
        self.face_halfedges(face).map(|h| self.tail(h))
    }
    /// The three edges of a face; the one *opposite* corner `k` at `k`.
    #[inline]
    pub fn face_edges(&self, face: FaceId) -> [EdgeId; 3] {
        std::array::from_fn(|k| self.edge(self.corner_halfedge(face, (k + 1) % 3)))
    }
    /// The face on the left of a halfedge.
    #[inline]
    pub fn face(&self, h: HalfedgeId) -> FaceId {
        FaceId::new(h.index() / 3)
    }
    /// The corner that a halfedge leaves: 0, 1 or 2.
    #[inline]
    pub fn corner(&self, h: HalfedgeId) -> usize {
        h.index() % 3
    }
    /// The next halfedge around the face, counterclockwise.
    #[inline]
    pub fn next(&self, h: HalfedgeId) -> HalfedgeId {
        HalfedgeId::new(if h.index() % 3 == 2 {
            h.index() - 2
        } else {
            h.index() + 1
        })
    }
    /// The previous halfedge around the face.
    #[inline]
    pub fn prev(&self, h: HalfedgeId) -> HalfedgeId {
        HalfedgeId::new(if h.index().is_multiple_of(3) {
            h.index() + 2
        } else {
            h.index() - 1
        })
    }
    /// The same edge in the other direction; `None` on the boundary.
    #[inline]
    pub fn twin(&self, h: HalfedgeId) -> Option<HalfedgeId> {
        let t = self.arrays.twin[h];
        (t != NONE).then(|| HalfedgeId::new(t as usize))
    }
    /// The vertex a halfedge leaves.
    #[inline]
    pub fn tail(&self, h: HalfedgeId) -> VertexId {
        self.arrays.tail[h]
    }
    /// The vertex a halfedge enters.
    #[inline]
    pub fn head(&self, h: HalfedgeId) -> VertexId {
        self.arrays.tail[self.next(h)]
    }
    /// The vertex of the face that is on neither end of the halfedge.
    #[inline]
    pub fn apex(&self, h: HalfedgeId) -> VertexId {
        self.arrays.tail[self.prev(h)]
    }
    /// The edge of a halfedge.
    #[inline]
    pub fn edge(&self, h: HalfedgeId) -> EdgeId {
        self.arrays.edge[h]
    }
    /// One halfedge of an edge, the same one as long as the connectivity does not change.
    #[inline]
    pub fn edge_halfedge(&self, e: EdgeId) -> HalfedgeId {
        self.arrays.edge_halfedge[e]
    }
    /// The two ends of an edge, tail of its halfedge first.
    #[inline]
    pub fn edge_vertices(&self, e: EdgeId) -> [VertexId; 2] {
        let h = self.arrays.edge_halfedge[e];
        [self.tail(h), self.head(h)]
    }
    /// The first outgoing halfedge of a vertex: the boundary one where there is one.
    #[inline]
    pub fn vertex_halfedge(&self, v: VertexId) -> HalfedgeId {
        self.arrays.vertex_halfedge[v]
    }
    /// True where the edge has one face only.
    #[inline]
    pub fn is_boundary_edge(&self, e: EdgeId) -> bool {
        self.arrays.twin[self.arrays.edge_halfedge[e]] == NONE
    }
    /// True where the vertex lies on a boundary loop.
    #[inline]
    pub fn is_boundary_vertex(&self, v: VertexId) -> bool {
        self.arrays.twin[self.arrays.vertex_halfedge[v]] == NONE
    }
    /// True where there is no boundary.
    pub fn is_closed(&self) -> bool {
        self.arrays.twin.iter().all(|&t| t != NONE)
    }

    /// The next outgoing halfedge counterclockwise around the tail; `None` past a boundary.
    #[inline]
    pub fn rotate_ccw(&self, h: HalfedgeId) -> Option<HalfedgeId> {
        self.twin(self.prev(h))
    }
    /// The next outgoing halfedge clockwise around the tail; `None` past a boundary.
    #[inline]
    pub fn rotate_cw(&self, h: HalfedgeId) -> Option<HalfedgeId> {
        self.twin(h).map(|t| self.next(t))
    }
    /// The outgoing halfedges of a vertex, one a face corner, counterclockwise from the first.
    /// At a boundary vertex the edge that closes the fan has no outgoing halfedge.
    pub fn outgoing(&self, v: VertexId) -> impl Iterator<Item = HalfedgeId> + '_ {
        let start = self.arrays.vertex_halfedge[v];
        std::iter::successors(Some(start), move |&h| {
            self.rotate_ccw(h).filter(|&n| n != start)
        })
    }
    /// The vertices joined to `v` by an edge, counterclockwise; one entry an edge.
    pub fn neighbours(&self, v: VertexId) -> impl Iterator<Item = VertexId> + '_ {
        let last = self
            .is_boundary_vertex(v)
            .then(|| self.outgoing(v).last().map(|h| self.apex(h)))
            .flatten();
        self.outgoing(v).map(|h| self.head(h)).chain(last)
    }
    /// Number of edges at a vertex.
    pub fn valence(&self, v: VertexId) -> usize {
        self.outgoing(v).count() + usize::from(self.is_boundary_vertex(v))
    }

    /// The boundary loops, each a chain of boundary halfedges in surface order (face on the left),
    /// in the order of their lowest halfedge.
    pub fn boundary_loops(&self) -> Vec<Vec<HalfedgeId>> {
        let mut seen = HalfedgeVec::filled(false, self.halfedge_count());
        let mut loops = Vec::new();
        for start in self.halfedges() {
            if self.arrays.twin[start] != NONE || seen[start] {
                continue;
            }
            let mut chain = Vec::new();
            let mut h = start;
            while !seen[h] {
                seen[h] = true;
                chain.push(h);
                h = self.arrays.vertex_halfedge[self.head(h)];
            }
            loops.push(chain);
        }
        loops
    }

    /// Euler characteristic, genus and boundary loops of a connected surface.
    pub fn topology(&self) -> Topology {
        let chi = self.vertex_count() as i64 - self.edge_count() as i64 + self.face_count() as i64;
        let boundary_loops = self.boundary_loops().len();
        Topology {
            vertices: self.vertex_count(),
            edges: self.edge_count(),
            faces: self.face_count(),
            euler_characteristic: chi,
            genus: (2 - chi - boundary_loops as i64) / 2,
            boundary_loops,
        }
    }

    /// The faces as vertex triples.
    pub fn to_faces(&self) -> Vec<[u32; 3]> {
        self.faces()
            .map(|f| self.face_vertices(f).map(VertexId::raw))
            .collect()
    }

    /// Checks every invariant; for tests after each mutation.
    pub fn validate(&self) -> Result<(), String> {
        let mut fan = VertexVec::filled(0usize, self.vertex_count());
        for h in self.halfedges() {
            fan[self.tail(h)] += 1;
            if let Some(t) = self.twin(h) {
                if self.twin(t) != Some(h) || t == h {
                    return Err(format!("twin of {t} is not {h}"));
                }
                if self.tail(t) != self.head(h) || self.head(t) != self.tail(h) {
                    return Err(format!(
                        "halfedges {h} and {t} do not run against each other"
                    ));
                }
                if self.edge(t) != self.edge(h) {
                    return Err(format!("halfedges {h} and {t} have two edges"));
                }
            }
            let representative = self.edge_halfedge(self.edge(h));
            if representative != h && self.twin(representative) != Some(h) {
                return Err(format!("edge of halfedge {h} is another's"));
            }
        }
        for v in self.vertices() {
            let first = self.vertex_halfedge(v);
            if self.tail(first) != v {
                return Err(format!(
                    "first halfedge of vertex {v} leaves another vertex"
                ));
            }
            if self.outgoing(v).count() != fan[v] {
                return Err(format!("the fan of vertex {v} is not complete"));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
