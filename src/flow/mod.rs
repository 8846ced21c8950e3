//! From a prescription of curvature to a flat cone metric: sections 3 and 4 of the tutorial.
pub mod cones;
pub mod correspondence;
pub mod delaunay;
pub mod doubled;
pub mod feasibility;
pub mod intrinsic;
mod laplacian;
pub mod metric;
pub mod packing;
pub mod pi_multiple;
pub mod prescription;
pub mod refine;
pub mod ricci;
mod scale;
pub mod schemes;
pub mod solve;
pub mod step;
pub mod vertex_scale;
