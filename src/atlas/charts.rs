//! Boundary and node charts, and the transitions from the central chart to them (tutorial 5.4, 5.5).
//!
//! *Enters:* the overlay, its layout triangulation, cut graph and development of both, target curvatures. *Leaves:* charts
//! whose coordinates are developed at their own origin from the layout's flat lengths (never copied from the central
//! chart, where a small one would have lost its digits), and the rigid motions between them. A chart is a set of overlay
//! faces; what is unfolded are the layout's cells under them, in which they are then placed.
//!
//! A boundary chart has two sectors, left and right of its segment, glued along the segment only
//! (`docs/method.md`, 5: a face near both sides is in it twice). A node chart is the ring or fan of one node, a sector for each
//! of its copies on the slit disk. No chart is made for interior cones: no planar chart exists there.

use crate::atlas::cut::{CutGraph, Segment};
use crate::atlas::develop::{Board, DevelopError, Development, Placement, Unfolded, Unfolder};
use crate::atlas::overlay::Layout;
use crate::atlas::plane::{RigidMotion, distance, doubled_area, rotate, wrap_angle};
use crate::flow::prescription::Prescription;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{ChartId, FaceId, FaceVec, HalfedgeId, SegmentId, VertexId, VertexVec};
use std::f64::consts::{FRAC_PI_2, PI};

/// What a chart covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChartKind {
    /// The slit disk.
    Central,
    /// Both sides of one segment.
    Boundary(SegmentId),
    /// The ring or fan of a node.
    Node(VertexId),
}

/// One face of a chart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChartFace {
    /// The face.
    pub face: FaceId,
    /// Which transition of the chart it belongs to.
    pub sector: u8,
    /// Its corners in the chart's coordinates.
    pub uv: [[f64; 2]; 3],
}

/// A chart; the central one lists no faces, its coordinates are the development.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// What it covers.
    pub kind: ChartKind,
    /// Its faces.
    pub faces: Vec<ChartFace>,
}

/// `from` coordinates to `to` coordinates on one sector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transition {
    /// Chart whose coordinates go in; always the central one in the file.
    pub from: ChartId,
    /// Chart whose coordinates come out.
    pub to: ChartId,
    /// Sector of `to`.
    pub sector: u8,
    /// The motion.
    pub motion: RigidMotion,
    /// Largest distance over the overlap's corners, source units.
    pub residual: f64,
    /// Number of faces in the overlap.
    pub faces: usize,
}

/// Takes coordinates left of a segment to those on its right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gluing {
    /// The motion.
    pub motion: RigidMotion,
    /// Largest distance over the corners on the segment, source units.
    pub residual: f64,
}

/// All charts with their transitions.
#[derive(Clone, Debug)]
pub struct Charts {
    /// Chart 0 is the central one.
    pub charts: Vec<Chart>,
    /// Central chart to every sector of every other.
    pub transitions: Vec<Transition>,
    /// One a segment.
    pub gluings: Vec<Gluing>,
}

impl Charts {
    /// Turns every chart so that its first sector lies as in the central one. Where gluings are quarter turns, so are all transitions then.
    pub fn turn_like_central(&mut self) {
        let mut rotation: Vec<Option<f64>> = vec![None; self.charts.len()];
        for t in &mut self.transitions {
            let first = *rotation[t.to.index()].get_or_insert(t.motion.rotation);
            let back = RigidMotion {
                rotation: -first,
                translation: [0.0; 2],
            };
            t.motion = back.after(&t.motion);
        }
        for (chart, rotation) in self.charts.iter_mut().zip(rotation) {
            let turn = crate::atlas::plane::rotation(-rotation.unwrap_or(0.0));
            let corners = chart.faces.iter_mut().flat_map(|f| &mut f.uv);
            corners.for_each(|p| *p = turn(*p));
        }
    }
}

/// Why the charts could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ChartError {
    /// The metric has a face that is no triangle.
    #[error(transparent)]
    Develop(#[from] DevelopError),
    /// A node has more copies than a sector number can count.
    #[error(
        "the cut meets {copies} times at vertex {vertex}, more than the 255 sectors that a node chart can have: move a cone away from there"
    )]
    TooManySectors {
        /// The node.
        vertex: VertexId,
        /// Copies of it on the slit disk.
        copies: usize,
    },
}

/// Curvature below which a node counts as flat, radians: the bound at which a cone is listed.
const FLAT: f64 = 1e-12;

/// Makes boundary charts for all segments, node charts for flat and for boundary nodes, and the motions between them.
///
/// `overlay`, `cut` and `central` are the surface, its cut and its central chart; `unfolded` is the layout's own.
pub fn chart(
    overlay: &Connectivity,
    cut: &CutGraph,
    central: &Development,
    layout: &Layout,
    unfolded: &Unfolded,
    prescription: &Prescription,
) -> Result<Charts, ChartError> {
    let under = &layout.connectivity;
    let unfolder = Unfolder::new(under, &layout.length, &unfolded.cut, &unfolded.copy)?;
    let mut maker = ChartMaker {
        c: overlay,
        cut,
        central,
        layout,
        unfolded,
        unfolder,
        board: Board::new(under.face_count(), unfolded.copies),
        member: FaceVec::filled(false, overlay.face_count()),
        // There are no more cells than layout faces.
        region: vec![false; under.face_count()],
    };
    let mut charts = vec![Chart {
        kind: ChartKind::Central,
        faces: Vec::new(),
    }];
    let mut transitions = Vec::new();
    for (i, (segment, under)) in cut.segments.iter().zip(&unfolded.cut.segments).enumerate() {
        let sectors = maker.strip(segment, under);
        let kind = ChartKind::Boundary(SegmentId::new(i));
        add(kind, sectors, &mut charts, &mut transitions);
    }
    for &node in &cut.nodes {
        if has_chart(overlay, &prescription.target, node) {
            let sectors = maker.ring(node);
            if sectors.len() > usize::from(u8::MAX) {
                return Err(ChartError::TooManySectors {
                    vertex: node,
                    copies: sectors.len(),
                });
            }
            add(
                ChartKind::Node(node),
                sectors,
                &mut charts,
                &mut transitions,
            );
        }
    }
    let segments = unfolded.cut.segments.iter();
    let gluings = segments.map(|s| maker.gluing(s)).collect();
    Ok(Charts {
        charts,
        transitions,
        gluings,
    })
}

/// Flat interior nodes and all nodes on the surface's boundary have a planar neighbourhood.
fn has_chart(c: &Connectivity, target: &VertexVec<f64>, node: VertexId) -> bool {
    c.is_boundary_vertex(node) || target[node].abs() < FLAT
}

/// One sector of a chart.
struct Sector {
    /// Overlay faces with their corners in the chart.
    faces: Vec<(FaceId, [[f64; 2]; 3])>,
    /// Central coordinates to those of the sector.
    motion: RigidMotion,
    /// Largest distance over the corners, source units.
    residual: f64,
}

struct ChartMaker<'a> {
    c: &'a Connectivity,
    cut: &'a CutGraph,
    central: &'a Development,
    layout: &'a Layout,
    unfolded: &'a Unfolded,
    unfolder: Unfolder<'a>,
    board: Board,
    /// Overlay faces that were listed already.
    member: FaceVec<bool>,
    /// Cells that may be unfolded.
    region: Vec<bool>,
}

impl ChartMaker<'_> {
    /// Left and right sector of a segment, glued along its middle layout edge, which lies on the x axis from the origin.
    fn strip(&mut self, segment: &Segment, under: &Segment) -> Vec<Sector> {
        let c = self.c;
        let middle = under.halfedges[under.halfedges.len() / 2];
        let left = Placement {
            halfedge: middle,
            tail: [0.0, 0.0],
            direction: 0.0,
        };
        let faces = self.faces_along(&segment.halfedges, &segment.halfedges[1..]);
        let mut sectors = vec![self.sector(left, faces)];
        let twins: Vec<HalfedgeId> = segment
            .halfedges
            .iter()
            .filter_map(|&h| c.twin(h))
            .collect();
        if let Some(twin) = self.layout.connectivity.twin(middle) {
            let right = Placement {
                halfedge: twin,
                tail: [self.unfolder.length(middle), 0.0],
                direction: PI,
            };
            // Twin i runs from vertex i + 1 back to vertex i, so all but the last leave an inner vertex.
            let faces = self.faces_along(&twins, &twins[..twins.len() - 1]);
            sectors.push(self.sector(right, faces));
        }
        sectors
    }

    /// The overlay faces along `edges` and those that touch the copies at `corners`.
    fn faces_along(&mut self, edges: &[HalfedgeId], corners: &[HalfedgeId]) -> Vec<FaceId> {
        let c = self.c;
        let mut faces = Vec::new();
        let mut add = |f: FaceId| {
            if !std::mem::replace(&mut self.member[f], true) {
                faces.push(f);
            }
        };
        for &h in edges {
            add(c.face(h));
        }
        for &corner in corners {
            // The copy's fan reaches both ways up to the cut or the boundary.
            let open = |h: &HalfedgeId| !self.cut.is_cut[c.edge(*h)];
            let ccw = |&h: &HalfedgeId| Some(c.prev(h)).filter(open).and_then(|p| c.twin(p));
            let cw = |&h: &HalfedgeId| Some(h).filter(open).and_then(|h| c.rotate_cw(h));
            for h in std::iter::successors(Some(corner), ccw) {
                add(c.face(h));
            }
            for h in std::iter::successors(Some(corner), cw) {
                add(c.face(h));
            }
        }
        for &f in &faces {
            self.member[f] = false;
        }
        faces
    }

    /// The faces around a node, the node at the origin, a sector for each of its copies.
    fn ring(&mut self, node: VertexId) -> Vec<Sector> {
        let start = ring_start(self.c, self.cut, node);
        let fans = fans(self.c, self.cut, start);
        // The same fans on the layout, from the same cut edge or boundary edge.
        let under = &self.layout.connectivity;
        let start = match under.is_boundary_vertex(node) {
            true => under.vertex_halfedge(node),
            false => self.layout.carrier(start).halfedge,
        };
        let mut direction = 0.0;
        let mut roots = Vec::new();
        for fan in self::fans(under, &self.unfolded.cut, start) {
            roots.push(Placement {
                halfedge: fan[0],
                tail: [0.0, 0.0],
                direction: wrap_angle(direction),
            });
            direction += fan.iter().map(|&h| self.unfolder.angle(h)).sum::<f64>();
        }
        let faces = |fan: Vec<HalfedgeId>| fan.into_iter().map(|h| self.c.face(h)).collect();
        let faces: Vec<Vec<FaceId>> = fans.into_iter().map(faces).collect();
        let sectors = roots.into_iter().zip(faces);
        sectors
            .map(|(root, faces)| self.sector(root, faces))
            .collect()
    }

    /// Unfolds the cells under some overlay faces from `root` and places the faces in them.
    fn sector(&mut self, root: Placement, faces: Vec<FaceId>) -> Sector {
        let layout = self.layout;
        for &f in &faces {
            self.region[layout.cell_under(f) as usize] = true;
        }
        self.board.clear();
        let region = &self.region;
        let allowed = |f| region[layout.cell[f] as usize];
        self.unfolder.unfold(root, allowed, &mut self.board);
        let (board, copy) = (&self.board, &self.unfolded.copy);
        let corner = |h| layout.place(h, |g| board.position[copy[g] as usize]);
        let place = |f: FaceId| (f, self.c.face_halfedges(f).map(corner));
        let placed: Vec<(FaceId, [[f64; 2]; 3])> = faces.iter().map(|&f| place(f)).collect();
        // Rotation from the layout faces' directions (which small faces still know), translation from all corners.
        let turns = board.placed.iter().map(|&(f, direction)| {
            let uv = self.unfolded.uv[f];
            let weight = doubled_area(uv).abs();
            (direction - self.unfolded.direction[f], weight)
        });
        let rotation = mean_angle(turns);
        let pairs = || {
            let rows = placed.iter();
            rows.flat_map(|&(f, uv)| self.central.uv[f].into_iter().zip(uv))
        };
        let (motion, residual) = fit(rotation, pairs);
        for &f in &faces {
            self.region[layout.cell_under(f) as usize] = false;
        }
        Sector {
            faces: placed,
            motion,
            residual,
        }
    }

    /// Coordinates on the left of a segment of the layout to those on its right.
    fn gluing(&self, segment: &Segment) -> Gluing {
        let c = &self.layout.connectivity;
        let sides = || {
            segment
                .halfedges
                .iter()
                .filter_map(|&h| c.twin(h).map(|t| (h, t)))
        };
        let direction = |h: HalfedgeId| {
            let face_direction = self.unfolded.direction[c.face(h)];
            self.unfolder.halfedge_direction(face_direction, h)
        };
        let turns = sides().map(|(h, t)| {
            let turn = direction(t) + PI - direction(h);
            (turn, self.unfolder.length(h))
        });
        let rotation = mean_angle(turns);
        let corner = |h: HalfedgeId| self.unfolded.uv[c.face(h)][c.corner(h)];
        let pairs = || {
            sides().flat_map(|(h, t)| {
                [
                    (corner(h), corner(c.next(t))),
                    (corner(c.next(h)), corner(t)),
                ]
            })
        };
        let (motion, residual) = fit(snapped(rotation), pairs);
        Gluing { motion, residual }
    }
}

/// Where the walk around a node begins: on the boundary, else at a cut edge.
fn ring_start(c: &Connectivity, cut: &CutGraph, node: VertexId) -> HalfedgeId {
    let cut_edge = |&h: &HalfedgeId| c.is_boundary_vertex(node) || cut.is_cut[c.edge(h)];
    let found = c.outgoing(node).find(cut_edge);
    found.unwrap_or_else(|| c.vertex_halfedge(node))
}

/// The outgoing halfedges from `start` counterclockwise, a new list at every cut edge.
fn fans(c: &Connectivity, cut: &CutGraph, start: HalfedgeId) -> Vec<Vec<HalfedgeId>> {
    let mut fans: Vec<Vec<HalfedgeId>> = Vec::new();
    let ccw = |&h: &HalfedgeId| c.rotate_ccw(h).filter(|&n| n != start);
    for h in std::iter::successors(Some(start), ccw) {
        match fans.last_mut() {
            Some(fan) if !cut.is_cut[c.edge(h)] => fan.push(h),
            _ => fans.push(vec![h]),
        }
    }
    fans
}

fn add(
    kind: ChartKind,
    sectors: Vec<Sector>,
    charts: &mut Vec<Chart>,
    transitions: &mut Vec<Transition>,
) {
    let to = ChartId::new(charts.len());
    let mut faces = Vec::new();
    for (i, sector) in sectors.into_iter().enumerate() {
        transitions.push(Transition {
            from: ChartId::new(0),
            to,
            sector: i as u8,
            motion: sector.motion,
            residual: sector.residual,
            faces: sector.faces.len(),
        });
        faces.extend(sector.faces.into_iter().map(|(face, uv)| ChartFace {
            face,
            sector: i as u8,
            uv,
        }));
    }
    charts.push(Chart { kind, faces });
}

/// Weighted mean of angles that agree up to rounding and whole turns, in (−π, π].
fn mean_angle(turns: impl Iterator<Item = (f64, f64)>) -> f64 {
    let mut first = None;
    let (mut sum, mut total) = (0.0, 0.0);
    for (turn, weight) in turns {
        let base = *first.get_or_insert(turn);
        sum += weight * wrap_angle(turn - base);
        total += weight;
    }
    let correction = if total > 0.0 { sum / total } else { 0.0 };
    wrap_angle(first.unwrap_or(0.0) + correction)
}

/// Radians within which a gluing's rotation is taken for the multiple of π/2 beside it: ten times what a flow may leave of a cone's curvature.
const SNAPPED: f64 = 1e-9;

/// The same angle, or the float64 nearest to the multiple of π/2 that it is but for rounding, so that quarter turns are exact.
fn snapped(rotation: f64) -> f64 {
    let quarters = [0.0, FRAC_PI_2, -FRAC_PI_2, PI];
    let near = |quarter: &f64| wrap_angle(rotation - quarter).abs() <= SNAPPED;
    quarters.into_iter().find(near).unwrap_or(rotation)
}

/// The translation that fits best after a given rotation, and the largest distance that is left.
fn fit<I: Iterator<Item = ([f64; 2], [f64; 2])>>(
    rotation: f64,
    pairs: impl Fn() -> I,
) -> (RigidMotion, f64) {
    let mut sum = [0.0; 2];
    let mut count = 0.0;
    for (p, q) in pairs() {
        let r = rotate(p, rotation);
        sum = [sum[0] + q[0] - r[0], sum[1] + q[1] - r[1]];
        count += 1.0;
    }
    let translation = if count > 0.0 {
        sum.map(|s| s / count)
    } else {
        [0.0; 2]
    };
    let motion = RigidMotion {
        rotation,
        translation,
    };
    let residual = pairs().fold(0.0f64, |worst, (p, q)| {
        worst.max(distance(motion.apply(p), q))
    });
    (motion, residual)
}
