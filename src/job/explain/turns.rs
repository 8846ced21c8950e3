//! What is said of a metric with quarter turns: loops, how far it is from conformal, features.

use super::counted;
use crate::flow::features::Feature;
use crate::flow::ricci::QuarterTurns;
use crate::geometry::ids::{NONE, VertexId};
use crate::geometry::mesh::Mesh;
use crate::read::metric::StoredTurns;

/// Loops and features that are told of one by one.
const TOLD: usize = 12;

/// What a build would store.
pub(super) fn of(met: &QuarterTurns, mesh: &Mesh) -> StoredTurns {
    let name = |v: Option<&VertexId>| v.map(|&v| mesh.source_vertex[v]).filter(|&v| v != NONE);
    let given_up = |f: &Feature| {
        let ends = [name(f.vertices.first()), name(f.vertices.last())];
        (f.edges.len(), ends)
    };
    StoredTurns {
        loops: met.loops.clone(),
        conformal_error: met.conformal_error,
        adjusted: met.moved.to_least,
        merged: met.moved.merged,
        lines: met.lines.len(),
        given_up: met.given_up.iter().map(given_up).collect(),
    }
}

/// What is said of the part of sharp edges, by length, that is in no feature.
pub(super) fn unfollowed(part: f64) -> Option<String> {
    let percent = 100.0 * part;
    (percent >= 0.5).then(|| {
        format!(
            "{percent:.0} % of the length of sharp edges (features.angle) is in no feature, since their chains are too short, lose themselves, or are as often ridge as valley: edges that shall be lines all the same can be named in features.file"
        )
    })
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
    let name = |v: Option<u32>| v.map_or("a new one".to_owned(), |v| v.to_string());
    let given_up = |feature: &(usize, [Option<u32>; 2])| {
        let (edges, [from, to]) = *feature;
        format!(
            "no line: {} from vertex {} to vertex {}",
            counted(edges, "edge", "edges"),
            name(from),
            name(to)
        )
    };
    lines.extend(met.given_up.iter().take(TOLD).map(given_up));
    lines
}
