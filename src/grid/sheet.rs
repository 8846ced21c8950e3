//! A surface that lies flat face by face, and straight lines drawn on it.
//!
//! *Enters:* a subdivision whose corners have coordinates, each face in a frame of its own, and the quarter turns between frames. *Leaves:* a finer one in which lines are paths of edges.
//! *Guaranteed:* whatever the rounding, a subdivision with the given surface's topology: a line splits the edges that it meets one after another. *Not guaranteed:* that a path is straight to better than
//! `near` of the edges beside it, where it uses vertices that are there.

mod beside;

use super::complex::{cross, turned};
use super::error::GridError;
use crate::geometry::ids::{EdgeId, EdgeVec, FaceId, HalfedgeId, HalfedgeVec, NONE, VertexId};
use crate::geometry::subdivision::Subdivision;

/// Least part of an edge that is split off.
const LEAST_PART: f64 = 1e-12;

/// The end of a line that is a vertex already is met where its distance is right to this part.
const GOAL: f64 = 1e-3;

/// Steps of a line that bring it no nearer to its end, after which it is given up: it runs to and fro between points that float64 does not tell apart.
const MOST_STALLS: usize = 16;

/// See the module docs.
pub(crate) struct Sheet {
    /// `corner[h].uv`: coordinates of the corner that h leaves, in the frame of its face.
    pub fine: Subdivision,
    /// A vector p of a face is p after so many quarter turns in the face beyond a halfedge.
    pub turns: HalfedgeVec<u8>,
    /// The line that an edge is part of, [`NONE`] elsewhere.
    pub line: EdgeVec<u32>,
    /// A line goes through vertices that lie beside it by less than this part of their distance from its last vertex.
    near: f64,
    /// Whether bearings around vertices that stay are counted from where their first halfedges went before anything was drawn: then these keep their directions.
    has_bearings: bool,
}

/// A place to go to, seen from a corner.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Aim {
    /// The halfedge that leaves the corner.
    pub corner: HalfedgeId,
    /// In the frame of its face.
    pub target: [f64; 2],
}

/// How a line goes on from a corner.
enum Way {
    /// Along the edge of a halfedge that begins or ends at the corner's vertex.
    Along(HalfedgeId),
    /// Into the face.
    Into,
}

fn minus([a, b]: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    [a - c, b - d]
}

fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

impl Sheet {
    /// Without lines.
    pub fn new(fine: Subdivision, turns: HalfedgeVec<u8>, near: f64) -> Self {
        let line = EdgeVec::filled(NONE, fine.connectivity.edge_count());
        Self {
            fine,
            turns,
            line,
            near,
            has_bearings: true,
        }
    }

    /// Forgets all lines. Bearings follow first halfedges from now on.
    pub fn clear(&mut self) {
        self.has_bearings = false;
        self.line = EdgeVec::filled(NONE, self.fine.connectivity.edge_count());
    }

    /// Coordinates of the corner that a halfedge leaves.
    pub fn at(&self, h: HalfedgeId) -> [f64; 2] {
        self.fine.corner[h].uv
    }

    /// From the tail to the head of a halfedge, in the frame of its face.
    pub fn vector(&self, h: HalfedgeId) -> [f64; 2] {
        minus(self.at(self.fine.connectivity.next(h)), self.at(h))
    }

    /// A point of the face of a halfedge in the frame of the face beyond; `None` at the border.
    pub fn beyond(&self, h: HalfedgeId, p: [f64; 2]) -> Option<[f64; 2]> {
        let c = &self.fine.connectivity;
        let t = c.twin(h)?;
        let [x, y] = turned(minus(p, self.at(h)), self.turns[h]);
        let [a, b] = self.at(c.next(t));
        Some([a + x, b + y])
    }

    /// The same aim from the next corner counterclockwise around its vertex.
    fn left(&self, aim: Aim) -> Option<Aim> {
        let c = &self.fine.connectivity;
        let prev = c.prev(aim.corner);
        let target = self.beyond(prev, aim.target)?;
        let corner = c.twin(prev)?;
        Some(Aim { corner, target })
    }

    /// The same aim from the next corner clockwise.
    fn right(&self, aim: Aim) -> Option<Aim> {
        let c = &self.fine.connectivity;
        let target = self.beyond(aim.corner, aim.target)?;
        let corner = c.next(c.twin(aim.corner)?);
        Some(Aim { corner, target })
    }

    /// An aim from all corners of its vertex.
    fn around(&self, aim: Aim) -> Vec<Aim> {
        let mut all = vec![aim];
        let mut last = aim;
        while let Some(next) = self.left(last) {
            if next.corner == aim.corner {
                return all;
            }
            all.push(next);
            last = next;
        }
        last = aim;
        while let Some(next) = self.right(last) {
            all.push(next);
            last = next;
        }
        all
    }

    /// The angle from where the first halfedge of a vertex goes to another that leaves it, counterclockwise, radians.
    pub fn bearing(&self, of: HalfedgeId) -> f64 {
        let c = &self.fine.connectivity;
        let before = c.outgoing(c.tail(of)).take_while(|&h| h != of);
        before.map(|h| self.angle(h)).sum()
    }

    /// The angle of a corner, radians.
    pub fn angle(&self, h: HalfedgeId) -> f64 {
        let prev = self.fine.connectivity.prev(h);
        let (a, b) = (self.vector(h), self.vector(prev).map(|x| -x));
        cross(a, b).atan2(dot(a, b)).max(0.0)
    }

    /// The corner of a vertex in which a bearing lies, and its angle in the frame there, radians.
    pub fn corner_at(&self, v: VertexId, bearing: f64) -> Option<(HalfedgeId, f64)> {
        let c = &self.fine.connectivity;
        let angles = c.outgoing(v).map(|h| (h, self.angle(h)));
        let angles: Vec<(HalfedgeId, f64)> = angles.collect();
        let total: f64 = angles.iter().map(|a| a.1).sum();
        let wanted = match c.is_boundary_vertex(v) {
            true => bearing,
            false => bearing.rem_euclid(total),
        };
        let mut before = 0.0;
        for (i, &(h, angle)) in angles.iter().enumerate() {
            if wanted < before + angle || i + 1 == angles.len() {
                let [x, y] = self.vector(h);
                return Some((h, y.atan2(x) + wanted - before));
            }
            before += angle;
        }
        None
    }

    /// An aim from the corner in which it begins, and the two beside it.
    pub fn near(&self, aim: Aim) -> Vec<Aim> {
        let beside = [self.right(aim), Some(aim), self.left(aim)];
        beside.into_iter().flatten().collect()
    }

    /// Which corner a straight line takes, and how.
    fn way(
        &self,
        aims: &[Aim],
        goal: Option<VertexId>,
        may_move: impl Fn(VertexId) -> bool,
    ) -> Option<(Aim, Way)> {
        let c = &self.fine.connectivity;
        let is_along = |edge: [f64; 2], to: [f64; 2]| {
            dot(edge, to) > 0.0 && cross(edge, to).abs() <= self.near * length(edge) * length(to)
        };
        // The one that ends at the target; or else the longest that ends before it, so that no thin face has all corners on the line.
        let mut best: Option<([f64; 2], Aim, HalfedgeId)> = None;
        let mut touching = best;
        for &aim in aims {
            let to = minus(aim.target, self.at(aim.corner));
            let prev = c.prev(aim.corner);
            let edges = [
                (aim.corner, self.vector(aim.corner)),
                (prev, self.vector(prev).map(|x| -x)),
            ];
            for (h, edge) in edges {
                let part = length(edge) / length(to);
                let end = if h == prev { c.tail(h) } else { c.head(h) };
                let is_end = match goal {
                    Some(goal) => end == goal && (part - 1.0).abs() <= GOAL,
                    None => (part - 1.0).abs() <= self.near,
                };
                let rank = match part {
                    _ if is_end => [2.0, 0.0],
                    p if p < 1.0 => [1.0, p],
                    _ if goal.is_some() => continue,
                    p => [0.0, -p],
                };
                // Lines with goals have nothing in common but their ends: where two leave a vertex side by side, one through a vertex of the other would cut off what lies between them.
                let best = match goal.is_some_and(|goal| end != goal && self.is_on_line(end)) {
                    true => &mut touching,
                    false => &mut best,
                };
                let is_better = best.is_none_or(|(most, ..)| rank > most);
                if is_along(edge, to) && is_better && (is_end || self.fits(aim, h)) {
                    *best = Some((rank, aim, h));
                }
            }
        }
        if let Some((_, aim, h)) = best {
            return Some((aim, Way::Along(h)));
        }
        let into = aims.iter().find(|aim| {
            let to = minus(aim.target, self.at(aim.corner));
            let back = self.vector(c.prev(aim.corner)).map(|x| -x);
            cross(self.vector(aim.corner), to) >= 0.0 && cross(to, back) > 0.0
        });
        let is_open = |aim: &&Aim| self.line[c.edge(c.next(aim.corner))] == NONE;
        let into = into.filter(|aim| touching.is_none() || is_open(aim));
        if let (None, Some((_, aim, h))) = (into, touching) {
            return Some((aim, Way::Along(h)));
        }
        let &aim = into?;
        let way = self
            .beside(aim, goal, may_move)
            .map_or(Way::Into, Way::Along);
        Some((aim, way))
    }

    fn is_on_line(&self, v: VertexId) -> bool {
        let c = &self.fine.connectivity;
        let mut edges = c
            .outgoing(v)
            .flat_map(|h| [h, c.prev(h)])
            .map(|h| c.edge(h));
        edges.any(|e| self.line[e] != NONE)
    }

    /// Draws a straight line to where `aims` say, seen from some corners of one vertex. The vertex where it ends: `goal`, if there is one already. Vertices that `may_move` are moved
    /// onto it where they lie beside it.
    pub fn draw(
        &mut self,
        aims: Vec<Aim>,
        line: u32,
        goal: Option<VertexId>,
        may_move: impl Fn(VertexId) -> bool,
    ) -> Result<VertexId, GridError> {
        let mut aims = aims;
        let lost = |aims: &[Aim], sheet: &Sheet| GridError::Lost {
            line,
            face: aims
                .first()
                .map_or(FaceId::new(0), |a| sheet.fine.connectivity.face(a.corner)),
        };
        let (mut last, mut stalls) = (f64::INFINITY, 0);
        loop {
            let (aim, way) = self
                .way(&aims, goal, &may_move)
                .ok_or_else(|| lost(&aims, self))?;
            let c = &self.fine.connectivity;
            let to = length(minus(aim.target, self.at(aim.corner)));
            // A straight line comes nearer with every step.
            stalls += usize::from(to >= last);
            if stalls > MOST_STALLS {
                return Err(lost(&aims, self));
            }
            last = to;
            let next = match way {
                Way::Along(h) => {
                    let whole = length(self.vector(h));
                    let is_out = h == aim.corner;
                    let e = c.edge(h);
                    if goal.is_none() && to < (1.0 - self.near) * whole {
                        // The edge keeps its id for the part at the tail of its first halfedge.
                        let is_kept = is_out == (c.edge_halfedge(e) == h);
                        let part = if is_out { to / whole } else { 1.0 - to / whole };
                        let v = self.split(h, part);
                        let first = self.fine.connectivity.edge_halfedge(e);
                        let own = if is_kept { e } else { self.rest(first) };
                        self.line[own] = line;
                        return Ok(v);
                    }
                    self.line[e] = line;
                    let end = if is_out { c.next(h) } else { h };
                    let head = c.tail(end);
                    let is_end = match goal {
                        Some(goal) => head == goal && to <= (1.0 + GOAL) * whole,
                        None => to <= (1.0 + self.near) * whole,
                    };
                    if is_end {
                        return Ok(c.tail(end));
                    }
                    // Exactly on the line, so that what follows is straight.
                    self.move_by(end, self.onto(aim, end));
                    Aim {
                        corner: end,
                        target: aim.target,
                    }
                }
                Way::Into => {
                    let opposite = c.next(aim.corner);
                    let [p, a, b] = [aim.corner, opposite, c.next(opposite)].map(|h| self.at(h));
                    let d = minus(aim.target, p);
                    let (right, left) = (cross(minus(a, p), d), cross(d, minus(b, p)));
                    let part = right / (right + left);
                    let across = minus(
                        [a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])],
                        p,
                    );
                    let reach = length(d) / length(across);
                    if goal.is_none() && reach < 1.0 - self.near {
                        let weights = [1.0 - reach, reach * (1.0 - part), reach * part];
                        return Ok(self.put_inside(aim.corner, weights, line));
                    }
                    let e = c.edge(opposite);
                    let is_end = goal.is_none() && reach <= 1.0 + self.near;
                    if self.line[e] != NONE && !is_end {
                        return Err(lost(&aims, self));
                    }
                    let target = self.beyond(opposite, aim.target);
                    let is_first = c.edge_halfedge(e) == opposite;
                    let m = self.split(opposite, part);
                    let (spoke, far) = self.split_sides(e, is_first);
                    self.line[spoke] = line;
                    if is_end {
                        return Ok(m);
                    }
                    let target = target.ok_or_else(|| lost(&aims, self))?;
                    let corner = far.ok_or_else(|| lost(&aims, self))?;
                    Aim { corner, target }
                }
            };
            aims = self.around(next);
        }
    }

    /// Splits the edge of a halfedge, at a part of it from its tail.
    fn split(&mut self, h: HalfedgeId, part: f64) -> VertexId {
        let c = &self.fine.connectivity;
        let e = c.edge(h);
        let part = part.clamp(LEAST_PART, 1.0 - LEAST_PART);
        let part = match c.edge_halfedge(e) == h {
            true => part,
            false => 1.0 - part,
        };
        let sides = [Some(c.edge_halfedge(e)), c.twin(c.edge_halfedge(e))];
        let moved: Vec<[u8; 2]> = sides
            .into_iter()
            .flatten()
            .map(|h| [self.turns[h], self.turns[c.next(h)]])
            .collect();
        let places: Vec<(usize, HalfedgeId)> = sides
            .into_iter()
            .flatten()
            .map(|h| (c.corner(h), c.next(h)))
            .collect();
        let vertex = self.fine.split_edge(e, part);
        for ([own, next], (k, old_next)) in moved.into_iter().zip(places) {
            let mut turns = [0; 3];
            turns[k] = own;
            turns[(k + 1) % 3] = next;
            turns.into_iter().for_each(|t| {
                self.turns.push(t);
            });
            self.turns[old_next] = 0;
        }
        let number = self.line[e];
        while self.line.len() < self.fine.connectivity.edge_count() {
            self.line.push(NONE);
        }
        // The part beyond the new vertex, the first of the new edges.
        let h = self.fine.connectivity.edge_halfedge(e);
        let rest = self.rest(h);
        self.line[rest] = number;
        vertex
    }

    /// The edge that goes on where that of a halfedge was split.
    fn rest(&self, h: HalfedgeId) -> EdgeId {
        // h runs a → m; the face beyond m → apex has m → b.
        let c = &self.fine.connectivity;
        let spoke = c.twin(c.next(h));
        spoke.map_or(c.edge(h), |s| c.edge(c.next(s)))
    }

    /// After a split of an edge: the edge from the new vertex to the apex on the side of its halfedge (or on the other), and a corner of the new vertex on the side across.
    fn split_sides(&self, e: EdgeId, is_first: bool) -> (EdgeId, Option<HalfedgeId>) {
        let c = &self.fine.connectivity;
        // a → m, and beyond the edge m → a.
        let h = c.edge_halfedge(e);
        let spoke = c.edge(c.next(h));
        match (is_first, c.twin(h)) {
            (true, far) => (spoke, far),
            (false, Some(t)) => (c.edge(c.prev(t)), Some(c.next(h))),
            (false, None) => (spoke, None),
        }
    }

    /// Puts a vertex into a face, `weights` counted from a corner on, and draws the line from that corner to it.
    fn put_inside(&mut self, corner: HalfedgeId, weights: [f64; 3], line: u32) -> VertexId {
        let c = &self.fine.connectivity;
        let (f, k, faces) = (c.face(corner), c.corner(corner), c.face_count());
        let mut from_first = [0.0; 3];
        (0..3).for_each(|i| from_first[(k + i) % 3] = weights[i]);
        let [_, bc, ca] = c.face_halfedges(f);
        let outer = [self.turns[bc], self.turns[ca]];
        let v = self.fine.split_face(f, from_first);
        for t in [0, outer[0], 0, 0, 0, outer[1]] {
            self.turns.push(t);
        }
        (self.turns[bc], self.turns[ca]) = (0, 0);
        let c = &self.fine.connectivity;
        while self.line.len() < c.edge_count() {
            self.line.push(NONE);
        }
        // The face keeps corners a and b; the first new one has the vertex, b and c.
        let spoke = match k {
            0 => ca,
            1 => bc,
            _ => HalfedgeId::new(3 * faces + 2),
        };
        self.line[c.edge(spoke)] = line;
        v
    }
}

#[cfg(test)]
mod tests;
