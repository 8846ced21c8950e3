//! How a job tells what it is doing, and is told to stop.

use crate::flow::step::FlowStep;

/// Receives progress. Every method has a default, so `&()` watches nothing.
pub trait Observer: Sync {
    /// A stage begins. `component` counts from 0 of `components`.
    fn stage(&self, _name: &'static str, _component: usize, _components: usize) {}
    /// The last stage of a component is over.
    fn finished(&self, _component: usize, _components: usize) {}
    /// The flow took a step.
    fn flow_step(&self, _step: &FlowStep) {}
    /// True where the job should stop as soon as it can.
    fn cancelled(&self) -> bool {
        false
    }
}

impl Observer for () {}

/// The target of the spans that parts of stages are.
pub const PARTS: &str = "affine_atlas::parts";

/// Begins a part of a stage, which lasts as long as what this gives is kept: `let _part = part!("quantise");`.
macro_rules! part {
    ($name:literal) => {
        tracing::trace_span!(target: $crate::observe::PARTS, $name).entered()
    };
}
pub(crate) use part;
