//! Harmonic functions on a triangulated disk.
//!
//! *Enters:* a disk, the lengths of its edges, and values on its border. *Leaves:* the function with these values whose interior
//! ones are weighted means of their neighbours': Σ w (h_j − h_i) = 0, with cotangent weights.
//!
//! *Guaranteed:* positive weights (those of edges that are not Delaunay are raised). So the maximum principle holds, and two functions
//! that take the border to that of a convex polygon, no inner edge to one of its sides, map the disk one to one (W. T. Tutte, *How to draw a
//! graph*, 1963; M. S. Floater, *One-to-one piecewise linear mappings over triangulations*, 2003). *Not guaranteed:* that linear functions
//! of a flat disk are reproduced where weights were raised.

use super::RectangleError;
use crate::flow::solve::SymmetricSolver;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, HalfedgeId, VertexVec};
use crate::geometry::triangle::cotangents;

/// Least weight of an edge, in units of the cotangent of π/4.
const LEAST_WEIGHT: f64 = 1e-3;
/// Largest weight, so that slivers do not spoil the condition.
const LARGEST_WEIGHT: f64 = 1e6;

/// One function for each set of values on the border, which are given at the tails of its halfedges, in order.
pub(super) fn harmonic(
    c: &Connectivity,
    length: &EdgeVec<f64>,
    border: &[HalfedgeId],
    border_values: &[Vec<f64>],
) -> Result<Vec<VertexVec<f64>>, RectangleError> {
    with_weights(c, &weights(c, length), border, border_values)
}

/// The same with given weights, which must be positive.
pub(super) fn with_weights(
    c: &Connectivity,
    weight: &EdgeVec<f64>,
    border: &[HalfedgeId],
    border_values: &[Vec<f64>],
) -> Result<Vec<VertexVec<f64>>, RectangleError> {
    let mut unknown = VertexVec::filled(u32::MAX, c.vertex_count());
    let mut unknowns = 0;
    for v in c.vertices().filter(|&v| !c.is_boundary_vertex(v)) {
        unknown[v] = unknowns;
        unknowns += 1;
    }
    let mut place = VertexVec::filled(usize::MAX, c.vertex_count());
    for (i, &h) in border.iter().enumerate() {
        place[c.tail(h)] = i;
    }
    let size = unknowns as usize;
    let mut diagonal = vec![0.0; size];
    let mut pairs = Vec::with_capacity(c.edge_count());
    let mut values = Vec::with_capacity(c.edge_count());
    let mut rhs = vec![0.0; size * border_values.len()];
    for e in c.edges() {
        let ends = c.edge_vertices(e);
        let w = weight[e];
        for (v, other) in [(ends[0], ends[1]), (ends[1], ends[0])] {
            let row = unknown[v] as usize;
            if row >= size {
                continue;
            }
            diagonal[row] += w;
            if unknown[other] as usize >= size {
                for (k, given) in border_values.iter().enumerate() {
                    rhs[k * size + row] += w * given[place[other]];
                }
            } else if row < unknown[other] as usize {
                pairs.push([unknown[v], unknown[other]]);
                values.push(-w);
            }
        }
    }
    let mut solver = SymmetricSolver::new(size, &pairs)?;
    solver.factorize(&diagonal, &values)?;
    solver.solve(&mut rhs);
    let whole = |(k, given): (usize, &Vec<f64>)| {
        let value = |v| match unknown[v] {
            u32::MAX => given[place[v]],
            row => rhs[k * size + row as usize],
        };
        c.vertices().map(value).collect()
    };
    Ok(border_values.iter().enumerate().map(whole).collect())
}

/// Positive weights: cotangents, raised where they are too small.
pub(super) fn weights(c: &Connectivity, length: &EdgeVec<f64>) -> EdgeVec<f64> {
    let mut weight = EdgeVec::filled(0.0, c.edge_count());
    for f in c.faces() {
        let edges = c.face_edges(f);
        // A face without area pulls nothing.
        let cotangent = cotangents(edges.map(|e| length[e])).unwrap_or_default();
        for k in 0..3 {
            weight[edges[k]] += 0.5 * cotangent[k];
        }
    }
    let bounded = |&w: &f64| w.clamp(LEAST_WEIGHT, LARGEST_WEIGHT);
    weight.iter().map(bounded).collect()
}
