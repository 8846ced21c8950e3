//! The atlas in the plane: the central chart, and beside it the packed patches.

use super::canvas::Canvas;
use super::colour::{CUT, FAINT, INK, NEGATIVE, PAPER, POSITIVE, categorical};
use super::text;
use crate::geometry::ids::{FaceId, FaceVec, NONE};
use crate::product::AffineAtlas;
use image::RgbImage;

/// Places a rectangle of the plane in the middle of a square of the picture, whose lower left is `corner`: v runs upwards in the plane, rows
/// downwards on the picture.
fn fitting(
    [low, high]: [[f64; 2]; 2],
    corner: [f64; 2],
    side: f64,
) -> impl Fn([f64; 2]) -> [f64; 2] {
    let extent = (high[0] - low[0]).max(high[1] - low[1]);
    let is_sound = extent > 0.0 && extent.is_finite();
    let scale = if is_sound { side / extent } else { 1.0 };
    let place = move |i: usize, x: f64| 0.5 * side + scale * (x - 0.5 * (low[i] + high[i]));
    move |p| [corner[0] + place(0, p[0]), corner[1] - place(1, p[1])]
}

/// The central chart with its patches in different colours, darker where it overlaps itself, with the cut (orange), the
/// surface's boundary (dark) and the cones; to the right the packed square. 2 `size` × `size` pixels.
pub fn layout(atlas: &AffineAtlas, size: usize) -> RgbImage {
    let size = super::canvas::side(size);
    let (full, titled) = (size as f64, size >= 240);
    let margin = 0.04 * full;
    let head = if titled { 30.0 } else { margin };
    let side = full - margin - head;
    let mut canvas = Canvas::new(2 * size, size, PAPER);
    let left = [(full - side) / 2.0, full - margin];
    chart(&mut canvas, atlas, left, side, full);
    packed(&mut canvas, atlas, [full + left[0], left[1]], side, full);
    let mut image = canvas.finish();
    if titled {
        let patches = atlas.patches.patches.len();
        let plural = if patches == 1 { "" } else { "es" };
        let packed = format!("{patches} patch{plural}, packed");
        for (k, words) in ["central chart", &packed].iter().enumerate() {
            let at = [(k as f64 + 0.5) * full, 16.0];
            text::write(&mut image, words, at, 0.5, INK);
        }
    }
    image
}

/// Faces in the colours of their patches, and the lines between patches, the boundary and the cut.
fn faces(
    canvas: &mut Canvas,
    atlas: &AffineAtlas,
    uv: &FaceVec<[[f64; 2]; 3]>,
    place: impl Fn(FaceId, [f64; 2]) -> [f64; 2],
    full: f64,
) {
    let connectivity = &atlas.mesh.connectivity;
    let patch = &atlas.patches.face_patch;
    for f in connectivity.faces() {
        let colour = categorical(patch[f].index());
        canvas.triangle(uv[f].map(|p| place(f, p)), colour);
    }
    // Between patches, the boundary and the cut: the thickest last.
    let styles = [(0.0014, [120; 3]), (0.0022, INK), (0.0024, CUT)];
    let mut lines = Vec::new();
    for h in connectivity.halfedges() {
        let f = connectivity.face(h);
        let across = connectivity.twin(h).map(|t| patch[connectivity.face(t)]);
        let kind = match (atlas.cut.segment[connectivity.edge(h)], across) {
            (NONE, Some(g)) if g == patch[f] => continue,
            (NONE, Some(_)) => 0,
            (NONE, None) => 1,
            _ => 2,
        };
        lines.push((kind, h));
    }
    // Stable.
    lines.sort_by_key(|(kind, _)| *kind);
    for (kind, h) in lines {
        let ((width, colour), f): ((f64, _), _) = (styles[kind], connectivity.face(h));
        let k = connectivity.corner(h);
        let [a, b] = [uv[f][k], uv[f][(k + 1) % 3]].map(|p| place(f, p));
        canvas.line(a, b, width * full, colour);
    }
}

fn chart(canvas: &mut Canvas, atlas: &AffineAtlas, corner: [f64; 2], side: f64, full: f64) {
    let connectivity = &atlas.mesh.connectivity;
    let uv = &atlas.central.uv;
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for p in uv.iter().flatten() {
        low = [low[0].min(p[0]), low[1].min(p[1])];
        high = [high[0].max(p[0]), high[1].max(p[1])];
    }
    let frame = fitting([low, high], corner, side);
    faces(canvas, atlas, uv, |_, p| frame(p), full);
    for (is_positive, colour) in [(false, NEGATIVE), (true, POSITIVE)] {
        let cones = atlas.prescription.cones.iter();
        for cone in cones.filter(|cone| (cone.curvature > 0.0) == is_positive) {
            for h in connectivity.outgoing(cone.vertex) {
                let at = frame(uv[connectivity.face(h)][connectivity.corner(h)]);
                canvas.disc(at, 0.0085 * full, colour, [255; 3]);
            }
        }
    }
}

fn packed(canvas: &mut Canvas, atlas: &AffineAtlas, corner: [f64; 2], side: f64, full: f64) {
    let layout = &atlas.patches;
    let frame = fitting([[0.0; 2], [1.0; 2]], corner, side);
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(&frame);
    for k in 0..4 {
        canvas.line(square[k], square[(k + 1) % 4], 0.0016 * full, FAINT);
    }
    let place = |f: FaceId, p: [f64; 2]| {
        let patch = layout.patches.get(layout.face_patch[f].index());
        frame(patch.map_or([0.0; 2], |patch| patch.packed(p)))
    };
    faces(canvas, atlas, &layout.uv, place, full);
}
