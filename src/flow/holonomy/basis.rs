//! 2g loops that generate the homology of a closed surface.
//!
//! *Enters:* connectivity. *Leaves:* [`DualLoops`]. *Guaranteed:* 2g simple loops that generate H₁; the same for the same ids. *Not guaranteed:*
//! the shortest ones.
//!
//! Tree and cotree (Eppstein 2003; Erickson, Whittlesey 2005 for the choice): a tree of fewest faces from face 0, then a spanning tree of the
//! vertices among the edges that the first tree does not cross, of those edges first that would close the longest loops. What is in neither tree closes one
//! loop each, and the part of the way to the root that both ends share is left out. Short loops keep the rows of the
//! Jacobian short.

use super::{DualLoops, HolonomyError, Passage};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::disjoint_sets::UnionFind;
use crate::geometry::ids::{EdgeId, EdgeVec, FaceId, FaceVec, HalfedgeId};

/// Shortest ways from face to face, all ending at face 0.
struct FaceTree {
    /// The halfedge of a face through which its way to the root leaves; `None` at the root.
    up: FaceVec<Option<HalfedgeId>>,
    /// Number of edges crossed on the way.
    depth: FaceVec<u32>,
    /// True for edges that some way crosses.
    is_crossed: EdgeVec<bool>,
}

/// See the module docs. The surface must be closed and connected.
pub fn homology_basis(connectivity: &Connectivity) -> Result<DualLoops, HolonomyError> {
    let c = connectivity;
    if !c.is_closed() {
        let boundary_loops = c.boundary_loops().len();
        return Err(HolonomyError::NotClosed { boundary_loops });
    }
    let tree = FaceTree::new(c)?;
    let mut by_length: Vec<Vec<EdgeId>> = Vec::new();
    for e in c.edges().filter(|&e| !tree.is_crossed[e]) {
        let length = sides(c, e).map(|h| tree.depth[c.face(h)] as usize);
        let length = length[0] + length[1];
        if by_length.len() <= length {
            by_length.resize(length + 1, Vec::new());
        }
        by_length[length].push(e);
    }
    let mut joined = UnionFind::new(c.vertex_count());
    let mut closing = Vec::new();
    for &e in by_length.iter().rev().flatten() {
        let [a, b] = c.edge_vertices(e);
        if !joined.join(a.index(), b.index()) {
            closing.push(e);
        }
    }
    closing.sort_unstable();
    let loops: Vec<Vec<Passage>> = closing.iter().map(|&e| tree.close(c, e)).collect();
    DualLoops::new(c, &loops)
}

/// Both halfedges of an edge of a closed surface.
fn sides(c: &Connectivity, e: EdgeId) -> [HalfedgeId; 2] {
    let h = c.edge_halfedge(e);
    [h, c.twin(h).unwrap_or(h)]
}

impl FaceTree {
    fn new(c: &Connectivity) -> Result<Self, HolonomyError> {
        let faces = c.face_count();
        let mut tree = Self {
            up: FaceVec::filled(None, faces),
            depth: FaceVec::filled(0, faces),
            is_crossed: EdgeVec::filled(false, c.edge_count()),
        };
        let mut reached = vec![FaceId::new(0); faces.min(1)];
        let mut next = 0;
        while let Some(&f) = reached.get(next) {
            next += 1;
            for h in c.face_halfedges(f) {
                let Some(t) = c.twin(h) else { continue };
                let g = c.face(t);
                if g.index() != 0 && tree.up[g].is_none() {
                    tree.up[g] = Some(t);
                    tree.depth[g] = tree.depth[f] + 1;
                    tree.is_crossed[c.edge(h)] = true;
                    reached.push(g);
                }
            }
        }
        match reached.len() == faces {
            true => Ok(tree),
            false => Err(HolonomyError::NotConnected {
                reached: reached.len(),
                faces,
            }),
        }
    }

    /// The loop across `e`: from the face of its halfedge towards the root, and back to the face of the twin.
    fn close(&self, c: &Connectivity, e: EdgeId) -> Vec<Passage> {
        let [h, t] = sides(c, e);
        let (mut f, mut g) = (c.face(h), c.face(t));
        let (mut rising, mut falling) = (Vec::new(), Vec::new());
        while f != g {
            let (from, ways) = match self.depth[f] >= self.depth[g] {
                true => (&mut f, &mut rising),
                false => (&mut g, &mut falling),
            };
            // Only the root has no way up, and it is never the deeper of two faces.
            let Some(up) = self.up[*from] else { break };
            ways.push(up);
            *from = c.face(c.twin(up).unwrap_or(up));
        }
        let other = |h: HalfedgeId| c.twin(h).unwrap_or(h);
        let down = falling.iter().rev().map(|&up| other(up));
        let leaves = rising.iter().copied().chain(down).chain([t]);
        let mut enter = h;
        leaves
            .map(|leave| {
                let way = Passage { enter, leave };
                enter = other(leave);
                way
            })
            .collect()
    }
}
