//! Connectivity repair around cones (tutorial 5.3): more edges where much negative curvature must fit.
//!
//! *Enters:* a mesh and its prescription. *Leaves:* the same surface, point for point, with more vertices; the
//! prescription, extended; how many splits that took.
//!
//! # Criteria
//!
//! A circle packing with curvature K̄ exists only where (6) holds for *every* vertex set I. With Φ ≡ 0 it says
//! |Lk(I)| > D(I)/π, where Lk(I) are the edges opposite to I in faces with one corner in I, and
//! D(I) = 2πχ(F_I) − Σ_I K̄ (on a boundary that is not free each boundary vertex counts π instead of 2π, and
//! D changes accordingly). Two families of sets are watched:
//!
//! 1. **Disks around a cone** (`links`): all vertices at most k edges from it. The link shall have at least 2D/π edges up
//!    to k = `rings`, and 1.5 D/π beyond. For the cone alone (k = 0) that is the tutorial's valence ≥ 4 − 2K̄/π;
//!    for the disks it is the same count, since D does not change as long as the disk stays a disk.
//!    Raising the cone's valence alone is not enough: a −12π cone needs more than 14 edges around *every* disk.
//! 2. **Vertices in the first rings** (`rings`): valence ≥ 6 (`ring_valence`), but for other cones and for the boundary.
//!
//! On a boundary that is not free every vertex must moreover have angle enough: about 2 − 2K̄/π faces.
//!
//! # Operations
//!
//! Edge splits at the midpoint and, rarely, face splits at the centroid: the surface stays where it is (Hausdorff distance 0)
//! and no edge is doubled, since all edges at a new vertex are new. Splitting the edge opposite to v in a face at v
//! raises v's valence by one; no split lowers any valence, so what holds stays true.
//! Longest edges go first, which spreads the splits evenly.
//!
//! The criteria are for every flow that keeps the connectivity, also where no (6) is known. *Not guaranteed:* that (6) then holds for
//! every set: a disk of rings may pass a narrow neck askew, and the shortest loop around the neck is what counts. For
//! circle packings [`make_packable`] decides (6), and splits more edges where it fails, until it holds.

mod cuts;
mod links;
mod packable;
mod rings;

pub use packable::make_packable;

use crate::flow::cones::{BoundaryCondition, Prescription};
use crate::flow::feasibility::Violation;
use crate::flow::ricci::FlowParams;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeId, FaceId, HalfedgeId, NONE, VertexId, VertexVec};
use crate::geometry::mesh::Mesh;
use crate::product::ConnectivityRepair;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// How many times the edges that (6) demands shall be there beyond the first rings: with hardly more than (6) demands,
/// the circles of one face differ in size by more than float64 can hold.
const MARGIN: f64 = 1.5;

/// What connectivity repair shall reach.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RefineParams {
    /// False leaves the connectivity as it is. Absent: true where the flow keeps the connectivity, false where it flips edges,
    /// since it hardly buys anything there; see [`is_enabled`](Self::is_enabled).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub enabled: Option<bool>,
    /// Rings around each cone whose vertices get `ring_valence`, 0 to 3.
    pub rings: usize,
    /// Least valence of the vertices in those rings, 3 to 8.
    pub ring_valence: usize,
    /// Least valence of all other interior vertices, 0 to 4; 4 removes the valence-3 vertices that the packings with
    /// intersecting circles cannot flatten.
    pub flat_vertex_valence: usize,
}

impl Default for RefineParams {
    fn default() -> Self {
        Self {
            enabled: None,
            rings: 2,
            ring_valence: 6,
            flat_vertex_valence: 0,
        }
    }
}

/// Why the criteria were not reached.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RefineError {
    /// A parameter is out of range.
    #[error("connectivity.{key} is {given}, but must be {low} to {high}")]
    OutOfRange {
        /// Key.
        key: &'static str,
        /// Given.
        given: usize,
        /// Least allowed.
        low: usize,
        /// Most allowed.
        high: usize,
    },
    /// The bound on splits was reached.
    #[error(
        "{splits} splits did not give the neighbourhoods of the {cones} cones enough edges: set connectivity.rings = {}, spread the curvature over more cones, or refine the mesh there",
        rings.saturating_sub(1)
    )]
    TooManySplits {
        /// Splits made.
        splits: usize,
        /// Number of cones.
        cones: usize,
        /// Rings asked for.
        rings: usize,
    },
    /// No number of splits that was tried made room for a circle packing.
    #[error(
        "no circle packing exists, even after {splits} splits around such regions: {}; spread the curvature over more cones, move them, or use the scheme `vertex-scaling` with flow.delaunay = true", violation.inequality()
    )]
    StillInfeasible {
        /// Splits made.
        splits: usize,
        /// The worst region that is left; vertices of the file.
        violation: Violation,
    },
}

/// Splits edges around cones until the criteria of the module docs hold; does nothing where they hold already. Whether it is
/// wanted is for the caller to ask ([`RefineParams::is_enabled`]).
pub fn refine(
    mesh: Mesh,
    prescription: Prescription,
    params: &RefineParams,
) -> Result<(Mesh, Prescription, ConnectivityRepair), RefineError> {
    params.check()?;
    let need: f64 = prescription
        .cones
        .iter()
        .map(|c| (4.0 - 2.0 * c.curvature / PI).max(0.0))
        .sum();
    // Rings of a cone of valence N hold about N, 2N, 3N vertices, each of which takes up to three splits.
    let most_splits = 1000 + 100 * need.ceil() as usize;
    let mut editor = Editor::new(mesh, prescription, most_splits);
    let result = editor.meet_criteria(params);
    result.map_err(|OutOfSplits| RefineError::TooManySplits {
        splits: editor.splits,
        cones: editor.interior_cones().len(),
        rings: params.rings,
    })?;
    let flat = raise_flat_vertices(&mut editor, params.flat_vertex_valence);
    flat.map_err(|OutOfSplits| RefineError::TooManySplits {
        splits: editor.splits,
        cones: editor.interior_cones().len(),
        rings: params.rings,
    })?;
    Ok(editor.finish())
}

/// Number in the file of a vertex, or of one beside it where repair put it in.
pub(crate) fn source_vertex(mesh: &Mesh, v: VertexId) -> u32 {
    let around = std::iter::once(v).chain(mesh.connectivity.neighbours(v));
    let mut known = around.map(|w| mesh.source_vertex[w]).filter(|&s| s != NONE);
    known.next().unwrap_or(v.raw())
}

/// The same with the vertices of the file: those that repair put in are left out of the list, but counted.
pub(crate) fn in_source(violation: Violation, mesh: &Mesh) -> Violation {
    let named = |v: VertexId| VertexId::new(source_vertex(mesh, v) as usize);
    let mut vertices: Vec<VertexId> = (violation.vertices.iter())
        .filter(|&&v| mesh.source_vertex[v] != NONE)
        .map(|&v| named(v))
        .collect();
    vertices.sort_unstable();
    Violation {
        vertex: named(violation.vertex),
        vertices,
        ..violation
    }
}

fn raise_flat_vertices(editor: &mut Editor, valence: usize) -> Result<(), OutOfSplits> {
    let connectivity = &editor.mesh.connectivity;
    let wanted: BTreeMap<VertexId, usize> = connectivity
        .vertices()
        .filter(|&v| editor.target[v] == 0.0 && !connectivity.is_boundary_vertex(v))
        .filter(|&v| connectivity.valence(v) < valence)
        .map(|v| (v, valence))
        .collect();
    editor.most_splits = editor.most_splits.saturating_add(2 * wanted.len());
    raise_all(editor, &wanted)
}

fn raise_all(editor: &mut Editor, wanted: &BTreeMap<VertexId, usize>) -> Result<(), OutOfSplits> {
    for (&v, &valence) in wanted {
        while editor.mesh.connectivity.valence(v) < valence {
            let lacks =
                |c: &Connectivity, w: VertexId| wanted.get(&w).is_some_and(|&n| c.valence(w) < n);
            let connectivity = &editor.mesh.connectivity;
            let best = editor.opposite_edges(v).max_by(|&g, &h| {
                let pairs = |h: HalfedgeId| {
                    let across = connectivity.twin(h).map(|t| connectivity.apex(t));
                    across.is_some_and(|w| lacks(connectivity, w))
                };
                let first = pairs(g).cmp(&pairs(h));
                first.then(editor.by_length(g, h))
            });
            let Some(h) = best else { break };
            let e = connectivity.edge(h);
            editor.split_edge(e)?;
        }
    }
    Ok(())
}

impl RefineParams {
    /// Whether connectivity is repaired before this flow. Packings exist only where (6) holds, and schemes that keep the
    /// connectivity break fewer triangles for it. With flips a metric exists always, and splits hardly change its quality but
    /// enlarge the overlay (benches/README.md has the figures).
    pub fn is_enabled(&self, flow: &FlowParams) -> bool {
        self.enabled.unwrap_or(!flow.flips())
    }

    fn check(&self) -> Result<(), RefineError> {
        for (key, given, low, high) in [
            ("rings", self.rings, 0, 3),
            ("ring_valence", self.ring_valence, 3, 8),
            ("flat_vertex_valence", self.flat_vertex_valence, 0, 4),
        ] {
            if !(low..=high).contains(&given) {
                return Err(RefineError::OutOfRange {
                    key,
                    given,
                    low,
                    high,
                });
            }
        }
        Ok(())
    }
}

/// The bound on splits was reached.
#[derive(Debug)]
struct OutOfSplits;

/// The mesh while it is being split.
struct Editor {
    mesh: Mesh,
    target: VertexVec<f64>,
    boundary: BoundaryCondition,
    /// Vertices before the first split.
    original_vertices: usize,
    splits: usize,
    most_splits: usize,
}

impl Editor {
    fn new(mesh: Mesh, prescription: Prescription, most_splits: usize) -> Self {
        Self {
            original_vertices: mesh.connectivity.vertex_count(),
            mesh,
            target: prescription.target,
            boundary: prescription.boundary,
            splits: 0,
            most_splits,
        }
    }

    fn meet_criteria(&mut self, params: &RefineParams) -> Result<(), OutOfSplits> {
        self.widen_boundary_angles()?;
        loop {
            let before = self.splits;
            for cone in self.interior_cones() {
                links::widen(self, cone, params.rings)?;
            }
            rings::raise(self, params)?;
            if self.splits == before {
                return Ok(());
            }
        }
    }

    fn interior_cones(&self) -> Vec<VertexId> {
        let connectivity = &self.mesh.connectivity;
        let vertices = connectivity.vertices();
        vertices
            .filter(|&v| self.target[v] != 0.0 && !connectivity.is_boundary_vertex(v))
            .collect()
    }

    /// Where the curvature of the boundary is prescribed: faces enough at each of its vertices that their angles are at most
    /// about π/2. Half a face is granted, so that a long boundary of small negative curvature is not refined all along.
    fn widen_boundary_angles(&mut self) -> Result<(), OutOfSplits> {
        if self.boundary == BoundaryCondition::Free {
            return Ok(());
        }
        for i in 0..self.original_vertices {
            let v = VertexId::new(i);
            if !self.mesh.connectivity.is_boundary_vertex(v) {
                continue;
            }
            let need = (1.5 - 2.0 * self.target[v] / PI - 1e-9).ceil();
            while (self.mesh.connectivity.outgoing(v).count() as f64) < need {
                let best = self.opposite_edges(v).max_by(|&g, &h| self.by_length(g, h));
                let Some(h) = best else { break };
                self.split_edge(self.mesh.connectivity.edge(h))?;
            }
        }
        Ok(())
    }

    /// The halfedges opposite to a vertex, one a face.
    fn opposite_edges(&self, v: VertexId) -> impl Iterator<Item = HalfedgeId> + '_ {
        let connectivity = &self.mesh.connectivity;
        connectivity.outgoing(v).map(|h| connectivity.next(h))
    }

    /// Which edge to split rather: inner before boundary edges, long before short ones, then the lower halfedge.
    fn by_length(&self, g: HalfedgeId, h: HalfedgeId) -> std::cmp::Ordering {
        let connectivity = &self.mesh.connectivity;
        let key = |h: HalfedgeId| {
            let e = connectivity.edge(h);
            (!connectivity.is_boundary_edge(e), self.mesh.edge_length(e))
        };
        let ((inner_g, length_g), (inner_h, length_h)) = (key(g), key(h));
        let order = inner_g.cmp(&inner_h);
        order.then(length_g.total_cmp(&length_h)).then(h.cmp(&g))
    }

    fn split_edge(&mut self, e: EdgeId) -> Result<VertexId, OutOfSplits> {
        self.count_split()?;
        self.target.push(0.0);
        Ok(self.mesh.split_edge(e, 0.5))
    }

    fn split_face(&mut self, f: FaceId) -> Result<VertexId, OutOfSplits> {
        self.count_split()?;
        self.target.push(0.0);
        Ok(self.mesh.split_face(f, [1.0 / 3.0; 3]))
    }

    fn count_split(&mut self) -> Result<(), OutOfSplits> {
        if self.splits >= self.most_splits {
            return Err(OutOfSplits);
        }
        self.splits += 1;
        Ok(())
    }

    /// The result; new vertices on a uniform boundary take their share. Where single boundary vertices are prescribed, they keep
    /// what they have, and the border is straight at a new vertex.
    fn finish(mut self) -> (Mesh, Prescription, ConnectivityRepair) {
        self.share_uniform_curvature();
        let repair = ConnectivityRepair {
            splits: self.splits,
            flips: 0,
            hausdorff: 0.0,
        };
        let prescription = Prescription::new(self.target, self.boundary);
        (self.mesh, prescription, repair)
    }

    /// Every loop keeps its total: its new vertices and those with the loop's most frequent curvature share what they have.
    /// Doing it again changes nothing.
    fn share_uniform_curvature(&mut self) {
        if self.boundary != BoundaryCondition::Uniform {
            return;
        }
        for chain in self.mesh.connectivity.boundary_loops() {
            let vertices = chain.iter().map(|&h| self.mesh.connectivity.tail(h));
            let (new, old): (Vec<VertexId>, Vec<VertexId>) =
                vertices.partition(|v| v.index() >= self.original_vertices);
            let mut frequency: BTreeMap<u64, usize> = BTreeMap::new();
            for &v in &old {
                *frequency.entry(self.target[v].to_bits()).or_default() += 1;
            }
            let most = frequency
                .iter()
                .max_by_key(|(bits, count)| (**count, **bits));
            let Some((&bits, &count)) = most.filter(|_| !new.is_empty()) else {
                continue;
            };
            let held: f64 = new.iter().map(|&v| self.target[v]).sum();
            let total = f64::from_bits(bits) * count as f64 + held;
            let share = total / (count + new.len()) as f64;
            let sharing: Vec<VertexId> = old
                .into_iter()
                .filter(|&v| self.target[v].to_bits() == bits)
                .collect();
            for v in sharing.into_iter().chain(new) {
                self.target[v] = share;
            }
        }
    }
}

#[cfg(test)]
mod tests;
