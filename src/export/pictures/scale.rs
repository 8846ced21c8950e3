//! Colours for the log scale: blue where the flat metric shrinks the surface, red where it grows.

use super::checkerboard::weighted_quantile;
use super::colour::{INK, Linear, diverging, to_linear};
use super::text::{self, Anchor};
use crate::geometry::ids::{FaceId, VertexId};
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
        let mut sorted: Vec<(f64, f64)> = (values.iter().copied().zip(areas))
            .filter(|(x, area)| x.is_finite() && area.is_finite())
            .collect();
        sorted.sort_by(|x, y| x.0.total_cmp(&y.0));
        let middle = weighted_quantile(&sorted, 0.5);
        let reach = (weighted_quantile(&sorted, 0.995) - middle)
            .max(middle - weighted_quantile(&sorted, 0.005));
        let reach = if reach > 0.0 { reach } else { 1.0 };
        Range { middle, reach }
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
            text::write(image, &words, [left as f64 - 6.0, y], Anchor::End, INK);
        }
        let at = [right as f64 - 12.0, top as f64 - 18.0];
        text::write(image, title, at, Anchor::End, INK);
    }
}

/// Values at the vertices of a mesh in the colours of a range.
pub(super) struct Scale<'a> {
    mesh: &'a Mesh,
    values: &'a [f64],
    range: Range,
}

impl<'a> Scale<'a> {
    /// `values` holds one for each vertex of the mesh.
    pub fn new(mesh: &'a Mesh, values: &'a [f64], range: Range) -> Scale<'a> {
        Scale {
            mesh,
            values,
            range,
        }
    }

    /// Colour of a point of a face by its barycentric weights.
    pub fn colour(&self, face: usize, weights: [f64; 3]) -> Linear {
        let corners = self.mesh.connectivity.face_vertices(FaceId::new(face));
        let value = |v: VertexId| self.values.get(v.index()).copied().unwrap_or(f64::NAN);
        let value: f64 = (0..3).map(|k| weights[k] * value(corners[k])).sum();
        to_linear(diverging((value - self.range.middle) / self.range.reach))
    }
}
