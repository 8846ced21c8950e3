//! Text from glyphs that are compiled in: no font file is looked for.

use image::RgbImage;
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

/// Width of a character, pixels.
pub const CHARACTER: usize = get_raster_width(FontWeight::Regular, RasterHeight::Size20);
/// Height of a line, pixels.
pub const LINE: usize = 20;

/// Where a text's given point lies on it.
#[derive(Clone, Copy)]
pub enum Anchor {
    /// Left end.
    Start,
    /// Middle.
    Middle,
    /// Right end.
    End,
}

/// Writes a line of text with `y` at its vertical middle. What falls outside the image is left out.
pub fn write(image: &mut RgbImage, text: &str, [x, y]: [f64; 2], anchor: Anchor, ink: [u8; 3]) {
    let left = x - shift(text, anchor);
    glyphs(text, |column, row, coverage| {
        blend(
            image,
            left as i64 + column as i64,
            y as i64 + row as i64 - LINE as i64 / 2,
            ink,
            coverage,
        );
    });
}

/// Writes a line of text upwards with `x` at the middle of the line's height.
pub fn write_upwards(image: &mut RgbImage, text: &str, [x, y]: [f64; 2], ink: [u8; 3]) {
    let bottom = y + shift(text, Anchor::Middle);
    glyphs(text, |column, row, coverage| {
        blend(
            image,
            x as i64 + row as i64 - LINE as i64 / 2,
            bottom as i64 - column as i64,
            ink,
            coverage,
        );
    });
}

fn shift(text: &str, anchor: Anchor) -> f64 {
    let width = (text.chars().count() * CHARACTER) as f64;
    match anchor {
        Anchor::Start => 0.0,
        Anchor::Middle => width / 2.0,
        Anchor::End => width,
    }
}

/// Every pixel that is not empty: column from the text's start, row, coverage. Unknown characters become `?`.
fn glyphs(text: &str, mut visit: impl FnMut(usize, usize, u8)) {
    for (n, character) in text.chars().enumerate() {
        let known = |c: char| get_raster(c, FontWeight::Regular, RasterHeight::Size20);
        let Some(glyph) = known(character).or_else(|| known('?')) else {
            continue;
        };
        for (row, line) in glyph.rows().enumerate() {
            for (column, &coverage) in line.iter().enumerate() {
                if coverage > 0 {
                    visit(n * CHARACTER + column, row, coverage);
                }
            }
        }
    }
}

fn blend(image: &mut RgbImage, x: i64, y: i64, ink: [u8; 3], coverage: u8) {
    let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y)) else {
        return;
    };
    if let Some(pixel) = image.get_pixel_mut_checked(x, y) {
        let share = u32::from(coverage);
        for (old, new) in pixel.0.iter_mut().zip(ink) {
            let sum = u32::from(*old) * (255 - share) + u32::from(new) * share;
            *old = ((sum + 127) / 255) as u8;
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
        write(&mut image, "far away", [1e9, -1e9], Anchor::End, [0; 3]);
        write_upwards(&mut image, "far away", [-500.0, 20.0], [0; 3]);
        assert_eq!(image, blank);
        write(
            &mut image,
            "1e-6 \u{10ffff}",
            [30.0, 20.0],
            Anchor::Middle,
            [0; 3],
        );
        assert_ne!(image, blank);
    }
}
