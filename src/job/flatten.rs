//! The first half of the pipeline: from a component and its cones to a slit surface with a flat metric.
//!
//! *Enters:* a mesh and its target curvature. *Leaves:* a [`Flattened`] surface: the refined mesh with its flat metric, and the cut
//! that opens it into a disk. What a build and a survey of cones have in common; it depends on nothing that
//! either does afterwards.

use super::BuildError;
use crate::atlas::cut::{self, CutGraph};
use crate::atlas::overlay::{self, Layout, Overlay};
use crate::atlas::patch::Domain;
use crate::config::Config;
use crate::flow::cones::{self, ConeError, Requests};
use crate::flow::prescription::Prescription;
use crate::flow::refine::ConnectivityRepair;
use crate::flow::refine::{self, RefineError};
use crate::flow::ricci::{self, FlatMetric, FlowError, Holonomy};
use crate::geometry::ids::EdgeVec;
use crate::geometry::mesh::Mesh;
use crate::grid::{self, GridError, Spacing};
use crate::observe::Observer;

/// A slit surface with a flat metric, before it is developed.
pub(super) struct Flattened {
    /// Surface after connectivity repair, refined by the flat triangulation. Its first vertices are those it had before.
    pub mesh: Mesh,
    /// Flat metric on its edges.
    pub metric: FlatMetric,
    /// Target curvature of its vertices.
    pub prescription: Prescription,
    /// What is cut and developed.
    pub layout: Layout,
    /// The cut on the layout.
    pub layout_cut: CutGraph,
    /// The cut on the mesh.
    pub cut: CutGraph,
    /// What connectivity repair changed.
    pub connectivity_repair: ConnectivityRepair,
}

/// Target curvature of a component, as its configuration asks for it.
pub(super) fn prescribed(
    mesh: &Mesh,
    requests: &Requests,
    config: &Config,
) -> Result<Prescription, ConeError> {
    let mut features = config.features.clone();
    if config.domain() == Domain::Grid {
        features.cell = (config.grid.cells as f64).sqrt().recip();
    }
    cones::prescribe(mesh, requests, &config.cones, &config.boundary, &features)
}

/// The mesh that cones and flow work on: for a grid with the vertices that it may want cones at, so far apart.
pub(super) fn prepared(
    mesh: Mesh,
    requests: &Requests,
    config: &Config,
    spacing: Spacing,
) -> Result<Mesh, GridError> {
    if config.domain() != Domain::Grid {
        return Ok(mesh);
    }
    grid::check_inside(&mesh)?;
    // Features that were named are edges of the mesh as it is.
    Ok(match requests.features.is_empty() {
        true => grid::refined(mesh, spacing),
        false => mesh,
    })
}

/// The same as a build tries it first.
pub(super) fn prepared_at_first(
    mesh: Mesh,
    requests: &Requests,
    config: &Config,
) -> Result<Mesh, GridError> {
    prepared(mesh, requests, config, grid::spacings(config.grid.cells)[0])
}

/// Repairs connectivity, flows, refines and cuts. `enter` is told each stage's name before it begins, and may stop the job.
pub(super) fn flatten(
    mesh: Mesh,
    prescription: Prescription,
    config: &Config,
    observer: &dyn Observer,
    enter: &impl Fn(&'static str) -> Result<(), BuildError>,
) -> Result<Flattened, BuildError> {
    enter("connectivity")?;
    let is_repaired = config.connectivity.is_enabled(&config.flow);
    if is_repaired && config.flow.holonomy == Holonomy::QuarterTurns {
        let setting = "connectivity.enabled = true";
        return Err(BuildError::flow(
            FlowError::QuarterTurnsWithout { setting },
            &mesh,
        ));
    }
    let (mesh, prescription, connectivity_repair) = refine_for(config, mesh, prescription)?;
    let source_length = edge_lengths(&mesh);
    let c = &mesh.connectivity;
    enter("flow")?;
    let metric = ricci::flow(c, &source_length, &prescription, &config.flow, observer)
        .map_err(|e| BuildError::flow(e, &mesh))?;
    if config.domain() == Domain::Grid {
        grid::check_range(metric.log_scale.as_slice())?;
    }
    let prescription = Prescription {
        // Of no use any more, and as large as the surface.
        field: None,
        ..prescription
    };
    enter("overlay")?;
    let Overlay {
        mesh,
        metric,
        prescription,
        layout,
        unmatched,
        ..
    } = overlay::overlay(mesh, metric, prescription)?;
    if unmatched > 0 {
        tracing::warn!(unmatched, "crossings were placed between their neighbours");
    }
    enter("cut")?;
    let layout_cut = cut::cut(&layout.connectivity, &layout.cut_cost(&mesh), &prescription)?;
    let cut = layout.lift(&layout_cut, &mesh.connectivity);
    Ok(Flattened {
        mesh,
        metric,
        prescription,
        layout,
        layout_cut,
        cut,
        connectivity_repair,
    })
}

/// Connectivity repair (5.3) where the flow profits from it: around cones, then wherever the scheme's packing could not exist.
pub(super) fn refine_for(
    config: &Config,
    mesh: Mesh,
    prescription: Prescription,
) -> Result<(Mesh, Prescription, ConnectivityRepair), RefineError> {
    let params = &config.connectivity;
    if !params.is_enabled(&config.flow) {
        return Ok((mesh, prescription, ConnectivityRepair::default()));
    }
    let (mesh, prescription, done) = refine::refine(mesh, prescription, params)?;
    refine::make_packable(mesh, prescription, done, config.flow.scheme)
}

/// Length of every edge in space, source units.
fn edge_lengths(mesh: &Mesh) -> EdgeVec<f64> {
    let edges = mesh.connectivity.edges();
    edges.map(|e| mesh.edge_length(e)).collect()
}
