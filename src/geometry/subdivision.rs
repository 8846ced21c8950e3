//! A subdivision of a surface: finer faces, each of which lies in one face of the surface.
//!
//! *Enters:* a surface, then edges to split. *Leaves:* connectivity, and for every corner its barycentric coordinates in the face that
//! its face lies in, so that whatever is linear on the surface's faces can be carried over.
//!
//! *Guaranteed:* a weight that is zero stays exactly zero, so points on a side of a face are known to be there; differences of weights
//! in a small face keep their relative accuracy.

use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeId, FaceId, FaceVec, HalfedgeId, HalfedgeVec, VertexId, VertexVec};
use crate::geometry::mesh::Mesh;

/// What is known of a corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Corner {
    /// Barycentric coordinates in the face of the surface.
    pub weights: [f64; 3],
    /// Coordinates in the corner's patch, where it has some.
    pub uv: [f64; 2],
}

impl Corner {
    fn between(p: Corner, q: Corner, parts: [f64; 2]) -> Corner {
        Corner {
            weights: std::array::from_fn(|i| mix(p.weights[i], q.weights[i], parts)),
            uv: std::array::from_fn(|i| mix(p.uv[i], q.uv[i], parts)),
        }
    }
}

/// a p + b q with a + b = 1; `p` itself where both are the same. Both parts are given, since what is left of 1 beside a small one has lost its digits.
fn mix(p: f64, q: f64, [a, b]: [f64; 2]) -> f64 {
    if p == q { p } else { a * p + b * q }
}

/// See the module docs.
#[derive(Clone, Debug)]
pub(crate) struct Subdivision {
    pub connectivity: Connectivity,
    /// Of every vertex, source units. The first ones are the surface's.
    pub position: VertexVec<[f64; 3]>,
    /// Face of the surface that a face lies in.
    pub parent: FaceVec<FaceId>,
    /// Of the corner that a halfedge leaves.
    pub corner: HalfedgeVec<Corner>,
}

impl Subdivision {
    /// The surface itself.
    pub fn identity(mesh: &Mesh) -> Self {
        let connectivity = mesh.connectivity.clone();
        let corner = |h| {
            let mut weights = [0.0; 3];
            weights[connectivity.corner(h)] = 1.0;
            Corner {
                weights,
                uv: [0.0; 2],
            }
        };
        Self {
            corner: connectivity.halfedges().map(corner).collect(),
            parent: connectivity.faces().collect(),
            position: mesh.positions.clone(),
            connectivity,
        }
    }

    /// Splits an edge at the fraction `t` from the tail of its halfedge.
    pub fn split_edge(&mut self, e: EdgeId, t: f64) -> VertexId {
        let [a, b] = self.connectivity.edge_vertices(e);
        let (p, q) = (self.position[a], self.position[b]);
        let split = self.connectivity.split_edge(e);
        let parts = [1.0 - t, t];
        self.position
            .push(std::array::from_fn(|i| mix(p[i], q[i], parts)));
        for (side, parts) in split.sides.iter().zip([parts, [t, 1.0 - t]]) {
            let at = |face: FaceId, k: usize| HalfedgeId::new(3 * face.index() + k % 3);
            let (old, k) = (side.old, side.corner);
            for corner in 0..3 {
                let same = self.corner[at(old, corner)];
                self.corner.push(same);
            }
            self.parent.push(self.parent[old]);
            let middle =
                Corner::between(self.corner[at(old, k)], self.corner[at(old, k + 1)], parts);
            self.corner[at(old, k + 1)] = middle;
            self.corner[at(side.new, k)] = middle;
        }
        split.vertex
    }

    /// Splits a face at a point inside it, given by its weights in that face.
    pub fn split_face(&mut self, f: FaceId, weights: [f64; 3]) -> VertexId {
        let old = self.connectivity.face_halfedges(f).map(|h| self.corner[h]);
        let at = self.connectivity.face_vertices(f).map(|v| self.position[v]);
        let sum = |x: [f64; 3]| (0..3).map(|k| weights[k] * x[k]).sum::<f64>();
        let inside = Corner {
            weights: std::array::from_fn(|i| sum(old.map(|c| c.weights[i]))),
            uv: std::array::from_fn(|i| sum(old.map(|c| c.uv[i]))),
        };
        self.position
            .push(std::array::from_fn(|i| sum(at.map(|p| p[i]))));
        let split = self.connectivity.split_face(f);
        for _ in 1..3 {
            self.parent.push(self.parent[f]);
            old.iter().for_each(|&c| {
                self.corner.push(c);
            });
        }
        for (i, face) in split.faces.into_iter().enumerate() {
            self.corner[HalfedgeId::new(3 * face.index() + (i + 2) % 3)] = inside;
        }
        split.vertex
    }

    /// The side of its parent face that a halfedge runs along, from corner to corner counterclockwise; `None` inside.
    pub fn side_of_parent(&self, h: HalfedgeId) -> Option<usize> {
        let ends = [h, self.connectivity.next(h)].map(|h| self.corner[h].weights);
        let opposite = (0..3).find(|&k| ends.iter().all(|w| w[k] == 0.0))?;
        Some((opposite + 1) % 3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::ids::NONE;

    /// A flat unit square.
    fn square(n: u32) -> Mesh {
        let at = |i: u32, j: u32| i * (n + 1) + j;
        let mut faces = Vec::new();
        for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            faces.extend([[a, b, c], [a, c, d]]);
        }
        let count = (n + 1) * (n + 1);
        let place = |v: u32| [v / (n + 1), v % (n + 1), 0].map(|x| f64::from(x) / f64::from(n));
        Mesh {
            connectivity: Connectivity::from_faces(&faces, count as usize).unwrap(),
            positions: (0..count).map(place).collect(),
            source_vertex: (0..count).collect(),
            source_face: (0..faces.len() as u32).collect(),
            face_material: FaceVec::filled(NONE, faces.len()),
            attributes: Vec::new(),
        }
    }

    /// Corners lie where their weights say, whatever is split.
    #[test]
    fn weights_reproduce_positions() {
        let mesh = square(4);
        let mut fine = Subdivision::identity(&mesh);
        let mut state = 5u64;
        for i in 0..300 {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1);
            let part = 0.1 + 0.8 * ((state >> 20) % 100) as f64 / 100.0;
            let any = (state >> 33) as usize;
            match i % 3 {
                0 => {
                    let f = FaceId::new(any % fine.connectivity.face_count());
                    let other = 0.7 * (1.0 - part);
                    fine.split_face(f, [part, other, 1.0 - part - other])
                }
                _ => {
                    let e = EdgeId::new(any % fine.connectivity.edge_count());
                    fine.split_edge(e, part)
                }
            };
        }
        let c = &fine.connectivity;
        c.validate().unwrap();
        let mut on_sides = 0;
        for h in c.halfedges() {
            let parent = mesh.face_positions(fine.parent[c.face(h)]);
            let w = fine.corner[h].weights;
            for (i, &here) in fine.position[c.tail(h)].iter().enumerate() {
                let there: f64 = w.iter().zip(&parent).map(|(w, p)| w * p[i]).sum();
                assert!((there - here).abs() < 1e-13);
            }
            on_sides += usize::from(fine.side_of_parent(h).is_some());
            if c.twin(h).is_none() {
                assert!(fine.side_of_parent(h).is_some());
            }
        }
        assert!(on_sides >= 3 * mesh.connectivity.face_count());
    }
}
