//! Files are read back by the `gltf` crate, which shares no code with the writer's layout of bytes.

use super::builder::bounds;
use super::*;
use crate::export::{atlas_json, sample};
use crate::geometry::mesh::{Appearance, AttributeKind, CornerAttribute, Material, TextureUse};
use gltf::json::Value;
use gltf::json::accessor::ComponentType;
use gltf::json::validation::Checked;
use std::collections::BTreeSet;

struct Read {
    document: gltf::Document,
    bin: Vec<u8>,
}

fn encoded(atlas: &AffineAtlas, appearance: &Appearance) -> Vec<u8> {
    let provenance = sample::provenance(appearance);
    let document = atlas_json::describe(atlas, &provenance).unwrap();
    let surface = Surface::of(atlas, appearance).unwrap();
    encode(&surface, &document, &provenance).unwrap()
}

fn read(atlas: &AffineAtlas, appearance: &Appearance) -> Read {
    let gltf = gltf::Gltf::from_slice(&encoded(atlas, appearance)).unwrap();
    Read {
        document: gltf.document,
        bin: gltf.blob.unwrap(),
    }
}

impl Read {
    fn primitives(&self) -> Vec<gltf::Primitive<'_>> {
        assert_eq!(self.document.meshes().len(), 1);
        let mesh = self.document.meshes().next().unwrap();
        mesh.primitives().collect()
    }

    fn positions(&self, primitive: &gltf::Primitive) -> Vec<[f32; 3]> {
        let reader = primitive.reader(|_| Some(&self.bin));
        reader.read_positions().unwrap().collect()
    }

    fn indices(&self, primitive: &gltf::Primitive) -> Vec<u32> {
        let reader = primitive.reader(|_| Some(&self.bin));
        reader.read_indices().unwrap().into_u32().collect()
    }

    fn tex_coords(&self, primitive: &gltf::Primitive, set: u32) -> Option<Vec<[f32; 2]>> {
        let reader = primitive.reader(|_| Some(&self.bin));
        Some(reader.read_tex_coords(set)?.into_f32().collect())
    }
}

#[test]
fn corners_keep_positions_patches_and_source_coordinates() {
    let atlas = sample::torus(5, 3);
    let file = read(&atlas, &Appearance::default());
    let [primitive] = &file.primitives()[..] else {
        panic!("one primitive expected")
    };
    let (positions, indices) = (file.positions(primitive), file.indices(primitive));
    let ours = file.tex_coords(primitive, 0).unwrap();
    let source = file.tex_coords(primitive, 1).unwrap();
    assert!(file.tex_coords(primitive, 2).is_none());
    // 15 vertices become the 24 of the slit rectangle.
    assert_eq!(positions.len(), 24);
    assert_eq!(indices.len(), 3 * atlas.mesh.connectivity.face_count());
    let patch = &atlas.patches.patches[0];
    for (at, &i) in indices.iter().enumerate() {
        let (f, k) = (FaceId::new(at / 3), at % 3);
        let p = atlas.mesh.face_positions(f)[k];
        let uv = atlas.patches.uv[f][k];
        for c in 0..3 {
            assert!((f64::from(positions[i as usize][c]) - p[c]).abs() < 1e-6);
        }
        let packed = [0, 1].map(|c| patch.packed_scale * uv[c] + patch.packed_offset[c]);
        assert!((f64::from(ours[i as usize][0]) - packed[0]).abs() < 1e-6);
        assert!((1.0 - f64::from(ours[i as usize][1]) - packed[1]).abs() < 1e-6);
        assert!(ours[i as usize].iter().all(|x| (0.0..=1.0).contains(x)));
        assert_eq!(
            source[i as usize],
            atlas.mesh.attributes[0].corner(f.index(), k)[..2]
        );
    }
}

#[test]
fn vertices_are_split_only_where_corners_differ() {
    let mut atlas = sample::torus(5, 3);
    atlas.mesh.attributes.clear();
    let plain = Appearance::default();
    assert_eq!(
        read(&atlas, &plain).primitives()[0]
            .get(&gltf::Semantic::Positions)
            .unwrap()
            .count(),
        24
    );
    // One face of another colour has three vertices of its own.
    let faces = atlas.mesh.connectivity.face_count();
    let mut values = vec![1.0f32; faces * 12];
    values[7 * 12..8 * 12].fill(0.25);
    atlas.mesh.attributes.push(CornerAttribute {
        kind: AttributeKind::Color(0),
        components: 4,
        values,
    });
    let file = read(&atlas, &plain);
    let primitive = &file.primitives()[0];
    assert_eq!(file.positions(primitive).len(), 27);
    let colors = primitive
        .reader(|_| Some(&file.bin))
        .read_colors(0)
        .unwrap();
    assert_eq!(colors.into_rgba_f32().filter(|c| c[0] == 0.25).count(), 3);
}

#[test]
fn normals_have_length_one_and_point_outwards() {
    let mut atlas = sample::torus(12, 9);
    let faces = atlas.mesh.connectivity.face_count();
    let check = |atlas: &AffineAtlas| {
        let file = read(atlas, &Appearance::default());
        let primitive = &file.primitives()[0];
        let reader = primitive.reader(|_| Some(&file.bin));
        for (p, n) in reader
            .read_positions()
            .unwrap()
            .zip(reader.read_normals().unwrap())
        {
            let length = n.iter().map(|x| x * x).sum::<f32>().sqrt();
            assert!((length - 1.0).abs() < 1e-5);
            // Outwards on a torus of radii 3 and 1: away from the core circle.
            let r = p[0].hypot(p[1]);
            let core = [p[0] * (1.0 - 3.0 / r), p[1] * (1.0 - 3.0 / r), p[2]];
            let dot: f32 = (0..3).map(|c| core[c] * n[c]).sum();
            assert!(dot > 0.8, "{dot}");
        }
    };
    check(&atlas);
    // Normals that are zero or missing in the source are made good.
    atlas.mesh.attributes.push(CornerAttribute {
        kind: AttributeKind::Normal,
        components: 3,
        values: [[0.0f32; 9], [f32::NAN; 9]].concat().repeat(faces / 2),
    });
    check(&atlas);
}

#[test]
fn materials_keep_their_textures_with_the_set_one_up() {
    let (atlas, appearance) = (sample::textured(), sample::appearance());
    let file = read(&atlas, &appearance);
    let primitives = file.primitives();
    // Two materials are used, and the faces without one get the default.
    let names: Vec<_> = primitives
        .iter()
        .map(|p| p.material().name().unwrap().to_owned())
        .collect();
    assert_eq!(names, ["textured", "plain", "default"]);
    assert_eq!(file.document.materials().len(), 3);
    assert_eq!(file.document.images().len(), 1);
    let material = primitives[0].material();
    let info = material
        .pbr_metallic_roughness()
        .base_color_texture()
        .unwrap();
    assert_eq!(info.tex_coord(), 1);
    let gltf::image::Source::View { view, mime_type } = info.texture().source().source() else {
        panic!("embedded image expected")
    };
    assert_eq!(mime_type, "image/png");
    let bytes = &file.bin[view.offset()..view.offset() + view.length()];
    assert_eq!(bytes, appearance.images[0].bytes);
    // Its second texture names a set that the surface does not have.
    assert!(material.emissive_texture().is_none());
    assert_eq!(primitives[1].material().alpha_cutoff(), Some(0.25));
    let triangles: usize = primitives.iter().map(|p| file.indices(p).len() / 3).sum();
    assert_eq!(triangles, atlas.mesh.connectivity.face_count());
}

#[test]
fn missing_parts_of_a_set_are_filled_and_sets_stay_consecutive() {
    let mut atlas = sample::torus(4, 3);
    let faces = atlas.mesh.connectivity.face_count();
    let set = |n, value| CornerAttribute {
        kind: AttributeKind::TexCoord(n),
        components: 2,
        values: vec![value; faces * 6],
    };
    // Sets 0 (empty), 3 and 9 (empty); an unknown kind is not written.
    atlas.mesh.attributes = vec![set(9, f32::NAN), set(3, 0.5), set(0, f32::NAN)];
    atlas.mesh.attributes.push(CornerAttribute {
        kind: AttributeKind::Custom("_TEMPERATURE".into()),
        components: 1,
        values: vec![1.0; faces * 3],
    });
    let mut appearance = Appearance {
        materials: vec![Material::default()],
        ..Appearance::default()
    };
    let count = |appearance: &Appearance, atlas: &AffineAtlas| {
        let file = read(atlas, appearance);
        let sets: BTreeSet<String> = file.primitives()[0]
            .attributes()
            .map(|(s, _)| s.to_string())
            .collect();
        sets
    };
    let expected = [
        "NORMAL",
        "POSITION",
        "TEXCOORD_0",
        "TEXCOORD_1",
        "TEXCOORD_2",
        "_LOG_SCALE",
    ];
    assert_eq!(
        count(&appearance, &atlas),
        expected.map(String::from).into()
    );
    // A material that needs the last set brings it back.
    appearance.materials[0].normal_texture = Some(TextureUse {
        texture: 0,
        tex_coord: 9,
        scale: 1.0,
    });
    atlas.mesh.face_material = crate::geometry::ids::FaceVec::filled(0, faces);
    assert!(count(&appearance, &atlas).contains("TEXCOORD_3"));
}

#[test]
fn tangents_are_kept_only_where_they_are_valid() {
    let mut atlas = sample::torus(4, 3);
    let faces = atlas.mesh.connectivity.face_count();
    let attribute = |kind, components, corner: &[f32]| CornerAttribute {
        kind,
        components,
        values: corner.repeat(3 * faces),
    };
    atlas.mesh.attributes = vec![
        attribute(AttributeKind::Normal, 3, &[0.0, 0.0, 2.0]),
        attribute(AttributeKind::Tangent, 4, &[1.0, 0.0, 0.0, -1.0]),
    ];
    let has_tangents = |atlas: &AffineAtlas| {
        let file = read(atlas, &Appearance::default());
        file.primitives()[0]
            .get(&gltf::Semantic::Tangents)
            .is_some()
    };
    assert!(has_tangents(&atlas));
    atlas.mesh.attributes[1].values[4 * 5 + 3] = 0.5;
    assert!(!has_tangents(&atlas));
}

#[test]
fn models_far_from_the_origin_keep_their_shape() {
    let mut atlas = sample::torus(5, 3);
    let shift = [1e9, -3e9, 0.0];
    let near = read(&atlas, &Appearance::default());
    for p in atlas.mesh.positions.as_mut_slice() {
        *p = std::array::from_fn(|i| p[i] + shift[i]);
    }
    atlas.image_origin = shift;
    let far = read(&atlas, &Appearance::default());
    let node = far.document.nodes().next().unwrap();
    assert_eq!(node.transform().decomposed().0, shift.map(|x| x as f32));
    let (a, b) = (
        near.positions(&near.primitives()[0]),
        far.positions(&far.primitives()[0]),
    );
    for (p, q) in a.iter().zip(&b) {
        assert!((0..3).all(|c| (p[c] - q[c]).abs() < 1e-5), "{p:?} {q:?}");
    }
}

#[test]
fn extras_hold_transitions_and_rectangles() {
    let atlas = sample::torus(8, 4);
    let file = read(&atlas, &Appearance::default());
    let mesh = file.document.meshes().next().unwrap();
    let extras: Value = serde_json::from_str(mesh.extras().as_ref().unwrap().get()).unwrap();
    let atlas_extras = &extras["affineAtlas"];
    let transitions = atlas_extras["transitions"].as_array().unwrap();
    assert_eq!(transitions.len(), atlas.charts.transitions.len());
    let rectangle: Vec<f64> =
        serde_json::from_value(atlas_extras["patches"][0]["rectangle"].clone()).unwrap();
    // The image has two texels of margin on every side and is the whole square's width.
    let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
    assert!(
        close(rectangle[0], 0.0) && close(rectangle[2], 1.0) && close(rectangle[3], 1.0),
        "{rectangle:?}"
    );
    let patch = &atlas.patches.patches[0];
    assert!(close(
        rectangle[3] - rectangle[1],
        patch.height as f64 / patch.width as f64
    ));
}

#[test]
fn bounds_and_index_types_follow_the_rules() {
    let atlas = sample::torus(5, 3);
    let file = read(&atlas, &Appearance::default());
    let primitive = &file.primitives()[0];
    let positions = file.positions(primitive);
    let (low, high) = bounds(&positions);
    let stated = primitive.bounding_box();
    assert_eq!((stated.min, stated.max), (low, high));
    let short = primitive.indices().unwrap();
    assert_eq!(short.data_type(), gltf::accessor::DataType::U16);
    let mut builder = Builder::default();
    builder.indices(&[0, 1, 2], 65_536);
    let Checked::Valid(component) = builder.root.accessors[0].component_type else {
        panic!("valid component type expected")
    };
    assert_eq!(component.0, ComponentType::U32);
    for view in file.document.views() {
        assert_eq!(view.offset() % 4, 0);
    }
}

#[test]
fn coordinates_beyond_single_precision_are_refused() {
    let mut atlas = sample::torus(4, 3);
    atlas.mesh.positions.as_mut_slice()[5][1] = 1e39;
    let error = Surface::of(&atlas, &Appearance::default());
    let error = error.err().expect("an error");
    assert!(
        matches!(error, ExportError::TooLarge { vertex: 5, .. }),
        "{error}"
    );
}
