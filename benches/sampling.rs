//! Texels a second that the sampler makes of a surface, on one thread: those inside patches, and all of them.
//!
//! `cargo bench --bench sampling -- [--runs N] MESH…`: budgets of 1024² and 2048² texels in both domains; the fastest run (of three) is shown. What is
//! measured is [`sample`] with positions, normals, faces and log scales, and what it does outside patches; no file is written.

mod common;

use affine_atlas::atlas::geometry_image::sample;
use affine_atlas::atlas::patches::Domain;
use affine_atlas::config::Config;
use affine_atlas::{job, read};
use common::{Arguments, cpu_seconds};
use std::error::Error;

const SIDES: [usize; 2] = [1024, 2048];

fn main() -> Result<(), Box<dyn Error>> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build_global()?;
    let arguments = Arguments::parse()?;
    println!(
        "| model | domain | faces | texels | inside | seconds | inside, millions a second | all, millions a second |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    for path in &arguments.meshes {
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let asset = read::read(path, &Default::default())?;
        for domain in [Domain::Flat, Domain::Grid] {
            for side in SIDES {
                let mut config = Config::default();
                config.images.domain = Some(domain);
                match domain {
                    Domain::Flat => config.patches.texel_budget = side * side,
                    Domain::Grid => {
                        config.grid.cells = side * side / config.grid.samples_per_cell.pow(2)
                    }
                }
                let atlas = job::build(&asset.soup, &config, &())?.swap_remove(0)?;
                let texels: usize = atlas.images.iter().map(|i| i.width * i.height).sum();
                let alpha = atlas.images.iter().flat_map(|i| &i.alpha);
                let inside = alpha.filter(|&&a| a > 0.0).count();
                let (mesh, scale) = (&atlas.mesh, &atlas.metric.log_scale);
                let mut seconds = f64::INFINITY;
                for _ in 0..arguments.runs {
                    let start = cpu_seconds();
                    let images = sample(mesh, &atlas.patches, scale, atlas.image_origin);
                    seconds = seconds.min(cpu_seconds() - start);
                    assert_eq!(images.len(), atlas.images.len());
                }
                let a_second = |count: usize| count as f64 / seconds * 1e-6;
                println!(
                    "| {name} | {domain:?} | {} | {texels} | {inside} | {seconds:.3} | {:.1} | {:.1} |",
                    mesh.connectivity.face_count(),
                    a_second(inside),
                    a_second(texels)
                );
            }
        }
    }
    Ok(())
}
