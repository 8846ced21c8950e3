//! The map from the surface to the grid that is affine on every triangle between cones.
//!
//! *Enters:* a surface on the plane, and its cone triangulation with steps. *Leaves:* the surface refined along the sides of those triangles, its corners in grid coordinates: integer points, lines and
//! cells are the same whatever frame they are seen from. *Guaranteed:* both ends of every edge obey its transition, a quarter turn and an integer translation, exactly; cones and corners are at integer points, lines on
//! lattice lines. *Not guaranteed:* little distortion: [`relax`](super::relax) sees to that.

use super::complex::turned;
use super::error::GridError;
use super::lattice::{Lattice, UNIT};
use super::quads::QuadMesh;
use super::sheet::{Aim, Sheet};
use super::triangle::double_area;
use crate::geometry::ids::{
    EdgeVec, FaceId, FaceVec, HalfedgeId, HalfedgeVec, NONE, VertexId, VertexVec,
};
use crate::geometry::subdivision::Subdivision;
use std::collections::VecDeque;
use std::f64::consts::FRAC_PI_2;

/// Vertices that lie beside a side by less than this part of their distance from the last vertex on it are taken to be on it: few digits in a file put them there. The map can move them.
const NEAR: f64 = 1e-4;
/// By how much the end of a path may miss the direction that it should have, radians.
const SAME_DIRECTION: f64 = 1e-3;

/// How far a vertex may move on the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Freedom {
    /// It stays.
    Fixed,
    /// Along coordinate 0 or 1 in the frame of its first corner.
    Along(u8),
    /// Everywhere.
    Free,
}

impl Freedom {
    /// Whether it may move along each axis.
    pub(super) fn axes(self) -> [bool; 2] {
        match self {
            Self::Fixed => [false; 2],
            Self::Along(axis) => [axis == 0, axis == 1],
            Self::Free => [true; 2],
        }
    }
}

/// A surface with grid coordinates.
pub(crate) struct GridMap {
    /// `corner[h].uv`: grid coordinates, cells; turns are those between their frames.
    pub sheet: Sheet,
    /// Of every vertex.
    pub freedom: VertexVec<Freedom>,
    /// Vertices whose place on the quad mesh is known.
    pub anchors: Vec<Anchor>,
}

/// A vertex of the surface that is a point of the quad mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Anchor {
    /// The vertex.
    pub vertex: VertexId,
    /// A square and its side that begins there.
    pub edge: (u32, u8),
    /// Angle of that side from where the first halfedge of the vertex goes, counterclockwise, radians.
    pub bearing: f64,
    /// Where that halfedge goes while the bearing holds.
    pub first: [f64; 2],
}

/// A corner, and the quarter turns and the translation that take the frame of the first corner of its vertex to its own.
pub(crate) type Frame = (HalfedgeId, u8, [i64; 2]);

/// The frames of the corners of a vertex, counterclockwise, by the translations across halfedges.
fn frames(sheet: &Sheet, v: VertexId, across: impl Fn(HalfedgeId) -> [i64; 2]) -> Vec<Frame> {
    let c = &sheet.fine.connectivity;
    let mut h = c.vertex_halfedge(v);
    let begin = h;
    let (mut turns, mut shift) = (0u8, [0i64; 2]);
    let mut all = vec![(h, turns, shift)];
    loop {
        let prev = c.prev(h);
        let Some(t) = c.twin(prev).filter(|&t| t != begin) else {
            return all;
        };
        let by = sheet.turns[prev];
        let ([x, y], [a, b]) = (turned(shift, by), across(prev));
        shift = [x + a, y + b];
        turns = (turns + by) & 3;
        h = t;
        all.push((h, turns, shift));
    }
}

fn put(sheet: &mut Sheet, frames: &[Frame], place: [f64; 2]) {
    for &(h, turns, shift) in frames {
        let [x, y] = turned(place, turns);
        sheet.fine.corner[h].uv = [x + shift[0] as f64, y + shift[1] as f64];
    }
}

impl GridMap {
    /// The translation across a halfedge: q = R^turns p + shift takes coordinates of its face to those of the face beyond; 0 at a border.
    pub fn shift(&self, h: HalfedgeId) -> [i64; 2] {
        let c = &self.sheet.fine.connectivity;
        let Some(t) = c.twin(h) else { return [0; 2] };
        let [x, y] = turned(self.sheet.at(h), self.sheet.turns[h]);
        let [a, b] = self.sheet.at(c.next(t));
        [(a - x).round() as i64, (b - y).round() as i64]
    }

    /// The frames of the corners of a vertex, counterclockwise.
    pub fn frames(&self, v: VertexId) -> Vec<Frame> {
        frames(&self.sheet, v, |h| self.shift(h))
    }

    /// Puts a vertex somewhere, seen from its first corner.
    pub fn put(&mut self, v: VertexId, place: [f64; 2]) {
        let frames = self.frames(v);
        put(&mut self.sheet, &frames, place);
    }

    /// Where a vertex is, seen from its first corner.
    pub fn place(&self, v: VertexId) -> [f64; 2] {
        self.sheet
            .at(self.sheet.fine.connectivity.vertex_halfedge(v))
    }

    /// Coordinates of the corners of a face.
    pub fn corners(&self, f: FaceId) -> [[f64; 2]; 3] {
        let c = &self.sheet.fine.connectivity;
        c.face_halfedges(f).map(|h| self.sheet.at(h))
    }

    /// The bearing of an anchor as it is now, where its first halfedge has not turned by half a turn since.
    pub fn bearing(&self, anchor: &Anchor) -> f64 {
        let first = self.sheet.fine.connectivity.vertex_halfedge(anchor.vertex);
        anchor.bearing - turn_between(anchor.first, self.sheet.vector(first))
    }
}

/// The angle from one direction to another, in (−π, π].
fn turn_between(from: [f64; 2], to: [f64; 2]) -> f64 {
    super::complex::cross(from, to).atan2(from[0] * to[0] + from[1] * to[1])
}

/// The first halfedges of anchors while vertices move: about a cone of more than a full turn they may turn by more than half a turn in all.
pub(super) struct Turning {
    first: Vec<HalfedgeId>,
    anchors: Vec<Anchor>,
}

impl Turning {
    pub fn new(map: &GridMap) -> Self {
        let c = &map.sheet.fine.connectivity;
        let first = map.anchors.iter().map(|a| c.vertex_halfedge(a.vertex));
        Self {
            first: first.collect(),
            anchors: map.anchors.clone(),
        }
    }

    /// Takes bearings anew. To be asked whenever every vertex has moved along one segment without a face turned over: an edge turns by less than half a turn in this.
    pub fn see(&mut self, corners: &Corners, place: &[[f64; 2]]) {
        for (h, anchor) in self.first.iter().zip(&mut self.anchors) {
            let (f, k) = (FaceId::new(h.index() / 3), h.index() % 3);
            let at = corners.corners(f, place);
            let (p, q) = (at[k], at[(k + 1) % 3]);
            let now = [q[0] - p[0], q[1] - p[1]];
            anchor.bearing -= turn_between(anchor.first, now);
            anchor.first = now;
        }
    }

    /// Gives the anchors their bearings, and the vertices their places.
    pub fn put(self, map: &mut GridMap, corners: &Corners, place: &[[f64; 2]]) {
        map.anchors = self.anchors;
        corners.put(map, place);
    }
}

/// From which frame every corner sees its vertex: q = R^turns p + shift, where p is its place from the first corner.
pub(super) struct Corners(HalfedgeVec<(u32, u8, [i64; 2])>);

impl Corners {
    pub fn new(map: &GridMap) -> Self {
        let c = &map.sheet.fine.connectivity;
        let mut corner = HalfedgeVec::filled((0, 0, [0; 2]), c.halfedge_count());
        for v in c.vertices() {
            for (h, turns, shift) in map.frames(v) {
                corner[h] = (v.raw(), turns, shift);
            }
        }
        Self(corner)
    }

    fn of(&self, f: FaceId) -> &[(u32, u8, [i64; 2])] {
        &self.0.as_slice()[3 * f.index()..3 * f.index() + 3]
    }

    /// Vertices of a face.
    pub fn vertices(&self, f: FaceId) -> [u32; 3] {
        [0, 1, 2].map(|k| self.of(f)[k].0)
    }

    /// Quarter turns of the corners of a face.
    pub fn turns(&self, f: FaceId) -> [u8; 3] {
        [0, 1, 2].map(|k| self.of(f)[k].1)
    }

    /// Corners of a face for places of vertices.
    pub fn corners(&self, f: FaceId, place: &[[f64; 2]]) -> [[f64; 2]; 3] {
        [0, 1, 2].map(|k| Self::seen(&self.of(f)[k], place))
    }

    /// Puts every vertex somewhere.
    pub fn put(&self, map: &mut GridMap, place: &[[f64; 2]]) {
        for (h, corner) in self.0.enumerate() {
            map.sheet.fine.corner[h].uv = Self::seen(corner, place);
        }
    }

    fn seen((v, turns, shift): &(u32, u8, [i64; 2]), place: &[[f64; 2]]) -> [f64; 2] {
        let [x, y] = turned(place[*v as usize], *turns);
        [x + shift[0] as f64, y + shift[1] as f64]
    }
}

/// Where a face lies: in which triangle between cones, and how its frame turns and moves into that of the triangle.
#[derive(Clone, Copy)]
struct Under {
    face: FaceId,
    turns: u8,
    shift: [f64; 2],
}

/// Refines a surface along the sides of the cone triangulation and maps it; see the module docs. `vertex`: the vertices of the lattice as vertices of the surface; `turns` those between the frames of its faces; `is_line` its edges on lines but borders.
pub(crate) fn affine(
    fine: Subdivision,
    turns: HalfedgeVec<u8>,
    lattice: &Lattice,
    vertex: &VertexVec<VertexId>,
    mesh: &QuadMesh,
    is_line: &EdgeVec<bool>,
    may_move: impl Fn(VertexId) -> bool + Copy,
) -> Result<GridMap, GridError> {
    let complex = &lattice.complex;
    let mut sheet = Sheet::new(fine, turns, NEAR);
    let own = |&h: &HalfedgeId| complex.side(h).twin.is_none_or(|t| h < t);
    let (lines, others): (Vec<HalfedgeId>, Vec<HalfedgeId>) = complex
        .sides()
        .filter(own)
        .partition(|&h| complex.side(h).is_line);
    // Lines are edges already; what is drawn after them cannot cross them.
    for h in lines {
        let (side, goal) = (complex.side(h), vertex[complex.head(h)]);
        sheet.follow(vertex[side.tail], side.bearing, h.raw(), goal, is_line)?;
    }
    for h in others {
        let aim = aim(&sheet, lattice, vertex, h)?;
        let aims = sheet.near(aim);
        sheet.draw(aims, h.raw(), Some(vertex[complex.head(h)]), may_move)?;
    }
    let under = flood(&sheet, lattice, vertex)?;
    let real = real_corners(lattice);
    let on_lattice = |u: Under, p: [f64; 2]| -> [f64; 2] {
        let [x, y] = turned(p, u.turns);
        let p = [x + u.shift[0], y + u.shift[1]];
        let ([a, b, c], to) = (real[u.face], lattice.corners(u.face));
        let whole = double_area([a, b, c]);
        let w = [
            double_area([p, b, c]),
            double_area([a, p, c]),
            double_area([a, b, p]),
        ];
        std::array::from_fn(|i| (0..3).map(|k| w[k] / whole * to[k][i] as f64).sum())
    };
    let c = &sheet.fine.connectivity;
    let mut shift = HalfedgeVec::filled([0; 2], c.halfedge_count());
    let mut grid_turns = HalfedgeVec::filled(0, c.halfedge_count());
    let mut on_side: VertexVec<u32> = VertexVec::filled(NONE, c.vertex_count());
    for h in c.halfedges() {
        let line = sheet.line[c.edge(h)];
        if line == NONE {
            continue;
        }
        [h, c.next(h)]
            .iter()
            .for_each(|&h| on_side[c.tail(h)] = line);
        // The side that runs the way of this halfedge, in the triangle on its left.
        let side = side_of(
            lattice,
            under[c.face(h)].face,
            line,
            sheet.vector(h),
            under[c.face(h)].turns,
        );
        let face = c.face(h);
        let side = side.ok_or(GridError::NoTriangle { face })?;
        let (own, turns) = (complex.side(side), complex.side(side).turns);
        if let Some(t) = own.twin {
            let from = lattice.corners(complex.face(side))[side.index() % 3];
            let next = complex.next(t);
            let to = lattice.corners(complex.face(next))[next.index() % 3];
            let [x, y] = turned(from, turns);
            grid_turns[h] = turns;
            shift[h] = [to[0] - x, to[1] - y];
        }
    }
    let mut is_cone = VertexVec::filled(false, c.vertex_count());
    vertex.iter().for_each(|&v| is_cone[v] = true);
    let mut places = Vec::with_capacity(c.vertex_count());
    let mut freedom = VertexVec::filled(Freedom::Free, c.vertex_count());
    for v in c.vertices() {
        let first = c.vertex_halfedge(v);
        let u = under[c.face(first)];
        let mut place = on_lattice(u, sheet.at(first));
        if is_cone[v] {
            place = place.map(f64::round);
            freedom[v] = Freedom::Fixed;
        } else if on_side[v] != NONE {
            let side = HalfedgeId::new(on_side[v] as usize);
            // On the side exactly: the nearest point of it, in a frame where it is a side of the triangle.
            let sides = (0..3).map(|k| HalfedgeId::new(3 * u.face.index() + k));
            let own = sides
                .filter(|&s| s == side || complex.side(s).twin == Some(side))
                .min_by(|&s, &t| {
                    distance(lattice, s, place).total_cmp(&distance(lattice, t, place))
                });
            if let Some(own) = own {
                place = nearest(lattice, own, place);
                if let Some(d) = lattice.direction(own) {
                    freedom[v] = Freedom::Along(d & 1);
                }
            }
        }
        places.push(place);
    }
    let mut paths = Vec::new();
    for (v, first) in vertex.iter().zip(mesh.first_edges(lattice)) {
        let (side, direction, edge) = first;
        paths.push((
            *v,
            start(&sheet, lattice, vertex, side)?.corner,
            side,
            direction,
            edge,
        ));
    }
    sheet.turns = grid_turns;
    let vertices = sheet.fine.connectivity.vertices();
    for (v, place) in vertices.zip(places) {
        let frames = frames(&sheet, v, |h| shift[h]);
        put(&mut sheet, &frames, place);
    }
    let anchor = |(vertex, path, side, direction, edge): (_, _, _, u8, _)| {
        let (steps, to) = (complex.side(side).steps, UNIT[usize::from(direction)]);
        let [a, b] = steps.map(|x| x as f64);
        let [x, y] = to.map(|x| x as f64);
        Anchor {
            vertex,
            edge,
            bearing: sheet.bearing(path) + (a * y - b * x).atan2(a * x + b * y),
            first: sheet.vector(sheet.fine.connectivity.vertex_halfedge(vertex)),
        }
    };
    let anchors = paths.into_iter().map(anchor).collect();
    Ok(GridMap {
        sheet,
        freedom,
        anchors,
    })
}

/// From the tail of a side to its head, in the frame of the corner there.
fn aim(
    sheet: &Sheet,
    lattice: &Lattice,
    vertex: &VertexVec<VertexId>,
    h: HalfedgeId,
) -> Result<Aim, GridError> {
    let side = lattice.complex.side(h);
    let face = FaceId::new(0);
    let found = sheet.corner_at(vertex[side.tail], side.bearing);
    let (corner, angle) = found.ok_or(GridError::Lost {
        line: h.raw(),
        face,
    })?;
    let [x, y] = side.vector;
    let quarters = ((angle - y.atan2(x)) / FRAC_PI_2).round() as i64;
    let [dx, dy] = turned(side.vector, quarters.rem_euclid(4) as u8);
    let [a, b] = sheet.at(corner);
    Ok(Aim {
        corner,
        target: [a + dx, b + dy],
    })
}

/// Corners of the triangles in the frames of their vectors, the first at the origin.
fn real_corners(lattice: &Lattice) -> FaceVec<[[f64; 2]; 3]> {
    let vector = |f: usize, k| lattice.complex.side(HalfedgeId::new(3 * f + k)).vector;
    let corners = |f| {
        let ([a, b], [c, d]) = (vector(f, 0), vector(f, 1));
        [[0.0; 2], [a, b], [a + c, b + d]]
    };
    (0..lattice.complex.places() / 3).map(corners).collect()
}

/// The triangle that every face lies in: from a corner of each on, as far as no line is crossed.
fn flood(
    sheet: &Sheet,
    lattice: &Lattice,
    vertex: &VertexVec<VertexId>,
) -> Result<FaceVec<Under>, GridError> {
    let (c, complex) = (&sheet.fine.connectivity, &lattice.complex);
    let real = real_corners(lattice);
    let mut under: FaceVec<Option<Under>> = FaceVec::filled(None, c.face_count());
    for f in complex.faces() {
        let h = HalfedgeId::new(3 * f.index());
        let side = complex.side(h);
        let start = start(sheet, lattice, vertex, h)?;
        let at = sheet.at(start.corner);
        let to = [start.target[0] - at[0], start.target[1] - at[1]];
        // Which quarter turn takes this to the vector of the side.
        let fits = |turns: &u8| {
            let [a, b] = turned(to, *turns);
            (a - side.vector[0]).hypot(b - side.vector[1])
        };
        let turns = (0..4u8)
            .min_by(|a, b| fits(a).total_cmp(&fits(b)))
            .unwrap_or(0);
        let [x, y] = turned(at, turns);
        let corner = real[f][0];
        let shift = [corner[0] - x, corner[1] - y];
        let first = Under {
            face: f,
            turns,
            shift,
        };
        let mut waiting = VecDeque::from([(c.face(start.corner), first)]);
        while let Some((g, u)) = waiting.pop_front() {
            match under[g] {
                Some(there) if there.face == f => continue,
                Some(_) => return Err(GridError::NoTriangle { face: g }),
                None => under[g] = Some(u),
            }
            for h in c.face_halfedges(g) {
                let Some(t) = c.twin(h) else { continue };
                if sheet.line[c.edge(h)] != NONE || under[c.face(t)].is_some() {
                    continue;
                }
                let turns = (u.turns + 4 - sheet.turns[h]) & 3;
                let [x, y] = turned(sheet.at(h), u.turns);
                let [a, b] = turned(sheet.at(c.next(t)), turns);
                let shift = [x + u.shift[0] - a, y + u.shift[1] - b];
                let next = Under {
                    face: f,
                    turns,
                    shift,
                };
                waiting.push_back((c.face(t), next));
            }
        }
    }
    let known = under.enumerate();
    let known = known.map(|(face, u)| (*u).ok_or(GridError::NoTriangle { face }));
    known.collect()
}

/// Where the path of a side begins, and its end seen from there.
fn start(
    sheet: &Sheet,
    lattice: &Lattice,
    vertex: &VertexVec<VertexId>,
    h: HalfedgeId,
) -> Result<Aim, GridError> {
    let c = &sheet.fine.connectivity;
    let line = lattice.complex.side(h).twin.map_or(h, |t| t.min(h)).raw();
    let aim = aim(sheet, lattice, vertex, h)?;
    // It may leave beside the corner that the bearing fell into.
    let found = sheet.near(aim).into_iter().find(|near| {
        let along = sheet.vector(near.corner);
        let at = sheet.at(near.corner);
        let to = [near.target[0] - at[0], near.target[1] - at[1]];
        let off = super::complex::cross(along, to).atan2(along[0] * to[0] + along[1] * to[1]);
        sheet.line[c.edge(near.corner)] == line && off.abs() < SAME_DIRECTION
    });
    let face = c.face(aim.corner);
    found.ok_or(GridError::NoTriangle { face })
}

/// The side of a triangle that is a line and runs like a vector of the surface.
fn side_of(
    lattice: &Lattice,
    f: FaceId,
    line: u32,
    vector: [f64; 2],
    turns: u8,
) -> Option<HalfedgeId> {
    let complex = &lattice.complex;
    let [x, y] = turned(vector, turns);
    let along = |h: HalfedgeId| {
        let [a, b] = complex.side(h).vector;
        (a * x + b * y) / (a.hypot(b) * x.hypot(y))
    };
    let own = (0..3)
        .map(|k| HalfedgeId::new(3 * f.index() + k))
        .filter(|&h| {
            let twin = complex.side(h).twin;
            h.raw() == line || twin.is_some_and(|t| t.raw() == line)
        });
    own.filter(|&h| along(h) > 0.0)
        .max_by(|&a, &b| along(a).total_cmp(&along(b)))
}

/// The point of a side that is nearest, on the lattice.
fn nearest(lattice: &Lattice, side: HalfedgeId, p: [f64; 2]) -> [f64; 2] {
    let f = lattice.complex.face(side);
    let begin = lattice.corners(f)[side.index() % 3].map(|x| x as f64);
    let steps = lattice.complex.side(side).steps.map(|x| x as f64);
    let squared = steps[0] * steps[0] + steps[1] * steps[1];
    let along = ((p[0] - begin[0]) * steps[0] + (p[1] - begin[1]) * steps[1]) / squared;
    std::array::from_fn(|i| begin[i] + along * steps[i])
}

fn distance(lattice: &Lattice, side: HalfedgeId, p: [f64; 2]) -> f64 {
    let [x, y] = nearest(lattice, side, p);
    (x - p[0]).hypot(y - p[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_than_half_a_turn_is_seen_in_parts() {
        let start = [1.0, 0.0];
        let (mut last, mut turned) = (start, 0.0);
        for step in 1..=9 {
            let (y, x) = (f64::from(step) * 0.4).sin_cos();
            turned += turn_between(last, [x, y]);
            last = [x, y];
        }
        assert!((turned - 3.6).abs() < 1e-12);
        assert!((turn_between(start, last) - 3.6).abs() > 6.0);
    }
}
