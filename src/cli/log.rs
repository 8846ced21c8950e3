//! Structured log lines on standard error.

use super::arguments::{Global, LogFormat};
use tracing::level_filters::LevelFilter;

/// Starts the log: as JSON everything that progress shows, as text only what `-v` asks for
/// (progress is drawn by [`super::progress`]).
pub fn start(global: &Global) {
    let level = match (global.quiet, global.verbose, global.log_format) {
        (true, ..) => LevelFilter::ERROR,
        (false, 0, LogFormat::Text) => LevelFilter::WARN,
        (false, 0, LogFormat::Json) => LevelFilter::INFO,
        (false, 1, _) => LevelFilter::DEBUG,
        (false, ..) => LevelFilter::TRACE,
    };
    let builder = tracing_subscriber::fmt()
        .with_writer(std::io::stderr)
        .with_max_level(level)
        .with_ansi(console::colors_enabled_stderr());
    // A second subscriber is refused; there is none in this program.
    let _ = match global.log_format {
        LogFormat::Json => builder.json().flatten_event(true).try_init(),
        LogFormat::Text => builder
            .without_time()
            .with_target(false)
            .compact()
            .try_init(),
    };
}
