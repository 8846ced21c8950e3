//! The main job: one asset from file to folder.
//!
//! `pipeline` is that of the tutorial (5.1) on one page, its first half on another (`flatten`): data only
//! flows forward, and a finished value is never changed. [`build`] does it for every component of a mesh in memory, [`run`] for a file,
//! [`inspect`] stops before the flow, [`survey`] tries different cones, [`rebuild`] goes back from images to a mesh, [`fit`] on to a
//! spline surface, [`texture`] lays a pattern over the surface, [`explain`] says what is wrong.

mod assembly;
mod charting;
mod checks;
mod components;
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

use assembly::Assembly;
use flatten::refine_for;
use listing::MOST_LISTED;
use publication::Publication;

use crate::config::Config;
use crate::export::folder::list_files;
use crate::geometry::mesh::Soup;
use crate::observe::Observer;
use crate::outcome::{AssetOutcome, AssetState, Failure};
use crate::product::AffineAtlas;
use crate::read;
use std::path::Path;
use std::time::Instant;

/// Builds the atlas of every component of a mesh in memory. One bad component does not spoil the
/// others; what concerns the whole mesh, or that it was stopped, is the outer error. Images are without the channels that the mesh does not have
/// ([`ImageParams::lacking`](crate::atlas::geometry_image::ImageParams::lacking)).
pub fn build(
    soup: &Soup,
    config: &Config,
    observer: &dyn Observer,
) -> Result<Vec<Result<AffineAtlas, BuildError>>, BuildError> {
    let mut atlases = Vec::new();
    components::each(
        soup,
        config,
        observer,
        |part| part.atlas(),
        |atlas| match atlas {
            Err(BuildError::Cancelled) => Err(BuildError::Cancelled),
            atlas => {
                atlases.push(atlas);
                Ok(())
            }
        },
    )?;
    Ok(atlases)
}

/// The last part of a folder's name; one that is given as `.` has one, too.
fn folder_name(folder: &Path) -> String {
    let resolved = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let name = resolved.file_name().unwrap_or("surface".as_ref());
    name.to_string_lossy().into_owned()
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

/// The mesh that a folder was built from, where that is another one.
fn older_source(folder: &Path, given: &str, blake3: &str) -> Option<String> {
    let source = crate::read::atlas::source(folder)?;
    (source.path != given && source.blake3 != blake3).then_some(source.path)
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
    for note in &asset.notes {
        tracing::warn!(asset = outcome.id, "{given}: {note}");
    }
    outcome.notes.clone_from(&asset.notes);
    if let Some(older) = older_source(&output.join(&outcome.id), given, &asset.blake3) {
        tracing::warn!(
            asset = outcome.id,
            "{given} takes the place of {older} in {}: they have the same name; give one another output folder",
            output.join(&outcome.id).display()
        );
    }
    for channel in config.images.lacking(&asset.soup) {
        let note = format!(
            "{given} has nothing for the channel \"{}\" of images.channels: its images are written without",
            channel.name()
        );
        tracing::warn!(asset = outcome.id, channel = channel.name(), "{note}");
        outcome.notes.push(note);
    }
    let id = outcome.id.clone();
    let notes = outcome.notes.clone();
    let publication = Publication::new(&asset, given, output, &id, config, notes, observer);
    let mut assembly = Assembly::default();
    let mut parts = Vec::new();
    let (mut told, mut untold) = (0, 0);
    let inside_out = components::each(
        &asset.soup,
        config,
        observer,
        |part| publication.component(part),
        |published| {
            let published = published?;
            for note in &published.notes {
                // All of them stand on the page.
                match config.report.enabled && told == MOST_LISTED {
                    true => untold += 1,
                    false => {
                        told += 1;
                        tracing::warn!(asset = id, "{note}");
                    }
                }
            }
            outcome.notes.extend_from_slice(&published.notes);
            parts.push(assembly.add(published));
            Ok(())
        },
    )?;
    let of_asset = [
        warnings::without_folders(given, parts.len(), config),
        warnings::inside_out(given, &inside_out),
    ];
    for note in of_asset.into_iter().flatten() {
        tracing::warn!(asset = id, "{note}");
        outcome.notes.push(note);
    }
    assembly.finish(publication, config, &outcome.notes)?;
    if untold > 0 {
        let page = output.join(&id).join("report.html");
        tracing::warn!(
            asset = id,
            "{untold} more notes on components are in {}",
            page.display()
        );
    }
    outcome.files = list_files(&output.join(&id)).unwrap_or_default();
    outcome.components = parts;
    Ok(())
}
