//! Colours: linear light for shading, sRGB bytes for files.

/// Red, green, blue in linear light, 0 to 1.
pub type Linear = [f32; 3];

/// Background of plane pictures, sRGB.
pub const PAPER: [u8; 3] = [250, 250, 248];
/// Text and axes, sRGB.
pub const INK: [u8; 3] = [52, 56, 64];
/// Grid lines, sRGB.
pub const FAINT: [u8; 3] = [224, 226, 228];
/// The cut, sRGB.
pub const CUT: [u8; 3] = [232, 119, 34];
/// Cones of positive curvature, sRGB.
pub const POSITIVE: [u8; 3] = [208, 40, 52];
/// Cones of negative curvature, sRGB.
pub const NEGATIVE: [u8; 3] = [38, 98, 204];

/// sRGB byte to linear light.
pub fn to_linear(colour: [u8; 3]) -> Linear {
    colour.map(|c| {
        let c = f32::from(c) / 255.0;
        if c <= 0.04045 {
            c / 12.92
        } else {
            ((c + 0.055) / 1.055).powf(2.4)
        }
    })
}

/// Linear light to sRGB bytes; anything outside 0 to 1 is clamped, NaN is black.
pub fn to_bytes(colour: Linear) -> [u8; 3] {
    colour.map(|c| {
        let c = if c <= 0.003_130_8 {
            12.92 * c
        } else {
            1.055 * c.powf(1.0 / 2.4) - 0.055
        };
        (255.0 * c + 0.5).clamp(0.0, 255.0) as u8
    })
}

/// a + t (b − a), component by component.
pub fn mix(a: Linear, b: Linear, t: f32) -> Linear {
    std::array::from_fn(|i| a[i] + t * (b[i] - a[i]))
}

/// Well distinguishable colours for any number of things: hues a golden angle apart, two lightnesses.
pub fn categorical(index: usize) -> [u8; 3] {
    let turn = (index as f32 * 0.618_034 + 0.58).fract();
    let lightness = [0.83, 0.76, 0.88][index % 3];
    oklch(lightness, 0.085, std::f32::consts::TAU * turn)
}

/// OKLCH (Ottosson 2020, "A perceptual color space for image processing") to sRGB bytes.
fn oklch(lightness: f32, chroma: f32, hue: f32) -> [u8; 3] {
    let (a, b) = (chroma * hue.cos(), chroma * hue.sin());
    let l = lightness + 0.396_337_78 * a + 0.215_803_76 * b;
    let m = lightness - 0.105_561_346 * a - 0.063_854_17 * b;
    let s = lightness - 0.089_484_18 * a - 1.291_485_5 * b;
    let [l, m, s] = [l * l * l, m * m * m, s * s * s];
    to_bytes([
        4.076_741_7 * l - 3.307_711_6 * m + 0.230_969_94 * s,
        -1.268_438 * l + 2.609_757_4 * m - 0.341_319_4 * s,
        -0.004_196_086_3 * l - 0.703_418_6 * m + 1.707_614_7 * s,
    ])
}

/// A diverging scale: blue at −1, pale at 0, red at 1; values beyond are held at the ends.
pub fn diverging(x: f64) -> [u8; 3] {
    const STOPS: [[f64; 3]; 7] = [
        [33.0, 60.0, 140.0],
        [70.0, 130.0, 196.0],
        [158.0, 198.0, 224.0],
        [242.0, 240.0, 234.0],
        [246.0, 184.0, 144.0],
        [214.0, 96.0, 76.0],
        [140.0, 20.0, 44.0],
    ];
    let last = STOPS.len() - 1;
    let at = if x.is_nan() {
        0.5
    } else {
        (x.clamp(-1.0, 1.0) + 1.0) / 2.0
    } * last as f64;
    let low = (at as usize).min(last - 1);
    let t = at - low as f64;
    std::array::from_fn(|i| (STOPS[low][i] + t * (STOPS[low + 1][i] - STOPS[low][i]) + 0.5) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_byte_survives_linear_light() {
        for c in 0..=255 {
            assert_eq!(to_bytes(to_linear([c; 3])), [c; 3]);
        }
    }

    #[test]
    fn diverging_scale_has_its_middle_and_its_ends() {
        assert_eq!(diverging(0.0), [242, 240, 234]);
        assert_eq!(diverging(f64::NAN), diverging(0.0));
        assert_eq!(diverging(-5.0), [33, 60, 140]);
        assert_eq!(diverging(f64::INFINITY), [140, 20, 44]);
    }

    #[test]
    fn neighbouring_categories_differ() {
        for i in 0..100 {
            let (a, b) = (categorical(i), categorical(i + 1));
            let apart: i32 = (0..3)
                .map(|k| (i32::from(a[k]) - i32::from(b[k])).abs())
                .sum();
            assert!(apart > 40, "{a:?} and {b:?}");
        }
    }
}
