//! Vertices of a mesh after repair by the numbers that they have in the file.

use crate::flow::feasibility::Violation;
use crate::geometry::ids::{NONE, VertexId};
use crate::geometry::mesh::Mesh;

/// Number in the file of a vertex, or of one beside it where repair put it in.
pub(crate) fn source_vertex(mesh: &Mesh, v: VertexId) -> u32 {
    let around = std::iter::once(v).chain(mesh.connectivity.neighbours(v));
    let mut known = around.map(|w| mesh.source_vertex[w]).filter(|&s| s != NONE);
    known.next().unwrap_or(v.raw())
}

/// The same with the vertices of the file: those that repair put in are left out of the list, but counted.
pub(crate) fn in_source(violation: Violation, mesh: &Mesh) -> Violation {
    let named = |v: VertexId| VertexId::new(source_vertex(mesh, v) as usize);
    let mut vertices: Vec<VertexId> = (violation.vertices.iter())
        .filter(|&&v| mesh.source_vertex[v] != NONE)
        .map(|&v| named(v))
        .collect();
    vertices.sort_unstable();
    Violation {
        vertex: named(violation.vertex),
        vertices,
        ..violation
    }
}
