//! Surfaces through samples of known ones, on few patches whose interfaces are written by hand.

mod basis;
mod division;
mod refusals;

use super::*;
use crate::export::gismo;
use crate::geometry::deviation::Triangles;
use crate::geometry::mesh::distance;
use std::f64::consts::FRAC_PI_2;

/// Samples of a function of the unit square.
fn sampled(samples: [usize; 2], f: impl Fn(f64, f64) -> [f64; 3]) -> Grid {
    let [columns, rows] = samples;
    let points = (0..rows).flat_map(|k| (0..columns).map(move |i| (i, k)));
    Grid {
        part: Part {
            block: 0,
            first: [0; 2],
            cells: [1; 2],
        },
        samples,
        points: points
            .map(|(i, k)| f(parameter(i, columns), parameter(k, rows)))
            .collect(),
    }
}

/// Two whole sides that are one curve; the flag says whether their parameters agree.
fn interface(first: (usize, Side), second: (usize, Side), forward: bool) -> Interface {
    let [first, second] = [first, second].map(|(patch, side)| PatchSide { patch, side });
    Interface {
        first,
        second,
        reversed: !forward,
    }
}

/// One patch whose sides are all on the boundary.
fn alone(grid: Grid) -> Grids {
    Grids {
        patches: vec![grid],
        interfaces: Vec::new(),
    }
}

/// A surface of degree 3 in both parameters.
fn bicubic(u: f64, v: f64) -> [f64; 3] {
    [
        u - 0.4 * u * u * v.powi(3) + 0.1 * v,
        v + 0.3 * u.powi(3) * v - 2.0,
        u.powi(3) * v.powi(3) - u * v * v + 0.2,
    ]
}

fn wavy(u: f64, v: f64) -> [f64; 3] {
    let (x, y) = (u + 0.1 * (3.0 * v).sin(), v + 0.2 * (2.0 * u).cos());
    [x, y, (2.0 * x).sin() * (1.7 * y + 0.3).cos()]
}

#[test]
fn polynomials_come_back() {
    for samples in [[4, 4], [8, 33], [41, 12]] {
        let grids = alone(sampled(samples, bicubic));
        let fitted = fit(&grids, 2.0).expect("fits");
        for k in 0..=30 {
            for i in 0..=30 {
                let (u, v) = (f64::from(i) / 30.0, f64::from(k) / 30.0);
                let jet = fitted.patches[0].at([u, v]);
                assert!(distance(jet.point, bicubic(u, v)) < 1e-12);
                let h = 1e-6;
                let (a, b) = (bicubic(u + h, v), bicubic(u - h, v));
                let slope = std::array::from_fn(|c| (a[c] - b[c]) / (2.0 * h));
                assert!(distance(jet.tangent[0], slope) < 1e-8);
                let (a, b) = (bicubic(u, v + h), bicubic(u, v - h));
                let slope = std::array::from_fn(|c| (a[c] - b[c]) / (2.0 * h));
                assert!(distance(jet.tangent[1], slope) < 1e-8);
            }
        }
    }
}

/// Half the interval, a sixteenth of the error.
#[test]
fn the_order_is_four() {
    let errors: Vec<f64> = [17, 33, 65, 129]
        .into_iter()
        .map(|n| {
            let fitted = fit(&alone(sampled([n, n], wavy)), 4.0).expect("fits");
            let places =
                (0..1600).map(|i| [f64::from(i % 40), f64::from(i / 40)].map(|x| x / 39.0));
            let squares = places
                .map(|[u, v]| distance(fitted.patches[0].at([u, v]).point, wavy(u, v)).powi(2));
            (squares.sum::<f64>() / 1600.0).sqrt()
        })
        .collect();
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((3.7..4.6).contains(&order), "{errors:?}");
    }
}

/// The unit square beside side `k` of the first, turned by `turns` quarters: its parameters to those of the first.
fn beside(k: Side, turns: usize, [u, v]: [f64; 2]) -> [f64; 2] {
    let mut p = [u - 0.5, v - 0.5];
    for _ in 0..turns {
        p = [-p[1], p[0]];
    }
    let centre = match k {
        Side::West => [-0.5, 0.5],
        Side::East => [1.5, 0.5],
        Side::South => [0.5, -0.5],
        Side::North => [0.5, 1.5],
    };
    [centre[0] + p[0], centre[1] + p[1]]
}

/// The side of the second square that is the first one's, and whether their parameters agree.
fn touching(k: Side, turns: usize) -> (Side, bool) {
    let is_same = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs() + (a[1] - b[1]).abs() < 1e-12;
    for other in Side::ALL {
        let at = |t: f64| beside(k, turns, other.at(t));
        for forward in [true, false] {
            let own = |t: f64| k.at(if forward { t } else { 1.0 - t });
            if is_same(at(0.1), own(0.1)) && is_same(at(0.8), own(0.8)) {
                return (other, forward);
            }
        }
    }
    panic!("{k:?} {turns}");
}

/// Two pieces of one smooth surface in every position to each other.
#[test]
fn neighbours_share_their_sides_however_they_are_turned() {
    for k in Side::ALL {
        for turns in 0..4 {
            let (m, forward) = touching(k, turns);
            let second = |u: f64, v: f64| {
                let [u, v] = beside(k, turns, [u, v]);
                wavy(u, v)
            };
            let samples = if k.along() == m.along() {
                [21, 30]
            } else {
                [30, 21]
            };
            let grids = Grids {
                patches: vec![sampled([21, 30], wavy), sampled(samples, second)],
                interfaces: vec![interface((1, m), (0, k), forward)],
            };
            let fitted = fit(&grids, 4.0).expect("fits");
            let own = fitted.patches[0].side(k);
            let mut across = fitted.patches[1].side(m);
            if !forward {
                across.reverse();
            }
            assert_eq!(own, across, "{k:?} {turns}");
            let sizes = fitted.patches.iter().map(|s| s.size()[0] * s.size()[1]);
            assert_eq!(fitted.control_points, sizes.sum::<usize>() - own.len());
            assert_eq!(fitted.neighbours.corners, 6);
            assert_eq!(fitted.neighbours.boundary.len(), 6);
            // A smooth surface has one normal on both sides, about.
            let plane = [[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 9.0, 0.0]];
            let mesh = Triangles {
                positions: &plane,
                faces: &[[0, 1, 2]],
            };
            let measured = measure(&grids, &fitted, mesh).expect("measured");
            assert!(measured.all_seams.gap < 1e-14);
            assert!(measured.all_seams.max_normal_angle < 0.02);
            assert!(measured.all.samples.max < 1e-3);
            file_agrees_with_the_plane(&fitted, k, turns);
        }
    }
}

/// What the file says of directions is what the motion of the plane does to them.
fn file_agrees_with_the_plane(fitted: &Surfaces, k: Side, turns: usize) {
    let mut bytes = Vec::new();
    gismo::write(fitted, &mut bytes).expect("written");
    let text = String::from_utf8(bytes).expect("text");
    let rows = text.split("<interfaces>\n").nth(1).expect("interfaces");
    let row: Vec<usize> = rows
        .lines()
        .next()
        .expect("one")
        .split(' ')
        .map(|n| n.parse().expect("a number"))
        .collect();
    assert_eq!((row[0], row[1], row[2]), (0, k as usize + 1, 1));
    let origin = beside(k, turns, [0.0, 0.0]);
    for (direction, axis) in [[1.0, 0.0], [0.0, 1.0]].into_iter().enumerate() {
        let (across, same) = (row[4 + direction], row[6 + direction]);
        let mut step = [0.0; 2];
        step[across] = if same == 1 { 1.0 } else { -1.0 };
        let end = beside(k, turns, step);
        let turned = [end[0] - origin[0], end[1] - origin[1]];
        assert!(
            (turned[0] - axis[0]).abs() + (turned[1] - axis[1]).abs() < 1e-12,
            "{k:?} {turns} {row:?}"
        );
    }
}

/// A torus that is one surface: all of its corners are one point.
#[test]
fn a_patch_may_meet_itself() {
    let turn = |t: f64| (4.0 * FRAC_PI_2 * t).sin_cos();
    let torus = |u: f64, v: f64| {
        let ((s, c), (z, r)) = (turn(u), turn(v));
        [(2.0 + r) * c, (2.0 + r) * s, z]
    };
    let grids = Grids {
        patches: vec![sampled([40, 30], torus)],
        interfaces: vec![
            interface((0, Side::East), (0, Side::West), true),
            interface((0, Side::South), (0, Side::North), true),
        ],
    };
    let fitted = fit(&grids, 2.0).expect("fits");
    let neighbours = &fitted.neighbours;
    assert_eq!((neighbours.corners, neighbours.interfaces.len()), (1, 2));
    let [columns, rows] = fitted.patches[0].size();
    assert_eq!(fitted.control_points, (columns - 1) * (rows - 1));
}

/// Two squares glued all around, one turned over: as many corners as a square has, and each side meets its mirror image.
#[test]
fn a_closed_surface_of_two_has_four_corners() {
    let bulge = |sign: f64| move |u: f64, v: f64| [u, v, sign * u * v * (1.0 - u) * (1.0 - v)];
    let back = |u: f64, v: f64| bulge(-1.0)(1.0 - u, v);
    let grids = Grids {
        patches: vec![sampled([9, 12], bulge(1.0)), sampled([9, 12], back)],
        interfaces: vec![
            interface((1, Side::North), (0, Side::North), false),
            interface((0, Side::South), (1, Side::South), false),
            interface((0, Side::East), (1, Side::West), true),
            interface((1, Side::East), (0, Side::West), true),
        ],
    };
    let fitted = fit(&grids, 2.0).expect("fits");
    let neighbours = &fitted.neighbours;
    assert_eq!((neighbours.corners, neighbours.interfaces.len()), (4, 4));
    // Numbers run over the corners of the first in order; the other has them mirrored.
    assert_eq!(neighbours.corner, [[0, 1, 2, 3], [1, 0, 3, 2]]);
    let order: Vec<PatchSide> = neighbours.interfaces.iter().map(|i| i.first).collect();
    assert!(order.is_sorted() && order.iter().all(|side| side.patch == 0));
    assert!(neighbours.boundary.is_empty());
}

#[test]
fn distances_and_folds_are_measured() {
    let mesh = [[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 9.0, 0.0]];
    let mesh = Triangles {
        positions: &mesh,
        faces: &[[0, 1, 2]],
    };
    let floor = |u: f64, v: f64| [u, v, 0.25];
    let wall = |u: f64, v: f64| [1.0, v, 0.25 + u];
    let grids = Grids {
        patches: vec![sampled([12, 9], floor), sampled([8, 9], wall)],
        interfaces: vec![interface((0, Side::East), (1, Side::West), true)],
    };
    let fitted = fit(&grids, 3.0).expect("fits");
    let measured = measure(&grids, &fitted, mesh).expect("measured");
    let on_floor = measured.patches[0].surface;
    assert!((on_floor.rms - 0.25).abs() < 1e-12 && (on_floor.max - 0.25).abs() < 1e-12);
    // Middles of 7 cells, the highest half a cell below the top; ∫ (1/4 + x)² from 0 to 1 is 31/48 up to the midpoint rule.
    let on_wall = measured.patches[1].surface;
    assert!((on_wall.max - (1.25 - 0.5 / 7.0)).abs() < 1e-12);
    let exact: f64 = 31.0 / 48.0 - 1.0 / (12.0 * 49.0);
    assert!((on_wall.rms - exact.sqrt()).abs() < 1e-12);
    // Both have area 1.
    let all = (0.5 * (0.0625 + exact)).sqrt();
    assert!((measured.all.surface.rms - all).abs() < 1e-12);
    let seams = measured.all_seams;
    assert!((seams.mean_normal_angle - FRAC_PI_2).abs() < 1e-9);
    assert!((seams.max_normal_angle - FRAC_PI_2).abs() < 1e-9);
    assert!(measured.all.samples.max < 1e-13);
    let nothing = Triangles { faces: &[], ..mesh };
    assert_eq!(measure(&grids, &fitted, nothing), Err(FitError::NoSurface));
}

/// A surface that runs forth, back and forth: x = 10 u³ − 15 u² + 6 u, whose slope is negative for |u − 1/2| < 1/√20.
#[test]
fn what_is_turned_over_is_measured() {
    let grids = alone(sampled([2001, 5], |u, v| [u, v, 0.0]));
    let mut fitted = fit(&grids, 4000.0).expect("fits");
    let mesh = Triangles {
        positions: &[[-9.0, -9.0, 0.0], [9.0, -9.0, 0.0], [0.0, 9.0, 0.0]],
        faces: &[[0, 1, 2]],
    };
    let flat = measure(&grids, &fitted, mesh).expect("measured");
    assert_eq!((flat.all.folded, flat.patches[0].folded), (0.0, 0.0));
    let surface = &mut fitted.patches[0];
    assert_eq!(surface.size(), [4, 4]);
    for row in surface.control.chunks_mut(4) {
        for (control, x) in row.iter_mut().zip([0.0, 2.0, -1.0, 1.0]) {
            control[0] = x;
        }
    }
    let back = 1.0 / 5f64.sqrt();
    let exact = back / (1.0 + 2.0 * back);
    let folded = measure(&grids, &fitted, mesh).expect("measured");
    assert!(
        (folded.all.folded - exact).abs() < 1e-5,
        "{}",
        folded.all.folded
    );
    assert_eq!(folded.all.folded, folded.patches[0].folded);
}

#[test]
fn threads_change_nothing() {
    let grids = alone(sampled([60, 44], wavy));
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads").install(|| fit(&grids, 4.0))
    };
    assert_eq!(run(1), run(3));
}
