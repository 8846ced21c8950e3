//! OBJ, OFF, PLY and STL: what is read, and what is refused with which words.

use affine_atlas::geometry::ids::NONE;
use affine_atlas::geometry::mesh::{AttributeKind, CornerAttribute, Soup};
use affine_atlas::read::{ReadParams, SourceAsset, read, read_bytes};
use std::path::Path;

const TETRAHEDRON: [[f64; 3]; 4] = [
    [0.1, 0.0, 0.0],
    [1.0, -2.5e-7, 0.0],
    [0.0, 1.0, 123456.7890123],
    [0.0, 0.0, 1.0],
];
const FACES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

fn asset(name: &str, bytes: impl AsRef<[u8]>) -> SourceAsset {
    read_bytes(Path::new(name), bytes.as_ref(), &ReadParams::default()).unwrap()
}

fn soup(name: &str, bytes: impl AsRef<[u8]>) -> Soup {
    asset(name, bytes).soup
}

fn refusal(name: &str, bytes: impl AsRef<[u8]>) -> String {
    limited(name, bytes, &ReadParams::default())
}

fn limited(name: &str, bytes: impl AsRef<[u8]>, params: &ReadParams) -> String {
    let error = read_bytes(Path::new(name), bytes.as_ref(), params).unwrap_err();
    error.to_string()
}

fn attribute(soup: &Soup, kind: AttributeKind) -> &CornerAttribute {
    soup.attributes.iter().find(|a| a.kind == kind).unwrap()
}

/// Every format of the same tetrahedron, by name.
fn tetrahedra() -> Vec<(&'static str, Vec<u8>)> {
    let mut obj = String::from("# a tetrahedron\n");
    let mut off = String::from("OFF\n4 4 6\n");
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment made by a test\nelement vertex 4\nproperty double x\n\
             property double y\nproperty double z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n"
        )
    };
    let mut ply = header("ascii");
    let mut little = header("binary_little_endian").into_bytes();
    let mut big = header("binary_big_endian").into_bytes();
    for [x, y, z] in TETRAHEDRON {
        obj += &format!("v {x} {y} {z}\n");
        off += &format!("{x} {y} {z}\n");
        ply += &format!("{x} {y} {z}\n");
        little.extend([x, y, z].into_iter().flat_map(f64::to_le_bytes));
        big.extend([x, y, z].into_iter().flat_map(f64::to_be_bytes));
    }
    for [a, b, c] in FACES {
        obj += &format!("f {} {} {}\n", a + 1, b + 1, c + 1);
        off += &format!("3 {a} {b} {c}\n");
        ply += &format!("3 {a} {b} {c}\n");
        little.push(3);
        big.push(3);
        little.extend([a, b, c].into_iter().flat_map(u32::to_le_bytes));
        big.extend([a, b, c].into_iter().flat_map(u32::to_be_bytes));
    }
    vec![
        ("t.obj", obj.into_bytes()),
        ("t.off", off.into_bytes()),
        ("t.ply", ply.into_bytes()),
        ("little.PLY", little),
        ("big.ply", big),
    ]
}

#[test]
fn positions_keep_full_precision_and_faces_their_order() {
    for (name, bytes) in tetrahedra() {
        let asset = asset(name, &bytes);
        assert_eq!(asset.soup.positions, TETRAHEDRON, "{name}");
        assert_eq!(asset.soup.faces, FACES, "{name}");
        assert_eq!(asset.soup.face_material, [NONE; 4]);
        assert_eq!(asset.soup.parts.len(), 1);
        assert_eq!(asset.soup.parts[0].vertices, 4);
        assert_eq!(asset.soup.parts[0].faces, 4);
        assert_eq!(asset.notes, Vec::<String>::new());
        // The hash of a file that stands alone is the file's.
        assert_eq!(asset.blake3, blake3::hash(&bytes).to_hex().to_string());
        assert_eq!(asset.files, [Path::new(name)]);
    }
}

#[test]
fn line_ends_do_not_matter() {
    for (name, bytes) in tetrahedra().into_iter().take(3) {
        let text = String::from_utf8(bytes).unwrap();
        for end in ["\r\n", "\r"] {
            let soup = soup(name, text.replace('\n', end));
            assert_eq!(soup.positions, TETRAHEDRON);
            assert_eq!(soup.faces, FACES);
        }
    }
}

#[test]
fn truncated_files_are_refused_at_every_byte() {
    for (name, bytes) in tetrahedra() {
        let body = bytes.len() - if name == "t.obj" { 30 } else { 2 };
        let params = ReadParams::default();
        for length in 0..body {
            let result = read_bytes(Path::new(name), &bytes[..length], &params);
            // An OBJ may end after any line, and the middle of a number can be one.
            if name != "t.obj" {
                assert!(result.is_err(), "{name} {length}");
            }
        }
    }
}

#[test]
fn every_format_names_the_vertex_that_is_not_finite() {
    for (name, bytes) in tetrahedra().into_iter().take(3) {
        let text = String::from_utf8(bytes).unwrap();
        for value in ["nan", "inf", "-inf", "1e999"] {
            let message = refusal(name, text.replace("123456.7890123", value));
            assert!(message.contains("vertex 2 (line"), "{message}");
            assert!(message.contains("z = "), "{message}");
        }
        let message = refusal(name, text.replace("123456.7890123", "1,5"));
        assert!(message.contains("`1,5` is not a number"), "{message}");
    }
    let (name, mut bytes) = tetrahedra().swap_remove(3);
    let at = bytes.len() - 4 * 13 - 8;
    bytes[at..at + 8].copy_from_slice(&f64::NAN.to_le_bytes());
    let message = refusal(name, bytes);
    assert!(message.contains("vertex 3 (byte"), "{message}");
}

#[test]
fn limits_count_before_memory_is_used() {
    for (name, bytes) in tetrahedra() {
        let faces = ReadParams {
            max_faces: 3,
            ..ReadParams::default()
        };
        let message = limited(name, &bytes, &faces);
        assert!(
            message.contains("has 4 triangles or more, beyond max_faces = 3"),
            "{message}"
        );
        let vertices = ReadParams {
            max_vertices: 3,
            ..ReadParams::default()
        };
        let message = limited(name, &bytes, &vertices);
        assert!(
            message.contains("has 4 vertices or more, beyond max_vertices = 3"),
            "{message}"
        );
        let size = bytes.len() as u64;
        let small = ReadParams {
            max_file_bytes: size - 1,
            ..ReadParams::default()
        };
        let message = limited(name, &bytes, &small);
        assert!(message.contains(&format!(
            "{size} bytes, more than max_file_bytes = {}",
            size - 1
        )));
        let enough = ReadParams {
            max_faces: 4,
            max_vertices: 4,
            max_file_bytes: size,
        };
        assert!(read_bytes(Path::new(name), &bytes, &enough).is_ok());
    }
    // Counts without data behind them.
    let huge = "OFF\n4000000 9000000 0\n0 0 0\n";
    assert!(refusal("a.off", huge).contains("the list of vertices needs 4000000"));
    let huge = "ply\nformat binary_little_endian 1.0\nelement vertex 40000000\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    let message = refusal("a.ply", huge);
    assert!(
        message.contains("an element's rows needs 480000"),
        "{message}"
    );
    let huge = "ply\nformat ascii 1.0\nelement vertex 18446744073709551615\nend_header\n";
    assert!(refusal("a.ply", huge).contains("max_vertices"));
    let nothing = "ply\nformat ascii 1.0\nelement nothing 18446744073709551615\nend_header\n";
    assert!(refusal("a.ply", nothing).contains("holds no triangle"));
}

#[test]
fn files_without_triangles_are_refused() {
    assert_eq!(
        refusal("points.obj", "v 0 0 0\nv 1 0 0\n"),
        "points.obj: holds no triangle (2 vertices, 0 faces); export a surface mesh, not points or curves"
    );
    assert!(refusal("a.off", "OFF 1 0 0\n0 0 0\n").contains("(1 vertices, 0 faces)"));
    assert!(refusal("a.stl", "solid a\nendsolid a\n").contains("holds no triangle"));
    assert!(refusal("a.obj", "").contains("holds no triangle"));
    assert!(refusal("a.off", "").contains("truncated"));
    assert!(refusal("a.stl", "").contains("binary STL needs 84"));
    assert!(refusal("a.ply", "").contains("end of file"));
}

#[test]
fn names_and_files_that_cannot_be() {
    let message = refusal("mesh.fbx", "");
    assert_eq!(
        message,
        "mesh.fbx: the extension .fbx is not supported; convert the mesh to .gltf, .glb, .obj, .ply, .stl or .off"
    );
    assert!(refusal("mesh", "").contains("no file name extension"));
    let params = ReadParams::default();
    let folder = tempfile::tempdir().unwrap();
    let message = read(&folder.path().join("none.obj"), &params)
        .unwrap_err()
        .to_string();
    assert!(message.contains("cannot be read"), "{message}");
    let inner = folder.path().join("folder.obj");
    std::fs::create_dir(&inner).unwrap();
    let message = read(&inner, &params).unwrap_err().to_string();
    assert!(message.contains("not a regular file"), "{message}");
    let path = folder.path().join("t.obj");
    std::fs::write(&path, &tetrahedra()[0].1).unwrap();
    let asset = read(&path, &params).unwrap();
    assert_eq!(asset.soup.positions, TETRAHEDRON);
    assert_eq!(asset.files, [path]);
}

// ---- OBJ

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn obj(rest: &str) -> Soup {
    soup("a.obj", format!("{SQUARE}{rest}"))
}

fn bad_obj(rest: &str) -> String {
    refusal("a.obj", format!("{SQUARE}{rest}"))
}

#[test]
fn obj_polygons_are_fanned_from_their_first_corner() {
    let soup = obj("f 2 3 4 1\nf 1 2 3\n");
    assert_eq!(soup.faces, [[1, 2, 3], [1, 3, 0], [0, 1, 2]]);
}

#[test]
fn obj_negative_and_forward_indices() {
    let soup = obj("f -4 -3 -1\nv 5 5 5\nf -1 1 2\nf 1 2 6\nv 6 6 6\n");
    assert_eq!(soup.faces, [[0, 1, 3], [4, 0, 1], [0, 1, 5]]);
    assert_eq!(
        bad_obj("f 1 2 3\nf 1 2 9\nf 1 2 -5\n"),
        "a.obj: face 2 (line 7) refers to vertex -5, but there are 4, counted from 1; correct the index or add what is missing"
    );
    let message = bad_obj("f 1 2 3 4\nf 1 2 9\n");
    assert!(
        message.contains("face 2 (line 6) refers to vertex 9, but there are 4, counted from 1")
    );
    assert!(bad_obj("f 0 1 2\n").contains("refers to vertex 0, but there are 4, counted from 1"));
    for bad in [
        "4294967296",
        "4294967297",
        "9223372036854775807",
        "-9223372036854775808",
    ] {
        let message = bad_obj(&format!("f 1 2 {bad}\n"));
        assert!(message.contains(&format!("vertex {bad},")), "{message}");
    }
    assert!(bad_obj("f 1 2 99999999999999999999\n").contains("expected a whole number"));
}

#[test]
fn obj_texture_coordinates_and_normals() {
    let soup = obj("vt 0.25 0.75\nvt 1\nvn 0 0 1\nf 1/1/1 2/2/1 3/1\nf 1 2 3\nf 1//1 2//1 3//-1\n");
    let uv = attribute(&soup, AttributeKind::TexCoord(0));
    // v points down in glTF.
    assert_eq!(uv.corner(0, 0), [0.25, 0.25]);
    assert_eq!(uv.corner(0, 1), [1.0, 1.0]);
    assert!(uv.corner(1, 0)[0].is_nan() && uv.corner(2, 2)[1].is_nan());
    let normal = attribute(&soup, AttributeKind::Normal);
    assert_eq!(normal.corner(0, 1), [0.0, 0.0, 1.0]);
    assert!(normal.corner(0, 2)[0].is_nan() && normal.corner(1, 0)[0].is_nan());
    assert_eq!(normal.corner(2, 2), [0.0, 0.0, 1.0]);
    assert!(bad_obj("f 1/1 2/1 3/1\n").contains("refers to texture coordinate 1, but there are 0"));
    assert!(bad_obj("f 1//1 2//1 3//1\n").contains("refers to normal 1, but there are 0"));
}

#[test]
fn obj_materials_parts_colours_and_notes() {
    let asset = asset(
        "a.obj",
        "mtllib a.mtl\no first object\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nf 1 2 3\nusemtl red # one\ng second\n\
         f 1 2 3\nl 1 2\nusemtl blue\nf 3 2 1\nusemtl red # one\nf 1 3 2\ncstype bezier\n",
    );
    let soup = &asset.soup;
    assert_eq!(soup.face_material, [NONE, 0, 1, 0]);
    let names: Vec<_> = soup
        .appearance
        .materials
        .iter()
        .map(|m| m.name.as_deref())
        .collect();
    assert_eq!(names, [Some("red # one"), Some("blue")]);
    let parts: Vec<_> = soup
        .parts
        .iter()
        .map(|p| (p.name.as_str(), p.vertices, p.first_face, p.faces))
        .collect();
    assert_eq!(parts, [("first object", 3, 0, 1), ("second", 0, 1, 3)]);
    let color = attribute(soup, AttributeKind::Color(0));
    assert_eq!(color.corner(2, 0), [0.0, 0.0, 1.0, 1.0]);
    assert_eq!(asset.notes.len(), 3, "{:?}", asset.notes);
    let some = self::asset("a.obj", "v 0 0 0 1 0 0\nv 1 0 0\nv 1 1 0 0 0 1\nf 1 2 3\n");
    assert!(some.soup.attributes.is_empty());
    assert!(some.notes[0].contains("colours"));
}

#[test]
fn obj_lines_that_continue_and_comments() {
    let soup = obj("f 1 \\\n2 3 # and so on\nf 1 \\\r\n 2 \\\r\n 4\nf 2 3 4\\\n\n  f\t1 3 4  \n");
    assert_eq!(soup.faces, [[0, 1, 2], [0, 1, 3], [1, 2, 3], [0, 2, 3]]);
    let last = obj("f 1 2 3\\");
    assert_eq!(last.faces, [[0, 1, 2]]);
}

#[test]
fn obj_refusals_name_the_line() {
    assert!(bad_obj("v 1 2\n").contains("line 5: expected `v x y z`"));
    assert!(bad_obj("v 1 2 3 4 5\n").contains("found `v 1 2 3 4 5`"));
    assert!(bad_obj("v 1 2 x\n").contains("line 5: `x` is not a number"));
    assert!(bad_obj("vn 1 2\n").contains("expected `vn x y z`"));
    assert!(bad_obj("vt\n").contains("line 5: `` is not a number"));
    assert!(bad_obj("f 1/2/3/4 2 3\n").contains("expected a corner like 1, 1/2, 1//3 or 1/2/3"));
    assert!(
        bad_obj("f a b c\n")
            .contains("expected a whole number as index of a face corner, found `a`")
    );
    assert!(bad_obj("f 1.5 2 3\n").contains("found `1.5`"));
}

// ---- OFF

#[test]
fn off_headers_comments_and_polygons() {
    let plain = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 1 2 3 0 255 0 0\n3 0 1 2 # red\n";
    let faces = [[1, 2, 3], [1, 3, 0], [0, 1, 2]];
    for head in [
        "OFF\n4 2 0\n",
        "OFF 4 2 0\n",
        "4 2 0\n",
        "# a\n\nOFF # b\n# c\n 4 2\n",
    ] {
        let soup = soup("a.off", format!("{head}{plain}"));
        assert_eq!(soup.faces, faces, "{head}");
        assert_eq!(soup.positions[2], [1.0, 1.0, 0.0]);
    }
    let glued = soup(
        "a.off",
        "OFF\n3 1 0#counts\n0 0 0\n1 0 0#red\n0 1 0\n3 0 1 2#\n",
    );
    assert_eq!(glued.faces, [[0, 1, 2]]);
    let asset = asset(
        "a.off",
        "OFF\n3 1 0\n0 0 0 9\n1 0 0 9\n0 1 0 9\n3 0 1 2\n3 2 1 0\n",
    );
    assert_eq!(asset.notes.len(), 2, "{:?}", asset.notes);
}

#[test]
fn off_attributes() {
    let soup = soup(
        "a.off",
        "STCNOFF\n3 1 0\n0 0 0 0 0 1 255 0 51 0.25 0.75\n1 0 0 0 0 1 0.5 0.25 0.125 0.5 1 1\n0 1 0 0 0 1 0 0 0 0 0\n3 0 1 2\n",
    );
    assert_eq!(
        attribute(&soup, AttributeKind::Normal).corner(0, 1),
        [0.0, 0.0, 1.0]
    );
    let color = attribute(&soup, AttributeKind::Color(0));
    assert_eq!(color.corner(0, 0), [1.0, 0.0, 0.2, 1.0]);
    assert_eq!(color.corner(0, 1), [0.5, 0.25, 0.125, 0.5]);
    let uv = attribute(&soup, AttributeKind::TexCoord(0));
    assert_eq!(uv.corner(0, 0), [0.25, 0.25]);
    assert_eq!(uv.corner(0, 1), [1.0, 0.0]);
}

/// Some programs write lines and points among the faces.
#[test]
fn faces_of_fewer_than_three_corners_are_left_out() {
    let vertices = "0 0 0\n1 0 0\n0 1 0\n";
    let lists = "2 0 1\n3 0 1 2\n1 2\n";
    let header = "element face 3\nproperty list uchar int vertex_indices\n";
    let header = format!("element vertex 3\n{XYZ}{header}");
    for (name, bytes, line) in [
        (
            "a.obj",
            format!("{SQUARE}f 1 2\nf 1/1 2/1 3/1\nf 3\nvt 0 0\n"),
            5,
        ),
        ("a.off", format!("OFF\n3 3 0\n{vertices}{lists}"), 6),
        ("a.ply", ply(&header, &format!("{vertices}{lists}")), 13),
    ] {
        let asset = asset(name, bytes);
        assert_eq!(asset.soup.faces, [[0, 1, 2]], "{name}");
        let note = format!("2 faces of fewer than 3 corners are skipped (the first: line {line})");
        assert_eq!(asset.notes, [note], "{name}");
    }
    let one = asset("a.obj", format!("{SQUARE}f 1 2\nf 1 2 3\n"));
    assert_eq!(
        one.notes,
        ["1 face of fewer than 3 corners is skipped (line 5)"]
    );
}

#[test]
fn off_refusals() {
    let off = |faces: &str| refusal("a.off", format!("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n{faces}"));
    assert!(
        off("3 0 1 3\n")
            .contains("face 0 (line 6) refers to vertex 3, but there are 3, counted from 0")
    );
    assert!(off("3 0 1 -1\n").contains("refers to vertex -1"));
    assert!(off("-3 0 1 2\n").contains("expected the number of corners of a face, found `-3`"));
    assert!(off("2 0 1\n").contains("no triangle"));
    assert!(off("3 0 1\n").contains("expected as many vertex indices"));
    assert!(off("99999999999 0 1\n").contains("expected as many vertex indices"));
    assert!(off("").contains("the list of faces needs 1"));
    assert!(refusal("a.off", "OFF BINARY\n3 1 0\n").contains("binary OFF"));
    assert!(refusal("a.off", "4OFF\n3 1 0\n").contains("3 dimensions"));
    assert!(refusal("a.off", "OFF\n-3 1 0\n").contains("numbers of vertices and faces"));
    assert!(refusal("a.off", "OFF\nx\n").contains("line 2"));
    assert!(refusal("a.off", "COFF\n1 0 0\n0 0 0 1\n").contains("what the keyword announces"));
}

// ---- PLY

fn ply(header: &str, body: &str) -> String {
    format!("ply\nformat ascii 1.0\n{header}end_header\n{body}")
}

const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";

#[test]
fn ply_attributes_of_vertices() {
    let header = format!(
        "element vertex 3\n{XYZ}property float nx\nproperty float ny\nproperty float nz\nproperty uchar red\nproperty uchar green\n\
         property uchar blue\nproperty float s\nproperty float t\nproperty double quality\nproperty list uchar int near\n\
         element face 1\nproperty list uint8 uint16 vertex_index\nproperty uchar flags\n"
    );
    let body = "0 0 0 0 0 1 255 0 51 0.25 0.75 7 2 5 5\n1 0 0 0 0 1 0 0 0 1 1 8 0\n0 1 0 0 0 1 0 0 0 0 0 9 0\n3 0 1 2 9\n";
    let asset = asset("a.ply", ply(&header, body));
    let soup = &asset.soup;
    assert_eq!(soup.faces, [[0, 1, 2]]);
    assert_eq!(
        attribute(soup, AttributeKind::Normal).corner(0, 2),
        [0.0, 0.0, 1.0]
    );
    assert_eq!(
        attribute(soup, AttributeKind::Color(0)).corner(0, 0),
        [1.0, 0.0, 0.2, 1.0]
    );
    assert_eq!(
        attribute(soup, AttributeKind::TexCoord(0)).corner(0, 0),
        [0.25, 0.25]
    );
    assert_eq!(
        attribute(soup, AttributeKind::Custom("quality".into())).values,
        [7.0, 8.0, 9.0]
    );
    assert_eq!(soup.attributes.len(), 4);
    assert!(asset.notes[0].contains("`flags`"));
}

#[test]
fn ply_texture_coordinates_of_corners() {
    let header = format!(
        "element vertex 4\n{XYZ}element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n"
    );
    let body = "0 0 0 1 0 0 1 1 0 0 1 0\n3 0 1 2 0\n4 0 1 2 3 8 0 0 1 0 1 1 0 0.25\n";
    let soup = soup("a.ply", ply(&header, body));
    let uv = attribute(&soup, AttributeKind::TexCoord(0));
    assert!(uv.corner(0, 0)[0].is_nan());
    assert_eq!(uv.corner(1, 2), [1.0, 0.0]);
    assert_eq!(uv.corner(2, 2), [0.0, 0.75]);
}

#[test]
fn ply_faces_first_strips_and_unknown_elements() {
    let header = format!(
        "element face 1\nproperty list uchar int vertex_indices\nelement edge 1\nproperty int a\nproperty list int int b\nelement vertex 4\n{XYZ}\
         element tristrips 1\nproperty list int int vertex_indices\n"
    );
    let body = "4 0 1 2 3\n7 1 3\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n9 0 1 2 3 -1 3 2 1 1\n";
    let asset = asset("a.ply", ply(&header, body));
    assert_eq!(
        asset.soup.faces,
        [[0, 1, 2], [0, 2, 3], [0, 1, 2], [2, 1, 3], [3, 2, 1]]
    );
    assert_eq!(asset.notes, ["the elements `edge` are skipped"]);
}

#[test]
fn ply_binary_scalars_of_every_type() {
    let header = "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty char x\nproperty ushort y\nproperty short z\n\
                  element face 1\nproperty list ushort uint vertex_indices\nend_header\n";
    let mut bytes = header.as_bytes().to_vec();
    for (x, y, z) in [(-5i8, 60000u16, -3i16), (1, 2, 3), (4, 5, 6)] {
        bytes.push(x as u8);
        bytes.extend(y.to_be_bytes());
        bytes.extend(z.to_be_bytes());
    }
    bytes.extend(3u16.to_be_bytes());
    bytes.extend([0u32, 1, 2].into_iter().flat_map(u32::to_be_bytes));
    let soup = soup("a.ply", bytes);
    assert_eq!(soup.positions[0], [-5.0, 60000.0, -3.0]);
    assert_eq!(soup.faces, [[0, 1, 2]]);
}

#[test]
fn ply_refusals() {
    let face = "element face 1\nproperty list uchar int vertex_indices\n";
    let header = format!("element vertex 3\n{XYZ}{face}");
    let vertices = "0 0 0\n1 0 0\n0 1 0\n";
    let body = |faces: &str| refusal("a.ply", ply(&header, &format!("{vertices}{faces}")));
    assert!(
        body("3 0 1 3\n")
            .contains("face 0 (line 13) refers to vertex 3, but there are 3, counted from 0")
    );
    assert!(body("3 0 1 -1\n").contains("refers to vertex -1"));
    assert!(body("2 0 1\n").contains("no triangle"));
    assert!(body("-3 0 1 2\n").contains("whole number as length of a list, found `-3`"));
    assert!(body("1e18 0 1 2\n").contains("a list needs"));
    assert!(body("nan 0 1 2\n").contains("length of a list"));
    assert!(body("").contains("a value needs"));
    assert!(body("3 0 1").contains("a value needs"));
    assert!(body("3 0 x 2\n").contains("`x` is not a number"));
    let head = |header: &str| refusal("a.ply", ply(header, ""));
    assert!(head(face).contains("ends after"));
    assert!(head("element vertex 0\n").contains("the PLY element `vertex` has no property x"));
    assert!(
        head("element face 0\nproperty int a\n")
            .contains("the PLY element `face` has no property vertex_indices")
    );
    assert!(head("property float x\n").contains("expected `element` before `property`"));
    assert!(head("element vertex -1\n").contains("expected `element name count`"));
    assert!(head("element a 1\nelement a 1\n").contains("every element once"));
    assert!(head("element a 1\nproperty half x\n").contains("expected a PLY type"));
    assert!(head("hello\n").contains("expected a PLY header line, found `hello`"));
    assert!(head("element a 1\n").contains("no triangle"));
    assert!(head("element a 1\nproperty int b\n").contains("an element's rows needs"));
    let many: String = (0..2000).map(|i| format!("element e{i} 0\n")).collect();
    assert!(head(&many).contains("at most 1024 elements and properties"));
    assert!(refusal("a.ply", "plyx\n").contains("line 1: expected `ply` on the first line"));
    assert!(refusal("a.ply", "ply\nformat zip 1.0\nend_header\n").contains("binary_big_endian"));
    assert!(refusal("a.ply", "ply\nend_header\n").contains("a `format` line"));
}

// ---- STL

fn stl_text() -> String {
    let mut text = String::from("solid a b\n");
    for face in FACES {
        text += " facet normal nan 0 0\n  outer loop\n";
        for v in face {
            let [x, y, z] = TETRAHEDRON[v as usize];
            text += &format!("   Vertex {x} {y} {z}\n");
        }
        text += "  endloop\n endfacet\n";
    }
    text + "endsolid\n"
}

fn stl_binary() -> Vec<u8> {
    let mut bytes = b"solid but binary".to_vec();
    bytes.resize(80, b' ');
    bytes.extend(4u32.to_le_bytes());
    for face in FACES {
        bytes.extend([0; 12]);
        for x in face.iter().flat_map(|&v| TETRAHEDRON[v as usize]) {
            bytes.extend((x as f32).to_le_bytes());
        }
        bytes.extend([0; 2]);
    }
    bytes
}

#[test]
fn stl_text_and_binary() {
    let text = asset("a.stl", stl_text());
    let binary = asset("a.STL", stl_binary());
    for asset in [&text, &binary] {
        assert_eq!(asset.soup.positions.len(), 12);
        assert_eq!(
            asset.soup.faces,
            [[0, 1, 2], [3, 4, 5], [6, 7, 8], [9, 10, 11]]
        );
    }
    assert_eq!(text.soup.parts[0].name, "a b");
    for (corner, v) in FACES.as_flattened().iter().enumerate() {
        let exact = TETRAHEDRON[*v as usize];
        assert_eq!(text.soup.positions[corner], exact);
        assert_eq!(
            binary.soup.positions[corner],
            exact.map(|x| f64::from(x as f32))
        );
    }
    let mut padded = stl_binary();
    padded[..5].copy_from_slice(b"other");
    padded.extend([0; 7]);
    assert_eq!(
        asset("a.stl", padded).notes,
        ["7 bytes after the last triangle are skipped"]
    );
}

#[test]
fn stl_refusals() {
    let bytes = stl_binary();
    let message = refusal("a.stl", &bytes[..bytes.len() - 1]);
    // Begins with `solid`, but holds bytes that no text has.
    assert_eq!(
        message,
        "a.stl: ends after 283 bytes where binary STL needs 284; the file is truncated or its counts are wrong, so export or download it again"
    );
    let mut nan = stl_binary();
    nan[84 + 50 + 12 + 4..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(refusal("a.stl", nan).contains("vertex 3 (byte 146) has y = NaN"));
    let text = stl_text();
    for length in 1..text.len() - 2 {
        let params = ReadParams::default();
        assert!(read_bytes(Path::new("a.stl"), &text.as_bytes()[..length], &params).is_err());
    }
    let bad = |from: &str, to: &str| refusal("a.stl", stl_text().replacen(from, to, 1));
    assert!(bad("   Vertex 0.1 0 0\n", "").contains("face 0 (line 6) has 2 corners"));
    assert!(bad("endloop", "vertex 0 0 0").contains("`endloop` after 3 vertices"));
    assert!(bad("Vertex 0.1 0 0", "Vertex 0.1 0").contains("expected `vertex x y z`"));
    assert!(bad("0.1", "0,1").contains("`0,1` is not a number"));
    assert!(bad("  outer loop\n", "").contains("expected `facet`, `outer loop` or `endsolid`"));
    assert!(bad("endloop", "endfacet").contains("expected `vertex` or `endloop`"));
}

// ---- damage

#[test]
fn damaged_files_are_read_or_refused() {
    for (name, bytes) in tetrahedra() {
        super::mutation::survive(name, &bytes, 3000);
    }
    super::mutation::survive("a.stl", stl_text().as_bytes(), 3000);
    super::mutation::survive("b.stl", &stl_binary(), 3000);
    let obj = "o a\nv 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nvt 0 0\nvt 1 0\nvn 0 0 1\nusemtl m\nf 1/1/1 2/2/1 3//1 \\\n1\nf -3 -2 -1\n";
    super::mutation::survive("a.obj", obj.as_bytes(), 6000);
    let off = "STCNOFF\n3 1 0\n0 0 0 0 0 1 255 0 51 0.25 0.75\n1 0 0 0 0 1 0.5 0.25 0.125 0.5 1 1\n0 1 0 0 0 1 0 0 0 0 0\n3 0 1 2\n";
    super::mutation::survive("a.off", off.as_bytes(), 6000);
    let header = format!(
        "element vertex 4\n{XYZ}property uchar red\nproperty uchar green\nproperty uchar blue\nproperty float s\nproperty float t\n\
         property list uchar int near\nelement face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n\
         element tristrips 1\nproperty list int int vertex_indices\n"
    );
    let body = "0 0 0 1 2 3 0 0 0\n1 0 0 1 2 3 0 0 2 5 6\n1 1 0 1 2 3 0 0 0\n0 1 0 1 2 3 1 1 0\n3 0 1 2 6 0 0 1 0 1 1\n3 0 2 3 0\n6 0 1 2 -1 3 2\n";
    super::mutation::survive("a.ply", ply(&header, body).as_bytes(), 6000);
}
