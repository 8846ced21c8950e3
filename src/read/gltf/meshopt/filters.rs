//! Filters (appendix B): from what packs well to what accessors expect, in place.

use crate::read::error::MeshoptError;

/// Applies a filter to every element. `layout` is the error where the stride does not fit the filter.
pub fn apply(
    bytes: &mut [u8],
    filter: &str,
    stride: usize,
    layout: MeshoptError,
) -> Result<(), MeshoptError> {
    match (filter, stride) {
        ("NONE", _) => {}
        ("OCTAHEDRAL", 4) => bytes.chunks_exact_mut(4).for_each(|b| {
            let v = [b[0] as i8, b[1] as i8, b[2] as i8].map(i32::from);
            let unit = octahedral(v, 127.0);
            (0..3).for_each(|k| b[k] = unit[k] as i8 as u8);
        }),
        ("OCTAHEDRAL", 8) => bytes.chunks_exact_mut(8).for_each(|b| {
            let unit = octahedral([0, 1, 2].map(|k| i32::from(half(b, k) as i16)), 32767.0);
            (0..3).for_each(|k| set_half(b, k, unit[k] as i16 as u16));
        }),
        ("QUATERNION", 8) => bytes.chunks_exact_mut(8).for_each(quaternion),
        ("EXPONENTIAL", _) => bytes.chunks_exact_mut(4).for_each(|b| {
            let value = i32::from_le_bytes([b[0], b[1], b[2], b[3]]);
            b.copy_from_slice(&exponential(value).to_le_bytes());
        }),
        ("COLOR", 4) => bytes.chunks_exact_mut(4).for_each(|b| {
            let [co, cg] = [b[1] as i8, b[2] as i8].map(i32::from);
            let rgba = color([i32::from(b[0]), co, cg, i32::from(b[3])], 255.0);
            (0..4).for_each(|k| b[k] = rgba[k] as u8);
        }),
        ("COLOR", 8) => bytes.chunks_exact_mut(8).for_each(|b| {
            let [co, cg] = [1, 2].map(|k| i32::from(half(b, k) as i16));
            let y = i32::from(half(b, 0));
            let rgba = color([y, co, cg, i32::from(half(b, 3))], 65535.0);
            (0..4).for_each(|k| set_half(b, k, rgba[k] as u16));
        }),
        ("OCTAHEDRAL" | "QUATERNION" | "COLOR", _) => return Err(layout),
        _ => return Err(MeshoptError::Mode),
    }
    Ok(())
}

/// The `k`-th short of some bytes.
pub fn half(bytes: &[u8], k: usize) -> u16 {
    u16::from_le_bytes([bytes[2 * k], bytes[2 * k + 1]])
}

/// Writes the `k`-th short.
pub fn set_half(bytes: &mut [u8], k: usize, value: u16) {
    bytes[2 * k..2 * k + 2].copy_from_slice(&value.to_le_bytes());
}

/// A unit vector, scaled to `max`, from its octahedral projection.
fn octahedral([x, y, one]: [i32; 3], max: f32) -> [f32; 3] {
    let one = one as f32;
    let (x, y) = (x as f32 / one, y as f32 / one);
    let z = 1.0 - x.abs() - y.abs();
    let fold = z.min(0.0);
    let (x, y) = (x - fold.copysign(x), y - fold.copysign(y));
    let scale = max / (x * x + y * y + z * z).sqrt();
    [x, y, z].map(|c| (c * scale).round())
}

/// A unit quaternion from its three lesser components.
fn quaternion(bytes: &mut [u8]) {
    let [x, y, z, last] = [0, 1, 2, 3].map(|k| i32::from(half(bytes, k) as i16));
    let scale = std::f32::consts::FRAC_1_SQRT_2 / (last | 3) as f32;
    let [x, y, z] = [x, y, z].map(|c| c as f32 * scale);
    let w = (1.0 - x * x - y * y - z * z).max(0.0).sqrt();
    let largest = (last & 3) as usize;
    for (k, c) in [w, x, y, z].into_iter().enumerate() {
        let value = (c * 32767.0).round() as i16;
        set_half(bytes, (largest + k) % 4, value as u16);
    }
}

/// 2^exponent × mantissa, from 8 and 24 signed bits.
fn exponential(value: i32) -> f32 {
    let (exponent, mantissa) = (value >> 24, (value << 8) >> 8);
    // Exact in double precision, rounded once.
    (f64::from(mantissa) * f64::from(exponent).exp2()) as f32
}

/// Red, green, blue, alpha, scaled to `max`, from luma and two chroma differences.
fn color([y, co, cg, alpha]: [i32; 4], max: f32) -> [f32; 4] {
    if alpha <= 0 {
        return [0.0; 4];
    }
    let full = (2 << alpha.ilog2()) - 1;
    let low = alpha & (full >> 1);
    let alpha = low << 1 | low & 1;
    let scale = max / full as f32;
    [y + co - cg, y + cg, y - co - cg, alpha].map(|c| (c as f32 * scale).round())
}
