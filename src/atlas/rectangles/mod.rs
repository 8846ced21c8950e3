//! Rectangles: four-sided patches that the flow itself maps to rectangles, in place of flat ones (`images.domain = "rectangle"`).
//!
//! *Enters:* a surface with its charts, and its flat patches. *Leaves:* the same surface on finer faces, and a [`PatchLayout`] of
//! rectangles: each is sampled corner to corner, a full grid without a mask.
//!
//! ```text
//! flat patches → sides and nodes → short sides contracted, walls drawn anew, division → small ones joined or not → divided by demand → the same again → middles → quads
//! → Ricci flow of each → common parameter of walls → maps spread by stretch and bend → rectangles glued → charts carried over → numbers of samples
//! ```
//!
//! What has n sides becomes n quads (`quads`), so that what decides about the images is where the walls are: short sides go (`contract`), walls meet at even
//! angles (`relax`), patches with many or hidden corners are divided (`division`), and those that would hold the surface worst for their texels (`sizes`). Small patches are joined (`join`) where the images then turn out better: both are made to the end. Each quad
//! is flattened by the same flow that made the cone metric, with π/2 at its four corners and nothing else (`flow`); its aspect ratio is its modulus,
//! which cannot be chosen. The two conformal maps on both sides of a wall stretch it differently, and crowd it at corners: its parameter is its length in
//! space, more where the surface bends (`density`, `walls`), and each quad is mapped to its rectangle with the border so given, harmonically at first and then so that no part is
//! stretched much more than it is to be (`place`). The final triangulation of a quad is not that of the surface, so the surface is refined once more, and what is linear on its
//! faces is carried over (`lift`). How the images of even texels bend says how many samples every strip of sides gets (`texels`, `counts`).
//!
//! *Guaranteed:* patches are injective, as harmonic maps to convex shapes are; every side of a rectangle is a whole side of its
//! neighbour, corner to corner, with as many samples (`counts`), and sample i of n from one corner is the same point for both, to the
//! last bit in the images. Spline patches fitted to two images can so share the control points of their common border.
//! *Not guaranteed:* conformal maps; smoothness across walls; a bound for the stretch inside a rectangle; the budget, where the least numbers of samples use more.
//!
//! The tutorial shows rectangles for disks only (Fig. 10 and 18, four corners of π/2); quads by joining centres to middles are
//! E. Catmull, J. Clark, *Recursively generated B-spline surfaces on arbitrary topological meshes* (1978).

mod chord;
mod contract;
mod counts;
mod density;
mod disk;
mod division;
mod flow;
mod glue;
mod harmonic;
mod join;
mod lift;
mod place;
mod quads;
mod relax;
mod sides;
mod sizes;
mod subdivision;
mod walls;

#[cfg(test)]
mod tests;

use crate::atlas::charts::Charts;
use crate::atlas::cut::CutGraph;
use crate::atlas::develop::Development;
use crate::atlas::geometry_image::{image_origin, sample};
use crate::atlas::overlay::OverlayError;
use crate::atlas::patches::{Patch, PatchLayout, PatchParams, packed, seams};
use crate::atlas::texels::{Bend, FINER};
use crate::flow::cones::Prescription;
use crate::flow::ricci::{FlatMetric, FlowError};
use crate::flow::solve::SolveError;
use crate::geometry::connectivity::ConnectivityError;
use crate::geometry::ids::{FaceVec, PatchId};
use crate::geometry::mesh::Mesh;
use counts::Strips;
use flow::Rectangle;
use glue::Added;
use quads::Quad;
use rayon::prelude::*;
use sides::Drawing;
use subdivision::Subdivision;

// Dividing the regions whose images turned out worst, and drawing all walls anew after it, gained up to 1.4 dB more. But walls that are drawn over and over split faces
// into ever smaller ones, whose flat lengths no longer add up to the cone metric: angle sums were off by up to 4e-5.

/// A surface with its flat metric, slit, developed and covered by charts.
#[derive(Clone, Debug)]
pub struct Charted {
    /// The surface.
    pub mesh: Mesh,
    /// Flat metric on its edges.
    pub metric: FlatMetric,
    /// Target curvature of its vertices.
    pub prescription: Prescription,
    /// The cut on it.
    pub cut: CutGraph,
    /// The central chart.
    pub central: Development,
    /// All others.
    pub charts: Charts,
}

/// Why there are no rectangles.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RectangleError {
    /// A patch, or a part of one, is no disk.
    #[error(
        "patch {patch} has Euler characteristic {euler_characteristic} and {border_loops} borders, but a disk has 1 and 1: please report this mesh"
    )]
    NotADisk {
        /// The flat patch.
        patch: usize,
        /// χ of it.
        euler_characteristic: i64,
        /// Its borders.
        border_loops: usize,
    },
    /// Something that holds for every mesh does not.
    #[error(
        "{what} do not fit together: please report this mesh, and use images.domain = \"flat\" meanwhile"
    )]
    Inconsistent {
        /// What was looked at.
        what: &'static str,
    },
    /// The flow of a quad found no metric.
    #[error(
        "rectangle {quad} could not be flattened; use images.domain = \"flat\", or more cones, which make patches simpler: {error}"
    )]
    Flow {
        /// Number of the quad.
        quad: usize,
        /// What the flow said.
        error: FlowError,
    },
    /// A flattened quad is no rectangle.
    #[error(
        "rectangle {quad} has opposite sides that differ by {difference:e} of its width, more than {bound:e}; use images.domain = \"flat\", or more cones, which make patches simpler"
    )]
    Unequal {
        /// Number of the quad.
        quad: usize,
        /// Difference of opposite sides, in widths.
        difference: f64,
        /// What is allowed.
        bound: f64,
    },
    /// A map to a rectangle is not one to one.
    #[error(
        "rectangle {quad} has {folded} of {faces} faces turned over, since it is more crowded than float64 can tell; use images.domain = \"flat\", or more cones, which make patches simpler"
    )]
    Folded {
        /// Number of the quad.
        quad: usize,
        /// Faces that are turned over.
        folded: usize,
        /// Faces of the rectangle.
        faces: usize,
    },
    /// A system of equations could not be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// A quad could not be refined.
    #[error(transparent)]
    Overlay(#[from] OverlayError),
    /// The pieces do not make a surface.
    #[error(transparent)]
    Connectivity(#[from] ConnectivityError),
}

/// Replaces flat patches by rectangles; the surface and everything on it gets finer faces.
///
/// `curvature_tolerance` is that of the flow.
///
/// # Errors
/// A quad whose flow does not arrive in float64. Everything else is not expected.
pub fn rectangles(
    surface: Charted,
    flat: &PatchLayout,
    params: &PatchParams,
    curvature_tolerance: f64,
) -> Result<(Charted, PatchLayout), RectangleError> {
    // Which division is better, only the images tell.
    let with = |joins| divided(&surface, flat, params, curvature_tolerance, joins);
    let (apart, joined) = rayon::join(|| with(false), || with(true));
    let found = match (apart, joined) {
        (Ok(Some(apart)), Ok(Some(joined))) if joined.error < apart.error => joined,
        (Ok(Some(found)), _) | (_, Ok(Some(found))) => found,
        (Err(error), _) | (_, Err(error)) => return Err(error),
        (Ok(None), Ok(None)) => {
            return Err(RectangleError::Inconsistent {
                what: "two divisions",
            });
        }
    };
    tracing::debug!(
        rectangles = found.layout.patches.len(),
        least_height = found.least_height,
        greatest_difference = found.greatest_difference,
        "patches became rectangles"
    );
    Ok((found.surface, found.layout))
}

/// A surface in rectangles.
struct Divided {
    surface: Charted,
    layout: PatchLayout,
    /// The squared error that its images will have, integrated over the surface.
    error: f64,
    /// Of all rectangles.
    least_height: f64,
    /// Of opposite sides.
    greatest_difference: f64,
}

/// Rectangles with small patches joined or all kept apart; nothing where none would be joined.
fn divided(
    surface: &Charted,
    flat: &PatchLayout,
    params: &PatchParams,
    curvature_tolerance: f64,
    joins: bool,
) -> Result<Option<Divided>, RectangleError> {
    let mut drawing = Drawing::new(&surface.mesh, &surface.cut.is_cut, &flat.face_patch)?;
    contract::contract(&mut drawing)?;
    relax::relax(&mut drawing)?;
    division::divide(&mut drawing)?;
    if joins && join::join(&mut drawing, params.texel_budget)? == 0 {
        return Ok(None);
    }
    sizes::divide(&mut drawing, params.texel_budget)?;
    contract::contract(&mut drawing)?;
    relax::relax(&mut drawing)?;
    // What has moved may be crowded elsewhere.
    division::divide(&mut drawing)?;
    drawing.mark_middles();
    let quads = quads::quads(&mut drawing)?;
    let strips = Strips::new(&drawing.fine, &quads);
    let (flattened, added) = placed(&drawing.fine, &drawing.bend, &quads, curvature_tolerance)?;
    let least =
        |value: fn(&Rectangle) -> f64| flattened.iter().map(value).fold(f64::INFINITY, f64::min);
    let (fine, face_patch) = glue::glue(&drawing.fine, &flattened, &added)?;
    let surface = lift::lift(surface.clone(), &fine);
    let c = &fine.connectivity;
    let uv: FaceVec<[[f64; 2]; 3]> = c
        .faces()
        .map(|f| c.face_halfedges(f).map(|h| fine.corner[h].uv))
        .collect();
    let face_patch: FaceVec<PatchId> = face_patch.into();
    let finer = params.texel_budget.saturating_mul(FINER);
    let mut layout = PatchLayout {
        face_patch,
        uv,
        patches: patches(&flattened, &strips.even(finer), params),
        seams: Vec::new(),
        packed: None,
    };
    let bends = bends(&surface, &layout, &flattened);
    let samples = strips.bent(&bends, params.texel_budget);
    layout.patches = patches(&flattened, &samples, params);
    layout.seams = seams(
        &surface.mesh,
        &surface.cut.is_cut,
        &layout.face_patch,
        &layout.uv,
    );
    Ok(Some(Divided {
        error: Strips::error(&bends, &samples),
        least_height: least(|r| r.height),
        greatest_difference: -least(|r| -r.unequal),
        surface,
        layout,
    }))
}

/// How the surface bends along the sides of every quad, as images of even texels see it.
fn bends(surface: &Charted, layout: &PatchLayout, rectangles: &[Rectangle]) -> Vec<Bend> {
    let mesh = &surface.mesh;
    let images = sample(mesh, layout, &surface.metric.log_scale, image_origin(mesh));
    let bends = images.iter().map(Bend::of_grid).zip(rectangles);
    bends
        .map(|(bend, rectangle)| match rectangle.origin % 2 {
            0 => bend,
            _ => bend.turned(),
        })
        .collect()
}

/// Flattens all quads and gives them coordinates, such that both sides of a wall have the same ones along it. `bend` is that of the surface's faces.
fn placed(
    drawing: &Subdivision,
    bend: &FaceVec<f64>,
    quads: &[Quad],
    curvature_tolerance: f64,
) -> Result<(Vec<Rectangle>, Added), RectangleError> {
    // The error of the first one that has one, whichever is done first.
    let flattened: Vec<Result<Rectangle, RectangleError>> = quads
        .par_iter()
        .enumerate()
        .map(|(i, quad)| flow::flatten(drawing, quad, i, curvature_tolerance))
        .collect();
    let mut rectangles: Vec<Rectangle> = flattened.into_iter().collect::<Result<_, _>>()?;
    let added = Added::new(drawing, &mut rectangles)?;
    for rectangle in &mut rectangles {
        rectangle.density = density::density(rectangle, drawing, bend);
    }
    let borders = walls::parameters(drawing, &rectangles)?;
    let placed: Vec<Result<(), RectangleError>> = rectangles
        .par_iter_mut()
        .zip(&borders)
        .enumerate()
        .map(|(i, (rectangle, border))| place::place(rectangle, border, i))
        .collect();
    placed.into_iter().collect::<Result<(), _>>()?;
    Ok((rectangles, added))
}

/// The images: from corner to corner of the rectangles, as many samples as their sides have.
fn patches(rectangles: &[Rectangle], samples: &[[usize; 2]], params: &PatchParams) -> Vec<Patch> {
    let images: Vec<([usize; 2], f64)> = rectangles
        .iter()
        .zip(samples)
        .map(|(r, n)| ([n[r.origin % 2], n[(r.origin + 1) % 2]], r.height))
        .collect();
    // In the packed square texels are square; as many as the image has.
    let contents: Vec<[f64; 2]> = images
        .iter()
        .map(|&([columns, rows], height)| {
            let texels = ((columns - 1) * (rows - 1)) as f64;
            let density = (texels / height).sqrt().min(4.0 * columns as f64);
            [density, density * height]
        })
        .collect();
    let sizes: Vec<[usize; 2]> = contents
        .iter()
        .map(|content| content.map(|x| x.ceil() as usize + 2 * params.padding.max(1)))
        .collect();
    let places = packed(&sizes, &contents);
    images
        .iter()
        .zip(places)
        .map(
            |(&([width, height], top), (packed_scale, packed_offset))| Patch {
                to_chart: None,
                width,
                height,
                texel_to_patch: [
                    [1.0 / (width - 1) as f64, 0.0, 0.0],
                    [0.0, -top / (height - 1) as f64, top],
                ],
                packed_scale,
                packed_offset,
            },
        )
        .collect()
}

impl Quad {
    /// The edges of the drawing on a side, from corner `k` on.
    fn side(&self, drawing: &Subdivision, k: usize) -> Vec<crate::geometry::ids::EdgeId> {
        let n = self.disk.border.len();
        let (from, to) = (self.corners[k % 4], self.corners[(k + 1) % 4]);
        let count = (to + n - from) % n;
        let place = |i| self.disk.border[(from + i) % n];
        (0..count)
            .map(|i| self.disk.edge(drawing, place(i)))
            .collect()
    }
}
