//! What lies beside a chain of sharp edges: room for cells, a flat side, or the next step of a stair.
//!
//! *Enters:* a mesh, how much its edges bend, and a chain of sharp ones. *Leaves:* what tells an edge of a solid from noise, from stair steps of volume data and from edges in corners too narrow for cells.

use super::{Feature, corner_angle, is_ridge};
use crate::geometry::ids::{EdgeId, EdgeVec, HalfedgeId, VertexId};
use crate::geometry::mesh::Mesh;
use std::collections::BTreeSet;
use std::f64::consts::{FRAC_PI_3, PI};

/// The angle, radians, between a chain and the next sharp edge at its ends that is room enough for cells.
const SHARPEST: f64 = 29.0 / 180.0 * PI;

/// Part of the least angle of sharp edges by which edges beside a chain may bend on average where that side is flat.
const FLAT_SIDE: f64 = 0.05;

/// Chains that bend by more, radians, are no steps of volume data: a surface between voxels in two classes bends by 35° to 55°.
const STEEP: f64 = FRAC_PI_3;

/// Part of the least angle of sharp edges from which an edge is the other side of a step.
const OTHER_SIDE: f64 = 0.75;

/// Part of a chain along which there must be another side, for a step.
const ALONG: f64 = 0.5;

/// How much longer than its own edges those that meet it may be on average, where it is at the mesh's resolution: beside steps of a solid's faces they are long.
const LONGER: f64 = 2.0;

/// The surface that chains lie on.
#[derive(Clone, Copy)]
pub(super) struct Beside<'a> {
    pub mesh: &'a Mesh,
    pub sharp: &'a EdgeVec<bool>,
    /// Angle between the normals of both sides, radians.
    pub bend: &'a EdgeVec<f64>,
    /// Least of that of sharp edges, radians.
    pub least: f64,
}

impl Beside<'_> {
    fn is_line(&self, e: EdgeId) -> bool {
        self.sharp[e] || self.mesh.connectivity.is_boundary_edge(e)
    }

    /// Whether there is room for cells on both sides of a chain at both ends: the next sharp edge or border is not nearer than [`SHARPEST`], and there is one, unless the chain is closed.
    pub fn has_room(&self, f: &Feature) -> bool {
        let mesh = self.mesh;
        let c = &mesh.connectivity;
        let ends = [
            (f.vertices.first(), f.edges.first()),
            (f.vertices.last(), f.edges.last()),
        ];
        let is_closed = f.vertices.first() == f.vertices.last();
        ends.into_iter().all(|(v, e)| {
            let (Some(&v), Some(&e)) = (v, e) else {
                return false;
            };
            let mut around: Vec<HalfedgeId> = c.outgoing(v).collect();
            let Some(at) = around.iter().position(|&h| c.edge(h) == e) else {
                return false;
            };
            let sum =
                |part: &[HalfedgeId]| part.iter().map(|&h| corner_angle(mesh, h)).sum::<f64>();
            let is_line = |h: &HalfedgeId| self.is_line(c.edge(*h));
            let is_end = around.iter().filter(|h| is_line(h)).count() < 3;
            if is_end && !is_closed && !c.is_boundary_vertex(v) {
                return false;
            }
            // Counterclockwise from this edge to the next line, and clockwise.
            let (left, right) = match c.is_boundary_vertex(v) {
                true => around.split_at(at),
                false => {
                    around.rotate_left(at);
                    (&around[..0], &around[..])
                }
            };
            let next = right.iter().skip(1).position(is_line);
            let next = next.map_or(right.len(), |i| i + 1);
            let before = if left.is_empty() { right } else { left };
            let last = before.iter().rposition(is_line).unwrap_or(0);
            [&right[..next], &before[last..]]
                .map(sum)
                .iter()
                .all(|&angle| angle >= SHARPEST)
        })
    }

    /// Edges that meet the chain on its left and on its right, up to the next lines; on the side of its beginning they may come twice.
    fn sides(&self, f: &Feature) -> [Vec<EdgeId>; 2] {
        let c = &self.mesh.connectivity;
        let mut sides = [Vec::new(), Vec::new()];
        let ends = f.vertices.windows(2);
        for (i, (&e, pair)) in f.edges.iter().zip(ends).enumerate() {
            let h = c.edge_halfedge(e);
            for h in [Some(h), c.twin(h)].into_iter().flatten() {
                let side = usize::from(c.tail(h) != pair[0]);
                // Around the far end of the edge, and where the chain begins around the near one too.
                let mut meet = |mut x: HalfedgeId, next: &dyn Fn(HalfedgeId) -> HalfedgeId| {
                    while !self.is_line(c.edge(x)) {
                        sides[side].push(c.edge(x));
                        match c.twin(x) {
                            Some(t) => x = next(t),
                            None => break,
                        }
                    }
                };
                let is_met = |v: VertexId| v == pair[1] || i == 0;
                if is_met(c.head(h)) {
                    meet(c.next(h), &|t| c.next(t));
                }
                if is_met(c.tail(h)) {
                    meet(c.prev(h), &|t| c.prev(t));
                }
            }
        }
        sides
    }

    /// Whether edges that meet it on one side hardly bend on average; a side without any is not flat.
    pub fn has_flat_side(&self, f: &Feature) -> bool {
        self.sides(f).iter().any(|side| {
            let sum: f64 = side.iter().map(|&e| self.bend[e]).sum();
            !side.is_empty() && sum <= FLAT_SIDE * self.least * side.len() as f64
        })
    }

    /// Whether it is a side of a step of one row of faces, where the mesh is as fine as the step is wide: a ridge where there is a valley across the row, or the reverse. Such are the surfaces of volumes in few classes, and heights in whole numbers; sharp as they are, they say that the
    /// surface passes between.
    pub fn is_step(&self, f: &Feature) -> bool {
        let c = &self.mesh.connectivity;
        if f.angle > STEEP {
            return false;
        }
        let others = self.sides(f).concat();
        let length = |edges: &[EdgeId]| -> f64 {
            let sum: f64 = edges.iter().map(|&e| self.mesh.edge_length(e)).sum();
            sum / edges.len() as f64
        };
        if others.is_empty() || length(&others) > LONGER * length(&f.edges) {
            return false;
        }
        let on_it: BTreeSet<VertexId> = f.vertices.iter().copied().collect();
        // Whether an edge of the other kind, all of it off the chain, ends at a vertex.
        let is_across = |v: VertexId, kind: bool| {
            let ways = c.outgoing(v).flat_map(|h| [h, c.prev(h)]);
            let mut edges = ways.map(|h| c.edge(h));
            let is_off = |e: EdgeId| c.edge_vertices(e).iter().all(|v| !on_it.contains(v));
            let bends = |e: EdgeId| self.bend[e] >= OTHER_SIDE * self.least;
            edges.any(|e| bends(e) && is_off(e) && is_ridge(self.mesh, e) != kind)
        };
        let is_stair = |e: EdgeId| {
            let kind = is_ridge(self.mesh, e);
            let h = c.edge_halfedge(e);
            let mut halves = [Some(h), c.twin(h)].into_iter().flatten();
            halves.any(|h| is_across(c.apex(h), kind))
        };
        let stairs = f.edges.iter().filter(|&&e| is_stair(e));
        let along: f64 = stairs.map(|&e| self.mesh.edge_length(e)).sum();
        along >= ALONG * f.length
    }
}
