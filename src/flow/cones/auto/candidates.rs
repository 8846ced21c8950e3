//! Places that may be worth a cone.
//!
//! *Enters:* fields on the surface. *Leaves:* vertices spread over it, vertices where a field is greater than around or less, vertices on
//! rings around one. None depends on how vertices are numbered, unless values tie.

use super::neighbours::Neighbours;
use crate::geometry::ids::NONE;

/// How far apart vertices are that are spread over a surface, in edges, where as many squares of that side would cover it: with this share
/// they are at least as many as asked for.
const APART: f64 = 0.7;

/// Vertices spread over the surface by edges, and the one of them that each vertex is nearest to.
pub(super) struct Samples {
    pub(super) vertices: Vec<usize>,
    /// Index into `vertices` of every vertex; of several as near, the first.
    pub(super) nearest: Vec<u32>,
}

impl Samples {
    pub(super) fn none() -> Self {
        Self {
            vertices: Vec::new(),
            nearest: Vec::new(),
        }
    }

    /// About `count` of those that are `allowed`, those of the lowest `order` first, none within some edges of another.
    pub(super) fn new(c: &Neighbours, allowed: &[bool], order: &[f64], count: usize) -> Self {
        let sorted = sorted(allowed, order);
        let vertices = match sorted.len() <= 2 * count {
            true => sorted,
            false => spread(c, sorted, count),
        };
        let nearest = nearest_of(c, &vertices);
        Self { vertices, nearest }
    }
}

fn sorted(allowed: &[bool], order: &[f64]) -> Vec<usize> {
    let mut vertices: Vec<usize> = (0..order.len()).filter(|&v| allowed[v]).collect();
    vertices.sort_by(|&v, &w| order[v].total_cmp(&order[w]).then(v.cmp(&w)));
    vertices
}

fn spread(c: &Neighbours, sorted: Vec<usize>, count: usize) -> Vec<usize> {
    let apart = APART * (sorted.len() as f64 / count.max(1) as f64).sqrt();
    let radius = apart.round().max(1.0) as usize;
    let mut is_near = vec![false; c.len()];
    let mut seen = vec![NONE; c.len()];
    let mut samples = Vec::new();
    for v in sorted {
        if is_near[v] {
            continue;
        }
        let mark = samples.len() as u32;
        samples.push(v);
        seen[v] = mark;
        let mut ring = vec![v];
        for _ in 0..radius {
            let mut next = Vec::new();
            for &x in &ring {
                for w in c.of(x) {
                    if std::mem::replace(&mut seen[w], mark) != mark {
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

/// For every vertex the number of the source that is fewest edges away; the first of several. 0 where there is none.
fn nearest_of(c: &Neighbours, sources: &[usize]) -> Vec<u32> {
    let mut nearest = vec![NONE; c.len()];
    let mut ring: Vec<usize> = Vec::new();
    for (i, &v) in sources.iter().enumerate() {
        nearest[v] = i as u32;
        ring.push(v);
    }
    let mut distance = vec![NONE; c.len()];
    ring.iter().for_each(|v| distance[*v] = 0);
    for step in 1.. {
        let mut next = Vec::new();
        for &v in &ring {
            for w in c.of(v) {
                if distance[w] == NONE {
                    distance[w] = step;
                    next.push(w);
                }
                if distance[w] == step {
                    nearest[w] = nearest[w].min(nearest[v]);
                }
            }
        }
        if next.is_empty() {
            break;
        }
        ring = next;
    }
    nearest
        .iter()
        .map(|&i| if i == NONE { 0 } else { i })
        .collect()
}

/// At most `count` allowed vertices where a field is greater than around, or less; those first where it is farthest from `level`, one of
/// each region before the second of any.
pub(super) fn extremes(
    c: &Neighbours,
    allowed: &[bool],
    field: &[f64],
    level: f64,
    regions: &Samples,
    count: usize,
) -> Vec<usize> {
    let is_extreme = |v: usize| {
        let around = c.of(v).map(|w| field[w]);
        let [least, greatest] = around.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| {
            [a.min(x), b.max(x)]
        });
        !(least..=greatest).contains(&field[v])
    };
    let vertices = (0..field.len()).filter(|&v| allowed[v] && is_extreme(v));
    let mut extremes: Vec<(f64, usize)> = vertices.map(|v| ((field[v] - level).abs(), v)).collect();
    extremes.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let mut seen = vec![0u32; regions.vertices.len().max(1)];
    let mut ranked: Vec<(u32, usize)> = Vec::with_capacity(extremes.len());
    for (_, v) in extremes {
        let before = &mut seen[regions.nearest[v] as usize];
        ranked.push((*before, v));
        *before += 1;
    }
    // Stable: in each round those farthest from the level first.
    ranked.sort_by_key(|r| r.0);
    ranked.truncate(count);
    ranked.into_iter().map(|(_, v)| v).collect()
}
