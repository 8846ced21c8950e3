//! The images of patches, and their places in the packed square.
//!
//! *Enters:* patches in their own coordinates, with areas and bends. *Leaves:* [`Patch`]es, and the places of their images in one image of all where that is wanted.

use super::demand::Sums;
use super::packing;
use super::params::PatchParams;
use super::rectangle::Oriented;
use super::resolution::{self, Raster};
use crate::atlas::patch::{Domain, PackedPlaces, Patch};

/// Gives patches images of square texels and their places in the packed square.
pub(super) fn with_images(
    oriented: &[Oriented],
    sums: &[Sums],
    params: &PatchParams,
) -> (Vec<Patch>, Option<PackedPlaces>) {
    images(oriented, place(oriented, sums, params), params)
}

/// The patches with their images, and the places of these in the packed square.
pub(super) fn images(
    oriented: &[Oriented],
    placed: Placed,
    params: &PatchParams,
) -> (Vec<Patch>, Option<PackedPlaces>) {
    let Placed {
        rasters,
        sizes,
        corners,
        side,
    } = placed;
    let contents: Vec<[f64; 2]> = oriented
        .iter()
        .zip(&rasters)
        .map(|(patch, raster)| square_content(patch, raster, params))
        .collect();
    let lows: Vec<[f64; 2]> = (rasters.iter().zip(&sizes).zip(&contents))
        .map(|((raster, size), content)| match params.packed_side {
            // As in the image, which fills its box.
            Some(_) if raster.density[0] == raster.density[1] => raster.low,
            _ => in_the_middle(size, content),
        })
        .collect();
    let patches = oriented
        .iter()
        .zip(&rasters)
        .zip(in_square(&lows, &contents, &corners, side))
        .map(|((patch, raster), (packed_scale, packed_offset))| Patch {
            domain: Domain::Flat,
            to_chart: Some(patch.to_chart),
            width: raster.width,
            height: raster.height,
            texel_to_patch: raster.texel_to_patch,
            packed_scale,
            packed_offset,
        })
        .collect();
    let packed = params.packed_side.map(|_| PackedPlaces {
        side,
        corners: (rasters.iter().zip(&sizes).zip(&corners))
            .map(|((raster, size), corner)| {
                // In the middle of its box, which is higher only where rows are not as far apart as columns.
                let above = (size[1] - raster.height.min(size[1])) / 2;
                [corner[0], side - corner[1] - size[1] + above]
            })
            .collect(),
    });
    (patches, packed)
}

/// Rasters with their boxes in the packed square, and its side, in texels; corners count from the lower left.
pub(super) struct Placed {
    rasters: Vec<Raster>,
    sizes: Vec<[usize; 2]>,
    corners: Vec<[usize; 2]>,
    side: usize,
}

impl Placed {
    pub fn of(patches: &[Oriented], rasters: Vec<Raster>, params: &PatchParams) -> Self {
        let sizes: Vec<[usize; 2]> = patches
            .iter()
            .zip(&rasters)
            .map(|(patch, raster)| {
                let [width, height] = square_content(patch, raster, params);
                let sized = |n: f64, margin: f64| {
                    ((n - 1e-6).ceil().max(1.0) + 2.0 * margin).round() as usize
                };
                match params.packed_side {
                    // The image itself must find room.
                    Some(_) => [
                        raster.width,
                        sized(height, raster.margin).max(raster.height),
                    ],
                    None => [width, height].map(|n| sized(n, raster.margin.max(0.5))),
                }
            })
            .collect();
        let fitting = params.packed_side.and_then(|side| {
            let corners = packing::pack_into(&sizes, side)?;
            Some((corners, side))
        });
        let (corners, side) = fitting.unwrap_or_else(|| packing::pack(&sizes));
        Self {
            rasters,
            sizes,
            corners,
            side,
        }
    }
}

/// Columns and rows of a patch in the packed square, where texels are square: about as many as its image has.
fn square_content(patch: &Oriented, raster: &Raster, params: &PatchParams) -> [f64; 2] {
    let [columns, rows] = raster.density;
    let density = match params.packed_side {
        // That of the image, texel for texel.
        Some(_) => columns,
        None => (columns * rows).sqrt().min(4.0 * columns),
    };
    [density, density * patch.height]
}

/// Gives the patches as many texels as the budget has, or, where a side is asked for, as fit; the least that patches must have may be more.
fn place(patches: &[Oriented], sums: &[Sums], params: &PatchParams) -> Placed {
    let with = |texel_budget: usize| {
        let params = PatchParams {
            texel_budget,
            ..params.clone()
        };
        let rasters = resolution::rasters(patches, sums, &params);
        Placed::of(patches, rasters, &params)
    };
    let whole = with(params.texel_budget);
    let Some(most) = params.packed_side.filter(|&most| whole.side > most) else {
        return whole;
    };
    let (mut low, mut high) = (1, params.texel_budget);
    let mut best = with(low);
    // Within a thousandth of the greatest budget that fits.
    while best.side <= most && high - low > 1 + low / 1024 {
        let middle = low + (high - low) / 2;
        let tried = with(middle);
        if tried.side <= most {
            (low, best) = (middle, tried);
        } else {
            high = middle;
        }
    }
    best
}

/// Where a content begins in the middle of its box.
fn in_the_middle(size: &[usize; 2], content: &[f64; 2]) -> [f64; 2] {
    [0, 1].map(|i| 0.5 * (size[i] as f64 - content[i]))
}

/// For contents (width, height) that begin so far from the corners of their boxes: the part of the square that a unit of the
/// content's width is, and where its lower left corner lies in the unit square.
fn in_square(
    lows: &[[f64; 2]],
    contents: &[[f64; 2]],
    corners: &[[usize; 2]],
    side: usize,
) -> Vec<(f64, [f64; 2])> {
    let side = side as f64;
    let boxes = lows.iter().zip(corners).zip(contents);
    boxes
        .map(|((low, corner), content)| {
            let place = |i: usize| corner[i] as f64 + low[i];
            (content[0] / side, [place(0) / side, place(1) / side])
        })
        .collect()
}
