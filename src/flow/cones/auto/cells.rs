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
    /// Cell and area of the vertices whose u is unknown, in the order of elimination.
    ordered: Vec<(u32, f64)>,
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
        let cells = samples.vertices.len() as u32;
        let mut count = cells;
        let mut own = |v: usize| {
            // A vertex that is alone already stays so.
            let cell = &mut cell[v];
            if *cell < cells {
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
        let ordered = order.iter().map(|&v| v as usize);
        Self {
            ordered: ordered.map(|v| (cell[v], vertex_weight[v])).collect(),
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

    /// The means of several fields side by side, `factor` times, which are 0 at vertices whose u is known.
    pub(super) fn means_of(&self, columns: &[Row], factor: f64) -> Vec<Row> {
        let mut means = vec![[0.0; LANES]; self.weight.len()];
        for (&(c, w), row) in self.ordered.iter().zip(columns) {
            let mean = means[c as usize].iter_mut();
            mean.zip(row).for_each(|(m, x)| *m += w * x);
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
