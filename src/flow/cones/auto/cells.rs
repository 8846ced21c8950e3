//! The surface seen at few points, for sums that say which cones are best.
//!
//! *Enters:* places where cones are or might be. *Leaves:* some thousand points in place of all vertices. The log scale is steep next to
//! cones, so the vertices around every place are points of their own; elsewhere it is smooth, and cells around the samples are enough.

use super::candidates::Samples;
use super::neighbours::Neighbours;
use crate::flow::solve::{LANES, Row};

/// Places up to which the second ring of vertices around them are points too; beyond, rings are the first.
const WIDE: usize = 48;

/// Exponent beyond which what a vertex adds is not told apart: a vertex far outside may stand out by thousands.
const STEEPEST: f64 = 300.0;

/// Single vertices around some places, cells around the samples elsewhere.
pub(super) struct Cells<'a> {
    /// Cell of every vertex.
    cell: Vec<u32>,
    /// Number of cells around samples.
    cells: usize,
    /// Those of them that lost vertices to points.
    changed: Vec<u32>,
    /// What is in those now and what they lost: place in the order of elimination, cell and area of the vertices whose u is unknown.
    parts: Vec<(u32, u32, f64)>,
    vertex_weight: &'a [f64],
    /// Area of every cell, all together 1.
    pub(super) weight: Vec<f64>,
}

impl<'a> Cells<'a> {
    pub(super) fn new(
        neighbours: &Neighbours,
        samples: &Samples,
        vertex_weight: &'a [f64],
        order: &[u32],
        places: &[usize],
    ) -> Self {
        let mut cell = samples.nearest.clone();
        let cells = samples.vertices.len();
        let mut is_changed = vec![false; cells];
        let mut count = cells as u32;
        let mut own = |v: usize| {
            // A vertex that is alone already stays so.
            let cell = &mut cell[v];
            if let Some(is_changed) = is_changed.get_mut(*cell as usize) {
                *is_changed = true;
                *cell = count;
                count += 1;
            }
        };
        for &place in places {
            own(place);
            for v in neighbours.of(place) {
                own(v);
                if places.len() <= WIDE {
                    neighbours.of(v).for_each(&mut own);
                }
            }
        }
        let mut weight = vec![0.0; count as usize];
        for (&c, w) in cell.iter().zip(vertex_weight) {
            weight[c as usize] += w;
        }
        let is_part = |c: u32| is_changed.get(c as usize).copied().unwrap_or(true);
        let ordered = (0..).zip(order).map(|(at, &v)| (at, v as usize));
        let parts = ordered
            .filter(|&(_, v)| is_part(cell[v]))
            .map(|(at, v)| (at, cell[v], vertex_weight[v]));
        Self {
            parts: parts.collect(),
            changed: (0..cells as u32).filter(|&c| is_part(c)).collect(),
            cells,
            cell,
            vertex_weight,
            weight,
        }
    }

    /// ∫e^{2u} and ∫e^{−2u} of every cell, over e^{2ū} and e^{−2ū}, where ū is the mean of u in the cell.
    pub(super) fn spread(&self, u: &[f64]) -> [Vec<f64>; 2] {
        let mean = self.means(u);
        [2.0, -2.0].map(|sign| {
            let mut all = vec![0.0; self.weight.len()];
            for ((&c, w), x) in self.cell.iter().zip(self.vertex_weight).zip(u) {
                let off = (sign * (x - mean[c as usize])).min(STEEPEST);
                all[c as usize] += w * off.exp();
            }
            all
        })
    }

    /// The cell of a vertex.
    pub(super) fn of(&self, vertex: usize) -> usize {
        self.cell[vertex] as usize
    }

    /// The means of several fields side by side, `factor` times, which are 0 at vertices whose u is known. `sums`: their integrals over the cells
    /// around samples, as these are without points.
    pub(super) fn means_of(&self, columns: &[Row], sums: &[Row], factor: f64) -> Vec<Row> {
        let mut means = vec![[0.0; LANES]; self.weight.len()];
        means[..self.cells].copy_from_slice(&sums[..self.cells]);
        for &c in &self.changed {
            means[c as usize] = [0.0; LANES];
        }
        for &(at, c, w) in &self.parts {
            add(&mut means[c as usize], w, &columns[at as usize]);
        }
        for (row, w) in means.iter_mut().zip(&self.weight) {
            let share = if *w > 0.0 { factor / w } else { 0.0 };
            row.iter_mut().for_each(|m| *m *= share);
        }
        means
    }

    pub(super) fn means(&self, field: &[f64]) -> Vec<f64> {
        let mut means = vec![0.0; self.weight.len()];
        for ((&c, w), x) in self.cell.iter().zip(self.vertex_weight).zip(field) {
            means[c as usize] += w * x;
        }
        for (m, w) in means.iter_mut().zip(&self.weight) {
            *m = if *w > 0.0 { *m / w } else { 0.0 };
        }
        means
    }
}

/// `sum` + `factor` · `row`.
#[inline]
pub(super) fn add(sum: &mut Row, factor: f64, row: &Row) {
    sum.iter_mut().zip(row).for_each(|(s, x)| *s += factor * x);
}
