//! Period vectors of a flat torus: the lattice by which its central chart tiles the plane.
//!
//! The slit torus is a fundamental domain, and the motions that glue its sides generate the group of
//! deck transformations. Without cones on genus 1 they are translations, and their vectors generate
//! a lattice of rank two (tutorial 5.5, Fig. 2).

use crate::product::AffineAtlas;

/// The shortest two independent period vectors of a closed genus-1 atlas without cones, counterclockwise,
/// in central-chart coordinates (source units). `None` for every other topology, and where a gluing
/// rotates by more than 1e-8 or the gluings do not generate a lattice of rank two.
pub fn period_vectors(atlas: &AffineAtlas) -> Option<[[f64; 2]; 2]> {
    let topology = atlas.topology;
    if topology.genus != 1 || topology.boundary_loops != 0 || !atlas.prescription.cones.is_empty() {
        return None;
    }
    let gluings = &atlas.charts.gluings;
    if gluings.iter().any(|g| g.motion.rotation.abs() > 1e-8) {
        return None;
    }
    let translations: Vec<_> = gluings.iter().map(|g| g.motion.translation).collect();
    match reduced_basis(&translations, RELATIVE_TOLERANCE)[..] {
        [a, b] => Some([a, b]),
        _ => None,
    }
}

/// Below this share of the longest generator a vector counts as zero. Gluings are exact to 1e-8 of
/// the chart's diameter, and combining a few of them loses little of that.
const RELATIVE_TOLERANCE: f64 = 1e-6;

/// A Lagrange-reduced basis of the lattice that some vectors of the plane generate: no, one or two vectors, the
/// shortest first, counterclockwise, the first in the right half-plane. Vectors shorter than `tolerance` times
/// the longest generator count as zero, so that measured vectors with an integer relation are taken as related.
pub fn reduced_basis(generators: &[[f64; 2]], tolerance: f64) -> Vec<[f64; 2]> {
    if generators.iter().any(|&v| !length(v).is_finite()) {
        return Vec::new();
    }
    let longest = generators.iter().map(|&v| length(v)).fold(0.0, f64::max);
    // Rounding alone leaves remainders of 1e-16: below that the loop in `insert` would not end.
    let zero = tolerance.max(1e-12) * longest;
    let mut basis: Vec<[f64; 2]> = Vec::with_capacity(3);
    for &generator in generators {
        insert(&mut basis, generator, zero);
    }
    let negated = |v: [f64; 2]| [-v[0], -v[1]];
    if let [a, ..] = &mut basis[..]
        && (a[0] < -zero || (a[0].abs() <= zero && a[1] < 0.0))
    {
        *a = negated(*a);
    }
    if let [a, b] = &mut basis[..]
        && cross(*a, *b) < 0.0
    {
        *b = negated(*b);
    }
    basis
}

/// Adds a vector to a reduced basis of at most two vectors.
///
/// A vector is replaced by its remainder to the others; with two reduced vectors that remainder is
/// at most 1/√2 of the longer one (the covering radius), so the loop ends after logarithmically many turns.
fn insert(basis: &mut Vec<[f64; 2]>, mut vector: [f64; 2], zero: f64) {
    loop {
        vector = remainder(vector, basis);
        if length(vector) <= zero {
            return;
        }
        basis.push(vector);
        basis.sort_by(|&a, &b| length(a).total_cmp(&length(b)));
        // Reduce the second by the first until neither changes: Lagrange's algorithm.
        while let [a, b, ..] = basis[..] {
            let reduced = remainder(b, &[a]);
            if length(reduced) <= zero {
                basis.remove(1);
            } else if length(reduced) < length(b) * (1.0 - 1e-12) {
                basis[1] = reduced;
            } else {
                break;
            }
            basis.sort_by(|&a, &b| length(a).total_cmp(&length(b)));
        }
        match basis.len() {
            3 => vector = basis.remove(2),
            _ => return,
        }
    }
}

/// The vector minus a nearby combination of the basis with integer factors.
fn remainder(v: [f64; 2], basis: &[[f64; 2]]) -> [f64; 2] {
    match *basis {
        [a] => {
            let n = (dot(v, a) / dot(a, a)).round();
            [v[0] - n * a[0], v[1] - n * a[1]]
        }
        [a, b, ..] => {
            let area = cross(a, b);
            let (m, n) = ((cross(v, b) / area).round(), (cross(a, v) / area).round());
            [v[0] - m * a[0] - n * b[0], v[1] - m * a[1] - n * b[1]]
        }
        [] => v,
    }
}

fn length(v: [f64; 2]) -> f64 {
    v[0].hypot(v[1])
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn close(a: [f64; 2], b: [f64; 2]) -> bool {
        length([a[0] - b[0], a[1] - b[1]]) < 1e-7
    }

    #[test]
    fn related_generators_give_two_vectors() {
        let basis = reduced_basis(&[[21.0, 0.0], [0.0, -12.0], [21.0, 12.0 + 1e-11]], 1e-6);
        assert_eq!(basis.len(), 2);
        assert!(
            close(basis[0], [0.0, 12.0]) && close(basis[1], [-21.0, 0.0]),
            "{basis:?}"
        );
    }

    #[test]
    fn a_finer_third_generator_refines_the_lattice() {
        // Z² and (1/2, 1/2): a lattice of covolume 1/2.
        let basis = reduced_basis(&[[1.0, 0.0], [0.0, 1.0], [0.5, 0.5]], 1e-6);
        let covolume = cross(basis[0], basis[1]);
        assert!((covolume - 0.5).abs() < 1e-12, "{basis:?}");
    }

    #[test]
    fn collinear_generators_give_their_greatest_common_divisor() {
        let basis = reduced_basis(&[[6.0, 0.0], [-10.0, 0.0], [15.0, 0.0]], 1e-6);
        assert_eq!(basis.len(), 1);
        assert!(close(basis[0], [1.0, 0.0]), "{basis:?}");
        assert!(reduced_basis(&[[0.0, 0.0]], 1e-6).is_empty());
        assert!(reduced_basis(&[], 1e-6).is_empty());
        assert!(reduced_basis(&[[f64::NAN, 0.0], [1.0, 2.0]], 1e-6).is_empty());
        assert!(reduced_basis(&[[f64::INFINITY, 0.0]], 1e-6).is_empty());
    }

    #[test]
    fn the_sample_torus_has_its_two_sides_as_periods() {
        let atlas = crate::export::sample::torus(5, 3);
        let [a, b] = period_vectors(&atlas).unwrap();
        assert!(close(a, [0.0, 3.0]) && close(b, [-5.0, 0.0]), "{a:?} {b:?}");
        let mut rotated = atlas.clone();
        rotated.charts.gluings[0].motion.rotation = 1e-3;
        assert!(period_vectors(&rotated).is_none());
        let mut sphere = atlas;
        sphere.topology.genus = 0;
        assert!(period_vectors(&sphere).is_none());
    }

    proptest! {
        /// Any unimodular mixture of two vectors generates their lattice: same covolume, shortest
        /// vector as found by brute force, and the generators are integer combinations of the basis.
        #[test]
        fn reduction_finds_the_lattice(
            angle in 0.0..std::f64::consts::TAU, ratio in 0.05..1.0f64, shear in -3i32..4, p in -6i32..7, q in -6i32..7,
        ) {
            let (s, c) = angle.sin_cos();
            let a = [3.0 * c, 3.0 * s];
            let b = [-3.0 * ratio * s + 0.3 * a[0], 3.0 * ratio * c + 0.3 * a[1]];
            let mix = |m: i32, n: i32| [f64::from(m) * a[0] + f64::from(n) * b[0], f64::from(m) * a[1] + f64::from(n) * b[1]];
            // Rows (1, shear) and (0, 1) are unimodular; a third generator adds nothing.
            let generators = [mix(1, shear), mix(0, 1), mix(p, q)];
            let basis = reduced_basis(&generators, 1e-9);
            prop_assert_eq!(basis.len(), 2);
            let covolume = cross(basis[0], basis[1]);
            prop_assert!((covolume - cross(a, b).abs()).abs() < 1e-9);
            let shortest = (-9..10).flat_map(|m| (-9..10).map(move |n| (m, n)))
                .filter(|&x| x != (0, 0)).map(|(m, n)| length(mix(m, n))).fold(f64::INFINITY, f64::min);
            prop_assert!((length(basis[0]) - shortest).abs() < 1e-9);
            for g in generators {
                prop_assert!(length(remainder(g, &basis)) < 1e-9);
            }
        }
    }
}
