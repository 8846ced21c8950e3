//! The limit surface as triangles.
//!
//! *Enters:* a [`Limit`] surface and a number of parts along a side of a cell. *Leaves:* a [`Tessellation`]: points that cells share along their sides, and normals that they share but across creases and at points without tangent plane.

use super::cage::{Cage, CellSide};
use super::evaluator::CORNER;
use super::limit::Limit;
use crate::geometry::mesh::{cross, dot, norm, sub};
use crate::parallel;
use rustc_hash::FxHashMap;

/// Triangles on the surface.
#[derive(Clone, Debug, Default)]
pub struct Tessellation {
    /// Points.
    pub points: Vec<[f64; 3]>,
    /// Faces by points, counterclockwise; two a part of a cell, cell by cell and row by row.
    pub faces: Vec<[u32; 3]>,
    /// Of every vertex of the next, its point and its unit normal.
    pub vertices: Vec<(u32, [f64; 3])>,
    /// The same faces by vertices.
    pub smooth_faces: Vec<[u32; 3]>,
    /// Parts along a side of a cell.
    pub parts: usize,
}

/// At least so many triangles all in all …
const TRIANGLES: usize = 100_000;
/// … but a side of a cell has no more parts.
const MOST_PARTS: usize = 8;

/// Parts along a side of a cell of surfaces with so many cells.
pub fn parts(cells: usize) -> usize {
    let wanted = (TRIANGLES as f64 / (2 * cells.max(1)) as f64).sqrt();
    (wanted.ceil() as usize).clamp(2, MOST_PARTS)
}

/// A place that cells share.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Name {
    Point(u32),
    /// The first side of an edge, and how far along it.
    Edge(CellSide, usize),
    Inside(u32, usize),
}

/// Of every corner of every cell, whether the surface has no tangent plane there: at corners, and where more than two cells lie between creases.
pub(super) fn without_plane(cage: &Cage) -> Vec<[bool; 4]> {
    let creases = cage.creases();
    let mut without = vec![[false; 4]; cage.cells.len()];
    for (v, side) in cage.leaving().into_iter().enumerate() {
        let Some(side) = side.filter(|_| cage.is_corner[v] || creases[v] > 0) else {
            continue;
        };
        let mut star = cage.star(side);
        let crease = star.iter().position(|&s| cage.is_crease(s));
        star.rotate_left(crease.unwrap_or(0));
        for sector in star.chunk_by(|_, &next| !cage.is_crease(next)) {
            if cage.is_corner[v] || (crease.is_some() && sector.len() > 2) {
                for &(c, k) in sector {
                    without[c as usize][usize::from(k)] = true;
                }
            }
        }
    }
    without
}

/// Points and normals at the ends of the parts of a cell, row by row. Where the surface has no tangent plane at a corner, `without`, the normal there is that of its part.
pub(super) fn jets(
    limit: &Limit<'_>,
    cell: u32,
    parts: usize,
    without: [bool; 4],
) -> Vec<([f64; 3], [f64; 3])> {
    let row = parts + 1;
    let places = (0..row * row).map(|i| [i % row, i / row].map(|x| x as f64 / parts as f64));
    let mut jets: Vec<_> = places.map(|at| limit.normal(cell, at)).collect();
    let last = row * row - 1;
    // Corners, what comes next to each counterclockwise, and before it.
    let corners = [
        [0, 1, row],
        [parts, parts + row, parts - 1],
        [last, last - 1, last - row],
        [last - parts, last - parts - row, last - parts + 1],
    ];
    for ([at, next, before], _) in corners.into_iter().zip(without).filter(|(_, is)| *is) {
        let [a, b] = [next, before].map(|i| sub(jets[i].0, jets[at].0));
        let normal = cross(a, b);
        let length = norm(normal);
        if length > 0.0 {
            jets[at].1 = normal.map(|x| x / length);
        }
    }
    jets
}

/// Of every corner of every cell, the first cell of those around the point that no crease divides from it; the cell itself where the surface has no tangent plane.
fn sectors(cage: &Cage, without_plane: &[[bool; 4]]) -> Vec<[u32; 4]> {
    let mut first = vec![[u32::MAX; 4]; cage.cells.len()];
    for c in 0..cage.cells.len() as u32 {
        for k in 0..4u8 {
            if first[c as usize][usize::from(k)] != u32::MAX {
                continue;
            }
            let mut star = cage.star((c, k));
            // From a crease on, where there is one.
            let crease = star.iter().position(|&s| cage.is_crease(s));
            star.rotate_left(crease.unwrap_or(0));
            let mut sector: Vec<CellSide> = Vec::new();
            let mut close = |sector: &mut Vec<CellSide>| {
                let least = sector.iter().map(|s| s.0).min().unwrap_or(0);
                for (c, k) in sector.drain(..) {
                    let is_alone = without_plane[c as usize][usize::from(k)];
                    first[c as usize][usize::from(k)] = if is_alone { c } else { least };
                }
            };
            for side in star {
                if cage.is_crease(side) {
                    close(&mut sector);
                }
                sector.push(side);
            }
            close(&mut sector);
        }
    }
    first
}

/// Divides every cell into `parts`² parts.
pub fn tessellate(limit: &Limit<'_>, parts: usize) -> Tessellation {
    let cage = limit.cage;
    let without_plane = without_plane(cage);
    let sectors = sectors(cage, &without_plane);
    let row = parts + 1;
    let jets = parallel::map_numbers(cage.cells.len(), |c| {
        jets(limit, c as u32, parts, without_plane[c])
    });
    let mut out = Tessellation {
        parts,
        ..Tessellation::default()
    };
    let mut points: FxHashMap<Name, u32> = FxHashMap::default();
    let mut vertices: FxHashMap<(u32, u32), u32> = FxHashMap::default();
    for c in 0..cage.cells.len() as u32 {
        let mut numbers = vec![[0u32; 2]; row * row];
        for (i, number) in numbers.iter_mut().enumerate() {
            let (name, sector) = named(cage, &sectors, c, [i % row, i / row], parts);
            let (position, normal) = jets[c as usize][i];
            let point = *points.entry(name).or_insert_with(|| {
                out.points.push(position);
                out.points.len() as u32 - 1
            });
            let vertex = *vertices.entry((point, sector)).or_insert_with(|| {
                out.vertices.push((point, [0.0; 3]));
                out.vertices.len() as u32 - 1
            });
            // The mean of those of all cells, which differ by rounding but at irregular points.
            (0..3).for_each(|x| out.vertices[vertex as usize].1[x] += normal[x]);
            *number = [point, vertex];
        }
        for j in 0..parts {
            for i in 0..parts {
                let at = [
                    j * row + i,
                    j * row + i + 1,
                    (j + 1) * row + i + 1,
                    (j + 1) * row + i,
                ];
                let (triangles, _) = triangles(&jets[c as usize], at);
                for corners in triangles {
                    out.faces.push(corners.map(|i| numbers[i][0]));
                    out.smooth_faces.push(corners.map(|i| numbers[i][1]));
                }
            }
        }
    }
    for (_, normal) in &mut out.vertices {
        let length = norm(*normal);
        *normal = match length > 0.0 {
            true => normal.map(|x| x / length),
            false => [0.0, 0.0, 1.0],
        };
    }
    out
}

/// Two triangles of a quad whose corners have these numbers, counterclockwise, along the diagonal with which both look more the way the surface does; and the least cosine between one's normal and that of the surface at one of its corners.
pub(super) fn triangles(
    jets: &[([f64; 3], [f64; 3])],
    [a, b, c, d]: [usize; 4],
) -> ([[usize; 3]; 2], f64) {
    let of = |corners: [usize; 3]| {
        let [p, q, r] = corners.map(|i| jets[i].0);
        let own = cross(sub(q, p), sub(r, p));
        let length = norm(own).max(f64::MIN_POSITIVE);
        let cosines = corners.map(|i| dot(own, jets[i].1) / length);
        cosines.into_iter().fold(1.0, f64::min)
    };
    let both = [[[a, b, c], [a, c, d]], [[a, b, d], [b, c, d]]];
    let [one, other] = both.map(|[t, u]| of(t).min(of(u)));
    match one >= other {
        true => (both[0], one),
        false => (both[1], other),
    }
}

/// The name of a place, and what tells its normals on both sides of a crease apart.
fn named(
    cage: &Cage,
    sectors: &[[u32; 4]],
    c: u32,
    [i, j]: [usize; 2],
    parts: usize,
) -> (Name, u32) {
    let is_end = |x: usize| x == 0 || x == parts;
    let at = [i, j].map(|x| x as f64 / parts as f64);
    match (is_end(i), is_end(j)) {
        (true, true) => {
            let k = CORNER.iter().position(|corner| *corner == at).unwrap_or(0);
            (
                Name::Point(cage.cells[c as usize][k]),
                sectors[c as usize][k],
            )
        }
        (false, false) => (Name::Inside(c, j * (parts + 1) + i), 0),
        (is_left_or_right, _) => {
            let k: u8 = match (is_left_or_right, i == 0, j == 0) {
                (false, _, true) => 0,
                (false, _, false) => 2,
                (true, false, _) => 1,
                (true, true, _) => 3,
            };
            let along = [i, j, parts - i, parts - j][usize::from(k)];
            let (edge, along) = match cage.across[c as usize][usize::from(k)] {
                Some(other) if other < (c, k) => (other, parts - along),
                _ => ((c, k), along),
            };
            (
                Name::Edge(edge, along),
                if cage.is_crease((c, k)) { c } else { 0 },
            )
        }
    }
}
