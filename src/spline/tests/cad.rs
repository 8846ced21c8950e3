//! Faces against the limit surface and each other.

use super::super::cad::{Faces, blocks, faces};
use super::super::cage::Cage;
use super::super::evaluator::Evaluator;
use super::super::limit::Limit;
use super::super::subdivide::subdivide;
use super::super::surface::BSplineSurface;
use super::super::tensor::{irregular_corners, place_in};
use super::{cages, distance, noise};
use crate::geometry::mesh::{cross, dot, norm};
use crate::grid::blocks::Block;

type Case = (Cage, Vec<[f64; 3]>);

/// Two cells with corners at all points but one: only a corner is irregular, and blocks are one cell.
fn strip() -> Case {
    let is_corner = (0..6).map(|v| v != 4).collect();
    let cells = vec![[0, 1, 4, 3], [1, 2, 5, 4]];
    let cage = Cage::new(6, cells, |_| false, is_corner).expect("a strip");
    let mut noise = noise(10);
    let point = |v: usize| [(v % 3) as f64 + 0.2 * noise(), (v / 3) as f64, noise()];
    (cage, (0..6).map(point).collect())
}

/// The generated control meshes once and twice divided: no cell has two irregular points.
pub(super) fn divided() -> Vec<Case> {
    let once = |(cage, points): &Case| subdivide(cage, points).expect("divided");
    let first: Vec<Case> = cages().iter().map(once).collect();
    let second: Vec<Case> = first.iter().map(once).collect();
    first.into_iter().chain(second).chain([strip()]).collect()
}

pub(super) fn with_limits(cases: &[Case], check: impl Fn(usize, &Limit<'_>)) {
    for (n, (cage, points)) in cases.iter().enumerate() {
        check(n, &Limit::new(cage, &Evaluator::new(cage), points));
    }
}

fn diagonal(points: &[[f64; 3]]) -> f64 {
    let off = points.iter().map(|&p| distance(p, points[0]));
    off.fold(0.0, f64::max)
}

/// Whether a place of a block lies in the last square of an irregular corner.
pub(super) fn is_last(block: &Block, irregular: [bool; 4], last: f64, [u, v]: [f64; 2]) -> bool {
    let [w, h] = block.cells.map(|n| n as f64);
    let far = [[u, v], [w - u, v], [w - u, h - v], [u, h - v]];
    (0..4).any(|c| irregular[c] && far[c][0] <= last && far[c][1] <= last)
}

/// A surface is the limit surface of its block outside last squares, and at corners.
pub(super) fn check_surface(
    limit: &Limit<'_>,
    block: &Block,
    surface: &BSplineSurface,
    last: f64,
    noise: &mut impl FnMut() -> f64,
) {
    let cage = limit.cage;
    let most = 1e-11 * diagonal(limit.control);
    let corners = irregular_corners(cage, block, &cage.irregular());
    let [w, h] = block.cells.map(|n| n as f64);
    let random = (0..40).map(|_| [w * noise(), h * noise()]);
    let random: Vec<[f64; 2]> = random.collect();
    for at in [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]]
        .into_iter()
        .chain(random)
    {
        let is_corner = (at[0] == 0.0 || at[0] == w) && (at[1] == 0.0 || at[1] == h);
        if is_corner || !is_last(block, corners, last, at) {
            let (_, cell, place) = place_in(block, at);
            let off = distance(surface.at(at).point, limit.at(cell, place).point);
            assert!(off < most, "{off} at {at:?} of {w} by {h}");
        }
    }
}

#[test]
fn faces_are_the_limit_surface() {
    with_limits(&divided(), |_, limit| {
        let faces = faces(limit, 0.01).expect("faces");
        let irregular = limit.cage.irregular();
        let blocks = blocks(limit.cage, &irregular).expect("blocks");
        let cells: usize = blocks.iter().map(|b| b.squares.len()).sum();
        assert_eq!(
            [blocks.len(), cells],
            [faces.shell.faces.len(), limit.cage.cells.len()]
        );
        let last = 0.5f64.powi(faces.halvings as i32);
        assert!(last <= 0.5 || !irregular.contains(&true));
        let mut noise = noise(11);
        for (block, face) in blocks.iter().zip(&faces.shell.faces) {
            check_surface(limit, block, &face.surface, last, &mut noise);
        }
    });
}

/// Border edges of each edge: face and number there.
fn uses(faces: &Faces) -> Vec<Vec<(usize, usize)>> {
    let mut uses = vec![Vec::new(); faces.shell.edges.len()];
    for (f, face) in faces.shell.faces.iter().enumerate() {
        for (i, &(edge, _)) in face.border.iter().enumerate() {
            uses[edge as usize].push((f, i));
        }
    }
    uses
}

/// Where part t of a border edge is on its face.
fn on_border(faces: &Faces, (f, i): (usize, usize), t: f64) -> [f64; 2] {
    let [from, to] = faces.shell.faces[f].places[i];
    [0, 1].map(|axis| from[axis] + t * (to[axis] - from[axis]))
}

#[test]
fn faces_meet_at_edges() {
    with_limits(&divided(), |n, limit| {
        let faces = faces(limit, 0.01).expect("faces");
        let irregular = limit.cage.irregular();
        let blocks = blocks(limit.cage, &irregular).expect("blocks");
        let most = 1e-11 * diagonal(limit.control);
        let last = 0.5f64.powi(faces.halvings as i32);
        let mut noise = noise(12);
        for (edge, uses) in uses(&faces).iter().enumerate() {
            let curve = &faces.shell.edges[edge].curve;
            let length = curve.knots[curve.knots.len() - 1] - curve.knots[0];
            let near = last * noise() / length;
            for t in [0.0, near, 1.0 - near, noise(), noise(), noise(), 1.0] {
                let jets: Vec<_> = uses
                    .iter()
                    .map(|&(f, i)| {
                        let is_forward = faces.shell.faces[f].border[i].1;
                        let at = on_border(&faces, (f, i), if is_forward { t } else { 1.0 - t });
                        (f, at, faces.shell.faces[f].surface.at(at))
                    })
                    .collect();
                let on = curve.at(curve.knots[0] + t * length)[0];
                for (f, at, jet) in &jets {
                    let off = distance(jet.point, on);
                    assert!(off < most, "cage {n} edge {edge} face {f} at {at:?}: {off}");
                }
                let [(f, at, a), (_, _, b)] = &jets[..] else {
                    continue;
                };
                let corners = irregular_corners(limit.cage, &blocks[*f], &irregular);
                if faces.is_crease[edge] || is_last(&blocks[*f], corners, last, *at) {
                    continue;
                }
                let [a, b] = [a, b].map(|jet| cross(jet.tangent[0], jet.tangent[1]));
                let turn = norm(cross(a, b)).atan2(dot(a, b));
                assert!(
                    turn < 1e-6,
                    "cage {n} edge {edge} face {f} at {at:?}: {turn}"
                );
            }
        }
    });
}

#[test]
fn shells_are_whole() {
    with_limits(&divided(), |n, limit| {
        let cage = limit.cage;
        let faces = faces(limit, 0.01).expect("faces");
        let shell = &faces.shell;
        let is_closed = cage.across.iter().flatten().all(Option::is_some);
        assert_eq!(shell.is_closed, is_closed);
        for (edge, uses) in uses(&faces).iter().enumerate() {
            let ways: Vec<bool> = uses
                .iter()
                .map(|&(f, i)| shell.faces[f].border[i].1)
                .collect();
            match ways[..] {
                [a, b] => assert!(a != b, "cage {n} edge {edge}"),
                _ => assert!(ways.len() == 1 && !is_closed, "cage {n} edge {edge}"),
            }
            let curve = &shell.edges[edge].curve;
            let ends = shell.edges[edge].ends.map(|v| shell.vertices[v as usize]);
            assert_eq!(
                ends,
                [curve.control[0], curve.control[curve.control.len() - 1]]
            );
        }
        for face in &shell.faces {
            let end = |(edge, is_forward): (u32, bool), last: bool| {
                shell.edges[edge as usize].ends[usize::from(is_forward == last)]
            };
            for (i, &edge) in face.border.iter().enumerate() {
                let next = face.border[(i + 1) % face.border.len()];
                assert_eq!(end(edge, true), end(next, false), "cage {n}");
            }
            let corners = [0, 1].map(|side| face.surface.side(2 * side).control);
            for corner in corners.iter().flat_map(|c| [c[0], c[c.len() - 1]]) {
                assert!(shell.vertices.contains(&corner));
            }
        }
        let euler = |v: usize, e: usize, f: usize| v as i64 - e as i64 + f as i64;
        let points = cage.leaving().iter().flatten().count();
        assert_eq!(
            euler(shell.vertices.len(), shell.edges.len(), shell.faces.len()),
            euler(points, cage.edges().count(), cage.cells.len()),
            "cage {n}"
        );
    });
}
