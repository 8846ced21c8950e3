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
mod regions;
#[cfg(test)]
mod tests;
mod transport;
mod violation;

pub use constraint::{Constraint, Region, Slack};
pub use violation::{Side, Violation};

/// Decides (6). Where it fails, the error is the worst region. For the meaning of (6) itself the margin must be 1.
pub fn check(constraint: &mut Constraint) -> Result<(), Violation> {
    // The worst; of equals the first.
    let regions = constraint.offending_regions().into_iter();
    match regions.min_by(|a, b| a.slack.total_cmp(&b.slack)) {
        Some(region) => Err(constraint.violation(region)),
        None => Ok(()),
    }
}
