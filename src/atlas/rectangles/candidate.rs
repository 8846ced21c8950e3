//! A surface in rectangles, one of several ways to divide it.
//!
//! *Enters:* a surface with its charts. *Leaves:* a [`Candidate`]: the surface on finer faces, the rectangles and their images' sizes, and what error the images will have.
//!
//! Either the surface is divided into clusters, whatever the flat patches and the cut are ([`in_clusters`]), or the flat patches are ([`in_patches`]): that asks nothing of the surface and
//! makes three times as many rectangles, of which each is worse.

use super::counts::Strips;
use super::flow::Rectangle;
use super::glue::Added;
use super::quads::Quad;
use super::sides::Drawing;
use super::{
    RectangleError, clusters, contract, density, division, flow, glue, parity, place,
    quadrangulate, quads, relax, sizes, walls,
};
use crate::atlas::charted::{self, Charted};
use crate::atlas::geometry_image::{GeometryImage, sample};
use crate::atlas::patches::{Domain, Patch, PatchLayout, PatchParams, packed, seams};
use crate::atlas::texels::{Bend, FINER};
use crate::geometry::ids::{EdgeVec, FaceVec, PatchId};
use crate::geometry::mesh::{Mesh, cross, norm, sub};
use crate::geometry::subdivision::Subdivision;
use rayon::prelude::*;
use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering::Relaxed;

/// So many times finer than the images is what their error is measured on.
const MEASURED: usize = 3;
/// Texels of the images whose error is measured, at most: what is best with so many is with more.
const JUDGED: usize = 1 << 18;

/// A surface in rectangles.
pub(super) struct Candidate {
    pub surface: Charted,
    pub layout: PatchLayout,
    /// The squared error that its images will have, integrated over the surface.
    pub error: f64,
    /// Of all rectangles.
    pub least_height: f64,
    /// Of opposite sides.
    pub greatest_difference: f64,
}

/// About so many clusters of faces, divided into quads by lines between their corners.
pub(super) fn in_clusters(
    surface: &Charted,
    params: &PatchParams,
    curvature_tolerance: f64,
    count: usize,
) -> Result<Candidate, RectangleError> {
    let drawing = in_cluster_drawing(&surface.mesh, count)?;
    let quads = quads::regions_as_quads(&drawing)?;
    finished(surface, &drawing, &quads, params, curvature_tolerance)
}

/// A surface on which clusters are divided into quads.
pub(super) fn in_cluster_drawing(mesh: &Mesh, count: usize) -> Result<Drawing, RectangleError> {
    let clusters = clusters::clusters(mesh, count);
    let nothing = EdgeVec::filled(false, mesh.connectivity.edge_count());
    let mut drawing = Drawing::new(mesh, &nothing, &clusters)?;
    contract::contract(&mut drawing)?;
    relax::relax(&mut drawing)?;
    parity::make_even(&mut drawing)?;
    quadrangulate::quadrangulate(&mut drawing)?;
    relax::relax(&mut drawing)?;
    Ok(drawing)
}

/// Flat patches, with walls drawn anew, divided by demand, and a centre in each joined to the middles of its sides.
pub(super) fn in_patches(
    surface: &Charted,
    flat: &PatchLayout,
    params: &PatchParams,
    curvature_tolerance: f64,
) -> Result<Candidate, RectangleError> {
    let mut drawing = Drawing::new(&surface.mesh, &surface.cut.is_cut, &flat.face_patch)?;
    contract::contract(&mut drawing)?;
    relax::relax(&mut drawing)?;
    division::divide(&mut drawing)?;
    sizes::divide(&mut drawing, params.texel_budget)?;
    contract::contract(&mut drawing)?;
    relax::relax(&mut drawing)?;
    // What has moved may be crowded elsewhere.
    division::divide(&mut drawing)?;
    drawing.mark_middles();
    let quads = quads::quads(&mut drawing)?;
    finished(surface, &drawing, &quads, params, curvature_tolerance)
}

/// The squared distance along the normal, integrated over the surface, between an image and what its every `step`th row and column hold.
pub(super) fn missed(image: &GeometryImage, step: usize) -> f64 {
    let at = |column: usize, row: usize| {
        let i = image.width * row + column;
        (
            image.position[i].map(f64::from),
            image.normal[i].map(f64::from),
        )
    };
    let mut sum = 0.0;
    for row in (0..image.height.saturating_sub(1)).step_by(step) {
        for column in (0..image.width.saturating_sub(1)).step_by(step) {
            let corner = |i: usize| at(column + step * (i % 2), row + step * (i / 2)).0;
            let [a, b, c, d] = [0, 1, 2, 3].map(corner);
            let area = 0.5 * norm(cross(sub(d, a), sub(c, b)));
            let mut squared = 0.0;
            for i in 0..step * step {
                let (s, t) = (i % step, i / step);
                let (p, normal) = at(column + s, row + t);
                let (s, t) = (s as f64 / step as f64, t as f64 / step as f64);
                let above: f64 = (0..3)
                    .map(|k| {
                        let top = (1.0 - s) * a[k] + s * b[k];
                        let bottom = (1.0 - s) * c[k] + s * d[k];
                        (p[k] - (1.0 - t) * top - t * bottom) * normal[k]
                    })
                    .sum();
                squared += above * above;
            }
            sum += area * squared / (step * step) as f64;
        }
    }
    sum
}

/// Flattens the quads of a drawing, gives them coordinates and images.
fn finished(
    surface: &Charted,
    drawing: &Drawing,
    quads: &[Quad],
    params: &PatchParams,
    curvature_tolerance: f64,
) -> Result<Candidate, RectangleError> {
    let strips = Strips::new(&drawing.fine, quads);
    let (flattened, added) = placed(&drawing.fine, &drawing.bend, quads, curvature_tolerance)?;
    let least =
        |value: fn(&Rectangle) -> f64| flattened.iter().map(value).fold(f64::INFINITY, f64::min);
    let (fine, face_patch) = glue::glue(&drawing.fine, &flattened, &added)?;
    let surface = charted::lift(surface.clone(), &fine);
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
    // Rows and columns between those of the images tell what these will miss; bends do not, where a map is crowded.
    let judged = strips.bent(&bends, params.texel_budget.min(JUDGED));
    let between = judged.iter().map(|n| n.map(|n| MEASURED * (n - 1) + 1));
    layout.patches = patches(&flattened, &between.collect::<Vec<_>>(), params);
    let mesh = &surface.mesh;
    let measured = sample(mesh, &layout, &surface.metric.log_scale, [0.0; 3]);
    let error = measured.iter().map(|image| missed(image, MEASURED)).sum();
    layout.patches = patches(&flattened, &samples, params);
    layout.seams = seams(
        &surface.mesh,
        &surface.cut.is_cut,
        &layout.face_patch,
        &layout.uv,
    );
    Ok(Candidate {
        error,
        least_height: least(|r| r.height),
        greatest_difference: -least(|r| -r.unequal),
        surface,
        layout,
    })
}

/// How the surface bends along the sides of every quad, as images of even texels see it.
fn bends(surface: &Charted, layout: &PatchLayout, rectangles: &[Rectangle]) -> Vec<Bend> {
    let mesh = &surface.mesh;
    let images = sample(mesh, layout, &surface.metric.log_scale, [0.0; 3]);
    let bends = images.iter().map(Bend::of_grid).zip(rectangles);
    bends
        .map(|(bend, rectangle)| match rectangle.origin % 2 {
            0 => bend,
            _ => bend.turned(),
        })
        .collect()
}

/// Flattens all quads and gives them coordinates, such that both sides of a wall have the same ones along it. `bend` is that of the surface's faces.
pub(super) fn placed(
    drawing: &Subdivision,
    bend: &FaceVec<f64>,
    quads: &[Quad],
    curvature_tolerance: f64,
) -> Result<(Vec<Rectangle>, Added), RectangleError> {
    // The error of the first one that has one, whichever is done first; those behind it need not be flattened.
    let first_failed = AtomicUsize::new(usize::MAX);
    let flattened: Vec<Option<Result<Rectangle, RectangleError>>> = quads
        .par_iter()
        .enumerate()
        .map(|(i, quad)| {
            if i > first_failed.load(Relaxed) {
                return None;
            }
            let flattened = flow::flatten(drawing, quad, i, curvature_tolerance);
            if flattened.is_err() {
                first_failed.fetch_min(i, Relaxed);
            }
            Some(flattened)
        })
        .collect();
    let mut rectangles = Vec::with_capacity(quads.len());
    for flattened in flattened {
        let left_out = || RectangleError::Inconsistent {
            what: "the quads of a surface",
        };
        rectangles.push(flattened.ok_or_else(left_out)??);
    }
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
                domain: Domain::Rectangle,
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
