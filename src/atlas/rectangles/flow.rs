//! A quad flattened to a rectangle by the Ricci flow: π/2 at its four corners, nothing elsewhere.
//!
//! *Enters:* a quad. *Leaves:* a [`Rectangle`]: the quad refined by the triangulation that the flow ended with, on whose faces
//! coordinates in [0, 1] × [0, height] are linear; the height (at most 1) is the modulus of the quad, which the flow finds.
//! *Guaranteed:* the border lies on the sides of the rectangle to the last bit, its corners on the corners. Before they were put there
//! its vertices lay within [`STRAIGHT`] of it.
//! Every prescription of this kind is met (Gauss, Bonnet: 4 · π/2 = 2π χ), whatever the mesh: see [`ricci`].

use super::RectangleError;
use super::quads::Quad;
use super::subdivision::{Corner, Subdivision};
use crate::atlas::cut;
use crate::atlas::develop::{self, Development};
use crate::atlas::overlay::{self, OnBase, Overlay};
use crate::atlas::plane::{distance, rotate};
use crate::flow::cones::{BoundaryCondition, Prescription};
use crate::flow::ricci::{self, FlowParams};
use crate::geometry::ids::{EdgeId, FaceVec, HalfedgeId, HalfedgeVec, NONE, VertexId, VertexVec};
use crate::geometry::mesh::Mesh;
use std::f64::consts::FRAC_PI_2;

/// Largest distance of a border vertex from its side, in diagonals of the rectangle.
pub(super) const STRAIGHT: f64 = 1e-8;

/// A flattened quad.
pub(super) struct Rectangle {
    /// Its faces, subdivided; `uv` of the corners is set, `parent` is a face of the *drawing*, `weights` and `position` are not those
    /// of the surface yet.
    pub fine: Subdivision,
    /// Which vertex of the drawing the first vertices are; all others are new.
    pub known: VertexVec<VertexId>,
    /// Edges on the border, in the order of the border: halfedge of the drawing that each lies on, edge, and the fraction along
    /// that halfedge where it begins.
    pub border: Vec<(HalfedgeId, EdgeId, f64)>,
    /// Height over width.
    pub height: f64,
    /// Which corner of the quad is the origin; the next one lies at (1, 0).
    pub origin: usize,
    /// Largest distance of a border vertex from its side, in diagonals.
    pub bend: f64,
}

/// Flattens a quad of a drawing.
pub(super) fn flatten(
    drawing: &Subdivision,
    quad: &Quad,
    number: usize,
    tolerance: f64,
) -> Result<Rectangle, RectangleError> {
    let disk = &quad.disk;
    let c = &disk.connectivity;
    let corners = quad.corners.map(|place| c.tail(disk.border[place]));
    let mut target = VertexVec::filled(0.0, c.vertex_count());
    for v in corners {
        target[v] = FRAC_PI_2;
    }
    let prescription = Prescription::new(target, BoundaryCondition::Corners);
    let params = FlowParams {
        curvature_tolerance: tolerance,
        ..FlowParams::default()
    };
    let metric =
        ricci::flow(c, &disk.lengths(drawing), &prescription, &params, &()).map_err(|error| {
            RectangleError::Flow {
                quad: number,
                error,
            }
        })?;
    let mesh = Mesh {
        positions: disk.vertex.iter().map(|&v| drawing.position[v]).collect(),
        source_vertex: VertexVec::filled(NONE, c.vertex_count()),
        source_face: (0..c.face_count() as u32).collect(),
        face_material: FaceVec::filled(NONE, c.face_count()),
        attributes: Vec::new(),
        connectivity: c.clone(),
    };
    let Overlay {
        mesh,
        prescription,
        layout,
        on_base,
        ..
    } = overlay::overlay(mesh, metric, prescription)?;
    let cost = layout.cut_cost(&mesh);
    let layout_cut = cut::cut(&layout.connectivity, &cost, &prescription)?;
    let cut = layout.lift(&layout_cut, &mesh.connectivity);
    let unfolded = develop::develop(&layout, layout_cut)?;
    let plane = Development::place(&mesh.connectivity, &cut, &layout, &unfolded);
    let fine = &mesh.connectivity;
    let place = |h: HalfedgeId| plane.uv[fine.face(h)][fine.corner(h)];
    // Base faces, and where on them the corners lie.
    let base = |h: HalfedgeId| -> (HalfedgeId, f64) {
        let f = mesh.source_face[fine.face(h)] as usize;
        let OnBase { side, fraction } = match &on_base {
            Some(on_base) => on_base[h],
            None => OnBase {
                side: fine.corner(h) as u8,
                fraction: 0.0,
            },
        };
        (HalfedgeId::new(3 * f + usize::from(side)), fraction)
    };
    let loops = fine.boundary_loops();
    let border = loops.first().filter(|_| loops.len() == 1);
    let border = border.ok_or(RectangleError::Inconsistent {
        what: "the border of a quad",
    })?;
    let framed = frame(border, &corners, |h| (fine.tail(h), place(h)))?;
    if framed.bend > STRAIGHT {
        return Err(RectangleError::NotStraight {
            quad: number,
            bend: framed.bend,
            bound: STRAIGHT,
        });
    }
    let mut on_border: VertexVec<Option<[f64; 2]>> = VertexVec::filled(None, fine.vertex_count());
    for (&h, &uv) in border.iter().zip(&framed.border) {
        on_border[fine.tail(h)] = Some(uv);
    }
    let uv = |h: HalfedgeId| match on_border[fine.tail(h)] {
        Some(uv) => uv,
        None => framed.place(place(h)),
    };
    let corner = |h: HalfedgeId| {
        let (along, t) = base(h);
        let k = along.index() % 3;
        let mut weights = [0.0; 3];
        weights[k] = 1.0 - t;
        weights[(k + 1) % 3] += t;
        Corner { weights, uv: uv(h) }
    };
    let corner: HalfedgeVec<Corner> = fine.halfedges().map(corner).collect();
    let parent = mesh.source_face.iter().map(|&f| disk.faces[f as usize]);
    let drawn = |&h: &HalfedgeId| {
        let (along, t) = base(h);
        (disk.halfedge(drawing, along), fine.edge(h), t)
    };
    Ok(Rectangle {
        known: disk.vertex.clone(),
        border: border.iter().map(drawn).collect(),
        height: framed.height,
        origin: framed.origin,
        bend: framed.bend,
        fine: Subdivision {
            corner,
            parent: parent.collect(),
            position: mesh.positions,
            connectivity: mesh.connectivity,
        },
    })
}

/// How a developed quad is turned and scaled.
struct Frame {
    from: [f64; 2],
    angle: f64,
    scale: f64,
    height: f64,
    origin: usize,
    bend: f64,
    /// Coordinates of the border, exactly on the sides.
    border: Vec<[f64; 2]>,
}

impl Frame {
    fn turned(&self, p: [f64; 2]) -> [f64; 2] {
        let d = [p[0] - self.from[0], p[1] - self.from[1]];
        rotate(d, -self.angle).map(|x| x / self.scale)
    }

    /// Inside nothing lies beyond the sides but by rounding.
    fn place(&self, p: [f64; 2]) -> [f64; 2] {
        let [x, y] = self.turned(p);
        [x.clamp(0.0, 1.0), y.clamp(0.0, self.height)]
    }
}

/// Lays the longer side between corners along u.
fn frame(
    border: &[HalfedgeId],
    corners: &[VertexId; 4],
    at: impl Fn(HalfedgeId) -> (VertexId, [f64; 2]),
) -> Result<Frame, RectangleError> {
    let error = || RectangleError::Inconsistent {
        what: "the corners of a quad",
    };
    let mut places = [0; 4];
    for (place, &v) in places.iter_mut().zip(corners) {
        *place = border
            .iter()
            .position(|&h| at(h).0 == v)
            .ok_or_else(error)?;
    }
    let points = places.map(|place| at(border[place]).1);
    let side = |k: usize| distance(points[k % 4], points[(k + 1) % 4]);
    let (long, short) = (side(0) + side(2), side(1) + side(3));
    // What is square to rounding begins at the centre.
    let origin = usize::from(short > long * (1.0 + 1e-9));
    let (p, q) = (points[origin], points[origin + 1]);
    let scale = 0.5 * (side(origin) + side(origin + 2));
    let height = 0.5 * (side(origin + 1) + side(origin + 3)) / scale;
    if !(scale > 0.0 && height > 0.0 && height.is_finite()) {
        return Err(error());
    }
    let mut frame = Frame {
        from: p,
        angle: (q[1] - p[1]).atan2(q[0] - p[0]),
        scale,
        height,
        origin,
        bend: 0.0,
        border: vec![[0.0; 2]; border.len()],
    };
    let n = border.len();
    let diagonal = 1.0f64.hypot(height);
    let mut exact = vec![[0.0; 2]; n];
    for k in 0..4 {
        let (from, to) = (places[(origin + k) % 4], places[(origin + k + 1) % 4]);
        let count = (to + n - from) % n;
        for i in 0..count {
            let place = (from + i) % n;
            let [x, y] = frame.turned(at(border[place]).1);
            let inside = [x.clamp(0.0, 1.0), y.clamp(0.0, height)];
            let corner = i == 0;
            exact[place] = match k {
                0 => [if corner { 0.0 } else { inside[0] }, 0.0],
                1 => [1.0, if corner { 0.0 } else { inside[1] }],
                2 => [if corner { 1.0 } else { inside[0] }, height],
                _ => [0.0, if corner { height } else { inside[1] }],
            };
            frame.bend = frame.bend.max(distance([x, y], exact[place]) / diagonal);
        }
    }
    frame.border = exact;
    Ok(frame)
}
