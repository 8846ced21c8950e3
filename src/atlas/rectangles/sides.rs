//! The sides of the patches: their common borders between corners, and the places on them that quads end at.
//!
//! *Enters:* a surface in patches. *Leaves:* a [`Drawing`]: the surface with its patch borders as walls, on which *nodes* (where three
//! or more sectors meet, where a cut ends or meets the surface's border) are marked, and later the *middles* of all sides between
//! them. *Guaranteed:* every patch has at least three sides; both patches of a side have the same nodes and the same middle.
//!
//! A side that two patches share is as long for one as for the other, so what is marked fits on both without negotiation.

use super::RectangleError;
use crate::atlas::patches::edge_bends;
use crate::geometry::ids::{EdgeId, EdgeVec, FaceId, FaceVec, PatchId, VertexId, VertexVec};
use crate::geometry::mesh::Mesh;
use crate::geometry::subdivision::Subdivision;
use crate::geometry::triangle::area;

/// Least sides of a patch: its centre must not lie on a straight line between two middles.
const LEAST_SIDES: usize = 3;
/// Nodes on a border that has none.
const ON_CLOSED: usize = 4;
/// A place this near to a vertex (in lengths of its edge) is moved there.
const SNAP: f64 = 0.1;

/// A side whose faces meet at this angle on the mean is a crease, radians.
const CREASE: f64 = 0.5;

/// Most pieces of a face, on the mean: lines cross about as many faces of an ordinary mesh as lie on a way across it.
const MOST_PIECES: usize = 5;
/// So many more are allowed, whatever the number of faces: lines on a few faces cross all of them.
const ALLOWED_PIECES: usize = 30_000;

/// What a vertex is to the quads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// Nothing.
    Plain,
    /// End of sides: a corner of quads.
    Node,
    /// Middle of a side: a corner of quads.
    Middle,
    /// Centre of a patch: a corner of quads.
    Centre,
}

/// A surface on which walls are drawn.
pub(super) struct Drawing {
    pub fine: Subdivision,
    /// Patch of every face of the surface.
    pub face_patch: FaceVec<PatchId>,
    pub is_wall: EdgeVec<bool>,
    /// Walls that stay where they are: the cut, the surface's border and creases.
    pub is_fixed: EdgeVec<bool>,
    /// θ² L of the edges of every face of the surface (half of each), for an area: θ the dihedral angle, L the length.
    pub bend: FaceVec<f64>,
    pub role: VertexVec<Role>,
}

/// A side, or a closed border: a chain of walls.
#[derive(Clone, Debug)]
pub(super) struct Chain {
    /// One more than edges; the first again at the end of a closed one.
    pub vertices: Vec<VertexId>,
    pub edges: Vec<EdgeId>,
}

impl Drawing {
    /// Draws the borders of the patches and their nodes.
    pub fn new(
        mesh: &Mesh,
        is_cut: &EdgeVec<bool>,
        face_patch: &FaceVec<PatchId>,
    ) -> Result<Self, RectangleError> {
        let c = &mesh.connectivity;
        let patch = |h| face_patch[c.face(h)];
        let border = |e| {
            let h = c.edge_halfedge(e);
            is_cut[e] || c.twin(h).is_none_or(|t| patch(t) != patch(h))
        };
        let mut drawing = Self {
            fine: Subdivision::identity(mesh),
            face_patch: face_patch.clone(),
            is_wall: c.edges().map(border).collect(),
            is_fixed: c
                .edges()
                .map(|e| is_cut[e] || c.is_boundary_edge(e))
                .collect(),
            bend: FaceVec::default(),
            role: VertexVec::filled(Role::Plain, c.vertex_count()),
        };
        let mut valence = VertexVec::filled(0u32, c.vertex_count());
        for e in c.edges().filter(|&e| drawing.is_wall[e]) {
            for v in c.edge_vertices(e) {
                valence[v] += 1;
            }
        }
        for (v, &n) in valence.enumerate() {
            if n != 0 && n != 2 {
                drawing.role[v] = Role::Node;
            }
        }
        drawing.bend = drawing.fix_creases(mesh);
        drawing.open_closed_borders();
        drawing.give_enough_sides()?;
        Ok(drawing)
    }

    /// Marks the middles of all sides.
    pub fn mark_middles(&mut self) {
        for mut side in self.chains() {
            let half = 0.5 * self.length(&side);
            self.mark(&mut side, half, Role::Middle);
        }
    }

    /// Refuses a surface whose faces lines have cut into very many pieces.
    pub fn check_pieces(&self) -> Result<(), RectangleError> {
        RectangleError::check_pieces(
            self.fine.connectivity.face_count(),
            self.face_patch.len(),
            [MOST_PIECES, ALLOWED_PIECES],
        )
    }

    /// Splits an edge at a fraction from the tail of its halfedge; what is a wall stays one.
    pub fn split(&mut self, e: EdgeId, t: f64) -> VertexId {
        let vertex = self.fine.split_edge(e, t);
        // The second half comes first, then what joins the new vertex to the apexes.
        self.is_wall.push(self.is_wall[e]);
        self.is_fixed.push(self.is_fixed[e]);
        while self.is_wall.len() < self.fine.connectivity.edge_count() {
            self.is_wall.push(false);
            self.is_fixed.push(false);
        }
        self.role.push(Role::Plain);
        vertex
    }

    /// Keeps sides along which the surface has a crease, on the whole; what is left of the bend of every face's edges, for an area.
    fn fix_creases(&mut self, mesh: &Mesh) -> FaceVec<f64> {
        let c = &mesh.connectivity;
        let lengths = |f| c.face_edges(f).map(|e| mesh.edge_length(e));
        let areas = c.faces().map(|f| area(lengths(f)).unwrap_or(0.0));
        let areas: FaceVec<f64> = areas.collect();
        let (bend, _) = edge_bends(mesh, &areas, |h| Some(c.face(c.twin(h)?)));
        for side in self.chains() {
            let length = |&e: &EdgeId| mesh.edge_length(e);
            let turned = side.edges.iter().map(|e| (bend[*e][0] * length(e)).sqrt());
            if turned.sum::<f64>() > CREASE * side.edges.iter().map(length).sum::<f64>() {
                for &e in &side.edges {
                    self.is_fixed[e] = true;
                }
            }
        }
        let of_face = |f: FaceId| {
            let free = c.face_edges(f).into_iter().filter(|&e| !self.is_fixed[e]);
            let half: f64 = free.map(|e| 0.5 * bend[e][0]).sum();
            let whole = half / areas[f];
            if whole.is_finite() { whole } else { 0.0 }
        };
        c.faces().map(of_face).collect()
    }

    fn open_closed_borders(&mut self) {
        for mut chain in self.chains() {
            let [first, .., last] = chain.vertices[..] else {
                continue;
            };
            if first != last || self.role[first] == Role::Node {
                continue;
            }
            let length = self.length(&chain);
            self.role[first] = Role::Node;
            for i in 1..ON_CLOSED {
                let at = length * i as f64 / ON_CLOSED as f64;
                self.mark(&mut chain, at, Role::Node);
            }
        }
    }

    /// Halves the longest side of a patch with too few.
    fn give_enough_sides(&mut self) -> Result<(), RectangleError> {
        let patches = self.face_patch.iter().map(|p| p.index() + 1).max();
        let patches = patches.unwrap_or(0);
        for _ in 0..=LEAST_SIDES * patches {
            let chains = self.chains();
            let mut sides = vec![0usize; patches];
            for chain in &chains {
                for p in self.beside(chain) {
                    sides[p.index()] += 1;
                }
            }
            let Some(poor) = sides.iter().position(|&n| n < LEAST_SIDES) else {
                return Ok(());
            };
            let own = chains.into_iter().filter(|chain| {
                let mut beside = self.beside(chain);
                beside.any(|p| p.index() == poor)
            });
            let longest = own.max_by(|a, b| self.length(a).total_cmp(&self.length(b)));
            let Some(mut longest) = longest else {
                break;
            };
            let half = 0.5 * self.length(&longest);
            self.mark(&mut longest, half, Role::Node);
        }
        Err(RectangleError::Inconsistent {
            what: "the sides of a patch",
        })
    }

    /// The patches on both sides of a chain; one twice where it meets itself, and only one on the surface's border.
    fn beside(&self, chain: &Chain) -> impl Iterator<Item = PatchId> + '_ {
        let c = &self.fine.connectivity;
        let halfedge = chain.edges.first().map(|&e| c.edge_halfedge(e));
        let twin = halfedge.and_then(|h| c.twin(h));
        let patch = |h| self.face_patch[self.fine.parent[c.face(h)]];
        halfedge.into_iter().chain(twin).map(patch)
    }

    /// All sides, then closed borders without a node.
    pub fn chains(&self) -> Vec<Chain> {
        let c = &self.fine.connectivity;
        let walls = || c.edges().filter(|&e| self.is_wall[e]);
        let mut first = VertexVec::filled(0u32, c.vertex_count() + 1);
        let mut ends: Vec<(VertexId, EdgeId)> = walls()
            .flat_map(|e| c.edge_vertices(e).map(|v| (v, e)))
            .collect();
        ends.sort_unstable();
        for (v, _) in &ends {
            first[VertexId::new(v.index() + 1)] += 1;
        }
        for v in 0..c.vertex_count() {
            let before = first[VertexId::new(v)];
            first[VertexId::new(v + 1)] += before;
        }
        let at =
            |v: VertexId| &ends[first[v] as usize..first[VertexId::new(v.index() + 1)] as usize];
        let mut used = EdgeVec::filled(false, c.edge_count());
        let mut chains = Vec::new();
        let mut follow = |start: VertexId, edge: EdgeId| {
            if used[edge] {
                return;
            }
            let mut chain = Chain {
                vertices: vec![start],
                edges: Vec::new(),
            };
            let (mut v, mut next) = (start, Some(edge));
            while let Some(e) = next {
                used[e] = true;
                let [a, b] = c.edge_vertices(e);
                v = if a == v { b } else { a };
                chain.vertices.push(v);
                chain.edges.push(e);
                next = match self.role[v] {
                    Role::Node => None,
                    _ => at(v).iter().map(|end| end.1).find(|&e| !used[e]),
                };
            }
            chains.push(chain);
        };
        for v in c.vertices().filter(|&v| self.role[v] == Role::Node) {
            for &(_, e) in at(v) {
                follow(v, e);
            }
        }
        for e in walls() {
            follow(c.edge_vertices(e)[0], e);
        }
        chains
    }

    /// Length in space.
    pub fn length(&self, chain: &Chain) -> f64 {
        chain.edges.iter().map(|&e| self.fine.edge_length(e)).sum()
    }

    /// Gives a role to the place at a distance along a chain; not to its ends.
    pub(super) fn mark(&mut self, chain: &mut Chain, distance: f64, role: Role) {
        let mut before = 0.0;
        let last = chain.edges.len().saturating_sub(1);
        for (i, &e) in chain.edges.iter().enumerate() {
            let length = self.fine.edge_length(e);
            if before + length < distance && i < last {
                before += length;
                continue;
            }
            let t = (distance - before) / length;
            // A vertex may be taken if it is inside the chain and has no role yet.
            let near = match t {
                t if t < SNAP && i > 0 => Some(chain.vertices[i]),
                t if t > 1.0 - SNAP && i < last => Some(chain.vertices[i + 1]),
                _ => None,
            };
            if let Some(v) = near.filter(|&v| self.role[v] == Role::Plain) {
                self.role[v] = role;
                return;
            }
            let t = if t.is_finite() { t } else { 0.5 };
            let t = t.clamp(SNAP, 1.0 - SNAP);
            let forward = self.fine.connectivity.edge_vertices(e)[0] == chain.vertices[i];
            let second = EdgeId::new(self.fine.connectivity.edge_count());
            let v = self.split(e, if forward { t } else { 1.0 - t });
            self.role[v] = role;
            chain.vertices.insert(i + 1, v);
            chain.edges.insert(i + usize::from(forward), second);
            return;
        }
    }
}
