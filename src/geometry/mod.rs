//! Surfaces: ids, connectivity, positions, and formulas on single triangles and polygons.
pub mod connectivity;
pub mod curvature;
pub mod deviation;
pub(crate) mod disjoint_sets;
pub(crate) mod fill;
pub mod frame;
pub mod ids;
pub mod mesh;
pub(crate) mod morton;
pub(crate) mod polygon;
pub(crate) mod subdivision;
pub mod triangle;

#[cfg(test)]
pub(crate) mod polycube;
