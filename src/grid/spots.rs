//! Where the points of a quad mesh lie on a map, and how they may move there.
//!
//! *Enters:* a [`GridMap`] and the quad mesh. *Leaves:* a [`Spot`] for each of its points, and the squares that places lie in. *Guaranteed:* the same on any number of threads; of the faces that a point lies in to rounding, the thickest counts.

use super::complex;
use super::density::Units;
use super::map::{Freedom, GridMap};
use super::quads::QuadMesh;
use super::squares::Squares;
use super::triangle::{self, double_area};
use crate::geometry::ids::{FaceId, VertexVec};
use crate::geometry::mesh::{cross, dot, norm, sub};
use crate::parallel;

/// Weight below which a corner of a face has no part in a point.
const NO_WEIGHT: f64 = 1e-9;
/// Faces that one thread looks at.
const RUN: usize = 8192;

/// A point of the quad mesh on the surface. Vectors are seen from the square that it was found in.
#[derive(Clone, Copy)]
pub(super) struct Spot {
    /// In space.
    pub position: [f64; 3],
    /// Of the surface, as long as one.
    pub normal: [f64; 3],
    /// Where it goes by a step along either axis.
    pub tangent: [[f64; 3]; 2],
    /// Along which axis it may move.
    pub is_free: [bool; 2],
    /// The square, and its corner there.
    pub corner: (u32, u8),
    /// Side of a cell, source units.
    pub size: f64,
    /// Of the face that it was found in: the thickest counts.
    pub thickness: f64,
}

/// Where points lie; `None` where one is not found.
pub(super) fn locate<'a>(
    map: &GridMap,
    mesh: &'a QuadMesh,
    normals: &VertexVec<[f64; 3]>,
    unit: &Units,
) -> Option<(Squares<'a>, Vec<Spot>)> {
    let c = &map.sheet.fine.connectivity;
    let squares = Squares::new(map, mesh)?;
    let runs = parallel::map_numbers(c.face_count().div_ceil(RUN), |i| {
        let faces = i * RUN..c.face_count().min((i + 1) * RUN);
        let mut found = Vec::new();
        for f in faces.map(FaceId::new) {
            spots_in(map, &squares, normals, unit, f, &mut found);
        }
        found
    });
    let mut spots: Vec<Option<Spot>> = vec![None; mesh.points.len()];
    for run in runs {
        for spot in run {
            let (square, corner) = spot.corner;
            let point = mesh.quads[square as usize][usize::from(corner)] as usize;
            if spots[point].is_none_or(|s| s.thickness < spot.thickness) {
                spots[point] = Some(spot);
            }
        }
    }
    let spots = spots.into_iter().collect::<Option<Vec<_>>>()?;
    Some((squares, spots))
}

/// The points in a face, where the surface has a normal.
fn spots_in(
    map: &GridMap,
    squares: &Squares<'_>,
    normals: &VertexVec<[f64; 3]>,
    unit: &Units,
    f: FaceId,
    found: &mut Vec<Spot>,
) {
    let (sheet, c) = (&map.sheet, &map.sheet.fine.connectivity);
    let p = map.corners(f);
    let whole = double_area(p);
    let thickness = triangle::thickness(p);
    let range = |i: usize| {
        let of = p.map(|p| p[i]);
        let low = of[0].min(of[1]).min(of[2]) - NO_WEIGHT;
        let high = of[0].max(of[1]).max(of[2]) + NO_WEIGHT;
        low.ceil() as i64..=high.floor() as i64
    };
    for x in range(0) {
        for y in range(1) {
            let q = [x as f64, y as f64];
            let weights = [
                double_area([q, p[1], p[2]]) / whole,
                double_area([p[0], q, p[2]]) / whole,
                double_area([p[0], p[1], q]) / whole,
            ];
            if weights.iter().any(|w| *w < -NO_WEIGHT) {
                continue;
            }
            let seen = squares.at(f, q);
            let Some(corner) = seen.corner_at([x, y]) else {
                continue;
            };
            let vertices = c.face_vertices(f);
            let at = vertices.map(|v| sheet.fine.position[v]);
            let mixed = |of: [[f64; 3]; 3]| -> [f64; 3] {
                std::array::from_fn(|i| (0..3).map(|k| weights[k] * of[k][i]).sum())
            };
            let (e, g) = (sub(at[1], at[0]), sub(at[2], at[0]));
            let (u, w) = (
                [p[1][0] - p[0][0], p[1][1] - p[0][1]],
                [p[2][0] - p[0][0], p[2][1] - p[0][1]],
            );
            // The direction in the frame of the face that an axis of the square has.
            let tangent = |axis: usize| {
                let unit = [[1.0, 0.0], [0.0, 1.0]][axis];
                let [x, y] = complex::turned(unit, 4 - seen.corner);
                let (s, t) = ((x * w[1] - y * w[0]) / whole, (y * u[0] - x * u[1]) / whole);
                std::array::from_fn(|i| s * e[i] + t * g[i])
            };
            let free = freedom(map, f, weights);
            let turned = usize::from(seen.corner & 1);
            let normal = mixed(vertices.map(|v| normals[v]));
            let length = norm(normal);
            if length == 0.0 {
                continue;
            }
            found.push(Spot {
                position: mixed(at),
                normal: normal.map(|x| x / length),
                tangent: [tangent(0), tangent(1)],
                is_free: [free[turned], free[1 - turned]],
                corner: (seen.square, corner),
                size: unit.of(sheet.fine.parent[f]),
                thickness,
            });
        }
    }
}

/// Whether a point of a face may move along the axes of its frame: on lines only along them.
fn freedom(map: &GridMap, f: FaceId, weights: [f64; 3]) -> [bool; 2] {
    let c = &map.sheet.fine.connectivity;
    let halfedges = c.face_halfedges(f);
    let has = weights.map(|w| w > NO_WEIGHT);
    let of_corner = |k: usize| {
        let v = c.tail(halfedges[k]);
        let axes = map.freedom[v].axes();
        let turns = map.frames(v).into_iter().find(|t| t.0 == halfedges[k]);
        match turns.is_some_and(|t| t.1 & 1 == 1) {
            true => [axes[1], axes[0]],
            false => axes,
        }
    };
    let beside: Vec<usize> = (0..3).filter(|&k| has[k]).collect();
    match beside[..] {
        [k] => of_corner(k),
        [j, k] => {
            let is_line = [j, k].map(|k| map.freedom[c.tail(halfedges[k])] != Freedom::Free);
            let [p, q] = [j, k].map(|k| map.sheet.at(halfedges[k]));
            match is_line == [true; 2] {
                true => [p[1] == q[1], p[0] == q[0]],
                false => [true; 2],
            }
        }
        _ => [true; 2],
    }
}

/// Normals of vertices: those of their faces, weighted by the angles there (Thürmer, Wüthrich 1998), so that at a corner of a box each side counts alike, however long it is.
pub(super) fn normals(map: &GridMap) -> VertexVec<[f64; 3]> {
    let (c, position) = (&map.sheet.fine.connectivity, &map.sheet.fine.position);
    let mut normals = VertexVec::filled([0.0; 3], c.vertex_count());
    for f in c.faces() {
        let vertices = c.face_vertices(f);
        let at = vertices.map(|v| position[v]);
        for (k, v) in vertices.into_iter().enumerate() {
            let [e, g] = [1, 2].map(|i| sub(at[(k + i) % 3], at[k]));
            let own = cross(e, g);
            let double_area = norm(own);
            if double_area > 0.0 {
                let weight = double_area.atan2(dot(e, g)) / double_area;
                (0..3).for_each(|i| normals[v][i] += weight * own[i]);
            }
        }
    }
    for normal in normals.as_mut_slice() {
        let length = norm(*normal);
        if length > 0.0 {
            *normal = normal.map(|x| x / length);
        }
    }
    normals
}
