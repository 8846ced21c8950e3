use super::cage::{Cage, CellSide, Kind};
use super::evaluator::Evaluator;
use super::limit::Limit;
use super::measure;
use super::subdivide::subdivide;
use super::tessellation::{parts, tessellate, without_plane};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::mesh::{cross, dot, sub};

/// Numbers without pattern between 0 and 1.
fn noise(mut state: u64) -> impl FnMut() -> f64 {
    move || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

const PHI: f64 = 1.618033988749895;

/// An icosahedron with every triangle as three quads: points with 5, 4 and 3 edges; without its first `missing` triangles.
fn icosahedron(missing: usize) -> (Vec<[u32; 4]>, Vec<[f64; 3]>) {
    let p = PHI;
    let mut points = vec![
        [-1.0, p, 0.0],
        [1.0, p, 0.0],
        [-1.0, -p, 0.0],
        [1.0, -p, 0.0],
        [0.0, -1.0, p],
        [0.0, 1.0, p],
        [0.0, -1.0, -p],
        [0.0, 1.0, -p],
        [p, 0.0, -1.0],
        [p, 0.0, 1.0],
        [-p, 0.0, -1.0],
        [-p, 0.0, 1.0],
    ];
    let triangles = [
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    let mut middles: std::collections::HashMap<[usize; 2], u32> = Default::default();
    let mut cells = Vec::new();
    let mut noise = noise(7);
    for t in &triangles[missing..] {
        let mean = |of: &[usize], points: &[[f64; 3]]| -> [f64; 3] {
            std::array::from_fn(|i| of.iter().map(|&v| points[v][i]).sum::<f64>() / of.len() as f64)
        };
        let mut edge = |a: usize, b: usize, points: &mut Vec<[f64; 3]>| {
            *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                points.push(mean(&[a, b], points).map(|x| x + 0.3 * noise()));
                points.len() as u32 - 1
            })
        };
        let e = [
            edge(t[0], t[1], &mut points),
            edge(t[1], t[2], &mut points),
            edge(t[2], t[0], &mut points),
        ];
        points.push(mean(t, &points));
        let m = points.len() as u32 - 1;
        for k in 0..3 {
            cells.push([t[k] as u32, e[k], m, e[(k + 2) % 3]]);
        }
    }
    (cells, points)
}

fn cage(
    missing: usize,
    crease: impl Fn(CellSide) -> bool,
    corners: &[usize],
) -> (Cage, Vec<[f64; 3]>) {
    let (cells, points) = icosahedron(missing);
    let mut is_corner = vec![false; points.len()];
    corners.iter().for_each(|&v| is_corner[v] = true);
    (
        Cage::new(points.len(), cells, crease, is_corner).unwrap(),
        points,
    )
}

/// Closed, open, with creases that end, go through and meet, with corners.
fn cages() -> Vec<(Cage, Vec<[f64; 3]>)> {
    let some = |(c, k): CellSide| (c * 7 + u32::from(k)) % 5 == 0;
    vec![
        cage(0, |_| false, &[]),
        cage(7, |_| false, &[3]),
        cage(0, some, &[]),
        cage(5, some, &[1, 20]),
        cage(0, |side| side == (9, 0) || side == (9, 1), &[]),
    ]
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn subdivided_meshes_have_the_same_surface() {
    for (n, (cage, points)) in cages().into_iter().enumerate() {
        let evaluator = Evaluator::new(&cage);
        let whole = Limit::new(&cage, &evaluator, &points);
        let (fine, fine_points) = subdivide(&cage, &points).unwrap();
        let fine_evaluator = Evaluator::new(&fine);
        let parts = Limit::new(&fine, &fine_evaluator, &fine_points);
        let mut noise = noise(1);
        for c in 0..cage.cells.len() as u32 {
            for k in 0..4u32 {
                for _ in 0..4 {
                    let at = [noise(), noise()];
                    let low = [[0.0, 0.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]][k as usize];
                    let in_whole = [low[0] + at[0] / 2.0, low[1] + at[1] / 2.0];
                    let a = whole.at(c, in_whole);
                    let b = parts.at(4 * c + k, at);
                    assert!(
                        distance(a.point, b.point) < 1e-12,
                        "cage {n} cell {c} {in_whole:?}"
                    );
                    for i in 0..2 {
                        let doubled = b.tangent[i].map(|x| 2.0 * x);
                        assert!(
                            distance(a.tangent[i], doubled) < 1e-9,
                            "cage {n} cell {c} {in_whole:?}"
                        );
                    }
                }
            }
        }
    }
}

/// The surface is the limit of subdivision: control points come to lie on it, nearer at each step; slowest where three cells lie between creases.
#[test]
fn control_points_converge_to_the_surface() {
    for (n, (cage, points)) in cages().into_iter().enumerate() {
        let evaluator = Evaluator::new(&cage);
        let whole = Limit::new(&cage, &evaluator, &points);
        let (mut fine, mut fine_points) = (cage.clone(), points.clone());
        let mut last = f64::INFINITY;
        for level in 1..=5u32 {
            (fine, fine_points) = subdivide(&fine, &fine_points).unwrap();
            let mut worst = 0.0f64;
            for (c, corners) in fine.cells.iter().enumerate() {
                // Where the corner of a cell lies in the coarse one.
                let (mut at, mut cell, mut k) = ([0.0; 2], c, c % 4);
                let corner = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
                at = corner[k].map(|x| x + at[0]);
                for _ in 0..level {
                    k = cell % 4;
                    cell /= 4;
                    at = [0, 1].map(|i| (at[i] + corner[k][i]) / 2.0);
                }
                let on = whole.at(cell as u32, at).point;
                worst = worst.max(distance(on, fine_points[corners[c % 4] as usize]));
            }
            if level > 2 {
                assert!(
                    worst < last / 1.6,
                    "cage {n} level {level}: {worst} after {last}"
                );
            }
            last = worst;
        }
        assert!(last > 1e-6 && last < 1e-2, "{last}");
    }
}

/// Limit positions of smooth points by the formula for any number of edges.
#[test]
fn limits_at_points_are_those_of_the_mask() {
    let (cage, points) = cage(0, |_| false, &[]);
    let evaluator = Evaluator::new(&cage);
    let limit = Limit::new(&cage, &evaluator, &points);
    let corner = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    for (c, corners) in cage.cells.iter().enumerate() {
        for k in 0..4 {
            let star = cage.star((c as u32, k as u8));
            let n = star.len() as f64;
            let mut sum = points[corners[k] as usize].map(|x| n * n * x);
            for (d, l) in star {
                let of =
                    |i: usize| points[cage.cells[d as usize][(usize::from(l) + i) % 4] as usize];
                (0..3).for_each(|x| sum[x] += 4.0 * of(1)[x] + of(2)[x]);
            }
            let wanted = sum.map(|x| x / (n * (n + 5.0)));
            let found = limit.at(c as u32, corner[k]).point;
            assert!(
                distance(found, wanted) < 1e-12,
                "{} edges",
                star_len(&cage, c, k)
            );
        }
    }
}

fn star_len(cage: &Cage, c: usize, k: usize) -> usize {
    cage.star((c as u32, k as u8)).len()
}

#[test]
fn derivatives_are_those_of_differences() {
    for (cage, points) in cages() {
        let evaluator = Evaluator::new(&cage);
        let limit = Limit::new(&cage, &evaluator, &points);
        let mut noise = noise(3);
        for c in 0..cage.cells.len() as u32 {
            let at = [0, 1].map(|_| 0.05 + 0.9 * noise());
            let jet = limit.at(c, at);
            for i in 0..2 {
                let moved = |d: f64| {
                    let mut at = at;
                    at[i] += d;
                    limit.at(c, at).point
                };
                let (a, b) = (moved(1e-6), moved(-1e-6));
                let slope = [0, 1, 2].map(|x| (a[x] - b[x]) / 2e-6);
                assert!(distance(slope, jet.tangent[i]) < 1e-6);
            }
        }
    }
}

/// Both cells at an edge have the same points there, and without a crease the same normals.
#[test]
fn cells_meet() {
    for (cage, points) in cages() {
        let evaluator = Evaluator::new(&cage);
        let limit = Limit::new(&cage, &evaluator, &points);
        let along =
            |k: u8, t: f64| [[t, 0.0], [1.0, t], [1.0 - t, 1.0], [0.0, 1.0 - t]][usize::from(k)];
        let normal = |side: CellSide, t: f64| {
            let [a, b] = limit.at(side.0, along(side.1, t)).tangent;
            let n = [
                a[1] * b[2] - a[2] * b[1],
                a[2] * b[0] - a[0] * b[2],
                a[0] * b[1] - a[1] * b[0],
            ];
            let length = n.iter().map(|x| x * x).sum::<f64>().sqrt();
            n.map(|x| x / length)
        };
        for side in cage.edges() {
            let Some(other) = cage.across[side.0 as usize][usize::from(side.1)] else {
                continue;
            };
            for t in [0.0, 0.001, 0.2, 0.5, 1.0 / 3.0, 0.9, 1.0] {
                let a = limit.at(side.0, along(side.1, t)).point;
                let b = limit.at(other.0, along(other.1, 1.0 - t)).point;
                assert!(distance(a, b) < 1e-12);
                if !cage.is_crease(side) && t > 0.0 && t < 1.0 {
                    assert!(distance(normal(side, t), normal(other, 1.0 - t)) < 1e-9);
                }
            }
        }
    }
}

#[test]
fn weights_sum_to_one() {
    for (cage, _) in cages() {
        let evaluator = Evaluator::new(&cage);
        for c in 0..cage.cells.len() as u32 {
            for at in [[0.0, 0.0], [1.0, 1.0], [0.3, 0.7], [1e-9, 0.0]] {
                let weights = evaluator.weights(c, at);
                assert!((weights.value.iter().sum::<f64>() - 1.0).abs() < 1e-12);
                assert!(
                    weights
                        .derivative
                        .iter()
                        .all(|d| d.iter().sum::<f64>().abs() < 1e-8)
                );
            }
        }
    }
}

#[test]
fn chains_of_creases_have_every_edge_once() {
    for (cage, _) in cages() {
        let inner = cage.edges().filter(|&(c, k)| {
            cage.is_crease((c, k)) && cage.across[c as usize][usize::from(k)].is_some()
        });
        let chains = cage.chains();
        assert_eq!(
            chains.iter().map(|c| c.len() - 1).sum::<usize>(),
            inner.count()
        );
        let kinds = cage.kinds();
        for chain in &chains {
            assert!(
                chain[1..chain.len() - 1]
                    .iter()
                    .all(|&v| kinds[v as usize] == Kind::Crease)
            );
        }
    }
}

mod cad;
mod patches;
mod surface;

/// Points along sides are shared: the triangles are a surface with the topology of the control mesh, at any number of parts.
#[test]
fn triangles_share_their_points() {
    for (cage, points) in cages() {
        let evaluator = Evaluator::new(&cage);
        let limit = Limit::new(&cage, &evaluator, &points);
        for parts in [1, 2, 3, 5, 7] {
            let triangles = tessellate(&limit, parts);
            let cells = cage.cells.len();
            let vertices = cage.leaving().iter().flatten().count() as i64;
            let euler = vertices - cage.edges().count() as i64 + cells as i64;
            let mesh = Connectivity::from_faces(&triangles.faces, triangles.points.len()).unwrap();
            assert_eq!(mesh.topology().euler_characteristic, euler);
            assert_eq!(triangles.faces.len(), 2 * parts * parts * cells);
            for (face, smooth) in triangles.faces.iter().zip(&triangles.smooth_faces) {
                let points = smooth.map(|v| triangles.vertices[v as usize].0);
                assert_eq!(*face, points);
            }
        }
    }
}

/// Where the measure finds no fold, triangles look the way of the normals at their corners; cells share normals but across creases and at points without tangent plane.
#[test]
fn triangles_look_along_normals() {
    let mut whole = 0;
    for (n, (cage, points)) in cages().into_iter().enumerate() {
        let evaluator = Evaluator::new(&cage);
        let limit = Limit::new(&cage, &evaluator, &points);
        let triangles = tessellate(&limit, parts(cage.cells.len()));
        let away = triangles.smooth_faces.iter().filter(|face| {
            let corners = face.map(|v| triangles.vertices[v as usize]);
            let [p, q, r] = corners.map(|(point, _)| triangles.points[point as usize]);
            let own = cross(sub(q, p), sub(r, p));
            corners.iter().any(|(_, normal)| dot(own, *normal) <= 0.0)
        });
        if measure::shape(&limit).turned_over == 0.0 {
            assert_eq!(away.count(), 0, "cage {n}");
            whole += 1;
        }
        let without = without_plane(&cage);
        let count = |v: usize| {
            let sides = (0..cage.cells.len()).flat_map(|c| [0, 1, 2, 3].map(|k| (c, k)));
            let at = sides.filter(|&(c, k)| cage.cells[c][k] as usize == v);
            at.filter(|&(c, k)| without[c][k]).count()
        };
        let corners = cage.is_corner.iter().enumerate().filter(|(_, is)| **is);
        for (v, _) in corners {
            let limit_point = points[v];
            let normals = triangles.vertices.iter();
            let normals = normals
                .filter(|(p, _)| distance(triangles.points[*p as usize], limit_point) < 1e-9);
            assert_eq!(normals.count(), count(v), "cage {n}, corner {v}");
        }
    }
    assert!(whole >= 2, "{whole}");
}
