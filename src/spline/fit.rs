//! The control points whose limit surface is nearest to samples of a surface.
//!
//! *Enters:* a control mesh and samples with their places. *Leaves:* control points, and the samples at the places nearest to them. Σ area · |surface − sample|² and a little of the squares by which second differences of control points differ from those of the quad mesh are minimised
//! by one sparse Cholesky factorisation; then places are moved to the nearest points of that surface, and so on (M. Halstead, M. Kass, T. DeRose 1993 for limit positions; J. Hoschek 1988 for places). *Guaranteed:* the same bytes for any number of threads.

use super::cage::{Cage, CellSide, Kind};
use super::error::SplineError;
use super::evaluator::Evaluator;
use super::gridded::Sample;
use super::limit::{Limit, Place};
use super::measure::shape;
use crate::flow::solve::SymmetricSolver;
use crate::geometry::mesh::{norm, sub};
use crate::parallel;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Weight of squares of second differences beside those of distances.
const FAIR: f64 = 1e-6;
/// Fits, one after each correction of places and one before.
const ROUNDS: usize = 6;
/// Samples this many times as far off as the root mean square count twice …
const FAR: f64 = 4.0;
/// … and none more often than this.
const MOST_WEIGHT: f64 = 8.0;
/// Where the surface folds it is made fairer by this factor, up to so much: by then it is as important as distances. After the last round it is so many times at most, first at corners of cells that fold and then at all points that these depend on.
const FAIRER: f64 = 3.0;
const FAIREST: f64 = 8.1e5;
const MOST_SMOOTHINGS: usize = 18;
const NARROW_SMOOTHINGS: usize = 8;
/// Samples that are moved in one go.
const RUN: usize = 256;

/// A sum of control points that is to be near to one of points of the quad mesh.
#[derive(Clone)]
struct Difference {
    points: Vec<(u32, f64)>,
    /// The point that it is about.
    at: u32,
    /// That of the quad mesh.
    wanted: [f64; 3],
}

/// The equations of a control mesh.
pub struct Fitter<'a> {
    cage: &'a Cage,
    evaluator: &'a Evaluator,
    solver: SymmetricSolver,
    differences: Vec<Difference>,
    /// Of each point, how many times the usual weight its differences have.
    fairness: Vec<f64>,
}

/// What a cell adds: products of weights, and of weights with samples.
#[derive(Default)]
struct Block {
    normal: Vec<f64>,
    right: Vec<[f64; 3]>,
}

impl<'a> Fitter<'a> {
    /// Prepares the pattern. `quads`: points of the quad mesh.
    ///
    /// # Errors
    /// Too little memory.
    pub fn new(
        cage: &'a Cage,
        evaluator: &'a Evaluator,
        quads: &[[f64; 3]],
    ) -> Result<Self, SplineError> {
        let mut differences = differences(cage);
        for difference in &mut differences {
            for &(v, x) in &difference.points {
                (0..3).for_each(|i| difference.wanted[i] += x * quads[v as usize][i]);
            }
        }
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
            fairness: vec![1.0; cage.vertices],
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
        let cells = self.cage.cells.len();
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
        let blocks: Vec<Block> = parallel::map_numbers(cells, |cell| {
            let own = &order[first[cell]..first[cell + 1]];
            self.block(cell as u32, own.iter().map(|&i| &samples[i as usize]))
        });
        let size = self.cage.vertices;
        let area: f64 = samples.iter().map(|s| s.area).sum();
        let fair = FAIR * area / size as f64;
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
                for (c, wanted) in difference.wanted.iter().enumerate() {
                    right[c * size + a as usize] += weight * x * wanted;
                }
                off.extend(points[..i].iter().map(|&(_, y)| weight * x * y));
            }
        }
        self.solver.factorize(&diagonal, &off)?;
        self.solver.solve(&mut right);
        Ok((0..size)
            .map(|v| [0, 1, 2].map(|c| right[c * size + v]))
            .collect())
    }

    fn block<'s>(&self, cell: u32, samples: impl Iterator<Item = &'s Sample>) -> Block {
        let n = self.evaluator.points(cell).len();
        let mut block = Block {
            normal: vec![0.0; n * n],
            right: vec![[0.0; 3]; n],
        };
        for sample in samples {
            let value = &self.evaluator.value(cell, sample.at);
            for (i, x) in value.iter().enumerate() {
                let x = sample.area * sample.weight * x;
                for (sum, y) in block.normal[i * n..=i * n + i].iter_mut().zip(value) {
                    *sum += x * y;
                }
                for (sum, y) in block.right[i].iter_mut().zip(sample.point) {
                    *sum += x * y;
                }
            }
        }
        block
    }

    /// Fits, and moves the places of samples to the nearest points, in turn; samples that are far off count more in later rounds. Where a cell folds, samples stay where the map has them, and
    /// where it still does it is made fairer, at first such that it becomes like the quad mesh, and where that does not do, flat. What folds in the end all the same is left as it was after the last correction of places.
    ///
    /// # Errors
    /// Equations without solution.
    pub fn fit(&mut self, samples: &mut [Sample]) -> Result<Vec<[f64; 3]>, SplineError> {
        let mut folds = Folds {
            given: samples.iter().map(Sample::place).collect(),
            times: vec![0; self.cage.cells.len()],
        };
        for round in 1..ROUNDS {
            let control = self.solve(samples)?;
            let limit = Limit::new(self.cage, self.evaluator, &control);
            move_places(&limit, samples);
            weigh(&limit, samples);
            if round > 1 {
                self.make_fairer(&mut folds, &shape(&limit).1, samples, false);
            }
        }
        let control = self.solve(samples)?;
        let limit = Limit::new(self.cage, self.evaluator, &control);
        let folded = shape(&limit).1;
        if !folded.is_empty() {
            let fairness = self.fairness.clone();
            for is_flat in [false, true] {
                self.fairness.clone_from(&fairness);
                let mut tried = samples.to_vec();
                let unfolded = self.unfolded(folds.clone(), &folded, &mut tried, is_flat)?;
                if let Some(control) = unfolded {
                    samples.copy_from_slice(&tried);
                    return Ok(control);
                }
            }
        }
        move_places(&limit, samples);
        Ok(control)
    }

    /// Control points with which nothing folds, and samples at their places, if fairness leads there; `is_flat`: not to the quad mesh, but to a flat one.
    fn unfolded(
        &mut self,
        mut folds: Folds,
        folded: &[u32],
        samples: &mut [Sample],
        is_flat: bool,
    ) -> Result<Option<Vec<[f64; 3]>>, SplineError> {
        let given = self.differences.clone();
        if is_flat {
            let wanted = self.differences.iter_mut().map(|d| &mut d.wanted);
            wanted.for_each(|wanted| *wanted = [0.0; 3]);
        }
        let mut folded = folded.to_vec();
        for smoothing in 0..MOST_SMOOTHINGS {
            self.make_fairer(&mut folds, &folded, samples, smoothing > NARROW_SMOOTHINGS);
            let control = self.solve(samples)?;
            let limit = Limit::new(self.cage, self.evaluator, &control);
            folded = shape(&limit).1;
            if folded.is_empty() {
                move_places(&limit, samples);
                return Ok(Some(control));
            }
        }
        self.differences = given;
        Ok(None)
    }

    /// Puts samples of cells that fold, or did, where the map has them, and makes those fairer that folded before.
    fn make_fairer(
        &mut self,
        folds: &mut Folds,
        folded: &[u32],
        samples: &mut [Sample],
        is_wide: bool,
    ) {
        folded
            .iter()
            .for_each(|&cell| folds.times[cell as usize] += 1);
        for (sample, place) in samples.iter_mut().zip(&folds.given) {
            let has_folded = |cell: u32| folds.times[cell as usize] > 0;
            if has_folded(place.cell) || has_folded(sample.cell) {
                (sample.cell, sample.at, sample.weight) = (place.cell, place.at, 1.0);
            }
        }
        let again = folded
            .iter()
            .filter(|cell| folds.times[**cell as usize] > 1);
        let mut is_near = vec![false; self.cage.vertices];
        for &cell in again {
            let points = match is_wide {
                true => self.evaluator.points(cell),
                false => &self.cage.cells[cell as usize],
            };
            points.iter().for_each(|&v| is_near[v as usize] = true);
        }
        let near = self.fairness.iter_mut().zip(&is_near);
        for (fairness, _) in near.filter(|(_, near)| **near) {
            *fairness = (*fairness * FAIRER).min(FAIREST);
        }
    }
}

/// Where cells fold.
#[derive(Clone)]
struct Folds {
    /// Of each sample, its place on the map.
    given: Vec<Place>,
    /// Of each cell, how many times it did.
    times: Vec<usize>,
}

/// Weights of samples for the next fit: more where they are far off.
fn weigh(limit: &Limit<'_>, samples: &mut [Sample]) {
    let off: Vec<f64> = samples
        .par_iter()
        .map(|s| norm(sub(limit.at(s.cell, s.at).point, s.point)))
        .collect();
    let area: f64 = samples.iter().map(|s| s.area).sum();
    let squares: f64 = samples.iter().zip(&off).map(|(s, d)| s.area * d * d).sum();
    let large = FAR * (squares / area).sqrt();
    if large > 0.0 {
        for (sample, d) in samples.iter_mut().zip(&off) {
            sample.weight = (1.0 + (d / large).powi(2)).min(MOST_WEIGHT);
        }
    }
}

/// Moves the places of samples to the nearest points of a surface.
pub fn move_places(limit: &Limit<'_>, samples: &mut [Sample]) {
    samples.par_chunks_mut(RUN).for_each(|run| {
        for sample in run {
            let place = limit.nearest(sample.point, sample.place());
            (sample.cell, sample.at) = (place.cell, place.at);
        }
    });
}

/// Second differences along both lines through a regular point, along creases, and along lines through points with three cells or more between two creases; and how far the edges at an irregular point are from flat.
fn differences(cage: &Cage) -> Vec<Difference> {
    let kinds = cage.kinds();
    let mut all = Vec::new();
    for (v, side) in cage.leaving().into_iter().enumerate() {
        let Some(side) = side else { continue };
        let at = v as u32;
        let star = cage.star(side);
        let end = |&(c, k): &(u32, u8)| cage.cells[c as usize][usize::from((k + 1) & 3)];
        let second = |a: u32, b: u32| Difference {
            points: vec![(at, -2.0), (a, 1.0), (b, 1.0)],
            at,
            wanted: [0.0; 3],
        };
        match kinds[v] {
            Kind::Smooth if star.len() == 4 => {
                all.push(second(end(&star[0]), end(&star[2])));
                all.push(second(end(&star[1]), end(&star[3])));
            }
            Kind::Smooth | Kind::Dart => {
                let ends: Vec<u32> = star.iter().map(end).collect();
                all.extend(from_flat(at, &ends));
            }
            kind => {
                let least = if kind == Kind::Crease { 3 } else { 4 };
                let sectors = sectors(cage, &star);
                let mut lines: Vec<[u32; 2]> = sectors
                    .iter()
                    .filter(|ends| ends.len() >= least)
                    .flat_map(|ends| ends.iter().zip(&ends[2..]))
                    .map(|(&a, &b)| [a.min(b), a.max(b)])
                    .collect();
                lines.sort_unstable();
                lines.dedup();
                all.extend(lines.into_iter().map(|[a, b]| second(a, b)));
            }
        }
    }
    all
}

/// Of the cells between two creases around a point, the ends of the edges that leave it, creases first and last.
fn sectors(cage: &Cage, star: &[CellSide]) -> Vec<Vec<u32>> {
    let mut star = star.to_vec();
    let first = star.iter().position(|&s| cage.is_crease(s));
    star.rotate_left(first.unwrap_or(0));
    let mut sectors: Vec<Vec<u32>> = Vec::new();
    for &(c, k) in &star {
        let corners = cage.cells[c as usize];
        let end = |k: u8| corners[usize::from(k & 3)];
        if cage.is_crease((c, k)) || sectors.is_empty() {
            sectors.push(vec![end(k + 1)]);
        }
        if let Some(sector) = sectors.last_mut() {
            sector.push(end(k + 3));
        }
    }
    sectors
}

/// How far edges that leave a point are from those of a regular polygon after an affine map: waves around it but those that turn once. With four edges their squares add up to those of both second differences.
fn from_flat(at: u32, ends: &[u32]) -> Vec<Difference> {
    let n = ends.len();
    let wave = |k: usize, shift: f64| {
        let turn = 2.0 * PI * k as f64 / n as f64;
        // Sums of squares of a constant and of an alternating wave are twice those of others.
        let size = if (2 * k).is_multiple_of(n) { 2.0 } else { 4.0 };
        let weight = |i: usize| (size / n as f64).sqrt() * (turn * i as f64 - shift).cos();
        let weights: Vec<f64> = (0..n).map(weight).collect();
        let mut points: Vec<(u32, f64)> = ends.iter().copied().zip(weights.clone()).collect();
        points.push((at, -weights.iter().sum::<f64>()));
        Difference {
            points,
            at,
            wanted: [0.0; 3],
        }
    };
    let mut all = vec![wave(0, 0.0)];
    for k in 2..=n / 2 {
        all.push(wave(k, 0.0));
        if 2 * k < n {
            all.push(wave(k, PI / 2.0));
        }
    }
    all
}

#[cfg(test)]
#[path = "tests/fit.rs"]
mod tests;
