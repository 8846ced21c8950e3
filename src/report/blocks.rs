//! How far the images of blocks are from the surface, by samples.
//!
//! *Enters:* the surface after repair, the mesh that was charted, and the images of its blocks. *Leaves:* a [`Deviation`].
//!
//! A point of the charted mesh has coordinates, and is looked for between the texels around these only; points between texels are looked for on all of
//! the surface. So no mesh is made of the images, whose faces are many more than the samples.
//!
//! *Guaranteed:* no distance is too small; the same result for any number of threads.
//! *Not guaranteed:* a point's distance is too large where another part of the images is nearer than that around its own place.

use crate::atlas::geometry_image::{GeometryImage, in_texels, mix};
use crate::atlas::patch::PatchLayout;
use crate::geometry::deviation::{
    Deviation, EvenSamples, Near, OneSided, Triangles, angle, evenly, nearest, normal, point_in,
    squared_distance,
};
use crate::geometry::ids::{FaceId, VertexId};
use crate::geometry::mesh::{Mesh, distance, triangle_area};
use rayon::prelude::*;

/// Squares of texels on each side of a point's own that it is looked for in.
const AROUND: usize = 1;

/// A surface and its images.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceImages<'a> {
    /// The charted mesh.
    pub mesh: &'a Mesh,
    /// Which face lies in which image, and where.
    pub layout: &'a PatchLayout,
    /// One a patch.
    pub images: &'a [GeometryImage],
    /// Added to their positions.
    pub origin: [f64; 3],
}

/// Corners in space.
type Triangle = [[f64; 3]; 3];

/// A point between texels, its triangle, and the area that it stands for.
struct Between {
    at: [f64; 3],
    triangle: Triangle,
    area: f64,
}

impl SurfaceImages<'_> {
    /// Measures the images against `source` by so many samples on each, and gives the distance of each vertex of the mesh from the images. `None` where
    /// either has no area.
    pub(super) fn deviation_of_blocks(
        &self,
        source: Triangles<'_>,
        samples: usize,
    ) -> Option<(Deviation, Vec<f64>)> {
        let c = &self.mesh.connectivity;
        let (positions, faces) = (self.mesh.positions.as_slice(), c.to_faces());
        let surface = Triangles {
            positions,
            faces: &faces,
        };
        let even = EvenSamples::new(surface, samples)?;
        let mut of_mesh = even.sum(|sum, (): &mut (), face, weights| {
            let corners = faces[face].map(|v| positions[v as usize]);
            let near = self.near(FaceId::new(face), weights, point_in(corners, weights));
            let angle = angle(normal(corners), near.normal);
            sum.add(even.area(), near.distance, angle);
        });
        let of_vertex = |v: usize| {
            let h = c.vertex_halfedge(VertexId::new(v));
            let weights = std::array::from_fn(|k| f64::from(u8::from(k == c.corner(h))));
            self.near(c.face(h), weights, positions[v]).distance
        };
        let vertices: Vec<f64> = (0..positions.len())
            .into_par_iter()
            .map(of_vertex)
            .collect();
        vertices.iter().for_each(|&d| of_mesh.reach(d));
        let of_images = self.between_texels(source, samples)?;
        Some((of_mesh.together(of_images), vertices))
    }

    /// What of the images is nearest to a point of a face, of that around its place.
    fn near(&self, face: FaceId, weights: [f64; 3], p: [f64; 3]) -> Near {
        let patch = self.layout.face_patch[face].index();
        let uv = mix(&self.layout.uv[face], weights);
        let image = &self.images[patch];
        // Where texels are sampled is half a texel further.
        let [x, y] = in_texels(&self.layout.patches[patch], uv).map(|x| (x - 0.5) as usize);
        let around = |x: usize, squares: usize| {
            let own = x.min(squares - 1);
            own.saturating_sub(AROUND)..(own + AROUND + 1).min(squares)
        };
        let (columns, rows) = (around(x, image.width - 1), around(y, image.height - 1));
        let squares = rows.flat_map(|row| columns.clone().map(move |column| [column, row]));
        let triangles = squares.flat_map(|square| self.triangles(patch, square));
        let found = triangles.map(|triangle| (squared_distance(p, triangle), triangle));
        let least = found.reduce(|a, b| if b.0 < a.0 { b } else { a });
        least.map_or(Near::default(), |(squared, triangle)| Near {
            distance: squared.sqrt(),
            normal: normal(triangle),
        })
    }

    /// The corners of the square between four texels, counterclockwise from its own texel.
    fn square(&self, patch: usize, [column, row]: [usize; 2]) -> [[f64; 3]; 4] {
        let image = &self.images[patch];
        [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[i, k]| {
            let p = image.position[image.width * (row + k) + column + i];
            std::array::from_fn(|x| f64::from(p[x]) + self.origin[x])
        })
    }

    /// Its two halves, parted along the shorter diagonal, as in a mesh that is made of the images.
    fn triangles(&self, patch: usize, square: [usize; 2]) -> [Triangle; 2] {
        let [a, b, c, d] = self.square(patch, square);
        match is_first_shorter([a, b, c, d]) {
            true => [[a, b, c], [a, c, d]],
            false => [[a, b, d], [b, c, d]],
        }
    }

    /// Points between texels, in squares evenly spread over the images, against the surface.
    fn between_texels(&self, source: Triangles<'_>, samples: usize) -> Option<OneSided> {
        let mut before = 0;
        let up_to: Vec<usize> = (self.images.iter())
            .map(|image| {
                before += (image.width - 1) * (image.height - 1);
                before
            })
            .collect();
        let squares = *up_to.last()?;
        let place = |i: usize| {
            let at = (2 * i + 1) * squares / (2 * samples);
            let patch = up_to.partition_point(|&end| end <= at);
            let within = at - patch.checked_sub(1).map_or(0, |k| up_to[k]);
            let columns = self.images[patch].width - 1;
            let square = self.square(patch, [within % columns, within / columns]);
            let (at, triangle) = point_of_square(square, evenly(i));
            let share = 2.0 * squares as f64 / samples as f64;
            Between {
                at,
                triangle,
                area: share * triangle_area(triangle),
            }
        };
        let points: Vec<Between> = (0..samples).into_par_iter().map(place).collect();
        let at: Vec<[f64; 3]> = points.iter().map(|point| point.at).collect();
        let mut sum = OneSided::default();
        for (point, near) in points.iter().zip(nearest(&at, source)?) {
            let angle = angle(normal(point.triangle), near.normal);
            sum.add(point.area, near.distance, angle);
        }
        Some(sum)
    }
}

fn is_first_shorter([a, b, c, d]: [[f64; 3]; 4]) -> bool {
    distance(a, c) <= distance(b, d)
}

/// The point at a place of the unit square, and the half that it lies in: each half of the square is a half of the unit square, affinely.
fn point_of_square(square: [[f64; 3]; 4], [r, s]: [f64; 2]) -> ([f64; 3], Triangle) {
    let [a, b, c, d] = square;
    let (triangle, weights) = match (is_first_shorter(square), s <= r, r + s <= 1.0) {
        (true, true, _) => ([a, b, c], [1.0 - r, r - s, s]),
        (true, false, _) => ([a, c, d], [1.0 - s, r, s - r]),
        (false, _, true) => ([a, b, d], [1.0 - r - s, r, s]),
        (false, _, false) => ([b, c, d], [1.0 - s, r + s - 1.0, 1.0 - r]),
    };
    (point_in(triangle, weights), triangle)
}
