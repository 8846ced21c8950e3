//! Ctrl-C in the middle of a build.

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

/// Sends the signal when a line on standard error names the stage.
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
    let mut child = program()
        .arg("build")
        .arg(&mesh)
        .arg("--out")
        .arg(out.path())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut lines = BufReader::new(child.stderr.take().expect("piped")).lines();
    let entered = format!("mesh: {stage}");
    let seen = lines
        .by_ref()
        .map_while(Result::ok)
        .any(|line| line.contains(&entered));
    assert!(seen, "never came to {stage}");
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

    assert!(files(&atlas) == before, "the older atlas was touched");
    let left: Vec<String> = std::fs::read_dir(out.path())
        .expect("a folder")
        .map(|e| {
            e.expect("readable")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .filter(|name| name != "mesh" && !OF_THE_RUN.contains(&name.as_str()))
        .collect();
    assert!(left.is_empty(), "{left:?} stayed behind");
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
