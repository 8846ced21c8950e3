//! The double of a surface with boundary: the surface and its mirror image, glued along the boundary.
//!
//! *Enters:* connectivity with boundary. *Leaves:* a closed one whose first faces, halfedges and vertices are the surface's own,
//! with the same ids. *Guaranteed:* faces of the mirror image run the other way, so the double is oriented.
//!
//! Curvature at a boundary vertex is twice the surface's own, and a flat metric that is symmetric has the old boundary as straight
//! lines: a boundary condition becomes none (`docs/method.md`, 2).

use crate::geometry::connectivity::{Connectivity, ConnectivityError};
use crate::geometry::ids::{EdgeVec, HalfedgeId, HalfedgeVec, VertexId, VertexVec};

/// A double, and which part of it is which.
#[derive(Clone, Debug)]
pub struct Doubled {
    /// Closed.
    pub connectivity: Connectivity,
    /// Every vertex of the double as a vertex of the surface.
    pub original: VertexVec<VertexId>,
}

impl Doubled {
    /// The double; a closed surface stays as it is.
    pub fn new(surface: &Connectivity) -> Result<Self, ConnectivityError> {
        if surface.is_closed() {
            return Ok(Self {
                connectivity: surface.clone(),
                original: surface.vertices().collect(),
            });
        }
        let mut original: VertexVec<VertexId> = surface.vertices().collect();
        let mut image: VertexVec<VertexId> = original.clone();
        for v in surface.vertices() {
            if !surface.is_boundary_vertex(v) {
                image[v] = original.push(v);
            }
        }
        let count = surface.halfedge_count();
        let mut tail: HalfedgeVec<VertexId> =
            surface.halfedges().map(|h| surface.tail(h)).collect();
        let mut twin: Vec<Option<HalfedgeId>> = surface
            .halfedges()
            .map(|h| Some(surface.twin(h).unwrap_or(mirrored(h, count))))
            .collect();
        for index in 0..count {
            let h = mirrored(HalfedgeId::new(count + index), count);
            tail.push(image[surface.head(h)]);
            twin.push(Some(match surface.twin(h) {
                Some(t) => mirrored(t, count),
                None => h,
            }));
        }
        Ok(Self {
            connectivity: Connectivity::from_gluing(tail, &twin, original.len())?,
            original,
        })
    }

    /// One value an edge of the surface, given to both copies.
    pub fn on_both<T: Clone>(&self, surface: &Connectivity, value: &EdgeVec<T>) -> EdgeVec<T> {
        let (c, count) = (&self.connectivity, surface.halfedge_count());
        let own = |h: HalfedgeId| {
            if h.index() < count {
                h
            } else {
                mirrored(h, count)
            }
        };
        c.edges()
            .map(|e| value[surface.edge(own(c.edge_halfedge(e)))].clone())
            .collect()
    }
}

/// The mirror image of a halfedge of a double whose halves have `count` halfedges each; it runs the other way.
///
/// Corner 0 stays corner 0 and the other two change places, so side `k` becomes side `2 − k`.
pub fn mirrored(h: HalfedgeId, count: usize) -> HalfedgeId {
    let (face, k) = (h.index() / 3, h.index() % 3);
    let faces = count / 3;
    let other = if face < faces {
        face + faces
    } else {
        face - faces
    };
    HalfedgeId::new(3 * other + 2 - k)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::ricci::shapes;

    #[test]
    fn a_double_is_closed_and_symmetric_and_keeps_ids() {
        for shape in [shapes::sheet(6, false), shapes::sheet(9, true)] {
            let surface = &shape.connectivity;
            let double = Doubled::new(surface).unwrap();
            let c = &double.connectivity;
            c.validate().unwrap();
            assert!(c.is_closed());
            let (one, both) = (surface.topology(), c.topology());
            assert_eq!(both.euler_characteristic, 2 * one.euler_characteristic);
            assert_eq!(both.genus, one.boundary_loops as i64 - 1);
            let count = surface.halfedge_count();
            for h in c.halfedges() {
                let image = mirrored(h, count);
                assert_eq!(mirrored(image, count), h);
                assert_eq!(double.original[c.tail(h)], double.original[c.head(image)]);
                let twin = c.twin(h).unwrap();
                assert!(c.twin(image) == Some(mirrored(twin, count)));
                if h.index() < count {
                    assert_eq!(c.tail(h), surface.tail(h));
                    match surface.twin(h) {
                        Some(t) => assert_eq!(t, twin),
                        None => assert_eq!(image, twin),
                    }
                }
            }
            let length = double.on_both(surface, &shape.length);
            for (e, &l) in length.enumerate() {
                let h = c.edge_halfedge(e);
                let own = if h.index() < count {
                    h
                } else {
                    mirrored(h, count)
                };
                assert_eq!(l, shape.length[surface.edge(own)]);
            }
        }
    }

    #[test]
    fn a_closed_surface_stays() {
        let shape = shapes::torus(5, 4);
        let double = Doubled::new(&shape.connectivity).unwrap();
        assert_eq!(double.connectivity, shape.connectivity);
        assert!(double.original.enumerate().all(|(v, &o)| v == o));
    }
}
