//! Sides that two rectangles share: both images hold the same points there, texel by texel.

use super::Verdicts;
use super::arrays::Arrays;
use super::document::{Document, Patch};
use super::formulas::Point2;
use crate::read::exr::Image;
use std::collections::BTreeSet;

/// Positions along the four sides of an image, counterclockwise from the lower left corner.
pub(super) type Sides = [Vec<[f32; 3]>; 4];

/// Reads them off.
pub(super) fn sides(image: &Image, patch: &Patch) -> Sides {
    let [right, bottom] = [patch.width, patch.height].map(|n| n.saturating_sub(1));
    let at = |column: usize, row: usize| {
        let texel = row * patch.width + column;
        [0, 1, 2].map(|i| image.rgb[i].get(texel).copied().unwrap_or(f32::NAN))
    };
    [
        (0..=right).map(|x| at(x, bottom)).collect(),
        (0..=bottom).rev().map(|y| at(right, y)).collect(),
        (0..=right).rev().map(|x| at(x, 0)).collect(),
        (0..=bottom).map(|y| at(0, y)).collect(),
    ]
}

/// Compares the two sides of every seam between rectangles; `of_patch` holds nothing for images that could not be read and for
/// other patches.
pub(super) fn check(
    arrays: &Arrays,
    document: &Document,
    of_patch: &[Option<Sides>],
    verdicts: &mut Verdicts,
) {
    let is_rectangle = |patch: &Patch| patch.domain == "rectangle";
    if !document.is_generated() || !document.patches.iter().any(is_rectangle) {
        return;
    }
    let mut stray = 0;
    let mut pairs = BTreeSet::new();
    for (seam, &[left, right]) in arrays.seam_patch.iter().enumerate() {
        let both = [left, right].map(|p| document.patches.get(p as usize));
        let [Some(one), Some(other)] = both.map(|p| p.filter(|p| is_rectangle(p))) else {
            continue;
        };
        let samples = &arrays.seam_uv[arrays.seam_range(seam)];
        // A part of the cut inside a rectangle.
        if left == right && samples.iter().all(|[a, b]| a == b) {
            continue;
        }
        for pair in samples.windows(2) {
            let [a, b] = [(one, 0), (other, 1)].map(|(p, k)| side(p, [pair[0][k], pair[1][k]]));
            match a.zip(b) {
                Some((a, b)) => {
                    pairs.insert([(one.id, a), (other.id, b)]);
                }
                None => stray += 1,
            }
        }
    }
    let texels = |(patch, side): (usize, usize)| Some(&of_patch.get(patch)?.as_ref()?[side]);
    let (mut compared, mut differing) = (0, 0);
    for [one, other] in &pairs {
        let (Some(one), Some(other)) = (texels(*one), texels(*other)) else {
            continue;
        };
        compared += one.len();
        differing += one.len().abs_diff(other.len());
        let texels = one.iter().zip(other.iter().rev());
        differing += texels.filter(|(p, q)| p != q).count();
    }
    verdicts.note(
        "images of rectangles hold the same points along shared sides",
        stray == 0 && differing == 0,
        format!("{differing} of {compared} texels differ, {stray} pieces of seams lie on no side"),
    );
}

/// The side of a rectangle on which both points lie.
fn side(patch: &Patch, points: [Point2; 2]) -> Option<usize> {
    let top = patch.texel_to_patch[1][2];
    let on = |i: usize, value: f64| points.iter().all(|p| p[i] == value);
    let lies = [on(1, 0.0), on(0, 1.0), on(1, top), on(0, 0.0)];
    lies.iter().position(|&lies| lies)
}
