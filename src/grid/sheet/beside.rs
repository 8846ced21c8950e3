//! Vertices beside a line moved onto it, which saves thin faces.
//!
//! *Enters:* a line that runs from a corner, and what lies around. *Leaves:* whether a vertex may be moved onto it, and the move. *Guaranteed:* no face is turned over, and none becomes thin that was not.

use super::super::complex::{cross, turned};
use super::super::triangle::{THICK, double_area, thickness};
use super::{Aim, GOAL, Sheet, dot, length, minus};
use crate::geometry::ids::{HalfedgeId, NONE, VertexId};

/// Vertices inside that lie beside a line by less than this part of their distance from its last vertex are moved onto it, where that does no harm.
const BESIDE: f64 = 0.05;

/// The same for those farther aside, where the line crosses the edge opposite by less than this part of it from them.
const NARROW: f64 = 1e-3;

/// Vertices that are off a line by less than this part of their distance from its last vertex are on it, to rounding.
const EXACT: f64 = 1e-14;

/// Part of its thickness that a thin face keeps at least where a corner is moved.
const KEPT: f64 = 0.1;

impl Sheet {
    /// Whether the other end of an edge of a corner may be moved onto the line from there: its star may be smaller than the way.
    pub(super) fn fits(&self, aim: Aim, h: HalfedgeId) -> bool {
        let c = &self.fine.connectivity;
        let end = if h == aim.corner { c.next(h) } else { h };
        let by = self.onto(aim, end);
        length(by) <= EXACT * length(minus(self.at(end), self.at(aim.corner)))
            || self.moves_without_harm(end, by)
    }

    /// From the vertex of a corner of a face to the nearest place on a line that begins in that face.
    pub(super) fn onto(&self, aim: Aim, end: HalfedgeId) -> [f64; 2] {
        let p = self.at(aim.corner);
        let (d, edge) = (minus(aim.target, p), minus(self.at(end), p));
        let along = dot(edge, d) / dot(d, d);
        minus([along * d[0], along * d[1]], edge)
    }

    /// Of the edges of a corner, one whose other end may be moved onto a line that runs into the face beside it, which saves a thin face.
    pub(super) fn beside(
        &self,
        aim: Aim,
        goal: Option<VertexId>,
        may_move: impl Fn(VertexId) -> bool,
    ) -> Option<HalfedgeId> {
        let c = &self.fine.connectivity;
        let (p, prev) = (self.at(aim.corner), c.prev(aim.corner));
        let d = minus(aim.target, p);
        let mut best: Option<(f64, HalfedgeId)> = None;
        for (h, end) in [(aim.corner, c.next(aim.corner)), (prev, prev)] {
            let (v, edge) = (c.tail(end), minus(self.at(end), p));
            let off = cross(edge, d).abs() / (length(edge) * length(d));
            let along = dot(edge, d) / dot(d, d);
            let is_beside = off <= BESIDE || self.crossed(aim.corner, d, h == aim.corner) < NARROW;
            if !is_beside || along <= 0.0 || along >= 1.0 - GOAL {
                continue;
            }
            let is_first = |h: HalfedgeId| {
                let u = c.head(h);
                self.has_bearings && !may_move(u) && c.head(c.vertex_halfedge(u)) == v
            };
            let is_kept = goal == Some(v)
                || !may_move(v)
                || c.is_boundary_vertex(v)
                || c.outgoing(v)
                    .any(|h| self.line[c.edge(h)] != NONE || is_first(h));
            let is_nearer = best.is_none_or(|(least, _)| off < least);
            if is_nearer && !is_kept && self.moves_without_harm(end, self.onto(aim, end)) {
                best = Some((off, h));
            }
        }
        best.map(|(_, h)| h)
    }

    /// The part of the edge opposite a corner at which a direction d from there crosses it, from its end on the right or on the left.
    fn crossed(&self, corner: HalfedgeId, d: [f64; 2], from_right: bool) -> f64 {
        let opposite = self.fine.connectivity.next(corner);
        let ends = [opposite, self.fine.connectivity.next(opposite)];
        let [a, b] = ends.map(|h| minus(self.at(h), self.at(corner)));
        let (right, left) = (cross(a, d), cross(d, b));
        let part = right / (right + left);
        if from_right { part } else { 1.0 - part }
    }

    /// Whether no face around the vertex of a corner, around which nothing is curved, is turned over or becomes thin when it is moved.
    fn moves_without_harm(&self, corner: HalfedgeId, by: [f64; 2]) -> bool {
        let c = &self.fine.connectivity;
        self.frames(corner).into_iter().all(|(h, turns)| {
            let others = [c.next(h), c.prev(h)].map(|h| self.at(h));
            let ([x, y], [a, b]) = (turned(by, turns), self.at(h));
            let [old, new] = [[a, b], [a + x, b + y]].map(|p| [p, others[0], others[1]]);
            double_area(new) > 0.0 && thickness(new) >= THICK.min(KEPT * thickness(old))
        })
    }

    /// Moves the vertex of a corner, around which nothing is curved, by what is given in the frame of its face.
    pub(super) fn move_by(&mut self, corner: HalfedgeId, by: [f64; 2]) {
        for (h, turns) in self.frames(corner) {
            let [x, y] = turned(by, turns);
            let [a, b] = self.at(h);
            self.fine.corner[h].uv = [a + x, b + y];
        }
    }

    /// The corners of the vertex of a corner, each with the quarter turns from that one's frame.
    fn frames(&self, corner: HalfedgeId) -> Vec<(HalfedgeId, u8)> {
        let aim = Aim {
            corner,
            target: self.at(corner),
        };
        let corners: Vec<HalfedgeId> = self.around(aim).iter().map(|a| a.corner).collect();
        let c = &self.fine.connectivity;
        // The first goes around counterclockwise, the rest clockwise from it again.
        let mut turns: Vec<u8> = vec![0];
        for i in 1..corners.len() {
            let left = c.twin(c.prev(corners[i - 1])) == Some(corners[i]);
            turns.push(
                match left {
                    true => turns[i - 1] + self.turns[c.prev(corners[i - 1])],
                    false => {
                        // From the corner on its left.
                        let h = c.twin(c.prev(corners[i]));
                        let at = corners[..i].iter().position(|&k| Some(k) == h).unwrap_or(0);
                        turns[at] + 4 - self.turns[c.prev(corners[i])]
                    }
                } & 3,
            );
        }
        corners.into_iter().zip(turns).collect()
    }
}
