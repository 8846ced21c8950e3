//! Changes of connectivity: flips and splits. Each keeps every invariant of the structure and the id of
//! everything that survives.

use super::{Arrays, Connectivity};
use crate::geometry::ids::{EdgeId, FaceId, HalfedgeId, NONE, VertexId};
use std::sync::Arc;

impl Connectivity {
    /// Its arrays for itself alone.
    fn own(&mut self) -> &mut Arrays {
        Arc::make_mut(&mut self.arrays)
    }

    /// Replaces edge `ab` between faces `abc` and `bad` by `dc`; `None`, and nothing done, on the
    /// boundary and where both sides are the same face.
    ///
    /// ```text
    ///        c                   c
    ///      / f \               / | \
    ///     a --- b     →       a f | g b
    ///      \ g /               \ | /
    ///        d                   d
    /// ```
    /// The edge keeps its id; its halfedge in `f` now runs from `d` to `c`.
    pub fn flip(&mut self, e: EdgeId) -> Option<Flip> {
        let h = self.edge_halfedge(e);
        let t = self.twin(h)?;
        if self.face(h) == self.face(t) {
            return None;
        }
        let (hn, hp, tn, tp) = (self.next(h), self.prev(h), self.next(t), self.prev(t));
        let (a, b, c, d) = (self.tail(h), self.tail(t), self.tail(hp), self.tail(tp));
        // Where each outer side goes: c→a and a→d around f, d→b and b→c around g.
        let moves = [(hp, hn), (tn, hp), (tp, tn), (hn, tp)];
        let moved = |x: HalfedgeId| moves.iter().find(|m| m.0 == x).map_or(x, |m| m.1);
        let firsts = [a, b, c, d].map(|v| (v, self.arrays.vertex_halfedge[v]));
        let sides = moves.map(|(from, to)| {
            let twin = self.twin(from).map(moved);
            (to, self.tail(from), twin, self.edge(from))
        });
        let own = self.own();
        for (to, tail, twin, edge) in sides {
            own.tail[to] = tail;
            own.edge[to] = edge;
            own.twin[to] = twin.map_or(NONE, HalfedgeId::raw);
            if let Some(twin) = twin {
                own.twin[twin] = to.raw();
            }
        }
        for (from, _) in moves {
            let to = moved(from);
            let edge = own.edge[to];
            let representative = own.edge_halfedge[edge];
            if own.twin[to] == NONE
                || (representative != to && own.twin[to] != representative.raw())
            {
                own.edge_halfedge[edge] = to;
            }
        }
        own.tail[h] = d;
        own.tail[t] = c;
        for (v, first) in firsts {
            own.vertex_halfedge[v] = if first == h {
                moved(tn)
            } else if first == t {
                moved(hn)
            } else {
                moved(first)
            };
        }
        Some(Flip { h, t, moves })
    }

    /// Puts a new vertex on an edge and joins it to the apex on each side. Returns the vertex
    /// and, for each side, the halves of its face.
    ///
    /// With halfedge `ab` of the edge and apex `c`, face `abc` keeps `a m c` (corner of `b` becomes `m`)
    /// and the new face is `m b c` with its corners in the same order (corner of `a` becomes `m`).
    /// The edge keeps its id for `am`.
    pub fn split_edge(&mut self, e: EdgeId) -> EdgeSplit {
        let h = self.edge_halfedge(e);
        let t = self.twin(h);
        let m = self.own().vertex_halfedge.push(h);
        let (e_mb, near) = (self.own().edge_halfedge.push(h), self.halve(h, m));
        let far = t.map(|t| self.halve(t, m));
        // near.new_along runs m → b. On the far side t was b → a: it keeps b → m, far.new_along runs m → a.
        match (t, &far) {
            (Some(t), Some(far)) => {
                self.pair(h, far.new_along);
                self.pair(near.new_along, t);
                self.own().edge[far.new_along] = e;
                self.own().edge[t] = e_mb;
            }
            _ => {
                self.own().twin[h] = NONE;
                self.own().twin[near.new_along] = NONE;
            }
        }
        self.own().edge[h] = e;
        self.own().edge[near.new_along] = e_mb;
        self.own().edge_halfedge[e] = h;
        self.own().edge_halfedge[e_mb] = near.new_along;
        // A boundary vertex m starts at the boundary halfedge m → b.
        self.own().vertex_halfedge[m] = near.new_along;
        EdgeSplit {
            vertex: m,
            sides: std::iter::once(near).chain(far).collect(),
        }
    }

    /// Halves the face left of `h` = a→b by an edge from `m` to the apex; the halves of `h` itself
    /// are left unpaired.
    fn halve(&mut self, h: HalfedgeId, m: VertexId) -> HalvedFace {
        let (hn, hp, k) = (self.next(h), self.prev(h), self.corner(h));
        let (b, c) = (self.tail(hn), self.tail(hp));
        let new_face = FaceId::new(self.face_count());
        let (outer_twin, outer_edge) = (self.twin(hn), self.edge(hn));
        let own = self.own();
        for corner in 0..3 {
            let v = [m, b, c][(corner + 3 - k) % 3];
            own.tail.push(v);
            own.twin.push(NONE);
            own.edge.push(outer_edge);
        }
        let at = |offset: usize| HalfedgeId::new(3 * new_face.index() + (k + offset) % 3);
        let (mb, bc, cm) = (at(0), at(1), at(2));
        // b → c moves to the new face.
        match outer_twin {
            Some(twin) => self.pair(bc, twin),
            None => self.own().edge_halfedge[outer_edge] = bc,
        }
        if self.arrays.edge_halfedge[outer_edge] == hn {
            self.own().edge_halfedge[outer_edge] = bc;
        }
        if self.arrays.vertex_halfedge[b] == hn {
            self.own().vertex_halfedge[b] = bc;
        }
        // m → c in the old face, c → m in the new one.
        self.own().tail[hn] = m;
        self.pair(hn, cm);
        let spoke = self.own().edge_halfedge.push(hn);
        self.own().edge[hn] = spoke;
        self.own().edge[cm] = spoke;
        HalvedFace {
            old: self.face(h),
            new: new_face,
            corner: k,
            new_along: mb,
        }
    }

    fn pair(&mut self, a: HalfedgeId, b: HalfedgeId) {
        let own = self.own();
        own.twin[a] = b.raw();
        own.twin[b] = a.raw();
    }

    /// Puts a new vertex `m` inside face `abc`: it keeps `a b m`; `m b c` and `a m c` are new, each
    /// corner in the place of the corner it replaces.
    pub fn split_face(&mut self, f: FaceId) -> FaceSplit {
        let [ab, bc, ca] = self.face_halfedges(f);
        let [a, b, c] = self.face_vertices(f);
        let m = self.own().vertex_halfedge.push(ca);
        let first = self.face_count();
        let outer = [
            (bc, self.twin(bc), self.edge(bc)),
            (ca, self.twin(ca), self.edge(ca)),
        ];
        let (edge, own) = (self.edge(ab), self.own());
        for v in [m, b, c, a, m, c] {
            own.tail.push(v);
            own.twin.push(NONE);
            own.edge.push(edge);
        }
        let at = |face: usize, corner: usize| HalfedgeId::new(3 * (first + face) + corner);
        for ((old, twin, edge), new) in outer.into_iter().zip([at(0, 1), at(1, 2)]) {
            self.own().edge[new] = edge;
            // The face may be glued to itself along these two sides.
            let twin = twin.map(|t| {
                if t == bc {
                    at(0, 1)
                } else if t == ca {
                    at(1, 2)
                } else {
                    t
                }
            });
            if let Some(twin) = twin {
                self.pair(new, twin);
            }
            if self.arrays.edge_halfedge[edge] == old {
                self.own().edge_halfedge[edge] = new;
            }
            let tail = self.arrays.tail[new];
            if self.arrays.vertex_halfedge[tail] == old {
                self.own().vertex_halfedge[tail] = new;
            }
        }
        self.own().tail[ca] = m;
        // Spokes: b m between the old face and the first new one, c m, a m.
        for (x, y) in [(bc, at(0, 0)), (at(0, 2), at(1, 1)), (ca, at(1, 0))] {
            self.pair(x, y);
            let spoke = self.own().edge_halfedge.push(x);
            self.own().edge[x] = spoke;
            self.own().edge[y] = spoke;
        }
        FaceSplit {
            vertex: m,
            faces: [f, FaceId::new(first), FaceId::new(first + 1)],
        }
    }
}

/// What [`Connectivity::split_edge`] did.
#[derive(Clone, Debug)]
pub struct EdgeSplit {
    /// The new vertex.
    pub vertex: VertexId,
    /// One or two halved faces; the first is left of the edge's halfedge.
    pub sides: Vec<HalvedFace>,
}

/// A face that became two.
#[derive(Clone, Copy, Debug)]
pub struct HalvedFace {
    /// The face that keeps its id: its corner `corner + 1` is now the new vertex.
    pub old: FaceId,
    /// The new face: its corner `corner` is the new vertex, the others are those of the old face before.
    pub new: FaceId,
    /// The corner that the split halfedge left.
    pub corner: usize,
    /// The part of the split halfedge in the new face.
    pub new_along: HalfedgeId,
}

/// What [`Connectivity::split_face`] did.
#[derive(Clone, Copy, Debug)]
pub struct FaceSplit {
    /// The new vertex.
    pub vertex: VertexId,
    /// The three faces; in face `i` the new vertex stands at corner `(i + 2) % 3`, the others as before.
    pub faces: [FaceId; 3],
}

/// What [`Connectivity::flip`] did to the numbering of halfedges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flip {
    /// Halfedge of the edge in `f`: `a → b` before, `d → c` after.
    pub h: HalfedgeId,
    /// Its twin in `g`: `b → a` before, `c → d` after.
    pub t: HalfedgeId,
    /// Old and new id of the outer halfedges `c → a`, `a → d`, `d → b`, `b → c`, in this order. What is kept a
    /// halfedge moves along; all four are read before any is written, since the ids are permuted.
    pub moves: [(HalfedgeId, HalfedgeId); 4],
}
