//! From the images of a grid to spline surfaces: what `affine-atlas fit` does.
//!
//! Surfaces are fitted to the images, and joined by what `atlas.json` says of their sides; the surface of the atlas, or another mesh, is
//! only what they are measured against.

use crate::export::ExportError;
use crate::export::folder::{Contents, Staging};
use crate::export::{EncodeError, gismo};
use crate::fit::{self, DEFAULT_SPACING, Errors, FitError, Grids, Measured, PatchErrors, Surfaces};
use crate::geometry::deviation::Triangles;
use crate::outcome::{Failure, FailureKind};
use crate::read::atlas::{FolderError, component_folders, read_images, read_surface};
use crate::read::{self, ReadError, ReadParams};
use std::fmt;
use std::path::{Path, PathBuf};

/// File of the figures.
const FIGURES: &str = "fit.json";
/// Patches that are named to the reader as the farthest off.
const NAMED: usize = 5;

/// What is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct FitParams {
    /// Sample steps a knot interval.
    pub spacing: f64,
    /// Mesh to measure against in place of the atlas's own surface.
    pub against: Option<PathBuf>,
}

impl Default for FitParams {
    fn default() -> Self {
        Self {
            spacing: DEFAULT_SPACING,
            against: None,
        }
    }
}

/// A component with its surfaces.
#[derive(Clone, Debug)]
pub struct FittedComponent {
    /// Name of its folder.
    pub name: String,
    /// What was fitted.
    pub grids: Grids,
    /// The surfaces.
    pub surfaces: Surfaces,
    /// Their errors.
    pub measured: Measured,
}

/// The surfaces of an asset.
#[derive(Clone, Debug)]
pub struct FittedAsset {
    /// One a component.
    pub components: Vec<FittedComponent>,
    /// Sample steps a knot interval.
    pub spacing: f64,
    /// Name of the mesh they were measured against, where it is not the atlas's own surface.
    pub against: Option<String>,
}

/// Why there are no surfaces.
#[derive(Debug, thiserror::Error)]
pub enum FitAssetError {
    /// The folder was refused.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The images do not make surfaces.
    #[error("{name}: {source}")]
    Fit {
        /// Name of the component's folder.
        name: String,
        /// Why.
        source: FitError,
    },
    /// The mesh to measure against was refused.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The surfaces cannot be written.
    #[error(transparent)]
    Export(#[from] ExportError),
}

impl From<&FitAssetError> for Failure {
    fn from(error: &FitAssetError) -> Self {
        Failure {
            kind: match error {
                FitAssetError::Export(_) => FailureKind::Output,
                _ => FailureKind::Input,
            },
            message: error.to_string(),
        }
    }
}

/// Fits and measures the surfaces of every component of an asset's folder.
///
/// # Errors
/// See [`FitAssetError`].
pub fn fit(folder: &Path, params: &FitParams) -> Result<FittedAsset, FitAssetError> {
    let against = match &params.against {
        Some(path) => Some(read::read(path, &ReadParams::default())?.soup),
        None => None,
    };
    let mut components = Vec::new();
    for folder in component_folders(folder)? {
        let name = folder_name(&folder);
        let refused = |source| FitAssetError::Fit {
            name: name.clone(),
            source,
        };
        let grids = fit::grids(&read_images(&folder)?).map_err(refused)?;
        let surfaces = fit::fit(&grids, params.spacing).map_err(refused)?;
        let measured = match &against {
            Some(soup) => measure(&grids, &surfaces, &soup.positions, &soup.faces),
            None => {
                let own = read_surface(&folder)?;
                measure(&grids, &surfaces, &own.positions, &own.faces)
            }
        };
        components.push(FittedComponent {
            measured: measured.map_err(refused)?,
            name,
            grids,
            surfaces,
        });
    }
    let name = |path: &PathBuf| path.file_name().map(|n| n.to_string_lossy().into_owned());
    Ok(FittedAsset {
        components,
        spacing: params.spacing,
        against: params.against.as_ref().and_then(name),
    })
}

/// Its last part; a folder that is given as `.` has one, too.
pub(super) fn folder_name(folder: &Path) -> String {
    let resolved = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
    let name = resolved.file_name().unwrap_or("surfaces".as_ref());
    name.to_string_lossy().into_owned()
}

fn measure(
    grids: &Grids,
    surfaces: &Surfaces,
    positions: &[[f64; 3]],
    faces: &[[u32; 3]],
) -> Result<Measured, FitError> {
    fit::measure(grids, surfaces, Triangles { positions, faces })
}

impl FittedAsset {
    /// Writes the folder `root/name`: NAME.xml for each component, and fit.json. It appears complete or not at all.
    ///
    /// # Errors
    /// Those of the file system, and a folder there that this did not write.
    pub fn write(&self, root: &Path, name: &str) -> Result<(), FitAssetError> {
        let staging = Staging::begin_with(Contents::Fit, root, name)?;
        for component in &self.components {
            let mut file = staging.create(&format!("{}.xml", component.name))?;
            let written = gismo::write(&component.surfaces, &mut file);
            written.map_err(|error| EncodeError::Io(error).at(file.path()))?;
            file.finish()?;
        }
        staging.write(FIGURES, format!("{:#}\n", self.json()).as_bytes())?;
        staging.publish()?;
        Ok(())
    }

    /// All figures, for programs.
    pub fn json(&self) -> serde_json::Value {
        let components: Vec<_> = self.components.iter().map(FittedComponent::json).collect();
        serde_json::json!({
            "format": "affine-atlas-fit",
            "version": 2,
            "degree": fit::DEGREE,
            "spacing": self.spacing,
            "against": self.against,
            "components": components,
        })
    }
}

impl FittedComponent {
    fn json(&self) -> serde_json::Value {
        let errors = |e: &Errors| serde_json::json!({ "rms": e.rms, "max": e.max });
        let surfaces = self.surfaces.patches.iter().zip(&self.grids.patches);
        let patches = surfaces.zip(&self.measured.patches).enumerate();
        let patches = patches.map(|(id, ((surface, grid), error))| {
            serde_json::json!({
                "id": id,
                "block": grid.part.block,
                "cells": [grid.part.first, grid.part.cells],
                "samples": grid.samples,
                "control_points": surface.size(),
                "sample_error": errors(&error.samples),
                "surface_error": errors(&error.surface),
                "folded_area": error.folded,
            })
        });
        let sides =
            |s: fit::PatchSide| serde_json::json!({ "patch": s.patch, "side": s.side.name() });
        let neighbours = &self.surfaces.neighbours;
        let seams = neighbours.interfaces.iter().zip(&self.measured.seams);
        let interfaces = seams.map(|(interface, error)| {
            serde_json::json!({
                "first": sides(interface.first),
                "second": sides(interface.second),
                "reversed": interface.reversed,
                "gap": error.gap,
                "normal_angle": { "mean": error.mean_normal_angle, "max": error.max_normal_angle },
            })
        });
        let Measured {
            all,
            all_seams,
            diagonal,
            ..
        } = &self.measured;
        serde_json::json!({
            "name": self.name,
            "file": format!("{}.xml", self.name),
            "diagonal": diagonal,
            "control_points": self.surfaces.control_points,
            "sample_error": errors(&all.samples),
            "surface_error": errors(&all.surface),
            "folded_area": all.folded,
            "gap": all_seams.gap,
            "normal_angle": { "mean": all_seams.mean_normal_angle, "max": all_seams.max_normal_angle },
            "patches": patches.collect::<Vec<_>>(),
            "interfaces": interfaces.collect::<Vec<_>>(),
            "boundary": neighbours.boundary.iter().copied().map(sides).collect::<Vec<_>>(),
        })
    }
}

impl fmt::Display for FittedAsset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.components.iter().try_for_each(|c| c.fmt(f))
    }
}

impl fmt::Display for FittedComponent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plural = |n: usize| if n == 1 { "" } else { "s" };
        let neighbours = &self.surfaces.neighbours;
        let (patches, shared) = (self.surfaces.patches.len(), neighbours.interfaces.len());
        let boundary = neighbours.boundary.len();
        let last = self.grids.patches.last();
        let blocks = last.map_or(0, |grid| grid.part.block + 1);
        writeln!(
            f,
            "{}: {patches} bicubic surface{} on {blocks} block{}, {shared} shared side{}, {boundary} on the boundary, {} control points",
            self.name,
            plural(patches),
            plural(blocks),
            plural(shared),
            self.surfaces.control_points,
        )?;
        let Measured {
            patches,
            all,
            all_seams,
            diagonal,
            ..
        } = &self.measured;
        let part = |x: f64| x / diagonal;
        let PatchErrors {
            samples,
            surface,
            folded,
        } = all;
        for (what, errors) in [("samples", samples), ("surface", surface)] {
            writeln!(
                f,
                "  from the {what}: RMS {:.3e}, at most {:.3e} (of the diagonal {diagonal:.6})",
                part(errors.rms),
                part(errors.max)
            )?;
        }
        writeln!(
            f,
            "  across shared sides: gap {:.1e} of the diagonal; normals turn by {:.2} degrees on average, {:.1} at most",
            part(all_seams.gap),
            all_seams.mean_normal_angle.to_degrees(),
            all_seams.max_normal_angle.to_degrees(),
        )?;
        let with_folds = patches.iter().filter(|errors| errors.folded > 0.0).count();
        writeln!(
            f,
            "  turned over: {:.1e} of the area, in {with_folds} of {} surfaces",
            folded,
            patches.len(),
        )?;
        let mut order: Vec<usize> = (0..patches.len()).collect();
        let max = |i: usize| patches[i].surface.max;
        order.sort_by(|&a, &b| max(b).total_cmp(&max(a)).then(a.cmp(&b)));
        let named = order.iter().take(NAMED);
        let named: Vec<String> = named
            .map(|&i| format!("{i} ({:.1e})", part(max(i))))
            .collect();
        writeln!(f, "  farthest off: surface {}", named.join(", "))
    }
}
