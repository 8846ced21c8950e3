//! Which side of which rectangle meets which, from the seams alone.
//!
//! *Enters:* the lattices of rectangles and the seams between them. *Leaves:* [`Neighbours`]. *Guaranteed:* every side of every
//! rectangle is in exactly one interface or on the boundary, whole sides meet whole sides of as many samples, and corners that
//! the interfaces join have one number. *Not guaranteed:* that the images hold equal points there.
//!
//! A seam may run around a corner where only two rectangles meet, and a closed one may begin in the middle of a side, so sides are found
//! edge by edge of the seams.

use super::error::FitError;
use super::surface::Side;
use crate::atlas::patches::Seam;
use crate::geometry::disjoint_sets::UnionFind;
use crate::rebuild::RebuildError;

/// Part of a rectangle by which a sample of a seam may lie beside its side, and by which a side may be covered wrongly.
const SIDE_TOLERANCE: f64 = 1e-6;

/// A side of a rectangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PatchSide {
    /// Patch.
    pub patch: usize,
    /// Which of its sides.
    pub side: Side,
}

/// Two sides that are one curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Interface {
    /// The lesser one.
    pub first: PatchSide,
    /// The other.
    pub second: PatchSide,
    /// Whether their parameters run against each other.
    pub reversed: bool,
}

/// How rectangles lie side by side.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Neighbours {
    /// In the order of their first sides.
    pub interfaces: Vec<Interface>,
    /// Sides on the boundary of the surface.
    pub boundary: Vec<PatchSide>,
    /// Number of the point at each corner of each patch.
    pub corner: Vec<[usize; 4]>,
    /// How many such points there are.
    pub corners: usize,
}

/// Size of an image and the rectangle it covers, which begins at the origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// Columns and rows.
    pub samples: [usize; 2],
    /// Width and height in patch coordinates.
    pub extent: [f64; 2],
}

/// What is known of a side while the seams are read.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    /// The side across, once known; the inner one is missing at the boundary.
    across: Option<Option<PatchSide>>,
    /// Length that was covered, in sides.
    covered: f64,
    /// Way of the side across while this one was walked from 0 to 1: 1 or −1 when all is covered.
    way: f64,
}

/// Reads the seams.
///
/// # Errors
/// Seams that do not lie on sides, or sides that do not meet whole.
pub fn neighbours(lattices: &[Lattice], seams: &[Seam]) -> Result<Neighbours, FitError> {
    let mut found = vec![[Found::default(); 4]; lattices.len()];
    let borders = seams.iter().enumerate();
    for (id, seam) in borders.filter(|(_, seam)| !seam.is_inner()) {
        for pair in seam.samples.windows(2) {
            let left = on_side(
                lattices,
                id,
                seam.left.index(),
                [pair[0].left, pair[1].left],
            )?;
            let uv = [pair[0].right, pair[1].right];
            let right = match seam.right {
                Some(patch) => on_side(lattices, id, patch.index(), uv)?,
                None => None,
            };
            if let Some((side, way)) = left {
                meet(&mut found, side, way, across(seam.right.is_none(), right))?;
            }
            if let Some((side, way)) = right {
                meet(&mut found, side, way, across(false, left))?;
            }
        }
    }
    let mut sets = UnionFind::new(4 * lattices.len());
    let (mut interfaces, mut boundary) = (Vec::new(), Vec::new());
    for (patch, sides) in found.iter().enumerate() {
        for (side, &found) in Side::ALL.into_iter().zip(sides) {
            let own = PatchSide { patch, side };
            let Found {
                across,
                covered,
                way,
            } = found;
            let whole = |x: f64| (x.abs() - 1.0).abs() <= SIDE_TOLERANCE;
            let across = across.ok_or(FitError::NoSeam { side: own })?;
            if across == Some(own) {
                return Err(FitError::Folded { side: own });
            }
            if !whole(covered) || across.is_some() && !whole(way) {
                return Err(FitError::NotWhole { side: own, covered });
            }
            let Some(other) = across else {
                boundary.push(own);
                continue;
            };
            let count = |s: PatchSide| lattices[s.patch].samples[s.side.along()];
            if count(own) != count(other) {
                return Err(FitError::Counts {
                    sides: [own, other],
                    samples: [count(own), count(other)],
                });
            }
            if other < own {
                continue;
            }
            let reversed = way < 0.0;
            let corner = |s: PatchSide| s.side.corners().map(|k| 4 * s.patch + k);
            let ([a, b], [mut c, mut d]) = (corner(own), corner(other));
            if reversed {
                std::mem::swap(&mut c, &mut d);
            }
            sets.join(a, c);
            sets.join(b, d);
            interfaces.push(Interface {
                first: own,
                second: other,
                reversed,
            });
        }
    }
    let mut number = vec![usize::MAX; 4 * lattices.len()];
    let mut corners = 0;
    let corner = (0..lattices.len())
        .map(|patch| {
            [0, 1, 2, 3].map(|k| {
                // Sets are called by their least member, which comes first.
                let name = sets.find(4 * patch + k);
                if number[name] == usize::MAX {
                    number[name] = corners;
                    corners += 1;
                }
                number[name]
            })
        })
        .collect();
    Ok(Neighbours {
        interfaces,
        boundary,
        corner,
        corners,
    })
}

/// An edge of a side: which, and its ends along it.
type Edge = (PatchSide, [f64; 2]);

/// What lies across an edge.
#[derive(Clone, Copy, Debug)]
enum Across {
    Boundary,
    Side(Edge),
    /// The edge is so short there that it has no direction, and could be on either side of a corner.
    Corner,
}

fn across(is_boundary: bool, edge: Option<Edge>) -> Across {
    match edge {
        Some(edge) => Across::Side(edge),
        None if is_boundary => Across::Boundary,
        None => Across::Corner,
    }
}

/// The side on which an edge of a seam lies, and its ends along it; nothing where the edge has no length there.
fn on_side(
    lattices: &[Lattice],
    seam: usize,
    patch: usize,
    uv: [[f64; 2]; 2],
) -> Result<Option<Edge>, FitError> {
    let Some(lattice) = lattices.get(patch) else {
        return Err(FitError::Seams(RebuildError::SeamPatch {
            seam,
            patch,
            patches: lattices.len(),
        }));
    };
    let ends = uv.map(|p| [p[0] / lattice.extent[0], p[1] / lattice.extent[1]]);
    let along = |side: Side| ends.map(|p| p[side.along()]);
    let beside = |side: Side| {
        let line = side.at(0.0)[1 - side.along()];
        let off = ends.map(|p| (p[1 - side.along()] - line).abs());
        off[0].max(off[1])
    };
    let mut best = Side::West;
    for side in Side::ALL {
        // Near a corner an edge may be near two sides; it runs along one of them.
        let length = |side: Side| (along(side)[1] - along(side)[0]).abs();
        let order = beside(side).total_cmp(&beside(best));
        if order.then(length(best).total_cmp(&length(side))).is_lt() {
            best = side;
        }
    }
    let is_finite = ends.as_flattened().iter().all(|x| x.is_finite());
    if !is_finite || beside(best) > SIDE_TOLERANCE {
        return Err(FitError::NotOnSide {
            seam,
            patch,
            at: ends[0],
        });
    }
    let [from, to] = along(best);
    let side = PatchSide { patch, side: best };
    Ok((from != to).then_some((side, [from, to])))
}

/// Notes an edge of a side and what lies across it.
fn meet(
    found: &mut [[Found; 4]],
    own: PatchSide,
    [from, to]: [f64; 2],
    across: Across,
) -> Result<(), FitError> {
    let entry = &mut found[own.patch][own.side as usize];
    entry.covered += (to - from).abs();
    let side = match across {
        Across::Corner => return Ok(()),
        Across::Boundary => None,
        Across::Side((side, [start, end])) => {
            entry.way += (end - start) * (to - from).signum();
            Some(side)
        }
    };
    match entry.across {
        Some(before) if before != side => Err(FitError::TwoNeighbours {
            side: own,
            across: [before, side],
        }),
        _ => {
            entry.across = Some(side);
            Ok(())
        }
    }
}
