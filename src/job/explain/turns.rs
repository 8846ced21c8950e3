//! What is said of a metric with quarter turns: loops, how far it is from conformal, features.

use super::counted;
use crate::flow::features::Feature;
use crate::flow::ricci::QuarterTurns;
use crate::geometry::ids::{NONE, VertexId};
use crate::geometry::mesh::Mesh;

/// Loops and features that are told of one by one.
const TOLD: usize = 12;

/// Sentences; vertices are named as in the input file.
pub(super) fn describe(met: &QuarterTurns, mesh: &Mesh) -> Vec<String> {
    let mut lines = Vec::new();
    let worst = met.loops.iter().fold(0.0_f64, |m, l| m.max(l.1.abs()));
    let turns: Vec<String> = met.loops.iter().map(|l| l.0.to_string()).collect();
    match turns.len() {
        0 => {}
        n if n <= TOLD => lines.push(format!(
            "{} by {} quarter turns, to {worst:.1e} rad",
            counted(n, "independent loop turns", "independent loops turn"),
            turns.join(", ")
        )),
        n => lines.push(format!(
            "{n} independent loops turn by quarter turns, to {worst:.1e} rad: the first by {}",
            turns[..TOLD].join(", ")
        )),
    }
    let [rms, most] = met.conformal_error;
    lines.push(format!(
        "lengths differ from those of the nearest conformal map by factors of e^{:.3} (rms; at most e^{:.3}): flow.conformality makes that less, and scales less even",
        0.5 * rms,
        0.5 * most
    ));
    let turns = |count| counted(count, "quarter turn was", "quarter turns were");
    if met.moved.to_least > 0 {
        lines.push(format!(
            "{} moved between vertices, so that a grid can have the cones of the field",
            turns(met.moved.to_least)
        ));
    }
    if met.moved.merged > 0 {
        lines.push(format!(
            "{} moved between cones of the field that were near each other or more than cones.count, so that one of two is gone",
            turns(met.moved.merged)
        ));
    }
    let all = met.lines.len() + met.given_up.len();
    if all > 0 {
        lines.push(format!(
            "{} of {all} features are straight lines",
            met.lines.len()
        ));
    }
    let end = |v: Option<&VertexId>| match v.map(|&v| mesh.source_vertex[v]) {
        Some(v) if v != NONE => v.to_string(),
        _ => "a new one".to_owned(),
    };
    let given_up = |f: &Feature| {
        format!(
            "no line: {} from vertex {} to vertex {}",
            counted(f.edges.len(), "edge", "edges"),
            end(f.vertices.first()),
            end(f.vertices.last())
        )
    };
    lines.extend(met.given_up.iter().take(TOLD).map(given_up));
    lines
}
