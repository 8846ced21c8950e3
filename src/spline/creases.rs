//! Which edges of a quad mesh become creases, and which points corners.
//!
//! *Enters:* cells, and of their edges the part that sharp edges of the surface cover. *Leaves:* a [`Cage`].

use super::cage::{Cage, CellSide};
use super::error::SplineError;
use crate::geometry::disjoint_sets::UnionFind;
use rustc_hash::FxHashSet;

/// An edge of cells is a crease where sharp edges cover this part of it.
const COVERED: f64 = 0.9;
/// Angle of sharp edges for the most part of a crease, radians: 40°.
pub const SHARP: f64 = 40.0 * std::f64::consts::PI / 180.0;
/// And all along it: 20°.
pub const BLUNT: f64 = SHARP / 2.0;
/// Creases that hang together have as many edges of cells, at least.
const SHORTEST_NET: usize = 8;
/// Creases that end inside have as many edges of cells, at least.
const SHORTEST_CREASE: usize = 4;

/// A control mesh whose creases are chains of edges that edges of more than 20° cover all along, and edges of more than 40° for the most part; too short ones are noise, and where the limit surface would have no tangent plane creases end an edge before.
/// `covered`: of an edge by its ends, the lesser number first, the parts that edges of both angles cover.
///
/// # Errors
/// Cells that make no surface.
pub fn creased(
    vertices: usize,
    cells: &[[u32; 4]],
    covered: impl Fn([u32; 2]) -> [f64; 2],
) -> Result<Cage, SplineError> {
    let cage = |is_crease: &dyn Fn([u32; 2]) -> bool, is_corner: Vec<bool>| {
        let at = |(c, k): CellSide| {
            let corners = cells[c as usize];
            let ends = [k, (k + 1) & 3].map(|k| corners[usize::from(k)]);
            is_crease(sorted(ends))
        };
        Cage::new(vertices, cells.to_vec(), at, is_corner)
    };
    let none = || vec![false; vertices];
    let steps = |chain: &[u32]| -> Vec<[u32; 2]> {
        chain.windows(2).map(|w| sorted([w[0], w[1]])).collect()
    };
    let all = cage(&|ends| covered(ends)[0] >= COVERED, none())?;
    let mut kept: Vec<Vec<u32>> = all.chains();
    kept.retain(|chain| {
        let steps = steps(chain);
        2.0 * steps.iter().map(|&s| covered(s)[1]).sum::<f64>() >= steps.len() as f64
    });
    let mut edges: FxHashSet<[u32; 2]> = kept.iter().flat_map(|chain| steps(chain)).collect();
    loop {
        let before = edges.len();
        let found = cage(&|ends| edges.contains(&ends), none())?;
        let kept = long_creases(&found);
        edges = kept.iter().flat_map(|chain| steps(chain)).collect();
        // One that ends before may be too short then.
        let found = cage(&|ends| edges.contains(&ends), none())?;
        for side in found.untidy_creases() {
            let ends = [found.tail(side), found.tail((side.0, side.1 + 1))];
            edges.remove(&sorted(ends));
        }
        if edges.len() == before {
            return cage(&|ends| edges.contains(&ends), found.turns());
        }
    }
}

/// Creases inside, as chains of points, but those that end inside and have too few edges, and those of which all that hang together have too few.
fn long_creases(cage: &Cage) -> Vec<Vec<u32>> {
    let mut kept = cage.chains();
    kept.retain(|chain| {
        let ends = [chain[0], chain[chain.len() - 1]];
        let goes_on = ends.iter().all(|&v| cage.is_corner[v as usize]) || ends[0] == ends[1];
        goes_on || chain.len() > SHORTEST_CREASE
    });
    let mut sets = UnionFind::new(cage.vertices);
    let mut length = vec![0; cage.vertices];
    for step in kept.iter().flat_map(|chain| chain.windows(2)) {
        sets.join(step[0] as usize, step[1] as usize);
    }
    for chain in &kept {
        length[sets.find(chain[0] as usize)] += chain.len() - 1;
    }
    let leaving = cage.leaving();
    let is_on_border = |v: u32| {
        leaving[v as usize].is_some_and(|side| cage.turn_back(cage.star(side)[0]).is_none())
    };
    let on_border = kept.iter().flatten().filter(|&&v| is_on_border(v));
    let touches: FxHashSet<usize> = on_border.map(|&v| sets.find(v as usize)).collect();
    kept.retain(|chain| {
        let set = sets.find(chain[0] as usize);
        length[set] >= SHORTEST_NET || touches.contains(&set)
    });
    kept
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}
