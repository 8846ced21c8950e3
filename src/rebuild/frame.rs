//! The lattice of an image: patch coordinates in texels, with v up.
//!
//! Lattice point (i, k) is the texel centre (i + ½, k + ½), where k counts rows from the bottom of the patch, so that the lattice
//! is oriented like it: images of blocks begin with the bottom row, all others with the top row.

use super::{PatchImage, RebuildError};

/// Size and place of an image's lattice in its patch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub width: usize,
    pub height: usize,
    texel_to_patch: [[f64; 3]; 2],
    determinant: f64,
    /// Whether row 0 is at the bottom of the patch.
    is_up: bool,
}

impl Frame {
    /// Checks an image: its size, its transform, and that every texel of the mask has a position.
    pub fn new(id: usize, patch: &PatchImage) -> Result<Self, RebuildError> {
        let (width, height) = (patch.width, patch.height);
        let texels = width.checked_mul(height).filter(|&n| n > 0);
        for (what, found) in [
            ("positions", patch.position.len()),
            ("alpha values", patch.alpha.len()),
        ] {
            if texels != Some(found) {
                return Err(RebuildError::ImageSize {
                    patch: id,
                    width,
                    height,
                    what,
                    found,
                });
            }
        }
        let [[a, b, c], [d, e, f]] = patch.texel_to_patch;
        let determinant = a * e - b * d;
        let finite = [a, b, c, d, e, f, 1.0 / determinant]
            .iter()
            .all(|x| x.is_finite());
        if !finite {
            return Err(RebuildError::Transform {
                patch: id,
                determinant,
            });
        }
        for (at, (p, &alpha)) in patch.position.iter().zip(patch.alpha).enumerate() {
            if let Some(&value) = p.iter().find(|x| alpha > 0.0 && !x.is_finite()) {
                return Err(RebuildError::TexelNotFinite {
                    patch: id,
                    column: at % width,
                    row: at / width,
                    value,
                });
            }
        }
        Ok(Self {
            width,
            height,
            texel_to_patch: patch.texel_to_patch,
            determinant,
            is_up: determinant > 0.0,
        })
    }

    /// Patch coordinates in texels, v up.
    pub fn texel(&self, p: [f64; 2]) -> [f64; 2] {
        let [[a, b, c], [d, e, f]] = self.texel_to_patch;
        let (x, y) = (p[0] - c, p[1] - f);
        let column = (e * x - b * y) / self.determinant;
        let row = (a * y - d * x) / self.determinant;
        match self.is_up {
            true => [column, row],
            false => [column, self.height as f64 - row],
        }
    }

    /// A vector in texels in patch coordinates.
    pub fn vector(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let y = if self.is_up { y } else { -y };
        self.texel_to_patch.map(|r| r[0] * x + r[1] * y)
    }

    /// Patch coordinates of the lattice point (i, k).
    pub fn centre(&self, i: usize, k: usize) -> [f64; 2] {
        let column = i as f64 + 0.5;
        let row = self.row(k) as f64 + 0.5;
        self.texel_to_patch
            .map(|r| r[0] * column + r[1] * row + r[2])
    }

    /// Where the lattice point (i, k) stands in the image's data.
    pub fn index(&self, i: usize, k: usize) -> usize {
        self.width * self.row(k) + i
    }

    fn row(&self, k: usize) -> usize {
        match self.is_up {
            true => k,
            false => self.height - 1 - k,
        }
    }
}
