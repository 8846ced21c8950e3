//! Folders of atlases: their bytes, and whether they are whole.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// The hash of every file below a folder, by path.
pub fn tree(folder: &Path) -> BTreeMap<String, String> {
    let mut files = BTreeMap::new();
    let mut pending = vec![folder.to_owned()];
    while let Some(path) = pending.pop() {
        for entry in fs::read_dir(&path).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                pending.push(path);
            } else {
                let bytes = fs::read(&path).expect("readable");
                let name = path
                    .strip_prefix(folder)
                    .expect("below")
                    .display()
                    .to_string();
                files.insert(name, blake3::hash(&bytes).to_hex().to_string());
            }
        }
    }
    files
}

/// The folders of assets in an output root, with the bytes of each.
pub fn atlases(root: &Path) -> BTreeMap<String, BTreeMap<String, String>> {
    let names = visible(root);
    names
        .into_iter()
        .map(|name| (name.clone(), tree(&root.join(name))))
        .collect()
}

/// Names of the assets' folders.
pub fn visible(root: &Path) -> Vec<String> {
    let entries = fs::read_dir(root).into_iter().flatten().flatten();
    let names = entries.filter(|e| e.path().is_dir());
    let names = names.map(|e| e.file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> = names
        .filter(|n| !n.starts_with('.') && n != "logs")
        .collect();
    names.sort();
    names
}

/// What is unfinished in an output root.
pub fn unfinished(root: &Path) -> Vec<String> {
    let entries = fs::read_dir(root).into_iter().flatten().flatten();
    let names = entries.map(|e| e.file_name().to_string_lossy().into_owned());
    names.filter(|n| n.starts_with(".affine-atlas-")).collect()
}

/// What is missing or cut in an atlas's folder, from what its own files say of each other. Nothing is said of a folder that was replaced
/// while it was read.
pub fn half_written(folder: &Path) -> Option<String> {
    let before = number(folder)?;
    let wrong = look(folder).err()?;
    (number(folder)? == before).then(|| format!("{}: {wrong}", folder.display()))
}

/// Tells whether a folder is the same one.
#[cfg(unix)]
fn number(folder: &Path) -> Option<u64> {
    use std::os::unix::fs::MetadataExt;
    Some(fs::metadata(folder).ok()?.ino())
}

#[cfg(not(unix))]
fn number(folder: &Path) -> Option<u64> {
    folder.is_dir().then_some(0)
}

fn look(folder: &Path) -> Result<(), String> {
    let read = |name: &str| fs::read(folder.join(name)).map_err(|e| format!("{name}: {e}"));
    let document: serde_json::Value =
        serde_json::from_slice(&read("atlas.json")?).map_err(|e| format!("atlas.json: {e}"))?;
    // A zip's directory stands at its end.
    let npz = read("atlas.npz")?;
    let tail = &npz[npz.len().saturating_sub(22)..];
    if !tail.starts_with(b"PK\x05\x06") {
        return Err("atlas.npz has no end".into());
    }
    let glb = read("surface.glb")?;
    let length = glb
        .get(8..12)
        .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    if length != u32::try_from(glb.len()).ok() {
        return Err(format!("surface.glb has {} bytes of {length:?}", glb.len()));
    }
    let patches = document["patches"].as_array().ok_or("no patches")?;
    for patch in patches {
        let image = patch["image"].as_str().ok_or("no image")?;
        if read(image)?.len() < 500 {
            return Err(format!("{image} is too short"));
        }
    }
    Ok(())
}
