//! Channels beside position and mask: those that `atlas.json` names are there, in the types it states.

use super::document::{Images, Patch};
use super::formulas::{Point3, norm3};
use crate::read::exr::{Image, numbers};
use ::exr::prelude::FlatSamples;

/// How far a normal of 32 bits may be from unit length. Rounding moves it by 1e-7; other writers may be less exact.
const UNIT_TOLERANCE: f64 = 1e-3;
/// What rounding to 16 bits adds: half a unit in the last of 11 binary places, relative to each component.
const HALF_ROUNDING: f64 = 1.0 / 2048.0;

/// Channels of the source by the word that stands for them; those of normals may have 16 bits.
const FLOATS: [(&str, &[&str]); 3] = [
    ("source-normal", &SOURCE_NORMAL),
    ("color", &["color.R", "color.G", "color.B", "color.A"]),
    ("texcoord", &["texcoord0.U", "texcoord0.V"]),
];
const SOURCE_NORMAL: [&str; 3] = ["sourceNormal.X", "sourceNormal.Y", "sourceNormal.Z"];

/// What of the stated channels an image does not have, or has in another type.
pub(super) fn lacking(image: &Image, stated: &Images) -> Option<String> {
    let mut wrong = Vec::new();
    for word in &stated.channels {
        match word.as_str() {
            "normal" if image.normal.is_none() => wrong.push("lacks normal.X/Y/Z".to_owned()),
            "normal" if image.half_normals != stated.is_half() => wrong.push(format!(
                "has normal.X/Y/Z not in the precision {}",
                stated.normal_precision
            )),
            "face" if image.face.is_none() => wrong.push("lacks surface.face".to_owned()),
            "log-scale" if image.log_scale.is_none() => {
                wrong.push("lacks surface.logScale".to_owned());
            }
            "normal" | "face" | "log-scale" => {}
            "material" => match image.others.get("material.id") {
                Some(FlatSamples::U32(_)) => {}
                _ => wrong.push("lacks material.id as unsigned integers".to_owned()),
            },
            _ => match FLOATS.iter().find(|(known, _)| known == word) {
                Some((_, names)) => {
                    let half = word == "source-normal" && stated.is_half();
                    let is_right = |name: &&&str| match image.others.get(**name) {
                        Some(FlatSamples::F32(_)) => !half,
                        Some(FlatSamples::F16(_)) => half,
                        _ => false,
                    };
                    let absent = names.iter().filter(|name| !is_right(name));
                    wrong.extend(absent.map(|name| {
                        format!(
                            "lacks {name} as floats of {} bits",
                            if half { 16 } else { 32 }
                        )
                    }));
                }
                None => wrong.push(format!("cannot hold the unknown channel {word:?}")),
            },
        }
    }
    (!wrong.is_empty()).then(|| wrong.join(", "))
}

/// How many numbers of the further channels are not finite.
pub(super) fn infinite(image: &Image) -> usize {
    let bad = |samples: &FlatSamples| match samples {
        FlatSamples::F16(values) => values.iter().filter(|x| !x.is_finite()).count(),
        FlatSamples::F32(values) => values.iter().filter(|x| !x.is_finite()).count(),
        FlatSamples::U32(_) => 0,
    };
    image.others.values().map(bad).sum()
}

/// The source's normals, where an image holds them.
pub(super) fn source_normal(image: &Image) -> Option<[Vec<f32>; 3]> {
    let [x, y, z] = SOURCE_NORMAL.map(|name| image.others.get(name).cloned().and_then(numbers));
    Some([x?, y?, z?])
}

/// Whether a texel holds a unit vector, as far as its precision tells.
pub(super) fn is_unit(normal: &[Vec<f32>; 3], texel: usize, is_half: bool) -> bool {
    let n: Point3 =
        std::array::from_fn(|i| normal[i].get(texel).copied().map_or(f64::NAN, f64::from));
    let tolerance = UNIT_TOLERANCE + if is_half { HALF_ROUNDING } else { 0.0 };
    (norm3(n) - 1.0).abs() < tolerance
}

/// Texels of a patch whose source normal is none.
pub(super) fn wrong_source_normals(image: &Image, stated: &Images, patch: &Patch) -> usize {
    let Some(normal) = source_normal(image) else {
        return 0;
    };
    let texels = 0..patch.width.saturating_mul(patch.height);
    texels
        .filter(|&at| !is_unit(&normal, at, stated.is_half()))
        .count()
}
