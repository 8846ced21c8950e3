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
//! and by max-flow min-cut one maximum flow decides it for all sets at once:
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
//! *Guaranteed:* in exact arithmetic, (6) decided. *In float64:* arcs with less than [`ROOM`] left count as full, so a region
//! whose slack is below [`ROOM`] times its corners is taken for one without.

mod angles;
mod constraint;
#[cfg(test)]
mod tests;
mod transport;

pub use constraint::{Constraint, Region, Side, Slack};

use crate::geometry::ids::VertexId;
use std::fmt;

/// Angle, radians, that counts as nothing left, one corner: (6) is strict, rounding of its sums stays far below this,
/// and circles that would have to realise less differ in size by its inverse.
pub const ROOM: f64 = 1e-10;

/// A set of vertices for which no circle packing exists.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Violation {
    /// A vertex of the set: the one with the strongest curvature of the wrong sign.
    pub vertex: VertexId,
    /// Number of vertices in the set.
    pub size: usize,
    /// Which way it fails.
    pub side: Side,
    /// Prescribed curvature of the set, radians.
    pub curvature: f64,
    /// What it must exceed ([`Side::Below`]) or stay under ([`Side::Above`]), radians.
    pub bound: f64,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let vertex = self.vertex;
        match self.size {
            0 | 1 => write!(f, "no circle packing exists: vertex {vertex}")?,
            size => write!(
                f,
                "no circle packing exists: the region of {size} vertices around vertex {vertex}"
            )?,
        }
        let relation = match self.side {
            Side::Below => "more",
            Side::Above => "less",
        };
        write!(
            f,
            " must have {relation} than {:.9} of curvature by (6), but {:.9} is prescribed (radians); raise the valence there by connectivity repair, move the cones, or use the scheme `vertex-scaling` with flow.delaunay = true",
            self.bound, self.curvature
        )
    }
}

impl std::error::Error for Violation {}

/// Decides (6). Where it fails, the error names the first single vertex that breaks it, else the worst region.
/// For the meaning of (6) itself the margin must be 1.
pub fn check(constraint: &mut Constraint) -> Result<(), Violation> {
    let single = constraint.first_offending_vertex();
    let region = single.or_else(|| {
        // The worst; of equals the first.
        let regions = constraint.offending_regions().into_iter();
        regions.min_by(|a, b| a.slack.total_cmp(&b.slack))
    });
    match region {
        Some(region) => Err(constraint.violation(&region)),
        None => Ok(()),
    }
}
