//! `components.json`: the components of an asset that are too many for a folder each.
//!
//! *Enters:* figures of each atlas, or why there is none. *Leaves:* the file beside `surface.glb`, which holds their surfaces.

use super::atlas_json::{FORMAT_VERSION, Generator};
use super::manifest::ComponentRecord;
use super::names::COMPONENTS;
use super::{ExportError, Provenance, folder::Staging};
use crate::geometry::mesh::bounding_box;
use crate::outcome::ComponentOutcome;
use crate::product::AffineAtlas;
use serde::{Deserialize, Serialize};

/// The file, key by key.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Document {
    /// `"affine-atlas"`.
    pub format: String,
    /// Version of the format.
    pub version: u32,
    /// Program that wrote it.
    pub generator: Generator,
    /// What the asset was made from.
    pub source: Source,
    /// All components, in order.
    pub components: Vec<Entry>,
}

/// The file without its components.
#[derive(Serialize)]
struct Head<'a> {
    format: &'a str,
    version: u32,
    generator: &'a Generator,
    source: &'a Source,
}

/// What the asset was made from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Source {
    /// Input file as given; never absolute.
    pub path: String,
    /// BLAKE3 hash of the input, hexadecimal.
    pub blake3: String,
    /// BLAKE3 hash of the configuration, hexadecimal.
    pub config_blake3: String,
}

/// One component.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Entry {
    /// What the manifest says of it.
    #[serde(flatten)]
    pub record: ComponentRecord,
    /// Of its atlas, where it was built.
    pub figures: Option<Figures>,
}

/// The figures of an atlas.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Figures {
    /// Vertices of the surface that the charts are defined on.
    pub vertices: usize,
    /// Its faces.
    pub faces: usize,
    /// Its genus.
    pub genus: i64,
    /// Its boundary loops.
    pub boundary_loops: usize,
    /// Lower corner of its bounding box, source units.
    pub low: [f64; 3],
    /// Upper corner.
    pub high: [f64; 3],
    /// Number of cones.
    pub cones: usize,
    /// Number of patches.
    pub patches: usize,
    /// Cells of its grid, where it has one.
    pub cells: Option<usize>,
    /// Its irregular points, likewise.
    #[serde(default)]
    pub irregular_points: Option<usize>,
    /// max |K − K̄|, radians.
    pub max_curvature_error: f64,
    /// (9), both areas normalised to 1.
    pub area_distortion: f64,
    /// Standard deviation of the log scale, by area.
    pub log_scale_std: f64,
    /// Mean angle error, radians.
    pub angle_error_mean: f64,
    /// Surface rebuilt from the images, decibels.
    pub image_psnr_db: Option<f64>,
}

impl Source {
    /// What the files of a component say of the asset.
    #[must_use]
    pub fn of(provenance: &Provenance) -> Self {
        Self {
            path: provenance.public_path(),
            blake3: provenance.blake3.to_owned(),
            config_blake3: provenance.config_blake3.to_owned(),
        }
    }
}

impl Entry {
    /// Of a component that was built, with its figures, or was not.
    #[must_use]
    pub fn new(outcome: &ComponentOutcome, figures: Option<Figures>) -> Self {
        Self {
            record: ComponentRecord::of(outcome),
            figures,
        }
    }
}

impl Figures {
    /// Those of an atlas.
    #[must_use]
    pub fn of(atlas: &AffineAtlas) -> Self {
        let (low, high) = bounding_box(atlas.mesh.positions.as_slice());
        Self {
            vertices: atlas.topology.vertices,
            faces: atlas.topology.faces,
            genus: atlas.topology.genus,
            boundary_loops: atlas.topology.boundary_loops,
            low,
            high,
            cones: atlas.prescription.cones.len(),
            patches: atlas.patches.patches.len(),
            cells: atlas.grid.as_ref().map(|grid| grid.cells()),
            irregular_points: atlas.grid.as_ref().map(|grid| grid.irregular().len()),
            max_curvature_error: atlas.metric.max_curvature_error,
            area_distortion: atlas.quality.area_distortion,
            log_scale_std: atlas.quality.log_scale.std,
            angle_error_mean: atlas.quality.angle_error.mean,
            image_psnr_db: atlas.quality.image_psnr_db,
        }
    }
}

impl Document {
    /// The file of these components.
    #[must_use]
    pub fn new(source: Source, components: Vec<Entry>) -> Self {
        Self {
            format: "affine-atlas".into(),
            version: FORMAT_VERSION,
            generator: Generator {
                name: env!("CARGO_PKG_NAME").into(),
                version: env!("CARGO_PKG_VERSION").into(),
            },
            source,
            components,
        }
    }

    /// Its text, one line a component.
    fn to_text(&self) -> String {
        let head = Head {
            format: &self.format,
            version: self.version,
            generator: &self.generator,
            source: &self.source,
        };
        let line = |entry: &Entry| serde_json::to_string(entry).expect("no maps");
        let lines: Vec<String> = self.components.iter().map(line).collect();
        let head = serde_json::to_string_pretty(&head).expect("no maps");
        let head = head.strip_suffix("\n}").unwrap_or(&head);
        format!(
            "{head},\n  \"components\": [\n    {}\n  ]\n}}\n",
            lines.join(",\n    ")
        )
    }

    /// Writes it into a staging folder.
    ///
    /// # Errors
    /// Where the file cannot be written.
    pub fn write(&self, staging: &Staging) -> Result<(), ExportError> {
        staging.write(COMPONENTS, self.to_text().as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::sample;
    use crate::geometry::mesh::Appearance;
    use crate::outcome::{Failure, FailureKind};

    #[test]
    fn text_has_a_line_a_component_and_reads_back() {
        let atlas = sample::torus(5, 3);
        let built = ComponentOutcome {
            index: 0,
            result: Ok(crate::outcome::Summary::of(&atlas, "out/many".into())),
        };
        let failed = ComponentOutcome {
            index: 1,
            result: Err(Failure {
                kind: FailureKind::Input,
                message: "one \"side\" }".into(),
            }),
        };
        let figures = Figures::of(&atlas);
        let entries = vec![
            Entry::new(&built, Some(figures.clone())),
            Entry::new(&failed, None),
        ];
        let appearance = Appearance::default();
        let source = Source::of(&sample::provenance(&appearance));
        let document = Document::new(source, entries);
        let text = document.to_text();
        assert_eq!(serde_json::from_str::<Document>(&text).unwrap(), document);
        let lines = text.lines().filter(|line| line.contains("\"component\":"));
        assert_eq!(lines.count(), 2);
        assert!(
            (0..3).all(|i| figures.low[i] < figures.high[i] || i == 2),
            "{figures:?}"
        );
    }
}
