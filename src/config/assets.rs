//! Names of assets: one output folder for each input file.

use crate::export::folder::RESERVED;
use std::collections::{BTreeMap, HashSet};
use std::path::{Component, Path, PathBuf};

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

/// One input file that wants a name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Input {
    /// The file, relative to the current folder or absolute.
    pub path: PathBuf,
    /// The file as the user wrote it, or would have.
    pub given: PathBuf,
    /// Where it lies below the folder or glob that it was found by, or as a list names it; nothing where the user named it alone.
    pub below: Option<PathBuf>,
}

/// Most bytes of an id: names of files have 255 at most, and some hold an id and more.
const LONGEST: usize = 120;

/// Names every input file.
///
/// In ids everything but letters, digits, `.`, `_` and `-` becomes `-`.
///
/// A file that was found below a folder, by a glob or in a list is named by its place there without extension (`left/a.obj`: `left-a`). So its id
/// does not depend on what else is there, but for files whose ids would be the same: these get their extension (`left-a-obj`,
/// `left-a-glb`), and where that does not tell them apart, some digits of a hash of their place.
///
/// A file that was named alone gets its stem. Where stems collide (letter case ignored, for file systems that
/// ignore it) the extension is appended (`a-obj`, `a-glb`) if that tells them apart, else the
/// folder's name is put in front (`left-a`, `right-a`), else both; what still collides is
/// numbered in the order given. Ids depend on the list of paths only.
#[must_use]
pub fn name_assets(inputs: Vec<Input>) -> Vec<Asset> {
    let mut groups: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    let mut longer_and_longer = Vec::with_capacity(inputs.len());
    for (i, input) in inputs.iter().enumerate() {
        let spellings = spellings(input);
        groups
            .entry(spellings[0].to_lowercase())
            .or_default()
            .push(i);
        longer_and_longer.push(spellings.into_iter());
    }
    let mut ids = vec![String::new(); inputs.len()];
    for members in groups.values() {
        for _ in 0..4 {
            for &i in members {
                ids[i] = longer_and_longer[i].next().unwrap_or_default();
            }
            if all_distinct(members.iter().map(|&i| ids[i].as_str())) {
                break;
            }
        }
    }
    // Names from different stems may meet (`a-obj.off` and `a.obj`); the output root holds files of its own.
    let mut taken: HashSet<String> = RESERVED.iter().map(|&name| name.to_owned()).collect();
    for id in &mut ids {
        let wanted = id.clone();
        let mut number = 2;
        while !taken.insert(id.to_lowercase()) {
            *id = format!("{wanted}-{number}");
            number += 1;
        }
    }
    let named = inputs.into_iter().zip(ids);
    named
        .map(|(Input { path, given, .. }, id)| Asset { id, path, given })
        .collect()
}

/// From the shortest name of a file to the longest.
fn spellings(input: &Input) -> [String; 4] {
    let file = &input.path;
    let Some(below) = &input.below else {
        return [
            stem(file),
            format!("{}-{}", stem(file), extension(file)),
            format!("{}-{}", folder(file), stem(file)),
            format!("{}-{}-{}", folder(file), stem(file), extension(file)),
        ];
    };
    let hash = blake3::hash(below.as_os_str().as_encoded_bytes()).to_hex();
    let place = below.with_extension("");
    let parts = place.components().filter_map(|part| match part {
        Component::Normal(name) => Some(name.to_string_lossy()),
        _ => None,
    });
    let parts: Vec<_> = parts.collect();
    let mut name = plain(Some(parts.join("-").as_ref()));
    if name.len() > LONGEST {
        let start = name
            .char_indices()
            .map(|(at, _)| at)
            .take_while(|&at| at <= LONGEST - 10);
        name.truncate(start.last().unwrap_or(0));
        name = format!("{name}-{}", &hash[..8]);
    }
    let with_extension = format!("{name}-{}", extension(file));
    let with_hash = format!("{with_extension}-{}", &hash[..6]);
    [name, with_extension, with_hash.clone(), with_hash]
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

    fn named(inputs: impl Iterator<Item = Input>) -> Vec<String> {
        let assets = name_assets(inputs.collect());
        assets.into_iter().map(|asset| asset.id).collect()
    }

    fn ids(paths: &[&str]) -> Vec<String> {
        named(paths.iter().map(|path| Input {
            path: Path::new("base").join(path),
            given: path.into(),
            below: None,
        }))
    }

    fn found(paths: &[&str]) -> Vec<String> {
        named(paths.iter().map(|path| Input {
            path: Path::new("scans").join(path),
            given: Path::new("scans").join(path),
            below: Some(path.into()),
        }))
    }

    #[test]
    fn what_is_found_is_named_by_its_place() {
        assert_eq!(
            found(&["a.obj", "left/a.obj", "left/deep/a b.v2.ply"]),
            ["a", "left-a", "left-deep-a-b.v2"]
        );
        // Only files of the same name have a say in each other's ids.
        let with = found(&["left/a.obj", "left/a.glb", "right/a.obj"]);
        assert_eq!(with, ["left-a-obj", "left-a-glb", "right-a"]);
        let met = found(&["left/a.obj", "left-a.obj", "b.obj"]);
        let other_order = found(&["b.obj", "left-a.obj", "left/a.obj"]);
        assert_eq!((&met[0], &met[1]), (&other_order[2], &other_order[1]));
        assert!(
            met[0].starts_with("left-a-obj-") && met[0] != met[1],
            "{met:?}"
        );
        let long = found(&[
            &format!("{}/a.obj", "é".repeat(300)),
            &format!("{}/b.obj", "é".repeat(300)),
        ]);
        assert!(long.iter().all(|id| id.len() <= LONGEST) && long[0] != long[1]);
    }

    #[test]
    fn thousands_of_files_are_named_at_once() {
        let paths: Vec<String> = (0..20_000)
            .map(|i| format!("{}/a{}.obj", i % 100, i / 100))
            .collect();
        let paths: Vec<&str> = paths.iter().map(String::as_str).collect();
        let all: HashSet<String> = found(&paths).into_iter().collect();
        assert_eq!(all.len(), 20_000);
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
    fn names_are_safe() {
        assert_eq!(ids(&["my mesh (1).obj"]), ["my-mesh--1-"]);
        assert_eq!(ids(&[".hidden.obj"]), ["hidden"]);
        assert_eq!(ids(&["..", "???.obj"]), ["mesh-mesh", "mesh-obj"]);
        assert_eq!(ids(&["manifest.jsonl.obj"]), ["manifest.jsonl-2"]);
        assert_eq!(ids(&["Logs.obj"]), ["Logs-2"]);
    }
}
