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

pub mod marked;
mod materials;
pub mod rebuilt;
pub mod region;
pub mod textured;
mod vertices;

use crate::atlas::patches::Domain;
use crate::export::atlas_json::{self, Document, Patch};
use crate::export::{ExportError, Provenance};
use crate::geometry::ids::{FaceId, NONE};
use crate::product::AffineAtlas;
use gltf::json::accessor::{ComponentType, GenericComponentType, Type};
use gltf::json::buffer::{Target, View};
use gltf::json::extras::RawValue;
use gltf::json::mesh::{Mode, Semantic};
use gltf::json::validation::{Checked, USize64};
use gltf::json::{Accessor, Buffer, Index, Mesh, Node, Root, Scene, Value};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;
use vertices::Primitive;

/// Largest file that the format's 32-bit lengths allow.
const MAX_BYTES: u64 = u32::MAX as u64;

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

/// The bytes of the file. Expects [`crate::export::check_shapes`] to hold.
pub fn encode(
    atlas: &AffineAtlas,
    document: &Document,
    provenance: &Provenance,
) -> Result<Vec<u8>, ExportError> {
    let appearance = provenance.appearance;
    let mut groups: BTreeMap<u32, Vec<FaceId>> = BTreeMap::new();
    for (f, &material) in atlas.mesh.face_material.enumerate() {
        let known = (material as usize) < appearance.materials.len();
        let key = if known { material } else { NONE };
        groups.entry(key).or_default().push(f);
    }
    let mut builder = Builder::default();
    let sets = vertices::Sets::of(&atlas.mesh.attributes);
    let mut splitter = vertices::Splitter::new(atlas, &sets)?;
    let mut materials = materials::Writer::new(appearance, &sets);
    let mut primitives = Vec::new();
    for (&id, faces) in &groups {
        let least_sets = materials.texture_coordinate_sets(id);
        let primitive = splitter.primitive(faces, least_sets)?;
        let material = materials.write(id, &mut builder);
        primitives.push(builder.primitive(&primitive, material));
    }
    let mesh = builder.root.push(Mesh {
        extensions: None,
        extras: Some(extras(document)),
        name: Some(provenance.asset.into()),
        primitives,
        weights: None,
    });
    let origin = splitter.origin();
    let node = builder.root.push(Node {
        mesh: Some(mesh),
        name: Some(provenance.asset.into()),
        translation: (origin != [0.0; 3]).then_some(origin),
        ..Node::default()
    });
    let scene = builder.root.push(Scene {
        extensions: None,
        extras: None,
        name: None,
        nodes: vec![node],
    });
    builder.root.scene = Some(scene);
    builder.root.asset.generator = Some(format!(
        "{} {}",
        document.generator.name, document.generator.version
    ));
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
        Domain::Rectangle => -0.5,
    };
    let [left, top] = packed(first, first);
    let [right, bottom] = packed(first + patch.width as f64, first + patch.height as f64);
    [left, top, right, bottom]
}

/// The JSON chunk and the binary chunk while they grow.
#[derive(Default)]
struct Builder {
    root: Root,
    bytes: Vec<u8>,
}

impl Builder {
    /// Adds bytes at an offset that is a multiple of four, and their view.
    fn view(&mut self, bytes: &[u8], target: Option<Target>) -> Index<View> {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let offset = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        self.root.push(View {
            buffer: Index::new(0),
            byte_length: bytes.len().into(),
            byte_offset: Some(offset.into()),
            byte_stride: None,
            name: None,
            target: target.map(Checked::Valid),
            extensions: None,
            extras: None,
        })
    }

    fn accessor(
        &mut self,
        view: Index<View>,
        count: usize,
        component: ComponentType,
        shape: Type,
    ) -> Accessor {
        Accessor {
            buffer_view: Some(view),
            byte_offset: None,
            count: USize64::from(count),
            component_type: Checked::Valid(GenericComponentType(component)),
            extensions: None,
            extras: None,
            type_: Checked::Valid(shape),
            min: None,
            max: None,
            name: None,
            normalized: false,
            sparse: None,
        }
    }

    /// Adds a vertex attribute of `N` floats.
    fn attribute<const N: usize>(&mut self, values: &[[f32; N]], shape: Type) -> Accessor {
        let bytes: Vec<u8> = values
            .iter()
            .flatten()
            .flat_map(|x| x.to_le_bytes())
            .collect();
        let view = self.view(&bytes, Some(Target::ArrayBuffer));
        self.accessor(view, values.len(), ComponentType::F32, shape)
    }

    fn primitive(
        &mut self,
        primitive: &Primitive,
        material: Index<gltf::json::Material>,
    ) -> gltf::json::mesh::Primitive {
        let mut attributes = BTreeMap::new();
        let mut add = |semantic, index| attributes.insert(Checked::Valid(semantic), index);

        let mut position = self.attribute(&primitive.position, Type::Vec3);
        let (low, high) = bounds(&primitive.position);
        position.min = Some(Value::from(low.to_vec()));
        position.max = Some(Value::from(high.to_vec()));
        add(Semantic::Positions, self.root.push(position));
        let normal = self.attribute(&primitive.normal, Type::Vec3);
        add(Semantic::Normals, self.root.push(normal));
        if let Some(tangent) = &primitive.tangent {
            let tangent = self.attribute(tangent, Type::Vec4);
            add(Semantic::Tangents, self.root.push(tangent));
        }
        for (set, values) in (0..).zip(&primitive.tex_coords) {
            let values = self.attribute(values, Type::Vec2);
            add(Semantic::TexCoords(set), self.root.push(values));
        }
        for (set, values) in (0..).zip(&primitive.colors) {
            let values = self.attribute(values, Type::Vec4);
            add(Semantic::Colors(set), self.root.push(values));
        }
        let log_scale = self.attribute(&primitive.log_scale, Type::Scalar);
        // The encoder puts the underscore in front.
        add(
            Semantic::Extras("LOG_SCALE".into()),
            self.root.push(log_scale),
        );

        let indices = self.indices(&primitive.indices, primitive.position.len());
        gltf::json::mesh::Primitive {
            attributes,
            extensions: None,
            extras: None,
            indices: Some(indices),
            material: Some(material),
            mode: Checked::Valid(Mode::Triangles),
            targets: None,
        }
    }

    /// 16 bits where they suffice; their greatest value is reserved by the format.
    fn indices(&mut self, indices: &[u32], vertices: usize) -> Index<Accessor> {
        let short = vertices <= usize::from(u16::MAX);
        let bytes: Vec<u8> = match short {
            true => indices
                .iter()
                .flat_map(|&i| (i as u16).to_le_bytes())
                .collect(),
            false => indices.iter().flat_map(|i| i.to_le_bytes()).collect(),
        };
        let component = if short {
            ComponentType::U16
        } else {
            ComponentType::U32
        };
        let view = self.view(&bytes, Some(Target::ElementArrayBuffer));
        let accessor = self.accessor(view, indices.len(), component, Type::Scalar);
        self.root.push(accessor)
    }

    /// Header, JSON chunk padded with spaces, binary chunk padded with zeros.
    fn finish(mut self) -> Result<Vec<u8>, ExportError> {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.root.push(Buffer {
            byte_length: self.bytes.len().into(),
            name: None,
            uri: None,
            extensions: None,
            extras: None,
        });
        let mut json = gltf::json::serialize::to_vec(&self.root)
            .expect("string keys and no custom serialiser, so that serialisation cannot fail");
        json.resize(json.len().next_multiple_of(4), b' ');
        let total = 12 + 8 + json.len() + 8 + self.bytes.len();
        if total as u64 > MAX_BYTES {
            return Err(ExportError::TooManyBytes {
                path: PathBuf::from("surface.glb"),
                bytes: total as u64,
                limit: MAX_BYTES,
            });
        }
        let word = |x: usize| (x as u32).to_le_bytes();
        let mut file = Vec::with_capacity(total);
        file.extend_from_slice(b"glTF");
        file.extend(2u32.to_le_bytes());
        file.extend(word(total));
        for (chunk, kind) in [(&json, b"JSON"), (&self.bytes, b"BIN\0")] {
            file.extend(word(chunk.len()));
            file.extend_from_slice(kind);
            file.extend_from_slice(chunk);
        }
        Ok(file)
    }
}

fn bounds(points: &[[f32; 3]]) -> ([f32; 3], [f32; 3]) {
    let start = ([f32::MAX; 3], [f32::MIN; 3]);
    points.iter().fold(start, |(low, high), p| {
        (
            std::array::from_fn(|i| low[i].min(p[i])),
            std::array::from_fn(|i| high[i].max(p[i])),
        )
    })
}

#[cfg(test)]
mod tests;
