//! Pictures of an atlas in space.

use super::checkerboard::Checkerboard;
use super::colour::{CUT, INK, Linear, NEGATIVE, POSITIVE};
use super::paint::Paint;
use super::scale::{Range, Scale};
use super::scene::Marks;
use super::studio::{Props, Studio};
use super::text::{self, Anchor};
use crate::geometry::mesh::Mesh;
use crate::product::AffineAtlas;
use image::{Rgb, RgbImage};

/// The surface with a checkerboard in flat coordinates, cones (red where the curvature is positive, blue where it is
/// negative) and the cut; `size` × `size` pixels.
///
/// Where the log scale is so extreme that cells would be too small or too large to read, their size changes by
/// powers of two, one fading into the next.
pub fn preview(atlas: &AffineAtlas, size: usize) -> RgbImage {
    Portrait::new(atlas, size).preview()
}

/// The surface coloured by the log scale, blue where the flat metric shrinks it and red where it grows, with a
/// bar of colours; `size` × `size` pixels. The middle is the median over the area.
pub fn log_scale(atlas: &AffineAtlas, size: usize) -> RgbImage {
    Portrait::new(atlas, size).log_scale()
}

/// A surface in colours of its own; `size` × `size` pixels. `colour` gets a face, the barycentric weights of a point in it and the size of a
/// pixel there in source units, and gives linear light.
pub fn painted(
    mesh: &Mesh,
    size: usize,
    colour: &(dyn Fn(usize, [f64; 3], f64) -> Linear + Sync),
) -> RgbImage {
    let studio = Studio::new(mesh, size);
    let props = studio.place(Marks::default());
    studio.draw(&props, &Paint::Edged(colour))
}

/// Radius of a bar along the cut, in sides of the picture.
pub(super) const CUT_RADIUS: f64 = 0.0026;
/// Radius of the ball at a cone, likewise.
pub(super) const CONE_RADIUS: f64 = 0.0125;

/// An atlas in the studio: one view and one light for all its pictures.
pub(super) struct Portrait<'a> {
    atlas: &'a AffineAtlas,
    studio: Studio<'a>,
    props: Props,
}

impl<'a> Portrait<'a> {
    /// Sets everything up for pictures of `size` × `size` pixels, held to the range of sizes.
    pub fn new(atlas: &'a AffineAtlas, size: usize) -> Portrait<'a> {
        let studio = Studio::new(&atlas.mesh, size);
        let props = studio.place(marks(atlas, &studio));
        Portrait {
            atlas,
            studio,
            props,
        }
    }

    /// See [`preview`].
    pub fn preview(&self) -> RgbImage {
        let board = Checkerboard::new(self.atlas);
        let paint = |face, weights, footprint| board.colour(face, weights, footprint);
        let mut image = self.studio.draw(&self.props, &Paint::Edged(&paint));
        legend(&mut image, self.atlas);
        image
    }

    /// See [`log_scale`].
    pub fn log_scale(&self) -> RgbImage {
        let values = self.atlas.metric.log_scale.as_slice();
        let range = Range::of(&self.atlas.mesh, values);
        let scale = Scale::new(&self.atlas.mesh, values, range);
        let paint = |face, weights, _| scale.colour(face, weights);
        let mut image = self.studio.draw(&self.props, &Paint::Smooth(&paint));
        range.bar(&mut image, "log scale u");
        image
    }
}

/// Balls at the cones and bars along the cut, sized for the picture.
fn marks(atlas: &AffineAtlas, studio: &Studio) -> Marks {
    let positions = &atlas.mesh.positions;
    let connectivity = &atlas.mesh.connectivity;
    let mut marks = Marks::default();
    for e in connectivity.edges() {
        if atlas.cut.is_cut.as_slice().get(e.index()) == Some(&true) {
            let [a, b] = connectivity.edge_vertices(e).map(|v| positions[v]);
            marks.cut_edge(a, b, studio.length(CUT_RADIUS, a));
        }
    }
    for cone in &atlas.prescription.cones {
        let p = positions[cone.vertex];
        marks.cone(p, cone.curvature, studio.length(CONE_RADIUS, p));
    }
    marks
}

/// What the marks mean, in the lower left corner; left out of small pictures.
fn legend(image: &mut RgbImage, atlas: &AffineAtlas) {
    let side = image.height() as usize;
    if side < 480 {
        return;
    }
    let mut entries: Vec<([u8; 3], String)> = Vec::new();
    let count = |positive: bool| {
        let cones = atlas.prescription.cones.iter();
        cones.filter(|c| (c.curvature > 0.0) == positive).count()
    };
    for (positive, colour, sign) in [(true, POSITIVE, '+'), (false, NEGATIVE, '-')] {
        let n = count(positive);
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
        for dy in -5_i32..=5 {
            for dx in -5_i32..=5 {
                if dx * dx + dy * dy <= 27 {
                    let (x, y) = ((21 + dx) as u32, (y as i32 + dy) as u32);
                    image.put_pixel(x, y, Rgb(*colour));
                }
            }
        }
        text::write(image, words, [34.0, y], Anchor::Start, INK);
    }
}
