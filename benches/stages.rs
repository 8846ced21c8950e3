//! CPU seconds, share and peak memory of every stage of the job on the fixtures, or on the meshes named as arguments.
//!
//! `cargo bench --bench stages -- [--levels N] [--runs N] [--flat] [MESH…]`: each mesh and its N midpoint subdivisions with flips, one
//! thread; the fastest run (of three) is shown, and in it the parts that stages tell of, each without those inside it. After each mesh: a table of its levels and how the time grows
//! between them. With `--flat` images are of flat patches, and cones are eight far apart instead of being searched for.

mod common;

use affine_atlas::atlas::patch::Domain;
use affine_atlas::config::Config;
use affine_atlas::flow::cones::ConeStrategy;
use affine_atlas::flow::ricci::Scheme;
use affine_atlas::observe::{Observer, PARTS};
use affine_atlas::{job, outcome::AssetState};
use common::{Arguments, Triangles, cpu_seconds, forget_peak, peak_mebibytes};
use std::error::Error;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use tracing::Subscriber;
use tracing::level_filters::LevelFilter;
use tracing::span::{Attributes, Id};
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::{Context, Layer, SubscriberExt};
use tracing_subscriber::registry::LookupSpan;
use tracing_subscriber::util::SubscriberInitExt;

/// What a stage took.
#[derive(Clone, Copy)]
struct Stage {
    name: &'static str,
    seconds: f64,
    /// MiB.
    peak: f64,
}

/// Notes CPU seconds when each stage begins, and the peak of the one before.
#[derive(Default)]
struct Stopwatch {
    begun: Mutex<Vec<(&'static str, f64, f64)>>,
}

impl Observer for Stopwatch {
    fn stage(&self, name: &'static str, _component: usize, _components: usize) {
        let mut begun = self.begun.lock().unwrap_or_else(PoisonError::into_inner);
        begun.push((name, cpu_seconds(), peak_mebibytes()));
        forget_peak();
    }
}

/// Adds up the CPU seconds of parts of stages, in the thread of the job.
#[derive(Clone, Default)]
struct Parts(Arc<Mutex<PartsSoFar>>);

#[derive(Default)]
struct PartsSoFar {
    /// Begun and not over: when, and how long those inside took.
    open: Vec<(f64, f64)>,
    seconds: Vec<(&'static str, f64)>,
}

impl<S: Subscriber + for<'a> LookupSpan<'a>> Layer<S> for Parts {
    fn on_new_span(&self, _: &Attributes<'_>, _: &Id, _: Context<'_, S>) {
        let mut parts = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        parts.open.push((cpu_seconds(), 0.0));
    }

    fn on_close(&self, id: Id, context: Context<'_, S>) {
        let mut parts = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let (Some((begin, inside)), Some(span)) = (parts.open.pop(), context.span(&id)) else {
            return;
        };
        let whole = cpu_seconds() - begin;
        if let Some((_, around)) = parts.open.last_mut() {
            *around += whole;
        }
        let (name, own) = (span.name(), whole - inside);
        match parts.seconds.iter_mut().find(|(known, _)| *known == name) {
            Some((_, sum)) => *sum += own,
            None => parts.seconds.push((name, own)),
        }
    }
}

/// One mesh of a table.
struct Level {
    vertices: usize,
    faces: usize,
    stages: Vec<Stage>,
    parts: Vec<(&'static str, f64)>,
}

impl Level {
    fn seconds(&self, names: &[&str]) -> f64 {
        let of = |s: &&Stage| names.is_empty() || names.contains(&s.name);
        self.stages.iter().filter(of).map(|s| s.seconds).sum()
    }

    fn peak(&self, name: &str) -> f64 {
        let of = |s: &&Stage| name.is_empty() || s.name == name;
        self.stages
            .iter()
            .filter(of)
            .fold(0.0, |m, s| m.max(s.peak))
    }
}

/// What issue and documentation call overlay, cut and layout.
const AFTER_FLOW: [&str; 3] = ["overlay", "cut", "charts"];

fn main() -> Result<(), Box<dyn Error>> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build_global()?;
    let parts = Parts::default();
    let own = Targets::new().with_target(PARTS, LevelFilter::TRACE);
    tracing_subscriber::registry()
        .with(parts.clone().with_filter(own))
        .try_init()?;
    let mut arguments = Arguments::parse()?;
    if arguments.meshes.is_empty() {
        let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/good");
        arguments.meshes = ["disk-mask.obj", "genus-3-pretzel.obj"]
            .map(|name| fixtures.join(name))
            .into();
    }
    for mesh in &arguments.meshes {
        let folder = tempfile::tempdir()?;
        let mut triangles = Triangles::read(mesh)?;
        let mut levels = Vec::new();
        for number in 0..=arguments.levels {
            let fine = folder.path().join("mesh.ply");
            let path = if number == 0 {
                mesh
            } else {
                triangles.subdivide();
                triangles.write(&fine)?;
                &fine
            };
            let (vertices, faces) = (triangles.positions.len(), triangles.faces.len());
            if number == arguments.levels {
                // The job is to have the memory for itself.
                triangles = Triangles {
                    faces: Vec::new(),
                    positions: Vec::new(),
                };
            }
            let mut best: Option<Level> = None;
            for _ in 0..arguments.runs {
                *parts.0.lock().unwrap_or_else(PoisonError::into_inner) = PartsSoFar::default();
                let stages = measure(path, arguments.flat)?;
                let of_run = parts.0.lock().unwrap_or_else(PoisonError::into_inner);
                let level = Level {
                    vertices,
                    faces,
                    stages,
                    parts: of_run.seconds.clone(),
                };
                if best
                    .as_ref()
                    .is_none_or(|b| level.seconds(&[]) < b.seconds(&[]))
                {
                    best = Some(level);
                }
            }
            let Some(best) = best else { continue };
            print_stages(&format!("{} level {number}", mesh.display()), &best);
            levels.push(best);
        }
        if levels.len() > 1 {
            print_table(&mesh.display().to_string(), &levels);
        }
    }
    Ok(())
}

fn print_stages(name: &str, level: &Level) {
    let whole = level.seconds(&[]);
    println!(
        "{name}: {} vertices, {whole:.3} CPU s, peak {:.0} MiB, overlay + cut + charts {:.2} × flow",
        level.vertices,
        level.peak(""),
        level.seconds(&AFTER_FLOW) / level.seconds(&["flow"])
    );
    for stage in &level.stages {
        println!(
            "  {:<14}{:9.3} s {:5.1} % {:7.0} MiB",
            stage.name,
            stage.seconds,
            100.0 * stage.seconds / whole,
            stage.peak
        );
    }
    let parts = level.parts.iter();
    let parts = parts.map(|(name, seconds)| format!("{name} {seconds:.3} s"));
    println!("  parts: {}", parts.collect::<Vec<_>>().join(", "));
    println!(
        "  verification: {:.2} microseconds a face",
        1e6 * level.seconds(&["verify"]) / level.faces as f64
    );
}

/// A column a level, and below how each row grows: the exponent of the vertex count from the level before.
fn print_table(name: &str, levels: &[Level]) {
    let row = |title: &str, cells: Vec<String>| println!("| {title} | {} |", cells.join(" | "));
    let each = |f: &dyn Fn(&Level) -> String| levels.iter().map(f).collect::<Vec<_>>();
    println!();
    row(name, each(&|l| format!("{} vertices", l.vertices)));
    row("---", each(&|_| "---".into()));
    for stage in &levels[0].stages {
        row(
            stage.name,
            each(&|l| {
                let seconds = l.seconds(&[stage.name]);
                format!("{seconds:.2} s, {:.0} %", 100.0 * seconds / l.seconds(&[]))
            }),
        );
    }
    row("whole job", each(&|l| format!("{:.2} s", l.seconds(&[]))));
    for (title, stage) in [("flow", "flow"), ("overlay", "overlay"), ("whole job", "")] {
        row(
            &format!("peak of {title}"),
            each(&|l| format!("{:.0} MiB", l.peak(stage))),
        );
    }
    row(
        "verify, microseconds a face",
        each(&|l| format!("{:.2}", 1e6 * l.seconds(&["verify"]) / l.faces as f64)),
    );
    let ratio = |l: &Level| l.seconds(&AFTER_FLOW) / l.seconds(&["flow"]);
    row(
        "(overlay + cut + charts) / flow",
        each(&|l| format!("{:.2}", ratio(l))),
    );
    let growth: [(&str, &[&str]); 5] = [
        ("whole job", &[]),
        ("flow", &["flow"]),
        ("grid", &["grid"]),
        ("overlay + cut + charts", &AFTER_FLOW),
        (
            "patches to write",
            &["patches", "images", "report", "write"],
        ),
    ];
    for (title, names) in growth {
        let mut cells = vec!["".to_owned()];
        cells.extend(levels.windows(2).map(|pair| {
            let times = pair[1].seconds(names) / pair[0].seconds(names);
            let sizes = pair[1].vertices as f64 / pair[0].vertices as f64;
            format!("{:.2}", times.ln() / sizes.ln())
        }));
        row(&format!("growth exponent of {title}"), cells);
    }
    println!();
}

/// Builds once into a temporary folder; stages in order, those that come again added up.
fn measure(mesh: &Path, flat: bool) -> Result<Vec<Stage>, Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let mut config = Config::default();
    config.flow.scheme = Scheme::VertexScaling;
    if flat {
        config.images.domain = Some(Domain::Flat);
        config.cones.strategy = ConeStrategy::Spread;
    }
    let config = config.resolved()?;
    let watch = Stopwatch::default();
    let given = mesh.to_string_lossy();
    let outcome = job::run(mesh, &given, folder.path(), "mesh", &config, &watch);
    watch.stage("end", 0, 1);
    if let AssetState::Failed(failure) = outcome.state {
        return Err(failure.message.into());
    }
    let begun = watch
        .begun
        .into_inner()
        .unwrap_or_else(PoisonError::into_inner);
    let mut stages: Vec<Stage> = Vec::new();
    for pair in begun.windows(2) {
        let [(name, start, _), (_, end, peak)] = [pair[0], pair[1]];
        match stages.iter_mut().find(|s| s.name == name) {
            Some(stage) => {
                stage.seconds += end - start;
                stage.peak = stage.peak.max(peak);
            }
            None => stages.push(Stage {
                name,
                seconds: end - start,
                peak,
            }),
        }
    }
    Ok(stages)
}
