//! Angles, curvature and the Hessian of a conformal structure at one `u`.
//!
//! *Enters:* connectivity, a [`ConformalStructure`], `u`. *Leaves:* per face angles and weights, per vertex curvature
//! (3), (4), per edge the weights of the Hessian ∂K/∂u. *Guaranteed:* the same bytes for any number of threads: faces
//! are independent, and every vertex sums its corners in the order of the faces.
//!
//! The Hessian needs no matrix here: with w_e the sum of [`FaceShape::weight`] over the faces of e,
//! ∂K_i/∂u_j = −Σ w_e over the edges ij, ∂K_i/∂u_i = Σ w_e over the edges at i, because angles do not change when all
//! of `u` does. So H is a weighted graph Laplacian, symmetric, with the constants in its kernel; semidefinite because the
//! energy is convex, and for packings (Φ ∈ [0, π/2]) plainly so, since no weight is negative.

use crate::flow::delaunay::Delaunay;
use crate::flow::schemes::{ConformalStructure, FaceShape};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, FaceId, FaceVec, HalfedgeId, VertexVec};
use crate::geometry::triangle;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Below this many items a piece is not worth another thread.
const PIECE: usize = 2048;

/// Evaluates one structure at many `u`.
pub struct Metric<'a> {
    surface: Surface<'a>,
    /// 2π at interior vertices, π on the boundary.
    full_angle: VertexVec<f64>,
}

/// What turns `u` into angles.
enum Surface<'a> {
    /// The connectivity stays.
    Fixed(&'a Connectivity, &'a ConformalStructure),
    /// Vertex scaling on the Delaunay triangulation at every `u`.
    Flipping(&'a mut Delaunay),
}

/// What [`Metric::evaluate`] finds at one `u`.
#[derive(Clone, Debug, Default)]
pub struct Evaluation {
    /// Angles and weights of every face.
    pub shape: FaceVec<FaceShape>,
    /// Curvature of every vertex, radians.
    pub curvature: VertexVec<f64>,
}

impl<'a> Metric<'a> {
    /// A structure on a connectivity that stays.
    pub fn new(connectivity: &'a Connectivity, structure: &'a ConformalStructure) -> Self {
        Self {
            surface: Surface::Fixed(connectivity, structure),
            full_angle: full_angles(connectivity),
        }
    }

    /// Vertex scaling with flips.
    pub fn flipping(delaunay: &'a mut Delaunay) -> Self {
        Self {
            full_angle: full_angles(&delaunay.connectivity),
            surface: Surface::Flipping(delaunay),
        }
    }

    /// The triangulation now.
    pub fn connectivity(&self) -> &Connectivity {
        match &self.surface {
            Surface::Fixed(connectivity, _) => connectivity,
            Surface::Flipping(delaunay) => &delaunay.connectivity,
        }
    }

    /// Flips so far.
    pub fn flips(&self) -> usize {
        match &self.surface {
            Surface::Fixed(..) => 0,
            Surface::Flipping(delaunay) => delaunay.flips,
        }
    }

    /// True where the triangulation is flipped.
    pub fn may_flip(&self) -> bool {
        matches!(self.surface, Surface::Flipping(_))
    }

    /// Where `u` starts.
    pub fn start(&self) -> VertexVec<f64> {
        match &self.surface {
            Surface::Fixed(_, structure) => structure.start.clone(),
            Surface::Flipping(delaunay) => {
                VertexVec::filled(0.0, delaunay.connectivity.vertex_count())
            }
        }
    }

    /// Says that `u` is where the flow has come to. Where lengths can take it in, `u` is 0 from now on and counted from there.
    pub fn rebase(&mut self, u: &mut VertexVec<f64>) {
        if let Surface::Flipping(delaunay) = &mut self.surface {
            delaunay.rebase(u);
            u.as_mut_slice().fill(0.0);
        }
    }

    /// `u` with all that was taken into the lengths.
    pub fn total(&self, u: &VertexVec<f64>) -> VertexVec<f64> {
        match &self.surface {
            Surface::Fixed(..) => u.clone(),
            Surface::Flipping(delaunay) => {
                let parts = delaunay.scale().iter().zip(u.iter());
                parts.map(|(scale, u)| scale + u).collect()
            }
        }
    }

    /// Angles, weights and curvature at `u`; buffers in `out` are reused. Where the triangulation is flipped, it is the Delaunay
    /// one at `u` from now on.
    pub fn evaluate(&mut self, u: &VertexVec<f64>, out: &mut Evaluation) {
        match &mut self.surface {
            Surface::Fixed(connectivity, structure) => {
                let faces = connectivity.face_count();
                if out.shape.len() != faces {
                    out.shape = FaceVec::filled(FaceShape::default(), faces);
                }
                let shapes = out.shape.as_mut_slice().par_iter_mut();
                shapes
                    .with_min_len(PIECE)
                    .enumerate()
                    .for_each(|(f, shape)| {
                        *shape = structure.face_shape(connectivity, u, FaceId::new(f));
                    });
            }
            Surface::Flipping(delaunay) => delaunay.evaluate(u, &mut out.shape),
        }
        out.curvature.clone_from(&self.full_angle);
        let connectivity = self.connectivity();
        for (f, shape) in out.shape.enumerate() {
            for (v, angle) in connectivity.face_vertices(f).into_iter().zip(shape.angle) {
                out.curvature[v] -= angle;
            }
        }
    }

    /// w_e of every edge, radians: minus the off-diagonal entries of the Hessian.
    pub fn edge_weights(&self, evaluation: &Evaluation) -> EdgeVec<f64> {
        let connectivity = self.connectivity();
        // The halfedge 3f + k lies opposite corner k + 2.
        let side =
            |h: HalfedgeId| evaluation.shape[connectivity.face(h)].weight[(h.index() % 3 + 2) % 3];
        connectivity
            .edges()
            .map(|e| {
                let h = connectivity.edge_halfedge(e);
                side(h) + connectivity.twin(h).map_or(0.0, side)
            })
            .collect()
    }

    /// Diagonal of the Hessian, radians, and below it the sum of the absolute values of the row's other
    /// entries. A loop moves no angle and counts in neither.
    pub fn diagonal(&self, weight: &EdgeVec<f64>) -> VertexVec<[f64; 2]> {
        let connectivity = self.connectivity();
        let mut diagonal = VertexVec::filled([0.0; 2], self.connectivity().vertex_count());
        for (e, &w) in weight.enumerate() {
            let [i, j] = connectivity.edge_vertices(e);
            if i != j {
                for v in [i, j] {
                    diagonal[v][0] += w;
                    diagonal[v][1] += w.abs();
                }
            }
        }
        diagonal
    }

    /// H δ, radians, for the Hessian with these weights.
    pub fn apply_hessian(
        &self,
        weight: &EdgeVec<f64>,
        direction: &VertexVec<f64>,
    ) -> VertexVec<f64> {
        let connectivity = self.connectivity();
        let mut result = VertexVec::filled(0.0, direction.len());
        for (e, &w) in weight.enumerate() {
            let [i, j] = connectivity.edge_vertices(e);
            let flow = w * (direction[i] - direction[j]);
            result[i] += flow;
            result[j] -= flow;
        }
        result
    }
}

impl Evaluation {
    /// Faces that are no triangles, ascending.
    pub fn broken_faces(&self) -> Vec<FaceId> {
        self.shape
            .enumerate()
            .filter(|(_, s)| s.broken)
            .map(|(f, _)| f)
            .collect()
    }
}

/// 2π at interior vertices, π at boundary vertices: what curvature is measured against, (3) and (4).
pub fn full_angles(connectivity: &Connectivity) -> VertexVec<f64> {
    connectivity
        .vertices()
        .map(|v| match connectivity.is_boundary_vertex(v) {
            true => PI,
            false => 2.0 * PI,
        })
        .collect()
}

/// The three lengths of a face, `k` opposite corner `k`.
pub fn face_lengths(connectivity: &Connectivity, length: &EdgeVec<f64>, face: FaceId) -> [f64; 3] {
    connectivity.face_edges(face).map(|e| length[e])
}

/// Faces whose lengths make no triangle, ascending.
pub fn broken_faces(connectivity: &Connectivity, length: &EdgeVec<f64>) -> Vec<FaceId> {
    connectivity
        .faces()
        .filter(|&f| !triangle::is_triangle(face_lengths(connectivity, length, f)))
        .collect()
}

/// Curvature (3), (4) of every vertex from lengths alone, radians; `None` where some face is no triangle.
pub fn curvature(connectivity: &Connectivity, length: &EdgeVec<f64>) -> Option<VertexVec<f64>> {
    let mut curvature = full_angles(connectivity);
    for f in connectivity.faces() {
        let angle = triangle::angles(face_lengths(connectivity, length, f))?;
        for (v, a) in connectivity.face_vertices(f).into_iter().zip(angle) {
            curvature[v] -= a;
        }
    }
    Some(curvature)
}

/// Total area, squared length unit; a face that is no triangle counts 0.
pub fn total_area(connectivity: &Connectivity, length: &EdgeVec<f64>) -> f64 {
    connectivity
        .faces()
        .filter_map(|f| triangle::area(face_lengths(connectivity, length, f)))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::ricci::Scheme;
    use crate::flow::ricci::shapes::{self, Shape};

    const SCHEMES: [Scheme; 4] = [
        Scheme::Tangential,
        Scheme::Thurston,
        Scheme::InversiveDistance,
        Scheme::VertexScaling,
    ];

    /// A structure and a `u` near its start at which no face is broken.
    fn at_random(shape: &Shape, scheme: Scheme) -> (ConformalStructure, VertexVec<f64>) {
        let mut random = shapes::sequence(43);
        let structure =
            ConformalStructure::new(scheme, &shape.connectivity, &shape.length).unwrap();
        let u = structure
            .start
            .iter()
            .map(|u| u + 0.2 * random() - 0.1)
            .collect();
        (structure, u)
    }

    #[test]
    fn hessians_agree_with_finite_differences() {
        for shape in shapes::small() {
            for scheme in SCHEMES {
                let (structure, u) = at_random(&shape, scheme);
                let mut metric = Metric::new(&shape.connectivity, &structure);
                let (mut now, mut up, mut down) = Default::default();
                metric.evaluate(&u, &mut now);
                assert!(now.broken_faces().is_empty());
                let weight = metric.edge_weights(&now);
                let largest = weight.iter().fold(0.0_f64, |m, w| m.max(w.abs()));
                for v in shape.connectivity.vertices() {
                    let h = 1e-5;
                    let mut moved = u.clone();
                    moved[v] += h;
                    metric.evaluate(&moved, &mut up);
                    moved[v] -= 2.0 * h;
                    metric.evaluate(&moved, &mut down);
                    let mut unit = VertexVec::filled(0.0, u.len());
                    unit[v] = 1.0;
                    let exact = metric.apply_hessian(&weight, &unit);
                    for (w, &entry) in exact.enumerate() {
                        let difference = (up.curvature[w] - down.curvature[w]) / (2.0 * h);
                        assert!(
                            (entry - difference).abs() < 1e-6 * entry.abs().max(1e-3 * largest),
                            "{} {scheme:?} ({w}, {v}): {entry} against {difference}",
                            shape.name
                        );
                    }
                    let diagonal = metric.diagonal(&weight)[v];
                    assert!((exact[v] - diagonal[0]).abs() < 1e-12 * diagonal[1]);
                }
            }
        }
    }

    #[test]
    fn hessians_are_semidefinite_with_the_constants_as_kernel() {
        let mut random = shapes::sequence(47);
        for shape in shapes::small() {
            for scheme in SCHEMES {
                let (structure, u) = at_random(&shape, scheme);
                let mut metric = Metric::new(&shape.connectivity, &structure);
                let mut now = Evaluation::default();
                metric.evaluate(&u, &mut now);
                let weight = metric.edge_weights(&now);
                let one = VertexVec::filled(1.0, u.len());
                for k in metric.apply_hessian(&weight, &one).iter() {
                    assert_eq!(*k, 0.0);
                }
                if matches!(scheme, Scheme::Tangential | Scheme::Thurston) {
                    assert!(weight.iter().all(|&w| w >= 0.0));
                }
                for _ in 0..50 {
                    let x: VertexVec<f64> = u.iter().map(|_| random() - 0.5).collect();
                    let hx = metric.apply_hessian(&weight, &x);
                    let form: f64 = x.iter().zip(hx.iter()).map(|(a, b)| a * b).sum();
                    assert!(form > 0.0);
                }
            }
        }
    }

    #[test]
    fn curvature_satisfies_gauss_bonnet_and_the_lengths() {
        for shape in shapes::small() {
            let chi = shape.connectivity.topology().euler_characteristic as f64;
            for scheme in SCHEMES {
                let (structure, u) = at_random(&shape, scheme);
                let mut metric = Metric::new(&shape.connectivity, &structure);
                let mut now = Evaluation::default();
                metric.evaluate(&u, &mut now);
                let total: f64 = now.curvature.iter().sum();
                assert!((total - 2.0 * PI * chi).abs() < 1e-11);
                let length = structure.lengths(&shape.connectivity, &u);
                assert!(broken_faces(&shape.connectivity, &length).is_empty());
                let by_length = curvature(&shape.connectivity, &length).unwrap();
                for (a, b) in now.curvature.iter().zip(by_length.iter()) {
                    assert!((a - b).abs() < 1e-11);
                }
            }
        }
        // A tetrahedron: π at every corner, Fig. 5.
        let tetrahedron = Shape::new(
            "tetrahedron",
            &[[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]],
            &[
                [1.0, 1.0, 1.0],
                [-1.0, -1.0, 1.0],
                [-1.0, 1.0, -1.0],
                [1.0, -1.0, -1.0],
            ],
        );
        let by_length = curvature(&tetrahedron.connectivity, &tetrahedron.length).unwrap();
        assert!(by_length.iter().all(|k| (k - PI).abs() < 1e-14));
        let area = total_area(&tetrahedron.connectivity, &tetrahedron.length);
        assert!((area - 8.0 * 3.0_f64.sqrt()).abs() < 1e-13);
    }

    #[test]
    fn threads_do_not_change_a_bit() {
        let shape = shapes::torus(90, 70);
        let (structure, u) = at_random(&shape, Scheme::InversiveDistance);
        let mut metric = Metric::new(&shape.connectivity, &structure);
        let mut with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            let mut out = Evaluation::default();
            pool.install(|| metric.evaluate(&u, &mut out));
            out
        };
        let (one, three) = (with(1), with(3));
        assert!(one.shape == three.shape);
        assert!(one.curvature == three.curvature);
    }
}
