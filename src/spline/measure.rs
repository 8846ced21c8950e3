//! How a spline surface lies beside the surface that it was fitted to, and whether it folds.
//!
//! *Enters:* a [`Limit`] surface, samples at their nearest places, and for distances both ways the triangles. *Leaves:* [`Errors`] and [`Shape`].

use super::gridded::Sample;
use super::limit::Limit;
use super::tessellation::{jets, parts, triangles, without_plane};
use crate::geometry::mesh::{cross, dot, norm, sub};
use crate::parallel;
use rayon::prelude::*;

/// Distances and angles from samples of the source to the nearest places that were found on the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Root of the mean square of distances, by area, source units.
    pub rms: f64,
    /// The largest distance, source units.
    pub max: f64,
    /// Mean angle of normals, by area, radians.
    pub mean_normal_angle: f64,
    /// On 95 % of the area angles are no larger, radians.
    pub p95_normal_angle: f64,
}

/// Whether the surface is one everywhere.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Shape {
    /// Smallest |∂s × ∂t| over its mean, over places that are farther than a sixteenth of a cell from the sides: at irregular points it vanishes.
    pub least_jacobian: f64,
    /// Part of the area where the surface is folded, or bent as much as if it were: from one place to the next, an eighth of a cell away or less, the normal turns by a right angle or more, or a triangle of the tessellation looks away from it at one of its corners.
    pub turned_over: f64,
}

/// Places are an eighth of a cell apart along both sides …
/// … and beside irregular points closer: eight for every halving, down to so many.
const HALVINGS: i32 = 6;
/// Places on sides are inside by this part of a cell: on a crease, or at its end, there is no normal.
const INSIDE: f64 = 1e-6;
/// Places nearer to a side, cells, do not count for the least Jacobian.
const NEAR_SIDE: f64 = 0.0625;

/// Measures samples that were moved to the nearest places.
pub fn errors(limit: &Limit<'_>, samples: &[Sample]) -> Errors {
    let mut each: Vec<(f64, f64, f64)> = samples
        .par_iter()
        .map(|s| {
            let (point, normal) = limit.normal(s.cell, s.at);
            let angle = norm(cross(normal, s.normal)).atan2(dot(normal, s.normal));
            (norm(sub(point, s.point)), angle, s.own_area())
        })
        .collect();
    let area: f64 = each.iter().map(|e| e.2).sum();
    if area <= 0.0 {
        return Errors::default();
    }
    let squares: f64 = each.iter().map(|(d, _, a)| a * d * d).sum();
    let angles: f64 = each.iter().map(|(_, angle, a)| a * angle).sum();
    let max = each.iter().map(|e| e.0).fold(0.0, f64::max);
    each.sort_by(|a, b| a.1.total_cmp(&b.1));
    let mut below = 0.0;
    let beyond = each.iter().find(|e| {
        below += e.2;
        below >= 0.95 * area
    });
    Errors {
        rms: (squares / area).sqrt(),
        max,
        mean_normal_angle: angles / area,
        p95_normal_angle: beyond.map_or(0.0, |e| e.1),
    }
}

/// Places along a side of a cell, finer towards its ends where these are irregular.
fn places(is_irregular: [bool; 2]) -> Vec<f64> {
    let mut breaks = vec![0.0, 0.5, 1.0];
    let halves = (2..=HALVINGS).map(|d| 0.5f64.powi(d));
    if is_irregular[0] {
        breaks.extend(halves.clone());
    }
    if is_irregular[1] {
        breaks.extend(halves.map(|x| 1.0 - x));
    }
    breaks.sort_by(f64::total_cmp);
    let between = breaks.windows(2).flat_map(|ends| {
        let part = (ends[1] - ends[0]) / 4.0;
        (0..4).map(move |i| ends[0] + f64::from(i) * part)
    });
    let all = between.chain([1.0]);
    all.map(|x| x.clamp(INSIDE, 1.0 - INSIDE)).collect()
}

/// Looks for folds.
pub fn shape(limit: &Limit<'_>) -> Shape {
    let cells = limit.cage.cells.len();
    let each = each_of(limit, &all(limit));
    let area: f64 = each.iter().map(|cell| cell.area).sum();
    let over: f64 = each.iter().map(|cell| cell.over).sum();
    let least = each.iter().map(|cell| cell.least);
    Shape {
        least_jacobian: least.fold(f64::INFINITY, f64::min) * cells as f64 / area,
        turned_over: over / area,
    }
}

/// The cells in which there are folds.
pub fn folded(limit: &Limit<'_>) -> Vec<u32> {
    folded_of(limit, &all(limit))
}

/// Those of some cells.
pub fn folded_of(limit: &Limit<'_>, cells: &[u32]) -> Vec<u32> {
    let each = each_of(limit, cells);
    let folded = cells.iter().zip(&each).filter(|(_, cell)| cell.over > 0.0);
    folded.map(|(&cell, _)| cell).collect()
}

fn all(limit: &Limit<'_>) -> Vec<u32> {
    (0..limit.cage.cells.len() as u32).collect()
}

fn each_of(limit: &Limit<'_>, cells: &[u32]) -> Vec<Cell> {
    let (irregular, without) = (limit.cage.irregular(), without_plane(limit.cage));
    parallel::map(cells, |_, &cell| {
        let mut own = Cell::new(limit, cell, &irregular);
        own.over = f64::max(
            own.over,
            own.area * away(limit, cell, without[cell as usize]),
        );
        own
    })
}

/// The Jacobians of a cell.
struct Cell {
    /// Its area.
    area: f64,
    /// The least length of those inside.
    least: f64,
    /// Area of its folded parts.
    over: f64,
}

impl Cell {
    fn new(limit: &Limit<'_>, cell: u32, irregular: &[bool]) -> Self {
        let [a, b, c, d] = limit.cage.cells[cell as usize].map(|v| irregular[v as usize]);
        let (s, t) = (places([a || d, b || c]), places([a || b, c || d]));
        let row = s.len();
        let grid = t.iter().flat_map(|&t| s.iter().map(move |&s| [s, t]));
        let jacobians: Vec<[f64; 3]> = grid
            .map(|at| limit.at(cell, at))
            .map(|jet| cross(jet.tangent[0], jet.tangent[1]))
            .collect();
        let sizes: Vec<f64> = jacobians.iter().map(|&j| norm(j)).collect();
        let is_inside = |x: f64| (NEAR_SIDE..=1.0 - NEAR_SIDE).contains(&x);
        let inside = (0..sizes.len()).filter(|i| is_inside(s[i % row]) && is_inside(t[i / row]));
        let least = inside.map(|i| sizes[i]).fold(f64::INFINITY, f64::min);
        let (mut area, mut over) = (0.0, 0.0);
        for j in 1..t.len() {
            for i in 1..row {
                let last = row * j + i;
                let around = [last - row - 1, last - row, last, last - 1];
                let size = around.iter().map(|&at| sizes[at]).sum::<f64>() / 4.0;
                let size = size * (s[i] - s[i - 1]) * (t[j] - t[j - 1]);
                area += size;
                let is_over = (0..4).any(|k| {
                    let [one, next] = [k, (k + 1) % 4].map(|k| jacobians[around[k]]);
                    dot(one, next) <= 0.0
                });
                if is_over {
                    over += size;
                }
            }
        }
        Self { area, over, least }
    }
}

/// Part of a cell whose triangles look away from the surface.
fn away(limit: &Limit<'_>, cell: u32, without_plane: [bool; 4]) -> f64 {
    let parts = parts(limit.cage.cells.len());
    let row = parts + 1;
    let jets = jets(limit, cell, parts, without_plane);
    let quads = (0..parts).flat_map(|j| (0..parts).map(move |i| row * j + i));
    let quads = quads.map(|at| [at, at + 1, at + row + 1, at + row]);
    let away = quads.filter(|&quad| triangles(&jets, quad).1 <= 0.0);
    away.count() as f64 / (parts * parts) as f64
}
