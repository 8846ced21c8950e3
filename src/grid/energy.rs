//! The energy of a map to the grid, and what it is made of.
//!
//! *Enters:* a [`GridMap`]. *Leaves:* Σ area (‖J‖² + ‖J⁻¹‖²) over its faces for any places of its vertices, with derivatives face by face; infinite where a face has no area.

use super::complex::turned;
use super::density::Units;
use super::dirichlet::{Rest, first_root, turned_back};
use super::fan::Around;
use super::map::{Corners, Freedom, GridMap};
use super::system::Derivatives;
use crate::geometry::ids::{FaceId, FaceVec, VertexId};
use rayon::prelude::*;

/// Faces a piece of work has at least.
const PIECE: usize = 1024;

/// Where vertices are, each in a frame of its own.
pub(super) type Places = [[f64; 2]];

/// See the module docs.
pub(super) struct Energy {
    /// All faces in the plane, unstretched.
    rest: FaceVec<Rest>,
    /// Those of which a vertex may move: the energy of the others is what it is.
    pub faces: Vec<FaceId>,
    pub corners: Corners,
    /// Energy of the others.
    others: f64,
    /// Area of all faces.
    pub area: f64,
}

impl Energy {
    pub fn new(map: &GridMap, unit: &Units) -> Self {
        let c = &map.sheet.fine.connectivity;
        let rest: FaceVec<Rest> = c.faces().map(|f| rest(map, unit, f)).collect();
        let is_fixed = |f: &FaceId| {
            let mut vertices = c.face_vertices(*f).into_iter();
            vertices.all(|v| map.freedom[v] == Freedom::Fixed)
        };
        let (fixed, faces): (Vec<FaceId>, Vec<FaceId>) = c.faces().partition(is_fixed);
        Self {
            corners: Corners::new(map),
            others: fixed.iter().map(|&f| rest[f].energy(map.corners(f))).sum(),
            area: rest.iter().map(|r| r.area).sum(),
            rest,
            faces,
        }
    }

    /// Of all faces.
    pub fn total(&self, place: &Places) -> f64 {
        let of_face = self.faces.par_iter().with_min_len(PIECE);
        let energies: Vec<f64> = of_face.map(|&f| self.of(f, place)).collect();
        self.others + energies.iter().sum::<f64>()
    }

    /// Of one face.
    pub fn of(&self, f: FaceId, place: &Places) -> f64 {
        self.rest[f].energy(self.corners.corners(f, place))
    }

    /// Faces with a vertex that may move, of which ‖J‖² + ‖J⁻¹‖² is greater; ascending.
    pub fn above(&self, density: f64, place: &Places) -> Vec<FaceId> {
        let of_face = self.faces.par_iter().with_min_len(PIECE);
        let above = of_face.filter(|&&f| self.is_above(density, f, place));
        above.copied().collect()
    }

    /// Their area.
    pub fn area_above(&self, density: f64, place: &Places) -> f64 {
        let above = self.above(density, place);
        above.iter().map(|&f| self.rest[f].area).sum()
    }

    pub fn is_above(&self, density: f64, f: FaceId, place: &Places) -> bool {
        self.of(f, place) > density * self.rest[f].area
    }

    /// A face as one of its vertices moves.
    pub fn around(&self, f: FaceId, v: VertexId, place: &Places) -> Around {
        let vertices = self.corners.vertices(f);
        let corner = vertices.iter().position(|&w| w == v.raw()).unwrap_or(0);
        let (corners, turns) = (self.corners.corners(f, place), self.corners.turns(f));
        Around::new(&self.rest[f], corners, corner, turns[corner])
    }

    /// How far vertices may go along `step` before a face has no area; infinity where it always has one.
    pub fn longest(&self, f: FaceId, place: &Places, step: impl Fn(u32) -> [f64; 2]) -> f64 {
        let (vertices, turns) = (self.corners.vertices(f), self.corners.turns(f));
        let d = [0, 1, 2].map(|k| turned(step(vertices[k]), turns[k]));
        first_root(self.corners.corners(f, place), d)
    }

    /// The same for all faces.
    pub fn longest_of_all(&self, place: &Places, step: &Places) -> f64 {
        let of_face = self.faces.par_iter().with_min_len(PIECE);
        let longest = of_face.map(|&f| self.longest(f, place, |v| step[v as usize]));
        longest.reduce(|| f64::INFINITY, f64::min)
    }

    /// Derivatives of a face at given places, in the frame of each vertex.
    pub fn derivatives(&self, f: FaceId, place: &Places) -> Derivatives {
        let (g, h) = self.rest[f].derivatives(self.corners.corners(f, place));
        turned_back(&g, &h, self.corners.turns(f))
    }
}

fn rest(map: &GridMap, unit: &Units, f: FaceId) -> Rest {
    let fine = &map.sheet.fine;
    let in_space = fine.connectivity.face_vertices(f).map(|v| fine.position[v]);
    Rest::new(in_space, unit.of(fine.parent[f]), map.corners(f))
}

/// ‖J‖² + ‖J⁻¹‖² of every face.
pub(super) fn densities(map: &GridMap, unit: &Units) -> impl Iterator<Item = (FaceId, f64)> {
    map.sheet.fine.connectivity.faces().map(|f| {
        let rest = rest(map, unit, f);
        (f, rest.energy(map.corners(f)) / rest.area)
    })
}
