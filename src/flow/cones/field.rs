//! Cones where the smoothest cross field is singular: multiples of π/2 that follow the shape.
//!
//! The field is drawn to the directions of principal curvature with the weight w (κ₁ − κ₂)² an area, so that it follows them over lengths of 1 / (κ₁ − κ₂) √w.
//!
//! *Enters:* a mesh, and which edges shall be lines. *Leaves:* cones and corners of the border, and what else the field says, so that a flow to quarter turns can follow it.
//! *Guaranteed:* cones have at least three quarter turns, corners of the border and sectors between features at least one, as in a grid of quads; no more cones inside than were
//! asked for. *Not guaranteed:* few cones where no number is: there are as many as the shape asks for.

use super::error::ConeError;
use super::request::RequestedCone;
use crate::flow::features::{Feature, FeatureParams, Features, features};
use crate::flow::field::{FieldError, GridCones, cross_field, diffused, leans, open_narrow};
use crate::flow::looped::LoopedSurface;
use crate::flow::metric::face_lengths;
use crate::flow::opened::Opened;
use crate::flow::prescription::FromField;
use crate::flow::signature::FULL_TURN;
use crate::flow::surface_delaunay::SurfaceDelaunay;
use crate::geometry::curvature;
use crate::geometry::ids::{
    EdgeId, EdgeVec, FaceVec, HalfedgeId, HalfedgeVec, VertexId, VertexVec,
};
use crate::geometry::mesh::Mesh;
use crate::geometry::triangle;
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// Least angle of a cone, quarter turns: around a vertex of two quads these would share two edges.
const LEAST_QUARTERS: i64 = 3;

/// Distance at which cones of opposite curvature cancel each other, and over which the surface's curvature counts as spread: so much of a side of the grid's cells, which have no place for
/// more, ...
const NEAR: f64 = 2.0 / 3.0;
/// ... but not less than this, in square roots of the component's area: about a cell of a grid of ten thousand quads. Half of the cones of a scan go, and the deviation of the log scale
/// grows by up to a quarter, from 0.064 to 0.079.
const LEAST_NEAR: f64 = 0.01;
/// ... and not more than this: that of forty cells. With fewer cones than their shape asks for, parts of a surface shrink to nothing.
const MOST_NEAR: f64 = 0.1;

/// Length on either side of a border's edge over which teeth are none of the border's directions, in the same unit: about a cell of a grid of two thousand quads.
const RAGGED: f64 = 0.02;

/// The same for features: about three cells. Rims of discs that volumes leave turn to and fro by 50° at every edge.
const ZIGZAG: f64 = 0.06;

/// Most that curvature may weigh in a face, beside an edge: thin ones would say what they do not know.
const MOST_PULL: f64 = 1.0;

/// Part of the features, the least important ones, that are left out at a time where they are too many.
const GIVEN_UP: usize = 8;

/// Cones, inside and on the border, and what else the field says.
pub(super) fn select(
    mesh: &Mesh,
    params: &FeatureParams,
    named: &[EdgeId],
    count: Option<usize>,
) -> Result<(Vec<RequestedCone>, FromField), ConeError> {
    let Features {
        chains: mut kept,
        left_out,
    } = features(mesh, params, named);
    let mut crowded = Vec::new();
    loop {
        match along(mesh, &kept, params, count) {
            // A piece between features that is too small for its corners: with fewer features it is larger.
            Err(ConeError::Field(FieldError::TooFewVertices { .. })) if !kept.is_empty() => {
                crowded.extend(kept.split_off(kept.len() - kept.len().div_ceil(GIVEN_UP)));
            }
            // Faces without width that nothing but a flip across a feature takes away.
            Err(ConeError::FieldOnFlatFaces) if !kept.is_empty() => crowded.append(&mut kept),
            result => {
                let (cones, mut found) = result?;
                found.features = kept;
                found.crowded = crowded;
                found.left_out = left_out;
                return Ok((cones, found));
            }
        }
    }
}

fn along(
    mesh: &Mesh,
    features: &[Feature],
    params: &FeatureParams,
    count: Option<usize>,
) -> Result<(Vec<RequestedCone>, FromField), ConeError> {
    let c = &mesh.connectivity;
    let source_length: EdgeVec<f64> = c.edges().map(|e| mesh.edge_length(e)).collect();
    let edges: Vec<EdgeId> = features.iter().flat_map(|f| &f.edges).copied().collect();
    let opened = Opened::new(c, &edges)?;
    let ground = SurfaceDelaunay::along_features(c, &source_length, &opened, &edges)?;
    let surface = LoopedSurface::along_features(&opened, &ground)?;
    let (own, length) = (surface.own(), surface.own_length());
    let sides = |f| face_lengths(own, &length, f);
    let angle: Option<FaceVec<[f64; 3]>> =
        own.faces().map(|f| triangle::angles(sides(f))).collect();
    let angle = angle.ok_or(ConeError::FieldOnFlatFaces)?;
    let area = own.faces().map(|f| triangle::area(sides(f)).unwrap_or(0.0));
    let area: FaceVec<f64> = area.collect();
    // Faces of the triangulation that was flipped, where their corners are in space.
    let places = opened.vertex.iter().map(|&v| mesh.positions[v]);
    let principal = curvature::principal(own, &places.collect());
    let pull = principal.enumerate().map(|(f, &[x, y])| {
        let (square, weight) = (x * x + y * y, params.curvature * area[f]);
        let weight = weight.min(MOST_PULL / square);
        match square > 0.0 && weight.is_finite() {
            true => [x * x - y * y, 2.0 * x * y].map(|p| weight * p),
            false => [0.0; 2],
        }
    });
    let pull: FaceVec<[f64; 2]> = pull.collect();
    let size = area.iter().sum::<f64>().sqrt();
    let is_feature = surface.is_feature();
    // The halves of an edge on the mirror, of which one is the surface's own.
    let own_side = |h: HalfedgeId| {
        let whole = surface.connectivity;
        let side = whole.edge_halfedge(ground.base.edge(h));
        let is_own = |h: &HalfedgeId| h.index() < own.halfedge_count();
        Some(side)
            .filter(is_own)
            .or(whole.twin(side))
            .unwrap_or(side)
    };
    let sides_of = |feature: &Feature| -> Vec<[HalfedgeId; 2]> {
        let halfedges = feature.edges.iter().map(|&e| c.edge_halfedge(e));
        let pairs = halfedges.filter_map(|h| Some([own_side(h), own_side(c.twin(h)?)]));
        pairs.collect()
    };
    let sides: Vec<Vec<[HalfedgeId; 2]>> = features.iter().map(sides_of).collect();
    let border = |h| (!is_feature[surface.connectivity.edge(h)]).then_some(0);
    let mut lean = leans(own, &angle, &length, border, RAGGED * size);
    // Each side of a feature is a line of its own: at an end on the surface it does not go on as the other.
    let mut side_of = HalfedgeVec::filled(None, own.halfedge_count());
    for (i, f) in features.iter().enumerate() {
        for (&e, &v) in f.edges.iter().zip(&f.vertices) {
            let h = c.edge_halfedge(e);
            for h in [Some(h), c.twin(h)].into_iter().flatten() {
                side_of[own_side(h)] = Some(2 * i + usize::from(c.tail(h) == v));
            }
        }
    }
    let zigzag = leans(own, &angle, &length, |h| side_of[h], ZIGZAG * size);
    let near = size * (NEAR * params.cell).clamp(LEAST_NEAR, MOST_NEAR);
    let even = diffused(own, &angle, &area, near).map_err(FieldError::from)?;
    let narrow = open_narrow(own, &angle, &area, &length);
    own.halfedges()
        .for_each(|h| lean[h] += zigzag[h] + even[h] + narrow[h]);
    let mut field = cross_field(own, &angle, &area, &pull, &lean)?;
    let asked = GridCones {
        least: LEAST_QUARTERS,
        near,
        most: count.unwrap_or(usize::MAX),
    };
    let (signature, moved) = field.grid_signature(&surface, &angle, &asked)?;
    let flat = |v: VertexId| match c.is_boundary_vertex(v) {
        true => FULL_TURN / 2,
        false => FULL_TURN,
    };
    let mut curvature: VertexVec<i64> = c.vertices().map(flat).collect();
    for (sector, &v) in opened.vertex.enumerate() {
        // The double has both halves of the angle.
        let halves = match opened.connectivity.is_boundary_vertex(sector) {
            true => 2,
            false => 1,
        };
        curvature[v] -= signature.cone[sector] / halves;
    }
    let cone = |v| RequestedCone {
        vertex: v,
        named: mesh.source_vertex[v],
        curvature: curvature[v] as f64 * FRAC_PI_2,
    };
    let cones = c.vertices().filter(|&v| curvature[v] != 0);
    let cones = cones.map(cone).collect();
    let found = FromField {
        sides,
        ground: Arc::new((opened, ground)),
        features: Vec::new(),
        crowded: Vec::new(),
        left_out: 0.0,
        field,
        signature,
        moved,
    };
    Ok((cones, found))
}
