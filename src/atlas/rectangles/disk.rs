//! A part of a subdivision between walls, taken out as a disk of its own.
//!
//! *Enters:* faces, and which edges are walls. *Leaves:* connectivity of these faces alone, glued across edges that are no walls; a
//! vertex that the walls meet several times has as many copies. *Guaranteed:* one face set, one border, χ = 1, or an error.

use super::RectangleError;
use super::harmonic::harmonic;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{
    EdgeId, EdgeVec, FaceId, FaceVec, HalfedgeId, HalfedgeVec, NONE, VertexId, VertexVec,
};
use crate::geometry::subdivision::Subdivision;

/// A disk; face `f` of it is the face `faces[f]` of the subdivision, with corners in the same order.
pub(super) struct Disk {
    pub connectivity: Connectivity,
    /// Faces of the subdivision, ascending.
    pub faces: Vec<FaceId>,
    /// Vertex of the subdivision of every vertex.
    pub vertex: VertexVec<VertexId>,
    /// The border, counterclockwise: own halfedges.
    pub border: Vec<HalfedgeId>,
}

impl Disk {
    /// Takes the faces, which must be ascending, out of the subdivision. `patch` is named in errors.
    pub fn new(
        fine: &Subdivision,
        is_wall: &EdgeVec<bool>,
        faces: Vec<FaceId>,
        patch: usize,
    ) -> Result<Self, RectangleError> {
        let c = &fine.connectivity;
        let own = |h: HalfedgeId| {
            let at = faces.binary_search(&c.face(h)).ok()?;
            Some(HalfedgeId::new(3 * at + c.corner(h)))
        };
        let twin: Vec<Option<HalfedgeId>> = faces
            .iter()
            .flat_map(|&f| c.face_halfedges(f))
            .map(|h| c.twin(h).filter(|_| !is_wall[c.edge(h)]).and_then(own))
            .collect();
        let next = |h: HalfedgeId| HalfedgeId::new(h.index() - h.index() % 3 + (h.index() + 1) % 3);
        let prev = |h: HalfedgeId| next(next(h));
        // One vertex a fan.
        let mut tail = HalfedgeVec::filled(NONE, twin.len());
        let mut vertex = VertexVec::default();
        for start in tail.ids() {
            if tail[start] != NONE {
                continue;
            }
            let here = c.tail(c.corner_halfedge(faces[start.index() / 3], start.index() % 3));
            let v = vertex.push(here).raw();
            let mut at = Some(start);
            while let Some(h) = at.filter(|&h| tail[h] == NONE) {
                tail[h] = v;
                at = twin[prev(h).index()];
            }
            at = twin[start.index()].map(next);
            while let Some(h) = at.filter(|&h| tail[h] == NONE) {
                tail[h] = v;
                at = twin[h.index()].map(next);
            }
        }
        let tail: HalfedgeVec<VertexId> = tail.iter().map(|&v| VertexId::new(v as usize)).collect();
        let connectivity = Connectivity::from_gluing(tail, &twin, vertex.len())?;
        let loops = connectivity.boundary_loops();
        let euler_characteristic = connectivity.topology().euler_characteristic;
        let mut reached = FaceVec::filled(false, faces.len());
        let mut stack = vec![FaceId::new(0)];
        let mut count = 0;
        while let Some(f) = stack.pop().filter(|f| f.index() < faces.len()) {
            if std::mem::replace(&mut reached[f], true) {
                continue;
            }
            count += 1;
            let across = connectivity.face_halfedges(f).into_iter();
            stack.extend(across.filter_map(|h| Some(connectivity.face(connectivity.twin(h)?))));
        }
        let mut loops = loops.into_iter();
        match (loops.next(), loops.len(), euler_characteristic) {
            (Some(border), 0, 1) if count == faces.len() => Ok(Self {
                connectivity,
                faces,
                vertex,
                border,
            }),
            (_, more, _) => Err(RectangleError::NotADisk {
                patch,
                euler_characteristic,
                border_loops: more + 1,
            }),
        }
    }

    /// The halfedge of the subdivision.
    pub fn halfedge(&self, fine: &Subdivision, h: HalfedgeId) -> HalfedgeId {
        fine.connectivity
            .corner_halfedge(self.faces[h.index() / 3], h.index() % 3)
    }

    /// The edge of the subdivision.
    pub fn edge(&self, fine: &Subdivision, h: HalfedgeId) -> EdgeId {
        fine.connectivity.edge(self.halfedge(fine, h))
    }

    /// The vertex of the subdivision where a place on the border begins.
    pub fn border_vertex(&self, place: usize) -> VertexId {
        self.vertex[self.connectivity.tail(self.border[place])]
    }

    /// Functions that are harmonic in space, one for each set of border values (in the order of the border's places).
    pub fn harmonic(
        &self,
        fine: &Subdivision,
        border_values: &[Vec<f64>],
    ) -> Result<Vec<VertexVec<f64>>, RectangleError> {
        let length = self.lengths(fine);
        harmonic(&self.connectivity, &length, &self.border, border_values)
    }

    /// Lengths of all edges in space.
    pub fn lengths(&self, fine: &Subdivision) -> EdgeVec<f64> {
        let c = &self.connectivity;
        let length = |e| fine.edge_length(self.edge(fine, c.edge_halfedge(e)));
        c.edges().map(length).collect()
    }
}

/// The faces that are joined to a face without crossing a wall, ascending.
pub(super) fn region(fine: &Subdivision, is_wall: &EdgeVec<bool>, start: FaceId) -> Vec<FaceId> {
    let c = &fine.connectivity;
    let mut seen = rustc_hash::FxHashSet::from_iter([start]);
    let mut faces = vec![start];
    let mut next = 0;
    while let Some(&f) = faces.get(next) {
        next += 1;
        for h in c.face_halfedges(f) {
            let across = c.twin(h).filter(|_| !is_wall[c.edge(h)]);
            if let Some(g) = across.map(|t| c.face(t)).filter(|&g| seen.insert(g)) {
                faces.push(g);
            }
        }
    }
    faces.sort_unstable();
    faces
}
