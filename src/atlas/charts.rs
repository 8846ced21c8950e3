//! Boundary and node charts, and the transitions from the central chart to them (tutorial 5.4, 5.5).
//!
//! *Enters:* flat lengths, cut graph, central development, target curvatures. *Leaves:* charts whose coordinates are
//! developed at their own origin from the intrinsic lengths (never copied from the central chart, where
//! a small one would have lost its digits), and the rigid motions between them.
//!
//! A boundary chart has two sectors, left and right of its segment, glued along the segment only
//! (method: a face near both sides is in it twice). A node chart is the ring or fan of one node, a sector for each
//! of its copies on the slit disk. No chart is made for interior cones: no planar chart exists there.

use crate::atlas::cut::{CutGraph, Segment};
use crate::atlas::develop::{Board, DevelopError, Development, Placement, Unfolder, step};
use crate::atlas::plane::{RigidMotion, distance, doubled_area, rotate, wrap_angle};
use crate::flow::cones::Prescription;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{
    ChartId, EdgeVec, FaceId, FaceVec, HalfedgeId, SegmentId, VertexId, VertexVec,
};
use std::f64::consts::PI;

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
pub fn chart(
    connectivity: &Connectivity,
    length: &EdgeVec<f64>,
    cut: &CutGraph,
    central: &Development,
    prescription: &Prescription,
) -> Result<Charts, ChartError> {
    let mut maker = ChartMaker {
        c: connectivity,
        cut,
        central,
        unfolder: Unfolder::new(connectivity, length, cut, &central.copy)?,
        board: Board::new(connectivity.face_count(), central.copies),
        region: FaceVec::filled(false, connectivity.face_count()),
    };
    let mut charts = vec![Chart {
        kind: ChartKind::Central,
        faces: Vec::new(),
    }];
    let mut transitions = Vec::new();
    for (i, segment) in cut.segments.iter().enumerate() {
        let sectors = maker.strip(segment);
        let kind = ChartKind::Boundary(SegmentId::new(i));
        maker.add(kind, sectors, &mut charts, &mut transitions);
    }
    for &node in &cut.nodes {
        if has_chart(connectivity, &prescription.target, node) {
            let sectors = maker.ring(node);
            if sectors.len() > usize::from(u8::MAX) {
                return Err(ChartError::TooManySectors {
                    vertex: node,
                    copies: sectors.len(),
                });
            }
            maker.add(
                ChartKind::Node(node),
                sectors,
                &mut charts,
                &mut transitions,
            );
        }
    }
    let gluings = cut.segments.iter().map(|s| maker.gluing(s)).collect();
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

/// Faces of one sector: id, angle of halfedge 0 in the chart, corners in the chart.
type Sector = Vec<(FaceId, f64, [[f64; 2]; 3])>;

struct ChartMaker<'a> {
    c: &'a Connectivity,
    cut: &'a CutGraph,
    central: &'a Development,
    unfolder: Unfolder<'a>,
    board: Board,
    region: FaceVec<bool>,
}

impl ChartMaker<'_> {
    /// Left and right sector of a segment, glued along its middle edge, which lies on the x axis from the origin.
    fn strip(&mut self, segment: &Segment) -> Vec<Sector> {
        let c = self.c;
        let middle = segment.halfedges[segment.halfedges.len() / 2];
        let l = self.unfolder.length(middle);
        let left = Placement {
            halfedge: middle,
            tail: [0.0, 0.0],
            direction: 0.0,
        };
        let left_corners: Vec<HalfedgeId> = segment.halfedges[1..].to_vec();
        let mut sectors = vec![self.side(left, &segment.halfedges, &left_corners)];
        let twins: Vec<HalfedgeId> = segment
            .halfedges
            .iter()
            .filter_map(|&h| c.twin(h))
            .collect();
        if let Some(twin) = c.twin(middle) {
            let right = Placement {
                halfedge: twin,
                tail: [l, 0.0],
                direction: PI,
            };
            // Twin i runs from vertex i + 1 back to vertex i, so all but the last leave an inner vertex.
            sectors.push(self.side(right, &twins, &twins[..twins.len() - 1]));
        }
        sectors
    }

    /// The faces along `edges` and those that touch the copies at `corners`, developed from `root`.
    fn side(&mut self, root: Placement, edges: &[HalfedgeId], corners: &[HalfedgeId]) -> Sector {
        let c = self.c;
        let mut members = Vec::new();
        let mut add = |region: &mut FaceVec<bool>, f: FaceId| {
            if !std::mem::replace(&mut region[f], true) {
                members.push(f);
            }
        };
        for &h in edges {
            add(&mut self.region, c.face(h));
        }
        for &corner in corners {
            // The copy's fan reaches both ways up to the cut or the boundary.
            let open = |h: &HalfedgeId| !self.cut.is_cut[c.edge(*h)];
            let ccw = |&h: &HalfedgeId| Some(c.prev(h)).filter(open).and_then(|p| c.twin(p));
            let cw = |&h: &HalfedgeId| Some(h).filter(open).and_then(|h| c.rotate_cw(h));
            for h in std::iter::successors(Some(corner), ccw) {
                add(&mut self.region, c.face(h));
            }
            for h in std::iter::successors(Some(corner), cw) {
                add(&mut self.region, c.face(h));
            }
        }
        self.board.clear();
        let region = &self.region;
        self.unfolder.unfold(root, |f| region[f], &mut self.board);
        let board = &self.board;
        let sector = board
            .placed
            .iter()
            .map(|&(f, direction)| {
                let corners = c.face_halfedges(f);
                let uv = corners.map(|h| board.position[self.central.copy[h] as usize]);
                (f, direction, uv)
            })
            .collect();
        for f in members {
            self.region[f] = false;
        }
        sector
    }

    /// The faces around a node, the node at the origin, a sector for each of its copies.
    fn ring(&self, node: VertexId) -> Vec<Sector> {
        let c = self.c;
        let start = c
            .outgoing(node)
            .find(|&h| c.is_boundary_vertex(node) || self.cut.is_cut[c.edge(h)])
            .unwrap_or_else(|| c.vertex_halfedge(node));
        let mut sectors: Vec<Sector> = Vec::new();
        let mut direction = 0.0;
        let mut at = Some(start);
        while let Some(h) = at {
            let (next, prev) = (c.next(h), c.prev(h));
            if sectors.is_empty() || self.cut.is_cut[c.edge(h)] {
                sectors.push(Vec::new());
            }
            let angle = self.unfolder.angle(h);
            let mut uv = [[0.0; 2]; 3];
            uv[c.corner(next)] = step([0.0; 2], self.unfolder.length(h), direction);
            uv[c.corner(prev)] = step([0.0; 2], self.unfolder.length(prev), direction + angle);
            let turned = self.unfolder.halfedge_direction(0.0, h);
            if let Some(sector) = sectors.last_mut() {
                sector.push((c.face(h), wrap_angle(direction - turned), uv));
            }
            direction += angle;
            at = c.rotate_ccw(h).filter(|&n| n != start);
        }
        sectors
    }

    fn add(
        &self,
        kind: ChartKind,
        sectors: Vec<Sector>,
        charts: &mut Vec<Chart>,
        transitions: &mut Vec<Transition>,
    ) {
        let to = ChartId::new(charts.len());
        let mut faces = Vec::new();
        for (i, sector) in sectors.into_iter().enumerate() {
            let (motion, residual) = self.motion_to(&sector);
            transitions.push(Transition {
                from: ChartId::new(0),
                to,
                sector: i as u8,
                motion,
                residual,
                faces: sector.len(),
            });
            faces.extend(sector.into_iter().map(|(face, _, uv)| ChartFace {
                face,
                sector: i as u8,
                uv,
            }));
        }
        charts.push(Chart { kind, faces });
    }

    /// Central coordinates to those of a sector: rotation from the faces' directions (which small faces still
    /// know), translation from all corners.
    fn motion_to(&self, sector: &Sector) -> (RigidMotion, f64) {
        let turns = sector.iter().map(|&(f, direction, uv)| {
            (
                direction - self.central.direction[f],
                doubled_area(uv).abs(),
            )
        });
        let rotation = mean_angle(turns);
        let pairs = || {
            sector
                .iter()
                .flat_map(|&(f, _, uv)| self.central.uv[f].into_iter().zip(uv))
        };
        fit(rotation, pairs)
    }

    /// Coordinates on the left of a segment to those on its right.
    fn gluing(&self, segment: &Segment) -> Gluing {
        let c = self.c;
        let sides = || {
            segment
                .halfedges
                .iter()
                .filter_map(|&h| c.twin(h).map(|t| (h, t)))
        };
        let direction = |h: HalfedgeId| {
            let face_direction = self.central.direction[c.face(h)];
            self.unfolder.halfedge_direction(face_direction, h)
        };
        let turns = sides().map(|(h, t)| {
            let turn = direction(t) + PI - direction(h);
            (turn, self.unfolder.length(h))
        });
        let rotation = mean_angle(turns);
        let corner = |h: HalfedgeId| self.central.uv[c.face(h)][c.corner(h)];
        let pairs = || {
            sides().flat_map(|(h, t)| {
                [
                    (corner(h), corner(c.next(t))),
                    (corner(c.next(h)), corner(t)),
                ]
            })
        };
        let (motion, residual) = fit(rotation, pairs);
        Gluing { motion, residual }
    }
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
