//! What the flow yields.

use crate::flow::features::Feature;
use crate::flow::field::Moved;
use crate::flow::intrinsic::Intrinsic;
use crate::flow::opened::Opened;
use crate::flow::packing::PackingFit;
use crate::flow::step::FlowStep;
use crate::geometry::ids::{EdgeVec, VertexVec};

/// How a metric whose transitions are quarter turns was met.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct QuarterTurns {
    /// By how many quarter turns each independent loop turns, and by how much it misses that, radians.
    pub loops: Vec<(i64, f64)>,
    /// Root of the mean square and maximum of λ* − λ⁰ − (u_i + u_j) over the edges of B: 0 where the metric is conformal.
    pub conformal_error: [f64; 2],
    /// Quarter turns that were moved from vertex to vertex so that a grid can have the cones of the field.
    pub moved: Moved,
    /// The features that are straight lines.
    pub lines: Vec<Feature>,
    /// Those that could not be.
    pub given_up: Vec<Feature>,
    /// Part of the length of sharp edges that is in neither, see [`Features`](crate::flow::features::Features).
    pub left_out: f64,
}

/// A flat metric with cones, and how it was reached.
#[derive(Clone, Debug)]
pub struct FlatMetric {
    /// `u` for vertex scaling, `u − ln γ⁰` for packings, so that the lengths below follow from it and the scheme.
    pub log_scale: VertexVec<f64>,
    /// Flat length of every edge, source units: of the surface's own edges, or where there is `intrinsic`, of the edges
    /// of `intrinsic.flat`.
    pub length: EdgeVec<f64>,
    /// The triangulations that the flow with flips went through; `None` where the connectivity stayed.
    pub intrinsic: Option<Box<Intrinsic>>,
    /// Curvature reached at every vertex, radians; also where the boundary is free.
    pub curvature: VertexVec<f64>,
    /// One entry an iteration.
    pub history: Vec<FlowStep>,
    /// max |K − K̄| over the prescribed vertices, radians.
    pub max_curvature_error: f64,
    /// How the surface was cut open along the features that are straight lines; vertices of `intrinsic` are sectors then. `None` where there are none.
    pub opened: Option<Box<Opened>>,
    /// Where the turnings of loops were prescribed too, how they were met.
    pub quarter_turns: Option<Box<QuarterTurns>>,
    /// Fit of the packing, for circle packings that have one.
    pub fit: Option<PackingFit>,
}

impl FlatMetric {
    /// u at every vertex of the surface, or of its double where it has a boundary.
    pub(super) fn scale(&self) -> &VertexVec<f64> {
        match &self.intrinsic {
            Some(intrinsic) => &intrinsic.u,
            None => &self.log_scale,
        }
    }
}
