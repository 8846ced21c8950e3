//! A hash over a mesh file and every file that it refers to, without decoding any of them.
//!
//! *Enters:* a path. *Leaves:* a [`Fingerprint`] that changes when a byte of the file changes, or a byte of a buffer or image that a glTF
//! file names, of a material library that an OBJ file names or of an image that this one names, or one of those appears or disappears. Only files that are hashed decide which
//! others are named, so two equal fingerprints mean that [`read`](super::read()) meets the same bytes.
//! Memory is bounded by the JSON of a glTF file and by material libraries; everything else streams through the hash.

use super::bounded::open_regular;
use super::{Format, folder, format_of, gltf, mtl};
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// What was found; see the module docs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fingerprint {
    /// BLAKE3, 64 hexadecimal digits.
    pub hash: String,
    /// Bytes of all files together.
    pub bytes: u64,
    /// The file and those that it refers to and that exist, the latter by name.
    pub files: Vec<PathBuf>,
}

/// Hashes a mesh file with all that it refers to.
///
/// # Errors
/// Where the file itself cannot be read. One that it refers to and that is missing, or lies outside its folder, is hashed as missing.
pub fn fingerprint(path: &Path) -> io::Result<Fingerprint> {
    let (mut file, _) = open_regular(path)?;
    let (hash, mut bytes) = hash_of(&mut file)?;
    let mut files = vec![path.to_owned()];
    let shown = path.parent().unwrap_or(Path::new(""));
    let folder = match shown.as_os_str().is_empty() {
        true => Path::new(".").canonicalize()?,
        false => shown.canonicalize()?,
    };
    let named = match format_of(path) {
        Ok(Format::Gltf) => named_in(&mut file)?,
        Ok(Format::Obj) => named_in_obj(&mut file, &folder)?,
        _ => BTreeSet::new(),
    };
    if named.is_empty() {
        let hash = hash.to_hex().to_string();
        return Ok(Fingerprint { hash, bytes, files });
    }
    let mut all = blake3::Hasher::new();
    all.update(hash.as_bytes());
    for name in &named {
        all.update(&(name.len() as u64).to_le_bytes());
        all.update(name.as_bytes());
        match referenced(&folder, name) {
            Ok((hash, length)) => {
                all.update(hash.as_bytes());
                bytes = bytes.saturating_add(length);
                files.push(shown.join(name));
            }
            Err(_) => {
                all.update(b"missing");
            }
        }
    }
    let hash = all.finalize().to_hex().to_string();
    Ok(Fingerprint { hash, bytes, files })
}

/// Hash and length of a stream from its start.
fn hash_of(file: &mut File) -> io::Result<(blake3::Hash, u64)> {
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(file)?;
    Ok((hasher.finalize(), hasher.count()))
}

/// A file in a folder, links followed.
fn open_in(folder: &Path, name: &str) -> io::Result<File> {
    let path = folder::find(folder, name)?;
    if !path.starts_with(folder) {
        return Err(io::ErrorKind::NotFound.into());
    }
    Ok(open_regular(&path)?.0)
}

/// Hash and length of a file in a folder.
fn referenced(folder: &Path, name: &str) -> io::Result<(blake3::Hash, u64)> {
    hash_of(&mut open_in(folder, name)?)
}

/// The material libraries that an OBJ file names, and the images that they name.
fn named_in_obj(file: &mut File, folder: &Path) -> io::Result<BTreeSet<String>> {
    file.seek(SeekFrom::Start(0))?;
    let mut named = BTreeSet::new();
    for name in mtl::libraries(BufReader::new(file))? {
        for library in mtl::library_files(&name) {
            let mut bytes = Vec::new();
            let read = open_in(folder, &library)
                .and_then(|file| file.take(mtl::LARGEST + 1).read_to_end(&mut bytes));
            if read.is_ok() && bytes.len() as u64 <= mtl::LARGEST {
                named.extend(mtl::texture_files(&library, &bytes));
            }
            named.insert(library);
        }
    }
    Ok(named)
}

/// The files that a glTF or GLB file names. One whose JSON is broken names none: reading it is refused.
fn named_in(file: &mut File) -> io::Result<BTreeSet<String>> {
    file.seek(SeekFrom::Start(0))?;
    let mut start = [0; 12];
    let json = match file.read_exact(&mut start) {
        Ok(()) if start.starts_with(b"glTF") => json_chunk(file)?,
        _ => {
            let mut text = Vec::new();
            file.seek(SeekFrom::Start(0))?;
            file.read_to_end(&mut text)?;
            text
        }
    };
    Ok(gltf::referenced_files(&json))
}

/// The first JSON chunk of a GLB file, which stands behind its header; empty where there is none.
fn json_chunk(file: &mut File) -> io::Result<Vec<u8>> {
    let mut head = [0; 8];
    while file.read_exact(&mut head).is_ok() {
        let [a, b, c, d, kind @ ..] = head;
        let length = u64::from(u32::from_le_bytes([a, b, c, d]));
        if &kind == b"JSON" {
            let mut text = Vec::new();
            file.take(length).read_to_end(&mut text)?;
            return Ok(text);
        }
        file.seek(SeekFrom::Current(i64::try_from(length).unwrap_or(i64::MAX)))?;
    }
    Ok(Vec::new())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn gltf(uris: &[&str]) -> String {
        let list: Vec<String> = uris
            .iter()
            .map(|uri| format!(r#"{{"uri":"{uri}","byteLength":1}}"#))
            .collect();
        format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{}],"images":[{{"uri":"skin.png"}}]}}"#,
            list.join(",")
        )
    }

    #[test]
    fn a_file_that_stands_alone_has_its_own_hash() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        fs::write(&path, "v 0 0 0").unwrap();
        let found = fingerprint(&path).unwrap();
        assert_eq!(found.hash, blake3::hash(b"v 0 0 0").to_hex().as_str());
        assert_eq!((found.bytes, found.files.len()), (7, 1));
        assert!(fingerprint(folder.path()).is_err());
        assert!(fingerprint(&folder.path().join("none.obj")).is_err());
    }

    #[test]
    fn every_file_that_a_gltf_names_counts() {
        let folder = tempfile::tempdir().unwrap();
        let put = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
        fs::create_dir(folder.path().join("sub")).unwrap();
        put(
            "a.gltf",
            gltf(&["b%201.bin", "data:;base64,AA==", "sub/c.bin", "../x"]).as_bytes(),
        );
        put("b 1.bin", b"1");
        put("sub/c.bin", b"22");
        put("x", b"not in the folder of the buffers, but in the same");
        let hash = || fingerprint(&folder.path().join("a.gltf")).unwrap();
        let first = hash();
        let names: Vec<_> = first
            .files
            .iter()
            .map(|f| f.strip_prefix(folder.path()).unwrap())
            .collect();
        assert_eq!(names, ["a.gltf", "b 1.bin", "sub/c.bin"].map(Path::new));
        put("x", b"changed");
        assert_eq!(hash(), first);
        put("b 1.bin", b"2");
        let second = hash();
        assert_ne!(second.hash, first.hash);
        put("skin.png", b"an image that was missing");
        let third = hash();
        assert_ne!(third.hash, second.hash);
        assert_eq!(third.files.len(), 4);
        fs::remove_file(folder.path().join("skin.png")).unwrap();
        assert_eq!(hash(), second);
    }

    #[test]
    fn a_glb_is_searched_for_names_too() {
        let folder = tempfile::tempdir().unwrap();
        let mut json = gltf(&["a.bin"]).into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut glb = b"glTF\x02\0\0\0".to_vec();
        glb.extend((20 + json.len() as u32).to_le_bytes());
        glb.extend((json.len() as u32).to_le_bytes());
        glb.extend(b"JSON");
        glb.extend(json);
        let path = folder.path().join("a.glb");
        fs::write(&path, &glb).unwrap();
        let missing = fingerprint(&path).unwrap();
        fs::write(folder.path().join("a.bin"), b"1").unwrap();
        assert_ne!(fingerprint(&path).unwrap().hash, missing.hash);
        for end in 0..glb.len() {
            fs::write(&path, &glb[..end]).unwrap();
            fingerprint(&path).unwrap();
        }
    }
}
