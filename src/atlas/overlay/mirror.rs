//! The layout of a surface with boundary: the final triangulation of its double, cut along the mirror.
//!
//! *Enters:* crossings of the double's edges with the final triangulation. *Leaves:* the cells on the surface's own side,
//! triangulated, and what lies under every piece of a final edge. The mirror is made of base edges, which are straight
//! in the flat metric too, so the cells are convex. *Not guaranteed:* anything about the other side; the final
//! triangulation need not be symmetric.

use super::OverlayError;
use super::crossings::Crossings;
use super::flat_face::{FlatFace, OnSide};
use super::polygon::{Faces, distances};
use super::slice::{Point, slice};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeId, EdgeVec, FaceId, HalfedgeId, HalfedgeVec, NONE, VertexId};
use std::ops::Range;

/// On which side of the mirror a base edge lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// Between two faces of the surface.
    Front,
    /// Between two mirror images.
    Back,
    /// On the mirror.
    Mirror,
}

/// Where an edge of a double lies whose first `front_faces` faces are the surface's own.
pub(super) fn place(base: &Connectivity, front_faces: usize, e: EdgeId) -> Place {
    let h = base.edge_halfedge(e);
    let is_front = |h: HalfedgeId| base.face(h).index() < front_faces;
    match (is_front(h), base.twin(h).map(is_front)) {
        (true, Some(true)) => Place::Front,
        (false, Some(false)) => Place::Back,
        _ => Place::Mirror,
    }
}

/// What lies under a piece of a final halfedge, between two of its crossings.
#[derive(Clone, Copy, Debug)]
pub(super) struct Under {
    /// Layout halfedge that runs the same way.
    pub halfedge: HalfedgeId,
    /// Fractions along the final halfedge where it begins and ends.
    pub low: f64,
    pub high: f64,
    /// Number of pieces before this one on the layout halfedge.
    pub offset: usize,
}

/// The cells on the surface's own side; see the module docs.
#[derive(Default)]
pub(super) struct Half {
    pub faces: Faces,
    /// Cell of every layout face.
    pub cell: Vec<u32>,
    /// Final halfedge that leaves the corner which a layout halfedge leaves; [`NONE`] at a crossing.
    corner: Vec<u32>,
    /// Crossings with the mirror on final edge e, from the tail: `mirror[mirror_first[e]..mirror_first[e + 1]]`.
    mirror: Vec<u32>,
    mirror_first: Vec<u32>,
    /// Number of crossings with the mirror before every piece of every final edge.
    interval_of_piece: Vec<u32>,
    /// Layout halfedge of every part of every final halfedge between crossings with the mirror; [`NONE`] behind it.
    interval: Vec<u32>,
    interval_first: Vec<u32>,
    /// Layout halfedge of every segment of every base edge on the mirror, [`NONE`] elsewhere.
    segment: Vec<u32>,
}

/// Number of the `i`-th segment of a base edge among those of all edges.
fn segment_index(x: &Crossings, e: EdgeId, i: usize) -> usize {
    x.curves.range(e).start + e.index() + i
}

impl Half {
    /// `vertex` numbers the crossings on the mirror.
    pub fn new(
        x: &Crossings,
        length: &EdgeVec<f64>,
        front_faces: usize,
        vertex: &[u32],
        vertices: usize,
    ) -> Result<Self, OverlayError> {
        let mut half = Self {
            segment: vec![NONE; x.curves.crossing.len() + x.base.edge_count()],
            ..Self::default()
        };
        let sides = Sides::new(x, front_faces)?;
        half.list_mirror(x, &sides);
        for f in x.flat.faces() {
            let h = x.flat.face_halfedges(f);
            let count = h.map(|h| half.mirror_range(x.flat.edge(h)).len());
            if count == [0; 3] {
                if sides.is_front(x, f)? {
                    half.whole_face(x, length, f, vertices)?;
                }
                continue;
            }
            let face = FlatFace::new(x.flat, length, f);
            let consistent = slice(count, |polygon| {
                half.cell_of(x, &sides, &face, f, polygon, vertex, vertices)
            })?;
            if !consistent {
                return Err(OverlayError::inconsistent("final face", f.index()));
            }
        }
        half.pair(x, &sides)?;
        Ok(half)
    }

    fn list_mirror(&mut self, x: &Crossings, sides: &Sides) {
        self.mirror_first.push(0);
        for e in x.flat.edges() {
            let before = self.mirror.len() as u32;
            for &index in &x.along[x.range(e)] {
                self.interval_of_piece
                    .push(self.mirror.len() as u32 - before);
                if sides.is_mirror(x, index as usize) {
                    self.mirror.push(index);
                }
            }
            self.interval_of_piece
                .push(self.mirror.len() as u32 - before);
            self.mirror_first.push(self.mirror.len() as u32);
        }
        let mut total = 0;
        for h in x.flat.halfedges() {
            self.interval_first.push(total);
            total += self.mirror_range(x.flat.edge(h)).len() as u32 + 1;
        }
        self.interval = vec![NONE; total as usize];
    }

    fn mirror_range(&self, e: EdgeId) -> Range<usize> {
        self.mirror_first[e.index()] as usize..self.mirror_first[e.index() + 1] as usize
    }

    /// The i-th crossing with the mirror along a final halfedge, from 1.
    fn mirror_on(&self, x: &Crossings, h: HalfedgeId, i: usize) -> usize {
        let e = x.flat.edge(h);
        let range = self.mirror_range(e);
        let at = match x.flat.edge_halfedge(e) == h {
            true => range.start + i - 1,
            false => range.end - i,
        };
        self.mirror[at] as usize
    }

    /// A final face with all of it on the surface's own side.
    fn whole_face(
        &mut self,
        x: &Crossings,
        length: &EdgeVec<f64>,
        f: FaceId,
        vertices: usize,
    ) -> Result<(), OverlayError> {
        let h = x.flat.face_halfedges(f);
        let corners = x.flat.face_vertices(f);
        if corners.iter().any(|v| v.index() >= vertices) {
            return Err(OverlayError::inconsistent("final face", f.index()));
        }
        let lengths = h.map(|h| length[x.flat.edge(h)]);
        let laid = self.faces.triangle(corners, lengths);
        for (h, l) in h.into_iter().zip(laid) {
            self.interval[self.interval_first[h.index()] as usize] = l.raw();
            self.corner.push(h.raw());
        }
        self.cell.push(self.cell.last().map_or(0, |&c| c + 1));
        Ok(())
    }

    /// One cell of a face that the mirror passes; nothing where it lies behind.
    #[allow(clippy::too_many_arguments)]
    fn cell_of(
        &mut self,
        x: &Crossings,
        sides: &Sides,
        face: &FlatFace,
        f: FaceId,
        polygon: &[Point],
        vertex: &[u32],
        vertices: usize,
    ) -> Result<(), OverlayError> {
        let error = || OverlayError::inconsistent("final face", f.index());
        let n = polygon.len();
        let halfedge = |p: Point| x.flat.corner_halfedge(f, p.side);
        let crossing = |p: Point| (p.place > 0).then(|| self.mirror_on(x, halfedge(p), p.place));
        let last = |p: Point| p.place == self.mirror_range(x.flat.edge(halfedge(p))).len();
        let follows = |p: Point, q: Point| match last(p) {
            true => (q.side, q.place) == ((p.side + 1) % 3, 0),
            false => (q.side, q.place) == (p.side, p.place + 1),
        };
        // The chords, with the base segment that each one is and whether the surface is on their left.
        let mut chord = [None; 6];
        let mut front = None;
        for i in 0..n {
            let (p, q) = (polygon[i], polygon[(i + 1) % n]);
            if follows(p, q) {
                if let Some(left) = sides.mirror_left[halfedge(p)] {
                    front = Some(left);
                }
                continue;
            }
            // A base edge run forward leaves the face through the halfedge that its crossing names.
            let (edge, before, forward) = match (crossing(p), crossing(q)) {
                (_, Some(q_index)) => {
                    let forward = x.curves.crossing[q_index].halfedge == halfedge(q);
                    (
                        sides.edge_of[q_index],
                        q_index + usize::from(!forward),
                        forward,
                    )
                }
                (Some(p_index), None) => {
                    let forward = x.curves.crossing[p_index].halfedge != halfedge(p);
                    (
                        sides.edge_of[p_index],
                        p_index + usize::from(forward),
                        forward,
                    )
                }
                (None, None) => return Err(error()),
            };
            let e = EdgeId::new(edge as usize);
            let i_segment = before - x.curves.range(e).start;
            chord[i] = Some(segment_index(x, e, i_segment));
            let left = sides.front_forward[e] == forward;
            if front.is_some_and(|f| f != left) {
                return Err(error());
            }
            front = Some(left);
        }
        if front != Some(true) {
            return front.map(|_| ()).ok_or_else(error);
        }
        let mut corners = [VertexId::new(0); 6];
        let mut at: [OnSide; 6] = [(0, [0.0, 1.0]); 6];
        for (i, &p) in polygon.iter().enumerate() {
            let (v, s) = match crossing(p) {
                Some(index) => (vertex[index] as usize, x.fractions(index, halfedge(p))),
                None => (x.flat.tail(halfedge(p)).index(), [0.0, 1.0]),
            };
            if v == NONE as usize || (p.place == 0 && v >= vertices) {
                return Err(error());
            }
            corners[i] = VertexId::new(v);
            at[i] = (p.side, s);
        }
        let flat = distances(n, |i, j| face.distance(at[i], at[j]));
        let laid = self.faces.polygon(&corners[..n], &flat, None);
        let cell = self.cell.last().map_or(0, |&c| c + 1);
        for triangle in &laid.triangles[..laid.count] {
            self.cell.push(cell);
            for &i in triangle {
                let p = polygon[i];
                self.corner.push(match p.place {
                    0 => halfedge(p).raw(),
                    _ => NONE,
                });
            }
        }
        for i in 0..n {
            let h = laid.side[i].raw();
            match chord[i] {
                Some(segment) => self.segment[segment] = h,
                None => {
                    let p = polygon[i];
                    let first = self.interval_first[halfedge(p).index()] as usize;
                    self.interval[first + p.place] = h;
                }
            }
        }
        Ok(())
    }

    /// Pairs what lies under the two sides of every final edge.
    fn pair(&mut self, x: &Crossings, sides: &Sides) -> Result<(), OverlayError> {
        for e in x.flat.edges() {
            let h = x.flat.edge_halfedge(e);
            let t = x.other(h)?;
            let m = self.mirror_range(e).len();
            for i in 0..=m {
                let a = self.interval[self.interval_first[h.index()] as usize + i];
                let b = self.interval[self.interval_first[t.index()] as usize + m - i];
                let both = a != NONE && b != NONE;
                // Front and back meet on the mirror only.
                let one = (a != NONE) != (b != NONE);
                if (both || one) && one != sides.mirror_left[h].is_some() {
                    return Err(OverlayError::inconsistent("final edge", e.index()));
                }
                if both {
                    let halfedge = |raw: u32| HalfedgeId::new(raw as usize);
                    self.faces.pair(halfedge(a), halfedge(b));
                }
            }
        }
        for e in x.base.edges() {
            if let Some(same) = x.curves.coincident[e].filter(|_| sides.on_mirror[e]) {
                for h in [same, x.other(same)?] {
                    let under = self.interval[self.interval_first[h.index()] as usize];
                    if under != NONE {
                        self.segment[segment_index(x, e, 0)] = under;
                    }
                }
            }
        }
        Ok(())
    }

    /// What lies under the `piece`-th piece of a final halfedge; `None` behind the mirror.
    pub fn under(&self, x: &Crossings, h: HalfedgeId, piece: usize) -> Option<Under> {
        let e = x.flat.edge(h);
        let range = x.range(e);
        let forward = x.flat.edge_halfedge(e) == h;
        let forward_piece = if forward { piece } else { range.len() - piece };
        let interval = *self
            .interval_of_piece
            .get(range.start + e.index() + forward_piece)? as usize;
        let mirror = &self.mirror[self.mirror_range(e)];
        let own = if forward {
            interval
        } else {
            mirror.len() - interval
        };
        let under = self.interval[self.interval_first[h.index()] as usize + own];
        if under == NONE {
            return None;
        }
        // The crossings at which it begins and ends, in the direction of h.
        let tail_of = |interval: usize| interval.checked_sub(1).map(|i| mirror[i] as usize);
        let head_of = |interval: usize| mirror.get(interval).map(|&i| i as usize);
        let (tail, head) = match forward {
            true => (tail_of(interval), head_of(interval)),
            false => (head_of(interval), tail_of(interval)),
        };
        let first = tail.map_or(0, |i| x.rank(i, h) + 1);
        Some(Under {
            halfedge: HalfedgeId::new(under as usize),
            low: tail.map_or(0.0, |i| x.fraction(i, h)),
            high: head.map_or(1.0, |i| x.fraction(i, h)),
            offset: piece - first,
        })
    }

    /// The layout halfedge that leaves the corner of `final_halfedge` in the cell of a layout halfedge.
    pub fn corner_in_cell(
        &self,
        inside: HalfedgeId,
        final_halfedge: HalfedgeId,
    ) -> Option<HalfedgeId> {
        let f = inside.index() / 3;
        let cell = self.cell[f];
        let first = (0..f).rev().take_while(|&g| self.cell[g] == cell).last();
        let faces = (first.unwrap_or(f)..self.cell.len()).take_while(|&g| self.cell[g] == cell);
        let mut corners = faces.flat_map(|g| 3 * g..3 * g + 3);
        let found = corners.find(|&h| self.corner[h] == final_halfedge.raw());
        found.map(HalfedgeId::new)
    }

    /// The layout halfedge that the `i`-th segment of a base edge on the mirror is.
    pub fn segment(&self, x: &Crossings, e: EdgeId, i: usize) -> Option<HalfedgeId> {
        let h = self.segment[segment_index(x, e, i)];
        (h != NONE).then(|| HalfedgeId::new(h as usize))
    }
}

/// Which side of the mirror things are on.
struct Sides {
    /// Base edge of every crossing.
    edge_of: Vec<u32>,
    /// True for base edges on the mirror.
    on_mirror: EdgeVec<bool>,
    /// For base edges on the mirror: the surface is on the left of their halfedge.
    front_forward: EdgeVec<bool>,
    /// For final halfedges on the mirror: the surface is on their left.
    mirror_left: HalfedgeVec<Option<bool>>,
    /// Side of a base edge that crosses a final edge or is the same, if it is not on the mirror.
    touched: EdgeVec<Option<bool>>,
}

impl Sides {
    fn new(x: &Crossings, front_faces: usize) -> Result<Self, OverlayError> {
        let mut sides = Self {
            edge_of: vec![NONE; x.curves.crossing.len()],
            on_mirror: EdgeVec::filled(false, x.base.edge_count()),
            front_forward: EdgeVec::filled(false, x.base.edge_count()),
            mirror_left: HalfedgeVec::filled(None, x.flat.halfedge_count()),
            touched: EdgeVec::filled(None, x.flat.edge_count()),
        };
        for e in x.base.edges() {
            let place = place(x.base, front_faces, e);
            let h = x.base.edge_halfedge(e);
            sides.on_mirror[e] = place == Place::Mirror;
            sides.front_forward[e] = x.base.face(h).index() < front_faces;
            for i in x.curves.range(e) {
                sides.edge_of[i] = e.raw();
                if place != Place::Mirror {
                    let crossed = x.flat.edge(x.curves.crossing[i].halfedge);
                    sides.touched[crossed] = Some(place == Place::Front);
                }
            }
            let Some(same) = x.curves.coincident[e] else {
                continue;
            };
            if place == Place::Mirror {
                let left = sides.front_forward[e];
                sides.mirror_left[same] = Some(left);
                sides.mirror_left[x.other(same)?] = Some(!left);
            } else {
                sides.touched[x.flat.edge(same)] = Some(place == Place::Front);
            }
        }
        Ok(sides)
    }

    fn is_mirror(&self, x: &Crossings, crossing: usize) -> bool {
        debug_assert!(crossing < x.curves.crossing.len());
        self.on_mirror[EdgeId::new(self.edge_of[crossing] as usize)]
    }

    /// The side of a final face that no base edge on the mirror passes.
    fn is_front(&self, x: &Crossings, f: FaceId) -> Result<bool, OverlayError> {
        let h = x.flat.face_halfedges(f);
        let known = h.into_iter().find_map(|h| {
            let touched = self.touched[x.flat.edge(h)];
            self.mirror_left[h].or(touched)
        });
        known.ok_or_else(|| OverlayError::inconsistent("final face", f.index()))
    }
}
