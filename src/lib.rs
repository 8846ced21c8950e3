//! Affine atlases of triangle meshes by discrete Ricci flow.
//!
//! A surface with a flat cone metric has an atlas whose transitions are rotations and translations.
//! This crate repairs a mesh, chooses cones, finds the metric, slits the surface into a disk, covers it with a
//! central chart, boundary charts and node charts, and samples geometry images over injective patches.
//! It implements the pipeline of Gu, Luo, Yau, *Tutorial on Discrete Ricci Flow for Global
//! Parameterizations* (section 5.1); equation and section numbers in these docs are the tutorial's.
//! `docs/method.md` of the source holds what goes beyond it, `docs/format.md` what every output satisfies, and `docs/output.md`
//! every file, key and array.
//!
//! ```text
//! read → repair → cones → connectivity repair → lengths → Ricci flow → overlay → cut → central chart → charts
//!                                                                                  ↓
//!                      write ← report ← geometry images ← patches ←────────────────┘
//! ```
//!
//! Every arrow is a function from finished values to a finished value; [`job`] is the page on which they
//! stand in order. Dependencies point one way: `geometry` ← `flow` ← `atlas` ← `product` ← `report`,
//! `export`; `read` and `repair` know `geometry` only; [`rebuild`] makes a mesh again from images and seams alone, in memory for
//! `report` and from a folder for the command; [`spline`] fits one smooth surface to the cells of a grid; [`texture`] lays an image that repeats over the surface; [`verify`] reads what was written and shares no
//! code with the stages that made it (but the readers of file formats in `read`). [`batch`] runs [`job`] for many assets, each in a
//! process of its own, and knows nothing of what a job computes.
//!
//! ```
//! use affine_atlas::{build, config::Config, geometry::mesh::Soup};
//!
//! // A tetrahedron: four cones of π, no flow needed beyond rounding.
//! let soup = Soup::from_triangles(
//!     vec![[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]],
//!     vec![[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]],
//! );
//! let mut config = Config::default();
//! config.cones.count = Some(4);
//! let atlases = build(&soup, &config, &())?;
//! let atlas = atlases[0].as_ref().unwrap();
//! assert_eq!(atlas.prescription.cones.len(), 4);
//! assert!(atlas.metric.max_curvature_error < 1e-10);
//! # Ok::<(), affine_atlas::job::BuildError>(())
//! ```
//!
//! # Symbols
//!
//! | symbol | name in code | meaning |
//! | --- | --- | --- |
//! | K, K̄ | `curvature`, `target_curvature` | angle defect (3), (4) and its prescription, radians |
//! | u | `log_scale` | logarithm of the length scale at a vertex; ln γ for packings |
//! | γ, Φ | `radius`, `phi` | radii and intersection angles of a circle packing |
//! | l, l̄ | `length`, `source_length` | flat length and length in space |
//! | θ | `angle` | corner angle, radians |
//! | λ | `penner` | logarithm of a length at u = 0, under Ptolemy flips a Penner coordinate |
//! | A, B, C | `base`, `delaunay`, `flat` | the mesh, its intrinsic Delaunay triangulation, the final one |
//! | χ, g | `euler_characteristic`, `genus` | V − E + F and the number of handles |
//! | φ | `transition`, `gluing` | rigid motions between charts and across the cut |
//!
//! # References
//!
//! * D. X. Gu, F. Luo, S.-T. Yau. *Tutorial on Discrete Ricci Flow for Global Parameterizations.*
//! * B. Chow, F. Luo. *Combinatorial Ricci flows on surfaces.* J. Differential Geom. 63, 2003.
//! * X. D. Gu, F. Luo, J. Sun, T. Wu. *A discrete uniformization theorem for polyhedral surfaces.* J. Differential Geom. 109, 2018.
//! * M. Gillespie, B. Springborn, K. Crane. *Discrete conformal equivalence of polyhedral surfaces.* ACM Trans. Graph. 40, 2021.
//! * B. Springborn. *Ideal hyperbolic polyhedra and discrete uniformization.* Discrete Comput. Geom. 64, 2020.
//! * M. Gillespie, N. Sharp, K. Crane. *Integer coordinates for intrinsic geometry processing.* SIGGRAPH Asia 2021.
//! * M. Campen, R. Capouellez, H. Shen, L. Zhu, D. Panozzo, D. Zorin. *Efficient and robust discrete conformal equivalence with boundary.* SIGGRAPH Asia 2021.
//! * R. Capouellez, D. Zorin. *Seamless parametrization in Penner coordinates.* ACM Trans. Graph. 43, 2024.
//! * D. Glickenstein. *Discrete conformal variations and scalar curvature on piecewise flat manifolds.* J. Differential Geom. 87, 2011.
//! * J. Erickson, K. Whittlesey. *Greedy optimal homotopy and homology generators.* SODA 2005.
//! * X. Gu, S. Gortler, H. Hoppe. *Geometry images.* SIGGRAPH 2002.
//! * P. Sander, Z. Wood, S. Gortler, J. Snyder, H. Hoppe. *Multi-chart geometry images.* SGP 2003.

pub mod atlas;
pub mod batch;
pub mod config;
pub mod export;
pub mod flow;
pub mod geometry;
pub mod grid;
pub mod job;
pub mod observe;
pub mod outcome;
mod parallel;
pub mod product;
pub mod read;
pub mod rebuild;
pub mod repair;
pub mod report;
pub mod schema;
pub mod spline;
pub mod texture;
pub mod verify;

pub use job::build;
