//! The integer grid on an atlas whose transitions are quarter turns: a unit square lattice whose points, lines and cells are the same whatever chart they are seen from.
//!
//! [`cone_triangulation`] leaves of the surface triangles between cones; [`mod@quantise`] gives their sides whole numbers of cells; [`quads`] are the unit squares of that lattice, and [`blocks`] rectangles of them.

pub mod blocks;
pub mod complex;
pub mod cone_triangulation;
mod error;
pub mod lattice;
pub mod quads;
pub mod quantise;
#[cfg(test)]
mod tests;
mod walk;

pub use error::GridError;
