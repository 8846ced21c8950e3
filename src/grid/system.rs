//! Newton's equations of an energy that is a sum over triples of points of the plane.
//!
//! *Enters:* gradient and positive semidefinite Hessian of every triple, by the six coordinates of its points. *Leaves:* the step that minimises their sum, to second order. *Guaranteed:* coordinates that may not move do not.

use super::error::GridError;
use crate::flow::solve::SymmetricSolver;
use crate::geometry::ids::NONE;
use crate::observe::part;
use rayon::prelude::*;
use std::ops::Range;

/// What is added to the diagonal, part of it, where rounding keeps the factor from being positive.
const DAMPINGS: [f64; 4] = [0.0, 1e-12, 1e-9, 1e-6];

/// Triples whose derivatives are worked out before they are added.
const PIECE: usize = 1 << 14;

/// Gradient and Hessian of one triple.
pub(super) type Derivatives = ([f64; 6], [[f64; 6]; 6]);

/// The sides of a triple.
const SIDES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// The equations of the points that may move; others are no unknowns.
pub(super) struct Equations {
    /// The unknown of every point, or [`NONE`].
    unknown: Vec<u32>,
    /// Points of every unknown.
    point: Vec<u32>,
    /// Unknowns of the points of every triple.
    triples: Vec<[u32; 3]>,
    solver: SymmetricSolver,
    gradient: Vec<f64>,
    diagonal: Vec<f64>,
    /// One value for each of the couplings that the solver knows.
    off_diagonal: Vec<f64>,
}

impl Equations {
    /// Of triples of points; `may_move`: of every point.
    pub(super) fn new(
        triples: impl Iterator<Item = [u32; 3]>,
        may_move: &[bool],
    ) -> Result<Self, GridError> {
        let _part = part!("order of elimination");
        let mut unknown = vec![NONE; may_move.len()];
        let points = (0..may_move.len()).filter(|&p| may_move[p]);
        let point: Vec<u32> = points.map(|p| p as u32).collect();
        for (i, &p) in point.iter().enumerate() {
            unknown[p as usize] = i as u32;
        }
        let triples: Vec<[u32; 3]> = triples.map(|t| t.map(|p| unknown[p as usize])).collect();
        let mut pairs: Vec<[u32; 2]> = (0..point.len() as u32)
            .map(|v| [2 * v, 2 * v + 1])
            .collect();
        for t in &triples {
            for (v, w) in SIDES.map(|[j, k]| (t[j], t[k])) {
                if v != NONE && w != NONE {
                    let axes = [(0, 0), (0, 1), (1, 0), (1, 1)];
                    pairs.extend(axes.map(|(a, b)| [2 * v + a, 2 * w + b]));
                }
            }
        }
        let n = 2 * point.len();
        Ok(Self {
            solver: SymmetricSolver::with_blocks(n, 2, &pairs)?,
            off_diagonal: vec![0.0; pairs.len()],
            gradient: vec![0.0; n],
            diagonal: vec![0.0; n],
            unknown,
            point,
            triples,
        })
    }

    /// Sums derivatives of triples, each asked for by its number. `is_free`: of every point, whether it may move along each axis.
    pub(super) fn sum(
        &mut self,
        derivatives: impl Fn(usize) -> Derivatives + Sync,
        is_free: impl Fn(usize) -> [bool; 2],
    ) {
        let _part = part!("derivatives");
        let n = self.point.len();
        self.gradient.fill(0.0);
        self.diagonal.fill(0.0);
        self.off_diagonal[..n].fill(0.0);
        let is_free: Vec<[bool; 2]> = self.point.iter().map(|&p| is_free(p as usize)).collect();
        let mut at = n;
        let mut of_triples = Vec::with_capacity(PIECE);
        for begin in (0..self.triples.len()).step_by(PIECE) {
            let piece = begin..self.triples.len().min(begin + PIECE);
            let of_triple = piece.clone().into_par_iter().with_min_len(PIECE / 16);
            of_triple
                .map(&derivatives)
                .collect_into_vec(&mut of_triples);
            at = self.add(piece, &of_triples, &is_free, at);
        }
        for (d, free) in self.diagonal.iter_mut().zip(is_free.as_flattened()) {
            if !free {
                *d = 1.0;
            }
        }
    }

    /// Adds derivatives of some triples, whose couplings begin at `at`. Where those of the next begin.
    fn add(
        &mut self,
        triples: Range<usize>,
        derivatives: &[Derivatives],
        is_free: &[[bool; 2]],
        mut at: usize,
    ) -> usize {
        for (t, (g, h)) in self.triples[triples].iter().zip(derivatives) {
            let free = t.map(|v| match v {
                NONE => [false; 2],
                v => is_free[v as usize],
            });
            let value = |i: usize, a: usize, j: usize, b: usize| match free[i][a] && free[j][b] {
                true => h[2 * i + a][2 * j + b],
                false => 0.0,
            };
            for k in (0..3).filter(|&k| t[k] != NONE) {
                let v = t[k] as usize;
                for a in (0..2).filter(|&a| free[k][a]) {
                    self.gradient[2 * v + a] += g[2 * k + a];
                    self.diagonal[2 * v + a] += h[2 * k + a][2 * k + a];
                }
                self.off_diagonal[v] += value(k, 0, k, 1);
            }
            for [j, k] in SIDES
                .into_iter()
                .filter(|[j, k]| t[*j] != NONE && t[*k] != NONE)
            {
                let values = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(a, b)| value(j, a, k, b));
                self.off_diagonal[at..at + 4].copy_from_slice(&values);
                at += 4;
            }
        }
        at
    }

    /// The step of every point, and the slope of the energy along it.
    pub(super) fn newton_step(&mut self) -> Result<(Vec<[f64; 2]>, f64), GridError> {
        let _part = part!("factor and solve");
        let mut result = Ok(());
        for damping in DAMPINGS {
            let damped: Vec<f64> = self.diagonal.iter().map(|d| d * (1.0 + damping)).collect();
            result = self.solver.factorize(&damped, &self.off_diagonal);
            if result.is_ok() {
                break;
            }
        }
        result?;
        let mut step: Vec<f64> = self.gradient.iter().map(|g| -g).collect();
        self.solver.solve(&mut step);
        let slope = step.iter().zip(&self.gradient).map(|(s, g)| s * g).sum();
        let of_point = |&v: &u32| match v {
            NONE => [0.0; 2],
            v => [step[2 * v as usize], step[2 * v as usize + 1]],
        };
        Ok((self.unknown.iter().map(of_point).collect(), slope))
    }
}
