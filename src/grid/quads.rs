//! The quad mesh of a [`Lattice`], in whole numbers alone.
//!
//! *Enters:* a lattice where nothing is missing. *Leaves:* its points and unit squares. *Guaranteed:* exact: points are those of the lattice, as many squares as cells, as many edges around a vertex as its
//! cone angle has quarter turns, or an error; the same order for the same lattice. Coordinates are those of a face: corner 0 at the origin, its first side along its steps.
//!
//! From a point *darts* go in the unit directions that the surface has there: four where it is flat, as many as quarter turns at a cone, those between the two sides of a border. Each is traced from face to face by signs of determinants; that passes
//! through no lattice point before its end. Around a square one turns left at every end.

use super::complex::turned;
use super::error::GridError;
use super::lattice::{Lattice, UNIT};
use crate::geometry::ids::{FaceId, HalfedgeId, VertexId};
use std::collections::HashMap;

/// Faces that a dart may pass: more than any triangulation of cones has beside an edge of the lattice.
const MOST_FACES_OF_DART: usize = 1_000_000;

/// A lattice point, and where it is in one face of the complex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// A face that it is in.
    pub face: FaceId,
    /// Coordinates there.
    pub at: [i64; 2],
    /// The vertex of the complex that it is, if it is one.
    pub vertex: Option<VertexId>,
    /// Number of edges.
    pub valence: usize,
}

/// Points and squares.
#[derive(Clone, Debug)]
pub struct QuadMesh {
    /// Vertices.
    pub points: Vec<Point>,
    /// Corners of squares, counterclockwise.
    pub quads: Vec<[u32; 4]>,
    /// Across side k of a square, from its corner k to the next: square and side there; `None` on the border.
    pub across: Vec<[Option<(u32, u8)>; 4]>,
    /// Of every point, its first edge, and the square and side that it is.
    first: Vec<(Dart, (u32, u8))>,
}

impl QuadMesh {
    /// Whether no two edges have the same ends, and none has the same point at both.
    pub fn is_simple(&self) -> bool {
        let mut ends: Vec<[u32; 2]> = Vec::with_capacity(2 * self.quads.len());
        for (q, (corners, across)) in self.quads.iter().zip(&self.across).enumerate() {
            for k in 0..4 {
                // Of both sides of an edge the first.
                if across[k].is_none_or(|other| (q as u32, k as u8) < other) {
                    let [a, b] = [corners[k], corners[(k + 1) % 4]];
                    ends.push([a.min(b), a.max(b)]);
                }
            }
        }
        ends.sort_unstable();
        ends.iter().all(|[a, b]| a != b) && ends.windows(2).all(|w| w[0] != w[1])
    }

    /// Whether points are on the border.
    pub fn border(&self) -> Vec<bool> {
        let mut is_border = vec![false; self.points.len()];
        for (corners, across) in self.quads.iter().zip(&self.across) {
            for k in (0..4).filter(|&k| across[k].is_none()) {
                is_border[corners[k] as usize] = true;
                is_border[corners[(k + 1) % 4] as usize] = true;
            }
        }
        is_border
    }

    /// Of every vertex of the complex: the side that leaves it before the first edge counterclockwise, the direction of that edge in the frame of the side's face, and the square and side that it is.
    pub fn first_edges(&self, lattice: &Lattice) -> Vec<(HalfedgeId, u8, (u32, u8))> {
        let vertices = self.points.iter().zip(&self.first);
        let vertices = vertices.filter(|(p, _)| p.vertex.is_some());
        let first = vertices.map(|(_, (dart, edge))| {
            let corner = lattice
                .corners(dart.face)
                .iter()
                .position(|at| *at == dart.at);
            (side(dart.face, corner.unwrap_or(0)), dart.direction, *edge)
        });
        first.collect()
    }
}

/// Where a point is in a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    Inside,
    /// On the side k, not at its ends.
    Side(usize),
    Corner(usize),
}

/// A unit direction at a point, in the frame of a face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Dart {
    face: FaceId,
    at: [i64; 2],
    direction: u8,
}

fn minus([a, b]: [i64; 2], [c, d]: [i64; 2]) -> [i64; 2] {
    [a - c, b - d]
}

fn plus([a, b]: [i64; 2], [c, d]: [i64; 2]) -> [i64; 2] {
    [a + c, b + d]
}

fn cross([a, b]: [i64; 2], [c, d]: [i64; 2]) -> i128 {
    i128::from(a) * i128::from(d) - i128::from(b) * i128::from(c)
}

/// Whether a direction is counterclockwise from `a` on, `a` included, and before `b`, less than half a turn away.
fn is_between(a: [i64; 2], d: u8, b: [i64; 2]) -> bool {
    let d = UNIT[usize::from(d)];
    let along = i128::from(a[0]) * i128::from(d[0]) + i128::from(a[1]) * i128::from(d[1]);
    let (from, to) = (cross(a, d), cross(d, b));
    (from > 0 || (from == 0 && along > 0)) && to > 0
}

fn divisor(a: i64, b: i64) -> i64 {
    if b == 0 { a.abs() } else { divisor(b, a % b) }
}

fn side(f: FaceId, k: usize) -> HalfedgeId {
    HalfedgeId::new(3 * f.index() + k)
}

/// Corners, what is across sides, and the first edge of every point.
type Squares = (
    Vec<[u32; 4]>,
    Vec<[Option<(u32, u8)>; 4]>,
    Vec<(Dart, (u32, u8))>,
);

/// Names of points that do not depend on the face they are seen from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Name {
    Vertex(VertexId),
    /// The side with the lower id of both, how many points from its tail.
    Side(HalfedgeId, i64),
    Face(FaceId, [i64; 2]),
}

/// Takes a lattice apart.
struct Extraction<'a> {
    lattice: &'a Lattice,
    number: HashMap<Name, u32>,
    points: Vec<Point>,
    /// Of every point, counterclockwise.
    darts: Vec<Vec<Dart>>,
}

impl Lattice {
    /// Coordinates of the corners of a face.
    pub fn corners(&self, f: FaceId) -> [[i64; 2]; 3] {
        let steps = |k| self.complex.side(side(f, k)).steps;
        [[0; 2], steps(0), plus(steps(0), steps(1))]
    }

    /// Points and squares; see the module docs.
    pub fn quads(&self) -> Result<QuadMesh, GridError> {
        if let Some(face) = self.complex.faces().find(|&f| self.missing(f) > 0) {
            return Err(GridError::NoArea { face });
        }
        let mut extraction = Extraction {
            lattice: self,
            number: HashMap::new(),
            points: Vec::new(),
            darts: Vec::new(),
        };
        extraction.list();
        let (quads, across, first) = extraction.squares()?;
        if quads.len() as i64 != self.cells() {
            return Err(GridError::Quads {
                found: quads.len(),
                cells: self.cells(),
            });
        }
        Ok(QuadMesh {
            points: extraction.points,
            quads,
            across,
            first,
        })
    }
}

impl Extraction<'_> {
    fn list(&mut self) {
        let complex = &self.lattice.complex;
        for v in complex.vertices() {
            let star = complex.star(v);
            let mut darts = Vec::new();
            for &h in &star {
                self.darts_of_corner(h, &mut darts);
            }
            if let (Some(&last), None) = (star.last(), complex.side(star[0]).twin) {
                // Along the border that comes in.
                let h = complex.prev(last);
                self.dart_back(h, last, &mut darts);
            }
            let (face, at) = self.corner(star[0]);
            self.push(Name::Vertex(v), face, at, Some(v), darts);
        }
        for h in complex.sides() {
            let s = complex.side(h);
            if s.twin.is_some_and(|t| t < h) {
                continue;
            }
            let count = divisor(s.steps[0], s.steps[1]);
            let step = s.steps.map(|x| x / count);
            for i in 1..count {
                let (face, tail) = self.corner(h);
                let at = plus(tail, step.map(|x| i * x));
                let mut darts = Vec::new();
                self.darts_of_side(h, face, at, &mut darts);
                match s.twin {
                    Some(t) => {
                        let (face, tail) = self.corner(t);
                        let back = complex.side(t).steps.map(|x| x / count);
                        let at = plus(tail, back.map(|x| (count - i) * x));
                        self.darts_of_side(t, face, at, &mut darts);
                    }
                    None => {
                        if let Some(direction) = unit(step).map(|d| (d + 2) & 3) {
                            darts.push(Dart {
                                face,
                                at,
                                direction,
                            });
                        }
                    }
                }
                self.push(Name::Side(h, i), face, at, None, darts);
            }
        }
        let faces: Vec<FaceId> = complex.faces().collect();
        for f in faces {
            self.list_inside(f);
        }
    }

    fn list_inside(&mut self, f: FaceId) {
        let corners = self.lattice.corners(f);
        let rows = corners.map(|p| p[1]);
        let [low, high] = [rows.iter().min(), rows.iter().max()].map(|y| y.copied().unwrap_or(0));
        for y in low..=high {
            // On the left of side k: steps × (x − corner) > 0, a bound for x by the sign of its second step.
            let (mut begin, mut end) = (i128::MIN, i128::MAX);
            let mut is_empty = false;
            for (k, corner) in corners.iter().enumerate() {
                let [a, b] = self.steps(side(f, k)).map(i128::from);
                let [x, y] = [i128::from(corner[0]), i128::from(y - corner[1])];
                // b x' < a y with x' from the corner.
                match b.signum() {
                    1 => end = end.min(x + (a * y + b - 1).div_euclid(b) - 1),
                    -1 => begin = begin.max(x + (-a * y).div_euclid(-b) + 1),
                    _ => is_empty |= a * y <= 0,
                }
            }
            if is_empty {
                continue;
            }
            for x in begin..=end {
                let at = [x as i64, y];
                let dart = |direction| Dart {
                    face: f,
                    at,
                    direction,
                };
                let darts = (0..4).map(dart).collect();
                self.push(Name::Face(f, at), f, at, None, darts);
            }
        }
    }

    fn push(
        &mut self,
        name: Name,
        face: FaceId,
        at: [i64; 2],
        vertex: Option<VertexId>,
        darts: Vec<Dart>,
    ) {
        self.number.insert(name, self.points.len() as u32);
        self.points.push(Point {
            face,
            at,
            vertex,
            valence: darts.len(),
        });
        self.darts.push(darts);
    }

    /// The corner that a side leaves.
    fn corner(&self, h: HalfedgeId) -> (FaceId, [i64; 2]) {
        let f = self.lattice.complex.face(h);
        (f, self.lattice.corners(f)[h.index() % 3])
    }

    fn steps(&self, h: HalfedgeId) -> [i64; 2] {
        self.lattice.complex.side(h).steps
    }

    /// Directions of a corner, its first side included, in order.
    fn darts_of_corner(&self, h: HalfedgeId, darts: &mut Vec<Dart>) {
        let back = self.steps(self.lattice.complex.prev(h)).map(|x| -x);
        let (face, at) = self.corner(h);
        let a = self.steps(h);
        in_order(|d| is_between(a, d, back), face, at, darts);
    }

    /// Directions on the left of a side, and along it.
    fn darts_of_side(&self, h: HalfedgeId, face: FaceId, at: [i64; 2], darts: &mut Vec<Dart>) {
        let a = self.steps(h);
        let is_left = |d: u8| {
            let u = UNIT[usize::from(d)];
            let across = cross(a, u);
            across > 0 || (across == 0 && a[0] * u[0] + a[1] * u[1] > 0)
        };
        in_order(is_left, face, at, darts);
    }

    /// The direction from the end of a border side back along it, at the corner that `next` leaves.
    fn dart_back(&self, border: HalfedgeId, next: HalfedgeId, darts: &mut Vec<Dart>) {
        let (face, at) = self.corner(next);
        if let Some(d) = unit(self.steps(border)) {
            let direction = (d + 2) & 3;
            darts.push(Dart {
                face,
                at,
                direction,
            });
        }
    }

    /// Where a point is in a face; `None` outside.
    fn place(&self, f: FaceId, at: [i64; 2]) -> Option<Place> {
        let corners = self.lattice.corners(f);
        let across: [i128; 3] =
            std::array::from_fn(|k| cross(self.steps(side(f, k)), minus(at, corners[k])));
        if across.iter().any(|x| *x < 0) {
            return None;
        }
        let on: Vec<usize> = (0..3).filter(|&k| across[k] == 0).collect();
        Some(match on[..] {
            [] => Place::Inside,
            [k] => Place::Side(k),
            // Sides 0 and 2 meet at corner 0.
            [0, 2] => Place::Corner(0),
            [_, k] => Place::Corner(k),
            _ => return None,
        })
    }

    /// Coordinates and direction beyond a side.
    fn beyond(&self, h: HalfedgeId, dart: Dart) -> Option<Dart> {
        let complex = &self.lattice.complex;
        let s = complex.side(h);
        let t = s.twin?;
        let (_, tail) = self.corner(h);
        let (face, head) = self.corner(complex.next(t));
        Some(Dart {
            face,
            at: plus(head, turned(minus(dart.at, tail), s.turns)),
            direction: (dart.direction + s.turns) & 3,
        })
    }

    /// The end of a dart as the dart that goes back.
    fn trace(&self, mut dart: Dart) -> Option<Dart> {
        let mut came_by = None;
        for _ in 0..MOST_FACES_OF_DART {
            let end = plus(dart.at, UNIT[usize::from(dart.direction)]);
            if self.place(dart.face, end).is_some() {
                let direction = (dart.direction + 2) & 3;
                return Some(Dart {
                    at: end,
                    direction,
                    ..dart
                });
            }
            let corners = self.lattice.corners(dart.face);
            // The side that is crossed first: value at the beginning over what is lost until the end.
            let mut first: Option<(i128, i128, HalfedgeId)> = None;
            for (k, &corner) in corners.iter().enumerate() {
                let h = side(dart.face, k);
                let value = |p| cross(self.steps(h), minus(p, corner));
                let (begin, end) = (value(dart.at), value(end));
                if end >= 0 || came_by == Some(h) {
                    continue;
                }
                let lost = begin - end;
                if first.is_none_or(|(value, of, _)| begin * of < value * lost) {
                    first = Some((begin, lost, h));
                }
            }
            let (_, _, h) = first?;
            came_by = self.lattice.complex.side(h).twin;
            dart = self.beyond(h, dart)?;
        }
        None
    }

    /// Point and place in its list of a dart that is seen from any face.
    fn find(&self, dart: Dart) -> Option<(u32, usize)> {
        let complex = &self.lattice.complex;
        let (name, seen) = match self.place(dart.face, dart.at)? {
            Place::Inside => (Name::Face(dart.face, dart.at), dart),
            Place::Side(k) => {
                let h = side(dart.face, k);
                let s = complex.side(h);
                let count = divisor(s.steps[0], s.steps[1]);
                let (_, tail) = self.corner(h);
                let step = s.steps.map(|x| x / count);
                let off = minus(dart.at, tail);
                let i = match step[0] {
                    0 => off[1] / step[1],
                    x => off[0] / x,
                };
                let name = match s.twin {
                    Some(t) if t < h => Name::Side(t, count - i),
                    _ => Name::Side(h, i),
                };
                let u = UNIT[usize::from(dart.direction)];
                let across = cross(s.steps, u);
                let is_own =
                    across > 0 || (across == 0 && s.steps[0] * u[0] + s.steps[1] * u[1] > 0);
                let seen = match is_own || s.twin.is_none() {
                    true => dart,
                    false => self.beyond(h, dart)?,
                };
                (name, seen)
            }
            Place::Corner(k) => {
                let h = side(dart.face, k);
                let prev = complex.prev(h);
                let back = self.steps(prev).map(|x| -x);
                let is_last = complex.side(prev).twin.is_none();
                let seen = match is_between(self.steps(h), dart.direction, back) || is_last {
                    true => dart,
                    false => self.beyond(prev, dart)?,
                };
                (Name::Vertex(complex.side(h).tail), seen)
            }
        };
        let point = *self.number.get(&name)?;
        let place = self.darts[point as usize].iter().position(|d| *d == seen)?;
        Some((point, place))
    }

    /// Squares, and what is across their sides.
    fn squares(&self) -> Result<Squares, GridError> {
        let broken = |point: usize| GridError::Open {
            face: self.points[point].face,
            at: self.points[point].at,
        };
        // Numbers of darts, and of every dart the one that goes back.
        let mut first = vec![0usize];
        for darts in &self.darts {
            first.push(first[first.len() - 1] + darts.len());
        }
        let mut back = Vec::with_capacity(first[self.darts.len()]);
        let mut point_of = Vec::with_capacity(back.capacity());
        for (point, darts) in self.darts.iter().enumerate() {
            for &dart in darts {
                let found = self.trace(dart).and_then(|back| self.find(back));
                let (end, place) = found.ok_or_else(|| broken(point))?;
                back.push(first[end as usize] + place);
                point_of.push(point);
            }
        }
        // The dart that follows around the square on the left; none outside the border.
        let next = |dart: usize| {
            let back = back[dart];
            let end = point_of[back];
            match back - first[end] {
                0 if self.is_on_border(end) => None,
                0 => Some(first[end + 1] - 1),
                _ => Some(back - 1),
            }
        };
        let mut quads = Vec::new();
        let mut side: Vec<Option<(u32, u8)>> = vec![None; back.len()];
        for (begin, &point) in point_of.iter().enumerate() {
            let Some(b) = next(begin) else { continue };
            let around = next(b).and_then(|c| Some([begin, b, c, next(c)?]));
            let around = around.filter(|a| next(a[3]) == Some(begin));
            let around = around.ok_or_else(|| broken(point))?;
            if around.iter().min() == Some(&begin) {
                for (k, dart) in around.into_iter().enumerate() {
                    side[dart] = Some((quads.len() as u32, k as u8));
                }
                quads.push(around);
            }
        }
        let across = quads
            .iter()
            .map(|q: &[usize; 4]| q.map(|dart| side[back[dart]]));
        let across = across.collect();
        let quads = quads.iter().map(|q| q.map(|dart| point_of[dart] as u32));
        let mut firsts = Vec::with_capacity(self.points.len());
        for (point, darts) in self.darts.iter().enumerate() {
            let edge = side[first[point]].ok_or_else(|| broken(point))?;
            firsts.push((darts[0], edge));
        }
        Ok((quads.collect(), across, firsts))
    }

    /// Whether the first dart of a point has nothing on its right.
    fn is_on_border(&self, point: usize) -> bool {
        let complex = &self.lattice.complex;
        let Point {
            face, at, vertex, ..
        } = self.points[point];
        match (vertex, self.place(face, at)) {
            (Some(v), _) => {
                let star = complex.star(v);
                star.first()
                    .is_some_and(|&h| complex.side(h).twin.is_none())
            }
            (None, Some(Place::Side(k))) => complex.side(side(face, k)).twin.is_none(),
            _ => false,
        }
    }
}

/// The unit direction of a vector that has one.
fn unit([x, y]: [i64; 2]) -> Option<u8> {
    match (x.signum(), y.signum()) {
        (1, 0) => Some(0),
        (0, 1) => Some(1),
        (-1, 0) => Some(2),
        (0, -1) => Some(3),
        _ => None,
    }
}

/// Consecutive directions that are wanted, from the first counterclockwise.
fn in_order(is_wanted: impl Fn(u8) -> bool, face: FaceId, at: [i64; 2], darts: &mut Vec<Dart>) {
    let begin = (0..4).find(|&d| is_wanted(d) && !is_wanted((d + 3) & 3));
    let Some(begin) = begin else { return };
    let wanted = (0..4)
        .map(|i| (begin + i) & 3)
        .take_while(|&d| is_wanted(d));
    darts.extend(wanted.map(|direction| Dart {
        face,
        at,
        direction,
    }));
}
