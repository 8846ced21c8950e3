//! A sheet of paper: antialiased triangles, lines and discs in the plane.

use super::raster::{SAMPLES, covered, stroked};
use image::RgbImage;

/// Sides that pictures are held to, pixels: smaller ones show nothing, larger ones are a mistake.
pub const SIDE_RANGE: [usize; 2] = [64, 8192];

/// The size asked for, held to [`SIDE_RANGE`].
pub(super) fn side(size: usize) -> usize {
    size.clamp(SIDE_RANGE[0], SIDE_RANGE[1])
}

/// The sheet. Coordinates are pixels, the origin at the top left, rows downwards.
pub struct Canvas {
    width: usize,
    height: usize,
    samples: Vec<[u8; 3]>,
}

impl Canvas {
    /// A blank sheet of `width` × `height` pixels.
    pub fn new(width: usize, height: usize, paper: [u8; 3]) -> Canvas {
        Canvas {
            width,
            height,
            samples: vec![paper; width * height * SAMPLES],
        }
    }

    /// A triangle, whichever way it is turned; `colour` is told what lies beneath.
    pub fn triangle(&mut self, points: [[f64; 2]; 3], colour: impl Fn([u8; 3]) -> [u8; 3]) {
        let width = self.width;
        covered(points, width, 0..self.height * SAMPLES, |row, columns| {
            for sample in &mut self.samples[row * width..][columns] {
                *sample = colour(*sample);
            }
        });
    }

    /// A line with round ends, `thickness` pixels thick.
    pub fn line(&mut self, a: [f64; 2], b: [f64; 2], thickness: f64, colour: [u8; 3]) {
        let (width, rows) = (self.width, 0..self.height * SAMPLES);
        stroked([a, b], 0.5 * thickness, width, rows, |column, row, _, _| {
            self.samples[row * width + column] = colour;
        });
    }

    /// A disc with a rim.
    pub fn disc(&mut self, centre: [f64; 2], radius: f64, colour: [u8; 3], rim: [u8; 3]) {
        self.line(centre, centre, 2.0 * radius, rim);
        self.line(centre, centre, 1.5 * radius, colour);
    }

    /// The picture, samples averaged.
    pub fn finish(self) -> RgbImage {
        let mut image = RgbImage::new(self.width as u32, self.height as u32);
        let lines = image.chunks_exact_mut(3 * self.width);
        for (line, samples) in lines.zip(self.samples.chunks_exact(SAMPLES * self.width)) {
            for (x, pixel) in line.chunks_exact_mut(3).enumerate() {
                let of_pixel: [[u8; 3]; SAMPLES] =
                    std::array::from_fn(|k| samples[k * self.width + x]);
                for (i, byte) in pixel.iter_mut().enumerate() {
                    let sum: u32 = of_pixel.iter().map(|sample| u32::from(sample[i])).sum();
                    *byte = ((sum + SAMPLES as u32 / 2) / SAMPLES as u32) as u8;
                }
            }
        }
        image
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_fill_their_area() {
        let mut canvas = Canvas::new(40, 40, [0; 3]);
        canvas.triangle([[0.0, 0.0], [40.0, 0.0], [0.0, 40.0]], |_| [255; 3]);
        let image = canvas.finish();
        let sum: f64 = image.pixels().map(|p| f64::from(p.0[0]) / 255.0).sum();
        assert!((sum - 800.0).abs() < 10.0, "{sum}");
        let mut canvas = Canvas::new(40, 40, [0; 3]);
        canvas.disc([20.0, 20.0], 12.0, [255; 3], [255; 3]);
        let sum: f64 = (canvas.finish().pixels())
            .map(|p| f64::from(p.0[0]) / 255.0)
            .sum();
        assert!((sum - 144.0 * std::f64::consts::PI).abs() < 5.0, "{sum}");
    }

    #[test]
    fn lines_off_the_sheet_and_without_a_place_leave_it_blank() {
        let mut canvas = Canvas::new(20, 20, [9; 3]);
        canvas.line([-1e12, -50.0], [1e12, -40.0], 3.0, [255; 3]);
        canvas.line([f64::NAN, 0.0], [5.0, 5.0], 3.0, [255; 3]);
        canvas.line([100.0, 100.0], [1e9, 100.0], 1.0, [255; 3]);
        canvas.triangle([[30.0, 30.0], [50.0, 30.0], [30.0, 50.0]], |_| [255; 3]);
        assert!(canvas.finish().pixels().all(|p| p.0 == [9; 3]));
    }
}
