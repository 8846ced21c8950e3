//! Mesh files → triangle soup, with precise refusals.
//!
//! Enters: a glTF, GLB, OBJ, PLY, STL or OFF file. Leaves: a [`SourceAsset`]: the [`Soup`] with every
//! vertex and triangle of the file (nothing welded, nothing oriented, nothing removed), a hash over
//! everything that was read, and notes about what the file holds besides triangles.
//!
//! Guaranteed for every input, hostile ones included: nothing panics; no byte outside the file's own
//! folder is read; counts are checked against the file's size and against [`ReadParams`] before memory
//! is set aside for them, and what files unpack to stays in proportion to their size; every position is finite and every index in range. Not guaranteed: anything
//! about the surface (manifoldness, orientation, duplicates), which is repair's business.
//!
//! | module | what it knows |
//! | --- | --- |
//! | `error` | what can be wrong with a file |
//! | `budget` | how many bytes files and what they unpack to may take |
//! | `folder` | which files may be read, and their hash |
//! | `fingerprint` | hash of a file and all that it refers to, without decoding any |
//! | `build` | the soup under construction and its limits |
//! | `text` | lines, tokens and numbers of text formats |
//! | `obj`, `off`, `ply`, `stl` | one format each |
//! | `mtl` | material libraries of OBJ files |
//! | `gltf` | glTF 2.0 and GLB with its compression extensions |
//! | `atlas` | images and seams of a folder that a build wrote |
//! | `gridded` | grid coordinates and patches of such a folder |
//! | `metric` | flat lengths and cones of such a folder |
//! | `npz`, `exr`, `bounded` | the formats in such a folder |
//!
//! The four small formats are read here rather than by crates: none that we know gives errors with
//! line, index and count, keeps the file's own face order and polygon fans, and bounds its memory.

pub mod atlas;
pub(crate) mod bounded;
mod budget;
mod build;
mod error;
pub(crate) mod exr;
mod fingerprint;
mod folder;
mod gltf;
pub mod gridded;
pub mod metric;
mod mtl;
pub(crate) mod npz;
mod obj;
mod off;
mod ply;
mod polygon;
mod stl;
mod text;

pub use error::{MeshoptError, Place, ReadError, ReadProblem};
pub use fingerprint::{Fingerprint, fingerprint};

use crate::geometry::mesh::Soup;
use build::SoupBuilder;
use folder::Folder;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// File name extensions that [`read`] understands, in lower case.
pub const EXTENSIONS: [&str; 6] = ["gltf", "glb", "obj", "ply", "stl", "off"];

/// Ceilings on what one asset may hold. They protect the machine, not the mathematics.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReadParams {
    /// Largest number of vertices; instances of a mesh count each. 1 to 2³² − 2.
    pub max_vertices: u64,
    /// Largest number of triangles; instances of a mesh count each. 1 to 2³² − 2.
    pub max_faces: u64,
    /// Largest number of bytes in all: the file, those it refers to, and what they unpack to. What they unpack to may besides be
    /// no more than 128 MiB and 256 bytes for each byte of the files.
    pub max_file_bytes: u64,
}

impl Default for ReadParams {
    /// Generous: larger than any mesh the later stages can take in the memory of one machine.
    fn default() -> Self {
        Self {
            max_vertices: 50_000_000,
            max_faces: 100_000_000,
            max_file_bytes: 8 << 30,
        }
    }
}

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct SourceAsset {
    /// Triangles, attributes, appearance.
    pub soup: Soup,
    /// BLAKE3 in hexadecimal: of the file where it stands alone; otherwise of the concatenated 32-byte
    /// hashes of the file and of every file it refers to, in order of first reference.
    pub blake3: String,
    /// The file and every file it refers to, in the order of the hash.
    pub files: Vec<PathBuf>,
    /// One sentence for everything in the file that is not in `soup`.
    pub notes: Vec<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    Gltf,
    Obj,
    Ply,
    Stl,
    Off,
}

fn format_of(path: &Path) -> Result<Format, ReadProblem> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("gltf" | "glb") => Ok(Format::Gltf),
        Some("obj") => Ok(Format::Obj),
        Some("ply") => Ok(Format::Ply),
        Some("stl") => Ok(Format::Stl),
        Some("off") => Ok(Format::Off),
        Some(other) => Err(ReadProblem::UnknownExtension {
            extension: error::shorten(other.as_bytes()),
        }),
        None => Err(ReadProblem::NoExtension),
    }
}

/// Reads a mesh file and the files it refers to. The format is taken from the file name's extension.
///
/// # Errors
/// [`ReadError`], which says in one sentence what is wrong with the file and what to change.
pub fn read(path: &Path, params: &ReadParams) -> Result<SourceAsset, ReadError> {
    let run = || {
        if path.is_dir() {
            return Err(ReadProblem::NotAFile);
        }
        // A name that is no file's says nothing of a format.
        std::fs::metadata(path).map_err(|source| ReadProblem::Io { source })?;
        let format = format_of(path)?;
        let mut build = SoupBuilder::new(params);
        let (folder, bytes) = Folder::open(path, &mut build.budget)?;
        parse(format, &bytes, folder, build)
    };
    run().map_err(|problem| ReadError::new(path, problem))
}

/// Reads a mesh file that is in memory; `name` gives the format by its extension and stands in messages.
/// References to other files are refused (data URIs are not).
///
/// # Errors
/// As [`read`].
pub fn read_bytes(
    name: &Path,
    bytes: &[u8],
    params: &ReadParams,
) -> Result<SourceAsset, ReadError> {
    let run = || {
        let format = format_of(name)?;
        let mut build = SoupBuilder::new(params);
        let folder = Folder::in_memory(name, bytes, &mut build.budget)?;
        parse(format, bytes, folder, build)
    };
    run().map_err(|problem| ReadError::new(name, problem))
}

fn parse(
    format: Format,
    bytes: &[u8],
    mut folder: Folder,
    mut build: SoupBuilder,
) -> Result<SourceAsset, ReadProblem> {
    match format {
        Format::Obj => obj::read_obj(bytes, &mut folder, &mut build)?,
        Format::Off => off::read_off(bytes, &mut build)?,
        Format::Ply => ply::read_ply(bytes, &mut build)?,
        Format::Stl => stl::read_stl(bytes, &mut build)?,
        Format::Gltf => gltf::read_gltf(bytes, &mut folder, &mut build)?,
    }
    let (soup, notes) = build.finish()?;
    let (blake3, files) = folder.finish();
    Ok(SourceAsset {
        soup,
        blake3,
        files,
        notes,
    })
}
