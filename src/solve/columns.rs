//! Solutions with the factor at hand: many columns of the inverse side by side, or one right side with few entries.
//!
//! *Enters:* a factor, unknowns. *Leaves:* columns of the inverse, one row an unknown, rows in the order of elimination.
//!
//! The crate solves supernode by supernode with calls for dense blocks, and on a surface most supernodes have few columns: the calls then cost several
//! times what they compute. Here [`LANES`] columns lie side by side, so that every entry of the factor meets whole rows of numbers; only
//! large blocks are left to the crate. A column starts from one unknown, and forward substitution reaches only what is
//! above that in the elimination tree: supernodes whose rows are all 0 are passed over. All of it is compiled for the widest vectors that the
//! crate knows, and those that the machine has are taken.
//!
//! *Guaranteed:* a column has the same bytes whichever others are beside it.

use super::{SymmetricSolver, registers};
use faer::linalg::matmul::matmul;
use faer::sparse::linalg::cholesky::SymbolicCholeskyRaw;
use faer::{Accum, MatMut, MatRef, Par};
use pulp::{Arch, Simd, WithSimd};

/// Columns side by side.
pub const LANES: usize = 16;
/// One number of each of the columns.
pub type Row = [f64; LANES];

/// Columns and rows below them from which on a block is left to the crate.
const LARGE: [usize; 2] = [12, 16];

/// Some consecutive columns of the factor that have the same rows below their diagonal block.
pub(super) struct Supernode<'a> {
    /// The first of its unknowns.
    pub start: usize,
    /// Number of its unknowns.
    pub size: usize,
    /// Rows below the diagonal block.
    pub below: &'a [u32],
    /// Column after column, the diagonal block on top.
    value: &'a [f64],
}

impl SymmetricSolver {
    /// Where every unknown stands in the order of elimination.
    pub fn positions(&self) -> Vec<u32> {
        match self.symbolic.perm() {
            Some(order) => order.arrays().1.to_vec(),
            None => (0..self.size as u32).collect(),
        }
    }

    /// At most [`LANES`] columns of the inverse, those of the unknowns at some positions; other lanes are 0. `columns` is overwritten, one row a position.
    pub fn columns(&self, positions: &[u32], columns: &mut Vec<Row>) {
        columns.clear();
        columns.resize(self.size, [0.0; LANES]);
        for (lane, &at) in positions.iter().enumerate().take(LANES) {
            columns[at as usize][lane] = 1.0;
        }
        Arch::new().dispatch(ForwardSideBySide {
            solver: self,
            sides: columns,
        });
        self.backward(columns);
        registers::free();
    }

    /// Replaces one right side, in the order of elimination, by the solution.
    pub fn solve_ordered(&self, side: &mut [f64]) {
        self.forward(side);
        self.backward(side);
    }

    /// Replaces one right side by the solution.
    pub(super) fn solve_alone(&self, side: &mut [f64]) {
        let Some(order) = self.symbolic.perm() else {
            return self.solve_ordered(side);
        };
        let unknown = order.arrays().0;
        let mut ordered: Vec<f64> = unknown.iter().map(|&u| side[u as usize]).collect();
        self.solve_ordered(&mut ordered);
        for (&u, x) in unknown.iter().zip(ordered) {
            side[u as usize] = x;
        }
    }

    pub(super) fn supernodes(&self) -> impl ExactSizeIterator<Item = Supernode<'_>> {
        let count = match self.symbolic.raw() {
            _ if self.size == 0 => 0,
            SymbolicCholeskyRaw::Supernodal(symbolic) => symbolic.n_supernodes(),
            SymbolicCholeskyRaw::Simplicial(_) => self.size,
        };
        (0..count).map(|s| self.supernode(s))
    }

    pub(super) fn supernode(&self, s: usize) -> Supernode<'_> {
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(symbolic) => {
                let start = symbolic.supernode_begin()[s] as usize;
                let value = &symbolic.col_ptr_for_val()[s..];
                Supernode {
                    start,
                    size: symbolic.supernode_end()[s] as usize - start,
                    below: symbolic.supernode(s).pattern(),
                    value: &self.factor[value[0] as usize..value[1] as usize],
                }
            }
            // Of a matrix that is diagonal, whatever is asked for: every column by itself.
            SymbolicCholeskyRaw::Simplicial(symbolic) => {
                let column = &symbolic.col_ptr()[s..];
                let [from, to] = [column[0] as usize, column[1] as usize];
                Supernode {
                    start: s,
                    size: 1,
                    below: &symbolic.row_idx()[from + 1..to],
                    value: &self.factor[from..to],
                }
            }
        }
    }
}

/// Forward substitution of several right sides.
struct ForwardSideBySide<'a> {
    solver: &'a SymmetricSolver,
    sides: &'a mut [Row],
}

impl WithSimd for ForwardSideBySide<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let mut rows = Vec::new();
        for node in self.solver.supernodes() {
            let own = self.sides[node.start..][..node.size].as_flattened();
            if own.iter().any(|x| *x != 0.0) {
                node.forward::<S>(self.sides, &mut rows);
            }
        }
    }
}

impl Supernode<'_> {
    #[inline(always)]
    fn height(&self) -> usize {
        self.size + self.below.len()
    }

    /// A column of the diagonal block from the diagonal on, and below the block.
    #[inline(always)]
    fn column(&self, j: usize) -> (&[f64], &[f64]) {
        let (top, bottom) = self.value[j * self.height()..][..self.height()].split_at(self.size);
        (&top[j..], bottom)
    }

    fn is_large(&self) -> bool {
        self.size >= LARGE[0] && self.below.len() >= LARGE[1]
    }

    /// The block below the diagonal one.
    fn bottom(&self) -> MatRef<'_, f64> {
        let (rows, height) = (self.below.len(), self.height());
        MatRef::from_column_major_slice_with_stride(
            &self.value[self.size..],
            rows,
            self.size,
            height,
        )
    }

    #[inline(always)]
    fn forward<S: Simd>(&self, x: &mut [Row], rows: &mut Vec<Row>) {
        let is_large = self.is_large();
        for j in 0..self.size {
            let (top, bottom) = self.column(j);
            let (before, after) = x.split_at_mut(self.start + j + 1);
            let own = &mut before[self.start + j];
            own.iter_mut().for_each(|x| *x /= top[0]);
            let own = *own;
            for (l, row) in top[1..].iter().zip(after.iter_mut()) {
                subtract::<S>(row, *l, &own);
            }
            if !is_large {
                for (l, &r) in bottom.iter().zip(self.below) {
                    subtract::<S>(&mut after[r as usize - self.start - j - 1], *l, &own);
                }
            }
        }
        if is_large {
            rows.clear();
            rows.resize(self.below.len(), [0.0; LANES]);
            let own = x[self.start..][..self.size].as_flattened();
            let own = MatRef::from_row_major_slice(own, self.size, LANES);
            let sum = rows.as_flattened_mut();
            let sum = MatMut::from_row_major_slice_mut(sum, self.below.len(), LANES);
            matmul(sum, Accum::Replace, self.bottom(), own, 1.0, Par::Seq);
            for (row, &r) in rows.iter().zip(self.below) {
                subtract::<S>(&mut x[r as usize], 1.0, row);
            }
        }
    }

    /// Backward substitution: the solution at its own unknowns, from `rows`, that at the rows below.
    #[inline(always)]
    pub(super) fn backward<S: Simd>(&self, own: &mut [Row], rows: &[Row]) {
        let is_large = self.is_large();
        if is_large {
            let sides = rows.as_flattened();
            let sides = MatRef::from_row_major_slice(sides, self.below.len(), LANES);
            let own = own.as_flattened_mut();
            let own = MatMut::from_row_major_slice_mut(own, self.size, LANES);
            let bottom = self.bottom().transpose();
            matmul(own, Accum::Add, bottom, sides, -1.0, Par::Seq);
        }
        for j in (0..self.size).rev() {
            let (top, bottom) = self.column(j);
            let mut x = own[j];
            for (l, row) in top[1..].iter().zip(&own[j + 1..]) {
                subtract::<S>(&mut x, *l, row);
            }
            if !is_large {
                for (l, row) in bottom.iter().zip(rows) {
                    subtract::<S>(&mut x, *l, row);
                }
            }
            x.iter_mut().for_each(|x| *x /= top[0]);
            own[j] = x;
        }
    }

    /// Forward substitution of one right side; `rows`: what is to be subtracted in the rows below.
    #[inline(always)]
    pub(super) fn forward_one<S: Simd>(&self, own: &mut [f64], rows: &mut Vec<f64>) {
        rows.clear();
        rows.resize(self.below.len(), 0.0);
        for j in 0..self.size {
            let (top, bottom) = self.column(j);
            own[j] /= top[0];
            let x = own[j];
            for (l, y) in top[1..].iter().zip(&mut own[j + 1..]) {
                *y = multiply_add::<S>(-l, x, *y);
            }
            for (l, row) in bottom.iter().zip(rows.iter_mut()) {
                *row = multiply_add::<S>(*l, x, *row);
            }
        }
    }

    /// [`backward`](Self::backward) of one right side.
    #[inline(always)]
    pub(super) fn backward_one<S: Simd>(&self, own: &mut [f64], rows: &[f64]) {
        for j in (0..self.size).rev() {
            let (top, bottom) = self.column(j);
            let x = own[j] - dot::<S>(&top[1..], &own[j + 1..]) - dot::<S>(bottom, rows);
            own[j] = x / top[0];
        }
    }
}

/// `x` + `a` `b`, rounded once where that is quick.
#[inline(always)]
pub(super) fn multiply_add<S: Simd>(a: f64, b: f64, x: f64) -> f64 {
    match S::IS_SCALAR {
        true => x + a * b,
        false => a.mul_add(b, x),
    }
}

/// `row` − `factor` · `other`.
#[inline(always)]
fn subtract<S: Simd>(row: &mut Row, factor: f64, other: &Row) {
    for (x, y) in row.iter_mut().zip(other) {
        *x = multiply_add::<S>(-factor, *y, *x);
    }
}

/// Σ a b, as far as the shorter goes, in a fixed order.
#[inline(always)]
fn dot<S: Simd>(a: &[f64], b: &[f64]) -> f64 {
    let length = a.len().min(b.len());
    // Four sums side by side are quicker than one.
    let mut sums = [0.0; 4];
    let (whole_a, rest_a) = a[..length].as_chunks::<4>();
    let (whole_b, rest_b) = b[..length].as_chunks::<4>();
    for (a, b) in whole_a.iter().zip(whole_b) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum = multiply_add::<S>(*a, *b, *sum);
        }
    }
    let rest: f64 = rest_a.iter().zip(rest_b).map(|(a, b)| a * b).sum();
    sums[0] + sums[1] + (sums[2] + sums[3]) + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The Laplacian of a square grid of vertices, and a little more on the diagonal.
    fn grid(side: usize) -> SymmetricSolver {
        let (pairs, diagonal, off) = laplacian(side);
        let mut solver = SymmetricSolver::new(side * side, &pairs).unwrap();
        solver.factorize(&diagonal, &off).unwrap();
        solver
    }

    /// Its pairs, diagonal and off-diagonal values.
    fn laplacian(side: usize) -> (Vec<[u32; 2]>, Vec<f64>, Vec<f64>) {
        let size = side * side;
        let at = |i: usize, j: usize| (i * side + j) as u32;
        let mut pairs = Vec::new();
        for i in 0..side {
            for j in 1..side {
                pairs.push([at(i, j - 1), at(i, j)]);
                pairs.push([at(j - 1, i), at(j, i)]);
            }
        }
        let weight: Vec<f64> = (0..pairs.len()).map(|p| 1.0 + (p % 7) as f64).collect();
        let mut diagonal = vec![0.01; size];
        for ([i, j], w) in pairs.iter().zip(&weight) {
            diagonal[*i as usize] += w;
            diagonal[*j as usize] += w;
        }
        let off: Vec<f64> = weight.iter().map(|w| -w).collect();
        (pairs, diagonal, off)
    }

    /// Where branches are substituted side by side it comes to the same, with the same bytes for any number of threads.
    #[test]
    fn branches_come_to_what_all_nodes_in_order_do() {
        let side = 150;
        let size = side * side;
        let (pairs, diagonal, off) = laplacian(side);
        let whole = grid(side);
        let mut fronts = SymmetricSolver::new(size, &pairs).unwrap();
        fronts = fronts.in_fronts(&pairs);
        fronts.factorize(&diagonal, &off).unwrap();
        let branches = fronts.fronts().for_substitution.as_ref().unwrap();
        assert!(branches.runs.len() > 4 && branches.above.len() < size / 2);
        let side: Vec<f64> = (0..size).map(|k| ((k * 37) % 101) as f64 - 50.0).collect();
        let places: Vec<u32> = (0..LANES).map(|k| (k * size / LANES) as u32).collect();
        let solved = |solver: &SymmetricSolver| {
            let mut columns = Vec::new();
            solver.columns(&places, &mut columns);
            let mut one = side.clone();
            solver.solve_ordered(&mut one);
            (columns.into_flattened(), one)
        };
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.unwrap().install(|| solved(&fronts))
        };
        let (expected, found) = (solved(&whole), on(1));
        assert_eq!(found, on(3));
        for (expected, found) in [(&expected.0, &found.0), (&expected.1, &found.1)] {
            let largest = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let parts = expected.iter().zip(found);
            parts.for_each(|(x, y)| assert!((x - y).abs() < 1e-11 * largest, "{x} {y}"));
        }
    }

    #[test]
    fn columns_are_those_of_the_inverse() {
        // The largest has supernodes of both kinds.
        for side in [1, 2, 5, 60] {
            let mut solver = grid(side);
            let size = side * side;
            let positions = solver.positions();
            let units: Vec<usize> = (0..LANES.min(size)).map(|k| k * size / LANES).collect();
            let places: Vec<u32> = units.iter().map(|&k| positions[k]).collect();
            let mut columns = Vec::new();
            solver.columns(&places, &mut columns);
            for (lane, &unit) in units.iter().enumerate() {
                let mut expected = vec![0.0; size];
                expected[unit] = 1.0;
                solver.solve(&mut expected);
                let mut one = vec![0.0; size];
                one[positions[unit] as usize] = 1.0;
                solver.solve_ordered(&mut one);
                let largest = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
                for (k, x) in expected.iter().enumerate() {
                    let at = positions[k] as usize;
                    for other in [columns[at][lane], one[at]] {
                        assert!((other - x).abs() < 1e-11 * largest, "{side}: {other} {x}");
                    }
                }
                // Alone it comes to the same.
                let mut alone = Vec::new();
                solver.columns(&places[lane..=lane], &mut alone);
                assert!(alone.iter().zip(&columns).all(|(a, c)| a[0] == c[lane]));
            }
        }
        let is_large = |node: Supernode| node.is_large();
        let solver = grid(60);
        assert!(solver.supernodes().any(is_large) && !solver.supernodes().all(is_large));
    }

    #[test]
    fn a_full_right_side_is_solved() {
        let mut solver = grid(20);
        let side: Vec<f64> = (0..400).map(|k| ((k * 37) % 101) as f64 - 50.0).collect();
        let positions = solver.positions();
        let mut one = vec![0.0; 400];
        (0..400).for_each(|k| one[positions[k] as usize] = side[k]);
        solver.solve_ordered(&mut one);
        let mut expected = side;
        solver.solve(&mut expected);
        let largest = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        for (k, x) in expected.iter().enumerate() {
            assert!((one[positions[k] as usize] - x).abs() < 1e-11 * largest);
        }
    }
}
