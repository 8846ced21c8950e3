//! What the flow is asked for: a curvature for every vertex.
//!
//! *Enters:* curvatures, and what happens on the boundary. *Leaves:* a [`Prescription`]. How one is chosen is told in
//! [`super::cones`].

use crate::flow::features::Feature;
use crate::flow::field::{CrossField, Moved};
use crate::flow::opened::Opened;
use crate::flow::signature::Signature;
use crate::flow::surface_delaunay::SurfaceDelaunay;
use crate::geometry::ids::{HalfedgeId, VertexId, VertexVec};
use std::sync::Arc;

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
    /// Where the cones are those of a cross field, what else it says; `None` leaves turnings to the flow.
    pub field: Option<Box<FromField>>,
}

/// What a cross field prescribes for flows to quarter turns beside curvatures.
#[derive(Clone, Debug)]
pub struct FromField {
    /// Chains of edges that shall become lines, the most important first; some may be given up.
    pub features: Vec<Feature>,
    /// Features that leave no room for the corners of a field.
    pub crowded: Vec<Feature>,
    /// Part of the length of sharp edges that is in no feature, see [`Features`](crate::flow::features::Features).
    pub left_out: f64,
    /// Both sides of the edges of every feature, as halfedges of the own part of the [`LoopedSurface`](crate::flow::looped::LoopedSurface) that is cut open along all of them.
    pub sides: Vec<Vec<[HalfedgeId; 2]>>,
    /// The field on that part.
    pub field: CrossField,
    /// Its cone angles and turnings there.
    pub signature: Signature,
    /// The surface that is cut open along all features, with the triangulation that the field is on.
    pub ground: Arc<(Opened, SurfaceDelaunay)>,
    /// Quarter turns that were moved from vertex to vertex so that a grid can have the cones.
    pub moved: Moved,
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
            field: None,
        }
    }
}
