//! How a spline surface lies beside the surface that it was fitted to, and whether it folds.
//!
//! *Enters:* a [`Limit`] surface, samples at their nearest places, and for distances both ways the triangles. *Leaves:* [`Errors`] and [`Shape`].

use super::gridded::Sample;
use super::limit::Limit;
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
    /// Smallest |∂s × ∂t| over its mean, over the middles of [`PARTS`]² parts of every cell.
    pub least_jacobian: f64,
    /// Part of the area where the surface is folded over itself: in a cell where the normal turns by more than a right angle from one part to the next, the parts whose normal looks away from
    /// the mean one, if they are a twentieth of the cell more than those of the source that do.
    pub turned_over: f64,
}

/// Parts of a cell along a side.
pub const PARTS: usize = 8;

/// Measures samples that were moved to the nearest places.
pub fn errors(limit: &Limit<'_>, samples: &[Sample]) -> Errors {
    let mut each: Vec<(f64, f64, f64)> = samples
        .par_iter()
        .map(|s| {
            let (point, normal) = limit.normal(s.cell, s.at);
            let angle = norm(cross(normal, s.normal)).atan2(dot(normal, s.normal));
            (norm(sub(point, s.point)), angle, s.area)
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

/// Jacobians in the middles of the parts of a cell, row by row.
fn jacobians(limit: &Limit<'_>, cell: u32) -> Vec<[f64; 3]> {
    let middle = |i: usize| (i as f64 + 0.5) / PARTS as f64;
    let parts = (0..PARTS).flat_map(|j| (0..PARTS).map(move |i| [middle(i), middle(j)]));
    let of = |at| {
        let jet = limit.at(cell, at);
        cross(jet.tangent[0], jet.tangent[1])
    };
    parts.map(of).collect()
}

/// Part of a cell by which more of the surface than of the source may look away from its mean normal.
const AWAY: f64 = 0.05;

/// Looks for folds, and lists the cells in which there are some. `samples`: of the source.
pub fn shape(limit: &Limit<'_>, samples: &[Sample]) -> (Shape, Vec<u32>) {
    let cells = limit.cage.cells.len();
    let each = parallel::map_numbers(cells, |cell| Cell::new(limit, cell as u32));
    let mut source = vec![[0.0; 2]; each.len()];
    for sample in samples.iter().filter(|s| each[s.cell as usize].away > 0.0) {
        let [away, all] = &mut source[sample.cell as usize];
        *all += sample.area;
        if dot(sample.normal, each[sample.cell as usize].mean) < 0.0 {
            *away += sample.area;
        }
    }
    let folded = |(cell, [away, all]): &(&Cell, [f64; 2])| {
        let bent = if *all > 0.0 { away / all } else { 0.0 };
        cell.away > cell.area * (bent + AWAY).min(1.0)
    };
    let sum: f64 = each.iter().map(|cell| cell.area).sum();
    let mean = sum / (each.len() * PARTS * PARTS) as f64;
    let least = each
        .iter()
        .map(|cell| cell.least)
        .fold(f64::INFINITY, f64::min);
    let is_folded: Vec<bool> = each.iter().zip(source).map(|pair| folded(&pair)).collect();
    let over = each.iter().zip(&is_folded).filter(|(_, folded)| **folded);
    let shape = Shape {
        least_jacobian: least / mean,
        turned_over: over.fold(0.0, |area, (cell, _)| area + cell.away) / sum,
    };
    let folded = (0..).zip(&is_folded).filter(|(_, folded)| **folded);
    (shape, folded.map(|(cell, _)| cell).collect())
}

/// The Jacobians of a cell.
struct Cell {
    /// Sum of their lengths.
    area: f64,
    /// The least length.
    least: f64,
    /// Their sum.
    mean: [f64; 3],
    /// Sum of the lengths of those that look away from it, where some neighbours are more than a right angle apart; else 0.
    away: f64,
}

impl Cell {
    fn new(limit: &Limit<'_>, cell: u32) -> Self {
        let jacobians = jacobians(limit, cell);
        let mut mean = [0.0; 3];
        for j in &jacobians {
            (0..3).for_each(|i| mean[i] += j[i]);
        }
        let sizes: Vec<f64> = jacobians.iter().map(|&j| norm(j)).collect();
        let at = |x: usize, y: usize| jacobians[PARTS * y + x];
        let flips = (0..PARTS).any(|y| {
            (0..PARTS).any(|x| {
                let right = x + 1 < PARTS && dot(at(x, y), at(x + 1, y)) < 0.0;
                right || (y + 1 < PARTS && dot(at(x, y), at(x, y + 1)) < 0.0)
            })
        });
        let away = jacobians.iter().zip(&sizes);
        let away = away.filter(|(j, _)| flips && dot(**j, mean) < 0.0);
        Self {
            area: sizes.iter().sum(),
            least: sizes.iter().copied().fold(f64::INFINITY, f64::min),
            away: away.fold(0.0, |sum, (_, size)| sum + size),
            mean,
        }
    }
}
