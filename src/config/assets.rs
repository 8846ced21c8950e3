//! Names of assets: one output folder for each input file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// One input file and the name of its output folder.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Asset {
    /// Folder name below the output folder: the file's stem, made unique.
    pub id: String,
    /// The file, relative to the current folder or absolute.
    pub path: PathBuf,
    /// The file as the user wrote it (`source.path`).
    pub given: PathBuf,
}

/// Names every input file.
///
/// `given` are paths as written, `base` the folder that relative ones start from. A file named
/// twice is one asset. The id is the file's stem with everything but letters, digits, `.`, `_`
/// and `-` replaced by `-`. Where stems collide (letter case ignored, for file systems that
/// ignore it) the extension is appended (`a-obj`, `a-glb`) if that tells them apart, else the
/// folder's name is put in front (`left-a`, `right-a`), else both; what still collides is
/// numbered in the order given. Ids depend on the list of paths only.
#[must_use]
pub fn name_assets(given: &[PathBuf], base: &Path) -> Vec<Asset> {
    let mut files: Vec<(PathBuf, PathBuf)> = Vec::new();
    for path in given {
        let file = base.join(path);
        if files.iter().all(|(known, _)| *known != file) {
            files.push((file, path.clone()));
        }
    }
    let mut by_stem: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for (i, (file, _)) in files.iter().enumerate() {
        by_stem
            .entry(stem(file).to_lowercase())
            .or_default()
            .push(i);
    }
    let mut ids = vec![String::new(); files.len()];
    for members in by_stem.values() {
        let spellings: [fn(&Path) -> String; 4] = [
            stem,
            |file| format!("{}-{}", stem(file), extension(file)),
            |file| format!("{}-{}", folder(file), stem(file)),
            |file| format!("{}-{}-{}", folder(file), stem(file), extension(file)),
        ];
        for spelling in spellings {
            for &i in members {
                ids[i] = spelling(&files[i].0);
            }
            if all_distinct(members.iter().map(|&i| ids[i].as_str())) {
                break;
            }
        }
    }
    // Names from different stems may meet (`a-obj.off` and `a.obj`); the output root holds
    // `manifest.jsonl` itself.
    let mut taken: Vec<String> = vec!["manifest.jsonl".to_owned()];
    for id in &mut ids {
        let wanted = id.clone();
        let mut number = 2;
        while taken.contains(&id.to_lowercase()) {
            *id = format!("{wanted}-{number}");
            number += 1;
        }
        taken.push(id.to_lowercase());
    }
    files
        .into_iter()
        .zip(ids)
        .map(|((path, given), id)| Asset { id, path, given })
        .collect()
}

fn all_distinct<'a>(names: impl Iterator<Item = &'a str>) -> bool {
    let mut lower: Vec<String> = names.map(str::to_lowercase).collect();
    lower.sort_unstable();
    lower.windows(2).all(|pair| pair[0] != pair[1])
}

fn stem(file: &Path) -> String {
    plain(file.file_stem())
}

fn extension(file: &Path) -> String {
    plain(file.extension())
}

fn folder(file: &Path) -> String {
    plain(file.parent().and_then(Path::file_name))
}

/// A name that is safe as a folder on any system and never hidden.
fn plain(name: Option<&std::ffi::OsStr>) -> String {
    let name = name.unwrap_or_default().to_string_lossy();
    let safe: String = name
        .chars()
        .map(|c| {
            if c.is_alphanumeric() || "._-".contains(c) {
                c
            } else {
                '-'
            }
        })
        .collect();
    let safe = safe.trim_start_matches(['.', '-']);
    if safe.is_empty() {
        "mesh".to_owned()
    } else {
        safe.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ids(paths: &[&str]) -> Vec<String> {
        let given: Vec<PathBuf> = paths.iter().map(PathBuf::from).collect();
        name_assets(&given, Path::new("base"))
            .into_iter()
            .map(|asset| asset.id)
            .collect()
    }

    #[test]
    fn stems_where_they_are_unique() {
        assert_eq!(ids(&["x/cow.obj", "spot.v2.ply"]), ["cow", "spot.v2"]);
    }

    #[test]
    fn collisions() {
        assert_eq!(ids(&["a.obj", "a.glb"]), ["a-obj", "a-glb"]);
        assert_eq!(ids(&["left/a.obj", "right/a.obj"]), ["left-a", "right-a"]);
        assert_eq!(
            ids(&["x/a.obj", "x/a.glb", "y/a.obj"]),
            ["x-a-obj", "x-a-glb", "y-a-obj"]
        );
        assert_eq!(ids(&["1/x/a.obj", "2/x/a.obj"]), ["x-a-obj", "x-a-obj-2"]);
        assert_eq!(ids(&["A.obj", "a.obj"]), ["base-A-obj", "base-a-obj-2"]);
        assert_eq!(
            ids(&["a-obj.off", "a.obj", "a.glb"]),
            ["a-obj", "a-obj-2", "a-glb"]
        );
    }

    #[test]
    fn a_file_named_twice_is_one_asset() {
        assert_eq!(ids(&["a.obj", "a.obj"]), ["a"]);
    }

    #[test]
    fn names_are_safe() {
        assert_eq!(ids(&["my mesh (1).obj"]), ["my-mesh--1-"]);
        assert_eq!(ids(&[".hidden.obj"]), ["hidden"]);
        assert_eq!(ids(&["..", "???.obj"]), ["mesh-mesh", "mesh-obj"]);
        assert_eq!(ids(&["manifest.jsonl.obj"]), ["manifest.jsonl-2"]);
    }

    #[test]
    fn paths_start_at_the_base() {
        let given = [PathBuf::from("m/a.obj"), PathBuf::from("/abs/b.obj")];
        let assets = name_assets(&given, Path::new("base"));
        assert_eq!(assets[0].path, Path::new("base/m/a.obj"));
        assert_eq!(assets[0].given, given[0]);
        assert_eq!(assets[1].path, given[1]);
    }
}
