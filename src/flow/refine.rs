//! Connectivity repair around cones (tutorial 5.3): more edges where much negative curvature must fit.
//!
//! *Enters:* a mesh and its prescription. *Leaves:* the same surface, point for point, with more vertices; the
//! prescription, extended; how many splits that took.
//!
//! # Criteria
//!
//! A circle packing with curvature K̄ exists only where (6) holds for *every* vertex set I. With Φ ≡ 0 it says
//! |Lk(I)| > D(I)/π, where Lk(I) are the edges opposite to I in faces with one corner in I, and
//! D(I) = 2πχ(F_I) − Σ_I K̄ (on a boundary that is not free each boundary vertex counts π instead of 2π, and
//! D changes accordingly). Two families of sets are watched:
//!
//! 1. **Disks around a cone** (`links`): all vertices at most k edges from it. The link shall have at least 2D/π edges up
//!    to k = `rings`, and 1.5 D/π beyond. For the cone alone (k = 0) that is the tutorial's valence ≥ 4 − 2K̄/π;
//!    for the disks it is the same count, since D does not change as long as the disk stays a disk.
//!    Raising the cone's valence alone is not enough: a −12π cone needs more than 14 edges around *every* disk.
//! 2. **Vertices in the first rings** (`rings`): valence ≥ 6 (`ring_valence`), but for other cones and for the boundary.
//!
//! On a boundary that is not free every vertex must moreover have angle enough: about 2 − 2K̄/π faces.
//!
//! # Operations
//!
//! Edge splits at the midpoint and, rarely, face splits at the centroid: the surface stays where it is (Hausdorff distance 0)
//! and no edge is doubled, since all edges at a new vertex are new. Splitting the edge opposite to v in a face at v
//! raises v's valence by one; no split lowers any valence, so what holds stays true.
//! Longest edges go first, which spreads the splits evenly.
//!
//! The criteria are for every flow that keeps the connectivity, also where no (6) is known. *Not guaranteed:* that (6) then holds for
//! every set: a disk of rings may pass a narrow neck askew, and the shortest loop around the neck is what counts. For
//! circle packings [`make_packable`] decides (6), and splits more edges where it fails, until it holds.

mod cuts;
mod editor;
mod links;
mod packable;
mod params;
mod rings;
mod source;

pub use editor::ConnectivityRepair;
pub use packable::make_packable;
pub use params::{RefineError, RefineParams};
pub(crate) use source::{in_source, source_vertex};

use crate::flow::prescription::Prescription;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{HalfedgeId, VertexId};
use crate::geometry::mesh::Mesh;
use editor::{Editor, OutOfSplits};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Splits edges around cones until the criteria of the module docs hold; does nothing where they hold already. Whether it is
/// wanted is for the caller to ask ([`RefineParams::is_enabled`]).
pub fn refine(
    mesh: Mesh,
    prescription: Prescription,
    params: &RefineParams,
) -> Result<(Mesh, Prescription, ConnectivityRepair), RefineError> {
    params.check()?;
    let need: f64 = prescription
        .cones
        .iter()
        .map(|c| (4.0 - 2.0 * c.curvature / PI).max(0.0))
        .sum();
    // Rings of a cone of valence N hold about N, 2N, 3N vertices, each of which takes up to three splits.
    let most_splits = 1000 + 100 * need.ceil() as usize;
    let mut editor = Editor::new(mesh, prescription, most_splits);
    let result = meet_criteria(&mut editor, params);
    result.map_err(|OutOfSplits| RefineError::TooManySplits {
        splits: editor.splits,
        cones: editor.interior_cones().len(),
        rings: params.rings,
    })?;
    let flat = raise_flat_vertices(&mut editor, params.flat_vertex_valence);
    flat.map_err(|OutOfSplits| RefineError::TooManySplits {
        splits: editor.splits,
        cones: editor.interior_cones().len(),
        rings: params.rings,
    })?;
    Ok(editor.finish())
}

fn meet_criteria(editor: &mut Editor, params: &RefineParams) -> Result<(), OutOfSplits> {
    editor.widen_boundary_angles()?;
    loop {
        let before = editor.splits;
        for cone in editor.interior_cones() {
            links::widen(editor, cone, params.rings)?;
        }
        rings::raise(editor, params)?;
        if editor.splits == before {
            return Ok(());
        }
    }
}

fn raise_flat_vertices(editor: &mut Editor, valence: usize) -> Result<(), OutOfSplits> {
    let connectivity = &editor.mesh.connectivity;
    let wanted: BTreeMap<VertexId, usize> = connectivity
        .vertices()
        .filter(|&v| editor.target[v] == 0.0 && !connectivity.is_boundary_vertex(v))
        .filter(|&v| connectivity.valence(v) < valence)
        .map(|v| (v, valence))
        .collect();
    editor.most_splits = editor.most_splits.saturating_add(2 * wanted.len());
    raise_all(editor, &wanted)
}

fn raise_all(editor: &mut Editor, wanted: &BTreeMap<VertexId, usize>) -> Result<(), OutOfSplits> {
    for (&v, &valence) in wanted {
        while editor.mesh.connectivity.valence(v) < valence {
            let lacks =
                |c: &Connectivity, w: VertexId| wanted.get(&w).is_some_and(|&n| c.valence(w) < n);
            let connectivity = &editor.mesh.connectivity;
            let best = editor.opposite_edges(v).max_by(|&g, &h| {
                let pairs = |h: HalfedgeId| {
                    let across = connectivity.twin(h).map(|t| connectivity.apex(t));
                    across.is_some_and(|w| lacks(connectivity, w))
                };
                let first = pairs(g).cmp(&pairs(h));
                first.then(editor.by_length(g, h))
            });
            let Some(h) = best else { break };
            let e = connectivity.edge(h);
            editor.split_edge(e)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
