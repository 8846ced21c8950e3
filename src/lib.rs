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
//! use affine_atlas::{build, config::Config, geometry::mesh::Soup, spline};
//!
//! // Two triangles a side of a cube, each named by its corners.
//! let corner = |i: u32| [0, 1, 2].map(|k| f64::from(i >> k & 1));
//! let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
//! let faces = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
//! let soup = Soup::from_triangles((0..8).map(corner).collect(), faces.collect());
//! let mut config = Config::default();
//! config.grid.cells = 54;
//!
//! // One atlas a component; `&()` watches nothing (see `observe::Observer`).
//! for atlas in build(&soup, &config, &())? {
//!     let atlas = atlas?;
//!     // The surface, whose faces are parts of those given, and the texture coordinates of their corners.
//!     let (mesh, layout) = (&atlas.mesh, &atlas.patches);
//!     for face in mesh.connectivity.faces() {
//!         let patch = &layout.patches[layout.face_patch[face].index()];
//!         let texcoord = layout.uv[face].map(|uv| patch.packed(uv));
//!         assert!(texcoord.as_flattened().iter().all(|x| (0.0..=1.0).contains(x)));
//!     }
//!     // A quad mesh, the flat metric, the maps between charts.
//!     let grid = atlas.grid.as_ref().expect("a cube has room for one");
//!     assert_eq!(grid.irregular().len(), 8);
//!     assert!(atlas.metric.max_curvature_error < 1e-10);
//!     let quarter_turns = atlas.charts.gluings.iter().map(|g| g.motion);
//!     assert!(quarter_turns.count() > 0);
//!     // A smooth surface, and a point of it in the middle of the first cell.
//!     let spline = spline::fit(&atlas.gridded().expect("it has a grid"))?;
//!     let jet = spline.with_limit(|limit| limit.at(0, [0.5, 0.5]));
//!     assert!(jet.point.iter().all(|x| (-0.01..1.01).contains(x)));
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! For the flow alone, with curvatures of one's own, see [`flow::ricci::flow`].
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
