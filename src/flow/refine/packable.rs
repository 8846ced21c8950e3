//! Connectivity repair until a circle packing exists: (6) is decided, and where it fails edges are split.
//!
//! *Enters:* a mesh, a prescription, a scheme. *Leaves:* the same surface with more vertices, for which (6) holds for every
//! set, or the region that still breaks it.
//!
//! Around cones [`refine`](super::refine) has counted edges of disks beforehand. What it cannot know are loops around narrow necks, and the intersection angles Φ of a
//! Thurston packing: they follow from the lengths (1), and with Φ up to π/2 a *flat* vertex of
//! valence 4 or 5, or a flat region of such vertices, can lack room. So the packing is fitted, (6) is decided for all sets,
//! the links of those that break it are split, and the packing is fitted again: the certificate of the decision tells where and how much.
//!
//! # Why it ends
//!
//! Every round splits an edge of each region's link, and there is a bound on all splits ([`most_splits`]). For Φ ≡ 0 a split
//! gives the region the π that it is counted for, so few rounds are needed. For Thurston's Φ the new edges get angles of
//! their own, and a split may be worth less than was counted; where a round takes away less than half of what was
//! lacking, the next one splits half as much again.
//!
//! A region without a link, or the bound on splits, ends in [`RefineError::StillInfeasible`]. *Guaranteed* otherwise: (6), exactly, for the
//! prescription returned, so the flow that follows has a minimum to find.

use super::cuts::{self, fill};
use super::editor::{ConnectivityRepair, Editor, OutOfSplits};
use super::params::RefineError;
use super::source::in_source;
use crate::flow::feasibility::{self, Constraint};
use crate::flow::metric::full_angles;
use crate::flow::packing::{self, PackingError};
use crate::flow::prescription::{BoundaryCondition, Prescription};
use crate::flow::schemes::Scheme;
use crate::geometry::ids::{EdgeVec, VertexId, VertexVec};
use crate::geometry::mesh::Mesh;
use std::f64::consts::PI;

/// How many times the room that (6) demands shall be there; see [`feasibility`](crate::flow::feasibility). Little, since it is asked
/// for everywhere: strong cones have had more from [`refine`](super::refine).
const MARGIN: f64 = 1.05;
/// How many times the cone angle of cones below −2π there shall be room for: with hardly more than (6) demands, the circles around
/// such a cone differ in size by more than float64 can hold. (A −12π cone on fertility, with Thurston's Φ: 10²¹ with a tenth more.)
const STRENGTH: f64 = 1.5;
/// What a round splits more than the one before that did not halve what was lacking.
const GROWTH: f64 = 1.5;
/// Most that is split beyond what is counted to be lacking.
const LARGEST_EAGERNESS: f64 = 8.0;

/// Splits that a mesh of so many vertices may be given. Far more than were ever needed: a hundredth of the vertices for
/// Thurston's scheme on scans, some tens around a cone.
fn most_splits(vertices: usize) -> usize {
    2000 + vertices
}

/// Splits edges until (6) holds for every set; does nothing for schemes that are no circle packings.
pub fn make_packable(
    mesh: Mesh,
    prescription: Prescription,
    done: ConnectivityRepair,
    scheme: Scheme,
) -> Result<(Mesh, Prescription, ConnectivityRepair), RefineError> {
    let is_packing = matches!(scheme, Scheme::Tangential | Scheme::Thurston);
    if !is_packing {
        return Ok((mesh, prescription, done));
    }
    let most = most_splits(mesh.connectivity.vertex_count());
    let mut editor = Editor::new(mesh, prescription, most);
    widen(&mut editor, scheme)?;
    let (mesh, prescription, mut repair) = editor.finish();
    repair.splits += done.splits;
    repair.flips += done.flips;
    repair.hausdorff = repair.hausdorff.max(done.hausdorff);
    Ok((mesh, prescription, repair))
}

/// Splits until no region lacks room, or the editor's bound on splits is reached.
pub(super) fn widen(editor: &mut Editor, scheme: Scheme) -> Result<(), RefineError> {
    let (mut eagerness, mut lacked) = (1.0, f64::INFINITY);
    loop {
        let phi = match intersection_angles(editor, scheme) {
            Ok(phi) => phi,
            // Lengths that cannot be fitted are the flow's to refuse.
            Err(_) => return Ok(()),
        };
        let mut shortages = cuts::shortages(editor, phi.as_ref(), &editor.target, MARGIN);
        if shortages.is_empty()
            && let Some(target) = with_stronger_cones(editor)
        {
            shortages = cuts::shortages(editor, phi.as_ref(), &target, MARGIN);
        }
        if shortages.is_empty() {
            return Ok(());
        }
        let lacking: f64 = shortages.iter().map(|s| s.lacking()).sum();
        if lacking > 0.5 * lacked {
            eagerness = LARGEST_EAGERNESS.min(GROWTH * eagerness);
        }
        lacked = lacking;
        tracing::debug!(
            vertices = editor.target.len(),
            regions = shortages.len(),
            lacking,
            eagerness,
            "splitting where no packing exists"
        );
        let before = editor.splits;
        let filled: Result<(), OutOfSplits> =
            (shortages.iter()).try_for_each(|shortage| fill(editor, shortage, eagerness));
        editor.share_uniform_curvature();
        if filled.is_err() || editor.splits == before {
            return decide(editor, scheme);
        }
    }
}

/// A prescription that asks more: cone angles of the strong cones are [`STRENGTH`] times what they are, and all other vertices
/// give a share of theirs for it, but for a free boundary, which gives it unasked. `None` without strong cones.
fn with_stronger_cones(editor: &Editor) -> Option<VertexVec<f64>> {
    let c = &editor.mesh.connectivity;
    let full = full_angles(c);
    let free = editor.boundary == BoundaryCondition::Free && !c.is_closed();
    let strong = |v: VertexId| !c.is_boundary_vertex(v) && editor.target[v] < -2.0 * PI - 1e-9;
    let angle = |v: VertexId| full[v] - editor.target[v];
    let sum = |of_strong: bool| -> f64 {
        let vertices = c.vertices().filter(|&v| strong(v) == of_strong);
        vertices.map(angle).sum()
    };
    if !c.vertices().any(strong) {
        return None;
    }
    // On tiny meshes the others have not so much to give; splits will change that.
    let (cones, others) = (sum(true), sum(false));
    let extra = match free {
        true => STRENGTH - 1.0,
        false => (STRENGTH - 1.0).min(0.5 * others / cones),
    };
    let share = if free { 0.0 } else { extra * cones / others };
    let target = c.vertices().map(|v| match strong(v) {
        true => editor.target[v] - extra * angle(v),
        false => editor.target[v] + share * angle(v),
    });
    Some(target.collect())
}

/// Nothing is left to split, or nothing may be: then (6) itself must hold, if not with the margin.
fn decide(editor: &Editor, scheme: Scheme) -> Result<(), RefineError> {
    let Ok(phi) = intersection_angles(editor, scheme) else {
        return Ok(());
    };
    let c = &editor.mesh.connectivity;
    let mut constraint = Constraint::new(c, phi.as_ref(), &editor.target, editor.boundary, 1.0);
    feasibility::check(&mut constraint).map_err(|violation| RefineError::StillInfeasible {
        splits: editor.splits,
        violation: in_source(violation, &editor.mesh),
    })
}

/// Φ of the packing that the flow would start from; none for Φ ≡ 0.
fn intersection_angles(
    editor: &Editor,
    scheme: Scheme,
) -> Result<Option<EdgeVec<f64>>, PackingError> {
    if scheme != Scheme::Thurston {
        return Ok(None);
    }
    let c = &editor.mesh.connectivity;
    let length = c.edges().map(|e| editor.mesh.edge_length(e)).collect();
    Ok(Some(packing::fit(c, &length)?.intersection_angles()))
}
