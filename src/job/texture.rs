//! From an atlas and an image that repeats to a textured surface: what `affine-atlas texture` does.

use super::fit::folder_name;
use crate::export::ExportError;
use crate::export::folder::{Contents, Staging};
use crate::export::glb::textured::{self, Textured};
use crate::export::pictures::colour::to_linear;
use crate::export::pictures::{encode_png, painted as picture};
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{FaceVec, NONE, VertexVec};
use crate::geometry::mesh::Mesh;
use crate::outcome::{Failure, FailureKind};
use crate::read::atlas::{FolderError, component_folders};
use crate::read::flat::{FlatSurface, read_flat};
use crate::texture::{
    Border, Exemplar, ExemplarError, Field, Painted, Steps, Symmetry, TextureError, Tile, as_it_is,
    fit, flat_area, paint, steps,
};
use image::{DynamicImage, RgbaImage};
use std::fmt;
use std::path::{Path, PathBuf};

/// Tiles along a side of the flat surface.
pub const DEFAULT_REPEAT: f64 = 16.0;
/// Texels along a side of the texture.
pub const DEFAULT_SIZE: u32 = 2048;
/// Texels along a side that may be asked for.
pub const SIZE_RANGE: std::ops::RangeInclusive<i64> = 16..=8192;
/// File of the figures.
const FIGURES: &str = "texture.json";
/// Pixels of the picture.
const PICTURE: usize = 1024;

/// How large a tile is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TileSize {
    /// So many tiles along a side of a square as large as the flat surface.
    Repeat(f64),
    /// Width, flat units.
    Width(f64),
}

/// What is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct TextureParams {
    /// The image.
    pub pattern: PathBuf,
    /// How large a tile is.
    pub tile: TileSize,
    /// Texels along a side of the texture.
    pub size: usize,
}

/// A component with its texture.
#[derive(Clone, Debug)]
pub struct TexturedComponent {
    /// Name of its folder.
    pub name: String,
    /// The surface that it lies on.
    pub surface: FlatSurface,
    /// The same, for pictures and files.
    pub mesh: Mesh,
    /// Tile as asked for.
    pub asked: Tile,
    /// Tile coordinates.
    pub field: Field,
    /// The texture.
    pub painted: Painted,
    /// Colour steps.
    pub steps: Steps,
    /// Area of the flat surface.
    pub flat_area: f64,
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
    /// How its sides fit.
    pub border: Border,
    /// How it changes when it is turned.
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
    /// The pattern cannot be laid on the surface.
    #[error("{name}: {source}")]
    Texture {
        /// Name of the component's folder.
        name: String,
        /// Why.
        source: TextureError,
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

/// Lays a pattern over every component of an asset's folder.
///
/// # Errors
/// See [`TextureAssetError`].
pub fn texture(folder: &Path, params: &TextureParams) -> Result<TexturedAsset, TextureAssetError> {
    let folders = component_folders(folder)?;
    let exemplar = Exemplar::read(&params.pattern)?;
    let mut components = Vec::new();
    for folder in folders {
        let name = folder_name(&folder);
        let surface = read_flat(&folder)?;
        let refused = |source| TextureAssetError::Texture {
            name: name.clone(),
            source,
        };
        components.push(component(&name, surface, &exemplar, params).map_err(refused)?);
    }
    let name = params.pattern.file_name().unwrap_or_default();
    Ok(TexturedAsset {
        components,
        pattern: name.to_string_lossy().into_owned(),
        border: exemplar.border(),
        symmetry: exemplar.symmetry(),
        exemplar,
    })
}

fn component(
    name: &str,
    surface: FlatSurface,
    exemplar: &Exemplar,
    params: &TextureParams,
) -> Result<TexturedComponent, TextureError> {
    let mesh = mesh(&surface)?;
    let area = flat_area(&surface);
    if !(area > 0.0 && area.is_finite()) {
        return Err(TextureError::NoArea { area });
    }
    let asked = Tile {
        width: match params.tile {
            TileSize::Repeat(count) => area.sqrt() / count,
            TileSize::Width(width) => width,
        },
        aspect: exemplar.aspect(),
    };
    let fitted = fit(&surface, &mesh.connectivity, asked)?;
    let field = fitted.unwrap_or_else(|| as_it_is(&surface, asked));
    let painted = paint(&surface, &field, exemplar, params.size);
    Ok(TexturedComponent {
        name: name.to_owned(),
        steps: steps(&surface, &mesh.connectivity, &painted),
        mesh,
        asked,
        field,
        painted,
        flat_area: area,
        surface,
    })
}

/// The surface without anything that textures do not need.
fn mesh(surface: &FlatSurface) -> Result<Mesh, TextureError> {
    let (vertices, faces) = (surface.positions.len(), surface.faces.len());
    Ok(Mesh {
        connectivity: Connectivity::from_faces(&surface.faces, vertices)?,
        positions: surface.positions.clone().into(),
        source_vertex: VertexVec::filled(NONE, vertices),
        source_face: FaceVec::filled(NONE, faces),
        face_material: FaceVec::filled(NONE, faces),
        attributes: Vec::new(),
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

    /// All figures, for programs. Lengths are flat units, colours parts of 255.
    pub fn json(&self) -> serde_json::Value {
        let [width, height] = self.exemplar.size();
        let components = self.components.iter().map(|component| {
            let mut json = component.json();
            json["warnings"] = self.warnings(component).into();
            json
        });
        serde_json::json!({
            "format": "affine-atlas-texture",
            "version": 1,
            "pattern": {
                "file": self.pattern,
                "width": width,
                "height": height,
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
        let turned = |difference: f64, turn: &str| {
            format!(
                "some transitions are {turn} turns, under which {} changes by {difference:.1} of 255 on average: that shows at the cut",
                self.pattern
            )
        };
        match &component.field.fitted {
            Some(fitted) => {
                let Symmetry { quarter, half } = self.symmetry;
                if let Some(difference) = quarter
                    && fitted.quarter_turned
                    && !self.symmetry.has_quarter()
                {
                    warnings.push(turned(difference, "quarter"));
                } else if fitted.half_turned && !self.symmetry.has_half() {
                    warnings.push(turned(half, "half"));
                }
                if fitted.flipped > 0 {
                    warnings.push(format!(
                        "{} of {} faces are turned over where tiles were moved; smaller tiles are moved less (--repeat)",
                        fitted.flipped,
                        component.surface.faces.len()
                    ));
                }
            }
            None => warnings.push(component.why_not_fitted()),
        }
        warnings
    }
}

impl TexturedComponent {
    /// Width of a tile as it was laid.
    #[must_use]
    pub fn tile_width(&self) -> f64 {
        1.0 / self.field.scale.length()
    }

    /// Tiles on the surface.
    #[must_use]
    pub fn tiles(&self) -> f64 {
        self.flat_area / (self.tile_width().powi(2) * self.asked.aspect)
    }

    fn why_not_fitted(&self) -> String {
        let other = self.surface.segments.iter();
        let other = other.filter(|s| s.quarter_turns.is_none()).count();
        match other {
            0 => format!(
                "some transitions are quarter turns, but the tile is no square (height over width {:.3}): the pattern jumps at the cut",
                self.asked.aspect
            ),
            n => format!(
                "{n} of {} transitions across the cut are no quarter turns: the pattern jumps there (on genus 0, cones.quantum = \"1/2\" makes all of them quarter turns)",
                self.surface.segments.len()
            ),
        }
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
        let colour = |face: usize, weights: [f64; 3], _: f64| {
            let corners = packed[face];
            let [u, v]: [f64; 2] =
                std::array::from_fn(|i| (0..3).map(|k| weights[k] * corners[k][i]).sum());
            let [r, g, b, a] = self.painted.at([size * u, size * (1.0 - v)]);
            let paper = 255.0 - a;
            to_linear([r, g, b].map(|c| (c * a / 255.0 + paper + 0.5) as u8))
        };
        picture(&self.mesh, PICTURE, &colour)
    }

    fn json(&self) -> serde_json::Value {
        let fitted = self.field.fitted.as_ref().map(|f| {
            serde_json::json!({
                "largest_correction": f.largest_correction,
                "stretch": f.stretch,
                "largest_misfit": f.largest_misfit,
                "flipped_faces": f.flipped,
                "quarter_turned": f.quarter_turned,
                "half_turned": f.half_turned,
            })
        });
        let scale = self.field.scale;
        serde_json::json!({
            "name": self.name,
            "texture": format!("{}.png", self.name),
            "surface": format!("{}.glb", self.name),
            "size": self.painted.size,
            "covered_texels": self.painted.covered,
            "tile": {
                "asked_width": self.asked.width,
                "width": self.tile_width(),
                "height": self.tile_width() * self.asked.aspect,
                "rotation": scale.im.atan2(scale.re),
            },
            "tiles": self.tiles(),
            "fitted": fitted,
            "colour_step": {
                "cut": self.steps.cut,
                "beside_cut": self.steps.beside_cut,
                "seams": self.steps.seams,
                "beside_seams": self.steps.beside_seams,
                "inside": self.steps.inside,
                "distance": self.steps.distance,
            },
        })
    }
}

impl fmt::Display for TexturedAsset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for component in &self.components {
            component.fmt(f)?;
            for warning in self.warnings(component) {
                writeln!(f, "  warning: {warning}")?;
            }
        }
        Ok(())
    }
}

impl fmt::Display for TexturedComponent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = self.painted.size;
        writeln!(
            f,
            "{}: {:.1} tiles of width {:.6} ({:.6} asked for) in {size} × {size} texels, {:.0} % of them in patches",
            self.name,
            self.tiles(),
            self.tile_width(),
            self.asked.width,
            100.0 * self.painted.covered as f64 / (size * size) as f64,
        )?;
        if let Some(fitted) = &self.field.fitted {
            writeln!(
                f,
                "  fitted across the cut: moved by at most {:.3} tiles, stretched by {:.1} % (RMS), closed to {:.0e} tiles",
                fitted.largest_correction,
                100.0 * fitted.stretch,
                fitted.largest_misfit,
            )?;
        }
        let step = |step: Option<f64>| step.map_or("none".to_owned(), |s| format!("{s:.2}"));
        writeln!(
            f,
            "  mean colour step over one texel, of 255: {} across the cut ({} beside it), {} across all seams ({} beside them), {} elsewhere",
            step(self.steps.cut),
            step(self.steps.beside_cut),
            step(self.steps.seams),
            step(self.steps.beside_seams),
            step(self.steps.inside),
        )
    }
}
