//! Patches against the limit surface and each other.

use super::super::cage::{Cage, CellSide};
use super::super::evaluator::Evaluator;
use super::super::limit::Limit;
use super::super::patches::{PatchSide, Patches, blocks, patches};
use super::super::subdivide::subdivide;
use super::super::surface::BSplineSurface;
use super::cad::{check_surface, divided, with_limits};
use super::{cage, noise};
use crate::geometry::mesh::{cross, dot, norm};

/// A cube, divided and projected to a sphere.
fn ball(levels: usize, crease: impl Fn(CellSide) -> bool) -> (Cage, Vec<[f64; 3]>) {
    let corner = |v: usize| [0, 1, 2].map(|i| if v >> i & 1 == 1 { 1.0 } else { -1.0 });
    let cells = vec![
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let cage = Cage::new(8, cells, crease, vec![false; 8]).expect("a cube");
    let mut ball = (cage, (0..8).map(corner).collect::<Vec<[f64; 3]>>());
    for _ in 0..levels {
        ball = subdivide(&ball.0, &ball.1).expect("divided");
        for p in &mut ball.1 {
            *p = p.map(|x| x / norm(*p));
        }
    }
    ball
}

/// A torus of w by h cells without irregular points, each round begun `shift` cells further.
fn torus(w: usize, h: usize, shift: usize) -> (Cage, Vec<[f64; 3]>) {
    let at = |i: usize, j: usize| {
        let moved = if j == h { shift } else { 0 };
        ((j % h) * w + (i + moved) % w) as u32
    };
    let cells = (0..h).flat_map(|j| (0..w).map(move |i| (i, j)));
    let cells = cells.map(|(i, j)| [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
    let cells = cells.collect();
    let turn = |n: usize, of: usize| (n as f64 / of as f64 * std::f64::consts::TAU).sin_cos();
    let points = (0..w * h).map(|v| {
        let ((s, c), (t, d)) = (turn(v % w, w), turn(v / w, h));
        [(3.0 + c) * d, (3.0 + c) * t, s]
    });
    let cage = Cage::new(w * h, cells, |_| false, vec![false; w * h]).expect("a torus");
    (cage, points.collect())
}

/// A strip around an axis: two borders and no irregular point.
fn ring() -> (Cage, Vec<[f64; 3]>) {
    let (torus, points) = torus(9, 4, 0);
    let cells = torus.cells[9..27].to_vec();
    let cage = Cage::new(points.len(), cells, |_| false, vec![false; points.len()]);
    (cage.expect("a ring"), points)
}

/// Control points of a side in the direction of its parameter.
fn side(patches: &Patches, PatchSide { patch, side }: PatchSide) -> Vec<[f64; 3]> {
    let surface = &patches.surfaces[patch as usize];
    let [columns, rows] = surface.size();
    let at = |i: usize, j: usize| surface.control[j * columns + i];
    match side {
        1 => (0..rows).map(|j| at(0, j)).collect(),
        2 => (0..rows).map(|j| at(columns - 1, j)).collect(),
        3 => (0..columns).map(|i| at(i, 0)).collect(),
        _ => (0..columns).map(|i| at(i, rows - 1)).collect(),
    }
}

fn knots(patches: &Patches, PatchSide { patch, side }: PatchSide) -> &[f64] {
    &patches.surfaces[patch as usize].knots[if side < 3 { 1 } else { 0 }]
}

/// Every side is in one interface or on the border; knots and control points along interfaces agree.
fn check_sides(patches: &Patches) {
    let both = |i: &super::super::patches::Interface| [i.first, i.second];
    let mut named: Vec<PatchSide> = patches.interfaces.iter().flat_map(both).collect();
    named.extend(&patches.boundary);
    named.sort_unstable();
    let all = (0..patches.surfaces.len() as u32)
        .flat_map(|patch| [1, 2, 3, 4].map(|side| PatchSide { patch, side }));
    assert_eq!(named, all.collect::<Vec<_>>());
    for interface in &patches.interfaces {
        let [first, second] = both(interface);
        assert_ne!(first.patch, second.patch, "{interface:?}");
        assert_eq!(knots(patches, first), knots(patches, second));
        let mut points = side(patches, second);
        if interface.reversed {
            points.reverse();
        }
        assert_eq!(side(patches, first), points, "{interface:?}");
    }
}

#[test]
fn patches_are_the_limit_surface_and_conform() {
    let mut cases = divided();
    cases.extend([
        ball(2, |_| false),
        ring(),
        torus(5, 4, 0),
        torus(7, 3, 2),
        torus(8, 8, 4),
    ]);
    // Creases of a box's faces, one of which is open to the next.
    cases.push(ball(2, |(c, k)| c == 1 && k != 2));
    with_limits(&cases, |n, limit| {
        let patches = patches(limit).expect("patches");
        check_sides(&patches);
        let is_closed = limit.cage.across.iter().flatten().all(Option::is_some);
        assert_eq!(patches.boundary.is_empty(), is_closed, "cage {n}");
        let blocks = blocks(limit.cage, &limit.cage.irregular())
            .expect("blocks")
            .blocks;
        let cells: usize = blocks.iter().map(|b| b.squares.len()).sum();
        assert_eq!(cells, limit.cage.cells.len());
        let mut noise = noise(16);
        for (block, surface) in blocks.iter().zip(&patches.surfaces) {
            check_surface(limit, block, surface, 0.5, &mut noise);
        }
    });
}

/// The normal of a surface at a place, as long as the Jacobian.
fn normal(surface: &BSplineSurface, at: [f64; 2]) -> [f64; 3] {
    let jet = surface.at(at);
    cross(jet.tangent[0], jet.tangent[1])
}

#[test]
fn patches_of_a_ball_look_outward() {
    let (cage, points) = ball(2, |_| false);
    let evaluator = Evaluator::new(&cage);
    let patches = patches(&Limit::new(&cage, &evaluator, &points)).expect("patches");
    assert_eq!((patches.surfaces.len(), patches.interfaces.len()), (6, 12));
    for surface in &patches.surfaces {
        assert_eq!(surface.size(), [11, 11]);
        for i in 0..=60 {
            for j in 0..=60 {
                let at = [i, j].map(|x| f64::from(x) / 15.0);
                let (point, normal) = (surface.at(at).point, normal(surface, at));
                let cosine = dot(point, normal) / norm(point) / norm(normal);
                assert!(norm(normal) > 0.01 && cosine > 0.99, "{at:?}: {normal:?}");
            }
        }
    }
}

/// There are no T-junctions: a corner is nowhere else a control point of a side.
#[test]
fn corners_of_patches_are_corners_of_all() {
    let (coarse, points) = cage(5, |(c, k)| (c * 7 + u32::from(k)) % 5 == 0, &[1, 20]);
    let (cage, points) = subdivide(&coarse, &points).expect("divided");
    let evaluator = Evaluator::new(&cage);
    let patches = patches(&Limit::new(&cage, &evaluator, &points)).expect("patches");
    let corners = |s: &BSplineSurface| {
        let [c, r] = s.size();
        [0, c - 1, c * (r - 1), c * r - 1].map(|i| s.control[i])
    };
    let all: Vec<[f64; 3]> = patches.surfaces.iter().flat_map(corners).collect();
    for patch in 0..patches.surfaces.len() as u32 {
        for number in 1..=4 {
            let points = side(
                &patches,
                PatchSide {
                    patch,
                    side: number,
                },
            );
            let inner = &points[1..points.len() - 1];
            assert!(inner.iter().all(|p| !all.contains(p)));
        }
    }
}
