//! The sets of vertices that lack edges, and the splits that make up for it.
//!
//! [`feasibility`](crate::flow::feasibility) finds the sets, with a margin. Splitting an edge of a set's link
//! gives it one edge more, and what that edge is worth, π − Φ of its halves, is taken to be what the whole was worth:
//! exact for Φ ≡ 0, a guess otherwise, since Φ follows from the new lengths.

use super::editor::{Editor, OutOfSplits};
use crate::flow::feasibility::{Constraint, Region};
use crate::geometry::ids::{EdgeVec, HalfedgeId, VertexVec};

/// A region that lacks edges, and what each edge of its link is worth.
pub(super) struct Shortage {
    region: Region,
    /// Halfedges of the link, each with the room of the corner opposite, radians.
    link: Vec<(HalfedgeId, f64)>,
}

impl Shortage {
    /// What is missing, radians; nothing where both sides are equal.
    pub fn lacking(&self) -> f64 {
        self.region.slack.abs()
    }
}

/// The regions that break (6) with a margin. `phi` and `target` as for [`Constraint::new`].
pub(super) fn shortages(
    editor: &Editor,
    phi: Option<&EdgeVec<f64>>,
    target: &VertexVec<f64>,
    margin: f64,
) -> Vec<Shortage> {
    let connectivity = &editor.mesh.connectivity;
    let mut constraint = Constraint::new(connectivity, phi, target, editor.boundary, margin);
    let regions = constraint.offending_regions().into_iter();
    let shortage = |region: Region| {
        let link = constraint.link(&region).into_iter();
        let worth = |h: HalfedgeId| constraint.corner_room(connectivity.prev(h));
        Shortage {
            link: link.map(|h| (h, worth(h))).collect(),
            region,
        }
    };
    regions.map(shortage).collect()
}

/// Splits edges of the link, long ones first, until their worth makes up for what the region lacks, times `eagerness`; one at
/// least, but for a region without a link, where there is nothing to split.
pub(super) fn fill(
    editor: &mut Editor,
    shortage: &Shortage,
    eagerness: f64,
) -> Result<(), OutOfSplits> {
    let mut link = shortage.link.clone();
    // Equality is not enough: one edge at least.
    let mut lacking = eagerness * shortage.lacking();
    while lacking >= 0.0 {
        let longest = link
            .iter()
            .max_by(|(g, _), (h, _)| editor.by_length(*g, *h));
        let Some(&(h, _)) = longest else { break };
        let c = &editor.mesh.connectivity;
        let twin = c.twin(h);
        editor.split_edge(c.edge(h))?;
        let c = &editor.mesh.connectivity;
        // Each side kept its tail; its other half lies past the spoke.
        for side in std::iter::once(h).chain(twin) {
            let worth = link
                .iter()
                .find(|(g, _)| *g == side)
                .map(|(_, worth)| *worth);
            let past = c.twin(c.next(side)).map(|t| c.next(t));
            if let (Some(worth), Some(past)) = (worth, past) {
                link.push((past, worth));
                lacking -= worth;
            }
        }
    }
    Ok(())
}
