//! Discrete conformal structures: one engine, four schemes (tutorial 3.1, 3.2; method of packings, of
//! inversive distance and of vertex scaling). They turn one number a vertex, `u`, into lengths.
//!
//! *Enters:* connectivity, source lengths, `u`. *Leaves:* lengths, dl/du, and a face's angles with the
//! weights w_ij = ∂θ_i/∂u_j that build the Hessian. *Guaranteed:* a packing with inversive distances in [0, 1]
//! (Φ ∈ [0, π/2]) never breaks a triangle, whatever `u`. *Not guaranteed:* that of the other two; their
//! broken faces get the limit angles (π, 0, 0), which extends the energy to a convex one on all of
//! ℝⁿ (Bobenko, Pinkall, Springborn 2015; Luo 2011), and are reported.
//!
//! | scheme | length | start u⁰ |
//! |---|---|---|
//! | `tangential` | γi + γj | ln c, c half the mean source length: units stay those of the source |
//! | `thurston` | √(γi² + γj² + 2 γi γj cos Φij) (2) | ln γ⁰ of (1) |
//! | `inversive-distance` | √(γi² + γj² + 2 I γi γj) | ln γ⁰, I from the source lengths |
//! | `vertex-scaling` | e^{(ui + uj)/2} l⁰ | 0 |
//!
//! with γ = e^u for the three packings, which are one scheme with different I (I = 1, cos Φ, or anything ≥ 0).

use crate::flow::packing::{self, PackingError, PackingFit};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeId, EdgeVec, FaceId, VertexId, VertexVec};
use crate::geometry::triangle;
use std::f64::consts::PI;

/// Which conformal structure turns `u` into lengths.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// l = γi + γj (Φ ≡ 0).
    Tangential,
    /// (2) with Φ from (1).
    Thurston,
    /// l² = γi² + γj² + 2Iγiγj with the initial lengths exact.
    InversiveDistance,
    /// l = e^{(ui + uj)/2} l⁰.
    #[default]
    VertexScaling,
}

/// What stays fixed while `u` moves.
#[derive(Clone, Debug)]
pub enum Law {
    /// l² = γi² + γj² + 2 I γi γj, γ = e^u; I of every edge, ≥ 0, no unit.
    Packing(EdgeVec<f64>),
    /// l = e^{(ui + uj)/2} l⁰; l⁰ of every edge, source units.
    Scaling(EdgeVec<f64>),
}

/// A discrete conformal structure and where its flow starts.
#[derive(Clone, Debug)]
pub struct ConformalStructure {
    /// How `u` becomes lengths.
    pub law: Law,
    /// u⁰ of every vertex: ln γ⁰ (γ⁰ in source units) for packings, 0 for vertex scaling.
    pub start: VertexVec<f64>,
    /// Fit of (1), for Thurston's scheme.
    pub fit: Option<PackingFit>,
}

/// One face at one `u`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FaceShape {
    /// Corner angles, radians.
    pub angle: [f64; 3],
    /// ∂θ_i/∂u_j = ∂θ_j/∂u_i for the edge ij *opposite* corner `k`, at `k`; radians. 0 where the face is broken.
    pub weight: [f64; 3],
    /// True where the lengths make no triangle.
    pub broken: bool,
}

impl FaceShape {
    /// The limit of a triangle whose longest side is opposite `corner`.
    pub(crate) fn broken_at(corner: usize) -> Self {
        let mut shape = FaceShape {
            broken: true,
            ..Default::default()
        };
        shape.angle[corner] = PI;
        shape
    }
}

impl ConformalStructure {
    /// The structure of a scheme that is fitted to the source lengths, which must be positive and finite.
    pub fn new(
        scheme: Scheme,
        connectivity: &Connectivity,
        source_length: &EdgeVec<f64>,
    ) -> Result<Self, PackingError> {
        let (vertices, edges) = (connectivity.vertex_count(), connectivity.edge_count());
        Ok(match scheme {
            Scheme::Tangential => {
                let mean = source_length.iter().sum::<f64>() / edges.max(1) as f64;
                Self {
                    law: Law::Packing(EdgeVec::filled(1.0, edges)),
                    start: VertexVec::filled((0.5 * mean).ln(), vertices),
                    fit: None,
                }
            }
            Scheme::Thurston => {
                let packing = packing::fit(connectivity, source_length)?;
                Self {
                    law: Law::Packing(packing.cos_phi),
                    start: packing.radius.iter().map(|r| r.ln()).collect(),
                    fit: Some(packing.fit),
                }
            }
            Scheme::InversiveDistance => {
                let radius = packing::exact_radii(connectivity, source_length);
                Self {
                    law: Law::Packing(packing::inversive_distances(
                        connectivity,
                        source_length,
                        &radius,
                    )),
                    start: radius.iter().map(|r| r.ln()).collect(),
                    fit: None,
                }
            }
            Scheme::VertexScaling => Self {
                law: Law::Scaling(source_length.clone()),
                start: VertexVec::filled(0.0, vertices),
                fit: None,
            },
        })
    }

    /// Length of one edge, source units.
    pub fn edge_length(
        &self,
        connectivity: &Connectivity,
        u: &VertexVec<f64>,
        edge: EdgeId,
    ) -> f64 {
        let [i, j] = connectivity.edge_vertices(edge);
        match &self.law {
            Law::Packing(inversive) => packing_length(u[i], u[j], inversive[edge]),
            Law::Scaling(length) => (0.5 * (u[i] + u[j])).exp() * length[edge],
        }
    }

    /// Length of every edge, source units.
    pub fn lengths(&self, connectivity: &Connectivity, u: &VertexVec<f64>) -> EdgeVec<f64> {
        connectivity
            .edges()
            .map(|e| self.edge_length(connectivity, u, e))
            .collect()
    }

    /// ∂l/∂u at the two ends of an edge, tail of its halfedge first, source units.
    ///
    /// Packings: ∂l/∂u_i = γ_i (γ_i + I γ_j) / l, which equals (l² + γ_i² − γ_j²) / 2l. Vertex scaling: l/2.
    /// On a loop the derivative by its one vertex is the sum of both.
    pub fn length_derivative(
        &self,
        connectivity: &Connectivity,
        u: &VertexVec<f64>,
        edge: EdgeId,
    ) -> [f64; 2] {
        let length = self.edge_length(connectivity, u, edge);
        match &self.law {
            Law::Packing(inversive) => {
                let [a, b] = connectivity.edge_vertices(edge).map(|v| u[v].exp());
                let i = inversive[edge];
                [a * (a + i * b) / length, b * (b + i * a) / length]
            }
            Law::Scaling(_) => [0.5 * length; 2],
        }
    }

    /// Angles and weights of one face.
    #[inline]
    pub fn face_shape(
        &self,
        connectivity: &Connectivity,
        u: &VertexVec<f64>,
        face: FaceId,
    ) -> FaceShape {
        let vertices: [VertexId; 3] = connectivity.face_vertices(face);
        let edges: [EdgeId; 3] = connectivity.face_edges(face);
        let u = vertices.map(|v| u[v]);
        match &self.law {
            Law::Packing(inversive) => packing_face(u, edges.map(|e| inversive[e])),
            Law::Scaling(length) => scaling_face(u, edges.map(|e| length[e])),
        }
    }
}

/// (2) from logarithms of radii, `√(γi² + γj² + 2 I γi γj)`, without overflow of squares.
pub fn packing_length(u_i: f64, u_j: f64, inversive: f64) -> f64 {
    let largest = u_i.max(u_j);
    let ratio = (u_i.min(u_j) - largest).exp();
    // Written as (1 + r)² − 2 (1 − I) r so that tangent circles give γi + γj exactly.
    let square = (1.0 + ratio) * (1.0 + ratio) - 2.0 * (1.0 - inversive) * ratio;
    largest.exp()
        * if inversive == 1.0 {
            1.0 + ratio
        } else {
            square.sqrt()
        }
}

/// A face of three circles with logarithms of radii `u` and inversive distance `inversive[k]` on the
/// edge opposite corner `k`.
///
/// Lengths are not used: where radii differ by 1e8 a length has lost the small one. With γ scaled by the largest and
/// I_ij opposite k and so on, the double area 2A and the scalar product d_k = l_ik l_jk cos θ_k are
///
/// 4A² = Σ γi² γj² (1 − I_ij²) + 2 γi γj γk Σ γi (I_jk + I_ij I_ik),
/// d_k = γk² + γk (γi I_ik + γj I_jk) − γi γj I_ij,
///
/// each θ_k = atan2(2A, d_k), and the chain (dθ/dl)(dl/du) collapses to
///
/// ∂θ_i/∂u_j = γi γj [γi γj (1 − I_ij²) + γk (γi (I_jk + I_ij I_ik) + γj (I_ik + I_ij I_jk))] / (2A l_ij²).
///
/// For I ∈ [0, 1] no term is negative: 4A² > 0, weights ≥ 0, nothing cancels. Φ ≡ 0 gives
/// tan²(θk/2) = γi γj / (γk (γi + γj + γk)) and weights r / (γi + γj), r the inradius.
pub fn packing_face(u: [f64; 3], inversive: [f64; 3]) -> FaceShape {
    let largest = u[0].max(u[1]).max(u[2]);
    let g = u.map(|u| (u - largest).exp());
    let h = inversive;
    // By the edge opposite k, ends i and j: γi γj, 1 − I², and by the vertex k: I_ij + I_ik I_jk … as `mixed`.
    let mut product = [0.0; 3];
    let mut defect = [0.0; 3];
    let mut mixed = [0.0; 3];
    for k in 0..3 {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        product[k] = g[i] * g[j];
        defect[k] = (1.0 - h[k]) * (1.0 + h[k]);
        mixed[k] = h[k] + h[i] * h[j];
    }
    let mut square = 0.0;
    let mut tangent_part = 0.0;
    for k in 0..3 {
        square += product[k] * product[k] * defect[k];
        tangent_part += g[k] * mixed[k];
    }
    square += 2.0 * g[0] * product[0] * tangent_part;
    let mut length_square = [0.0; 3];
    for k in 0..3 {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        length_square[k] = g[i] * g[i] + g[j] * g[j] + 2.0 * h[k] * product[k];
    }
    // A NaN must not pass for a triangle.
    if square.is_nan() || square <= 0.0 {
        let mut longest = 0;
        for k in 1..3 {
            if length_square[k] > length_square[longest] {
                longest = k;
            }
        }
        return FaceShape::broken_at(longest);
    }
    let double_area = square.sqrt();
    let mut shape = FaceShape::default();
    for k in 0..3 {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let dot = g[k] * (g[k] + g[i] * h[j] + g[j] * h[i]) - product[k] * h[k];
        shape.angle[k] = double_area.atan2(dot);
        let bracket = product[k] * defect[k] + g[k] * (g[i] * mixed[i] + g[j] * mixed[j]);
        shape.weight[k] = product[k] * bracket / (double_area * length_square[k]);
    }
    shape
}

/// A face of vertex scaling: `length[k]` is l⁰ of the edge opposite corner `k`; ∂θ_i/∂u_j = ½ cot θ_k.
pub fn scaling_face(u: [f64; 3], length: [f64; 3]) -> FaceShape {
    // The length opposite k is e^{(Σu − u_k)/2} l⁰: the common factor e^{Σu/2} changes no angle, and
    // taking e^{−(u_k − u_min)/2} ≤ 1 avoids overflow.
    let least = u[0].min(u[1]).min(u[2]);
    let scaled = [0, 1, 2].map(|k| length[k] * (0.5 * (least - u[k])).exp());
    let (Some(angle), Some(cotangent)) = (triangle::angles(scaled), triangle::cotangents(scaled))
    else {
        let mut longest = 0;
        for k in 1..3 {
            if scaled[k] > scaled[longest] {
                longest = k;
            }
        }
        return FaceShape::broken_at(longest);
    };
    FaceShape {
        angle,
        weight: cotangent.map(|c| 0.5 * c),
        broken: false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::ricci::shapes;

    const SCHEMES: [Scheme; 4] = [
        Scheme::Tangential,
        Scheme::Thurston,
        Scheme::InversiveDistance,
        Scheme::VertexScaling,
    ];

    fn close(a: f64, b: f64, tolerance: f64) {
        assert!((a - b).abs() <= tolerance, "{a} against {b}");
    }

    #[test]
    fn the_start_is_the_source() {
        for shape in shapes::small() {
            let c = &shape.connectivity;
            let mean = shape.length.iter().sum::<f64>() / c.edge_count() as f64;
            for scheme in SCHEMES {
                let structure = ConformalStructure::new(scheme, c, &shape.length).unwrap();
                let length = structure.lengths(c, &structure.start);
                let mut worst: f64 = 0.0;
                for (e, &l) in length.enumerate() {
                    worst = worst.max((l - shape.length[e]).abs() / shape.length[e]);
                }
                match scheme {
                    Scheme::Tangential => length.iter().for_each(|&l| close(l, mean, 1e-14 * mean)),
                    Scheme::Thurston => close(worst, structure.fit.unwrap().max_length_error, 1e-9),
                    _ => close(worst, 0.0, 1e-13),
                }
            }
        }
    }

    #[test]
    fn length_derivatives_agree_with_finite_differences() {
        let mut random = shapes::sequence(31);
        for shape in shapes::small() {
            let c = &shape.connectivity;
            for scheme in SCHEMES {
                let structure = ConformalStructure::new(scheme, c, &shape.length).unwrap();
                let u: VertexVec<f64> = structure
                    .start
                    .iter()
                    .map(|u| u + 0.6 * random() - 0.3)
                    .collect();
                for e in c.edges() {
                    let exact = structure.length_derivative(c, &u, e);
                    for (k, v) in c.edge_vertices(e).into_iter().enumerate() {
                        let h = 1e-5;
                        let (mut up, mut down) = (u.clone(), u.clone());
                        up[v] += h;
                        down[v] -= h;
                        let difference =
                            structure.edge_length(c, &up, e) - structure.edge_length(c, &down, e);
                        close(exact[k], difference / (2.0 * h), 1e-8);
                    }
                }
            }
        }
    }

    #[test]
    fn faces_agree_with_the_chain_rule_on_lengths() {
        let mut random = shapes::sequence(37);
        let mut tried = 0;
        for round in 0..400 {
            let u = [(); 3].map(|_| 2.0 * random() - 1.0);
            // Φ in [0, π/2] in two rounds of three, any inversive distance ≥ 0 in the third.
            let reach = if round % 3 == 2 { 3.0 } else { 1.0 };
            let inversive = [(); 3].map(|_| reach * random());
            let length =
                [0, 1, 2].map(|k| packing_length(u[(k + 1) % 3], u[(k + 2) % 3], inversive[k]));
            let shape = packing_face(u, inversive);
            assert_eq!(shape.broken, !triangle::is_triangle(length));
            assert!(!(shape.broken && reach == 1.0));
            if shape.broken {
                let longest = (0..3).max_by(|&i, &j| length[i].total_cmp(&length[j]));
                close(shape.angle[longest.unwrap()], PI, 0.0);
                assert_eq!(shape.weight, [0.0; 3]);
                continue;
            }
            let angle = triangle::angles(length).unwrap();
            let by_length = triangle::angle_derivatives(length).unwrap();
            // Slivers of inversive distance lose digits in their lengths, which are not used here.
            if angle.iter().any(|a| a.sin() < 1e-2) {
                continue;
            }
            tried += 1;
            let g = u.map(f64::exp);
            for k in 0..3 {
                close(shape.angle[k], angle[k], 1e-12);
                let (i, j) = ((k + 1) % 3, (k + 2) % 3);
                // ∂θi/∂uj through the two edges at j, dl/du from the printed form (l² + γj² − γ²)/2l.
                let slope = |end: usize, other: usize, l: f64| {
                    (l * l + g[end] * g[end] - g[other] * g[other]) / (2.0 * l)
                };
                let chain = |a: usize, b: usize| {
                    by_length[a][a] * slope(b, k, length[a])
                        + by_length[a][k] * slope(b, a, length[k])
                };
                close(shape.weight[k], chain(i, j), 1e-10);
                close(shape.weight[k], chain(j, i), 1e-10);
            }
        }
        assert!(tried > 300);
    }

    #[test]
    fn tangent_circles_match_the_closed_form() {
        let mut random = shapes::sequence(41);
        for _ in 0..100 {
            let u = [(); 3].map(|_| 3.0 * random());
            let g = u.map(f64::exp);
            let shape = packing_face(u, [1.0; 3]);
            for i in 0..3 {
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                let sine = shape.angle[i].sin();
                // ∂K_i/∂γ_i and ∂K_i/∂γ_j of one face, the tutorial's printed Hessian with its misprints corrected.
                let own = 2.0 * g[j] * g[k] * (2.0 * g[i] + g[j] + g[k])
                    / ((g[i] + g[j]).powi(2) * (g[i] + g[k]).powi(2) * sine);
                let mixed = -2.0 * g[i] * g[k] / ((g[i] + g[k]) * (g[i] + g[j]).powi(2) * sine);
                close(shape.weight[j] + shape.weight[k], own * g[i], 1e-12);
                close(-shape.weight[k], mixed * g[j], 1e-12);
            }
        }
    }

    #[test]
    fn very_unequal_circles_keep_their_digits() {
        // tan(θi/2) = √(γj γk / (γi (γi + γj + γk))) needs no difference of lengths.
        for ratio in [1e-4_f64, 1e-8, 1e-12, 1e-16] {
            for g in [
                [1.0, ratio, 0.7 * ratio],
                [1.0, 0.3, ratio],
                [ratio * ratio, 1.0, ratio],
            ] {
                let shape = packing_face(g.map(f64::ln), [1.0; 3]);
                let total: f64 = g.iter().sum();
                for i in 0..3 {
                    let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                    let exact = 2.0 * (g[j] * g[k]).sqrt().atan2((g[i] * total).sqrt());
                    close(shape.angle[i] / exact, 1.0, 1e-13);
                    let inradius = (g[0] * g[1] * g[2] / total).sqrt();
                    close(shape.weight[i] * (g[j] + g[k]) / inradius, 1.0, 1e-12);
                }
                close(shape.angle.iter().sum::<f64>(), PI, 1e-14);
            }
        }
        // Nothing overflows where e^u would.
        let far = packing_face([2000.0, 2001.0, 1999.0], [1.0, 0.5, 0.0]);
        let near = packing_face([0.0, 1.0, -1.0], [1.0, 0.5, 0.0]);
        assert_eq!(far, near);
    }

    #[test]
    fn scaling_faces_are_cotangents_and_report_broken_ones() {
        let shape = scaling_face([0.3, -0.2, 0.1], [1.0, 1.2, 0.9]);
        let scale = |a: f64, b: f64| (0.5 * (a + b)).exp();
        let length = [
            scale(-0.2, 0.1),
            1.2 * scale(0.3, 0.1),
            0.9 * scale(0.3, -0.2),
        ];
        let angle = triangle::angles(length).unwrap();
        for (k, a) in angle.into_iter().enumerate() {
            close(shape.angle[k], a, 1e-14);
            close(shape.weight[k], 0.5 / a.tan(), 1e-14);
        }
        let broken = scaling_face([9.0, 0.0, 0.0], [0.1, 1.0, 1.0]);
        assert!(!broken.broken);
        let broken = scaling_face([-9.0, 0.0, 0.0], [1.0, 1.0, 1.0]);
        assert!(broken.broken);
        assert_eq!(broken.angle, [PI, 0.0, 0.0]);
    }
}
