//! Writing what a job built: the folder of one asset as the output format (`docs/format.md`) describes it.
//!
//! *Enters:* an [`AffineAtlas`] and its [`Provenance`]. *Leaves:* `atlas.json`, `atlas.npz`,
//! `surface.glb`, `images/PPPP.exr` and, where it is asked for, `images/packed.exr` in a [`folder::Staging`] folder, which replaces the older
//! folder in one step once it is complete.
//!
//! *Guaranteed:* the same atlas and provenance give the same bytes, whatever the machine and the
//! number of threads; no file but the manifest holds wall time, memory or host names, and none
//! holds an absolute path; a reader never sees a half-written folder.
//! *Not guaranteed:* anything about the quality of the atlas. It is written as it is, as long as
//! its arrays fit each other and its numbers are finite.

pub mod atlas_json;
pub mod components;
mod error;
pub mod exr;
pub mod fit;
pub mod folder;
pub mod gismo;
pub mod glb;
mod html;
pub mod index;
pub mod manifest;
mod names;
pub mod npz;
pub mod periods;
pub mod pictures;
mod provenance;
mod quads;
pub mod report;
#[cfg(test)]
pub(crate) mod sample;
mod shapes;
pub mod step;
pub mod usd;

pub use error::{Action, EncodeError, ExportError};
pub use provenance::Provenance;
pub use shapes::check_shapes;

use crate::atlas::geometry_image::pack_images;
use crate::observe::part;
use crate::parallel;
use crate::product::AffineAtlas;
use folder::Staging;
use std::io;

/// Writes all data files of one component into a staging folder: `atlas.json`, `atlas.npz`,
/// `surface.glb` and the images. `subfolder` is `""` for an asset of one component, else
/// [`folder::component_name`].
pub fn write_component(
    staging: &Staging,
    subfolder: &str,
    atlas: &AffineAtlas,
    provenance: &Provenance,
) -> Result<Written, ExportError> {
    check_shapes(atlas)?;
    let document = atlas_json::describe(atlas, provenance)?;
    let inside = |name: &str| match subfolder {
        "" => name.to_owned(),
        _ => format!("{subfolder}/{name}"),
    };
    let mut files = Vec::new();
    let name = inside("atlas.json");
    staging.write(&name, document.to_text().as_bytes())?;
    files.push(name);

    let name = inside("atlas.npz");
    let arrays = || -> Result<(), ExportError> {
        let _part = part!("npz");
        // Through memory: a zip writer that meets a full disk complains on the terminal when dropped.
        let mut archive = io::Cursor::new(Vec::new());
        npz::write(atlas, &mut archive).map_err(|e| e.at(&staging.target().join(&name)))?;
        staging.write(&name, archive.get_ref())
    };
    let others = || write_others(staging, &inside, atlas, &document, provenance);
    let (arrays, others) = rayon::join(arrays, others);
    arrays?;
    files.push(name);
    let (others, surface) = others?;
    files.extend(others);
    Ok(Written { files, surface })
}

/// What was written of a component.
pub struct Written {
    /// Paths inside the staging folder.
    pub files: Vec<String>,
    /// What `surface.glb` draws.
    pub surface: glb::Surface,
}

/// Images, quads and the GLB.
fn write_others(
    staging: &Staging,
    inside: &(impl Fn(&str) -> String + Sync),
    atlas: &AffineAtlas,
    document: &atlas_json::Document,
    provenance: &Provenance,
) -> Result<(Vec<String>, glb::Surface), ExportError> {
    let part = part!("images");
    // Compression takes most of the time, and images do not depend on each other.
    let images = parallel::map(&atlas.images, |id, image| {
        let name = inside(&atlas_json::image_path(id));
        let mut file = staging.create(&name)?;
        let label = exr::label(document, id, provenance);
        exr::write(image, &atlas.image_params, &label.to_text(), &mut file)
            .map_err(|e| e.at(file.path()))?;
        file.finish()?;
        Ok(name)
    });
    let mut files = images.into_iter().collect::<Result<Vec<_>, _>>()?;
    drop(part);

    if let (Some(places), Some(label)) = (
        &atlas.patches.packed,
        exr::packed_label(document, provenance),
    ) {
        let name = inside(&label.packed.image);
        let mut file = staging.create(&name)?;
        let image = pack_images(&atlas.images, places);
        exr::write(&image, &atlas.image_params, &label.to_text(), &mut file)
            .map_err(|e| e.at(file.path()))?;
        file.finish()?;
        files.push(name);
    }

    if let Some(grid) = &atlas.grid {
        let name = inside("quads.obj");
        let text = quads::text(atlas, grid, &provenance.appearance.materials);
        staging.write(&name, text.as_bytes())?;
        files.push(name);
    }

    let _part = part!("glb");
    let name = inside("surface.glb");
    let surface = glb::Surface::of(atlas, provenance.appearance)?;
    let bytes = glb::encode(&surface, document, provenance)?;
    staging.write(&name, &bytes)?;
    files.push(name);
    Ok((files, surface))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    /// With `AFFINE_ATLAS_SAMPLE_DIR` set, the folders stay there for checkers outside of this program.
    #[test]
    fn components_are_written_whole_and_the_same_every_time() {
        let temporary = tempfile::tempdir().unwrap();
        let kept = std::env::var_os("AFFINE_ATLAS_SAMPLE_DIR").map(PathBuf::from);
        let root = kept.unwrap_or_else(|| temporary.path().to_owned());
        let appearance = sample::appearance();
        for (asset, atlas) in sample::all() {
            let mut provenance = sample::provenance(&appearance);
            provenance.asset = asset;
            let mut contents = Vec::new();
            for _ in 0..2 {
                let staging = Staging::begin(&root, asset).unwrap();
                let files = write_component(&staging, "", &atlas, &provenance)
                    .unwrap()
                    .files;
                assert_eq!(
                    files,
                    ["atlas.json", "atlas.npz", "images/0000.exr", "surface.glb"]
                );
                staging.publish().unwrap();
                let read = |name: &String| std::fs::read(root.join(asset).join(name)).unwrap();
                contents.push(files.iter().map(read).collect::<Vec<_>>());
            }
            assert!(
                contents[0] == contents[1],
                "{asset} differs from run to run"
            );
        }
    }
}
