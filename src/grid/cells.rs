//! Cells that fold where their edges are drawn straight, unfolded.
//!
//! *Enters:* a relaxed [`GridMap`] and the quad mesh. *Leaves:* the same with moved vertices about cells of which a corner looks away from the surface, or nearly. *Guaranteed:* no face is turned over, or comes below a twentieth of its area; cones stay, lines stay on their lattice lines; the energy of
//! these cells is no greater than before. *Not guaranteed:* that none folds: where the surface bends within a cell, or about cones that are nearer than a cell, there may be no such place.
//!
//! The energy of a map knows faces, not cells: across a ridge, or beside three edges that meet, a cell without distortion on the surface may fold in space. That of a corner with edges a and b, of which h = n · (a × b) with the normal n of the
//! surface, is (|a|² + |b|²) / 2h, its condition number (Knupp 2001), and a share of h/s² + s²/h for cells of side s. It is convex in a, b and h together; the Hessian leaves out that of h (Gauss, Newton). h is bent away from 0 so that
//! corners turned over have an energy too (Garanzha et al. 2021). A step moves points in tangent planes; the map follows it, bilinear in every square, and points are located anew.
//!
//! Moving all points, not only those near such corners, makes angles a degree better, and the distance to the source up to a quarter greater, since lines leave the ridges that the field has put them on.

use super::density::Units;
use super::error::GridError;
use super::map::{Corners, GridMap, Turning};
use super::quads::QuadMesh;
use super::spots::{Spot, locate, normals};
use super::squares::Squares;
use super::system::{Derivatives, Equations};
use super::triangle::double_area;
use crate::geometry::ids::{FaceId, FaceVec, VertexId};
use crate::geometry::mesh::{cross, dot, norm, sub, triangle_area};
use crate::observe::part;
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Share of the size of cells in the energy.
const SIZE: f64 = 0.3;
/// Part of a cell's area below which h is bent.
const BENT: f64 = 0.2;
/// Sine of a corner, seen along the normal of the surface, below which its cell is to be mended.
const LEAST_SINE: f64 = 0.2;
/// Points that may move are within so many cells of such corners.
const RINGS: usize = 3;
/// Most steps.
const MOST_STEPS: usize = 15;
/// It ends where a step lowers the energy by less than this part.
const LEAST_GAIN: f64 = 1e-3;
/// Cells that a point moves at most in a step.
const REACH: f64 = 0.4;
const MOST_HALVINGS: usize = 12;
/// Part of its area on the grid that a face keeps in a step, …
const KEPT: f64 = 0.1;
/// … and of its area on the surface that it keeps in all, unless it had less: what lies in a crevice that a cell passes over is on the grid all the same.
const LEAST_AREA: f64 = 0.05;
/// Vertices or faces that a piece of work has at least.
const PIECE: usize = 1024;

/// A corner of a cell: the point there, the next and the previous.
fn corner(q: &[u32; 4], k: usize) -> [u32; 3] {
    [q[k], q[(k + 1) % 4], q[(k + 3) % 4]]
}

/// All corners of cells.
fn corners(quads: &[[u32; 4]]) -> impl Iterator<Item = [u32; 3]> {
    quads.iter().flat_map(|q| (0..4).map(|k| corner(q, k)))
}

/// Points near corners of cells that are turned over or nearly.
fn near_bad_corners(mesh: &QuadMesh, spots: &[Spot]) -> Vec<bool> {
    let mut near = vec![false; spots.len()];
    for points in corners(&mesh.quads) {
        let [a, b] = shape(spots, points, &|_| [0.0; 2]).edges;
        let own = &spots[points[0] as usize];
        let sine = dot(own.normal, cross(a, b)) / (norm(a) * norm(b));
        near[points[0] as usize] |= sine.is_nan() || sine < LEAST_SINE;
    }
    for _ in 0..RINGS {
        let last = near.clone();
        for q in mesh
            .quads
            .iter()
            .filter(|q| q.iter().any(|&i| last[i as usize]))
        {
            q.iter().for_each(|&i| near[i as usize] = true);
        }
    }
    near
}

/// Edges of a corner, and its h with the derivative of h by n · (a × b).
struct Shape {
    edges: [[f64; 3]; 2],
    area: f64,
    h: f64,
    slope: f64,
}

impl Shape {
    fn new(edges: [[f64; 3]; 2], normal: [f64; 3], size: f64) -> Self {
        let d = dot(normal, cross(edges[0], edges[1]));
        let root = d.hypot(BENT * size * size);
        Self {
            edges,
            area: size * size,
            // The same as (d + root) / 2 without cancellation.
            h: match d > 0.0 {
                true => 0.5 * (d + root),
                false => 0.5 * (BENT * size * size).powi(2) / (root - d),
            },
            slope: 0.5 * (1.0 + d / root),
        }
    }

    fn squared(&self) -> f64 {
        self.edges.iter().map(|e| dot(*e, *e)).sum()
    }

    /// 0 for a square.
    fn energy(&self) -> f64 {
        let (h, area) = (self.h, self.area);
        self.squared() / (2.0 * h) - 1.0 + 0.5 * SIZE * (h / area + area / h - 2.0)
    }

    /// Gradient and Hessian by both edges.
    fn derivatives(&self, normal: [f64; 3]) -> Derivatives {
        let (h, area, [a, b]) = (self.h, self.area, self.edges);
        let by_h = -self.squared() / (2.0 * h * h) + 0.5 * SIZE * (1.0 / area - area / (h * h));
        let twice = (self.squared() + SIZE * area) / (h * h * h);
        let of_h = [cross(b, normal), cross(normal, a)];
        let joined = |x: [[f64; 3]; 2]| -> [f64; 6] { std::array::from_fn(|i| x[i / 3][i % 3]) };
        let (edge, of_h) = (joined([a, b]), joined(of_h).map(|x| self.slope * x));
        let gradient = std::array::from_fn(|i| edge[i] / h + by_h * of_h[i]);
        let hessian = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let mixed = (edge[i] * of_h[j] + of_h[i] * edge[j]) / (h * h);
                f64::from(u8::from(i == j)) / h - mixed + twice * of_h[i] * of_h[j]
            })
        });
        (gradient, hessian)
    }
}

/// The corner whose points have moved by steps.
fn shape(spots: &[Spot], points: [u32; 3], step: &dyn Fn(u32) -> [f64; 2]) -> Shape {
    let at = points.map(|i| {
        let (spot, [x, y]) = (&spots[i as usize], step(i));
        let [u, v] = spot.tangent;
        std::array::from_fn(|k| spot.position[k] + x * u[k] + y * v[k])
    });
    let own = &spots[points[0] as usize];
    Shape::new([sub(at[1], at[0]), sub(at[2], at[0])], own.normal, own.size)
}

fn energy(cells: &[[u32; 4]], spots: &[Spot], step: &dyn Fn(u32) -> [f64; 2]) -> f64 {
    let of_corner = corners(cells).map(|points| shape(spots, points, step).energy());
    of_corner.sum()
}

/// Derivatives of a corner by the coordinates of its three points.
fn derivatives(spots: &[Spot], points: [u32; 3]) -> Derivatives {
    let (gradient, hessian) =
        shape(spots, points, &|_| [0.0; 2]).derivatives(spots[points[0] as usize].normal);
    // Change of both edges by every coordinate.
    let change: [[f64; 6]; 6] = std::array::from_fn(|i| {
        let (p, axis) = (i / 2, i % 2);
        let t = spots[points[p] as usize].tangent[axis];
        std::array::from_fn(|k| match (p, k / 3) {
            (0, _) => -t[k % 3],
            (1, 0) | (2, 1) => t[k % 3],
            _ => 0.0,
        })
    });
    let product = |x: &[f64; 6], y: &[f64; 6]| (0..6).map(|k| x[k] * y[k]).sum::<f64>();
    let turned = change.map(|c| hessian.map(|row| product(&row, &c)));
    (
        change.map(|c| product(&c, &gradient)),
        change.map(|c| turned.map(|t| product(&c, &t))),
    )
}

/// Moves vertices; see the module docs. Those that moved.
pub(super) fn unfold(
    map: &mut GridMap,
    mesh: &QuadMesh,
    unit: &Units,
) -> Result<BTreeSet<VertexId>, GridError> {
    let _part = part!("unfold cells");
    let mut unfolded = BTreeSet::new();
    let normals = normals(map);
    let Some((mut squares, mut spots)) = locate(map, mesh, &normals, unit) else {
        return Ok(unfolded);
    };
    let near = near_bad_corners(mesh, &spots);
    let is_near = |q: &[u32; 4]| q.iter().any(|&i| near[i as usize]);
    let cells: Vec<[u32; 4]> = mesh.quads.iter().copied().filter(is_near).collect();
    if cells.is_empty() {
        return Ok(unfolded);
    }
    let seen_from = Corners::new(map);
    let least = least_areas(map, &seen_from, unit);
    let mut equations = Equations::new(corners(&cells), &near)?;
    let mut before = energy(&cells, &spots, &|_| [0.0; 2]);
    for steps in 0..MOST_STEPS {
        let of_corner = |i: usize| derivatives(&spots, corner(&cells[i / 4], i % 4));
        equations.sum(of_corner, |p| spots[p].is_free);
        let (mut step, _) = equations.newton_step()?;
        for [x, y] in &mut step {
            let by = (REACH / x.hypot(*y)).min(1.0);
            (*x, *y) = (by * *x, by * *y);
        }
        let mut length = 1.0;
        for _ in 0..MOST_HALVINGS {
            let part = |i: u32| step[i as usize].map(|x| length * x);
            if energy(&cells, &spots, &part) < before {
                break;
            }
            length *= 0.5;
        }
        let vertices = map.sheet.fine.connectivity.vertices();
        let places: Vec<[f64; 2]> = vertices.map(|v| map.place(v)).collect();
        let step = follow(map, mesh, &squares, &spots, &step);
        let moved = without_harm(map, &seen_from, &least, &places, &step, length);
        let before_step = map.anchors.clone();
        let mut turning = Turning::new(map);
        turning.see(&seen_from, &moved);
        turning.put(map, &seen_from, &moved);
        let found = locate(map, mesh, &normals, unit);
        let there = found.as_ref().map_or(f64::INFINITY, |(_, spots)| {
            energy(&cells, spots, &|_| [0.0; 2])
        });
        tracing::trace!(steps, energy = there, length, cells = cells.len(), "cells");
        match found {
            Some(found) if there <= before => {
                (squares, spots) = found;
                let vertices = map.sheet.fine.connectivity.vertices().zip(&step);
                unfolded.extend(vertices.filter(|(_, s)| **s != [0.0; 2]).map(|(v, _)| v));
            }
            _ => {
                map.anchors = before_step;
                seen_from.put(map, &places);
                return Ok(unfolded);
            }
        }
        if there > before * (1.0 - LEAST_GAIN) {
            return Ok(unfolded);
        }
        before = there;
    }
    Ok(unfolded)
}

/// Twice the area on the grid below which no face shall come.
fn least_areas(map: &GridMap, seen_from: &Corners, unit: &Units) -> FaceVec<f64> {
    let (fine, vertices) = (&map.sheet.fine, map.sheet.fine.connectivity.vertices());
    let places: Vec<[f64; 2]> = vertices.map(|v| map.place(v)).collect();
    let of_face = |f: FaceId| {
        let corners = fine.connectivity.face_vertices(f).map(|v| fine.position[v]);
        let size = unit.of(fine.parent[f]);
        let natural = 2.0 * triangle_area(corners) / (size * size);
        let now = double_area(seen_from.corners(f, &places));
        (LEAST_AREA * natural).min(now)
    };
    fine.connectivity.faces().map(of_face).collect()
}

/// Places of vertices after a step, shorter where a face would lose its area; `least` is twice what it must have.
fn without_harm(
    map: &GridMap,
    seen_from: &Corners,
    least: &FaceVec<f64>,
    places: &[[f64; 2]],
    step: &[[f64; 2]],
    length: f64,
) -> Vec<[f64; 2]> {
    let mut moved: Vec<[f64; 2]> = places
        .iter()
        .zip(step)
        .map(|([x, y], [dx, dy])| [x + length * dx, y + length * dy])
        .collect();
    let harmed = |f: FaceId, moved: &[[f64; 2]]| {
        let [old, new] = [places, moved].map(|p| double_area(seen_from.corners(f, p)));
        !(new >= (KEPT * old).max(least[f]) && new > 0.0)
    };
    let c = &map.sheet.fine.connectivity;
    let all: Vec<FaceId> = c.faces().collect();
    let all = all.into_par_iter().with_min_len(PIECE);
    let mut faces: BTreeSet<FaceId> = all.filter(|&f| harmed(f, &moved)).collect();
    for k in 1.. {
        if faces.is_empty() {
            break;
        }
        let vertices: BTreeSet<VertexId> = faces.iter().flat_map(|&f| c.face_vertices(f)).collect();
        for &v in &vertices {
            let (place, i) = (places[v.index()], v.index());
            // In the end it stays.
            moved[i] = match k < MOST_HALVINGS {
                true => [0, 1].map(|a| 0.5 * (place[a] + moved[i][a])),
                false => place,
            };
        }
        let around = vertices.iter().flat_map(|&v| c.outgoing(v));
        faces = around
            .map(|h| c.face(h))
            .filter(|&f| harmed(f, &moved))
            .collect();
    }
    moved
}

/// How vertices move so that points of the surface `step` away come to lie on the points of the quad mesh.
fn follow(
    map: &GridMap,
    mesh: &QuadMesh,
    squares: &Squares,
    spots: &[Spot],
    step: &[[f64; 2]],
) -> Vec<[f64; 2]> {
    // Of every corner of every square: quarter turns from the square in which its point was found.
    let mut turns = vec![[0u8; 4]; mesh.quads.len()];
    for spot in spots {
        for out in mesh.around(spot.corner).iter().filter(|o| !o.is_backwards) {
            let (q, k) = out.edge;
            let by = i32::from(k) - i32::from(spot.corner.1) - out.turns;
            turns[q as usize][usize::from(k)] = by.rem_euclid(4) as u8;
        }
    }
    let c = &map.sheet.fine.connectivity;
    let vertices: Vec<_> = c.vertices().collect();
    let of_vertex = vertices.into_par_iter().with_min_len(PIECE).map(|v| {
        let free = map.freedom[v].axes();
        if free == [false; 2] {
            return [0.0; 2];
        }
        let place = map.place(v);
        let seen = squares.at(c.face(c.vertex_halfedge(v)), place);
        let [s, t]: [f64; 2] =
            std::array::from_fn(|i| (place[i] - seen.at[i] as f64).clamp(0.0, 1.0));
        let weights = [(1.0 - s) * (1.0 - t), s * (1.0 - t), s * t, (1.0 - s) * t];
        let mut sum = [0.0; 2];
        for (k, weight) in weights.into_iter().enumerate() {
            let k = (usize::from(seen.corner) + k) % 4;
            let point = mesh.quads[seen.square as usize][k];
            let own = turns[seen.square as usize][k];
            let [x, y] = super::complex::turned(step[point as usize], own + 4 - seen.corner);
            sum = [sum[0] - weight * x, sum[1] - weight * y];
        }
        [0, 1].map(|a| if free[a] { sum[a] } else { 0.0 })
    });
    of_vertex.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const NORMAL: [f64; 3] = [0.0, 0.6, 0.8];

    fn shape_of(x: [f64; 6]) -> Shape {
        let [a, b] = [0, 3].map(|i| [x[i], x[i + 1], x[i + 2]]);
        Shape::new([a, b], NORMAL, 1.1)
    }

    #[test]
    fn a_square_has_hardly_any_energy_and_a_fold_much() {
        let (a, b) = ([2.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
        let up = [0.0, 0.0, 1.0];
        let square = Shape::new([a, b], up, 2.0).energy();
        assert!(square.abs() < 0.02, "{square}");
        let folded = Shape::new([b, a], up, 2.0).energy();
        assert!(folded.is_finite() && folded > 100.0, "{folded}");
    }

    #[test]
    fn derivatives_are_those_of_the_energy() {
        for x in [
            [1.0, 0.2, -0.3, 0.1, 0.9, 0.4],
            [1.0, 0.1, -0.1, -0.4, -0.2, 0.3],
        ] {
            let (gradient, hessian) = shape_of(x).derivatives(NORMAL);
            for i in 0..6 {
                let [up, down] = [1e-6, -1e-6].map(|h| {
                    let mut x = x;
                    x[i] += h;
                    shape_of(x).energy()
                });
                let slope = (up - down) / 2e-6;
                assert!(
                    (gradient[i] - slope).abs() < 1e-5 * (1.0 + slope.abs()),
                    "{i}"
                );
            }
            // No direction in which it bends down.
            for i in 0..6 {
                for j in 0..6 {
                    let own = hessian[i][i] * hessian[j][j];
                    assert!(hessian[i][j].powi(2) <= own * (1.0 + 1e-12), "{i} {j}");
                    let apart = (hessian[i][j] - hessian[j][i]).abs();
                    assert!(apart <= 1e-12 * own.sqrt());
                }
            }
        }
    }
}
