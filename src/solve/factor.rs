//! The Cholesky factor, front by front.
//!
//! *Enters:* a symbolic factor, and values. *Leaves:* the factor, in the crate's layout.
//!
//! The multifrontal method (Duff and Reid 1983; Liu 1992): a supernode's columns and what they subtract from the rows below are one dense matrix, its front, to which the children in the elimination tree add what they have to subtract there.
//! Branches of the tree know nothing of each other, so they are worked out side by side; above them fronts are few and large, and their columns are worked out side by side. Most fronts of a surface are small, where calls for
//! dense blocks cost several times what they compute: those are loops here, compiled for the widest vectors that the crate knows; large ones are left to the crate.
//!
//! *Guaranteed:* the same bytes for any number of threads: neither branches nor blocks of columns depend on it, and children are added in the order of elimination.

use super::front::{add, large, pivots, small};
use faer::dyn_stack::MemBuffer;
use faer::sparse::linalg::cholesky::{SymbolicCholesky, SymbolicCholeskyRaw};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::collections::HashMap;
use std::ops::Range;

/// Columns, and columns and rows, from which on a front is large.
const LARGE: [usize; 2] = [12, 48];
/// Part of all work that a branch is at most, …
const BRANCH: f64 = 1.0 / 48.0;
/// … but for small systems, where it is so many multiplications.
const LEAST_BRANCH: f64 = 2e6;
/// Work of a front that is worth several threads.
const SHARED: f64 = 2e6;

/// No parent.
const NONE: u32 = u32::MAX;

/// Some consecutive columns of the factor with the same rows below their diagonal block.
struct Node {
    /// Number of columns.
    size: usize,
    /// In [`Fronts::place`]: the rows below.
    below: Range<usize>,
    /// In the factor: column after column, the diagonal block on top.
    value: Range<usize>,
    /// In [`Fronts::entries`].
    entries: Range<usize>,
    parent: u32,
}

impl Node {
    /// Multiplications.
    fn work(&self) -> f64 {
        let below = self.below.len() as f64;
        let heights = (1..=self.size).map(|i| i as f64 + below);
        heights.map(|h| h * h).sum()
    }

    /// Columns and rows of the front.
    fn height(&self) -> usize {
        self.size + self.below.len()
    }
}

/// How a matrix is factorised.
pub(super) struct Fronts {
    nodes: Vec<Node>,
    /// Where each row below a node stands in the front of its parent.
    place: Vec<u32>,
    /// Which value of the matrix is added (diagonal, then pairs), and where in the values of its node.
    entries: Vec<[u32; 2]>,
    /// The children of each node.
    children: Vec<Range<usize>>,
    child: Vec<u32>,
    /// Branches, whose nodes are worked out side by side with those of others, and the nodes above them, all in ascending order.
    branches: Vec<Vec<u32>>,
    above: Vec<u32>,
    /// Where substitution can go through branches side by side.
    pub for_substitution: Option<Branches>,
}

/// Branches as substitution needs them: rows below a node are in its own run, or above all branches.
pub(super) struct Branches {
    /// Consecutive nodes of each.
    pub runs: Vec<Vec<Range<usize>>>,
    /// Consecutive nodes above all of them.
    pub nodes_above: Vec<Range<usize>>,
    /// Their unknowns, in the order of elimination.
    pub above: Vec<u32>,
    /// Where each unknown stands among these.
    pub place: Vec<u32>,
}

/// What a node subtracts from the rows below it: square, column after column, the lower triangle.
type Update = Vec<f64>;

/// A pivot that is not positive.
pub(super) struct NotPositive;

impl Fronts {
    /// `pairs`: off-diagonal entries; both triangles, several of one entry.
    pub fn new(symbolic: &SymbolicCholesky<u32>, size: usize, pairs: &[[u32; 2]]) -> Self {
        let (mut nodes, rows) = nodes(symbolic, size);
        let mut of_column = vec![0; size];
        let mut start = 0;
        let mut first = Vec::with_capacity(nodes.len());
        for (s, node) in nodes.iter().enumerate() {
            first.push(start);
            of_column[start..start + node.size].fill(s as u32);
            start += node.size;
        }
        let mut place = vec![0; rows.len()];
        for s in 0..nodes.len() {
            let Some(&next) = rows[nodes[s].below.clone()].first() else {
                continue;
            };
            let parent = of_column[next as usize] as usize;
            nodes[s].parent = parent as u32;
            // Both ascend.
            let (above, from) = (&nodes[parent], first[parent]);
            let mut at = above.below.start;
            for i in nodes[s].below.clone() {
                let own = rows[i] as usize - from;
                place[i] = if own < above.size {
                    own as u32
                } else {
                    while rows[at] < rows[i] {
                        at += 1;
                    }
                    (above.size + at - above.below.start) as u32
                };
            }
        }
        let position = |unknown: u32| match symbolic.perm() {
            Some(order) => order.arrays().1[unknown as usize] as usize,
            None => unknown as usize,
        };
        // Column and row of every value, by nodes.
        let entry = |[i, j]: [u32; 2]| {
            let (i, j) = (position(i), position(j));
            [i.min(j) as u32, i.max(j) as u32]
        };
        let diagonal = (0..size as u32).map(|i| [i; 2]);
        let all: Vec<[u32; 2]> = diagonal.chain(pairs.iter().copied()).map(entry).collect();
        let mut count = vec![0usize; nodes.len() + 1];
        for [column, _] in &all {
            count[of_column[*column as usize] as usize + 1] += 1;
        }
        for s in 0..nodes.len() {
            count[s + 1] += count[s];
            nodes[s].entries = count[s]..count[s + 1];
        }
        let mut entries = vec![[0; 2]; all.len()];
        for (i, [column, _]) in all.iter().enumerate() {
            let next = &mut count[of_column[*column as usize] as usize];
            entries[*next][0] = i as u32;
            *next += 1;
        }
        // Where a row stands in the front at hand.
        let mut stands = vec![0; size];
        for (node, &first) in nodes.iter().zip(&first) {
            (0..node.size).for_each(|k| stands[first + k] = k);
            for (k, &row) in (node.size..).zip(&rows[node.below.clone()]) {
                stands[row as usize] = k;
            }
            for [i, at] in &mut entries[node.entries.clone()] {
                let [column, row] = all[*i as usize].map(|c| c as usize);
                *at = ((column - first) * node.height() + stands[row]) as u32;
            }
        }
        let mut fronts = Self {
            nodes,
            place,
            entries,
            children: Vec::new(),
            child: Vec::new(),
            branches: Vec::new(),
            above: Vec::new(),
            for_substitution: None,
        };
        fronts.link();
        fronts.divide();
        fronts.for_substitution = fronts.for_substitution(&first, size);
        fronts
    }

    /// See [`Branches`]; `first`: the first unknown of every node, of `size` unknowns. None where there is one only, or where the order does not go through the elimination tree branch by branch.
    fn for_substitution(&self, first: &[usize], size: usize) -> Option<Branches> {
        let runs = |nodes: &Vec<u32>| {
            let runs = nodes.chunk_by(|a, b| a + 1 == *b);
            let ends = |run: &[u32]| Some(*run.first()? as usize..*run.last()? as usize + 1);
            runs.filter_map(ends).collect::<Vec<_>>()
        };
        let of_branch: Vec<Vec<Range<usize>>> = self.branches.iter().map(runs).collect();
        let mut run_of = vec![NONE; self.nodes.len()];
        for (number, run) in (0..).zip(of_branch.iter().flatten()) {
            run_of[run.clone()].fill(number);
        }
        let is_inside = |s: usize| {
            let beyond = self.parent(s).map_or(NONE, |parent| run_of[parent]);
            beyond == NONE || beyond == run_of[s]
        };
        let mut inner = of_branch.iter().flatten().flat_map(Range::clone);
        if of_branch.len() < 2 || !inner.all(is_inside) {
            return None;
        }
        let mut branches = Branches {
            runs: of_branch,
            nodes_above: runs(&self.above),
            above: Vec::new(),
            place: vec![NONE; size],
        };
        for &s in &self.above {
            let from = first[s as usize];
            for row in from..from + self.nodes[s as usize].size {
                branches.place[row] = branches.above.len() as u32;
                branches.above.push(row as u32);
            }
        }
        Some(branches)
    }

    /// Children of the nodes.
    fn link(&mut self) {
        let count = self.nodes.len();
        let mut first = vec![0usize; count + 2];
        for node in self.nodes.iter().filter(|n| n.parent != NONE) {
            first[node.parent as usize + 2] += 1;
        }
        for s in 0..=count {
            first[s + 1] += first[s];
        }
        self.child = vec![0; first[count + 1]];
        for (s, node) in self.nodes.iter().enumerate() {
            if node.parent != NONE {
                let next = &mut first[node.parent as usize + 1];
                self.child[*next] = s as u32;
                *next += 1;
            }
        }
        self.children = (0..count).map(|s| first[s]..first[s + 1]).collect();
    }

    /// Branches and what is above them.
    fn divide(&mut self) {
        let count = self.nodes.len();
        // Of whole subtrees.
        let mut work: Vec<f64> = self.nodes.iter().map(Node::work).collect();
        for s in 0..count {
            if let Some(parent) = self.parent(s) {
                work[parent] += work[s];
            }
        }
        let roots = (0..count).filter(|&s| self.parent(s).is_none());
        let all: f64 = roots.map(|s| work[s]).sum();
        let most = (BRANCH * all).max(LEAST_BRANCH);
        let is_above = |s: usize| work[s] > most;
        // Small subtrees together are one branch.
        let mut branch_of = vec![NONE; count];
        let (mut branches, mut sum) = (0, f64::INFINITY);
        for s in (0..count).filter(|&s| !is_above(s)) {
            if self.parent(s).is_none_or(is_above) {
                if sum + work[s] > most {
                    (branches, sum) = (branches + 1, 0.0);
                }
                sum += work[s];
                branch_of[s] = branches - 1;
            }
        }
        self.branches = vec![Vec::new(); branches as usize];
        for s in (0..count).rev() {
            match self.parent(s).map_or(NONE, |p| branch_of[p]) {
                NONE => {}
                branch => branch_of[s] = branch,
            }
        }
        for (s, &branch) in branch_of.iter().enumerate() {
            match branch {
                NONE => self.above.push(s as u32),
                branch => self.branches[branch as usize].push(s as u32),
            }
        }
    }

    /// Multiplications of a factorisation.
    #[cfg(test)]
    pub fn work(&self) -> f64 {
        self.nodes.iter().map(Node::work).sum()
    }

    fn parent(&self, s: usize) -> Option<usize> {
        let parent = self.nodes[s].parent;
        (parent != NONE).then_some(parent as usize)
    }

    /// The factor of a matrix: `diagonal` one an unknown, `off_diagonal` one a pair.
    pub fn factorize(
        &self,
        factor: &mut [f64],
        diagonal: &[f64],
        off_diagonal: &[f64],
    ) -> Result<(), NotPositive> {
        let matrix = Matrix {
            diagonal,
            off_diagonal,
        };
        let mut rest = factor;
        let of_node = self.nodes.iter().map(|node| {
            let (own, others) = std::mem::take(&mut rest).split_at_mut(node.value.len());
            rest = others;
            own
        });
        let mut own: Vec<&mut [f64]> = of_node.collect();
        let mut taken = |nodes: &[u32]| -> Vec<&mut [f64]> {
            let own = nodes.iter().map(|&s| std::mem::take(&mut own[s as usize]));
            own.collect()
        };
        let of_branch = self.branches.iter().map(|nodes| (nodes, taken(nodes)));
        let branches: Vec<_> = of_branch.collect();
        let branch = |(nodes, own): (&Vec<u32>, Vec<&mut [f64]>)| {
            Arch::new().dispatch(Branch {
                fronts: self,
                matrix,
                nodes,
                own,
                waiting: HashMap::new(),
                is_shared: false,
            })
        };
        let updates: Vec<Result<Waiting, NotPositive>> = match branches.len() {
            1 => branches.into_iter().map(branch).collect(),
            _ => branches.into_par_iter().map(branch).collect(),
        };
        let mut waiting = HashMap::new();
        for of_branch in updates {
            waiting.extend(of_branch?);
        }
        let above = Branch {
            fronts: self,
            matrix,
            nodes: &self.above,
            own: taken(&self.above),
            waiting,
            is_shared: true,
        };
        Arch::new().dispatch(above).map(|_| ())
    }
}

/// The nodes of a symbolic factor and the rows below them.
fn nodes(symbolic: &SymbolicCholesky<u32>, size: usize) -> (Vec<Node>, Vec<u32>) {
    let mut rows = Vec::new();
    let mut node = |size: usize, below: &[u32], value: [u32; 2]| {
        let begin = rows.len();
        rows.extend_from_slice(below);
        Node {
            size,
            below: begin..rows.len(),
            value: value[0] as usize..value[1] as usize,
            entries: 0..0,
            parent: NONE,
        }
    };
    let nodes = match symbolic.raw() {
        SymbolicCholeskyRaw::Supernodal(super_nodes) => {
            let [begin, end] = [super_nodes.supernode_begin(), super_nodes.supernode_end()];
            let value = super_nodes.col_ptr_for_val();
            let all = (0..super_nodes.n_supernodes()).map(|s| {
                let below = super_nodes.supernode(s).pattern();
                node(
                    (end[s] - begin[s]) as usize,
                    below,
                    [value[s], value[s + 1]],
                )
            });
            all.collect()
        }
        // Of a matrix that is diagonal, whatever is asked for: every column by itself.
        SymbolicCholeskyRaw::Simplicial(columns) => {
            let (first, row) = (columns.col_ptr(), columns.row_idx());
            let all = (0..size).map(|s| {
                let [from, to] = [first[s], first[s + 1]];
                node(1, &row[from as usize + 1..to as usize], [from, to])
            });
            all.collect()
        }
    };
    (nodes, rows)
}

#[derive(Clone, Copy)]
struct Matrix<'a> {
    diagonal: &'a [f64],
    off_diagonal: &'a [f64],
}

impl Matrix<'_> {
    fn value(&self, entry: u32) -> f64 {
        let at = entry as usize;
        match self.diagonal.get(at) {
            Some(x) => *x,
            None => self.off_diagonal[at - self.diagonal.len()],
        }
    }
}

/// Updates of nodes whose parent is yet to come.
type Waiting = HashMap<u32, Update>;

/// Nodes to be worked out; updates are left of those whose parents are not among them.
struct Branch<'a> {
    fronts: &'a Fronts,
    matrix: Matrix<'a>,
    nodes: &'a [u32],
    own: Vec<&'a mut [f64]>,
    /// Of other nodes.
    waiting: Waiting,
    is_shared: bool,
}

impl WithSimd for Branch<'_> {
    type Output = Result<Waiting, NotPositive>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let (mut pivots, mut spare) = (pivots(), Vec::new());
        let mut waiting = self.waiting;
        for (&s, own) in self.nodes.iter().zip(self.own) {
            let children = &self.fronts.child[self.fronts.children[s as usize].clone()];
            let updates = children.iter();
            let updates = updates.filter_map(|&c| Some((c, waiting.remove(&c)?)));
            let front = Front {
                fronts: self.fronts,
                matrix: self.matrix,
                node: s,
                values: own,
                children: updates.collect(),
                pivots: &mut pivots,
                spare: &mut spare,
                is_shared: self.is_shared,
            };
            let update = front.with_simd(simd)?;
            if self.fronts.nodes[s as usize].parent != NONE {
                waiting.insert(s, update);
            }
        }
        Ok(waiting)
    }
}

/// A front to be worked out.
struct Front<'a> {
    fronts: &'a Fronts,
    matrix: Matrix<'a>,
    node: u32,
    values: &'a mut [f64],
    children: Vec<(u32, Update)>,
    pivots: &'a mut MemBuffer,
    /// Memory to be used again.
    spare: &'a mut Vec<Update>,
    is_shared: bool,
}

impl WithSimd for Front<'_> {
    type Output = Result<Update, NotPositive>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let node = &self.fronts.nodes[self.node as usize];
        let (size, below) = (node.size, node.below.len());
        let own = self.values;
        own.fill(0.0);
        for &[entry, at] in &self.fronts.entries[node.entries.clone()] {
            own[at as usize] += self.matrix.value(entry);
        }
        let mut update = self.spare.pop().unwrap_or_default();
        update.clear();
        update.resize(below * below, 0.0);
        for (child, of_child) in self.children {
            let place = &self.fronts.place[self.fronts.nodes[child as usize].below.clone()];
            add(size, place, &of_child, own, &mut update);
            // Thousands of small ones that come and go would leave the heap in pieces; large ones go back.
            if !self.is_shared {
                self.spare.push(of_child);
            }
        }
        let is_large = size >= LARGE[0] && node.height() >= LARGE[1];
        let done = match is_large {
            true => {
                let is_shared = self.is_shared && node.work() >= SHARED;
                large(size, own, &mut update, self.pivots, is_shared)
            }
            false => small::<S>(size, own, &mut update),
        };
        match done {
            true => Ok(update),
            false => Err(NotPositive),
        }
    }
}

#[cfg(test)]
mod tests;
