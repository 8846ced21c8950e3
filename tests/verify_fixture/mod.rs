//! Small complete atlases, made here from nothing but a planar development, and written by hand: the verifier
//! must not be tested with data from the stages that it judges.
#![allow(
    dead_code,
    unused_imports,
    reason = "every test binary uses a part of it"
)]

mod builder;
mod files;
mod picture;
mod plane;
mod shapes;

use exr::prelude::Compression;
use serde_json::Value;
use std::collections::BTreeMap;

pub use files::{Npy, write_npz};
pub use picture::{glb, picture};
pub use shapes::{cone, pillow, torus, tube};

pub const NONE: u32 = u32::MAX;
pub type P2 = [f64; 2];
pub type P3 = [f64; 3];

/// Rows of `atlas.npz`.
#[derive(Clone, Default)]
pub struct Arrays {
    pub positions: Vec<P3>,
    pub faces: Vec<[u32; 3]>,
    pub source_face: Vec<u32>,
    pub source_vertex: Vec<u32>,
    pub log_scale: Vec<f64>,
    pub target_curvature: Vec<f64>,
    pub flat_length: Vec<[f64; 3]>,
    pub central_uv: Vec<[P2; 3]>,
    pub cut: Vec<[u8; 3]>,
    pub segment: Vec<[u32; 3]>,
    pub chart_offset: Vec<u32>,
    pub chart_face: Vec<u32>,
    pub chart_sector: Vec<u8>,
    pub chart_uv: Vec<[P2; 3]>,
    pub patch: Vec<u32>,
    pub patch_uv: Vec<[P2; 3]>,
    pub seam_offset: Vec<u32>,
    pub seam_position: Vec<P3>,
    pub seam_uv: Vec<[P2; 2]>,
    pub seam_patch: Vec<[u32; 2]>,
}

/// A geometry image.
#[derive(Clone)]
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pub floats: BTreeMap<String, Vec<f32>>,
    pub face: Vec<u32>,
    pub text: String,
    pub compression: Compression,
}

/// Everything in an asset's folder.
#[derive(Clone)]
pub struct Atlas {
    pub json: Value,
    pub arrays: Arrays,
    pub pictures: Vec<Picture>,
    pub glb: Vec<u8>,
}

/// A planar development with what cannot be derived from it.
pub struct Plan {
    pub positions: Vec<P3>,
    pub faces: Vec<[u32; 3]>,
    pub uv: Vec<[P2; 3]>,
    /// Cut edges, either way round.
    pub cut: Vec<(u32, u32)>,
    pub cones: Vec<(u32, f64)>,
    /// Patch of every face.
    pub patch: Vec<u32>,
    pub topology: (i64, i64),
}
