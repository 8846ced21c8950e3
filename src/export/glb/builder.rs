//! The two chunks of a GLB file.

use super::vertices::Primitive;
use crate::export::ExportError;
use gltf::json::accessor::{ComponentType, GenericComponentType, Type};
use gltf::json::buffer::{Target, View};
use gltf::json::mesh::{Mode, Semantic};
use gltf::json::validation::{Checked, USize64};
use gltf::json::{Accessor, Buffer, Index, Mesh, Node, Root, Scene, Value};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Largest file that the format's 32-bit lengths allow.
const MAX_BYTES: u64 = u32::MAX as u64;

/// The JSON chunk and the binary chunk while they grow.
#[derive(Default)]
pub(super) struct Builder {
    pub(super) root: Root,
    pub(super) bytes: Vec<u8>,
}

impl Builder {
    /// Adds bytes at an offset that is a multiple of four, and their view.
    pub(super) fn view(&mut self, bytes: &[u8], target: Option<Target>) -> Index<View> {
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

    pub(super) fn accessor(
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
    pub(super) fn attribute<const N: usize>(
        &mut self,
        values: &[[f32; N]],
        shape: Type,
    ) -> Accessor {
        let bytes: Vec<u8> = values
            .iter()
            .flatten()
            .flat_map(|x| x.to_le_bytes())
            .collect();
        let view = self.view(&bytes, Some(Target::ArrayBuffer));
        self.accessor(view, values.len(), ComponentType::F32, shape)
    }

    pub(super) fn primitive(
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
    pub(super) fn indices(&mut self, indices: &[u32], vertices: usize) -> Index<Accessor> {
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

    /// A scene of one mesh, moved.
    pub(super) fn scene(&mut self, mesh: Mesh, origin: [f32; 3]) {
        let name = mesh.name.clone();
        let mesh = self.root.push(mesh);
        let node = self.root.push(Node {
            mesh: Some(mesh),
            name,
            translation: (origin != [0.0; 3]).then_some(origin),
            ..Node::default()
        });
        let scene = self.root.push(Scene {
            extensions: None,
            extras: None,
            name: None,
            nodes: vec![node],
        });
        self.root.scene = Some(scene);
        self.root.asset.generator =
            Some(concat!("affine-atlas ", env!("CARGO_PKG_VERSION")).into());
    }

    /// Header, JSON chunk padded with spaces, binary chunk padded with zeros.
    pub(super) fn finish(mut self) -> Result<Vec<u8>, ExportError> {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.root.push(Buffer {
            byte_length: self.bytes.len().into(),
            name: None,
            uri: None,
            extensions: None,
            extras: None,
        });
        let mut json = self
            .root
            .to_vec()
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

pub(super) fn bounds(points: &[[f32; 3]]) -> ([f32; 3], [f32; 3]) {
    let start = ([f32::MAX; 3], [f32::MIN; 3]);
    points.iter().fold(start, |(low, high), p| {
        (
            std::array::from_fn(|i| low[i].min(p[i])),
            std::array::from_fn(|i| high[i].max(p[i])),
        )
    })
}
