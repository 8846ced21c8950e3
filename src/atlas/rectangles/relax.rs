//! Walls drawn anew, so that they are smooth and meet at even angles.
//!
//! *Enters:* a [`Drawing`] whose walls run along edges of the mesh, and meet as it came. *Leaves:* the same sides between the same patches, elsewhere.
//! *Guaranteed:* every patch keeps its sides and stays a disk; the cut, the surface's border and creases stay. *Not guaranteed:* shortest lines.
//!
//! Where three or more walls meet, all patches around are joined to a disk, and its centre (where what lies between the far ends of the walls is
//! seen as equally as can be) is joined to these ends, as [`star`] does for the centres of quads. So a wall that ends on the side of
//! another one at a right angle becomes three walls at 120°, and no quad has a straight angle for a corner there. A side between nodes that do not move becomes the
//! line on which both of its patches are seen alike.

use super::RectangleError;
use super::disk::Disk;
use super::division::{draw_between, part};
use super::quads::star;
use super::sides::{Drawing, Role};
use crate::geometry::ids::{EdgeId, FaceId, VertexId};

/// How often all nodes are looked at: each move changes what its neighbours see.
const ROUNDS: usize = 1;

/// Draws anew what may move.
pub(super) fn relax(drawing: &mut Drawing) -> Result<(), RectangleError> {
    for _ in 0..ROUNDS {
        let nodes = drawing.role.enumerate();
        let nodes: Vec<VertexId> = nodes
            .filter(|(_, role)| **role == Role::Node)
            .map(|(v, _)| v)
            .collect();
        for node in nodes {
            move_node(drawing, node)?;
        }
    }
    for side in drawing.chains() {
        let is_free = side.edges.iter().all(|&e| !drawing.is_fixed[e]);
        if let ([first, .., last], true) = (&side.vertices[..], is_free)
            && is_pinned(drawing, *first)
            && is_pinned(drawing, *last)
        {
            straighten(drawing, &side.edges, [*first, *last])?;
        }
    }
    Ok(())
}

/// Whether a wall that stays ends at a node.
pub(super) fn is_pinned(drawing: &Drawing, node: VertexId) -> bool {
    let c = &drawing.fine.connectivity;
    c.is_boundary_vertex(node)
        || c.outgoing(node)
            .any(|h| drawing.is_wall[c.edge(h)] && drawing.is_fixed[c.edge(h)])
}

/// A side as one of its nodes sees it.
pub(super) struct Arm {
    /// From there on.
    pub edges: Vec<EdgeId>,
    /// The node at its end.
    pub end: VertexId,
}

/// The sides from a node on, counterclockwise.
pub(super) fn arms(drawing: &Drawing, node: VertexId) -> Option<Vec<Arm>> {
    let c = &drawing.fine.connectivity;
    let walls = c.outgoing(node).filter(|&h| drawing.is_wall[c.edge(h)]);
    let follow = |start| {
        let mut edges = vec![c.edge(start)];
        let mut at = start;
        // A wall has fewer edges than there are.
        while edges.len() <= c.edge_count() {
            let v = c.head(at);
            if drawing.role[v] == Role::Node {
                return Some(Arm { edges, end: v });
            }
            let mut ahead = c
                .outgoing(v)
                .filter(|&h| drawing.is_wall[c.edge(h)] && c.edge(h) != c.edge(at));
            at = ahead.next()?;
            edges.push(c.edge(at));
        }
        None
    };
    walls.map(follow).collect()
}

/// Moves a node to where its walls' ends are seen alike, if nothing there is pinned.
fn move_node(drawing: &mut Drawing, node: VertexId) -> Result<(), RectangleError> {
    if is_pinned(drawing, node) {
        return Ok(());
    }
    let Some(arms) = arms(drawing, node) else {
        return Ok(());
    };
    let mut far: Vec<VertexId> = arms.iter().map(|arm| arm.end).collect();
    far.sort_unstable();
    far.dedup();
    // A wall may go on where the cut ends, without a node.
    let mut edges = arms.iter().flat_map(|arm| &arm.edges);
    if edges.any(|&e| drawing.is_fixed[e]) {
        return Ok(());
    }
    if arms.len() < 3 || far.len() < arms.len() || far.contains(&node) {
        return Ok(());
    }
    // Sectors must be of different patches, or together they are no disk.
    let c = &drawing.fine.connectivity;
    let mut seen: Vec<Vec<FaceId>> = Vec::with_capacity(arms.len());
    for Arm { edges, .. } in &arms {
        let h = c.edge_halfedge(edges[0]);
        let h = if c.tail(h) == node {
            Some(h)
        } else {
            c.twin(h)
        };
        let Some(h) = h else { return Ok(()) };
        if seen
            .iter()
            .any(|faces| faces.binary_search(&c.face(h)).is_ok())
        {
            return Ok(());
        }
        seen.push(super::disk::region(
            &drawing.fine,
            &drawing.is_wall,
            c.face(h),
        ));
    }
    let start = seen[0][0];
    for &e in arms.iter().flat_map(|arm| &arm.edges) {
        drawing.is_wall[e] = false;
    }
    let disk = part(drawing, start)?;
    let ends: Option<Vec<usize>> = arms.iter().map(|arm| only_place(&disk, arm.end)).collect();
    let between = ends.and_then(|mut ends| {
        ends.sort_unstable();
        let n = disk.border.len();
        let middles: Option<Vec<usize>> = (0..ends.len())
            .map(|i| {
                let (from, to) = (ends[i], ends[(i + 1) % ends.len()]);
                let room = (to + n - from) % n;
                (room > 1).then_some((from + room / 2) % n)
            })
            .collect();
        Some((ends, middles?))
    });
    match between {
        Some((ends, mut middles)) => {
            middles.sort_unstable();
            drawing.role[node] = Role::Plain;
            let centre = star(drawing, disk, &ends, &middles)?;
            drawing.role[centre] = Role::Node;
        }
        None => {
            for &e in arms.iter().flat_map(|arm| &arm.edges) {
                drawing.is_wall[e] = true;
            }
        }
    }
    Ok(())
}

/// Where a vertex is on the border, if it is there once.
pub(super) fn only_place(disk: &Disk, v: VertexId) -> Option<usize> {
    let mut places = (0..disk.border.len()).filter(|&place| disk.border_vertex(place) == v);
    let place = places.next()?;
    places.next().is_none().then_some(place)
}

/// Draws the side between two nodes anew.
fn straighten(
    drawing: &mut Drawing,
    edges: &[EdgeId],
    ends: [VertexId; 2],
) -> Result<(), RectangleError> {
    let c = &drawing.fine.connectivity;
    let h = c.edge_halfedge(edges[0]);
    let Some(t) = c.twin(h) else { return Ok(()) };
    let here = super::disk::region(&drawing.fine, &drawing.is_wall, c.face(h));
    if ends[0] == ends[1] || here.binary_search(&c.face(t)).is_ok() {
        return Ok(());
    }
    let start = c.face(h);
    for &e in edges {
        drawing.is_wall[e] = false;
    }
    let disk = part(drawing, start)?;
    let n = disk.border.len();
    let places = ends.map(|v| only_place(&disk, v));
    match places {
        [Some(a), Some(b)] if (a + n - b) % n > 1 && (b + n - a) % n > 1 => {
            draw_between(drawing, &disk, [a, b])?;
        }
        _ => {
            for &e in edges {
                drawing.is_wall[e] = true;
            }
        }
    }
    Ok(())
}
