//! Surfaces in grey with the faces of one region in colour: where a circle packing cannot exist.
//!
//! *Enters:* meshes, each with a set of its vertices. *Leaves:* one GLB: a mesh and a node for each; its first primitive is
//! the region, every face with a corner in the set, its second the rest; the set, by the numbers of the source file, and both sides
//! of the inequality in `meshes[].extras`, under the key `affineAtlas`.
//! *Not guaranteed:* double precision, as in `surface.glb`.

use super::builder::Builder;
use crate::export::ExportError;
use crate::flow::feasibility::{Side, Violation};
use crate::geometry::ids::{FaceId, VertexVec};
use crate::geometry::mesh::Mesh;
use gltf::json::accessor::Type;
use gltf::json::extras::RawValue;
use gltf::json::material::{PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor};
use gltf::json::mesh::{Mode, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Index, Material, Node, Scene, Value};
use serde::Serialize;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// The region and what is around it, linear red, green, blue, alpha.
const COLOURS: [(&str, [f32; 4]); 2] = [
    ("region", [0.85, 0.12, 0.03, 1.0]),
    ("surface", [0.45, 0.45, 0.45, 1.0]),
];

/// A component of the file that breaks (6).
#[derive(Clone, Debug)]
pub struct RegionOf {
    /// Which component, from 0.
    pub component: usize,
    /// The surface.
    pub mesh: Mesh,
    /// The set of its vertices, numbered as `mesh` does.
    pub violation: Violation,
}

#[derive(Debug, Serialize)]
struct Extras {
    #[serde(rename = "affineAtlas")]
    atlas: RegionExtras,
}

#[derive(Debug, Serialize)]
struct RegionExtras {
    component: usize,
    /// Of the source file.
    vertices: Vec<u32>,
    /// The curvature must be `more` or `less` than the bound.
    must_be: &'static str,
    /// In π.
    bound: f64,
    /// In π.
    curvature: f64,
}

/// The bytes of the file.
pub fn encode(regions: &[RegionOf]) -> Result<Vec<u8>, ExportError> {
    let mut builder = Builder::default();
    let material = COLOURS.map(|(name, colour)| {
        builder.root.push(Material {
            name: Some(name.into()),
            double_sided: true,
            pbr_metallic_roughness: PbrMetallicRoughness {
                base_color_factor: PbrBaseColorFactor(colour),
                metallic_factor: StrengthFactor(0.0),
                roughness_factor: StrengthFactor(0.9),
                ..PbrMetallicRoughness::default()
            },
            ..Material::default()
        })
    });
    let mut nodes = Vec::new();
    for region in regions {
        nodes.push(surface(&mut builder, region, material));
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

fn surface(
    builder: &mut Builder,
    region: &RegionOf,
    material: [Index<Material>; 2],
) -> Index<Node> {
    let RegionOf {
        component,
        mesh,
        violation,
    } = region;
    let c = &mesh.connectivity;
    let mut inside = VertexVec::filled(false, c.vertex_count());
    for &v in &violation.vertices {
        inside[v] = true;
    }
    let touched = |f: &FaceId| c.face_vertices(*f).into_iter().any(|v| inside[v]);
    let (of_region, rest): (Vec<FaceId>, Vec<FaceId>) = c.faces().partition(touched);
    // Near the surface, so that floats hold its detail.
    let origin = mesh
        .positions
        .iter()
        .next()
        .map_or([0.0; 3], |p| p.map(|x| x as f32));
    let mut primitives = Vec::new();
    for (faces, material) in [of_region, rest].into_iter().zip(material) {
        if faces.is_empty() {
            continue;
        }
        primitives.push(primitive(builder, mesh, &faces, origin, material));
    }
    let name = format!("component {component}");
    let mesh = builder.root.push(gltf::json::Mesh {
        extensions: None,
        extras: Some(extras(*component, mesh, violation)),
        name: Some(name.clone()),
        primitives,
        weights: None,
    });
    builder.root.push(Node {
        mesh: Some(mesh),
        name: Some(name),
        translation: (origin != [0.0; 3]).then_some(origin),
        ..Node::default()
    })
}

/// Faces with vertices of their own, so that viewers shade them flat.
fn primitive(
    builder: &mut Builder,
    mesh: &Mesh,
    faces: &[FaceId],
    origin: [f32; 3],
    material: Index<Material>,
) -> gltf::json::mesh::Primitive {
    let c = &mesh.connectivity;
    let mut number = VertexVec::filled(None, c.vertex_count());
    let (mut position, mut indices) = (Vec::new(), Vec::new());
    for &f in faces {
        for v in c.face_vertices(f) {
            let next = position.len() as u32;
            let own = *number[v].get_or_insert(next);
            if own == next {
                let p = mesh.positions[v];
                position.push([0, 1, 2].map(|k| (p[k] - f64::from(origin[k])) as f32));
            }
            indices.push(own);
        }
    }
    let mut accessor = builder.attribute(&position, Type::Vec3);
    let (low, high) = super::builder::bounds(&position);
    accessor.min = Some(Value::from(low.to_vec()));
    accessor.max = Some(Value::from(high.to_vec()));
    let accessor = builder.root.push(accessor);
    let indices = builder.indices(&indices, position.len());
    gltf::json::mesh::Primitive {
        attributes: BTreeMap::from([(Checked::Valid(Semantic::Positions), accessor)]),
        extensions: None,
        extras: None,
        indices: Some(indices),
        material: Some(material),
        mode: Checked::Valid(Mode::Triangles),
        targets: None,
    }
}

fn extras(component: usize, mesh: &Mesh, violation: &Violation) -> Box<RawValue> {
    let vertices = violation.vertices.iter().map(|&v| mesh.source_vertex[v]);
    let extras = Extras {
        atlas: RegionExtras {
            component,
            vertices: vertices.collect(),
            must_be: match violation.side {
                Side::Below => "more",
                Side::Above => "less",
            },
            bound: violation.bound / PI,
            curvature: violation.curvature / PI,
        },
    };
    gltf::json::serialize::to_string(&extras)
        .and_then(RawValue::from_string)
        .expect("string keys and no custom serialiser, so that serialisation cannot fail")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::ids::VertexId;
    use crate::repair::corpus::soup;
    use crate::repair::{RepairParams, repair};

    #[test]
    fn a_region_is_drawn_apart_from_the_rest_and_listed() {
        // Two tents that share a side.
        let at = |x: i32, y: i32| [f64::from(x) + 1e6, f64::from(y), 0.0];
        let corners = vec![at(0, 0), at(1, 0), at(1, 1), at(0, 1), at(2, 0), at(2, 1)];
        let faces = vec![[0, 1, 3], [1, 2, 3], [1, 4, 2], [4, 5, 2]];
        let repaired = repair(&soup(corners, faces), &RepairParams::default()).unwrap();
        let component = repaired.components.into_iter().next().unwrap();
        let mut mesh = component.mesh.unwrap();
        component.frame.leave_all(&mut mesh.positions);
        let v = |source: u32| {
            let position = mesh.source_vertex.iter().position(|&s| s == source);
            VertexId::new(position.unwrap())
        };
        let vertices = vec![v(0), v(3)];
        let violation = Violation {
            vertex: v(0),
            size: 2,
            vertices,
            side: Side::Below,
            curvature: -PI,
            bound: -0.5 * PI,
            slack: -0.5 * PI,
        };
        let bytes = encode(&[RegionOf {
            component: 3,
            mesh,
            violation,
        }])
        .unwrap();
        let file = gltf::Gltf::from_slice(&bytes).unwrap();
        let (document, blob) = (file.document, file.blob.unwrap());
        let drawn = document.meshes().next().unwrap();
        let faces: Vec<Vec<[f32; 3]>> = drawn
            .primitives()
            .map(|p| {
                let reader = p.reader(|_| Some(&blob[..]));
                let position: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
                let indices = reader.read_indices().unwrap().into_u32();
                indices.map(|i| position[i as usize]).collect()
            })
            .collect();
        assert_eq!([faces[0].len(), faces[1].len()], [6, 6]);
        let node = document.nodes().next().unwrap();
        let moved = node.transform().decomposed().0;
        let lowest = |k: usize| {
            let x = faces[k]
                .iter()
                .map(|p| f64::from(p[0]) + f64::from(moved[0]));
            x.fold(f64::INFINITY, f64::min)
        };
        assert_eq!([lowest(0), lowest(1)], [1e6, 1e6 + 1.0]);
        let extras: serde_json::Value =
            serde_json::from_str(drawn.extras().as_ref().unwrap().get()).unwrap();
        let own = &extras["affineAtlas"];
        let mut listed: Vec<u64> = own["vertices"]
            .as_array()
            .unwrap()
            .iter()
            .map(|v| v.as_u64().unwrap())
            .collect();
        listed.sort_unstable();
        assert_eq!(listed, [0, 3]);
        assert_eq!(own["component"], 3);
        assert_eq!(
            (&own["must_be"], &own["bound"]),
            (&"more".into(), &(-0.5).into())
        );
    }
}
