//! Newton with a line search on the convex energy (tutorial 3.4).
//!
//! Each step solves (Hessian) δ = K̄ − K. Where a constant may be added to `u`, one vertex is left out of
//! the system, which removes the kernel without spoiling sparsity; a free boundary is left out whole.
//!
//! A step of length s is taken when the directional derivative Σ (K − K̄) δ at its end is still ≤ 0, so the energy fell by
//! convexity, *or* when ‖K − K̄‖₂ fell by a tenth. Insisting on the sign alone halves every step near
//! the minimum, where rounding decides it, and turns quadratic convergence into a factor of ½ a step.
//!
//! After the tolerance is met, full steps are taken as long as each at least halves the error: they are cheap, and
//! the layout profits from curvatures at the floor of float64.

use super::{FlowError, FlowStep, Problem, Solution, dot, moved};
use crate::flow::metric::Evaluation;
use crate::flow::solve::SymmetricSolver;
use crate::geometry::ids::{EdgeId, EdgeVec, VertexId, VertexVec};

/// Largest change of `u` tried in one step: e^20 in scale. Beyond it the quadratic model means nothing.
const LARGEST_CHANGE: f64 = 20.0;
/// Largest range of `u`: beyond it lengths leave float64, and `u` runs away from a minimum that does not exist.
const LARGEST_RANGE: f64 = 600.0;
/// The line search gives up below this step.
const SMALLEST_STEP: f64 = 1e-10;
/// Largest number of steps after the tolerance is met.
const POLISHING_STEPS: usize = 8;
/// Largest difference in what a step would still add to `u` at the end. A packing that (6) rules out by equality has curvatures
/// that reach the target only as `u` runs away, one unit a Newton step, until rounding takes it for converged.
const REMAINING_CHANGE: f64 = 0.1;
/// Shifts of the diagonal, relative to the largest row, tried in turn until a direction leads down. The first is the rule;
/// the others are for Hessians that are only semidefinite, or nearly so (all faces of a vertex broken).
const SHIFTS: [f64; 7] = [0.0, 1e-14, 1e-11, 1e-8, 1e-5, 1e-3, 1e-1];

/// The Newton system with its fixed pattern.
struct System {
    solver: SymmetricSolver,
    /// Vertices that are unknowns.
    unknown: Vec<VertexId>,
    /// Edges between unknowns, one a pair.
    edge: Vec<EdgeId>,
}

impl System {
    fn new(problem: &Problem) -> Result<Self, FlowError> {
        let connectivity = problem.metric.connectivity;
        let mut unknown: Vec<VertexId> = connectivity
            .vertices()
            .filter(|&v| problem.prescribed[v])
            .collect();
        if problem.scale_free {
            unknown.pop();
        }
        let mut index = VertexVec::filled(None, connectivity.vertex_count());
        for (i, &v) in unknown.iter().enumerate() {
            index[v] = Some(i as u32);
        }
        let (mut edge, mut pairs) = (Vec::new(), Vec::new());
        for e in connectivity.edges() {
            let [i, j] = connectivity.edge_vertices(e).map(|v| index[v]);
            if let (Some(i), Some(j)) = (i, j)
                && i != j
            {
                edge.push(e);
                pairs.push([i, j]);
            }
        }
        Ok(Self {
            solver: SymmetricSolver::new(unknown.len(), &pairs)?,
            unknown,
            edge,
        })
    }

    /// Sets the Hessian with `shift` (relative to its largest row) on the diagonal, and solves H δ = −residual; δ is 0 at
    /// vertices that are no unknowns. `None` where the matrix is not positive definite.
    fn direction(
        &mut self,
        hessian: &Hessian,
        shift: f64,
        residual: &VertexVec<f64>,
    ) -> Option<VertexVec<f64>> {
        let off_diagonal: Vec<f64> = self.edge.iter().map(|&e| -hessian.weight[e]).collect();
        let diagonal: Vec<f64> = self
            .unknown
            .iter()
            .map(|&v| hessian.row[v][0] + shift * hessian.largest)
            .collect();
        self.solver.factorize(&diagonal, &off_diagonal).ok()?;
        let mut rhs: Vec<f64> = self.unknown.iter().map(|&v| -residual[v]).collect();
        self.solver.solve(&mut rhs);
        let mut direction = VertexVec::filled(0.0, residual.len());
        for (&v, x) in self.unknown.iter().zip(rhs) {
            direction[v] = x;
        }
        Some(direction)
    }
}

/// Weights of the edges, diagonal and absolute row sums, and the largest of these.
struct Hessian {
    weight: EdgeVec<f64>,
    row: VertexVec<[f64; 2]>,
    largest: f64,
}

impl Hessian {
    fn new(problem: &Problem, evaluation: &Evaluation) -> Self {
        let weight = problem.metric.edge_weights(evaluation);
        let row = problem.metric.diagonal(&weight);
        let largest = row.iter().map(|r| r[1]).fold(f64::MIN_POSITIVE, f64::max);
        Self {
            weight,
            row,
            largest,
        }
    }
}

/// Largest minus smallest value.
pub(super) fn spread(values: &VertexVec<f64>) -> f64 {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for &x in values.iter() {
        (low, high) = (low.min(x), high.max(x));
    }
    high - low
}

pub(crate) fn minimise(problem: &Problem) -> Result<Solution, FlowError> {
    let params = problem.params;
    let mut system = System::new(problem)?;
    let mut u = problem.metric.structure.start.clone();
    let (mut now, mut trial) = (Evaluation::default(), Evaluation::default());
    problem.metric.evaluate(&u, &mut now);
    let mut record = FlowStep {
        max_error: problem.max_error(&now),
        ..FlowStep::default()
    };
    let mut history = vec![record];
    problem.observer.flow_step(&record);
    let mut polished = 0;
    let mut remaining: f64 = 0.0;
    loop {
        if problem.observer.cancelled() {
            return Err(FlowError::Cancelled);
        }
        let converged = record.max_error <= params.curvature_tolerance;
        if converged && polished == POLISHING_STEPS {
            break;
        }
        let exhausted = record.iteration >= params.max_newton_steps || spread(&u) > LARGEST_RANGE;
        if !converged && exhausted {
            return Err(problem.not_converged(record.iteration, &now));
        }
        let residual = problem.residual(&now);
        let hessian = Hessian::new(problem, &now);
        let taken = if converged {
            polished += 1;
            let direction = SHIFTS[..3]
                .iter()
                .find_map(|&shift| system.direction(&hessian, shift, &residual));
            remaining = direction.as_ref().map_or(f64::INFINITY, spread);
            direction
                .filter(|direction| {
                    problem
                        .metric
                        .evaluate(&moved(&u, direction, 1.0), &mut trial);
                    problem.max_error(&trial) < 0.5 * record.max_error
                })
                .map(|direction| (direction, 1.0))
        } else {
            SHIFTS.iter().find_map(|&shift| {
                let direction = system.direction(&hessian, shift, &residual)?;
                let step = line_search(problem, &u, &direction, &residual, &mut trial)?;
                Some((direction, step))
            })
        };
        let Some((direction, step)) = taken else {
            if converged {
                break;
            }
            return Err(problem.not_converged(record.iteration, &now));
        };
        // `now` is the scratch of the quadrature: it is replaced right after.
        record.energy += problem.energy_change(&u, &direction, step, &mut now);
        u = moved(&u, &direction, step);
        std::mem::swap(&mut now, &mut trial);
        record.iteration += 1;
        record.max_error = problem.max_error(&now);
        record.step = step;
        record.flow_time = record.iteration as f64;
        history.push(record);
        problem.observer.flow_step(&record);
    }
    if now.shape.iter().any(|s| s.broken) {
        return Err(problem.not_converged(record.iteration, &now));
    }
    if remaining > REMAINING_CHANGE {
        return Err(problem.runaway(record.iteration, &u, remaining));
    }
    Ok(Solution {
        u,
        evaluation: now,
        history,
    })
}

/// The first of 1, ½, ¼ … that is accepted (see the module docs), with its evaluation in `trial`.
fn line_search(
    problem: &Problem,
    u: &VertexVec<f64>,
    direction: &VertexVec<f64>,
    residual: &VertexVec<f64>,
    trial: &mut Evaluation,
) -> Option<f64> {
    let largest = direction.iter().map(|d| d.abs()).fold(0.0, f64::max);
    if !largest.is_finite() || dot(residual, direction) >= 0.0 {
        return None;
    }
    let norm = dot(residual, residual).sqrt();
    let mut step = (LARGEST_CHANGE / largest).min(1.0);
    while step >= SMALLEST_STEP {
        problem.metric.evaluate(&moved(u, direction, step), trial);
        let next = problem.residual(trial);
        if dot(&next, direction) <= 0.0 || dot(&next, &next).sqrt() <= 0.9 * norm {
            return Some(step);
        }
        step *= 0.5;
    }
    None
}
