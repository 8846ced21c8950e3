//! The figures of an asset, from the `atlas.json` of its components.

use crate::export::manifest::Record;
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::Path;

/// Figures of all components together: counts are added up, of the others the worst is taken.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Figures {
    /// Faces of the surfaces the charts are defined on.
    pub faces: u64,
    /// Genus.
    pub genus: i64,
    /// Boundary loops.
    pub boundary_loops: u64,
    /// Cones.
    pub cones: u64,
    /// Patches.
    pub patches: u64,
    /// (9).
    pub area_distortion: f64,
    /// Standard deviation of the log scale.
    pub log_scale_std: f64,
    /// Mean angle error, radians.
    pub angle_error_mean: f64,
    /// Surface rebuilt from the images, decibels.
    pub image_psnr_db: Option<f64>,
}

#[derive(Deserialize)]
struct Document {
    topology: Topology,
    cones: Vec<IgnoredAny>,
    patches: Vec<IgnoredAny>,
    quality: Quality,
}

#[derive(Deserialize)]
struct Topology {
    faces: u64,
    genus: i64,
    boundary_loops: u64,
}

#[derive(Deserialize)]
struct Quality {
    area_distortion: f64,
    log_scale: Deviation,
    angle_error: Mean,
    image_psnr_db: Option<f64>,
}

#[derive(Deserialize)]
struct Deviation {
    std: f64,
}

#[derive(Deserialize)]
struct Mean {
    mean: f64,
}

/// Those of the asset's atlases; nothing where there are none, or none can be read.
pub(super) fn read(output_root: &Path, record: &Record) -> Option<Figures> {
    let documents = record
        .files
        .iter()
        .filter(|file| file.ends_with("/atlas.json") && !file.split('/').any(|part| part == ".."));
    let mut all: Option<Figures> = None;
    for file in documents {
        // A file that is gone or broken says nothing; `verify` is there to find it.
        let bytes = fs::read(output_root.join(file)).ok()?;
        let document: Document = serde_json::from_slice(&bytes).ok()?;
        let sum = all.get_or_insert_default();
        let Quality {
            area_distortion,
            log_scale,
            angle_error,
            image_psnr_db,
        } = document.quality;
        sum.faces += document.topology.faces;
        sum.genus += document.topology.genus;
        sum.boundary_loops += document.topology.boundary_loops;
        sum.cones += document.cones.len() as u64;
        sum.patches += document.patches.len() as u64;
        sum.area_distortion = sum.area_distortion.max(area_distortion);
        sum.log_scale_std = sum.log_scale_std.max(log_scale.std);
        sum.angle_error_mean = sum.angle_error_mean.max(angle_error.mean);
        sum.image_psnr_db = match (sum.image_psnr_db, image_psnr_db) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
    }
    all
}
