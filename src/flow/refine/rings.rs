//! Valence of the vertices in the first rings around cones: criterion 2 of [`super`].

use super::editor::{Editor, OutOfSplits};
use super::params::RefineParams;
use crate::geometry::ids::{FaceId, HalfedgeId, VertexId, VertexVec};
use std::cmp::Ordering;
use std::collections::VecDeque;

/// Raises the vertices of the rings, ring by ring outwards. A new vertex goes as far out as it can, since inside the rings
/// it must be raised in turn; so each ring pushes its new vertices into the next one.
pub(super) fn raise(editor: &mut Editor, params: &RefineParams) -> Result<(), OutOfSplits> {
    loop {
        let before = editor.splits;
        let mut distance = distances(editor, params.rings);
        for ring in 1..=params.rings as u32 {
            let mut next = 0;
            // New vertices of this ring are appended while it is worked on.
            while next < distance.len() {
                let v = VertexId::new(next);
                next += 1;
                if distance[v] != ring || !counts(editor, v) {
                    continue;
                }
                while editor.mesh.connectivity.valence(v) < params.ring_valence {
                    raise_by_one(editor, v, &mut distance, params.rings)?;
                }
            }
        }
        if editor.splits == before {
            return Ok(());
        }
    }
}

/// Criterion 2 is about flat interior vertices: other cones have criterion 1.
fn counts(editor: &Editor, v: VertexId) -> bool {
    editor.target[v] == 0.0 && !editor.mesh.connectivity.is_boundary_vertex(v)
}

/// Edges to the nearest interior cone, and `rings + 1` wherever that is more than `rings`.
fn distances(editor: &Editor, rings: usize) -> VertexVec<u32> {
    let connectivity = &editor.mesh.connectivity;
    let beyond = rings as u32 + 1;
    let mut distance = VertexVec::filled(beyond, connectivity.vertex_count());
    let mut queue = VecDeque::new();
    for cone in editor.interior_cones() {
        distance[cone] = 0;
        queue.push_back(cone);
    }
    while let Some(v) = queue.pop_front() {
        for w in connectivity.neighbours(v) {
            if distance[w] > distance[v] + 1 {
                distance[w] = distance[v] + 1;
                queue.push_back(w);
            }
        }
    }
    distance
}

/// A split that raises a vertex by one.
#[derive(Clone, Copy)]
enum Split {
    /// Of the edge opposite to it.
    Edge(HalfedgeId),
    /// Of a face at it.
    Face(FaceId, HalfedgeId),
}

fn raise_by_one(
    editor: &mut Editor,
    v: VertexId,
    distance: &mut VertexVec<u32>,
    rings: usize,
) -> Result<(), OutOfSplits> {
    let connectivity = &editor.mesh.connectivity;
    let beyond = rings as u32 + 1;
    let out = |nearest: u32| (nearest + 1).min(beyond);
    let reach = |split: Split| match split {
        Split::Edge(h) => {
            let ends = distance[connectivity.tail(h)].min(distance[connectivity.head(h)]);
            let across = connectivity
                .twin(h)
                .map_or(beyond, |t| distance[connectivity.apex(t)]);
            out(ends.min(across).min(distance[v]))
        }
        Split::Face(f, _) => {
            let corners = connectivity.face_vertices(f).map(|w| distance[w]);
            out(corners.into_iter().fold(beyond, u32::min))
        }
    };
    let key = |split: Split| match split {
        Split::Edge(h) => (true, h),
        Split::Face(_, h) => (false, h),
    };
    let better = |a: &Split, b: &Split| -> Ordering {
        let ((edge_a, h_a), (edge_b, h_b)) = (key(*a), key(*b));
        let order = reach(*a).cmp(&reach(*b)).then(edge_a.cmp(&edge_b));
        order.then(editor.by_length(h_a, h_b))
    };
    let candidates = editor
        .opposite_edges(v)
        .flat_map(|h| [Split::Edge(h), Split::Face(connectivity.face(h), h)]);
    let Some(best) = candidates.max_by(better) else {
        return Ok(());
    };
    let far = reach(best);
    match best {
        Split::Edge(h) => {
            let e = connectivity.edge(h);
            editor.split_edge(e)?;
        }
        Split::Face(f, _) => {
            editor.split_face(f)?;
        }
    }
    distance.push(far);
    Ok(())
}
