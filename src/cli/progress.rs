//! Progress on standard error: bars on a terminal, plain lines otherwise, JSON lines on request.

use super::arguments::{Global, LogFormat};
use super::{interrupt, summary, terminal};
use affine_atlas::flow::ricci::FlowStep;
use affine_atlas::observe::Observer;
use affine_atlas::outcome::AssetOutcome;
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Shows the progress of one command over all its assets.
pub struct Progress {
    style: Style,
    assets: usize,
    /// What is said of an asset that is done.
    done: &'static str,
}

enum Style {
    Silent,
    Lines { steps: bool },
    Json,
    Bars { all: ProgressBar, one: ProgressBar },
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
        }
    }

    /// With another word than "built" for assets that are done.
    pub fn calling_it(self, done: &'static str) -> Self {
        Self { done, ..self }
    }

    /// Watches one asset, `index` from 0.
    pub fn asset<'p>(&'p self, id: &'p str, index: usize) -> AssetProgress<'p> {
        if let Style::Bars { all, one } = &self.style {
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
        match &self.style {
            Style::Silent => {}
            Style::Lines { .. } => terminal::print_error(&format!(
                "[{}/{}] {}: {} after {:.1} s\n",
                index + 1,
                self.assets,
                outcome.id,
                match outcome.state_name() {
                    "built" => self.done,
                    other => other,
                },
                outcome.seconds
            )),
            Style::Json => summary::log(outcome),
            Style::Bars { all, .. } => all.set_position(index as u64 + 1),
        }
    }

    /// Takes bars off the terminal before results are printed.
    pub fn finish(&self) {
        if let Style::Bars { all, one } = &self.style {
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
    all.set_style(style("{bar:30} {pos}/{len} meshes  {elapsed}"));
    let one = group.add(ProgressBar::new_spinner());
    one.set_style(style("{spinner} {prefix}  {wide_msg}"));
    one.enable_steady_tick(Duration::from_millis(120));
    Style::Bars { all, one }
}

/// Shows the progress of one asset and passes Ctrl-C on to its job.
pub struct AssetProgress<'p> {
    progress: &'p Progress,
    id: &'p str,
    index: usize,
    stage: Mutex<Stage>,
}

#[derive(Clone, Copy, Default)]
struct Stage {
    name: &'static str,
    component: usize,
    components: usize,
}

impl Stage {
    /// `flow`, or `flow (component 2 of 5)`.
    fn words(self) -> String {
        if self.components > 1 {
            format!(
                "{} (component {} of {})",
                self.name,
                self.component + 1,
                self.components
            )
        } else {
            self.name.to_owned()
        }
    }
}

impl Observer for AssetProgress<'_> {
    fn stage(&self, name: &'static str, component: usize, components: usize) {
        let stage = Stage {
            name,
            component,
            components,
        };
        *self.stage.lock().unwrap_or_else(PoisonError::into_inner) = stage;
        match &self.progress.style {
            Style::Silent => {}
            Style::Lines { .. } => terminal::print_error(&format!(
                "[{}/{}] {}: {}\n",
                self.index + 1,
                self.progress.assets,
                self.id,
                stage.words()
            )),
            Style::Json => tracing::info!(
                target: "affine_atlas",
                asset = self.id,
                stage = name,
                component,
                components,
                "stage"
            ),
            Style::Bars { one, .. } => one.set_message(stage.words()),
        }
    }

    fn flow_step(&self, step: &FlowStep) {
        let words = || {
            format!(
                "step {}, max |K − K̄| = {:.1e}, step length {}",
                step.iteration, step.max_error, step.step
            )
        };
        match &self.progress.style {
            Style::Silent | Style::Lines { steps: false } => {}
            Style::Lines { steps: true } => terminal::print_error(&format!(
                "[{}/{}] {}: {}\n",
                self.index + 1,
                self.progress.assets,
                self.id,
                words()
            )),
            Style::Json => tracing::debug!(
                target: "affine_atlas",
                asset = self.id,
                iteration = step.iteration,
                max_error = step.max_error,
                energy = step.energy,
                step = step.step,
                flips = step.flips,
                "flow step"
            ),
            Style::Bars { one, .. } => {
                let stage = *self.stage.lock().unwrap_or_else(PoisonError::into_inner);
                one.set_message(format!("{}: {}", stage.words(), words()));
            }
        }
    }

    fn cancelled(&self) -> bool {
        interrupt::requested()
    }
}
