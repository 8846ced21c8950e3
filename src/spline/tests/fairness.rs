use super::*;

fn squares(differences: &[Difference], points: &[[f64; 3]]) -> f64 {
    let sum = |d: &Difference, i: usize| -> f64 {
        d.points
            .iter()
            .map(|&(v, x)| x * points[v as usize][i])
            .sum()
    };
    differences
        .iter()
        .flat_map(|d| (0..3).map(move |i| sum(d, i).powi(2)))
        .sum()
}

#[test]
fn edges_of_an_affine_polygon_are_flat_and_no_others() {
    for n in 3..9usize {
        let ends: Vec<u32> = (1..=n as u32).collect();
        let turn = |i: usize| 2.0 * PI * i as f64 / n as f64;
        let corner = |i: usize| {
            let (y, x) = turn(i).sin_cos();
            [3.0 * x + y, 0.5 * y - x, 0.7 * x + 2.0 * y]
        };
        let mut points = vec![[0.0; 3]];
        points.extend((0..n).map(corner));
        let differences = from_flat(0, &ends);
        assert_eq!(differences.len(), n - 2);
        assert!(squares(&differences, &points) < 1e-24, "{n}");
        // Each direction but those of affine maps, all edges and the waves that turn twice and more.
        for k in (0..=n / 2).filter(|&k| k != 1) {
            let mut other = points.clone();
            (0..n).for_each(|i| other[i + 1][2] += (turn(i) * k as f64).cos());
            let size: f64 = (0..n).map(|i| (turn(i) * k as f64).cos().powi(2)).sum();
            let found = squares(&differences, &other);
            assert!(
                (found - 2.0 * size).abs() < 1e-9,
                "{n} {k}: {found}, {size}"
            );
        }
    }
}

#[test]
fn flat_edges_of_a_regular_point_are_both_second_differences() {
    let mut points = vec![[0.1, 0.2, 0.3], [1.0, 0.3, 0.2], [0.2, 0.9, -0.4]];
    points.extend([[-1.1, 0.0, 0.5], [0.1, -1.0, 0.6]]);
    let second = |a: u32, b: u32| Difference {
        points: vec![(0, -2.0), (a, 1.0), (b, 1.0)],
        at: 0,
        wanted: [0.0; 3],
    };
    let both = squares(&[second(1, 3), second(2, 4)], &points);
    let flat = squares(&from_flat(0, &[1, 2, 3, 4]), &points);
    assert!((both - flat).abs() < 1e-12, "{both} {flat}");
}
