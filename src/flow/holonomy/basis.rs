//! Loops that generate the homology of a closed surface, or of a double as far as symmetric metrics are concerned.
//!
//! *Enters:* connectivity. *Leaves:* [`DualLoops`]. *Guaranteed:* 2g simple loops that generate H₁ of a closed surface; on the double of a surface, of every piece of genus g with b
//! boundary loops, 2g in the front half and b − 1 that go from one boundary to another and back on the other side. The same for the same ids. *Not guaranteed:*
//! the shortest ones.
//!
//! In a symmetric metric the turnings of all loops of the double follow from those and from the angles at vertices: mirror images turn alike, and a loop beside a
//! boundary turns by what its corners leave.
//!
//! Tree and cotree (Eppstein 2003; Erickson, Whittlesey 2005 for the choice): a tree of fewest faces from face 0, then a spanning tree of the
//! vertices among the edges that the first tree does not cross, of those edges first that would close the longest loops. What is in neither tree closes one
//! loop each, and the part of the way to the root that both ends share is left out. Short loops keep the rows of the
//! Jacobian short.

use super::{DualLoops, HolonomyError, Passage};
use crate::flow::mirror::Reflection;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::disjoint_sets::UnionFind;
use crate::geometry::ids::{EdgeId, EdgeVec, FaceId, FaceVec, HalfedgeId};

/// Shortest ways from face to face, all of a piece ending at one, its root.
struct FaceTree {
    /// The halfedge of a face through which its way to the root leaves; `None` at a root.
    up: FaceVec<Option<HalfedgeId>>,
    /// The root of the piece of every face that was reached.
    root: FaceVec<Option<FaceId>>,
    /// Number of edges crossed on the way.
    depth: FaceVec<u32>,
    /// True for edges that some way crosses.
    is_crossed: EdgeVec<bool>,
    /// Number of faces reached.
    reached: usize,
}

/// See the module docs. The surface must be closed and connected.
pub fn homology_basis(connectivity: &Connectivity) -> Result<DualLoops, HolonomyError> {
    let c = connectivity;
    if !c.is_closed() {
        let boundary_loops = c.boundary_loops().len();
        return Err(HolonomyError::NotClosed { boundary_loops });
    }
    let mut tree = FaceTree::new(c);
    tree.grow(c, FaceId::new(0));
    tree.check(c)?;
    DualLoops::new(c, &tree.handles(c))
}

/// The loops of a double of which `half` is the front half, in one piece or several: its halfedges are the first ones of `double`.
pub fn mirrored_basis(
    half: &Connectivity,
    double: &Connectivity,
    reflection: &Reflection,
) -> Result<DualLoops, HolonomyError> {
    let boundaries = half.boundary_loops();
    if boundaries.is_empty() {
        return homology_basis(double);
    }
    // Ways end at a face beside the first boundary of the piece.
    let mut end = FaceVec::filled(None, half.face_count());
    let mut tree = FaceTree::new(half);
    let mut others = Vec::new();
    for boundary in &boundaries {
        let face = half.face(boundary[0]);
        if tree.root[face].is_some() {
            others.push(boundary);
        } else {
            tree.grow(half, face);
            end[face] = Some(boundary[0]);
        }
    }
    tree.check(half)?;
    let mut loops = tree.handles(half);
    for boundary in others {
        let nearest = boundary.iter().min_by_key(|&&h| tree.depth[half.face(h)]);
        let Some(&start) = nearest else { continue };
        let Some(end) = tree.root[half.face(start)].and_then(|root| end[root]) else {
            continue;
        };
        let mut enter = start;
        let mut there = Vec::new();
        loop {
            let up = tree.up[half.face(enter)];
            let leave = up.unwrap_or(end);
            there.push(Passage { enter, leave });
            let Some(across) = up.and_then(|h| half.twin(h)) else {
                break;
            };
            enter = across;
        }
        let image = |h: HalfedgeId| reflection.halfedge[h];
        let back = there.iter().rev().map(|way| Passage {
            enter: image(way.leave),
            leave: image(way.enter),
        });
        loops.push(there.iter().copied().chain(back).collect());
    }
    DualLoops::new(double, &loops)
}

/// Both halfedges of an edge that is not on the boundary.
fn sides(c: &Connectivity, e: EdgeId) -> [HalfedgeId; 2] {
    let h = c.edge_halfedge(e);
    [h, c.twin(h).unwrap_or(h)]
}

impl FaceTree {
    fn new(c: &Connectivity) -> Self {
        let faces = c.face_count();
        Self {
            up: FaceVec::filled(None, faces),
            root: FaceVec::filled(None, faces),
            depth: FaceVec::filled(0, faces),
            is_crossed: EdgeVec::filled(false, c.edge_count()),
            reached: 0,
        }
    }

    /// Ways from all faces of a piece to `root`.
    fn grow(&mut self, c: &Connectivity, root: FaceId) {
        let mut reached = vec![root; c.face_count().min(1)];
        let mut next = 0;
        reached.iter().for_each(|&f| self.root[f] = Some(root));
        while let Some(&f) = reached.get(next) {
            next += 1;
            for h in c.face_halfedges(f) {
                let Some(t) = c.twin(h) else { continue };
                let g = c.face(t);
                if self.root[g].is_none() {
                    self.root[g] = Some(root);
                    self.up[g] = Some(t);
                    self.depth[g] = self.depth[f] + 1;
                    self.is_crossed[c.edge(h)] = true;
                    reached.push(g);
                }
            }
        }
        self.reached += reached.len();
    }

    /// Refuses faces that no way leads to.
    fn check(&self, c: &Connectivity) -> Result<(), HolonomyError> {
        match self.reached == c.face_count() {
            true => Ok(()),
            false => Err(HolonomyError::NotConnected {
                reached: self.reached,
                faces: c.face_count(),
            }),
        }
    }

    /// The loops around handles: those that edges close which are neither crossed by the tree nor in a tree of vertices, where every boundary counts as one vertex.
    fn handles(&self, c: &Connectivity) -> Vec<Vec<Passage>> {
        let mut joined = UnionFind::new(c.vertex_count());
        let mut by_length: Vec<Vec<EdgeId>> = Vec::new();
        for e in c.edges() {
            if c.is_boundary_edge(e) {
                let [a, b] = c.edge_vertices(e);
                joined.join(a.index(), b.index());
                continue;
            }
            if self.is_crossed[e] {
                continue;
            }
            let length = sides(c, e).map(|h| self.depth[c.face(h)] as usize);
            let length = length[0] + length[1];
            if by_length.len() <= length {
                by_length.resize(length + 1, Vec::new());
            }
            by_length[length].push(e);
        }
        let mut closing = Vec::new();
        for &e in by_length.iter().rev().flatten() {
            let [a, b] = c.edge_vertices(e);
            if !joined.join(a.index(), b.index()) {
                closing.push(e);
            }
        }
        closing.sort_unstable();
        closing.iter().map(|&e| self.close(c, e)).collect()
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
