//! How directions are carried from face to face.

use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{FaceVec, HalfedgeId, HalfedgeVec};
use std::f64::consts::PI;

/// The direction of a halfedge in the frame of its face, radians. `angle`: corner angles of the face, radians.
pub(super) fn heading(c: &Connectivity, angle: &FaceVec<[f64; 3]>, h: HalfedgeId) -> f64 {
    let [_, second, third] = angle[c.face(h)];
    match c.corner(h) {
        0 => 0.0,
        1 => PI - second,
        _ => (PI - second) + (PI - third),
    }
}

/// ρ of every halfedge: a direction φ in the frame of its face is the direction φ + ρ in the frame of the twin's face, and on the boundary in that of the
/// halfedge itself.
pub(super) fn transport(c: &Connectivity, angle: &FaceVec<[f64; 3]>) -> HalfedgeVec<f64> {
    let heading = |h| heading(c, angle, h);
    c.halfedges()
        .map(|h| match c.twin(h) {
            Some(t) => (heading(t) + PI) - heading(h),
            None => -heading(h),
        })
        .collect()
}
