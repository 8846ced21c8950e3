//! What a user may choose about connectivity repair, and why it fails.

use crate::flow::feasibility::Violation;
use crate::flow::ricci::FlowParams;

/// What connectivity repair shall reach.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RefineParams {
    /// False leaves the connectivity as it is. Absent: true where the flow keeps the connectivity, false where it flips edges,
    /// since it hardly buys anything there; see [`is_enabled`](Self::is_enabled).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub enabled: Option<bool>,
    /// Rings around each cone whose vertices get `ring_valence`, 0 to 3.
    pub rings: usize,
    /// Least valence of the vertices in those rings, 3 to 8.
    pub ring_valence: usize,
    /// Least valence of all other interior vertices, 0 to 4; 4 removes the valence-3 vertices that the packings with
    /// intersecting circles cannot flatten.
    pub flat_vertex_valence: usize,
}

impl Default for RefineParams {
    fn default() -> Self {
        Self {
            enabled: None,
            rings: 2,
            ring_valence: 6,
            flat_vertex_valence: 0,
        }
    }
}

/// Why the criteria were not reached.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RefineError {
    /// A parameter is out of range.
    #[error("connectivity.{key} is {given}, but must be {low} to {high}")]
    OutOfRange {
        /// Key.
        key: &'static str,
        /// Given.
        given: usize,
        /// Least allowed.
        low: usize,
        /// Most allowed.
        high: usize,
    },
    /// The bound on splits was reached.
    #[error(
        "{splits} splits did not give the neighbourhoods of the {cones} cones enough edges: set connectivity.rings = {}, spread the curvature over more cones, or refine the mesh there",
        rings.saturating_sub(1)
    )]
    TooManySplits {
        /// Splits made.
        splits: usize,
        /// Number of cones.
        cones: usize,
        /// Rings asked for.
        rings: usize,
    },
    /// No number of splits that was tried made room for a circle packing.
    #[error(
        "no circle packing exists, even after {splits} splits around such regions: {}; spread the curvature over more cones, move them, or use the scheme `vertex-scaling` with flow.delaunay = true", violation.inequality()
    )]
    StillInfeasible {
        /// Splits made.
        splits: usize,
        /// The worst region that is left; vertices of the file.
        violation: Violation,
    },
}

impl RefineParams {
    /// Whether connectivity is repaired before this flow. Packings exist only where (6) holds, and schemes that keep the
    /// connectivity break fewer triangles for it. With flips a metric exists always, and splits hardly change its quality but
    /// enlarge the overlay (benches/README.md has the figures).
    pub fn is_enabled(&self, flow: &FlowParams) -> bool {
        self.enabled.unwrap_or(!flow.flips())
    }

    pub(super) fn check(&self) -> Result<(), RefineError> {
        for (key, given, low, high) in [
            ("rings", self.rings, 0, 3),
            ("ring_valence", self.ring_valence, 3, 8),
            ("flat_vertex_valence", self.flat_vertex_valence, 0, 4),
        ] {
            if !(low..=high).contains(&given) {
                return Err(RefineError::OutOfRange {
                    key,
                    given,
                    low,
                    high,
                });
            }
        }
        Ok(())
    }
}
