//! Models that have no defects, and the independent checker of what is made of them.

// Not every test binary uses all of it.
#![allow(dead_code)]

#[path = "../arrays/mod.rs"]
pub mod arrays;
pub mod grids;
pub mod lines;
pub mod plates;
pub mod watertight;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// File, genus, boundary loops.
pub const CLEAN: [(&str, usize, usize); 18] = [
    ("spot.obj", 0, 0),
    ("bunny-closed.off", 0, 0),
    ("nefertiti.obj", 0, 0),
    ("fandisk.off", 0, 0),
    ("bumpy-cube.obj", 0, 0),
    ("rocker-arm.obj", 1, 0),
    ("kitten.obj", 1, 0),
    ("brezel.obj", 2, 0),
    ("three-holes.off", 3, 0),
    ("elephant-genus3.obj", 3, 0),
    ("fertility.off", 4, 0),
    ("face.obj", 0, 1),
    ("camelhead.off", 0, 1),
    ("lilium.obj", 0, 1),
    ("lego.ply", 0, 1),
    ("punctured-torus.obj", 1, 1),
    ("stanford-bunny.obj", 0, 5),
    ("beetle.obj", 0, 11),
];

/// Those with more than 10,000 faces, which have nine tenths of all. Cases in which the size of a model asks nothing new leave them to
/// `--ignored` (`docs/testing.md`); the default build of each is among the others.
pub const LARGE: [&str; 10] = [
    "rocker-arm.obj",
    "camelhead.off",
    "fandisk.off",
    "nefertiti.obj",
    "bumpy-cube.obj",
    "kitten.obj",
    "elephant-genus3.obj",
    "face.obj",
    "stanford-bunny.obj",
    "beetle.obj",
];

/// Folders below one, and it itself, that hold an `atlas.json`; by name.
pub fn atlases(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(folder) = open.pop() {
        if folder.join("atlas.json").is_file() {
            found.push(folder.clone());
        }
        let entries = std::fs::read_dir(&folder).into_iter().flatten().flatten();
        open.extend(entries.map(|e| e.path()).filter(|p| p.is_dir()));
    }
    found.sort();
    found
}

/// The model, where the checker can compare an atlas with it: it reads OBJ and OFF only.
pub fn comparable(model: &Path) -> Option<&Path> {
    let extension = model.extension()?;
    (extension == "obj" || extension == "off").then_some(model)
}

/// Asks the independent checker about an output folder, where there is one.
pub fn checked(atlas: &Path, source: Option<&Path>, cones: Option<usize>) -> Result<(), String> {
    let Some(checker) = std::env::var_os("AFFINE_ATLAS_CHECKER") else {
        return Ok(());
    };
    let python = std::env::var_os("AFFINE_ATLAS_PYTHON").unwrap_or_else(|| "python3".into());
    let mut command = Command::new(python);
    command.arg(checker).arg(atlas);
    if let Some(source) = source {
        command.arg("--source").arg(source);
    }
    if let Some(cones) = cones {
        command.arg("--cones").arg(cones.to_string());
    }
    succeed("checker", &mut command)
}

/// Asks another checker, a file beside the independent one.
pub fn checked_by(name: &str, atlas: &Path, source: Option<&Path>) -> Result<(), String> {
    let Some(checker) = std::env::var_os("AFFINE_ATLAS_CHECKER") else {
        return Ok(());
    };
    let python = std::env::var_os("AFFINE_ATLAS_PYTHON").unwrap_or_else(|| "python3".into());
    let mut command = Command::new(python);
    command
        .arg(Path::new(&checker).with_file_name(name))
        .arg(atlas);
    if let Some(source) = source {
        command.arg("--source").arg(source);
    }
    succeed(name, &mut command)
}

/// Runs a program that lists what is wrong in lines that begin with FAIL.
pub fn succeed(who: &str, command: &mut Command) -> Result<(), String> {
    let Output {
        status,
        stdout,
        stderr,
    } = command.output().map_err(|e| e.to_string())?;
    if status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&stdout);
    let failed: Vec<&str> = said.lines().filter(|l| l.starts_with("FAIL")).collect();
    let stderr = String::from_utf8_lossy(&stderr);
    Err(format!("{who}: {}\n{stderr}", failed.join("\n")))
}
