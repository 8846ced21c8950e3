use super::super::measure;
use super::*;

/// A sheet of n × n cells with sides of length 1.
fn sheet(n: u32, crease: impl Fn(CellSide) -> bool) -> (Cage, Vec<[f64; 3]>) {
    let at = |x: u32, y: u32| y * (n + 1) + x;
    let cells = (0..n * n).map(|c| (c % n, c / n));
    let cells = cells.map(|(x, y)| [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)]);
    let count = (n + 1) * (n + 1);
    let points = (0..count).map(|v| [f64::from(v % (n + 1)), f64::from(v / (n + 1)), 0.0]);
    let none = vec![false; count as usize];
    let cage = Cage::new(count as usize, cells.collect(), crease, none).unwrap();
    (cage, points.collect())
}

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

#[test]
fn sheets_fold_where_a_point_is_moved_across_others() {
    let (cage, points) = sheet(6, |_| false);
    let evaluator = Evaluator::new(&cage);
    let middle = 3 * 7 + 3;
    let moved = |by: f64| {
        let mut control = points.clone();
        control[middle][0] += by;
        let limit = Limit::new(&cage, &evaluator, &control);
        let (shape, folded) = measure::shape(&limit);
        // Signs of Jacobians, much denser.
        let dense = (0..36u32).any(|cell| {
            (0..4096).any(|i| {
                let jet = limit.at(cell, [i % 64, i / 64].map(|x| (f64::from(x) + 0.5) / 64.0));
                jet.tangent[0][0] * jet.tangent[1][1] - jet.tangent[0][1] * jet.tangent[1][0] < 0.0
            })
        });
        assert_eq!(shape.turned_over > 0.0, dense, "{by}");
        assert_eq!(folded.is_empty(), !dense, "{by}");
        dense
    };
    assert!(!moved(0.0) && !moved(0.8));
    assert!(moved(3.0));
}

#[test]
fn a_bend_by_more_than_a_right_angle_within_an_eighth_of_a_cell_counts() {
    // A crease lies between cells, and does not.
    let bent = |is_crease: bool| {
        let (cage, mut points) = sheet(6, |(c, k)| {
            is_crease && ((c % 6 == 2 && k == 1) || (c % 6 == 3 && k == 3))
        });
        // With the crease it is where that is, else it passes the corners of no part of a cell.
        let middle = if is_crease { 3.0 } else { 3.2 };
        for p in &mut points {
            let x = p[0] - middle;
            *p = [0.02 * x, p[1], x.abs()];
        }
        let evaluator = Evaluator::new(&cage);
        measure::shape(&Limit::new(&cage, &evaluator, &points))
            .0
            .turned_over
    };
    assert_eq!(bent(true), 0.0);
    assert!(bent(false) > 0.0);
}

#[test]
fn creases_that_turn_around_one_cell_make_corners() {
    // Around the middle of 2 × 2 cells: to the right and up, and to the right and left.
    let at = |sides: &'static [CellSide]| {
        let (cage, _) = sheet(2, move |side| sides.contains(&side));
        cage.turns()[4]
    };
    assert!(at(&[(3, 0), (1, 2), (3, 3), (2, 1)]));
    assert!(!at(&[(3, 0), (1, 2), (2, 0), (0, 2)]));
    assert!(!at(&[]));
}
