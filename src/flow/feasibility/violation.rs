//! A vertex set that breaks (6), and what is said about it.

use crate::flow::pi_multiple::in_pi;
use crate::geometry::ids::VertexId;
use std::f64::consts::PI;
use std::fmt;

/// Which side of the constraint is broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Too little curvature: the cone angles do not fit into the faces around.
    Below,
    /// Too much curvature: the faces around have no room for so small cone angles.
    Above,
}

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
