//! The common refinement of the base mesh and the final triangulation of the flow.
pub mod positions;
