//! Bicubic B-spline surfaces through the geometry images of a grid.
//!
//! *Enters:* [`Grids`]: samples of parts of blocks, full grids from corner to corner, and which of their sides are one curve. *Leaves:* [`Surfaces`]: one
//! tensor-product surface a part over uniform open knots, and how they lie side by side; `measure` says how far they are off.
//!
//! ```text
//! blocks → parts without T-junctions → one point a corner → one curve a shared side → the inside of every part
//! ```
//!
//! Blocks of a grid have T-junctions, but tensor-product surfaces that share control points along their sides have none: [`divide`] goes on with lines
//! until whole sides meet. A curve between two corners is fitted once, and both surfaces get its control points. Then the inner control points of a surface are fitted with
//! its border fixed: what the border leaves of the samples is fitted by rows and then by columns, which is the least squares
//! solution of the whole grid, since the equations are a Kronecker product.
//!
//! *Guaranteed:* surfaces meet without gaps: both have the same control points along a shared side, to the last bit, and the same knots; the same
//! result for any number of threads. *Not guaranteed:* tangents that agree across sides (the surfaces are C² inside and C⁰ between), and surfaces that are nowhere turned over:
//! `measure` says how much of them is.
//!
//! C. de Boor, *A Practical Guide to Splines* (1978), chapter XVII for tensor products; L. Piegl, W. Tiller, *The NURBS Book*
//! (1997), 9.4.

mod basis;
mod blocks;
mod division;
mod error;
mod least_squares;
mod measure;
mod neighbours;
mod side;
mod stored;
mod surface;

#[cfg(test)]
mod tests;

pub use basis::{Basis, DEGREE};
pub use blocks::{Block, Blocks};
pub use division::{Division, Part, divide};
pub use error::FitError;
pub use least_squares::{LeastSquares, parameter};
pub use measure::{Errors, Measured, PatchErrors, SeamErrors, measure};
pub use neighbours::Neighbours;
pub use side::{Interface, PatchSide, Side};
pub use stored::grids;
pub use surface::{BSplineSurface, Jet};

use rayon::prelude::*;
use std::collections::BTreeMap;

/// Sample steps a knot interval: sixteen samples for one control point.
pub const DEFAULT_SPACING: f64 = 4.0;
/// With fewer samples a knot interval control points follow the noise of single samples.
pub const LEAST_SPACING: f64 = 2.0;
/// Samples of a part of a block.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Which.
    pub part: Part,
    /// Columns and rows.
    pub samples: [usize; 2],
    /// Points in space, u fastest, from the lower left corner on.
    pub points: Vec<[f64; 3]>,
}

/// Everything that surfaces are fitted to.
#[derive(Clone, Debug, PartialEq)]
pub struct Grids {
    /// One a surface.
    pub patches: Vec<Grid>,
    /// Which of their sides are one curve: there they have the same samples. Where they have not, those of the first count.
    pub interfaces: Vec<Interface>,
}

/// Fitted surfaces.
#[derive(Clone, Debug, PartialEq)]
pub struct Surfaces {
    /// One a patch.
    pub patches: Vec<BSplineSurface>,
    /// How they lie side by side.
    pub neighbours: Neighbours,
    /// Control points of all, shared ones counted once.
    pub control_points: usize,
}

/// Fits surfaces whose knot intervals take about `spacing` sample steps.
///
/// # Errors
/// Too few samples, and interfaces that do not fit the grids.
pub fn fit(grids: &Grids, spacing: f64) -> Result<Surfaces, FitError> {
    // Not a number is refused, too.
    if !(spacing >= LEAST_SPACING && spacing.is_finite()) {
        return Err(FitError::Spacing {
            spacing,
            least: LEAST_SPACING,
        });
    }
    if grids.patches.is_empty() {
        return Err(FitError::NoPatches);
    }
    let fitters = fitters(&grids.patches, spacing)?;
    let samples: Vec<[usize; 2]> = grids.patches.iter().map(|grid| grid.samples).collect();
    let neighbours = Neighbours::new(&samples, grids.interfaces.clone())?;
    let corners = corner_points(&grids.patches, &neighbours);
    let curves = curves(&grids.patches, &neighbours, &corners, &fitters);
    let patches: Vec<BSplineSurface> = grids
        .patches
        .par_iter()
        .zip(&curves)
        .map(|(grid, border)| inside(grid, border, &fitters))
        .collect();
    let inner: usize = patches
        .iter()
        .map(|s| (s.size()[0] - 2) * (s.size()[1] - 2))
        .sum();
    let between = neighbours.interfaces.iter().map(|i| i.first);
    let on_curves: usize = between
        .chain(neighbours.boundary.iter().copied())
        .map(|s| patches[s.patch].size()[s.side.along()] - 2)
        .sum();
    Ok(Surfaces {
        control_points: inner + on_curves + neighbours.corners,
        patches,
        neighbours,
    })
}

/// The fitting of every number of samples that a side has.
type Fitters = BTreeMap<usize, LeastSquares>;

fn fitters(grids: &[Grid], spacing: f64) -> Result<Fitters, FitError> {
    let mut fitters = Fitters::new();
    for (patch, grid) in grids.iter().enumerate() {
        let [columns, rows] = grid.samples;
        for samples in [columns, rows] {
            if fitters.contains_key(&samples) {
                continue;
            }
            let basis = Basis::for_samples(samples, spacing).ok_or(FitError::TooFewSamples {
                block: grid.part.block,
                columns,
                rows,
            })?;
            let fitter = LeastSquares::new(samples, basis).ok_or(FitError::Undetermined {
                samples,
                control_points: basis.count(),
            })?;
            fitters.insert(samples, fitter);
        }
        if grid.points.len() != columns * rows {
            return Err(FitError::GridSize {
                patch,
                columns,
                rows,
                points: grid.points.len(),
            });
        }
    }
    Ok(fitters)
}

/// Where the corners of a grid stand.
fn corner_of(grid: &Grid, corner: usize) -> [f64; 3] {
    let [columns, rows] = grid.samples;
    let (right, top) = (columns - 1, (rows - 1) * columns);
    grid.points[[0, right, top + right, top][corner]]
}

/// One point a corner: the first sample there.
fn corner_points(grids: &[Grid], neighbours: &Neighbours) -> Vec<[f64; 3]> {
    let mut points = vec![None; neighbours.corners];
    for (grid, numbers) in grids.iter().zip(&neighbours.corner) {
        for (corner, &number) in numbers.iter().enumerate() {
            points[number].get_or_insert_with(|| corner_of(grid, corner));
        }
    }
    points.into_iter().flatten().collect()
}

/// Control points of the four sides of every patch, each side in the direction of its parameter.
fn curves(
    grids: &[Grid],
    neighbours: &Neighbours,
    corners: &[[f64; 3]],
    fitters: &Fitters,
) -> Vec<[Vec<[f64; 3]>; 4]> {
    let samples = |s: PatchSide| -> Vec<[f64; 3]> {
        let grid = &grids[s.patch];
        let places = s.side.grid(grid.samples);
        places.into_iter().map(|i| grid.points[i]).collect()
    };
    let curve = |s: PatchSide| {
        let samples = samples(s);
        let ends = s.side.corners().map(|k| neighbours.corner[s.patch][k]);
        fitters[&samples.len()].fit(&samples, ends.map(|number| corners[number]))
    };
    let shared: Vec<Vec<[f64; 3]>> = neighbours
        .interfaces
        .par_iter()
        .map(|interface| curve(interface.first))
        .collect();
    let mut sides = vec![[const { Vec::new() }; 4]; grids.len()];
    for (interface, control) in neighbours.interfaces.iter().zip(shared) {
        let mut other = control.clone();
        if interface.reversed {
            other.reverse();
        }
        for (s, control) in [(interface.first, control), (interface.second, other)] {
            sides[s.patch][s.side as usize] = control;
        }
    }
    for &s in &neighbours.boundary {
        sides[s.patch][s.side as usize] = curve(s);
    }
    sides
}

/// The surface of a patch whose border is known.
fn inside(grid: &Grid, border: &[Vec<[f64; 3]>; 4], fitters: &Fitters) -> BSplineSurface {
    let [columns, rows] = grid.samples;
    let (by_u, by_v) = (&fitters[&columns], &fitters[&rows]);
    let mut surface = BSplineSurface {
        basis: [by_u.basis(), by_v.basis()],
        control: vec![[0.0; 3]; by_u.basis().count() * by_v.basis().count()],
    };
    let size = surface.size();
    for side in Side::ALL {
        for (place, &point) in side.grid(size).into_iter().zip(&border[side as usize]) {
            surface.control[place] = point;
        }
    }
    let nothing = [[0.0; 3]; 2];
    // Rows of samples to rows of inner control points, and the same by columns.
    let fitted: Vec<Vec<[f64; 3]>> = (0..rows)
        .map(|k| {
            let rest: Vec<[f64; 3]> = (0..columns)
                .map(|i| {
                    let known = surface.combine(by_u.row(i), by_v.row(k)).point;
                    let sample = grid.points[k * columns + i];
                    std::array::from_fn(|c| sample[c] - known[c])
                })
                .collect();
            by_u.fit(&rest, nothing)
        })
        .collect();
    for i in 1..size[0] - 1 {
        let column: Vec<[f64; 3]> = fitted.iter().map(|row| row[i]).collect();
        let control = by_v.fit(&column, nothing);
        for (k, &point) in control.iter().enumerate().take(size[1] - 1).skip(1) {
            surface.control[k * size[0] + i] = point;
        }
    }
    surface
}
