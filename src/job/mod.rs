//! The main job: one asset from file to folder.
//!
//! `build_component` is the pipeline of the tutorial (5.1) on one page, its first half on another (`flatten`): data only
//! flows forward, and a finished value is never changed. [`build`] does it for every component of a mesh in memory, [`run`] for a file,
//! [`inspect`] stops before the flow, [`survey`] tries different cones, [`rebuild`] goes back from images to a mesh, [`fit`] on to
//! spline surfaces, [`texture`] lays a pattern over the surface, [`explain`] says what is wrong.

mod error;
pub mod explain;
pub mod fit;
mod flatten;
mod inspect;
mod listing;
mod precision;
mod publication;
pub mod rebuild;
mod shares;
pub mod survey;
pub mod texture;

pub use error::{BuildError, Unverified};
pub use inspect::{Inspection, inspect};
pub use precision::{Cause, Precision};

use flatten::{Flattened, flatten, prescribed, refine_for};
use publication::Publication;

use crate::atlas::charted::Charted;
use crate::atlas::develop::Development;
use crate::atlas::geometry_image::SourceSurface;
use crate::atlas::patches::Domain;
use crate::atlas::{axes, charts, develop, geometry_image, patches, rectangles};
use crate::config::Config;
use crate::export::folder::list_files;
use crate::flow::cones::{self, Requests};
use crate::geometry::deviation::{Triangles, distances};
use crate::geometry::mesh::Soup;
use crate::grid;
use crate::observe::Observer;
use crate::outcome::{AssetOutcome, AssetState, ComponentOutcome, Failure, Summary};
use crate::product::AffineAtlas;
use crate::read;
use crate::rebuild::Images;
use crate::repair::{self, Component};
use crate::report;
use std::path::Path;
use std::time::Instant;

/// Builds the atlas of every component of a mesh in memory. One bad component does not spoil the
/// others; what concerns the whole mesh is the outer error. Images are without the channels that the mesh does not have
/// ([`ImageParams::lacking`](crate::atlas::geometry_image::ImageParams::lacking)).
pub fn build(
    soup: &Soup,
    config: &Config,
    observer: &dyn Observer,
) -> Result<Vec<Result<AffineAtlas, BuildError>>, BuildError> {
    let mut atlases = Vec::new();
    each(soup, config, observer, |part| {
        atlases.push(part.atlas);
        Ok(())
    })?;
    Ok(atlases)
}

/// What became of one component.
struct Part<'a> {
    index: usize,
    /// Of the mesh.
    components: usize,
    /// With its share of texels and pixels.
    config: &'a Config,
    atlas: Result<AffineAtlas, BuildError>,
}

/// Builds one component after the other and hands each on before it begins the next, so that no more than one atlas need be in memory.
fn each(
    soup: &Soup,
    config: &Config,
    observer: &dyn Observer,
    mut take: impl FnMut(Part<'_>) -> Result<(), BuildError>,
) -> Result<(), BuildError> {
    observer.stage("repair", 0, 1);
    let repaired = repair::repair(soup, &config.repair)?;
    let requests = cones::assign(&repaired, &config.cones, &config.boundary, &config.features)?;
    let config = &Config {
        images: config.images.held_by(soup),
        ..config.clone()
    };
    let shares = shares::shares(&repaired.components);
    let components = repaired.components.len();
    let parts = repaired.components.into_iter().zip(requests).zip(shares);
    for (index, ((component, requests), share)) in parts.enumerate() {
        let config = &shares::of_share(config, share);
        let stages = Observed {
            observer,
            component: index,
            components,
        };
        let enter = |stage| stages.enter(stage);
        take(Part {
            index,
            components,
            config,
            atlas: build_component(component, &requests, config, observer, enter),
        })?;
    }
    Ok(())
}

/// Who watches which component.
struct Observed<'a> {
    observer: &'a dyn Observer,
    component: usize,
    components: usize,
}

impl Observed<'_> {
    /// Tells that a stage begins, unless the job was to stop.
    fn enter(&self, stage: &'static str) -> Result<(), BuildError> {
        if self.observer.cancelled() {
            return Err(BuildError::Cancelled);
        }
        self.observer.stage(stage, self.component, self.components);
        Ok(())
    }
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
    let frame = component.frame;
    let mesh = component.mesh?;
    let prescription = prescribed(&mesh, requests, config)?;
    let (given, given_faces) = (mesh.positions.clone(), mesh.connectivity.to_faces());
    let source = SourceSurface::of(&mesh, &config.images);
    let Flattened {
        mesh,
        metric,
        prescription,
        layout,
        layout_cut,
        cut,
        connectivity_repair,
    } = flatten(mesh, prescription, config, observer, &enter)?;
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
    let surface = Charted {
        mesh,
        metric,
        prescription,
        cut,
        central,
        charts,
    };
    let in_patches = |surface: &Charted, domain: Domain| {
        let under = Some((&layout, &unfolded));
        patches::layout(
            &surface.mesh,
            &surface.metric.length,
            &surface.cut,
            &surface.central,
            under,
            domain,
            &config.patches,
        )
    };
    let (mut grid, mut no_grid) = (None, None);
    let (surface, patches) = match config.images.domain {
        Domain::Flat => {
            enter("patches")?;
            let patches = in_patches(&surface, Domain::Flat)?;
            (surface, patches)
        }
        Domain::Rectangle => {
            enter("patches")?;
            let patches = in_patches(&surface, Domain::Rectangle)?;
            enter("rectangles")?;
            let tolerance = config.flow.curvature_tolerance;
            rectangles::rectangles(surface, &patches, &config.patches, tolerance)?
        }
        Domain::Grid => {
            enter("grid")?;
            match grid::grid(surface, &config.grid, &config.patches) {
                Ok((surface, patches, found)) => {
                    grid = Some(found);
                    (surface, patches)
                }
                Err(refused) => {
                    let (surface, error) = *refused;
                    no_grid = Some(error);
                    enter("patches")?;
                    let patches = in_patches(&surface, Domain::Flat)?;
                    (surface, patches)
                }
            }
        }
    };
    let Charted {
        mesh,
        metric,
        prescription,
        cut,
        central,
        charts,
    } = surface;
    enter("images")?;
    let image_origin = geometry_image::image_origin(&mesh, &frame);
    let origin = frame.enter(image_origin);
    let images = geometry_image::sample(&mesh, &patches, &metric.log_scale, origin);
    let images = match &source {
        Some(source) => geometry_image::sample_attributes(&mesh, &patches, images, source),
        None => images,
    };
    let mut images = images;
    if let Some(grid) = &grid {
        grid.unite(&mut images);
    }
    enter("report")?;
    let topology = mesh.connectivity.topology();
    let quality = report::measure(&mesh, &metric, &cut, &central, &charts, &prescription);
    let given = Triangles {
        positions: given.as_slice(),
        faces: &given_faces,
    };
    let readable = Images::new(&patches, &images, origin);
    let (quality, rebuilt) = report::measure_images(
        quality,
        given,
        &readable,
        topology,
        config.patches.texel_budget,
    );
    let image_distance = rebuilt
        .filter(|_| config.report.enabled)
        .and_then(|rebuilt| {
            let rebuilt = Triangles {
                positions: &rebuilt.positions,
                faces: &rebuilt.faces,
            };
            distances(mesh.positions.as_slice(), rebuilt)
        });
    let atlas = AffineAtlas {
        topology,
        seamless: report::is_seamless(&charts),
        repair: component.log.counts(),
        repair_log: component.log,
        image_distance: image_distance.map(Into::into),
        flow: config.flow.clone(),
        mesh,
        prescription,
        metric,
        cut,
        central,
        charts,
        patches,
        grid,
        no_grid,
        images,
        image_params: config.images.clone(),
        image_origin,
        connectivity_repair,
        quality,
    };
    Ok(atlas.leave(&frame))
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
    for channel in config.images.lacking(&asset.soup) {
        let note = format!(
            "{given} has nothing for the channel \"{}\" of images.channels: its images are written without",
            channel.name()
        );
        tracing::warn!(asset = outcome.id, channel = channel.name(), "{note}");
        outcome.notes.push(note);
    }
    let folder = output.join(&outcome.id);
    let id = outcome.id.clone();
    let mut publication = Publication::new(&asset, given, output, &id, config, observer);
    let mut parts = Vec::new();
    each(&asset.soup, config, observer, |part| {
        let Part {
            index, components, ..
        } = part;
        let result = match part.atlas {
            Err(BuildError::Cancelled) => return Err(BuildError::Cancelled),
            Err(error) => {
                publication.leave_out(index, components);
                Err(error)
            }
            Ok(atlas) => {
                for note in warnings(&atlas, part.config) {
                    let note = match components {
                        1 => format!("{given} {note}"),
                        _ => format!("component {index} of {given} {note}"),
                    };
                    tracing::warn!(asset = id, "{note}");
                    outcome.notes.push(note);
                }
                let folder = folder.join(Publication::subfolder(index, components));
                let added = publication.add(index, components, &atlas, part.config)?;
                added.map(|()| Summary::of(&atlas, folder))
            }
        };
        let result = result.map_err(|error| Failure::from(&error));
        parts.push(ComponentOutcome { index, result });
        Ok(())
    })?;
    publication.finish()?;
    outcome.files = list_files(&folder).unwrap_or_default();
    outcome.components = parts;
    Ok(())
}

/// What was asked for and could not be had, and much distortion, beginning with a verb.
fn warnings(atlas: &AffineAtlas, config: &Config) -> Vec<String> {
    let mut notes = Vec::new();
    let (quality, most) = (&atlas.quality, config.report.distortion_warning);
    if quality.log_scale.std > most {
        notes.push(format!(
            "is drawn unevenly: the log scale deviates by {:.2} (report.distortion_warning = {most}), area distortion (9) is {:.2}; more cones help (`affine-atlas cones` shows how much), `affine-atlas explain` shows where",
            quality.log_scale.std, quality.area_distortion
        ));
    }
    if let Some(met) = &atlas.metric.quarter_turns
        && !met.given_up.is_empty()
    {
        let all = met.lines.len() + met.given_up.len();
        notes.push(format!(
            "has {} of {all} features as lines: the others cannot be lines with these, or only in faces without width; atlas.json names them, and a larger features.angle asks for fewer",
            met.lines.len()
        ));
    }
    if let Some(error) = &atlas.no_grid {
        notes.push(format!("has flat patches instead of a grid: {error}"));
    }
    let params = &config.patches;
    let count = atlas.patches.patches.len();
    if let Some(most) = params.max_count.filter(|&most| count > most) {
        notes.push(format!(
            "has {count} patches, more than the {most} of patches.max_count: with fewer, patches would overlap"
        ));
    }
    let side = atlas.patches.packed.as_ref().map(|packed| packed.side);
    if let (Some(most), Some(side)) = (params.packed_side, side)
        && side > most
    {
        notes.push(format!(
            "needs a packed image of {side} by {side} texels, more than the {most} of patches.packed_side: each of its {count} patches has at least patches.min_side texels"
        ));
    }
    notes
}
