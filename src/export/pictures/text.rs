//! Text from glyphs that are compiled in: no font file is looked for.

use image::RgbImage;
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

/// Width of a character, pixels.
pub const CHARACTER: usize = get_raster_width(FontWeight::Regular, RasterHeight::Size20);
/// Height of a line, pixels.
pub const LINE: usize = 20;

/// Writes a line of text with `y` at its vertical middle and this share of its width to the left of `x`. What falls outside the image is
/// left out.
pub fn write(image: &mut RgbImage, text: &str, [x, y]: [f64; 2], share: f64, ink: [u8; 3]) {
    let left = x - share * (text.chars().count() * CHARACTER) as f64;
    for (n, character) in text.chars().enumerate() {
        // Unknown characters become `?`.
        let known = |c: char| get_raster(c, FontWeight::Regular, RasterHeight::Size20);
        let glyph = known(character).or_else(|| known('?'));
        let rows = glyph.iter().flat_map(|glyph| glyph.rows().enumerate());
        for (row, line) in rows {
            for (column, &coverage) in line.iter().enumerate() {
                let x = u32::try_from(left as i64 + (n * CHARACTER + column) as i64);
                let y = u32::try_from(y as i64 + row as i64 - LINE as i64 / 2);
                let (Ok(x), Ok(y)) = (x, y) else { continue };
                if let Some(pixel) = image.get_pixel_mut_checked(x, y) {
                    let share = u32::from(coverage);
                    for (old, new) in pixel.0.iter_mut().zip(ink) {
                        let sum = u32::from(*old) * (255 - share) + u32::from(new) * share;
                        *old = ((sum + 127) / 255) as u8;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_inside_is_drawn_and_text_outside_is_not() {
        let mut image = RgbImage::from_pixel(60, 40, image::Rgb([255; 3]));
        let blank = image.clone();
        write(&mut image, "far away", [1e9, -1e9], 1.0, [0; 3]);
        assert_eq!(image, blank);
        write(&mut image, "1e-6 \u{10ffff}", [30.0, 20.0], 0.5, [0; 3]);
        assert_ne!(image, blank);
    }
}
