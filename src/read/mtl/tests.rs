use super::library::{Described, map};
use super::*;
use crate::read::{ReadParams, SourceAsset, fingerprint, read, read_bytes};
use std::fs;
use std::path::Path;

const FACES: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nf 1/1 2/1 3/1\n";

fn described(text: &str) -> Described {
    let text = format!("newmtl a\n{text}\n");
    parse(text.as_bytes()).materials.remove("a").unwrap()
}

/// A PNG of one pixel.
fn png(color: image::ExtendedColorType, pixel: &[u8]) -> Vec<u8> {
    use image::ImageEncoder;
    let mut bytes = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new(&mut bytes);
    encoder.write_image(pixel, 1, 1, color).unwrap();
    bytes
}

fn put(folder: &Path, name: &str, bytes: impl AsRef<[u8]>) {
    let path = folder.join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, bytes).unwrap();
}

fn read_in(folder: &Path) -> SourceAsset {
    read(&folder.join("a.obj"), &ReadParams::default()).unwrap()
}

#[test]
fn numbers_of_a_material() {
    let d = described("Kd 0.5 2 nan\n kd .25\nKe 0 1 0\nd -halo 0.25\nTr 0.5\nNs 250 # shiny");
    assert_eq!(d.diffuse, Some([0.25; 3]));
    assert_eq!(d.emissive, Some([0.0, 1.0, 0.0]));
    assert_eq!((d.alpha(), d.roughness()), (0.25, 0.5));
    assert_eq!(described("Tr 0.75").alpha(), 0.25);
    assert_eq!(described("d 7").alpha(), 1.0);
    assert_eq!(described("Ns 250\nPr 0.125").roughness(), 0.125);
    assert_eq!(described("Ns 250\nillum 1").roughness(), 1.0);
    assert_eq!(
        described("Kd spectral a.rfl\nKd\nNs x\nNs inf"),
        Described::default()
    );
    assert_eq!(
        parse(b"Kd 1 0 0\nnewmtl\nnewmtl b c\r\nKd 1\nnewmtl b c\nKd 0")
            .materials
            .len(),
        2
    );
    let many: String = (0..5000).map(|i| format!("newmtl {i}\n")).collect();
    assert_eq!(parse(many.as_bytes()).materials.len(), 4096);
    let twice = parse(b"newmtl b\nKd 1\nnewmtl b\nKd 0");
    assert_eq!(twice.materials["b"].diffuse, Some([1.0; 3]));
}

#[test]
fn options_stand_before_the_name_of_a_texture() {
    let of = |text: &str| map(text).unwrap();
    let plain = of("my skin.png");
    assert_eq!(plain.file, "my skin.png");
    assert!(plain.changes.is_empty() && !plain.is_clamped && plain.scale == 1.0);
    let all = of("-blendu on -mm 0 1 -s 1 1 1 -o 0 0 -clamp on -bm 0.5 -imfchan r 2.png");
    assert_eq!((all.file.as_str(), all.scale), ("2.png", 0.5));
    assert!(all.is_clamped && all.changes.is_empty());
    assert_eq!(
        of("-s 2 -mm 0 2 -t 0 0 .1 a.png").changes,
        ["-s", "-mm", "-t"]
    );
    assert_eq!(of("-odd.png").file, "-odd.png");
    for text in ["", "-s", "-s 1 1 1", "-bm", "-mm 1"] {
        assert_eq!(map(text), None, "{text}");
    }
}

#[test]
fn names_of_libraries_are_found_in_any_line() {
    let found = |text: &str| libraries(text.as_bytes()).unwrap();
    let text = "\u{feff}mtllib a.mtl\r\n# mtllib b\n  mtllib  my colours.mtl \nmtllib a.mtl\nmtllib\nmtllibx c\rmtllib d";
    assert_eq!(found(text), ["a.mtl", "my colours.mtl", "d"]);
    let long = format!("mtllib {}\n", "x".repeat(LONGEST as usize));
    assert_eq!(found(&long).len(), 1);
    let many: String = (0..1000).map(|i| format!("mtllib {i}\n")).collect();
    assert_eq!(found(&many).len(), MOST_LIBRARIES);
    let files = |name: &str| library_files(name).collect::<Vec<_>>();
    assert_eq!(files("a b\\c"), ["a b/c", "c", "a", "b/c", "c"]);
    assert_eq!(files("\"a.mtl\""), ["a.mtl"]);
    assert_eq!(files("C:\\x\\a.mtl"), ["x/a.mtl", "a.mtl"]);
}

#[test]
fn textures_lie_where_the_library_says_or_beside_the_mesh() {
    assert_eq!(places("a.mtl", "b.png"), ["b.png"]);
    assert_eq!(
        places("m/a.mtl", "t\\b.png"),
        ["m/t/b.png", "t/b.png", "b.png"]
    );
    assert_eq!(places("a.mtl", "C:\\p\\b.png"), ["p/b.png", "b.png"]);
    assert_eq!(places("a.mtl", "/root/b.png"), ["root/b.png", "b.png"]);
    assert_eq!(places("a.mtl", "b.png # x"), ["b.png # x", "b.png"]);
    assert_eq!(places("a.mtl", "../b.png"), ["b.png"]);
    assert!(places("a.mtl", "..").is_empty());
}

#[test]
fn materials_get_colours_and_textures() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let obj = format!(
        "mtllib m/my colours.mtl\n{FACES}usemtl skin\nf 1 2 3\nusemtl glass\nf 1 2 3\nusemtl none\nf 1 2 3\n"
    );
    put(folder, "a.obj", obj);
    put(
        folder,
        "m/my colours.mtl",
        "newmtl skin\nKd .1 .2 .3\nmap_Kd -clamp on t/skin.png\nmap_d t/skin.png\nmap_Bump -bm 2 t/skin.png\nmap_Ke t/skin.png\n\
         newmtl glass\nKd .1 .2 .3\nd .5\nPm 1\nbump grey.png\nmap_Ks spec.png\nmap_d other.png\nmap_Ke text.png\nnewmtl unused\nmap_Kd no.png\n",
    );
    let skin = png(image::ExtendedColorType::Rgb8, &[255, 0, 0]);
    put(folder, "m/t/skin.png", &skin);
    put(folder, "grey.png", png(image::ExtendedColorType::L8, &[9]));
    put(folder, "text.png", "no image");
    let asset = read_in(folder);
    let looks = &asset.soup.appearance;
    let [skinned, glass, none] = looks.materials.as_slice() else {
        panic!("{:?}", looks.materials);
    };
    assert_eq!(
        asset.soup.face_material,
        [crate::geometry::ids::NONE, 0, 1, 2]
    );
    assert_eq!(skinned.base_color, [1.0; 4]);
    assert_eq!(
        (skinned.alpha_mode.as_str(), skinned.emissive),
        ("BLEND", [1.0; 3])
    );
    let used = skinned.base_color_texture.as_ref().unwrap();
    assert_eq!(looks.textures[used.texture].wrap, [CLAMP_TO_EDGE; 2]);
    assert_eq!(looks.images[looks.textures[used.texture].image].bytes, skin);
    let bumps = skinned.normal_texture.as_ref().unwrap();
    assert_eq!(
        (bumps.scale, looks.textures[bumps.texture].wrap),
        (2.0, [REPEAT; 2])
    );
    assert_eq!(
        skinned.emissive_texture.as_ref().unwrap().texture,
        bumps.texture
    );
    assert_eq!(glass.base_color, [0.1, 0.2, 0.3, 0.5]);
    assert_eq!((glass.metallic, glass.alpha_mode.as_str()), (1.0, "BLEND"));
    assert!(glass.normal_texture.is_none() && glass.emissive_texture.is_none());
    assert_eq!(
        *none,
        Material {
            name: Some("none".into()),
            ..Material::default()
        }
    );
    for what in [
        "height map",
        "`map_Ks` of material `glass`",
        "`map_d` of",
        "`text.png` is skipped: neither",
        "`none` is in no",
        "`grey.png` is not there: `grey.png`",
        "`text.png` is not there",
    ] {
        assert!(
            asset.notes.iter().any(|n| n.contains(what)),
            "{what}: {:?}",
            asset.notes
        );
    }
    assert_eq!(asset.notes.len(), 7, "{:?}", asset.notes);
}

#[test]
fn what_is_missing_is_noted() {
    let folder = tempfile::tempdir().unwrap();
    let obj = format!("mtllib a.mtl b.mtl\nmtllib ../c.mtl\n{FACES}usemtl x\nf 1 2 3\n");
    put(folder.path(), "a.obj", &obj);
    let asset = read_in(folder.path());
    assert_eq!(asset.notes.len(), 2, "{:?}", asset.notes);
    // Two files in one line.
    put(folder.path(), "b.mtl", "newmtl x\nKd 0\nmap_Kd gone.png");
    let asset = read_in(folder.path());
    assert_eq!(
        asset.soup.appearance.materials[0].base_color,
        [0.0, 0.0, 0.0, 1.0]
    );
    assert!(
        asset
            .notes
            .iter()
            .any(|n| n.contains("`gone.png` is skipped: there is no such file"))
    );
    // The images beside the mesh, wherever the library had them.
    put(
        folder.path(),
        "b.mtl",
        "newmtl x\nKd 0\nmap_Kd C:\\a\\gone.png",
    );
    put(
        folder.path(),
        "gone.png",
        png(image::ExtendedColorType::L8, &[9]),
    );
    let asset = read_in(folder.path());
    assert!(
        asset.soup.appearance.materials[0]
            .base_color_texture
            .is_some()
    );
    let name = Path::new("a.obj");
    let alone = read_bytes(name, obj.as_bytes(), &ReadParams::default()).unwrap();
    assert_eq!(alone.soup.faces, asset.soup.faces);
}

#[test]
fn the_fingerprint_covers_libraries_and_their_textures() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    put(
        folder,
        "a.obj",
        format!("mtllib a.mtl\n{FACES}usemtl x\nf 1 2 3\n"),
    );
    let hash = || fingerprint(&folder.join("a.obj")).unwrap();
    let mut seen = vec![hash()];
    put(folder, "a.mtl", "newmtl x\nmap_Kd t\\skin.png\n");
    seen.push(hash());
    put(
        folder,
        "t/skin.png",
        png(image::ExtendedColorType::L8, &[9]),
    );
    seen.push(hash());
    assert_eq!(seen[2].files.len(), 3);
    put(
        folder,
        "t/skin.png",
        png(image::ExtendedColorType::L8, &[8]),
    );
    seen.push(hash());
    put(folder, "a.mtl", "newmtl x\nmap_Kd t\\skin.png\nKd 1 0 0");
    seen.push(hash());
    for (i, a) in seen.iter().enumerate() {
        assert!(seen[..i].iter().all(|b| b.hash != a.hash));
    }
    // The reader has met no other file.
    let mut read: Vec<_> = read_in(folder).files;
    let mut hashed = seen.pop().unwrap().files;
    read.sort();
    hashed.sort();
    assert_eq!(read, hashed);
}

#[test]
fn what_is_not_understood_is_noted_and_case_does_not_matter() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let obj = format!("MTLLIB A.mtl\n{FACES}UseMtl x\nf 1 2 3\n");
    put(folder, "a.obj", obj);
    let cut = &png(image::ExtendedColorType::L8, &[9])[..40];
    put(folder, "CUT.png", cut);
    put(folder, "b.bmp", b"BM");
    let library =
        "newmtl x\nKd red\nKd 0 0,5 1\nKe 1 2\nnewmtl\nnewmtl x\nNs\nmap_Kd\nmap_Ke -s 2 b.bmp\n";
    put(folder, "a.MTL", library);
    let notes = read_in(folder).notes;
    let unclear = |n: &&String| n.starts_with("line ") && n.contains("is not understood");
    assert_eq!(notes.iter().filter(unclear).count(), 6, "{notes:?}");
    assert!(
        notes[1].contains("line 3 of material library `A.mtl`"),
        "{notes:?}"
    );
    put(
        folder,
        "a.MTL",
        "newmtl x\nmap_Kd cut.png\nmap_Ke -s 2 b.bmp\n",
    );
    let notes = read_in(folder).notes;
    assert!(
        notes[0].contains("`cut.png` is skipped: it is cut off"),
        "{notes:?}"
    );
    assert!(notes[1].contains("BMP, not PNG"), "{notes:?}");
    put(folder, "a.MTL", b"\xff\xfen\0");
    assert!(read_in(folder).notes[0].contains("UTF-16"));
    put(folder, "b.bmp", png(image::ExtendedColorType::L8, &[9]));
    put(folder, "a.MTL", "newmtl x\nmap_Ke -s 2 b.bmp\n");
    let notes = read_in(folder).notes;
    assert_eq!(notes, ["texture `b.bmp` is used as it is, without -s"]);
    let bytes = |name: &str| fingerprint(&folder.join(name)).unwrap().bytes;
    let alone = fs::metadata(folder.join("a.obj")).unwrap().len();
    assert!(bytes("a.obj") > alone + 40);
}
