//! A cross field, and the cones and turnings that it stands for (`docs/method.md`, 8).
//!
//! *Enters:* a triangulation with its corner angles. *Leaves:* a [`CrossField`]: a direction in every face, up to quarter turns, and by how much
//! it turns across every edge; from it a [`Signature`]. *Guaranteed:* signatures are exact multiples of π/2 that meet Gauss–Bonnet; the
//! same bytes for any number of threads. *Not guaranteed:* the field of least energy among all: it is the smoothest section of the bundle of
//! fourth powers (Knöppel, Crane, Pinkall, Schröder 2013) divided by its length.
//!
//! In the frame of a face halfedge `3f` points along 0. Crossing the halfedge h from face f to face g the frame turns by
//! ρ_h, and ω_h = φ_g − φ_f − ρ_h, up to quarter turns, is by how much the field turns. Then Θ̂_v = Θ_v − Σ ω over the edges crossed
//! once counterclockwise around v, and κ̂ = κ − Σ ω along a loop.
//!
//! A boundary edge counts as a face beyond it whose frame points along the edge and whose field is that direction, or where it goes on the whole: so the field is drawn to the border, and around a
//! boundary vertex, from border to border, Θ̂ is a multiple of π/2 as well. On the double the field is mirrored, and turns twice as much across the mirror.

mod connection;
mod diffused;
mod narrow;
mod quarters;
mod ragged;
mod smoothest;
#[cfg(test)]
mod tests;
mod ways;

pub use diffused::diffused;
pub use narrow::open_narrow;
pub use quarters::{GridCones, Moved};
pub use ragged::leans;
pub use smoothest::cross_field;

use crate::flow::holonomy::HolonomyError;
use crate::flow::looped::LoopedSurface;
use crate::flow::signature::Signature;
use crate::flow::solve::SolveError;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{FaceVec, HalfedgeId, HalfedgeVec, VertexId, VertexVec};
use std::f64::consts::FRAC_PI_2;

/// Angles that must be multiples of π/2 are so to this, radians. Rounding leaves about 1e-13.
const ROUNDING: f64 = 1e-6;

/// A direction in every face, up to quarter turns.
#[derive(Clone, Debug, PartialEq)]
pub struct CrossField {
    /// φ, radians from halfedge `3f`.
    pub direction: FaceVec<f64>,
    /// ω: by how much the field turns from the face of a halfedge to that of its twin, on the boundary to the direction of the border, radians; the twin's is its
    /// negative. Between −π/4 and π/4, beside what directions were made to turn less (`lean` of [`cross_field`]), but where cones were moved.
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
    /// There is no more to merge.
    #[error(
        "the field has {left} cones that cannot be merged, as a grid has none of fewer than three quads, but at most {most} are asked for: raise cones.count"
    )]
    TooManyCones {
        /// Number of cones inside.
        left: usize,
        /// Most that are asked for.
        most: usize,
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
    /// Θ̂ of every vertex, quarter turns: 4 where the field is regular inside, 2 where it is on the boundary. `angle`: corner angles, radians, of the triangulation
    /// that the field is on.
    pub fn cones(
        &self,
        connectivity: &Connectivity,
        angle: &FaceVec<[f64; 3]>,
    ) -> Result<VertexVec<i64>, FieldError> {
        let c = connectivity;
        let mut theta = VertexVec::filled(0.0, c.vertex_count());
        for h in c.halfedges() {
            // From the face of h counterclockwise around its tail across the halfedge before h.
            theta[c.tail(h)] += angle[c.face(h)][c.corner(h)] - self.matching[c.prev(h)];
            if c.twin(h).is_none() {
                theta[c.tail(h)] += self.matching[h];
            }
        }
        let mut cone = VertexVec::filled(0, c.vertex_count());
        for (vertex, &theta) in theta.enumerate() {
            cone[vertex] =
                quarters(theta).map_err(|residual| FieldError::BrokenCone { vertex, residual })?;
        }
        Ok(cone)
    }

    /// Cone angles and turnings on the closed surface or on the double. `angle`: corner angles of the surface's own part, radians.
    pub fn signature(
        &self,
        surface: &LoopedSurface,
        angle: &FaceVec<[f64; 3]>,
    ) -> Result<Signature, FieldError> {
        let (c, loops) = (surface.connectivity, &surface.loops);
        loops.check(c)?;
        let own = self.cones(surface.own(), angle)?;
        let cone = match surface.reflection() {
            Some(reflection) => c
                .vertices()
                .map(|v| match v == reflection.vertex[v] {
                    true => 2 * own[v],
                    false => own[v.min(reflection.vertex[v])],
                })
                .collect(),
            None => own,
        };
        let mut turning = loops.turning(c, |corner| self.angle_at(surface, angle, corner));
        for (of, turning) in turning.iter_mut().enumerate() {
            let crossed = loops.passages(of);
            let crossed = crossed.map(|way| self.matching_at(surface, way.leave));
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

    /// The same field where both sides of some features are glued again.
    #[must_use]
    pub fn glued(&self, sides: &[[HalfedgeId; 2]]) -> Self {
        let mut field = self.clone();
        for &[h, t] in sides {
            // From one side to the direction of the feature and on to the other side.
            let turn = self.matching[h] - self.matching[t];
            (field.matching[h], field.matching[t]) = (turn, -turn);
        }
        field
    }

    /// The angle of a corner of the closed surface or the double.
    fn angle_at(
        &self,
        surface: &LoopedSurface,
        angle: &FaceVec<[f64; 3]>,
        corner: HalfedgeId,
    ) -> f64 {
        let c = surface.connectivity;
        let own = match surface.reflection() {
            // The image of the halfedge that leaves a corner ends at the image of the corner.
            Some(r) if corner.index() >= self.matching.len() => c.next(r.halfedge[corner]),
            _ => corner,
        };
        angle[c.face(own)][c.corner(own)]
    }

    /// ω of a halfedge of the closed surface or the double.
    fn matching_at(&self, surface: &LoopedSurface, h: HalfedgeId) -> f64 {
        let Some(reflection) = surface.reflection() else {
            return self.matching[h];
        };
        let image = reflection.halfedge[h];
        let (own, sign) = match h.index() < self.matching.len() {
            true => (h, 1.0),
            false => (image, -1.0),
        };
        let is_on_mirror = surface.connectivity.twin(h) == Some(image);
        sign * self.matching[own] * if is_on_mirror { 2.0 } else { 1.0 }
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
