//! Sharp edges of solids, told from noise and from stair steps of volume data.
//!
//! *Enters:* chains of sharp edges. *Leaves:* those that are edges of a solid, as it seems, and those which have a place in a grid.

use super::beside::Beside;
use super::{Feature, is_ridge, noise};
use crate::geometry::ids::{EdgeVec, NONE, VertexId};
use crate::geometry::mesh::Mesh;

/// Fewest edges of a chain that counts where nobody named them: shorter ones are mostly noise, …
pub const LEAST_EDGES: usize = 5;
/// … unless they are as long as this, in square roots of the surface's area, ridges or valleys throughout, have room on both sides, and a flat side or long edges: edges of a solid.
pub const LONG: f64 = 0.05;
/// Least length of a chain of many edges, in square roots of the surface's area: about a side of the cells when there are 2,000. What is shorter has no place in a grid, however
/// many edges it has.
pub const LEAST_LENGTH: f64 = 0.02;
/// Length of edges on average, in square roots of the surface's area, from which a mesh is coarse and its edges are more than noise.
const COARSE: f64 = 0.1;

/// What a chain of sharp edges is.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Kind {
    /// Noise, as it seems, or a step of volume data.
    Noise,
    /// An edge of a solid or between materials, without a place in a grid: few edges, and short or without room on both sides.
    Crowded,
    /// One that shall become a line.
    Line,
}

/// A surface and how much it bends at its edges.
#[derive(Clone, Copy)]
pub(super) struct Surface<'a> {
    pub mesh: &'a Mesh,
    /// Angle between the normals of both sides, radians.
    pub bend: &'a EdgeVec<f64>,
    /// Least of that of sharp edges, radians.
    pub least: f64,
    /// Edges that the user names.
    pub is_named: &'a EdgeVec<bool>,
    /// Square root of its area, source units.
    pub side: f64,
}

impl Surface<'_> {
    /// Edges that the input has: not parts of them.
    fn given_edges(&self, f: &Feature) -> usize {
        let is_given = |v: &&VertexId| self.mesh.source_vertex[**v] != NONE;
        f.vertices[1..].iter().filter(is_given).count()
    }

    fn is_long(&self, f: &Feature) -> bool {
        self.given_edges(f) >= LEAST_EDGES && f.length / self.side >= LEAST_LENGTH
    }

    fn is_named(&self, f: &Feature) -> bool {
        f.edges.iter().any(|&e| self.is_named[e])
    }

    /// What chains are. `lines` are the edges of all of them.
    pub fn kinds(&self, all: &[Feature], lines: &EdgeVec<bool>) -> Vec<Kind> {
        let is_between = |f: &Feature| f.edges.iter().any(|&e| self.bend[e] < self.least);
        let is_given = |f: &Feature| self.is_named(f) || is_between(f);
        let ridges = |f: &Feature| -> Vec<bool> {
            let edges = f.edges.iter();
            edges.map(|&e| is_ridge(self.mesh, e)).collect()
        };
        let ridges: Vec<Vec<bool>> = all.iter().map(ridges).collect();
        let chances: Vec<f64> = ridges.iter().map(|r| noise::chance(r)).collect();
        let tested = all.iter().zip(&chances);
        let tested = tested.filter(|(f, _)| self.is_long(f) && !is_given(f));
        let most = noise::most(tested.map(|(_, &chance)| chance).collect());
        let beside = Beside {
            mesh: self.mesh,
            sharp: lines,
            bend: self.bend,
            least: self.least,
        };
        let kind = |(i, f): (usize, &Feature)| {
            let given_edges = self.given_edges(f);
            let length = f.length / self.side;
            let is_long = self.is_long(f) && (is_given(f) || chances[i] <= most);
            // Long single edges may be sides of a hole of eight.
            let may_be_step = given_edges > 1 || length < LONG;
            let is_solid = || {
                let are_alike = ridges[i].iter().all(|&r| r == ridges[i][0]);
                let is_coarse = length >= COARSE * given_edges as f64;
                let stands_out = || are_alike && (is_coarse || beside.has_flat_side(f));
                (is_long || stands_out()) && !(may_be_step && beside.is_step(f))
            };
            if !is_given(f) && !is_solid() {
                Kind::Noise
            } else if self.is_named(f) || is_long || length >= LONG && beside.has_room(f) {
                Kind::Line
            } else {
                Kind::Crowded
            }
        };
        all.iter().enumerate().map(kind).collect()
    }
}
