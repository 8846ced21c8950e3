//! Cones where the smoothest cross field is singular: multiples of π/2 that follow the shape.
//!
//! *Enters:* a mesh. *Leaves:* cones and corners of the border, and by how much loops turn in the field, so that a flow to quarter turns can have both.
//! *Guaranteed:* cones have at least three quarter turns and corners at least one, as in a grid of quads. *Not guaranteed:* few cones: there are as many as the
//! shape asks for.

use super::error::ConeError;
use super::request::RequestedCone;
use crate::flow::field::cross_field;
use crate::flow::looped::LoopedSurface;
use crate::flow::metric::face_lengths;
use crate::flow::signature::FULL_TURN;
use crate::flow::surface_delaunay::SurfaceDelaunay;
use crate::geometry::ids::{EdgeVec, FaceVec};
use crate::geometry::mesh::Mesh;
use crate::geometry::triangle;
use std::f64::consts::FRAC_PI_2;

/// Least angle of a cone, quarter turns: around a vertex of two quads these would share two edges.
const LEAST_QUARTERS: i64 = 3;

/// Cones, inside and on the border, and the turning of every loop of [`LoopedSurface`], in quarter turns.
pub(super) fn select(mesh: &Mesh) -> Result<(Vec<RequestedCone>, Vec<i64>), ConeError> {
    let c = &mesh.connectivity;
    let source_length: EdgeVec<f64> = c.edges().map(|e| mesh.edge_length(e)).collect();
    let ground = SurfaceDelaunay::new(c, &source_length)?;
    let surface = LoopedSurface::new(c, &ground)?;
    let (own, length) = (surface.own(), surface.own_length());
    let sides = |f| face_lengths(own, &length, f);
    let angle: Option<FaceVec<[f64; 3]>> =
        own.faces().map(|f| triangle::angles(sides(f))).collect();
    let angle = angle.ok_or(ConeError::FieldOnFlatFaces)?;
    let area = own.faces().map(|f| triangle::area(sides(f)).unwrap_or(0.0));
    let area: FaceVec<f64> = area.collect();
    let mut field = cross_field(own, &angle, &area)?;
    let (signature, _) = field.grid_signature(&surface, &angle, LEAST_QUARTERS)?;
    let cone = |v| {
        let curvature = (FULL_TURN - signature.cone[v]) as f64 * FRAC_PI_2;
        // On the border the double has twice the curvature.
        RequestedCone {
            vertex: v,
            named: mesh.source_vertex[v],
            curvature: match c.is_boundary_vertex(v) {
                true => 0.5 * curvature,
                false => curvature,
            },
        }
    };
    let cones = c.vertices().filter(|&v| signature.cone[v] != FULL_TURN);
    Ok((cones.map(cone).collect(), signature.turning))
}
