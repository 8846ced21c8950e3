//! Why an atlas that was built did not pass its checks, where float64 is too coarse for it.
//!
//! *Enters:* the checks that failed, the atlas, and the file it was made from. *Leaves:* the most striking figure of what 16 digits do not hold,
//! with what to change: faces too thin for their lengths to tell their angles, faces too small beside the mesh for coordinates, scales too far
//! apart, or slivers where two triangulations cross; nothing where the surface has none of them, so that the fault is not in the mesh.
//!
//! It only words a refusal. Whether there is one, the checks decide: many meshes with such faces are built.

use super::checks::{failed_of, listed};
use crate::atlas::develop::diameter;
use crate::geometry::ids::FaceId;
use crate::geometry::mesh::{Soup, bounding_box, distance, triangle_area};
use crate::geometry::triangle::area;
use crate::product::AffineAtlas;
use crate::verify::Verdicts;

/// Faces this thin (height by longest side) have angles that lengths with 16 digits do not tell: they differ by the square of it where the
/// face is obtuse, and by it times 1e-16 where a side is short, and the errors of several faces add up.
const THIN: f64 = 1e-7;

/// Faces this small, as a part of the mesh or of the chart, have coordinates of less than four digits.
const SMALL: f64 = 1e-12;

/// Faces of the refined surface this thin, in the flat metric, blur the angles at their corners as those of [`THIN`] do, since their lengths are
/// differences of those of larger faces.
const SLIVER: f64 = 1e-6;

/// Log scales this far apart leave the smallest parts of the atlas less than eight digits beside the largest.
const APART: f64 = 18.0;

/// Faces this small, as a part of the chart, have sides that its coordinates hold with eight digits at the most, less what laying out all the
/// faces between has added up to.
const TINY: f64 = 1e-8;

/// An atlas that float64 does not hold.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "float64 does not hold this atlas, which did not pass {failed} of its {checks} checks ({listed}): {cause}"
)]
pub struct Precision {
    /// How many checks failed.
    pub failed: usize,
    /// How many there were.
    pub checks: usize,
    /// The first of those that failed, with their figures.
    pub listed: String,
    /// What is too thin, too small or too far apart.
    pub cause: Cause,
}

/// What of a surface is beyond float64.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum Cause {
    /// The mesh has faces without width.
    #[error(
        "face {face} of the mesh is only {width:.1e} times as wide as long, and {faces} are below {THIN:.0e}, where lengths with 16 digits no longer tell the angles of a face; collapse the short edges and flip the long ones of such faces, or make the mesh anew (isotropic remeshing)"
    )]
    Thin {
        /// The thinnest face of the file.
        face: u32,
        /// Its height by its longest side.
        width: f64,
        /// How many are too thin.
        faces: usize,
    },
    /// The mesh has faces of very different sizes.
    #[error(
        "face {face} of the mesh has {size:.1e} of its size, and {faces} are below {SMALL:.0e}, where coordinates with 16 digits have few left for a face; remove such small parts, or make a mesh of them alone"
    )]
    Small {
        /// The smallest face of the file.
        face: u32,
        /// Its longest side by the diagonal of the mesh.
        size: f64,
        /// How many are too small.
        faces: usize,
    },
    /// The mesh and the triangulation of its flat metric cross so that slivers are left.
    #[error(
        "the flat triangulation is far from the mesh's own, and where they cross slivers are left, in face {face} of the mesh one only {width:.1e} times as wide as long, and {faces} are below {SLIVER:.0e}, where errors of rounding add up; ask for more or weaker cones, which change the triangulation less, or divide long thin faces of the mesh"
    )]
    Sliver {
        /// Face of the file in which the thinnest sliver lies.
        face: u32,
        /// Its height by its longest side, in the flat metric.
        width: f64,
        /// How many are too thin.
        faces: usize,
    },
    /// The flat metric has scales too far apart.
    #[error(
        "the flat metric scales lengths by factors e^{range:.0} apart, so that parts of it are too small for coordinates with 16 digits (its smallest face, in face {face} of the mesh, has {size:.1e} of the chart's size); ask for other or more cones (`affine-atlas cones` shows what they gain): a long thin part needs cones of 2π together at each end (cones.list), and noise or spikes are better smoothed away"
    )]
    Apart {
        /// Greatest less least log scale.
        range: f64,
        /// Face of the file in which the smallest face of the chart lies.
        face: u32,
        /// Longest side of that by the diagonal of the chart.
        size: f64,
    },
}

impl Cause {
    fn is_tiny(&self) -> bool {
        matches!(self, Cause::Apart { size, .. } if *size < TINY)
    }
}

impl Precision {
    /// What float64 does not hold of an atlas that fails these checks; `None` where nothing is beyond it.
    pub(super) fn of(verdicts: &Verdicts, atlas: &AffineAtlas, soup: &Soup) -> Option<Self> {
        let cause = thin(atlas, soup)
            .or_else(|| small(atlas, soup))
            .or_else(|| apart(atlas, APART))
            .or_else(|| sliver(atlas))
            .or_else(|| apart(atlas, 0.0).filter(Cause::is_tiny))?;
        let failed = failed_of(verdicts);
        Some(Self {
            failed: failed.len(),
            checks: verdicts.checks.len(),
            listed: listed(&failed),
            cause,
        })
    }
}

/// The faces of the file that the atlas has, with their corners.
fn faces<'a>(
    atlas: &'a AffineAtlas,
    soup: &'a Soup,
) -> impl Iterator<Item = (u32, [[f64; 3]; 3])> + 'a {
    let mut numbers: Vec<u32> = atlas.mesh.source_face.iter().copied().collect();
    numbers.sort_unstable();
    numbers.dedup();
    numbers.into_iter().filter_map(|number| {
        let face = soup.faces.get(number as usize)?;
        let corner = |v: u32| soup.positions.get(v as usize).copied();
        Some((
            number,
            [corner(face[0])?, corner(face[1])?, corner(face[2])?],
        ))
    })
}

fn longest(p: [[f64; 3]; 3]) -> f64 {
    (0..3).fold(0.0, |most: f64, k| most.max(distance(p[k], p[(k + 1) % 3])))
}

/// The face with the least figure, and how many have one below the bound.
fn least(figures: impl Iterator<Item = (u32, f64)>, bound: f64) -> Option<(u32, f64, usize)> {
    let below = figures.filter(|figure| figure.1 < bound);
    below.fold(None, |least, (face, figure)| match least {
        Some((_, smallest, count)) if smallest <= figure => {
            least.map(|(face, figure, _)| (face, figure, count + 1))
        }
        _ => Some((face, figure, least.map_or(1, |least| least.2 + 1))),
    })
}

fn thin(atlas: &AffineAtlas, soup: &Soup) -> Option<Cause> {
    let width = |p: [[f64; 3]; 3]| {
        let longest = longest(p);
        // Of a face as long as 1, whose square is a number.
        2.0 * triangle_area(p.map(|corner| [0, 1, 2].map(|i| (corner[i] - p[0][i]) / longest)))
    };
    let widths = faces(atlas, soup).map(|(face, p)| (face, width(p)));
    let (face, width, faces) = least(widths, THIN)?;
    Some(Cause::Thin { face, width, faces })
}

fn small(atlas: &AffineAtlas, soup: &Soup) -> Option<Cause> {
    let (low, high) = bounding_box(atlas.mesh.positions.as_slice());
    let whole = distance(low, high);
    let sizes = faces(atlas, soup).map(|(face, p)| (face, longest(p) / whole));
    let (face, size, faces) = least(sizes, SMALL)?;
    Some(Cause::Small { face, size, faces })
}

fn sliver(atlas: &AffineAtlas) -> Option<Cause> {
    let c = &atlas.mesh.connectivity;
    let width = |f: FaceId| {
        // Lengths are opposite corners, edges begin at them.
        let [a, b, d] = c.face_halfedges(f).map(|h| atlas.metric.length[c.edge(h)]);
        let longest = a.max(b).max(d);
        let area = area([b, d, a].map(|l| l / longest)).unwrap_or(0.0);
        (atlas.mesh.source_face[f], 2.0 * area)
    };
    let (face, width, faces) = least(c.faces().map(width), SLIVER)?;
    Some(Cause::Sliver { face, width, faces })
}

fn apart(atlas: &AffineAtlas, bound: f64) -> Option<Cause> {
    let scales = atlas.metric.log_scale.iter();
    let (low, high) = scales.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &u| {
        (low.min(u), high.max(u))
    });
    let range = high - low;
    let uv = &atlas.central.uv;
    let whole = diameter(uv.iter().flatten().copied());
    let sizes = uv
        .iter()
        .zip(atlas.mesh.source_face.iter())
        .map(|(corners, &face)| (face, diameter(corners.iter().copied()) / whole));
    let (face, size, _) = least(sizes, f64::INFINITY)?;
    (range > bound).then_some(Cause::Apart { range, face, size })
}
