//! Islands of `TEXCOORD_0`: blocks that lie side by side on the surface, laid out side by side in the plane.
//!
//! *Enters:* a quad mesh and its blocks. *Leaves:* the blocks, turned so that all of an island lie in one frame, with their places in islands, and places of these in a
//! square. *Guaranteed:* borders of islands are lines of the grid; cells of an island overlap nowhere, and a point of the plane is one point of the quad mesh, so that what touches there is
//! joined on the surface; islands keep a gutter. *Not guaranteed:* the fewest islands.
//!
//! Blocks are joined along their longest common sides first, as long as an island fills enough of the rectangle around it. Of several answers to what is enough, the one with the fewest islands is taken whose
//! square is well filled.

use super::blocks::{Block, Blocks, Piece, corner, sides};
use super::error::GridError;
use super::packing::{Outline, Packed, pack};
use super::quads::QuadMesh;
use crate::parallel;
use rustc_hash::{FxHashMap, FxHashSet};

/// What part of the rectangle around an island its cells must be: answers that are tried; the last leaves blocks alone.
const FILLED: [f64; 9] = [0.5, 0.6, 0.7, 0.75, 0.8, 0.85, 0.9, 0.95, 2.0];
/// A square is well filled where this part of it is cells.
const WELL: f64 = 0.8;
/// Longest side of an island of several blocks, in sides of a square with all cells: answers that are tried.
const LONGEST: [f64; 2] = [1.0, 0.5];
/// Blocks are joined where there are at most so many: more are hardly looked at as one picture.
const MOST_JOINED: usize = 1000;

/// Where blocks are.
#[derive(Clone, Debug)]
pub struct Islands {
    /// Of every block, its island and the cell there at its lower left corner.
    pub place: Vec<(usize, [usize; 2])>,
    /// Of every island, the texel at its lower left corner.
    pub corner: Vec<[usize; 2]>,
    /// Texels on a side of the square.
    pub side: usize,
}

/// A turn by quarters, then a shift: how a block lies in its island.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Motion {
    turns: u8,
    shift: [i64; 2],
}

impl Motion {
    const NONE: Self = Self {
        turns: 0,
        shift: [0; 2],
    };

    fn of(self, p: [i64; 2]) -> [i64; 2] {
        let [x, y] = turned(p, self.turns);
        [x + self.shift[0], y + self.shift[1]]
    }

    fn after(self, first: Self) -> Self {
        Self {
            turns: (self.turns + first.turns) & 3,
            shift: self.of(first.shift),
        }
    }

    fn inverse(self) -> Self {
        let turns = (4 - self.turns) & 3;
        Self {
            turns,
            shift: turned(self.shift, turns).map(|x| -x),
        }
    }
}

fn turned([x, y]: [i64; 2], turns: u8) -> [i64; 2] {
    match turns & 3 {
        0 => [x, y],
        1 => [-y, x],
        2 => [-x, -y],
        _ => [y, -x],
    }
}

/// Blocks in one frame.
#[derive(Clone, Debug, Default)]
struct Island {
    blocks: Vec<(usize, Motion)>,
    /// Twice the middles of its cells.
    cells: FxHashSet<[i64; 2]>,
    /// The point of the quad mesh at every corner of a cell.
    points: FxHashMap<[i64; 2], u32>,
    low: [i64; 2],
    high: [i64; 2],
}

impl Island {
    fn of(mesh: &QuadMesh, blocks: &[Block], b: usize) -> Self {
        let block = &blocks[b];
        let [w, h] = block.cells;
        let mut island = Self {
            blocks: vec![(b, Motion::NONE)],
            high: [w as i64, h as i64],
            ..Self::default()
        };
        for j in 0..=h {
            for i in 0..=w {
                let at = [i as i64, j as i64];
                island
                    .points
                    .insert(at, corner(mesh.squares(), block, [i, j]));
                if i < w && j < h {
                    island.cells.insert(at.map(|x| 2 * x + 1));
                }
            }
        }
        island
    }

    /// The same after a motion.
    fn moved(&self, by: Motion) -> Self {
        let twice = Motion {
            shift: by.shift.map(|x| 2 * x),
            ..by
        };
        let ends = [by.of(self.low), by.of(self.high)];
        Self {
            blocks: self
                .blocks
                .iter()
                .map(|(b, m)| (*b, by.after(*m)))
                .collect(),
            cells: self.cells.iter().map(|&c| twice.of(c)).collect(),
            points: self.points.iter().map(|(&p, &id)| (by.of(p), id)).collect(),
            low: [0, 1].map(|i| ends[0][i].min(ends[1][i])),
            high: [0, 1].map(|i| ends[0][i].max(ends[1][i])),
        }
    }

    /// Whether another one lies beside this one as it does on the surface.
    fn fits(&self, other: &Self) -> bool {
        let is_free = |c: &[i64; 2]| !self.cells.contains(c);
        let agrees = |(p, id): (&[i64; 2], &u32)| self.points.get(p).is_none_or(|own| own == id);
        other.cells.iter().all(is_free) && other.points.iter().all(agrees)
    }

    /// Sides of the rectangle around both.
    fn around(&self, other: &Self) -> [i64; 2] {
        [0, 1].map(|i| self.high[i].max(other.high[i]) - self.low[i].min(other.low[i]))
    }

    fn outline(&self) -> Outline {
        let at = |c: &[i64; 2], i: usize| ((c[i] - 1) / 2 - self.low[i]) as usize;
        let cells = self.cells.iter().map(|c| [at(c, 0), at(c, 1)]);
        let mut cells: Vec<[usize; 2]> = cells.collect();
        cells.sort_unstable();
        Outline {
            size: [0, 1].map(|i| (self.high[i] - self.low[i]) as usize),
            cells,
        }
    }

    fn join(&mut self, other: Self) {
        self.blocks.extend(other.blocks);
        self.cells.extend(other.cells);
        self.points.extend(other.points);
        self.low = [0, 1].map(|i| self.low[i].min(other.low[i]));
        self.high = [0, 1].map(|i| self.high[i].max(other.high[i]));
    }
}

/// A point on a side of a block, so many cells along it.
fn on_side(block: &Block, s: usize, along: usize) -> [i64; 2] {
    let ([w, h], x) = (block.cells.map(|n| n as i64), along as i64);
    match s {
        0 => [x, 0],
        1 => [w, x],
        2 => [w - x, h],
        _ => [0, h - x],
    }
}

/// How a block lies beside another one, in the frame of that one, which it meets along a piece of its side.
fn beside(blocks: &[Block], b: usize, s: usize, piece: &Piece) -> Option<(usize, Motion)> {
    let (other, t, start) = piece.across?;
    let turns = ((s + 6 - t) & 3) as u8;
    let here = on_side(&blocks[b], s, piece.start);
    let there = turned(on_side(&blocks[other], t, start + piece.length), turns);
    let shift = [here[0] - there[0], here[1] - there[1]];
    Some((other, Motion { turns, shift }))
}

/// Joins blocks to islands that fill so much of the rectangles around them.
fn joined(mesh: &QuadMesh, blocks: &Blocks, filled: f64, longest: f64) -> Vec<Island> {
    let own = &blocks.blocks;
    let mut islands: Vec<Option<Island>> = Vec::with_capacity(own.len());
    islands.extend((0..own.len()).map(|b| Some(Island::of(mesh, own, b))));
    if filled > 1.0 || own.len() > MOST_JOINED {
        return islands.into_iter().flatten().collect();
    }
    let longest = longest * (mesh.quads.len() as f64).sqrt();
    // Of every block its island, and how it lies there.
    let mut home: Vec<(usize, Motion)> = (0..own.len()).map(|b| (b, Motion::NONE)).collect();
    let mut common: Vec<(usize, usize, &Piece)> = Vec::new();
    for (b, of_block) in blocks.sides.iter().enumerate() {
        for (s, pieces) in of_block.iter().enumerate() {
            common.extend(pieces.iter().map(|piece| (b, s, piece)));
        }
    }
    common.sort_by_key(|(b, s, piece)| (std::cmp::Reverse(piece.length), *b, *s, piece.start));
    loop {
        let mut is_done = true;
        for &(b, s, piece) in &common {
            let Some((other, motion)) = beside(own, b, s, piece) else {
                continue;
            };
            let ((i, here), (j, there)) = (home[b], home[other]);
            if i == j {
                continue;
            }
            let (Some(one), Some(two)) = (&islands[i], &islands[j]) else {
                continue;
            };
            let two = two.moved(here.after(motion).after(there.inverse()));
            let [w, h] = one.around(&two).map(|x| x as f64);
            let cells = (one.cells.len() + two.cells.len()) as f64;
            if cells < filled * w * h || w.max(h) > longest || !one.fits(&two) {
                continue;
            }
            for &(block, motion) in &two.blocks {
                home[block] = (i, motion);
            }
            if let Some(one) = &mut islands[i] {
                one.join(two);
            }
            islands[j] = None;
            is_done = false;
        }
        if is_done {
            return islands.into_iter().flatten().collect();
        }
    }
}

/// Joins blocks to islands, turns them, and packs the islands into a square, each cell `samples` texels wide, with so many texels between islands.
pub(super) fn arrange(
    mesh: &QuadMesh,
    blocks: &mut Blocks,
    samples: usize,
    gutter: usize,
) -> Result<Islands, GridError> {
    let answers = FILLED
        .into_iter()
        .flat_map(|filled| LONGEST.map(|longest| [filled, longest]));
    let answers: Vec<[f64; 2]> = answers.collect();
    let mut islands = parallel::map(&answers, |_, &[filled, longest]| {
        joined(mesh, blocks, filled, longest)
    });
    islands.sort_by_key(Vec::len);
    islands.dedup_by_key(|islands| islands.len());
    let texels = mesh.quads.len() as f64 * (samples * samples) as f64;
    let well = (texels / WELL).sqrt() as usize;
    let packed = |islands: &[Island], most| {
        let outlines: Vec<Outline> = islands.iter().map(Island::outline).collect();
        pack(&outlines, samples, gutter, most)
    };
    let first = islands
        .iter()
        .enumerate()
        .find_map(|(i, islands)| Some((i, packed(islands, well)?)));
    // Otherwise what fills a square best.
    let best = || {
        let mut best: Option<(usize, Packed)> = None;
        for (i, islands) in islands.iter().enumerate() {
            let most = best
                .as_ref()
                .map_or(usize::MAX, |(_, packed)| packed.side - 1);
            best = packed(islands, most).map(|packed| (i, packed)).or(best);
        }
        best
    };
    let (i, packed) = first.or_else(best).unwrap_or_default();
    let islands = islands.swap_remove(i);
    let mut place = vec![(0, [0; 2]); blocks.blocks.len()];
    for (number, (island, is_turned)) in islands.iter().zip(&packed.is_turned).enumerate() {
        let frame = Motion {
            turns: u8::from(*is_turned),
            shift: [0; 2],
        };
        let island = Island {
            blocks: island.blocks.clone(),
            low: island.low,
            high: island.high,
            ..Island::default()
        }
        .moved(frame);
        for &(b, motion) in &island.blocks {
            let block = &mut blocks.blocks[b];
            let far = motion.of(block.cells.map(|n| n as i64));
            let low = [0, 1].map(|i| motion.shift[i].min(far[i]) - island.low[i]);
            place[b] = (number, low.map(|x| x as usize));
            *block = block.turned(motion.turns);
        }
    }
    blocks.sides = sides(mesh.squares(), &blocks.blocks)?;
    Ok(Islands {
        place,
        corner: packed.corner,
        side: packed.side,
    })
}
