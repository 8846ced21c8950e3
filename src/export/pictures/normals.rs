//! Normals to shade with: smooth over the surface, broken at creases.

use super::view::{Vec3, along, unit};
use crate::geometry::ids::FaceId;
use crate::geometry::mesh::{Mesh, cross, dot, norm, sub};
use rayon::prelude::*;

/// Faces that meet at less than this share a smooth normal: cosine of 40°.
const CREASE: f64 = 0.766;
/// Cosine of half of that: no two faces so near the same direction are farther from each other.
const HALF_CREASE: f64 = 0.9397;

/// Unit normals of the corners of all faces: the mean, by area, over the faces at the vertex that meet at a small angle.
pub fn corner_normals(mesh: &Mesh) -> Vec<[Vec3; 3]> {
    let connectivity = &mesh.connectivity;
    // Unit normals of the faces, and twice their areas.
    let faces: Vec<(Vec3, f64)> = (connectivity.faces())
        .map(|f| {
            let [a, b, c] = mesh.face_positions(f);
            let n = cross(sub(b, a), sub(c, a));
            (unit(n), norm(n))
        })
        .collect();
    let mut smooth = vec![[0.0; 3]; mesh.positions.len()];
    for (f, &(n, area)) in connectivity.faces().zip(&faces) {
        for v in connectivity.face_vertices(f) {
            smooth[v.index()] = along(smooth[v.index()], area, n);
        }
    }
    for sum in &mut smooth {
        *sum = unit(*sum);
    }
    // Vertices where all faces are near the mean have one normal.
    let mut is_smooth = vec![true; smooth.len()];
    for (f, &(n, _)) in connectivity.faces().zip(&faces) {
        for v in connectivity.face_vertices(f) {
            is_smooth[v.index()] &= dot(n, smooth[v.index()]) > HALF_CREASE;
        }
    }
    let of_face = |f: usize| {
        let own = faces[f].0;
        [0, 1, 2].map(|k| {
            let v = connectivity.tail(connectivity.corner_halfedge(FaceId::new(f), k));
            if is_smooth[v.index()] {
                return smooth[v.index()];
            }
            let around = connectivity
                .outgoing(v)
                .map(|h| faces[connectivity.face(h).index()]);
            let alike = around.filter(|(n, _)| dot(*n, own) > CREASE);
            unit(alike.fold([0.0; 3], |sum, (n, area)| along(sum, area, n)))
        })
    };
    (0..faces.len()).into_par_iter().map(of_face).collect()
}
