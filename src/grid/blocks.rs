//! Rectangles of squares: the motorcycle graph of a quad mesh, with as few of its lines as that takes.
//!
//! *Enters:* a [`QuadMesh`]. *Leaves:* [`Block`]s, each a rectangle of squares, and what lies across their sides, square by square. *Guaranteed:* every square is in one block; irregular points are on the borders of
//! blocks; T-junctions are harmless, since both sides have the same squares; the same blocks for the same mesh. *Not guaranteed:* the fewest.
//!
//! From every irregular point a line starts along each of its edges and goes straight on, all at the same speed, until it meets another line, an irregular point or the border; lines divide the surface into rectangles (Eppstein, Goodrich, Kim, Tamstorf 2008).
//! Without irregular points a line or two are put where they are needed. Then two blocks that share a whole side of both become one, the longest sides first, and one that lies beside itself becomes two.

use super::error::GridError;
use super::quads::QuadMesh;
use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};

/// A rectangle of squares.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Squares along its first and second side.
    pub cells: [usize; 2],
    /// Row by row from the bottom: square, and which of its corners is at the bottom left.
    pub squares: Vec<(u32, u8)>,
}

/// A stretch of a side with one neighbour, in squares, counterclockwise around the block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Piece {
    /// First square of this side.
    pub start: usize,
    /// Squares.
    pub length: usize,
    /// Block, side and first square across, which is met last there; `None` on the border.
    pub across: Option<(usize, usize, usize)>,
}

impl Block {
    /// The same turned by quarters, counterclockwise.
    pub(super) fn turned(&self, turns: u8) -> Self {
        let [w, h] = self.cells;
        let turns = turns & 3;
        let cells = if turns & 1 == 1 { [h, w] } else { [w, h] };
        let old = |i: usize, j: usize| match turns {
            0 => (i, j),
            1 => (j, h - 1 - i),
            2 => (w - 1 - i, h - 1 - j),
            _ => (w - 1 - j, i),
        };
        let squares = (0..cells[1]).flat_map(|j| (0..cells[0]).map(move |i| old(i, j)));
        let squares = squares.map(|(i, j)| {
            let (q, k) = self.squares[j * w + i];
            (q, (k + 4 - turns) & 3)
        });
        Self {
            cells,
            squares: squares.collect(),
        }
    }
}

/// The point at column i and row j of the corners of a block's squares.
pub(super) fn corner(mesh: Squares<'_>, block: &Block, [i, j]: [usize; 2]) -> u32 {
    let [w, h] = block.cells;
    let (column, row) = (i.min(w - 1), j.min(h - 1));
    let (q, k) = block.squares[row * w + column];
    let turn = match (i > column, j > row) {
        (false, false) => 0,
        (true, false) => 1,
        (true, true) => 2,
        (false, true) => 3,
    };
    mesh.quads[q as usize][usize::from((k + turn) & 3)]
}

/// Blocks with their sides: bottom, right, top, left.
#[derive(Clone, Debug)]
pub struct Blocks {
    /// Rectangles.
    pub blocks: Vec<Block>,
    /// Stretches of each of their sides.
    pub sides: Vec<[Vec<Piece>; 4]>,
}

/// Squares of a mesh.
#[derive(Clone, Copy, Debug)]
pub struct Squares<'a> {
    /// Corners, counterclockwise.
    pub quads: &'a [[u32; 4]],
    /// Across side k, from corner k to the next: square and side there; `None` on the border.
    pub across: &'a [[Option<(u32, u8)>; 4]],
}

/// Where blocks are divided.
#[derive(Clone, Debug)]
pub struct Rules {
    /// Whether lines start along all edges of a point.
    pub starts: Vec<bool>,
    /// Of every square, the sides that divide it from the next from the beginning; those on the border do anyway.
    pub walls: Vec<[bool; 4]>,
    /// Whether such sides and those at points where lines start divide blocks to the end, so that every such point is a corner of all its blocks.
    pub are_kept: bool,
}

struct Walls<'a> {
    mesh: Squares<'a>,
    rules: &'a Rules,
    /// Of every square, its four sides.
    is_wall: Vec<[bool; 4]>,
}

impl QuadMesh {
    /// Its squares.
    pub fn squares(&self) -> Squares<'_> {
        Squares {
            quads: &self.quads,
            across: &self.across,
        }
    }

    /// See the module docs.
    pub fn blocks(&self) -> Result<Blocks, GridError> {
        let points = self.points.iter().zip(self.border());
        let starts = points.map(|(p, is_border)| match is_border {
            true => p.valence > 3,
            false => p.valence != 4,
        });
        self.squares().blocks(&Rules {
            starts: starts.collect(),
            walls: vec![[false; 4]; self.quads.len()],
            are_kept: false,
        })
    }
}

impl<'a> Squares<'a> {
    /// Blocks by rules.
    pub fn blocks(self, rules: &'a Rules) -> Result<Blocks, GridError> {
        let on_border = self.across.iter().map(|a| a.map(|across| across.is_none()));
        let both =
            |(border, walls): ([bool; 4], &[bool; 4])| [0, 1, 2, 3].map(|k| border[k] || walls[k]);
        let mut walls = Walls {
            mesh: self,
            is_wall: on_border.zip(&rules.walls).map(both).collect(),
            rules,
        };
        walls.race();
        let mut blocks = walls.rectangles()?;
        walls.join(&mut blocks)?;
        walls.part(&mut blocks)?;
        let sides = sides(self, &blocks)?;
        Ok(Blocks { blocks, sides })
    }

    /// The side that goes on where one ends at a point with four edges.
    fn straight_on(self, (q, k): (u32, u8)) -> Option<(u32, u8)> {
        let (q, k) = self.across[q as usize][usize::from((k + 1) & 3)]?;
        Some((q, (k + 1) & 3))
    }
}

impl Walls<'_> {
    /// Whether a side divides blocks to the end.
    fn is_kept(&self, (q, k): (u32, u8)) -> bool {
        let corners = self.mesh.quads[q as usize];
        let ends = [k, (k + 1) & 3].map(|k| corners[usize::from(k)]);
        self.rules.are_kept
            && (self.rules.walls[q as usize][usize::from(k)]
                || ends.iter().any(|&v| self.rules.starts[v as usize]))
    }

    fn put(&mut self, (q, k): (u32, u8)) {
        self.is_wall[q as usize][usize::from(k)] = true;
        if let Some((q, k)) = self.mesh.across[q as usize][usize::from(k)] {
            self.is_wall[q as usize][usize::from(k)] = true;
        }
    }

    fn is(&self, q: u32, k: u8) -> bool {
        self.is_wall[q as usize][usize::from(k & 3)]
    }

    /// Lines from irregular points.
    fn race(&mut self) {
        let mesh = self.mesh;
        let starts = &self.rules.starts;
        // Where lines start, and on walls.
        let mut is_met = starts.clone();
        for (corners, walls) in mesh.quads.iter().zip(&self.is_wall) {
            for k in (0..4).filter(|&k| walls[k]) {
                is_met[corners[k] as usize] = true;
                is_met[corners[(k + 1) % 4] as usize] = true;
            }
        }
        let mut running: Vec<(u32, u8)> = Vec::new();
        for (q, corners) in mesh.quads.iter().enumerate() {
            for k in 0..4u8 {
                let inner = mesh.across[q][usize::from(k)].is_some();
                if inner && starts[corners[usize::from(k)] as usize] {
                    running.push((q as u32, k));
                }
            }
        }
        while !running.is_empty() {
            let mut next = Vec::with_capacity(running.len());
            for (q, k) in running {
                let was = self.is(q, k);
                self.put((q, k));
                let end = mesh.quads[q as usize][usize::from((k + 1) & 3)] as usize;
                if was || std::mem::replace(&mut is_met[end], true) {
                    continue;
                }
                next.extend(mesh.straight_on((q, k)));
            }
            running = next;
        }
    }

    /// A whole line from a side on, both ways, as far as there are no walls.
    fn line(&mut self, begin: (u32, u8)) {
        let back = self.mesh.across[begin.0 as usize][usize::from(begin.1)];
        for start in [Some(begin), back].into_iter().flatten() {
            let mut at = start;
            let mut is_first = true;
            loop {
                if self.is(at.0, at.1) && !std::mem::take(&mut is_first) {
                    break;
                }
                is_first = false;
                self.put(at);
                // Both sides of a wall that is crossed end it.
                if self.is_met_by_wall(at) {
                    break;
                }
                match self.mesh.straight_on(at) {
                    Some(next) => at = next,
                    None => break,
                }
            }
        }
    }

    /// Whether a wall crosses where a side ends.
    fn is_met_by_wall(&self, (q, k): (u32, u8)) -> bool {
        self.is(q, k + 1)
    }

    /// The block whose bottom left corner is a corner of a square; `None` where it is no rectangle.
    fn rectangle(&self, corner: (u32, u8)) -> Option<Block> {
        let mesh = self.mesh;
        let row = |mut at: (u32, u8)| {
            let mut row = vec![at];
            while !self.is(at.0, at.1 + 1) && row.len() <= mesh.quads.len() {
                let (q, k) = mesh.across[at.0 as usize][usize::from((at.1 + 1) & 3)]?;
                at = (q, (k + 1) & 3);
                row.push(at);
            }
            Some(row)
        };
        let mut squares = row(corner)?;
        let width = squares.len();
        let mut first = corner;
        let mut height = 1;
        while !self.is(first.0, first.1 + 2) {
            first = mesh.across[first.0 as usize][usize::from((first.1 + 2) & 3)]?;
            squares.extend(row(first)?);
            height += 1;
            if squares.len() != width * height || squares.len() > mesh.quads.len() {
                return None;
            }
        }
        let block = Block {
            cells: [width, height],
            squares,
        };
        // Walls all around, and none inside.
        let is_whole = (0..height).all(|j| {
            (0..width).all(|i| {
                let (q, k) = block.squares[j * width + i];
                let walls = [j == 0, i + 1 == width, j + 1 == height, i == 0];
                (0..4).all(|s| self.is(q, k + s as u8) == walls[s])
            })
        });
        is_whole.then_some(block)
    }

    /// All blocks, with lines put where a region has no corner.
    fn rectangles(&mut self) -> Result<Vec<Block>, GridError> {
        let mesh = self.mesh;
        loop {
            let mut is_taken = vec![false; mesh.quads.len()];
            let mut blocks = Vec::new();
            for q in 0..mesh.quads.len() as u32 {
                for k in 0..4 {
                    if is_taken[q as usize] || !(self.is(q, k) && self.is(q, k + 3)) {
                        continue;
                    }
                    let block = self
                        .rectangle((q, k))
                        .ok_or(GridError::NoRectangle { square: q })?;
                    block
                        .squares
                        .iter()
                        .for_each(|s| is_taken[s.0 as usize] = true);
                    blocks.push(block);
                }
            }
            let Some(free) = is_taken.iter().position(|taken| !taken) else {
                return Ok(blocks);
            };
            // A region that closes up: across it if it has a border, and both ways if not.
            let region = self.region(free as u32);
            let beside_wall = region
                .iter()
                .find_map(|&q| Some((q, (0..4).find(|&k| self.is(q, k))?)));
            match beside_wall {
                Some((q, k)) => self.line((q, (k + 1) & 3)),
                None => {
                    self.line((free as u32, 0));
                    self.line((free as u32, 1));
                }
            }
        }
    }

    /// Squares that no wall divides from one.
    fn region(&self, begin: u32) -> Vec<u32> {
        let mut is_met = vec![false; self.mesh.quads.len()];
        is_met[begin as usize] = true;
        let mut region = vec![begin];
        let mut at = 0;
        while at < region.len() {
            let q = region[at];
            for k in (0..4).filter(|&k| !self.is(q, k)) {
                if let Some((next, _)) = self.mesh.across[q as usize][usize::from(k)]
                    && !std::mem::replace(&mut is_met[next as usize], true)
                {
                    region.push(next);
                }
            }
            at += 1;
        }
        region
    }

    /// Makes one of two blocks that share a whole side of both: the longest sides first, then by block and side.
    fn join(&mut self, blocks: &mut Vec<Block>) -> Result<(), GridError> {
        let mut along = Along::new(self.mesh, blocks);
        let mut left: Vec<Option<Block>> = blocks.drain(..).map(Some).collect();
        let mut sides = Vec::with_capacity(left.len());
        for block in left.iter().flatten() {
            sides.push(along.pieces(self.mesh, block)?);
        }
        // Of two blocks beside each other, both whole sides; one that has changed since is found out when its turn comes.
        let whole = |sides: &[[Vec<Piece>; 4]], b: usize, s: usize| match sides[b][s][..] {
            [
                Piece {
                    length,
                    across: Some((other, t, _)),
                    ..
                },
            ] if other != b && sides[other][t].len() == 1 => Some((length, other)),
            _ => None,
        };
        let mut heap: BinaryHeap<(usize, Reverse<usize>, Reverse<usize>)> = BinaryHeap::new();
        let offer = |heap: &mut BinaryHeap<_>, sides: &[[Vec<Piece>; 4]], b: usize| {
            for s in 0..4 {
                if let Some((length, _)) = whole(sides, b, s) {
                    heap.push((length, Reverse(b), Reverse(s)));
                }
            }
        };
        (0..left.len()).for_each(|b| offer(&mut heap, &sides, b));
        while let Some((length, Reverse(b), Reverse(s))) = heap.pop() {
            let (Some(block), Some((now, other))) = (&left[b], whole(&sides, b, s)) else {
                continue;
            };
            let Some(beyond) = left[other].as_ref().filter(|_| now == length) else {
                continue;
            };
            let side = side_of(block, s);
            if side.iter().any(|&side| self.is_kept(side)) {
                continue;
            }
            for (q, k) in side {
                self.is_wall[q as usize][usize::from(k)] = false;
                if let Some((q, k)) = self.mesh.across[q as usize][usize::from(k)] {
                    self.is_wall[q as usize][usize::from(k)] = false;
                }
            }
            let squares = block.squares.iter().chain(&beyond.squares);
            let mut turned = squares.flat_map(|&(q, k)| (0..4u8).map(move |i| (q, (k + i) & 3)));
            let corner = turned.find(|&(q, k)| self.is(q, k) && self.is(q, k + 3));
            let joined = corner.and_then(|corner| self.rectangle(corner));
            let square = block.squares[0].0;
            let joined = joined.ok_or(GridError::NoRectangle { square })?;
            let (kept, gone) = (b.min(other), b.max(other));
            along.put(kept, &joined);
            left[gone] = None;
            sides[gone] = Default::default();
            sides[kept] = along.pieces(self.mesh, &joined)?;
            left[kept] = Some(joined);
            let around = sides[kept].iter().flatten();
            let around = around.filter_map(|piece| piece.across.map(|a| a.0));
            let around: BTreeSet<usize> = around.chain([kept]).collect();
            for &b in &around {
                if let Some(block) = &left[b] {
                    sides[b] = along.pieces(self.mesh, block)?;
                }
            }
            around.iter().for_each(|&b| offer(&mut heap, &sides, b));
        }
        blocks.extend(left.into_iter().flatten());
        Ok(())
    }

    /// Divides blocks that lie beside themselves, as far as they have squares for that.
    fn part(&mut self, blocks: &mut Vec<Block>) -> Result<(), GridError> {
        loop {
            let sides = sides(self.mesh, blocks)?;
            let beside_itself = |(b, of): (usize, &[Vec<Piece>; 4])| {
                let [w, h] = blocks[b].cells;
                let own = (0..4).flat_map(|s| of[s].iter().map(move |p| (s, p)));
                own.filter_map(|(s, p)| p.across.filter(|a| a.0 == b).map(|a| (s, a.1)))
                    .find_map(|(s, t)| match (s % 2, t % 2) {
                        // Left and right, bottom and top.
                        (1, 1) if w > 1 => Some((b, 0)),
                        (0, 0) if h > 1 => Some((b, 1)),
                        _ if w.max(h) > 1 => Some((b, usize::from(h > w))),
                        _ => None,
                    })
            };
            let Some((b, axis)) = sides.iter().enumerate().find_map(beside_itself) else {
                return Ok(());
            };
            let w = blocks[b].cells[0];
            let half = blocks[b].cells[axis] / 2;
            for i in 0..blocks[b].cells[1 - axis] {
                let (at, side) = match axis {
                    0 => (i * w + half - 1, 1),
                    _ => ((half - 1) * w + i, 2),
                };
                let (q, k) = blocks[b].squares[at];
                self.put((q, (k + side) & 3));
            }
            let second = if axis == 0 { half } else { half * w };
            let corners = [blocks[b].squares[0], blocks[b].squares[second]];
            let [one, other] = corners.map(|corner| self.rectangle(corner));
            let square = corners[0].0;
            let missing = || GridError::NoRectangle { square };
            blocks[b] = one.ok_or_else(missing)?;
            blocks.push(other.ok_or_else(missing)?);
        }
    }
}

/// What lies across the sides of blocks.
pub(super) fn sides(
    mesh: Squares<'_>,
    blocks: &[Block],
) -> Result<Vec<[Vec<Piece>; 4]>, GridError> {
    let along = Along::new(mesh, blocks);
    blocks.iter().map(|b| along.pieces(mesh, b)).collect()
}

/// Block, side and number along it of every side of a square on the border of its block.
struct Along(Vec<[Option<(usize, usize, usize)>; 4]>);

impl Along {
    fn new(mesh: Squares<'_>, blocks: &[Block]) -> Self {
        let mut along = Self(vec![[None; 4]; mesh.quads.len()]);
        for (b, block) in blocks.iter().enumerate() {
            along.put(b, block);
        }
        along
    }

    fn put(&mut self, b: usize, block: &Block) {
        for s in 0..4 {
            for (i, (q, k)) in side_of(block, s).into_iter().enumerate() {
                self.0[q as usize][usize::from(k)] = Some((b, s, i));
            }
        }
    }

    /// What lies across the sides of one block.
    fn pieces(&self, mesh: Squares<'_>, block: &Block) -> Result<[Vec<Piece>; 4], GridError> {
        let mut all: [Vec<Piece>; 4] = Default::default();
        for (s, pieces) in all.iter_mut().enumerate() {
            for (i, (q, k)) in side_of(block, s).into_iter().enumerate() {
                let across = match mesh.across[q as usize][usize::from(k)] {
                    Some((square, k)) => {
                        let there = self.0[square as usize][usize::from(k)];
                        Some(there.ok_or(GridError::NoRectangle { square })?)
                    }
                    None => None,
                };
                let goes_on = |piece: &Piece| match (piece.across, across) {
                    (Some((b, s, last)), Some((c, t, at))) => (b, s) == (c, t) && at + 1 == last,
                    (None, None) => true,
                    _ => false,
                };
                match pieces.last_mut() {
                    Some(piece) if goes_on(piece) => {
                        piece.length += 1;
                        piece.across = across;
                    }
                    _ => pieces.push(Piece {
                        start: i,
                        length: 1,
                        across,
                    }),
                }
            }
        }
        Ok(all)
    }
}

/// Squares along a side of a block, counterclockwise, with their sides there.
pub(crate) fn side_of(block: &Block, s: usize) -> Vec<(u32, u8)> {
    let [w, h] = block.cells;
    let at = |i: usize, j: usize| {
        let (q, k) = block.squares[j * w + i];
        (q, (k + s as u8) & 3)
    };
    match s {
        0 => (0..w).map(|i| at(i, 0)).collect(),
        1 => (0..h).map(|j| at(w - 1, j)).collect(),
        2 => (0..w).rev().map(|i| at(i, h - 1)).collect(),
        _ => (0..h).rev().map(|j| at(0, j)).collect(),
    }
}
