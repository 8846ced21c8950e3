//! Angles to begin with: the nearest to equilateral that sum to what is wanted in every face and at every vertex.

use super::constraint::Constraint;
use crate::flow::solve::{SolveError, SymmetricSolver};
use crate::geometry::ids::{HalfedgeId, VertexId, VertexVec};

/// One angle a corner, radians, by the halfedge that leaves it. Sums are met to rounding; bounds are not looked at.
///
/// Minimises Σ (θ − ρπ/3)² over all corners. With multipliers a of vertices and b of faces, θ = ρπ/3 + a + b, b = −mean(a)
/// over the face, and a solves a Laplacian with a third of the number of faces as an edge's weight. a is 0 on a free
/// boundary, or else at vertex 0, where any constant would do.
pub(super) fn nearest_to_equilateral(constraint: &Constraint) -> Result<Vec<f64>, SolveError> {
    let c = constraint.connectivity();
    let third = constraint.face_room() / 3.0;
    let free = c.vertices().any(|v| !constraint.is_prescribed(v));
    let unknown: Vec<VertexId> = c
        .vertices()
        .filter(|&v| constraint.is_prescribed(v) && (free || v.index() > 0))
        .collect();
    let mut number = VertexVec::filled(None, c.vertex_count());
    for (i, &v) in unknown.iter().enumerate() {
        number[v] = Some(i);
    }
    let mut diagonal = vec![0.0; unknown.len()];
    let (mut pairs, mut off_diagonal) = (Vec::new(), Vec::new());
    for e in c.edges() {
        let [i, j] = c.edge_vertices(e);
        if i == j {
            continue;
        }
        let weight = if c.is_boundary_edge(e) { 1.0 } else { 2.0 } / 3.0;
        for k in [i, j].into_iter().filter_map(|v| number[v]) {
            diagonal[k] += weight;
        }
        if let (Some(i), Some(j)) = (number[i], number[j]) {
            pairs.push([i as u32, j as u32]);
            off_diagonal.push(-weight);
        }
    }
    let mut solution: Vec<f64> = unknown
        .iter()
        .map(|&v| constraint.wanted(v) - third * c.outgoing(v).count() as f64)
        .collect();
    let mut solver = SymmetricSolver::new(unknown.len(), &pairs)?;
    solver.factorize(&diagonal, &off_diagonal)?;
    solver.solve(&mut solution);
    let a = |h: HalfedgeId| number[c.tail(h)].map_or(0.0, |k| solution[k]);
    Ok(c.halfedges()
        .map(|h| {
            let others = a(c.next(h)) + a(c.prev(h));
            third + (2.0 * a(h) - others) / 3.0
        })
        .collect())
}
