//! The linear system of one Newton step: the Hessian ∂K/∂u by unknowns.
//!
//! *Enters:* a triangulation, which vertices have an unknown, the weights of its edges. *Leaves:* the factor. Vertices that share their
//! `u` are one unknown; where everything is prescribed, one vertex is left out, which removes the constants and keeps the
//! matrix sparse.

use crate::flow::solve::{SolveError, SymmetricSolver};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeId, EdgeVec, NONE, VertexId, VertexVec};

/// Share of the edges that may be flipped before the unknowns are ordered anew: a stale order lets the factor fill up many times
/// over (8228 flips of 0.2 million edges: four times), and costs nothing measurable below this.
const STALE_SHARE: f64 = 2e-4;
/// Which vertices have an unknown.
pub(crate) struct Unknowns<'a> {
    pub(crate) connectivity: &'a Connectivity,
    /// False where `u` stays.
    pub(crate) prescribed: &'a VertexVec<bool>,
    /// Vertex with whose `u` that of a vertex moves.
    pub(crate) shares: &'a VertexVec<VertexId>,
    /// True where adding a constant to `u` changes nothing.
    pub(crate) scale_free: bool,
    /// Flips so far.
    pub(crate) flips: usize,
}

/// The system on one pattern.
pub(crate) struct System {
    pub(crate) solver: SymmetricSolver,
    /// Number of the unknown of a vertex, `NONE` where `u` stays.
    pub(crate) unknown: VertexVec<u32>,
    unknowns: usize,
    /// Edges between two unknowns.
    edge: Vec<EdgeId>,
    /// Number of flips at which the pattern was taken.
    pub(crate) flips: usize,
    /// Number of flips at which the unknowns were ordered.
    ordered: usize,
}

/// Diagonal and off-diagonal entries of the Hessian by unknowns, and the largest sum of absolute values in a row.
pub(crate) struct Hessian {
    pub(crate) diagonal: Vec<f64>,
    pub(crate) off_diagonal: Vec<f64>,
    largest: f64,
}

impl System {
    /// The unknowns of the triangulation as it is now. Vertices that share their `u` are one unknown. `last`, of the same unknowns, leaves its memory, and its
    /// order where hardly an edge was flipped since.
    pub(crate) fn new(of: &Unknowns, last: Option<Self>) -> Result<Self, SolveError> {
        let connectivity = of.connectivity;
        let mut own: Vec<VertexId> = connectivity
            .vertices()
            .filter(|&v| of.prescribed[v] && of.shares[v] == v)
            .collect();
        if of.scale_free {
            own.pop();
        }
        let mut unknown = VertexVec::filled(NONE, connectivity.vertex_count());
        for (i, &v) in own.iter().enumerate() {
            unknown[v] = i as u32;
        }
        for v in connectivity.vertices() {
            unknown[v] = unknown[of.shares[v]];
        }
        let (mut edge, mut pairs) = (Vec::new(), Vec::new());
        for e in connectivity.edges() {
            let [i, j] = connectivity.edge_vertices(e).map(|v| unknown[v]);
            if i != NONE && j != NONE && i != j {
                edge.push(e);
                pairs.push([i, j]);
            }
        }
        let flips = of.flips;
        let fresh = |last: &Self| {
            (flips - last.ordered) as f64 <= STALE_SHARE * connectivity.edge_count() as f64
        };
        let (solver, ordered) = match last {
            Some(last) if fresh(&last) => (last.solver.with_pairs(&pairs)?, last.ordered),
            Some(last) => (last.solver.renewed(0, &pairs)?, flips),
            None => (SymmetricSolver::new(own.len(), &pairs)?, flips),
        };
        Ok(Self {
            solver,
            unknowns: own.len(),
            unknown,
            edge,
            flips,
            ordered,
        })
    }

    /// The entries for the weights of all edges.
    pub(crate) fn assemble(&self, connectivity: &Connectivity, weight: &EdgeVec<f64>) -> Hessian {
        let mut diagonal = vec![0.0; self.unknowns];
        let mut row = vec![0.0; self.unknowns];
        for (e, &w) in weight.enumerate() {
            let [i, j] = connectivity.edge_vertices(e).map(|v| self.unknown[v]);
            // An edge within one unknown (a loop, or from a vertex to its mirror image) moves no angle.
            if i != j {
                for i in [i, j].into_iter().filter(|&i| i != NONE) {
                    diagonal[i as usize] += w;
                    row[i as usize] += 2.0 * w.abs();
                }
            }
        }
        Hessian {
            diagonal,
            off_diagonal: self.edge.iter().map(|&e| -weight[e]).collect(),
            largest: row.into_iter().fold(f64::MIN_POSITIVE, f64::max),
        }
    }

    /// Solves H δ = −residual with `shift` (relative to the largest row) on the diagonal; δ is 0 at vertices that are no
    /// unknowns. `None` where the matrix is not positive definite.
    pub(crate) fn direction(
        &mut self,
        hessian: &Hessian,
        shift: f64,
        residual: &VertexVec<f64>,
    ) -> Option<VertexVec<f64>> {
        let shifted = hessian
            .diagonal
            .iter()
            .map(|d| d + shift * hessian.largest)
            .collect::<Vec<_>>();
        self.solver
            .factorize(&shifted, &hessian.off_diagonal)
            .ok()?;
        let mut rhs = vec![0.0; self.unknowns];
        for (v, r) in residual.enumerate() {
            if self.unknown[v] != NONE {
                rhs[self.unknown[v] as usize] -= r;
            }
        }
        self.solver.solve(&mut rhs);
        let at = |&i: &u32| rhs.get(i as usize).copied().unwrap_or(0.0);
        Some(self.unknown.iter().map(at).collect())
    }
}
