//! What repair changed, by place and by count.

use std::collections::BTreeMap;
use std::fmt;

/// Why a face was taken out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RemovalReason {
    /// Two of its corners are one vertex.
    RepeatedVertex,
    /// Its corners lie on one line.
    Collinear,
    /// An earlier face (named) has the same three vertices.
    DuplicateOf(u32),
    /// The input has the flat sheet that it lies in from both sides, in other triangles, and this is the other side.
    Back,
    /// The input has it from both sides, and it hangs on an edge that has two faces without it: a sheet without volume.
    Flap,
}

/// One change. Vertices and faces are those of the input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// A vertex was replaced by another at its position.
    WeldedVertex {
        /// The one that is gone.
        vertex: u32,
        /// The one that stands for it.
        onto: u32,
    },
    /// A face was taken out.
    RemovedFace {
        /// The face.
        face: u32,
        /// Why.
        reason: RemovalReason,
    },
    /// A face was split because a vertex lay on its side.
    SplitFace {
        /// The face.
        face: u32,
        /// The vertex on its side.
        at: u32,
    },
    /// A face was turned over.
    FlippedFace {
        /// The face.
        face: u32,
    },
    /// An edge with more than two faces was cut into several edges.
    CutEdge {
        /// Its ends, the lower first.
        ends: [u32; 2],
        /// How many faces met there.
        faces: u32,
        /// How many edges there are now.
        edges: u32,
        /// Lowest of those faces.
        face: u32,
    },
    /// A vertex with several fans of faces was given one copy a fan.
    SplitVertex {
        /// The vertex.
        vertex: u32,
        /// How many copies were added.
        copies: u32,
    },
    /// One of several edges between the same vertices was split at its midpoint.
    SplitEdge {
        /// The vertices.
        ends: [u32; 2],
        /// A face at the edge.
        face: u32,
    },
    /// No face uses a vertex.
    UnreferencedVertex {
        /// The vertex.
        vertex: u32,
    },
}

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Change::WeldedVertex { vertex, onto } => {
                write!(f, "vertex {vertex} is welded to vertex {onto}")
            }
            Change::RemovedFace { face, reason } => match reason {
                RemovalReason::RepeatedVertex => {
                    write!(f, "face {face} has one vertex twice")
                }
                RemovalReason::Collinear => {
                    write!(f, "face {face} has its corners on one line")
                }
                RemovalReason::DuplicateOf(first) => {
                    write!(f, "face {face} has the same vertices as face {first}")
                }
                RemovalReason::Back => {
                    write!(f, "face {face} is the back of a flat sheet")
                }
                RemovalReason::Flap => {
                    write!(
                        f,
                        "face {face} is there from both sides and hangs on another sheet"
                    )
                }
            },
            Change::SplitFace { face, at } => {
                write!(f, "face {face} has vertex {at} on its side")
            }
            Change::FlippedFace { face } => {
                write!(f, "face {face} is oriented against its neighbours")
            }
            Change::CutEdge { ends, faces, .. } => write!(
                f,
                "the edge from vertex {} to vertex {} has {faces} faces",
                ends[0], ends[1]
            ),
            Change::SplitVertex { vertex, copies } => write!(
                f,
                "the faces at vertex {vertex} form {} fans",
                u64::from(copies) + 1
            ),
            Change::SplitEdge { ends, .. } => write!(
                f,
                "vertices {} and {} are joined by several edges",
                ends[0], ends[1]
            ),
            Change::UnreferencedVertex { vertex } => {
                write!(f, "no face uses vertex {vertex}")
            }
        }
    }
}

/// Every change, in the order in which it was made.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RepairLog {
    /// The changes.
    pub changes: Vec<Change>,
}

/// Names of the counts, as `atlas.json` lists them.
const COUNTS: [&str; 13] = [
    "welded_vertices",
    "removed_faces",
    "removed_degenerate_faces",
    "removed_collinear_faces",
    "removed_duplicate_faces",
    "removed_back_faces",
    "removed_flap_faces",
    "split_faces",
    "flipped_faces",
    "cut_edges",
    "split_vertices",
    "split_edges",
    "unreferenced_vertices",
];

impl RepairLog {
    /// True where nothing changed.
    pub fn is_empty(&self) -> bool {
        self.changes.is_empty()
    }

    /// Counts by name; every name is there, also with 0. `removed_faces` is the sum over the reasons,
    /// `cut_edges` and `split_vertices` count the edges and vertices that were added.
    pub fn counts(&self) -> BTreeMap<String, u64> {
        let mut counts: BTreeMap<String, u64> =
            COUNTS.iter().map(|name| (name.to_string(), 0)).collect();
        let mut add = |name: &str, n: u64| {
            if let Some(count) = counts.get_mut(name) {
                *count += n;
            }
        };
        for change in &self.changes {
            match *change {
                Change::WeldedVertex { .. } => add("welded_vertices", 1),
                Change::RemovedFace { reason, .. } => {
                    add("removed_faces", 1);
                    match reason {
                        RemovalReason::RepeatedVertex => add("removed_degenerate_faces", 1),
                        RemovalReason::Collinear => add("removed_collinear_faces", 1),
                        RemovalReason::DuplicateOf(_) => add("removed_duplicate_faces", 1),
                        RemovalReason::Back => add("removed_back_faces", 1),
                        RemovalReason::Flap => add("removed_flap_faces", 1),
                    }
                }
                Change::SplitFace { .. } => add("split_faces", 1),
                Change::FlippedFace { .. } => add("flipped_faces", 1),
                Change::CutEdge { edges, .. } => add("cut_edges", u64::from(edges) - 1),
                Change::SplitVertex { copies, .. } => add("split_vertices", u64::from(copies)),
                Change::SplitEdge { .. } => add("split_edges", 1),
                Change::UnreferencedVertex { .. } => add("unreferenced_vertices", 1),
            }
        }
        counts
    }

    /// The counts that are not zero, in one line: `2 removed faces, 1 flipped face`.
    pub fn summary(&self) -> String {
        let counts = self.counts();
        let parts: Vec<String> = COUNTS
            .iter()
            .filter(|name| **name != "removed_faces")
            .filter_map(|name| counts.get(*name).map(|&n| (name, n)))
            .filter(|&(_, n)| n > 0)
            .map(|(name, n)| format!("{n} {}", in_words(name, n)))
            .collect();
        if parts.is_empty() {
            "nothing to change".into()
        } else {
            parts.join(", ")
        }
    }

    /// The first change that alters the surface: leaving out unused vertices does not.
    pub(crate) fn first_refused_by_strict(&self) -> Option<&Change> {
        self.changes
            .iter()
            .find(|c| !matches!(c, Change::UnreferencedVertex { .. }))
    }
}

fn in_words(name: &str, count: u64) -> String {
    let words = name.replace('_', " ");
    match (count, words.strip_suffix("vertices")) {
        (1, Some(start)) => format!("{start}vertex"),
        (1, None) => words.strip_suffix('s').unwrap_or(&words).to_string(),
        _ => words,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_and_summary_agree() {
        let log = RepairLog {
            changes: vec![
                Change::WeldedVertex { vertex: 3, onto: 1 },
                Change::RemovedFace {
                    face: 7,
                    reason: RemovalReason::DuplicateOf(2),
                },
                Change::RemovedFace {
                    face: 8,
                    reason: RemovalReason::RepeatedVertex,
                },
                Change::SplitVertex {
                    vertex: 4,
                    copies: 2,
                },
            ],
        };
        let counts = log.counts();
        assert_eq!(counts["removed_faces"], 2);
        assert_eq!(counts["split_vertices"], 2);
        assert_eq!(counts["flipped_faces"], 0);
        assert_eq!(
            log.summary(),
            "1 welded vertex, 1 removed degenerate face, 1 removed duplicate face, 2 split vertices"
        );
    }
}
