//! The limit surface as bicubic B-spline faces that share edges and vertices: what CAD programs take.
//!
//! *Enters:* a [`Limit`] surface. *Leaves:* a [`Shell`] of one face a block: rectangles of cells, of which every irregular point is a corner and no crease passes inside.
//!
//! A face is the limit surface to rounding, but in a last square at every irregular point, where it goes on as `tensor` says: knots at 1/2, 1/4, … 2⁻ᵈ of a cell come so near to such points that normals of both faces at an edge differ by less
//! than asked. Elsewhere they are the same, and points at edges are the same everywhere, to rounding. *Not guaranteed:* equal normals in those last squares, least of all at corners beside which several cells lie between creases, where the limit surface has no tangent plane; [`Jump`] says how far they are apart.

use super::cage::{Cage, CellSide, Kind};
use super::error::SplineError;
use super::limit::Limit;
use super::shell::{Edge, Face, Shell};
use super::surface::BSplineSurface;
use super::tensor::{Vertices, irregular_corners, join_corners, surface};
use crate::geometry::mesh::{cross, dot, norm};
use crate::grid::blocks::{Block, Rules, Squares, side_of};
use crate::parallel;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Halvings towards irregular points, at most.
pub const MOST_HALVINGS: u32 = 16;
/// With less the last square of a block of one cell would be all of it.
const LEAST_HALVINGS: u32 = 1;
/// Normals at the last eighth of irregular points may differ by so many times as much.
const ELSEWHERE: f64 = 5.0;
/// Places along an edge where normals of both faces are compared, a unit of cells.
const ALONG: usize = 8;

/// Faces, and what edges are.
#[derive(Clone, Debug)]
pub struct Faces {
    /// The shell.
    pub shell: Shell,
    /// Halvings towards irregular points.
    pub halvings: u32,
    /// Edges along creases.
    pub is_crease: Vec<bool>,
    /// What cells beside every edge touch, one a cell along it.
    pub beside: Vec<Vec<Beside>>,
}

/// What the two cells at a side touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beside {
    /// Regular points alone.
    Regular,
    /// An irregular point, or the end of a crease.
    Irregular,
    /// A corner, or a point with three cells or more between two creases.
    Corner,
}

/// How far normals turn across edges that are no creases, radians.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Jump {
    /// Mean over the places that were compared.
    pub mean: f64,
    /// 95 % are no larger.
    pub p95: f64,
    /// The largest.
    pub max: f64,
}

/// Rectangles of cells for faces.
///
/// # Errors
/// None of a control mesh whose cells have at most one irregular point.
pub(super) fn blocks(cage: &Cage, irregular: &[bool]) -> Result<Vec<Block>, SplineError> {
    let rules = Rules {
        starts: irregular.to_vec(),
        walls: cage.crease.clone(),
        are_kept: true,
    };
    let squares = Squares {
        quads: &cage.cells,
        across: &cage.across,
    };
    Ok(squares.blocks(&rules)?.blocks)
}

/// Parameters of a side of a block between which its surface is one piece; `graded` says which ends have halvings.
fn breaks(cells: usize, graded: [bool; 2], halvings: u32) -> Vec<f64> {
    let mut breaks = Vec::new();
    let last = cells as f64;
    let grading = (1..=halvings).rev().map(|d| 0.5f64.powi(d as i32));
    if graded[0] {
        breaks.extend(grading.clone());
    }
    breaks.extend((0..=cells).map(|i| i as f64));
    if graded[1] {
        breaks.extend(grading.map(|x| last - x));
    }
    breaks.sort_by(f64::total_cmp);
    breaks.dedup();
    breaks
}

/// The surface of a block with knots towards its irregular corners.
fn face(limit: &Limit<'_>, block: &Block, irregular: [bool; 4], halvings: u32) -> BSplineSurface {
    // Irregular corners are at the bottom left, bottom right, top right, top left.
    let [a, b, c, d] = irregular;
    let [w, h] = block.cells;
    let across = breaks(w, [a || d, b || c], halvings);
    let up = breaks(h, [a || b, c || d], halvings);
    surface(limit, block, irregular, [across, up])
}

/// Halvings after which normals at seven of eight irregular points differ by less than `angle`, radians, and at all others by less than [`ELSEWHERE`] times that; [`MOST_HALVINGS`] where there are none.
fn halvings(limit: &Limit<'_>, irregular: &[bool], angle: f64) -> u32 {
    let (leaving, kinds) = (limit.cage.leaving(), limit.cage.kinds());
    // At corners the surface is sharp, however small the square.
    let is_met = |v: &usize| irregular[*v] && kinds[*v] != Kind::Corner;
    let points = (0..irregular.len()).filter(is_met);
    let points: Vec<CellSide> = points.filter_map(|v| leaving[v]).collect();
    let mut needed = parallel::map(&points, |_, &side| {
        let mut needed = [MOST_HALVINGS; 2];
        for d in LEAST_HALVINGS..MOST_HALVINGS {
            let jump = jump_at(limit, side, d);
            for (needed, most) in needed.iter_mut().zip([angle, ELSEWHERE * angle]) {
                if jump < most {
                    *needed = d.min(*needed);
                }
            }
            if jump < angle {
                break;
            }
        }
        needed
    });
    needed.sort_unstable();
    let most = needed.iter().map(|n| n[1]).max().unwrap_or(LEAST_HALVINGS);
    let usual = needed
        .len()
        .checked_sub(1)
        .map(|last| needed[last * 7 / 8][0]);
    most.max(usual.unwrap_or(LEAST_HALVINGS))
}

/// The largest angle between normals across edges at an irregular point.
fn jump_at(limit: &Limit<'_>, side: CellSide, halvings: u32) -> f64 {
    let cage = limit.cage;
    let star = cage.star(side);
    let corner = |&(q, k): &CellSide| {
        let block = Block {
            cells: [1, 1],
            squares: vec![(q, k)],
        };
        face(limit, &block, [true, false, false, false], halvings)
    };
    let surfaces: Vec<BSplineSurface> = star.iter().map(corner).collect();
    let last = 0.5f64.powi(halvings as i32);
    let mut largest = 0.0f64;
    for (n, &side) in star.iter().enumerate() {
        // Its side 0 is the one before's left side.
        let Some(before) = cage.turn_back(side).filter(|_| !cage.is_crease(side)) else {
            continue;
        };
        let Some(other) = star.iter().position(|&s| s == before) else {
            continue;
        };
        for i in 0..=ALONG {
            let t = last * i as f64 / ALONG as f64;
            let normals = [surfaces[n].at([t, 0.0]), surfaces[other].at([0.0, t])]
                .map(|jet| cross(jet.tangent[0], jet.tangent[1]));
            largest = largest.max(angle(normals));
        }
    }
    largest
}

fn angle([a, b]: [[f64; 3]; 2]) -> f64 {
    norm(cross(a, b)).atan2(dot(a, b))
}

/// Faces of a surface whose cells have at most one irregular point each.
///
/// # Errors
/// See [`SplineError`].
pub fn faces(limit: &Limit<'_>, most_jump: f64) -> Result<Faces, SplineError> {
    let cage = limit.cage;
    let irregular = cage.irregular();
    let halvings = halvings(limit, &irregular, most_jump);
    let blocks = blocks(cage, &irregular)?;
    let face = |block: &Block| {
        let corners = irregular_corners(cage, block, &irregular);
        face(limit, block, corners, halvings)
    };
    let surfaces = parallel::map(&blocks, |_, block| face(block));
    Ok(joined(cage, &irregular, &blocks, surfaces, halvings))
}

/// Makes surfaces a shell.
fn joined(
    cage: &Cage,
    irregular: &[bool],
    blocks: &[Block],
    mut surfaces: Vec<BSplineSurface>,
    halvings: u32,
) -> Faces {
    let Vertices {
        points: vertices,
        at: vertex,
    } = join_corners(cage, blocks, &mut surfaces);
    let kinds = cage.kinds();
    // There the limit surface has no tangent plane, or comes near it slowly.
    let sectors = cage
        .leaving()
        .into_iter()
        .map(|side| side.map_or_else(Vec::new, |s| cage.sectors(s)));
    let is_wide: Vec<bool> = sectors
        .map(|sectors| sectors.iter().any(|&cells| cells > 2))
        .collect();
    let touched = |(c, k): CellSide| {
        let across = cage.across[c as usize][usize::from(k)];
        let cells = [Some(c), across.map(|other| other.0)];
        let mut points = cells
            .into_iter()
            .flatten()
            .flat_map(|c| cage.cells[c as usize]);
        let of = |v: u32| match (kinds[v as usize], irregular[v as usize]) {
            (Kind::Corner, _) => Beside::Corner,
            (Kind::Crease, true) if is_wide[v as usize] => Beside::Corner,
            (_, true) => Beside::Irregular,
            _ => Beside::Regular,
        };
        points
            .try_fold(Beside::Regular, |worst, v| match (of(v), worst) {
                (Beside::Corner, _) => Err(Beside::Corner),
                (Beside::Irregular, _) => Ok(Beside::Irregular),
                _ => Ok(worst),
            })
            .unwrap_or_else(|corner| corner)
    };
    let mut known: FxHashMap<CellSide, u32> = FxHashMap::default();
    let (mut edges, mut is_crease, mut beside) = (Vec::new(), Vec::new(), Vec::new());
    let mut faces = Vec::new();
    let mut is_closed = true;
    for (block, surface) in blocks.iter().zip(surfaces) {
        let (mut border, mut places) = (Vec::new(), Vec::new());
        let [w, h] = block.cells.map(|cells| cells as f64);
        for s in 0..4 {
            let side = side_of(block, s);
            let curve = surface.side(s);
            let length = side.len();
            // Counterclockwise the upper and the left side run against their parameters.
            let parameter = |i: usize| if s < 2 { i as f64 } else { (length - i) as f64 };
            let end = |i: usize| match i == length {
                true => cage.tail((side[i - 1].0, side[i - 1].1 + 1)),
                false => cage.tail(side[i]),
            };
            let mut begin = 0;
            for i in 1..=length {
                let Some(last) = vertex[end(i) as usize] else {
                    continue;
                };
                let first = side[begin];
                let range = [parameter(begin), parameter(i)];
                // Met from the other side its last step is the first.
                let across = cage.across[side[i - 1].0 as usize][usize::from(side[i - 1].1)];
                is_closed &= across.is_some();
                let edge = match across.and_then(|other| known.get(&other)) {
                    Some(&edge) => (edge, false),
                    None => {
                        let ends = [vertex[end(begin) as usize].unwrap_or(last), last];
                        let mut curve = curve.part(range);
                        let count = curve.control.len();
                        curve.control[0] = vertices[ends[0] as usize];
                        curve.control[count - 1] = vertices[ends[1] as usize];
                        known.insert(first, edges.len() as u32);
                        is_crease.push(cage.is_crease(first));
                        beside.push(side[begin..i].iter().map(|&s| touched(s)).collect());
                        edges.push(Edge { ends, curve });
                        (edges.len() as u32 - 1, true)
                    }
                };
                border.push(edge);
                places.push(range.map(|along| match s {
                    0 => [along, 0.0],
                    1 => [w, along],
                    2 => [along, h],
                    _ => [0.0, along],
                }));
                begin = i;
            }
        }
        faces.push(Face {
            surface,
            border,
            places,
        });
    }
    Faces {
        shell: Shell {
            vertices,
            edges,
            faces,
            is_closed,
        },
        halvings,
        is_crease,
        beside,
    }
}

impl Jump {
    fn of(mut angles: Vec<f64>) -> Self {
        angles.sort_by(f64::total_cmp);
        let count = angles.len();
        let Some(&max) = angles.last() else {
            return Self::default();
        };
        Self {
            mean: angles.iter().sum::<f64>() / count as f64,
            p95: angles[(count - 1) * 95 / 100],
            max,
        }
    }
}

impl Faces {
    /// How far normals turn across edges that are no creases: beside regular cells, irregular points and corners.
    pub fn jumps(&self) -> [Jump; 3] {
        let mut sides: Vec<Vec<(usize, usize)>> = vec![Vec::new(); self.shell.edges.len()];
        for (f, face) in self.shell.faces.iter().enumerate() {
            for (i, &(edge, _)) in face.border.iter().enumerate() {
                sides[edge as usize].push((f, i));
            }
        }
        let inner = sides.par_iter().enumerate();
        let inner = inner.filter(|&(edge, _)| !self.is_crease[edge]);
        let angles: Vec<(Beside, f64)> = inner
            .flat_map_iter(|(edge, sides)| match sides[..] {
                [a, b] => self.angles(&self.beside[edge], a, b),
                _ => Vec::new(),
            })
            .collect();
        [Beside::Regular, Beside::Irregular, Beside::Corner].map(|beside| {
            let own = angles.iter().filter(|(at, _)| *at == beside);
            Jump::of(own.map(|(_, angle)| *angle).collect())
        })
    }

    /// Angles along an edge, which is border edge i of a face, and of another: evenly over its length, and where both faces have their last squares.
    fn angles(
        &self,
        beside: &[Beside],
        a: (usize, usize),
        b: (usize, usize),
    ) -> Vec<(Beside, f64)> {
        let cells = beside.len() as f64;
        let steps = ALONG * beside.len();
        let last = 0.5f64.powi(self.halvings as i32) / cells;
        let even = (0..=steps).map(|i| i as f64 / steps as f64);
        let near = (0..ALONG).map(|i| last * i as f64 / ALONG as f64);
        let all = even.chain(near.clone()).chain(near.map(|t| 1.0 - t));
        all.map(|t| {
            // At the end of a cell the worse one.
            let cell = |t: f64| ((t * cells) as usize).min(beside.len() - 1);
            let (one, other) = (beside[cell(t - 1e-9)], beside[cell(t + 1e-9)]);
            let worse = if one == Beside::Regular || other == Beside::Corner {
                other
            } else {
                one
            };
            (worse, angle([self.normal(a, t), self.normal(b, 1.0 - t)]))
        })
        .collect()
    }

    fn normal(&self, (f, i): (usize, usize), t: f64) -> [f64; 3] {
        let face = &self.shell.faces[f];
        let [from, to] = face.places[i];
        let at = [0, 1].map(|axis| from[axis] + t * (to[axis] - from[axis]));
        let jet = face.surface.at(at);
        cross(jet.tangent[0], jet.tangent[1])
    }
}
