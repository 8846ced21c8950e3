//! The vertex scale that comes nearest to a change of metric which need not be conformal.
//!
//! *Enters:* a triangulation, closed or the half of a symmetric double, and by how much the logarithm of every edge's length changes, in Penner coordinates. *Leaves:* one u a vertex.
//! *Guaranteed:* a conformal change, d_ij = (u_i + u_j)/2, gives its own u back, to rounding.
//!
//! What it is for: a point of a face with barycentric coordinates b over its triangle is Σ b_i v_i, where v_i are the vectors on the light cone with
//! −2⟨v_i, v_j⟩ = l_ij². The new metric has vectors w_i of its own, and Σ b_i v_i ↦ Σ b_i e^{−u_i} w_i is a map of the surface
//! that agrees on the sides of all faces, whatever u is. It is the natural one, an isometry of ideal triangles, on a face where
//! d_ij = (u_i + u_j)/2 on all three sides, so where u_i is the *corner value* d_ij + d_ki − d_jk. Faces that share a vertex need not
//! agree on it unless the change is conformal. So u is the solution of least squares
//!
//! ```text
//! min Σ_faces Σ_sides ((u_i − u_j) − 2 (d_ki − d_jk))²,
//! ```
//!
//! in whose terms are how far, in the hyperbolic metric, points are moved along the sides beyond what isometries do (the translations of
//! Capouellez and Zorin, *Seamless parametrization in Penner coordinates*, 2024, section 5; those may have periods along handles beside, which this u does not have).
//! The constant that is left, one a piece, makes Σ_edges (d_ij − (u_i + u_j)/2) vanish.

use crate::flow::solve::{SolveError, SymmetricSolver};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::disjoint_sets::UnionFind;
use crate::geometry::ids::{EdgeVec, VertexId, VertexVec};

/// Solutions after the first, each of what the last has left: the first is as good as the condition of the matrix, which grows with the mesh.
const REFINEMENTS: usize = 2;

/// The u nearest to `change` (natural logarithms of ratios of lengths, one an edge), one a vertex.
///
/// # Errors
/// A surface that is too large for the solver.
pub fn nearest_scale(
    c: &Connectivity,
    change: &EdgeVec<f64>,
) -> Result<VertexVec<f64>, SolveError> {
    let mut joined = UnionFind::new(c.vertex_count());
    for [i, j] in c.edges().map(|e| c.edge_vertices(e)) {
        joined.join(i.index(), j.index());
    }
    let piece: VertexVec<usize> = c.vertices().map(|v| joined.find(v.index())).collect();
    // One vertex of every piece has u = 0 until the constant is known. A loop says nothing.
    let mut unknown = VertexVec::filled(None, c.vertex_count());
    let mut unknowns = 0;
    for v in c.vertices().filter(|&v| piece[v] != v.index()) {
        unknown[v] = Some(unknowns as u32);
        unknowns += 1;
    }
    let ends = |e| {
        let [i, j] = c.edge_vertices(e);
        (i != j).then(|| [unknown[i], unknown[j]])
    };
    let (mut pairs, mut values) = (Vec::new(), Vec::new());
    let mut diagonal = vec![0.0; unknowns];
    for e in c.edges() {
        let Some(ends) = ends(e) else { continue };
        let faces = if c.is_boundary_edge(e) { 1.0 } else { 2.0 };
        ends.into_iter()
            .flatten()
            .for_each(|i| diagonal[i as usize] += faces);
        if let [Some(i), Some(j)] = ends {
            pairs.push([i, j]);
            values.push(-faces);
        }
    }
    let mut solver = SymmetricSolver::new(unknowns, &pairs)?;
    solver.factorize(&diagonal, &values)?;
    let mut u = VertexVec::filled(0.0, c.vertex_count());
    for _ in 0..=REFINEMENTS {
        let at = residual(c, change, &u);
        let mut rest = vec![0.0; unknowns];
        for (i, at) in unknown.iter().zip(&at) {
            if let Some(i) = i {
                rest[*i as usize] = *at;
            }
        }
        solver.solve(&mut rest);
        for (u, i) in u.as_mut_slice().iter_mut().zip(unknown.iter()) {
            *u += i.map_or(0.0, |i| rest[i as usize]);
        }
    }
    let left = |e| {
        let [i, j] = c.edge_vertices(e);
        change[e] - 0.5 * (u[i] + u[j])
    };
    let mut constant = VertexVec::filled((0.0, 0.0), c.vertex_count());
    for e in c.edges() {
        let (sum, count) = &mut constant[VertexId::new(piece[c.edge_vertices(e)[0]])];
        (*sum, *count) = (*sum + left(e), *count + 1.0);
    }
    let of = |(v, u): (VertexId, &f64)| {
        let (sum, count): (f64, f64) = constant[VertexId::new(piece[v])];
        u + sum / count
    };
    Ok(u.enumerate().map(of).collect())
}

/// Minus the gradient of half the sum of squares at `u`.
fn residual(c: &Connectivity, change: &EdgeVec<f64>, u: &VertexVec<f64>) -> Vec<f64> {
    let mut rest = vec![0.0; c.vertex_count()];
    for f in c.faces() {
        let (vertices, edges) = (c.face_vertices(f), c.face_edges(f));
        for k in 0..3 {
            // The side from i to j is opposite corner k; the edge opposite a corner has the corner's number.
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            let wanted = 2.0 * (change[edges[j]] - change[edges[i]]);
            let (p, q) = (vertices[i], vertices[j]);
            let gap = wanted - (u[p] - u[q]);
            if p != q {
                rest[p.index()] += gap;
                rest[q.index()] -= gap;
            }
        }
    }
    rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::ricci::shapes;

    /// Numbers in [−½, ½).
    fn sequence(state: u64) -> impl FnMut() -> f64 {
        let mut random = shapes::sequence(state);
        move || random() - 0.5
    }

    fn conformal(c: &Connectivity, u: &VertexVec<f64>) -> EdgeVec<f64> {
        let half = |e| {
            let [i, j] = c.edge_vertices(e);
            0.5 * (u[i] + u[j])
        };
        c.edges().map(half).collect()
    }

    #[test]
    fn a_conformal_change_gives_its_scale_back() {
        let mut random = sequence(3);
        for shape in [
            shapes::torus(40, 30),
            shapes::plate(3, 2),
            shapes::plate(0, 2),
        ] {
            let c = &shape.connectivity;
            let u: VertexVec<f64> = c.vertices().map(|_| 6.0 * random()).collect();
            let found = nearest_scale(c, &conformal(c, &u)).unwrap();
            for (a, b) in u.iter().zip(found.iter()) {
                assert!((a - b).abs() < 1e-13 * 6.0, "{a} against {b}");
            }
        }
    }

    /// At the solution of least squares no vertex gains by moving, and any other u is worse.
    #[test]
    fn any_other_scale_is_farther() {
        let mut random = sequence(5);
        let shape = shapes::torus(9, 7);
        let c = &shape.connectivity;
        let change: EdgeVec<f64> = c.edges().map(|_| random()).collect();
        let cost = |u: &VertexVec<f64>| -> f64 {
            let of_face = |f| {
                let (v, e) = (c.face_vertices(f), c.face_edges(f));
                let d = e.map(|e| change[e]);
                let corner: [f64; 3] = [0, 1, 2].map(|k| d[(k + 1) % 3] + d[(k + 2) % 3] - d[k]);
                let gap = |i: usize, j: usize| (u[v[i]] - u[v[j]]) - (corner[i] - corner[j]);
                gap(0, 1).powi(2) + gap(1, 2).powi(2) + gap(2, 0).powi(2)
            };
            c.faces().map(of_face).sum()
        };
        let found = nearest_scale(c, &change).unwrap();
        let least = cost(&found);
        assert!(least > 0.1, "{least}: no change to speak of");
        for _ in 0..20 {
            let other: VertexVec<f64> = found.iter().map(|u| u + 1e-3 * random()).collect();
            assert!(cost(&other) > least);
        }
        let mean: f64 = c.edges().map(|e| change[e] - conformal(c, &found)[e]).sum();
        assert!(mean.abs() < 1e-12);
    }
}
