//! The image of all patches: in it, every patch's own image stands texel for texel, and no other texel is marked.

use super::Verdicts;
use super::channels;
use super::document::{Document, Packed};
use crate::read::exr::{Image, Read, read};
use ::exr::prelude::FlatSamples;
use std::path::Path;

/// Compares it with the images of the patches, if `atlas.json` names one.
pub(super) fn check(folder: &Path, document: &Document, verdicts: &mut Verdicts) {
    let Some(packed) = &document.images.packed else {
        return;
    };
    let mut note = |name: &str, problem: Option<String>| {
        verdicts.note(name, problem.is_none(), problem.unwrap_or_default())
    };
    let image = match read(&folder.join(&packed.image), [packed.side; 2]) {
        Ok(Read::Image { image, layout }) => match layout {
            None => Ok(image),
            Some(layout) => Err(layout),
        },
        Ok(Read::WrongSize([columns, rows])) => Err(format!("has {columns} by {rows} texels")),
        Err(problem) => Err(problem),
    };
    let problem = match &image {
        Ok(image) => channels::lacking(image, &document.images),
        Err(problem) => Some(problem.clone()),
    };
    note("the packed image keeps the contract's layout", problem);
    // Only now is it known that the file really holds that many texels.
    let Ok(image) = image else { return };
    if !note(
        "images lie apart from each other in the packed image",
        places(packed, document),
    ) {
        return;
    }
    let infinite = channels::infinite(&image)
        + (columns(&image).flatten())
            .filter(|x| !x.is_finite())
            .count();
    note(
        "the packed image is finite everywhere",
        (infinite > 0).then(|| format!("{infinite} numbers are not")),
    );
    let compared = compare(folder, document, packed, &image);
    let (differing, marked, unreadable) = compared;
    note(
        "the packed image holds the images of the patches",
        (differing > 0 || unreadable > 0).then(|| {
            format!("{differing} texels differ, {unreadable} images could not be compared")
        }),
    );
    note(
        "the packed image marks nothing between the patches",
        (marked > 0).then(|| format!("{marked} texels are marked")),
    );
}

/// What is wrong with the places of the images; the packed image has the stated size.
fn places(packed: &Packed, document: &Document) -> Option<String> {
    if packed.corners.len() != document.patches.len() {
        let (places, patches) = (packed.corners.len(), document.patches.len());
        return Some(format!("{places} places for {patches} patches"));
    }
    let mut taken = vec![false; packed.side * packed.side];
    for (patch, &[left, top]) in document.patches.iter().zip(&packed.corners) {
        let end = |from: usize, count: usize| from.checked_add(count);
        let inside = |end: Option<usize>| end.is_some_and(|end| end <= packed.side);
        if !inside(end(left, patch.width)) || !inside(end(top, patch.height)) {
            return Some(format!("patch {} reaches beyond it", patch.id));
        }
        for row in top..top + patch.height {
            let from = packed.side * row + left;
            let texels = &mut taken[from..from + patch.width];
            if texels.contains(&true) {
                return Some(format!("patch {} lies on another", patch.id));
            }
            texels.fill(true);
        }
    }
    None
}

/// Texels that differ from those of the patches' images, texels marked outside of these, and images that could not be compared.
fn compare(
    folder: &Path,
    document: &Document,
    packed: &Packed,
    image: &Image,
) -> (usize, usize, usize) {
    let (mut differing, mut unreadable) = (0, 0);
    let mut between = vec![true; packed.side * packed.side];
    for (patch, &[left, top]) in document.patches.iter().zip(&packed.corners) {
        let own = read(&folder.join(&patch.image), [patch.width, patch.height]);
        let own = match own {
            Ok(Read::Image { image, .. }) => Some(image),
            _ => None,
        };
        unreadable += usize::from(own.is_none());
        for row in 0..patch.height {
            let to = packed.side * (top + row) + left;
            between[to..to + patch.width].fill(false);
            let from = patch.width * row;
            for (at, there) in (from..from + patch.width).zip(to..) {
                let same = own
                    .as_ref()
                    .is_none_or(|own| same_texel(own, at, image, there));
                differing += usize::from(!same);
            }
        }
    }
    let marked = between.iter().zip(&image.alpha);
    let marked = marked.filter(|(between, alpha)| **between && **alpha != 0.0);
    (differing, marked.count(), unreadable)
}

/// The numbers of the channels that all images may have.
fn columns(image: &Image) -> impl Iterator<Item = &Vec<f32>> {
    let further = image.normal.iter().flatten().chain(&image.log_scale);
    image.rgb.iter().chain([&image.alpha]).chain(further)
}

/// Whether all channels are equal.
fn same_texel(a: &Image, at: usize, b: &Image, there: usize) -> bool {
    let numbers = columns(a)
        .zip(columns(b))
        .all(|(x, y)| x.get(at) == y.get(there));
    let faces = match (&a.face, &b.face) {
        (Some(x), Some(y)) => x.get(at) == y.get(there),
        (x, y) => x.is_none() && y.is_none(),
    };
    let others = a.others.len() == b.others.len()
        && a.others
            .iter()
            .all(|(name, x)| match (x, b.others.get(name)) {
                (FlatSamples::F16(x), Some(FlatSamples::F16(y))) => x.get(at) == y.get(there),
                (FlatSamples::F32(x), Some(FlatSamples::F32(y))) => x.get(at) == y.get(there),
                (FlatSamples::U32(x), Some(FlatSamples::U32(y))) => x.get(at) == y.get(there),
                _ => false,
            });
    numbers && faces && others && columns(a).count() == columns(b).count()
}
