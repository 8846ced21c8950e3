use super::*;
use crate::{SymmetricSolver, least_degree};

/// A square grid of vertices with a diagonal in each square, by columns of its lower triangle; a hundredth of the vertices have no edges.
fn mesh(side: usize) -> (Vec<u32>, Vec<u32>) {
    let size = side * side;
    // Numbers without pattern.
    let step = (0.618 * size as f64) as usize | 1;
    let step = (step..).find(|s| gcd(*s, size) == 1).unwrap();
    let at = |i: usize, j: usize| ((i * side + j) * step % size) as u32;
    let mut below = vec![Vec::new(); size];
    for (i, j) in (0..size).map(|k| (k / side, k % side)) {
        for (k, l) in [(i + 1, j), (i, j + 1), (i + 1, j + 1)] {
            let is_alone = |i: usize, j: usize| (i * side + j).is_multiple_of(101);
            if k < side && l < side && !is_alone(i, j) && !is_alone(k, l) {
                let (v, w) = (at(i, j), at(k, l));
                below[v.min(w) as usize].push(v.max(w));
            }
        }
    }
    let (mut column, mut row) = (vec![0], Vec::new());
    for (v, mut below) in below.into_iter().enumerate() {
        below.sort_unstable();
        row.push(v as u32);
        row.extend(below);
        column.push(row.len() as u32);
    }
    (column, row)
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[test]
fn separators_are_few_vertices_between_halves() {
    for side in [46, 100, 200] {
        let (column, row) = mesh(side);
        let graph = Graph::new(&column, &row);
        let sides = separated(&graph).unwrap();
        for v in 0..graph.count() {
            let apart = |&w: &u32| sides[v] + sides[w as usize] == 1;
            assert!(!graph.around(v).iter().any(apart), "{side}: {v}");
        }
        let count = |of: u8| sides.iter().filter(|&&s| s == of).count();
        // A straight one has a vertex in each row.
        assert!(count(2) <= 3 * side / 2, "{side}: {}", count(2));
        let most = (MOST + 0.05) * graph.count() as f64;
        assert!(count(0).max(count(1)) as f64 <= most, "{side}");
    }
}

#[test]
fn covers_have_as_few_vertices_as_any() {
    let mut state = 1u64;
    let mut chance = |of: u64| {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 33) % of
    };
    for _ in 0..300 {
        let count = 2 + chance(11) as u32;
        let all = (0..count).flat_map(|v| (0..v).map(move |w| [w, v]));
        let edges: Vec<[u32; 2]> = all.filter(|_| chance(3) == 0).collect();
        let side: Vec<u8> = (0..count).map(|_| chance(2) as u8).collect();
        let (mut column, mut row) = (vec![0], Vec::new());
        for v in 0..count {
            row.push(v);
            row.extend(edges.iter().filter(|[w, _]| *w == v).map(|[_, x]| *x));
            column.push(row.len() as u32);
        }
        let cover = cover(&Graph::new(&column, &row), &side);
        let crosses = |[v, w]: &&[u32; 2]| side[*v as usize] != side[*w as usize];
        let crossing: Vec<_> = edges.iter().filter(crosses).collect();
        let meets = |set: u32| {
            let mut crossing = crossing.iter();
            crossing.all(|[v, w]| set >> v & 1 == 1 || set >> w & 1 == 1)
        };
        assert!(meets(cover.iter().map(|v| 1 << v).sum()));
        let fewest = (0..1u32 << count).filter(|&set| meets(set));
        let fewest = fewest.map(u32::count_ones).min().unwrap();
        assert_eq!(cover.len(), fewest as usize, "{edges:?} {side:?}");
    }
}

#[test]
fn orders_hold_every_vertex_once_and_are_less_work_than_minimum_degree() {
    let (column, row) = mesh(320);
    let dissected = order(&column, &row, &mut Vec::new(), &least_degree).unwrap();
    let mut sorted = dissected.clone();
    sorted.sort_unstable();
    assert!(sorted.iter().enumerate().all(|(i, &v)| i as u32 == v));
    // On any number of threads.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1);
    let alone = || order(&column, &row, &mut Vec::new(), &least_degree).unwrap();
    assert!(pool.build().unwrap().install(alone) == dissected);
    let work = |order: &[u32]| work(&column, &row, order);
    let least = least_degree(&column, &row).unwrap();
    let [dissected, least] = [work(&dissected), work(&least)];
    assert!(1.4 * dissected <= least, "{dissected} {least}");
}

/// Multiplications of a factorisation in an order.
fn work(column: &[u32], row: &[u32], order: &[u32]) -> f64 {
    let mut place = vec![0; order.len()];
    (0..order.len()).for_each(|i| place[order[i] as usize] = i as u32);
    let of_column = |c: usize| &row[column[c] as usize..column[c + 1] as usize];
    let all = (0..order.len()).flat_map(|c| of_column(c).iter().map(move |&r| [c as u32, r]));
    let pairs: Vec<[u32; 2]> = all.filter(|[c, r]| c != r).collect();
    let solver = SymmetricSolver::in_order(order, &place, &pairs);
    solver.fronts().work()
}

/// Every thousandth vertex gets an edge to one some rows on, over and over.
#[test]
fn divisions_are_mended_where_edges_change() {
    let side = 320;
    let (mut column, mut row) = mesh(side);
    let mut division = Vec::new();
    order(&column, &row, &mut division, &least_degree).unwrap();
    for round in 0..5 {
        let size = side * side;
        let mut below: Vec<Vec<u32>> = (0..size)
            .map(|c| row[column[c] as usize..column[c + 1] as usize].to_vec())
            .collect();
        for v in (round..size).step_by(1000) {
            // A neighbour of a neighbour, where there is one.
            let next = |v: usize| below[v].last().map(|&w| w as usize);
            let w = next(v).and_then(next).unwrap_or(v);
            if w != v && !below[v].contains(&(w as u32)) {
                below[v].push(w as u32);
                below[v].sort_unstable();
            }
        }
        column = vec![0];
        row = below.concat();
        for below in &below {
            column.push(column[column.len() - 1] + below.len() as u32);
        }
        let before = division.clone();
        let mended = order(&column, &row, &mut division, &least_degree).unwrap();
        let mut sorted = mended.clone();
        sorted.sort_unstable();
        assert!(sorted.iter().enumerate().all(|(i, &v)| i as u32 == v));
        // Nearly all is where it was.
        let moved = before.iter().zip(&division).filter(|(a, b)| a != b).count();
        assert!(moved < size / 50, "{round}: {moved} of {size}");
        let anew = order(&column, &row, &mut Vec::new(), &least_degree).unwrap();
        let [mended, anew] = [&mended, &anew].map(|order| work(&column, &row, order));
        assert!(mended <= 1.2 * anew, "{round}: {mended} {anew}");
    }
}

#[test]
fn graphs_in_pieces_and_without_edges_are_ordered() {
    let none: Vec<u32> = (0..=5000).collect();
    let alone: Vec<u32> = (0..5000).collect();
    let order = order(&none, &alone, &mut Vec::new(), &least_degree).unwrap();
    assert_eq!(order.len(), 5000);
    let mut sorted = order;
    sorted.sort_unstable();
    assert!(sorted == alone);
}
