//! Curvature without what noise adds to it.
//!
//! On scans the angles around vertices differ from 2π by as much as at the corners of a box, up here and down there, and the smoothest field is singular wherever they do: its directions are carried around a vertex by the surface's own angles. So they are carried by a connection whose curvature is that of the
//! surface after it flowed, as heat does, over a short length; the difference, which the metric takes up, is spread over the edges.
//!
//! *Enters:* a Delaunay triangulation with its corner angles. *Leaves:* for every halfedge by how much less a direction turns across it; the twin's is its negative. With k from (M + tL) k = K, where M are areas of vertices and L is the cotangent Laplacian, that is t w_ij (k_j − k_i) across the halfedge
//! from i to j, and sums up to K − M k around a vertex. *Guaranteed:* the border has its own directions and takes up no curvature; the total curvature is as before.

use crate::flow::solve::{SolveError, SymmetricSolver};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, FaceVec, HalfedgeVec, VertexVec};
use std::f64::consts::TAU;

/// Added to the diagonal, relative to its largest entry: a vertex of the border may have no edge inside.
const SHIFT: f64 = 1e-12;

/// Most that a cotangent counts: faces without width would take all digits.
const MOST: f64 = 1e6;

/// See the module docs. `reach`: length over which curvature is spread, √(2t), in the unit whose square `area` has.
pub fn diffused(
    c: &Connectivity,
    angle: &FaceVec<[f64; 3]>,
    area: &FaceVec<f64>,
    reach: f64,
) -> Result<HalfedgeVec<f64>, SolveError> {
    let time = 0.5 * reach * reach;
    let mut weight = EdgeVec::filled(0.0, c.edge_count());
    let mut curvature = VertexVec::filled(TAU, c.vertex_count());
    let mut mass = VertexVec::filled(0.0, c.vertex_count());
    for h in c.halfedges() {
        let (f, v) = (c.face(h), c.tail(h));
        curvature[v] -= angle[f][c.corner(h)];
        mass[v] += area[f] / 3.0;
        // Across from the corner before.
        let opposite = angle[f][c.corner(c.prev(h))];
        weight[c.edge(h)] += 0.5 * time * opposite.tan().recip().min(MOST);
    }
    for h in c.halfedges().filter(|&h| c.twin(h).is_none()) {
        weight[c.edge(h)] = 0.0;
        for v in [c.tail(h), c.head(h)] {
            (curvature[v], mass[v]) = (0.0, 0.0);
        }
    }
    let mut diagonal: Vec<f64> = mass.iter().copied().collect();
    let (mut pairs, mut values) = (Vec::new(), Vec::new());
    for e in c.edges() {
        let h = c.edge_halfedge(e);
        let ends = [c.tail(h), c.head(h)].map(|v| v.index());
        // Of a Delaunay triangulation none is negative but by rounding.
        weight[e] = weight[e].max(0.0);
        if ends[0] == ends[1] || weight[e] == 0.0 {
            continue;
        }
        ends.iter().for_each(|&v| diagonal[v] += weight[e]);
        pairs.push(ends.map(|v| v as u32));
        values.push(-weight[e]);
    }
    let largest = diagonal.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    diagonal.iter_mut().for_each(|d| *d += SHIFT * largest);
    let mut solver = SymmetricSolver::new(diagonal.len(), &pairs)?;
    solver.factorize(&diagonal, &values)?;
    let mut density: Vec<f64> = curvature.iter().copied().collect();
    solver.solve(&mut density);
    let across = |h| {
        let [from, to] = [c.tail(h), c.head(h)].map(|v| density[v.index()]);
        weight[c.edge(h)] * (to - from)
    };
    Ok(c.halfedges().map(across).collect())
}

#[cfg(test)]
mod tests;
