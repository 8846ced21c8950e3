//! Elimination in a front: its own columns, and what they subtract from the rows below.
//!
//! *Enters:* columns with rows, the diagonal block on top, and the square of the rows below, column after column. *Leaves:* the same columns of the factor, and the square without what they subtract. *Guaranteed:* the same bytes on any number of threads.

use super::columns::multiply_add;
use super::registers;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{
    LltRegularization, cholesky_in_place, cholesky_in_place_scratch,
};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, MatMut, MatRef, Par, Spec};
use pulp::Simd;
use rayon::prelude::*;

/// Columns that are eliminated together in a large front.
const PANEL: usize = 64;

/// Workspace for the diagonal blocks of large fronts.
pub(super) fn pivots() -> MemBuffer {
    let scratch = cholesky_in_place_scratch::<f64>(PANEL, Par::Seq, Spec::default());
    MemBuffer::new(scratch)
}

/// Adds the update of a child whose rows stand at `place` in this front.
#[inline(always)]
pub(super) fn add(
    size: usize,
    place: &[u32],
    of_child: &[f64],
    own: &mut [f64],
    update: &mut [f64],
) {
    let count = place.len();
    if count == 0 {
        return;
    }
    let height = own.len() / size;
    let below = height - size;
    let inside = place.partition_point(|&p| (p as usize) < size);
    for (j, column) in of_child.chunks_exact(count).enumerate() {
        let at = place[j] as usize;
        let (into, from) = match j < inside {
            true => (&mut own[at * height..][..height], 0),
            false => (&mut update[(at - size) * below..][..below], size),
        };
        for (x, &p) in column[j..].iter().zip(&place[j..]) {
            into[p as usize - from] += x;
        }
    }
}

/// Eliminates the columns of a small front. Whether all pivots are positive.
#[inline(always)]
pub(super) fn small<S: Simd>(size: usize, own: &mut [f64], update: &mut [f64]) -> bool {
    let height = own.len() / size;
    let below = height - size;
    for j in 0..size {
        let (before, after) = own.split_at_mut((j + 1) * height);
        let column = &mut before[j * height + j..];
        let pivot = column[0].sqrt();
        if !is_pivot(pivot) {
            return false;
        }
        let inverse = 1.0 / pivot;
        column[0] = pivot;
        column[1..].iter_mut().for_each(|x| *x *= inverse);
        let column = &column[1..];
        for (k, other) in after.chunks_exact_mut(height).enumerate() {
            let factor = -column[k];
            for (x, l) in other[j + 1 + k..].iter_mut().zip(&column[k..]) {
                *x = multiply_add::<S>(factor, *l, *x);
            }
        }
    }
    let column = |j: usize| &own[j * height + size..][..below];
    let mut j = 0;
    while j + 4 <= size {
        let [a, b, c, d] = [column(j), column(j + 1), column(j + 2), column(j + 3)];
        for k in 0..below {
            let into = &mut update[k * below + k..(k + 1) * below];
            let [fa, fb, fc, fd] = [-a[k], -b[k], -c[k], -d[k]];
            let rows = a[k..].iter().zip(&b[k..]).zip(&c[k..]).zip(&d[k..]);
            for (x, (((a, b), c), d)) in into.iter_mut().zip(rows) {
                let sum = multiply_add::<S>(fb, *b, multiply_add::<S>(fa, *a, *x));
                *x = multiply_add::<S>(fd, *d, multiply_add::<S>(fc, *c, sum));
            }
        }
        j += 4;
    }
    while j < size {
        let a = column(j);
        for k in 0..below {
            let into = &mut update[k * below + k..(k + 1) * below];
            let factor = -a[k];
            for (x, a) in into.iter_mut().zip(&a[k..]) {
                *x = multiply_add::<S>(factor, *a, *x);
            }
        }
        j += 1;
    }
    true
}

/// Whether a number may be on the diagonal of the factor: infinities may come of sums.
#[inline(always)]
fn is_pivot(x: f64) -> bool {
    x > 0.0 && x < f64::INFINITY
}

/// The same of a large one, panel by panel.
pub(super) fn large(
    size: usize,
    own: &mut [f64],
    update: &mut [f64],
    pivots: &mut MemBuffer,
    is_shared: bool,
) -> bool {
    let height = own.len() / size;
    let below = height - size;
    for begin in (0..size).step_by(PANEL) {
        let width = PANEL.min(size - begin);
        let (before, after) = own.split_at_mut((begin + width) * height);
        let panel = &mut before[begin * (height + 1)..];
        let panel_mat =
            MatMut::from_column_major_slice_with_stride_mut(panel, height - begin, width, height);
        let (mut top, mut bottom) = panel_mat.split_at_row_mut(width);
        let factorised = cholesky_in_place(
            top.as_mut(),
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(pivots),
            Spec::default(),
        );
        registers::free();
        let pivots = top.as_ref().diagonal().column_vector();
        if factorised.is_err() || !pivots.iter().all(|&x| is_pivot(x)) {
            return false;
        }
        solve_rows(top.as_ref(), bottom.as_mut(), is_shared);
        let bottom = bottom.as_ref();
        in_blocks(after, height, is_shared, |first, columns| {
            let from = begin + width + first;
            subtract(bottom, first, columns, height, from);
        });
    }
    if below == 0 {
        return true;
    }
    let bottom = MatRef::from_column_major_slice_with_stride(&own[size..], below, size, height);
    in_blocks(update, below, is_shared, |first, columns| {
        subtract(bottom, first, columns, below, first);
    });
    true
}

/// Subtracts from some columns, from row `from` on, what columns that are eliminated leave: `rows`, of which those from `first` on are meant.
fn subtract(rows: MatRef<'_, f64>, first: usize, columns: &mut [f64], height: usize, from: usize) {
    let count = columns.len() / height;
    let into = MatMut::from_column_major_slice_with_stride_mut(
        &mut columns[from..],
        height - from,
        count,
        height,
    );
    let (_, rows) = rows.split_at_row(first);
    let (own, _) = rows.split_at_row(count);
    matmul(into, Accum::Add, rows, own.transpose(), -1.0, Par::Seq);
    // Blocks may have a thread of their own.
    registers::free();
}

/// `f` of the number of the first column and of blocks of columns.
fn in_blocks(
    columns: &mut [f64],
    height: usize,
    is_shared: bool,
    f: impl Fn(usize, &mut [f64]) + Sync,
) {
    let of_block = |(i, block): (usize, &mut [f64])| f(i * PANEL, block);
    match is_shared {
        true => columns
            .par_chunks_mut(PANEL * height)
            .enumerate()
            .for_each(of_block),
        false => columns
            .chunks_mut(PANEL * height)
            .enumerate()
            .for_each(of_block),
    }
}

/// Rows that are solved at a time.
const ROWS: usize = 256;

/// Replaces rows by their solutions with a triangular block.
fn solve_rows(triangle: MatRef<'_, f64>, rows: MatMut<'_, f64>, is_shared: bool) {
    let count = rows.nrows();
    if count <= ROWS {
        if count > 0 {
            solve_lower_triangular_in_place(triangle, rows.transpose_mut(), Par::Seq);
            registers::free();
        }
        return;
    }
    let half = (count / ROWS).div_ceil(2) * ROWS;
    let (upper, lower) = rows.split_at_row_mut(half);
    let (mut upper, mut lower) = (Some(upper), Some(lower));
    let first = || {
        upper
            .take()
            .map(|rows| solve_rows(triangle, rows, is_shared))
    };
    let second = || {
        lower
            .take()
            .map(|rows| solve_rows(triangle, rows, is_shared))
    };
    match is_shared {
        true => {
            rayon::join(first, second);
        }
        false => {
            let (mut first, mut second) = (first, second);
            first();
            second();
        }
    }
}
