//! The texture: every texel of the packed square in the colour of the exemplar at its place.
//!
//! *Enters:* a surface with its grid, a tiling and an exemplar. *Leaves:* a [`Painted`] square.
//!
//! *Guaranteed:* a texel whose centre lies in a patch holds the mean of the exemplar over the texel as it lies on the grid, in linear
//! light (bilinear interpolation where the texel is smaller than a pixel). Patches lie in the square as on the grid but for scale, quarter turns and
//! translations, so that texels are squares along the grid's axes. Outside, the pattern goes on over [`MARGIN`] texels, as the
//! nearest texel in a patch has it, and beyond that its colour is repeated: neither bilinear filtering nor smaller copies see what lies
//! between patches. The same for any number of threads.

use super::exemplar::{Exemplar, to_pixel};
use super::tiling::Tiling;
use crate::atlas::geometry_image::nearest_sources;
use crate::atlas::raster::cover;
use crate::geometry::ids::NONE;
use crate::grid::complex::turned;
use crate::read::gridded::GriddedSurface;
use rayon::prelude::*;

/// Texels outside a patch over which its pattern goes on.
pub const MARGIN: f64 = 4.0;

/// A square of texels, row 0 at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Painted {
    /// Texels along a side.
    pub size: usize,
    /// sRGB and opacity.
    pub texels: Vec<[u8; 4]>,
    /// Texels whose centre lies in a patch.
    pub covered: usize,
}

impl Painted {
    /// Bilinear interpolation at a place in texels (centres at halves), channels of 255.
    #[must_use]
    pub fn at(&self, place: [f64; 2]) -> [f64; 4] {
        let last = self.size.saturating_sub(1);
        let place = place.map(|x| (x - 0.5).clamp(0.0, last as f64));
        let [x, y] = place.map(|x| x as usize);
        let [s, t] = [place[0] - x as f64, place[1] - y as f64];
        let mut sum = [0.0; 4];
        for (column, row, weight) in [
            (x, y, (1.0 - s) * (1.0 - t)),
            (x + 1, y, s * (1.0 - t)),
            (x, y + 1, (1.0 - s) * t),
            (x + 1, y + 1, s * t),
        ] {
            let texel = self.texels[row.min(last) * self.size + column.min(last)];
            for (sum, c) in sum.iter_mut().zip(texel) {
                *sum += weight * f64::from(c);
            }
        }
        sum
    }
}

/// Corners of a face in a square of that many texels.
pub(super) fn in_texels(surface: &GriddedSurface, face: usize, size: usize) -> [[f64; 2]; 3] {
    let size = size as f64;
    surface
        .packed(face)
        .map(|[u, v]| [size * u, size * (1.0 - v)])
}

/// Paints a square of `size` × `size` texels, at least one.
#[must_use]
pub fn paint(
    surface: &GriddedSurface,
    tiling: &Tiling,
    exemplar: &Exemplar,
    size: usize,
) -> Painted {
    let size = size.max(1);
    let face_of = owners(surface, size);
    let sources: Vec<bool> = face_of.iter().map(|&f| f != NONE).collect();
    let nearest = nearest_sources(&sources, size);
    let brush = Brush {
        surface,
        tiling,
        exemplar,
        size,
    };
    let centre = |at: usize| [(at % size) as f64 + 0.5, (at / size) as f64 + 0.5];
    let is_near = |at: usize| {
        let (place, from) = (centre(at), centre(nearest[at]));
        (place[0] - from[0]).hypot(place[1] - from[1]) <= MARGIN
    };
    let near = (0..nearest.len()).into_par_iter().map(|at| {
        let source = nearest[at];
        match face_of[source] {
            NONE => [0; 4],
            _ if !is_near(at) => [0; 4],
            face => brush.texel(face as usize, centre(at)),
        }
    });
    let near: Vec<[u8; 4]> = near.collect();
    let texels = (0..nearest.len()).into_par_iter();
    let texels = texels.map(|at| near[if is_near(at) { at } else { nearest[at] }]);
    Painted {
        size,
        texels: texels.collect(),
        covered: sources.iter().filter(|&&covered| covered).count(),
    }
}

/// The face that each texel centre lies in, the lowest of several; [`NONE`] outside. A patch without any texel centre gets one texel all the
/// same where it is free.
fn owners(surface: &GriddedSurface, size: usize) -> Vec<u32> {
    let mut face_of = vec![NONE; size * size];
    let mut is_seen = vec![false; surface.patches.len()];
    for face in 0..surface.faces.len() {
        let patch = surface.patch[face] as usize;
        cover(in_texels(surface, face, size), size, size, |x, y, _| {
            let owner = &mut face_of[y * size + x];
            *owner = (*owner).min(face as u32);
            is_seen[patch] = true;
        });
    }
    for face in 0..surface.faces.len() {
        let patch = surface.patch[face] as usize;
        if std::mem::replace(&mut is_seen[patch], true) {
            continue;
        }
        let corners = in_texels(surface, face, size);
        let middle = |i: usize| corners.iter().map(|p| p[i]).sum::<f64>() / 3.0;
        let [x, y] = [0, 1].map(|i| (middle(i).max(0.0) as usize).min(size - 1));
        let owner = &mut face_of[y * size + x];
        *owner = (*owner).min(face as u32);
    }
    face_of
}

struct Brush<'a> {
    surface: &'a GriddedSurface,
    tiling: &'a Tiling,
    exemplar: &'a Exemplar,
    size: usize,
}

impl Brush<'_> {
    /// The colour of the texel around a place in or near a face.
    fn texel(&self, face: usize, place: [f64; 2]) -> [u8; 4] {
        let surface = self.surface;
        let packing = surface.patches[surface.patch[face] as usize];
        let side = 1.0 / (packing.scale * self.size as f64);
        let [corner, ..] = in_texels(surface, face, self.size);
        let from_corner = [side * (place[0] - corner[0]), side * (corner[1] - place[1])];
        let [x, y] = turned(from_corner, surface.patch_turns[face]);
        let [[u, v], ..] = surface.grid_uv[face];
        let at = self.tiling.repeats([u + x, v + y]);
        to_pixel(self.exemplar.mean(at, self.tiling.repeats([side; 2])))
    }
}
