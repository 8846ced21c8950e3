//! `surface.glb`: the surface with its packed patches as `TEXCOORD_0`, for viewers and other tools.
//!
//! One mesh with one primitive a material. Source attributes follow ours: texture-coordinate set
//! `n` becomes `n + 1`, and materials are told so. `_LOG_SCALE` is the only custom attribute, a scalar:
//! attributes of several shapes crash a common importer. Transitions and patch rectangles are in `meshes[0].extras`.
//!
//! *Guaranteed:* the Khronos validator finds no error; triangles stand in the order of materials and faces,
//! as many as the surface has faces.
//! *Not guaranteed:* double precision. Positions are 32-bit floats relative to the node's translation,
//! so tiny faces may collapse; `atlas.npz` has the surface in full.

mod builder;
pub mod marked;
mod materials;
pub mod plain;
pub mod region;
pub mod textured;
mod vertices;
pub mod whole;

use crate::atlas::patches::Domain;
use crate::export::atlas_json::{self, Document, Patch};
use crate::export::{ExportError, Provenance};
use crate::geometry::ids::{FaceId, NONE};
use crate::geometry::mesh::{Appearance, cross, norm, sub};
use crate::product::AffineAtlas;
use builder::Builder;
use gltf::json::Mesh;
use gltf::json::extras::RawValue;
use serde::Serialize;
use std::collections::BTreeMap;
use vertices::{Primitive, SetNumbers};

/// What `meshes[0].extras` holds, under the key `affineAtlas`.
#[derive(Debug, Serialize)]
struct Extras<'a> {
    #[serde(rename = "affineAtlas")]
    atlas: AtlasExtras<'a>,
}

#[derive(Debug, Serialize)]
struct AtlasExtras<'a> {
    version: u32,
    transitions: &'a [atlas_json::Transition],
    patches: Vec<PatchExtras<'a>>,
}

#[derive(Debug, Serialize)]
struct PatchExtras<'a> {
    id: usize,
    image: &'a str,
    /// Left, top, right and bottom of the image in `TEXCOORD_0`, v down.
    rectangle: [f64; 4],
    patch_to_packed: atlas_json::Packing,
    patch_to_chart: Option<atlas_json::Similarity>,
}

/// The vertices of a component, split for the format.
pub struct Surface {
    /// Subtracted from positions.
    origin: [f32; 3],
    /// The source's texture-coordinate sets.
    sets: SetNumbers,
    /// Those of each material.
    primitives: Vec<(u32, Primitive)>,
    /// What a side of the packed square is on the surface, source units.
    side: f64,
    /// The same of a texel.
    texel: f64,
}

impl Surface {
    /// Splits the vertices of an atlas. Expects [`crate::export::check_shapes`] to hold.
    pub fn of(atlas: &AffineAtlas, appearance: &Appearance) -> Result<Self, ExportError> {
        let mut groups: BTreeMap<u32, Vec<FaceId>> = BTreeMap::new();
        for (f, &material) in atlas.mesh.face_material.enumerate() {
            let known = (material as usize) < appearance.materials.len();
            let key = if known { material } else { NONE };
            groups.entry(key).or_default().push(f);
        }
        let sets = vertices::Sets::of(&atlas.mesh.attributes);
        let numbers = sets.numbers();
        let mut splitter = vertices::Splitter::new(atlas, &sets)?;
        let mut primitives = Vec::new();
        for (&id, faces) in &groups {
            let least_sets = materials::texture_coordinate_sets(appearance, id, &numbers);
            primitives.push((id, splitter.primitive(faces, least_sets)?));
        }
        let (side, texel) = lengths(atlas);
        Ok(Self {
            origin: splitter.origin(),
            sets: numbers,
            primitives,
            side,
            texel,
        })
    }
}

/// What a side of the packed square and a texel are on the surface on average, source units; 1 where that is no length.
fn lengths(atlas: &AffineAtlas) -> (f64, f64) {
    let (mesh, layout) = (&atlas.mesh, &atlas.patches);
    // Areas in units of the surface's size, so that nothing underflows.
    let size = mesh.diagonal();
    let (mut space, mut packed) = (0.0, 0.0);
    for f in mesh.connectivity.faces() {
        let [a, b, c] = mesh.face_positions(f);
        let side = |p| sub(p, a).map(|x| x / size);
        space += norm(cross(side(b), side(c)));
        let [a, b, c] = layout.uv[f];
        let scale = layout.patches[layout.face_patch[f].index()].packed_scale;
        let [b, c] = [b, c].map(|p| [0, 1].map(|i| scale * (p[i] - a[i])));
        packed += (b[0] * c[1] - b[1] * c[0]).abs();
    }
    let side = size * (space / packed).sqrt();
    let texels = layout.patches.iter().map(|patch| {
        let [[a, _, _], [b, _, _]] = patch.texel_to_patch;
        patch.packed_scale * a.hypot(b)
    });
    let texel = side * texels.fold(0.0, f64::max);
    match side.is_normal() && texel.is_normal() {
        true => (side, texel),
        false => (1.0, 0.0),
    }
}

/// The bytes of the file of one component.
pub fn encode(
    surface: &Surface,
    document: &Document,
    provenance: &Provenance,
) -> Result<Vec<u8>, ExportError> {
    let mut builder = Builder::default();
    let mut materials = materials::Writer::new(provenance.appearance, &surface.sets);
    let mut primitives = Vec::new();
    for (id, primitive) in &surface.primitives {
        let material = materials.write(*id, &mut builder);
        primitives.push(builder.primitive(primitive, material));
    }
    let mesh = Mesh {
        extensions: None,
        extras: Some(extras(document)),
        name: Some(provenance.asset.into()),
        primitives,
        weights: None,
    };
    builder.scene(mesh, surface.origin);
    builder.finish()
}

fn extras(document: &Document) -> Box<RawValue> {
    let extras = Extras {
        atlas: AtlasExtras {
            version: document.version,
            transitions: &document.transitions,
            patches: document
                .patches
                .iter()
                .map(|p| PatchExtras {
                    id: p.id,
                    image: &p.image,
                    rectangle: rectangle(p),
                    patch_to_packed: p.patch_to_packed,
                    patch_to_chart: p.patch_to_chart,
                })
                .collect(),
        },
    };
    gltf::json::serialize::to_string(&extras)
        .and_then(RawValue::from_string)
        .expect("string keys and no custom serialiser, so that serialisation cannot fail")
}

/// Left, top, right and bottom of a patch's image in the packed square, v down.
fn rectangle(patch: &Patch) -> [f64; 4] {
    let m = patch.texel_to_patch;
    let packing = patch.patch_to_packed;
    let packed = |column: f64, row: f64| -> [f64; 2] {
        let p = m.map(|r| r[0] * column + r[1] * row + r[2]);
        let [u, v] = [0, 1].map(|i| packing.scale * p[i] + packing.translation[i]);
        [u, 1.0 - v]
    };
    // A texel reaches half its size from where it is sampled.
    let first = match patch.domain {
        Domain::Flat => 0.0,
        Domain::Grid => -0.5,
    };
    let [left, top] = packed(first, first);
    let [right, bottom] = packed(first + patch.width as f64, first + patch.height as f64);
    [left, top, right, bottom]
}

#[cfg(test)]
mod tests;
