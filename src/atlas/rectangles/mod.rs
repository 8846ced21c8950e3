//! Rectangles: four-sided patches that the flow itself maps to rectangles, in place of flat ones (`images.domain = "rectangle"`).
//!
//! *Enters:* a surface with its charts, and its flat patches. *Leaves:* the same surface on finer faces, and a [`PatchLayout`] of
//! rectangles: each is sampled corner to corner, a full grid without a mask.
//!
//! ```text
//! clusters of faces → sides and nodes → short sides contracted, walls drawn anew → sides halved until all are even → lines between corners: quads → walls drawn anew
//! → Ricci flow of each → common parameter of walls → maps spread by stretch and bend → rectangles glued → charts carried over → numbers of samples
//! ```
//!
//! What decides about the images is where the walls are. All rectangles have about as many samples, since strips of them wander over the whole surface; so clusters are to be equally hard (`clusters`), and
//! few, since samples on shared sides lie in two images. A cluster mostly has six sides, and one line makes two quads of it (`parity`, `quadrangulate`); short sides go (`contract`), walls meet at even
//! angles (`relax`). Several numbers of clusters are tried, and the one whose images miss least is taken (`candidate`). Where some make rectangles too crowded for float64, the flat patches are divided as well: what has n sides
//! becomes n quads around a centre (`quads`), patches with many or hidden corners are divided first (`division`), and those that would hold the surface worst for their texels (`sizes`).
//!
//! Each quad is flattened by the same flow that made the cone metric, with π/2 at its four corners and nothing else (`flow`); its aspect ratio is its modulus,
//! which cannot be chosen. The two conformal maps on both sides of a wall stretch it differently, and crowd it at corners: its parameter is its length in
//! space, more where the surface bends (`density`, `walls`), and each quad is mapped to its rectangle with the border so given, harmonically at first and then so that no part is
//! stretched much more than it is to be (`place`, on faces that lie in those of the flow: `diagonals`). The final triangulation of a quad is not that of the surface, so the surface is refined once more, and what is linear on its
//! faces is carried over (`lift`). How the images of even texels bend says how many samples every strip of sides gets (`texels`, `counts`).
//!
//! Rectangles know nothing of the cut: one may lie across it, with the same coordinates on both sides.
//!
//! *Guaranteed:* patches are injective, as harmonic maps to convex shapes are; every side of a rectangle is a whole side of its
//! neighbour, corner to corner, with as many samples (`counts`), and sample i of n from one corner is the same point for both, to the
//! last bit in the images. Spline patches fitted to two images can so share the control points of their common border.
//! *Not guaranteed:* conformal maps; smoothness across walls; a bound for the stretch inside a rectangle; the budget, where the least numbers of samples use more.
//!
//! The tutorial shows rectangles for disks only (Fig. 10 and 18, four corners of π/2); quads by joining centres to middles are
//! E. Catmull, J. Clark, *Recursively generated B-spline surfaces on arbitrary topological meshes* (1978).

mod candidate;
mod chord;
mod clusters;
mod contract;
mod counts;
mod density;
mod diagonals;
mod disk;
mod division;
mod flow;
mod glue;
mod harmonic;
mod parity;
mod place;
mod quadrangulate;
mod quads;
mod relax;
mod sides;
mod sizes;
mod walls;

#[cfg(test)]
mod tests;

use crate::atlas::charted::Charted;
use crate::atlas::overlay::OverlayError;
use crate::atlas::patches::{PatchLayout, PatchParams};
use crate::flow::ricci::FlowError;
use crate::flow::solve::SolveError;
use crate::geometry::connectivity::ConnectivityError;
use crate::geometry::mesh::Mesh;
use candidate::Candidate;
use rayon::prelude::*;

/// Clusters that are tried, as many as the budget and the faces allow. What is best among them is chance for the most part: PSNR differs by up to 3 dB.
const CLUSTERS: [usize; 4] = [50, 60, 70, 80];
/// Texels that a cluster is to have at least, on the mean: it becomes about two rectangles, of eight by eight.
const LEAST_TEXELS: usize = 136;
/// Faces that a cluster is to have at least, on the mean.
const LEAST_FACES: usize = 12;

/// Most pieces of a face that the flat triangulation leaves, on the mean: ordinary meshes have two or three.
const MOST_PIECES: usize = 16;
/// So many more are allowed, whatever the number of faces.
const ALLOWED_PIECES: usize = 60_000;

/// Why there are no rectangles.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RectangleError {
    /// A patch, or a part of one, is no disk.
    #[error(
        "patch {patch} has Euler characteristic {euler_characteristic} and {border_loops} borders, but a disk has 1 and 1: please report this mesh"
    )]
    NotADisk {
        /// The flat patch.
        patch: usize,
        /// χ of it.
        euler_characteristic: i64,
        /// Its borders.
        border_loops: usize,
    },
    /// Something that holds for every mesh does not.
    #[error(
        "{what} do not fit together: please report this mesh, and use images.domain = \"flat\" meanwhile"
    )]
    Inconsistent {
        /// What was looked at.
        what: &'static str,
    },
    /// The flow of a quad found no metric.
    #[error(
        "rectangle {quad} could not be flattened; use images.domain = \"flat\", or more cones, which make patches simpler: {error}"
    )]
    Flow {
        /// Number of the quad.
        quad: usize,
        /// What the flow said.
        error: FlowError,
    },
    /// A flattened quad is no rectangle.
    #[error(
        "rectangle {quad} has opposite sides that differ by {difference:e} of its width, more than {bound:e}; use images.domain = \"flat\", or more cones, which make patches simpler"
    )]
    Unequal {
        /// Number of the quad.
        quad: usize,
        /// Difference of opposite sides, in widths.
        difference: f64,
        /// What is allowed.
        bound: f64,
    },
    /// A map to a rectangle is not one to one.
    #[error(
        "rectangle {quad} has {folded} of {faces} faces turned over, since it is more crowded than float64 can tell; use images.domain = \"flat\", or more cones, which make patches simpler"
    )]
    Folded {
        /// Number of the quad.
        quad: usize,
        /// Faces that are turned over.
        folded: usize,
        /// Faces of the rectangle.
        faces: usize,
    },
    /// The flat triangulation, or lines between rectangles, cross faces far more often than their number makes believe.
    #[error(
        "the {faces} faces of this surface would be cut into {pieces} pieces or more (most: {most}), since very many long thin faces lie side by side; use images.domain = \"flat\", or divide the long faces, or remesh the surface with faces of similar sides"
    )]
    TooManyPieces {
        /// Pieces so far.
        pieces: usize,
        /// Faces that are cut.
        faces: usize,
        /// How many pieces there may be.
        most: usize,
    },
    /// A system of equations could not be solved.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// A quad could not be refined.
    #[error(transparent)]
    Overlay(#[from] OverlayError),
    /// The pieces do not make a surface.
    #[error(transparent)]
    Connectivity(#[from] ConnectivityError),
}

/// Replaces flat patches by rectangles; the surface and everything on it gets finer faces.
///
/// `curvature_tolerance` is that of the flow.
///
/// # Errors
/// A quad whose flow does not arrive in float64. Everything else is not expected.
pub fn rectangles(
    surface: Charted,
    flat: &PatchLayout,
    params: &PatchParams,
    curvature_tolerance: f64,
) -> Result<(Charted, PatchLayout), RectangleError> {
    check_pieces(&surface.mesh)?;
    // Which division is best, only the images tell. Where clusters make rectangles too crowded for float64, flat patches may be better, since the cut ends at the tips of what stands out.
    let most = (params.texel_budget / LEAST_TEXELS)
        .min(surface.mesh.connectivity.face_count() / LEAST_FACES)
        .max(1);
    let mut counts = CLUSTERS
        .map(|count| (count * most.min(CLUSTERS[3]) / CLUSTERS[3]).max(1))
        .to_vec();
    counts.dedup();
    let in_clusters = |count| {
        let found = candidate::in_clusters(&surface, params, curvature_tolerance, count);
        if let Err(error) = &found {
            tracing::debug!(count, %error, "no rectangles of so many clusters");
        }
        found.ok()
    };
    // One is dropped as soon as there is a better one: each is a whole surface.
    let (best, all_arrived) = counts
        .par_iter()
        .enumerate()
        .map(|(i, &count)| {
            let found = in_clusters(count);
            let arrived = found.is_some();
            (found.map(|found| (i, found)), arrived)
        })
        .reduce(|| (None, true), |a, b| (better(a.0, b.0), a.1 && b.1));
    let (in_patches, error) = match all_arrived {
        true => (None, None),
        false => match candidate::in_patches(&surface, flat, params, curvature_tolerance) {
            Ok(found) => (Some((counts.len(), found)), None),
            Err(error) => (None, Some(error)),
        },
    };
    let best = better(best, in_patches).map(|(_, found)| found);
    let found = best.ok_or(error.unwrap_or(RectangleError::Inconsistent {
        what: "the clusters of faces",
    }))?;
    tracing::debug!(
        rectangles = found.layout.patches.len(),
        least_height = found.least_height,
        greatest_difference = found.greatest_difference,
        "patches became rectangles"
    );
    Ok((found.surface, found.layout))
}

impl RectangleError {
    /// Refuses more pieces than so many for each of the faces that are cut, and so many more.
    fn check_pieces(pieces: usize, faces: usize, [of_face, more]: [usize; 2]) -> Result<(), Self> {
        let most = of_face * faces + more;
        match pieces <= most {
            true => Ok(()),
            false => Err(Self::TooManyPieces {
                pieces,
                faces,
                most,
            }),
        }
    }
}

/// Refuses a surface whose faces the flat triangulation has cut into very many pieces: each of them is flattened again, several times.
fn check_pieces(mesh: &Mesh) -> Result<(), RectangleError> {
    let mut given: Vec<u32> = mesh.source_face.iter().copied().collect();
    given.sort_unstable();
    given.dedup();
    RectangleError::check_pieces(
        mesh.connectivity.face_count(),
        given.len(),
        [MOST_PIECES, ALLOWED_PIECES],
    )
}

/// The one with less error; the first one, by its number, of those that are equal.
fn better(
    a: Option<(usize, Candidate)>,
    b: Option<(usize, Candidate)>,
) -> Option<(usize, Candidate)> {
    match (a, b) {
        (Some(a), Some(b)) => {
            let order = a.1.error.total_cmp(&b.1.error).then(a.0.cmp(&b.0));
            Some(if order.is_le() { a } else { b })
        }
        (a, b) => a.or(b),
    }
}
