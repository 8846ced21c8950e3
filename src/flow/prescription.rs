//! What the flow is asked for: a curvature for every vertex.
//!
//! *Enters:* curvatures, and what happens on the boundary. *Leaves:* a [`Prescription`]. How one is chosen is told in
//! [`super::cones`].

use crate::geometry::ids::{VertexId, VertexVec};

/// Bound on the difference between the total of K̄ and 2πχ, radians, that counts as rounding.
pub const GAUSS_BONNET_TOLERANCE: f64 = 1e-9;

/// What happens on the boundary loops.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BoundaryCondition {
    /// `u` stays where it is on the boundary; curvature falls where it falls (5.2).
    #[default]
    Free,
    /// Every boundary vertex of a loop gets the same curvature (Fig. 9).
    Uniform,
    /// Four boundary vertices of a disk get π/2, the others 0: a rectangle.
    Corners,
    /// Listed boundary vertices get the curvature listed; the others share evenly what Gauss–Bonnet (or the total of
    /// their loop) leaves.
    Prescribed,
}

/// A vertex whose prescribed curvature is not zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Where.
    pub vertex: VertexId,
    /// Prescribed curvature K̄, radians.
    pub curvature: f64,
}

/// The curvature that the flow must reach.
#[derive(Clone, Debug)]
pub struct Prescription {
    /// K̄ of every vertex, radians. Zero and without meaning at boundary vertices where the boundary is free.
    pub target: VertexVec<f64>,
    /// Every vertex with K̄ ≠ 0 (boundary vertices only where the boundary is not free), by vertex.
    pub cones: Vec<Cone>,
    /// What happens on the boundary. `Free` on closed surfaces, where it says nothing.
    pub boundary: BoundaryCondition,
    /// By how many quarter turns every loop of the surface's [`LoopedSurface`](crate::flow::looped::LoopedSurface) shall turn, for flows to quarter turns; `None` leaves
    /// that to the flow.
    pub turning: Option<Vec<i64>>,
}

impl Prescription {
    /// Lists the vertices with K̄ ≠ 0 as cones.
    pub fn new(target: VertexVec<f64>, boundary: BoundaryCondition) -> Self {
        let cones = target
            .enumerate()
            .filter(|(_, k)| **k != 0.0)
            .map(|(vertex, &curvature)| Cone { vertex, curvature })
            .collect();
        Self {
            target,
            cones,
            boundary,
            turning: None,
        }
    }
}
