//! Rectangles of small surfaces: common parameters of walls, and maps without folds.

mod clusters;
mod density;
mod drawing;

use super::candidate::{in_cluster_drawing, placed};
use super::flow::Rectangle;
use super::glue::Added;
use super::quads::{Quad, quads, regions_as_quads};
use super::sides::Drawing;
use super::walls::{self, Fractions};
use super::{RectangleError, division, flow, place};
use crate::atlas::cut::cut;
use crate::atlas::plane::{distance, doubled_area};
use crate::flow::prescription::{BoundaryCondition, Prescription};
use crate::geometry::ids::{FaceVec, HalfedgeId, PatchId, VertexId, VertexVec};
use crate::geometry::mesh::Mesh;
use crate::geometry::polycube::{lengths, polycube};
use crate::geometry::subdivision::Subdivision;
use robust::{Coord, orient2d};
use std::collections::BTreeMap;

const TOLERANCE: f64 = 1e-10;

/// Moves vertices so that nothing is symmetric.
fn shaken(mut mesh: Mesh) -> Mesh {
    for (v, p) in mesh.positions.as_mut_slice().iter_mut().enumerate() {
        for (i, x) in p.iter_mut().enumerate() {
            *x += 0.2 * (12.9898 * v as f64 + 78.233 * i as f64).sin();
        }
    }
    mesh
}

/// One patch, slit to cones and borders.
fn undivided(mesh: &Mesh, cones: &[usize]) -> Drawing {
    let c = &mesh.connectivity;
    let mut target = VertexVec::filled(0.0, c.vertex_count());
    for &v in cones {
        target[VertexId::new(v)] = 1.0;
    }
    let prescription = Prescription::new(target, BoundaryCondition::Free);
    let cut = cut(c, &lengths(mesh), &prescription).unwrap();
    let face_patch = FaceVec::filled(PatchId::new(0), c.face_count());
    Drawing::new(mesh, &cut.is_cut, &face_patch).unwrap()
}

fn drawn(mesh: &Mesh, cones: &[usize]) -> (Subdivision, Vec<Quad>) {
    let mut drawing = undivided(mesh, cones);
    division::divide(&mut drawing).unwrap();
    drawing.mark_middles();
    let quads = quads(&mut drawing).unwrap();
    (drawing.fine, quads)
}

/// The same surface in about so many clusters.
fn clustered(mesh: &Mesh, count: usize) -> (Subdivision, Vec<Quad>) {
    let drawing = in_cluster_drawing(mesh, count).unwrap();
    let quads = regions_as_quads(&drawing).unwrap();
    (drawing.fine, quads)
}

fn sphere_mesh() -> Mesh {
    let cubes = (0..64).map(|i| [i % 4, i / 4 % 4, i / 16]);
    shaken(polycube(cubes, |_, _, _| true))
}

fn torus_mesh() -> Mesh {
    let ring = (0..9).filter(|&i| i != 4).map(|i| [i % 3, i / 3, 0]);
    shaken(polycube(ring, |_, _, _| true))
}

fn annulus_mesh() -> Mesh {
    let squares = (0..42).map(|i| [i % 7, i / 7, 0]);
    let squares = squares.filter(|q| ![[3, 2, 0], [3, 3, 0]].contains(q));
    shaken(polycube(squares, |_, axis, sign| axis == 2 && sign == 1))
}

fn sphere() -> (Subdivision, Vec<Quad>) {
    drawn(&sphere_mesh(), &[0, 17, 40])
}

fn torus() -> (Subdivision, Vec<Quad>) {
    drawn(&torus_mesh(), &[])
}

fn annulus() -> (Subdivision, Vec<Quad>) {
    drawn(&annulus_mesh(), &[])
}

fn surfaces() -> [(&'static str, (Subdivision, Vec<Quad>)); 6] {
    [
        ("sphere", sphere()),
        ("torus", torus()),
        ("annulus", annulus()),
        ("sphere in clusters", clustered(&sphere_mesh(), 8)),
        ("torus in clusters", clustered(&torus_mesh(), 8)),
        ("annulus in clusters", clustered(&annulus_mesh(), 5)),
    ]
}

fn flattened(fine: &Subdivision, quads: &[Quad]) -> Vec<Rectangle> {
    let flat = |(i, quad)| flow::flatten(fine, quad, i, TOLERANCE).unwrap();
    let mut rectangles: Vec<Rectangle> = quads.iter().enumerate().map(flat).collect();
    Added::new(fine, &mut rectangles).unwrap();
    rectangles
}

/// Rectangle and side of a piece, and the fractions of the side at its ends.
type Ends = (usize, usize, [Fractions; 2]);

/// The pieces on every wall, in its direction.
fn pieces(
    rectangles: &[Rectangle],
    borders: &[Vec<(usize, Fractions)>],
) -> BTreeMap<HalfedgeId, Vec<Ends>> {
    let mut result: BTreeMap<HalfedgeId, Vec<Ends>> = BTreeMap::new();
    for (i, (rectangle, border)) in rectangles.iter().zip(borders).enumerate() {
        assert_eq!(rectangle.border.len(), border.len());
        for (k, piece) in rectangle.border.iter().enumerate() {
            let (side, from) = border[k];
            let following = border.get(k + 1).filter(|next| next.0 == side);
            let to = following.map_or([1.0, 0.0], |next| next.1);
            let ends = (i, side, [from, to]);
            result.entry(piece.wall).or_default().push(ends);
        }
    }
    result
}

/// What the conformal map of one rectangle says, summed from the first corner of every side.
fn own_fractions(rectangle: &Rectangle) -> Vec<(usize, Fractions)> {
    let c = &rectangle.fine.connectivity;
    let tails = rectangle
        .border
        .iter()
        .map(|piece| c.tail(c.edge_halfedge(piece.edge)));
    let tails: Vec<VertexId> = tails.collect();
    let sides = flow::sides(&tails, &rectangle.corners).unwrap();
    let mut fractions = Vec::new();
    for (k, side) in sides.into_iter().enumerate() {
        let pieces = &rectangle.border[side];
        let whole: f64 = pieces.iter().map(|piece| piece.length).sum();
        let mut before = 0.0;
        for piece in pieces {
            fractions.push((k, [before / whole, 1.0 - before / whole]));
            before += piece.length;
        }
    }
    fractions
}

#[test]
fn both_sides_of_a_wall_have_one_parameter() {
    let (mut to_itself, mut alone) = (0, 0);
    for (name, (fine, quads)) in surfaces() {
        let rectangles = flattened(&fine, &quads);
        let borders = walls::parameters(&fine, &rectangles).unwrap();
        let pieces = pieces(&rectangles, &borders);
        for (&wall, own) in &pieces {
            let Some(twin) = fine.connectivity.twin(wall) else {
                alone += 1;
                continue;
            };
            let across = &pieces[&twin];
            assert_eq!(own.len(), across.len(), "{name}");
            for (a, b) in own.iter().zip(across.iter().rev()) {
                let turned = |[before, behind]: Fractions| [behind, before];
                let [from, to] = b.2;
                assert_eq!(a.2, [turned(to), turned(from)], "{name}");
                to_itself += usize::from(a.0 == b.0);
            }
        }
        for (_, _, [from, to]) in pieces.into_values().flatten() {
            assert!(from[0] < to[0] && from[1] > to[1], "{name}");
            assert!((from[0] + from[1] - 1.0).abs() < 1e-15);
        }
    }
    // The cut ends at cones: both sides of the quad there are one wall.
    assert!(to_itself > 0 && alone > 0, "{to_itself} {alone}");
}

#[test]
fn the_common_parameter_is_the_length_in_space() {
    for (name, (fine, quads)) in surfaces() {
        let rectangles = flattened(&fine, &quads);
        let borders = walls::parameters(&fine, &rectangles).unwrap();
        for (rectangle, border) in rectangles.iter().zip(&borders) {
            let c = &rectangle.fine.connectivity;
            let length = |piece: &flow::Piece| {
                let ends = c.edge_vertices(piece.edge);
                let [p, q] = ends.map(|v| rectangle.fine.position[v]);
                crate::geometry::mesh::distance(p, q)
            };
            let lengths: Vec<f64> = rectangle.border.iter().map(length).collect();
            for side in 0..4 {
                let on = |i: &usize| border[*i].0 == side;
                let whole: f64 = (0..border.len()).filter(on).map(|i| lengths[i]).sum();
                let mut before = 0.0;
                for i in (0..border.len()).filter(on) {
                    let expected = before / whole;
                    assert!((border[i].1[0] - expected).abs() < 1e-9, "{name}");
                    before += lengths[i];
                }
            }
        }
    }
}

/// Every face is counterclockwise, decided exactly, and they fill the rectangle, whose corners are corners.
fn assert_a_rectangle(name: &str, rectangle: &Rectangle) {
    let fine = &rectangle.fine;
    let c = &fine.connectivity;
    let uv = |h: HalfedgeId| fine.corner[h].uv;
    let mut area = 0.0;
    for f in c.faces() {
        let t = c.face_halfedges(f).map(uv);
        let [p, q, r] = t.map(|[x, y]| Coord { x, y });
        assert!(orient2d(p, q, r) > 0.0, "{name}: {t:?}");
        area += 0.5 * doubled_area(t);
    }
    assert!((area / rectangle.height - 1.0).abs() < 1e-12, "{name}");
    let expected = [
        [0.0, 0.0],
        [1.0, 0.0],
        [1.0, rectangle.height],
        [0.0, rectangle.height],
    ];
    for (k, &corner) in rectangle.corners.iter().enumerate() {
        let here = uv(c.vertex_halfedge(corner));
        assert_eq!(here, expected[(k + 4 - rectangle.origin) % 4], "{name}");
    }
}

#[test]
fn no_face_is_flipped_and_corners_stay() {
    for (name, (fine, quads)) in surfaces() {
        let bend = FaceVec::filled(1.0, fine.connectivity.face_count());
        let (rectangles, _) = placed(&fine, &bend, &quads, TOLERANCE).unwrap();
        assert!(rectangles.len() >= 3, "{name}");
        for rectangle in &rectangles {
            assert_a_rectangle(name, rectangle);
        }
    }
}

/// The fractions of every piece, crowded to 1 / 10,000 at one end of every side; `ends` says which one.
fn crowded(border: &[(usize, Fractions)], ends: usize) -> Vec<(usize, Fractions)> {
    let crowd = |t: f64| 1e-4 * t + (1.0 - 1e-4) * t.powi(9);
    let piece = |&(side, [before, behind]): &(usize, Fractions)| {
        let fractions = match ends >> side & 1 {
            0 => [crowd(before), 1.0 - crowd(before)],
            _ => [1.0 - crowd(behind), crowd(behind)],
        };
        (side, fractions)
    };
    border.iter().map(piece).collect()
}

/// Far from what two conformal maps ask for.
#[test]
fn no_border_folds_a_rectangle() {
    for (name, (fine, quads)) in surfaces() {
        let mut rectangles = flattened(&fine, &quads);
        let borders = walls::parameters(&fine, &rectangles).unwrap();
        for (rectangle, border) in rectangles.iter_mut().zip(borders) {
            for ends in 0..16 {
                place::place(rectangle, &crowded(&border, ends), 0).unwrap();
                assert_a_rectangle(name, rectangle);
            }
        }
    }
}

#[test]
fn a_rectangle_that_is_turned_over_is_refused() {
    let (fine, quads) = torus();
    let mut rectangles = flattened(&fine, &quads);
    let mut borders = walls::parameters(&fine, &rectangles).unwrap();
    // Two vertices of a side change places.
    let at = (2..borders[0].len()).find(|&i| {
        borders[0][i - 1].0 == borders[0][i].0 && borders[0][i - 2].0 == borders[0][i].0
    });
    let at = at.unwrap();
    let (first, second) = (borders[0][at - 1].1, borders[0][at].1);
    (borders[0][at - 1].1, borders[0][at].1) = (second, first);
    let error = place::place(&mut rectangles[0], &borders[0], 7).unwrap_err();
    assert!(
        matches!(error, RectangleError::Folded { quad: 7, .. }),
        "{error}"
    );
}

/// Where nothing moves and nothing is spread the harmonic map is nearly the flow's own: edges keep the ratio of their flat lengths.
#[test]
fn borders_that_stay_leave_the_conformal_map() {
    for (name, (fine, quads)) in surfaces() {
        for mut rectangle in flattened(&fine, &quads) {
            let border = own_fractions(&rectangle);
            place::place_in_rounds(&mut rectangle, &border, 0, 0).unwrap();
            let c = &rectangle.fine.connectivity;
            let uv = |v: VertexId| rectangle.fine.corner[c.vertex_halfedge(v)].uv;
            let flat = &rectangle.layout.connectivity;
            let plane = |e| {
                let [p, q] = flat.edge_vertices(e);
                distance(uv(p), uv(q))
            };
            let on_border = flat.edges().find(|&e| flat.is_boundary_edge(e)).unwrap();
            let scale = plane(on_border) / rectangle.layout.length[on_border];
            for e in flat.edges() {
                let error = plane(e) - scale * rectangle.layout.length[e];
                assert!(error.abs() < 0.02, "{name}: {error}");
            }
        }
    }
}

/// Mean squared length in space of what is a unit long in the unit square, over the surface.
fn stretch(rectangle: &Rectangle) -> f64 {
    let fine = &rectangle.fine;
    let c = &fine.connectivity;
    let squared = |f| {
        let corners = c.face_halfedges(f);
        let p = corners.map(|h| fine.position[c.tail(h)]);
        let uv = corners.map(|h| fine.corner[h].uv);
        let uv = uv.map(|[u, v]| [u, v / rectangle.height]);
        // By finite differences along the axes, in barycentric coordinates of the face.
        let (a, b) = (
            [uv[1][0] - uv[0][0], uv[1][1] - uv[0][1]],
            [uv[2][0] - uv[0][0], uv[2][1] - uv[0][1]],
        );
        let determinant = a[0] * b[1] - a[1] * b[0];
        let side = |k: usize| [0, 1, 2].map(|x| p[k][x] - p[0][x]);
        let (p, q) = (side(1), side(2));
        let along = [[b[1], -a[1]], [-b[0], a[0]]].map(|[s, t]| {
            let d = [0, 1, 2].map(|x| (s * p[x] + t * q[x]) / determinant);
            d.iter().map(|x| x * x).sum::<f64>()
        });
        let area = 0.5 * crate::geometry::mesh::norm(crate::geometry::mesh::cross(p, q));
        0.5 * area * (along[0] + along[1])
    };
    c.faces().map(squared).sum()
}

#[test]
fn spreading_lowers_the_stretch() {
    let mut gained: f64 = 1.0;
    for (name, (fine, quads)) in surfaces() {
        let mut rectangles = flattened(&fine, &quads);
        let borders = walls::parameters(&fine, &rectangles).unwrap();
        for (rectangle, border) in rectangles.iter_mut().zip(&borders) {
            place::place_in_rounds(rectangle, border, 0, 0).unwrap();
            let harmonic = stretch(rectangle);
            place::place(rectangle, border, 0).unwrap();
            let spread = stretch(rectangle);
            assert!(
                spread <= harmonic * (1.0 + 1e-12),
                "{name}: {spread} {harmonic}"
            );
            gained = gained.min(spread / harmonic);
        }
    }
    assert!(gained < 0.95, "{gained}");
}
