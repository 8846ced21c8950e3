//! `--profile`: where the time goes, as a trace that Perfetto and chrome://tracing open.
//!
//! Workers tell of each stage, and of its parts, when they are over ([`Event::Part`]); the build collects that of all meshes and writes it at the end. A process of the trace is a
//! mesh, its threads are those of its worker.

use super::check::write_whole;
use super::problem::Problem;
use super::progress::Progress;
use affine_atlas::batch::worker::{self, Event, Part};
use affine_atlas::batch::{Task, Watcher};
use affine_atlas::outcome::AssetOutcome;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::{Mutex, PoisonError};
use std::time::SystemTime;
use tracing::Subscriber;
use tracing::span::{Attributes, Id};
use tracing_subscriber::layer::Context;
use tracing_subscriber::registry::LookupSpan;

/// Tells the parent of every part that is over.
pub struct Tell;

struct Begun(SystemTime);

impl<S: Subscriber + for<'a> LookupSpan<'a>> tracing_subscriber::Layer<S> for Tell {
    fn on_new_span(&self, _: &Attributes<'_>, id: &Id, context: Context<'_, S>) {
        if let Some(span) = context.span(id) {
            span.extensions_mut().insert(Begun(SystemTime::now()));
        }
    }

    fn on_close(&self, id: Id, context: Context<'_, S>) {
        let Some(span) = context.span(&id) else {
            return;
        };
        if let Some(Begun(begin)) = span.extensions().get() {
            worker::send(&Event::Part(Part::since(span.name(), None, *begin)));
        }
    }
}

/// Passes on what a batch tells, and keeps what it tells of parts.
pub struct Profile<'a> {
    progress: &'a Progress,
    parts: Mutex<Vec<(usize, Part)>>,
}

impl<'a> Profile<'a> {
    /// Beside what is shown.
    pub fn new(progress: &'a Progress) -> Self {
        Self {
            progress,
            parts: Mutex::default(),
        }
    }

    /// Writes the trace.
    pub fn write(self, path: &Path, tasks: &[Task]) -> Result<(), Problem> {
        let parts = self.parts.into_inner();
        let parts = parts.unwrap_or_else(PoisonError::into_inner);
        write_whole(path, trace(&parts, tasks).to_string().as_bytes())
    }
}

/// The trace event format: times in microseconds.
fn trace(parts: &[(usize, Part)], tasks: &[Task]) -> Value {
    let first = parts.iter().map(|(_, part)| part.begin).min().unwrap_or(0);
    let name = |(i, task): (usize, &Task)| json!({"ph": "M", "name": "process_name", "pid": i + 1, "args": {"name": task.id}});
    let mut events: Vec<Value> = tasks.iter().enumerate().map(name).collect();
    events.extend(parts.iter().map(|(task, part)| {
        let mut event = json!({
            "ph": "X",
            "name": part.name,
            "pid": task + 1,
            "tid": part.thread,
            "ts": part.begin - first,
            "dur": part.microseconds,
        });
        if let Some(component) = part.component {
            event["args"] = json!({"component": component});
        }
        event
    }));
    json!({"traceEvents": events, "displayTimeUnit": "ms"})
}

impl Watcher for Profile<'_> {
    fn begin(&self, tasks: &[Task], to_build: &[usize]) {
        self.progress.begin(tasks, to_build);
    }

    fn event(&self, task: usize, event: &Event) {
        if let Event::Part(part) = event {
            let mut parts = self.parts.lock().unwrap_or_else(PoisonError::into_inner);
            parts.push((task, part.clone()));
        }
        self.progress.event(task, event);
    }

    fn said(&self, task: usize, line: &str) {
        self.progress.said(task, line);
    }

    fn finished(&self, task: usize, outcome: &AssetOutcome) {
        self.progress.finished(task, outcome);
    }

    fn cancelled(&self) -> bool {
        self.progress.cancelled()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_from_the_first_part_on() {
        let part = |name: &str, begin, component| Part {
            name: name.into(),
            component,
            thread: 0,
            begin,
            microseconds: 7,
        };
        let parts = [
            (0, part("flow", 1_000_040, Some(0))),
            (0, part("read", 1_000_000, None)),
        ];
        let events = trace(&parts, &[]);
        let events = events["traceEvents"].as_array().expect("a list");
        assert_eq!(events[0]["ts"], 40);
        assert_eq!(events[0]["args"]["component"], 0);
        assert_eq!(events[1]["ts"], 0);
        assert_eq!(events[1]["dur"], 7);
        assert_eq!(events[1]["pid"], 1);
        assert!(events[1].get("args").is_none());
    }
}
