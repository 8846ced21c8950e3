//! Small patches joined to their neighbours, where fewer rectangles with more texels each hold the surface better.
//!
//! *Enters:* a [`Drawing`], and a budget of texels. *Leaves:* fewer walls on it. *Guaranteed:* every patch is a disk with three to [`MOST_SIDES`] sides where it was joined; the cut, the
//! surface's border and creases stay. *Not guaranteed:* a better division: what two patches become together may be a shape whose rectangles are stretched, which is foreseen
//! as a factor only.
//!
//! Samples on shared sides lie in two images. A side that goes takes two rectangles with it, and where three walls met at its end two more, since the others go on as one side of
//! the patches on both of their sides.

use super::RectangleError;
use super::division::{MOST_SIDES, part, regions};
use super::sides::{Chain, Drawing, Role};
use super::sizes::{LEAST_GAIN, ROUNDS, Size, Total, floor, size};
use crate::geometry::ids::{FaceVec, VertexId};
use std::collections::BTreeMap;

/// How much more error the rectangles of a joined patch are taken to have than those of a convex one.
const SHAPE: f64 = 1.5;
/// Least sides that a patch keeps.
const LEAST_SIDES: f64 = 3.0;

/// Joins until nothing is gained; how many walls went.
pub(super) fn join(drawing: &mut Drawing, budget: usize) -> Result<usize, RectangleError> {
    let floor = floor(drawing);
    let mut gone = 0;
    for _ in 0..ROUNDS {
        let found = Walls::new(drawing, floor)?.worth_erasing(drawing, budget);
        if found.is_empty() {
            break;
        }
        gone += found.len();
        for (chain, dissolved) in found {
            for &e in &chain.edges {
                drawing.is_wall[e] = false;
            }
            for v in dissolved {
                drawing.role[v] = Role::Plain;
            }
        }
    }
    Ok(gone)
}

/// The patches and the sides between them.
struct Walls {
    /// Number of every face's patch.
    label: FaceVec<usize>,
    sizes: Vec<Size>,
    chains: Vec<Chain>,
    /// Sides that end at a node.
    valence: BTreeMap<VertexId, usize>,
    /// Sides that two patches share, the lesser number first.
    shared: BTreeMap<[usize; 2], usize>,
}

impl Walls {
    fn new(drawing: &Drawing, floor: f64) -> Result<Self, RectangleError> {
        let c = &drawing.fine.connectivity;
        let mut label = FaceVec::filled(usize::MAX, c.face_count());
        let mut sizes = Vec::new();
        for start in regions(drawing) {
            let disk = part(drawing, start)?;
            disk.faces.iter().for_each(|&f| label[f] = sizes.len());
            sizes.push(size(drawing, &disk, floor));
        }
        let mut walls = Self {
            label,
            sizes,
            chains: drawing.chains(),
            valence: BTreeMap::new(),
            shared: BTreeMap::new(),
        };
        for chain in &walls.chains {
            for v in ends(chain).into_iter().flatten() {
                *walls.valence.entry(v).or_default() += 1;
            }
            if let Some(pair) = walls.beside(drawing, chain) {
                *walls.shared.entry(pair).or_default() += 1;
            }
        }
        Ok(walls)
    }

    /// The patches on both sides of a wall, unless it is on the surface's border.
    fn beside(&self, drawing: &Drawing, chain: &Chain) -> Option<[usize; 2]> {
        let c = &drawing.fine.connectivity;
        let h = c.edge_halfedge(*chain.edges.first()?);
        let [p, q] = [h, c.twin(h)?].map(|h| self.label[c.face(h)]);
        Some([p.min(q), p.max(q)])
    }

    /// All patches around a vertex.
    fn around(&self, drawing: &Drawing, v: VertexId) -> impl Iterator<Item = usize> {
        let c = &drawing.fine.connectivity;
        c.outgoing(v).map(|h| self.label[c.face(h)])
    }

    /// The sides without which the error is less, each with the nodes that would go with it, best first; no patch is near two of them.
    fn worth_erasing(&self, drawing: &Drawing, budget: usize) -> Vec<(Chain, Vec<VertexId>)> {
        let whole = Total::of(self.sizes.iter());
        let candidates = self.chains.iter().filter_map(|chain| {
            let (dissolved, after) = self.erased(drawing, chain, whole)?;
            let gain = whole.gain(after, budget);
            (gain >= LEAST_GAIN).then_some((gain, chain, dissolved))
        });
        let mut candidates: Vec<(f64, &Chain, Vec<VertexId>)> = candidates.collect();
        candidates.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut is_touched = vec![false; self.sizes.len()];
        candidates.retain(|(_, chain, _)| {
            let ends = ends(chain).into_iter().flatten();
            let near = ends.flat_map(|v| self.around(drawing, v));
            let near: Vec<usize> = near.collect();
            let is_free = near.iter().all(|&p| !is_touched[p]);
            if is_free {
                near.into_iter().for_each(|p| is_touched[p] = true);
            }
            is_free
        });
        let taken = candidates.into_iter();
        taken
            .map(|(_, chain, dissolved)| (chain.clone(), dissolved))
            .collect()
    }

    /// What would be without a side, if it may go: nodes that go with it, and the sum of errors.
    fn erased(
        &self,
        drawing: &Drawing,
        chain: &Chain,
        whole: Total,
    ) -> Option<(Vec<VertexId>, Total)> {
        let ends = ends(chain)?;
        let pair = self.beside(drawing, chain)?;
        let [p, q] = pair.map(|p| self.sizes[p]);
        // What shares two sides would be a ring without one of them.
        let makes_a_disk = pair[0] != pair[1] && self.shared.get(&pair) == Some(&1);
        let is_fixed = chain.edges.iter().any(|&e| drawing.is_fixed[e]);
        let valence = ends.map(|v| self.valence.get(&v).copied().unwrap_or(0));
        if !makes_a_disk || is_fixed || ends[0] == ends[1] || valence.iter().any(|&n| n < 3) {
            return None;
        }
        let goes = ends.into_iter().zip(valence).filter(|(_, n)| *n == 3);
        let dissolved: Vec<VertexId> = goes.map(|(v, _)| v).collect();
        let lost = dissolved.len() as f64;
        let joined = Size {
            sides: p.sides + q.sides - 2.0 - lost,
            bend: p.bend + q.bend,
            area: p.area + q.area,
            border: p.border + q.border - 2.0 * drawing.length(chain),
        };
        let keeps_enough = dissolved.iter().all(|&v| {
            let mut others = self.around(drawing, v).filter(|r| !pair.contains(r));
            others.all(|r| self.sizes[r].sides - lost >= LEAST_SIDES)
        });
        let is_in_bounds = (LEAST_SIDES..=MOST_SIDES as f64).contains(&joined.sides);
        (is_in_bounds && keeps_enough).then(|| {
            let after = Total {
                error: whole.error - p.error() - q.error() + SHAPE * joined.error(),
                rectangles: whole.rectangles - 2.0 - 2.0 * lost,
            };
            (dissolved, after)
        })
    }
}

/// Both ends of a side.
fn ends(chain: &Chain) -> Option<[VertexId; 2]> {
    match chain.vertices[..] {
        [first, .., last] => Some([first, last]),
        _ => None,
    }
}
