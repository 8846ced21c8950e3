//! A triangulation cut open along some of its edges.
//!
//! *Enters:* connectivity, edges. *Leaves:* the same faces and halfedges with nothing glued across those edges, and the vertices that are left: one for every
//! sector of faces between two cuts. *Guaranteed:* where nothing is cut, ids of vertices stay.

use crate::geometry::connectivity::{Connectivity, ConnectivityError};
use crate::geometry::ids::{EdgeId, EdgeVec, HalfedgeId, HalfedgeVec, VertexId, VertexVec};

/// See the module docs.
#[derive(Clone, Debug)]
pub struct Opened {
    /// What is left.
    pub connectivity: Connectivity,
    /// The vertex of every sector. A vertex's first sector has the vertex's own id.
    pub vertex: VertexVec<VertexId>,
    /// Both sides of every edge that was cut.
    pub glued: Vec<[HalfedgeId; 2]>,
}

impl Opened {
    /// Cuts some edges; those on the boundary stay as they are.
    pub fn new(connectivity: &Connectivity, cuts: &[EdgeId]) -> Result<Self, ConnectivityError> {
        let c = connectivity;
        let mut is_cut = EdgeVec::filled(false, c.edge_count());
        let mut glued = Vec::with_capacity(cuts.len());
        for &e in cuts {
            let h = c.edge_halfedge(e);
            if let (Some(t), false) = (c.twin(h), std::mem::replace(&mut is_cut[e], true)) {
                glued.push([h, t]);
            }
        }
        let mut vertex: VertexVec<VertexId> = c.vertices().collect();
        let mut tail: HalfedgeVec<Option<VertexId>> = HalfedgeVec::filled(None, c.halfedge_count());
        let across = |h| c.twin(h).filter(|_| !is_cut[c.edge(h)]);
        for v in c.vertices() {
            let mut is_first = true;
            for start in c.outgoing(v) {
                if tail[start].is_some() {
                    continue;
                }
                let sector = match std::mem::take(&mut is_first) {
                    true => v,
                    false => vertex.push(v),
                };
                // Clockwise to the beginning of the sector, if it has one, then counterclockwise through it.
                let mut first = start;
                while let Some(h) = across(first).map(|t| c.next(t)) {
                    first = h;
                    if h == start {
                        break;
                    }
                }
                let mut h = first;
                loop {
                    tail[h] = Some(sector);
                    match across(c.prev(h)) {
                        Some(next) if next != first => h = next,
                        _ => break,
                    }
                }
            }
        }
        let tail = c.halfedges().map(|h| tail[h].unwrap_or(c.tail(h)));
        let twin: Vec<_> = c.halfedges().map(across).collect();
        let opened = Connectivity::from_gluing(tail.collect(), &twin, vertex.len())?;
        Ok(Self {
            connectivity: opened,
            vertex,
            glued,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::ricci::shapes;

    #[test]
    fn a_slit_a_loop_and_a_junction() {
        let shape = shapes::torus(9, 7);
        let c = &shape.connectivity;
        let cut = |pairs: &[[usize; 2]]| {
            let is_cut = |e: EdgeId| {
                let ends = c.edge_vertices(e).map(|v| v.index());
                pairs.iter().any(|p| *p == ends || [p[1], p[0]] == ends)
            };
            let cuts: Vec<EdgeId> = c.edges().filter(|&e| is_cut(e)).collect();
            Opened::new(c, &cuts).unwrap()
        };
        let whole = cut(&[]);
        assert_eq!(whole.connectivity, *c);
        // Vertices are 7 i + j. Two edges: the middle vertex is there twice, the ends once.
        let slit = cut(&[[0, 1], [1, 2]]);
        assert_eq!(slit.connectivity.vertex_count(), c.vertex_count() + 1);
        assert_eq!(slit.connectivity.boundary_loops().len(), 1);
        let around: Vec<[usize; 2]> = (0..7).map(|j| [j, (j + 1) % 7]).collect();
        let tube = cut(&around);
        assert_eq!(tube.connectivity.vertex_count(), c.vertex_count() + 7);
        assert_eq!(tube.connectivity.boundary_loops().len(), 2);
        let junction = cut(&[[0, 1], [1, 2], [1, 8]]);
        assert_eq!(junction.connectivity.vertex_count(), c.vertex_count() + 2);
        for opened in [slit, tube, junction] {
            let o = &opened.connectivity;
            o.validate().unwrap();
            for h in o.halfedges() {
                assert_eq!(opened.vertex[o.tail(h)], c.tail(h));
            }
            for &[h, t] in &opened.glued {
                assert!(c.twin(h) == Some(t) && o.twin(h).is_none() && o.twin(t).is_none());
            }
        }
    }
}
