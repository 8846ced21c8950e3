//! The control points whose limit surface is nearest to samples of a surface.
//!
//! *Enters:* a control mesh and samples with their places. *Leaves:* control points, and the samples at the places nearest to them: [`Equations`] are solved, then places are moved to the nearest points of that surface, and so on (M. Halstead, M. Kass, T. DeRose 1993 for limit positions; J. Hoschek 1988 for places).
//! *Guaranteed:* the same bytes for any number of threads; where nothing folds with samples at their places on the map, nothing does in the end.

use super::equations::{Equations, GRADIENTS};
use super::error::SplineError;
use super::folds::{Folds, shortened, unfolded};
use super::gridded::Sample;
use super::limit::Limit;
use crate::geometry::mesh::{norm, sub};
use rayon::prelude::*;

/// Fits, one after each correction of places and one before.
const ROUNDS: usize = 10;
/// Samples this many times as far off as the root mean square count twice …
const FAR: f64 = 3.0;
/// … and none more often than this.
const MOST_WEIGHT: f64 = 8.0;
/// Samples that are moved in one go.
const RUN: usize = 256;

/// Fits, and moves the places of samples to the nearest points, in turn; samples that are far off count more in later rounds. Where cells fold with samples at their places on the map, these stay there and cells are made fairer until none does;
/// steps after that are shortened where cells would fold, and these made a little fairer. What folds all the same is made fairer again in the end, and if that does not help it is left as it is. Samples leave in the order of their cells on the map.
///
/// # Errors
/// Equations without solution.
pub fn fit(
    equations: &mut Equations<'_>,
    samples: &mut [Sample],
) -> Result<Vec<[f64; 3]>, SplineError> {
    let (cage, evaluator) = (equations.cage, equations.evaluator);
    // Those of a cell are read one after the other, many times.
    samples.sort_by_key(|s| s.cell);
    let given = samples.to_vec();
    let put_back = |samples: &mut [Sample], folds: &Folds| {
        for (sample, given) in samples.iter_mut().zip(&given) {
            if folds.is_in(given.cell) || folds.is_in(sample.cell) {
                *sample = *given;
            }
        }
    };
    let mut control = equations.solve(samples)?;
    let mut folds = Folds::of(equations, &control);
    if folds.any()
        && let Some(fairer) = unfolded(equations, &folds, samples)?
    {
        (control, folds) = (fairer, Folds::none(cage));
    }
    for _ in 1..ROUNDS {
        let limit = Limit::new(cage, evaluator, &control);
        move_places(&limit, samples);
        weigh(&limit, samples);
        put_back(samples, &folds);
        let wanted = equations.step(&limit, samples, GRADIENTS)?;
        (control, folds) = shortened(equations, &control, &wanted, &folds);
    }
    if folds.any() {
        put_back(samples, &folds);
        if let Some(fairer) = unfolded(equations, &folds, samples)? {
            control = fairer;
        }
    }
    move_places(&Limit::new(cage, evaluator, &control), samples);
    Ok(control)
}

/// Weights of samples for the next fit: more where they are far off.
fn weigh(limit: &Limit<'_>, samples: &mut [Sample]) {
    let off: Vec<f64> = samples
        .par_iter()
        .map(|s| norm(sub(limit.at(s.cell, s.at).point, s.point)))
        .collect();
    let area: f64 = samples.iter().map(Sample::own_area).sum();
    let squares = samples.iter().zip(&off).map(|(s, d)| s.own_area() * d * d);
    let squares: f64 = squares.sum();
    let large = FAR * (squares / area).sqrt();
    if large > 0.0 {
        for (sample, d) in samples.iter_mut().zip(&off) {
            sample.weight = (1.0 + (d / large).powi(2)).min(MOST_WEIGHT);
        }
    }
}

/// Moves the places of samples to the nearest points of a surface, or of its border.
pub fn move_places(limit: &Limit<'_>, samples: &mut [Sample]) {
    samples.par_chunks_mut(RUN).for_each(|run| {
        for sample in run {
            let mut place = sample.place();
            match &mut sample.border {
                Some(side) => (place, *side) = limit.nearest_on_border(sample.point, place, *side),
                None => place = limit.nearest(sample.point, place),
            }
            (sample.cell, sample.at) = (place.cell, place.at);
        }
    });
}
