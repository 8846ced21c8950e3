//! The limit surface as bicubic B-spline patches that meet at whole sides with the same knots: what isogeometric analysis takes.
//!
//! *Enters:* a [`Limit`] surface whose cells have at most one irregular point each. *Leaves:* [`Patches`]: one surface a block of cells, which sides they share, and which are on the border.
//!
//! Blocks are the rectangles between lines that go straight on from every irregular point, along creases and the border until they come to an irregular point, to the border or back: the base complex. Where a rectangle would close up or lie beside itself, a
//! line more goes all around. Every half of a cell has a knot, in both parameters of all patches.
//!
//! *Guaranteed:* a side is all of an interface or on the border; knots along both sides of an interface are the same, and control points to the last bit; irregular points and ends of creases are corners of all their patches; the patches are the limit surface to rounding but
//! in a last square of half a cell by half a cell at every irregular point, where they are as `tensor` says. No patch has an interface with itself unless it is one cell. *Not guaranteed:* equal normals across interfaces in those squares; few patches.

use super::cage::{Cage, CellSide};
use super::error::SplineError;
use super::limit::Limit;
use super::surface::BSplineSurface;
use super::tensor::{irregular_corners, join_corners, surface};
use crate::grid::blocks::{Block, Blocks, Piece, Rules, Squares, side_of};
use crate::parallel;

/// Patches and how they hang together.
#[derive(Clone, Debug, PartialEq)]
pub struct Patches {
    /// Their surfaces; the normal ∂u × ∂v points outward.
    pub surfaces: Vec<BSplineSurface>,
    /// Pairs of sides that are one curve.
    pub interfaces: Vec<Interface>,
    /// Sides on the border.
    pub boundary: Vec<PatchSide>,
}

/// A side of a patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PatchSide {
    /// Number of the patch.
    pub patch: u32,
    /// 1 is u = 0, 2 the last u, 3 is v = 0, 4 the last v.
    pub side: u8,
}

/// Two sides that are one curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interface {
    /// The one before, by patch and by side counterclockwise from v = 0.
    pub first: PatchSide,
    /// The other.
    pub second: PatchSide,
    /// Whether the parameters along the sides run against each other.
    pub reversed: bool,
}

/// Patches of a surface whose cells have at most one irregular point each.
///
/// # Errors
/// See [`SplineError`].
pub fn patches(limit: &Limit<'_>) -> Result<Patches, SplineError> {
    let cage = limit.cage;
    let irregular = cage.irregular();
    let Blocks { blocks, sides } = blocks(cage, &irregular)?;
    let mut surfaces = parallel::map(&blocks, |_, block| {
        let corners = irregular_corners(cage, block, &irregular);
        let breaks = block.cells.map(breaks);
        surface(limit, block, corners, breaks)
    });
    join_corners(cage, &blocks, &mut surfaces);
    let mut patches = Patches {
        surfaces,
        interfaces: Vec::new(),
        boundary: Vec::new(),
    };
    for (b, sides) in sides.iter().enumerate() {
        for (s, pieces) in sides.iter().enumerate() {
            patches.put([b, s], pieces);
        }
    }
    Ok(patches)
}

/// Parameters between which a surface is one piece: every half of a cell.
fn breaks(cells: usize) -> Vec<f64> {
    (0..=2 * cells).map(|i| i as f64 / 2.0).collect()
}

/// Rectangles of cells whose sides meet whole sides.
///
/// # Errors
/// See [`SplineError::Blocks`].
pub(super) fn blocks(cage: &Cage, irregular: &[bool]) -> Result<Blocks, SplineError> {
    let squares = Squares {
        quads: &cage.cells,
        across: &cage.across,
    };
    let mut walls = cage.crease.clone();
    for (walls, corners) in walls.iter_mut().zip(&cage.cells) {
        let starts = corners.map(|v| irregular[v as usize]);
        (0..4).for_each(|k| walls[k] |= starts[k] || starts[(k + 1) % 4]);
    }
    let mut rules = Rules {
        starts: irregular.to_vec(),
        walls,
        are_kept: true,
    };
    loop {
        go_on(cage, irregular, &mut rules.walls);
        let found = squares.blocks(&rules)?;
        // Where lines were added these may end on walls, and go on; there are finitely many edges.
        let sides = |block: &Block| (0..4).flat_map(|s| side_of(block, s)).collect::<Vec<_>>();
        let mut has_more = false;
        for (q, k) in found.blocks.iter().flat_map(sides) {
            let wall = &mut rules.walls[q as usize][usize::from(k)];
            has_more |= !std::mem::replace(wall, true);
        }
        if !has_more {
            return Ok(found);
        }
    }
}

/// Makes every wall go straight on where it ends at a point that is not irregular.
fn go_on(cage: &Cage, irregular: &[bool], walls: &mut [[bool; 4]]) {
    let all = (0..walls.len() as u32).flat_map(|c| [0, 1, 2, 3].map(|k| (c, k)));
    let is_wall = |&(c, k): &CellSide| walls[c as usize][usize::from(k)];
    let mut running: Vec<CellSide> = all.filter(is_wall).collect();
    while let Some((c, k)) = running.pop() {
        let end = (k + 1) & 3;
        if irregular[cage.tail((c, end)) as usize] {
            continue;
        }
        // The side that leaves the end of this one opposite to it; walls end at the border.
        let across = cage.across[c as usize][usize::from(end)];
        let Some(next) = across.map(|(d, l)| (d, (l + 1) & 3)) else {
            continue;
        };
        if !std::mem::replace(&mut walls[next.0 as usize][usize::from(next.1)], true) {
            running.push(next);
            if let Some((d, l)) = cage.across[next.0 as usize][usize::from(next.1)] {
                walls[d as usize][usize::from(l)] = true;
            }
        }
    }
}

/// Of sides counterclockwise from v = 0, the numbers.
const NUMBER: [u8; 4] = [3, 2, 4, 1];

impl Patches {
    /// Enters what lies across side s of patch b, and gives both the same control points.
    fn put(&mut self, [b, s]: [usize; 2], pieces: &[Piece]) {
        let name = |b: usize, s: usize| PatchSide {
            patch: b as u32,
            side: NUMBER[s],
        };
        let Some((other, t, _)) = pieces.first().and_then(|piece| piece.across) else {
            self.boundary.push(name(b, s));
            return;
        };
        if (other, t) < (b, s) {
            return;
        }
        // Counterclockwise one runs against the other, and two of four sides run against their parameters.
        let reversed = (s < 2) == (t < 2);
        let mut points = self.surfaces[b].side(s).control;
        if reversed {
            points.reverse();
        }
        let surface = &mut self.surfaces[other];
        let [columns, rows] = surface.size();
        let (first, step) = match t {
            0 => (0, 1),
            1 => (columns - 1, columns),
            2 => (columns * (rows - 1), 1),
            _ => (0, columns),
        };
        for (i, point) in points.into_iter().enumerate() {
            surface.control[first + i * step] = point;
        }
        self.interfaces.push(Interface {
            first: name(b, s),
            second: name(other, t),
            reversed,
        });
    }
}
