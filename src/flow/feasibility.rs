//! Whether a circle packing with the prescribed curvature can exist: constraint (6) of the tutorial, for every vertex set.
//!
//! *Enters:* connectivity, Φ, prescription. *Leaves:* nothing, or the regions that break (6), with both sides.
//!
//! In a face whose circles meet at angles in [0, π/2] the corners of a vertex set I, one, two or three of the
//! face's, have angles that sum to less than h = π − Φ(opposite edge), π or exactly π, and to more than 0, Φ(their
//! edge) or exactly π. Summed over all faces, with Θ the prescribed cone angles (2π − K̄ inside, π − K̄ on the boundary),
//!
//! Σ_I Θ < Σ_faces h          (on a closed surface this is (6) as printed, by χ(F_I)),
//! Σ_I Θ > Σ_faces h'         (that is (6) of the complement, by Gauss–Bonnet).
//!
//! Where the boundary is free, sets hold interior vertices only, since curvature on the boundary is not prescribed, and both
//! are needed: none follows from the other.
//!
//! # Deciding it for all sets
//!
//! h is what the corners of a face can hold together when each holds at most π − Φ(opposite edge) and all
//! three π; for two this is π *because* Φ ≤ π/2. So (6) asks whether every vertex can hand its cone angle out to its corners,
//! and by max-flow min-cut one maximum flow decides it for all sets at once (`network`):
//!
//! ```text
//! source ── Θ_i ── vertex i ── π − Φ(opposite edge) ── face ── π ── sink
//! ```
//!
//! All vertices of a free boundary are one vertex, which takes what the interior leaves. If the flow falls short, the vertices
//! still reached from the source break (6). If it is complete, (6) holds with ≤, and with < exactly where residual arcs
//! lead from each vertex to each other (`transport`). The flow starts from the angles nearest to equilateral
//! (`angles`), which break bounds near strong cones only, so little is left to be sent.
//!
//! # Margin
//!
//! Connectivity repair wants more than existence: a packing that hardly exists has circles that differ in size by more than
//! float64 can hold. With margin ρ ≥ 1 everything is multiplied by ρ but what a single corner holds: the angles
//! ρΘ are asked for, a face holds ρπ. In terms of (6) the right side, Σ over the link of π − Φ, must be ρ times the
//! left one. Submodularity needs corners of at least ρπ/2, so the margin shrinks where π − Φ is less, and is none
//! at Φ = π/2; a packing that fits with a margin fits without.
//!
//! # Exact
//!
//! All of it is counted in integers, as multiples of a small fraction of π; `exact` tells which multiples the doubles stand
//! for, and why no sum overflows. So (6) with equality, a −4π cone at valence 6 with Φ ≡ 0, is found out as surely as a deficit.
//! Floating point serves only to start the flow where it nearly ends.
//!
//! *Guaranteed:* the verdict, for those numbers, with totals that meet Gauss–Bonnet; a region that is returned breaks (6), and no set has
//! less slack than the regions together. *Not guaranteed:* that float64 can hold a packing that exists: circles around a
//! region with little slack differ in size by about its inverse.

mod angles;
mod constraint;
mod exact;
mod network;
#[cfg(test)]
mod tests;
mod transport;

pub use constraint::{Constraint, Region, Side, Slack};

use crate::flow::cones::in_pi;
use crate::geometry::ids::VertexId;
use std::f64::consts::PI;
use std::fmt;

/// A set of vertices for which no circle packing exists.
#[derive(Clone, Debug, PartialEq)]
pub struct Violation {
    /// A vertex of the set: the one with the strongest curvature of the wrong sign.
    pub vertex: VertexId,
    /// Number of vertices in the set.
    pub size: usize,
    /// The set, ascending.
    pub vertices: Vec<VertexId>,
    /// Which way it fails.
    pub side: Side,
    /// Prescribed curvature of the set, radians.
    pub curvature: f64,
    /// What it must exceed ([`Side::Below`]) or stay under ([`Side::Above`]), radians.
    pub bound: f64,
    /// Minus what is missing, radians; 0 exactly where both sides are equal.
    pub slack: f64,
}

/// Most vertices of a region that a message lists.
const LISTED: usize = 8;

impl Violation {
    /// Both sides of (6), without what follows from it.
    pub fn inequality(&self) -> String {
        let vertex = self.vertex;
        let set = match self.size {
            0 | 1 => format!("vertex {vertex}"),
            size => {
                let listed: Vec<String> = (self.vertices.iter().take(LISTED))
                    .map(VertexId::to_string)
                    .collect();
                let more = if self.vertices.len() > LISTED {
                    ", …"
                } else {
                    ""
                };
                let listed = listed.join(", ");
                format!("the region of {size} vertices around vertex {vertex} ({listed}{more})")
            }
        };
        let (relation, too) = match self.side {
            Side::Below => ("more", "little"),
            Side::Above => ("less", "much"),
        };
        let (bound, given) = (in_pi(self.bound), in_pi(self.curvature));
        let prescribed = match self.slack == 0.0 {
            true => "exactly that is prescribed".to_owned(),
            false if bound == given => {
                format!("{given} is prescribed, {:.1e}π too {too}", -self.slack / PI)
            }
            false => format!("{given} is prescribed"),
        };
        format!("{set} must have {relation} than {bound} of curvature by (6), but {prescribed}")
    }
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "no circle packing exists: {}; let connectivity repair split edges there (connectivity.enabled = true), move the cones, or use the scheme `vertex-scaling` with flow.delaunay = true",
            self.inequality()
        )
    }
}

impl std::error::Error for Violation {}

/// Decides (6). Where it fails, the error is the worst region. For the meaning of (6) itself the margin must be 1.
pub fn check(constraint: &mut Constraint) -> Result<(), Violation> {
    // The worst; of equals the first.
    let regions = constraint.offending_regions().into_iter();
    match regions.min_by(|a, b| a.slack.total_cmp(&b.slack)) {
        Some(region) => Err(constraint.violation(region)),
        None => Ok(()),
    }
}
