//! Blocks of a grid, and what lies across their sides.
//!
//! *Enters:* cells and sides of every block, as they are stated. *Leaves:* [`Blocks`]. *Guaranteed:* every block has cells; the pieces of a side
//! cover it in order; what lies across them are pieces of other sides, as long, across which lie the first. *Not guaranteed:* that their images hold the
//! same points.

use super::error::FitError;
use crate::grid::blocks::Piece;

/// A rectangle of cells.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Columns and rows.
    pub cells: [usize; 2],
    /// What lies across the bottom, the right, the top and the left side, in cells counterclockwise around the block.
    pub sides: [Vec<Piece>; 4],
}

impl Block {
    /// Cells along a side.
    pub(super) fn length(&self, side: usize) -> usize {
        self.cells[side % 2]
    }

    /// Where a point of a side stands, counted along it counterclockwise, in the direction of the axis; and the other way round.
    pub(super) fn along_axis(&self, side: usize, at: usize) -> usize {
        match side {
            0 | 1 => at,
            _ => self.length(side) - at,
        }
    }
}

/// Blocks that fit each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Blocks(Vec<Block>);

/// A piece by block, side and number along it.
type Place = [usize; 3];

impl Blocks {
    /// Checks that blocks fit each other.
    ///
    /// # Errors
    /// Blocks without cells, sides that their pieces do not cover, and pieces across which lies none, or one that does not say so.
    pub fn new(blocks: Vec<Block>) -> Result<Self, FitError> {
        for (patch, block) in blocks.iter().enumerate() {
            if block.cells.contains(&0) {
                let cells = block.cells;
                return Err(FitError::NoCells { patch, cells });
            }
            for side in 0..4 {
                covered(block, [patch, side])?;
            }
        }
        for (patch, block) in blocks.iter().enumerate() {
            for (side, pieces) in block.sides.iter().enumerate() {
                for (number, piece) in pieces.iter().enumerate() {
                    mutual(&blocks, [patch, side, number], piece)?;
                }
            }
        }
        Ok(Self(blocks))
    }

    /// The blocks.
    pub fn get(&self) -> &[Block] {
        &self.0
    }
}

fn covered(block: &Block, [patch, side]: [usize; 2]) -> Result<(), FitError> {
    let (mut end, cells) = (0, block.length(side));
    for (number, piece) in block.sides[side].iter().enumerate() {
        let place = [patch, side, number];
        if piece.start != end {
            let start = piece.start;
            return Err(FitError::PieceStart { place, start, end });
        }
        let left = cells - end;
        if piece.length == 0 || piece.length > left {
            let length = piece.length;
            return Err(FitError::PieceLength {
                place,
                length,
                left,
            });
        }
        end += piece.length;
    }
    match end == cells {
        true => Ok(()),
        false => Err(FitError::NotCovered {
            patch,
            side,
            end,
            cells,
        }),
    }
}

/// That the piece across is there and names this one.
fn mutual(blocks: &[Block], place: Place, piece: &Piece) -> Result<(), FitError> {
    let Some((patch, side, start)) = piece.across else {
        return Ok(());
    };
    let Some(other) = blocks.get(patch) else {
        let patches = blocks.len();
        return Err(FitError::PiecePatch {
            place,
            patch,
            patches,
        });
    };
    let Some(pieces) = other.sides.get(side) else {
        return Err(FitError::PieceSide { place, side });
    };
    let own = (place[0], place[1], piece.start);
    let number = pieces.partition_point(|other| other.start < start);
    let fits = |other: &&Piece| {
        other.start == start && other.length == piece.length && other.across == Some(own)
    };
    if pieces.get(number).filter(fits).is_none() {
        return Err(FitError::NotMutual {
            place,
            across: [patch, side, start],
        });
    }
    match own == (patch, side, start) {
        true => Err(FitError::Folded { place }),
        false => Ok(()),
    }
}
