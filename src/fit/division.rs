//! Blocks divided until whole sides meet whole sides.
//!
//! *Enters:* [`Blocks`], whose sides may have T-junctions. *Leaves:* a [`Division`]: their parts, and which sides of parts are one curve. *Guaranteed:* every
//! side of a part meets exactly one whole side of a part (perhaps its own other side) or lies on the boundary; no line is longer than that takes. *Not guaranteed:* few parts: lines go on
//! from block to block until they end at the boundary or meet themselves, and in the worst case every cell is a part.
//!
//! Where two pieces of a side meet, the lattice line there divides the block from this side to the opposite one. So it ends in the middle of a piece across, or in a corner
//! there. The former makes another line. Lines lie between cells, so there are finitely many of them.

use super::blocks::{Block, Blocks};
use super::side::{Interface, PatchSide, Side};
use crate::grid::blocks::Piece;

/// A rectangle of cells of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Block.
    pub block: usize,
    /// Its first column and row in the block.
    pub first: [usize; 2],
    /// Columns and rows.
    pub cells: [usize; 2],
}

/// Parts of blocks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Division {
    /// Block by block, row by row.
    pub parts: Vec<Part>,
    /// Which of their sides meet.
    pub interfaces: Vec<Interface>,
}

/// A line through a block: block, axis along which its place is counted, place.
type Line = (usize, usize, usize);

/// Divides blocks.
pub fn divide(blocks: &Blocks) -> Division {
    let blocks = blocks.get();
    let lines = lines(blocks);
    let mut parts = Vec::new();
    let mut first = Vec::with_capacity(blocks.len());
    for (block, [columns, rows]) in lines.iter().enumerate() {
        first.push(parts.len());
        for row in rows.windows(2) {
            for column in columns.windows(2) {
                parts.push(Part {
                    block,
                    first: [column[0], row[0]],
                    cells: [column[1] - column[0], row[1] - row[0]],
                });
            }
        }
    }
    let divided = Divided {
        blocks,
        lines,
        first,
    };
    let mut interfaces = Vec::new();
    for block in 0..blocks.len() {
        divided.inside(block, &mut interfaces);
        divided.around(block, &mut interfaces);
    }
    Division { parts, interfaces }
}

/// Places of the lines through every block along both axes, with its ends.
fn lines(blocks: &[Block]) -> Vec<[Vec<usize>; 2]> {
    let mut is_line: Vec<[Vec<bool>; 2]> = blocks
        .iter()
        .map(|block| {
            block.cells.map(|cells| {
                let mut is_line = vec![false; cells + 1];
                (is_line[0], is_line[cells]) = (true, true);
                is_line
            })
        })
        .collect();
    let mut open: Vec<Line> = Vec::new();
    let mut put = |(block, axis, at): Line, open: &mut Vec<Line>| {
        let is_line: &mut Vec<bool> = &mut is_line[block][axis];
        if !std::mem::replace(&mut is_line[at], true) {
            open.push((block, axis, at));
        }
    };
    for (b, block) in blocks.iter().enumerate() {
        for (side, pieces) in block.sides.iter().enumerate() {
            for piece in pieces {
                put(
                    (b, side % 2, block.along_axis(side, piece.start)),
                    &mut open,
                );
            }
        }
    }
    while let Some((b, axis, at)) = open.pop() {
        for side in [axis, axis + 2] {
            let at = blocks[b].along_axis(side, at);
            let piece = piece_of(&blocks[b], side, at);
            if let (Some((other, other_side, start)), true) = (piece.across, piece.start < at) {
                let at = start + piece.start + piece.length - at;
                let at = blocks[other].along_axis(other_side, at);
                put((other, other_side % 2, at), &mut open);
            }
        }
    }
    let places = |is_line: Vec<bool>| {
        let at = (0..is_line.len()).filter(|&at| is_line[at]);
        at.collect()
    };
    is_line
        .into_iter()
        .map(|of_block| of_block.map(places))
        .collect()
}

/// The piece that holds a cell of a side, which it has.
fn piece_of(block: &Block, side: usize, cell: usize) -> Piece {
    let pieces = &block.sides[side];
    pieces[pieces.partition_point(|piece| piece.start <= cell) - 1]
}

/// Blocks with the lines through them.
struct Divided<'a> {
    blocks: &'a [Block],
    lines: Vec<[Vec<usize>; 2]>,
    /// Number of the first part of every block.
    first: Vec<usize>,
}

impl Divided<'_> {
    /// Numbers of columns and rows of parts.
    fn size(&self, block: usize) -> [usize; 2] {
        [0, 1].map(|axis| self.lines[block][axis].len() - 1)
    }

    /// Interfaces within a block.
    fn inside(&self, block: usize, interfaces: &mut Vec<Interface>) {
        let [columns, rows] = self.size(block);
        for part in 0..columns * rows {
            let beyond = [
                (part % columns + 1 < columns, 1, [Side::East, Side::West]),
                (
                    part / columns + 1 < rows,
                    columns,
                    [Side::North, Side::South],
                ),
            ];
            for (_, step, sides) in beyond.into_iter().filter(|beyond| beyond.0) {
                let patch = self.first[block] + part;
                interfaces.push(Interface {
                    first: PatchSide {
                        patch,
                        side: sides[0],
                    },
                    second: PatchSide {
                        patch: patch + step,
                        side: sides[1],
                    },
                    reversed: false,
                });
            }
        }
    }

    /// Interfaces of a block's sides with those that come after them.
    fn around(&self, block: usize, interfaces: &mut Vec<Interface>) {
        for (side, pieces) in self.blocks[block].sides.iter().enumerate() {
            for piece in pieces {
                let own = (block, side, piece.start);
                let Some(across) = piece.across.filter(|&across| own < across) else {
                    continue;
                };
                let other = across.1;
                let ends = |at: &usize| self.blocks[block].along_axis(side, *at);
                let lines = self.lines[block][side % 2].iter().map(ends);
                let range = piece.start..piece.start + piece.length;
                for start in lines.filter(|at| range.contains(at)) {
                    // The end of this stretch is the beginning of the other.
                    let first = self.at(block, side, start);
                    let length = first.1;
                    let start = across.2 + range.end - start - length;
                    interfaces.push(Interface {
                        first: first.0,
                        second: self.at(across.0, other, start).0,
                        // Two sides of a block run along its axes, and two against them.
                        reversed: (side < 2) == (other < 2),
                    });
                }
            }
        }
    }

    /// The part's side that begins at a point of a block's side, counterclockwise, and its cells.
    fn at(&self, block: usize, side: usize, start: usize) -> (PatchSide, usize) {
        let lines = &self.lines[block][side % 2];
        let low = self.blocks[block].along_axis(side, start);
        let is_along = side < 2;
        // Against the axis a stretch ends at the line where it begins along it.
        let line = lines.partition_point(|&at| at < low);
        let index = if is_along { line } else { line - 1 };
        let [columns, rows] = self.size(block);
        let part = match side {
            0 => index,
            1 => (index + 1) * columns - 1,
            2 => (rows - 1) * columns + index,
            _ => index * columns,
        };
        let place = PatchSide {
            patch: self.first[block] + part,
            side: Side::AROUND[side],
        };
        (place, lines[index + 1] - lines[index])
    }
}
