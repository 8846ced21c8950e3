//! Seeds and findings of the fuzzers, once each through the same functions as there: `fuzz/README.md`.

#[path = "../fuzz/src/targets.rs"]
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

/// The whole folder that the fuzzers start from is accepted: edits of it reach every check.
#[test]
fn the_folder_of_the_fuzzers_is_whole() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/folder");
    let verdicts = affine_atlas::verify::verify(&folder, &Default::default()).expect("a folder");
    assert!(verdicts.all_passed(), "{verdicts}");
}
