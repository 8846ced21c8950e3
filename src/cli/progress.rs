//! Progress on standard error: bars on a terminal, plain lines otherwise, JSON lines on request.

use super::arguments::{Global, LogFormat};
use super::{interrupt, summary, terminal};
use affine_atlas::batch::worker::Event;
use affine_atlas::batch::{Task, Watcher};
use affine_atlas::flow::ricci::FlowStep;
use affine_atlas::observe::Observer;
use affine_atlas::outcome::{AssetOutcome, AssetState};
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Shows the progress of one command over all its assets.
pub struct Progress {
    style: Style,
    assets: usize,
    /// What is said of an asset that is done.
    done: &'static str,
    /// Of a batch: what runs, and how much of the work is done.
    batch: Mutex<Option<Running>>,
    /// When a stage of one of several components was last told of in a line.
    told: Mutex<Option<Instant>>,
}

/// Stages of small components follow each other by hundreds a second; a log wants a line now and then.
const BETWEEN_LINES: Duration = Duration::from_secs(1);

enum Style {
    Silent,
    Lines {
        steps: bool,
    },
    Json,
    Bars {
        group: MultiProgress,
        all: ProgressBar,
        one: ProgressBar,
    },
}

/// A batch under way.
struct Running {
    since: Instant,
    /// Of each task.
    ids: Vec<String>,
    costs: Vec<u64>,
    /// Position of each task that must be built in the order of building.
    places: BTreeMap<usize, usize>,
    /// Stage of each task that runs.
    stages: BTreeMap<usize, Stage>,
    cost: f64,
    cost_done: f64,
    done: usize,
}

impl Running {
    /// Its number in the order of building, from 0; what is cached comes before all.
    fn index(&self, task: usize) -> usize {
        let place = self.places.get(&task).copied().unwrap_or(0);
        self.ids.len() - self.places.len() + place
    }

    /// Seconds that are left if the rest goes as fast as what is done; none before a hundredth is done.
    fn left(&self) -> Option<f64> {
        let part = self.cost_done / self.cost;
        let elapsed = self.since.elapsed().as_secs_f64();
        (part >= 0.01 && elapsed > 1.0).then(|| elapsed * (1.0 - part) / part)
    }
}

/// A mesh costs a little whatever its size.
const LEAST_COST: u64 = 20_000;

/// So many seconds in words: "40 s", "3 min", "2 h 5 min".
pub fn in_words(seconds: f64) -> String {
    let minutes = (seconds / 60.0).round() as u64;
    match minutes {
        0 | 1 if seconds < 90.0 => format!("{seconds:.0} s"),
        0..60 => format!("{minutes} min"),
        _ => format!("{} h {} min", minutes / 60, minutes % 60),
    }
}

impl Progress {
    /// For so many assets.
    pub fn new(global: &Global, assets: usize) -> Self {
        let style = if global.log_format == LogFormat::Json {
            Style::Json // the log itself leaves out what `--quiet` does not want
        } else if global.quiet {
            Style::Silent
        } else if terminal::stderr_is_terminal() && global.verbose == 0 {
            bars(assets)
        } else {
            Style::Lines {
                steps: global.verbose > 0,
            }
        };
        Self {
            style,
            assets,
            done: "built",
            batch: Mutex::default(),
            told: Mutex::default(),
        }
    }

    /// With another word than "built" for assets that are done.
    pub fn calling_it(self, done: &'static str) -> Self {
        Self { done, ..self }
    }

    /// Watches one asset, `index` from 0.
    pub fn asset<'p>(&'p self, id: &'p str, index: usize) -> AssetProgress<'p> {
        if let Style::Bars { all, one, .. } = &self.style {
            all.set_position(index as u64);
            one.set_prefix(id.to_owned());
            one.set_message("");
        }
        AssetProgress {
            progress: self,
            id,
            index,
            stage: Mutex::default(),
        }
    }

    /// An asset is done; its figures and failures are shown by [`summary`], at once in JSON.
    pub fn done(&self, outcome: &AssetOutcome, index: usize) {
        self.show_done(outcome, index + 1, "");
    }

    /// `count` is the asset's number in lines, and how many are done in bars; `more` ends its line.
    fn show_done(&self, outcome: &AssetOutcome, count: usize, more: &str) {
        match &self.style {
            Style::Silent => {}
            Style::Lines { .. } => terminal::print_error(&format!(
                "[{count}/{}] {}: {} after {:.1} s{more}\n",
                self.assets,
                outcome.id,
                match outcome.state_name() {
                    "built" => self.done,
                    other => other,
                },
                outcome.seconds
            )),
            Style::Json => summary::log(outcome),
            Style::Bars { all, .. } => all.set_position(count as u64),
        }
    }

    /// Takes bars off the terminal before results are printed.
    pub fn finish(&self) {
        if let Style::Bars { all, one, .. } = &self.style {
            one.finish_and_clear();
            all.finish_and_clear();
        }
    }
}

fn bars(assets: usize) -> Style {
    let group = MultiProgress::new();
    let all = group.add(ProgressBar::new(assets as u64));
    let style = |template: &str| {
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
    };
    all.set_style(style("{bar:30} {pos}/{len} meshes  {elapsed}  {msg}"));
    // The clock runs while the first mesh is under way.
    all.enable_steady_tick(Duration::from_secs(1));
    let one = group.add(ProgressBar::new_spinner());
    one.set_style(style("{spinner} {prefix}  {wide_msg}"));
    one.enable_steady_tick(Duration::from_millis(120));
    Style::Bars { group, all, one }
}

/// Shows the progress of one asset and passes Ctrl-C on to its job.
pub struct AssetProgress<'p> {
    progress: &'p Progress,
    id: &'p str,
    index: usize,
    stage: Mutex<Stage>,
}

#[derive(Clone, Default)]
struct Stage {
    name: String,
    component: usize,
    components: usize,
}

impl Stage {
    /// `flow`, or `flow (component 2 of 5)`.
    fn words(&self) -> String {
        if self.components > 1 {
            format!(
                "{} (component {} of {})",
                self.name,
                self.component + 1,
                self.components
            )
        } else {
            self.name.clone()
        }
    }
}

impl Observer for AssetProgress<'_> {
    fn stage(&self, name: &'static str, component: usize, components: usize) {
        let stage = Stage {
            name: name.to_owned(),
            component,
            components,
        };
        self.progress.show_stage(self.index, self.id, &stage);
        *self.stage.lock().unwrap_or_else(PoisonError::into_inner) = stage;
    }

    fn flow_step(&self, step: &FlowStep) {
        let stage = self
            .stage
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone();
        self.progress.show_step(self.index, self.id, &stage, step);
    }

    fn cancelled(&self) -> bool {
        interrupt::requested()
    }
}

impl Progress {
    /// Whether the last line about a component is old enough for another.
    fn is_time_for_a_line(&self) -> bool {
        let mut told = self.told.lock().unwrap_or_else(PoisonError::into_inner);
        let is_time = told.is_none_or(|at| at.elapsed() >= BETWEEN_LINES);
        if is_time {
            *told = Some(Instant::now());
        }
        is_time
    }

    fn show_stage(&self, index: usize, id: &str, stage: &Stage) {
        match &self.style {
            Style::Silent => {}
            Style::Lines { steps: false } if stage.components > 1 && !self.is_time_for_a_line() => {
            }
            Style::Lines { .. } => terminal::print_error(&format!(
                "[{}/{}] {id}: {}\n",
                index + 1,
                self.assets,
                stage.words()
            )),
            Style::Json => tracing::info!(
                target: "affine_atlas",
                asset = id,
                stage = stage.name,
                component = stage.component,
                components = stage.components,
                "stage"
            ),
            Style::Bars { one, .. } => {
                one.set_prefix(id.to_owned());
                one.set_message(stage.words());
            }
        }
    }

    fn show_step(&self, index: usize, id: &str, stage: &Stage, step: &FlowStep) {
        let words = || {
            format!(
                "step {}, max |K − K̄| = {:.1e}, step length {}",
                step.iteration, step.max_error, step.step
            )
        };
        match &self.style {
            Style::Silent | Style::Lines { steps: false } => {}
            Style::Lines { steps: true } => terminal::print_error(&format!(
                "[{}/{}] {id}: {}\n",
                index + 1,
                self.assets,
                words()
            )),
            Style::Json => tracing::debug!(
                target: "affine_atlas",
                asset = id,
                iteration = step.iteration,
                max_error = step.max_error,
                energy = step.energy,
                step = step.step,
                flips = step.flips,
                "flow step"
            ),
            Style::Bars { one, .. } => {
                one.set_prefix(id.to_owned());
                one.set_message(format!("{}: {}", stage.words(), words()));
            }
        }
    }
}

impl Watcher for Progress {
    fn begin(&self, tasks: &[Task], to_build: &[usize]) {
        let costs: Vec<u64> = tasks.iter().map(|task| task.cost + LEAST_COST).collect();
        let places = to_build
            .iter()
            .enumerate()
            .map(|(place, &task)| (task, place));
        let running = Running {
            since: Instant::now(),
            ids: tasks.iter().map(|task| task.id.clone()).collect(),
            places: places.collect(),
            stages: BTreeMap::new(),
            cost: to_build.iter().map(|&task| costs[task] as f64).sum(),
            cost_done: 0.0,
            done: tasks.len() - to_build.len(),
            costs,
        };
        let cached = running.done;
        if let Style::Bars { all, .. } = &self.style {
            all.set_position(cached as u64);
        } else if let Style::Lines { .. } = &self.style
            && cached > 0
        {
            terminal::print_error(&format!(
                "{cached} of {} whole already, {} to build\n",
                tasks.len(),
                to_build.len()
            ));
        }
        *self.batch.lock().unwrap_or_else(PoisonError::into_inner) = Some(running);
    }

    fn event(&self, task: usize, event: &Event) {
        let mut batch = self.batch.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(running) = batch.as_mut() else {
            return;
        };
        let index =
            running.places.get(&task).copied().unwrap_or(0) + self.assets - running.places.len();
        match event {
            Event::Stage {
                name,
                component,
                components,
            } => {
                let stage = Stage {
                    name: name.clone(),
                    component: *component,
                    components: *components,
                };
                self.show_stage(index, &running.ids[task], &stage);
                running.stages.insert(task, stage);
            }
            Event::Step(step) => {
                let stage = running.stages.get(&task).cloned().unwrap_or_default();
                self.show_step(index, &running.ids[task], &stage, step);
            }
            Event::Part(_) | Event::Finished(_) => {}
        }
    }

    fn said(&self, _: usize, line: &str) {
        let line = format!("{line}\n");
        match &self.style {
            Style::Bars { group, .. } => group.suspend(|| terminal::print_error(&line)),
            _ => terminal::print_error(&line),
        }
    }

    fn finished(&self, task: usize, outcome: &AssetOutcome) {
        let mut batch = self.batch.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(running) = batch.as_mut() else {
            // Cached: before anything is built.
            if let Style::Json = &self.style {
                summary::log(outcome);
            }
            return;
        };
        running.stages.remove(&task);
        if outcome.state != AssetState::Cancelled {
            running.done += 1;
            running.cost_done += running.costs[task] as f64;
        }
        let left = match running.done < self.assets {
            true => running.left().map(in_words),
            false => None,
        };
        let more = match &left {
            Some(left) if self.assets > 10 => {
                format!(", {} left: about {left}", self.assets - running.done)
            }
            _ => String::new(),
        };
        if let (Style::Bars { all, .. }, Some(left)) = (&self.style, &left) {
            all.set_message(format!("about {left} left"));
        }
        let count = match &self.style {
            Style::Lines { .. } => running.index(task) + 1,
            _ => running.done,
        };
        self.show_done(outcome, count, &more);
    }

    fn cancelled(&self) -> bool {
        interrupt::requested()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_in_words() {
        for (seconds, words) in [
            (0.4, "0 s"),
            (40.0, "40 s"),
            (89.0, "89 s"),
            (90.0, "2 min"),
            (3540.0, "59 min"),
            (7500.0, "2 h 5 min"),
        ] {
            assert_eq!(in_words(seconds), words);
        }
    }
}
