//! Sides halved, as few as can be, so that every region has an even number of corners.
//!
//! *Enters:* a [`Drawing`] with its nodes. *Leaves:* more nodes on it. *Guaranteed:* an even number of sides around every region, or an error where a closed surface's part has none
//! to pair an odd region with (there are always two). *Not guaranteed:* the fewest halved sides.
//!
//! A halved side is one more for the regions on both of its sides. So what is halved is crossed by paths that pair odd regions, or lead from one to the surface's border: a T-join
//! in the graph of regions. Pairs are matched greedily, the nearest first, and exchanged while the paths get shorter in sum.

use super::RectangleError;
use super::division::{part, places, regions};
use super::sides::{Chain, Drawing, Role};
use crate::geometry::ids::FaceVec;

/// What crossing a side costs more, if it has the mean length: halves of short ones are shorter still.
const SHORT: f64 = 0.5;
/// Exchanges that gain less are rounding.
const GAIN: f64 = 1e-9;

/// Halves sides until every region has an even number.
pub(super) fn make_even(drawing: &mut Drawing) -> Result<(), RectangleError> {
    let graph = Graph::new(drawing)?;
    let is_halved = graph.halved()?;
    for (mut side, _) in graph.sides.into_iter().zip(is_halved).filter(|x| x.1) {
        let half = 0.5 * drawing.length(&side);
        drawing.mark(&mut side, half, Role::Node);
    }
    Ok(())
}

/// Regions, and the sides between them.
struct Graph {
    sides: Vec<Chain>,
    /// Regions on both sides; what lies beyond the surface's border is one more.
    beside: Vec<[usize; 2]>,
    /// Of crossing a side.
    cost: Vec<f64>,
    /// Sides around every region, and beyond the border.
    around: Vec<Vec<usize>>,
    /// Regions with an odd number of corners.
    odd: Vec<usize>,
}

/// The cost of the way to a region, and its last side.
type Way = (f64, usize);

impl Graph {
    fn new(drawing: &Drawing) -> Result<Self, RectangleError> {
        let c = &drawing.fine.connectivity;
        let mut region = FaceVec::filled(0, c.face_count());
        let mut corners = Vec::new();
        for start in regions(drawing) {
            let disk = part(drawing, start)?;
            disk.faces.iter().for_each(|&f| region[f] = corners.len());
            corners.push(places(drawing, &disk, |role| role == Role::Node).count());
        }
        let beyond = corners.len();
        let sides = drawing.chains();
        let beside: Vec<[usize; 2]> = sides
            .iter()
            .filter_map(|side| Some(c.edge_halfedge(*side.edges.first()?)))
            .map(|h| [Some(h), c.twin(h)].map(|h| h.map_or(beyond, |h| region[c.face(h)])))
            .collect();
        let lengths: Vec<f64> = sides.iter().map(|side| drawing.length(side)).collect();
        let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
        let cost = lengths.iter().map(|length| 1.0 + SHORT * mean / length);
        let mut around = vec![Vec::new(); beyond + 1];
        for (side, &[a, b]) in beside.iter().enumerate() {
            // A side with one region on both sides makes no difference to it.
            if a != b {
                around[a].push(side);
                around[b].push(side);
            }
        }
        Ok(Self {
            cost: cost.collect(),
            odd: (0..beyond).filter(|&r| corners[r] % 2 == 1).collect(),
            sides,
            beside,
            around,
        })
    }

    fn across(&self, side: usize, region: usize) -> usize {
        let [a, b] = self.beside[side];
        if a == region { b } else { a }
    }

    /// Which sides are halved.
    fn halved(&self) -> Result<Vec<bool>, RectangleError> {
        let ways: Vec<Vec<Way>> = self.odd.iter().map(|&r| self.ways(r)).collect();
        let mut is_halved = vec![false; self.sides.len()];
        for [i, to] in self.pairs(&ways)? {
            let mut at = to;
            while at != self.odd[i] {
                let side = ways[i][at].1;
                is_halved[side] = !is_halved[side];
                at = self.across(side, at);
            }
        }
        Ok(is_halved)
    }

    /// Cheapest ways from a region to all others.
    fn ways(&self, from: usize) -> Vec<Way> {
        let mut ways = vec![(f64::INFINITY, usize::MAX); self.around.len()];
        ways[from].0 = 0.0;
        let mut is_done = vec![false; self.around.len()];
        loop {
            let waiting = (0..ways.len()).filter(|&r| !is_done[r] && ways[r].0.is_finite());
            let Some(nearest) = waiting.min_by(|&a, &b| ways[a].0.total_cmp(&ways[b].0)) else {
                return ways;
            };
            is_done[nearest] = true;
            for &side in &self.around[nearest] {
                let other = self.across(side, nearest);
                let cost = ways[nearest].0 + self.cost[side];
                if cost < ways[other].0 {
                    ways[other] = (cost, side);
                }
            }
        }
    }

    /// Pairs every odd region, by its place in the list, with a region, or with what lies beyond the border. Each pair once.
    fn pairs(&self, ways: &[Vec<Way>]) -> Result<Vec<[usize; 2]>, RectangleError> {
        let beyond = self.around.len() - 1;
        let count = self.odd.len();
        // `count` stands for what is beyond the border.
        let region = |j: usize| self.odd.get(j).copied().unwrap_or(beyond);
        let cost = |i: usize, j: usize| ways[i][region(j)].0;
        let mut candidates: Vec<(f64, usize, usize)> = (0..count)
            .flat_map(|i| (i + 1..=count).map(move |j| (i, j)))
            .map(|(i, j)| (cost(i, j), i, j))
            .filter(|(cost, ..)| cost.is_finite())
            .collect();
        candidates.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        let mut mate = vec![None; count];
        for (_, i, j) in candidates {
            if mate[i].is_none() && (j == count || mate[j].is_none()) {
                mate[i] = Some(j);
                if j < count {
                    mate[j] = Some(i);
                }
            }
        }
        let mate: Option<Vec<usize>> = mate.into_iter().collect();
        let mut mate = mate.ok_or(RectangleError::Inconsistent {
            what: "regions with an odd number of sides",
        })?;
        let mut is_better = true;
        while std::mem::take(&mut is_better) {
            for i in 0..count {
                for j in 0..count {
                    let (p, q) = (mate[i], mate[j]);
                    if i == j || p == j || p == count || q == count {
                        continue;
                    }
                    if cost(i, j) + cost(p, q) < cost(i, p) + cost(j, q) - GAIN {
                        (mate[i], mate[j], mate[p], mate[q]) = (j, i, q, p);
                        is_better = true;
                    }
                }
            }
        }
        let pairs = mate.iter().enumerate().filter(|&(i, &j)| i < j);
        Ok(pairs.map(|(i, &j)| [i, region(j)]).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Regions in a row of columns, each with an extra corner where `odd` has its number.
    fn grid(columns: usize, rows: usize, odd: &[usize], is_open: bool) -> Graph {
        let beyond = columns * rows;
        let mut beside = Vec::new();
        for r in 0..beyond {
            let (x, y) = (r % columns, r / columns);
            if x + 1 < columns {
                beside.push([r, r + 1]);
            }
            if y + 1 < rows {
                beside.push([r, r + columns]);
            }
            if is_open && x == 0 {
                beside.push([r, beyond]);
            }
        }
        let mut around = vec![Vec::new(); beyond + 1];
        for (side, &[a, b]) in beside.iter().enumerate() {
            around[a].push(side);
            around[b].push(side);
        }
        let chain = Chain {
            vertices: Vec::new(),
            edges: Vec::new(),
        };
        let wave = |i: usize| 1.0 + 0.2 * (7.3 * i as f64).sin();
        Graph {
            sides: vec![chain; beside.len()],
            cost: (0..beside.len()).map(wave).collect(),
            odd: odd.to_vec(),
            beside,
            around,
        }
    }

    /// The cost of halved sides; infinite where they leave an odd region.
    fn cost(graph: &Graph, is_halved: &[bool]) -> f64 {
        let beyond = graph.around.len() - 1;
        for region in 0..beyond {
            let halved = graph.around[region].iter().filter(|&&s| is_halved[s]);
            if (halved.count() % 2 == 1) != graph.odd.contains(&region) {
                return f64::INFINITY;
            }
        }
        let sides = graph.cost.iter().zip(is_halved).filter(|x| *x.1);
        sides.map(|x| x.0).sum()
    }

    #[test]
    fn all_regions_become_even_and_hardly_any_other_sides_cost_less() {
        let cases: [(&[usize], bool); 5] = [
            (&[0, 8], false),
            (&[1, 3, 5, 7], false),
            (&[0, 1, 2, 6, 7, 8], false),
            (&[4], true),
            (&[2, 4, 8], true),
        ];
        for (odd, is_open) in cases {
            let graph = grid(3, 3, odd, is_open);
            let found = cost(&graph, &graph.halved().unwrap());
            let count = graph.sides.len();
            let all = (0..1u32 << count).map(|bits| {
                let is_halved: Vec<bool> = (0..count).map(|i| bits >> i & 1 == 1).collect();
                cost(&graph, &is_halved)
            });
            let least = all.fold(f64::INFINITY, f64::min);
            // With two pairs all exchanges are tried; with more the best may need three at once.
            let most = if odd.len() <= 4 { 1.0 } else { 1.2 };
            assert!(
                found.is_finite() && found <= most * least + 1e-12,
                "{odd:?}: {found}, {least}"
            );
        }
        assert!(grid(3, 3, &[4], false).halved().is_err());
    }
}
