//! Meshes of positions and normals, rebuilt from geometry images or of spline surfaces: one GLB, a mesh and a node a component.
//!
//! *Guaranteed:* the vertices of a mesh are those it was rebuilt with, shared by all faces that meet there: as watertight
//! as the mesh. *Not guaranteed:* double precision: positions are 32-bit floats, relative to the node's translation.

use super::builder::Builder;
use crate::export::ExportError;
use gltf::json::accessor::Type;
use gltf::json::material::{PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor};
use gltf::json::mesh::{Mode, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Material, Mesh, Node, Scene, Value};
use std::collections::BTreeMap;

/// One component.
#[derive(Clone, Copy, Debug)]
pub struct Component<'a> {
    /// Its name.
    pub name: &'a str,
    /// Vertices, source units.
    pub positions: &'a [[f64; 3]],
    /// Unit normals of the vertices; none where viewers are to shade faces flat.
    pub normals: Option<&'a [[f32; 3]]>,
    /// Counterclockwise.
    pub faces: &'a [[u32; 3]],
    /// Taken off the positions and put on the node; exact as 32-bit floats.
    pub origin: [f64; 3],
}

/// The bytes of the file.
pub fn encode(components: &[Component<'_>]) -> Result<Vec<u8>, ExportError> {
    let mut builder = Builder::default();
    let material = builder.root.push(Material {
        pbr_metallic_roughness: PbrMetallicRoughness {
            base_color_factor: PbrBaseColorFactor([0.6, 0.6, 0.6, 1.0]),
            metallic_factor: StrengthFactor(0.0),
            roughness_factor: StrengthFactor(0.9),
            ..PbrMetallicRoughness::default()
        },
        double_sided: true,
        ..Material::default()
    });
    let mut nodes = Vec::new();
    for component in components {
        let origin = component.origin.map(|x| x as f32);
        let position: Vec<[f32; 3]> = component
            .positions
            .iter()
            .map(|p| std::array::from_fn(|i| (p[i] - f64::from(origin[i])) as f32))
            .collect();
        let mut accessor = builder.attribute(&position, Type::Vec3);
        let (low, high) = super::builder::bounds(&position);
        accessor.min = Some(Value::from(low.to_vec()));
        accessor.max = Some(Value::from(high.to_vec()));
        let accessor = builder.root.push(accessor);
        let mut attributes = BTreeMap::from([(Checked::Valid(Semantic::Positions), accessor)]);
        if let Some(normals) = component.normals {
            let normals = builder.attribute(normals, Type::Vec3);
            let normals = builder.root.push(normals);
            attributes.insert(Checked::Valid(Semantic::Normals), normals);
        }
        let indices = builder.indices(component.faces.as_flattened(), position.len());
        let mesh = builder.root.push(Mesh {
            extensions: None,
            extras: None,
            name: Some(component.name.into()),
            primitives: vec![gltf::json::mesh::Primitive {
                attributes,
                extensions: None,
                extras: None,
                indices: Some(indices),
                material: Some(material),
                mode: Checked::Valid(Mode::Triangles),
                targets: None,
            }],
            weights: None,
        });
        nodes.push(builder.root.push(Node {
            mesh: Some(mesh),
            name: Some(component.name.into()),
            translation: (origin != [0.0; 3]).then_some(origin),
            ..Node::default()
        }));
    }
    let scene = builder.root.push(Scene {
        extensions: None,
        extras: None,
        name: None,
        nodes,
    });
    builder.root.scene = Some(scene);
    builder.root.asset.generator = Some(concat!("affine-atlas ", env!("CARGO_PKG_VERSION")).into());
    builder.finish()
}
