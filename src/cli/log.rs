//! Structured log lines: on standard error, and of each mesh in a file.

use super::arguments::{Global, LogFormat};
use super::profile::Tell;
use affine_atlas::batch::worker::Voice;
use affine_atlas::observe::PARTS;
use std::fs::File;
use std::path::Path;
use std::sync::Arc;
use tracing::level_filters::LevelFilter;
use tracing_subscriber::Layer;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// Stages and steps that a worker tells its parent by events; they go into the mesh's own log only.
const STAGES: &str = "affine_atlas::stages";

/// What `-q`, `-v` and the format let through.
fn level(quiet: bool, verbose: u8, json: bool) -> LevelFilter {
    match (quiet, verbose, json) {
        (true, ..) => LevelFilter::ERROR,
        (false, 0, false) => LevelFilter::WARN,
        (false, 0, true) => LevelFilter::INFO,
        (false, 1, _) => LevelFilter::DEBUG,
        (false, ..) => LevelFilter::TRACE,
    }
}

/// Starts the log: as JSON everything that progress shows, as text only what `-v` asks for
/// (progress is drawn by [`super::progress`]).
pub fn start(global: &Global) {
    let json = global.log_format == LogFormat::Json;
    let level = level(global.quiet, global.verbose, json);
    // A second subscriber is refused; there is none in this program.
    let _ = tracing_subscriber::registry()
        .with(on_standard_error(json).with_filter(lines(level)))
        .try_init();
}

/// The same for a worker, with everything from INFO on (`-v`: all there is) as JSON lines in a file of its own, which replaces that of
/// an earlier run. Gives why there is no file.
pub fn start_worker(voice: &Voice, path: &Path) -> Result<(), std::io::Error> {
    let level = level(voice.quiet, voice.verbose, voice.json);
    let terminal = lines(level).with_target(STAGES, LevelFilter::OFF);
    let (file, trouble) = match File::create(path) {
        Ok(file) => (Some(Arc::new(file)), Ok(())),
        Err(error) => (None, Err(error)),
    };
    let detail = match voice.verbose {
        0 => LevelFilter::INFO,
        _ => LevelFilter::DEBUG,
    };
    let own = file.map(|file| {
        let lines = tracing_subscriber::fmt::layer().json().flatten_event(true);
        let targets = Targets::new().with_target("affine_atlas", detail);
        let targets = targets.with_target(PARTS, LevelFilter::OFF);
        lines.with_writer(file).with_filter(targets)
    });
    let parts = voice.parts.then(|| {
        let targets = Targets::new().with_target(PARTS, LevelFilter::TRACE);
        Tell.with_filter(targets)
    });
    let _ = tracing_subscriber::registry()
        .with(on_standard_error(voice.json).with_filter(terminal))
        .with(own)
        .with(parts)
        .try_init();
    trouble
}

/// What is said in lines: parts are not.
fn lines(level: LevelFilter) -> Targets {
    let all = Targets::new().with_default(level);
    all.with_target(PARTS, LevelFilter::OFF)
}

fn on_standard_error<S>(json: bool) -> Box<dyn Layer<S> + Send + Sync>
where
    S: tracing::Subscriber + for<'a> tracing_subscriber::registry::LookupSpan<'a>,
{
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_ansi(console::colors_enabled_stderr());
    match json {
        true => Box::new(lines.json().flatten_event(true)),
        false => Box::new(lines.without_time().with_target(false).compact()),
    }
}
