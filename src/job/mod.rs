//! The main job: one asset from file to folder.
//!
//! `build_component` is the pipeline of the tutorial (5.1) on one page: data only flows forward, and a finished
//! value is never changed. [`build`] does it for every component of a mesh in memory, [`run`] for a file,
//! [`inspect`] stops before the flow.

mod error;
mod inspect;

pub use error::BuildError;
pub use inspect::{Inspection, inspect};

use crate::atlas::develop::Development;
use crate::atlas::overlay::Overlay;
use crate::atlas::{charts, cut, develop, geometry_image, overlay, patches};
use crate::config::Config;
use crate::export::folder::{Staging, component_name, list_files};
use crate::export::{self, ExportError, Provenance, pictures};
use crate::flow::cones::{self, Prescription, Requests};
use crate::flow::refine::{self, RefineError};
use crate::flow::ricci;
use crate::geometry::ids::EdgeVec;
use crate::geometry::mesh::{Mesh, Soup};
use crate::observe::Observer;
use crate::outcome::{AssetOutcome, AssetState, ComponentOutcome, Failure, Summary};
use crate::product::{AffineAtlas, ConnectivityRepair};
use crate::read::{self, SourceAsset};
use crate::repair::{self, Component};
use crate::report;
use std::path::Path;
use std::time::Instant;

/// Builds the atlas of every component of a mesh in memory. One bad component does not spoil the
/// others; what concerns the whole mesh is the outer error.
pub fn build(
    soup: &Soup,
    config: &Config,
    observer: &dyn Observer,
) -> Result<Vec<Result<AffineAtlas, BuildError>>, BuildError> {
    observer.stage("repair", 0, 1);
    let repaired = repair::repair(soup, &config.repair)?;
    let requests = cones::assign(&repaired, &config.cones, &config.boundary)?;
    let count = repaired.components.len();
    let parts = repaired.components.into_iter().zip(requests).enumerate();
    Ok(parts
        .map(|(i, (component, requests))| {
            let enter = |stage| {
                if observer.cancelled() {
                    return Err(BuildError::Cancelled);
                }
                observer.stage(stage, i, count);
                Ok(())
            };
            build_component(component, &requests, config, observer, enter)
        })
        .collect())
}

/// The pipeline. `enter` is told each stage's name before it begins, and may stop the job.
fn build_component(
    component: Component,
    requests: &Requests,
    config: &Config,
    observer: &dyn Observer,
    enter: impl Fn(&'static str) -> Result<(), BuildError>,
) -> Result<AffineAtlas, BuildError> {
    enter("cones")?;
    let mesh = component.mesh?;
    let prescription = cones::prescribe(&mesh, requests, &config.cones, &config.boundary)?;
    enter("connectivity")?;
    let (mesh, prescription, connectivity_repair) = refine_for(config, mesh, prescription)?;
    let source_length = edge_lengths(&mesh);
    let c = &mesh.connectivity;
    enter("flow")?;
    let metric = ricci::flow(c, &source_length, &prescription, &config.flow, observer)
        .map_err(|e| BuildError::flow(e, &mesh))?;
    enter("overlay")?;
    let Overlay {
        mesh,
        metric,
        prescription,
        layout,
        unmatched,
    } = overlay::overlay(mesh, metric, prescription)?;
    if unmatched > 0 {
        tracing::warn!(unmatched, "crossings were placed between their neighbours");
    }
    let c = &mesh.connectivity;
    enter("cut")?;
    let layout_cut = cut::cut(&layout.connectivity, &layout.cut_cost(&mesh), &prescription)?;
    let cut = layout.lift(&layout_cut, c);
    enter("charts")?;
    let unfolded = develop::develop(&layout, layout_cut)?;
    let central = Development::place(c, &cut, &layout, &unfolded);
    let charts = charts::chart(c, &cut, &central, &layout, &unfolded, &prescription)?;
    enter("patches")?;
    let under = Some((&layout, &unfolded));
    let patches = patches::layout(
        &mesh,
        &metric.length,
        &cut,
        &central,
        under,
        &config.patches,
    )?;
    enter("images")?;
    let image_origin = geometry_image::image_origin(&mesh);
    let images = geometry_image::sample(&mesh, &patches, &metric.log_scale, image_origin);
    enter("report")?;
    let quality = report::measure(&mesh, &metric, &cut, &central, &charts, &prescription);
    Ok(AffineAtlas {
        topology: mesh.connectivity.topology(),
        seamless: report::is_seamless(&charts),
        repair: component.log.counts(),
        flow: config.flow.clone(),
        mesh,
        prescription,
        metric,
        cut,
        central,
        charts,
        patches,
        images,
        image_origin,
        connectivity_repair,
        quality,
    })
}

/// Connectivity repair (5.3) where the flow profits from it: around cones, then wherever the scheme's packing could not exist.
fn refine_for(
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

/// Reads, builds and writes one asset into `output/id`. `given` is the path as the user wrote it.
///
/// The folder appears whole or not at all. Components that fail keep what an earlier run left of them.
pub fn run(
    path: &Path,
    given: &str,
    output: &Path,
    id: &str,
    config: &Config,
    observer: &dyn Observer,
) -> AssetOutcome {
    let start = Instant::now();
    let mut outcome = AssetOutcome::whole(id, AssetState::Cancelled, 0.0);
    let finished = run_stages(path, given, output, config, observer, &mut outcome);
    outcome.state = match finished {
        Ok(()) => AssetState::Built,
        Err(BuildError::Cancelled) => AssetState::Cancelled,
        Err(error) => AssetState::Failed(Failure::from(&error)),
    };
    outcome.seconds = start.elapsed().as_secs_f64();
    outcome
}

fn run_stages(
    path: &Path,
    given: &str,
    output: &Path,
    config: &Config,
    observer: &dyn Observer,
    outcome: &mut AssetOutcome,
) -> Result<(), BuildError> {
    observer.stage("read", 0, 1);
    let asset = read::read(path, &config.limits)?;
    outcome.input_hash = Some(asset.blake3.clone());
    outcome.notes.clone_from(&asset.notes);
    let atlases = build(&asset.soup, config, observer)?;
    if atlases
        .iter()
        .any(|a| matches!(a, Err(BuildError::Cancelled)))
    {
        return Err(BuildError::Cancelled);
    }
    observer.stage("write", 0, 1);
    let folder = output.join(&outcome.id);
    if atlases.iter().any(Result::is_ok) {
        write(
            &asset,
            given,
            output,
            &outcome.id,
            config,
            &atlases,
            observer,
        )?;
    }
    outcome.files = list_files(&folder).unwrap_or_default();
    let several = atlases.len() > 1;
    for (index, atlas) in atlases.iter().enumerate() {
        let folder = match several {
            true => folder.join(component_name(index)),
            false => folder.clone(),
        };
        let result = match atlas {
            Ok(atlas) => Ok(Summary::of(atlas, folder)),
            Err(error) => Err(Failure::from(error)),
        };
        outcome.components.push(ComponentOutcome { index, result });
    }
    Ok(())
}

/// Writes all components into one folder that replaces the older one in one step.
fn write(
    asset: &SourceAsset,
    given: &str,
    output: &Path,
    id: &str,
    config: &Config,
    atlases: &[Result<AffineAtlas, BuildError>],
    observer: &dyn Observer,
) -> Result<(), ExportError> {
    let go_on = || match observer.cancelled() {
        true => Err(ExportError::Interrupted),
        false => Ok(()),
    };
    let staging = Staging::begin(output, id)?;
    let config_blake3 = config.hash();
    for (component, atlas) in atlases.iter().enumerate() {
        let subfolder = match atlases.len() {
            1 => String::new(),
            _ => component_name(component),
        };
        let Ok(atlas) = atlas else {
            staging.keep_previous(&subfolder)?;
            continue;
        };
        let provenance = Provenance {
            path: given,
            blake3: &asset.blake3,
            config_blake3: &config_blake3,
            component,
            components: atlases.len(),
            parts: &asset.soup.parts,
            appearance: &asset.soup.appearance,
            asset: id,
        };
        export::write_component(&staging, &subfolder, atlas, &provenance)?;
        go_on()?;
        if config.pictures.enabled {
            pictures::write(&staging, &subfolder, atlas, config.pictures.size)?;
        }
        go_on()?;
    }
    staging.publish()
}
