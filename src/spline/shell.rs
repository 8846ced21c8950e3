//! Spline surfaces that share vertices and edges, as CAD programs have them: what a STEP file holds.

use super::surface::{BSplineCurve, BSplineSurface};

/// Faces with their common edges.
#[derive(Clone, Debug, PartialEq)]
pub struct Shell {
    /// Points where edges end.
    pub vertices: Vec<[f64; 3]>,
    /// Edges.
    pub edges: Vec<Edge>,
    /// Faces; the normal ∂u × ∂v points outward.
    pub faces: Vec<Face>,
    /// Whether every edge has a face on both sides.
    pub is_closed: bool,
}

/// An edge.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// Vertices where it begins and ends.
    pub ends: [u32; 2],
    /// It from the first to the second.
    pub curve: BSplineCurve,
}

/// A face: the whole of its surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// Its surface.
    pub surface: BSplineSurface,
    /// Edges around it, counterclockwise seen from outside, and whether each is walked from its first end to its second.
    pub border: Vec<(u32, bool)>,
    /// Of each of them the parameters of the surface where it begins and ends, as it is walked; between, it goes straight and evenly.
    pub places: Vec<[[f64; 2]; 2]>,
}
