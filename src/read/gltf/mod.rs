//! glTF 2.0: `.gltf` with its files, and `.glb`.
//!
//! Vertices run over the primitives of the nodes, nodes in order of their indices; every instance of a mesh
//! is a copy of its own. Node transforms are applied in double precision; normals move by the inverse
//! transpose; a mirrored instance has its triangles reversed so that its outside stays outside. Skinned
//! meshes are taken in their bind pose and morph targets at weight 0: positions as stored.
//!
//! Order of work: container → JSON → extensions → buffers → node tree → plan (every count, checked against the
//! limits) → appearance → geometry. Memory for geometry is set aside only after the plan has been accepted.

mod accessor;
mod appearance;
mod buffers;
mod container;
mod draco;
mod meshopt;
mod primitive;
mod scene;
mod schema;
mod uri;

use super::build::SoupBuilder;
use super::error::{ReadProblem, shorten};
use super::folder::Folder;
use buffers::Buffers;
use primitive::Plan;
use schema::{Preamble, Root};
use std::collections::BTreeSet;

/// Extensions that change geometry and are understood.
const GEOMETRY: [&str; 5] = [
    "EXT_meshopt_compression",
    "KHR_draco_mesh_compression",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_texture_transform",
];

/// Extensions of look, light, motion and records: the surface is complete without them.
const IRRELEVANT: [&str; 10] = [
    "EXT_lights_image_based",
    "EXT_texture_avif",
    "EXT_texture_webp",
    "KHR_animation_pointer",
    "KHR_lights_punctual",
    "KHR_texture_basisu",
    "KHR_xmp",
    "KHR_xmp_json_ld",
    "MSFT_lod",
    "MSFT_texture_dds",
];

/// What an object of the JSON, or a primitive under a node, takes in memory at most, without its data.
///
/// Three bytes of JSON can stand for a material, and a mesh of many empty primitives under many nodes for
/// their product: they are counted against the byte limit before they are made.
const OBJECT_BYTES: u64 = 512;

/// Reads a glTF or GLB file; the first bytes tell which.
pub(super) fn read_gltf(
    bytes: &[u8],
    folder: &mut Folder,
    build: &mut SoupBuilder,
) -> Result<(), ReadProblem> {
    let (json, binary) = container::split(bytes)?;
    // Some writers pad the chunk with zeros instead of blanks.
    let end = json
        .iter()
        .rposition(|&b| b != 0 && !b.is_ascii_whitespace())
        .map_or(0, |i| i + 1);
    let json = json[..end]
        .strip_prefix(b"\xef\xbb\xbf")
        .unwrap_or(&json[..end]);
    let objects = json.iter().filter(|&&b| b == b'{').count() as u64;
    let budget = &mut build.budget;
    budget.unpack(OBJECT_BYTES * objects, || "its JSON".into())?;
    let bad_json = |source| ReadProblem::Json { source };
    let preamble: Preamble = serde_json::from_slice(json).map_err(bad_json)?;
    check_version(&preamble)?;
    check_extensions(&preamble)?;
    let root: Root = serde_json::from_slice(json).map_err(bad_json)?;
    let (instances, notes) = scene::instances(&root)?;
    notes.into_iter().for_each(|note| build.note(note));
    let mut plan = Plan::default();
    for instance in &instances {
        plan.add(&root, instance, build)?;
    }
    let buffers = Buffers::load(&root, binary, folder, &mut build.budget)?;
    let maps = appearance::gather(&root, &buffers, folder, build)?;
    plan.read(&root, &buffers, &maps, build)
}

fn check_version(preamble: &Preamble) -> Result<(), ReadProblem> {
    let asset = &preamble.asset;
    let minimum = asset.min_version.as_ref().filter(|v| *v != "2.0");
    let wrong = (!asset.version.starts_with("2.")).then_some(&asset.version);
    match wrong.or(minimum) {
        Some(version) => Err(ReadProblem::GltfVersion {
            version: shorten(version.as_bytes()),
        }),
        None => Ok(()),
    }
}

fn check_extensions(preamble: &Preamble) -> Result<(), ReadProblem> {
    for name in &preamble.extensions_required {
        let known = GEOMETRY.contains(&name.as_str())
            || IRRELEVANT.contains(&name.as_str())
            || name.starts_with("KHR_materials_");
        if !known {
            let remedy = match name.as_str() {
                "EXT_mesh_gpu_instancing" => {
                    "export the asset with every copy as a node of its own"
                }
                _ => "export the asset without it",
            };
            return Err(ReadProblem::RequiredExtension {
                name: shorten(name.as_bytes()),
                remedy,
            });
        }
    }
    Ok(())
}

/// The files in the asset's folder that the JSON of a glTF file names, as relative paths: buffers and images. Names that
/// reading refuses are left out, and where the JSON is broken there are none.
pub(super) fn referenced_files(json: &[u8]) -> BTreeSet<String> {
    #[derive(Default, serde::Deserialize)]
    #[serde(default)]
    struct Named {
        uri: Option<String>,
    }
    #[derive(Default, serde::Deserialize)]
    #[serde(default)]
    struct Names {
        buffers: Vec<Named>,
        images: Vec<Named>,
    }
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    let end = json.iter().rposition(|&b| b != 0).map_or(0, |i| i + 1);
    let names: Names = serde_json::from_slice(&json[..end]).unwrap_or_default();
    let uris = names.buffers.into_iter().chain(names.images);
    let external = |uri: &String| {
        !uri.get(..5)
            .is_some_and(|s| s.eq_ignore_ascii_case("data:"))
    };
    uris.filter_map(|named| named.uri)
        .filter(external)
        .filter_map(|uri| uri::relative_path(&uri).ok())
        .collect()
}
