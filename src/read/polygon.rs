//! Polygons as triangles.
//!
//! A polygon is fanned from its first corner, as other readers do it, so long as the fan turns no triangle over.
//! Where it does and the polygon is flat, a constrained Delaunay triangulation fills it: the fan of a concave polygon
//! covers places that the polygon leaves out. A concave polygon that is not flat is fanned: no one surface is meant.

use crate::geometry::fill::fill;
use crate::geometry::mesh::{cross, dot, norm, sub};
use std::collections::BTreeMap;

/// How far corners of a flat polygon may be off its plane, in parts of its size; texts have few digits.
const FLAT: f64 = 1e-3;

/// The n − 2 triangles of a polygon of n ≥ 3 corners, as numbers of corners. A polygon one of whose positions is not known yet is fanned.
pub(super) fn triangulate(
    corners: usize,
    position: impl Fn(usize) -> Option<[f64; 3]>,
) -> Vec<[usize; 3]> {
    let fan = || (2..corners).map(|k| [0, k - 1, k]).collect();
    if corners == 3 {
        return fan();
    }
    let points: Option<Vec<_>> = (0..corners).map(position).collect();
    let plane = points.and_then(|points| plane_of_folded_fan(&points));
    plane.and_then(|plane| inside(&plane)).unwrap_or_else(fan)
}

/// Coordinates of a flat polygon's corners in its plane, counterclockwise, if its fan turns a triangle over.
fn plane_of_folded_fan(points: &[[f64; 3]]) -> Option<Vec<[f64; 2]>> {
    let arms = points.iter().map(|&p| sub(p, points[0]));
    let size = arms.clone().map(norm).fold(0.0, f64::max);
    let arms: Vec<_> = arms.map(|a| a.map(|x| x / size)).collect();
    let areas: Vec<_> = arms[1..].windows(2).map(|w| cross(w[0], w[1])).collect();
    let normal: [f64; 3] = std::array::from_fn(|i| areas.iter().map(|a| a[i]).sum());
    if areas.iter().all(|&a| dot(a, normal) >= 0.0) {
        return None;
    }
    let length = norm(normal);
    let normal = normal.map(|x| x / length);
    let is_flat = arms.iter().all(|&a| dot(a, normal).abs() <= FLAT);
    let along = *arms.iter().max_by(|a, b| norm(**a).total_cmp(&norm(**b)))?;
    let height = dot(along, normal);
    let u: [f64; 3] = std::array::from_fn(|i| along[i] - height * normal[i]);
    let v = cross(normal, u);
    is_flat.then(|| arms.iter().map(|&a| [dot(a, u), dot(a, v)]).collect())
}

/// The n − 2 triangles inside a polygon; `None` where sides cross. Holes may hang on bridges, sides that the polygon passes twice.
fn inside(polygon: &[[f64; 2]]) -> Option<Vec<[usize; 3]>> {
    let (mut points, mut corner) = (Vec::new(), Vec::new());
    let mut numbers = BTreeMap::new();
    let number: Vec<usize> = polygon
        .iter()
        .enumerate()
        .map(|(k, p)| {
            // Zero has two signs.
            *numbers
                .entry(p.map(|x| (x + 0.0).to_bits()))
                .or_insert_with(|| {
                    points.push(*p);
                    corner.push(k);
                    points.len() - 1
                })
        })
        .collect();
    let sides: Vec<[usize; 2]> = (0..number.len())
        .map(|k| [number[k], number[(k + 1) % number.len()]])
        .collect();
    let triangles = fill(&points, &sides)?;
    let triangles = triangles.iter().map(|t| t.map(|v| corner[v as usize]));
    (triangles.len() == polygon.len() - 2).then(|| triangles.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(points: &[[f64; 3]], triangles: &[[usize; 3]]) -> f64 {
        let areas = triangles.iter().map(|t| {
            let [a, b, c] = t.map(|k| points[k]);
            0.5 * norm(cross(sub(b, a), sub(c, a)))
        });
        areas.sum()
    }

    fn tilted(plane: &[[f64; 2]]) -> Vec<[f64; 3]> {
        plane
            .iter()
            .map(|&[x, y]| [x, y, 0.5 * x - 2.0 * y])
            .collect()
    }

    /// Area in the plane z = x/2 − 2y for each unit in the plane z = 0.
    const TILT: f64 = 2.291_287_847_477_92;

    fn triangles(points: &[[f64; 3]]) -> Vec<[usize; 3]> {
        triangulate(points.len(), |k| points.get(k).copied())
    }

    #[test]
    fn concave_polygons_are_filled_once() {
        // An L, whose fan from the first corner folds, begun at each of its corners and run both ways.
        let l = [
            [0.0, 0.0],
            [3.0, 0.0],
            [3.0, 1.0],
            [1.0, 1.0],
            [1.0, 3.0],
            [0.0, 3.0],
        ];
        for start in 0..6 {
            for is_reversed in [false, true] {
                let mut corners = l;
                corners.rotate_left(start);
                if is_reversed {
                    corners.reverse();
                }
                let points = tilted(&corners);
                let found = triangles(&points);
                assert_eq!(found.len(), 4);
                assert!(
                    (area(&points, &found) - 5.0 * TILT).abs() < 1e-12,
                    "{start}"
                );
                let up = if is_reversed { -1.0 } else { 1.0 };
                for t in found {
                    let [a, b, c] = t.map(|k| corners[k]);
                    let turn = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
                    assert!(up * turn > 0.0);
                }
            }
        }
    }

    #[test]
    fn a_bridge_leads_to_a_hole() {
        let ring = [
            [0.0, 0.0],
            [3.0, 0.0],
            [3.0, 3.0],
            [0.0, 3.0],
            [0.0, 0.0],
            [1.0, 1.0],
            [1.0, 2.0],
            [2.0, 2.0],
            [2.0, 1.0],
            [1.0, 1.0],
        ];
        let points = tilted(&ring);
        let found = triangles(&points);
        assert_eq!(found.len(), 8);
        assert!((area(&points, &found) - 8.0 * TILT).abs() < 1e-12);
    }

    #[test]
    fn other_polygons_are_fanned() {
        let fan = vec![[0, 1, 2], [0, 2, 3]];
        let convex = tilted(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        assert_eq!(triangles(&convex), fan);
        // Concave at its third corner and bent; then with sides that cross; then not known.
        let dart = [[2.0, 0.0], [0.0, 2.0], [0.1, 0.1], [-1.0, -0.1]];
        let mut bent = tilted(&dart);
        bent[1][2] += 0.3;
        assert_eq!(triangles(&bent), fan);
        let crossed = tilted(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.5]]);
        assert_eq!(triangles(&crossed), fan);
        assert_eq!(
            triangulate(4, |k| tilted(&dart).get(k).copied().filter(|_| k < 3)),
            fan
        );
        assert_eq!(triangles(&[[1.0; 3]; 4]), fan);
    }
}
