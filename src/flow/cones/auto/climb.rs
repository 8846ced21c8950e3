//! The vertex of a surface where something is worth most.
//!
//! *Enters:* a worth of every vertex. *Leaves:* a vertex worth more than its neighbours, found uphill from the best of some samples. The worth
//! of a place for a cone is a smooth function but for the cones that are there, so few samples are enough.

use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::VertexId;

/// Samples to climb from.
const SUMMITS: usize = 6;

/// Vertices worth more than their neighbours, the best first: uphill from the best of some vertices with their worth. `worth` gets a buffer
/// of its own.
pub(super) fn climb(
    connectivity: &Connectivity,
    starts: impl Iterator<Item = (usize, f64)>,
    taken: impl Fn(usize) -> bool,
    worth: impl Fn(usize, &mut Vec<f64>) -> f64,
) -> Vec<(usize, f64)> {
    let mut row = Vec::new();
    let mut tops: Vec<(usize, f64)> = Vec::new();
    for mut top in summits(starts.filter(|start| !taken(start.0))) {
        loop {
            let around = connectivity.neighbours(VertexId::new(top.0));
            let next = around
                .map(VertexId::index)
                .filter(|&w| !taken(w))
                .map(|w| (w, worth(w, &mut row)))
                .fold(top, |a, b| if b.1 > a.1 { b } else { a });
            if next.0 == top.0 {
                break;
            }
            top = next;
        }
        if tops.iter().all(|t| t.0 != top.0) {
            tops.push(top);
        }
    }
    // Stable: of equals the first found.
    tops.sort_by(|a, b| b.1.total_cmp(&a.1));
    tops
}

/// The few that are worth most.
fn summits(scored: impl Iterator<Item = (usize, f64)>) -> Vec<(usize, f64)> {
    let mut best: Vec<(usize, f64)> = Vec::with_capacity(SUMMITS + 1);
    for one in scored {
        let place = best.partition_point(|b| b.1 >= one.1);
        if place < SUMMITS {
            best.insert(place, one);
            best.truncate(SUMMITS);
        }
    }
    best
}

/// Vertices spread over the surface, about `count` of them: those of the lowest `order` first, none within some edges of another.
pub(super) fn sample(
    connectivity: &Connectivity,
    allowed: &[bool],
    order: &[f64],
    count: usize,
) -> Vec<usize> {
    let mut vertices: Vec<usize> = (0..order.len()).filter(|&v| allowed[v]).collect();
    vertices.sort_by(|&v, &w| order[v].total_cmp(&order[w]).then(v.cmp(&w)));
    if vertices.len() <= 2 * count {
        return vertices;
    }
    let radius = ((vertices.len() / count) as f64).sqrt().round().max(1.0) as usize;
    let mut is_near = vec![false; order.len()];
    let mut samples = Vec::new();
    for v in vertices {
        if is_near[v] {
            continue;
        }
        samples.push(v);
        is_near[v] = true;
        let (mut ring, mut within) = (vec![v], vec![v]);
        for _ in 0..radius {
            let mut next = Vec::new();
            for &x in &ring {
                for w in connectivity
                    .neighbours(VertexId::new(x))
                    .map(VertexId::index)
                {
                    if !within.contains(&w) {
                        within.push(w);
                        next.push(w);
                        is_near[w] = true;
                    }
                }
            }
            ring = next;
        }
    }
    samples
}
