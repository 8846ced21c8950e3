//! What is said of a metric with quarter turns: loops, how far it is from conformal, features.

use super::counted;
use crate::flow::features::Feature;
use crate::flow::ricci::QuarterTurns;
use crate::geometry::ids::{NONE, VertexId};
use crate::geometry::mesh::Mesh;
use crate::job::warnings::sharp_edges_left_out;
use crate::read::metric::{FeatureEnd, NoLine, StoredTurns};

/// Loops and features that are told of one by one.
const TOLD: usize = 12;

/// What a build would store.
pub(super) fn of(met: &QuarterTurns, mesh: &Mesh) -> StoredTurns {
    let end = |v: VertexId| FeatureEnd {
        vertex: Some(mesh.source_vertex[v]).filter(|&v| v != NONE),
        position: mesh.positions[v],
    };
    let given_up = |f: &Feature| {
        let (&from, &to) = (f.vertices.first()?, f.vertices.last()?);
        Some(NoLine {
            edges: f.edges.len(),
            ends: [end(from), end(to)],
        })
    };
    StoredTurns {
        loops: met.loops.clone(),
        conformal_error: met.conformal_error,
        adjusted: met.moved.to_least,
        merged: met.moved.merged,
        lines: met.lines.len(),
        given_up: met.given_up.iter().filter_map(given_up).collect(),
        left_out: met.left_out,
    }
}

/// Sentences; vertices are named as in the input file.
pub(super) fn describe(met: &StoredTurns) -> Vec<String> {
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
    if met.adjusted > 0 {
        lines.push(format!(
            "{} moved between vertices, so that a grid can have the cones of the field",
            turns(met.adjusted)
        ));
    }
    if met.merged > 0 {
        lines.push(format!(
            "{} moved between cones of the field that were near each other or more than cones.count, so that one of two is gone",
            turns(met.merged)
        ));
    }
    let all = met.lines + met.given_up.len();
    if all > 0 {
        lines.push(format!(
            "{} of {all} features are straight lines",
            met.lines
        ));
    }
    let name = |end: &FeatureEnd| {
        let [x, y, z] = end.position;
        let vertex = match end.vertex {
            Some(v) => format!("vertex {v} of the file"),
            None => "a new vertex".to_owned(),
        };
        format!("{vertex} (near {x:.4}, {y:.4}, {z:.4})")
    };
    let given_up = |feature: &NoLine| {
        let [from, to] = &feature.ends;
        let edges = counted(feature.edges, "edge", "edges");
        format!("no line: {edges} from {} to {}", name(from), name(to))
    };
    lines.extend(met.given_up.iter().take(TOLD).map(given_up));
    if met.left_out >= 0.005 {
        lines.push(format!("it has {}", sharp_edges_left_out(met.left_out)));
    }
    lines
}
