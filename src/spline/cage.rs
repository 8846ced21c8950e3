//! Control meshes of Catmull–Clark surfaces: quads, what lies across their sides, creases and corners.
//!
//! *Guaranteed:* what is across a side of a cell has that cell across its own; sides on the border are creases; where more than two creases meet is a corner.

use super::error::SplineError;
use rustc_hash::FxHashMap;

/// A side of a cell: the cell, and the corner at which the side begins counterclockwise.
pub type CellSide = (u32, u8);

/// A control mesh without its points.
#[derive(Clone, Debug, PartialEq)]
pub struct Cage {
    /// Number of control points.
    pub vertices: usize,
    /// Corners of cells, counterclockwise.
    pub cells: Vec<[u32; 4]>,
    /// Across side k of a cell, from its corner k to the next; `None` on the border.
    pub across: Vec<[Option<CellSide>; 4]>,
    /// Whether a side is infinitely sharp; those on the border are.
    pub crease: Vec<[bool; 4]>,
    /// Control points that the surface passes through, sharp in every direction.
    pub is_corner: Vec<bool>,
}

/// What the surface is like at a control point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// No crease ends here.
    Smooth,
    /// One does.
    Dart,
    /// One goes through.
    Crease,
    /// The surface passes through it.
    Corner,
}

impl Cage {
    /// A control mesh of cells; `crease` says of a side whether it is one, and `is_corner` of a point, where these are not so anyway.
    ///
    /// # Errors
    /// Edges between more than two cells, cells that are turned against each other, and two edges with the same ends.
    pub fn new(
        vertices: usize,
        cells: Vec<[u32; 4]>,
        crease: impl Fn(CellSide) -> bool,
        is_corner: Vec<bool>,
    ) -> Result<Self, SplineError> {
        let across = across(vertices, &cells)?;
        let side = |at: CellSide| crease(at) || across[at.0 as usize][usize::from(at.1)].is_none();
        let crease = (0..cells.len() as u32)
            .map(|c| [0, 1, 2, 3].map(|k| side((c, k))))
            .collect();
        let mut cage = Self {
            vertices,
            cells,
            across,
            crease,
            is_corner,
        };
        for c in 0..cage.cells.len() {
            for k in 0..4 {
                // Both sides of an edge.
                if let Some((d, l)) = cage.across[c][k] {
                    let other = cage.crease[d as usize][usize::from(l)];
                    cage.crease[c][k] |= other;
                }
            }
        }
        for (corner, creases) in cage.is_corner.iter_mut().zip(creases(
            vertices,
            &cage.cells,
            &cage.across,
            &cage.crease,
        )) {
            *corner |= creases > 2;
        }
        Ok(cage)
    }

    /// The next side around the point that a side leaves, counterclockwise; `None` at the border.
    pub fn turn(&self, (c, k): CellSide) -> Option<CellSide> {
        self.across[c as usize][usize::from((k + 3) & 3)]
    }

    /// The one before, clockwise.
    pub fn turn_back(&self, (c, k): CellSide) -> Option<CellSide> {
        let (c, k) = self.across[c as usize][usize::from(k)]?;
        Some((c, (k + 1) & 3))
    }

    /// Where a side begins.
    pub fn tail(&self, (c, k): CellSide) -> u32 {
        self.cells[c as usize][usize::from(k & 3)]
    }

    /// Whether a side is a crease.
    pub fn is_crease(&self, (c, k): CellSide) -> bool {
        self.crease[c as usize][usize::from(k & 3)]
    }

    /// Sides that leave the point that one leaves, in order: at the border from the first on, inside from that one on.
    pub fn star(&self, side: CellSide) -> Vec<CellSide> {
        let mut first = side;
        while let Some(back) = self.turn_back(first) {
            first = back;
            if first == side {
                break;
            }
        }
        let mut star = vec![first];
        let mut at = first;
        while let Some(next) = self.turn(at).filter(|next| *next != first) {
            star.push(next);
            at = next;
        }
        star
    }

    /// One side that leaves each point; `None` of one without cells.
    pub fn leaving(&self) -> Vec<Option<CellSide>> {
        let mut leaving = vec![None; self.vertices];
        for (c, corners) in self.cells.iter().enumerate() {
            for (k, &v) in corners.iter().enumerate() {
                leaving[v as usize].get_or_insert((c as u32, k as u8));
            }
        }
        leaving
    }

    /// Creases that end at each point.
    pub fn creases(&self) -> Vec<u8> {
        creases(self.vertices, &self.cells, &self.across, &self.crease)
    }

    /// What the surface is like at each point.
    pub fn kinds(&self) -> Vec<Kind> {
        let creases = self.creases();
        let kind = |(&corner, creases): (&bool, &u8)| match (corner, creases) {
            (true, _) => Kind::Corner,
            (_, 0) => Kind::Smooth,
            (_, 1) => Kind::Dart,
            _ => Kind::Crease,
        };
        self.is_corner.iter().zip(&creases).map(kind).collect()
    }

    /// Of each point, whether the surface around it is not one of bicubic pieces.
    pub fn irregular(&self) -> Vec<bool> {
        let kinds = self.kinds();
        let leaving = self.leaving();
        let of = |(v, side): (usize, &Option<CellSide>)| {
            let Some(side) = *side else { return false };
            match kinds[v] {
                Kind::Smooth => self.star(side).len() != 4,
                Kind::Dart => true,
                kind => {
                    let wanted = if kind == Kind::Crease { 2 } else { 1 };
                    self.sectors(side).iter().any(|&cells| cells != wanted)
                }
            }
        };
        leaving.iter().enumerate().map(of).collect()
    }

    /// Numbers of cells between creases around the point that a side leaves.
    pub fn sectors(&self, side: CellSide) -> Vec<usize> {
        let mut star = self.star(side);
        let Some(first) = star.iter().position(|&s| self.is_crease(s)) else {
            return vec![star.len()];
        };
        star.rotate_left(first);
        let mut sectors = Vec::new();
        for side in star {
            match self.is_crease(side) {
                true => sectors.push(1),
                false => *sectors.last_mut().unwrap_or(&mut 0) += 1,
            }
        }
        sectors
    }

    /// Creases, not those on the border, at points where the limit surface has no tangent plane, folds, or comes near its tangent plane slowly: that ends at an irregular point; both with four cells or
    /// more between them; of more that meet with three cells or more between two, that with the fewest cells beside it.
    pub fn untidy_creases(&self) -> Vec<CellSide> {
        let creases = self.creases();
        let of = |(v, side): (usize, Option<CellSide>)| {
            let Some(side) = side.filter(|_| creases[v] > 0) else {
                return Vec::new();
            };
            let mut star = self.star(side);
            if self.turn_back(star[0]).is_some() {
                let first = star.iter().position(|&s| self.is_crease(s));
                star.rotate_left(first.unwrap_or(0));
            }
            let (sectors, cells) = (self.sectors(side), star.len());
            let most = sectors.iter().copied().max().unwrap_or(0);
            // The crease at which sector i begins.
            let begins = star.into_iter().filter(|&s| self.is_crease(s)).enumerate();
            let inner = begins.filter(|(_, s)| self.turn_back(*s).is_some());
            let before = |i: usize| sectors[(i + sectors.len() - 1) % sectors.len()];
            match creases[v] {
                1 if cells != 4 => inner.map(|(_, side)| side).collect(),
                2 if most > 3 => inner.map(|(_, side)| side).collect(),
                3.. if most > 2 => {
                    let least = inner.min_by_key(|&(i, _)| sectors[i] + before(i));
                    least.map(|(_, side)| side).into_iter().collect()
                }
                _ => Vec::new(),
            }
        };
        self.leaving()
            .into_iter()
            .enumerate()
            .flat_map(of)
            .collect()
    }

    /// Whether a point is one where creases turn so far that a smooth curve does not: around a single cell, which would have no area there, or on the border around four or more.
    pub fn turns(&self) -> Vec<bool> {
        let creases = self.creases();
        let of = |(v, side): (usize, Option<CellSide>)| {
            side.filter(|_| creases[v] == 2).is_some_and(|side| {
                let sectors = self.sectors(side);
                sectors.contains(&1) || (sectors.len() == 1 && sectors[0] > 3)
            })
        };
        self.leaving().into_iter().enumerate().map(of).collect()
    }

    /// Every edge once, as the first of its sides.
    pub fn edges(&self) -> impl Iterator<Item = CellSide> + '_ {
        let sides = (0..self.cells.len() as u32).flat_map(|c| (0..4).map(move |k| (c, k)));
        sides.filter(|&(c, k)| {
            self.across[c as usize][usize::from(k)].is_none_or(|other| (c, k) < other)
        })
    }

    /// Creases inside as chains of points, from corner to corner or end; a closed one repeats its first.
    pub fn chains(&self) -> Vec<Vec<u32>> {
        let kinds = self.kinds();
        let leaving = self.leaving();
        let mut is_done: Vec<[bool; 4]> = vec![[false; 4]; self.cells.len()];
        let mut begin: Vec<CellSide> = self.edges().filter(|&s| self.is_crease(s)).collect();
        let backward: Vec<CellSide> = begin
            .iter()
            .filter_map(|&(c, k)| self.across[c as usize][usize::from(k)])
            .collect();
        begin.extend(backward);
        let is_end = |side: &CellSide| kinds[self.tail(*side) as usize] != Kind::Crease;
        let (ends, circles): (Vec<_>, Vec<_>) = begin.into_iter().partition(is_end);
        let mut chains = Vec::new();
        for start in ends.into_iter().chain(circles) {
            if self.across[start.0 as usize][usize::from(start.1)].is_none()
                || is_done[start.0 as usize][usize::from(start.1)]
            {
                continue;
            }
            let mut chain = vec![self.tail(start)];
            let mut at = start;
            loop {
                is_done[at.0 as usize][usize::from(at.1)] = true;
                let Some(back) = self.across[at.0 as usize][usize::from(at.1)] else {
                    break;
                };
                is_done[back.0 as usize][usize::from(back.1)] = true;
                let end = self.tail(back);
                chain.push(end);
                if kinds[end as usize] != Kind::Crease {
                    break;
                }
                // The other crease there.
                let star = leaving[end as usize].map_or_else(Vec::new, |side| self.star(side));
                let next = star.into_iter().find(|&s| {
                    self.is_crease(s) && s != back && !is_done[s.0 as usize][usize::from(s.1)]
                });
                match next {
                    Some(side) => at = side,
                    None => break,
                }
            }
            chains.push(chain);
        }
        chains
    }
}

fn across(vertices: usize, cells: &[[u32; 4]]) -> Result<Vec<[Option<CellSide>; 4]>, SplineError> {
    let mut sides: FxHashMap<[u32; 2], CellSide> = FxHashMap::default();
    for (c, corners) in cells.iter().enumerate() {
        for k in 0..4 {
            let ends = [corners[k], corners[(k + 1) % 4]];
            if let Some(&v) = ends.iter().find(|&&v| v as usize >= vertices) {
                return Err(SplineError::Point {
                    cell: c,
                    point: v,
                    points: vertices,
                });
            }
            if ends[0] == ends[1] || sides.insert(ends, (c as u32, k as u8)).is_some() {
                return Err(SplineError::Edge { cell: c, ends });
            }
        }
    }
    let of = |corners: &[u32; 4]| {
        [0, 1, 2, 3].map(|k| sides.get(&[corners[(k + 1) % 4], corners[k]]).copied())
    };
    Ok(cells.iter().map(of).collect())
}

fn creases(
    vertices: usize,
    cells: &[[u32; 4]],
    across: &[[Option<CellSide>; 4]],
    crease: &[[bool; 4]],
) -> Vec<u8> {
    let mut counts = vec![0; vertices];
    for (c, corners) in cells.iter().enumerate() {
        for k in 0..4 {
            let is_first = across[c][k].is_none_or(|other| (c as u32, k as u8) < other);
            for v in [corners[k], corners[(k + 1) % 4]] {
                let count: &mut u8 = &mut counts[v as usize];
                *count = count.saturating_add(u8::from(is_first && crease[c][k]));
            }
        }
    }
    counts
}
