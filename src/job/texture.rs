//! From an atlas and an image that repeats to a textured surface: what `affine-atlas texture` does.

use super::folder_name;
use crate::atlas::plane::doubled_area;
use crate::export::ExportError;
use crate::export::folder::{Contents, Staging};
use crate::export::glb::textured::{self, Textured};
use crate::export::pictures::colour::to_linear;
use crate::export::pictures::{encode_png, painted as picture};
use crate::geometry::connectivity::ConnectivityError;
use crate::geometry::mesh::{Mesh, triangle_area};
use crate::outcome::{Failure, FailureKind};
use crate::parallel;
use crate::read::atlas::{FolderError, component_folders};
use crate::read::gridded::{GriddedSurface, read_gridded};
use crate::texture::{
    Border, Exemplar, ExemplarError, MOST_COPIES, Painted, Steps, Symmetry, TileSize, Tiling,
    paint, steps, tile_size,
};
use image::{DynamicImage, RgbaImage};
use std::fmt;
use std::path::{Path, PathBuf};

/// Tiles along a side of a cell that may be asked for.
pub const TILES_RANGE: std::ops::RangeInclusive<i64> = 1..=64;
/// Texels along a side of the texture.
pub const DEFAULT_SIZE: u32 = 2048;
/// Texels along a side that may be asked for.
pub const SIZE_RANGE: std::ops::RangeInclusive<i64> = 16..=8192;
/// Texels along a side that each component has at least, unless fewer are asked for.
const LEAST_SIDE: usize = 64;
/// File of the figures.
const FIGURES: &str = "texture.json";
/// Pixels of the picture.
const PICTURE: usize = 1024;

/// What is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureParams {
    /// The image.
    pub pattern: PathBuf,
    /// Tiles along a side of a cell.
    pub tiles: u32,
    /// Texels along a side of the texture; components share out its area by theirs.
    pub size: usize,
}

/// A component with its texture.
#[derive(Clone, Debug)]
pub struct TexturedComponent {
    /// Name of its folder.
    pub name: String,
    /// The surface that it lies on.
    pub surface: GriddedSurface,
    /// The same, for pictures and files.
    pub mesh: Mesh,
    /// Number of cells.
    pub cells: usize,
    /// How large tiles are, source units.
    pub tile_size: TileSize,
    /// The texture.
    pub painted: Painted,
    /// Colour steps.
    pub steps: Steps,
}

/// The textures of an asset.
#[derive(Clone, Debug)]
pub struct TexturedAsset {
    /// One a component.
    pub components: Vec<TexturedComponent>,
    /// File name of the pattern.
    pub pattern: String,
    /// The pattern.
    pub exemplar: Exemplar,
    /// How it lies on the grid.
    pub tiling: Tiling,
    /// How its sides fit.
    pub border: Border,
    /// How a tile changes when it is turned.
    pub symmetry: Symmetry,
}

/// Why there is no texture.
#[derive(Debug, thiserror::Error)]
pub enum TextureAssetError {
    /// The pattern was refused.
    #[error(transparent)]
    Exemplar(#[from] ExemplarError),
    /// The folder was refused.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The faces of a component make no surface.
    #[error("{name}: the faces of atlas.npz make no surface ({source}); build the atlas again")]
    Connectivity {
        /// Name of the component's folder.
        name: String,
        /// Why.
        source: ConnectivityError,
    },
    /// The texture cannot be written.
    #[error(transparent)]
    Export(#[from] ExportError),
}

impl From<&TextureAssetError> for Failure {
    fn from(error: &TextureAssetError) -> Self {
        Failure {
            kind: match error {
                TextureAssetError::Export(_) => FailureKind::Output,
                _ => FailureKind::Input,
            },
            message: error.to_string(),
        }
    }
}

fn area(surface: &GriddedSurface) -> f64 {
    let corners = |face: &[u32; 3]| face.map(|v| surface.positions[v as usize]);
    let faces = surface.faces.iter();
    faces.map(|face| triangle_area(corners(face))).sum()
}

/// Texels along a side of the texture of a component with this share of the area: all together have as many as that of a single one, but each some.
fn side_of_share(size: usize, share: f64) -> usize {
    let side = (size as f64 * share.sqrt()).ceil() as usize;
    side.clamp(LEAST_SIDE.min(size), size)
}

/// Lays a pattern over every component of an asset's folder.
///
/// # Errors
/// See [`TextureAssetError`].
pub fn texture(folder: &Path, params: &TextureParams) -> Result<TexturedAsset, TextureAssetError> {
    let folders = component_folders(folder)?;
    let exemplar = Exemplar::read(&params.pattern)?;
    let tiling = Tiling::new(params.tiles, exemplar.size());
    let read = |folder: PathBuf| {
        let surface = read_gridded(&folder)?;
        Ok::<_, TextureAssetError>((folder_name(&folder), surface))
    };
    let surfaces: Vec<_> = folders.into_iter().map(read).collect::<Result<_, _>>()?;
    let areas: Vec<f64> = surfaces.iter().map(|(_, surface)| area(surface)).collect();
    let total: f64 = areas.iter().sum();
    let parts = surfaces.into_iter().zip(areas).collect();
    let textured = |((name, surface), area): ((String, GriddedSurface), f64)| {
        let mesh = Mesh::bare(surface.positions.clone(), &surface.faces);
        let mesh = mesh.map_err(|source| TextureAssetError::Connectivity {
            name: name.clone(),
            source,
        })?;
        let size = side_of_share(params.size, area / total);
        let painted = paint(&surface, &tiling, &exemplar, size);
        let on_grid = surface.grid_uv.iter().map(|&uv| 0.5 * doubled_area(uv));
        Ok(TexturedComponent {
            name,
            cells: on_grid.sum::<f64>().round() as usize,
            tile_size: tile_size(&surface, &tiling),
            steps: steps(&surface, &mesh.connectivity, &tiling, &painted),
            mesh,
            painted,
            surface,
        })
    };
    let components = parallel::beside(parts, textured);
    let components = components
        .into_iter()
        .collect::<Result<_, TextureAssetError>>()?;
    let name = params.pattern.file_name().unwrap_or_default();
    Ok(TexturedAsset {
        components,
        pattern: name.to_string_lossy().into_owned(),
        border: exemplar.border(),
        symmetry: exemplar.symmetry(tiling.copies),
        tiling,
        exemplar,
    })
}

impl TexturedAsset {
    /// Writes the folder `root/name`: for each component NAME.png, NAME.glb and NAME.preview.png, and texture.json. It appears complete or
    /// not at all.
    ///
    /// # Errors
    /// Those of the file system, and a folder there that this did not write.
    pub fn write(&self, root: &Path, name: &str) -> Result<(), TextureAssetError> {
        let staging = Staging::begin_with(Contents::Texture, root, name)?;
        let is_transparent = self.exemplar.is_transparent();
        for component in &self.components {
            let file = |extension: &str| format!("{}.{extension}", component.name);
            let of_png = |file: &str, error: image::ImageError| ExportError::Encode {
                path: staging.target().join(file),
                message: error.to_string(),
            };
            let (png_name, preview) = (file("png"), file("preview.png"));
            let png = component.png(is_transparent);
            let png = png.map_err(|e| of_png(&png_name, e))?;
            let glb = textured::encode(&Textured {
                name: &component.name,
                mesh: &component.mesh,
                patch: &component.surface.patch,
                tex_coords: &component.packed(),
                origin: component.surface.origin,
                png: &png,
                is_transparent,
            })?;
            staging.write(&png_name, &png)?;
            staging.write(&file("glb"), &glb)?;
            let picture = encode_png(&component.picture());
            let picture = picture.map_err(|e| of_png(&preview, e))?;
            staging.write(&preview, &picture)?;
        }
        staging.write(FIGURES, format!("{:#}\n", self.json()).as_bytes())?;
        staging.publish()?;
        Ok(())
    }

    /// All figures, for programs. Lengths are source units, colours parts of 255.
    pub fn json(&self) -> serde_json::Value {
        let [width, height] = self.exemplar.size();
        let components = self.components.iter().map(|component| {
            let mut json = component.json(&self.tiling);
            json["warnings"] = self.warnings(component).into();
            json
        });
        serde_json::json!({
            "format": "affine-atlas-texture",
            "version": 2,
            "tiles_per_cell": self.tiling.tiles_per_cell,
            "pattern": {
                "file": self.pattern,
                "width": width,
                "height": height,
                "copies_per_tile": self.tiling.copies,
                "stretched": self.tiling.is_stretched,
                "repeats": self.border.repeats(),
                "border": { "across": self.border.across, "inside": self.border.inside },
                "quarter_turn": { "symmetric": self.symmetry.has_quarter(), "difference": self.symmetry.quarter },
                "half_turn": { "symmetric": self.symmetry.has_half(), "difference": self.symmetry.half },
            },
            "components": components.collect::<Vec<_>>(),
        })
    }

    /// What will show.
    fn warnings(&self, component: &TexturedComponent) -> Vec<String> {
        let mut warnings = Vec::new();
        if !self.border.repeats() {
            let Border { across, inside } = self.border;
            warnings.push(format!(
                "{} does not repeat: its first and last columns differ by {:.1} of 255 and its first and last rows by {:.1}, neighbouring ones by at most {:.1} and {:.1}",
                self.pattern, across[0], across[1], inside[0], inside[1]
            ));
        }
        if self.tiling.is_stretched {
            let [width, height] = self.exemplar.size();
            warnings.push(format!(
                "{} has {width} × {height} pixels, which is no ratio of whole numbers up to {MOST_COPIES}: it is stretched to the square of a tile",
                self.pattern
            ));
        }
        let Symmetry { quarter, half } = self.symmetry;
        let [quarters, halves] = component.turns();
        let turned = if quarters && !self.symmetry.has_quarter() {
            Some((quarter, "quarter"))
        } else if halves && !self.symmetry.has_half() {
            Some((half, "half"))
        } else {
            None
        };
        if let Some((difference, turn)) = turned {
            warnings.push(format!(
                "some transitions are {turn} turns, under which {} changes by {difference:.1} of 255 on average: that shows at the cut",
                self.pattern
            ));
        }
        warnings
    }
}

impl TexturedComponent {
    /// Tiles on the surface.
    #[must_use]
    pub fn tiles(&self, tiling: &Tiling) -> usize {
        let per_cell = tiling.tiles_per_cell as usize;
        self.cells.saturating_mul(per_cell * per_cell)
    }

    /// Whether some transitions are quarter turns, one way or the other, and whether some are half turns.
    fn turns(&self) -> [bool; 2] {
        let turns = self.surface.turns.as_flattened();
        [turns.iter().any(|t| t % 2 == 1), turns.contains(&2)]
    }

    fn packed(&self) -> Vec<[[f64; 2]; 3]> {
        let faces = 0..self.surface.faces.len();
        faces.map(|face| self.surface.packed(face)).collect()
    }

    fn png(&self, is_transparent: bool) -> Result<Vec<u8>, image::ImageError> {
        let side = self.painted.size as u32;
        let texels = self.painted.texels.as_flattened().to_vec();
        // The number of bytes is that of the sides, so that there is an image.
        let image = RgbaImage::from_raw(side, side, texels).unwrap_or_default();
        match is_transparent {
            true => encode_png(&image),
            false => encode_png(&DynamicImage::from(image).into_rgb8()),
        }
    }

    /// The surface with the texture as a viewer has it.
    fn picture(&self) -> image::RgbImage {
        let size = self.painted.size as f64;
        let packed = self.packed();
        let colour = |face: usize, weights: [f64; 3]| {
            let corners = packed[face];
            let [u, v]: [f64; 2] =
                std::array::from_fn(|i| (0..3).map(|k| weights[k] * corners[k][i]).sum());
            let [r, g, b, a] = self.painted.at([size * u, size * (1.0 - v)]);
            let paper = 255.0 - a;
            to_linear([r, g, b].map(|c| (c * a / 255.0 + paper + 0.5) as u8))
        };
        picture(&self.mesh, PICTURE, &colour)
    }

    fn json(&self, tiling: &Tiling) -> serde_json::Value {
        let [quarter, half] = self.turns();
        serde_json::json!({
            "name": self.name,
            "texture": format!("{}.png", self.name),
            "surface": format!("{}.glb", self.name),
            "size": self.painted.size,
            "covered_texels": self.painted.covered,
            "cells": self.cells,
            "tiles": self.tiles(tiling),
            "tile_size": { "p05": self.tile_size.p05, "p95": self.tile_size.p95 },
            "transitions": { "quarter_turns": quarter, "half_turns": half },
            "colour_step": {
                "cut": self.steps.cut,
                "beside_cut": self.steps.beside_cut,
                "seams": self.steps.seams,
                "beside_seams": self.steps.beside_seams,
            },
        })
    }
}

impl fmt::Display for TexturedAsset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for component in &self.components {
            component.describe(&self.tiling, f)?;
            for warning in self.warnings(component) {
                writeln!(f, "  warning: {warning}")?;
            }
        }
        Ok(())
    }
}

impl TexturedComponent {
    fn describe(&self, tiling: &Tiling, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = self.painted.size;
        writeln!(
            f,
            "{}: {} tiles on {} cells, 9 of 10 between {:.6} and {:.6} wide, in {size} × {size} texels, {:.0} % of them in patches",
            self.name,
            self.tiles(tiling),
            self.cells,
            self.tile_size.p05,
            self.tile_size.p95,
            100.0 * self.painted.covered as f64 / (size * size) as f64,
        )?;
        let step = |step: Option<f64>| step.map_or("none".to_owned(), |s| format!("{s:.2}"));
        writeln!(
            f,
            "  mean colour step over two texels, of 255: {} where the grid turns ({} beside it), {} across seams ({} beside them)",
            step(self.steps.cut),
            step(self.steps.beside_cut),
            step(self.steps.seams),
            step(self.steps.beside_seams),
        )
    }
}
