//! The document key by key, in the order in which it is written.

use super::grid::{Grid, SidePiece};
use crate::atlas::geometry_image::{Channel, Precision};
use crate::atlas::patches::Domain;
use crate::flow::refine::ConnectivityRepair;
use crate::flow::ricci::{FlowStep, PackingFit, Scheme, Solver};
use crate::product::Quality;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Version of the output contract that this module writes.
pub const FORMAT_VERSION: u32 = 2;

/// The whole document.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Document {
    /// `"affine-atlas"`.
    #[schemars(extend("const" = "affine-atlas"))]
    pub format: String,
    /// Version of the format.
    #[schemars(extend("const" = FORMAT_VERSION))]
    pub version: u32,
    /// Program that wrote it.
    pub generator: Generator,
    /// What it was made from.
    pub source: Source,
    /// Units of all numbers.
    pub units: Units,
    /// Counts of the surface in `atlas.npz`.
    pub topology: Topology,
    /// Changes made to the input, by name.
    pub repair: BTreeMap<String, u64>,
    /// Changes made around cones (tutorial 5.3).
    pub connectivity: ConnectivityRepair,
    /// The flat metric and how it was reached.
    pub metric: Metric,
    /// Vertices of prescribed curvature.
    pub cones: Vec<Cone>,
    /// Features that were asked for; absent where there are none.
    #[serde(skip_serializing_if = "Vec::is_empty", default)]
    pub features: Vec<Feature>,
    /// Segments of the cut graph with their gluings.
    pub segments: Vec<Segment>,
    /// Charts; number 0 is the central one.
    pub charts: Vec<Chart>,
    /// Central chart to every sector of every other.
    pub transitions: Vec<Transition>,
    /// Two period vectors of a flat torus, in central-chart coordinates.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub periods: Option<[[f64; 2]; 2]>,
    /// The integer grid; absent where patches are no blocks of one.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub grid: Option<Grid>,
    /// Why there is none, where one was asked for.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub no_grid: Option<String>,
    /// Domains of the geometry images.
    pub patches: Vec<Patch>,
    /// What the images hold; absent where that is normal, face and log scale, all of 32 bits, and no image of all patches is there.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub images: Option<Images>,
    /// Measured quality.
    pub quality: Quality,
    /// Added to an image's `R G B` to give source coordinates.
    pub image_origin: [f64; 3],
    /// Properties of the whole atlas.
    pub flags: Flags,
}

/// Program that wrote the atlas.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Generator {
    /// Name of the program.
    pub name: String,
    /// Its version.
    pub version: String,
}

/// What the atlas was made from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Source {
    /// Input file as given; never absolute.
    pub path: String,
    /// BLAKE3 hash of the input, hexadecimal.
    pub blake3: String,
    /// BLAKE3 hash of the configuration, hexadecimal.
    pub config_blake3: String,
    /// Which component this is, from 0.
    pub component: usize,
    /// How many the input has.
    pub components: usize,
    /// Runs of vertices and faces that parts of the input gave.
    pub parts: Vec<SourcePart>,
}

/// A run of vertices and faces of the input.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct SourcePart {
    /// Node, mesh and primitive, or the object name.
    pub name: String,
    /// Its first vertex in the running count.
    pub first_vertex: usize,
    /// Number of its vertices.
    pub vertices: usize,
    /// Its first face in the running count.
    pub first_face: usize,
    /// Number of its faces.
    pub faces: usize,
}

/// Units of all numbers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Units {
    /// Lengths and coordinates: `"source"`, those of the input.
    pub length: String,
    /// Angles and curvatures: `"radian"`.
    pub angle: String,
}

/// Counts that do not depend on the metric.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Topology {
    /// Number of vertices.
    pub vertices: usize,
    /// Number of edges.
    pub edges: usize,
    /// Number of faces.
    pub faces: usize,
    /// χ = V − E + F.
    pub euler_characteristic: i64,
    /// Number of handles.
    pub genus: i64,
    /// Number of boundary loops.
    pub boundary_loops: usize,
}

/// What happened on the boundary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Boundary {
    /// The surface is closed.
    None,
    /// `u` kept its value on the boundary.
    Free,
    /// Every boundary vertex of a loop got the same curvature.
    Uniform,
    /// Four corners of π/2.
    Corners,
    /// Vertex by vertex.
    Prescribed,
}

/// The flat metric and how it was reached.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Metric {
    /// Conformal structure.
    pub scheme: Scheme,
    /// Minimiser.
    pub solver: Solver,
    /// Boundary condition.
    pub boundary: Boundary,
    /// Iterations that were taken.
    pub iterations: usize,
    /// Edges that were flipped.
    pub flips: usize,
    /// max |K − K̄| over the prescribed vertices, radians.
    pub max_curvature_error: f64,
    /// Bound that was asked for, radians.
    pub curvature_tolerance: f64,
    /// True where rounding stopped the flow above that bound.
    pub limited_by_float64: bool,
    /// How well a circle packing keeps the lengths in space; absent for other schemes.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub fit: Option<PackingFit>,
    /// What is prescribed of loops; absent where they are free.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub holonomy: Option<Holonomy>,
    /// One entry an iteration.
    pub history: Vec<FlowStep>,
}

/// What is prescribed of loops, and how it was met.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Holonomy {
    /// One entry an independent loop.
    pub loops: Vec<Loop>,
    /// How much cheaper a change of scale was than one of shape.
    pub conformality: f64,
    /// Number of quarter turns that were moved between vertices so that a grid can have the cones of the field.
    pub adjusted: usize,
    /// Number of quarter turns that were moved between cones of the field, of which one is gone.
    pub merged: usize,
    /// Part of the length of sharp edges that is in none of `features`, of chains that are as long as cells.
    #[serde(default)]
    pub left_out: f64,
}

/// An independent loop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Loop {
    /// By how many quarter turns it turns.
    pub turns: i64,
    /// By how much it misses that, radians.
    pub residual: f64,
}

/// A chain of sharp edges, or between materials.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Feature {
    /// Its vertices in order, rows of `positions`; the first is the last again where it is closed.
    pub vertices: Vec<usize>,
    /// Length in space, source units.
    pub length: f64,
    /// Mean angle between the normals of both sides, radians.
    pub angle: f64,
    /// Whether it is a straight line of the atlas, parallel to one of the axes up to quarter turns.
    pub is_line: bool,
}

/// A vertex of prescribed curvature.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Cone {
    /// Row of `positions`.
    pub vertex: usize,
    /// Vertex of the input file; null for a vertex that repair made.
    pub source_vertex: Option<u32>,
    /// Prescribed curvature, radians.
    pub curvature: f64,
}

/// A rigid motion of the plane: p ↦ R(rotation) p + translation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Motion {
    /// Angle in (−π, π].
    pub rotation: f64,
    /// The rotation as a number of quarter turns, 0 to 3; absent where it is none.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub quarter_turns: Option<u8>,
    /// Added after the rotation, source units.
    pub translation: [f64; 2],
    /// Largest distance over the corners in the overlap, source units.
    pub residual: f64,
}

/// A chain of cut edges.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Segment {
    /// Number, as in the array `segment`.
    pub id: usize,
    /// Node where it begins.
    pub from: u32,
    /// Node where it ends.
    pub to: u32,
    /// All its vertices, from `from` to `to`.
    pub vertices: Vec<u32>,
    /// Coordinates on its left to coordinates on its right.
    pub gluing: Motion,
}

/// A chart.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Chart {
    /// Number, as in `chart_offset`.
    pub id: usize,
    /// What it covers.
    #[serde(flatten)]
    pub domain: ChartDomain,
}

/// What a chart covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum ChartDomain {
    /// The slit disk.
    Central,
    /// Both sides of a segment.
    Boundary {
        /// The segment.
        segment: u32,
    },
    /// The ring or fan of a node.
    Node {
        /// The node.
        vertex: u32,
    },
}

/// A transition from one chart to another on one sector.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Transition {
    /// Chart whose coordinates go in.
    pub from: u32,
    /// Chart whose coordinates come out.
    pub to: u32,
    /// Sector of `to`.
    pub sector: u8,
    /// The motion.
    #[serde(flatten)]
    pub motion: Motion,
    /// Number of faces in the overlap.
    pub faces: usize,
}

/// The domain of one geometry image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Patch {
    /// Number, as in the array `patch`.
    pub id: usize,
    /// Its image, relative to the folder.
    pub image: String,
    /// How texels lie in it.
    pub domain: Domain,
    /// Columns of the image.
    pub width: usize,
    /// Rows of the image.
    pub height: usize,
    /// (column, row, 1) to patch coordinates.
    pub texel_to_patch: [[f64; 3]; 2],
    /// Of a block: cells along its first and second axis.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub cells: Option<[usize; 2]>,
    /// Of a block: texels on a side of a cell.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub samples_per_cell: Option<usize>,
    /// Of a block: what lies across its bottom, right, top and left.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub sides: Option<[Vec<SidePiece>; 4]>,
    /// Of a block: the island of `TEXCOORD_0` that it lies in.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub island: Option<usize>,
    /// Patch coordinates to central-chart coordinates; null for a block of a grid.
    pub patch_to_chart: Option<Similarity>,
    /// Patch coordinates to the unit square of `surface.glb`, v up.
    pub patch_to_packed: Packing,
}

/// What the images hold.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Images {
    /// Groups of channels beside position and mask, as `images.channels` names them; those that the source lacks are not there.
    pub channels: Vec<Channel>,
    /// How normals are stored.
    pub normal_precision: Precision,
    /// One image of all patches; absent where none was asked for.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub packed: Option<Packed>,
}

/// One image of all patches: in it, each patch's image lies texel for texel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Packed {
    /// The image, relative to the folder.
    pub image: String,
    /// Its columns and rows.
    pub side: usize,
    /// Column and row, from the top, of the upper left texel of each patch's image, by patch.
    pub corners: Vec<[usize; 2]>,
}

/// p ↦ scale · R(rotation) p + translation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Similarity {
    /// Positive factor.
    pub scale: f64,
    /// Angle in (−π, π].
    pub rotation: f64,
    /// Added last, source units.
    pub translation: [f64; 2],
}

/// p ↦ scale · p + translation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Packing {
    /// Positive factor.
    pub scale: f64,
    /// Added last.
    pub translation: [f64; 2],
}

/// Properties of the whole atlas.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Flags {
    /// True where every gluing is a quarter turn to 1e-8.
    pub seamless: bool,
}
