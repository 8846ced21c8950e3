//! A surface with one texture over all of it, as a GLB that holds the image too.
//!
//! *Guaranteed:* triangles stand in the order of the faces; a vertex of the surface is there once for each place that it has in the
//! texture. *Not guaranteed:* double precision: positions are 32-bit floats, relative to the node's translation.

use super::builder::Builder;
use super::vertices::{PACKED_TOLERANCE, normals, unit};
use crate::export::ExportError;
use crate::geometry::ids::NONE;
use crate::geometry::mesh::Mesh;
use gltf::json::accessor::Type;
use gltf::json::image::MimeType;
use gltf::json::material::{AlphaMode, PbrMetallicRoughness, StrengthFactor};
use gltf::json::mesh::{Mode, Semantic};
use gltf::json::texture::{Info, MagFilter, MinFilter, Sampler, WrappingMode};
use gltf::json::validation::Checked;
use gltf::json::{Image, Material, Node, Scene, Texture, Value};
use std::collections::BTreeMap;

/// A surface and its texture.
#[derive(Clone, Copy, Debug)]
pub struct Textured<'a> {
    /// Its name.
    pub name: &'a str,
    /// The surface.
    pub mesh: &'a Mesh,
    /// Patch of every face: corners of different patches are never one vertex.
    pub patch: &'a [u32],
    /// Texture coordinates of every corner, v up.
    pub tex_coords: &'a [[[f64; 2]; 3]],
    /// Taken off the positions and put on the node; exact as 32-bit floats.
    pub origin: [f64; 3],
    /// The image, a PNG file.
    pub png: &'a [u8],
    /// True where the image has texels that are not opaque.
    pub is_transparent: bool,
}

/// The bytes of the file.
///
/// # Errors
/// More bytes than the format can hold, and positions that are no 32-bit floats.
pub fn encode(textured: &Textured<'_>) -> Result<Vec<u8>, ExportError> {
    let mut builder = Builder::default();
    let corners = Corners::split(textured)?;
    let mut position = builder.attribute(&corners.position, Type::Vec3);
    let (low, high) = super::builder::bounds(&corners.position);
    position.min = Some(Value::from(low.to_vec()));
    position.max = Some(Value::from(high.to_vec()));
    let normal = builder.attribute(&corners.normal, Type::Vec3);
    let tex_coord = builder.attribute(&corners.tex_coord, Type::Vec2);
    let attributes = [
        (Semantic::Positions, position),
        (Semantic::Normals, normal),
        (Semantic::TexCoords(0), tex_coord),
    ];
    let attributes: BTreeMap<_, _> = attributes
        .into_iter()
        .map(|(semantic, accessor)| (Checked::Valid(semantic), builder.root.push(accessor)))
        .collect();
    let indices = builder.indices(&corners.indices, corners.position.len());
    let material = material(textured, &mut builder);
    let mesh = builder.root.push(gltf::json::Mesh {
        extensions: None,
        extras: None,
        name: Some(textured.name.into()),
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
    let origin = textured.origin.map(|x| x as f32);
    let node = builder.root.push(Node {
        mesh: Some(mesh),
        name: Some(textured.name.into()),
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
    builder.root.asset.generator = Some(concat!("affine-atlas ", env!("CARGO_PKG_VERSION")).into());
    builder.finish()
}

/// A rough surface that has the image's colours.
fn material(textured: &Textured<'_>, builder: &mut Builder) -> gltf::json::Index<Material> {
    let view = builder.view(textured.png, None);
    let image = builder.root.push(Image {
        buffer_view: Some(view),
        mime_type: Some(MimeType("image/png".into())),
        name: Some(textured.name.into()),
        uri: None,
        extensions: None,
        extras: None,
    });
    let sampler = builder.root.push(Sampler {
        mag_filter: Some(Checked::Valid(MagFilter::Linear)),
        min_filter: Some(Checked::Valid(MinFilter::LinearMipmapLinear)),
        wrap_s: Checked::Valid(WrappingMode::ClampToEdge),
        wrap_t: Checked::Valid(WrappingMode::ClampToEdge),
        ..Sampler::default()
    });
    let texture = builder.root.push(Texture {
        name: None,
        sampler: Some(sampler),
        source: image,
        extensions: None,
        extras: None,
    });
    let alpha_mode = match textured.is_transparent {
        true => AlphaMode::Blend,
        false => AlphaMode::Opaque,
    };
    builder.root.push(Material {
        name: Some("pattern".into()),
        alpha_mode: Checked::Valid(alpha_mode),
        pbr_metallic_roughness: PbrMetallicRoughness {
            base_color_texture: Some(Info {
                index: texture,
                tex_coord: 0,
                extensions: None,
                extras: None,
            }),
            metallic_factor: StrengthFactor(0.0),
            roughness_factor: StrengthFactor(0.9),
            ..PbrMetallicRoughness::default()
        },
        double_sided: true,
        ..Material::default()
    })
}

/// Vertices of the file.
#[derive(Default)]
struct Corners {
    position: Vec<[f32; 3]>,
    normal: Vec<[f32; 3]>,
    tex_coord: Vec<[f32; 2]>,
    indices: Vec<u32>,
}

impl Corners {
    fn split(textured: &Textured<'_>) -> Result<Self, ExportError> {
        let Textured {
            mesh,
            patch,
            tex_coords,
            origin,
            ..
        } = textured;
        let (vertex_normal, face_normal) = normals(mesh);
        let mut corners = Self::default();
        // What a file vertex came from, and the one before it at the same vertex.
        let mut places: Vec<(u32, [f64; 2], u32)> = Vec::new();
        let mut last = vec![NONE; mesh.positions.len()];
        for f in mesh.connectivity.faces() {
            let vertices = mesh.connectivity.face_vertices(f);
            for (v, place) in vertices.into_iter().zip(tex_coords[f.index()]) {
                let own = patch[f.index()];
                let mut found = last[v.index()];
                while let Some(&(patch, other, before)) = places.get(found as usize) {
                    let near = |i: usize| (other[i] - place[i]).abs() <= PACKED_TOLERANCE;
                    if patch == own && near(0) && near(1) {
                        break;
                    }
                    found = before;
                }
                if found == NONE {
                    found = places.len() as u32;
                    places.push((own, place, last[v.index()]));
                    last[v.index()] = found;
                    let p = mesh.positions[v];
                    let p: [f64; 3] = std::array::from_fn(|i| p[i] - origin[i]);
                    if let Some(&coordinate) = p.iter().find(|x| !(**x as f32).is_finite()) {
                        let vertex = v.index();
                        return Err(ExportError::TooLarge { vertex, coordinate });
                    }
                    corners.position.push(p.map(|x| x as f32));
                    let normal = unit(vertex_normal[v]).or_else(|| unit(face_normal[f]));
                    let normal = normal.unwrap_or([0.0, 0.0, 1.0]).map(|x| x as f32 + 0.0);
                    corners.normal.push(normal);
                    let [s, t] = place;
                    corners.tex_coord.push([s as f32, (1.0 - t) as f32]);
                }
                corners.indices.push(found);
            }
        }
        Ok(corners)
    }
}
