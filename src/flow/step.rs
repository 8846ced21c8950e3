//! What the flow records of each of its steps, and where it ends.

/// Where no step lowers the error any more, rounding is the limit, and an error up to this is accepted, radians: the achieved
/// one is in the record and in the report.
pub(super) const FLOAT64_FLOOR: f64 = 1e-9;

/// One line of the convergence record.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
pub struct FlowStep {
    /// Number of the iteration, 0 for the state before the first.
    pub iteration: usize,
    /// max |K − K̄| over the vertices that are prescribed, radians.
    pub max_error: f64,
    /// Convex energy, relative to the start.
    pub energy: f64,
    /// Step length taken to come here; 1 is a full Newton step.
    pub step: f64,
    /// Edges flipped to come here. In the first line those that make the triangulation of the surface itself Delaunay; the lines
    /// together count every flip.
    pub flips: usize,
    /// Σε for the gradient flow, the iteration for Newton.
    pub flow_time: f64,
}
