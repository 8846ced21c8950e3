//! Sharp edges in rows.
//!
//! *Enters:* edges of a mesh. *Leaves:* maximal chains of them, as vertices and as [`Feature`]s.

use super::Feature;
use crate::geometry::ids::{EdgeId, EdgeVec, VertexId, VertexVec};
use crate::geometry::mesh::{Mesh, dot, sub};

/// Cosine of the angle by which a line may turn where edges of noise meet it: those that volumes leave round discs turn by 50°.
const STRAIGHT: f64 = 0.5;

/// How many of these edges meet at each vertex.
pub(super) fn degrees(mesh: &Mesh, edges: &EdgeVec<bool>) -> VertexVec<u32> {
    let c = &mesh.connectivity;
    let mut degree = VertexVec::filled(0, c.vertex_count());
    for (e, _) in edges.enumerate().filter(|(_, is_one)| **is_one) {
        c.edge_vertices(e).into_iter().for_each(|v| degree[v] += 1);
    }
    degree
}

/// Whether just two of these edges meet at a vertex, and one goes on in the other.
pub(super) fn goes_on(mesh: &Mesh, edges: &EdgeVec<bool>, v: VertexId) -> bool {
    let c = &mesh.connectivity;
    let ways = c.outgoing(v).filter(|&h| edges[c.edge(h)]);
    let ways: Vec<[f64; 3]> = ways
        .map(|h| sub(mesh.positions[c.head(h)], mesh.positions[v]))
        .collect();
    let [p, q] = &ways[..] else { return false };
    let lengths = (dot(*p, *p) * dot(*q, *q)).sqrt();
    -dot(*p, *q) >= STRAIGHT * lengths
}

/// Maximal chains of edges, by their vertices, between joints: vertices where other than two of them meet, which lie on the boundary, or which are said to be one; then closed ones.
pub(super) fn chains(
    mesh: &Mesh,
    edges: &EdgeVec<bool>,
    is_joint: impl Fn(VertexId) -> bool,
) -> Vec<Vec<VertexId>> {
    let c = &mesh.connectivity;
    let degree = degrees(mesh, edges);
    let mut is_walked = EdgeVec::filled(false, c.edge_count());
    let neighbours = |v: VertexId| {
        let ways = c.outgoing(v).flat_map(|h| [h, c.prev(h)]);
        ways.map(|h| c.edge(h)).filter(|&e| edges[e])
    };
    let other = |e: EdgeId, v: VertexId| {
        let [a, b] = c.edge_vertices(e);
        if a == v { b } else { a }
    };
    let is_end = |v: VertexId| degree[v] != 2 || c.is_boundary_vertex(v) || is_joint(v);
    let mut chains = Vec::new();
    let mut walk = |start: VertexId, is_walked: &mut EdgeVec<bool>| {
        while let Some(first) = neighbours(start).find(|&e| !is_walked[e]) {
            let mut chain = vec![start];
            let (mut v, mut e) = (start, first);
            loop {
                is_walked[e] = true;
                v = other(e, v);
                chain.push(v);
                if v == start || is_end(v) {
                    break;
                }
                match neighbours(v).find(|&e| !is_walked[e]) {
                    Some(next) => e = next,
                    None => break,
                }
            }
            chains.push(chain);
        }
    };
    for v in c.vertices().filter(|&v| degree[v] > 0 && is_end(v)) {
        walk(v, &mut is_walked);
    }
    for v in c.vertices().filter(|&v| degree[v] > 0) {
        walk(v, &mut is_walked);
    }
    chains
}

/// A chain with its edges and its measures.
pub(super) fn feature(mesh: &Mesh, bend: &EdgeVec<f64>, vertices: Vec<VertexId>) -> Feature {
    let c = &mesh.connectivity;
    let between = |pair: &[VertexId]| {
        let ways = c.outgoing(pair[0]).flat_map(|h| [h, c.prev(h)]);
        let mut edges = ways.map(|h| c.edge(h));
        edges.find(|&e| c.edge_vertices(e).contains(&pair[1]))
    };
    let edges: Vec<EdgeId> = vertices.windows(2).filter_map(between).collect();
    let length: f64 = edges.iter().map(|&e| mesh.edge_length(e)).sum();
    let turned: f64 = edges.iter().map(|&e| mesh.edge_length(e) * bend[e]).sum();
    Feature {
        vertices,
        edges,
        length,
        angle: if length > 0.0 { turned / length } else { 0.0 },
    }
}
