//! glTF and GLB: what is read, and what is refused with which words. Every asset is built here.

use affine_atlas::geometry::ids::NONE;
use affine_atlas::geometry::mesh::{AttributeKind, CornerAttribute, Soup};
use affine_atlas::read::{ReadParams, SourceAsset, read, read_bytes};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;

const BYTE: u32 = 5120;
const UNSIGNED_BYTE: u32 = 5121;
const SHORT: u32 = 5122;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

const SQUARE: [[f32; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
];

/// An asset under construction: JSON and one buffer.
struct Asset {
    json: Value,
    binary: Vec<u8>,
}

impl Asset {
    fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "accessors": [], "bufferViews": [], "meshes": [],
        });
        Self {
            json,
            binary: Vec::new(),
        }
    }

    fn push(&mut self, list: &str, item: Value) -> usize {
        if self.json[list].is_null() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().unwrap();
        list.push(item);
        list.len() - 1
    }

    fn view(&mut self, bytes: impl IntoIterator<Item = u8>) -> usize {
        let start = self.binary.len();
        self.binary.extend(bytes);
        let length = self.binary.len() - start;
        while !self.binary.len().is_multiple_of(4) {
            self.binary.push(0);
        }
        self.push(
            "bufferViews",
            json!({"buffer": 0, "byteOffset": start, "byteLength": length}),
        )
    }

    fn accessor(
        &mut self,
        kind: &str,
        component: u32,
        count: usize,
        bytes: impl IntoIterator<Item = u8>,
    ) -> usize {
        let view = self.view(bytes);
        self.push(
            "accessors",
            json!({"bufferView": view, "componentType": component, "count": count, "type": kind}),
        )
    }

    fn floats(&mut self, kind: &str, rows: &[impl AsRef<[f32]>]) -> usize {
        let numbers = rows.iter().flat_map(|r| r.as_ref().to_vec());
        let bytes: Vec<u8> = numbers.flat_map(f32::to_le_bytes).collect();
        self.accessor(kind, FLOAT, rows.len(), bytes)
    }

    fn shorts(&mut self, indices: &[u16]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|i| i.to_le_bytes()).collect();
        self.accessor("SCALAR", UNSIGNED_SHORT, indices.len(), bytes)
    }

    fn json_bytes(&self) -> Vec<u8> {
        serde_json::to_vec(&self.json).unwrap()
    }

    fn glb(&mut self) -> Vec<u8> {
        if self.json["buffers"].is_null() {
            self.json["buffers"] = json!([{"byteLength": self.binary.len()}]);
        }
        glb(&self.json_bytes(), &self.binary)
    }

    fn read(&mut self) -> SourceAsset {
        read_bytes(Path::new("a.glb"), &self.glb(), &ReadParams::default()).unwrap()
    }

    fn soup(&mut self) -> Soup {
        self.read().soup
    }

    fn refusal(&mut self) -> String {
        let error = read_bytes(Path::new("a.glb"), &self.glb(), &ReadParams::default());
        error.unwrap_err().to_string()
    }
}

/// What reading counts for the objects of a JSON text.
fn object_bytes(json: &[u8]) -> u64 {
    512 * json.iter().filter(|&&b| b == b'{').count() as u64
}

fn glb(json: &[u8], binary: &[u8]) -> Vec<u8> {
    let padded = json.len().next_multiple_of(4);
    let length = 12 + 8 + padded + 8 + binary.len();
    let mut bytes = b"glTF".to_vec();
    for word in [2, length as u32, padded as u32, 0x4E4F_534A] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(json);
    bytes.resize(20 + padded, b' ');
    bytes.extend((binary.len() as u32).to_le_bytes());
    bytes.extend(0x004E_4942u32.to_le_bytes());
    bytes.extend(binary);
    bytes
}

/// The unit square as two triangles.
fn square() -> Asset {
    let mut asset = Asset::new();
    let position = asset.floats("VEC3", &SQUARE);
    let indices = asset.shorts(&[0, 1, 2, 0, 2, 3]);
    asset.push(
        "meshes",
        json!({"primitives": [{"attributes": {"POSITION": position}, "indices": indices}]}),
    );
    asset
}

const FACES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

fn exact(points: &[[f32; 3]]) -> Vec<[f64; 3]> {
    points.iter().map(|p| p.map(f64::from)).collect()
}

fn attribute(soup: &Soup, kind: AttributeKind) -> &CornerAttribute {
    soup.attributes.iter().find(|a| a.kind == kind).unwrap()
}

fn close(a: &[f32], b: &[f64]) -> bool {
    a.len() == b.len()
        && a.iter()
            .zip(b)
            .all(|(x, y)| (f64::from(*x) - y).abs() < 1e-6)
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for chunk in bytes.chunks(3) {
        let word =
            chunk.iter().fold(0u32, |w, &b| w << 8 | u32::from(b)) << (8 * (3 - chunk.len()));
        for k in 0..4 {
            let digit = DIGITS[(word >> (18 - 6 * k) & 63) as usize];
            text.push(if k <= chunk.len() {
                char::from(digit)
            } else {
                '='
            });
        }
    }
    text
}

// ---- containers

#[test]
fn glb_data_uri_and_external_buffer_hold_the_same() {
    let mut asset = square();
    let binary = asset.binary.clone();
    let from_glb = asset.read();
    assert_eq!(from_glb.soup.positions, exact(&SQUARE));
    assert_eq!(from_glb.soup.faces, FACES);
    assert_eq!(from_glb.soup.face_material, [NONE; 2]);
    assert_eq!(from_glb.soup.parts[0].name, "node 0, mesh 0, primitive 0");
    let params = ReadParams::default();
    let uri = format!("data:application/octet-stream;base64,{}", base64(&binary));
    asset.json["buffers"] = json!([{"byteLength": binary.len(), "uri": uri}]);
    let from_data = read_bytes(Path::new("a.gltf"), &asset.json_bytes(), &params).unwrap();
    assert_eq!(from_data.soup, from_glb.soup);

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    fs::create_dir(folder.path().join("a b")).unwrap();
    fs::write(folder.path().join("a b/c.bin"), &binary).unwrap();
    asset.json["buffers"] = json!([{"byteLength": binary.len(), "uri": "a%20b/c.bin"}]);
    let text = asset.json_bytes();
    fs::write(&path, &text).unwrap();
    let from_file = read(&path, &params).unwrap();
    assert_eq!(from_file.soup, from_glb.soup);
    assert_eq!(
        from_file.files,
        [path.clone(), folder.path().join("a b/c.bin")]
    );
    let hashes = [blake3::hash(&text), blake3::hash(&binary)];
    let both: Vec<u8> = hashes.iter().flat_map(|h| *h.as_bytes()).collect();
    assert_eq!(from_file.blake3, blake3::hash(&both).to_hex().to_string());
    // In memory there is no folder.
    let error = read_bytes(Path::new("a.gltf"), &text, &params).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("`a%20b/c.bin` it refers to cannot be read")
    );
    // The budget counts both files.
    let tight = ReadParams {
        max_file_bytes: object_bytes(&text) + 1024 + (text.len() + binary.len() - 1) as u64,
        ..params
    };
    let message = read(&path, &tight).unwrap_err().to_string();
    assert!(
        message.contains("c.bin would bring the asset to"),
        "{message}"
    );
}

#[test]
fn truncated_containers() {
    let bytes = square().glb();
    for length in 0..bytes.len() {
        let error = read_bytes(Path::new("a.glb"), &bytes[..length], &ReadParams::default());
        assert!(error.is_err(), "{length}");
    }
    let cut = |length: usize| {
        let error = read_bytes(Path::new("a.glb"), &bytes[..length], &ReadParams::default());
        error.unwrap_err().to_string()
    };
    assert!(cut(8).contains("ends after 8 bytes where the GLB header needs 12"));
    let needed = format!("where the GLB file needs {}", bytes.len());
    assert!(
        cut(bytes.len() - 1).contains(&needed),
        "{}",
        cut(bytes.len() - 1)
    );
    let mut long_chunk = bytes.clone();
    long_chunk[12..16].copy_from_slice(&u32::MAX.to_le_bytes());
    let error = read_bytes(Path::new("a.glb"), &long_chunk, &ReadParams::default());
    assert!(
        error
            .unwrap_err()
            .to_string()
            .contains("a GLB chunk needs 4294967315")
    );
    let mut old = bytes.clone();
    old[4] = 1;
    let error = read_bytes(Path::new("a.glb"), &old, &ReadParams::default());
    assert!(
        error
            .unwrap_err()
            .to_string()
            .contains("glTF version 1, and only 2.0")
    );
    // Zeros instead of blanks after the JSON, and bytes after the end, are forgiven.
    let mut asset = square();
    asset.glb();
    let mut json = asset.json_bytes();
    json.extend([0; 5]);
    let mut padded = glb(&json, &asset.binary);
    padded.extend([7; 3]);
    assert!(read_bytes(Path::new("a.glb"), &padded, &ReadParams::default()).is_ok());
}

#[test]
fn json_that_is_none() {
    let refusal = |text: &str| {
        let error = read_bytes(Path::new("a.gltf"), text.as_bytes(), &ReadParams::default());
        error.unwrap_err().to_string()
    };
    assert!(refusal("").contains("its glTF JSON cannot be read"));
    assert!(refusal("{").contains("line 1 column 1"));
    assert!(refusal("{}").contains("missing field `asset`"));
    assert!(
        refusal(r#"{"asset":{"version":"1.0"},"nodes":{"a":1}}"#)
            .contains("glTF version 1.0, and only 2.0")
    );
    assert!(refusal(r#"{"asset":{"version":"2.0","minVersion":"2.1"}}"#).contains("version 2.1"));
    assert!(refusal(r#"{"asset":{"version":"2.0"}}"#).contains("holds no triangle"));
    assert!(refusal(r#"{"asset":{"version":"2.0"},"scene":-1}"#).contains("invalid value"));
    // Deep nesting ends in an error, not in an overflow of the stack.
    let deep = format!(
        r#"{{"asset":{{"version":"2.0"}},"extras":{}"#,
        "[".repeat(1_000_000)
    );
    assert!(refusal(&deep).contains("its glTF JSON cannot be read"));
    let deep = format!(
        r#"{{"asset":{{"version":"2.0"}},"nodes":[{}"#,
        r#"{"extensions":"#.repeat(1_000_000)
    );
    assert!(refusal(&deep).contains("its glTF JSON cannot be read"));
}

// ---- node tree

#[test]
fn transforms_compose_down_the_tree() {
    let mut asset = square();
    let half = std::f64::consts::FRAC_1_SQRT_2;
    asset.json["nodes"] = json!([
        {"children": [1], "translation": [10.0, 0.0, 0.0], "rotation": [0.0, 0.0, half, half], "scale": [2.0, 2.0, 2.0]},
        {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 3, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1]},
    ]);
    let soup = asset.soup();
    // (1, 1, 0) → matrix (1, 3, 5) → scale (2, 6, 10) → quarter turn (−6, 2, 10) → (4, 2, 10).
    let expected = [4.0, 2.0, 10.0];
    for (x, e) in soup.positions[2].iter().zip(expected) {
        assert!((x - e).abs() < 1e-14);
    }
    assert_eq!(soup.faces, FACES);
    // A rotation that is not quite a unit, as single precision has it, scales nothing.
    asset.json["nodes"] = json!([{"mesh": 0, "rotation": [0.0, 0.0, 0.70710683, 0.70710683]}]);
    let turned = asset.soup().positions[1];
    assert!((turned[1] - 1.0).abs() < 1e-15 && turned[0].abs() < 1e-15);
}

#[test]
fn instances_run_in_node_order_and_mirrors_are_reversed() {
    let mut asset = square();
    let normals = asset.floats("VEC3", &[[0.0, 0.0, 1.0]; 4]);
    let tangents = asset.floats("VEC4", &[[1.0, 0.0, 0.0, 1.0]; 4]);
    let attributes = &mut asset.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["NORMAL"] = json!(normals);
    attributes["TANGENT"] = json!(tangents);
    asset.json["scenes"] = json!([{"nodes": [2, 0]}]);
    asset.json["nodes"] = json!([
        {"mesh": 0, "scale": [-1, 1, 1], "name": "mirrored"},
        {"mesh": 0, "translation": [0, 0, 7]},
        {"mesh": 0, "scale": [1, -1, -1], "children": [1]},
    ]);
    let soup = asset.soup();
    assert_eq!(soup.positions.len(), 12);
    let names: Vec<_> = soup
        .parts
        .iter()
        .map(|p| (p.name.as_str(), p.first_vertex, p.first_face, p.faces))
        .collect();
    assert_eq!(
        names,
        [
            ("node 0 (mirrored), mesh 0, primitive 0", 0, 0, 2),
            ("node 1, mesh 0, primitive 0", 4, 2, 2),
            ("node 2, mesh 0, primitive 0", 8, 4, 2),
        ]
    );
    assert_eq!(soup.faces[0], [0, 2, 1]);
    assert_eq!(soup.faces[4], [8, 9, 10]);
    assert_eq!(soup.positions[6], [1.0, -1.0, -7.0]);
    // The stored normal agrees with the triangle's in every instance.
    let normal = attribute(&soup, AttributeKind::Normal);
    let tangent = attribute(&soup, AttributeKind::Tangent);
    for (f, face) in soup.faces.iter().enumerate() {
        let [a, b, c] = face.map(|v| soup.positions[v as usize]);
        let z = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        assert!(z * f64::from(normal.corner(f, 0)[2]) > 0.9, "face {f}");
        let expected: &[f64] = if f < 2 {
            &[-1.0, 0.0, 0.0, -1.0]
        } else {
            &[1.0, 0.0, 0.0, 1.0]
        };
        assert!(close(tangent.corner(f, 1), expected));
    }
}

#[test]
fn normals_move_by_the_inverse_transpose() {
    let mut asset = square();
    let s = std::f32::consts::FRAC_1_SQRT_2;
    let normals = asset.floats(
        "VEC3",
        &[[s, s, 0.0], [0.0, 0.0, 1.0], [0.0; 3], [1.0, 0.0, 0.0]],
    );
    asset.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    asset.json["nodes"] = json!([{"mesh": 0, "scale": [2, 1, 5]}]);
    let soup = asset.soup();
    let normal = attribute(&soup, AttributeKind::Normal);
    // x + y = const becomes x/2 + y = const.
    let five = 5.0f64.sqrt();
    assert!(close(normal.corner(0, 0), &[1.0 / five, 2.0 / five, 0.0]));
    assert!(close(normal.corner(0, 1), &[0.0, 0.0, 1.0]));
    assert!(
        normal.corner(0, 2)[0].is_nan(),
        "a zero normal is no normal"
    );
}

#[test]
fn default_scene_and_no_scene() {
    let mut asset = square();
    asset.json["nodes"] = json!([{"mesh": 0}, {"mesh": 0}, {"mesh": 0}]);
    asset.json["scenes"] = json!([{"nodes": [0]}, {"nodes": [1, 2]}]);
    let read = asset.read();
    assert_eq!(read.soup.faces.len(), 2);
    assert_eq!(
        read.notes,
        ["2 nodes with meshes lie outside the default scene and are skipped"]
    );
    asset.json["scene"] = json!(1);
    assert_eq!(asset.soup().faces.len(), 4);
    asset.json.as_object_mut().unwrap().remove("scene");
    assert_eq!(asset.soup().faces.len(), 6);
    asset.json["scene"] = json!(2);
    assert!(
        asset
            .refusal()
            .contains("the asset refers to scene 2, but there are 2, counted from 0")
    );
}

#[test]
fn node_graphs_that_are_no_trees() {
    let mut asset = square();
    let mut refused = |nodes: Value, scene: Value| {
        asset.json["nodes"] = nodes;
        asset.json["scenes"] = json!([{"nodes": scene}]);
        asset.refusal()
    };
    let own_child = refused(json!([{"mesh": 0, "children": [0]}]), json!([0]));
    assert!(
        own_child.contains("node 0 is reached twice (a cycle or two parents)"),
        "{own_child}"
    );
    assert!(
        refused(
            json!([{"children": [1]}, {"children": [0], "mesh": 0}]),
            json!([0])
        )
        .contains("is reached twice")
    );
    assert!(refused(json!([{"mesh": 0}]), json!([0, 0])).contains("node 0 is reached twice"));
    assert!(
        refused(json!([{"children": [7]}]), json!([0]))
            .contains("node 0 refers to node 7, but there are 1")
    );
    assert!(refused(json!([{}]), json!([3])).contains("the scene refers to node 3"));
    assert!(
        refused(json!([{"mesh": 5}]), json!([0]))
            .contains("node 0 refers to mesh 5, but there are 1")
    );
    assert!(
        refused(json!([{"mesh": 0, "rotation": [0, 0, 0, 0]}]), json!([0]))
            .contains("node 0 has a transform that is not finite or a rotation of length 0")
    );
    let huge =
        json!([{"children": [1], "scale": [1e200, 1, 1]}, {"mesh": 0, "scale": [1e200, 1, 1]}]);
    assert!(refused(huge, json!([0])).contains("node 1 has a transform"));
    // Doubling at every level: 2^40 instances were it allowed.
    let levels: Vec<_> = (0..40)
        .map(|i| json!({"children": [i + 1, i + 1]}))
        .collect();
    let levels = Value::Array(levels.into_iter().chain([json!({"mesh": 0})]).collect());
    assert!(refused(levels, json!([0])).contains("is reached twice"));
    // A cycle without a root, where no scene names one.
    asset.json["nodes"] = json!([{"mesh": 0}, {"children": [2]}, {"children": [1]}]);
    asset.json.as_object_mut().unwrap().remove("scene");
    assert!(asset.refusal().contains("node 1 is reached twice"));
    // A deep chain is legal.
    let depth = 100_000;
    let chain = (0..depth).map(|i| {
        if i + 1 < depth {
            json!({"children": [i + 1]})
        } else {
            json!({"mesh": 0})
        }
    });
    asset.json["nodes"] = chain.collect();
    assert_eq!(asset.soup().faces.len(), 2);
}

#[test]
fn instances_are_counted_before_they_are_made() {
    let mut asset = square();
    asset.json["nodes"] = (0..1000).map(|_| json!({"mesh": 0})).collect();
    asset.json["scenes"] = json!([{"nodes": (0..1000).collect::<Vec<_>>()}]);
    let glb = asset.glb();
    let limited = |params: ReadParams| {
        let error = read_bytes(Path::new("a.glb"), &glb, &params).unwrap_err();
        error.to_string()
    };
    let params = ReadParams::default();
    let faces = limited(ReadParams {
        max_faces: 1999,
        ..params
    });
    assert!(
        faces.contains("has 2000 triangles or more, beyond max_faces = 1999"),
        "{faces}"
    );
    let vertices = limited(ReadParams {
        max_vertices: 3999,
        ..params
    });
    assert!(
        vertices.contains("has 4000 vertices or more, beyond max_vertices = 3999"),
        "{vertices}"
    );
    let exact = ReadParams {
        max_faces: 2000,
        max_vertices: 4000,
        ..params
    };
    assert_eq!(
        read_bytes(Path::new("a.glb"), &glb, &exact)
            .unwrap()
            .soup
            .faces
            .len(),
        2000
    );
}

#[test]
fn skins_and_morph_targets_stay_in_the_bind_pose() {
    let mut asset = square();
    asset.json["nodes"] = json!([
        {"mesh": 0, "skin": 0, "translation": [100, 0, 0]},
        {"translation": [0, 3, 0]},
    ]);
    asset.json["skins"] = json!([{"joints": [1]}]);
    let targets = asset.floats("VEC3", &[[9.0; 3]; 4]);
    asset.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": targets}]);
    asset.json["meshes"][0]["weights"] = json!([1.0]);
    let joints = asset.accessor("VEC4", UNSIGNED_BYTE, 4, [0; 16]);
    let weights = asset.floats("VEC4", &[[1.0, 0.0, 0.0, 0.0]; 4]);
    let attributes = &mut asset.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_0"] = json!(joints);
    attributes["WEIGHTS_0"] = json!(weights);
    let read = asset.read();
    assert_eq!(read.soup.positions, exact(&SQUARE));
    assert!(read.soup.attributes.is_empty());
    assert_eq!(read.notes.len(), 3, "{:?}", read.notes);
}

// ---- primitives

#[test]
fn strips_fans_and_lists_without_indices() {
    let mut asset = Asset::new();
    let position = asset.floats("VEC3", &[SQUARE[0], SQUARE[1], SQUARE[3], SQUARE[2]]);
    let stitched = asset.shorts(&[0, 1, 2, 2, 2, 1, 3, 3]);
    let attributes = json!({"POSITION": position});
    asset.push(
        "meshes",
        json!({"primitives": [
            {"attributes": attributes, "mode": 5},
            {"attributes": attributes, "mode": 6},
            {"attributes": attributes, "mode": 5, "indices": stitched},
            {"attributes": attributes},
            {"attributes": attributes, "mode": 0},
            {"attributes": attributes, "mode": 3},
            {"attributes": {}},
        ]}),
    );
    let read = asset.read();
    let parts: Vec<_> = read
        .soup
        .parts
        .iter()
        .map(|p| (p.first_vertex, p.first_face, p.faces))
        .collect();
    assert_eq!(parts, [(0, 0, 2), (4, 2, 2), (8, 4, 2), (12, 6, 1)]);
    let faces = |range: std::ops::Range<usize>, base: u32| -> Vec<[u32; 3]> {
        read.soup.faces[range]
            .iter()
            .map(|f| f.map(|v| v - base))
            .collect()
    };
    // The strip's triangles all face the same way.
    assert_eq!(faces(0..2, 0), [[0, 1, 2], [1, 3, 2]]);
    assert_eq!(faces(2..4, 4), [[0, 1, 2], [0, 2, 3]]);
    // Repeated vertices are no triangles.
    assert_eq!(faces(4..6, 8), [[0, 1, 2], [2, 1, 3]]);
    assert_eq!(faces(6..7, 12), [[0, 1, 2]]);
    // One corner is left over, two primitives are no surface, one has no positions.
    assert_eq!(read.notes.len(), 4, "{:?}", read.notes);
    asset.json["meshes"][0]["primitives"][0]["mode"] = json!(7);
    assert!(
        asset
            .refusal()
            .contains("expected a primitive mode from 0 to 6, found `7`")
    );
}

#[test]
fn points_alone_are_no_mesh() {
    let mut asset = square();
    asset.json["meshes"][0]["primitives"][0]["mode"] = json!(0);
    assert!(asset.refusal().contains("holds no triangle"));
}

#[test]
fn attributes_of_all_kinds_and_parts_without_them() {
    let mut asset = square();
    let uv = asset.accessor(
        "VEC2",
        UNSIGNED_SHORT,
        4,
        [0u16, 65535, 13107, 0, 0, 0, 0, 0]
            .into_iter()
            .flat_map(u16::to_le_bytes),
    );
    asset.json["accessors"][uv]["normalized"] = json!(true);
    let color = asset.accessor(
        "VEC3",
        UNSIGNED_BYTE,
        4,
        [255, 0, 51, 0, 0, 0, 0, 0, 0, 0, 0, 0],
    );
    let normal = asset.accessor("VEC3", BYTE, 4, [0u8, 0, 127].repeat(4));
    asset.json["accessors"][normal]["normalized"] = json!(true);
    let heat = asset.floats("SCALAR", &[[1.0], [2.0], [3.0], [4.0]]);
    let pair = asset.floats("VEC2", &[[1.0, 2.0]; 4]);
    let matrix = asset.floats("MAT2", &[[1.0; 4]; 4]);
    let plain = asset.json["meshes"][0]["primitives"][0].clone();
    let attributes = &mut asset.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["TEXCOORD_3"] = json!(uv);
    attributes["COLOR_0"] = json!(color);
    attributes["NORMAL"] = json!(normal);
    attributes["_HEAT"] = json!(heat);
    attributes["_MATRIX"] = json!(matrix);
    attributes["UNKNOWN"] = json!(heat);
    let mut third = plain.clone();
    third["attributes"]["_HEAT"] = json!(pair);
    let mut fourth = plain.clone();
    fourth["attributes"]["_HEAT"] = json!(heat);
    let primitives = asset.json["meshes"][0]["primitives"]
        .as_array_mut()
        .unwrap();
    primitives.insert(0, plain);
    primitives.extend([third, fourth]);
    let read = asset.read();
    let soup = &read.soup;
    assert_eq!(soup.faces.len(), 8);
    assert_eq!(soup.attributes.len(), 4);
    for attribute in &soup.attributes {
        assert_eq!(attribute.values.len(), 8 * 3 * attribute.components);
        assert!(attribute.corner(0, 0).iter().all(|x| x.is_nan()));
        assert!(attribute.corner(5, 2).iter().all(|x| x.is_nan()));
        assert!(!attribute.corner(2, 0)[0].is_nan());
    }
    assert!(close(
        attribute(soup, AttributeKind::TexCoord(3)).corner(2, 0),
        &[0.0, 1.0]
    ));
    assert!(close(
        attribute(soup, AttributeKind::TexCoord(3)).corner(2, 1),
        &[0.2, 0.0]
    ));
    // Integer colours are fractions whether marked so or not; alpha is 1.
    assert!(close(
        attribute(soup, AttributeKind::Color(0)).corner(2, 0),
        &[1.0, 0.0, 0.2, 1.0]
    ));
    assert!(close(
        attribute(soup, AttributeKind::Normal).corner(2, 2),
        &[0.0, 0.0, 1.0]
    ));
    let heat = attribute(soup, AttributeKind::Custom("HEAT".into()));
    assert_eq!(
        (heat.corner(3, 2), heat.corner(7, 1)),
        (&[4.0f32][..], &[3.0f32][..])
    );
    assert_eq!(read.notes.len(), 3, "{:?}", read.notes);
}

#[test]
fn quantized_positions_and_strides() {
    let mut asset = Asset::new();
    // Interleaved: three shorts, padding, two floats.
    let mut bytes = vec![0; 4];
    for p in SQUARE {
        bytes.extend(
            p.map(|x| (x * 1000.0) as i16)
                .into_iter()
                .flat_map(i16::to_le_bytes),
        );
        bytes.extend([0xAA; 2]);
        bytes.extend([p[0], p[1]].into_iter().flat_map(f32::to_le_bytes));
    }
    let view = asset.view(bytes);
    asset.json["bufferViews"][view]["byteStride"] = json!(16);
    let position = asset.push(
        "accessors",
        json!({"bufferView": view, "byteOffset": 4, "componentType": SHORT, "count": 4, "type": "VEC3"}),
    );
    let uv = asset.push(
        "accessors",
        json!({"bufferView": view, "byteOffset": 12, "componentType": FLOAT, "count": 4, "type": "VEC2"}),
    );
    let indices = asset.accessor("SCALAR", UNSIGNED_BYTE, 6, [0, 1, 2, 0, 2, 3]);
    let primitive =
        json!({"attributes": {"POSITION": position, "TEXCOORD_0": uv}, "indices": indices});
    asset.push("meshes", json!({"primitives": [primitive]}));
    asset.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    asset.json["nodes"] = json!([{"mesh": 0, "scale": [0.5, 0.5, 0.5]}]);
    let soup = asset.soup();
    assert_eq!(soup.positions[2], [500.0, 500.0, 0.0]);
    assert_eq!(
        attribute(&soup, AttributeKind::TexCoord(0)).corner(1, 2),
        [0.0, 1.0]
    );
    asset.json["accessors"][position]["normalized"] = json!(true);
    assert_eq!(asset.soup().positions[1][0], 0.5 * 1000.0 / 32767.0);
    asset.json["bufferViews"][view]["byteStride"] = json!(4);
    assert!(asset.refusal().contains("byteStride as long as a value"));
    asset.json["bufferViews"][view]["byteStride"] = json!(0);
    assert!(asset.refusal().contains("byteStride as long as a value"));
}

#[test]
fn sparse_accessors_and_accessors_without_a_view() {
    let mut asset = square();
    let at = asset.view([1, 3]);
    let beyond = asset.view([1, 4]);
    let values = asset.view(
        [[7.0f32, 0.0, 0.0], [0.0, 8.0, 0.0]]
            .concat()
            .into_iter()
            .flat_map(f32::to_le_bytes),
    );
    let sparse = json!({"count": 2, "indices": {"bufferView": at, "componentType": UNSIGNED_BYTE}, "values": {"bufferView": values}});
    asset.json["accessors"][0]["sparse"] = sparse.clone();
    let mut expected = exact(&SQUARE);
    expected[1] = [7.0, 0.0, 0.0];
    expected[3] = [0.0, 8.0, 0.0];
    assert_eq!(asset.soup().positions, expected);
    // Without a view the other values are zeros.
    asset.json["accessors"][0]
        .as_object_mut()
        .unwrap()
        .remove("bufferView");
    let zeros = [[0.0; 3], expected[1], [0.0; 3], expected[3]];
    assert_eq!(asset.soup().positions, zeros);
    asset.json["accessors"][0]
        .as_object_mut()
        .unwrap()
        .remove("sparse");
    assert_eq!(asset.soup().positions, [[0.0; 3]; 4]);

    let mut broken = |change: &dyn Fn(&mut Value)| {
        let mut sparse = sparse.clone();
        change(&mut sparse);
        asset.json["accessors"][0]["sparse"] = sparse;
        asset.refusal()
    };
    assert!(broken(&|s| s["count"] = json!(5)).contains(
        "accessor 0 replaces a number of values of 5 by its sparse part, but has 4 values"
    ));
    assert!(
        broken(&|s| s["count"] = json!(3))
            .contains("accessor 0 needs 3 bytes of buffer view 2, which has 2")
    );
    assert!(
        broken(&|s| s["indices"]["componentType"] = json!(FLOAT))
            .contains("an unsigned integer is wanted")
    );
    assert!(
        broken(&|s| s["indices"]["bufferView"] = json!(beyond))
            .contains("accessor 0 replaces value 4 by its sparse part, but has 4 values")
    );
    assert!(
        broken(&|s| s["values"]["byteOffset"] = json!(u64::MAX))
            .contains("accessor 0 needs 18446744073709551615 bytes")
    );
    assert!(
        broken(&|s| s["values"]["bufferView"] = json!(99))
            .contains("accessor 0 refers to buffer view 99")
    );
}

// ---- bounds

#[test]
fn indices_and_values_are_checked() {
    let mut asset = square();
    let at = asset.json["bufferViews"][1]["byteOffset"].as_u64().unwrap() as usize;
    asset.binary[at + 6..at + 8].copy_from_slice(&99u16.to_le_bytes());
    assert_eq!(
        asset.refusal(),
        "a.glb: face 1 (node 0, mesh 0, primitive 0) refers to vertex 99, but there are 4, counted from 0; correct the index or add what is missing"
    );
    for value in [f32::NAN, f32::INFINITY] {
        let mut asset = square();
        asset.json["nodes"] = json!([{"mesh": 0}, {"mesh": 0, "translation": [1, 1, 1]}]);
        asset.json["scenes"] = json!([{"nodes": [1]}]);
        asset.binary[2 * 12 + 4..][..4].copy_from_slice(&value.to_le_bytes());
        let message = asset.refusal();
        assert!(
            message.contains("vertex 2 (node 1, mesh 0, primitive 0) has"),
            "{message}"
        );
        assert!(message.contains("every coordinate must be a finite number"));
    }
}

#[test]
fn references_and_ranges_are_checked() {
    let change = |pointer: &str, value: Value| {
        let mut asset = square();
        asset.json["buffers"] = json!([{"byteLength": asset.binary.len()}]);
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        asset.json.pointer_mut(parent).unwrap()[key] = value;
        asset.refusal()
    };
    let primitive = "/meshes/0/primitives/0";
    let missing = change(&format!("{primitive}/indices"), json!(9));
    assert_eq!(
        missing,
        "a.glb: node 0, mesh 0, primitive 0 refers to accessor 9, but there are 2, counted from 0; correct the index"
    );
    assert!(
        change(&format!("{primitive}/attributes/POSITION"), json!(2))
            .contains("refers to accessor 2")
    );
    assert!(
        change(&format!("{primitive}/material"), json!(0))
            .contains("refers to material 0, but there are 0")
    );
    assert!(
        change("/accessors/0/bufferView", json!(5))
            .contains("accessor 0 refers to buffer view 5, but there are 2")
    );
    assert!(
        change("/bufferViews/0/buffer", json!(1))
            .contains("buffer view 0 refers to buffer 1, but there are 1")
    );
    assert!(
        change("/bufferViews/1/byteLength", json!(100))
            .contains("buffer view 1 needs 148 bytes of buffer 0, which has 60")
    );
    assert!(change("/bufferViews/1/byteOffset", json!(u64::MAX)).contains("which has 60"));
    assert!(
        change("/accessors/0/count", json!(5))
            .contains("accessor 0 needs 60 bytes of buffer view 0, which has 48")
    );
    assert!(
        change("/accessors/1/byteOffset", json!(2))
            .contains("accessor 1 needs 14 bytes of buffer view 1, which has 12")
    );
    assert!(change("/accessors/0/count", json!(u64::MAX)).contains("beyond max_vertices"));
    assert!(change("/accessors/1/count", json!(u64::MAX)).contains("beyond max_faces"));
    assert!(
        change("/accessors/0/count", json!(40_000_000))
            .contains("accessor 0 needs 480000000 bytes")
    );
    assert!(
        change("/buffers/0/byteLength", json!(61))
            .contains("buffer 0 needs 61 bytes of its file, which has 60")
    );
    assert!(change("/buffers/0/byteLength", json!(59)).contains("of buffer 0, which has 59"));
    assert!(
        change("/accessors/0/type", json!("VEC2"))
            .contains("POSITION uses accessor 0, which is VEC2 of F32 where VEC3")
    );
    assert!(change("/accessors/0/type", json!("VEC9")).contains("a type of glTF 2.0"));
    assert!(change("/accessors/0/componentType", json!(5130)).contains("a type of glTF 2.0"));
    assert!(
        change("/accessors/0/componentType", json!(UNSIGNED_INT))
            .contains("where VEC3 of floats or short integers is wanted")
    );
    assert!(change("/accessors/1/componentType", json!(FLOAT)).contains("indices uses accessor 1"));
    assert!(change("/accessors/1/count", json!(0)).contains("holds no triangle"));
    assert!(change("/accessors/0/count", json!(0)).contains("refers to vertex 0, but there are 0"));
    assert!(change("/accessors/0/count", json!(-1)).contains("glTF JSON"));
    let mut asset = square();
    let uv = asset.floats("VEC2", &[[0.0; 2]; 3]);
    asset.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uv);
    assert!(
        asset
            .refusal()
            .contains("TEXCOORD_0 has 3 values for 4 vertices")
    );
    // A buffer without data.
    let mut asset = square();
    asset.json["buffers"] = json!([{"byteLength": 60}]);
    let error = read_bytes(
        Path::new("a.gltf"),
        &asset.json_bytes(),
        &ReadParams::default(),
    );
    assert!(
        error
            .unwrap_err()
            .to_string()
            .contains("buffer 0 has neither a URI nor a GLB chunk")
    );
}

#[test]
fn attributes_that_would_fill_the_memory_are_counted() {
    let mut asset = square();
    let heat = asset.floats("SCALAR", &[[1.0]; 4]);
    let plain = asset.json["meshes"][0]["primitives"][0].clone();
    let primitives = (0..100).map(|i| {
        let mut primitive = plain.clone();
        primitive["attributes"][format!("_HEAT{i}")] = json!(heat);
        primitive
    });
    asset.json["meshes"][0]["primitives"] = primitives.collect();
    let glb = asset.glb();
    // 200 triangles × 3 corners × 100 attributes × 4 bytes; 100 times an object with two attributes.
    let primitives = 100 * 3 * 512;
    let needed = 240_000 + glb.len() as u64 + object_bytes(&asset.json_bytes()) + primitives;
    // 8 bytes a number of the positions, the indices and the attribute of each primitive; 4 vertices and 2 triangles.
    let numbers = 100 * (8 * (12 + 6 + 4) + 4 * 24 + 2 * 16);
    let read = |limit: u64| {
        let params = ReadParams {
            max_file_bytes: limit,
            ..ReadParams::default()
        };
        read_bytes(Path::new("a.glb"), &glb, &params)
    };
    let message = read(needed - 1).unwrap_err().to_string();
    assert!(
        message.contains(&format!(
            "corner attributes would bring the asset to {needed} bytes"
        )),
        "{message}"
    );
    let message = read(needed + numbers - 1).unwrap_err().to_string();
    assert!(
        message.contains(&format!(
            "reading accessor {heat} would bring the asset to {} bytes",
            needed + numbers
        )),
        "{message}"
    );
    let whole = read(needed + numbers).unwrap();
    assert_eq!(whole.soup.attributes.len(), 100);
}

/// The refusal of a square whose values unpack to more than its few bytes warrant, and the time it took.
fn costly(asset: &mut Asset) -> String {
    let started = std::time::Instant::now();
    let message = asset.refusal();
    let seconds = started.elapsed().as_secs_f64();
    assert!(seconds < 20.0, "{seconds} s: {message}");
    assert!(
        message.contains("are granted for") && message.contains("bytes of files"),
        "{message}"
    );
    message
}

#[test]
fn what_a_small_file_unpacks_to_is_bounded() {
    let zeros = |kind: &str, component: u32, count: u64| json!({"componentType": component, "count": count, "type": kind});
    // Indices without data.
    let mut asset = square();
    let indices = asset.push("accessors", zeros("SCALAR", UNSIGNED_SHORT, 290_000_000));
    asset.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    let message = costly(&mut asset);
    assert!(
        message.contains(&format!("reading accessor {indices} ")),
        "{message}"
    );
    // Positions without data.
    let mut asset = square();
    let positions = asset.push("accessors", zeros("VEC3", FLOAT, 50_000_000));
    asset.json["meshes"][0]["primitives"][0]["attributes"] = json!({"POSITION": positions});
    let message = costly(&mut asset);
    assert!(
        message.contains(&format!("reading accessor {positions} ")),
        "{message}"
    );
    // The same numbers read by thousands of attributes.
    let mut asset = square();
    let positions = asset.push("accessors", zeros("VEC3", FLOAT, 100_000));
    let numbers = asset.push("accessors", zeros("SCALAR", FLOAT, 100_000));
    let mut attributes: serde_json::Map<String, Value> = (0..8000)
        .map(|i| (format!("_{i}"), json!(numbers)))
        .collect();
    attributes.insert("POSITION".into(), json!(positions));
    asset.json["meshes"][0]["primitives"][0]["attributes"] = attributes.into();
    let message = costly(&mut asset);
    assert!(
        message.contains(&format!("reading accessor {numbers}")),
        "{message}"
    );
    // The same mesh under thousands of primitives.
    let mut asset = square();
    let positions = asset.push("accessors", zeros("VEC3", FLOAT, 10_000));
    let primitive = json!({"attributes": {"POSITION": positions}});
    asset.json["meshes"][0]["primitives"] = vec![primitive; 1000].into();
    costly(&mut asset);
}

#[test]
fn a_hundred_thousand_attributes_are_looked_up_quickly() {
    let mut asset = square();
    let heat = asset.floats("SCALAR", &[[1.0]; 4]);
    let mut attributes = asset.json["meshes"][0]["primitives"][0]["attributes"].clone();
    for i in 0..100_000 {
        attributes[format!("_{i}")] = json!(heat);
    }
    asset.json["meshes"][0]["primitives"][0]["attributes"] = attributes;
    let started = std::time::Instant::now();
    assert_eq!(asset.soup().attributes.len(), 100_000);
    assert!(started.elapsed().as_secs() < 10);
}

#[test]
fn images_of_one_place_are_one_image() {
    let mut asset = square();
    let mut picture = PNG.to_vec();
    picture.resize(4 << 20, 0);
    let view = asset.view(picture);
    asset.json["images"] = vec![json!({"bufferView": view}); 1500].into();
    asset.json["textures"] = (0..1500).map(|i| json!({"source": i})).collect();
    asset.json["materials"] = (0..1500)
        .map(|i| json!({"normalTexture": {"index": i}}))
        .collect();
    let appearance = asset.soup().appearance;
    assert_eq!(appearance.materials.len(), 1500);
    assert_eq!(appearance.images.len(), 1);
    assert!(appearance.textures.iter().all(|texture| texture.image == 0));
}

#[test]
fn points_that_a_draco_stream_declares_are_counted_before_they_are_made() {
    // The count of points stands behind that of the two triangles.
    let stream = DRACO[0].replace("02020100000002040100", "02020100000002ffffff4f0100");
    assert_ne!(stream, DRACO[0]);
    let message = draco(&stream).refusal();
    assert!(
        message.contains("it declares 167772159 points where at most 50000000 may follow"),
        "{message}"
    );
    // Triangles that are coded by their neighbours, with 255 attributes that have seams of their own.
    let stream = DRACO[1].replace("0202010100000004020102", "0202010100000080897a80897aff02");
    assert_ne!(stream, DRACO[1]);
    let message = costly(&mut draco(&stream));
    assert!(
        message.contains("the Draco data of node 0, mesh 0, primitive 0"),
        "{message}"
    );
}

#[test]
fn empty_primitives_under_many_nodes_are_counted() {
    let mut asset = Asset::new();
    let position = asset.accessor("VEC3", FLOAT, 0, []);
    let empty = json!({"attributes": {"POSITION": position}});
    asset.push("meshes", json!({"primitives": vec![empty; 3000]}));
    asset.json["nodes"] = (0..3000).map(|_| json!({"mesh": 0})).collect();
    asset.json["scenes"] = json!([{"nodes": (0..3000).collect::<Vec<_>>()}]);
    let params = ReadParams {
        max_file_bytes: 64 << 20,
        ..ReadParams::default()
    };
    let error = read_bytes(Path::new("a.glb"), &asset.glb(), &params).unwrap_err();
    let message = error.to_string();
    assert!(
        message.contains("its list of primitives would bring the asset to"),
        "{message}"
    );
    // Materials of three bytes each.
    let mut asset = square();
    asset.json["materials"] = Value::Array(vec![json!({}); 200_000]);
    let error = read_bytes(Path::new("a.glb"), &asset.glb(), &params).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("its JSON would bring the asset to")
    );
}

// ---- URIs

#[test]
fn uris_stay_in_the_folder() {
    let outer = tempfile::tempdir().unwrap();
    let folder = outer.path().join("asset");
    fs::create_dir(&folder).unwrap();
    let mut asset = square();
    let binary = asset.binary.clone();
    fs::write(outer.path().join("secret.bin"), &binary).unwrap();
    fs::write(folder.join("inside.bin"), &binary).unwrap();
    fs::create_dir(folder.join("directory")).unwrap();
    let path = folder.join("a.gltf");
    let mut refused = |uri: &str| {
        asset.json["buffers"] = json!([{"byteLength": binary.len(), "uri": uri}]);
        fs::write(&path, asset.json_bytes()).unwrap();
        read(&path, &ReadParams::default()).map_err(|e| e.to_string())
    };
    assert!(refused("inside.bin").is_ok());
    assert!(refused("./inside.bin").is_ok());
    let absolute = outer.path().join("secret.bin");
    let absolute = absolute.to_str().unwrap();
    let file = format!("file://{absolute}");
    for uri in [
        "../secret.bin",
        "%2e%2e/secret.bin",
        "x/../../secret.bin",
        absolute,
        &file,
        "http://localhost/x",
        "..\\secret.bin",
    ] {
        let message = refused(uri).unwrap_err();
        assert!(
            message.contains("leads out of the asset's folder"),
            "{uri}: {message}"
        );
    }
    for uri in ["%FF.bin", "%", "a%00.bin", "", "data:;base64,*", "data:"] {
        let message = refused(uri).unwrap_err();
        assert!(message.contains("is malformed"), "{uri}: {message}");
    }
    let missing = refused("missing.bin").unwrap_err();
    assert!(
        missing.contains("the file `missing.bin` it refers to cannot be read"),
        "{missing}"
    );
    assert!(
        refused("directory")
            .unwrap_err()
            .contains("no regular file")
    );
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../secret.bin", folder.join("link.bin")).unwrap();
        let message = refused("link.bin").unwrap_err();
        assert!(
            message.contains("`link.bin` leads out of the asset's folder"),
            "{message}"
        );
        std::os::unix::fs::symlink("inside.bin", folder.join("inner.bin")).unwrap();
        assert!(refused("inner.bin").is_ok());
    }
}

#[test]
fn a_file_named_twice_is_read_once() {
    let folder = tempfile::tempdir().unwrap();
    let mut asset = square();
    let buffer = json!({"byteLength": asset.binary.len(), "uri": "b.bin"});
    asset.json["buffers"] = Value::Array(vec![buffer; 1000]);
    fs::write(folder.path().join("b.bin"), &asset.binary).unwrap();
    let path = folder.path().join("a.gltf");
    fs::write(&path, asset.json_bytes()).unwrap();
    let read = read(&path, &ReadParams::default()).unwrap();
    assert_eq!(read.files.len(), 2);
}

// ---- extensions

#[test]
fn required_extensions() {
    let required = |name: &str| {
        let mut asset = square();
        asset.json["extensionsRequired"] = json!([name]);
        asset
    };
    for name in [
        "KHR_materials_unlit",
        "KHR_texture_basisu",
        "KHR_mesh_quantization",
        "KHR_draco_mesh_compression",
        "KHR_lights_punctual",
    ] {
        assert_eq!(required(name).soup().faces.len(), 2);
    }
    assert_eq!(
        required("ACME_voxels").refusal(),
        "a.glb: requires the glTF extension ACME_voxels, which is not supported; export the asset without it"
    );
    assert!(
        required("EXT_mesh_gpu_instancing")
            .refusal()
            .contains("every copy as a node of its own")
    );
    let mut optional = square();
    optional.json["extensionsUsed"] = json!(["ACME_voxels", "EXT_mesh_gpu_instancing"]);
    optional.json["extensions"] = json!({"ACME_voxels": {"a": [1, 2]}});
    optional.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {}}});
    let read = optional.read();
    assert_eq!(read.soup.faces.len(), 2);
    assert!(read.notes[0].contains("EXT_mesh_gpu_instancing"));
}

fn from_hex(hex: &str) -> Vec<u8> {
    let pair = |i: usize| u8::from_str_radix(&hex[i..i + 2], 16).unwrap();
    (0..hex.len()).step_by(2).map(pair).collect()
}

/// The unit square with texture coordinates, written by Draco's own encoder: sequential, edgebreaker at
/// speed 5, edgebreaker at speed 0 (valence).
const DRACO: [&str; 3] = [
    "445241434f02020100000002040100010200020301020009030000030902000102020001010003030130011003003482880400000000ff0700000001010003030130011003003482a40000000000ff0000000000000000000000000000000000803f0b00000000000000000000803f08",
    "445241434f02020101000000040201020000011fff0111ff011102ff000000000001000903000002010309020001020101010003030130011003002882980000000000ff0700000000000000000000000000000000803f0b01010100030301300110030028822c0000000000ff00000000000000000000000000803f08",
    "445241434f02020101000000040201020000011fff0111ff011102ff000100000001000903000002010309020001020101010003030130011003002882980000000000ff0700000000000000000000000000000000803f0b050101000203014001000c020000008002807000000000ff00000000000000000000000000803f08",
];

fn draco(hex: &str) -> Asset {
    let mut asset = Asset::new();
    let view = asset.view(from_hex(hex));
    let vector = |kind: &str, count: u32, component: u32| json!({"componentType": component, "count": count, "type": kind});
    asset.json["accessors"] = json!([
        vector("VEC3", 4, FLOAT),
        vector("VEC2", 4, FLOAT),
        vector("SCALAR", 6, UNSIGNED_SHORT)
    ]);
    asset.push(
        "meshes",
        json!({"primitives": [{
            "attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2,
            "extensions": {"KHR_draco_mesh_compression": {"bufferView": view, "attributes": {"POSITION": 0, "TEXCOORD_0": 1}}},
        }]}),
    );
    asset.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    asset
}

#[test]
fn draco_streams_of_three_kinds() {
    for hex in DRACO {
        let soup = draco(hex).soup();
        assert_eq!(soup.faces.len(), 2);
        assert_eq!(soup.positions.len(), 4);
        let uv = attribute(&soup, AttributeKind::TexCoord(0));
        let mut area = 0.0;
        for (f, face) in soup.faces.iter().enumerate() {
            let p = face.map(|v| soup.positions[v as usize]);
            area += 0.5
                * ((p[1][0] - p[0][0]) * (p[2][1] - p[0][1])
                    - (p[1][1] - p[0][1]) * (p[2][0] - p[0][0]));
            for (k, p) in p.iter().enumerate() {
                // Coordinates were quantised to 11 and 8 bits; texture coordinates are the positions.
                assert!(p.iter().all(|x| x.abs() < 1e-6 || (x - 1.0).abs() < 1e-6));
                assert!(close(uv.corner(f, k), &p[..2]));
            }
        }
        assert!((area - 1.0).abs() < 1e-6, "counterclockwise");
    }
}

#[test]
fn damaged_draco_streams_are_refused() {
    let refusal = draco("00112233445566778899").refusal();
    assert!(
        refusal.contains(
            "node 0, mesh 0, primitive 0: the data of KHR_draco_mesh_compression cannot be unpacked"
        ),
        "{refusal}"
    );
    assert!(
        refusal.contains("npx @gltf-transform/cli copy"),
        "{refusal}"
    );
    let mut asset = draco(DRACO[1]);
    let draco_extension =
        &mut asset.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"];
    draco_extension["attributes"]["TEXCOORD_0"] = json!(7);
    assert!(
        asset
            .refusal()
            .contains("it holds no attribute 7 for TEXCOORD_0")
    );
    let params = ReadParams {
        max_faces: 2,
        max_vertices: 4,
        max_file_bytes: 1 << 20,
    };
    for hex in DRACO {
        let whole = from_hex(hex);
        for length in 0..whole.len() {
            let mut cut = Asset::new();
            cut.json = draco(hex).json;
            cut.binary = whole[..length].to_vec();
            cut.json["bufferViews"][0]["byteLength"] = json!(length);
            let result = read_bytes(Path::new("a.glb"), &cut.glb(), &params);
            assert!(result.is_err(), "{length}");
        }
    }
}

/// The unit square as compressed views, packed by hand after the specification.
fn meshopt() -> Asset {
    let mut asset = Asset::new();
    let indices = [0xd1u8, 0, 4, 4, 7 | 0x80, 0, 8, 4, 0, 0, 0, 0];
    // Differences of the sequence 0 1 2 0 2 3 to the last index: 0, +1, +1, −2, +2, +1.
    let differences = [0i32, 1, 1, -2, 2, 1];
    let codes = differences.map(|d| ((d << 1) ^ (d >> 31)) as u8 * 2);
    let indices: Vec<u8> = [indices[0]]
        .into_iter()
        .chain(codes)
        .chain([0; 4])
        .collect();
    let packed_indices = asset.view(indices.clone());
    // Version 0, stride 8, one block of 4 elements: whole bytes in column 0 and 2, zeros elsewhere, baseline 0.
    let mut packed = vec![0xa0];
    for column in [
        Some([0u8, 1, 1, 0]),
        None,
        Some([0, 0, 1, 1]),
        None,
        None,
        None,
        None,
        None,
    ] {
        let Some(column) = column else {
            packed.push(0);
            continue;
        };
        packed.push(3);
        let mut last = 0u8;
        for x in column {
            let d = x.wrapping_sub(last) as i8;
            packed.push(((d << 1) ^ (d >> 7)) as u8);
            last = x;
        }
        packed.extend([0; 12]);
    }
    packed.extend([0; 32]);
    let packed_positions = asset.view(packed.clone());
    let extension = |view: usize,
                     bytes: usize,
                     stride: u32,
                     mode: &str,
                     count: u32,
                     binary: &Value| {
        json!({"buffer": 0, "byteOffset": binary["bufferViews"][view]["byteOffset"], "byteLength": bytes, "byteStride": stride, "mode": mode, "count": count})
    };
    let first = extension(packed_indices, indices.len(), 2, "INDICES", 6, &asset.json);
    let second = extension(
        packed_positions,
        packed.len(),
        8,
        "ATTRIBUTES",
        4,
        &asset.json,
    );
    asset.json["bufferViews"] = json!([
        {"buffer": 1, "byteLength": 12, "extensions": {"EXT_meshopt_compression": first}},
        {"buffer": 1, "byteOffset": 12, "byteLength": 32, "byteStride": 8, "extensions": {"KHR_meshopt_compression": second}},
    ]);
    asset.json["buffers"] = json!([
        {"byteLength": asset.binary.len()},
        {"byteLength": 44, "uri": "no-such-file.bin", "extensions": {"EXT_meshopt_compression": {"fallback": true}}},
    ]);
    asset.json["accessors"] = json!([
        {"bufferView": 1, "componentType": SHORT, "count": 4, "type": "VEC3"},
        {"bufferView": 0, "componentType": UNSIGNED_SHORT, "count": 6, "type": "SCALAR"},
    ]);
    asset.push(
        "meshes",
        json!({"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}),
    );
    asset.json["extensionsRequired"] =
        json!(["EXT_meshopt_compression", "KHR_meshopt_compression"]);
    asset
}

#[test]
fn meshopt_compressed_views() {
    let mut asset = meshopt();
    let extension = &asset.json["bufferViews"][1]["extensions"]["KHR_meshopt_compression"];
    let packed = extension["byteLength"].as_u64().unwrap();
    let soup = asset.soup();
    assert_eq!(soup.positions, exact(&SQUARE));
    assert_eq!(soup.faces, FACES);

    let whole = asset.json.clone();
    let mut refused = |pointer: &str, value: Value| {
        asset.json = whole.clone();
        *asset.json.pointer_mut(pointer).unwrap() = value;
        asset.refusal()
    };
    let second = "/bufferViews/1/extensions/KHR_meshopt_compression";
    let message = refused(&format!("{second}/byteLength"), json!(packed - 1));
    assert!(
        message.contains(
            "buffer view 1 (EXT_meshopt_compression or KHR_meshopt_compression) cannot be unpacked"
        ),
        "{message}"
    );
    assert!(
        message.contains("npx @gltf-transform/cli copy"),
        "{message}"
    );
    assert!(
        refused(&format!("{second}/byteLength"), json!(10_000)).contains("buffer view 1 needs")
    );
    assert!(refused(&format!("{second}/count"), json!(u64::MAX)).contains("cannot be unpacked"));
    assert!(
        refused(&format!("{second}/count"), json!(5))
            .contains("it unpacks to 40 bytes where the view has 32")
    );
    assert!(
        refused(&format!("{second}/byteStride"), json!(6))
            .contains("stride 6, count 4 or filter do not fit the mode")
    );
    assert!(refused(&format!("{second}/mode"), json!("POINTS")).contains("unknown mode or filter"));
    assert!(
        refused(&format!("{second}/buffer"), json!(1))
            .contains("buffer 1 has neither a URI nor a GLB chunk")
    );
}

// ---- appearance

/// How a PNG begins, and the name of its last part.
const PNG: [u8; 12] = *b"\x89PNG\r\n\x1a\nIEND";
const JPEG: [u8; 4] = [0xff, 0xd8, 0xff, 0xe0];

#[test]
fn materials_textures_and_images() {
    let mut asset = square();
    let png = asset.view(PNG);
    asset.json["images"] = json!([
        {"bufferView": png, "mimeType": "image/jpeg"},
        {"uri": format!("data:image/jpeg;base64,{}", base64(&JPEG))},
        {"uri": "missing.png"},
        {"uri": "data:,GIF89a"},
    ]);
    asset.json["samplers"] = json!([{"wrapS": 33071, "magFilter": 9729}]);
    asset.json["textures"] = json!([
        {"source": 1, "sampler": 0}, {"source": 0}, {"source": 2}, {"source": 3}, {"extensions": {"KHR_texture_basisu": {"source": 0}}},
    ]);
    asset.json["materials"] = json!([
        {"name": "plain"},
        {
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.5, 0.25, 0.125, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.75,
                "baseColorTexture": {"index": 0, "texCoord": 1}, "metallicRoughnessTexture": {"index": 2},
            },
            "normalTexture": {"index": 1, "scale": 0.5}, "occlusionTexture": {"index": 3, "strength": 0.25},
            "emissiveTexture": {"index": 4}, "emissiveFactor": [1, 0, 0], "alphaMode": "MASK", "alphaCutoff": 0.3, "doubleSided": true,
        },
    ]);
    asset.json["meshes"][0]["primitives"][0]["material"] = json!(1);
    let read = asset.read();
    let soup = &read.soup;
    assert_eq!(soup.face_material, [1, 1]);
    let [plain, full] = &soup.appearance.materials[..] else {
        panic!("two materials")
    };
    assert_eq!(
        (plain.name.as_deref(), plain.metallic),
        (Some("plain"), 1.0)
    );
    assert_eq!(
        (full.metallic, full.roughness, full.alpha_cutoff),
        (0.0, 0.75, 0.3)
    );
    assert_eq!(
        (full.alpha_mode.as_str(), full.double_sided),
        ("MASK", true)
    );
    let base = full.base_color_texture.as_ref().unwrap();
    assert_eq!((base.texture, base.tex_coord, base.scale), (0, 1, 1.0));
    let normal = full.normal_texture.as_ref().unwrap();
    assert_eq!((normal.texture, normal.scale), (1, 0.5));
    // A missing file, a GIF and a texture of an extension are left out, with a note each.
    assert!(
        full.metallic_roughness_texture.is_none()
            && full.occlusion_texture.is_none()
            && full.emissive_texture.is_none()
    );
    assert_eq!(read.notes.len(), 3, "{:?}", read.notes);
    let textures = &soup.appearance.textures;
    assert_eq!(
        (textures[0].wrap, textures[0].mag_filter),
        ([33071, 10497], Some(9729))
    );
    let images = &soup.appearance.images;
    assert_eq!(
        (
            textures[0].image,
            images[0].mime_type.as_str(),
            &images[0].bytes[..]
        ),
        (0, "image/jpeg", &JPEG[..])
    );
    // The bytes say PNG, whatever the declared type.
    assert_eq!(
        (
            textures[1].image,
            images[1].mime_type.as_str(),
            &images[1].bytes[..]
        ),
        (1, "image/png", &PNG[..])
    );
    for (pointer, message) in [
        (
            "/materials/1/normalTexture/index",
            "material 1 refers to texture 9, but there are 5",
        ),
        (
            "/textures/0/source",
            "texture 0 refers to image 9, but there are 4",
        ),
        (
            "/textures/0/sampler",
            "texture 0 refers to sampler 9, but there are 1",
        ),
        ("/images/0/bufferView", "image 0 refers to buffer view 9"),
    ] {
        let before = asset.json.clone();
        *asset.json.pointer_mut(pointer).unwrap() = json!(9);
        assert!(asset.refusal().contains(message), "{}", asset.refusal());
        asset.json = before;
    }
    asset.json["images"][2]["uri"] = json!("../outside.png");
    assert!(asset.refusal().contains("leads out of the asset's folder"));
}

#[test]
fn texture_transforms_are_written_into_the_coordinates() {
    let mut asset = square();
    let uv: Vec<[f32; 2]> = SQUARE.iter().map(|p| [p[0], p[1]]).collect();
    let uv = asset.floats("VEC2", &uv);
    asset.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uv);
    asset.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = json!(uv);
    asset.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    asset.json["extensionsRequired"] = json!(["KHR_texture_transform"]);
    // The specification's example: the lower left quadrant of the image, turned clockwise.
    let transform = json!({"KHR_texture_transform": {"offset": [0, 1], "rotation": std::f64::consts::FRAC_PI_2, "scale": [0.5, 0.5]}});
    asset.json["textures"] = json!([{"source": 0}]);
    asset.json["images"] = json!([{"uri": format!("data:;base64,{}", base64(&PNG))}]);
    asset.json["materials"] = json!([{"emissiveTexture": {"index": 0, "extensions": transform}}]);
    let soup = asset.soup();
    let moved = attribute(&soup, AttributeKind::TexCoord(0));
    // (0,0) (1,0) (1,1) (0,1) of the quad see (0,1) (0,½) (½,½) (½,1) of the image.
    assert!(close(moved.corner(0, 0), &[0.0, 1.0]));
    assert!(close(moved.corner(0, 1), &[0.0, 0.5]));
    assert!(close(moved.corner(0, 2), &[0.5, 0.5]));
    assert!(close(moved.corner(1, 2), &[0.5, 1.0]));
    assert!(close(
        attribute(&soup, AttributeKind::TexCoord(1)).corner(0, 2),
        &[1.0, 1.0]
    ));
    // The extension may name another set; two transforms of one set are noted.
    let other = json!({"KHR_texture_transform": {"scale": [3, 3], "texCoord": 1}});
    asset.json["materials"][0]["normalTexture"] = json!({"index": 0, "extensions": other});
    asset.json["materials"][0]["occlusionTexture"] = json!({"index": 0, "texCoord": 1});
    let read = asset.read();
    assert!(close(
        attribute(&read.soup, AttributeKind::TexCoord(1)).corner(0, 2),
        &[3.0, 3.0]
    ));
    let material = &read.soup.appearance.materials[0];
    assert_eq!(material.normal_texture.as_ref().unwrap().tex_coord, 1);
    assert!(
        read.notes[0].contains("different transforms"),
        "{:?}",
        read.notes
    );
}

// ---- damage

#[test]
fn damaged_assets_are_read_or_refused() {
    super::mutation::survive("square.glb", &square().glb(), 6000);
    super::mutation::survive("meshopt.glb", &meshopt().glb(), 6000);
    for hex in DRACO {
        super::mutation::survive("draco.glb", &draco(hex).glb(), 3000);
        // Damage to the stream alone, which the decoder must survive.
        let whole = draco(hex);
        for at in 0..whole.binary.len() {
            for value in [0, 1, 0x7f, 0x80, 0xff] {
                let mut asset = draco(hex);
                asset.binary[at] = value;
                let params = ReadParams {
                    max_vertices: 1000,
                    max_faces: 1000,
                    max_file_bytes: 1 << 20,
                };
                if let Ok(asset) = read_bytes(Path::new("a.glb"), &asset.glb(), &params) {
                    let count = asset.soup.positions.len();
                    assert!(
                        asset
                            .soup
                            .faces
                            .iter()
                            .flatten()
                            .all(|&v| (v as usize) < count)
                    );
                }
            }
        }
    }
    let mut asset = square();
    let uv = asset.floats("VEC2", &[[0.0; 2]; 4]);
    let at = asset.view([1, 3]);
    let values = asset.view([0; 24]);
    asset.json["accessors"][0]["sparse"] = json!({
        "count": 2, "indices": {"bufferView": at, "componentType": UNSIGNED_BYTE}, "values": {"bufferView": values},
    });
    asset.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uv);
    asset.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    asset.json["materials"] = json!([{"normalTexture": {"index": 0, "extensions": {"KHR_texture_transform": {"scale": [2, 3]}}}}]);
    asset.json["textures"] = json!([{"source": 0, "sampler": 0}]);
    asset.json["samplers"] = json!([{}]);
    asset.json["images"] = json!([{"uri": format!("data:;base64,{}", base64(&PNG))}]);
    asset.json["nodes"] = json!([{"children": [1, 2]}, {"mesh": 0, "scale": [-1, 2, 1]}, {"mesh": 0, "rotation": [0, 0, 0.6, 0.8]}]);
    let uri = format!(
        "data:application/octet-stream;base64,{}",
        base64(&asset.binary)
    );
    asset.json["buffers"] = json!([{"byteLength": asset.binary.len(), "uri": uri}]);
    super::mutation::survive("rich.gltf", &asset.json_bytes(), 8000);
}
