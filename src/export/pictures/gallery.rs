//! Several metrics on one surface, side by side from the same views in the same colours.

use super::colour::{INK, PAPER};
use super::scale::{Coloured, Range};
use super::studio::{Mark, Shape, Studio};
use super::text::{self, LINE};
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

/// A surface whose views and light stand ready.
pub struct Gallery<'a> {
    /// From the front and, where the surface is closed, from behind.
    studios: Vec<Studio>,
    mesh: &'a Mesh,
    side: usize,
}

impl<'a> Gallery<'a> {
    /// Sets up panels of `size` × `size` pixels, held to the range of sizes.
    pub fn new(mesh: &'a Mesh, size: usize) -> Gallery<'a> {
        Gallery {
            side: super::canvas::side(size),
            studios: Studio::views(Shape::of(mesh), size, mesh.connectivity.is_closed()),
            mesh,
        }
    }

    /// The panels in a row, each below its title, from the front and, where the surface is closed, below that from behind.
    ///
    /// Colours show the log scale relative to its median over the area: blue where the flat metric shrinks the surface and red
    /// where it grows. They mean the same in all panels and reach as far as the widest and the least wide range have in their
    /// geometric mean, so that the one need not be all pale nor the other all dark. Cones are red or blue by their
    /// sign, larger for more curvature.
    pub fn row(&self, panels: &[Panel<'_>]) -> RgbImage {
        let mesh = self.mesh;
        let ranges: Vec<Range> = (panels.iter())
            .map(|panel| Range::of(mesh, panel.log_scale))
            .collect();
        let reaches = ranges.iter().map(|r| r.reach);
        let least = reaches.clone().fold(f64::INFINITY, f64::min);
        let greatest = reaches.fold(0.0, f64::max);
        let reach = (least * greatest).sqrt();
        let side = self.side;
        let lines = panels.iter().map(|p| p.title.len()).max().unwrap_or(0);
        let head = lines * LINE + 2 * MARGIN;
        // The bar of colours has a place of its own, beside panels that have room for it.
        let strip = if side >= LEAST_BARRED { STRIP } else { 0 };
        let width = (side * panels.len() + strip).max(1);
        let height = side * self.studios.len() + head;
        let mut image = RgbImage::from_pixel(width as u32, height as u32, Rgb(PAPER));
        for (k, (panel, range)) in panels.iter().zip(ranges).enumerate() {
            let range = Range { reach, ..range };
            let paint = Coloured {
                range,
                mesh,
                values: panel.log_scale,
            };
            let (left, marks) = (k * side, marks(panel));
            for (row, studio) in self.studios.iter().enumerate() {
                let [drawn] = studio.draw(&marks, &paint);
                let top = head + row * side;
                imageops::replace(&mut image, &drawn, left as i64, top as i64);
            }
            for (line, words) in panel.title.iter().enumerate() {
                let middle = (left + side / 2) as f64;
                let y = (MARGIN + line * LINE + LINE / 2) as f64;
                text::write(&mut image, words, [middle, y], 0.5, INK);
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
}

fn marks(panel: &Panel<'_>) -> Vec<Mark> {
    let cut = panel.cut.iter().map(|&ends| Mark::cut(ends));
    let cones = panel.cones.iter().map(|&(place, curvature)| {
        // Areas of the balls are as the curvatures.
        let relative = (curvature.abs() / FRAC_PI_2).sqrt();
        let [least, greatest] = CONE_SIZES;
        Mark::cone(place, curvature, relative.clamp(least, greatest))
    });
    cut.chain(cones).collect()
}
