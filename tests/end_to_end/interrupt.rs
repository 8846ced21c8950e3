//! Ctrl-C in the middle of a build, and of a fit.

use crate::OF_THE_RUN;
use crate::command::{build_into, program};
use crate::good::files;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};

/// Each triangle becomes four.
fn subdivide(positions: &mut Vec<[f64; 3]>, faces: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut middles = BTreeMap::new();
    let mut middle = |positions: &mut Vec<[f64; 3]>, a: u32, b: u32| {
        *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            let (p, q) = (positions[a as usize], positions[b as usize]);
            positions.push(std::array::from_fn(|i| 0.5 * (p[i] + q[i])));
            positions.len() as u32 - 1
        })
    };
    let mut finer = Vec::with_capacity(4 * faces.len());
    for &[a, b, c] in faces {
        let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| middle(positions, p, q));
        finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    finer
}

/// The mask, 16 times as fine: several seconds of work.
fn write_large(path: &Path) {
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/good/disk-mask.obj");
    let text = std::fs::read_to_string(fixture).expect("committed");
    let mut positions = Vec::new();
    let mut faces = Vec::new();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        let kind = words.next();
        let numbers: Vec<f64> = words.flat_map(str::parse).collect();
        match kind {
            Some("v") => positions.push([numbers[0], numbers[1], numbers[2]]),
            Some("f") => faces.push([0, 1, 2].map(|k| numbers[k] as u32 - 1)),
            _ => {}
        }
    }
    assert_eq!(faces.len(), 4357, "the mask is made of plain triangles");
    for _ in 0..2 {
        faces = subdivide(&mut positions, &faces);
    }
    let mut obj = String::new();
    for [x, y, z] in positions {
        writeln!(obj, "v {x} {y} {z}").expect("written");
    }
    for [a, b, c] in faces {
        writeln!(obj, "f {} {} {}", a + 1, b + 1, c + 1).expect("written");
    }
    std::fs::write(path, obj).expect("written");
}

/// Interrupts a build in this stage.
fn interrupt_at(stage: &str) {
    let out = tempfile::tempdir().expect("a temporary folder");
    let input = tempfile::tempdir().expect("a temporary folder");
    let mesh = input.path().join("mesh.obj");
    let small = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/bad/zero-area-face.obj");
    std::fs::copy(small, &mesh).expect("copied");
    assert!(build_into(out.path(), &mesh, &[]).status.success());
    let atlas = out.path().join("mesh");
    let before = files(&atlas);

    write_large(&mesh);
    let mut command = program();
    command.arg("build").arg(&mesh).arg("--out").arg(out.path());
    interrupt(command, &format!("mesh: {stage}"));
    assert!(files(&atlas) == before, "the older atlas was touched");
    let is_known = |name: &String| name == "mesh" || OF_THE_RUN.contains(&name.as_str());
    let left: Vec<String> = names(out.path()).filter(|name| !is_known(name)).collect();
    assert!(left.is_empty(), "{left:?} stayed behind");
}

/// Sends the signal when a line on standard error says that a stage begins.
fn interrupt(mut command: Command, entered: &str) {
    let mut child = command
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut lines = BufReader::new(child.stderr.take().expect("piped")).lines();
    let seen = lines
        .by_ref()
        .map_while(Result::ok)
        .any(|line| line.contains(entered));
    assert!(seen, "never came to {entered}");
    // The shell's own `kill`: a bare machine may have no other.
    let kill = format!("kill -INT {}", child.id());
    let sent = Command::new("sh").args(["-c", &kill]).status();
    assert!(sent.expect("a shell").success());
    let said: Vec<String> = lines.map_while(Result::ok).collect();
    let status = child.wait().expect("ends");
    assert_eq!(status.code(), Some(130), "{said:?}");
    assert!(
        said.iter().any(|line| line.contains("stopping")),
        "{said:?}"
    );
}

/// Of what lies in a folder.
fn names(folder: &Path) -> impl Iterator<Item = String> {
    let entries = std::fs::read_dir(folder).expect("a folder");
    entries.map(|e| e.expect("readable").file_name().display().to_string())
}

#[test]
fn while_a_surface_is_fitted() {
    let out = tempfile::tempdir().expect("a temporary folder");
    let mesh = out.path().join("mesh.obj");
    write_large(&mesh);
    let mut command = program();
    command.arg("fit").arg(&mesh).arg("--out");
    command.arg(out.path().join("surface"));
    interrupt(command, "mesh: flow");
    assert_eq!(names(out.path()).collect::<Vec<_>>(), ["mesh.obj"]);
}

#[test]
fn while_the_metric_is_computed() {
    interrupt_at("flow");
}

#[test]
fn while_images_are_sampled() {
    interrupt_at("images");
}

#[test]
fn while_the_folder_is_written() {
    interrupt_at("write");
}
