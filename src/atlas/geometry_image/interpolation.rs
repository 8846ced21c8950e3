//! Points of a patch in texels, and values in between.

use crate::atlas::patch::{Domain, Patch};
use crate::atlas::raster::to_texel;
use crate::geometry::mesh::norm;

/// A point of a patch in texels, such that texels are sampled at halves. The sides of a block come to lie on the first and the
/// last column and row to the last bit.
pub(crate) fn in_texels(patch: &Patch, p: [f64; 2]) -> [f64; 2] {
    match patch.domain {
        Domain::Flat => to_texel(&patch.texel_to_patch, p),
        Domain::Grid => {
            let samples = 1.0 / patch.texel_to_patch[0][0];
            p.map(|x| x * samples.round() + 0.5)
        }
    }
}

/// The mean of the corners' values by weights.
pub(crate) fn mix<const N: usize>(values: &[[f64; N]; 3], weights: [f64; 3]) -> [f64; N] {
    std::array::from_fn(|i| (0..3).map(|k| weights[k] * values[k][i]).sum())
}

/// The same direction, of length 1; none where there is none.
pub(super) fn unit(n: [f64; 3]) -> Option<[f64; 3]> {
    let length = norm(n);
    (length.is_finite() && length > 0.0).then(|| n.map(|x| x / length))
}
