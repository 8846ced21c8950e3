use super::*;
use crate::{Order, SymmetricSolver};
use faer::dyn_stack::MemStack;
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::perm::PermRef;
use faer::sparse::{SparseColMat, Triplet};
use faer::{Par, Side, Spec};

/// The Laplacian of a torus of squares with a diagonal each, its vertices numbered without pattern, and a little more on the diagonal: pairs, diagonal and off-diagonal values.
fn torus(side: usize) -> (Vec<[u32; 2]>, Vec<f64>, Vec<f64>) {
    let size = side * side;
    let order = shuffled(size, 1);
    let at = |i: usize, j: usize| order[i % side * side + j % side];
    let all = (0..size).map(|k| [k / side, k % side]);
    let pairs: Vec<[u32; 2]> = all
        .flat_map(|[i, j]| {
            [[i + 1, j], [i, j + 1], [i + 1, j + 1]].map(|[k, l]| [at(i, j), at(k, l)])
        })
        .collect();
    let mut diagonal = vec![0.01; size];
    let weight = |p: usize| 1.0 + (p % 7) as f64;
    for (p, pair) in pairs.iter().enumerate() {
        pair.iter().for_each(|&i| diagonal[i as usize] += weight(p));
    }
    let off = (0..pairs.len()).map(|p| -weight(p)).collect();
    (pairs, diagonal, off)
}

fn shuffled(size: usize, seed: u64) -> Vec<u32> {
    let mut order: Vec<u32> = (0..size as u32).collect();
    let mut state = seed;
    for i in (1..size).rev() {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        order.swap(i, (state >> 33) as usize % (i + 1));
    }
    order
}

/// The factor as the crate computes it, in the same symbolic one.
fn of_crate(
    solver: &SymmetricSolver,
    pairs: &[[u32; 2]],
    diagonal: &[f64],
    off: &[f64],
) -> Vec<f64> {
    let of_diagonal = diagonal.iter().enumerate();
    let of_diagonal = of_diagonal.map(|(i, &x)| Triplet::new(i as u32, i as u32, x));
    let of_pairs = pairs.iter().zip(off);
    let of_pairs = of_pairs.map(|(&[i, j], &x)| Triplet::new(i.max(j), i.min(j), x));
    let entries: Vec<_> = of_diagonal.chain(of_pairs).collect();
    let size = diagonal.len();
    let matrix = SparseColMat::try_new_from_triplets(size, size, &entries).unwrap();
    let symbolic = &solver.symbolic;
    let mut factor = vec![0.0; symbolic.len_val()];
    let scratch = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
    symbolic
        .factorize_numeric_llt(
            &mut factor,
            matrix.as_ref(),
            Side::Lower,
            LltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
            Spec::default(),
        )
        .unwrap();
    factor
}

#[test]
fn factors_are_those_of_the_crate() {
    for side in [3, 10, 40, 110] {
        let (pairs, diagonal, off) = torus(side);
        let size = side * side;
        let any = shuffled(size, 2);
        let mut place = vec![0; size];
        (0..size).for_each(|i| place[any[i] as usize] = i as u32);
        // The last is no order that goes through the elimination tree branch by branch, and fills up.
        let given = PermRef::new_checked(&any, &place, size);
        let orders = [
            Order::LeastDegree { border: 0 },
            Order::LeastDegree { border: 5 },
            Order::Given(given),
        ];
        for order in orders.into_iter().take(if side > 40 { 2 } else { 3 }) {
            let mut solver = SymmetricSolver::ordered(size, &pairs, order)
                .unwrap()
                .in_fronts(&pairs);
            solver.factorize(&diagonal, &off).unwrap();
            let expected = of_crate(&solver, &pairs, &diagonal, &off);
            // The triangle above the diagonal is not looked at.
            let mut compared = 0;
            for node in &solver.fronts().nodes {
                for j in 0..node.size {
                    let column = node.value.start + j * node.height();
                    for at in column + j..column + node.height() {
                        let (found, expected) = (solver.factor[at], expected[at]);
                        assert!(
                            (found - expected).abs() < 1e-12 * diagonal[0],
                            "{side}: {found} {expected}"
                        );
                        compared += 1;
                    }
                }
            }
            assert!(compared >= size + pairs.len());
        }
    }
}

#[test]
fn factors_have_the_same_bytes_on_any_number_of_threads() {
    let (pairs, diagonal, off) = torus(150);
    let mut solver = SymmetricSolver::new(diagonal.len(), &pairs)
        .unwrap()
        .in_fronts(&pairs);
    assert!(solver.fronts().branches.len() > 8 && solver.fronts().above.len() > 3);
    let is_shared = |&s: &u32| solver.fronts().nodes[s as usize].work() >= SHARED;
    assert!(solver.fronts().above.iter().any(is_shared));
    let mut factors = [1, 2, 5].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        let pool = pool.build().unwrap();
        pool.install(|| solver.factorize(&diagonal, &off).unwrap());
        solver
            .factor
            .iter()
            .map(|x| x.to_bits())
            .collect::<Vec<u64>>()
    });
    factors.sort();
    assert!(factors[0] == factors[2]);
}

#[test]
fn pivots_that_are_not_positive_are_found_wherever_they_are() {
    let (pairs, diagonal, off) = torus(70);
    let mut solver = SymmetricSolver::new(diagonal.len(), &pairs)
        .unwrap()
        .in_fronts(&pairs);
    for at in (0..diagonal.len()).step_by(97) {
        let mut diagonal = diagonal.clone();
        diagonal[at] = -1.0;
        assert!(solver.factorize(&diagonal, &off).is_err(), "{at}");
    }
    // And the next one is as if nothing had been.
    solver.factorize(&diagonal, &off).unwrap();
    let expected = of_crate(&solver, &pairs, &diagonal, &off);
    let last = expected.last().unwrap();
    assert!((solver.factor.last().unwrap() - last).abs() < 1e-9);
}
