//! Where borders of a surface and features go on the whole, though their edges turn to and fro.
//!
//! Scans end in teeth, and so does what is cut out of a mesh face by face. A field that is drawn to such edges stands at 45° to the border, since that is what edges of ±30° or ±60° have as mean of their fourth powers, and makes a corner of every tooth. The rims that volumes leave discs turn to and fro likewise. So where the
//! border turns both ways within a window of length, its edges count as if they pointed along the mean of directions there.
//!
//! *Enters:* a surface with boundary, its corner angles, and which halfedges are its border. *Leaves:* by how much the direction that each shall count for differs from its own. *Guaranteed:* 0 where the border turns one way only, as at a corner or along a hole; the sum of turns of a
//! border is as before. *Not guaranteed:* the outline of teeth, which is not wanted.

use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, FaceVec, HalfedgeId, HalfedgeVec};
use std::f64::consts::{FRAC_PI_2, PI};

/// How much borders turn to and fro in a window where directions are mean ones, radians: all turns but what they come to. A step of two right angles turns by twice as much.
const TO_AND_FRO: f64 = FRAC_PI_2;

/// Windows have at most this part of a closed border on either side.
const PART: f64 = 0.125;

/// A border, a part of one between features, or a side of a feature.
struct Line {
    halfedges: Vec<HalfedgeId>,
    length: Vec<f64>,
    /// By how much it turns to the left from each halfedge to the next, radians; the last of a closed one to the first.
    turn: Vec<f64>,
    is_closed: bool,
}

/// See the module docs. `line`: the line that a halfedge without twin is of, if any, such as a border or a side of a feature; `reach`: length of the window on either side of an edge, in the unit of `length`.
pub fn leans(
    c: &Connectivity,
    angle: &FaceVec<[f64; 3]>,
    length: &EdgeVec<f64>,
    line: impl Fn(HalfedgeId) -> Option<usize>,
    reach: f64,
) -> HalfedgeVec<f64> {
    let mut leans = HalfedgeVec::filled(0.0, c.halfedge_count());
    for line in lines(c, angle, length, line) {
        let total: f64 = line.length.iter().sum();
        let reach = match line.is_closed {
            true => reach.min(PART * total),
            false => reach,
        };
        for (i, &h) in line.halfedges.iter().enumerate() {
            leans[h] = line.lean(i, reach);
        }
    }
    leans
}

impl Line {
    /// Of an edge.
    fn lean(&self, i: usize, reach: f64) -> f64 {
        let [ahead, back] = [true, false].map(|is_ahead| self.side(i, reach, is_ahead));
        let all = ahead.turns + back.turns;
        if all - (ahead.turned - back.turned).abs() < TO_AND_FRO {
            return 0.0;
        }
        (ahead.sum + back.sum) / (ahead.length + back.length)
    }

    /// What is ahead of the middle of an edge, or behind it.
    fn side(&self, i: usize, reach: f64, is_ahead: bool) -> Side {
        let count = self.halfedges.len();
        let mut side = Side::default();
        let mut at = i;
        let mut own = 0.5 * self.length[i];
        loop {
            let part = own.min(reach - side.length);
            side.length += part;
            side.sum += part * side.turned;
            let next = match is_ahead {
                true => (at + 1 < count).then_some(at + 1),
                false => at.checked_sub(1),
            };
            let around = self
                .is_closed
                .then_some(if is_ahead { 0 } else { count - 1 });
            let Some(next) = next.or(around).filter(|_| side.length < reach) else {
                return side;
            };
            let turn = match is_ahead {
                true => self.turn[at],
                false => -self.turn[next],
            };
            side.turned += turn;
            side.turns += turn.abs();
            (at, own) = (next, self.length[next]);
        }
    }
}

/// One side of a window.
#[derive(Default)]
struct Side {
    length: f64,
    /// Directions relative to that of the middle, times lengths.
    sum: f64,
    /// The last direction.
    turned: f64,
    /// Sum of absolute turns.
    turns: f64,
}

/// All lines.
fn lines(
    c: &Connectivity,
    angle: &FaceVec<[f64; 3]>,
    length: &EdgeVec<f64>,
    line: impl Fn(HalfedgeId) -> Option<usize>,
) -> Vec<Line> {
    let line_of = |h: HalfedgeId| line(h).filter(|_| c.twin(h).is_none());
    // The halfedge of the boundary after one, and by how much that turns.
    let after = |h: HalfedgeId| {
        let mut next = c.next(h);
        let mut theta = angle[c.face(next)][c.corner(next)];
        while let Some(twin) = c.twin(next) {
            next = c.next(twin);
            theta += angle[c.face(next)][c.corner(next)];
        }
        (next, PI - theta)
    };
    let mut begins = HalfedgeVec::filled(true, c.halfedge_count());
    for h in c.halfedges().filter(|&h| line_of(h).is_some()) {
        let next = after(h).0;
        begins[next] &= line_of(next) != line_of(h);
    }
    let mut seen = HalfedgeVec::filled(false, c.halfedge_count());
    let mut lines = Vec::new();
    // Those that begin somewhere first: what is left is closed.
    for is_closed in [false, true] {
        for first in c.halfedges().filter(|&h| line_of(h).is_some()) {
            if seen[first] || !(is_closed || begins[first]) {
                continue;
            }
            let mut line = Line {
                halfedges: Vec::new(),
                length: Vec::new(),
                turn: Vec::new(),
                is_closed,
            };
            let mut h = first;
            while line_of(h) == line_of(first) && !std::mem::replace(&mut seen[h], true) {
                let (next, turn) = after(h);
                line.halfedges.push(h);
                line.length.push(length[c.edge(h)]);
                line.turn.push(turn);
                h = next;
            }
            lines.push(line);
        }
    }
    lines
}

#[cfg(test)]
mod tests;
