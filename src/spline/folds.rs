//! Cells that fold, and what is done against it.
//!
//! *Enters:* [`Equations`] and control points. *Leaves:* control points with which fewer cells fold, or none.

use super::cage::Cage;
use super::equations::Equations;
use super::error::SplineError;
use super::gridded::Sample;
use super::limit::Limit;
use super::measure::{folded, folded_of};

/// Where the surface folds it is made fairer by this factor, up to so much: by then it is as important as distances.
const FAIRER: f64 = 3.0;
const FAIREST: f64 = 8.1e5;
/// So many times at most, first at corners of cells that fold and then at all points that these depend on.
const MOST_SMOOTHINGS: usize = 14;
const NARROW_SMOOTHINGS: usize = 4;
/// A step is halved this many times where cells would fold, and then left out.
const MOST_HALVINGS: usize = 4;

/// Which cells fold.
pub struct Folds {
    cells: Vec<u32>,
    is_in: Vec<bool>,
}

impl Folds {
    /// No cell of a control mesh.
    pub fn none(cage: &Cage) -> Self {
        Self {
            cells: Vec::new(),
            is_in: vec![false; cage.cells.len()],
        }
    }

    /// Those of a surface.
    pub fn of(equations: &Equations<'_>, control: &[[f64; 3]]) -> Self {
        let limit = Limit::new(equations.cage, equations.evaluator, control);
        let mut folds = Self::none(equations.cage);
        folds.cells = folded(&limit);
        for &cell in &folds.cells {
            folds.is_in[cell as usize] = true;
        }
        folds
    }

    /// Whether there are some.
    pub fn any(&self) -> bool {
        !self.cells.is_empty()
    }

    /// Whether a cell is one.
    pub fn is_in(&self, cell: u32) -> bool {
        self.is_in[cell as usize]
    }
}

/// Makes cells fairer: at their corners, or, where `is_wide`, at all points that they depend on.
fn make_fairer(equations: &mut Equations<'_>, cells: &[u32], is_wide: bool) {
    let mut is_near = vec![false; equations.cage.vertices];
    for &cell in cells {
        let points = match is_wide {
            true => equations.evaluator.points(cell),
            false => &equations.cage.cells[cell as usize],
        };
        points.iter().for_each(|&v| is_near[v as usize] = true);
    }
    let near = equations.fairness.iter_mut().zip(&is_near);
    for (fairness, _) in near.filter(|(_, near)| **near) {
        *fairness = (*fairness * FAIRER).min(FAIREST);
    }
}

/// Control points with which nothing folds, for samples where they are, if fairness leads there: first such that cells become like the quad mesh, and where that does not do, flat. At first at corners of cells that fold, later at all points that they depend on.
///
/// # Errors
/// Equations without solution.
pub fn unfolded(
    equations: &mut Equations<'_>,
    folds: &Folds,
    samples: &[Sample],
) -> Result<Option<Vec<[f64; 3]>>, SplineError> {
    let given = equations.fairness.clone();
    for is_flat in [false, true] {
        equations.is_flat = is_flat;
        let mut cells = folds.cells.clone();
        for smoothing in 0..MOST_SMOOTHINGS {
            make_fairer(equations, &cells, smoothing >= NARROW_SMOOTHINGS);
            let control = equations.solve(samples)?;
            let limit = Limit::new(equations.cage, equations.evaluator, &control);
            cells = folded(&limit);
            if cells.is_empty() {
                return Ok(Some(control));
            }
        }
        equations.fairness.clone_from(&given);
    }
    equations.is_flat = false;
    Ok(None)
}

/// Control points on the way to others such that no cell folds that did not, and those that still do: the way of all points that a cell depends on which would is halved, more than once, and then nothing. Such cells, and those that still fold, are made a little fairer.
pub fn shortened(
    equations: &mut Equations<'_>,
    from: &[[f64; 3]],
    to: &[[f64; 3]],
    folds: &Folds,
) -> (Vec<[f64; 3]>, Folds) {
    let (cage, evaluator) = (equations.cage, equations.evaluator);
    let mut control = to.to_vec();
    let mut now = Folds::of(equations, &control);
    make_fairer(equations, &now.cells, false);
    let mut part = vec![1.0f64; cage.vertices];
    // Cells by the points that they depend on.
    let mut around: Vec<Vec<u32>> = Vec::new();
    for halving in 0.. {
        let is_new = |cell: &&u32| !folds.is_in(**cell);
        let new: Vec<u32> = now.cells.iter().filter(is_new).copied().collect();
        if new.is_empty() {
            break;
        }
        if around.is_empty() {
            around = vec![Vec::new(); cage.vertices];
            for cell in 0..cage.cells.len() as u32 {
                let points = evaluator.points(cell).iter();
                points.for_each(|&v| around[v as usize].push(cell));
            }
        }
        let mut points: Vec<u32> = new
            .iter()
            .flat_map(|&cell| evaluator.points(cell))
            .copied()
            .collect();
        points.sort_unstable();
        points.dedup();
        for v in points.iter().map(|&v| v as usize) {
            part[v] = if halving < MOST_HALVINGS {
                part[v] / 2.0
            } else {
                0.0
            };
            control[v] = [0, 1, 2].map(|c| from[v][c] + part[v] * (to[v][c] - from[v][c]));
        }
        let mut changed: Vec<u32> = points
            .iter()
            .flat_map(|&v| &around[v as usize])
            .copied()
            .collect();
        changed.sort_unstable();
        changed.dedup();
        let limit = Limit::of_cells(cage, evaluator, &control, &changed);
        for &cell in &changed {
            now.is_in[cell as usize] = false;
        }
        for cell in folded_of(&limit, &changed) {
            now.is_in[cell as usize] = true;
        }
        now.cells = (0..)
            .zip(&now.is_in)
            .filter(|(_, is)| **is)
            .map(|(cell, _)| cell)
            .collect();
    }
    (control, now)
}

#[cfg(test)]
#[path = "tests/folds.rs"]
mod tests;
