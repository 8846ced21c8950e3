//! Colours for the log scale: blue where the flat metric shrinks the surface, red where it grows.

use super::aspect::Spot;
use super::brush::Paint;
use super::checkerboard::{ascending, weighted_quantile};
use super::colour::{INK, Linear, diverging, to_linear};
use super::text;
use crate::geometry::ids::FaceId;
use crate::geometry::mesh::{Mesh, triangle_area};
use image::{Rgb, RgbImage};
use std::sync::LazyLock;

/// Colours of the scale that are told apart; an odd number, for a middle.
const COLOURS: usize = 2047;
/// They, from one end to the other.
static SCALE: LazyLock<Vec<Linear>> = LazyLock::new(|| {
    let at = |k: usize| 2.0 * k as f64 / (COLOURS - 1) as f64 - 1.0;
    (0..COLOURS).map(|k| to_linear(diverging(at(k)))).collect()
});

/// Which values get which colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Range {
    /// The pale middle: the median over the area.
    pub middle: f64,
    /// What is so far from it gets the ends of the scale.
    pub reach: f64,
}

impl Range {
    /// The range of values at the vertices of a mesh. One percent of the area, usually that next to cones, may lie beyond the
    /// ends of the scale.
    pub fn of(mesh: &Mesh, values: &[f64]) -> Range {
        // By area, for splits crowd the vertices around cones.
        let mut areas = vec![0.0; mesh.connectivity.vertex_count()];
        for f in mesh.connectivity.faces() {
            let area = triangle_area(mesh.face_positions(f));
            for v in mesh.connectivity.face_vertices(f) {
                areas[v.index()] += area;
            }
        }
        let sorted = ascending(values.iter().copied().zip(areas));
        let middle = weighted_quantile(&sorted, 0.5);
        let reach = (weighted_quantile(&sorted, 0.995) - middle)
            .max(middle - weighted_quantile(&sorted, 0.005));
        let reach = if reach > 0.0 { reach } else { 1.0 };
        Range { middle, reach }
    }

    /// Colour of a spot of the surface by the values at the corners of its face.
    fn colour(self, values: &[f64; 3], spot: &Spot) -> Linear {
        let [a, b, c] = values;
        let value = spot.weights[0] * a + spot.weights[1] * b + spot.weights[2] * c;
        let x = (value - self.middle) / self.reach;
        let at = ((x + 1.0) * (0.5 * (COLOURS - 1) as f64) + 0.5) as i32;
        match x.is_nan() {
            true => SCALE[COLOURS / 2],
            false => SCALE[at.clamp(0, COLOURS as i32 - 1) as usize],
        }
    }

    /// A vertical bar of colours with numbers, at the right; left out of small pictures.
    pub fn bar(self, image: &mut RgbImage, title: &str) {
        let Range { middle, reach } = self;
        let side = image.height() as usize;
        if side < 320 {
            return;
        }
        let (top, bottom) = (side / 4, 3 * side / 4);
        let right = image.width() as usize;
        let left = right.saturating_sub(22);
        for y in top..bottom {
            let t = 1.0 - 2.0 * (y - top) as f64 / (bottom - top) as f64;
            for x in left..left + 10 {
                image.put_pixel(x as u32, y as u32, Rgb(diverging(t)));
            }
        }
        for t in [-1.0, 0.0, 1.0] {
            let y = 0.5 * ((top + bottom) as f64 - t * (bottom - top) as f64);
            let words = format!("{:+.2}", middle + t * reach);
            text::write(image, &words, [left as f64 - 6.0, y], 1.0, INK);
        }
        let at = [right as f64 - 12.0, top as f64 - 18.0];
        text::write(image, title, at, 1.0, INK);
    }
}

/// A surface in the colours of values at its vertices.
pub(super) struct Coloured<'a> {
    pub range: Range,
    pub mesh: &'a Mesh,
    /// Those that are missing have no colour.
    pub values: &'a [f64],
}

impl Paint<1> for Coloured<'_> {
    type OfFace = [f64; 3];

    fn of_face(&self, face: usize) -> [f64; 3] {
        let corners = self.mesh.connectivity.face_vertices(FaceId::new(face));
        corners.map(|v| self.values.get(v.index()).copied().unwrap_or(f64::NAN))
    }

    fn colours(&self, values: &mut [f64; 3], spot: &Spot) -> [Linear; 1] {
        [self.range.colour(values, spot)]
    }
}
