//! Both sides of (6) for one vertex set.

use super::exact::{ConeAngle, Exact};
use super::violation::{Side, Violation};
use crate::flow::prescription::BoundaryCondition;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, FaceId, FaceVec, HalfedgeId, VertexId, VertexVec};

/// Vertices, connected by faces, that break (6).
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// The vertices, ascending.
    pub vertices: Vec<VertexId>,
    /// Which way it fails.
    pub side: Side,
    /// How much room is left, radians: zero or negative, but for rounding.
    pub slack: f64,
}

/// Both slacks of one set, radians; (6) holds for it where both are positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slack {
    /// g(I) = Σ_faces h − Σ_I Θ.
    pub upper: f64,
    /// Σ_I Θ − Σ_faces h'.
    pub lower: f64,
}

/// (6) for one connectivity, Φ and prescription.
pub struct Constraint<'a> {
    connectivity: &'a Connectivity,
    target: &'a VertexVec<f64>,
    free_boundary: bool,
    margin: f64,
    exact: Exact,
    vertex_mark: VertexVec<u32>,
    face_mark: FaceVec<u32>,
    mark: u32,
}

impl<'a> Constraint<'a> {
    /// `phi`: intersection angles, radians in [0, π/2]; `None` for Φ ≡ 0. `target`: K̄, radians, one a vertex.
    /// `margin`: ρ of [the module docs](super), 1 to 2, to hundredths; 1 is (6). Which exact numbers all these stand for is told
    /// [there](super), too.
    pub fn new(
        connectivity: &'a Connectivity,
        phi: Option<&EdgeVec<f64>>,
        target: &'a VertexVec<f64>,
        boundary: BoundaryCondition,
        margin: f64,
    ) -> Self {
        let free_boundary = boundary == BoundaryCondition::Free;
        let cone_angles = target.enumerate().map(|(v, &curvature)| {
            let border = connectivity.is_boundary_vertex(v);
            ConeAngle {
                full: if border { 1 } else { 2 },
                curvature,
                prescribed: !(free_boundary && border),
            }
        });
        let counts = [connectivity.edge_count(), connectivity.face_count()];
        Self {
            connectivity,
            target,
            free_boundary,
            margin,
            exact: Exact::new(&cone_angles.collect(), phi, counts, margin),
            vertex_mark: VertexVec::filled(0, connectivity.vertex_count()),
            face_mark: FaceVec::filled(0, connectivity.face_count()),
            mark: 0,
        }
    }

    pub(super) fn connectivity(&self) -> &'a Connectivity {
        self.connectivity
    }

    pub(super) fn exact(&self) -> &Exact {
        &self.exact
    }

    /// False where curvature is not prescribed: on a free boundary.
    pub fn is_prescribed(&self, v: VertexId) -> bool {
        !(self.free_boundary && self.connectivity.is_boundary_vertex(v))
    }

    /// ρ times the cone angle of a prescribed vertex, radians.
    pub(super) fn wanted(&self, v: VertexId) -> f64 {
        self.exact.radians(self.exact.wanted[v])
    }

    /// Most that the corner at the tail of a halfedge can hold.
    pub(super) fn exact_room(&self, h: HalfedgeId) -> i128 {
        self.exact.room[self.connectivity.edge(self.connectivity.next(h))]
    }

    /// Most that the corner at the tail of a halfedge can hold, radians.
    pub fn corner_room(&self, h: HalfedgeId) -> f64 {
        self.exact.radians(self.exact_room(h))
    }

    /// What the three corners of a face hold together, radians.
    pub fn face_room(&self) -> f64 {
        self.exact.radians(self.exact.whole)
    }

    /// Slacks of any set of prescribed vertices, rounded once each: their signs are exact. A vertex named twice counts once.
    pub fn slack(&mut self, set: &[VertexId]) -> Slack {
        let [upper, lower] = self.exact_slacks(set);
        Slack {
            upper: self.exact.radians(upper),
            lower: self.exact.radians(lower),
        }
    }

    /// g(I) = Σ_faces h − Σ_I Θ and Σ_I Θ − Σ_faces h'.
    pub(super) fn exact_slacks(&mut self, set: &[VertexId]) -> [i128; 2] {
        self.mark += 1;
        let mark = self.mark;
        let mut wanted = 0;
        for &v in set {
            if self.vertex_mark[v] != mark {
                self.vertex_mark[v] = mark;
                wanted += self.exact.wanted[v];
            }
        }
        let (mut most, mut least) = (0, 0);
        let whole = self.exact.whole;
        for &v in set {
            for h in self.connectivity.outgoing(v) {
                let face = self.connectivity.face(h);
                if self.face_mark[face] == mark {
                    continue;
                }
                self.face_mark[face] = mark;
                let corners = self.connectivity.face_halfedges(face);
                let inside = corners.map(|h| self.vertex_mark[self.connectivity.tail(h)] == mark);
                // What the one corner holds that differs from the other two, if any.
                let odd = |value: bool| {
                    let corner = inside.iter().position(|&i| i == value);
                    corner.map_or(0, |k| self.exact_room(corners[k]))
                };
                match inside.iter().filter(|&&i| i).count() {
                    1 => most += odd(true),
                    2 => {
                        most += whole;
                        least += whole - odd(false);
                    }
                    _ => {
                        most += whole;
                        least += whole;
                    }
                }
            }
        }
        [most - wanted, wanted - least]
    }

    /// The prescribed vertex with the least room left alone, on either side, and that room without the margin's factor, radians: no
    /// region can be sure of more. `None` where no single vertex is a proper set.
    pub fn tightest_vertex(&mut self) -> Option<(VertexId, f64)> {
        // All of V is no proper subset.
        if self.connectivity.vertex_count() < 2 {
            return None;
        }
        let mut tightest: Option<(i128, VertexId)> = None;
        for v in self.connectivity.vertices() {
            if self.is_prescribed(v) {
                let [upper, lower] = self.exact_slacks(&[v]);
                let own = (upper.min(lower), v);
                tightest = Some(tightest.map_or(own, |t| t.min(own)));
            }
        }
        tightest.map(|(slack, v)| (v, self.exact.radians(slack) / self.margin))
    }

    /// What to say about a region: both sides of (6), without the margin's factor.
    pub(super) fn violation(&mut self, region: Region) -> Violation {
        let [upper, lower] = self.exact_slacks(&region.vertices);
        let wanted: i128 = (region.vertices.iter())
            .map(|&v| self.exact.wanted[v])
            .sum();
        let full: i128 = (region.vertices.iter())
            .map(|&v| match self.connectivity.is_boundary_vertex(v) {
                true => self.exact.whole,
                false => 2 * self.exact.whole,
            })
            .sum();
        // K̄ and what bounds it, from the same integers: the two are equal exactly where the slack is zero.
        let (curvature, bound) = match region.side {
            Side::Below => (full - wanted, full - wanted - upper),
            Side::Above => (full - wanted, full - wanted + lower),
        };
        let strength = |v: VertexId| match region.side {
            Side::Below => -self.target[v],
            Side::Above => self.target[v],
        };
        let strongest = (region.vertices.iter().copied())
            .reduce(|a, b| if strength(b) > strength(a) { b } else { a });
        Violation {
            vertex: strongest.unwrap_or(VertexId::new(0)),
            size: region.vertices.len(),
            vertices: region.vertices,
            side: region.side,
            curvature: self.exact.radians(curvature) / self.margin,
            bound: self.exact.radians(bound) / self.margin,
            slack: region.slack / self.margin,
        }
    }

    /// The halfedges opposite to the set's side of (6): splitting one gives the region a corner more. They lie in faces with
    /// one corner in the region for [`Side::Below`], with two for [`Side::Above`].
    pub fn link(&self, region: &Region) -> Vec<HalfedgeId> {
        let c = self.connectivity;
        let inside = |v: VertexId| region.vertices.binary_search(&v).is_ok();
        let mut faces: Vec<FaceId> = (region.vertices.iter())
            .flat_map(|&v| c.outgoing(v).map(|h| c.face(h)))
            .collect();
        faces.sort_unstable();
        faces.dedup();
        let odd = region.side == Side::Below;
        let opposite = |h: &HalfedgeId| {
            let ends = [c.tail(*h), c.head(*h)];
            inside(c.apex(*h)) == odd && ends.into_iter().all(|v| inside(v) != odd)
        };
        faces
            .into_iter()
            .flat_map(|f| c.face_halfedges(f))
            .filter(opposite)
            .collect()
    }
}
