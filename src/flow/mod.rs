//! From a prescription of curvature to a flat cone metric: sections 3 and 4 of the tutorial.
pub mod cones;
pub mod correspondence;
pub mod delaunay;
pub mod doubled;
pub mod feasibility;
pub mod intrinsic;
pub mod metric;
pub mod packing;
pub mod refine;
pub mod ricci;
pub mod schemes;
pub mod solve;
