//! What the benches share: arguments, midpoint subdivision, and CPU seconds and peak memory as the system counts them.

// Not every bench needs all of it.
#![allow(dead_code)]

use affine_atlas::geometry::mesh::{Mesh, Soup};
use affine_atlas::{read, repair};
use std::collections::HashMap;
use std::error::Error;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

/// `[--levels N] [--runs N] [--flat] MESH…`
pub struct Arguments {
    /// Midpoint subdivisions of each mesh beside the mesh itself.
    pub levels: usize,
    /// Runs of which the fastest counts.
    pub runs: usize,
    /// Flat patches with cones given, in place of the default.
    pub flat: bool,
    pub meshes: Vec<PathBuf>,
}

impl Arguments {
    pub fn parse() -> Result<Self, Box<dyn Error>> {
        let mut given = Self {
            levels: 0,
            runs: 3,
            flat: false,
            meshes: Vec::new(),
        };
        let mut arguments = std::env::args().skip(1);
        while let Some(argument) = arguments.next() {
            let mut number = || -> Result<usize, Box<dyn Error>> {
                let value = arguments.next().ok_or("a number is missing")?;
                Ok(value.parse()?)
            };
            match argument.as_str() {
                "--levels" => given.levels = number()?,
                "--runs" => given.runs = number()?.max(1),
                "--flat" => given.flat = true,
                // What cargo adds.
                "--bench" => {}
                other if other.starts_with('-') => return Err(format!("no option {other}").into()),
                _ => given.meshes.push(argument.into()),
            }
        }
        Ok(given)
    }
}

/// Triangles and the vertices they are of.
pub struct Triangles {
    pub faces: Vec<[u32; 3]>,
    pub positions: Vec<[f64; 3]>,
}

impl Triangles {
    /// The first component of a mesh, repaired.
    pub fn read(mesh: &Path) -> Result<Self, Box<dyn Error>> {
        let asset = read::read(mesh, &Default::default())?;
        let mut repaired = repair::repair(&asset.soup, &Default::default())?;
        let mesh = repaired.components.swap_remove(0).mesh?;
        Ok(Self {
            faces: mesh.connectivity.to_faces(),
            positions: mesh.positions.as_slice().to_vec(),
        })
    }

    /// The same as a mesh with names.
    pub fn mesh(&self) -> Result<Mesh, Box<dyn Error>> {
        let soup = Soup::from_triangles(self.positions.clone(), self.faces.clone());
        let mut repaired = repair::repair(&soup, &Default::default())?;
        Ok(repaired.components.swap_remove(0).mesh?)
    }

    /// Every face into four, new vertices at the middle of its edges and after the old ones; the surface stays.
    pub fn subdivide(&mut self) {
        let mut middle = HashMap::new();
        let mut fine = Vec::with_capacity(4 * self.faces.len());
        let positions = &mut self.positions;
        for &[a, b, c] in &self.faces {
            let mut between = |i: u32, j: u32| {
                *middle.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    let (p, q) = (positions[i as usize], positions[j as usize]);
                    positions.push(std::array::from_fn(|k| 0.5 * (p[k] + q[k])));
                    positions.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (between(a, b), between(b, c), between(c, a));
            fine.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        self.faces = fine;
    }

    /// Writes a binary PLY file.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        let mut file = std::io::BufWriter::new(fs::File::create(path)?);
        write!(
            file,
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
            self.positions.len(),
            self.faces.len()
        )?;
        for x in self.positions.iter().flatten() {
            file.write_all(&x.to_le_bytes())?;
        }
        for face in &self.faces {
            file.write_all(&[3])?;
            for v in face {
                file.write_all(&v.to_le_bytes())?;
            }
        }
        file.flush()
    }
}

/// CPU seconds of all threads of this process so far; of the clock where the system does not tell.
///
/// On a machine with other work the clock says more about that work.
pub fn cpu_seconds() -> f64 {
    let threads = fs::read_dir("/proc/self/task").into_iter().flatten();
    let nanoseconds = threads.flatten().filter_map(|thread| {
        let line = fs::read_to_string(thread.path().join("schedstat")).ok()?;
        line.split_whitespace().next()?.parse::<u64>().ok()
    });
    match nanoseconds.sum::<u64>() {
        0 => {
            let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH);
            now.map_or(0.0, |d| d.as_secs_f64())
        }
        sum => sum as f64 * 1e-9,
    }
}

/// Most MiB that this process had in memory since [`forget_peak`]; 0 where the system does not tell.
pub fn peak_mebibytes() -> f64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kibibytes = line.and_then(|l| l.trim().trim_end_matches("kB").trim().parse::<f64>().ok());
    kibibytes.unwrap_or(0.0) / 1024.0
}

/// Begins a new measurement of the peak, where the system can.
pub fn forget_peak() {
    let _ = fs::write("/proc/self/clear_refs", "5");
}
