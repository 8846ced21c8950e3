//! Changes of steps that keep every face closed: walks from side to side.
//!
//! *Enters:* a [`Lattice`] and where to begin. *Leaves:* the cheapest walk. In a *state* (h, d) the side h gets one more step in direction d. Its face then closes again where another of its sides, b, gets one less; beyond b that is one more in the
//! direction into which the gluing turns d, and so on. A walk that comes back to its first state changes no sum; one that begins and ends on the border neither. (A walk is a sheet of the grid
//! that is put in or taken out.) *Guaranteed:* the same walk for the same lattice.

use super::lattice::{Lattice, UNIT};
use crate::geometry::ids::{FaceId, HalfedgeId};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Cost of a unit that is missing afterwards and was not before.
const MISSING: f64 = 1000.0;
/// Factor on the cost of what takes away from what is missing.
const HEALING: f64 = 0.1;

/// A side and the direction in which it gets one more step.
pub type State = (HalfedgeId, u8);

/// The cheapest first; of equal ones the first state.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Entry {
    pub(super) cost: f64,
    pub(super) state: u32,
}

impl Eq for Entry {}

impl Ord for Entry {
    fn cmp(&self, other: &Self) -> Ordering {
        other
            .cost
            .total_cmp(&self.cost)
            .then(other.state.cmp(&self.state))
    }
}

impl PartialOrd for Entry {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Memory of searches, used again.
#[derive(Default)]
pub struct Walks {
    cost: Vec<f64>,
    from: Vec<u32>,
    /// The search in which a state was met.
    met: Vec<u32>,
    search: u32,
    /// States visited by all searches.
    pub(super) visits: usize,
    heap: BinaryHeap<Entry>,
}

fn number((h, d): State) -> u32 {
    4 * h.raw() + u32::from(d)
}

fn state(number: u32) -> State {
    (HalfedgeId::new(number as usize / 4), (number % 4) as u8)
}

impl Lattice {
    /// The state of the walk the other way round: the same change seen from beyond the side.
    fn reversed(&self, (h, d): State) -> Option<State> {
        let side = self.complex.side(h);
        side.twin.map(|t| (t, (d + side.turns + 2) & 3))
    }

    /// Adds a walk's changes, or takes them back.
    pub fn apply(&mut self, walk: &[State], sign: i64) {
        for &(h, d) in walk {
            let [x, y] = self.complex.side(h).steps;
            let [a, b] = UNIT[usize::from(d)];
            self.complex.set_steps(h, [x + sign * a, y + sign * b]);
        }
    }

    /// What is missing of the faces that a walk touches.
    pub fn missing_on(&self, walk: &[State]) -> i64 {
        let mut faces: Vec<FaceId> = Vec::with_capacity(2 * walk.len());
        for &(h, _) in walk {
            faces.push(self.complex.face(h));
            faces.extend(self.complex.side(h).twin.map(|t| self.complex.face(t)));
        }
        faces.sort_unstable();
        faces.dedup();
        faces.into_iter().map(|f| self.missing(f)).sum()
    }

    /// E of the sides that a walk changes.
    pub fn energy_of_walk(&self, walk: &[State]) -> f64 {
        let lower = |h: HalfedgeId| self.complex.side(h).twin.map_or(h, |t| h.min(t));
        let mut sides: Vec<HalfedgeId> = walk.iter().map(|w| lower(w.0)).collect();
        sides.sort_unstable();
        sides.dedup();
        self.energy_on(sides.into_iter())
    }

    /// What it costs to take from `b` what `h` gets, in their face.
    fn cost(&self, (h, d): State, b: HalfedgeId) -> Option<f64> {
        let complex = &self.complex;
        if !self.may_change(b, d) {
            return None;
        }
        let e = UNIT[usize::from(d)];
        let steps = |h: HalfedgeId| complex.side(h).steps;
        let (own, next) = (steps(h), steps(complex.next(h)));
        let before =
            (1 - (own[0] * next[1] - own[1] * next[0])).max(0) + self.missing_of_line(b, steps(b));
        let own = [own[0] + e[0], own[1] + e[1]];
        let other = [steps(b)[0] - e[0], steps(b)[1] - e[1]];
        let area = match b == complex.next(h) {
            true => own[0] * other[1] - own[1] * other[0],
            false => other[0] * own[1] - other[1] * own[0],
        };
        let after = (1 - area).max(0) + self.missing_of_line(b, other);
        let more = self.energy_of(b, other) - self.energy_of(b, steps(b));
        let cost = if more > 0.0 {
            1.0 + more
        } else {
            1.0 / (1.0 - more)
        };
        Some(match after.cmp(&before) {
            Ordering::Greater => cost + MISSING * (after - before) as f64,
            Ordering::Equal => cost,
            Ordering::Less => HEALING * cost,
        })
    }

    /// The cheapest walk that begins with a state, with its cost; none that costs `most` or more.
    pub fn walk(&self, begin: State, most: f64, memory: &mut Walks) -> Option<(f64, Vec<State>)> {
        if !self.may_change(begin.0, begin.1) {
            return None;
        }
        match self.reversed(begin) {
            None => self.search(begin, most, true, memory),
            Some(reversed) => {
                let closed = self.search(begin, most, false, memory);
                if !self.has_border {
                    return closed;
                }
                let most = closed.as_ref().map_or(most, |c| c.0);
                let open = self.search(begin, most, true, memory);
                let Some((cost, mut forward)) = open else {
                    return closed;
                };
                match self.search(reversed, most - cost, true, memory) {
                    Some((more, backward)) => {
                        forward.extend(&backward[1..]);
                        Some((cost + more, forward))
                    }
                    None => closed,
                }
            }
        }
    }

    /// The cheapest walk from a state back to it, or to the border.
    fn search(
        &self,
        begin: State,
        most: f64,
        to_border: bool,
        memory: &mut Walks,
    ) -> Option<(f64, Vec<State>)> {
        let complex = &self.complex;
        let Walks {
            cost,
            from,
            met,
            search,
            visits,
            heap,
        } = memory;
        let states = 4 * complex.places();
        if met.len() != states {
            *cost = vec![0.0; states];
            *from = vec![0; states];
            *met = vec![0; states];
            *search = 0;
        }
        *search += 1;
        heap.clear();
        let first = number(begin);
        heap.push(Entry {
            cost: 0.0,
            state: first,
        });
        // The first state is met when it is come back to.
        let mut end: Option<(f64, u32, Option<State>)> = None;
        let mut is_first = true;
        while let Some(Entry {
            cost: so_far,
            state: at,
        }) = heap.pop()
        {
            if end.is_some_and(|(least, ..)| least <= so_far) {
                break;
            }
            let is_old = met[at as usize] == *search && cost[at as usize] < so_far;
            if is_old && !is_first {
                continue;
            }
            is_first = false;
            *visits += 1;
            let (h, d) = state(at);
            for b in [complex.next(h), complex.prev(h)] {
                let Some(step) = self.cost((h, d), b) else {
                    continue;
                };
                let total = so_far + step;
                if total >= most || end.is_some_and(|(least, ..)| least <= total) {
                    continue;
                }
                let side = complex.side(b);
                let Some(t) = side.twin else {
                    // One less is one more the other way.
                    if to_border {
                        end = Some((total, at, Some((b, (d + 2) & 3))));
                    }
                    continue;
                };
                let there = number((t, (d + side.turns) & 3));
                if there == first {
                    if !to_border {
                        end = Some((total, at, None));
                    }
                    continue;
                }
                let place = there as usize;
                if met[place] != *search || total < cost[place] {
                    (met[place], cost[place], from[place]) = (*search, total, at);
                    heap.push(Entry {
                        cost: total,
                        state: there,
                    });
                }
            }
        }
        let (total, mut at, last) = end?;
        let mut walk: Vec<State> = last.into_iter().collect();
        while at != first {
            walk.push(state(at));
            at = from[at as usize];
        }
        walk.push(begin);
        walk.reverse();
        Some((total, walk))
    }
}
