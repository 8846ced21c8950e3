//! How long a change of log-lengths is.
//!
//! A step of Newton has many solutions; the shortest in this norm is taken. Its inverse is W⁻¹ + τ B V⁻¹ Bᵀ: with d = r + B u, where B
//! adds the u of both ends of an edge, the square of the length of d is the least of Σ W r² + Σ V u² / τ. W weighs edges by the area of
//! their faces and V vertices by theirs, each by the square root of area by mean area. For τ = 0 scales are nothing special; as τ grows they become free, and the
//! metric as conformal as the turnings let it.
//!
//! The square root is a compromise. Weights that are all the same make the change follow the sampling of the mesh: where it is fine, there are more edges to keep. Weights that are
//! the areas do not, but then small faces take most of the change, so angles are far from linear along a step.
//!
//! An edge of a thin face turns angles by cotangents without bound for a small change of length, so the shortest step would be made of such edges first, as far as they are anything but linear. So W
//! grows with the squares of what an edge does to the angles opposite it: 1 + c Σ (∂θ/∂λ)². Marching cubes on a wavy ball (11,000 vertices, edges down to 7·10⁻⁵ of the median): 3 steps with c = 0.1, and with c = 0 a hundred
//! that lead nowhere; nefertiti.obj 10 in place of 13, face.obj 6 in place of 15. From 0.01 to 1 all of these arrive; the larger c is, the more areas change.

use crate::flow::metric::face_lengths;
use crate::flow::mirror::Reflection;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, VertexVec};
use crate::geometry::triangle;

/// Least area relative to the mean that counts: the system would lose digits beyond.
const LEAST_AREA: f64 = 1e-6;
/// How much what an edge does to angles makes it weigh: c of the module docs.
const STIFFNESS: f64 = 0.1;
/// Largest sum of squares of what an edge does to angles that counts; that of faces without width.
const STIFFEST: f64 = 1e12;

/// Diagonals of the inverse norm.
#[derive(Clone, Debug)]
pub(super) struct Norm {
    /// W⁻¹.
    pub(super) edge: EdgeVec<f64>,
    /// τ V⁻¹; `None` for τ = 0.
    pub(super) vertex: Option<VertexVec<f64>>,
}

impl Norm {
    /// Weights by the square root of area and by what edges do to angles, for a conformality τ.
    pub(super) fn by_area(c: &Connectivity, length: &EdgeVec<f64>, conformality: f64) -> Self {
        let mut edge = EdgeVec::filled(0.0, c.edge_count());
        let mut turned = EdgeVec::filled(0.0, c.edge_count());
        let mut vertex = VertexVec::filled(0.0, c.vertex_count());
        for f in c.faces() {
            let sides = face_lengths(c, length, f);
            let area = triangle::area(sides).unwrap_or(0.0);
            for h in c.face_halfedges(f) {
                edge[c.edge(h)] += area;
                vertex[c.tail(h)] += area;
            }
            let cotangents = triangle::cotangents(sides);
            for (k, e) in c.face_edges(f).into_iter().enumerate() {
                turned[e] += match cotangents {
                    Some(cot) => (0.5 * (cot[(k + 1) % 3] + cot[(k + 2) % 3])).powi(2),
                    None => STIFFEST,
                };
            }
        }
        let is_conformal = conformality > 0.0;
        let by_area = inverse(edge.as_slice(), 1.0);
        let stiff =
            |(inverse, turned): (f64, &f64)| inverse / (1.0 + STIFFNESS * turned.min(STIFFEST));
        Self {
            edge: by_area.into_iter().zip(turned.iter()).map(stiff).collect(),
            vertex: is_conformal.then(|| inverse(vertex.as_slice(), conformality).into()),
        }
    }

    /// The same where every edge and vertex moves together with its mirror image: both weigh as much as both do, and the entry of one stands for both.
    pub(super) fn by_images(mut self, reflection: Option<&Reflection>) -> Self {
        let Some(reflection) = reflection else {
            return self;
        };
        for (e, &image) in reflection.edge.enumerate() {
            if e != image {
                self.edge[e] *= 0.5;
            }
        }
        for (v, &image) in reflection.vertex.enumerate() {
            if let (true, Some(vertex)) = (v != image, &mut self.vertex) {
                vertex[v] *= 0.5;
            }
        }
        self
    }

    /// Every edge and vertex the same.
    #[cfg(test)]
    pub(super) fn uniform(c: &Connectivity, conformality: f64) -> Self {
        let is_conformal = conformality > 0.0;
        Self {
            edge: EdgeVec::filled(1.0, c.edge_count()),
            vertex: is_conformal.then(|| VertexVec::filled(conformality, c.vertex_count())),
        }
    }
}

fn inverse(weight: &[f64], factor: f64) -> Vec<f64> {
    let mean = weight.iter().sum::<f64>() / weight.len().max(1) as f64;
    let relative = |w: &f64| match mean > 0.0 {
        true => (w / mean).max(LEAST_AREA).sqrt(),
        false => 1.0,
    };
    weight.iter().map(|w| factor / relative(w)).collect()
}
