//! Seconds and share of every stage of the job on the fixtures, or on the meshes named as arguments.
//!
//! `cargo bench --bench stages [-- MESH…]`. One thread, each mesh built three times, the fastest run shown.

use affine_atlas::config::Config;
use affine_atlas::observe::Observer;
use affine_atlas::{job, outcome::AssetState};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Notes when each stage begins.
#[derive(Default)]
struct Stopwatch {
    begun: Mutex<Vec<(&'static str, Instant)>>,
}

impl Observer for Stopwatch {
    fn stage(&self, name: &'static str, _component: usize, _components: usize) {
        let mut begun = self.begun.lock().unwrap_or_else(PoisonError::into_inner);
        begun.push((name, Instant::now()));
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build_global()?;
    let named: Vec<PathBuf> = std::env::args()
        .skip(1)
        .filter(|a| !a.starts_with('-'))
        .map(PathBuf::from)
        .collect();
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/good");
    let meshes = if named.is_empty() {
        vec![
            fixtures.join("disk-mask.obj"),
            fixtures.join("genus-3-pretzel.obj"),
        ]
    } else {
        named
    };
    for mesh in meshes {
        let runs = (0..std::env::var("RUNS")
            .ok()
            .and_then(|r| r.parse().ok())
            .unwrap_or(3))
            .map(|_| measure(&mesh));
        let runs = runs.collect::<Result<Vec<_>, _>>()?;
        let total = |run: &Vec<(&str, f64)>| run.iter().map(|s| s.1).sum::<f64>();
        let Some(best) = runs
            .into_iter()
            .min_by(|a, b| total(a).total_cmp(&total(b)))
        else {
            continue;
        };
        let sum = total(&best);
        println!("{}: {sum:.3} s", mesh.display());
        for (stage, seconds) in best {
            println!(
                "  {stage:<14}{seconds:8.3} s {:5.1} %",
                100.0 * seconds / sum
            );
        }
    }
    Ok(())
}

/// Builds once into a temporary folder; stages in order with their seconds.
fn measure(mesh: &Path) -> Result<Vec<(&'static str, f64)>, Box<dyn std::error::Error>> {
    let folder = tempfile::tempdir()?;
    let mut config = Config::default();
    config.flow.scheme = affine_atlas::flow::ricci::Scheme::VertexScaling;
    let watch = Stopwatch::default();
    let given = mesh.to_string_lossy();
    let outcome = job::run(mesh, &given, folder.path(), "mesh", &config, &watch);
    let end = Instant::now();
    if let AssetState::Failed(failure) = outcome.state {
        return Err(failure.message.into());
    }
    let begun = watch
        .begun
        .into_inner()
        .unwrap_or_else(PoisonError::into_inner);
    let ends = begun.iter().skip(1).map(|b| b.1).chain([end]);
    Ok(begun
        .iter()
        .zip(ends)
        .map(|(&(stage, start), end)| (stage, (end - start).as_secs_f64()))
        .collect())
}
