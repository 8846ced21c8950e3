//! The overlay of a surface that was cut open along features, glued again.
//!
//! *Enters:* a mesh with a metric whose triangulations are those of what was left when it was cut open; the overlay of that. *Leaves:* the overlay of the mesh.
//! *Guaranteed:* nothing but vertices and edges changes; both sides of a feature meet, since it is an edge of the mesh and of the final triangulation, so nothing
//! crosses it.

use super::layout::Refinement;
use super::{Layout, Overlay, OverlayError};
use crate::flow::opened::Opened;
use crate::flow::prescription::Prescription;
use crate::flow::ricci::FlatMetric;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, HalfedgeId, HalfedgeVec, VertexId, VertexVec};
use crate::geometry::mesh::Mesh;
use std::collections::BTreeMap;

/// The same surface with the vertices and edges that it has where it is cut open; faces and corners stay.
pub(super) fn open(mesh: Mesh, opened: &Opened) -> Mesh {
    Mesh {
        connectivity: opened.connectivity.clone(),
        positions: of_sectors(&mesh.positions, opened),
        source_vertex: of_sectors(&mesh.source_vertex, opened),
        ..mesh
    }
}

/// Values of vertices given to all of their sectors.
pub(super) fn of_sectors<T: Copy>(value: &VertexVec<T>, opened: &Opened) -> VertexVec<T> {
    opened.vertex.iter().map(|&v| value[v]).collect()
}

/// Glues what was cut open. `of_vertex`: metric and prescription of the mesh as it was.
pub(super) fn weld(
    overlay: Overlay,
    opened: &Opened,
    metric: &FlatMetric,
    prescription: Prescription,
) -> Result<Overlay, OverlayError> {
    let vertices = metric.curvature.len();
    let weld = Weld { opened, vertices };
    let Overlay {
        mesh,
        metric: refined,
        layout,
        on_base,
        unmatched,
        ..
    } = overlay;
    let connectivity = weld.connectivity(&mesh.connectivity)?;
    let metric = FlatMetric {
        log_scale: weld.vertices(&refined.log_scale, &metric.log_scale),
        length: weld.edges(&mesh.connectivity, &connectivity, &refined.length),
        curvature: weld.vertices(&refined.curvature, &metric.curvature),
        ..refined
    };
    let target = prescription.target.clone();
    let zero = VertexVec::filled(0.0, mesh.positions.len());
    let prescription = Prescription {
        target: weld.vertices(&zero, &target),
        ..prescription
    };
    // Every sector has the values of its vertex.
    let original = |all: usize| weld.kept(all);
    let positions = original(mesh.positions.len()).map(|v| mesh.positions[v]);
    let source_vertex = original(mesh.positions.len()).map(|v| mesh.source_vertex[v]);
    Ok(Overlay {
        layout: weld.layout(layout)?,
        mesh: Mesh {
            positions: positions.collect(),
            source_vertex: source_vertex.collect(),
            connectivity,
            ..mesh
        },
        metric,
        prescription,
        on_base,
        unmatched,
    })
}

struct Weld<'a> {
    opened: &'a Opened,
    /// Number of vertices of the mesh.
    vertices: usize,
}

impl Weld<'_> {
    /// Where a vertex goes: a sector to its vertex, what was added after all vertices.
    fn target(&self, v: VertexId) -> VertexId {
        match self.opened.vertex.as_slice().get(v.index()) {
            Some(&of) => of,
            None => VertexId::new(v.index() - self.opened.vertex.len() + self.vertices),
        }
    }

    /// One of the vertices that go to each place.
    fn kept(&self, all: usize) -> impl Iterator<Item = VertexId> {
        // The first sector of a vertex has its id.
        let added = self.opened.vertex.len()..all;
        (0..self.vertices).chain(added).map(VertexId::new)
    }

    fn vertices<T: Copy>(&self, value: &VertexVec<T>, own: &VertexVec<T>) -> VertexVec<T> {
        let added = value.iter().skip(self.opened.vertex.len());
        own.iter()
            .take(self.vertices)
            .chain(added)
            .copied()
            .collect()
    }

    fn connectivity(&self, c: &Connectivity) -> Result<Connectivity, OverlayError> {
        let sectors = self.opened.vertex.len();
        let ends = |c: &Connectivity, h| [c.tail(h), c.head(h)];
        let boundary = c.halfedges().filter(|&h| c.twin(h).is_none());
        let by_ends: BTreeMap<[VertexId; 2], HalfedgeId> =
            boundary.map(|h| (ends(c, h), h)).collect();
        let mut twin: Vec<Option<HalfedgeId>> = c.halfedges().map(|h| c.twin(h)).collect();
        for (i, pair) in self.opened.glued.iter().enumerate() {
            let sides = pair.map(|h| by_ends.get(&ends(&self.opened.connectivity, h)));
            let [Some(&h), Some(&t)] = sides else {
                return Err(OverlayError::inconsistent("side of feature edge", i));
            };
            (twin[h.index()], twin[t.index()]) = (Some(t), Some(h));
        }
        let tail: HalfedgeVec<VertexId> = c.halfedges().map(|h| self.target(c.tail(h))).collect();
        let count = c.vertex_count() - sectors + self.vertices;
        Ok(Connectivity::from_gluing(tail, &twin, count)?)
    }

    /// Values of edges, from the halfedge that an edge goes by.
    fn edges<T: Copy>(
        &self,
        from: &Connectivity,
        to: &Connectivity,
        value: &EdgeVec<T>,
    ) -> EdgeVec<T> {
        let of = |e| value[from.edge(to.edge_halfedge(e))];
        to.edges().map(of).collect()
    }

    fn layout(&self, layout: Layout) -> Result<Layout, OverlayError> {
        let from = &layout.connectivity;
        let to = self.connectivity(from)?;
        let refinement = layout.refinement.map(|refinement| {
            let Refinement {
                carrier,
                chain_first,
                chain,
            } = refinement;
            let mut made = Refinement {
                carrier,
                chain_first: vec![0],
                chain: Vec::with_capacity(chain.len()),
            };
            for e in to.edges() {
                let was = from.edge(to.edge_halfedge(e)).index();
                let range = chain_first[was] as usize..chain_first[was + 1] as usize;
                made.chain.extend(&chain[range]);
                made.chain_first.push(made.chain.len() as u32);
            }
            made
        });
        Ok(Layout {
            length: self.edges(from, &to, &layout.length),
            may_cut: self.edges(from, &to, &layout.may_cut),
            cell: layout.cell,
            connectivity: to,
            refinement,
        })
    }
}
