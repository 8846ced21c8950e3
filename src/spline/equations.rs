//! The equations of a control mesh: least squares of distances to samples, and fairness.
//!
//! *Enters:* a control mesh and samples with their places. *Leaves:* control points. Σ area · |surface − sample|² and a little of the squares by which second differences of control points differ from those of the quad mesh
//! are minimised by one sparse Cholesky factorisation.
//!
//! Where samples are at the nearest places of a surface already, distances to its tangent planes are minimised instead (A. Blake, M. Isard 1998; W. Wang, H. Pottmann, Y. Liu 2006): a Gauss–Newton step in control points and places together, while points that are nearest in turn draw the surface to the places that
//! they had. Its matrix couples coordinates; a few steps of conjugate gradients with the other matrix as preconditioner are as good. *Guaranteed:* the same bytes for any number of threads.

use super::cage::Cage;
use super::error::SplineError;
use super::evaluator::Evaluator;
use super::fairness::{Difference, differences};
use super::gridded::Sample;
use super::limit::{Limit, along_side};
use crate::flow::solve::SymmetricSolver;
use crate::geometry::mesh::{dot, norm, sub};
use crate::parallel;
use rayon::prelude::*;

/// Weight of squares of second differences beside those of distances.
const FAIR: f64 = 1e-6;
/// So many times more at most where cells are no larger than faces, and with the square of faces a cell less where they are: there, distances say how the surface bends from one face to the next only, and would have every face flat.
const FAIR_WITHIN_FACES: f64 = 100.0;
/// Weight of squares of distances along tangent planes beside those to them: without, surfaces slide along themselves.
const ALONG: f64 = 0.1;
/// A sample whose direction is farther from the normal, as a squared cosine, is not at its nearest place and counts with all of its distance.
const TOWARDS: f64 = 0.75;
/// Steps of conjugate gradients.
pub const GRADIENTS: usize = 4;

/// See the module docs.
pub struct Equations<'a> {
    /// Control mesh.
    pub cage: &'a Cage,
    /// The same, prepared.
    pub evaluator: &'a Evaluator,
    differences: Vec<Difference>,
    /// Of each point, how many times the usual weight its differences have.
    pub fairness: Vec<f64>,
    /// Whether differences are to be none, in place of those of the quad mesh.
    pub is_flat: bool,
    solver: SymmetricSolver,
}

/// What a cell adds: products of weights, and of weights with samples.
struct Block {
    normal: Vec<f64>,
    right: Vec<[f64; 3]>,
}

/// Samples by cell.
struct ByCell<'s> {
    samples: &'s [Sample],
    first: Vec<usize>,
    order: Vec<u32>,
}

/// A sample beside the surface, or beside its border.
struct Beside {
    off: [f64; 3],
    /// Normal of the surface, or tangent of the border.
    direction: [f64; 3],
    /// What distances along the direction count.
    towards: f64,
    /// And others.
    across: f64,
}

impl<'s> ByCell<'s> {
    fn new(samples: &'s [Sample], cells: usize) -> Self {
        let mut first = vec![0usize; cells + 1];
        samples.iter().for_each(|s| first[s.cell as usize + 1] += 1);
        (0..cells).for_each(|c| first[c + 1] += first[c]);
        let mut next = first.clone();
        let mut order = vec![0u32; samples.len()];
        for (i, sample) in samples.iter().enumerate() {
            let at = &mut next[sample.cell as usize];
            order[*at] = i as u32;
            *at += 1;
        }
        Self {
            samples,
            first,
            order,
        }
    }

    fn of(&self, cell: usize) -> impl Iterator<Item = (usize, &'s Sample)> {
        let own = &self.order[self.first[cell]..self.first[cell + 1]];
        own.iter().map(|&i| (i as usize, &self.samples[i as usize]))
    }
}

impl Beside {
    fn new(limit: &Limit<'_>, sample: &Sample) -> Self {
        let (point, normal) = limit.normal(sample.cell, sample.at);
        let off = sub(sample.point, point);
        let Some(side) = sample.border else {
            let towards = dot(off, normal);
            let is_nearest = towards * towards > TOWARDS * dot(off, off);
            return Self {
                off,
                direction: normal,
                towards: 1.0,
                across: if is_nearest { ALONG } else { 1.0 },
            };
        };
        let tangent = along_side(side, limit.at(sample.cell, sample.at).tangent);
        let length = norm(tangent);
        let direction = tangent.map(|x| if length > 0.0 { x / length } else { 0.0 });
        let along = dot(off, direction);
        let is_nearest = along * along < (1.0 - TOWARDS) * dot(off, off);
        Self {
            off,
            direction,
            towards: if is_nearest { ALONG } else { 1.0 },
            across: 1.0,
        }
    }

    /// A difference, with less of what is along the tangent plane, or along the border.
    fn weighed(&self, x: [f64; 3]) -> [f64; 3] {
        let towards = (self.towards - self.across) * dot(x, self.direction);
        [0, 1, 2].map(|i| self.across * x[i] + towards * self.direction[i])
    }
}

impl<'a> Equations<'a> {
    /// Prepares the pattern. `quads`: points of the quad mesh; `facets`: faces of the surface that samples are of, without those that lie in one plane with others.
    ///
    /// # Errors
    /// Too little memory.
    pub fn new(
        cage: &'a Cage,
        evaluator: &'a Evaluator,
        quads: &[[f64; 3]],
        facets: usize,
    ) -> Result<Self, SplineError> {
        let cells_a_facet = cage.cells.len() as f64 / facets.max(1) as f64;
        let fairness = 1.0 + FAIR_WITHIN_FACES * cells_a_facet.min(1.0).powi(2);
        let differences = differences(cage, quads);
        let mut pairs = Vec::new();
        for cell in 0..cage.cells.len() as u32 {
            let points = evaluator.points(cell);
            for (i, &a) in points.iter().enumerate() {
                pairs.extend(points[..i].iter().map(|&b| [a, b]));
            }
        }
        for difference in &differences {
            let points = &difference.points;
            for (i, &(a, _)) in points.iter().enumerate() {
                pairs.extend(points[..i].iter().map(|&(b, _)| [a, b]));
            }
        }
        Ok(Self {
            solver: SymmetricSolver::new(cage.vertices, &pairs)?,
            fairness: vec![fairness; cage.vertices],
            is_flat: false,
            cage,
            evaluator,
            differences,
        })
    }

    /// Control points for samples at their places.
    ///
    /// # Errors
    /// Equations without solution.
    pub fn solve(&mut self, samples: &[Sample]) -> Result<Vec<[f64; 3]>, SplineError> {
        let by_cell = ByCell::new(samples, self.cage.cells.len());
        let mut right = self.factorize(&by_cell)?;
        self.solver.solve(&mut right);
        let size = self.cage.vertices;
        let point = |v: usize| [0, 1, 2].map(|c| right[c * size + v]);
        Ok((0..size).map(point).collect())
    }

    /// Control points for samples that may move along tangent planes; `limit`: the surface whose nearest places they are at, `steps`: of conjugate gradients, [`GRADIENTS`] mostly.
    ///
    /// # Errors
    /// Equations without solution.
    pub fn step(
        &mut self,
        limit: &Limit<'_>,
        samples: &[Sample],
        steps: usize,
    ) -> Result<Vec<[f64; 3]>, SplineError> {
        let by_cell = ByCell::new(samples, self.cage.cells.len());
        self.factorize(&by_cell)?;
        let beside: Vec<Beside> = samples.par_iter().map(|s| Beside::new(limit, s)).collect();
        let given: Vec<f64> = (0..3)
            .flat_map(|c| limit.control.iter().map(move |p| p[c]))
            .collect();
        let mut residual = self.lacking(&by_cell, &beside, &given);
        let (mut moved, mut direction) = (vec![0.0; given.len()], vec![0.0; given.len()]);
        let mut before = f64::INFINITY;
        for _ in 0..steps {
            let mut solved = residual.clone();
            self.solver.solve(&mut solved);
            let now = product(&residual, &solved);
            for (d, s) in direction.iter_mut().zip(&solved) {
                *d = s + now / before * *d;
            }
            let image = self.image(&by_cell, &beside, &direction);
            let length = now / product(&direction, &image);
            // Where nothing is left to be gained.
            if !length.is_finite() {
                break;
            }
            for (i, d) in direction.iter().enumerate() {
                moved[i] += length * d;
                residual[i] -= length * image[i];
            }
            before = now;
        }
        let size = self.cage.vertices;
        let point = |v: usize| [0, 1, 2].map(|c| given[c * size + v] + moved[c * size + v]);
        Ok((0..size).map(point).collect())
    }

    fn fair(&self, samples: &[Sample]) -> f64 {
        let area: f64 = samples.iter().map(Sample::own_area).sum();
        FAIR * area / self.cage.vertices as f64
    }

    /// Factorises the matrix of distances to points, and gives the right side: all x, then y and z.
    fn factorize(&mut self, by_cell: &ByCell<'_>) -> Result<Vec<f64>, SplineError> {
        let blocks: Vec<Block> =
            parallel::map_numbers(self.cage.cells.len(), |cell| self.block(cell, by_cell));
        let size = self.cage.vertices;
        let fair = self.fair(by_cell.samples);
        // Nothing is left undetermined where no sample is.
        let mut diagonal = vec![1e-9 * fair; size];
        let mut right = vec![0.0; 3 * size];
        let mut off = Vec::new();
        for (cell, block) in blocks.iter().enumerate() {
            let points = self.evaluator.points(cell as u32);
            let n = points.len();
            for (i, &a) in points.iter().enumerate() {
                diagonal[a as usize] += block.normal[i * n + i];
                off.extend_from_slice(&block.normal[i * n..i * n + i]);
                for (c, x) in block.right[i].iter().enumerate() {
                    right[c * size + a as usize] += x;
                }
            }
        }
        for difference in &self.differences {
            let weight = fair * self.fairness[difference.at as usize];
            let points = &difference.points;
            for (i, &(a, x)) in points.iter().enumerate() {
                diagonal[a as usize] += weight * x * x;
                for (c, wanted) in self.wanted(difference).iter().enumerate() {
                    right[c * size + a as usize] += weight * x * wanted;
                }
                off.extend(points[..i].iter().map(|&(_, y)| weight * x * y));
            }
        }
        self.solver.factorize(&diagonal, &off)?;
        Ok(right)
    }

    fn block(&self, cell: usize, by_cell: &ByCell<'_>) -> Block {
        let n = self.evaluator.points(cell as u32).len();
        let mut block = Block {
            normal: vec![0.0; n * n],
            right: vec![[0.0; 3]; n],
        };
        let mut value = Vec::new();
        for (_, sample) in by_cell.of(cell) {
            self.evaluator.value(cell as u32, sample.at, &mut value);
            for (i, x) in value.iter().enumerate() {
                let x = sample.area * sample.weight * x;
                for (sum, y) in block.normal[i * n..=i * n + i].iter_mut().zip(&value) {
                    *sum += x * y;
                }
                for (sum, y) in block.right[i].iter_mut().zip(sample.point) {
                    *sum += x * y;
                }
            }
        }
        block
    }

    /// What distances to tangent planes and differences lack at control points, as a right side.
    fn lacking(&self, by_cell: &ByCell<'_>, beside: &[Beside], control: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; control.len()];
        self.add_samples(&mut sum, by_cell, None, |i, _| {
            beside[i].weighed(beside[i].off)
        });
        self.add_differences(&mut sum, by_cell.samples, |difference| {
            sub(
                self.wanted(difference),
                difference.sum(|v| self.at(control, v)),
            )
        });
        sum
    }

    /// The matrix of distances to tangent planes by a vector.
    fn image(&self, by_cell: &ByCell<'_>, beside: &[Beside], vector: &[f64]) -> Vec<f64> {
        let least = 1e-9 * self.fair(by_cell.samples);
        let mut sum: Vec<f64> = vector.iter().map(|x| least * x).collect();
        self.add_samples(&mut sum, by_cell, Some(vector), |i, x| beside[i].weighed(x));
        self.add_differences(&mut sum, by_cell.samples, |difference| {
            difference.sum(|v| self.at(vector, v))
        });
        sum
    }

    fn wanted(&self, difference: &Difference) -> [f64; 3] {
        if self.is_flat {
            return [0.0; 3];
        }
        difference.wanted
    }

    fn at(&self, vector: &[f64], v: u32) -> [f64; 3] {
        [0, 1, 2].map(|c| vector[c * self.cage.vertices + v as usize])
    }

    /// Adds to every point what `of` gives for samples, by weights of the point there; that gets the number of a sample and what the vector, if there is one, is there.
    fn add_samples(
        &self,
        sum: &mut [f64],
        by_cell: &ByCell<'_>,
        vector: Option<&[f64]>,
        of: impl Fn(usize, [f64; 3]) -> [f64; 3] + Sync,
    ) {
        let added = parallel::map_numbers(self.cage.cells.len(), |cell| {
            let points = self.evaluator.points(cell as u32);
            // Four numbers, of which the last is 0, are worked on at a time.
            let four = |[x, y, z]: [f64; 3]| [x, y, z, 0.0];
            let own = vector.map(|vector| points.iter().map(|&v| four(self.at(vector, v))));
            let own: Vec<[f64; 4]> = own.into_iter().flatten().collect();
            let mut added = vec![[0.0; 4]; points.len()];
            let mut value = Vec::new();
            for (i, sample) in by_cell.of(cell) {
                self.evaluator.value(cell as u32, sample.at, &mut value);
                let mut x = [0.0; 4];
                for (w, p) in value.iter().zip(&own) {
                    (0..4).for_each(|c| x[c] += w * p[c]);
                }
                let weight = sample.area * sample.weight;
                let x = four(of(i, [x[0], x[1], x[2]]).map(|x| weight * x));
                for (w, added) in value.iter().zip(&mut added) {
                    (0..4).for_each(|c| added[c] += w * x[c]);
                }
            }
            added
        });
        let size = self.cage.vertices;
        for (cell, added) in added.iter().enumerate() {
            let points = self.evaluator.points(cell as u32);
            for (&v, x) in points.iter().zip(added) {
                (0..3).for_each(|c| sum[c * size + v as usize] += x[c]);
            }
        }
    }

    /// The same for differences.
    fn add_differences(
        &self,
        sum: &mut [f64],
        samples: &[Sample],
        of: impl Fn(&Difference) -> [f64; 3],
    ) {
        let (size, fair) = (self.cage.vertices, self.fair(samples));
        for difference in &self.differences {
            let weight = fair * self.fairness[difference.at as usize];
            let x = of(difference);
            for &(v, w) in &difference.points {
                (0..3).for_each(|c| sum[c * size + v as usize] += weight * w * x[c]);
            }
        }
    }
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
#[path = "tests/equations.rs"]
mod tests;
