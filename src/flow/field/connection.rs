//! How directions are carried from face to face.

use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{FaceVec, HalfedgeId, HalfedgeVec};
use std::f64::consts::PI;

/// ρ of every halfedge: a direction φ in the frame of its face is the direction φ + ρ in the frame of the twin's face. `angle`: corner angles,
/// radians. The surface must be closed.
pub(super) fn transport(c: &Connectivity, angle: &FaceVec<[f64; 3]>) -> HalfedgeVec<f64> {
    // Direction of every halfedge in the frame of its face.
    let heading = |h: HalfedgeId| {
        let [_, second, third] = angle[c.face(h)];
        match c.corner(h) {
            0 => 0.0,
            1 => PI - second,
            _ => (PI - second) + (PI - third),
        }
    };
    c.halfedges()
        .map(|h| match c.twin(h) {
            Some(t) => (heading(t) + PI) - heading(h),
            None => 0.0,
        })
        .collect()
}
