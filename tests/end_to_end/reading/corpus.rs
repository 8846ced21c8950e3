//! Reads every model of a folder of test models, where the variable `AFFINE_ATLAS_CORPUS` names one.

use affine_atlas::read::{EXTENSIONS, ReadParams, read};
use std::fs;
use std::path::{Path, PathBuf};

fn models(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            models(&path, found);
        } else if path
            .extension()
            .is_some_and(|e| EXTENSIONS.contains(&&*e.to_string_lossy()))
        {
            found.push(path);
        }
    }
    found.sort();
}

#[test]
#[cfg_attr(not(corpus), ignore = "needs AFFINE_ATLAS_CORPUS")]
fn every_model_of_the_corpus_is_read_whole() {
    let Some(corpus) = std::env::var_os("AFFINE_ATLAS_CORPUS") else {
        println!("skipped: AFFINE_ATLAS_CORPUS is not set");
        return;
    };
    let corpus = PathBuf::from(corpus);
    let mut paths = Vec::new();
    models(&corpus, &mut paths);
    assert!(paths.len() >= 18);
    let table = fs::read_to_string(corpus.join("README.md")).unwrap();
    let mut checked = 0;
    for path in paths {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let start = std::time::Instant::now();
        let asset = match read(&path, &ReadParams::default()) {
            // Hostile files, of which some may be refused, in words.
            Err(error) if path.parent() == Some(&corpus.join("hard")) => {
                println!("{name}: {error}");
                assert!(error.to_string().contains(&name), "{error}");
                continue;
            }
            read => read.unwrap(),
        };
        let (v, f) = (asset.soup.positions.len(), asset.soup.faces.len());
        println!(
            "{name}: {v} vertices, {f} faces, {} parts, {:?}, {:?}",
            asset.soup.parts.len(),
            start.elapsed(),
            asset.notes
        );
        assert!(asset.soup.faces.iter().flatten().all(|&i| (i as usize) < v));
        // | file | V | F | …
        for line in table.lines() {
            let cells: Vec<_> = line.split('|').map(str::trim).collect();
            if cells.len() > 4 && cells[1] == name && path.parent() == Some(&corpus) {
                assert_eq!(cells[2].parse(), Ok(v), "{name}");
                assert_eq!(cells[3].parse(), Ok(f), "{name}");
                checked += 1;
            }
        }
    }
    assert_eq!(checked, 18);
}
