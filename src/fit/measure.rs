//! How far fitted surfaces are from their samples, from the surface that was sampled, and from each other.
//!
//! *Enters:* grids, their surfaces, and a triangle mesh. *Leaves:* [`Measured`]. *Guaranteed:* distances of single points to rounding;
//! the same for any number of threads. *Not guaranteed:* maxima between the points that were looked at: samples, middles of
//! the cells between them, and [`STEPS`] points a sample step along shared sides.

use super::basis::Local;
use super::{BSplineSurface, FitError, Grid, Grids, Interface, Surfaces, parameter};
use crate::geometry::deviation::{Triangles, angle, distances};
use crate::geometry::mesh::{bounding_box, cross, distance, dot, norm, sub};
use rayon::prelude::*;

/// Points along a shared side for every step between two samples.
const STEPS: usize = 2;

/// Root mean square and maximum of distances.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Source units.
    pub rms: f64,
    /// Source units.
    pub max: f64,
}

/// Errors of one patch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PatchErrors {
    /// Of the surface at the parameters of the samples from the samples, each counting the same.
    pub samples: Errors,
    /// Of the surface in the middle of every cell of samples from the mesh, by area.
    pub surface: Errors,
    /// The part of the surface's area that is turned over: its normal in the middle of a cell points away from that of the cell.
    pub folded: f64,
}

/// What lies between two patches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SeamErrors {
    /// Largest distance between the points of both sides at one parameter, source units.
    pub gap: f64,
    /// Mean angle between the normals of both sides, radians, by length.
    pub mean_normal_angle: f64,
    /// The largest such angle.
    pub max_normal_angle: f64,
}

/// All errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// One a patch.
    pub patches: Vec<PatchErrors>,
    /// One an interface.
    pub seams: Vec<SeamErrors>,
    /// Over all patches.
    pub all: PatchErrors,
    /// Over all interfaces.
    pub all_seams: SeamErrors,
    /// Diagonal of the mesh's bounding box, source units.
    pub diagonal: f64,
}

/// Sums of squares over points that count differently.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    squares: f64,
    weight: f64,
    max: f64,
    /// Weight of what is turned over.
    folded: f64,
}

impl Sums {
    fn add(&mut self, distance: f64, weight: f64) {
        self.squares += weight * distance * distance;
        self.weight += weight;
        self.max = self.max.max(distance);
    }

    fn join(self, other: Sums) -> Sums {
        Sums {
            squares: self.squares + other.squares,
            weight: self.weight + other.weight,
            max: self.max.max(other.max),
            folded: self.folded + other.folded,
        }
    }

    /// A sum by weight.
    fn mean(self, sum: f64) -> f64 {
        match self.weight > 0.0 {
            true => sum / self.weight,
            false => 0.0,
        }
    }

    fn errors(self) -> Errors {
        Errors {
            rms: self.mean(self.squares).sqrt(),
            max: self.max,
        }
    }
}

/// The middle of a cell of samples on the surface.
struct Middle {
    point: [f64; 3],
    /// Of the surface, about.
    area: f64,
    is_folded: bool,
}

/// Angles along shared sides.
#[derive(Clone, Copy, Debug, Default)]
struct Along {
    gap: f64,
    angles: f64,
    length: f64,
    largest: f64,
}

impl Along {
    fn errors(self) -> SeamErrors {
        SeamErrors {
            gap: self.gap,
            mean_normal_angle: if self.length > 0.0 {
                self.angles / self.length
            } else {
                0.0
            },
            max_normal_angle: self.largest,
        }
    }
}

/// Measures surfaces against their samples, a mesh, and each other.
///
/// # Errors
/// A mesh without faces.
pub fn measure(
    grids: &Grids,
    surfaces: &Surfaces,
    mesh: Triangles<'_>,
) -> Result<Measured, FitError> {
    let from_samples: Vec<Sums> = grids
        .patches
        .par_iter()
        .zip(&surfaces.patches)
        .map(|(grid, surface)| {
            let [columns, rows] = grid.samples;
            let (us, vs) = (
                row_of(surface.basis[0], columns),
                row_of(surface.basis[1], rows),
            );
            let mut sums = Sums::default();
            for (k, v) in vs.iter().enumerate() {
                for (i, u) in us.iter().enumerate() {
                    let point = surface.combine(u, v).point;
                    sums.add(distance(point, grid.points[k * columns + i]), 1.0);
                }
            }
            sums
        })
        .collect();
    let middles: Vec<Vec<Middle>> = grids
        .patches
        .par_iter()
        .zip(&surfaces.patches)
        .map(|(grid, surface)| middles(grid, surface))
        .collect();
    let points: Vec<[f64; 3]> = middles.iter().flatten().map(|m| m.point).collect();
    let mut off = distances(&points, mesh)
        .ok_or(FitError::NoSurface)?
        .into_iter();
    let from_mesh: Vec<Sums> = middles
        .iter()
        .map(|patch| {
            let mut sums = Sums::default();
            for (middle, distance) in patch.iter().zip(&mut off) {
                sums.add(distance, middle.area);
                if middle.is_folded {
                    sums.folded += middle.area;
                }
            }
            sums
        })
        .collect();
    let along: Vec<Along> = surfaces
        .neighbours
        .interfaces
        .par_iter()
        .map(|interface| across(grids, surfaces, interface))
        .collect();
    let errors = |samples: Sums, surface: Sums| PatchErrors {
        samples: samples.errors(),
        surface: surface.errors(),
        folded: surface.mean(surface.folded),
    };
    let total = |sums: &[Sums]| sums.iter().copied().fold(Sums::default(), Sums::join);
    let all_along = along.iter().fold(Along::default(), |a, b| Along {
        gap: a.gap.max(b.gap),
        angles: a.angles + b.angles,
        length: a.length + b.length,
        largest: a.largest.max(b.largest),
    });
    let (low, high) = bounding_box(mesh.positions);
    Ok(Measured {
        patches: from_samples
            .iter()
            .zip(&from_mesh)
            .map(|(&samples, &surface)| errors(samples, surface))
            .collect(),
        seams: along.into_iter().map(Along::errors).collect(),
        all: errors(total(&from_samples), total(&from_mesh)),
        all_seams: all_along.errors(),
        diagonal: distance(low, high),
    })
}

/// The middles of all cells, rows of them one after the other.
fn middles(grid: &Grid, surface: &BSplineSurface) -> Vec<Middle> {
    let [columns, rows] = grid.samples;
    let middle = |i: usize, n: usize| (i as f64 + 0.5) / (n - 1) as f64;
    let part = 1.0 / ((columns - 1) * (rows - 1)) as f64;
    let cells = (0..rows - 1).flat_map(|k| (0..columns - 1).map(move |i| (i, k)));
    let cells = cells.map(|(i, k)| {
        let at = |across: usize, up: usize| grid.points[(k + up) * columns + i + across];
        let cell = cross(sub(at(1, 1), at(0, 0)), sub(at(0, 1), at(1, 0)));
        let jet = surface.at([middle(i, columns), middle(k, rows)]);
        let normal = cross(jet.tangent[0], jet.tangent[1]);
        Middle {
            point: jet.point,
            area: part * norm(normal),
            is_folded: dot(normal, cell) < 0.0,
        }
    });
    cells.collect()
}

/// The basis at every sample of a row.
fn row_of(basis: super::Basis, samples: usize) -> Vec<Local> {
    (0..samples)
        .map(|i| basis.at(parameter(i, samples)))
        .collect()
}

/// Both sides of an interface at the same points, which leave out the corners, where patches may have no normal.
fn across(grids: &Grids, surfaces: &Surfaces, interface: &Interface) -> Along {
    let (first, second) = (interface.first, interface.second);
    let samples = grids.patches[first.patch].samples[first.side.along()];
    let count = STEPS * (samples - 1);
    let mut along = Along::default();
    for i in 0..count {
        let t = (i as f64 + 0.5) / count as f64;
        let across = if interface.reversed { 1.0 - t } else { t };
        let a = surfaces.patches[first.patch].at(first.side.at(t));
        let b = surfaces.patches[second.patch].at(second.side.at(across));
        let length = norm(a.tangent[first.side.along()]);
        let normal = |jet: super::Jet| cross(jet.tangent[0], jet.tangent[1]);
        let turn = angle(normal(a), normal(b));
        along.gap = along.gap.max(distance(a.point, b.point));
        along.angles += length * turn;
        along.length += length;
        along.largest = along.largest.max(turn);
    }
    along
}
