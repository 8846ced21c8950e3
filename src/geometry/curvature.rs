//! Directions of principal curvature on the faces of a mesh.
//!
//! *Enters:* a triangulation and where its vertices are in space. *Leaves:* one complex number a face, (κ₁ − κ₂) e^{2iθ}: θ is the angle from halfedge `3f` to the direction of the
//! greater curvature κ₁, so the sign of a direction does not matter. *Guaranteed:* it turns with the surface and is 1/s times as large on a surface s times as large. *Not
//! guaranteed:* that it is smooth: it is as rough as the mesh is.
//!
//! The curvature tensor of a face is that of its edges, Σ β |e| (ē⊥ ⊗ ē⊥) / 2A over the bends β of its edges (Cohen-Steiner, Morvan 2003), half of
//! each, since it has two faces; this is its part without trace.

use super::connectivity::Connectivity;
use super::ids::{FaceVec, HalfedgeId, VertexVec};
use super::mesh::{cross, dot, norm, sub};

/// See the module docs; 0 for faces without area.
pub fn principal(c: &Connectivity, positions: &VertexVec<[f64; 3]>) -> FaceVec<[f64; 2]> {
    let normals: FaceVec<[f64; 3]> = (c.faces())
        .map(|f| {
            let [p, q, r] = c.face_vertices(f).map(|v| positions[v]);
            cross(sub(q, p), sub(r, p))
        })
        .collect();
    let edge = |h: HalfedgeId| sub(positions[c.head(h)], positions[c.tail(h)]);
    let on_face = |f| {
        let doubled = norm(normals[f]);
        let first = edge(c.corner_halfedge(f, 0));
        let mut z = [0.0; 2];
        for h in c.face_halfedges(f) {
            let Some(t) = c.twin(h) else { continue };
            let (e, n) = (edge(h), normals[c.face(t)]);
            let length = norm(e);
            let bend = (dot(cross(normals[f], n), e) / length).atan2(dot(normals[f], n));
            // Across the edge: a quarter turn more, which is a half turn of e^{2iθ}.
            let angle = (dot(cross(first, e), normals[f]) / doubled).atan2(dot(first, e));
            let weight = -bend * length;
            z[0] += weight * (2.0 * angle).cos();
            z[1] += weight * (2.0 * angle).sin();
        }
        let z = z.map(|x| x / doubled);
        match z.iter().all(|x| x.is_finite()) {
            true => z,
            false => [0.0; 2],
        }
    };
    c.faces().map(on_face).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Circles around 2, radius 0.5, in rows that are sheared against the circles.
    fn torus(rows: usize, columns: usize) -> (Connectivity, VertexVec<[f64; 3]>) {
        let place = |i: usize, j: usize| {
            let u = TAU * i as f64 / rows as f64;
            let v = TAU * (j as f64 + 0.37 * i as f64) / columns as f64;
            let r = 2.0 + 0.5 * v.cos();
            [r * u.cos(), r * u.sin(), 0.5 * v.sin()]
        };
        let mut positions = Vec::new();
        let mut faces = Vec::new();
        for i in 0..=rows {
            for j in 0..columns {
                positions.push(place(i, j));
                if i < rows {
                    let at = |i: usize, j: usize| (i * columns + j % columns) as u32;
                    let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                    faces.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
        (
            Connectivity::from_faces(&faces, positions.len()).unwrap(),
            positions.into(),
        )
    }

    #[test]
    fn a_torus_has_its_circles() {
        let (c, positions) = torus(120, 48);
        let z = principal(&c, &positions);
        let (mut got, mut wanted) = ([0.0; 2], 0.0);
        for f in c.faces() {
            let [p, q, r] = c.face_vertices(f).map(|v| positions[v]);
            if c.face_halfedges(f).iter().any(|&h| c.twin(h).is_none()) {
                continue;
            }
            let normal = cross(sub(q, p), sub(r, p));
            let middle: [f64; 3] = std::array::from_fn(|i| (p[i] + q[i] + r[i]) / 3.0);
            // Curvature is greatest across the large circle, along which this is.
            let circle = [-middle[1], middle[0], 0.0];
            let first = sub(q, p);
            let angle =
                (dot(cross(first, circle), normal) / norm(normal)).atan2(dot(first, circle));
            let (s, cosine) = (2.0 * angle).sin_cos();
            let area = 0.5 * norm(normal);
            // Relative to the circle.
            got[0] += area * (z[f][0] * cosine + z[f][1] * s);
            got[1] += area * (z[f][1] * cosine - z[f][0] * s);
            let distance = middle[0].hypot(middle[1]);
            wanted += area * (2.0 - (distance - 2.0) / 0.5 / distance);
        }
        assert!((got[0] + wanted).abs() < 0.02 * wanted, "{got:?} {wanted}");
        assert!(got[1].abs() < 0.02 * wanted, "{got:?} {wanted}");
    }

    #[test]
    fn size_and_position_do_not_matter_but_by_a_factor() {
        let (c, positions) = torus(20, 12);
        let turned: Vec<[f64; 3]> = (positions.iter())
            .map(|&[x, y, z]| [3.0 * y + 7.0, 3.0 * z, 3.0 * x - 1.0])
            .collect();
        let (a, b) = (principal(&c, &positions), principal(&c, &turned.into()));
        for f in c.faces() {
            assert!(
                (0..2).all(|i| (a[f][i] - 3.0 * b[f][i]).abs() < 1e-12),
                "{f}"
            );
        }
    }
}
