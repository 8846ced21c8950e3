//! Images and seams of one component's folder: what a reader of geometry images uses, and no more.
//!
//! *Enters:* a folder that a build wrote. *Leaves:* an [`ImageFolder`]: positions and masks of the images, the seam arrays
//! of `atlas.npz`, and from `atlas.json` where the texels lie and the topology that is stated.
//!
//! *Guaranteed:* nothing panics whatever the files hold, and memory is bounded by what they hold; images have the size that is stated; the
//! arrays of seams have lengths that fit each other.
//! *Not guaranteed:* finite numbers, patches in range, and that seams bound patches.

use super::bounded::{JSON_LIMIT, is_inside, read_bounded};
use super::exr::{self, Read};
use super::npz::Npz;
use crate::parallel;
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::path::{Path, PathBuf};

/// What an asset has whose components have no folders.
const COMPONENTS: &str = "components.json";

/// Version of the output format (`docs/format.md`) that is understood.
const VERSIONS: std::ops::RangeInclusive<u64> = 1..=2;

/// The number that stands for the surface's boundary in `seam_patch`.
pub const BOUNDARY: u32 = u32::MAX;

/// A folder that was refused, and why.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// No atlas there.
    #[error(
        "{} holds no atlas.json and no component-000; give the folder that `affine-atlas build` wrote for a mesh",
        folder.display()
    )]
    NoAtlas {
        /// As given.
        folder: PathBuf,
    },
    /// An asset of components without folders.
    #[error(
        "{} holds all {components} components in one surface.glb and no folder of each, which this needs; build with --set output.component_folders={components}",
        folder.display()
    )]
    NoFolders {
        /// As given.
        folder: PathBuf,
        /// How many there are.
        components: usize,
    },
    /// A file that is missing or no file of its format.
    #[error("{}: {problem}; build the atlas again, or give its complete folder", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What its reader said.
        problem: String,
    },
    /// No grid, where one is needed.
    #[error(
        "{} has no grid: build with images.domain = \"grid\"; where that was set, no grid could be made, and the build's warning says why",
        path.display()
    )]
    NoGrid {
        /// `atlas.json`.
        path: PathBuf,
    },
    /// Another format, or a version that came later.
    #[error(
        "{} says format {format:?}, version {version}; this program reads \"affine-atlas\", versions 1 and 2",
        path.display()
    )]
    Version {
        /// `atlas.json`.
        path: PathBuf,
        /// What it says.
        format: String,
        /// What it says.
        version: u64,
    },
    /// A domain that is not known.
    #[error(
        "patch {patch} of {} has the domain {domain:?}; it must be \"flat\" or \"grid\"",
        path.display()
    )]
    Domain {
        /// `atlas.json`.
        path: PathBuf,
        /// Patch.
        patch: usize,
        /// Its domain.
        domain: String,
    },
    /// A patch out of order, or with an image elsewhere.
    #[error(
        "row {row} of the patches in {} has the id {id} and the image {image:?}; ids count from 0 and images lie in the folder",
        path.display()
    )]
    Patch {
        /// `atlas.json`.
        path: PathBuf,
        /// Row.
        row: usize,
        /// Its id.
        id: usize,
        /// Its image.
        image: String,
    },
    /// An image of another size.
    #[error(
        "{} has {} columns and {} rows, but atlas.json states {} and {}",
        path.display(), found[0], found[1], stated[0], stated[1]
    )]
    ImageSize {
        /// The image.
        path: PathBuf,
        /// Columns and rows of the file.
        found: [usize; 2],
        /// Columns and rows in `atlas.json`.
        stated: [usize; 2],
    },
    /// Seam arrays that do not fit.
    #[error(
        "seam_offset of {} must rise from 0 to the {samples} samples and have one entry more than the {seams} seams; it has {entries} entries and ends with {last}",
        path.display()
    )]
    SeamOffsets {
        /// `atlas.npz`.
        path: PathBuf,
        /// Rows of `seam_position`.
        samples: usize,
        /// Rows of `seam_patch`.
        seams: usize,
        /// Length of `seam_offset`.
        entries: usize,
        /// Its last entry.
        last: u32,
    },
}

/// Topology of a surface as `atlas.json` states it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub struct StatedTopology {
    /// χ.
    pub euler_characteristic: i64,
    /// Handles.
    pub genus: i64,
    /// Boundary loops.
    pub boundary_loops: i64,
}

/// One geometry image.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredImage {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// (column, row, 1) to patch coordinates.
    pub texel_to_patch: [[f64; 3]; 2],
    /// True where texels are grid corners of a block, false where they are texel centres of a `flat` patch.
    pub is_rectangle: bool,
    /// Surface points minus the image origin, row by row from the top.
    pub position: Vec<[f32; 3]>,
    /// 1 where the texel lies in the patch.
    pub alpha: Vec<f32>,
}

/// Everything that a mesh is rebuilt from.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageFolder {
    /// One a patch.
    pub images: Vec<StoredImage>,
    /// Added to positions of images.
    pub image_origin: [f64; 3],
    /// Seam s holds these rows of `seam_position` and `seam_uv`.
    pub seam_offset: Vec<u32>,
    /// Samples.
    pub seam_position: Vec<[f64; 3]>,
    /// Patch coordinates on the left and on the right.
    pub seam_uv: Vec<[[f64; 2]; 2]>,
    /// Patches on the left and on the right ([`BOUNDARY`]).
    pub seam_patch: Vec<[u32; 2]>,
    /// What the mesh must have.
    pub topology: StatedTopology,
}

#[derive(Deserialize)]
struct Document {
    topology: StatedTopology,
    patches: Vec<Patch>,
    #[serde(default)]
    image_origin: [f64; 3],
}

#[derive(Deserialize)]
struct Head {
    #[serde(default)]
    format: String,
    #[serde(default)]
    version: u64,
}

/// Names of the domains.
const DOMAINS: [&str; 2] = ["flat", "grid"];

#[derive(Deserialize)]
struct Patch {
    id: usize,
    image: String,
    domain: String,
    width: usize,
    height: usize,
    texel_to_patch: [[f64; 3]; 2],
}

/// What an atlas was built from, as `atlas.json` says.
#[derive(Clone, Debug, Deserialize, PartialEq, Eq)]
pub struct Source {
    /// The file, as it was given.
    pub path: String,
    /// BLAKE3 hash of its bytes, hexadecimal.
    pub blake3: String,
}

/// What the asset in a folder was built from; `None` where there is no atlas.
pub fn source(folder: &Path) -> Option<Source> {
    #[derive(Deserialize)]
    struct Document {
        source: Source,
    }
    let document = match component_folders(folder) {
        Ok(folders) => folders.first()?.join("atlas.json"),
        Err(FolderError::NoFolders { .. }) => folder.join(COMPONENTS),
        Err(_) => return None,
    };
    let text = read_bounded(&document, JSON_LIMIT).ok()?;
    let document: Document = serde_json::from_slice(&text).ok()?;
    Some(document.source)
}

/// How many components an asset has whose components have no folders.
fn without_folders(folder: &Path) -> Option<usize> {
    #[derive(Deserialize)]
    struct Document {
        components: Vec<IgnoredAny>,
    }
    let text = read_bounded(&folder.join(COMPONENTS), JSON_LIMIT).ok()?;
    let document: Document = serde_json::from_slice(&text).ok()?;
    Some(document.components.len())
}

/// The folders of the components of an asset, in order: the asset's own where it has one component.
///
/// # Errors
/// Where there is no atlas.
pub fn component_folders(folder: &Path) -> Result<Vec<PathBuf>, FolderError> {
    if folder.join("atlas.json").is_file() {
        return Ok(vec![folder.to_owned()]);
    }
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let is_component = |path: &PathBuf| {
        let name = path.file_name().and_then(|name| name.to_str());
        name.is_some_and(|name| name.starts_with("component-")) && path.join("atlas.json").is_file()
    };
    let mut folders: Vec<PathBuf> = entries.map(|e| e.path()).filter(is_component).collect();
    folders.sort();
    let folder = folder.to_owned();
    match (folders.is_empty(), without_folders(&folder)) {
        (false, _) => Ok(folders),
        (true, Some(components)) => Err(FolderError::NoFolders { folder, components }),
        (true, None) => Err(FolderError::NoAtlas { folder }),
    }
}

/// Reads the folder of one component.
///
/// # Errors
/// Files that are missing, damaged, or do not fit each other.
pub fn read_images(folder: &Path) -> Result<ImageFolder, FolderError> {
    let document = document(&folder.join("atlas.json"))?;
    let images = parallel::map(&document.patches, |_, patch| image(folder, patch));
    let images = images.into_iter().collect::<Result<_, _>>()?;
    let path = folder.join("atlas.npz");
    let of_file = |problem| FolderError::File {
        path: path.clone(),
        problem,
    };
    let mut npz = Npz::open(&path).map_err(of_file)?;
    let read = |npz: &mut Npz| -> Result<_, String> {
        let (seam_offset, _) = npz.read::<u32>("seam_offset", &[None])?;
        let (position, samples) = npz.read::<f64>("seam_position", &[None, Some(3)])?;
        let (uv, _) = npz.read::<f64>("seam_uv", &[Some(samples), Some(2), Some(2)])?;
        let (patch, _) = npz.read::<u32>("seam_patch", &[None, Some(2)])?;
        Ok((seam_offset, position, uv, patch))
    };
    let (seam_offset, position, uv, patch) = read(&mut npz).map_err(of_file)?;
    let seam_position = position.as_chunks::<3>().0.to_vec();
    let seam_uv = uv.as_chunks::<2>().0.as_chunks::<2>().0.to_vec();
    let seam_patch = patch.as_chunks::<2>().0.to_vec();
    let last = seam_offset.last().copied().unwrap_or(0);
    let fits = seam_offset.first() == Some(&0)
        && last as usize == seam_position.len()
        && seam_offset.len() == seam_patch.len() + 1
        && seam_offset.is_sorted();
    if !fits {
        return Err(FolderError::SeamOffsets {
            samples: seam_position.len(),
            seams: seam_patch.len(),
            entries: seam_offset.len(),
            last,
            path,
        });
    }
    Ok(ImageFolder {
        images,
        image_origin: document.image_origin,
        seam_offset,
        seam_position,
        seam_uv,
        seam_patch,
        topology: document.topology,
    })
}

/// `atlas.json`, once its format and version are known to be ours.
pub(super) fn checked_json(path: &Path) -> Result<serde_json::Value, FolderError> {
    let of_file = |problem| FolderError::File {
        path: path.to_owned(),
        problem,
    };
    let bytes = read_bounded(path, JSON_LIMIT).map_err(|e| of_file(e.to_string()))?;
    let value: serde_json::Value =
        serde_json::from_slice(&bytes).map_err(|e| of_file(e.to_string()))?;
    let head = Head::deserialize(&value).map_err(|e| of_file(e.to_string()))?;
    if head.format != "affine-atlas" || !VERSIONS.contains(&head.version) {
        return Err(FolderError::Version {
            path: path.to_owned(),
            format: head.format,
            version: head.version,
        });
    }
    Ok(value)
}

fn document(path: &Path) -> Result<Document, FolderError> {
    let of_file = |problem| FolderError::File {
        path: path.to_owned(),
        problem,
    };
    let value = checked_json(path)?;
    let document = Document::deserialize(&value).map_err(|e| of_file(e.to_string()))?;
    for (row, patch) in document.patches.iter().enumerate() {
        if patch.id != row || !is_inside(&patch.image) {
            return Err(FolderError::Patch {
                path: path.to_owned(),
                row,
                id: patch.id,
                image: patch.image.clone(),
            });
        }
        if !DOMAINS.contains(&patch.domain.as_str()) {
            return Err(FolderError::Domain {
                path: path.to_owned(),
                patch: row,
                domain: patch.domain.clone(),
            });
        }
    }
    Ok(document)
}

fn image(folder: &Path, patch: &Patch) -> Result<StoredImage, FolderError> {
    let path = folder.join(&patch.image);
    let stated = [patch.width, patch.height];
    match exr::read(&path, stated) {
        Err(problem) => Err(FolderError::File { path, problem }),
        Ok(Read::WrongSize(found)) => Err(FolderError::ImageSize {
            path,
            found,
            stated,
        }),
        Ok(Read::Image { image, .. }) => {
            let [r, g, b] = image.rgb;
            Ok(StoredImage {
                width: patch.width,
                height: patch.height,
                texel_to_patch: patch.texel_to_patch,
                is_rectangle: patch.domain != DOMAINS[0],
                position: r
                    .into_iter()
                    .zip(g)
                    .zip(b)
                    .map(|((x, y), z)| [x, y, z])
                    .collect(),
                alpha: image.alpha,
            })
        }
    }
}
