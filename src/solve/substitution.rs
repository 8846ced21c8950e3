//! Substitution with a factor, branches of the elimination tree side by side.
//!
//! *Enters:* a factor, right sides in the order of elimination. *Leaves:* solutions in their place.
//!
//! Unknowns of a branch meet those of other branches above them only. So backward substitution goes through the nodes above first, and then through all branches at once; forward
//! substitution the other way round, and what a branch subtracts above is summed up by itself before.
//!
//! *Guaranteed:* the same bytes for any number of threads: branches do not depend on it, and their sums are subtracted in order.

use super::columns::{LANES, Row, Supernode};
use super::factor::Branches;
use super::{Numeric, SymmetricSolver, registers};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::ops::Range;

/// What is replaced at one unknown: a number, or one for each of several right sides.
pub(super) trait Value: Copy + Send + Sync {
    fn backward<S: Simd>(node: &Supernode, own: &mut [Self], rows: &[Self]);
}

impl Value for f64 {
    #[inline(always)]
    fn backward<S: Simd>(node: &Supernode, own: &mut [Self], rows: &[Self]) {
        node.backward_one::<S>(own, rows);
    }
}

impl Value for [f64; LANES] {
    #[inline(always)]
    fn backward<S: Simd>(node: &Supernode, own: &mut [Self], rows: &[Row]) {
        node.backward::<S>(own, rows);
    }
}

/// Consecutive nodes with the values of their unknowns, which begin at `first`.
struct Run<'x, T> {
    nodes: Range<usize>,
    first: usize,
    values: &'x mut [T],
}

impl SymmetricSolver {
    /// The branches of a system that is worked out in several.
    fn branches(&self) -> Option<&Branches> {
        match &self.numeric {
            Numeric::Fronts(fronts, _) => fronts.for_substitution.as_ref(),
            Numeric::Whole(_) => None,
        }
    }

    /// All nodes with all values.
    fn whole<'x, T>(&self, values: &'x mut [T]) -> Run<'x, T> {
        Run {
            nodes: 0..self.supernodes().len(),
            first: 0,
            values,
        }
    }

    /// The runs of each branch.
    fn runs<'x, T>(&self, branches: &Branches, values: &'x mut [T]) -> Vec<Vec<Run<'x, T>>> {
        let of_branch = branches.runs.iter().enumerate();
        let all = of_branch.flat_map(|(branch, runs)| runs.iter().map(move |run| (run, branch)));
        let mut all: Vec<(&Range<usize>, usize)> = all.collect();
        all.sort_unstable_by_key(|(nodes, _)| nodes.start);
        let mut runs: Vec<Vec<Run<T>>> = branches.runs.iter().map(|_| Vec::new()).collect();
        let (mut rest, mut at) = (values, 0);
        for (nodes, branch) in all {
            let first = self.supernode(nodes.start).start;
            let last = self.supernode(nodes.end - 1);
            let (_, from) = rest.split_at_mut(first - at);
            let (own, after) = from.split_at_mut(last.start + last.size - first);
            at = first + own.len();
            rest = after;
            runs[branch].push(Run {
                nodes: nodes.clone(),
                first,
                values: own,
            });
        }
        runs
    }

    /// Forward substitution of one right side.
    pub(super) fn forward(&self, side: &mut [f64]) {
        let arch = Arch::new();
        let Some(branches) = self.branches() else {
            let runs = vec![self.whole(side)];
            return arch.dispatch(Forward {
                solver: self,
                runs,
                sums: &mut [],
                place: &[],
            });
        };
        let sums = self.runs(branches, side).into_par_iter().map(|runs| {
            let mut sums = vec![0.0; branches.above.len()];
            arch.dispatch(Forward {
                solver: self,
                runs,
                sums: &mut sums,
                place: &branches.place,
            });
            sums
        });
        let sums: Vec<Vec<f64>> = sums.collect();
        for of_branch in sums {
            for (&row, sum) in branches.above.iter().zip(of_branch) {
                side[row as usize] -= sum;
            }
        }
        for nodes in &branches.nodes_above {
            let run = Run {
                nodes: nodes.clone(),
                ..self.whole(side)
            };
            arch.dispatch(Forward {
                solver: self,
                runs: vec![run],
                sums: &mut [],
                place: &[],
            });
        }
    }

    /// Backward substitution.
    pub(super) fn backward<T: Value>(&self, values: &mut [T]) {
        let arch = Arch::new();
        let Some(branches) = self.branches() else {
            let runs = vec![self.whole(values)];
            return arch.dispatch(Backward {
                solver: self,
                runs,
                above: &[],
                place: &[],
            });
        };
        for nodes in branches.nodes_above.iter().rev() {
            let run = Run {
                nodes: nodes.clone(),
                ..self.whole(values)
            };
            arch.dispatch(Backward {
                solver: self,
                runs: vec![run],
                above: &[],
                place: &[],
            });
        }
        let above: Vec<T> = (branches.above.iter())
            .map(|&row| values[row as usize])
            .collect();
        self.runs(branches, values)
            .into_par_iter()
            .for_each(|runs| {
                arch.dispatch(Backward {
                    solver: self,
                    runs,
                    above: &above,
                    place: &branches.place,
                });
                registers::free();
            });
    }
}

/// Forward substitution in some runs.
struct Forward<'a, 'x> {
    solver: &'a SymmetricSolver,
    runs: Vec<Run<'x, f64>>,
    /// What is to be subtracted in rows above all branches.
    sums: &'a mut [f64],
    /// Where such a row stands among them.
    place: &'a [u32],
}

impl WithSimd for Forward<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let mut rows = Vec::new();
        for run in self.runs {
            for node in run.nodes.map(|s| self.solver.supernode(s)) {
                let own = &mut run.values[node.start - run.first..][..node.size];
                if own.iter().all(|x| *x == 0.0) {
                    continue;
                }
                node.forward_one::<S>(own, &mut rows);
                for (row, &r) in rows.iter().zip(node.below) {
                    match run.values.get_mut(r as usize - run.first) {
                        Some(value) => *value -= row,
                        None => self.sums[self.place[r as usize] as usize] += row,
                    }
                }
            }
        }
    }
}

/// Backward substitution in some runs.
struct Backward<'a, 'x, T> {
    solver: &'a SymmetricSolver,
    runs: Vec<Run<'x, T>>,
    /// The solution in rows above all branches.
    above: &'a [T],
    /// Where such a row stands among them.
    place: &'a [u32],
}

impl<T: Value> WithSimd for Backward<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let mut rows = Vec::new();
        for run in self.runs {
            for node in run.nodes.rev().map(|s| self.solver.supernode(s)) {
                rows.clear();
                let below = node.below.iter().map(|&r| {
                    let own = run.values.get(r as usize - run.first);
                    own.copied()
                        .unwrap_or_else(|| self.above[self.place[r as usize] as usize])
                });
                rows.extend(below);
                let own = &mut run.values[node.start - run.first..][..node.size];
                T::backward::<S>(&node, own, &rows);
            }
        }
    }
}
