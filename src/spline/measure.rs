//! How a spline surface lies beside the surface that it was fitted to, and whether it folds.
//!
//! *Enters:* a [`Limit`] surface, samples at their nearest places, and for distances both ways the triangles. *Leaves:* [`Errors`] and [`Shape`].

use super::gridded::Sample;
use super::limit::Limit;
use crate::geometry::mesh::{cross, dot, norm, sub};
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
    /// Part of the area where the surface is folded over itself: the normal looks away from that of the cell, and turns by more than a right angle from one part to the next.
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

/// Looks for folds, and lists the cells in which there are some.
pub fn shape(limit: &Limit<'_>) -> (Shape, Vec<u32>) {
    let cells = 0..limit.cage.cells.len() as u32;
    let each: Vec<(f64, f64, f64)> = cells
        .into_par_iter()
        .map(|cell| {
            let jacobians = jacobians(limit, cell);
            let mut whole = [0.0; 3];
            for j in &jacobians {
                (0..3).for_each(|i| whole[i] += j[i]);
            }
            let sizes: Vec<f64> = jacobians.iter().map(|&j| norm(j)).collect();
            let flips = (0..PARTS).any(|y| {
                (0..PARTS).any(|x| {
                    let at = |x: usize, y: usize| jacobians[PARTS * y + x];
                    let right = x + 1 < PARTS && dot(at(x, y), at(x + 1, y)) < 0.0;
                    right || (y + 1 < PARTS && dot(at(x, y), at(x, y + 1)) < 0.0)
                })
            });
            let away = jacobians
                .iter()
                .zip(&sizes)
                .filter(|(j, _)| flips && dot(**j, whole) < 0.0);
            let least = sizes.iter().copied().fold(f64::INFINITY, f64::min);
            (
                sizes.iter().sum::<f64>(),
                least,
                away.fold(0.0, |area, (_, size)| area + size),
            )
        })
        .collect();
    let sum: f64 = each.iter().map(|e| e.0).sum();
    let mean = sum / (each.len() * PARTS * PARTS) as f64;
    let folded = (0..).zip(&each).filter(|(_, e)| e.2 > 0.0);
    let shape = Shape {
        least_jacobian: each.iter().map(|e| e.1).fold(f64::INFINITY, f64::min) / mean,
        turned_over: each.iter().fold(0.0, |area, e| area + e.2) / sum,
    };
    (shape, folded.map(|(cell, _)| cell).collect())
}
