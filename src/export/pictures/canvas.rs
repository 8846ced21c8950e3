//! A sheet of paper: antialiased triangles, lines and discs in the plane.
//!
//! What is drawn is noted first and then filled band by band, in the order in which it was drawn.

use super::raster::{SAMPLES, covered, row_at, stroked};
use image::RgbImage;
use rayon::prelude::*;

/// Sides that pictures are held to, pixels: smaller ones show nothing, larger ones are a mistake.
pub const SIDE_RANGE: [usize; 2] = [64, 8192];
/// Rows of pixels that are filled at a time.
const BAND: usize = 16;

/// The size asked for, held to [`SIDE_RANGE`].
pub(super) fn side(size: usize) -> usize {
    size.clamp(SIDE_RANGE[0], SIDE_RANGE[1])
}

/// Red, green and blue in the last three bytes.
type Packed = u32;

fn packed([r, g, b]: [u8; 3]) -> Packed {
    u32::from_be_bytes([0, r, g, b])
}

/// What is drawn.
enum Shape {
    /// Its corners.
    Triangle([[f64; 2]; 3]),
    /// Its ends and half of its thickness.
    Line([[f64; 2]; 2], f64),
}

impl Shape {
    /// Its highest and its lowest place.
    fn rows(&self) -> [f64; 2] {
        match self {
            Shape::Triangle([a, b, c]) => [a[1].min(b[1]).min(c[1]), a[1].max(b[1]).max(c[1])],
            Shape::Line([a, b], radius) => [a[1].min(b[1]) - radius, a[1].max(b[1]) + radius],
        }
    }
}

/// The sheet. Coordinates are pixels, the origin at the top left, rows downwards.
pub struct Canvas {
    width: usize,
    height: usize,
    paper: [u8; 3],
    shapes: Vec<(Shape, Packed)>,
}

impl Canvas {
    /// A blank sheet of `width` × `height` pixels.
    pub fn new(width: usize, height: usize, paper: [u8; 3]) -> Canvas {
        Canvas {
            width,
            height,
            paper,
            shapes: Vec::new(),
        }
    }

    /// A triangle, whichever way it is turned. Beyond the blank paper its colour is multiplied with what lies beneath, so that overlaps are
    /// darker.
    pub fn triangle(&mut self, points: [[f64; 2]; 3], colour: [u8; 3]) {
        self.shapes.push((Shape::Triangle(points), packed(colour)));
    }

    /// A line with round ends, `thickness` pixels thick.
    pub fn line(&mut self, a: [f64; 2], b: [f64; 2], thickness: f64, colour: [u8; 3]) {
        let shape = Shape::Line([a, b], 0.5 * thickness);
        self.shapes.push((shape, packed(colour)));
    }

    /// A disc with a rim.
    pub fn disc(&mut self, centre: [f64; 2], radius: f64, colour: [u8; 3], rim: [u8; 3]) {
        self.line(centre, centre, 2.0 * radius, rim);
        self.line(centre, centre, 1.5 * radius, colour);
    }

    /// The picture, samples averaged.
    pub fn finish(self) -> RgbImage {
        let mut image = RgbImage::new(self.width as u32, self.height as u32);
        let in_band = self.in_bands();
        let bands = image.par_chunks_mut((3 * self.width * BAND).max(1));
        bands
            .zip(in_band)
            .enumerate()
            .for_each(|(b, (bytes, shapes))| {
                let samples = self.band(b * BAND..((b + 1) * BAND).min(self.height), &shapes);
                let lines = bytes.chunks_exact_mut(3 * self.width);
                for (line, of_line) in lines.zip(samples.chunks_exact(SAMPLES * self.width)) {
                    average(line, of_line);
                }
            });
        image
    }

    /// The shapes that reach into each band, in the order in which they were drawn.
    fn in_bands(&self) -> Vec<Vec<u32>> {
        let mut lists = vec![Vec::new(); self.height.div_ceil(BAND)];
        for (number, (shape, _)) in (0..).zip(&self.shapes) {
            let [top, bottom] = shape.rows().map(row_at);
            let end = bottom.min(self.height * SAMPLES);
            if top < end {
                let bands = top / (BAND * SAMPLES)..end.div_ceil(BAND * SAMPLES);
                for list in &mut lists[bands] {
                    list.push(number);
                }
            }
        }
        lists
    }

    /// The samples of some rows of pixels.
    fn band(&self, rows: std::ops::Range<usize>, shapes: &[u32]) -> Vec<Packed> {
        let (width, paper) = (self.width, packed(self.paper));
        let rows = rows.start * SAMPLES..rows.end * SAMPLES;
        let mut samples = vec![paper; width * rows.len()];
        for &number in shapes {
            let (shape, colour) = &self.shapes[number as usize];
            match shape {
                Shape::Triangle(points) => {
                    covered(*points, width, rows.clone(), |row, columns| {
                        for sample in &mut samples[(row - rows.start) * width..][columns] {
                            *sample = match *sample == paper {
                                true => *colour,
                                false => product(*sample, *colour, self.paper),
                            };
                        }
                    });
                }
                Shape::Line(ends, radius) => {
                    stroked(*ends, *radius, width, rows.clone(), |column, row, _, _| {
                        samples[(row - rows.start) * width + column] = *colour;
                    });
                }
            }
        }
        samples
    }
}

/// Two colours multiplied, relative to the paper's.
fn product(below: Packed, above: Packed, paper: [u8; 3]) -> Packed {
    let (below, above) = (below.to_be_bytes(), above.to_be_bytes());
    packed(std::array::from_fn(|i| {
        let product = u32::from(below[i + 1]) * u32::from(above[i + 1]);
        (product / u32::from(paper[i]).max(1)).min(255) as u8
    }))
}

/// Pixels of a line from their samples.
fn average(line: &mut [u8], samples: &[Packed]) {
    let width = line.len() / 3;
    let [a, b, c, d] = [0, 1, 2, 3].map(|k: usize| &samples[k * width..][..width]);
    for (x, pixel) in line.chunks_exact_mut(3).enumerate() {
        let of_pixel = [a[x], b[x], c[x], d[x]];
        let [first, ..] = of_pixel;
        let mean = match of_pixel == [first; SAMPLES] {
            true => first,
            false => mean(of_pixel),
        };
        let [_, r, g, b] = mean.to_be_bytes();
        pixel.copy_from_slice(&[r, g, b]);
    }
}

/// The mean of colours, red and blue at once.
fn mean(samples: [Packed; SAMPLES]) -> Packed {
    const HALVES: u32 = 0x00ff_00ff;
    let of = |shift: u32| {
        let sum: u32 = samples.iter().map(|s| (s >> shift) & HALVES).sum();
        ((sum + 0x0002_0002) / SAMPLES as u32) & HALVES
    };
    of(0) | of(8) << 8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_fill_their_area() {
        let mut canvas = Canvas::new(40, 40, [0; 3]);
        canvas.triangle([[0.0, 0.0], [40.0, 0.0], [0.0, 40.0]], [255; 3]);
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
        canvas.triangle([[30.0, 30.0], [50.0, 30.0], [30.0, 50.0]], [255; 3]);
        assert!(canvas.finish().pixels().all(|p| p.0 == [9; 3]));
    }
}
