//! The exemplar: an image that repeats in both directions, and its mean over any rectangle.
//!
//! *Enters:* an image file. *Leaves:* an [`Exemplar`], and how well it repeats and which turns it survives.
//!
//! Means are exact: sums over all pixels left of and above a point stand ready, so that a mean over a rectangle costs four look-ups
//! whatever its size. They are taken in linear light and weighted by opacity; over one pixel the mean is bilinear interpolation.

use super::ExemplarError;
use crate::export::pictures::colour::{to_bytes, to_linear};
use crate::read::bounded::open_regular;
use image::{ImageFormat, ImageReader, Rgba, RgbaImage};
use std::io::BufReader;
use std::path::Path;

/// Most pixels a side.
const SIDE_LIMIT: u32 = 4096;
/// Linear light is summed in whole parts of this.
const PARTS: f32 = 65535.0;
/// Mean difference of channels (of 255) up to which an image counts as the same: what rounding to bytes does.
const SAME: f64 = 1.0;
/// Samples along a side of a tile that is looked at for its symmetry where the image is no square.
const TILE: u32 = 256;

/// An image that repeats.
#[derive(Clone, Debug)]
pub struct Exemplar {
    image: RgbaImage,
    /// Sums over the pixels left of and above each pixel corner: linear light times opacity, and opacity.
    sums: Vec<[u64; 4]>,
}

/// How the two sides of an image fit each other when it repeats: mean differences of channels (of 255).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Border {
    /// Last column and first column, last row and first row.
    pub across: [f64; 2],
    /// The most that neighbouring columns, and rows, differ.
    pub inside: [f64; 2],
}

impl Border {
    /// True where repeating makes no edge sharper than those inside.
    #[must_use]
    pub fn repeats(&self) -> bool {
        (0..2).all(|i| self.across[i] <= self.inside[i] + SAME)
    }
}

/// How a tile changes when it is turned about its middle: mean differences of channels (of 255).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Symmetry {
    /// By a quarter turn.
    pub quarter: f64,
    /// By half a turn.
    pub half: f64,
}

impl Symmetry {
    /// True where a quarter turn changes nothing.
    #[must_use]
    pub fn has_quarter(&self) -> bool {
        self.quarter <= SAME
    }

    /// True where half a turn changes nothing.
    #[must_use]
    pub fn has_half(&self) -> bool {
        self.half <= SAME
    }
}

impl Exemplar {
    /// Reads a file; its content decides about the format. Channels become 8 bits, the encoding is taken to be sRGB.
    ///
    /// # Errors
    /// A file that cannot be read, is no image, or is too large.
    pub fn read(path: &Path) -> Result<Self, ExemplarError> {
        let io = |source| ExemplarError::Io {
            path: path.to_owned(),
            source,
        };
        let no_image = |error: image::ImageError| ExemplarError::NoImage {
            path: path.to_owned(),
            problem: error.to_string(),
        };
        let open = || {
            let (file, _) = open_regular(path)?;
            let mut reader = ImageReader::new(BufReader::new(file));
            if let Ok(format) = ImageFormat::from_path(path) {
                reader.set_format(format);
            }
            // By its content, or where that says nothing by its name.
            reader.with_guessed_format()
        };
        let (width, height) = open().map_err(io)?.into_dimensions().map_err(no_image)?;
        if width.max(height) > SIDE_LIMIT {
            return Err(ExemplarError::TooLarge {
                path: path.to_owned(),
                width,
                height,
                limit: SIDE_LIMIT,
            });
        }
        let image = open().map_err(io)?.decode().map_err(no_image)?;
        Ok(Self::new(image.to_rgba8()))
    }

    /// Takes an image; one without pixels becomes one transparent pixel.
    #[must_use]
    pub fn new(image: RgbaImage) -> Self {
        let image = match image.is_empty() {
            true => RgbaImage::new(1, 1),
            false => image,
        };
        let (width, height) = (image.width() as usize, image.height() as usize);
        let mut sums = vec![[0; 4]; (width + 1) * (height + 1)];
        for (y, row) in image.rows().enumerate() {
            let mut running = [0u64; 4];
            for (x, pixel) in row.enumerate() {
                let [r, g, b, a] = pixel.0;
                let light = to_linear([r, g, b]).map(|c| (PARTS * c).round() as u64);
                let opacity = u64::from(a);
                for (sum, c) in running.iter_mut().zip(light) {
                    *sum += c * opacity;
                }
                running[3] += opacity;
                let above = sums[y * (width + 1) + x + 1];
                let here = &mut sums[(y + 1) * (width + 1) + x + 1];
                *here = std::array::from_fn(|i| above[i] + running[i]);
            }
        }
        Self { image, sums }
    }

    /// Columns and rows.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        [self.image.width() as usize, self.image.height() as usize]
    }

    /// True where some pixel is not opaque.
    #[must_use]
    pub fn is_transparent(&self) -> bool {
        self.image.pixels().any(|p| p.0[3] != 255)
    }

    /// Mean over a rectangle around a point of the repeating image: the point and the sides in repeats, x to the right in widths of the image and y
    /// up in heights from its lower left corner; a side of less than a pixel counts as one. Linear light times opacity, and opacity, 0 to 1.
    #[must_use]
    pub fn mean(&self, at: [f64; 2], sides: [f64; 2]) -> [f64; 4] {
        let size = self.size().map(|n| n as f64);
        let [width, height]: [f64; 2] = std::array::from_fn(|i| (sides[i] * size[i]).max(1.0));
        let middle = [at[0] * size[0], (1.0 - at[1]) * size[1]];
        let low = [middle[0] - 0.5 * width, middle[1] - 0.5 * height];
        let low: [f64; 2] = std::array::from_fn(|i| low[i].rem_euclid(size[i]));
        let [x0, y0] = low.map(|x| if x.is_finite() { x } else { 0.0 });
        let [x1, y1] = [x0 + width, y0 + height];
        let [a, b, c, d] = [[x1, y1], [x0, y1], [x1, y0], [x0, y0]].map(|p| self.sum(p));
        let scale = 1.0 / (255.0 * width * height);
        std::array::from_fn(|i| {
            let part = if i < 3 {
                scale / f64::from(PARTS)
            } else {
                scale
            };
            ((a[i] - b[i] - c[i] + d[i]) * part).max(0.0)
        })
    }

    /// Sum over the repeating image from its upper left corner to a point right of and below it.
    fn sum(&self, p: [f64; 2]) -> [f64; 4] {
        let size = self.size();
        let [columns, rows] = size;
        let whole: [f64; 2] = std::array::from_fn(|i| (p[i] / size[i] as f64).floor());
        let rest: [f64; 2] = std::array::from_fn(|i| p[i] - whole[i] * size[i] as f64);
        let cell: [usize; 2] = std::array::from_fn(|i| (rest[i] as usize).min(size[i] - 1));
        let part: [f64; 2] = std::array::from_fn(|i| (rest[i] - cell[i] as f64).clamp(0.0, 1.0));
        let ([x, y], [s, t]) = (cell, part);
        let mut sum = [0.0; 4];
        let mut add = |weight: f64, x: usize, y: usize| {
            // Of most points only the four corners of their pixel count.
            if weight != 0.0 {
                let here = self.sums[y * (columns + 1) + x];
                for i in 0..4 {
                    sum[i] += weight * here[i] as f64;
                }
            }
        };
        add((1.0 - s) * (1.0 - t), x, y);
        add(s * (1.0 - t), x + 1, y);
        add((1.0 - s) * t, x, y + 1);
        add(s * t, x + 1, y + 1);
        add(whole[0] * (1.0 - t), columns, y);
        add(whole[0] * t, columns, y + 1);
        add(whole[1] * (1.0 - s), x, rows);
        add(whole[1] * s, x + 1, rows);
        add(whole[0] * whole[1], columns, rows);
        sum
    }

    /// See [`Border`].
    #[must_use]
    pub fn border(&self) -> Border {
        let (width, height) = self.image.dimensions();
        let columns =
            |a: u32, b: u32| difference((0..height).map(|y| [(a, y), (b, y)]), &self.image);
        let rows = |a: u32, b: u32| difference((0..width).map(|x| [(x, a), (x, b)]), &self.image);
        Border {
            across: [columns(width - 1, 0), rows(height - 1, 0)],
            inside: [
                (1..width).map(|x| columns(x - 1, x)).fold(0.0, f64::max),
                (1..height).map(|y| rows(y - 1, y)).fold(0.0, f64::max),
            ],
        }
    }

    /// How a tile of so many copies across and down changes when it is turned; one copy is stretched to a square.
    #[must_use]
    pub fn symmetry(&self, copies: [u32; 2]) -> Symmetry {
        let (width, height) = self.image.dimensions();
        let all = |width, height| (0..height).flat_map(move |y| (0..width).map(move |x| (x, y)));
        let half = all(width, height).map(|(x, y)| [(x, y), (width - 1 - x, height - 1 - y)]);
        let sampled = (width != height).then(|| self.tile(copies));
        let tile = sampled.as_ref().unwrap_or(&self.image);
        let side = tile.width();
        let quarter = all(side, side).map(|(x, y)| [(x, y), (y, side - 1 - x)]);
        Symmetry {
            quarter: difference(quarter, tile),
            half: difference(half, &self.image),
        }
    }

    /// A square of so many copies across and down.
    fn tile(&self, copies: [u32; 2]) -> RgbaImage {
        let part = copies.map(|n| f64::from(n) / f64::from(TILE));
        RgbaImage::from_fn(TILE, TILE, |x, y| {
            let place = [x, TILE - 1 - y].map(|k| f64::from(k) + 0.5);
            let at = std::array::from_fn(|i| part[i] * place[i]);
            Rgba(to_pixel(self.mean(at, part)))
        })
    }
}

/// Mean difference of the channels of pairs of pixels.
fn difference(pairs: impl Iterator<Item = [(u32, u32); 2]>, image: &RgbaImage) -> f64 {
    let (mut sum, mut count) = (0u64, 0u64);
    for [a, b] in pairs {
        let [a, b] = [a, b].map(|(x, y)| image.get_pixel(x, y).0);
        sum += (0..4).map(|i| u64::from(a[i].abs_diff(b[i]))).sum::<u64>();
        count += 4;
    }
    sum as f64 / count.max(1) as f64
}

/// Linear light times opacity, and opacity, as an sRGB pixel.
#[must_use]
pub(super) fn to_pixel(mean: [f64; 4]) -> [u8; 4] {
    let [r, g, b, a] = mean;
    let opacity = a.max(f64::MIN_POSITIVE);
    let [r, g, b] = to_bytes([r, g, b].map(|c| (c / opacity) as f32));
    [r, g, b, (255.0 * a + 0.5).clamp(0.0, 255.0) as u8]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(width: u32, height: u32) -> RgbaImage {
        let mut state = 5u64;
        RgbaImage::from_fn(width, height, |_, _| {
            Rgba(std::array::from_fn(|i| {
                state = state
                    .wrapping_mul(6364136223846793005)
                    .wrapping_add(1442695040888963407);
                if i < 3 { (state >> 56) as u8 } else { 255 }
            }))
        })
    }

    #[test]
    fn pixels_come_back_at_their_centres_however_far_the_tile_is() {
        let image = noise(7, 5);
        let exemplar = Exemplar::new(image.clone());
        for (x, y, pixel) in image.enumerate_pixels() {
            for shift in [[0.0, 0.0], [-3.0, 2.0], [1000.0, -77.0]] {
                let at = [
                    (f64::from(x) + 0.5) / 7.0 + shift[0],
                    (4.5 - f64::from(y)) / 5.0 + shift[1],
                ];
                assert_eq!(
                    to_pixel(exemplar.mean(at, [0.0; 2])),
                    pixel.0,
                    "{x} {y} {shift:?}"
                );
            }
        }
    }

    #[test]
    fn means_over_large_rectangles_are_those_of_all_pixels() {
        let image = noise(6, 6);
        let exemplar = Exemplar::new(image.clone());
        let mut mean = [0.0; 3];
        for pixel in image.pixels() {
            let [r, g, b, _] = pixel.0;
            for (sum, c) in mean.iter_mut().zip(to_linear([r, g, b])) {
                *sum += f64::from(c) / 36.0;
            }
        }
        for sides in [[1.0, 1.0], [5.0, 5.0], [2.0, 3.0]] {
            let found = exemplar.mean([0.37, 0.91], sides);
            for i in 0..3 {
                assert!(
                    (found[i] - mean[i]).abs() < 1e-5,
                    "{sides:?}: {found:?} {mean:?}"
                );
            }
        }
        // Two pixels and two halves of pixels.
        let quarter = exemplar.mean([2.5 / 6.0, 2.5 / 6.0], [2.0 / 6.0; 2]);
        let mut expected = 0.0;
        for (x, s) in [(1, 0.5), (2, 1.0), (3, 0.5)] {
            for (y, t) in [(2, 0.5), (3, 1.0), (4, 0.5)] {
                let [r, g, b, _] = image.get_pixel(x, y).0;
                expected += s * t / 4.0 * f64::from(to_linear([r, g, b])[0]);
            }
        }
        assert!((quarter[0] - expected).abs() < 1e-5);
    }

    #[test]
    fn transparent_pixels_do_not_colour_others() {
        let image = RgbaImage::from_fn(2, 1, |x, _| match x {
            0 => Rgba([200, 10, 10, 255]),
            _ => Rgba([0, 255, 0, 0]),
        });
        let exemplar = Exemplar::new(image);
        assert!(exemplar.is_transparent());
        assert_eq!(
            to_pixel(exemplar.mean([0.5, 0.5], [1.0; 2])),
            [200, 10, 10, 128]
        );
    }

    #[test]
    fn borders_and_turns_are_told_apart() {
        let ramp = |f: &dyn Fn(u32, u32) -> u8| {
            Exemplar::new(RgbaImage::from_fn(8, 8, |x, y| {
                let c = f(x, y);
                Rgba([c, c, c, 255])
            }))
        };
        let slope = ramp(&|x, _| 30 * x as u8);
        assert!(!slope.border().repeats());
        assert_eq!(slope.border().across, [0.75 * 210.0, 0.0]);
        assert_eq!(slope.border().inside, [0.75 * 30.0, 0.0]);
        assert!(!slope.symmetry([1, 1]).has_half() && !slope.symmetry([1, 1]).has_quarter());
        // Squares of a checkerboard have edges inside that are as sharp as those between tiles.
        let board = ramp(&|x, y| if (x / 4 + y / 4) % 2 == 0 { 255 } else { 0 });
        assert!(board.border().repeats());
        assert!(board.symmetry([1, 1]).has_half() && !board.symmetry([1, 1]).has_quarter());
        let frame = ramp(&|x, y| (20 * (x.min(7 - x)).min(y.min(7 - y))) as u8);
        assert!(frame.symmetry([1, 1]).has_quarter() && frame.border().repeats());
        // No square: stretched to one, or twice in one.
        let wide = RgbaImage::from_fn(8, 4, |x, y| {
            let c = (40 * (x / 2).min((7 - x) / 2) + 40 * y.min(3 - y)) as u8;
            Rgba([c, c, c, 255])
        });
        let wide = Exemplar::new(wide);
        assert!(wide.symmetry([1, 1]).has_half() && !wide.symmetry([1, 2]).has_quarter());
        let plain = Exemplar::new(RgbaImage::from_pixel(4, 2, Rgba([9, 90, 200, 255])));
        assert!(plain.symmetry([1, 2]).has_quarter());
        assert!(noise(1, 1).width() == 1 && Exemplar::new(noise(1, 1)).border().repeats());
    }
}
