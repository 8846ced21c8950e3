use super::*;

/// Numbers without pattern, reproducible.
fn sequence(mut state: u64) -> impl FnMut() -> f64 {
    move || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Gaussian elimination with pivoting.
fn dense_solve(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for c in 0..n {
        let pivot = (c..n)
            .max_by(|&i, &j| a[i][c].abs().total_cmp(&a[j][c].abs()))
            .unwrap();
        a.swap(c, pivot);
        b.swap(c, pivot);
        for r in c + 1..n {
            let t = a[r][c] / a[c][c];
            let upper = a[c].clone();
            for (x, y) in a[r].iter_mut().zip(upper).skip(c) {
                *x -= t * y;
            }
            b[r] -= t * b[c];
        }
    }
    for c in (0..n).rev() {
        let known: f64 = (c + 1..n).map(|j| a[c][j] * b[j]).sum();
        b[c] = (b[c] - known) / a[c][c];
    }
    b
}

#[test]
fn agrees_with_dense_elimination_and_is_reusable() {
    let mut random = sequence(7);
    for n in [1usize, 2, 5, 40] {
        let mut pairs = Vec::new();
        for _ in 0..3 * n {
            let i = (random() * n as f64) as u32;
            let j = (random() * n as f64) as u32;
            if i != j {
                pairs.push([i, j]);
            }
        }
        // The same pair in both orders must add up.
        if n > 1 {
            pairs.extend([[0, 1], [1, 0]]);
        }
        let mut solver = SymmetricSolver::new(n, &pairs).unwrap();
        for _ in 0..2 {
            let off: Vec<f64> = pairs.iter().map(|_| -random()).collect();
            let mut dense = vec![vec![0.0; n]; n];
            for (p, w) in pairs.iter().zip(&off) {
                let [i, j] = p.map(|i| i as usize);
                dense[i][j] += w;
                dense[j][i] += w;
                dense[i][i] -= w;
                dense[j][j] -= w;
            }
            let mut diagonal = vec![0.0; n];
            for i in 0..n {
                dense[i][i] += 0.1;
                diagonal[i] = dense[i][i];
            }
            let rhs: Vec<f64> = (0..n).map(|_| random() - 0.5).collect();
            let expected = dense_solve(dense.clone(), rhs.clone());
            // With its own order, and with that of itself, which must come to the same.
            let kept = SymmetricSolver::new(n, &pairs).unwrap();
            let mut kept = kept.with_pairs(&pairs).unwrap();
            let mut last = SymmetricSolver::with_border(n, n.div_ceil(3), &pairs).unwrap();
            for solver in [&mut solver, &mut kept, &mut last] {
                solver.factorize(&diagonal, &off).unwrap();
                let mut x = rhs.clone();
                solver.solve(&mut x);
                for (a, b) in x.iter().zip(&expected) {
                    assert!((a - b).abs() < 1e-11, "{a} against {b}");
                }
            }
        }
    }
}

#[test]
fn blocks_are_ordered_as_a_whole() {
    let mut random = sequence(11);
    let (blocks, width) = (30, 2);
    let mut pairs = Vec::new();
    for b in 0..blocks as u32 {
        pairs.push([2 * b, 2 * b + 1]);
        let other = (random() * blocks as f64) as u32;
        if other != b {
            let (x, y) = (2 * b, 2 * other);
            pairs.extend([[x, y], [x, y + 1], [x + 1, y], [x + 1, y + 1]]);
        }
    }
    let size = width * blocks;
    let off: Vec<f64> = pairs.iter().map(|_| random() - 0.5).collect();
    let (diagonal, rhs) = (vec![40.0; size], (0..size).map(|_| random()));
    let rhs: Vec<f64> = rhs.collect();
    let solutions = [
        SymmetricSolver::new(size, &pairs),
        SymmetricSolver::with_blocks(size, width, &pairs),
    ];
    let [one, other] = solutions.map(|solver| {
        let (mut solver, mut x) = (solver.unwrap(), rhs.clone());
        solver.factorize(&diagonal, &off).unwrap();
        solver.solve(&mut x);
        x
    });
    for (a, b) in one.iter().zip(&other) {
        assert!((a - b).abs() < 1e-14);
    }
}

#[test]
fn singular_and_infinite_matrices_are_refused() {
    let mut solver = SymmetricSolver::new(2, &[[0, 1]]).unwrap();
    let refused = Err(SolveError::NotPositiveDefinite { unknowns: 2 });
    assert_eq!(solver.factorize(&[1.0, -1.0], &[0.0]), refused);
    assert_eq!(solver.factorize(&[1.0, 1.0], &[2.0]), refused);
    assert_eq!(solver.factorize(&[f64::INFINITY, 1.0], &[0.0]), refused);
    assert_eq!(solver.factorize(&[f64::NAN, 1.0], &[0.0]), refused);
    assert_eq!(solver.factorize(&[2.0, 2.0], &[1.0]), Ok(()));
    let mut empty = SymmetricSolver::new(0, &[]).unwrap();
    empty.factorize(&[], &[]).unwrap();
    empty.solve(&mut []);
}
