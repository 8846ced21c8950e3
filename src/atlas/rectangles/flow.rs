//! A quad flattened by the Ricci flow: π/2 at its four corners, nothing elsewhere, which makes it a rectangle.
//!
//! *Enters:* a quad. *Leaves:* a [`Rectangle`]: the quad refined by the triangulation that the flow ended with, the flat lengths along its
//! border, and the height (at most 1) over the width, which is the modulus of the quad: the flow finds it. Where its vertices lie in
//! the rectangle is not said here; see [`place`](super::place).
//! *Guaranteed:* opposite sides are of one length up to [`UNEQUAL`].
//! Every prescription of this kind is met (Gauss, Bonnet: 4 · π/2 = 2π χ), whatever the mesh: see [`ricci`].

use super::RectangleError;
use super::diagonals;
use super::quads::Quad;
use crate::atlas::overlay::{self, Carrier, Layout, OnBase, Overlay};
use crate::flow::prescription::{BoundaryCondition, Prescription};
use crate::flow::ricci::{self, FlowParams};
use crate::geometry::ids::{EdgeId, FaceVec, HalfedgeId, HalfedgeVec, NONE, VertexId, VertexVec};
use crate::geometry::mesh::Mesh;
use crate::geometry::subdivision::{Corner, Subdivision};
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

/// Newton's method takes fifteen steps or so to flatten a quad; one that takes so many is too crowded for float64, and then so are most of the
/// others, of which each is as much work as the flow of the whole surface.
const MOST_STEPS: usize = 60;
/// Largest difference of opposite sides, in widths of the rectangle.
pub(super) const UNEQUAL: f64 = 1e-8;

/// A flattened quad.
pub(super) struct Rectangle {
    /// Its faces, subdivided; `parent` is a face of the *drawing*, `weights` and `position` are not those of the surface yet, and `uv`
    /// is not set.
    pub fine: Subdivision,
    /// Which vertex of the drawing the first vertices are; all others are new.
    pub known: VertexVec<VertexId>,
    /// The border, counterclockwise from the first corner on.
    pub border: Vec<Piece>,
    /// Corners of the quad, counterclockwise: own vertices.
    pub corners: [VertexId; 4],
    /// Height over width.
    pub height: f64,
    /// Which corner of the quad is the origin; the next one lies at (1, 0).
    pub origin: usize,
    /// Difference of opposite sides, in widths.
    pub unequal: f64,
    /// The triangulation that the flow ended with: flat, Delaunay but where the border cut it. Its vertices are the first ones.
    pub layout: Layout,
    /// Where on it the vertices lie that the flow left.
    pub carrier: VertexVec<Carrier>,
    /// How densely it is to be sampled at the vertices of the layout, in units of the mean: evenly, as long as nothing else is asked for. See
    /// [`density`](super::density).
    pub density: VertexVec<f64>,
}

/// An edge on the border of a rectangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Piece {
    /// Halfedge of the drawing that it lies on.
    pub wall: HalfedgeId,
    /// The edge.
    pub edge: EdgeId,
    /// Fraction along the halfedge where it begins.
    pub from: f64,
    /// Flat length, in any unit.
    pub length: f64,
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
        max_newton_steps: MOST_STEPS,
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
        metric,
        layout,
        on_base,
        ..
    } = overlay::overlay(mesh, metric, prescription)?;
    let fine = &mesh.connectivity;
    // Base faces, and where on them the corners lie.
    let base = |h: HalfedgeId| -> (HalfedgeId, [f64; 2]) {
        let f = mesh.source_face[fine.face(h)] as usize;
        let OnBase { side, fractions } = match &on_base {
            Some(on_base) => on_base[h],
            None => OnBase {
                side: fine.corner(h) as u8,
                fractions: [0.0, 1.0],
            },
        };
        (HalfedgeId::new(3 * f + usize::from(side)), fractions)
    };
    let loops = fine.boundary_loops();
    let [border] = &loops[..] else {
        return Err(RectangleError::Inconsistent {
            what: "the border of a quad",
        });
    };
    let piece = |&h: &HalfedgeId| {
        let (along, [from, _]) = base(h);
        Piece {
            wall: disk.halfedge(drawing, along),
            edge: fine.edge(h),
            from,
            length: metric.length[fine.edge(h)],
        }
    };
    let mut border: Vec<HalfedgeId> = border.clone();
    let first = border.iter().position(|&h| fine.tail(h) == corners[0]);
    border.rotate_left(first.unwrap_or(0));
    let pieces: Vec<Piece> = border.iter().map(piece).collect();
    let tails: Vec<VertexId> = border.iter().map(|&h| fine.tail(h)).collect();
    let side = sides(&tails, &corners)?.map(|side| pieces[side].iter().map(|p| p.length).sum());
    let shape = Shape::new(side)?;
    if shape.unequal > UNEQUAL {
        return Err(RectangleError::Unequal {
            quad: number,
            difference: shape.unequal,
            bound: UNEQUAL,
        });
    }
    let corner = |h: HalfedgeId| {
        let (along, [before, behind]) = base(h);
        let k = along.index() % 3;
        let mut weights = [0.0; 3];
        weights[k] = behind;
        weights[(k + 1) % 3] = before;
        Corner {
            weights,
            uv: [0.0; 2],
        }
    };
    let corner: HalfedgeVec<Corner> = fine.halfedges().map(corner).collect();
    let parent = mesh.source_face.iter().map(|&f| disk.faces[f as usize]);
    let carrier = fine
        .vertices()
        .map(|v| layout.carrier(fine.vertex_halfedge(v)));
    let mut carrier = carrier.collect();
    let mut fine = Subdivision {
        corner,
        parent: parent.collect(),
        position: mesh.positions,
        connectivity: mesh.connectivity,
    };
    diagonals::draw(&mut fine, &layout, &mut carrier);
    Ok(Rectangle {
        known: disk.vertex.clone(),
        border: pieces,
        corners,
        height: shape.height,
        origin: shape.origin,
        unequal: shape.unequal,
        carrier,
        density: VertexVec::filled(1.0, layout.connectivity.vertex_count()),
        layout,
        fine,
    })
}

/// The parts of a border, which begins at the first corner, between corners.
pub(super) fn sides(
    tails: &[VertexId],
    corners: &[VertexId; 4],
) -> Result<[Range<usize>; 4], RectangleError> {
    let mut places = [0, 0, 0, 0, tails.len()];
    for (place, &corner) in places.iter_mut().zip(corners) {
        let found = tails.iter().position(|&v| v == corner);
        *place = found.unwrap_or(tails.len());
    }
    let is_in_order = places[0] == 0 && places.windows(2).all(|p| p[0] < p[1]);
    match is_in_order {
        true => Ok([0, 1, 2, 3].map(|k| places[k]..places[k + 1])),
        false => Err(RectangleError::Inconsistent {
            what: "the corners of a quad",
        }),
    }
}

/// What four sides make.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Shape {
    height: f64,
    origin: usize,
    unequal: f64,
}

impl Shape {
    /// Lays the longer side along u.
    fn new(side: [f64; 4]) -> Result<Self, RectangleError> {
        let (long, short) = (side[0] + side[2], side[1] + side[3]);
        // What is square to rounding begins at the centre.
        let origin = usize::from(short > long * (1.0 + 1e-9));
        let (width, height) = match origin {
            0 => (0.5 * long, 0.5 * short),
            _ => (0.5 * short, 0.5 * long),
        };
        let shape = Self {
            height: height / width,
            origin,
            unequal: (side[0] - side[2]).abs().max((side[1] - side[3]).abs()) / width,
        };
        match shape.height > 0.0 && shape.height.is_finite() && shape.unequal.is_finite() {
            true => Ok(shape),
            false => Err(RectangleError::Inconsistent {
                what: "the sides of a quad",
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longer_side_lies_along_u() {
        let shape = Shape::new([1.0, 4.0, 1.0, 4.0 + 4e-9]).unwrap();
        assert_eq!(shape.origin, 1);
        assert!((shape.height - 0.25).abs() < 1e-9);
        assert!((shape.unequal - 1e-9).abs() < 1e-12);
        // What is square up to rounding begins at the first corner.
        assert_eq!(Shape::new([1.0, 1.0 + 1e-10, 1.0, 1.0]).unwrap().origin, 0);
        assert!(Shape::new([0.0; 4]).is_err());
        assert!(Shape::new([1.0, f64::NAN, 1.0, 1.0]).is_err());
    }

    #[test]
    fn sides_lie_between_corners() {
        let tails = [7, 3, 1, 0, 5].map(VertexId::new);
        let corners = [7, 3, 0, 5].map(VertexId::new);
        let found = sides(&tails, &corners).unwrap();
        assert_eq!(found, [0..1, 1..3, 3..4, 4..5]);
        assert!(sides(&tails, &[7, 0, 3, 5].map(VertexId::new)).is_err());
        assert!(sides(&tails, &[7, 3, 0, 2].map(VertexId::new)).is_err());
    }
}
