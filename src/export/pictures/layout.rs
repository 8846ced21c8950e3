//! The atlas in the plane: the central chart, and beside it the packed patches.

use super::canvas::Canvas;
use super::colour::{CUT, FAINT, INK, NEGATIVE, PAPER, POSITIVE, categorical};
use super::text::{self, Anchor};
use crate::geometry::ids::{FaceId, NONE};
use crate::product::AffineAtlas;
use image::RgbImage;

/// Where a rectangle of the plane goes on the picture.
struct Frame {
    low: [f64; 2],
    scale: f64,
    corner: [f64; 2],
}

impl Frame {
    /// Fits the box into a square of the picture, in its middle. `corner` is the square's lower left.
    fn fitting(low: [f64; 2], high: [f64; 2], corner: [f64; 2], side: f64) -> Frame {
        let extent = (high[0] - low[0]).max(high[1] - low[1]);
        let scale = if extent > 0.0 && extent.is_finite() {
            side / extent
        } else {
            1.0
        };
        let slack = |i: usize| 0.5 * (side - scale * (high[i] - low[i]));
        Frame {
            low,
            scale,
            corner: [corner[0] + slack(0), corner[1] - slack(1)],
        }
    }

    /// v runs upwards in the plane, rows downwards on the picture.
    fn place(&self, p: [f64; 2]) -> [f64; 2] {
        [
            self.corner[0] + self.scale * (p[0] - self.low[0]),
            self.corner[1] - self.scale * (p[1] - self.low[1]),
        ]
    }
}

/// The central chart with its patches in different colours, darker where it overlaps itself, with the cut (orange), the
/// surface's boundary (dark) and the cones; to the right the packed square. 2 `size` × `size` pixels.
pub fn layout(atlas: &AffineAtlas, size: usize) -> RgbImage {
    let size = super::size::side(size);
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
        for (k, words) in [
            "central chart".to_string(),
            format!("{patches} patch{plural}, packed"),
        ]
        .iter()
        .enumerate()
        {
            let at = [(k as f64 + 0.5) * full, 16.0];
            text::write(&mut image, words, at, Anchor::Middle, INK);
        }
    }
    image
}

/// Colours multiplied, so that overlaps darken.
fn tinted(colour: [u8; 3]) -> impl Fn([u8; 3]) -> [u8; 3] {
    move |below| {
        std::array::from_fn(|i| {
            let product = u32::from(below[i]) * u32::from(colour[i]) / u32::from(PAPER[i]);
            product.min(255) as u8
        })
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
    let frame = Frame::fitting(low, high, corner, side);
    for f in connectivity.faces() {
        let colour = categorical(atlas.patches.face_patch[f].index());
        canvas.triangle(uv[f].map(|p| frame.place(p)), tinted(colour));
    }
    // Lines from the faintest to the most important.
    let line = |canvas: &mut Canvas, f: FaceId, k: usize, width: f64, colour: [u8; 3]| {
        let [a, b] = [uv[f][k], uv[f][(k + 1) % 3]].map(|p| frame.place(p));
        canvas.line(a, b, width * full, colour);
    };
    for pass in 0..3 {
        for h in connectivity.halfedges() {
            let (f, k) = (connectivity.face(h), connectivity.corner(h));
            let segment = atlas.cut.segment[connectivity.edge(h)];
            let across = connectivity.twin(h).map(|t| connectivity.face(t));
            let between_patches =
                across.is_some_and(|g| atlas.patches.face_patch[f] != atlas.patches.face_patch[g]);
            match pass {
                0 if between_patches && segment == NONE => line(canvas, f, k, 0.0012, [120; 3]),
                1 if across.is_none() => line(canvas, f, k, 0.0022, INK),
                2 if segment != NONE => line(canvas, f, k, 0.0026, CUT),
                _ => {}
            }
        }
    }
    let (mut positive, mut negative) = (Vec::new(), Vec::new());
    for cone in &atlas.prescription.cones {
        for h in connectivity.outgoing(cone.vertex) {
            let at = frame.place(uv[connectivity.face(h)][connectivity.corner(h)]);
            if cone.curvature > 0.0 {
                positive.push(at);
            } else {
                negative.push(at);
            }
        }
    }
    for (places, colour) in [(negative, NEGATIVE), (positive, POSITIVE)] {
        for at in places {
            canvas.disc(at, 0.0085 * full, colour, [255; 3]);
        }
    }
}

fn packed(canvas: &mut Canvas, atlas: &AffineAtlas, corner: [f64; 2], side: f64, full: f64) {
    let connectivity = &atlas.mesh.connectivity;
    let frame = Frame::fitting([0.0; 2], [1.0; 2], corner, side);
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|p| frame.place(p));
    let [a, b, c, d] = square;
    for half in [[a, b, c], [a, c, d]] {
        canvas.triangle(half, |_| [255; 3]);
    }
    for k in 0..4 {
        canvas.line(square[k], square[(k + 1) % 4], 0.0016 * full, FAINT);
    }
    let place = |f: FaceId, p: [f64; 2]| {
        let patch = atlas
            .patches
            .patches
            .get(atlas.patches.face_patch[f].index());
        let (scale, offset) = patch.map_or((0.0, [0.0; 2]), |p| (p.packed_scale, p.packed_offset));
        frame.place([p[0] * scale + offset[0], p[1] * scale + offset[1]])
    };
    for f in connectivity.faces() {
        let colour = categorical(atlas.patches.face_patch[f].index());
        let points = atlas.patches.uv[f].map(|p| place(f, p));
        canvas.triangle(points, |_| colour);
    }
    for h in connectivity.halfedges() {
        let (f, k) = (connectivity.face(h), connectivity.corner(h));
        let cut = atlas.cut.segment[connectivity.edge(h)] != NONE;
        let across = connectivity.twin(h).map(|t| connectivity.face(t));
        let colour = match across {
            None => INK,
            Some(_) if cut => CUT,
            Some(g) if atlas.patches.face_patch[f] != atlas.patches.face_patch[g] => [120; 3],
            Some(_) => continue,
        };
        let uv = &atlas.patches.uv[f];
        let [from, to] = [uv[k], uv[(k + 1) % 3]].map(|p| place(f, p));
        canvas.line(from, to, 0.0018 * full, colour);
    }
}
