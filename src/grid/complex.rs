//! Flat triangles glued along their sides by quarter turns and translations: a Δ-complex, in which a triangle may be glued to itself and two vertices be joined by many edges.
//!
//! *Enters:* triangles in the plane with their gluing. *Leaves:* the same surface with other triangles: flips, and vertices that are taken out. *Guaranteed:* sides of a face sum to
//! zero, a side and its twin are each other's negative after the quarter turn between their frames, to the rounding of the input; every face is counterclockwise if it was
//! and callers ask [`Complex::is_convex`] first. *Not guaranteed:* ids: a flip moves sides within its two faces.

use crate::geometry::ids::{FaceId, HalfedgeId, HalfedgeVec, VertexId, VertexVec};

/// Sine of an angle below which three points count as on a line.
const STRAIGHT: f64 = 1e-12;

/// Twice the area over the square of the longest side that faces have at least after a flip that nothing but the lattice asks for.
const THICK: f64 = 1e-2;

/// A vector after `turns` quarter turns counterclockwise.
pub fn turned<T: Copy + std::ops::Neg<Output = T>>([x, y]: [T; 2], turns: u8) -> [T; 2] {
    match turns & 3 {
        0 => [x, y],
        1 => [-y, x],
        2 => [-x, -y],
        _ => [y, -x],
    }
}

/// x₁ y₂ − y₁ x₂.
pub fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn add(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] + b[0], a[1] + b[1]]
}

fn minus(a: [f64; 2]) -> [f64; 2] {
    [-a[0], -a[1]]
}

/// A side of a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side {
    /// Where it begins.
    pub tail: VertexId,
    /// From there to its end, in the frame of its face.
    pub vector: [f64; 2],
    /// The angle at its tail from where the surface's [`vertex_halfedge`](crate::geometry::connectivity::Connectivity::vertex_halfedge) goes, counterclockwise,
    /// radians: which way it goes where an angle may be more than a full turn. Up to full angles around the vertex.
    pub bearing: f64,
    /// The same on the lattice, cells; zero before the surface is quantised.
    pub steps: [i64; 2],
    /// The side that it is glued to; `None` on the border.
    pub twin: Option<HalfedgeId>,
    /// A vector p of this face is p after so many quarter turns in the frame of the face beyond.
    pub turns: u8,
    /// Whether it lies on a line of the atlas, a border or a feature: it is never flipped.
    pub is_line: bool,
}

/// See the module docs. Side `3f + k` runs from corner `k` of face `f` to corner `k + 1`.
#[derive(Clone, Debug)]
pub struct Complex {
    side: HalfedgeVec<Side>,
    /// One side that begins at every vertex; `None` for vertices that were taken out.
    first: VertexVec<Option<HalfedgeId>>,
    is_gone: Vec<bool>,
}

impl Complex {
    /// Three sides a face; `side.turns` and `side.twin` must be those of a gluing.
    pub fn new(side: HalfedgeVec<Side>, vertices: usize) -> Self {
        let mut first = VertexVec::filled(None, vertices);
        for (h, s) in side.enumerate() {
            first[s.tail] = Some(h);
        }
        let is_gone = vec![false; side.len() / 3];
        Self {
            side,
            first,
            is_gone,
        }
    }

    /// The same without places of what is gone, and which vertex every vertex was.
    pub fn compact(&self) -> (Self, VertexVec<VertexId>) {
        let kept: VertexVec<VertexId> = self.vertices().collect();
        let mut vertex = VertexVec::filled(0, self.first.len());
        for (new, &old) in kept.enumerate() {
            vertex[old] = new.index();
        }
        let mut place = HalfedgeVec::filled(0, self.side.len());
        let sides: Vec<HalfedgeId> = self.sides().collect();
        for (new, &old) in sides.iter().enumerate() {
            place[old] = new;
        }
        let side = sides.iter().map(|&h| Side {
            tail: VertexId::new(vertex[self.side[h].tail]),
            twin: self.side[h].twin.map(|t| HalfedgeId::new(place[t])),
            ..self.side[h]
        });
        (Self::new(side.collect(), kept.len()), kept)
    }

    /// One side.
    pub fn side(&self, h: HalfedgeId) -> &Side {
        &self.side[h]
    }

    /// The side after one in its face.
    pub fn next(&self, h: HalfedgeId) -> HalfedgeId {
        HalfedgeId::new(if h.index() % 3 == 2 {
            h.index() - 2
        } else {
            h.index() + 1
        })
    }

    /// The side before one in its face.
    pub fn prev(&self, h: HalfedgeId) -> HalfedgeId {
        HalfedgeId::new(if h.index().is_multiple_of(3) {
            h.index() + 2
        } else {
            h.index() - 1
        })
    }

    /// Face of a side.
    pub fn face(&self, h: HalfedgeId) -> FaceId {
        FaceId::new(h.index() / 3)
    }

    /// Where a side ends.
    pub fn head(&self, h: HalfedgeId) -> VertexId {
        self.side[self.next(h)].tail
    }

    /// Faces that are left.
    pub fn faces(&self) -> impl Iterator<Item = FaceId> + '_ {
        let left = self.is_gone.iter().enumerate().filter(|(_, gone)| !**gone);
        left.map(|(f, _)| FaceId::new(f))
    }

    /// Sides of faces that are left.
    pub fn sides(&self) -> impl Iterator<Item = HalfedgeId> + '_ {
        self.faces()
            .flat_map(|f| (0..3).map(move |k| HalfedgeId::new(3 * f.index() + k)))
    }

    /// Vertices that are left.
    pub fn vertices(&self) -> impl Iterator<Item = VertexId> + '_ {
        let left = self.first.enumerate().filter(|(_, first)| first.is_some());
        left.map(|(v, _)| v)
    }

    /// Number of places of sides, those of faces that are gone too.
    pub fn places(&self) -> usize {
        self.side.len()
    }

    /// Whether the face of a side is left.
    pub fn is_left(&self, h: HalfedgeId) -> bool {
        !self.is_gone[h.index() / 3]
    }

    /// Twice the area of a face, in the square of the unit of vectors.
    pub fn double_area(&self, f: FaceId) -> f64 {
        let h = HalfedgeId::new(3 * f.index());
        cross(self.side[h].vector, self.side[self.next(h)].vector)
    }

    /// Sides that begin at a vertex, counterclockwise; from the border to the border where it lies there.
    pub fn star(&self, v: VertexId) -> Vec<HalfedgeId> {
        let Some(begin) = self.first[v] else {
            return Vec::new();
        };
        let mut h = begin;
        while let Some(t) = self.side[h].twin {
            h = self.next(t);
            if h == begin {
                break;
            }
        }
        let (begin, mut star) = (h, vec![h]);
        while let Some(next) = self.side[self.prev(h)].twin {
            if next == begin {
                break;
            }
            star.push(next);
            h = next;
        }
        star
    }

    /// The angle of the corner that a side leaves, radians; a face that rounding has turned over counts as flat.
    pub fn angle(&self, h: HalfedgeId) -> f64 {
        let (a, b) = (self.side[h].vector, minus(self.side[self.prev(h)].vector));
        cross(a, b).max(0.0).atan2(dot(a, b))
    }

    /// Sums of the angles of a star from line to line, from the first line on; one sum where it has none.
    pub fn sectors(&self, star: &[HalfedgeId], angle: impl Fn(HalfedgeId) -> f64) -> Vec<f64> {
        let first = star.iter().position(|&h| self.side[h].is_line);
        let order = star.iter().cycle().skip(first.unwrap_or(0));
        let mut sectors: Vec<f64> = Vec::new();
        for &h in order.take(star.len()) {
            match sectors.last_mut() {
                Some(sum) if !self.side[h].is_line => *sum += angle(h),
                _ => sectors.push(angle(h)),
            }
        }
        sectors
    }

    /// Turns the frame of a face by quarter turns.
    pub fn turn(&mut self, f: FaceId, turns: u8) {
        for k in 0..3 {
            let h = HalfedgeId::new(3 * f.index() + k);
            self.side[h].vector = turned(self.side[h].vector, turns);
            self.side[h].steps = turned(self.side[h].steps, turns);
            self.side[h].turns = self.side[h].turns.wrapping_sub(turns) & 3;
            if let Some(t) = self.side[h].twin {
                self.side[t].turns = self.side[t].turns.wrapping_add(turns) & 3;
            }
        }
    }

    /// Gives the face beyond a side the frame of the face before it. `None` at the border and where both are the same face.
    fn align(&mut self, h: HalfedgeId) -> Option<HalfedgeId> {
        let t = self.side[h].twin?;
        if self.face(t) == self.face(h) {
            return None;
        }
        let turns = self.side[h].turns;
        self.turn(self.face(t), 4 - turns);
        Some(t)
    }

    /// Whether both triangles beside a side are a strictly convex quadrilateral, so that it can be flipped.
    pub fn is_convex(&self, h: HalfedgeId) -> bool {
        let Some([hn, hp, tn, tp]) = self.quad(h) else {
            return false;
        };
        let wide = |a: [f64; 2], b: [f64; 2]| cross(a, b) > STRAIGHT * dot(a, a).max(dot(b, b));
        wide(tn, minus(hp)) && wide(hn, minus(tp))
    }

    /// Whether both triangles after a flip have areas of at least 0.01 of the square of their longest side.
    pub fn stays_thick(&self, h: HalfedgeId) -> bool {
        let Some([hn, hp, tn, tp]) = self.quad(h) else {
            return false;
        };
        let is_thick = |a: [f64; 2], b: [f64; 2]| {
            let c = add(a, b);
            cross(a, b) >= THICK * dot(a, a).max(dot(b, b)).max(dot(c, c))
        };
        // c → a → d and d → b → c.
        is_thick(hp, tn) && is_thick(tp, hn)
    }

    /// Whether the angles opposite a side sum to more than π, by more than rounding.
    pub fn is_wrong(&self, h: HalfedgeId) -> bool {
        let Some([hn, hp, tn, tp]) = self.quad(h) else {
            return false;
        };
        let (a, b, c, d) = (hp, minus(hn), tp, minus(tn));
        let sum = dot(a, b) * cross(c, d) + dot(c, d) * cross(a, b);
        let size = (dot(a, a) * dot(b, b) * dot(c, c) * dot(d, d)).sqrt();
        sum < -STRAIGHT * size && self.is_convex(h)
    }

    /// Vectors of the sides after and before a side and its twin, in the frame of the side.
    fn quad(&self, h: HalfedgeId) -> Option<[[f64; 2]; 4]> {
        let t = self.side[h].twin?;
        if self.face(t) == self.face(h) {
            return None;
        }
        let back = 4 - self.side[h].turns;
        let beyond = |h: HalfedgeId| turned(self.side[h].vector, back);
        Some([
            self.side[self.next(h)].vector,
            self.side[self.prev(h)].vector,
            beyond(self.next(t)),
            beyond(self.prev(t)),
        ])
    }

    /// Replaces the side from a to b between faces abc and bad by one from d to c; both faces have the frame of the first then. False, and nothing done, at the
    /// border and within one face.
    pub fn flip(&mut self, h: HalfedgeId) -> bool {
        let Some(t) = self.align(h) else {
            return false;
        };
        let (hn, hp, tn, tp) = (self.next(h), self.prev(h), self.next(t), self.prev(t));
        let (c, d) = (self.side[hp].tail, self.side[tp].tail);
        let vector = add(self.side[tp].vector, self.side[hn].vector);
        let [p, q] = [tp, hn].map(|h| self.side[h].steps);
        let steps = [p[0] + q[0], p[1] + q[1]];
        let bearing = |from: HalfedgeId, vector: [f64; 2]| {
            let Side {
                bearing,
                vector: beside,
                ..
            } = self.side[from];
            bearing + cross(beside, vector).atan2(dot(beside, vector))
        };
        // Seen from d and from c.
        let bearings = [bearing(tp, vector), bearing(hp, minus(vector))];
        self.moved(&[(hp, hn), (tn, hp), (tp, tn), (hn, tp)]);
        let side = |tail, vector, bearing, steps, twin| Side {
            tail,
            vector,
            bearing,
            steps,
            twin: Some(twin),
            turns: 0,
            is_line: false,
        };
        self.side[h] = side(d, vector, bearings[0], steps, t);
        self.side[t] = side(c, minus(vector), bearings[1], turned(steps, 2), h);
        for h in [h, hn, hp, t, tn, tp] {
            self.first[self.side[h].tail] = Some(h);
        }
        true
    }

    /// Moves sides, with their gluing, from places to places.
    fn moved(&mut self, moves: &[(HalfedgeId, HalfedgeId)]) {
        let place = |h: HalfedgeId| moves.iter().find(|m| m.0 == h).map_or(h, |m| m.1);
        let sides: Vec<Side> = moves.iter().map(|&(from, _)| self.side[from]).collect();
        for (&(_, to), mut side) in moves.iter().zip(sides) {
            side.twin = side.twin.map(place);
            if let Some(t) = side.twin {
                self.side[t].twin = Some(to);
            }
            self.side[to] = side;
        }
    }

    /// Sets the steps of a side, and those of its twin.
    pub fn set_steps(&mut self, h: HalfedgeId, steps: [i64; 2]) {
        let Side { twin, turns, .. } = self.side[h];
        self.side[h].steps = steps;
        if let Some(t) = twin {
            self.side[t].steps = turned(steps, turns + 2);
        }
    }

    /// Takes out a vertex with three faces around it, which become one.
    pub fn merge_inside(&mut self, v: VertexId) -> bool {
        let star = self.star(v);
        let [a, b, c] = star[..] else {
            return false;
        };
        self.align_star(&star);
        let outer = [a, b, c].map(|h| self.next(h));
        self.merge(v, &star, outer.map(Some), [a, self.next(a), self.prev(a)]);
        true
    }

    /// Takes out a vertex of the border with two faces, which become one.
    pub fn merge_on_border(&mut self, v: VertexId) -> bool {
        let star = self.star(v);
        let [a, b] = star[..] else {
            return false;
        };
        self.align_star(&star);
        let whole = self.joined(self.prev(b), a, None);
        let places = [a, self.next(a), self.prev(a)];
        let outer = [self.next(a), self.next(b)];
        self.merge(v, &star, [Some(outer[0]), Some(outer[1]), None], places);
        self.place(places[2], whole);
        true
    }

    /// Takes out a vertex of a straight line with two faces on each side, which become one on each side. `first`: one of its sides that is on the line.
    pub fn merge_on_line(&mut self, v: VertexId, first: HalfedgeId) -> bool {
        let mut star = self.star(v);
        let begin = star.iter().position(|&h| h == first);
        star.rotate_left(begin.unwrap_or(0));
        let [a, b, c, d] = star[..] else {
            return false;
        };
        self.align_star(&star);
        let left = [a, self.next(a), self.prev(a)];
        let right = [c, self.next(c), self.prev(c)];
        let there = self.joined(self.prev(b), a, Some(right[2]));
        let back = self.joined(self.prev(d), c, Some(left[2]));
        let outer = [a, b, c, d].map(|h| self.next(h));
        self.merge(v, &[a, b], [Some(outer[0]), Some(outer[1]), None], left);
        self.merge(v, &[c, d], [Some(outer[2]), Some(outer[3]), None], right);
        self.place(left[2], there);
        self.place(right[2], back);
        true
    }

    /// Two sides one after the other as one.
    fn joined(&self, one: HalfedgeId, other: HalfedgeId, twin: Option<HalfedgeId>) -> Side {
        Side {
            tail: self.side[one].tail,
            vector: add(self.side[one].vector, self.side[other].vector),
            bearing: self.side[one].bearing,
            steps: [0; 2],
            twin,
            turns: 0,
            is_line: self.side[one].is_line,
        }
    }

    fn place(&mut self, h: HalfedgeId, side: Side) {
        self.first[side.tail] = Some(h);
        self.side[h] = side;
    }

    /// Gives all faces around a vertex the frame of the first.
    fn align_star(&mut self, star: &[HalfedgeId]) {
        for &h in &star[..star.len() - 1] {
            self.align(self.prev(h));
        }
    }

    /// Puts `outer` sides into `places` of the first of the faces of `star`; the others are gone, and so is the vertex.
    fn merge(
        &mut self,
        v: VertexId,
        star: &[HalfedgeId],
        outer: [Option<HalfedgeId>; 3],
        places: [HalfedgeId; 3],
    ) {
        for &h in &star[1..] {
            self.is_gone[h.index() / 3] = true;
        }
        let moves = outer.iter().zip(places);
        let moves = moves.filter_map(|(outer, place)| Some(((*outer)?, place)));
        let moves: Vec<_> = moves.collect();
        self.moved(&moves);
        for (_, h) in moves {
            self.first[self.side[h].tail] = Some(h);
        }
        self.first[v] = None;
    }
}
