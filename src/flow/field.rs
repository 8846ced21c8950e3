//! A cross field, and the cones and turnings that it stands for (`docs/method.md`, 8).
//!
//! *Enters:* a closed triangulation with its corner angles. *Leaves:* a [`CrossField`]: a direction in every face, up to quarter turns, and by how much
//! it turns across every edge; from it a [`Signature`]. *Guaranteed:* signatures are exact multiples of π/2 that meet Gauss–Bonnet; the
//! same bytes for any number of threads. *Not guaranteed:* the field of least energy among all: it is the smoothest section of the bundle of
//! fourth powers (Knöppel, Crane, Pinkall, Schröder 2013) divided by its length.
//!
//! In the frame of a face halfedge `3f` points along 0. Crossing the halfedge h from face f to face g the frame turns by
//! ρ_h, and ω_h = φ_g − φ_f − ρ_h, up to quarter turns, is by how much the field turns. Then Θ̂_v = Θ_v − Σ ω over the edges crossed
//! once counterclockwise around v, and κ̂ = κ − Σ ω along a loop.

mod connection;
mod quarters;
mod smoothest;
#[cfg(test)]
mod tests;

pub use smoothest::cross_field;

use crate::flow::holonomy::{DualLoops, HolonomyError};
use crate::flow::signature::Signature;
use crate::flow::solve::SolveError;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{FaceVec, HalfedgeVec, VertexId, VertexVec};
use std::f64::consts::FRAC_PI_2;

/// Angles that must be multiples of π/2 are so to this, radians. Rounding leaves about 1e-13.
const ROUNDING: f64 = 1e-6;

/// A direction in every face, up to quarter turns.
#[derive(Clone, Debug, PartialEq)]
pub struct CrossField {
    /// φ, radians from halfedge `3f`.
    pub direction: FaceVec<f64>,
    /// ω: by how much the field turns from the face of a halfedge to that of its twin, radians; the twin's is its negative. Between −π/4 and
    /// π/4 but where cones were moved.
    pub matching: HalfedgeVec<f64>,
}

/// Why there is no field, or no signature.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FieldError {
    /// The surface is not what fields are made on.
    #[error(transparent)]
    Holonomy(#[from] HolonomyError),
    /// The linear system could not be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// The cone angle of a vertex is no multiple of π/2: the matching is not one of a field.
    #[error(
        "the field turns around vertex {vertex} by {residual:e} rad more than a multiple of a quarter turn"
    )]
    BrokenCone {
        /// Vertex.
        vertex: VertexId,
        /// What is left, radians.
        residual: f64,
    },
    /// The turning of a loop is no multiple of π/2: the matching is not one of a field.
    #[error(
        "the field turns along loop {of} by {residual:e} rad more than a multiple of a quarter turn"
    )]
    BrokenLoop {
        /// Loop.
        of: usize,
        /// What is left, radians.
        residual: f64,
    },
    /// There are not enough vertices to spread the curvature over.
    #[error(
        "the surface has {vertices} vertices only, too few for cones of at least {least} quarter turns: refine the mesh"
    )]
    TooFewVertices {
        /// Number of vertices.
        vertices: usize,
        /// Least cone angle asked for, quarter turns.
        least: i64,
    },
}

impl CrossField {
    /// Cone angles and turnings. `angle`: corner angles, radians, of the triangulation that the field is on.
    pub fn signature(
        &self,
        connectivity: &Connectivity,
        angle: &FaceVec<[f64; 3]>,
        loops: &DualLoops,
    ) -> Result<Signature, FieldError> {
        let c = connectivity;
        loops.check(c)?;
        let mut theta = VertexVec::filled(0.0, c.vertex_count());
        for h in c.halfedges() {
            // From the face of h counterclockwise around its tail across the halfedge before h.
            theta[c.tail(h)] += angle[c.face(h)][c.corner(h)] - self.matching[c.prev(h)];
        }
        let mut cone = VertexVec::filled(0, c.vertex_count());
        for (vertex, &theta) in theta.enumerate() {
            cone[vertex] =
                quarters(theta).map_err(|residual| FieldError::BrokenCone { vertex, residual })?;
        }
        let mut turning = loops.turning(c, |corner| angle[c.face(corner)][c.corner(corner)]);
        for (of, turning) in turning.iter_mut().enumerate() {
            let crossed = loops.passages(of).map(|way| self.matching[way.leave]);
            *turning -= crossed.sum::<f64>();
        }
        let turning = turning.into_iter().enumerate();
        let turning = turning.map(|(of, turning)| {
            quarters(turning).map_err(|residual| FieldError::BrokenLoop { of, residual })
        });
        Ok(Signature {
            cone,
            turning: turning.collect::<Result<_, _>>()?,
        })
    }
}

/// An angle in quarter turns, or what is left of it.
fn quarters(angle: f64) -> Result<i64, f64> {
    let turns = (angle / FRAC_PI_2).round();
    let residual = angle - turns * FRAC_PI_2;
    match residual.abs() < ROUNDING {
        true => Ok(turns as i64),
        false => Err(residual),
    }
}
