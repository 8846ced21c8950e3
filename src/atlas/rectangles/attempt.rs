//! One way to divide a surface into rectangles, with what its images would be off by.
//!
//! *Enters:* a [`Drawing`] whose regions are to become rectangles. *Leaves:* an [`Attempt`]: the rectangles, glued together, the numbers of samples of their images, and the
//! squared error that is to be expected, in all and for every region.
//!
//! Which walls are best is not known before maps are there: one crowded rectangle may hold more of the error than all others. So the walls are drawn from what areas and
//! bends tell, and then the regions that turned out worst are divided ([`best`]), as long as that helps.

use super::bends::Bend;
use super::counts::Strips;
use super::flow::Rectangle;
use super::quads::quads;
use super::sides::Drawing;
use super::subdivision::Subdivision;
use super::{RectangleError, division, finish, glue, patches, placed, sizes};
use crate::atlas::geometry_image::{image_origin, sample};
use crate::atlas::patches::{PatchLayout, PatchParams};
use crate::geometry::ids::{FaceId, FaceVec, NONE, PatchId, VertexVec};
use crate::geometry::mesh::Mesh;

/// How often the worst regions are divided, at most.
const ROUNDS: usize = 4;
/// Bends are measured on images with so many times the texels that they will have: coarser ones do not see what is between their texels, much finer ones see the
/// mesh's own edges.
const FINER: usize = 2;

/// A surface in rectangles.
pub(super) struct Attempt {
    /// The walls, before middles and centres were put in.
    drawing: Drawing,
    /// A face of every region, and its squared error if its images had one texel each.
    regions: Vec<(FaceId, f64)>,
    /// The squared distance of all images from the surface, integrated over it.
    pub error: f64,
    pub rectangles: Vec<Rectangle>,
    /// The whole surface, and the rectangle of every face.
    pub fine: Subdivision,
    pub face_patch: FaceVec<PatchId>,
    /// Coordinates of all corners.
    pub uv: FaceVec<[[f64; 2]; 3]>,
    /// Samples along the sides of every quad.
    pub samples: Vec<[usize; 2]>,
}

/// The best of some attempts, the first of which draws no further walls.
pub(super) fn best(
    drawing: Drawing,
    params: &PatchParams,
    curvature_tolerance: f64,
) -> Result<Attempt, RectangleError> {
    let mut best = Attempt::new(drawing, params, curvature_tolerance)?;
    for _ in 0..ROUNDS {
        let mut drawing = best.drawing.clone();
        let drawn = sizes::divide_measured(&mut drawing, &best.regions, params.texel_budget)?;
        if drawn == 0 {
            break;
        }
        finish(&mut drawing)?;
        // What cannot be flattened is no better.
        let next = Attempt::new(drawing, params, curvature_tolerance);
        match next.ok().filter(|next| next.error < best.error) {
            Some(next) => best = next,
            None => break,
        }
    }
    Ok(best)
}

impl Attempt {
    /// Flattens all regions.
    pub fn new(
        before: Drawing,
        params: &PatchParams,
        curvature_tolerance: f64,
    ) -> Result<Self, RectangleError> {
        let starts = division::regions(&before);
        let mut drawing = before.clone();
        drawing.mark_middles();
        let quads = quads(&mut drawing)?;
        let strips = Strips::new(&drawing.fine, &quads);
        let (rectangles, added) =
            placed(&drawing.fine, &drawing.bend, &quads, curvature_tolerance)?;
        let (fine, face_patch) = glue::glue(&drawing.fine, &rectangles, &added)?;
        let c = &fine.connectivity;
        let corners = |f| c.face_halfedges(f).map(|h| fine.corner[h].uv);
        let even = strips.even(params.texel_budget.saturating_mul(FINER));
        let layout = PatchLayout {
            face_patch: face_patch.into(),
            uv: c.faces().map(corners).collect(),
            patches: patches(&rectangles, &even, params),
            seams: Vec::new(),
            packed: None,
        };
        let bends = bends(&fine, &layout, &rectangles);
        let samples = strips.bent(&bends, params.texel_budget);
        let mut errors = vec![0.0; starts.len()];
        let mut error = 0.0;
        for ((quad, bend), samples) in quads.iter().zip(&bends).zip(&samples) {
            errors[quad.region] += bend.error([1.0, 1.0]);
            error += bend.error(samples.map(|n| (n - 1) as f64));
        }
        Ok(Self {
            drawing: before,
            regions: starts.into_iter().zip(errors).collect(),
            error,
            rectangles,
            face_patch: layout.face_patch,
            uv: layout.uv,
            samples,
            fine,
        })
    }
}

/// How the surface bends along the sides of every quad, as images of even texels see it.
fn bends(fine: &Subdivision, layout: &PatchLayout, rectangles: &[Rectangle]) -> Vec<Bend> {
    let c = &fine.connectivity;
    let mesh = Mesh {
        positions: fine.position.clone(),
        source_vertex: VertexVec::filled(NONE, c.vertex_count()),
        source_face: fine.parent.iter().map(|f| f.index() as u32).collect(),
        face_material: FaceVec::filled(NONE, c.face_count()),
        attributes: Vec::new(),
        connectivity: c.clone(),
    };
    // Positions are all that is looked at.
    let log_scale = VertexVec::filled(0.0, c.vertex_count());
    let images = sample(&mesh, layout, &log_scale, image_origin(&mesh));
    let bends = images.iter().map(Bend::of).zip(rectangles);
    bends
        .map(|(bend, rectangle)| match rectangle.origin % 2 {
            0 => bend,
            _ => bend.turned(),
        })
        .collect()
}
