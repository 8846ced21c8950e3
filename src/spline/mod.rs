//! One smooth surface over the atlas: the Catmull–Clark limit surface on the cells of its grid.
//!
//! *Enters:* a [`Gridded`] surface. *Leaves:* a [`Spline`]: control points, how far the surface is from that one, and the same surface as B-spline faces for CAD ([`cad`]) and as patches for analysis ([`patches`]).
//!
//! ```text
//! cells, faces on them → control mesh with creases → least squares ⇄ nearest places → limit surface → B-spline faces
//! ```
//!
//! A surface admits a manifold spline if and only if it admits an affine atlas (X. Gu, Y. He, H. Qin 2006): here, that of the grid. Away from irregular points the limit surface is the bicubic B-spline over the atlas' own coordinates, twice continuously differentiable;
//! at irregular points it is continuously differentiable (U. Reif 1995, J. Peters, U. Reif 1998).
//!
//! *Guaranteed:* the same bytes for any number of threads. *Not guaranteed:* that nothing folds: [`Shape`] says what does.

pub mod cad;
pub mod cage;
pub mod creases;
pub mod equations;
mod error;
pub mod evaluator;
mod fairness;
pub mod fit;
mod folds;
pub mod gridded;
pub mod limit;
pub mod measure;
pub mod patches;
mod rings;
pub mod shell;
pub mod subdivide;
pub mod surface;
mod tensor;
pub mod tessellation;
#[cfg(test)]
mod tests;
pub mod voids;

pub use error::SplineError;
pub use gridded::Gridded;

use crate::geometry::deviation::{Deviation, Sampling, Triangles, deviation};
use crate::geometry::mesh::{norm, sub};
use cad::Faces;
use cage::Cage;
use equations::Equations;
use evaluator::Evaluator;
use limit::Limit;
use measure::{Errors, Shape};
use patches::Patches;
use tessellation::{Tessellation, parts, tessellate};

/// Normals of B-spline faces differ by no more beside irregular points, degrees.
pub const DEFAULT_ANGLE: f64 = 0.1;
/// Samples of each surface.
const SAMPLING: Sampling = Sampling {
    samples: 100_000,
    vertices: 100_000,
};

/// A fitted surface; source units but where said.
#[derive(Clone, Debug)]
pub struct Spline {
    /// Control mesh.
    pub cage: Cage,
    /// Control points.
    pub control: Vec<[f64; 3]>,
    /// Diagonal of the bounding box of the surface that it was fitted to.
    pub diagonal: f64,
    /// From samples of that surface.
    pub errors: Errors,
    /// Between both; absent where one has no area.
    pub deviation: Option<Deviation>,
    /// Whether it folds.
    pub shape: Shape,
}

impl Spline {
    /// The largest distance between both surfaces that was found, from samples of either and from vertices, source units.
    pub fn farthest(&self) -> f64 {
        self.deviation
            .map_or(self.errors.max, |d| d.hausdorff.max(self.errors.max))
    }

    /// The limit surface, to be handed to what asks for points.
    pub fn with_limit<T>(&self, take: impl FnOnce(&Limit<'_>) -> T) -> T {
        let evaluator = Evaluator::new(&self.cage);
        take(&Limit::new(&self.cage, &evaluator, &self.control))
    }

    /// The same surface, looking to its other side.
    ///
    /// # Errors
    /// None, since it has cells already.
    pub fn turned_over(self) -> Result<Self, SplineError> {
        let cells = self.cage.cells.iter().map(|&[a, b, c, d]| [a, d, c, b]);
        let is_crease = |(cell, k)| self.cage.is_crease((cell, 3 - k));
        let corners = self.cage.is_corner.clone();
        let cage = Cage::new(self.cage.vertices, cells.collect(), is_crease, corners)?;
        Ok(Self { cage, ..self })
    }

    /// Whether it has no border.
    pub fn is_closed(&self) -> bool {
        self.cage.across.as_flattened().iter().all(Option::is_some)
    }

    /// Triangles for pictures and viewers.
    pub fn tessellation(&self) -> Tessellation {
        self.with_limit(|limit| tessellate(limit, parts(self.cage.cells.len())))
    }

    /// B-spline faces for CAD and patches for analysis. `angle`: see [`DEFAULT_ANGLE`], radians.
    ///
    /// # Errors
    /// See [`SplineError`].
    pub fn b_splines(&self, angle: f64) -> Result<(Faces, Patches), SplineError> {
        let is_irregular = self.cage.irregular();
        let has_two =
            |cell: &[u32; 4]| cell.iter().filter(|&&v| is_irregular[v as usize]).count() > 1;
        // The same surface with at most one irregular point a cell.
        let (cage, control) = match self.cage.cells.iter().any(has_two) {
            true => subdivide::subdivide(&self.cage, &self.control)?,
            false => (self.cage.clone(), self.control.clone()),
        };
        let evaluator = Evaluator::new(&cage);
        let limit = Limit::new(&cage, &evaluator, &control);
        Ok((cad::faces(&limit, angle)?, patches::patches(&limit)?))
    }
}

/// Fits a surface.
///
/// # Errors
/// Cells that make no surface, faces outside of cells, equations without solution.
pub fn fit(gridded: &Gridded) -> Result<Spline, SplineError> {
    let (low, high) = gridded.bounds();
    // About the middle, for digits.
    let middle: [f64; 3] = std::array::from_fn(|i| (low[i] + high[i]) / 2.0);
    let gridded = &gridded.moved(middle.map(|x| -x));
    let cage = gridded.cage()?;
    let mut samples = gridded.samples()?;
    let evaluator = Evaluator::new(&cage);
    let mut equations = Equations::new(&cage, &evaluator, &gridded.points, gridded.facets())?;
    let mut control = fit::fit(&mut equations, &mut samples)?;
    let limit = Limit::new(&cage, &evaluator, &control);
    let triangles = tessellate(&limit, parts(cage.cells.len()));
    let own = Triangles {
        positions: &triangles.points,
        faces: &triangles.faces,
    };
    let source = Triangles {
        positions: &gridded.positions,
        faces: &gridded.faces,
    };
    let (errors, shape) = (measure::errors(&limit, &samples), measure::shape(&limit));
    let deviation = deviation(source, own, SAMPLING);
    for p in &mut control {
        *p = std::array::from_fn(|i| p[i] + middle[i]);
    }
    Ok(Spline {
        cage,
        control,
        diagonal: norm(sub(high, low)),
        errors,
        deviation,
        shape,
    })
}
