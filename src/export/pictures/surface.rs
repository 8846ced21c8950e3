//! Pictures of an atlas in space.

use super::aspect::Spot;
use super::brush::Paint;
use super::checkerboard::{Checkerboard, FaceBoard};
use super::colour::{CUT, INK, Linear, NEGATIVE, POSITIVE};
use super::scale::{Coloured, Range};
use super::studio::{Mark, Shape, Studio};
use super::text;
use crate::geometry::mesh::Mesh;
use crate::product::AffineAtlas;
use image::{Rgb, RgbImage};

/// Two pictures of the surface in one view, each `size` × `size` pixels, with its cones (red where the curvature is positive, blue where it is
/// negative) and the cut. The first shows a checkerboard in flat coordinates: where the log scale is so extreme that cells would be too
/// small or too large to read, their size changes by powers of two, one fading into the next. The second shows the log scale, blue where the
/// flat metric shrinks the surface and red where it grows, with a bar of colours; the middle is the median over the area.
pub fn surface(atlas: &AffineAtlas, size: usize) -> [RgbImage; 2] {
    let mesh = &atlas.mesh;
    let (board, values) = (Checkerboard::new(atlas), atlas.metric.log_scale.as_slice());
    let range = Range::of(mesh, values);
    let paint = BoardAndScale {
        board,
        scale: Coloured {
            range,
            mesh,
            values,
        },
    };
    let [mut preview, mut log_scale] = studio(mesh, size).draw(&marks(atlas), &paint);
    legend(&mut preview, atlas);
    range.bar(&mut log_scale, "log scale u");
    [preview, log_scale]
}

/// A surface in colours of its own; `size` × `size` pixels. `colour` gets a face and the barycentric weights of a point in it, and gives
/// linear light.
pub fn painted(
    mesh: &Mesh,
    size: usize,
    colour: &(dyn Fn(usize, [f64; 3]) -> Linear + Sync),
) -> RgbImage {
    let [image] = studio(mesh, size).draw(&[], &Painted(colour));
    image
}

/// The checkerboard, and the log scale.
struct BoardAndScale<'a> {
    board: Checkerboard<'a>,
    scale: Coloured<'a>,
}

impl Paint<2> for BoardAndScale<'_> {
    type OfFace = (FaceBoard, [f64; 3]);

    fn of_face(&self, face: usize) -> Self::OfFace {
        (self.board.of_face(face), self.scale.of_face(face))
    }

    fn colours(&self, (board, values): &mut Self::OfFace, spot: &Spot) -> [Linear; 2] {
        let [scale] = self.scale.colours(values, spot);
        [self.board.colour(board, spot), scale]
    }
}

/// The mean of a few places of a pixel.
struct Painted<'a>(&'a (dyn Fn(usize, [f64; 3]) -> Linear + Sync));

impl Paint<1> for Painted<'_> {
    type OfFace = ();

    fn of_face(&self, _: usize) {}

    fn colours(&self, (): &mut (), spot: &Spot) -> [Linear; 1] {
        let mut mean = [0.0; 3];
        for (x, y) in [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)] {
            let weight = |k: usize| spot.weights[k] + x * spot.right[k] + y * spot.down[k];
            let inside = [0, 1, 2].map(|k| weight(k).max(0.0));
            let sum: f64 = inside.iter().sum();
            let seen = (self.0)(spot.face, inside.map(|w| w / sum));
            mean = std::array::from_fn(|i| mean[i] + 0.25 * seen[i]);
        }
        [mean]
    }
}

fn studio(mesh: &Mesh, size: usize) -> Studio {
    Studio::views(Shape::of(mesh), size, false).swap_remove(0)
}

/// Balls at the cones and bars along the cut.
fn marks(atlas: &AffineAtlas) -> Vec<Mark> {
    let (positions, connectivity) = (&atlas.mesh.positions, &atlas.mesh.connectivity);
    let is_cut = atlas.cut.is_cut.as_slice();
    let cut = connectivity
        .edges()
        .filter(|e| is_cut.get(e.index()) == Some(&true));
    let bars = cut.map(|e| Mark::cut(connectivity.edge_vertices(e).map(|v| positions[v])));
    let cones = atlas.prescription.cones.iter();
    bars.chain(cones.map(|c| Mark::cone(positions[c.vertex], c.curvature, 1.0)))
        .collect()
}

/// What the marks mean, in the lower left corner; left out of small pictures.
fn legend(image: &mut RgbImage, atlas: &AffineAtlas) {
    let side = image.height() as usize;
    if side < 480 {
        return;
    }
    let mut entries: Vec<([u8; 3], String)> = Vec::new();
    for (positive, colour, sign) in [(true, POSITIVE, '+'), (false, NEGATIVE, '-')] {
        let cones = atlas.prescription.cones.iter();
        let n = cones.filter(|c| (c.curvature > 0.0) == positive).count();
        if n > 0 {
            let plural = if n == 1 { "" } else { "s" };
            entries.push((colour, format!("{n} cone{plural} ({sign})")));
        }
    }
    if !atlas.cut.segments.is_empty() {
        entries.push((CUT, "cut".into()));
    }
    let bottom = side - 14 - 22 * entries.len();
    for (k, (colour, words)) in entries.iter().enumerate() {
        let y = (bottom + 22 * k + 11) as f64;
        let square = (0..121).map(|at| (at % 11 - 5, at / 11 - 5));
        for (dx, dy) in square.filter(|(dx, dy)| dx * dx + dy * dy <= 27) {
            image.put_pixel((21 + dx) as u32, (y as i32 + dy) as u32, Rgb(*colour));
        }
        text::write(image, words, [34.0, y], 0.0, INK);
    }
}
