//! Enough edges around every disk of rings about a cone: criterion 1 of [`super`].

use super::editor::{Editor, OutOfSplits};
use crate::flow::prescription::BoundaryCondition;
use crate::geometry::ids::{FaceVec, HalfedgeId, VertexId, VertexVec};
use std::f64::consts::{PI, TAU};

/// How many times the edges that (6) demands shall be there beyond the first rings: with hardly more than (6) demands,
/// the circles of one face differ in size by more than float64 can hold.
const MARGIN: f64 = 1.5;

const UNREACHED: u32 = u32::MAX;

/// Splits edges of the links of the disks around a cone until each is long enough. A cone of positive curvature
/// needs no more than its own valence: beyond it every closed link has the three edges that D asks for.
pub(super) fn widen(editor: &mut Editor, cone: VertexId, rings: usize) -> Result<(), OutOfSplits> {
    let levels = if editor.target[cone] > 0.0 {
        0
    } else {
        usize::MAX
    };
    let mut disk = Disk::new(editor, cone);
    for level in 0..=levels {
        disk.take_in_frontier(editor);
        let margin = if level <= rings { 2.0 } else { MARGIN };
        let need = (margin * disk.demand() / PI - 1e-9).ceil();
        while (disk.link.len() as f64) < need {
            let Some(h) = disk.edge_to_split(editor) else {
                break;
            };
            disk.split(editor, h)?;
        }
        if disk.frontier.is_empty() {
            break;
        }
    }
    Ok(())
}

/// The vertices at most so many edges from a cone.
struct Disk {
    /// Edges from the cone.
    distance: VertexVec<u32>,
    /// Distance of the outermost vertices inside.
    level: u32,
    /// Vertices that come in next.
    frontier: Vec<VertexId>,
    /// True for faces with a corner inside.
    touched: FaceVec<bool>,
    /// Number of those.
    touched_count: usize,
    /// Halfedges opposite to the only corner inside, in faces with one.
    link: Vec<HalfedgeId>,
    /// Σ over the vertices inside of (2π or π) − K̄.
    angles: f64,
}

impl Disk {
    fn new(editor: &Editor, cone: VertexId) -> Self {
        let connectivity = &editor.mesh.connectivity;
        let mut distance = VertexVec::filled(UNREACHED, connectivity.vertex_count());
        distance[cone] = 0;
        Self {
            distance,
            level: 0,
            frontier: vec![cone],
            touched: FaceVec::filled(false, connectivity.face_count()),
            touched_count: 0,
            link: Vec::new(),
            angles: 0.0,
        }
    }

    /// With a free boundary (6) is about sets of interior vertices.
    fn may_enter(editor: &Editor, v: VertexId) -> bool {
        editor.boundary != BoundaryCondition::Free
            || !editor.mesh.connectivity.is_boundary_vertex(v)
    }

    fn inside(&self, v: VertexId) -> bool {
        self.distance[v] <= self.level
    }

    /// The frontier comes in, and its neighbours become the frontier.
    fn take_in_frontier(&mut self, editor: &Editor) {
        let connectivity = &editor.mesh.connectivity;
        let entering = std::mem::take(&mut self.frontier);
        self.level = entering.first().map_or(self.level, |&v| self.distance[v]);
        let mut faces = Vec::new();
        for &v in &entering {
            let whole = if connectivity.is_boundary_vertex(v) {
                PI
            } else {
                TAU
            };
            self.angles += whole - editor.target[v];
            for h in connectivity.outgoing(v) {
                let f = connectivity.face(h);
                if !self.touched[f] {
                    self.touched[f] = true;
                    self.touched_count += 1;
                    faces.push(f);
                }
            }
            for w in connectivity.neighbours(v) {
                if self.distance[w] == UNREACHED && Self::may_enter(editor, w) {
                    self.distance[w] = self.level + 1;
                    self.frontier.push(w);
                }
            }
        }
        let old = std::mem::take(&mut self.link);
        let candidates = faces
            .into_iter()
            .flat_map(|f| connectivity.face_halfedges(f))
            .filter(|&h| self.inside(connectivity.apex(h)));
        let link = old
            .into_iter()
            .chain(candidates)
            .filter(|&h| !self.inside(connectivity.tail(h)) && !self.inside(connectivity.head(h)))
            .collect();
        self.link = link;
    }

    /// D of the module docs of [`super`]: Σ(2π − K̄) − π·(touched faces that are not in the link).
    fn demand(&self) -> f64 {
        self.angles - PI * (self.touched_count - self.link.len()) as f64
    }

    /// The link edge to split rather. The new vertex must stay outside: its neighbour inside must be one of the outermost,
    /// or it must lie on a free boundary.
    fn edge_to_split(&self, editor: &Editor) -> Option<HalfedgeId> {
        let connectivity = &editor.mesh.connectivity;
        let stays_outside = |h: HalfedgeId| {
            let outermost = |h: HalfedgeId| {
                let apex = connectivity.apex(h);
                !self.inside(apex) || self.distance[apex] == self.level
            };
            let boundary_edge = connectivity.twin(h).is_none();
            let free = editor.boundary == BoundaryCondition::Free;
            (boundary_edge && free) || (outermost(h) && connectivity.twin(h).is_none_or(outermost))
        };
        self.link
            .iter()
            .copied()
            .filter(|&h| stays_outside(h))
            .max_by(|&g, &h| editor.by_length(g, h))
    }

    fn split(&mut self, editor: &mut Editor, h: HalfedgeId) -> Result<(), OutOfSplits> {
        let connectivity = &editor.mesh.connectivity;
        let twin = connectivity.twin(h);
        let m = editor.split_edge(connectivity.edge(h))?;
        let connectivity = &editor.mesh.connectivity;
        let enters = Self::may_enter(editor, m);
        self.distance
            .push(if enters { self.level + 1 } else { UNREACHED });
        if enters {
            self.frontier.push(m);
        }
        while self.touched.len() < connectivity.face_count() {
            self.touched.push(false);
        }
        // The halves of the halfedge at a corner inside are both in the link: the old id runs to m or from m, the
        // other half is found across the spoke to that corner.
        for side in std::iter::once(h).chain(twin) {
            if !self.inside(connectivity.apex(side)) {
                continue;
            }
            // `side` keeps its tail and now ends in m; past the spoke m → apex lies the other half.
            let spoke = connectivity.next(side);
            let Some(across) = connectivity.twin(spoke) else {
                continue;
            };
            let other = connectivity.next(across);
            self.touched[connectivity.face(other)] = true;
            self.touched_count += 1;
            self.link.push(other);
        }
        Ok(())
    }
}
