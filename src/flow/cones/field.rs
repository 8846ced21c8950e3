//! Cones where the smoothest cross field is singular: multiples of π/2 that follow the shape.
//!
//! *Enters:* a closed mesh. *Leaves:* cones, and by how much loops turn in the field, so that a flow to quarter turns can have both. *Guaranteed:* cones have at
//! least three quarter turns, as in a grid of quads. *Not guaranteed:* few cones: there are as many as the shape asks for.

use super::error::ConeError;
use super::request::RequestedCone;
use crate::flow::field::cross_field;
use crate::flow::holonomy::homology_basis;
use crate::flow::signature::FULL_TURN;
use crate::flow::surface_delaunay::SurfaceDelaunay;
use crate::geometry::ids::{EdgeVec, FaceVec};
use crate::geometry::mesh::Mesh;
use crate::geometry::triangle;
use std::f64::consts::FRAC_PI_2;

/// Least angle of a cone, quarter turns: around a vertex of two quads these would share two edges.
const LEAST_QUARTERS: i64 = 3;

/// Cones, and the turning of every loop of the homology basis of the surface's own Delaunay triangulation, in quarter turns.
pub(super) fn select(mesh: &Mesh) -> Result<(Vec<RequestedCone>, Vec<i64>), ConeError> {
    let c = &mesh.connectivity;
    if !c.is_closed() {
        let boundary_loops = c.boundary_loops().len();
        return Err(ConeError::FieldOnBoundary { boundary_loops });
    }
    let source_length: EdgeVec<f64> = c.edges().map(|e| mesh.edge_length(e)).collect();
    let ground = SurfaceDelaunay::new(c, &source_length)?;
    let (b, length) = (&ground.delaunay, ground.length());
    let sides = |f| b.face_edges(f).map(|e| length[e]);
    let angle: Option<FaceVec<[f64; 3]>> = b.faces().map(|f| triangle::angles(sides(f))).collect();
    let angle = angle.ok_or(ConeError::FieldOnFlatFaces)?;
    let area = b.faces().map(|f| triangle::area(sides(f)).unwrap_or(0.0));
    let area: FaceVec<f64> = area.collect();
    let loops = homology_basis(b)?;
    let mut field = cross_field(b, &angle, &area)?;
    let (signature, _) = field.grid_signature(b, &length, &angle, &loops, LEAST_QUARTERS)?;
    let cones = signature.cone.enumerate().filter(|(_, k)| **k != FULL_TURN);
    let cones = cones.map(|(vertex, quarters)| RequestedCone {
        vertex,
        named: mesh.source_vertex[vertex],
        curvature: (FULL_TURN - quarters) as f64 * FRAC_PI_2,
    });
    Ok((cones.collect(), signature.turning))
}
