//! Seeds and findings of the fuzzers, once each through the same functions as there: `fuzz/README.md`.

#[path = "../../fuzz/src/targets.rs"]
mod targets;

use std::fs;
use std::path::{Path, PathBuf};

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten();
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.expect("an entry").path())
        .collect();
    files.sort();
    files
}

#[test]
fn seeds_and_findings_are_read_or_refused() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz");
    for (name, run) in targets::TARGETS {
        let seeds = files(&root.join("corpus").join(name));
        assert!(!seeds.is_empty(), "no seeds of {name}");
        for path in seeds
            .iter()
            .chain(&files(&root.join("findings").join(name)))
        {
            println!("{}", path.display());
            run(&fs::read(path).expect("a file"));
        }
    }
    for kind in ["corpus", "findings"] {
        for folder in files(&root.join(kind)) {
            let name = folder.file_name().and_then(|name| name.to_str());
            let known = targets::TARGETS
                .iter()
                .any(|(known, _)| Some(*known) == name);
            assert!(known, "{} is of no target", folder.display());
        }
    }
}

/// libFuzzer cuts what is longer than it is told to try (`fuzz/README.md`), and cut seeds lead nowhere.
#[test]
fn seeds_are_tried_whole() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz");
    let readme = fs::read_to_string(root.join("README.md")).expect("a file");
    let longest = readme.split("-max_len=").nth(1).expect("a command");
    let digits = longest.split_whitespace().next().expect("a number");
    let longest: u64 = digits.parse().expect("a number");
    for path in files(&root.join("corpus")).iter().flat_map(|f| files(f)) {
        let length = fs::metadata(&path).expect("a file").len();
        assert!(length <= longest, "{} has {length}", path.display());
    }
}

/// All of the small folder can be read, and with each of the seeds that take the place of one of its files: edits of them reach every line.
#[test]
fn the_small_folder_and_its_seeds_can_be_read() {
    use affine_atlas::read::{atlas, gridded, metric, read};
    let fuzz = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz");
    let copy = tempfile::tempdir().expect("a folder");
    fs::create_dir(copy.path().join("images")).expect("a folder");
    let names = ["atlas.json", "atlas.npz", "images/0000.exr", "square.bin"];
    let reset = || {
        for name in names {
            fs::copy(fuzz.join("small").join(name), copy.path().join(name)).expect("copied");
        }
    };
    let mut seeds = Vec::new();
    for (target, name) in [
        ("atlas_json", names[0]),
        ("npz", names[1]),
        ("exr", names[2]),
    ] {
        let of_target = files(&fuzz.join("corpus").join(target));
        seeds.extend(of_target.into_iter().map(|seed| (seed, name)));
    }
    for (seed, name) in seeds {
        reset();
        fs::copy(&seed, copy.path().join(name)).expect("copied");
        let shown = seed.display();
        let images = atlas::read_images(copy.path()).unwrap_or_else(|e| panic!("{shown}: {e}"));
        assert_eq!(images.images[0].position.len(), 64, "{shown}");
        metric::read_metric(copy.path()).unwrap_or_else(|e| panic!("{shown}: {e}"));
        gridded::read_gridded(copy.path()).unwrap_or_else(|e| panic!("{shown}: {e}"));
    }
    let path = copy.path().join("a.gltf");
    fs::copy(fuzz.join("corpus/gltf/files.gltf"), &path).expect("copied");
    let asset = read(&path, &Default::default()).expect("a mesh");
    assert_eq!((asset.files.len(), asset.soup.faces.len()), (3, 2));
}

/// The whole folder that the fuzzers start from is accepted: edits of it reach every check.
#[test]
fn the_folder_of_the_fuzzers_is_whole() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/folder");
    let verdicts = affine_atlas::verify::verify(&folder, &Default::default()).expect("a folder");
    assert!(verdicts.all_passed(), "{verdicts}");
}
