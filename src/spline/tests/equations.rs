use super::super::fit::move_places;
use super::*;

const SIDE: u32 = 5;

/// A closed strip of cells around a wavy tube, open at both ends.
fn tube() -> (Cage, Vec<[f64; 3]>) {
    let around = 7;
    let at = |x: u32, y: u32| y * around + x % around;
    let cells = (0..around * SIDE).map(|c| (c % around, c / around));
    let cells = cells.map(|(x, y)| [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)]);
    let count = around * (SIDE + 1);
    let points = (0..count).map(|v| {
        let (x, y) = (f64::from(v % around), f64::from(v / around));
        let (sin, cos) = (x * std::f64::consts::TAU / f64::from(around)).sin_cos();
        let radius = 2.0 + 0.6 * (1.3 * y + x).sin();
        [radius * cos, radius * sin, 1.5 * y + 0.2 * cos]
    });
    let none = vec![false; count as usize];
    let cage = Cage::new(count as usize, cells.collect(), |_| false, none).unwrap();
    (cage, points.collect())
}

/// Samples of a surface, said to be at places that are off by up to a tenth of a cell.
fn samples(limit: &Limit<'_>) -> Vec<Sample> {
    let parts = 6;
    let all = (0..limit.cage.cells.len() as u32).flat_map(|cell| {
        (0..parts * parts).map(move |i| (cell, [i % parts, i / parts].map(f64::from)))
    });
    all.map(|(cell, place)| {
        let at = place.map(|x| (x + 0.5) / f64::from(parts));
        let wrong = [
            at[0] + 0.4 * (7.0 * at[1]).sin() * at[0] * (1.0 - at[0]),
            at[1],
        ];
        let (point, normal) = limit.normal(cell, at);
        Sample {
            point,
            normal,
            area: 1.0 + at[0],
            weight: 1.0 + at[1],
            cell,
            at: wrong,
            border: None,
        }
    })
    .collect()
}

fn with_samples(test: impl Fn(&Cage, &Evaluator, &[[f64; 3]], Vec<Sample>)) {
    let (cage, points) = tube();
    let evaluator = Evaluator::new(&cage);
    let given = samples(&Limit::new(&cage, &evaluator, &points));
    // What the fit begins with is another tube.
    let other: Vec<[f64; 3]> = points
        .iter()
        .map(|p| [1.2 * p[0], p[1] + 0.3 * p[2].sin(), 1.1 * p[2]])
        .collect();
    test(&cage, &evaluator, &other, given);
}

#[test]
fn a_step_minimises_distances_to_tangent_planes() {
    with_samples(|cage, evaluator, quads, mut samples| {
        let mut equations = Equations::new(cage, evaluator, quads, 1_000_000).unwrap();
        let control = equations.solve(&samples).unwrap();
        let limit = Limit::new(cage, evaluator, &control);
        move_places(&limit, &mut samples);
        let found = equations.step(&limit, &samples, 100).unwrap();
        let beside: Vec<Beside> = samples.iter().map(|s| Beside::new(&limit, s)).collect();
        assert!(beside.iter().any(|b| b.across < 1.0));
        // The sum itself, of surfaces through the same places.
        let fair = FAIR * samples.iter().map(|s| s.area).sum::<f64>() / control.len() as f64;
        let energy = |control: &[[f64; 3]]| -> f64 {
            let moved = Limit::new(cage, evaluator, control);
            let distances = samples.iter().zip(&beside).map(|(s, b)| {
                let off = sub(s.point, moved.at(s.cell, s.at).point);
                let towards = dot(off, b.direction).powi(2);
                s.area * s.weight * (towards + b.across * (dot(off, off) - towards))
            });
            let differences = equations.differences.iter().map(|d| {
                let lacks = sub(d.wanted, d.sum(|v| control[v as usize]));
                fair * equations.fairness[d.at as usize] * dot(lacks, lacks)
            });
            distances.sum::<f64>() + differences.sum::<f64>()
        };
        let slope = |at: &[[f64; 3]], v: usize, c: usize| {
            let moved = |by: f64| {
                let mut moved = at.to_vec();
                moved[v][c] += by;
                energy(&moved)
            };
            (moved(0.01) - moved(-0.01)) / 0.02
        };
        let steepest = |at: &[[f64; 3]]| {
            let all = (0..control.len()).flat_map(|v| (0..3).map(move |c| (v, c)));
            all.map(|(v, c)| slope(at, v, c).abs()).fold(0.0, f64::max)
        };
        let (before, after) = (steepest(&control), steepest(&found));
        assert!(after < 1e-9 * before, "{before} {after}");
    });
}

#[test]
fn five_steps_come_nearer_than_ten_turns_of_places_and_points() {
    let rms = |limit: &Limit<'_>, samples: &[Sample]| {
        let squares = samples.iter().map(|s| {
            let off = sub(limit.at(s.cell, s.at).point, s.point);
            dot(off, off)
        });
        (squares.sum::<f64>() / samples.len() as f64).sqrt()
    };
    with_samples(|cage, evaluator, quads, samples| {
        let reached = |with_steps: bool, rounds: usize| {
            let mut samples = samples.clone();
            let mut equations = Equations::new(cage, evaluator, quads, 1_000_000).unwrap();
            let mut control = equations.solve(&samples).unwrap();
            for _ in 0..rounds {
                let limit = Limit::new(cage, evaluator, &control);
                move_places(&limit, &mut samples);
                control = match with_steps {
                    true => equations.step(&limit, &samples, GRADIENTS).unwrap(),
                    false => equations.solve(&samples).unwrap(),
                };
            }
            let limit = Limit::new(cage, evaluator, &control);
            move_places(&limit, &mut samples);
            rms(&limit, &samples)
        };
        let (steps, turns) = (reached(true, 5), reached(false, 10));
        assert!(steps < turns, "{steps} {turns}");
    });
}

#[test]
fn fairness_counts_more_where_cells_are_no_larger_than_faces() {
    let (cage, points) = tube();
    let evaluator = Evaluator::new(&cage);
    let fairness = |facets: usize| {
        let equations = Equations::new(&cage, &evaluator, &points, facets).unwrap();
        assert!(
            equations
                .fairness
                .iter()
                .all(|&f| f == equations.fairness[0])
        );
        equations.fairness[0]
    };
    let cells = cage.cells.len();
    assert_eq!(fairness(cells), 1.0 + FAIR_WITHIN_FACES);
    assert_eq!(fairness(cells / 5), 1.0 + FAIR_WITHIN_FACES);
    assert!((fairness(10 * cells) - 1.0 - FAIR_WITHIN_FACES / 100.0).abs() < 1e-12);
}

#[test]
fn faces_in_one_plane_are_one_facet() {
    // A strip of four triangles, bent along the edge in its middle.
    let facets = |height: f64| {
        let positions = vec![
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [2.0, 0.0, height],
            [0.0, 1.0, 0.0],
            [1.0, 1.0, 0.0],
            [2.0, 1.0, height],
        ];
        let gridded = super::super::Gridded {
            positions,
            faces: vec![[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]],
            block: Vec::new(),
            uv: Vec::new(),
            points: Vec::new(),
            cells: Vec::new(),
            cell_block: Vec::new(),
            cell_at: Vec::new(),
        };
        gridded.facets()
    };
    assert_eq!(facets(0.0), 1);
    assert_eq!(facets(0.1), 2);
}
