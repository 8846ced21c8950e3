//! Material libraries of OBJ files, from there to `surface.glb`.

use crate::command::{build_into, verify};
use gltf::image::Source;
use std::fs;
use std::io::Cursor;
use std::path::Path;

/// A tetrahedron, one face of it painted and three with a skin.
const MESH: &str = "mtllib colours.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\n\
    usemtl paint\nf 1 3 2\nusemtl skin\nf 1/1 2/2 4/3\nf 1/1 4/2 3/3\nf 2/1 3/2 4/3\n";

fn png(grey: u8) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let image = image::RgbImage::from_pixel(4, 4, image::Rgb([grey, 0, 9]));
    image
        .write_to(&mut bytes, image::ImageFormat::Png)
        .expect("in memory");
    bytes.into_inner()
}

/// The only line of the manifest says so.
fn state(folder: &Path) -> String {
    let line = fs::read_to_string(folder.join("manifest.jsonl")).expect("a manifest");
    let line: serde_json::Value = serde_json::from_str(line.trim()).expect("one line");
    line["state"].as_str().expect("a state").to_owned()
}

#[test]
fn colours_and_textures_of_an_obj_reach_the_glb_and_the_cache() {
    let (input, output) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let mesh = input.path().join("mesh.obj");
    let library =
        |color: &str| format!("newmtl paint\nKd {color}\nd 0.5\nnewmtl skin\nmap_Kd t\\skin.png\n");
    let put = |name: &str, bytes: &[u8]| fs::write(input.path().join(name), bytes).unwrap();
    fs::create_dir(input.path().join("t")).unwrap();
    put("mesh.obj", MESH.as_bytes());
    put("colours.mtl", library("0.25 0.5 0.75").as_bytes());
    put("t/skin.png", &png(1));
    let built = || {
        let output = build_into(output.path(), &mesh, &[]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!((output.status.code(), said.as_str()), (Some(0), ""));
    };
    let glb = output.path().join("mesh/surface.glb");
    // Of each material colour and image.
    let looks = || {
        let file = gltf::Gltf::open(&glb).expect("a GLB");
        let binary = file.blob.as_deref().expect("a binary chunk");
        let of = |material: gltf::Material<'_>| {
            let pbr = material.pbr_metallic_roughness();
            let image = pbr.base_color_texture().map(|texture| {
                assert_eq!(texture.tex_coord(), 1, "behind our own coordinates");
                match texture.texture().source().source() {
                    Source::View { view, .. } => binary[view.offset()..][..view.length()].to_vec(),
                    Source::Uri { uri, .. } => panic!("{uri}"),
                }
            });
            (
                material.name().unwrap_or_default().to_owned(),
                pbr.base_color_factor(),
                image,
            )
        };
        file.document.materials().map(of).collect::<Vec<_>>()
    };
    built();
    let paint = ("paint".to_owned(), [0.25, 0.5, 0.75, 0.5], None);
    let skin = |grey| ("skin".to_owned(), [1.0; 4], Some(png(grey)));
    assert_eq!(looks(), [paint, skin(1)]);
    verify(&output.path().join("mesh"));
    built();
    assert_eq!(state(output.path()), "cached");
    put("t/skin.png", &png(2));
    built();
    assert_eq!(state(output.path()), "built");
    assert_eq!(looks()[1], skin(2));
    put("colours.mtl", library("1 1 1").as_bytes());
    built();
    assert_eq!(looks()[0].1, [1.0, 1.0, 1.0, 0.5]);
}

#[test]
fn what_is_left_out_stands_in_the_report() {
    let input = tempfile::tempdir().unwrap();
    let mesh = input.path().join("mesh.obj");
    fs::write(&mesh, MESH).unwrap();
    let library = "newmtl paint\nmap_Kd a&b.png\nnewmtl skin\nKd 1\n";
    fs::write(input.path().join("colours.mtl"), library).unwrap();
    let output = build_into(input.path(), &mesh, &[]);
    assert_eq!(output.status.code(), Some(0));
    let page = fs::read_to_string(input.path().join("mesh/report.html")).unwrap();
    let listed = page.split("<h2>Notes</h2>").nth(1).expect("notes");
    let listed = listed.split("</ul>").next().unwrap_or_default();
    assert!(listed.contains("a&amp;b.png"), "{listed}");
    assert!(listed.contains("there is no such file"), "{listed}");
}
