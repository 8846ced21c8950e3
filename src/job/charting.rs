//! From a component to its charted surface: what atlases of one mesh with different grids have in common.

use super::BuildError;
use super::flatten::{Flattened, flatten, prepared, prescribed};
use crate::atlas::charted::Charted;
use crate::atlas::develop::{Development, Unfolded};
use crate::atlas::geometry_image::SourceSurface;
use crate::atlas::overlay::Layout;
use crate::atlas::patches::Domain;
use crate::atlas::{axes, charts, develop};
use crate::config::Config;
use crate::flow::cones::Requests;
use crate::flow::refine::ConnectivityRepair;
use crate::geometry::frame::Frame;
use crate::geometry::ids::VertexVec;
use crate::geometry::mesh::Mesh;
use crate::grid::{self, Spacing};
use crate::observe::Observer;
use crate::repair::{Component, RepairLog};

/// A component with charts, in its own frame.
pub(super) struct Charting {
    /// The surface.
    pub surface: Charted,
    /// What was developed.
    pub layout: Layout,
    /// Where it lies.
    pub unfolded: Unfolded,
    /// Vertices and faces after repair.
    pub given: VertexVec<[f64; 3]>,
    /// See above.
    pub given_faces: Vec<[u32; 3]>,
    /// What images sample of the input, where they do.
    pub source: Option<SourceSurface>,
    /// From source units to its own.
    pub frame: Frame,
    /// What repair changed.
    pub log: RepairLog,
    /// What connectivity repair changed.
    pub connectivity_repair: ConnectivityRepair,
}

/// Cones, flow, cut and charts; `spacing` is that of new vertices, for a grid. `enter` is told each stage's name before it begins, and may stop the job.
pub(super) fn chart(
    component: Component,
    requests: &Requests,
    config: &Config,
    spacing: Spacing,
    observer: &dyn Observer,
    enter: &impl Fn(&'static str) -> Result<(), BuildError>,
) -> Result<Charting, BuildError> {
    enter("cones")?;
    let (frame, log) = (component.frame, component.log);
    let mesh: Mesh = component.mesh?;
    let (given, given_faces) = (mesh.positions.clone(), mesh.connectivity.to_faces());
    let source = SourceSurface::of(&mesh, &config.images);
    let mesh = prepared(mesh, requests, config, spacing)?;
    let before = mesh.positions.len();
    let prescription = prescribed(&mesh, requests, config)?;
    let Flattened {
        mesh,
        metric,
        prescription,
        layout,
        layout_cut,
        cut,
        connectivity_repair,
    } = flatten(mesh, prescription, config, observer, enter)?;
    if config.domain() == Domain::Grid {
        grid::check_size(before, mesh.positions.len())?;
    }
    let c = &mesh.connectivity;
    enter("charts")?;
    let mut unfolded = develop::develop(&layout, layout_cut)?;
    let mut central = Development::place(c, &cut, &layout, &unfolded);
    if let Some(met) = &metric.quarter_turns {
        let axis = axes::axis(&mesh, &cut, &central, &met.lines);
        unfolded.turn(-axis);
        central.turn(-axis);
    }
    let mut charts = charts::chart(c, &cut, &central, &layout, &unfolded, &prescription)?;
    if metric.quarter_turns.is_some() {
        charts.turn_like_central();
    }
    Ok(Charting {
        surface: Charted {
            mesh,
            metric,
            prescription,
            cut,
            central,
            charts,
        },
        layout,
        unfolded,
        given,
        given_faces,
        source,
        frame,
        log,
        connectivity_repair,
    })
}
