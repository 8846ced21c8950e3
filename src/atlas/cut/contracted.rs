//! Shortest paths, homotopy basis and connections on the surface with every boundary loop contracted to a point.

use super::paths::{Search, Ways};
use crate::flow::prescription::Prescription;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::disjoint_sets::UnionFind;
use crate::geometry::ids::{EdgeId, EdgeVec, FaceId, NONE, VertexId, VertexVec};

/// Most roots that are tried for the homotopy basis of a surface with handles …
const MOST_ROOTS: usize = 8;
/// … and least, where every one of them takes long.
const LEAST_ROOTS: usize = 3;
/// Vertices that the searches from all roots may visit together.
const VISITS: usize = 200_000;

/// The surface with every boundary loop taken as one point.
pub(super) struct Contracted<'a> {
    connectivity: &'a Connectivity,
    length: &'a EdgeVec<f64>,
    ways: Ways,
    loops: Vec<Vec<VertexId>>,
    /// Number of the boundary loop of a vertex, `NONE` inside.
    loop_of: VertexVec<u32>,
    is_cone: VertexVec<bool>,
    cones: Vec<VertexId>,
}

impl<'a> Contracted<'a> {
    pub(super) fn new(
        connectivity: &'a Connectivity,
        length: &'a EdgeVec<f64>,
        prescription: &Prescription,
    ) -> Self {
        let mut loop_of = VertexVec::filled(NONE, connectivity.vertex_count());
        let mut loops = Vec::new();
        for (i, chain) in connectivity.boundary_loops().into_iter().enumerate() {
            let vertices: Vec<_> = chain.into_iter().map(|h| connectivity.tail(h)).collect();
            for &v in &vertices {
                loop_of[v] = i as u32;
            }
            loops.push(vertices);
        }
        let mut is_cone = VertexVec::filled(false, connectivity.vertex_count());
        let mut cones = Vec::new();
        for cone in &prescription.cones {
            // A cone on the boundary lies on the disk's border already.
            if loop_of[cone.vertex] == NONE {
                is_cone[cone.vertex] = true;
                cones.push(cone.vertex);
            }
        }
        Self {
            connectivity,
            length,
            ways: Ways::new(connectivity, length),
            loops,
            loop_of,
            is_cone,
            cones,
        }
    }

    /// Goes on with a search until all is reached. A boundary loop is entered as a whole, at no cost.
    fn run(&self, search: &mut Search) {
        while let Some(v) = search.settle() {
            if self.loop_of[v] != NONE {
                let d = search.distance(v);
                for &w in &self.loops[self.loop_of[v] as usize] {
                    search.enter(w, d);
                }
            }
        }
    }

    /// The tree of shortest paths from a root.
    fn tree(&self, root: VertexId) -> Search<'_> {
        let mut search = self.ways.search();
        search.enter(root, 0.0);
        self.run(&mut search);
        // Two vertices of a loop can be reached at exactly the same distance; as the loop is one point,
        // a tree may enter it once only.
        for vertices in &self.loops {
            let entries = vertices.iter().filter(|&&v| search.by(v).is_some());
            let late: Vec<VertexId> = entries.skip(1).copied().collect();
            late.into_iter().for_each(|v| search.forget_way(v));
        }
        search
    }

    /// Where a homotopy basis may start: the cones (a cone must be on the cut anyway), or vertices spread over the surface.
    pub(super) fn roots(&self) -> Vec<VertexId> {
        // With one forced point the tutorial's basis goes through it; with none every place is as good.
        let wanted = match self.cones.len() + self.loops.len() {
            1 => 1,
            _ => (VISITS / self.connectivity.vertex_count().max(1)).clamp(LEAST_ROOTS, MOST_ROOTS),
        };
        let mut roots: Vec<VertexId> = self.cones.iter().copied().take(wanted).collect();
        if roots.is_empty() {
            roots.extend(self.loops.iter().take(wanted).map(|l| l[0]));
        }
        if roots.is_empty() {
            let mut search = self.ways.search();
            search.enter(VertexId::new(0), 0.0);
            roots.push(self.farthest(&mut search));
        }
        let mut search = self.ways.search();
        roots.iter().for_each(|&v| search.enter(v, 0.0));
        while roots.len() < wanted {
            let next = self.farthest(&mut search);
            if search.distance(next) == 0.0 {
                break;
            }
            search.enter(next, 0.0);
            roots.push(next);
        }
        roots
    }

    /// The vertex farthest from a search's sources of those it reaches, the first of equals.
    fn farthest(&self, search: &mut Search) -> VertexId {
        self.run(search);
        let mut best = (VertexId::new(0), -1.0);
        for v in self.connectivity.vertices() {
            let distance = search.distance(v);
            if distance > best.1 && distance.is_finite() {
                best = (v, distance);
            }
        }
        best.0
    }

    /// 2g loops from the root whose complement is one disk (with holes where boundary loops are).
    pub(super) fn homotopy_basis(&self, root: VertexId) -> EdgeVec<bool> {
        let c = self.connectivity;
        let reach = self.tree(root);
        // Cotree: the longest closing loops go into the dual tree, so the shortest ones remain.
        let mut duals: Vec<(f64, EdgeId)> = self
            .core(&reach)
            .into_iter()
            .map(|e| {
                let [a, b] = c.edge_vertices(e).map(|v| reach.distance(v));
                (a + b + self.length[e], e)
            })
            .collect();
        duals.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
        let mut joined = UnionFind::new(c.face_count());
        let mut is_cut = EdgeVec::filled(false, c.edge_count());
        for (_, e) in duals {
            let h = c.edge_halfedge(e);
            let Some(t) = c.twin(h) else { continue };
            if joined.join(c.face(h).index(), c.face(t).index()) {
                continue;
            }
            is_cut[e] = true;
            for end in c.edge_vertices(e) {
                self.mark_path(&reach, end, &mut is_cut);
            }
        }
        is_cut
    }

    /// The edges outside a tree of paths that lie on a closed walk across such edges, ascending.
    ///
    /// Any spanning tree of the dual graph holds all the others, whatever they weigh: they hang like the twigs of a tree
    /// and are stripped from their ends. What is left is a few curves on the surface, so little remains to be sorted.
    fn core(&self, reach: &Search) -> Vec<EdgeId> {
        let c = self.connectivity;
        // Edges that are not crossed: of the tree, of the boundary, and those stripped.
        let mut gone: EdgeVec<bool> = c.edges().map(|e| c.is_boundary_edge(e)).collect();
        for h in c.vertices().filter_map(|v| reach.by(v)) {
            gone[c.edge(h)] = true;
        }
        let open = |f: FaceId, gone: &EdgeVec<bool>| {
            c.face_halfedges(f)
                .into_iter()
                .filter(|&h| !gone[c.edge(h)])
                .count()
        };
        for f in c.faces() {
            let mut at = f;
            // From the end of a twig to where it meets another one that is not stripped yet.
            while open(at, &gone) == 1 {
                let side = c.face_halfedges(at).into_iter().find(|&h| !gone[c.edge(h)]);
                let Some(h) = side else { break };
                gone[c.edge(h)] = true;
                let Some(t) = c.twin(h) else { break };
                at = c.face(t);
            }
        }
        c.edges().filter(|&e| !gone[e]).collect()
    }

    /// Marks the path by which `v` was reached; inside a contracted loop it moves at no cost.
    fn mark_path(&self, reach: &Search, v: VertexId, is_cut: &mut EdgeVec<bool>) {
        let c = self.connectivity;
        let mut at = v;
        loop {
            match reach.by(at) {
                Some(h) => {
                    if std::mem::replace(&mut is_cut[c.edge(h)], true) {
                        break;
                    }
                    at = c.tail(h);
                }
                None => {
                    // The root, or a loop vertex reached through another one of its loop.
                    let entered = (self.loop_of[at] != NONE)
                        .then(|| &self.loops[self.loop_of[at] as usize])
                        .and_then(|l| l.iter().copied().find(|&w| reach.by(w).is_some()));
                    match entered {
                        Some(w) => at = w,
                        None => break,
                    }
                }
            }
        }
    }

    /// Joins every cone and boundary loop to the graph by the shortest path to it.
    /// `root` is where a graph that is still empty starts (it may have been pruned away from there).
    pub(super) fn join_terminals(&self, is_cut: &mut EdgeVec<bool>, root: Option<VertexId>) {
        let c = self.connectivity;
        let mut attached = VertexVec::filled(false, c.vertex_count());
        // The search goes on from what it knows when the graph has grown: each path found is one of new sources.
        let mut search = self.ways.search();
        let attach = |v: VertexId, attached: &mut VertexVec<bool>, search: &mut Search| {
            let whole_loop = self.loop_of[v] != NONE;
            let group: &[VertexId] = if whole_loop {
                &self.loops[self.loop_of[v] as usize]
            } else {
                std::slice::from_ref(&v)
            };
            for &w in group {
                if !std::mem::replace(&mut attached[w], true) {
                    search.enter(w, 0.0);
                }
            }
        };
        let mut is_empty = true;
        for e in c.edges().filter(|&e| is_cut[e]) {
            is_empty = false;
            for v in c.edge_vertices(e) {
                attach(v, &mut attached, &mut search);
            }
        }
        if is_empty {
            let first = self.cones.first().copied();
            let first = first.or(self.loops.first().map(|l| l[0]));
            match root.or(first) {
                Some(v) => attach(v, &mut attached, &mut search),
                None => return,
            };
        }
        while let Some(end) = search.settle() {
            if attached[end] || !(self.is_cone[end] || self.loop_of[end] != NONE) {
                continue;
            }
            let mut way = search.by(end);
            attach(end, &mut attached, &mut search);
            while let Some(h) = way {
                is_cut[c.edge(h)] = true;
                let tail = c.tail(h);
                if attached[tail] {
                    break;
                }
                way = search.by(tail);
                attach(tail, &mut attached, &mut search);
            }
        }
    }

    /// Removes chains that end neither at a cone nor on the boundary.
    pub(super) fn prune(&self, is_cut: &mut EdgeVec<bool>) {
        let c = self.connectivity;
        let mut valence = VertexVec::filled(0usize, c.vertex_count());
        for e in c.edges().filter(|&e| is_cut[e]) {
            for v in c.edge_vertices(e) {
                valence[v] += 1;
            }
        }
        let dangles = |v: VertexId, n: usize| n == 1 && !self.is_cone[v] && self.loop_of[v] == NONE;
        let mut ends: Vec<VertexId> = c.vertices().filter(|&v| dangles(v, valence[v])).collect();
        while let Some(v) = ends.pop() {
            if !dangles(v, valence[v]) {
                continue;
            }
            let Some(h) = c.outgoing(v).find(|&h| is_cut[c.edge(h)]) else {
                continue;
            };
            let (e, w) = (c.edge(h), c.head(h));
            is_cut[e] = false;
            valence[v] -= 1;
            valence[w] -= 1;
            ends.push(w);
        }
    }

    pub(super) fn total_length(&self, is_cut: &EdgeVec<bool>) -> f64 {
        is_cut
            .enumerate()
            .filter(|&(_, &cut)| cut)
            .map(|(e, _)| self.length[e])
            .sum()
    }
}
