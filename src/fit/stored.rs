//! The blocks and images of a folder, as fitting takes them.

use super::blocks::{Block, Blocks};
use super::division::{Division, Part, divide};
use super::{FitError, Grid, Grids};
use crate::grid::blocks::Piece;
use crate::read::atlas::{ImageFolder, StoredBlock, StoredImage, StoredPiece};

/// Takes over a folder whose patches are blocks of a grid, divided where their sides have T-junctions.
///
/// # Errors
/// Patches that are no blocks, blocks that do not fit each other or their images, holes in these, and sides that meet at different points.
pub fn grids(folder: &ImageFolder) -> Result<Grids, FitError> {
    let origin = folder.image_origin;
    if let Some(&value) = origin.iter().find(|x| !x.is_finite()) {
        return Err(FitError::Origin { value });
    }
    let mut samples_per_cell = 0;
    let mut blocks = Vec::with_capacity(folder.images.len());
    for (patch, image) in folder.images.iter().enumerate() {
        let stored = image.block.as_ref().ok_or(FitError::NoGrid { patch })?;
        if patch == 0 {
            samples_per_cell = stored.samples_per_cell;
        }
        blocks.push(block(patch, image, stored, samples_per_cell)?);
        every_sample_is_there(patch, image)?;
    }
    let blocks = Blocks::new(blocks)?;
    let images = Images {
        images: &folder.images,
        samples_per_cell,
    };
    images.agree(&blocks)?;
    let Division { parts, interfaces } = divide(&blocks);
    let patches = parts.into_iter().map(|part| images.grid(part, origin));
    Ok(Grids {
        patches: patches.collect(),
        interfaces,
    })
}

/// What is stated of a block, if its image is that of its cells.
fn block(
    patch: usize,
    image: &StoredImage,
    stored: &StoredBlock,
    samples_per_cell: usize,
) -> Result<Block, FitError> {
    let cells = stored.cells;
    if stored.samples_per_cell != samples_per_cell {
        let samples_per_cell = [stored.samples_per_cell, samples_per_cell];
        return Err(FitError::SamplesPerCell {
            patch,
            samples_per_cell,
        });
    }
    let samples = [image.width, image.height];
    let wanted = cells.map(|n| n.checked_mul(samples_per_cell)?.checked_add(1));
    if samples_per_cell == 0 || wanted != samples.map(Some) {
        return Err(FitError::ImageCells {
            patch,
            samples,
            cells,
            samples_per_cell,
        });
    }
    let mut sides = Vec::with_capacity(4);
    for (side, pieces) in stored.sides.iter().enumerate() {
        let pieces = pieces.iter().enumerate();
        let pieces = pieces.map(|(number, stored)| piece([patch, side, number], stored));
        sides.push(pieces.collect::<Result<Vec<_>, _>>()?);
    }
    let wrong = |sides: Vec<_>| {
        let sides = sides.len();
        FitError::Sides { patch, sides }
    };
    let sides = sides.try_into().map_err(wrong)?;
    Ok(Block { cells, sides })
}

fn piece(place: [usize; 3], stored: &StoredPiece) -> Result<Piece, FitError> {
    let across = match (stored.patch, stored.side, stored.other_start) {
        (Some(patch), Some(side), Some(start)) if stored.reversed => Some((patch, side, start)),
        (None, None, None) if !stored.reversed => None,
        _ => return Err(FitError::PieceAcross { place }),
    };
    Ok(Piece {
        start: stored.start,
        length: stored.length,
        across,
    })
}

fn every_sample_is_there(patch: usize, image: &StoredImage) -> Result<(), FitError> {
    for (at, (point, &alpha)) in image.position.iter().zip(&image.alpha).enumerate() {
        let value = match alpha > 0.0 {
            true if point.iter().all(|x| x.is_finite()) => continue,
            true => "not finite",
            false => "a hole (A = 0)",
        };
        return Err(FitError::Sample {
            patch,
            column: at % image.width,
            row: at / image.width,
            value,
        });
    }
    Ok(())
}

/// Images of blocks, of the right size. Row 0 is at the bottom.
struct Images<'a> {
    images: &'a [StoredImage],
    samples_per_cell: usize,
}

impl Images<'_> {
    /// Texel `at` along a side, counterclockwise.
    fn along(&self, patch: usize, side: usize, at: usize) -> [f32; 3] {
        let image = &self.images[patch];
        let [right, top] = [image.width - 1, image.height - 1];
        let [column, row] = match side {
            0 => [at, 0],
            1 => [right, at],
            2 => [right - at, top],
            _ => [0, top - at],
        };
        image.position[row * image.width + column]
    }

    /// That both images have the same points where blocks meet.
    fn agree(&self, blocks: &Blocks) -> Result<(), FitError> {
        let k = self.samples_per_cell;
        for (patch, block) in blocks.get().iter().enumerate() {
            for (side, pieces) in block.sides.iter().enumerate() {
                for piece in pieces {
                    let own = (patch, side, piece.start);
                    let Some((other, other_side, start)) = piece.across.filter(|&a| own < a) else {
                        continue;
                    };
                    for i in 0..=piece.length * k {
                        let at = piece.start * k + i;
                        let across = (start + piece.length) * k - i;
                        let one = self.along(patch, side, at);
                        let points = [one, self.along(other, other_side, across)];
                        if points[0] != points[1] {
                            return Err(FitError::Apart {
                                at: [patch, side, at],
                                other,
                                points,
                            });
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// The samples of a part.
    fn grid(&self, part: Part, origin: [f64; 3]) -> Grid {
        let k = self.samples_per_cell;
        let image = &self.images[part.block];
        let samples = part.cells.map(|n| n * k + 1);
        let [column, row] = part.first.map(|n| n * k);
        let rows = (row..row + samples[1]).map(|row| row * image.width + column);
        let points = rows.flat_map(|start| {
            let row = &image.position[start..start + samples[0]];
            row.iter()
                .map(|p| std::array::from_fn(|c| f64::from(p[c]) + origin[c]))
        });
        Grid {
            part,
            samples,
            points: points.collect(),
        }
    }
}
