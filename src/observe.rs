//! How a job tells what it is doing, and is told to stop.

use crate::flow::step::FlowStep;

/// Receives progress. Every method has a default, so `&()` watches nothing.
pub trait Observer: Sync {
    /// A stage begins. `component` counts from 0 of `components`.
    fn stage(&self, _name: &'static str, _component: usize, _components: usize) {}
    /// The flow took a step.
    fn flow_step(&self, _step: &FlowStep) {}
    /// True where the job should stop as soon as it can.
    fn cancelled(&self) -> bool {
        false
    }
}

impl Observer for () {}
