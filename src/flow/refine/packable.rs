//! Connectivity repair until a circle packing can exist: (6) is decided, and where it fails edges are split.
//!
//! Around cones [`refine`](super::refine) has counted edges beforehand. What it cannot know are the intersection angles Φ of a
//! Thurston packing: they follow from the lengths (1), and with Φ up to π/2 a *flat* vertex of
//! valence 4 or 5, or a flat region of such vertices, can lack room. So the packing is fitted, (6) is decided for all sets,
//! the links of those that break it are split, and the packing is fitted again.

use super::cuts::{fill, shortages};
use super::{Editor, RefineError};
use crate::flow::cones::Prescription;
use crate::flow::packing;
use crate::flow::ricci::Scheme;
use crate::geometry::ids::EdgeVec;
use crate::geometry::mesh::Mesh;
use crate::product::ConnectivityRepair;

/// Rounds of fitting and splitting. What is not repaired by then is refused by the flow, with the region and both sides
/// of the inequality.
const ROUNDS: usize = 16;
/// How many times the room that (6) demands shall be there; see [`feasibility`](crate::flow::feasibility). Little, since it is asked
/// for everywhere: strong cones have had more from [`refine`](super::refine).
const MARGIN: f64 = 1.05;

/// Splits edges until (6) holds for every set, as far as that helps; does nothing for schemes that are no circle packings.
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
    let mut editor = Editor::new(mesh, prescription, usize::MAX);
    for _ in 0..ROUNDS {
        let c = &editor.mesh.connectivity;
        let mut phi: Option<EdgeVec<f64>> = None;
        if scheme == Scheme::Thurston {
            let length = c.edges().map(|e| editor.mesh.edge_length(e)).collect();
            // Lengths that cannot be fitted are the flow's to refuse.
            let Ok(packing) = packing::fit(c, &length) else {
                break;
            };
            phi = Some(packing.intersection_angles());
        }
        let shortages = shortages(&editor, phi.as_ref(), MARGIN);
        if std::env::var_os("FEAS_DEBUG").is_some() {
            let sizes: Vec<(usize, f64, f64)> = shortages.iter().map(|s| s.report()).collect();
            eprintln!("{} vertices, {} regions {:?}", editor.target.len(), shortages.len(), &sizes[..sizes.len().min(12)]);
        }
        if shortages.is_empty() {
            break;
        }
        for shortage in &shortages {
            // Without a bound on splits this cannot fail.
            let _ = fill(&mut editor, shortage);
        }
    }
    let (mesh, prescription, mut repair) = editor.finish();
    repair.splits += done.splits;
    repair.flips += done.flips;
    repair.hausdorff = repair.hausdorff.max(done.hausdorff);
    Ok((mesh, prescription, repair))
}
