//! Newton's equations of an energy that is a sum over triples of points of the plane.
//!
//! *Enters:* gradient and positive semidefinite Hessian of every triple, by the six coordinates of its points. *Leaves:* the step that minimises their sum, to second order. *Guaranteed:* coordinates that may not move do not.

use super::error::GridError;
use crate::flow::solve::SymmetricSolver;

/// What is added to the diagonal, part of it, where rounding keeps the factor from being positive.
const DAMPINGS: [f64; 4] = [0.0, 1e-12, 1e-9, 1e-6];

/// Gradient and Hessian of one triple.
pub(super) type Derivatives = ([f64; 6], [[f64; 6]; 6]);

/// See the module docs.
pub(super) struct System {
    gradient: Vec<f64>,
    diagonal: Vec<f64>,
    /// One value for each of the couplings that [`solver`] lists.
    off_diagonal: Vec<f64>,
}

/// A solver for triples of `count` points.
pub(super) fn solver(
    triples: impl Iterator<Item = [u32; 3]>,
    count: usize,
) -> Result<SymmetricSolver, GridError> {
    let mut pairs = Vec::new();
    for points in triples {
        pairs.extend(points.map(|v| [2 * v, 2 * v + 1]));
        for k in 0..3 {
            let [v, w] = [points[k], points[(k + 1) % 3]];
            pairs.extend([(0, 0), (0, 1), (1, 0), (1, 1)].map(|(a, b)| [2 * v + a, 2 * w + b]));
        }
    }
    Ok(SymmetricSolver::with_blocks(2 * count, 2, &pairs)?)
}

impl System {
    /// `is_free`: of every point, whether it may move along each axis.
    pub(super) fn new<'a>(
        triples: impl Iterator<Item = ([u32; 3], &'a Derivatives)>,
        is_free: &[[bool; 2]],
    ) -> Self {
        let n = is_free.len();
        let (mut gradient, mut diagonal) = (vec![0.0; 2 * n], vec![0.0; 2 * n]);
        let mut off_diagonal = Vec::new();
        for (points, (g, h)) in triples {
            let is_free = |k: usize, a: usize| is_free[points[k] as usize][a];
            let value =
                |i: [usize; 2], j: [usize; 2]| match is_free(i[0], i[1]) && is_free(j[0], j[1]) {
                    true => h[2 * i[0] + i[1]][2 * j[0] + j[1]],
                    false => 0.0,
                };
            for k in 0..3 {
                for a in (0..2).filter(|&a| is_free(k, a)) {
                    let index = 2 * points[k] as usize + a;
                    gradient[index] += g[2 * k + a];
                    diagonal[index] += h[2 * k + a][2 * k + a];
                }
                off_diagonal.push(value([k, 0], [k, 1]));
            }
            for k in 0..3 {
                let next = (k + 1) % 3;
                for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    off_diagonal.push(value([k, a], [next, b]));
                }
            }
        }
        for (d, free) in diagonal.iter_mut().zip(is_free.as_flattened()) {
            if !free {
                *d = 1.0;
            }
        }
        Self {
            gradient,
            diagonal,
            off_diagonal,
        }
    }

    /// The step of every point, and the slope of the energy along it.
    pub(super) fn newton_step(
        &self,
        solver: &mut SymmetricSolver,
    ) -> Result<(Vec<[f64; 2]>, f64), GridError> {
        let mut result = Ok(());
        for damping in DAMPINGS {
            let damped: Vec<f64> = self.diagonal.iter().map(|d| d * (1.0 + damping)).collect();
            result = solver.factorize(&damped, &self.off_diagonal);
            if result.is_ok() {
                break;
            }
        }
        result?;
        let mut step: Vec<f64> = self.gradient.iter().map(|g| -g).collect();
        solver.solve(&mut step);
        let slope = step.iter().zip(&self.gradient).map(|(s, g)| s * g).sum();
        let step = step.chunks_exact(2).map(|s| [s[0], s[1]]).collect();
        Ok((step, slope))
    }
}
