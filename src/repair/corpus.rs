//! Real models for tests, read where the environment variable `AFFINE_ATLAS_CORPUS` names their folder.

use crate::geometry::ids::NONE;
use crate::geometry::mesh::Soup;
use std::path::PathBuf;

/// The folder, or a line that says what is skipped.
pub(crate) fn folder(test: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("AFFINE_ATLAS_CORPUS").map(PathBuf::from);
    if folder.is_none() {
        println!("skipped {test}: AFFINE_ATLAS_CORPUS is not set");
    }
    folder
}

/// A soup without attributes.
pub(crate) fn soup(positions: Vec<[f64; 3]>, faces: Vec<[u32; 3]>) -> Soup {
    Soup {
        face_material: vec![NONE; faces.len()],
        positions,
        faces,
        ..Soup::default()
    }
}

/// Positions and faces of an OBJ or OFF file; enough for the models at hand.
pub(crate) fn load(path: &std::path::Path) -> Soup {
    let text = std::fs::read_to_string(path).unwrap();
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    let mut fan = |corners: &[u32]| {
        for k in 1..corners.len() - 1 {
            faces.push([corners[0], corners[k], corners[k + 1]]);
        }
    };
    if path.extension().is_some_and(|e| e == "obj") {
        for line in text.lines() {
            let words: Vec<&str> = line.split_whitespace().collect();
            match words.first() {
                Some(&"v") => {
                    positions.push(std::array::from_fn(|i| words[i + 1].parse().unwrap()));
                }
                Some(&"f") => {
                    let corner = |w: &&str| {
                        let i: i64 = w.split('/').next().unwrap().parse().unwrap();
                        let v = if i > 0 {
                            i - 1
                        } else {
                            positions.len() as i64 + i
                        };
                        v as u32
                    };
                    fan(&words[1..].iter().map(corner).collect::<Vec<_>>());
                }
                _ => {}
            }
        }
    } else {
        let mut words = text.split_whitespace().skip(1);
        let mut number = || words.next().unwrap().parse::<f64>().unwrap();
        let counts = [(); 3].map(|()| number() as usize);
        for _ in 0..counts[0] {
            positions.push([(); 3].map(|()| number()));
        }
        for _ in 0..counts[1] {
            let corners = number() as usize;
            fan(&(0..corners).map(|_| number() as u32).collect::<Vec<_>>());
        }
    }
    soup(positions, faces)
}
