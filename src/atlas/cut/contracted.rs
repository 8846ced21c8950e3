//! Shortest paths, homotopy basis and connections on the surface with every boundary loop contracted to a point.

use crate::flow::cones::Prescription;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeId, EdgeVec, HalfedgeId, NONE, VertexId, VertexVec};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Roots that are tried for the homotopy basis of a surface with handles.
const ROOTS: usize = 8;

/// The surface with every boundary loop taken as one point.
pub(super) struct Contracted<'a> {
    connectivity: &'a Connectivity,
    length: &'a EdgeVec<f64>,
    loops: Vec<Vec<VertexId>>,
    /// Number of the boundary loop of a vertex, `NONE` inside.
    loop_of: VertexVec<u32>,
    is_cone: VertexVec<bool>,
    cones: Vec<VertexId>,
}

/// Distances and the halfedge by which each vertex was reached (pointing at it).
struct Reach {
    distance: VertexVec<f64>,
    by: VertexVec<Option<HalfedgeId>>,
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
            loops,
            loop_of,
            is_cone,
            cones,
        }
    }

    /// Both directions of every edge at `v` that may be cut, as halfedges towards the neighbour.
    fn steps(&self, v: VertexId) -> impl Iterator<Item = (EdgeId, VertexId)> + '_ {
        let c = self.connectivity;
        // Boundary edges are never cut; every interior edge at `v` has an outgoing halfedge.
        c.outgoing(v)
            .filter(move |&h| c.twin(h).is_some())
            .map(move |h| (c.edge(h), c.head(h)))
    }

    /// Shortest paths from `sources`; stops at the first vertex that `is_goal` accepts and returns it.
    /// A boundary loop is entered as a whole, at no cost, unless it is left out by `enter_loops`.
    fn shortest_paths(
        &self,
        sources: &[VertexId],
        enter_loops: bool,
        mut is_goal: impl FnMut(VertexId) -> bool,
    ) -> (Reach, Option<VertexId>) {
        let c = self.connectivity;
        let mut reach = Reach {
            distance: VertexVec::filled(f64::INFINITY, c.vertex_count()),
            by: VertexVec::filled(None, c.vertex_count()),
        };
        // Non-negative floats order as their bits do; equal distances go by vertex.
        let mut queue = BinaryHeap::new();
        for &v in sources {
            reach.distance[v] = 0.0;
            queue.push(Reverse((0u64, v)));
        }
        while let Some(Reverse((bits, v))) = queue.pop() {
            let d = f64::from_bits(bits);
            if d > reach.distance[v] {
                continue;
            }
            if is_goal(v) {
                return (reach, Some(v));
            }
            if enter_loops && self.loop_of[v] != NONE {
                for &w in &self.loops[self.loop_of[v] as usize] {
                    if d < reach.distance[w] {
                        reach.distance[w] = d;
                        reach.by[w] = None;
                        queue.push(Reverse((bits, w)));
                    }
                }
            }
            for h in c.outgoing(v).filter(|&h| c.twin(h).is_some()) {
                let w = c.head(h);
                let candidate = d + self.length[c.edge(h)];
                if candidate < reach.distance[w] {
                    reach.distance[w] = candidate;
                    reach.by[w] = Some(h);
                    queue.push(Reverse((candidate.to_bits(), w)));
                }
            }
        }
        if enter_loops {
            self.keep_one_entry(&mut reach);
        }
        (reach, None)
    }

    /// Two vertices of a loop can be reached at exactly the same distance; as the loop is one point,
    /// a tree may enter it once only.
    fn keep_one_entry(&self, reach: &mut Reach) {
        for vertices in &self.loops {
            let entries = vertices.iter().copied().filter(|&v| reach.by[v].is_some());
            let entries: Vec<VertexId> = entries.collect();
            for &v in entries.iter().skip(1) {
                reach.by[v] = None;
            }
        }
    }

    /// Where a homotopy basis may start: the cones (a cone must be on the cut anyway), or vertices spread over the surface.
    pub(super) fn roots(&self) -> Vec<VertexId> {
        let mut roots: Vec<VertexId> = self.cones.iter().copied().take(ROOTS).collect();
        if roots.is_empty() {
            roots.extend(self.loops.iter().take(ROOTS).map(|l| l[0]));
        }
        // With one forced point the tutorial's basis goes through it; with none every place is as good.
        let wanted = match self.cones.len() + self.loops.len() {
            1 => 1,
            _ => ROOTS,
        };
        if roots.is_empty() {
            roots.push(self.farthest(&[VertexId::new(0)]));
        }
        while roots.len() < wanted {
            let next = self.farthest(&roots);
            if roots.contains(&next) {
                break;
            }
            roots.push(next);
        }
        roots
    }

    fn farthest(&self, from: &[VertexId]) -> VertexId {
        let (reach, _) = self.shortest_paths(from, true, |_| false);
        let mut best = (from[0], -1.0);
        for (v, &d) in reach.distance.enumerate() {
            if d > best.1 {
                best = (v, d);
            }
        }
        best.0
    }

    /// 2g loops from the root whose complement is one disk (with holes where boundary loops are).
    pub(super) fn homotopy_basis(&self, root: VertexId) -> EdgeVec<bool> {
        let c = self.connectivity;
        let (reach, _) = self.shortest_paths(&[root], true, |_| false);
        let mut in_tree = EdgeVec::filled(false, c.edge_count());
        for h in reach.by.iter().flatten() {
            in_tree[c.edge(*h)] = true;
        }
        // Cotree: the longest closing loops go into the dual tree, so the shortest ones remain.
        let mut duals: Vec<(f64, EdgeId)> = c
            .edges()
            .filter(|&e| !in_tree[e] && !c.is_boundary_edge(e))
            .map(|e| {
                let [a, b] = c.edge_vertices(e);
                (reach.distance[a] + reach.distance[b] + self.length[e], e)
            })
            .collect();
        duals.sort_by(|x, y| y.0.total_cmp(&x.0).then(x.1.cmp(&y.1)));
        let mut joined = UnionFind::new(c.face_count());
        let mut is_cut = EdgeVec::filled(false, c.edge_count());
        for (_, e) in duals {
            let h = c.edge_halfedge(e);
            let t = c.twin(h).expect("boundary edges were left out");
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

    /// Marks the path by which `v` was reached; inside a contracted loop it moves at no cost.
    fn mark_path(&self, reach: &Reach, v: VertexId, is_cut: &mut EdgeVec<bool>) {
        let c = self.connectivity;
        let mut at = v;
        loop {
            match reach.by[at] {
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
                        .and_then(|l| l.iter().copied().find(|&w| reach.by[w].is_some()));
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
        let mut sources = Vec::new();
        let mut attach = |v: VertexId, sources: &mut Vec<VertexId>| -> bool {
            if attached[v] {
                return false;
            }
            let whole_loop = self.loop_of[v] != NONE;
            let group: &[VertexId] = if whole_loop {
                &self.loops[self.loop_of[v] as usize]
            } else {
                std::slice::from_ref(&v)
            };
            for &w in group {
                attached[w] = true;
                sources.push(w);
            }
            true
        };
        for e in c.edges().filter(|&e| is_cut[e]) {
            for v in c.edge_vertices(e) {
                attach(v, &mut sources);
            }
        }
        let terminals: Vec<VertexId> = self
            .cones
            .iter()
            .copied()
            .chain(self.loops.iter().map(|l| l[0]))
            .collect();
        if sources.is_empty() {
            match root.or(terminals.first().copied()) {
                Some(v) => attach(v, &mut sources),
                None => return,
            };
        }
        let is_terminal = |v: VertexId| self.is_cone[v] || self.loop_of[v] != NONE;
        loop {
            let mut is_source = VertexVec::filled(false, c.vertex_count());
            sources.iter().for_each(|&v| is_source[v] = true);
            let (reach, found) =
                self.shortest_paths(&sources, false, |v| is_terminal(v) && !is_source[v]);
            let Some(end) = found else { break };
            attach(end, &mut sources);
            let mut at = end;
            while let Some(h) = reach.by[at] {
                is_cut[c.edge(h)] = true;
                at = c.tail(h);
                attach(at, &mut sources);
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
            let Some((e, w)) = self.steps(v).find(|&(e, _)| is_cut[e]) else {
                continue;
            };
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

/// Disjoint sets with path halving.
struct UnionFind {
    parent: Vec<u32>,
}

impl UnionFind {
    fn new(count: usize) -> Self {
        Self {
            parent: (0..count as u32).collect(),
        }
    }

    fn find(&mut self, mut a: usize) -> usize {
        while self.parent[a] as usize != a {
            self.parent[a] = self.parent[self.parent[a] as usize];
            a = self.parent[a] as usize;
        }
        a
    }

    /// True where the two were apart before.
    fn join(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b)] = a.min(b) as u32;
        a != b
    }
}
