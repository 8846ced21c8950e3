//! The order of vertices and faces in large components.

use super::*;
use crate::geometry::ids::FaceId;

/// A wavy sheet of n × n squares whose vertices and faces stand in the order of multiples of numbers that have no divisor in common with how many there are, and one
/// triangle before them.
fn shuffled(n: usize) -> Soup {
    let side = n + 1;
    let place = |i: usize| (i * 7919) % (side * side);
    let mut positions = vec![[0.0; 3]; side * side];
    for i in 0..side * side {
        let (x, y) = ((i % side) as f64, (i / side) as f64);
        positions[place(i)] = [x, y, (0.1 * x).sin() * (0.13 * y).cos()];
    }
    let mut faces = vec![[0; 3]; 2 * n * n];
    for i in 0..n * n {
        let corner = |dx: usize, dy: usize| place((i / n + dy) * side + i % n + dx) as u32;
        let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
        faces[(2 * i * 7919) % (2 * n * n)] = [a, b, c];
        faces[((2 * i + 1) * 7919) % (2 * n * n)] = [a, c, d];
    }
    let first = positions.len() as u32;
    positions.extend([[-9.0, 0.0, 0.0], [-8.0, 0.0, 0.0], [-9.0, 1.0, 0.0]]);
    faces.insert(0, [0, 1, 2].map(|k| first + k));
    let mut soup = soup(positions, faces);
    let values = soup.faces.iter().flatten().map(|&v| v as f32);
    soup.attributes.push(CornerAttribute {
        kind: AttributeKind::TexCoord(0),
        components: 1,
        values: values.collect(),
    });
    soup
}

/// Mean distance of the numbers of neighbouring faces, as a part of their number.
fn spread(mesh: &Mesh) -> f64 {
    let c = &mesh.connectivity;
    let number = |f: FaceId| f.raw() as f64;
    let distances = c.edges().filter_map(|e| {
        let h = c.edge_halfedge(e);
        let t = c.twin(h)?;
        Some((number(c.face(h)) - number(c.face(t))).abs())
    });
    let (count, sum) = distances.fold((0.0, 0.0), |(n, sum), d| (n + 1.0, sum + d));
    sum / count / c.face_count() as f64
}

#[test]
fn neighbours_in_large_components_lie_near_each_other() {
    for (n, is_reordered) in [(100, false), (257, true)] {
        let soup = shuffled(n);
        let result = repaired(&soup);
        let [small, large] = &result.components[..] else {
            panic!("{} components", result.components.len());
        };
        assert_eq!((small.faces, large.faces), (1, 2 * n * n));
        let mesh = large.mesh.as_ref().unwrap();
        assert_eq!(spread(mesh) < 0.01, is_reordered, "{}", spread(mesh));
        // Everything has gone with its face.
        for f in mesh.connectivity.faces() {
            let source = mesh.source_face[f] as usize;
            let halfedges = mesh.connectivity.face_halfedges(f);
            for (k, h) in halfedges.into_iter().enumerate() {
                let v = mesh.connectivity.tail(h);
                assert_eq!(mesh.source_vertex[v], soup.faces[source][k]);
                assert_eq!(result.locate(mesh.source_vertex[v]), Some((1, v)));
                let value = mesh.attributes[0].corner(f.index(), k);
                assert_eq!(value, [soup.faces[source][k] as f32]);
            }
        }
    }
}
