//! Log scales as one vector: a number `u` for every vertex.

use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, VertexVec};

/// Dot product in the order of vertices.
pub(crate) fn dot(a: &VertexVec<f64>, b: &VertexVec<f64>) -> f64 {
    a.iter().zip(b.iter()).map(|(a, b)| a * b).sum()
}

/// u + step · direction.
pub(crate) fn moved(u: &VertexVec<f64>, direction: &VertexVec<f64>, step: f64) -> VertexVec<f64> {
    u.iter()
        .zip(direction.iter())
        .map(|(u, d)| u + step * d)
        .collect::<Vec<_>>()
        .into()
}

/// Adds a constant to `u`.
pub(crate) fn shift(u: &mut VertexVec<f64>, constant: f64) {
    u.as_mut_slice().iter_mut().for_each(|u| *u += constant);
}

/// Largest minus smallest value.
pub(crate) fn spread(values: &VertexVec<f64>) -> f64 {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for &x in values.iter() {
        (low, high) = (low.min(x), high.max(x));
    }
    high - low
}

/// Logarithms of lengths with the scale taken out: λ_ij − (u_i + u_j)/2.
pub(crate) fn at_unit_scale(
    c: &Connectivity,
    log_length: &EdgeVec<f64>,
    u: &VertexVec<f64>,
) -> EdgeVec<f64> {
    let without = |(e, l): (_, &f64)| {
        let [i, j] = c.edge_vertices(e);
        l - 0.5 * (u[i] + u[j])
    };
    log_length.enumerate().map(without).collect()
}
