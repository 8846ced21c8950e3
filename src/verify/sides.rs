//! Sides of blocks: what `atlas.json` says lies across them, and that both images hold the same points there, texel by texel.

use super::Verdicts;
use super::document::{Document, Patch, Piece};
use crate::read::exr::Image;

/// Positions along the four sides of an image, counterclockwise from its lower left corner; row 0 is the lowest.
pub(super) type Sides = [Vec<[f32; 3]>; 4];

/// Reads them off.
pub(super) fn sides(image: &Image, patch: &Patch) -> Sides {
    let [right, top] = [patch.width, patch.height].map(|n| n.saturating_sub(1));
    let at = |column: usize, row: usize| {
        let texel = row * patch.width + column;
        [0, 1, 2].map(|i| image.rgb[i].get(texel).copied().unwrap_or(f32::NAN))
    };
    [
        (0..=right).map(|x| at(x, 0)).collect(),
        (0..=top).map(|y| at(right, y)).collect(),
        (0..=right).rev().map(|x| at(x, top)).collect(),
        (0..=top).rev().map(|y| at(0, y)).collect(),
    ]
}

/// A block as `atlas.json` describes it.
struct Block<'a> {
    cells: [usize; 2],
    samples: usize,
    pieces: &'a [Vec<Piece>; 4],
}

fn block(patch: &Patch) -> Option<Block<'_>> {
    let (cells, samples) = (patch.cells?, patch.samples_per_cell?);
    let size = cells.map(|n| n.checked_mul(samples).and_then(|n| n.checked_add(1)));
    (size == [Some(patch.width), Some(patch.height)]).then_some(Block {
        cells,
        samples,
        pieces: patch.sides.as_ref()?,
    })
}

/// Compares all sides; `of_patch` holds nothing for images that could not be read and for flat patches.
pub(super) fn check(document: &Document, of_patch: &[Option<Sides>], verdicts: &mut Verdicts) {
    let is_block = |patch: &&Patch| patch.domain == "grid";
    if !document.patches.iter().any(|patch| is_block(&patch)) {
        return;
    }
    let blocks: Vec<Option<Block<'_>>> = document.patches.iter().map(block).collect();
    let mut without: Vec<usize> = Vec::new();
    for patch in document.patches.iter().filter(is_block) {
        if blocks[patch.id].is_none() {
            without.push(patch.id);
        }
    }
    verdicts.note(
        "blocks state their cells and sides, and images have their size",
        without.is_empty(),
        format!("{} blocks do not", without.len()),
    );
    let (mut uncovered, mut one_way, mut compared, mut differing) = (0, 0, 0, 0);
    for (id, block) in blocks.iter().enumerate() {
        let Some(block) = block else { continue };
        for (s, pieces) in block.pieces.iter().enumerate() {
            let mut end = Some(0);
            for piece in pieces {
                let follows = end == Some(piece.start) && piece.length > 0;
                end = follows
                    .then(|| piece.start.checked_add(piece.length))
                    .flatten();
            }
            uncovered += usize::from(end != Some(block.cells[s % 2]));
            for piece in pieces {
                let Some((other, side, start)) = piece.across() else {
                    one_way += usize::from(piece.patch.is_some());
                    continue;
                };
                let back = |p: &Piece| {
                    p.across() == Some((id, s, piece.start))
                        && p.start == start
                        && p.length == piece.length
                };
                let beyond = blocks.get(other).and_then(Option::as_ref);
                let is_mutual = beyond
                    .and_then(|beyond| beyond.pieces.get(side))
                    .is_some_and(|pieces| pieces.iter().any(back));
                if !is_mutual || !piece.reversed {
                    one_way += 1;
                    continue;
                }
                let texels = |patch: usize, side: usize, from: usize| {
                    let own = &of_patch.get(patch)?.as_ref()?[side];
                    let first = from.checked_mul(block.samples)?;
                    let length = piece.length.checked_mul(block.samples)?;
                    own.get(first..=first.checked_add(length)?)
                };
                let (Some(a), Some(b)) = (texels(id, s, piece.start), texels(other, side, start))
                else {
                    continue;
                };
                compared += a.len();
                let pairs = a.iter().zip(b.iter().rev());
                differing += pairs
                    .filter(|(p, q)| p.map(f32::to_bits) != q.map(f32::to_bits))
                    .count();
            }
        }
    }
    verdicts.note(
        "pieces of sides cover them in order",
        uncovered == 0,
        format!("{uncovered} sides are not"),
    );
    verdicts.note(
        "pieces of sides name each other",
        one_way == 0,
        format!("{one_way} do not"),
    );
    verdicts.note(
        "images of blocks hold the same points along common sides",
        differing == 0,
        format!("{differing} of {compared} texels differ"),
    );
}
