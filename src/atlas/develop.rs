//! Planar embedding of a flat disk (tutorial 5.5).
//!
//! *Enters:* the layout triangulation and its cut. *Leaves:* plane coordinates, one for each vertex of the slit
//! disk, and the error with which the disk closed up; then the same disk with the overlay's faces, each placed inside
//! its cell of the layout.
//!
//! Faces are unfolded one from another, but not as the tutorial does, by multiplying with the
//! quotient of two coordinate differences: after a face of relative size 1e-12 that quotient has lost its direction.
//! Each face carries the *angle* of its first halfedge, a sum of corner angles that never sees a
//! coordinate; positions add `length · e^{i angle}`, so rounding in positions stays where it is. Faces are
//! visited by the size of the edge they are entered through, large first, and breadth first within a
//! factor of two, so that no large face hangs on a small one or at the end of a long chain.

use crate::atlas::cut::{CutGraph, slit_copies};
use crate::atlas::overlay::Layout;
use crate::atlas::plane::{distance, rotation, wrap_angle};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, FaceId, FaceVec, HalfedgeId, HalfedgeVec};
use crate::geometry::triangle::angles;
use rayon::prelude::*;
use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;
use std::f64::consts::PI;

/// The layout triangulation slit and laid out in the plane.
#[derive(Clone, Debug)]
pub struct Unfolded {
    /// The cut, on the layout.
    pub cut: CutGraph,
    /// Plane coordinates of the corners of every layout face, source units.
    pub uv: FaceVec<[[f64; 2]; 3]>,
    /// Angle of halfedge 0 of every layout face in the plane, radians in (−π, π]. It keeps its precision
    /// where a face is too small for its coordinates to tell.
    pub direction: FaceVec<f64>,
    /// Vertex of the slit disk at the corner that a layout halfedge leaves.
    pub copy: HalfedgeVec<u32>,
    /// Number of vertices of the slit disk.
    pub copies: usize,
    /// Largest mismatch that was left when the disk was closed up, source units.
    pub closing_error: f64,
}

impl Unfolded {
    /// Turns the plane about the origin, radians.
    pub fn turn(&mut self, angle: f64) {
        let turn = rotation(angle);
        let corners = self.uv.as_mut_slice().iter_mut().flatten();
        corners.for_each(|p| *p = turn(*p));
        let directions = self.direction.as_mut_slice().iter_mut();
        directions.for_each(|d| *d = wrap_angle(*d + angle));
    }
}

/// The central chart.
#[derive(Clone, Debug)]
pub struct Development {
    /// Plane coordinates of the corners of every face, source units.
    pub uv: FaceVec<[[f64; 2]; 3]>,
    /// Vertex of the slit disk at the corner that a halfedge leaves: a vertex on the cut has several copies.
    pub copy: HalfedgeVec<u32>,
    /// Number of vertices of the slit disk.
    pub copies: usize,
    /// Largest mismatch that was left when the disk was closed up, source units.
    pub closing_error: f64,
}

impl Development {
    /// The overlay's faces in the plane of its layout. `cut` is the layout's cut lifted to the overlay.
    pub fn place(
        overlay: &Connectivity,
        cut: &CutGraph,
        layout: &Layout,
        unfolded: &Unfolded,
    ) -> Self {
        let c = &layout.connectivity;
        let (copy, copies) = slit_copies(overlay, &cut.is_cut);
        // One place a copy: the carriers of its corners agree up to rounding only.
        let mut position = vec![UNPLACED; copies];
        for h in overlay.halfedges() {
            let place = &mut position[copy[h] as usize];
            if place[0].is_nan() {
                *place = layout.place(h, |g| unfolded.uv[c.face(g)][c.corner(g)]);
            }
        }
        let corners = |f| overlay.face_halfedges(f);
        let uv = overlay
            .faces()
            .map(|f| corners(f).map(|h| position[copy[h] as usize]));
        Self {
            uv: uv.collect(),
            copy,
            copies,
            closing_error: unfolded.closing_error,
        }
    }

    /// Turns the chart about the origin, radians.
    pub fn turn(&mut self, angle: f64) {
        let turn = rotation(angle);
        let corners = self.uv.as_mut_slice().iter_mut().flatten();
        corners.for_each(|p| *p = turn(*p));
    }

    /// A chart made up for a test.
    #[cfg(test)]
    pub(crate) fn from_coordinates(
        uv: FaceVec<[[f64; 2]; 3]>,
        copy: HalfedgeVec<u32>,
        copies: usize,
    ) -> Self {
        Self {
            uv,
            copy,
            copies,
            closing_error: 0.0,
        }
    }

    /// Diagonal of the bounding box, source units.
    pub fn diameter(&self) -> f64 {
        diameter(self.uv.iter().flatten().copied())
    }
}

/// Diagonal of the bounding box of points in the plane; 0 where there are none.
pub fn diameter(points: impl Iterator<Item = [f64; 2]>) -> f64 {
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    for p in points {
        for i in 0..2 {
            low[i] = low[i].min(p[i]);
            high[i] = high[i].max(p[i]);
        }
    }
    if low[0] > high[0] {
        return 0.0;
    }
    distance(low, high)
}

/// Why a metric cannot be developed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum DevelopError {
    /// The lengths of a face make no triangle. The flow never lets such a metric out.
    #[error("the flat lengths {}, {} and {} of face {face} make no triangle", length[0], length[1], length[2])]
    BrokenFace {
        /// The face.
        face: FaceId,
        /// Its flat lengths, opposite corners 0 to 2.
        length: [f64; 3],
    },
}

/// Slits the layout along a cut and develops the disk from its largest face.
pub fn develop(layout: &Layout, cut: CutGraph) -> Result<Unfolded, DevelopError> {
    let (connectivity, length) = (&layout.connectivity, &layout.length);
    let (copy, copies) = slit_copies(connectivity, &cut.is_cut);
    let unfolder = Unfolder::new(connectivity, length, &cut, &copy)?;
    let mut largest = (FaceId::new(0), -1.0);
    for f in connectivity.faces() {
        let size = unfolder
            .face_lengths(f)
            .iter()
            .fold(f64::INFINITY, |a, &b| a.min(b));
        if size > largest.1 {
            largest = (f, size);
        }
    }
    let mut board = Board::new(connectivity.face_count(), copies);
    let root = Placement {
        halfedge: connectivity.corner_halfedge(largest.0, 0),
        tail: [0.0, 0.0],
        direction: 0.0,
    };
    let closing_error = unfolder.unfold(root, |_| true, &mut board);
    let mut direction = FaceVec::filled(0.0, connectivity.face_count());
    for &(f, d) in &board.placed {
        direction[f] = d;
    }
    let uv = connectivity
        .faces()
        .map(|f| {
            connectivity
                .face_halfedges(f)
                .map(|h| board.position[copy[h] as usize])
        })
        .collect();
    Ok(Unfolded {
        cut,
        uv,
        direction,
        copy,
        copies,
        closing_error,
    })
}

/// A halfedge laid down in the plane.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// Which.
    pub halfedge: HalfedgeId,
    /// Where its tail lies.
    pub tail: [f64; 2],
    /// Its angle, radians.
    pub direction: f64,
}

/// What has been unfolded so far; may be used again after [`Board::clear`].
pub struct Board {
    /// Position of every slit vertex; NaN where it is not placed.
    pub position: Vec<[f64; 2]>,
    /// The placed faces with the angle of their halfedge 0, in the order they were visited.
    pub placed: Vec<(FaceId, f64)>,
    is_placed: FaceVec<bool>,
    touched: Vec<u32>,
}

const UNPLACED: [f64; 2] = [f64::NAN; 2];

impl Board {
    /// An empty board for a slit disk.
    pub fn new(faces: usize, copies: usize) -> Self {
        Self {
            position: vec![UNPLACED; copies],
            placed: Vec::new(),
            is_placed: FaceVec::filled(false, faces),
            touched: Vec::new(),
        }
    }

    /// Takes everything off, in time proportional to what lies there.
    pub fn clear(&mut self) {
        for copy in self.touched.drain(..) {
            self.position[copy as usize] = UNPLACED;
        }
        for (f, _) in self.placed.drain(..) {
            self.is_placed[f] = false;
        }
    }

    fn put(&mut self, copy: u32, p: [f64; 2]) {
        self.position[copy as usize] = p;
        self.touched.push(copy);
    }
}

/// Unfolds faces of the slit disk one from another.
pub struct Unfolder<'a> {
    connectivity: &'a Connectivity,
    length: &'a EdgeVec<f64>,
    cut: &'a CutGraph,
    copy: &'a HalfedgeVec<u32>,
    angles: FaceVec<[f64; 3]>,
}

impl<'a> Unfolder<'a> {
    /// Prepares the corner angles of all faces.
    pub fn new(
        connectivity: &'a Connectivity,
        length: &'a EdgeVec<f64>,
        cut: &'a CutGraph,
        copy: &'a HalfedgeVec<u32>,
    ) -> Result<Self, DevelopError> {
        let lengths = |face| connectivity.face_edges(face).map(|e| length[e]);
        let faces = (0..connectivity.face_count()).into_par_iter();
        let found = faces.map(|f| angles(lengths(FaceId::new(f))));
        let found: Vec<Option<[f64; 3]>> = found.collect();
        let checked = connectivity.faces().zip(found).map(|(face, angles)| {
            let length = lengths(face);
            angles.ok_or(DevelopError::BrokenFace { face, length })
        });
        let angles: FaceVec<_> = checked.collect::<Result<Vec<_>, _>>()?.into();
        Ok(Self {
            connectivity,
            length,
            cut,
            copy,
            angles,
        })
    }

    /// Flat length of the edge opposite each corner.
    pub fn face_lengths(&self, f: FaceId) -> [f64; 3] {
        self.connectivity.face_edges(f).map(|e| self.length[e])
    }

    /// Corner angle where a halfedge leaves, radians.
    pub fn angle(&self, h: HalfedgeId) -> f64 {
        self.angles[self.connectivity.face(h)][self.connectivity.corner(h)]
    }

    /// Flat length of a halfedge.
    pub fn length(&self, h: HalfedgeId) -> f64 {
        self.length[self.connectivity.edge(h)]
    }

    /// Angle of a halfedge in the plane, from that of halfedge 0 of its face.
    pub fn halfedge_direction(&self, face_direction: f64, h: HalfedgeId) -> f64 {
        face_direction + self.turn(h)
    }

    /// Angle from halfedge 0 of the face to `h`.
    fn turn(&self, h: HalfedgeId) -> f64 {
        let angles = self.angles[self.connectivity.face(h)];
        match self.connectivity.corner(h) {
            0 => 0.0,
            1 => PI - angles[1],
            _ => PI + angles[0],
        }
    }

    /// Lays down the face of `root` and, across edges that are not cut, every face that `allowed` accepts.
    /// Returns the largest mismatch at corners that were already there. The board should be clear.
    pub fn unfold(
        &self,
        root: Placement,
        allowed: impl Fn(FaceId) -> bool,
        board: &mut Board,
    ) -> f64 {
        let c = self.connectivity;
        let l = self.length(root.halfedge);
        let head = step(root.tail, l, root.direction);
        board.put(self.copy[root.halfedge], root.tail);
        board.put(self.copy[c.next(root.halfedge)], head);
        let entrance = |halfedge: HalfedgeId, depth, direction| Entrance {
            class: self.length(halfedge).log2().floor() as i64,
            depth: Reverse(depth),
            halfedge: Reverse(halfedge),
            direction,
        };
        let mut mismatch = 0.0f64;
        let mut queue = BinaryHeap::from([entrance(root.halfedge, 0, root.direction)]);
        while let Some(entered) = queue.pop() {
            let (h, direction) = (entered.halfedge.0, entered.direction);
            let f = c.face(h);
            if board.is_placed[f] {
                continue;
            }
            board.is_placed[f] = true;
            let face_direction = wrap_angle(direction - self.turn(h));
            board.placed.push((f, face_direction));
            let (n, p) = (c.next(h), c.prev(h));
            let tail = board.position[self.copy[h] as usize];
            let head = board.position[self.copy[n] as usize];
            // The apex hangs on the nearer end.
            let apex = if self.length(p) <= self.length(n) {
                step(tail, self.length(p), direction + self.angle(h))
            } else {
                step(head, self.length(n), direction + PI - self.angle(n))
            };
            let there = board.position[self.copy[p] as usize];
            if there[0].is_nan() {
                board.put(self.copy[p], apex);
            } else {
                mismatch = mismatch.max(distance(there, apex));
            }
            for side in c.face_halfedges(f) {
                let Some(t) = c.twin(side).filter(|_| !self.cut.is_cut[c.edge(side)]) else {
                    continue;
                };
                if board.is_placed[c.face(t)] || !allowed(c.face(t)) {
                    continue;
                }
                let across = wrap_angle(self.halfedge_direction(face_direction, side) + PI);
                queue.push(entrance(t, entered.depth.0 + 1, across));
            }
        }
        mismatch
    }
}

/// How a face is entered: through large sides first, then breadth first.
struct Entrance {
    /// Binary logarithm of the side's length, rounded down.
    class: i64,
    depth: Reverse<u32>,
    /// The side.
    halfedge: Reverse<HalfedgeId>,
    /// Its angle, radians.
    direction: f64,
}

impl Entrance {
    fn key(&self) -> (i64, Reverse<u32>, Reverse<HalfedgeId>) {
        (self.class, self.depth, self.halfedge)
    }
}

impl PartialEq for Entrance {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

impl Eq for Entrance {}

impl PartialOrd for Entrance {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Entrance {
    fn cmp(&self, other: &Self) -> Ordering {
        self.key().cmp(&other.key())
    }
}

/// The point at a distance in a direction.
pub fn step(from: [f64; 2], length: f64, direction: f64) -> [f64; 2] {
    let (s, c) = direction.sin_cos();
    [from[0] + length * c, from[1] + length * s]
}
