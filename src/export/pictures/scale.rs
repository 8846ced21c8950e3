//! Colours for the log scale: blue where the flat metric shrinks the surface, red where it grows.

use super::checkerboard::{ascending, weighted_quantile};
use super::colour::{INK, Linear, diverging, to_linear};
use super::studio::Spot;
use super::text;
use crate::geometry::ids::FaceId;
use crate::geometry::mesh::{Mesh, triangle_area};
use image::{Rgb, RgbImage};

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

    /// Colour of a spot of the surface by the values at the vertices of its face.
    pub(super) fn colour(self, mesh: &Mesh, values: &[f64], spot: &Spot) -> Linear {
        let corners = mesh.connectivity.face_vertices(FaceId::new(spot.face));
        let value = |k: usize| {
            let value = values.get(corners[k].index()).copied();
            spot.weights[k] * value.unwrap_or(f64::NAN)
        };
        let value = value(0) + value(1) + value(2);
        to_linear(diverging((value - self.middle) / self.reach))
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
