//! What a cone does to its own vertex, beyond the linear picture.
//!
//! *Enters:* the star of a vertex: its number of faces, its curvature, the Laplacian there. *Leaves:* how far the log scale at the vertex is from what the linear
//! picture says when the vertex becomes a cone.
//!
//! On a smooth surface the log scale of a cone goes to ±∞, and on a mesh most of the linear picture's error is that of this one vertex. In a star of n equal
//! triangles the angles add up to 2π − c where u of the vertex stands −2 ln sin((2π − c)/2n) above that of its neighbours, up to a constant: that is what vertex
//! scaling does, and the linear picture is its tangent at the curvature that the vertex had. A strong negative cone is far less deep than the tangent says, a
//! positive one higher.

use std::f64::consts::{FRAC_PI_2, PI};

/// Half an angle of a star that is no less and no more: flips put more faces around where the angles would be wider.
const HALF_ANGLE: [f64; 2] = [1e-3, 0.9 * FRAC_PI_2];

/// The faces around a vertex.
#[derive(Clone, Copy, Debug)]
pub(super) struct Star {
    /// Number of faces.
    faces: f64,
    /// −2 ln sin of half an angle where the vertex is flat.
    flat: f64,
    /// Change of u by curvature in the linear picture, 1/radians.
    slope: f64,
    /// `slope` over that of equal triangles.
    ratio: f64,
    /// Curvature that the vertex has, radians.
    own: f64,
}

impl Star {
    /// `curvature`: that of the vertex, radians; `weight`: the diagonal of the Laplacian there.
    pub(super) fn new(faces: usize, curvature: f64, weight: f64) -> Self {
        let faces = faces.max(3) as f64;
        let slope = if weight > 0.0 { 1.0 / weight } else { 0.0 };
        let tangent = 1.0 / (half_angle(faces, curvature).tan() * faces);
        Self {
            faces,
            flat: height(faces, 0.0),
            slope,
            ratio: slope / tangent,
            own: curvature,
        }
    }

    /// What u of the vertex is above that of the linear picture where its curvature is changed, by radians.
    pub(super) fn bent(&self, change: f64) -> f64 {
        self.excess(self.own + change) - self.excess(self.own)
    }

    /// What u of the vertex is above that of the linear picture, with a cone of some curvature, radians, in place of a flat vertex.
    pub(super) fn excess(&self, curvature: f64) -> f64 {
        self.ratio * (height(self.faces, curvature) - self.flat) - self.slope * curvature
    }

    /// Its derivative by the curvature.
    pub(super) fn excess_slope(&self, curvature: f64) -> f64 {
        let tangent = 1.0 / (half_angle(self.faces, curvature).tan() * self.faces);
        self.ratio * tangent - self.slope
    }
}

fn half_angle(faces: f64, curvature: f64) -> f64 {
    let [least, most] = HALF_ANGLE;
    ((2.0 * PI - curvature) / (2.0 * faces)).clamp(least, most)
}

/// u of the vertex over that of its neighbours, up to a constant. Beyond the widest angle its tangent there.
fn height(faces: f64, curvature: f64) -> f64 {
    let half = half_angle(faces, curvature);
    let beyond = (2.0 * PI - curvature) / (2.0 * faces) - half;
    -2.0 * half.sin().ln() - 2.0 * beyond / half.tan()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Angles at the middle of a star whose spokes are scaled by e^{u/2}, added up.
    fn angle_sum(faces: usize, u: f64) -> f64 {
        let rim = 2.0 * (PI / faces as f64).sin();
        let spoke = (0.5 * u).exp();
        faces as f64 * 2.0 * (0.5 * rim / spoke).asin()
    }

    #[test]
    fn a_flat_regular_star_is_scaled_as_its_angles_say() {
        for faces in [4, 6, 9] {
            let weight = faces as f64 / (PI / faces as f64).tan().recip();
            let star = Star::new(faces, 0.0, weight);
            for c in [-2.0, -0.5, 0.0, 0.7, 3.0] {
                let u = star.excess(c) + c / weight;
                assert!(
                    (angle_sum(faces, u) - (TAU - c)).abs() < 1e-9,
                    "{faces} {c}"
                );
                let step = 1e-5;
                let slope = (star.excess(c + step) - star.excess(c - step)) / (2.0 * step);
                assert!((slope - star.excess_slope(c)).abs() < 1e-8, "{faces} {c}");
                // A corner that gets the cone that it is stays as it is.
                let tangent = 1.0 / (faces as f64 * half_angle(faces as f64, c).tan());
                let corner = Star::new(faces, c, 1.0 / tangent);
                assert!((corner.bent(-c) + corner.excess(c)).abs() < 1e-12);
            }
        }
    }
}
