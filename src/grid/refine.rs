//! Small meshes with enough vertices for the cones of a grid.
//!
//! *Enters:* a mesh. *Leaves:* the same surface, whose longest edges are divided into three one after another until it has enough faces. *Guaranteed:* new vertices lie on old edges, old ones keep their numbers.
//!
//! Halves would lie where texels of a cell lie, too: these would be on edges of faces, which say little of them.
//!
//! A tetrahedron needs eight cones of three quarter turns and has four vertices; a triangle needs one inside and has none there.

use crate::atlas::charted::lift_mesh;
use crate::geometry::ids::EdgeId;
use crate::geometry::mesh::Mesh;
use crate::geometry::subdivision::Subdivision;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Meshes with fewer faces are refined.
const FACES: usize = 200;

/// See the module docs.
pub(crate) fn refined(mesh: Mesh) -> Mesh {
    if mesh.connectivity.face_count() >= FACES {
        return mesh;
    }
    let mut fine = Subdivision::identity(&mesh);
    // Lengths of equal edges may differ in their last digits.
    let length = |fine: &Subdivision, e: EdgeId| {
        let [a, b] = fine.connectivity.edge_vertices(e);
        let (p, q) = (fine.position[a], fine.position[b]);
        let squared: f64 = (0..3).map(|i| (p[i] - q[i]).powi(2)).sum();
        squared as f32
    };
    let mut longest = BinaryHeap::new();
    for e in fine.connectivity.edges() {
        longest.push((length(&fine, e).to_bits(), Reverse(e)));
    }
    while let Some((bits, Reverse(e))) = longest.pop() {
        if fine.connectivity.face_count() >= FACES {
            break;
        }
        if bits != length(&fine, e).to_bits() {
            continue;
        }
        let [_, end] = fine.connectivity.edge_vertices(e);
        let first = fine.split_edge(e, 1.0 / 3.0);
        let c = &fine.connectivity;
        let rest = c.outgoing(first).find(|&h| c.head(h) == end);
        let second = rest.map(|h| c.edge(h)).map(|e| fine.split_edge(e, 0.5));
        let c = &fine.connectivity;
        let around: Vec<EdgeId> = [Some(first), second]
            .into_iter()
            .flatten()
            .flat_map(|v| c.outgoing(v))
            .flat_map(|h| [c.edge(h), c.edge(c.prev(h))])
            .collect();
        for e in around {
            longest.push((length(&fine, e).to_bits(), Reverse(e)));
        }
    }
    lift_mesh(mesh, &fine)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::mesh::triangle_area;
    use crate::geometry::polycube::polycube;

    #[test]
    fn a_cube_gets_vertices_on_its_edges_and_faces() {
        let mesh = polycube([[0, 0, 0]], |_, _, _| true);
        let area = |mesh: &Mesh| {
            let faces = mesh.connectivity.faces();
            faces
                .map(|f| triangle_area(mesh.face_positions(f)))
                .sum::<f64>()
        };
        let (vertices, before) = (mesh.positions.len(), area(&mesh));
        let topology = mesh.connectivity.topology();
        let fine = refined(mesh.clone());
        assert!((FACES..FACES + 4).contains(&fine.connectivity.face_count()));
        assert!((area(&fine) - before).abs() < 1e-12);
        assert_eq!(
            fine.positions.as_slice()[..vertices],
            *mesh.positions.as_slice()
        );
        let after = fine.connectivity.topology();
        assert_eq!(after.euler_characteristic, topology.euler_characteristic);
        // None is longer than half of what faces of that number have.
        let c = &fine.connectivity;
        let longest = c.edges().map(|e| fine.edge_length(e)).fold(0.0, f64::max);
        assert!(longest < 0.6, "{longest}");
    }
}
