//! Surfaces with some of their faces in colour: where something is wrong, in context.
//!
//! *Enters:* surfaces, each with a mark on every face. *Leaves:* one GLB: a mesh and a node for each surface, a primitive and a material
//! for each mark that occurs, the marked ones first; how many faces have which mark in `meshes[].extras`, under the key `affineAtlas`.
//! *Not guaranteed:* double precision, as in `surface.glb`. Faces with a corner that is not finite are left out.

use super::builder::Builder;
use crate::export::ExportError;
use gltf::json::accessor::Type;
use gltf::json::extras::RawValue;
use gltf::json::material::{PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Index, Material, Node, Scene, Value};
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;

/// What is said of a face.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Mark {
    /// What keeps an asset from being built.
    Offending,
    /// Where the flat metric makes the surface much larger.
    Grown,
    /// Where it makes it much smaller.
    Shrunk,
    /// Where angles change much.
    Sheared,
    /// Everything else.
    #[default]
    Plain,
}

impl Mark {
    /// All of them, in the order of primitives.
    const ALL: [Mark; 5] = [
        Mark::Offending,
        Mark::Grown,
        Mark::Shrunk,
        Mark::Sheared,
        Mark::Plain,
    ];

    /// Name of its material.
    pub fn name(self) -> &'static str {
        match self {
            Mark::Offending => "offending",
            Mark::Grown => "grown",
            Mark::Shrunk => "shrunk",
            Mark::Sheared => "sheared",
            Mark::Plain => "surface",
        }
    }

    /// Linear red, green, blue, alpha.
    fn colour(self) -> [f32; 4] {
        match self {
            Mark::Offending => [0.85, 0.12, 0.03, 1.0],
            Mark::Grown => [0.75, 0.1, 0.06, 1.0],
            Mark::Shrunk => [0.03, 0.12, 0.6, 1.0],
            Mark::Sheared => [0.8, 0.45, 0.02, 1.0],
            Mark::Plain => [0.45, 0.45, 0.45, 1.0],
        }
    }
}

/// A surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Marked {
    /// Its name.
    pub name: String,
    /// Vertices, source units.
    pub positions: Vec<[f64; 3]>,
    /// Faces; vertices must be in range.
    pub faces: Vec<[u32; 3]>,
    /// One a face.
    pub marks: Vec<Mark>,
}

impl Marked {
    /// Whether anything stands out.
    pub fn has_marks(&self) -> bool {
        self.marks.iter().any(|&mark| mark != Mark::Plain)
    }
}

/// The bytes of the file.
pub fn encode(surfaces: &[Marked]) -> Result<Vec<u8>, ExportError> {
    let mut builder = Builder::default();
    let materials = Mark::ALL.map(|mark| {
        builder.root.push(Material {
            name: Some(mark.name().into()),
            double_sided: true,
            pbr_metallic_roughness: PbrMetallicRoughness {
                base_color_factor: PbrBaseColorFactor(mark.colour()),
                metallic_factor: StrengthFactor(0.0),
                roughness_factor: StrengthFactor(0.9),
                ..PbrMetallicRoughness::default()
            },
            ..Material::default()
        })
    });
    let mut nodes = Vec::new();
    for surface in surfaces {
        nodes.extend(node(&mut builder, surface, materials));
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

/// Nothing where there is no face to draw.
fn node(
    builder: &mut Builder,
    surface: &Marked,
    materials: [Index<Material>; 5],
) -> Option<Index<Node>> {
    let at = |v: u32| {
        let p = surface.positions.get(v as usize).copied();
        p.filter(|p| p.iter().all(|x| x.is_finite()))
    };
    let drawn = |f: &[u32; 3]| f.iter().all(|&v| at(v).is_some());
    let first = surface.faces.iter().find(|f| drawn(f))?;
    // Near the surface, so that floats hold its detail.
    let origin = at(first[0])?.map(|x| x as f32);
    let mut primitives = Vec::new();
    let mut counts = BTreeMap::new();
    for (mark, material) in Mark::ALL.into_iter().zip(materials) {
        let faces: Vec<[u32; 3]> = (surface.faces.iter().zip(&surface.marks))
            .filter(|&(f, &own)| own == mark && drawn(f))
            .map(|(&f, _)| f)
            .collect();
        if faces.is_empty() {
            continue;
        }
        counts.insert(mark.name(), faces.len());
        let mut rows: FxHashMap<u32, u32> = FxHashMap::default();
        let (mut position, mut indices) = (Vec::new(), Vec::new());
        for v in faces.into_iter().flatten() {
            let next = position.len() as u32;
            let row = *rows.entry(v).or_insert(next);
            if row == next {
                let p = at(v).unwrap_or_default();
                position.push([0, 1, 2].map(|k| (p[k] - f64::from(origin[k])) as f32));
            }
            indices.push(row);
        }
        primitives.push(primitive(builder, &position, &indices, material));
    }
    let extras = serde_json::json!({ "affineAtlas": { "faces": counts } });
    let mesh = builder.root.push(gltf::json::Mesh {
        extensions: None,
        extras: RawValue::from_string(extras.to_string()).ok(),
        name: Some(surface.name.clone()),
        primitives,
        weights: None,
    });
    Some(builder.root.push(Node {
        mesh: Some(mesh),
        name: Some(surface.name.clone()),
        translation: (origin != [0.0; 3]).then_some(origin),
        ..Node::default()
    }))
}

fn primitive(
    builder: &mut Builder,
    position: &[[f32; 3]],
    indices: &[u32],
    material: Index<Material>,
) -> Primitive {
    let mut accessor = builder.attribute(position, Type::Vec3);
    let (low, high) = super::builder::bounds(position);
    accessor.min = Some(Value::from(low.to_vec()));
    accessor.max = Some(Value::from(high.to_vec()));
    let accessor = builder.root.push(accessor);
    let indices = builder.indices(indices, position.len());
    Primitive {
        attributes: BTreeMap::from([(Checked::Valid(Semantic::Positions), accessor)]),
        extensions: None,
        extras: None,
        indices: Some(indices),
        material: Some(material),
        mode: Checked::Valid(Mode::Triangles),
        targets: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_become_primitives_and_broken_faces_are_left_out() {
        let surface = Marked {
            name: "part".into(),
            positions: vec![
                [1e6, 0.0, 0.0],
                [1e6 + 1.0, 0.0, 0.0],
                [1e6, 1.0, 0.0],
                [f64::NAN, 0.0, 0.0],
                [1e6 + 1.0, 1.0, 0.0],
            ],
            faces: vec![[0, 1, 3], [0, 1, 2], [1, 4, 2]],
            marks: vec![Mark::Offending, Mark::Plain, Mark::Shrunk],
        };
        let nothing = Marked {
            positions: vec![[f64::NAN; 3]; 3],
            faces: vec![[0, 1, 2]],
            marks: vec![Mark::Offending],
            ..Marked::default()
        };
        let bytes = encode(&[nothing, surface]).unwrap();
        let file = gltf::Gltf::from_slice(&bytes).unwrap();
        let drawn: Vec<_> = file.document.meshes().collect();
        assert_eq!(drawn.len(), 1);
        let names: Vec<_> = drawn[0]
            .primitives()
            .map(|p| p.material().name().unwrap().to_owned())
            .collect();
        assert_eq!(names, ["shrunk", "surface"]);
        let node = file.document.nodes().next().unwrap();
        assert_eq!(node.transform().decomposed().0, [1e6, 0.0, 0.0]);
        let extras = drawn[0].extras().as_ref().unwrap().get();
        assert!(extras.contains("\"shrunk\":1"), "{extras}");
    }
}
