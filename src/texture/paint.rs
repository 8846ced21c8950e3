//! The texture: every texel of the packed square in the colour of the exemplar at its place.
//!
//! *Enters:* a surface, tile coordinates and an exemplar. *Leaves:* a [`Painted`] square.
//!
//! *Guaranteed:* a texel whose centre lies in a patch holds the mean of the exemplar over the texel as it lies on the tile, in linear
//! light (bilinear interpolation where the texel is smaller than a pixel). Outside, the pattern goes on over [`MARGIN`] texels, as the
//! nearest texel in a patch has it, and beyond that its colour is repeated: neither bilinear filtering nor smaller copies see what lies
//! between patches. The same for any number of threads.

use super::exemplar::{Exemplar, to_pixel};
use super::field::Field;
use super::gaussian::Complex;
use crate::atlas::geometry_image::nearest_sources;
use crate::atlas::raster::cover;
use crate::geometry::ids::NONE;
use crate::read::flat::FlatSurface;
use rayon::prelude::*;

/// Texels outside a patch over which its pattern goes on.
pub const MARGIN: f64 = 4.0;
/// Most samples along a side of a texel that is larger than a pixel; below, one for each pixel.
const SAMPLES: usize = 4;

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
pub(super) fn in_texels(surface: &FlatSurface, face: usize, size: usize) -> [[f64; 2]; 3] {
    let size = size as f64;
    surface
        .packed(face)
        .map(|[u, v]| [size * u, size * (1.0 - v)])
}

/// Paints a square of `size` × `size` texels, at least one.
#[must_use]
pub fn paint(surface: &FlatSurface, field: &Field, exemplar: &Exemplar, size: usize) -> Painted {
    let size = size.max(1);
    let face_of = owners(surface, size);
    let sources: Vec<bool> = face_of.iter().map(|&f| f != NONE).collect();
    let nearest = nearest_sources(&sources, size);
    let brush = Brush {
        surface,
        field,
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
            face => brush.texel(face as usize, centre(source), centre(at)),
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
fn owners(surface: &FlatSurface, size: usize) -> Vec<u32> {
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
    surface: &'a FlatSurface,
    field: &'a Field,
    exemplar: &'a Exemplar,
    size: usize,
}

impl Brush<'_> {
    /// The colour at a place near a texel centre `from` that belongs to a face.
    fn texel(&self, face: usize, from: [f64; 2], place: [f64; 2]) -> [u8; 4] {
        let corners = in_texels(self.surface, face, self.size);
        let values = self.field.corners[face].map(Complex::point);
        let steps = self.steps(face, corners, values);
        let weights = barycentric(corners, from);
        let base = (0..3).fold(Complex::ZERO, |sum, k| sum + values[k].scaled(weights[k]));
        let middle =
            base + steps[0].scaled(place[0] - from[0]) + steps[1].scaled(place[1] - from[1]);
        let side = steps[0].length().max(steps[1].length());
        let pixels = side * self.exemplar.size()[0] as f64;
        if pixels <= 1.0 {
            return to_pixel(self.exemplar.mean(middle.coordinates(), side));
        }
        let count = (pixels.ceil() as usize).min(SAMPLES);
        let part = 1.0 / count as f64;
        let offset = |k: usize| (k as f64 + 0.5) * part - 0.5;
        let mut sum = [0.0; 4];
        for i in 0..count {
            for j in 0..count {
                let at = middle + steps[0].scaled(offset(i)) + steps[1].scaled(offset(j));
                let mean = self.exemplar.mean(at.coordinates(), side * part);
                for (sum, c) in sum.iter_mut().zip(mean) {
                    *sum += part * part * c;
                }
            }
        }
        to_pixel(sum)
    }

    /// How tile coordinates change from texel to texel to the right and down. In a flat patch that is one similarity: faces without
    /// area, of which it could not be told, have it too.
    fn steps(&self, face: usize, corners: [[f64; 2]; 3], values: [Complex; 3]) -> [Complex; 2] {
        let patch = &self.surface.patches[self.surface.patch[face] as usize];
        if let Some(to_chart) = patch.to_chart {
            let length = to_chart.scale / (patch.packed_scale * self.size as f64);
            let turn = Complex::new(to_chart.rotation.cos(), to_chart.rotation.sin());
            let right = self.field.scale * turn.scaled(length);
            return [right, right * Complex::quarter_turns(3)];
        }
        let [a, b] = [1, 2].map(|k| [corners[k][0] - corners[0][0], corners[k][1] - corners[0][1]]);
        let [p, q] = [1, 2].map(|k| values[k] - values[0]);
        let det = a[0] * b[1] - a[1] * b[0];
        let steps = [
            (p.scaled(b[1]) - q.scaled(a[1])).scaled(1.0 / det),
            (q.scaled(a[0]) - p.scaled(b[0])).scaled(1.0 / det),
        ];
        // A texel that spans the surface has its mean colour; so has one on a face without area.
        match steps.iter().all(|s| s.length() < 1e3) {
            true => steps,
            false => [Complex::new(1e3, 0.0), Complex::new(0.0, 1e3)],
        }
    }
}

/// Weights of a triangle's corners at a point, held to the triangle; the same for all corners where it has no area.
fn barycentric(t: [[f64; 2]; 3], p: [f64; 2]) -> [f64; 3] {
    let area =
        |a: [f64; 2], b: [f64; 2]| (a[0] - p[0]) * (b[1] - p[1]) - (a[1] - p[1]) * (b[0] - p[0]);
    let parts = [area(t[1], t[2]), area(t[2], t[0]), area(t[0], t[1])];
    let sum: f64 = parts.iter().sum();
    let held = parts.map(|x| (x / sum).max(0.0));
    let total: f64 = held.iter().sum();
    match total.is_finite() && total > 0.0 {
        true => held.map(|x| x / total),
        false => [1.0 / 3.0; 3],
    }
}
