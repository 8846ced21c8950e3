//! The faces of the overlay: every base face cut along the final edges that pass it, and triangulated.
//!
//! *Enters:* crossings, flat lengths, positions of all overlay vertices, the ground (what lies under final edges). *Leaves:*
//! triangles with flat lengths, and for every corner where it lies on its base face and on the layout. *Guaranteed:* a face that
//! nothing crosses is kept as it is; no vertex but the crossings is added; both sides of an edge have the same length
//! to the last bit.

use super::OverlayError;
use super::crossings::Crossings;
use super::flat_face::{FlatFace, Fractions, OnSide};
use super::layout::Carrier;
use super::mirror::{Half, Under};
use super::polygon::{Faces, Laid, MOST, distances};
use super::slice::{Point, slice};
use crate::geometry::ids::{EdgeVec, FaceId, HalfedgeId, NONE, VertexId};
use crate::geometry::mesh::distance;

/// Where a corner of the overlay lies on its base face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnBase {
    /// Side, from the base corner where it begins.
    pub side: u8,
    /// Fractions of it before the corner of the overlay and behind it; 0 and 1 at the corner where it begins.
    pub fractions: Fractions,
}

/// What lies under final edges.
pub(super) enum Ground {
    /// The whole final triangulation is the layout.
    Whole,
    /// The part of it on the surface's own side.
    Half(Box<Half>),
}

impl Ground {
    pub(super) fn under(&self, x: &Crossings, h: HalfedgeId, piece: usize) -> Option<Under> {
        match self {
            Ground::Whole => Some(Under {
                halfedge: h,
                low: 0.0,
                high: 1.0,
                offset: piece,
            }),
            Ground::Half(half) => half.under(x, h, piece),
        }
    }
}

/// What the overlay is made from.
pub(super) struct Inputs<'a> {
    pub x: &'a Crossings<'a>,
    /// Flat length of every final edge.
    pub length: &'a EdgeVec<f64>,
    /// Number of base faces that are the surface's own.
    pub front_faces: usize,
    /// Overlay vertex of every crossing, [`NONE`] where it is not on the surface.
    pub vertex: &'a [u32],
    /// Position of every overlay vertex.
    pub position: &'a [[f64; 3]],
    pub ground: &'a Ground,
}

/// The faces of the overlay under construction.
pub(super) struct Regions {
    pub faces: Faces,
    /// Base face of every face.
    pub base_face: Vec<u32>,
    /// Of the corner that every halfedge leaves.
    pub on_base: Vec<OnBase>,
    pub carrier: Vec<Carrier>,
    /// For every overlay halfedge along a final edge, in the order they were made: layout halfedge, number of its
    /// piece there, overlay halfedge.
    pub pieces: Vec<(HalfedgeId, u32, HalfedgeId)>,
    /// First entry of `segments` of every front base halfedge.
    segment_first: Vec<u32>,
    /// Overlay halfedge of every segment of every front base halfedge.
    segments: Vec<u32>,
    /// Overlay halfedge along an arc that waits for the other side, at its lowest crossing.
    waiting: Vec<u32>,
}

/// A corner of a region.
#[derive(Clone, Copy)]
struct Corner {
    vertex: VertexId,
    /// The crossing; `None` at a base vertex.
    crossing: Option<usize>,
    on_base: OnBase,
    /// On the border of the final face: halfedge and fractions.
    border: HalfedgeId,
    fractions: Fractions,
    carrier: Carrier,
}

impl Regions {
    pub fn new(inputs: &Inputs) -> Result<Self, OverlayError> {
        let (x, front) = (inputs.x, inputs.front_faces);
        let mut segment_first = Vec::with_capacity(3 * front + 1);
        let mut total = 0;
        for h in (0..3 * front).map(HalfedgeId::new) {
            segment_first.push(total as u32);
            total += x.met(h) + 1;
        }
        segment_first.push(total as u32);
        // A face with n crossings on its sides becomes n + 1 triangles.
        let faces = total - 2 * front;
        if 3 * faces >= NONE as usize {
            return Err(OverlayError::TooLarge { faces });
        }
        let mut regions = Self {
            faces: Faces::with_capacity(faces),
            base_face: Vec::with_capacity(faces),
            on_base: Vec::with_capacity(3 * faces),
            carrier: Vec::with_capacity(3 * faces),
            pieces: Vec::with_capacity(2 * x.curves.crossing.len() + 3 * front),
            segment_first,
            segments: vec![NONE; total],
            waiting: vec![NONE; x.curves.crossing.len()],
        };
        for f in (0..front).map(FaceId::new) {
            let count = x.base.face_halfedges(f).map(|h| x.met(h));
            if count == [0; 3] {
                regions.whole_face(inputs, f)?;
                continue;
            }
            let consistent = slice(count, |polygon| regions.region(inputs, f, polygon))?;
            if !consistent {
                return Err(OverlayError::inconsistent("base face", f.index()));
            }
        }
        regions.pair_segments(inputs)?;
        Ok(regions)
    }

    /// A base face that is a final face too.
    fn whole_face(&mut self, inputs: &Inputs, f: FaceId) -> Result<(), OverlayError> {
        let x = inputs.x;
        let sides = x.base.face_halfedges(f);
        let mut border = [HalfedgeId::new(0); 3];
        for k in 0..3 {
            border[k] = x.coincident(sides[k])?;
        }
        let error = || OverlayError::inconsistent("base face", f.index());
        if (0..3).any(|k| x.flat.next(border[k]) != border[(k + 1) % 3]) {
            return Err(error());
        }
        let length = border.map(|h| inputs.length[x.flat.edge(h)]);
        let laid = self.faces.triangle(x.base.face_vertices(f), length);
        self.base_face.push(f.raw());
        for k in 0..3 {
            let under = inputs.ground.under(x, border[k], 0).ok_or_else(error)?;
            self.on_base.push(OnBase {
                side: k as u8,
                fractions: [0.0, 1.0],
            });
            self.carrier.push(Carrier {
                halfedge: under.halfedge,
                fraction: 0.0,
            });
            self.note_piece(inputs, under.halfedge, 0, laid[k]);
            self.segments[self.segment_first[sides[k].index()] as usize] = laid[k].raw();
        }
        Ok(())
    }

    /// One region of a base face that is crossed.
    fn region(
        &mut self,
        inputs: &Inputs,
        f: FaceId,
        polygon: &[Point],
    ) -> Result<(), OverlayError> {
        let x = inputs.x;
        let n = polygon.len();
        let error = || OverlayError::inconsistent("base face", f.index());
        let halfedge = |p: Point| x.base.corner_halfedge(f, p.side);
        let follows = |p: Point, q: Point| match p.place == x.met(halfedge(p)) {
            true => (q.side, q.place) == ((p.side + 1) % 3, 0),
            false => (q.side, q.place) == (p.side, p.place + 1),
        };
        let mut is_arc = [false; MOST];
        for i in 0..n {
            is_arc[i] = !follows(polygon[i], polygon[(i + 1) % n]);
        }
        let blank = Corner {
            vertex: VertexId::new(0),
            crossing: None,
            on_base: OnBase {
                side: 0,
                fractions: [0.0, 1.0],
            },
            border: HalfedgeId::new(0),
            fractions: [0.0, 1.0],
            carrier: Carrier {
                halfedge: HalfedgeId::new(0),
                fraction: 0.0,
            },
        };
        let mut corners = [blank; MOST];
        // Crossings know on which final halfedge they are, seen from this region.
        for i in 0..n {
            let p = polygon[i];
            corners[i].on_base.side = p.side as u8;
            if p.place == 0 {
                corners[i].vertex = x.base.tail(halfedge(p));
                continue;
            }
            let met = x.meet(halfedge(p), p.place)?;
            let arrives_along_side = !is_arc[(i + n - 1) % n];
            if arrives_along_side != is_arc[i] {
                return Err(error());
            }
            let border = match arrives_along_side {
                true => met.leaves,
                false => x.other(met.leaves)?,
            };
            let vertex = inputs.vertex[met.index];
            if vertex == NONE {
                return Err(error());
            }
            corners[i].vertex = VertexId::new(vertex as usize);
            corners[i].crossing = Some(met.index);
            corners[i].on_base.fractions = x.base_fractions(met.index, halfedge(p));
            corners[i].border = border;
            corners[i].fractions = x.fractions(met.index, border);
        }
        // Base vertices follow from the next corner.
        for i in 0..n {
            if corners[i].crossing.is_some() {
                continue;
            }
            let next = &corners[(i + 1) % n];
            corners[i].border = match (next.crossing, is_arc[i]) {
                (Some(_), true) => next.border,
                (Some(_), false) => x.flat.prev(next.border),
                (None, false) => x.coincident(halfedge(polygon[i]))?,
                (None, true) => return Err(error()),
            };
        }
        let final_face = x.flat.face(corners[0].border);
        if (1..n).any(|i| x.flat.face(corners[i].border) != final_face) {
            return Err(error());
        }
        let under = carriers(inputs, &mut corners[..n], &is_arc).ok_or_else(error)?;
        let laid = self.lay(inputs, f, &corners[..n], final_face);
        for i in 0..n {
            let (p, q, h) = (corners[i], corners[(i + 1) % n], laid.side[i]);
            if let Some(under) = under[i] {
                self.note_piece(inputs, under.halfedge, under.offset, h);
            }
            if is_arc[i] {
                // Every crossing ends one arc of a base face, so the lower one names it.
                let name = p.crossing.into_iter().chain(q.crossing).min();
                let waiting = &mut self.waiting[name.ok_or_else(error)?];
                match std::mem::replace(waiting, NONE) {
                    NONE => *waiting = h.raw(),
                    other => self.faces.pair(HalfedgeId::new(other as usize), h),
                }
            } else {
                let first = self.segment_first[halfedge(polygon[i]).index()] as usize;
                self.segments[first + polygon[i].place] = h.raw();
            }
        }
        Ok(())
    }

    /// Triangulates a region by its shape in the plane and in space.
    fn lay(&mut self, inputs: &Inputs, f: FaceId, corners: &[Corner], final_face: FaceId) -> Laid {
        let (x, n) = (inputs.x, corners.len());
        let face = FlatFace::new(x.flat, inputs.length, final_face);
        let at = |i: usize| -> OnSide { (x.flat.corner(corners[i].border), corners[i].fractions) };
        let flat = distances(n, |i, j| face.distance(at(i), at(j)));
        let position = |i: usize| inputs.position[corners[i].vertex.index()];
        let space = (n > 3).then(|| distances(n, |i, j| distance(position(i), position(j))));
        let mut vertices = [VertexId::new(0); MOST];
        for (vertex, corner) in vertices.iter_mut().zip(corners) {
            *vertex = corner.vertex;
        }
        let laid = self.faces.polygon(&vertices[..n], &flat, space.as_ref());
        for triangle in &laid.triangles[..laid.count] {
            self.base_face.push(f.raw());
            for &i in triangle {
                self.on_base.push(corners[i].on_base);
                self.carrier.push(corners[i].carrier);
            }
        }
        laid
    }

    fn note_piece(&mut self, inputs: &Inputs, under: HalfedgeId, piece: usize, h: HalfedgeId) {
        let flat = inputs.x.flat;
        // Only those that run with their edge are wanted; on half a surface that is known later.
        let against = || flat.edge_halfedge(flat.edge(under)) != under;
        if !(matches!(inputs.ground, Ground::Whole) && against()) {
            self.pieces.push((under, piece as u32, h));
        }
    }

    /// Pairs the segments of base edges.
    fn pair_segments(&mut self, inputs: &Inputs) -> Result<(), OverlayError> {
        let x = inputs.x;
        if self
            .waiting
            .iter()
            .chain(&self.segments)
            .enumerate()
            .any(|(i, &h)| {
                // Arcs have met their other side; segments have been made.
                (i < self.waiting.len()) == (h != NONE)
            })
        {
            return Err(OverlayError::inconsistent(
                "overlay face",
                self.faces.count(),
            ));
        }
        for h in (0..3 * inputs.front_faces).map(HalfedgeId::new) {
            let n = x.met(h);
            let e = x.base.edge(h);
            let forward = x.base.edge_halfedge(e) == h;
            let own = self.segment_first[h.index()] as usize;
            let twin = x
                .base
                .twin(h)
                .filter(|t| t.index() < 3 * inputs.front_faces);
            for i in 0..=n {
                let segment = HalfedgeId::new(self.segments[own + i] as usize);
                match (twin, inputs.ground) {
                    (Some(t), _) => {
                        let across = self.segment_first[t.index()] as usize + n - i;
                        let across = HalfedgeId::new(self.segments[across] as usize);
                        self.faces.pair(segment, across);
                    }
                    (None, Ground::Half(half)) => {
                        let i = if forward { i } else { n - i };
                        let error = || OverlayError::inconsistent("base edge", e.index());
                        let under = half.segment(x, e, i).ok_or_else(error)?;
                        self.pieces.push((under, 0, segment));
                    }
                    (None, Ground::Whole) => {
                        return Err(OverlayError::inconsistent("base edge", e.index()));
                    }
                }
            }
        }
        Ok(())
    }
}

/// Finds what lies under every side along a final edge, then the carriers of all corners. `None` where ranks do not follow
/// each other or a side lies behind the mirror.
fn carriers(
    inputs: &Inputs,
    corners: &mut [Corner],
    is_arc: &[bool; MOST],
) -> Option<[Option<Under>; MOST]> {
    let x = inputs.x;
    let n = corners.len();
    let mut under = [None; MOST];
    for i in 0..n {
        let (p, q) = (&corners[i], &corners[(i + 1) % n]);
        let border = p.border;
        let piece = match p.crossing {
            Some(index) if is_arc[i] => x.rank(index, border) + 1,
            None if is_arc[i] || q.crossing.is_none() => 0,
            _ => continue,
        };
        let ends = match q.crossing {
            Some(index) => q.border == border && x.rank(index, border) == piece,
            None => q.border == x.flat.next(border) && x.count(border) == piece,
        };
        if !ends {
            return None;
        }
        under[i] = Some(inputs.ground.under(x, border, piece)?);
    }
    let inside = under.iter().flatten().next()?.halfedge;
    for i in 0..n {
        let corner = &mut corners[i];
        let incoming = under[(i + n - 1) % n].filter(|_| corner.crossing.is_some());
        corner.carrier = match (under[i].or(incoming), inputs.ground) {
            (Some(under), _) => Carrier {
                halfedge: under.halfedge,
                fraction: (corner.fractions[0] - under.low) / (under.high - under.low),
            },
            (None, Ground::Whole) => Carrier {
                halfedge: corner.border,
                fraction: 0.0,
            },
            (None, Ground::Half(half)) => Carrier {
                halfedge: half.corner_in_cell(inside, corner.border)?,
                fraction: 0.0,
            },
        };
    }
    Some(under)
}
