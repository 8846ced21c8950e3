//! The shortest solution of A d = F, for the Jacobian A and a [`Norm`] M: d = M⁻¹ Aᵀ μ with (A M⁻¹ Aᵀ) μ = F.
//!
//! *Enters:* a [`State`]. *Leaves:* a factor of A M⁻¹ Aᵀ and directions. The cone angles of two vertices are coupled where some edge moves both, about 19 entries a row; a
//! loop is coupled with all vertices near it. So the loops come last in the elimination: rows that are long but few do not fill the rest.

use super::SeamlessError;
use super::jacobian::{ByRow, Columns, most_products};
use super::norm::Norm;
use super::state::{Problem, State};
use crate::flow::solve::SymmetricSolver;
use crate::geometry::ids::{EdgeId, EdgeVec, NONE, VertexId};
use crate::observe::part;
use crate::parallel;
use std::ops::Range;

/// Shifts of the diagonal, relative to its mean, tried in turn until the matrix is positive definite.
const SHIFTS: [f64; 4] = [1e-14, 1e-12, 1e-10, 1e-8];

/// The system at one λ.
pub(super) struct Normal {
    solver: SymmetricSolver,
    pairs: Vec<[u32; 2]>,
    by_edges: Columns,
    /// Where scales are cheaper.
    by_scales: Option<Columns>,
}

/// A M⁻¹ Aᵀ: every pair of equations that are coupled once, by the larger one.
struct Products {
    pairs: Vec<[u32; 2]>,
    values: Vec<f64>,
    diagonal: Vec<f64>,
}

impl Normal {
    /// Factorises at `state`; what `last` has is used again where the pattern is the same.
    pub(super) fn new(
        problem: &Problem,
        state: &State,
        norm: &Norm,
        last: Option<Self>,
    ) -> Result<Self, SeamlessError> {
        let part = part!("Jacobian");
        let equations = problem.equations();
        let by_edges = state.by_edges(problem)?;
        let by_scales = norm.vertex.as_ref();
        let by_scales = by_scales.map(|_| state.by_scales(problem, &by_edges));
        check_density(&by_edges, problem.base.edge_count())?;
        let mut parts = vec![(&by_edges, norm.edge.as_slice())];
        if let (Some(columns), Some(weight)) = (&by_scales, &norm.vertex) {
            parts.push((columns, weight.as_slice()));
        }
        let Products {
            pairs,
            values,
            mut diagonal,
        } = Products::new(equations, &parts);
        drop(part);
        let part = part!("order of elimination");
        let loops = equations - problem.local_equations();
        // An order that is kept although edges were flipped lets the factor fill up: twice over for one edge in a hundred.
        let mut solver = match last {
            Some(last) if last.pairs == pairs => last.solver,
            Some(last) => last.solver.renewed(loops, &pairs)?,
            None => SymmetricSolver::with_border(equations, loops, &pairs)?,
        };
        drop(part);
        let _part = part!("factor");
        let mean = diagonal.iter().sum::<f64>() / equations.max(1) as f64;
        let mut shifted = 0.0;
        let mut result = Ok(());
        for shift in SHIFTS {
            diagonal
                .iter_mut()
                .for_each(|d| *d += (shift - shifted) * mean);
            shifted = shift;
            result = solver.factorize(&diagonal, &values);
            if result.is_ok() {
                break;
            }
        }
        result?;
        Ok(Self {
            solver,
            pairs,
            by_edges,
            by_scales,
        })
    }

    /// The direction d, and A d.
    pub(super) fn direction(
        &mut self,
        problem: &Problem,
        norm: &Norm,
        missing: &[f64],
    ) -> (EdgeVec<f64>, Vec<f64>) {
        let mut multiplier = missing.to_vec();
        self.solver.solve(&mut multiplier);
        let parts = norm.edge.iter().enumerate();
        let parts = parts.map(|(e, weight)| weight * self.by_edges.dot(e, &multiplier));
        let mut direction: EdgeVec<f64> = parts.collect();
        if let (Some(columns), Some(weight)) = (&self.by_scales, &norm.vertex) {
            let scale: Vec<f64> = (0..columns.count())
                .map(|v| weight[VertexId::new(v)] * columns.dot(v, &multiplier))
                .collect();
            let base = problem.base;
            for (e, d) in direction.as_mut_slice().iter_mut().enumerate() {
                let ends = base.edge_vertices(EdgeId::new(e));
                let [i, j] = ends.map(|v| problem.vertex_shares[v].index());
                *d += scale[i] + scale[j];
            }
        }
        // An image's own column is empty.
        let change = self.by_edges.times(&direction, missing.len());
        let direction = problem.shares.iter().map(|&e| direction[e]).collect();
        (direction, change)
    }
}

/// Refuses what would take hours and all of the memory: an edge that was flipped hundreds of times over moves the angles of as many vertices.
fn check_density(by_edges: &Columns, edges: usize) -> Result<(), SeamlessError> {
    let rows = (0..by_edges.count()).map(|c| by_edges.column(c).0.len());
    let products: usize = rows.map(|n| n * n / 2).sum();
    let most = most_products(edges);
    match products > most {
        true => Err(SeamlessError::TooDense { products, most }),
        false => Ok(()),
    }
}

/// Rows that are summed by one thread.
const ROWS: usize = 8192;

impl Products {
    /// Σ w a aᵀ over the columns a of all parts, row by row (Gustavson 1978).
    fn new(equations: usize, parts: &[(&Columns, &[f64])]) -> Self {
        let by_row: Vec<_> = parts.iter().map(|part| part.0.by_row(equations)).collect();
        let of_rows = parallel::map_numbers(equations.div_ceil(ROWS), |i| {
            let rows = i * ROWS..equations.min((i + 1) * ROWS);
            Self::of_rows(rows, parts, &by_row)
        });
        let mut all = Self {
            pairs: Vec::with_capacity(of_rows.iter().map(|p| p.pairs.len()).sum()),
            values: Vec::with_capacity(of_rows.iter().map(|p| p.pairs.len()).sum()),
            diagonal: Vec::with_capacity(equations),
        };
        for rows in of_rows {
            all.pairs.extend(rows.pairs);
            all.values.extend(rows.values);
            all.diagonal.extend(rows.diagonal);
        }
        all
    }

    fn of_rows(rows: Range<usize>, parts: &[(&Columns, &[f64])], by_row: &[ByRow]) -> Self {
        let (mut pairs, mut values) = (Vec::new(), Vec::new());
        let mut diagonal = vec![0.0; rows.len()];
        let mut sum = vec![0.0; rows.end];
        let mut met = vec![NONE; rows.end];
        let mut coupled: Vec<u32> = Vec::new();
        for (r, diagonal) in rows.zip(&mut diagonal) {
            for ((columns, weight), (first, entries)) in parts.iter().zip(by_row) {
                for &(c, at) in &entries[first[r] as usize..first[r + 1] as usize] {
                    let (rows, values) = columns.column(c as usize);
                    let v = weight[c as usize] * values[at as usize];
                    *diagonal += v * values[at as usize];
                    for (&s, u) in rows[..at as usize].iter().zip(values) {
                        let place = s as usize;
                        if met[place] != r as u32 {
                            (met[place], sum[place]) = (r as u32, 0.0);
                            coupled.push(s);
                        }
                        sum[place] += v * u;
                    }
                }
            }
            for s in coupled.drain(..) {
                pairs.push([s, r as u32]);
                values.push(sum[s as usize]);
            }
        }
        Self {
            pairs,
            values,
            diagonal,
        }
    }
}
