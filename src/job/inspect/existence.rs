//! What is known before the flow about the existence of the metric, in lines for a reader.
//!
//! *Enters:* a component, its prescription, the flow's parameters. *Leaves:* the verdict on (6) for circle packings, with the
//! worst region; for the other schemes what is known instead.

use crate::flow::cones::{Prescription, in_pi};
use crate::flow::feasibility::{self, Constraint, Violation};
use crate::flow::packing;
use crate::flow::refine::{in_source, source_vertex};
use crate::flow::ricci::{FlowError, FlowParams, Scheme};
use crate::geometry::ids::{EdgeVec, NONE, VertexId};
use crate::geometry::mesh::Mesh;
use std::f64::consts::PI;

/// What (6) says of one component.
pub(super) enum Verdict {
    /// It holds; the vertex of `mesh` with the least room alone, and that room, radians.
    Possible(Option<(VertexId, f64)>),
    /// It fails; vertices as `mesh` numbers them.
    Impossible(Violation),
}

/// Decides (6) where the scheme is a circle packing. An error where lengths cannot be fitted by one.
pub(super) fn decide(
    mesh: &Mesh,
    prescription: &Prescription,
    flow: &FlowParams,
) -> Result<Option<Verdict>, FlowError> {
    let c = &mesh.connectivity;
    let phi: Option<EdgeVec<f64>> = match flow.scheme {
        Scheme::Tangential => None,
        Scheme::Thurston => {
            let length = c.edges().map(|e| mesh.edge_length(e)).collect();
            Some(packing::fit(c, &length)?.intersection_angles())
        }
        Scheme::InversiveDistance | Scheme::VertexScaling => return Ok(None),
    };
    let (target, boundary) = (&prescription.target, prescription.boundary);
    let mut constraint = Constraint::new(c, phi.as_ref(), target, boundary, 1.0);
    Ok(Some(match feasibility::check(&mut constraint) {
        Ok(()) => Verdict::Possible(constraint.tightest_vertex()),
        Err(violation) => Verdict::Impossible(violation),
    }))
}

/// What is known of the metric's existence.
pub(super) fn line(verdict: Option<&Verdict>, mesh: &Mesh, flow: &FlowParams) -> String {
    match verdict {
        Some(Verdict::Possible(tightest)) => {
            let room = tightest.map_or(String::new(), |(v, room)| {
                let room = (1e4 * room / PI).floor() / 1e4 * PI;
                let room = match room > 0.0 {
                    true => in_pi(room),
                    false => "less than 0.0001π".into(),
                };
                let name = source_vertex(mesh, v);
                let place = match mesh.source_vertex[v] == NONE {
                    true => format!("a new vertex beside {name}"),
                    false => format!("vertex {name}"),
                };
                format!("; the tightest single vertex, {place} of the file, has {room} to spare")
            });
            format!("  circle packing: exists, (6) holds for every region{room}")
        }
        Some(Verdict::Impossible(violation)) => {
            let said = in_source(violation.clone(), mesh);
            format!("  circle packing: none: {}", said.inequality())
        }
        None if flow.flips() => {
            "  flat metric: exists; with flips Gauss–Bonnet and positive cone angles are all it takes, and both hold".into()
        }
        None => {
            "  flat metric: Gauss–Bonnet and positive cone angles hold; whether this scheme has one on this connectivity is not known before the flow".into()
        }
    }
}
