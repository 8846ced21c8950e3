//! A mesh and its prescription while edges are being split.

use crate::flow::prescription::{BoundaryCondition, Prescription};
use crate::geometry::ids::{EdgeId, FaceId, HalfedgeId, VertexId, VertexVec};
use crate::geometry::mesh::Mesh;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// What connectivity repair changed (tutorial 5.3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ConnectivityRepair {
    /// Edge and face splits.
    pub splits: usize,
    /// Edge flips.
    pub flips: usize,
    /// Hausdorff distance to the surface before, source units; 0 for splits.
    pub hausdorff: f64,
}

/// The bound on splits was reached.
#[derive(Debug)]
pub(super) struct OutOfSplits;

/// The mesh while it is being split.
pub(super) struct Editor {
    pub(super) mesh: Mesh,
    pub(super) target: VertexVec<f64>,
    pub(super) boundary: BoundaryCondition,
    /// Vertices before the first split.
    pub(super) original_vertices: usize,
    pub(super) splits: usize,
    pub(super) most_splits: usize,
}

impl Editor {
    pub(super) fn new(mesh: Mesh, prescription: Prescription, most_splits: usize) -> Self {
        Self {
            original_vertices: mesh.connectivity.vertex_count(),
            mesh,
            target: prescription.target,
            boundary: prescription.boundary,
            splits: 0,
            most_splits,
        }
    }

    pub(super) fn interior_cones(&self) -> Vec<VertexId> {
        let connectivity = &self.mesh.connectivity;
        let vertices = connectivity.vertices();
        vertices
            .filter(|&v| self.target[v] != 0.0 && !connectivity.is_boundary_vertex(v))
            .collect()
    }

    /// Where the curvature of the boundary is prescribed: faces enough at each of its vertices that their angles are at most
    /// about π/2. Half a face is granted, so that a long boundary of small negative curvature is not refined all along.
    pub(super) fn widen_boundary_angles(&mut self) -> Result<(), OutOfSplits> {
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
    pub(super) fn opposite_edges(&self, v: VertexId) -> impl Iterator<Item = HalfedgeId> + '_ {
        let connectivity = &self.mesh.connectivity;
        connectivity.outgoing(v).map(|h| connectivity.next(h))
    }

    /// Which edge to split rather: inner before boundary edges, long before short ones, then the lower halfedge.
    pub(super) fn by_length(&self, g: HalfedgeId, h: HalfedgeId) -> std::cmp::Ordering {
        let connectivity = &self.mesh.connectivity;
        let key = |h: HalfedgeId| {
            let e = connectivity.edge(h);
            (!connectivity.is_boundary_edge(e), self.mesh.edge_length(e))
        };
        let ((inner_g, length_g), (inner_h, length_h)) = (key(g), key(h));
        let order = inner_g.cmp(&inner_h);
        order.then(length_g.total_cmp(&length_h)).then(h.cmp(&g))
    }

    pub(super) fn split_edge(&mut self, e: EdgeId) -> Result<VertexId, OutOfSplits> {
        self.count_split()?;
        self.target.push(0.0);
        Ok(self.mesh.split_edge(e, 0.5))
    }

    pub(super) fn split_face(&mut self, f: FaceId) -> Result<VertexId, OutOfSplits> {
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
    pub(super) fn finish(mut self) -> (Mesh, Prescription, ConnectivityRepair) {
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
    pub(super) fn share_uniform_curvature(&mut self) {
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
