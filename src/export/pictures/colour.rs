//! Colours: linear light for shading, sRGB bytes for files.

use std::sync::LazyLock;

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
    static LIGHT: LazyLock<[f32; 256]> = LazyLock::new(|| {
        std::array::from_fn(|c| {
            let c = c as f32 / 255.0;
            if c <= 0.04045 {
                c / 12.92
            } else {
                ((c + 0.055) / 1.055).powf(2.4)
            }
        })
    });
    let light: &[f32; 256] = &LIGHT;
    let [r, g, b] = colour;
    [
        light[usize::from(r)],
        light[usize::from(g)],
        light[usize::from(b)],
    ]
}

/// Linear light to sRGB bytes; anything outside 0 to 1 is clamped, NaN is black.
pub fn to_bytes(colour: Linear) -> [u8; 3] {
    // Finer than bytes are at their densest.
    const STEPS: f32 = 16383.0;
    static BYTES: LazyLock<Vec<u8>> = LazyLock::new(|| {
        let byte = |k: u16| {
            let c = f32::from(k) / STEPS;
            let c = if c <= 0.003_130_8 {
                12.92 * c
            } else {
                1.055 * c.powf(1.0 / 2.4) - 0.055
            };
            (255.0 * c + 0.5) as u8
        };
        (0..=STEPS as u16).map(byte).collect()
    });
    let bytes: &[u8] = &BYTES;
    // Casts of what is no number are 0; those to signed numbers are the quickest.
    let byte = |c: f32| bytes[((c * STEPS + 0.5) as i32).clamp(0, STEPS as i32) as usize];
    [byte(colour[0]), byte(colour[1]), byte(colour[2])]
}

/// a + t (b − a), component by component.
#[inline]
pub fn mix(a: Linear, b: Linear, t: f32) -> Linear {
    let mix = |i: usize| a[i] + t * (b[i] - a[i]);
    [mix(0), mix(1), mix(2)]
}

/// Well distinguishable pale colours for any number of things: hues a golden angle apart, three lightnesses.
pub fn categorical(index: usize) -> [u8; 3] {
    let turn = (index as f32 * 0.618_034 + 0.58).fract();
    let lightness = [0.79, 0.73, 0.85][index % 3];
    std::array::from_fn(|i| {
        let phase = std::f32::consts::TAU * (turn - i as f32 / 3.0);
        (255.0 * (lightness + 0.15 * phase.cos())) as u8
    })
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
    let at = if x.is_nan() {
        3.0
    } else {
        3.0 + 3.0 * x.clamp(-1.0, 1.0)
    };
    let low = (at as usize).min(STOPS.len() - 2);
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
