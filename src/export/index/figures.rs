//! The figures of an asset, from the `atlas.json` of its components, or `components.json` where they have none.

use crate::export::components;
use crate::export::manifest::Record;
use crate::export::names::COMPONENTS;
use crate::read::bounded::{JSON_LIMIT, read_bounded};
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};
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
    /// Cells of grids; none where there are flat patches only.
    pub cells: Option<u64>,
    /// Irregular points of grids, likewise.
    pub irregular: Option<u64>,
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
    grid: Option<Grid>,
    quality: Quality,
}

#[derive(Deserialize)]
struct Grid {
    cells: u64,
    irregular: Vec<IgnoredAny>,
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

impl Figures {
    /// Those of one atlas.
    fn of(document: &Document) -> Self {
        let quality = &document.quality;
        Self {
            faces: document.topology.faces,
            genus: document.topology.genus,
            boundary_loops: document.topology.boundary_loops,
            cones: document.cones.len() as u64,
            patches: document.patches.len() as u64,
            cells: document.grid.as_ref().map(|grid| grid.cells),
            irregular: document
                .grid
                .as_ref()
                .map(|grid| grid.irregular.len() as u64),
            area_distortion: quality.area_distortion,
            log_scale_std: quality.log_scale.std,
            angle_error_mean: quality.angle_error.mean,
            image_psnr_db: quality.image_psnr_db,
        }
    }

    /// Those of a component that has no folder.
    fn listed(figures: &components::Figures) -> Self {
        Self {
            faces: figures.faces as u64,
            genus: figures.genus,
            boundary_loops: figures.boundary_loops as u64,
            cones: figures.cones as u64,
            patches: figures.patches as u64,
            cells: figures.cells.map(|cells| cells as u64),
            irregular: figures.irregular_points.map(|points| points as u64),
            area_distortion: figures.area_distortion,
            log_scale_std: figures.log_scale_std,
            angle_error_mean: figures.angle_error_mean,
            image_psnr_db: figures.image_psnr_db,
        }
    }

    fn with(self, other: &Self) -> Self {
        let sum = |a: Option<u64>, b: Option<u64>| match (a, b) {
            (Some(a), Some(b)) => Some(a + b),
            (a, b) => a.or(b),
        };
        Self {
            faces: self.faces + other.faces,
            genus: self.genus + other.genus,
            boundary_loops: self.boundary_loops + other.boundary_loops,
            cones: self.cones + other.cones,
            patches: self.patches + other.patches,
            cells: sum(self.cells, other.cells),
            irregular: sum(self.irregular, other.irregular),
            area_distortion: self.area_distortion.max(other.area_distortion),
            log_scale_std: self.log_scale_std.max(other.log_scale_std),
            angle_error_mean: self.angle_error_mean.max(other.angle_error_mean),
            image_psnr_db: match (self.image_psnr_db, other.image_psnr_db) {
                (Some(a), Some(b)) => Some(a.min(b)),
                (a, b) => a.or(b),
            },
        }
    }
}

/// Those of the asset's atlases; nothing where there are none, or one cannot be read.
pub(super) fn read(output_root: &Path, record: &Record) -> Option<Figures> {
    let inside = |file: &&String| !file.split('/').any(|part| part == "..");
    let mut all: Option<Figures> = None;
    let mut add = |figures: Figures| {
        all = Some(match all.take() {
            Some(all) => all.with(&figures),
            None => figures,
        });
    };
    for file in record.files.iter().filter(inside) {
        let (folder, name) = file.rsplit_once('/')?;
        // A file that is gone or broken says nothing; `verify` is there to find it.
        let read = || read_bounded(&output_root.join(file), JSON_LIMIT).ok();
        if name == "atlas.json" {
            add(Figures::of(&serde_json::from_slice(&read()?).ok()?));
        } else if name == COMPONENTS && folder == record.id {
            let document: components::Document = serde_json::from_slice(&read()?).ok()?;
            let listed = document.components.iter();
            let listed = listed.filter_map(|entry| entry.figures.as_ref());
            listed.map(Figures::listed).for_each(&mut add);
        }
    }
    all
}
