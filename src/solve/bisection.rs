//! Short cuts of graphs into two halves.
//!
//! *Enters:* a [`Graph`]. *Leaves:* the side of each vertex, and the fewest vertices that meet all edges between the sides.
//!
//! A cut is found on coarse graphs, in which vertices that are matched along heavy edges are one, and made shorter on each finer one (Hendrickson and Leland 1995; Karypis and Kumar 1998; Fiduccia and Mattheyses 1982).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A graph of so many vertices is cut without a coarser one.
const COARSEST: usize = 100;
/// A graph that has more than this part of the vertices of the finer one is no coarser one.
const COARSER: f64 = 0.9;
/// Part of all that a side is at most.
pub(super) const MOST: f64 = 0.58;
/// Cuts of the coarsest graph that are tried.
const TRIES: usize = 8;
/// Passes of improvement at each graph, and moves without improvement that end one.
const PASSES: usize = 4;
const VAIN: usize = 80;

/// No vertex.
const NONE: u32 = u32::MAX;

/// An undirected graph with weights; both directions of each edge.
pub(super) struct Graph {
    first: Vec<u32>,
    to: Vec<u32>,
    /// Of edges; empty where all are 1.
    weight: Vec<u32>,
    /// Of vertices; empty where all are 1.
    size: Vec<u32>,
}

impl Graph {
    /// From the lower triangle of a matrix by columns.
    pub fn new(column: &[u32], row: &[u32]) -> Self {
        let count = column.len() - 1;
        let of_column = |c: usize| &row[column[c] as usize..column[c + 1] as usize];
        let edges = (0..count).flat_map(|c| of_column(c).iter().map(move |&r| (c, r as usize)));
        let edges = edges.filter(|(c, r)| c != r);
        let mut first = vec![0u32; count + 1];
        for (c, r) in edges.clone() {
            first[c + 1] += 1;
            first[r + 1] += 1;
        }
        (0..count).for_each(|v| first[v + 1] += first[v]);
        let mut next = first.clone();
        let mut to = vec![0; first[count] as usize];
        for (c, r) in edges {
            for (v, w) in [(c, r), (r, c)] {
                to[next[v] as usize] = w as u32;
                next[v] += 1;
            }
        }
        Self {
            first,
            to,
            weight: Vec::new(),
            size: Vec::new(),
        }
    }

    pub fn count(&self) -> usize {
        self.first.len() - 1
    }

    fn size(&self, v: usize) -> u32 {
        self.size.get(v).copied().unwrap_or(1)
    }

    fn all(&self) -> u64 {
        (0..self.count()).map(|v| u64::from(self.size(v))).sum()
    }

    pub fn around(&self, v: usize) -> &[u32] {
        &self.to[self.first[v] as usize..self.first[v + 1] as usize]
    }

    /// Neighbours and weights of the edges there.
    fn edges(&self, v: usize) -> impl Iterator<Item = (usize, u32)> {
        let range = self.first[v] as usize..self.first[v + 1] as usize;
        range.map(|i| {
            let weight = self.weight.get(i).copied().unwrap_or(1);
            (self.to[i] as usize, weight)
        })
    }

    /// The lower triangle by columns.
    pub fn lower(&self) -> (Vec<u32>, Vec<u32>) {
        let (mut column, mut row) = (vec![0], Vec::with_capacity(self.to.len() / 2));
        for v in 0..self.count() {
            let start = row.len();
            row.extend(self.around(v).iter().filter(|&&w| w as usize > v));
            row[start..].sort_unstable();
            column.push(row.len() as u32);
        }
        (column, row)
    }

    /// The part of these vertices, whose numbers there `place` tells of those of that part only.
    pub fn part(&self, vertices: &[u32], place: &[u32], side: &[u8], own: u8) -> Self {
        let (mut first, mut to) = (vec![0], Vec::new());
        for &v in vertices {
            let inside = self.around(v as usize).iter().copied();
            let inside = inside.filter(|&w| side[w as usize] == own);
            to.extend(inside.map(|w| place[w as usize]));
            first.push(to.len() as u32);
        }
        Self {
            first,
            to,
            weight: Vec::new(),
            size: Vec::new(),
        }
    }
}

/// Two sides of about the same size with few edges between them.
pub(super) fn cut(graph: &Graph) -> Vec<u8> {
    let coarser = match graph.count() > COARSEST {
        true => coarser(graph),
        false => None,
    };
    let mut side = match coarser {
        Some((coarse, of)) => {
            let side = cut(&coarse);
            of.iter().map(|&c| side[c as usize]).collect()
        }
        None => {
            let count = graph.count();
            let tries = (0..TRIES).map(|k| {
                let mut side = grown(graph, k * count / TRIES);
                let cut = improve(graph, &mut side);
                (cut, side)
            });
            let best = tries.min_by_key(|(cut, _)| *cut);
            best.map(|(_, side)| side).unwrap_or_default()
        }
    };
    improve(graph, &mut side);
    side
}

/// A graph with vertices matched along heavy edges, and the vertex of it that each one becomes.
fn coarser(graph: &Graph) -> Option<(Graph, Vec<u32>)> {
    let count = graph.count();
    let most = (graph.all() / 32).max(2);
    let mut of = vec![NONE; count];
    let mut pairs: Vec<[u32; 2]> = Vec::with_capacity(count / 2);
    for v in 0..count {
        if of[v] != NONE {
            continue;
        }
        let fits = |w: usize| {
            of[w] == NONE && w != v && u64::from(graph.size(v)) + u64::from(graph.size(w)) <= most
        };
        let free = graph.edges(v).filter(|&(w, _)| fits(w));
        let mate = free.max_by_key(|&(w, weight)| (weight, Reverse(graph.size(w)), Reverse(w)));
        let mate = mate.map_or(v, |(w, _)| w);
        of[v] = pairs.len() as u32;
        of[mate] = pairs.len() as u32;
        pairs.push([v as u32, mate as u32]);
    }
    if pairs.len() as f64 > COARSER * count as f64 {
        return None;
    }
    let mut coarse = Graph {
        first: Vec::with_capacity(pairs.len() + 1),
        to: Vec::new(),
        weight: Vec::new(),
        size: Vec::with_capacity(pairs.len()),
    };
    coarse.first.push(0);
    let mut at = vec![NONE; pairs.len()];
    for (c, &[v, w]) in pairs.iter().enumerate() {
        let start = coarse.to.len();
        let both = [v as usize, w as usize];
        let both = &both[..if v == w { 1 } else { 2 }];
        for (x, weight) in both.iter().flat_map(|&v| graph.edges(v)) {
            let to = of[x];
            if to as usize == c {
                continue;
            }
            let slot = at[to as usize] as usize;
            if slot >= start && slot < coarse.to.len() && coarse.to[slot] == to {
                coarse.weight[slot] += weight;
            } else {
                at[to as usize] = coarse.to.len() as u32;
                coarse.to.push(to);
                coarse.weight.push(weight);
            }
        }
        coarse.first.push(coarse.to.len() as u32);
        coarse.size.push(both.iter().map(|&v| graph.size(v)).sum());
    }
    Some((coarse, of))
}

/// Side 0 grown from a vertex, nearest vertices first, until it has half of all.
fn grown(graph: &Graph, start: usize) -> Vec<u8> {
    let count = graph.count();
    let half = graph.all() / 2;
    let mut side = vec![1; count];
    let mut sum = 0;
    let mut queue = std::collections::VecDeque::new();
    let mut seen = vec![false; count];
    for begin in (start..count).chain(0..start) {
        if !seen[begin] {
            seen[begin] = true;
            queue.push_back(begin);
        }
        while let Some(v) = queue.pop_front() {
            if sum >= half {
                return side;
            }
            side[v] = 0;
            sum += u64::from(graph.size(v));
            for &w in graph.around(v) {
                if !std::mem::replace(&mut seen[w as usize], true) {
                    queue.push_back(w as usize);
                }
            }
        }
    }
    side
}

/// Moves vertices between the sides while that makes the cut less; its weight.
fn improve(graph: &Graph, side: &mut [u8]) -> i64 {
    let count = graph.count();
    let all = graph.all();
    let most = ((MOST * all as f64) as u64).max(all / 2 + 1);
    let mut sums = [0u64; 2];
    for v in 0..count {
        sums[usize::from(side[v])] += u64::from(graph.size(v));
    }
    // By how much the cut becomes less if a vertex moves.
    let mut gain = vec![0i64; count];
    let (mut cut, mut border) = (0i64, Vec::new());
    for v in 0..count {
        let mut across = 0;
        for (w, weight) in graph.edges(v) {
            let weight = i64::from(weight);
            if side[w] == side[v] {
                gain[v] -= weight;
            } else {
                gain[v] += weight;
                across += weight;
            }
        }
        if across > 0 {
            border.push(v as u32);
        }
        cut += across;
    }
    cut /= 2;
    let mut moved_in = vec![0u8; count];
    for pass in 1..=PASSES as u8 {
        let mut heap: BinaryHeap<(i64, Reverse<u32>)> = BinaryHeap::new();
        heap.extend(border.iter().map(|&v| (gain[v as usize], Reverse(v))));
        let (mut moves, mut best, mut now) = (Vec::new(), (cut, 0), cut);
        while let Some((g, Reverse(v))) = heap.pop() {
            let at = v as usize;
            if moved_in[at] == pass || g != gain[at] {
                continue;
            }
            let (from, size) = (usize::from(side[at]), u64::from(graph.size(at)));
            // To the smaller side, or to one with room.
            if sums[1 - from] + size > most && sums[1 - from] + size > sums[from] {
                continue;
            }
            moved_in[at] = pass;
            side[at] = 1 - side[at];
            sums[from] -= size;
            sums[1 - from] += size;
            now -= g;
            gain[at] = -g;
            moves.push(v);
            for (w, weight) in graph.edges(at) {
                let weight = 2 * i64::from(weight);
                gain[w] += if side[w] == side[at] { -weight } else { weight };
                if moved_in[w] != pass {
                    heap.push((gain[w], Reverse(w as u32)));
                }
            }
            if now < best.0 {
                best = (now, moves.len());
            } else if moves.len() - best.1 > VAIN {
                break;
            }
        }
        for &v in moves[best.1..].iter().rev() {
            let at = v as usize;
            let (from, size) = (usize::from(side[at]), u64::from(graph.size(at)));
            side[at] = 1 - side[at];
            sums[from] -= size;
            sums[1 - from] += size;
            gain[at] = -gain[at];
            for (w, weight) in graph.edges(at) {
                let weight = 2 * i64::from(weight);
                gain[w] += if side[w] == side[at] { -weight } else { weight };
            }
        }
        if best.0 >= cut {
            break;
        }
        cut = best.0;
        for &v in &moves[..best.1] {
            border.push(v);
            border.extend_from_slice(graph.around(v as usize));
        }
        border.sort_unstable();
        border.dedup();
        let is_border = |v: usize| graph.around(v).iter().any(|&w| side[w as usize] != side[v]);
        border.retain(|&v| is_border(v as usize));
    }
    cut
}

/// The fewest vertices that meet all edges between the sides 0 and 1.
pub(super) fn cover(graph: &Graph, side: &[u8]) -> Vec<u32> {
    let count = graph.count();
    let across = |v: usize| {
        let around = graph.around(v).iter().copied();
        around.filter(move |&w| side[w as usize] + side[v] == 1)
    };
    let left: Vec<u32> = (0..count as u32)
        .filter(|&v| side[v as usize] == 0 && across(v as usize).next().is_some())
        .collect();
    let mut mate = vec![NONE; count];
    // Augmenting paths, from each vertex of the left side that has no mate: what leads to a vertex of the right side, and where the search goes on.
    let mut seen = vec![NONE; count];
    let mut came_from = vec![NONE; count];
    for &start in &left {
        let mut stack = vec![start];
        let mut end = NONE;
        'search: while let Some(v) = stack.pop() {
            for w in across(v as usize) {
                if seen[w as usize] == start {
                    continue;
                }
                seen[w as usize] = start;
                came_from[w as usize] = v;
                match mate[w as usize] {
                    NONE => {
                        end = w;
                        break 'search;
                    }
                    next => stack.push(next),
                }
            }
        }
        while end != NONE {
            let v = came_from[end as usize];
            let next = mate[v as usize];
            mate[end as usize] = v;
            mate[v as usize] = end;
            end = next;
        }
    }
    // What alternating paths from vertices of the left side without mate reach.
    let mut reached = vec![false; count];
    let mut stack: Vec<u32> = left
        .iter()
        .copied()
        .filter(|&v| mate[v as usize] == NONE)
        .collect();
    stack.iter().for_each(|&v| reached[v as usize] = true);
    let mut right = Vec::new();
    while let Some(v) = stack.pop() {
        for w in across(v as usize) {
            if std::mem::replace(&mut reached[w as usize], true) {
                continue;
            }
            right.push(w);
            let next = mate[w as usize];
            if next != NONE && !std::mem::replace(&mut reached[next as usize], true) {
                stack.push(next);
            }
        }
    }
    let mut cover: Vec<u32> = left.into_iter().filter(|&v| !reached[v as usize]).collect();
    cover.extend(right);
    cover
}
