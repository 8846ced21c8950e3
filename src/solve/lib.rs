//! The sparse symmetric solve: the only room that knows the linear-algebra crate.
//!
//! *Enters:* the pattern of a symmetric matrix, then its values as often as one likes. *Leaves:* solutions.
//! The fill-reducing order (nested dissection where the matrix is large, approximate minimum degree) and the symbolic factor are computed once a
//! pattern; numeric factorisations, those of large matrices front by front, write into one factor.
//! *Guaranteed:* the same bytes for any number of threads. *Not guaranteed:* accuracy beyond the condition number.
//!
//! The factor is supernodal always: the crate's own threshold picks the simplicial one for small
//! fill, which is slower above some ten thousand unknowns.

mod bisection;
mod columns;
mod dissection;
mod factor;
mod front;
mod registers;
mod substitution;

pub use columns::{LANES, Row};

use dissection::Division;
use factor::Fronts;
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::perm::PermRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::linalg::{SupernodalThreshold, amd};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Accum, Conj, MatMut, MatRef, Par, Side, Spec};

/// Right sides that are solved at a time: enough that the factor is read from memory once for all of them.
const BLOCK: usize = 16;

/// Unknowns (or blocks of them) above which a system is large: ordered by nested dissection and factorised front by front, on all threads. With one thread smaller ones take the crate as long in an order of minimum degree, which costs less.
const LARGE: usize = 120_000;

/// Why a system could not be solved.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// The pattern needs more memory or larger indices than there are.
    #[error("a sparse system of {unknowns} unknowns does not fit into memory; use a smaller mesh")]
    TooLarge {
        /// Number of unknowns.
        unknowns: usize,
    },
    /// The matrix is not positive definite, or holds a value that is no finite number.
    #[error("the sparse matrix of {unknowns} unknowns is not positive definite")]
    NotPositiveDefinite {
        /// Number of unknowns.
        unknowns: usize,
    },
}

/// The inner products of some vectors with some others, all of one length and one after another in `a` and `b`: for each of `counts[0]` in `a` those with the
/// `counts[1]` in `b`.
pub fn inner_products(a: &[f64], b: &[f64], counts: [usize; 2]) -> Vec<f64> {
    let [a, b] = columns_of(a, b, counts);
    let mut products = vec![0.0; counts[0] * counts[1]];
    let into = MatMut::from_column_major_slice_mut(&mut products, counts[1], counts[0]);
    matmul(into, Accum::Replace, b.transpose(), a, 1.0, Par::Seq);
    registers::free();
    products
}

/// The same of as many vectors as others, but only those of a vector with the other of the same number and those after that; 0 in the place of others.
pub fn half_products(a: &[f64], b: &[f64], count: usize) -> Vec<f64> {
    let [a, b] = columns_of(a, b, [count; 2]);
    let mut products = vec![0.0; count * count];
    let into = MatMut::from_column_major_slice_mut(&mut products, count, count);
    triangular::matmul(
        into,
        BlockStructure::TriangularLower,
        Accum::Replace,
        b.transpose(),
        BlockStructure::Rectangular,
        a,
        BlockStructure::Rectangular,
        1.0,
        Par::Seq,
    );
    registers::free();
    products
}

fn columns_of<'a>(a: &'a [f64], b: &'a [f64], counts: [usize; 2]) -> [MatRef<'a, f64>; 2] {
    let length = b.len() / counts[1].max(1);
    let matrix =
        |x: &'a [f64], count| MatRef::from_column_major_slice(&x[..count * length], length, count);
    [matrix(a, counts[0]), matrix(b, counts[1])]
}

/// A symmetric positive definite matrix with a fixed pattern, and its Cholesky factor.
pub struct SymmetricSolver {
    size: usize,
    symbolic: SymbolicCholesky<u32>,
    /// Empty where no parts were ordered by themselves.
    division: Division,
    numeric: Numeric,
    factor: Vec<f64>,
    /// Of factorisations by the crate, and of several right sides at a time.
    workspace: MemBuffer,
}

/// How values become a factor.
enum Numeric {
    /// By the crate.
    Whole(Columns),
    /// Front by front, of so many pairs.
    Fronts(Fronts, usize),
}

/// The matrix by columns of its lower triangle, diagonal first.
struct Columns {
    first: Vec<u32>,
    row: Vec<u32>,
    value: Vec<f64>,
    /// Where the value of every off-diagonal pair is added.
    slot: Vec<u32>,
}

impl SymmetricSolver {
    /// Orders and analyses the pattern of a `size` × `size` matrix with a full diagonal and the
    /// off-diagonal entries `pairs`, each named once for both triangles. A pair may occur several times (its
    /// values are added); a pair of equal indices adds to the diagonal.
    pub fn new(size: usize, pairs: &[[u32; 2]]) -> Result<Self, SolveError> {
        Self::ordered(size, pairs, Order::LeastDegree { border: 0 })
    }

    /// The same for a matrix whose last `border` unknowns are coupled with very many others each: they are eliminated last, and the others
    /// are ordered as if there were none.
    pub fn with_border(size: usize, border: usize, pairs: &[[u32; 2]]) -> Result<Self, SolveError> {
        Self::ordered(size, pairs, Order::LeastDegree { border })
    }

    /// The same for a matrix of `width` × `width` blocks that are all zero or all given: whole blocks are ordered, which is quicker.
    pub fn with_blocks(size: usize, width: usize, pairs: &[[u32; 2]]) -> Result<Self, SolveError> {
        Self::ordered(size, pairs, Order::Blocks { width })
    }

    /// The same for a pattern that differs little from this one, in the memory of this one: the order is kept, which saves most of the
    /// analysis. Where much has changed the factor fills up many times over: then order anew.
    pub fn with_pairs(self, pairs: &[[u32; 2]]) -> Result<Self, SolveError> {
        let given = self.symbolic.perm().map(|order| {
            let (order, place) = order.arrays();
            (order.to_vec(), place.to_vec())
        });
        let size = self.size;
        let order = match &given {
            Some((order, place)) => Order::Given(PermRef::new_checked(order, place, size)),
            None => Order::LeastDegree { border: 0 },
        };
        let (factor, division) = self.leave();
        Self::with_memory(size, pairs, order, factor, division)
    }

    /// [`with_border`](Self::with_border) for another pattern of as many unknowns, in the memory of this one. Of a large pattern the parts are kept that are ordered by themselves, as far as no entry leads from one to another.
    pub fn renewed(self, border: usize, pairs: &[[u32; 2]]) -> Result<Self, SolveError> {
        let (size, order) = (self.size, Order::LeastDegree { border });
        let (factor, division) = self.leave();
        Self::with_memory(size, pairs, order, factor, division)
    }

    /// What another solver can use; all else is gone before that is made.
    fn leave(self) -> (Vec<f64>, Division) {
        (self.factor, self.division)
    }

    fn ordered(size: usize, pairs: &[[u32; 2]], order: Order<'_>) -> Result<Self, SolveError> {
        Self::with_memory(size, pairs, order, Vec::new(), Vec::new())
    }

    /// `factor`: memory to be used again; `division`: that of a similar pattern.
    fn with_memory(
        size: usize,
        pairs: &[[u32; 2]],
        order: Order<'_>,
        mut factor: Vec<f64>,
        mut division: Division,
    ) -> Result<Self, SolveError> {
        let too_large = SolveError::TooLarge { unknowns: size };
        if size >= u32::MAX as usize / 2 || pairs.len() >= u32::MAX as usize / 2 {
            return Err(too_large);
        }
        // Pairs by column, in the order given, then each column by row.
        let mut first = vec![0u32; size + 1];
        for [i, j] in pairs {
            first[*i.min(j) as usize + 1] += 1;
        }
        for c in 0..size {
            first[c + 1] += first[c];
        }
        let mut next = first.clone();
        let mut by_column = vec![[0u32; 2]; pairs.len()];
        for (p, [i, j]) in pairs.iter().enumerate() {
            let at = &mut next[*i.min(j) as usize];
            by_column[*at as usize] = [*i.max(j), p as u32];
            *at += 1;
        }
        let (mut column, mut row) = (Vec::with_capacity(size + 1), Vec::new());
        row.reserve(size + pairs.len());
        let mut slot = vec![0; pairs.len()];
        for c in 0..size {
            column.push(row.len() as u32);
            row.push(c as u32);
            let entries = &mut by_column[first[c] as usize..first[c + 1] as usize];
            entries.sort_unstable();
            for &mut [r, p] in entries {
                if row.last() != Some(&r) {
                    row.push(r);
                }
                slot[p as usize] = row.len() as u32 - 1;
            }
        }
        column.push(row.len() as u32);
        drop(by_column);
        let pattern = SymbolicSparseColMatRef::new_checked(size, size, &column, None, &row);
        let params = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..Default::default()
        };
        let is_large = order.is_large(size);
        let own;
        let ordering = match order {
            Order::Given(order) => SymmetricOrdering::Custom(order),
            Order::LeastDegree { border: 0 } if !is_large => SymmetricOrdering::Amd,
            Order::LeastDegree { border } => {
                let found = border_last(size, border, &column, &row, &mut division);
                own = found.ok_or(too_large)?;
                SymmetricOrdering::Custom(PermRef::new_checked(&own.0, &own.1, size))
            }
            Order::Blocks { width } => {
                own = by_blocks(size, width, &column, &row).ok_or(too_large)?;
                SymmetricOrdering::Custom(PermRef::new_checked(&own.0, &own.1, size))
            }
        };
        let symbolic = factorize_symbolic_cholesky(pattern, Side::Lower, ordering, params)
            .map_err(|_| too_large)?;
        let (numeric, scratch) = match is_large {
            true => {
                drop((column, row, slot));
                let fronts = Fronts::new(&symbolic, size, pairs);
                (Numeric::Fronts(fronts, pairs.len()), StackReq::EMPTY)
            }
            false => {
                let columns = Columns {
                    first: column,
                    value: vec![0.0; row.len()],
                    row,
                    slot,
                };
                let scratch =
                    symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
                (Numeric::Whole(columns), scratch)
            }
        };
        let workspace = MemBuffer::try_new(scratch).map_err(|_| too_large)?;
        let length = symbolic.len_val();
        if factor.capacity() < length {
            // In this order: there is no room for both. What the system gives is zero already, and each thread touches its own part first.
            drop(factor);
            factor = vec![0.0; length];
        } else {
            factor.resize(length, 0.0);
        }
        Ok(Self {
            size,
            numeric,
            factor,
            symbolic,
            division,
            workspace,
        })
    }

    /// The same in a given order.
    #[cfg(test)]
    fn in_order(order: &[u32], place: &[u32], pairs: &[[u32; 2]]) -> Self {
        let given = Order::Given(PermRef::new_checked(order, place, order.len()));
        Self::ordered(order.len(), pairs, given)
            .unwrap()
            .in_fronts(pairs)
    }

    /// The same, factorised front by front whatever its size.
    #[cfg(test)]
    fn in_fronts(mut self, pairs: &[[u32; 2]]) -> Self {
        let fronts = Fronts::new(&self.symbolic, self.size, pairs);
        self.numeric = Numeric::Fronts(fronts, pairs.len());
        self
    }

    #[cfg(test)]
    fn fronts(&self) -> &Fronts {
        match &self.numeric {
            Numeric::Fronts(fronts, _) => fronts,
            Numeric::Whole(_) => panic!("by the crate"),
        }
    }

    /// Number of unknowns.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Sets the values and factorises: `diagonal` one an unknown, `off_diagonal` one a pair.
    pub fn factorize(&mut self, diagonal: &[f64], off_diagonal: &[f64]) -> Result<(), SolveError> {
        let failed = SolveError::NotPositiveDefinite {
            unknowns: self.size,
        };
        if self.size == 0 {
            return Ok(());
        }
        let factorised = match &mut self.numeric {
            Numeric::Fronts(fronts, pairs) => {
                // NaN pivots are taken for what they are, but infinities may pass: look first.
                let [diagonal, off_diagonal] = [&diagonal[..self.size], &off_diagonal[..*pairs]];
                let mut values = diagonal.iter().chain(off_diagonal);
                if !values.all(|v| v.is_finite()) {
                    return Err(failed);
                }
                let done = fronts.factorize(&mut self.factor, diagonal, off_diagonal);
                done.map_err(|_| failed)
            }
            Numeric::Whole(matrix) => {
                let matrix = matrix.with(diagonal, off_diagonal).ok_or(failed)?;
                let done = self.symbolic.factorize_numeric_llt(
                    &mut self.factor,
                    matrix,
                    Side::Lower,
                    LltRegularization::default(),
                    Par::Seq,
                    MemStack::new(&mut self.workspace),
                    Spec::default(),
                );
                done.map(|_| ()).map_err(|_| failed)
            }
        };
        registers::free();
        factorised
    }

    /// Replaces `rhs` (one value an unknown, any number of right sides one after another) by the solutions, with the factor of the
    /// last [`factorize`](Self::factorize) that succeeded. Several at a time cost less than one by one, and give other last bits.
    pub fn solve(&mut self, rhs: &mut [f64]) {
        if self.size == 0 {
            return;
        }
        for block in rhs.chunks_mut(BLOCK * self.size) {
            let columns = block.len() / self.size;
            if columns == 1 {
                self.solve_alone(block);
                continue;
            }
            let scratch = self
                .symbolic
                .solve_in_place_scratch::<f64>(columns, Par::Seq);
            if self.workspace.len() < scratch.unaligned_bytes_required() {
                self.workspace = MemBuffer::new(scratch);
            }
            LltRef::new(&self.symbolic, &self.factor).solve_in_place_with_conj(
                Conj::No,
                MatMut::from_column_major_slice_mut(
                    &mut block[..columns * self.size],
                    self.size,
                    columns,
                ),
                Par::Seq,
                MemStack::new(&mut self.workspace),
            );
        }
        registers::free();
    }
}

impl Columns {
    /// With new values; `None` where one is no finite number.
    fn with(
        &mut self,
        diagonal: &[f64],
        off_diagonal: &[f64],
    ) -> Option<SparseColMatRef<'_, u32, f64>> {
        self.value.fill(0.0);
        for (&start, &d) in self.first.iter().zip(diagonal) {
            self.value[start as usize] = d;
        }
        for (&slot, &w) in self.slot.iter().zip(off_diagonal) {
            self.value[slot as usize] += w;
        }
        if self.value.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let size = self.first.len() - 1;
        let pattern =
            SymbolicSparseColMatRef::new_checked(size, size, &self.first, None, &self.row);
        Some(SparseColMatRef::new(pattern, &self.value))
    }
}

/// In which order unknowns are eliminated.
enum Order<'a> {
    /// Approximate minimum degree, but for the last `border` unknowns, which come last.
    LeastDegree {
        border: usize,
    },
    /// Approximate minimum degree of blocks of `width` unknowns.
    Blocks {
        width: usize,
    },
    Given(PermRef<'a, u32>),
}

impl Order<'_> {
    /// Whether a system of so many unknowns is large.
    fn is_large(&self, size: usize) -> bool {
        let count = match *self {
            Order::LeastDegree { border } => size.saturating_sub(border),
            Order::Blocks { width } => size / width,
            Order::Given(_) => size,
        };
        count > LARGE
    }
}

/// A permutation and its inverse.
type Permutation = (Vec<u32>, Vec<u32>);

/// Approximate minimum degree of the leading block, then the last `border` unknowns. `column` and `row` are the lower triangle by columns,
/// ascending. `None` where memory does not suffice.
fn border_last(
    size: usize,
    border: usize,
    column: &[u32],
    row: &[u32],
    division: &mut Division,
) -> Option<Permutation> {
    let core = size.saturating_sub(border);
    let mut first = Vec::with_capacity(core + 1);
    let mut inner = Vec::with_capacity(row.len());
    for c in 0..core {
        first.push(inner.len() as u32);
        let rows = &row[column[c] as usize..column[c + 1] as usize];
        inner.extend(rows.iter().copied().filter(|&r| (r as usize) < core));
    }
    first.push(inner.len() as u32);
    let (mut order, mut place) = little_fill(&first, &inner, division)?;
    order.extend(core as u32..size as u32);
    place.extend(core as u32..size as u32);
    Some((order, place))
}

/// Approximate minimum degree of blocks, and the unknowns of a block one after another.
fn by_blocks(size: usize, width: usize, column: &[u32], row: &[u32]) -> Option<Permutation> {
    let (blocks, width) = (size / width, width as u32);
    let mut first = Vec::with_capacity(blocks + 1);
    let mut inner: Vec<u32> = Vec::with_capacity(row.len() / width as usize);
    for b in 0..blocks {
        let begin = inner.len();
        first.push(begin as u32);
        let c = b * width as usize;
        for r in &row[column[c] as usize..column[c + 1] as usize] {
            if inner[begin..].last() != Some(&(r / width)) {
                inner.push(r / width);
            }
        }
    }
    first.push(inner.len() as u32);
    let (order, place) = little_fill(&first, &inner, &mut Vec::new())?;
    let unknowns = |blocks: Vec<u32>| {
        let each = blocks
            .into_iter()
            .flat_map(|b| (0..width).map(move |k| width * b + k));
        each.collect()
    };
    Some((unknowns(order), unknowns(place)))
}

/// An order of a lower triangle by columns in which the factor fills up little.
fn little_fill(first: &[u32], row: &[u32], division: &mut Division) -> Option<Permutation> {
    let size = first.len() - 1;
    let order = match size > LARGE {
        true => dissection::order(first, row, division, &least_degree)?,
        false => least_degree(first, row)?,
    };
    let mut place = vec![0; size];
    for (i, &unknown) in order.iter().enumerate() {
        place[unknown as usize] = i as u32;
    }
    Some((order, place))
}

/// Approximate minimum degree of a lower triangle by columns.
fn least_degree(first: &[u32], row: &[u32]) -> Option<Vec<u32>> {
    let size = first.len() - 1;
    let pattern = SymbolicSparseColMatRef::new_checked(size, size, first, None, row);
    let (mut order, mut place) = (vec![0; size], vec![0; size]);
    let scratch = amd::order_scratch::<u32>(size, row.len());
    let mut memory = MemBuffer::try_new(scratch).ok()?;
    amd::order(
        &mut order,
        &mut place,
        pattern,
        amd::Control::default(),
        MemStack::new(&mut memory),
    )
    .ok()?;
    Some(order)
}

#[cfg(test)]
mod tests;
