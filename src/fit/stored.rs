//! The images and seams of a folder, as fitting takes them.

use super::{FitError, Grid, Grids, Lattice};
use crate::read::atlas::{ImageFolder, StoredImage};
use crate::rebuild::{RebuildError, stored_seams};

/// Part of its size by which a rectangle may miss the origin: texel_to_patch is rounded.
const ORIGIN_TOLERANCE: f64 = 1e-9;

/// Takes over a folder of rectangles.
///
/// # Errors
/// Flat images, images with holes, and seams of patches that are not there.
pub fn grids(folder: &ImageFolder) -> Result<Grids, FitError> {
    if let Some(patch) = folder.images.iter().position(|image| !image.is_rectangle) {
        return Err(FitError::Flat { patch });
    }
    let origin = folder.image_origin;
    if let Some(&value) = origin.iter().find(|x| !x.is_finite()) {
        return Err(RebuildError::OriginNotFinite { value }.into());
    }
    let patches = folder.images.iter().enumerate();
    Ok(Grids {
        patches: patches
            .map(|(patch, image)| grid(patch, image, origin))
            .collect::<Result<_, _>>()?,
        seams: stored_seams(folder)?,
    })
}

fn grid(patch: usize, image: &StoredImage, origin: [f64; 3]) -> Result<Grid, FitError> {
    let (columns, rows) = (image.width, image.height);
    if columns < 2 || rows < 2 {
        return Err(FitError::TooFewSamples {
            patch,
            columns,
            rows,
        });
    }
    for (at, (point, &alpha)) in image.position.iter().zip(&image.alpha).enumerate() {
        let value = match alpha > 0.0 {
            true if point.iter().all(|x| x.is_finite()) => continue,
            true => "not finite",
            false => "a hole (A = 0)",
        };
        return Err(FitError::Sample {
            patch,
            column: at % columns,
            row: at / columns,
            value,
        });
    }
    let place = |column: usize, row: usize| {
        let texel = [column as f64, row as f64, 1.0];
        image
            .texel_to_patch
            .map(|r| r.iter().zip(texel).map(|(a, b)| a * b).sum::<f64>())
    };
    // Row 0 is at the top.
    let (low, high) = (place(0, rows - 1), place(columns - 1, 0));
    let (left_top, right_bottom) = (place(0, 0), place(columns - 1, rows - 1));
    let is_rectangle = (0..2).all(|i| {
        let near = |a: f64, b: f64| (a - b).abs() <= ORIGIN_TOLERANCE * high[i];
        let upright = [
            [left_top[0], right_bottom[0]],
            [right_bottom[1], left_top[1]],
        ];
        high[i].is_finite()
            && near(low[i], 0.0)
            && near(upright[i][0], low[i])
            && near(upright[i][1], high[i])
    });
    if !(is_rectangle && high[0] > 0.0 && high[1] > 0.0) {
        return Err(FitError::Lattice {
            patch,
            corners: [low, high],
        });
    }
    let points = (0..rows).rev().flat_map(|row| {
        let row = &image.position[row * columns..(row + 1) * columns];
        row.iter()
            .map(|p| std::array::from_fn(|c| f64::from(p[c]) + origin[c]))
    });
    Ok(Grid {
        lattice: Lattice {
            samples: [columns, rows],
            extent: high,
        },
        points: points.collect(),
    })
}
