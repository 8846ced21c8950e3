//! What is fuzzed: every reader of bytes that somebody else may have written. A target may refuse its bytes in any way; it may not panic,
//! hang, or take memory without bound. What is read is checked for what the reader promises of it.

use affine_atlas::batch::plan::Plan;
use affine_atlas::config;
use affine_atlas::export::manifest::Manifest;
use affine_atlas::flow::cones;
use affine_atlas::read::{
    ReadError, ReadParams, SourceAsset, atlas, fingerprint, gridded, metric, read, read_bytes,
};
use affine_atlas::texture::Exemplar;
use affine_atlas::verify::{VerifyOptions, verify};
use serde_json::{Value, json};
use std::cell::RefCell;
use std::fs;
use std::io::{Cursor, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::thread::LocalKey;

/// Reads whatever bytes it is given.
pub type Target = fn(&[u8]);

/// All targets by name.
pub const TARGETS: [(&str, Target); 17] = [
    ("obj", |bytes| mesh("a.obj", bytes)),
    ("off", |bytes| mesh("a.off", bytes)),
    ("ply", |bytes| mesh("a.ply", bytes)),
    ("stl", |bytes| mesh("a.stl", bytes)),
    ("gltf", gltf),
    ("glb", |bytes| mesh("a.glb", bytes)),
    ("meshopt", meshopt),
    ("draco", draco),
    ("pattern", pattern),
    ("exr", exr),
    ("npz", npz),
    ("atlas_json", atlas_json),
    ("config", configuration),
    ("cones", cone_file),
    ("plan", plan),
    ("manifest", manifest),
    ("verify", verify_folder),
];

const LIMITS: ReadParams = ReadParams {
    max_vertices: 20_000,
    max_faces: 20_000,
    max_file_bytes: 8 << 20,
};

/// A mesh in memory.
fn mesh(name: &str, bytes: &[u8]) {
    promised(read_bytes(Path::new(name), bytes, &LIMITS));
}

/// What the reader promises of a mesh, or of its refusal.
fn promised(read: Result<SourceAsset, ReadError>) {
    match read {
        Ok(asset) => {
            let soup = &asset.soup;
            let count = soup.positions.len();
            assert!(!soup.faces.is_empty());
            assert!(soup.faces.iter().flatten().all(|&v| (v as usize) < count));
            assert!(soup.positions.iter().flatten().all(|x| x.is_finite()));
            assert_eq!(soup.face_material.len(), soup.faces.len());
            for attribute in &soup.attributes {
                let numbers = 3 * soup.faces.len() * attribute.components;
                assert_eq!(attribute.values.len(), numbers);
                assert!(attribute.values.iter().all(|x| !x.is_infinite()));
            }
        }
        Err(error) => {
            let message = error.to_string();
            assert!(message.len() < 1000, "{message}");
            assert!(!message.contains(|c: char| c.is_control()), "{message:?}");
        }
    }
}

/// A glTF file in a folder, with the files it refers to.
fn gltf(bytes: &[u8]) {
    in_folder(&SMALL, |folder| {
        let path = folder.put("a.gltf", bytes);
        let found = fingerprint(&path).expect("a file");
        let asset = read(&path, &LIMITS);
        if let Ok(asset) = &asset {
            assert!(asset.files.iter().all(|file| found.files.contains(file)));
        }
        promised(asset);
    });
}

/// A GLB around compressed data: `extend` completes its JSON.
fn packed(binary: &[u8], extend: impl FnOnce(&mut Value)) {
    let mut root = json!({
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": binary.len()}],
        "nodes": [{"mesh": 0}],
    });
    extend(&mut root);
    let mut text = root.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut glb = b"glTF".to_vec();
    for word in [
        2,
        (28 + text.len() + binary.len()) as u32,
        text.len() as u32,
    ] {
        glb.extend(word.to_le_bytes());
    }
    glb.extend(b"JSON");
    glb.extend(&text);
    glb.extend((binary.len() as u32).to_le_bytes());
    glb.extend(b"BIN\0");
    glb.extend(binary);
    mesh("a.glb", &glb);
}

/// Four bytes that choose mode, filter, stride and count, then a compressed buffer view.
fn meshopt(bytes: &[u8]) {
    let Some((&[mode, filter, stride, count], data)) = bytes.split_first_chunk() else {
        return;
    };
    let pick = |names: &[&'static str], k: u8| names[usize::from(k) % names.len()];
    let mode = pick(&["ATTRIBUTES", "TRIANGLES", "INDICES"], mode);
    let filters = ["NONE", "OCTAHEDRAL", "QUATERNION", "EXPONENTIAL", "COLOR"];
    let filter = pick(&filters, filter);
    let (stride, count) = (u64::from(stride), 3 * u64::from(count));
    let is_positions = mode == "ATTRIBUTES";
    let (kind, component) = match (is_positions, stride) {
        (true, 12) => ("VEC3", 5126),
        (true, 8) => ("VEC3", 5122),
        (true, _) => ("VEC3", 5120),
        (false, 2) => ("SCALAR", 5123),
        (false, _) => ("SCALAR", 5125),
    };
    packed(data, |root| {
        let mut view = json!({"buffer": 0, "byteLength": stride * count, "extensions": {"EXT_meshopt_compression": {
            "buffer": 0, "byteLength": data.len(), "byteStride": stride, "count": count, "mode": mode, "filter": filter,
        }}});
        if is_positions {
            view["byteStride"] = json!(stride);
        }
        root["bufferViews"] = json!([view]);
        let vertices = if is_positions { count } else { 256 };
        let read =
            json!({"bufferView": 0, "componentType": component, "count": count, "type": kind});
        let zeros = json!({"componentType": 5126, "count": vertices, "type": "VEC3"});
        root["accessors"] = json!([read, zeros]);
        let mut primitive = json!({"attributes": {"POSITION": if is_positions { 0 } else { 1 }}});
        if !is_positions {
            primitive["indices"] = json!(0);
        }
        root["meshes"] = json!([{"primitives": [primitive]}]);
    });
}

/// A Draco stream with positions, normals, texture coordinates and colours.
fn draco(bytes: &[u8]) {
    packed(bytes, |root| {
        root["bufferViews"] = json!([{"buffer": 0, "byteLength": bytes.len()}]);
        let vectors = ["VEC3", "VEC3", "VEC2", "VEC4"];
        root["accessors"] = vectors
            .iter()
            .map(|kind| json!({"componentType": 5126, "count": 4, "type": kind}))
            .collect();
        let names = ["POSITION", "NORMAL", "TEXCOORD_0", "COLOR_0"];
        // The second has positions alone, which more streams have.
        let primitives = [4, 1].map(|count| {
            let all = names.iter().take(count).enumerate();
            let attributes: serde_json::Map<String, Value> = all
                .map(|(i, name)| ((*name).to_owned(), json!(i)))
                .collect();
            json!({"attributes": attributes, "extensions": {
                "KHR_draco_mesh_compression": {"bufferView": 0, "attributes": attributes},
            }})
        });
        let [all, alone] = primitives;
        root["meshes"] = json!([{"primitives": [all]}, {"primitives": [alone]}]);
        // Which of the two, by the stream itself, so that either is reached.
        root["nodes"] = json!([{"mesh": bytes.len() % 2}]);
    });
}

/// An image whose repetition covers a surface.
fn pattern(bytes: &[u8]) {
    // Large images take their time in decoders that are not ours.
    if side_of(bytes) > 512 {
        return;
    }
    in_folder(&SMALL, |folder| {
        let path = folder.put("pattern", bytes);
        if let Ok(image) = Exemplar::read(&path) {
            let _ = (
                image.border(),
                image.symmetry([1, 2]),
                image.is_transparent(),
            );
            assert!(
                image
                    .mean([0.3, 0.7], [0.5, 0.25])
                    .iter()
                    .all(|x| x.is_finite())
            );
        }
    });
}

/// The larger side that a PNG or JPEG states, 0 where it states none.
fn side_of(bytes: &[u8]) -> u64 {
    if let Some(rest) = bytes.strip_prefix(b"\x89PNG\r\n\x1a\n") {
        let word = |at: usize| {
            let b = rest.get(at..at + 4)?;
            Some(u64::from(u32::from_be_bytes([b[0], b[1], b[2], b[3]])))
        };
        return word(8).max(word(12)).unwrap_or(0);
    }
    let frame = |w: &&[u8]| w[0] == 0xff && (0xc0..=0xc2).contains(&w[1]);
    let sides = bytes.windows(9).filter(frame).map(|w| {
        let side = |at: usize| u64::from(u16::from_be_bytes([w[at], w[at + 1]]));
        side(5).max(side(7))
    });
    sides.max().unwrap_or(0)
}

/// One image of a folder that is whole but for it.
fn exr(bytes: &[u8]) {
    in_folder(&SMALL, |folder| {
        folder.put("images/0000.exr", bytes);
        let _ = atlas::read_images(&folder.path);
    });
}

/// The arrays of a folder that is whole but for them.
fn npz(bytes: &[u8]) {
    in_folder(&SMALL, |folder| {
        folder.put("atlas.npz", bytes);
        if let Ok(surface) = gridded::read_gridded(&folder.path) {
            let count = surface.positions.len();
            let mut corners = surface.faces.iter().flatten();
            assert!(corners.all(|&v| (v as usize) < count));
            let count = surface.quads.points.len();
            let mut corners = surface.quads.cells.iter().flatten();
            assert!(corners.all(|&v| (v as usize) < count));
        }
        let _ = metric::read_metric(&folder.path);
        let _ = atlas::read_images(&folder.path);
    });
}

/// The description of a folder that is whole but for it.
fn atlas_json(bytes: &[u8]) {
    in_folder(&SMALL, |folder| {
        folder.put("atlas.json", bytes);
        let _ = atlas::read_images(&folder.path);
        let _ = metric::read_metric(&folder.path);
        let _ = gridded::read_gridded(&folder.path);
    });
}

fn configuration(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    match config::parse("config.toml", &text, &[]) {
        Ok(config) => {
            let flat = config.flat();
            assert!(!flat.is_empty());
            assert_eq!(config.hash(), config.canonical().hash());
        }
        Err(error) => assert!(!error.remedy().is_empty()),
    }
    // The same text as a setting on the command line.
    let _ = config::parse("config.toml", "", &[text.into_owned()]);
}

fn cone_file(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    for first in [0, 1] {
        if let Ok(cones) = cones::file::parse(&text, first) {
            let lines = text.lines().count();
            assert!(
                cones
                    .iter()
                    .all(|(line, _)| (1..=lines).contains(&(*line as usize)))
            );
        }
    }
}

fn plan(bytes: &[u8]) {
    in_folder(&SMALL, |folder| {
        let path = folder.put("plan.jsonl", bytes);
        let _ = Plan::read(&path);
        // Most plans have a wrong hash; this one's is right.
        let sealed = folder.put("plan.jsonl", &with_hash(bytes));
        let _ = Plan::read(&sealed);
    });
}

/// A plan whose last line holds the hash of all lines before.
fn with_hash(bytes: &[u8]) -> Vec<u8> {
    let text = bytes.strip_suffix(b"\n").unwrap_or(bytes);
    let end = text
        .iter()
        .rposition(|&b| b == b'\n')
        .map_or(0, |at| at + 1);
    let Ok(Value::Object(mut last)) = serde_json::from_slice(&text[end..]) else {
        return bytes.to_vec();
    };
    let hash = blake3::hash(&text[..end]).to_hex().to_string();
    for value in last
        .values_mut()
        .filter(|value| value.as_str().is_some_and(|s| s.len() == 64))
    {
        *value = json!(hash);
    }
    let mut all = text[..end].to_vec();
    all.extend(Value::Object(last).to_string().into_bytes());
    all.push(b'\n');
    all
}

fn manifest(bytes: &[u8]) {
    in_folder(&WHOLE, |folder| {
        folder.put("manifest.jsonl", bytes);
        if let Ok((manifest, _)) = Manifest::load(&folder.path) {
            assert!(manifest.records().len() <= bytes.len());
        }
        let _ = verify(&folder.path, &VerifyOptions::default());
    });
}

/// Edits of the files of a whole folder: each two bytes that choose a file, two that choose a place in it, and one that says how many
/// of the bytes behind it (up to 15) take the place of those there. Arrays are edited unpacked and packed again.
fn verify_folder(bytes: &[u8]) {
    static UNPACKED: LazyLock<Vec<(String, Vec<u8>)>> = LazyLock::new(|| arrays_of(NPZ));
    in_folder(&WHOLE, |folder| {
        let mut files: Vec<(&str, Vec<u8>)> = PLAIN
            .iter()
            .map(|&(name, bytes)| (name, bytes.to_vec()))
            .collect();
        let mut arrays = UNPACKED.clone();
        let mut edited = vec![false; files.len() + 1];
        let mut rest = bytes;
        while let Some((&[file, low, high, count], after)) = rest.split_first_chunk() {
            let count = usize::from(count % 16).min(after.len());
            let (new, after) = after.split_at(count);
            rest = after;
            let plain = files.len();
            let file = usize::from(file) % (plain + arrays.len());
            let old = match file < plain {
                true => &mut files[file].1,
                false => &mut arrays[file - plain].1,
            };
            let at = usize::from(u16::from_le_bytes([low, high])) % old.len();
            let end = (at + count).min(old.len());
            old[at..end].copy_from_slice(&new[..end - at]);
            edited[file.min(plain)] = true;
        }
        for ((name, bytes), _) in files.iter().zip(&edited).filter(|(_, edited)| **edited) {
            folder.put(name, bytes);
        }
        if edited[files.len()] {
            folder.put("atlas.npz", &zipped(&arrays));
        }
        let verdicts = verify(&folder.path, &VerifyOptions::default());
        assert!(!verdicts.expect("a folder").checks.is_empty());
    });
}

// ---- whole folders

/// Names of files and what they hold.
type Files = [(&'static str, &'static [u8])];

macro_rules! file {
    ($folder:literal, $name:literal) => {
        ($name, include_bytes!(concat!("../", $folder, "/", $name)))
    };
}

const NPZ: &[u8] = include_bytes!("../folder/atlas.npz");

/// What a build wrote of a tetrahedron, without its arrays.
const PLAIN: &Files = &[
    file!("folder", "atlas.json"),
    file!("folder", "surface.glb"),
    file!("folder", "images/0000.exr"),
    file!("folder", "images/0001.exr"),
    file!("folder", "images/0002.exr"),
    file!("folder", "images/0003.exr"),
];

const ARRAYS: &Files = &[("atlas.npz", NPZ)];

/// As little as the readers take: one patch of 8 by 8 texels, so that most of the time goes to the file that is fuzzed. And a file that a
/// glTF file may refer to.
const LITTLE: &Files = &[
    file!("small", "atlas.json"),
    file!("small", "atlas.npz"),
    file!("small", "images/0000.exr"),
    file!("small", "square.bin"),
];

thread_local! {
    static WHOLE: RefCell<Folder> = RefCell::new(Folder::new(&[PLAIN, ARRAYS].concat()));
    static SMALL: RefCell<Folder> = RefCell::new(Folder::new(LITTLE));
}

/// A folder that holds a whole atlas, of which a target replaces files.
struct Folder {
    path: PathBuf,
    whole: Vec<(&'static str, &'static [u8])>,
    replaced: Vec<String>,
    _removed_at_the_end: tempfile::TempDir,
}

impl Folder {
    fn new(files: &Files) -> Self {
        // In memory where the system has such a place.
        let memory = Path::new("/dev/shm");
        let folder = match memory.is_dir() {
            true => tempfile::tempdir_in(memory),
            false => tempfile::tempdir(),
        };
        let folder = folder.expect("a temporary folder");
        fs::create_dir(folder.path().join("images")).expect("a folder");
        let mut whole = Self {
            path: folder.path().to_owned(),
            whole: files.to_vec(),
            replaced: files.iter().map(|(name, _)| (*name).to_owned()).collect(),
            _removed_at_the_end: folder,
        };
        whole.restore();
        whole
    }

    fn put(&mut self, name: &str, bytes: &[u8]) -> PathBuf {
        let path = self.path.join(name);
        fs::write(&path, bytes).expect("written");
        if !self.replaced.iter().any(|known| known == name) {
            self.replaced.push(name.to_owned());
        }
        path
    }

    fn restore(&mut self) {
        for name in std::mem::take(&mut self.replaced) {
            let path = self.path.join(&name);
            match self.whole.iter().find(|(known, _)| *known == name) {
                Some((_, bytes)) => fs::write(path, bytes).expect("written"),
                None => fs::remove_file(path).expect("removed"),
            }
        }
    }
}

fn in_folder(folder: &'static LocalKey<RefCell<Folder>>, run: impl FnOnce(&mut Folder)) {
    folder.with_borrow_mut(|folder| {
        run(folder);
        folder.restore();
    });
}

/// Names and bytes of the arrays of a container.
fn arrays_of(npz: &[u8]) -> Vec<(String, Vec<u8>)> {
    let mut archive = zip::ZipArchive::new(Cursor::new(npz)).expect("a container");
    (0..archive.len())
        .map(|i| {
            let mut entry = archive.by_index(i).expect("an entry");
            let mut bytes = Vec::new();
            entry.read_to_end(&mut bytes).expect("an array");
            (entry.name().expect("a name").into_owned(), bytes)
        })
        .collect()
}

fn zipped(arrays: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options =
        zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (name, bytes) in arrays {
        zip.start_file(name.as_str(), options).expect("an entry");
        zip.write_all(bytes).expect("written");
    }
    zip.finish().expect("a container").into_inner()
}
