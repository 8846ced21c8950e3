//! Several metrics on one surface, side by side from the same view in the same colours.

use super::colour::{INK, PAPER};
use super::paint::Paint;
use super::scale::{Range, Scale};
use super::scene::Marks;
use super::studio::Studio;
use super::surface::{CONE_RADIUS, CUT_RADIUS};
use super::text::{self, Anchor, LINE};
use super::view::Vec3;
use crate::geometry::mesh::Mesh;
use image::{Rgb, RgbImage, imageops};
use std::f64::consts::FRAC_PI_2;

/// Radii of cones over that of one of ±π/2, least and greatest.
const CONE_SIZES: [f64; 2] = [0.45, 2.2];
/// Pixels of the strip with the bar of colours, and panels from which on there is one.
const STRIP: usize = 132;
const LEAST_BARRED: usize = 320;
/// Pixels above and below the titles.
const MARGIN: usize = 8;

/// One surface with one metric.
pub struct Panel<'a> {
    /// Lines above it.
    pub title: Vec<String>,
    /// Logarithm of the length scale at every vertex of the mesh, up to a constant.
    pub log_scale: &'a [f64],
    /// Edges of the cut, source units.
    pub cut: &'a [[[f64; 3]; 2]],
    /// Place and curvature of the cones, radians.
    pub cones: Vec<([f64; 3], f64)>,
}

/// A surface whose view and light stand ready.
pub struct Gallery<'a> {
    studio: Studio<'a>,
}

impl<'a> Gallery<'a> {
    /// Sets up panels of `size` × `size` pixels, held to the range of sizes.
    pub fn new(mesh: &'a Mesh, size: usize) -> Gallery<'a> {
        Gallery {
            studio: Studio::new(mesh, size),
        }
    }

    /// The panels in a row, each below its title, coloured by the log scale relative to its median over the area: blue where the
    /// flat metric shrinks the surface and red where it grows. The colours mean the same in all of them and reach as far
    /// as the widest and the least wide range have in their geometric mean, so that the one need not be all pale nor
    /// the other all dark. Cones are red or blue by their sign, larger for more curvature.
    pub fn row(&self, panels: &[Panel<'_>]) -> RgbImage {
        let mesh = self.studio.mesh;
        let ranges: Vec<Range> = (panels.iter())
            .map(|panel| Range::of(mesh, panel.log_scale))
            .collect();
        let reaches = ranges.iter().map(|r| r.reach);
        let least = reaches.clone().fold(f64::INFINITY, f64::min);
        let greatest = reaches.fold(0.0, f64::max);
        let reach = (least * greatest).sqrt();
        let side = self.studio.size;
        let lines = panels.iter().map(|p| p.title.len()).max().unwrap_or(0);
        let head = lines * LINE + 2 * MARGIN;
        // The bar of colours has a place of its own, beside panels that have room for it.
        let strip = if side >= LEAST_BARRED { STRIP } else { 0 };
        let width = (side * panels.len() + strip).max(1);
        let mut image = RgbImage::from_pixel(width as u32, (side + head) as u32, Rgb(PAPER));
        for (k, (panel, range)) in panels.iter().zip(ranges).enumerate() {
            let range = Range { reach, ..range };
            let scale = Scale::new(mesh, panel.log_scale, range);
            let paint = |face, weights, _| scale.colour(face, weights);
            let props = self.studio.place(self.marks(panel));
            let drawn = self.studio.draw(&props, &Paint::Smooth(&paint));
            let left = k * side;
            imageops::replace(&mut image, &drawn, left as i64, head as i64);
            for (line, words) in panel.title.iter().enumerate() {
                let middle = (left + side / 2) as f64;
                let y = (MARGIN + line * LINE + LINE / 2) as f64;
                text::write(&mut image, words, [middle, y], Anchor::Middle, INK);
            }
        }
        if strip > 0 {
            let mut bar = RgbImage::from_pixel(strip as u32, side as u32, Rgb(PAPER));
            let shown = Range { middle: 0.0, reach };
            shown.bar(&mut bar, "u - median");
            let left = side * panels.len();
            imageops::replace(&mut image, &bar, left as i64, head as i64);
        }
        image
    }

    fn marks(&self, panel: &Panel<'_>) -> Marks {
        let mut marks = Marks::default();
        for &[a, b] in panel.cut {
            marks.cut_edge(a, b, self.studio.length(CUT_RADIUS, a));
        }
        for &(place, curvature) in &panel.cones {
            marks.cone(place, curvature, self.radius(place, curvature));
        }
        marks
    }

    /// Areas of the balls are as the curvatures.
    fn radius(&self, place: Vec3, curvature: f64) -> f64 {
        let relative = (curvature.abs() / FRAC_PI_2).sqrt();
        let [least, greatest] = CONE_SIZES;
        relative.clamp(least, greatest) * self.studio.length(CONE_RADIUS, place)
    }
}
