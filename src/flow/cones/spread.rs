//! Well-spread vertices by distance along the edges (farthest-point sampling), and the most central one.
//!
//! No choice depends on the numbering of vertices: where distances tie, the vertex with the lowest coordinates
//! (x, then y, then z) wins, and only vertices at one position are told apart by their number.

use crate::geometry::ids::{VertexId, VertexVec};
use crate::geometry::mesh::{Mesh, distance, triangle_area};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Up to `count` interior vertices far from each other and from the boundary.
///
/// On a closed surface the first is the vertex farthest in space from the centroid of the area; with a boundary it is the
/// vertex farthest from the boundary. Each further one is farthest, along the edges, from all before it and
/// from the boundary. Fewer come back where there are fewer interior vertices.
pub fn spread(mesh: &Mesh, count: usize) -> Vec<VertexId> {
    let connectivity = &mesh.connectivity;
    let boundary: Vec<VertexId> = connectivity
        .vertices()
        .filter(|&v| connectivity.is_boundary_vertex(v))
        .collect();
    let mut nearest = VertexVec::filled(f64::INFINITY, connectivity.vertex_count());
    let mut chosen: Vec<VertexId> = Vec::new();
    if boundary.is_empty() && count > 0 {
        let center = centroid(mesh);
        let first = best(mesh, |v| distance(mesh.positions[v], center));
        chosen.extend(first);
        approach(mesh, &chosen, &mut nearest);
    } else {
        approach(mesh, &boundary, &mut nearest);
    }
    while chosen.len() < count {
        let farthest = best(mesh, |v| nearest[v]).filter(|&v| nearest[v] > 0.0);
        let Some(v) = farthest else { break };
        chosen.push(v);
        approach(mesh, &[v], &mut nearest);
    }
    chosen
}

/// The interior vertex whose greatest distance, along the edges, to eight spread vertices is least.
pub fn central(mesh: &Mesh) -> Option<VertexId> {
    let mut farthest = VertexVec::filled(0.0f64, mesh.connectivity.vertex_count());
    for v in spread(mesh, 8) {
        let mut from = VertexVec::filled(f64::INFINITY, mesh.connectivity.vertex_count());
        approach(mesh, &[v], &mut from);
        for (w, &d) in from.enumerate() {
            farthest[w] = farthest[w].max(d);
        }
    }
    best(mesh, |v| -farthest[v])
}

/// Area centroid; the first vertex where there is no area.
fn centroid(mesh: &Mesh) -> [f64; 3] {
    let mut sum = [0.0; 3];
    let mut total = 0.0;
    // Relative to one vertex: a model far from the origin keeps its digits.
    let origin = mesh.positions[VertexId::new(0)];
    for f in mesh.connectivity.faces() {
        let corners = mesh.face_positions(f);
        let area = triangle_area(corners);
        total += area;
        for (i, s) in sum.iter_mut().enumerate() {
            *s += area * corners.iter().map(|p| p[i] - origin[i]).sum::<f64>() / 3.0;
        }
    }
    if total > 0.0 {
        std::array::from_fn(|i| origin[i] + sum[i] / total)
    } else {
        origin
    }
}

/// The interior vertex of greatest value; ties as the module docs say.
fn best(mesh: &Mesh, value: impl Fn(VertexId) -> f64) -> Option<VertexId> {
    let order = |&v: &VertexId, &w: &VertexId| {
        let ties = by_position(mesh.positions[w], mesh.positions[v]).then(w.cmp(&v));
        value(v).total_cmp(&value(w)).then(ties)
    };
    mesh.connectivity
        .vertices()
        .filter(|&v| !mesh.connectivity.is_boundary_vertex(v))
        .max_by(order)
}

/// Compares coordinates, x first.
pub(crate) fn by_position(p: [f64; 3], q: [f64; 3]) -> Ordering {
    (0..3).fold(Ordering::Equal, |o, i| o.then(p[i].total_cmp(&q[i])))
}

/// A vertex that paths have come to.
pub(super) struct Front {
    pub(super) distance: f64,
    pub(super) vertex: VertexId,
}

impl Ord for Front {
    /// Reversed: the heap yields the nearest first.
    fn cmp(&self, other: &Self) -> Ordering {
        let order = other.distance.total_cmp(&self.distance);
        order.then(other.vertex.cmp(&self.vertex))
    }
}
impl PartialOrd for Front {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl PartialEq for Front {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Front {}

/// Lowers `nearest` to the distance from the sources along the edges (Dijkstra), wherever that is less.
pub(super) fn approach(mesh: &Mesh, sources: &[VertexId], nearest: &mut VertexVec<f64>) {
    let mut heap = BinaryHeap::new();
    for &vertex in sources {
        nearest[vertex] = 0.0;
        heap.push(Front {
            distance: 0.0,
            vertex,
        });
    }
    while let Some(front) = heap.pop() {
        if front.distance > nearest[front.vertex] {
            continue;
        }
        for vertex in mesh.connectivity.neighbours(front.vertex) {
            let step = distance(mesh.positions[front.vertex], mesh.positions[vertex]);
            let distance = front.distance + step;
            if distance < nearest[vertex] {
                nearest[vertex] = distance;
                heap.push(Front { distance, vertex });
            }
        }
    }
}
