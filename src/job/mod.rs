//! The main job: one asset from file to folder.
//!
//! `pipeline` is that of the tutorial (5.1) on one page, its first half on another (`flatten`): data only
//! flows forward, and a finished value is never changed. [`build`] does it for every component of a mesh in memory, [`run`] for a file,
//! [`inspect`] stops before the flow, [`survey`] tries different cones, [`rebuild`] goes back from images to a mesh, [`fit`] on to a
//! spline surface, [`texture`] lays a pattern over the surface, [`explain`] says what is wrong.

mod charting;
mod checks;
mod error;
pub mod explain;
pub mod fit;
mod flatten;
mod inspect;
mod listing;
mod pipeline;
mod precision;
mod publication;
pub mod rebuild;
mod shares;
pub mod survey;
pub mod texture;
mod warnings;

pub use error::{BuildError, Unverified};
pub use inspect::{Inspection, inspect};
pub use precision::{Cause, Precision};

use flatten::refine_for;
use pipeline::pipeline;
use publication::Publication;
use warnings::warnings;

use crate::atlas::patch::Domain;
use crate::config::Config;
use crate::export::folder::list_files;
use crate::flow::cones;
use crate::geometry::mesh::Soup;
use crate::observe::Observer;
use crate::outcome::{AssetOutcome, AssetState, ComponentOutcome, Failure, Summary};
use crate::product::AffineAtlas;
use crate::read;
use crate::repair;
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
    /// Builds it of flat patches, for this reason.
    without_grid: &'a dyn Fn(String) -> Result<AffineAtlas, BuildError>,
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
    let config = config.clone().resolved()?;
    let config = &Config {
        images: config.images.held_by(soup),
        ..config
    };
    let assigned = |c: &Config| cones::assign(&repaired, &c.cones, &c.boundary, &c.features);
    let requests = assigned(config)?;
    let otherwise = assigned(&config.on_flat_patches())?;
    let shares = shares::shares(&repaired.components);
    let components = repaired.components.len();
    let parts = repaired
        .components
        .into_iter()
        .zip(requests)
        .zip(otherwise)
        .zip(shares);
    for (index, (((component, requests), otherwise), share)) in parts.enumerate() {
        let config = &shares::of_share(config, share)?;
        let stages = Observed {
            observer,
            component: index,
            components,
        };
        let enter = |stage| stages.enter(stage);
        let flat = config.on_flat_patches();
        let spare = component.clone();
        let without_grid = |reason: String| {
            let spare = spare.clone();
            pipeline(spare, &otherwise, &flat, Some(reason), observer, &enter)
        };
        let is_sound = component.mesh.is_ok();
        let atlas = match pipeline(component, &requests, config, None, observer, &enter) {
            Err(BuildError::Cancelled) => Err(BuildError::Cancelled),
            Err(error) if is_sound && config.domain() == Domain::Grid => {
                without_grid(error.to_string())
            }
            atlas => atlas,
        };
        take(Part {
            index,
            components,
            config,
            atlas,
            without_grid: &without_grid,
        })?;
    }
    Ok(())
}

/// The last part of a folder's name; one that is given as `.` has one, too.
fn folder_name(folder: &Path) -> String {
    let resolved = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let name = resolved.file_name().unwrap_or("surface".as_ref());
    name.to_string_lossy().into_owned()
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
            Ok(mut atlas) => {
                let mut added = publication.add(index, components, &mut atlas, part.config)?;
                if let (Err(error), true) = (&added, atlas.grid.is_some()) {
                    match (part.without_grid)(error.to_string()) {
                        Err(BuildError::Cancelled) => return Err(BuildError::Cancelled),
                        Err(error) => added = Err(error),
                        Ok(flat) => {
                            atlas = flat;
                            added = publication.add(index, components, &mut atlas, part.config)?;
                        }
                    }
                }
                for note in warnings(&atlas, part.config) {
                    let note = match components {
                        1 => format!("{given} {note}"),
                        _ => format!("component {index} of {given} {note}"),
                    };
                    tracing::warn!(asset = id, "{note}");
                    outcome.notes.push(note);
                }
                let folder = folder.join(Publication::subfolder(index, components));
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
