//! How many samples each side of a rectangle gets.
//!
//! *Enters:* quads. *Leaves:* the columns and rows of their images. *Guaranteed:* opposite sides of a quad, and the two quads on both
//! sides of a wall, have the same number: the sides that must agree form strips through the quads, and each strip has one number.
//! *Not guaranteed:* the budget, where the least numbers use more.
//!
//! A strip's number follows the mean length of its sides in space, so that texels are about as large everywhere.

use super::quads::Quad;
use super::subdivision::Subdivision;
use crate::atlas::patches::MAX_SIDE;
use rustc_hash::FxHashMap as Map;

/// Least samples along a side.
pub(super) const LEAST: usize = 8;

/// Samples along side 0 (and 2) and side 1 (and 3) of every quad.
pub(super) fn samples(drawing: &Subdivision, quads: &[Quad], budget: usize) -> Vec<[usize; 2]> {
    let mut side_of_edge = Map::default();
    let mut length: Vec<f64> = Vec::new();
    let sides: Vec<[usize; 4]> = quads
        .iter()
        .map(|quad| {
            std::array::from_fn(|k| {
                let edges = quad.side(drawing, k);
                // Both quads of a wall see the same edges, so the least one names it.
                let name = edges.iter().min().copied();
                *side_of_edge.entry(name).or_insert_with(|| {
                    length.push(edges.iter().map(|&e| drawing.edge_length(e)).sum());
                    length.len() - 1
                })
            })
        })
        .collect();
    let mut strip: Vec<usize> = (0..length.len()).collect();
    for side in &sides {
        for k in 0..2 {
            let (a, b) = (find(&mut strip, side[k]), find(&mut strip, side[k + 2]));
            strip[a.max(b)] = a.min(b);
        }
    }
    let mut total = vec![(0.0, 0.0); length.len()];
    for (i, l) in length.iter().enumerate() {
        let sum = &mut total[find(&mut strip, i)];
        *sum = (sum.0 + l, sum.1 + 1.0);
    }
    let mean: Vec<[f64; 2]> = sides
        .iter()
        .map(|side| {
            [0, 1].map(|k| {
                let (sum, count) = total[find(&mut strip, side[k])];
                sum / count
            })
        })
        .collect();
    let count = |length: f64, density: f64| {
        let samples = (length * density).round().min(MAX_SIDE as f64 - 1.0);
        (samples as usize + 1).clamp(LEAST, MAX_SIDE)
    };
    let texels = |density: f64| -> f64 {
        let image = |m: &[f64; 2]| (count(m[0], density) * count(m[1], density)) as f64;
        mean.iter().map(image).sum()
    };
    // A strip has at least one sample, and the longest one at most the budget.
    let longest = mean
        .iter()
        .flatten()
        .fold(f64::MIN_POSITIVE, |m, &x| m.max(x));
    let (mut low, mut high) = (0.0, budget as f64 / longest);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if texels(middle) > budget as f64 {
            high = middle;
        } else {
            low = middle;
        }
    }
    mean.iter().map(|m| m.map(|m| count(m, low))).collect()
}

fn find(parent: &mut [usize], mut i: usize) -> usize {
    while parent[i] != i {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    i
}
