use super::super::cage::CellSide;
use super::super::evaluator::Evaluator;
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

#[test]
fn sheets_fold_where_a_point_is_moved_across_others() {
    let (cage, points) = sheet(6, |_| false);
    let evaluator = Evaluator::new(&cage);
    let middle = 3 * 7 + 3;
    let moved = |by: f64| {
        let mut control = points.clone();
        control[middle][0] += by;
        let limit = Limit::new(&cage, &evaluator, &control);
        let (shape, folded) = (measure::shape(&limit), folded(&limit));
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
fn steps_are_shortened_where_cells_would_fold_and_nowhere_else() {
    let (cage, points) = sheet(9, |_| false);
    let evaluator = Evaluator::new(&cage);
    let mut equations = Equations::new(&cage, &evaluator, &points, 1_000_000).unwrap();
    // A corner of the sheet moves a little, a point inside across others.
    let (inside, corner) = (5 * 10 + 5, 0);
    let mut wanted = points.clone();
    wanted[inside][0] += 3.0;
    wanted[corner][2] += 0.5;
    assert!(Folds::of(&equations, &wanted).any());
    let none = Folds::none(&cage);
    let (found, folds) = shortened(&mut equations, &points, &wanted, &none);
    assert!(!folds.any() && !Folds::of(&equations, &found).any());
    assert_eq!(found[corner], wanted[corner]);
    let part = (found[inside][0] - points[inside][0]) / 3.0;
    assert!(0.0 < part && part <= 0.5, "{part}");
    assert!(equations.fairness[inside] > 2.0 && equations.fairness[corner] < 1.1);
    // What folds already may go all the way.
    let given = Folds::of(&equations, &wanted);
    let (found, folds) = shortened(&mut equations, &points, &wanted, &given);
    assert_eq!(found, wanted);
    assert_eq!(folds.cells, given.cells);
}

#[test]
fn fairness_unfolds_what_samples_fold() {
    let (cage, points) = sheet(6, |_| false);
    let evaluator = Evaluator::new(&cage);
    let limit = Limit::new(&cage, &evaluator, &points);
    // Samples of two places are each where the other should be.
    let places = (0..36u32).flat_map(|cell| (0..9).map(move |i| (cell, [i % 3, i / 3])));
    let samples: Vec<Sample> = places
        .map(|(cell, place)| {
            let at = place.map(|x| (f64::from(x) + 0.5) / 3.0);
            let from = match cell {
                14 => 21,
                21 => 14,
                other => other,
            };
            let (point, normal) = limit.normal(from, at);
            Sample {
                point,
                normal,
                area: 1.0,
                weight: 1.0,
                cell,
                at,
                border: None,
            }
        })
        .collect();
    let mut equations = Equations::new(&cage, &evaluator, &points, 1_000_000).unwrap();
    let folded = equations.solve(&samples).unwrap();
    let folds = Folds::of(&equations, &folded);
    assert!(folds.any());
    let found = unfolded(&mut equations, &folds, &samples).unwrap();
    assert!(!Folds::of(&equations, &found.unwrap()).any());
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
        measure::shape(&Limit::new(&cage, &evaluator, &points)).turned_over
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
