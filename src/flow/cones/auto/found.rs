//! What a search for cones has found.

/// Share of the least variance of the log scale that counts as hardly more: a quarter of the standard deviation.
const NEAR_COST: f64 = 0.6;

/// Cones, and what they cost.
pub(super) struct Found {
    pub(super) vertices: Vec<usize>,
    pub(super) curvature: Vec<f64>,
    /// By the objective.
    pub(super) cost: f64,
    /// ln of (9) + 1, in the linear picture; 0 where there is nothing to compare with.
    pub(super) distortion: f64,
}

/// The choice that costs least; of those that cost hardly more, the one of least distortion. Among whole quanta a little of the one buys much of
/// the other: a cone of 3/2 π instead of three of π/2 makes (9) many times as large.
pub(super) fn cheapest(found: Vec<Found>) -> Option<Found> {
    let least = found.iter().map(|f| f.cost).fold(f64::INFINITY, f64::min);
    // A variance of nothing may be negative by rounding.
    let hardly_more = least + NEAR_COST * least.abs();
    let near = found.into_iter().filter(|f| f.cost <= hardly_more);
    near.reduce(|a, b| if b.distortion < a.distortion { b } else { a })
}
