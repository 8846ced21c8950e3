//! A supersampled sheet of paper: triangles, lines and discs in the plane.

use super::raster::covered;
use image::{Rgb, RgbImage};

/// Samples along each side of a pixel.
const SAMPLES: usize = 3;

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
            samples: vec![paper; width * height * SAMPLES * SAMPLES],
        }
    }

    fn end(&self) -> [usize; 2] {
        [self.width * SAMPLES, self.height * SAMPLES]
    }

    /// A triangle, whichever way it is turned; `colour` is told what lies beneath.
    pub fn triangle(&mut self, points: [[f64; 2]; 3], colour: impl Fn([u8; 3]) -> [u8; 3]) {
        let scaled = points.map(|p| [p[0] * SAMPLES as f64, p[1] * SAMPLES as f64, 0.0]);
        let end = self.end();
        covered(&scaled, end, 0, |column, row, _| {
            let sample = &mut self.samples[row * end[0] + column];
            *sample = colour(*sample);
        });
    }

    /// A line with round ends, `width` pixels thick.
    pub fn line(&mut self, a: [f64; 2], b: [f64; 2], width: f64, colour: [u8; 3]) {
        let scale = SAMPLES as f64;
        let (a, b) = (a.map(|x| x * scale), b.map(|x| x * scale));
        let radius = 0.5 * width * scale;
        if a.iter().chain(&b).any(|x| !x.is_finite()) {
            return;
        }
        let axis = [b[0] - a[0], b[1] - a[1]];
        let length2 = axis[0] * axis[0] + axis[1] * axis[1];
        let end = self.end();
        let range = |k: usize| {
            let low = (a[k].min(b[k]) - radius).floor().max(0.0) as usize;
            let high = (a[k].max(b[k]) + radius).ceil().clamp(0.0, end[k] as f64);
            low..high as usize
        };
        let columns = range(0);
        let half = radius * length2.sqrt() / axis[1].abs();
        for row in range(1) {
            // Where the row comes as near as that to the whole line, and a sample more; casts saturate.
            let middle = a[0] + axis[0] * (row as f64 + 0.5 - a[1]) / axis[1] - 0.5;
            let (from, to) = match (middle - half, middle + half) {
                (from, to) if from.is_finite() && to.is_finite() => {
                    ((from - 1.0) as usize, (to + 2.0) as usize)
                }
                _ => (columns.start, columns.end),
            };
            for column in columns.start.max(from)..columns.end.min(to) {
                let d = [column as f64 + 0.5 - a[0], row as f64 + 0.5 - a[1]];
                let along = d[0] * axis[0] + d[1] * axis[1];
                let t = if length2 > 0.0 {
                    (along / length2).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                let away = [d[0] - t * axis[0], d[1] - t * axis[1]];
                if away[0] * away[0] + away[1] * away[1] <= radius * radius {
                    self.samples[row * end[0] + column] = colour;
                }
            }
        }
    }

    /// A dashed line.
    pub fn dashes(&mut self, a: [f64; 2], b: [f64; 2], width: f64, colour: [u8; 3]) {
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        let pieces = (length / (8.0 * width)).clamp(1.0, 4096.0) as usize;
        let at = |t: f64| [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])];
        for k in 0..pieces {
            let from = k as f64 / pieces as f64;
            let to = (k as f64 + 0.5) / pieces as f64;
            self.line(at(from), at(to), width, colour);
        }
    }

    /// A disc with a rim.
    pub fn disc(&mut self, centre: [f64; 2], radius: f64, colour: [u8; 3], rim: [u8; 3]) {
        self.line(centre, centre, 2.0 * radius, rim);
        self.line(centre, centre, 1.5 * radius, colour);
    }

    /// The picture, samples averaged.
    pub fn finish(self) -> RgbImage {
        let columns = self.width * SAMPLES;
        RgbImage::from_fn(self.width as u32, self.height as u32, |x, y| {
            let mut sum = [0_u32; 3];
            for row in 0..SAMPLES {
                let from = (y as usize * SAMPLES + row) * columns + x as usize * SAMPLES;
                for sample in &self.samples[from..from + SAMPLES] {
                    for (s, &c) in sum.iter_mut().zip(sample) {
                        *s += u32::from(c);
                    }
                }
            }
            let count = (SAMPLES * SAMPLES) as u32;
            Rgb(sum.map(|s| ((s + count / 2) / count) as u8))
        })
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
        canvas.dashes([100.0, 100.0], [1e9, 100.0], 1.0, [255; 3]);
        canvas.triangle([[30.0, 30.0], [50.0, 30.0], [30.0, 50.0]], |_| [255; 3]);
        assert!(canvas.finish().pixels().all(|p| p.0 == [9; 3]));
    }
}
