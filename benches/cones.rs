//! The automatic choice of cones against one Newton flow on the same mesh with the cones chosen.
//!
//! `cargo bench --bench cones -- [--levels N] [--runs N] MESH…`: each mesh and its N midpoint subdivisions, the default and 16 cones.
//! Choice and flow in turn, one thread; each figure the least of the runs (three). CPU seconds are those of
//! all threads, and what the clock says stands beside them.

mod common;

use affine_atlas::flow::cones::{self, BoundaryParams, ConeParams};
use affine_atlas::flow::ricci;
use affine_atlas::geometry::ids::EdgeVec;
use affine_atlas::geometry::mesh::Mesh;
use common::{Arguments, Triangles, cpu_seconds};
use std::error::Error;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build_global()?;
    let arguments = Arguments::parse()?;
    println!(
        "| mesh | vertices | cones | choice: CPU, clock | flow: CPU, clock | ratio: CPU, clock |"
    );
    println!("| --- | --- | --- | --- | --- | --- |");
    for mesh in &arguments.meshes {
        let name = mesh.file_stem().unwrap_or_default().to_string_lossy();
        let mut triangles = Triangles::read(mesh)?;
        for level in 0..=arguments.levels {
            if level > 0 {
                triangles.subdivide();
            }
            let mesh = triangles.mesh()?;
            for count in [None, Some(16)] {
                let params = ConeParams {
                    count,
                    ..ConeParams::default()
                };
                measure(
                    &format!("{name} level {level}"),
                    &mesh,
                    &params,
                    arguments.runs,
                )?;
            }
        }
    }
    Ok(())
}

/// CPU seconds and seconds of the clock.
#[derive(Clone, Copy)]
struct Seconds {
    cpu: f64,
    clock: f64,
}

impl Seconds {
    const NONE: Self = Self {
        cpu: f64::INFINITY,
        clock: f64::INFINITY,
    };

    fn least(&mut self, other: Self) {
        self.cpu = self.cpu.min(other.cpu);
        self.clock = self.clock.min(other.clock);
    }
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, Seconds) {
    let (cpu, clock) = (cpu_seconds(), Instant::now());
    let result = work();
    let seconds = Seconds {
        clock: clock.elapsed().as_secs_f64(),
        cpu: cpu_seconds() - cpu,
    };
    (result, seconds)
}

fn measure(
    name: &str,
    mesh: &Mesh,
    params: &ConeParams,
    runs: usize,
) -> Result<(), Box<dyn Error>> {
    let edges = mesh.connectivity.edges();
    let length: EdgeVec<f64> = edges.map(|e| mesh.edge_length(e)).collect();
    let (mut choice, mut flow) = (Seconds::NONE, Seconds::NONE);
    let mut placed = 0;
    for _ in 0..runs {
        let (prescription, seconds) = timed(|| {
            cones::prescribe(
                mesh,
                &Default::default(),
                params,
                &BoundaryParams::default(),
                &Default::default(),
            )
        });
        choice.least(seconds);
        let prescription = prescription?;
        placed = prescription.cones.len();
        let (flat, seconds) = timed(|| {
            ricci::flow(
                &mesh.connectivity,
                &length,
                &prescription,
                &Default::default(),
                &(),
            )
        });
        flow.least(seconds);
        flat?;
    }
    println!(
        "| {name} | {} | {placed}{} | {:.2} s, {:.2} s | {:.2} s, {:.2} s | {:.2}, {:.2} |",
        mesh.connectivity.vertex_count(),
        (params.count).map_or(" by default".into(), |count| format!(" of {count}")),
        choice.cpu,
        choice.clock,
        flow.cpu,
        flow.clock,
        choice.cpu / flow.cpu,
        choice.clock / flow.clock
    );
    Ok(())
}
