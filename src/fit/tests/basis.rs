//! Functions against their definition, and what least squares must satisfy.

use crate::fit::basis::ORDER;
use crate::fit::{Basis, DEGREE, LeastSquares, parameter};

/// The definition: a ratio of knots times each of the two functions of one degree less, 0/0 = 0.
fn by_definition(knots: &[f64], i: usize, degree: usize, t: f64) -> f64 {
    if degree == 0 {
        let last = t == 1.0 && knots[i + 1] == 1.0 && knots[i] < 1.0;
        return f64::from(u8::from(knots[i] <= t && t < knots[i + 1] || last));
    }
    let ratio = |x: f64, width: f64| if width > 0.0 { x / width } else { 0.0 };
    let rising = ratio(t - knots[i], knots[i + degree] - knots[i]);
    let falling = ratio(
        knots[i + degree + 1] - t,
        knots[i + degree + 1] - knots[i + 1],
    );
    rising * by_definition(knots, i, degree - 1, t)
        + falling * by_definition(knots, i + 1, degree - 1, t)
}

/// One function of a basis at a parameter.
fn function(basis: Basis, i: usize, t: f64) -> f64 {
    let local = basis.at(t);
    let at = i.checked_sub(local.first).filter(|&r| r < ORDER);
    at.map_or(0.0, |r| local.value[r])
}

#[test]
fn functions_are_those_of_the_definition() {
    for intervals in [1, 2, 3, 4, 9] {
        let basis = Basis::new(intervals);
        let knots = basis.knots();
        assert_eq!(knots.len(), basis.count() + ORDER);
        for step in 0..=200 {
            let t = f64::from(step) / 200.0;
            let mut sum = 0.0;
            for i in 0..basis.count() {
                let value = function(basis, i, t);
                let defined = by_definition(&knots, i, DEGREE, t);
                assert!((value - defined).abs() < 1e-14, "{intervals} {i} {t}");
                assert!(value >= 0.0);
                sum += value;
            }
            assert!((sum - 1.0).abs() < 1e-14);
        }
        assert_eq!(function(basis, 0, 0.0), 1.0);
        assert_eq!(function(basis, basis.count() - 1, 1.0), 1.0);
    }
}

/// The knots' Greville points are the control points of the line x = t.
#[test]
fn greville_points_give_the_identity() {
    let basis = Basis::new(7);
    let knots = basis.knots();
    let greville: Vec<f64> = (0..basis.count())
        .map(|i| knots[i + 1..=i + DEGREE].iter().sum::<f64>() / DEGREE as f64)
        .collect();
    for step in 0..=90 {
        let t = f64::from(step) / 90.0;
        let local = basis.at(t);
        let sum = |weights: [f64; ORDER]| -> f64 {
            (0..ORDER)
                .map(|r| weights[r] * greville[local.first + r])
                .sum()
        };
        assert!((sum(local.value) - t).abs() < 1e-14);
        assert!((sum(local.derivative) - 1.0).abs() < 1e-12);
    }
}

#[test]
fn derivatives_are_those_of_finite_differences() {
    let basis = Basis::new(5);
    let h = 1e-5;
    for step in 1..60 {
        let t = f64::from(step) / 61.0;
        let local = basis.at(t);
        for r in 0..ORDER {
            let i = local.first + r;
            let slope = (function(basis, i, t + h) - function(basis, i, t - h)) / (2.0 * h);
            assert!((local.derivative[r] - slope).abs() < 1e-6, "{i} {t}");
        }
    }
}

/// The residual of a least squares fit is orthogonal to everything that was free.
#[test]
fn residuals_are_orthogonal_to_the_inner_functions() {
    for (samples, spacing) in [(4, 4.0), (6, 2.0), (8, 4.0), (50, 2.0), (51, 7.3)] {
        let basis = Basis::for_samples(samples, spacing).expect("enough samples");
        let fitter = LeastSquares::new(samples, basis).expect("determined");
        let values: Vec<[f64; 3]> = (0..samples)
            .map(|i| [0.0, 1.0, 2.0].map(|c| (3.7 * i as f64 + c).sin()))
            .collect();
        let ends = [[0.3, -2.0, 1.0], [5.0, 0.0, 0.1]];
        let control = fitter.fit(&values, ends);
        assert_eq!([control[0], control[control.len() - 1]], ends);
        for j in 1..basis.count() - 1 {
            for c in 0..3 {
                let dot: f64 = (0..samples)
                    .map(|i| {
                        let t = parameter(i, samples);
                        let point: f64 = (0..basis.count())
                            .map(|k| function(basis, k, t) * control[k][c])
                            .sum();
                        function(basis, j, t) * (values[i][c] - point)
                    })
                    .sum();
                assert!(dot.abs() < 1e-12, "{samples} {j}: {dot:e}");
            }
        }
    }
}

#[test]
fn counts_follow_from_samples() {
    let count = |samples, spacing| Basis::for_samples(samples, spacing).map(Basis::count);
    assert_eq!(count(3, 4.0), None);
    assert_eq!(count(4, 2.0), Some(4));
    assert_eq!(count(8, 4.0), Some(5));
    assert_eq!(count(41, 4.0), Some(13));
    assert_eq!(count(41, 1e300), Some(4));
    // One control point less than samples at most.
    assert_eq!(count(6, 2.0), Some(6));
}
