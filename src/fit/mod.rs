//! Bicubic B-spline surfaces through the geometry images of rectangles.
//!
//! *Enters:* [`Grids`]: the samples of rectangles, full grids from corner to corner, and the seams between them. *Leaves:* [`Surfaces`]: one
//! tensor-product surface a rectangle over uniform open knots, and which sides meet; `measure` says how far they are off.
//!
//! ```text
//! seams → sides that meet → corner points → one curve a shared side → the inside of every patch
//! ```
//!
//! A corner is the mean of the samples that stand for it (equal up to rounding). A curve between two corners is fitted once, to the mean of the
//! samples on both sides of it, and both patches get its control points. Then the inner control points of a patch are fitted with
//! its border fixed: what the border leaves of the samples is fitted by rows and then by columns, which is the least squares
//! solution of the whole grid, since the equations are a Kronecker product.
//!
//! *Guaranteed:* patches meet without gaps: both have the same control points along a shared side, to the last bit, and the same knots; the same
//! result for any number of threads. *Not guaranteed:* tangents that agree across sides (the surfaces are C² inside and C⁰ between), and a normal
//! everywhere: at a corner where the angle of a patch is 0 or π there is none, and where samples crowd beside a bent side, knot intervals may be too long for it and the surface
//! folds (`measure` says how much of it does).
//!
//! C. de Boor, *A Practical Guide to Splines* (1978), chapter XVII for tensor products; L. Piegl, W. Tiller, *The NURBS Book*
//! (1997), 9.4.

mod basis;
mod error;
mod least_squares;
mod measure;
mod neighbours;
mod stored;
mod surface;

#[cfg(test)]
mod tests;

pub use basis::{Basis, DEGREE};
pub use error::FitError;
pub use least_squares::{LeastSquares, parameter};
pub use measure::{Errors, Measured, PatchErrors, SeamErrors, measure};
pub use neighbours::{Interface, Lattice, Neighbours, PatchSide, neighbours};
pub use stored::grids;
pub use surface::{BSplineSurface, Jet, Side};

use crate::atlas::patches::Seam;
use crate::geometry::mesh::{bounding_box, distance};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Sample steps a knot interval: sixteen samples for one control point.
pub const DEFAULT_SPACING: f64 = 4.0;
/// With fewer samples a knot interval control points follow the noise of single samples.
pub const LEAST_SPACING: f64 = 2.0;
/// Part of the diagonal by which samples of one corner may differ: float32 keeps 1e-7 of a coordinate, which is at most ten diagonals.
const CORNER_TOLERANCE: f64 = 1e-5;

/// Samples of one rectangle.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Its size in samples and in patch coordinates.
    pub lattice: Lattice,
    /// Points in space, u fastest, from the lower left corner on.
    pub points: Vec<[f64; 3]>,
}

/// Everything that surfaces are fitted to.
#[derive(Clone, Debug)]
pub struct Grids {
    /// One a patch.
    pub patches: Vec<Grid>,
    /// Where they meet.
    pub seams: Vec<Seam>,
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
/// Too few samples, seams that do not bound rectangles, and corners that are far apart.
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
    let lattices: Vec<Lattice> = grids.patches.iter().map(|grid| grid.lattice).collect();
    let neighbours = neighbours(&lattices, &grids.seams)?;
    let corners = corner_points(&grids.patches, &neighbours)?;
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
        let [columns, rows] = grid.lattice.samples;
        for samples in [columns, rows] {
            if fitters.contains_key(&samples) {
                continue;
            }
            let basis = Basis::for_samples(samples, spacing).ok_or(FitError::TooFewSamples {
                patch,
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
    let [columns, rows] = grid.lattice.samples;
    let (right, top) = (columns - 1, (rows - 1) * columns);
    grid.points[[0, right, top + right, top][corner]]
}

/// One point a corner: the mean of the samples there.
fn corner_points(grids: &[Grid], neighbours: &Neighbours) -> Result<Vec<[f64; 3]>, FitError> {
    let mut sum = vec![([0.0; 3], 0.0); neighbours.corners];
    for (grid, numbers) in grids.iter().zip(&neighbours.corner) {
        for (corner, &number) in numbers.iter().enumerate() {
            let point = corner_of(grid, corner);
            let (total, count) = &mut sum[number];
            *total = std::array::from_fn(|c| total[c] + point[c]);
            *count += 1.0;
        }
    }
    let points: Vec<[f64; 3]> = sum
        .into_iter()
        .map(|(total, count)| total.map(|x| x / count))
        .collect();
    let boxes: Vec<[f64; 3]> = grids
        .iter()
        .flat_map(|grid| <[[f64; 3]; 2]>::from(bounding_box(&grid.points)))
        .collect();
    let (low, high) = bounding_box(&boxes);
    let diagonal = distance(low, high);
    for (patch, (grid, numbers)) in grids.iter().zip(&neighbours.corner).enumerate() {
        for (corner, &number) in numbers.iter().enumerate() {
            let off = distance(corner_of(grid, corner), points[number]);
            if off > CORNER_TOLERANCE * diagonal {
                return Err(FitError::CornersApart {
                    patch,
                    corner,
                    distance: off,
                    relative: off / diagonal,
                });
            }
        }
    }
    Ok(points)
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
        let places = s.side.grid(grid.lattice.samples);
        places.into_iter().map(|i| grid.points[i]).collect()
    };
    let curve = |s: PatchSide, samples: &[[f64; 3]]| {
        let ends = s.side.corners().map(|k| neighbours.corner[s.patch][k]);
        fitters[&samples.len()].fit(samples, ends.map(|number| corners[number]))
    };
    let shared: Vec<Vec<[f64; 3]>> = neighbours
        .interfaces
        .par_iter()
        .map(|interface| {
            let mut points = samples(interface.first);
            let mut others = samples(interface.second);
            if interface.reversed {
                others.reverse();
            }
            for (point, other) in points.iter_mut().zip(others) {
                *point = std::array::from_fn(|c| 0.5 * (point[c] + other[c]));
            }
            curve(interface.first, &points)
        })
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
        sides[s.patch][s.side as usize] = curve(s, &samples(s));
    }
    sides
}

/// The surface of a patch whose border is known.
fn inside(grid: &Grid, border: &[Vec<[f64; 3]>; 4], fitters: &Fitters) -> BSplineSurface {
    let [columns, rows] = grid.lattice.samples;
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
