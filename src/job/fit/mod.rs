//! From a mesh, or the folder of its atlas, to spline surfaces: what `affine-atlas fit` does.
//!
//! A folder has a grid already. Of a mesh the flat metric is computed once, and grids are laid on it as asked: with a number of cells, or
//! the coarsest whose surface is near enough.

mod search;
mod text;
mod write;

use super::components::Observed;
use super::{BuildError, folder_name};
use crate::config::ConfigError;
use crate::export::ExportError;
use crate::export::fit::document::{self, Component, Document};
use crate::export::step::LengthUnit;
use crate::grid::GridError;
use crate::observe::Observer;
use crate::outcome::{Failure, FailureKind};
use crate::read::atlas::{FolderError, component_folders};
use crate::read::gridded::read_gridded;
use crate::spline::cad::Faces;
use crate::spline::patches::Patches;
use crate::spline::tessellation::Tessellation;
use crate::spline::voids::{Closed, inside_out, voids};
use crate::spline::{self, Gridded, Spline, SplineError};
use std::path::Path;

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitParams {
    /// The grid, where the input is a mesh.
    pub size: Size,
    /// Most by which normals of faces in STEP files are to differ beside irregular points, radians.
    pub angle: f64,
    /// What source units are.
    pub unit: LengthUnit,
}

impl Default for FitParams {
    fn default() -> Self {
        Self {
            size: Size::Default,
            angle: spline::DEFAULT_ANGLE.to_radians(),
            unit: LengthUnit::Millimetre,
        }
    }
}

/// How fine the grid is to be.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Size {
    /// As a build would make it, or as it is in the folder.
    #[default]
    Default,
    /// About so many cells, shared among components by area.
    Cells(usize),
    /// The coarsest with which no place of the mesh is farther from the surface than this part of the diagonal of its component.
    OfDiagonal(f64),
    /// Or than this length, source units.
    Length(f64),
}

/// A component with its surface.
#[derive(Clone, Debug)]
pub struct FittedComponent {
    /// Name.
    pub name: String,
    /// Whether the mesh is inside out there; the surface looks outward.
    pub inside_out: bool,
    /// The component whose cavity this bounds, by its place among them: its faces are in that one's STEP file.
    pub void_of: Option<usize>,
    /// Its surface.
    pub spline: Spline,
    /// The same for CAD.
    pub faces: Faces,
    /// The same for analysis.
    pub patches: Patches,
}

/// A component without a surface.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unfitted {
    /// Name.
    pub name: String,
    /// Why.
    pub failure: Failure,
}

/// The surfaces of an asset.
#[derive(Clone, Debug)]
pub struct FittedAsset {
    /// One a component that has one.
    pub components: Vec<FittedComponent>,
    /// The others.
    pub unfitted: Vec<Unfitted>,
    /// What was asked for.
    pub params: FitParams,
}

/// Why there are no surfaces.
#[derive(Debug, thiserror::Error)]
pub enum FitAssetError {
    /// The folder was refused.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A grid is there already.
    #[error(
        "{} holds a grid of its own: give the mesh in place of the folder to choose the cells, or build it with grid.cells",
        path.display()
    )]
    HasGrid {
        /// The folder.
        path: std::path::PathBuf,
    },
    /// The mesh was refused, or its flow.
    #[error(transparent)]
    Build(#[from] BuildError),
    /// There is no grid.
    #[error("{name} has no integer grid to lay a surface on: {source}")]
    Grid {
        /// Name of the component.
        name: String,
        /// Why.
        source: GridError,
    },
    /// Not near enough with as many cells as are tried.
    #[error(
        "{name}: with {cells} cells the surface is still up to {reached:.3e} of the diagonal from the mesh, and {wanted:.3e} was asked for; ask for a larger --tolerance"
    )]
    Tolerance {
        /// Name of the component.
        name: String,
        /// Most cells that were tried.
        cells: usize,
        /// Largest distance there, of the diagonal.
        reached: f64,
        /// What was asked for, of the diagonal.
        wanted: f64,
    },
    /// The grid makes no surface.
    #[error("{name}: {source}")]
    Spline {
        /// Name of the component.
        name: String,
        /// Why.
        source: SplineError,
    },
    /// The surfaces cannot be written.
    #[error(transparent)]
    Export(#[from] ExportError),
}

impl From<ConfigError> for FitAssetError {
    fn from(error: ConfigError) -> Self {
        BuildError::from(error).into()
    }
}

impl From<&FitAssetError> for Failure {
    fn from(error: &FitAssetError) -> Self {
        match error {
            FitAssetError::Build(error) => Failure::from(error),
            FitAssetError::Export(_) => Failure {
                kind: FailureKind::Output,
                message: error.to_string(),
            },
            _ => Failure {
                kind: FailureKind::Input,
                message: error.to_string(),
            },
        }
    }
}

/// Fits the surfaces of every component of a mesh, or of an asset's folder. One that has none does not spoil the others.
///
/// # Errors
/// What concerns the whole asset, and where no component has a surface, what is wrong with the first; see [`FitAssetError`].
pub fn fit(
    input: &Path,
    params: &FitParams,
    observer: &dyn Observer,
) -> Result<FittedAsset, FitAssetError> {
    let splines = match input.is_dir() {
        true => of_folder(input, params, observer)?,
        false => search::of_mesh(input, params, observer)?,
    };
    let count = splines.len();
    let (mut components, mut unfitted, mut first) = (Vec::new(), Vec::new(), None);
    let mut fitted_as = vec![None; count];
    for (index, (name, placed, spline)) in oriented(splines).into_iter().enumerate() {
        enter(observer, "B-splines", index, count)?;
        let fitted = spline.and_then(|spline| {
            let (faces, patches) = spline.b_splines(params.angle).map_err(of_spline(&name))?;
            Ok((spline, faces, patches))
        });
        match fitted {
            Ok((spline, faces, patches)) => {
                fitted_as[index] = Some(components.len());
                components.push(FittedComponent {
                    name,
                    inside_out: placed.inside_out,
                    void_of: placed.void_of,
                    spline,
                    faces,
                    patches,
                });
            }
            Err(error) => {
                let failure = Failure::from(&error);
                unfitted.push(Unfitted { name, failure });
                first.get_or_insert(error);
            }
        }
    }
    for component in &mut components {
        component.void_of = component.void_of.and_then(|index| fitted_as[index]);
    }
    match first {
        Some(error) if components.is_empty() => Err(error),
        _ => Ok(FittedAsset {
            components,
            unfitted,
            params: *params,
        }),
    }
}

/// Turns over what is inside out, and finds out what bounds cavities of others.
fn oriented(splines: Splines) -> Vec<(String, Placed, Result<Spline, FitAssetError>)> {
    let closed = |(_, spline): &(String, Result<Spline, FitAssetError>)| {
        let spline = spline.as_ref().ok().filter(|spline| spline.is_closed());
        spline.map(Spline::tessellation)
    };
    let mut surfaces: Vec<Option<Tessellation>> = splines.iter().map(closed).collect();
    let turned = inside_out(&all(&surfaces));
    for (surface, _) in surfaces
        .iter_mut()
        .zip(&turned)
        .filter(|(_, turned)| **turned)
    {
        let faces = surface.iter_mut().flat_map(|surface| &mut surface.faces);
        faces.for_each(|[_, b, c]| std::mem::swap(b, c));
    }
    let voids = voids(&all(&surfaces));
    let placed = turned.into_iter().zip(voids);
    let each = splines.into_iter().zip(placed);
    let each = each.map(|((name, spline), (inside_out, void_of))| {
        let spline = spline.and_then(|spline| match inside_out {
            true => spline.turned_over().map_err(of_spline(&name)),
            false => Ok(spline),
        });
        let placed = Placed {
            inside_out,
            void_of,
        };
        (name, placed, spline)
    });
    each.collect()
}

/// How a surface lies among the others.
#[derive(Clone, Copy)]
struct Placed {
    inside_out: bool,
    void_of: Option<usize>,
}

fn all(surfaces: &[Option<Tessellation>]) -> Vec<Option<Closed<'_>>> {
    let surfaces = surfaces.iter().map(Option::as_ref);
    let closed = surfaces.map(|surface| {
        surface.map(|s| Closed {
            points: &s.points,
            faces: &s.faces,
        })
    });
    closed.collect()
}

/// Tells that a stage begins, unless the job was to stop.
fn enter(
    observer: &dyn Observer,
    stage: &'static str,
    component: usize,
    components: usize,
) -> Result<(), BuildError> {
    Observed {
        observer,
        component,
        components,
    }
    .enter(stage)
}

/// Of every component its name and surface, or why it has none.
type Splines = Vec<(String, Result<Spline, FitAssetError>)>;

fn of_spline(name: &str) -> impl Fn(SplineError) -> FitAssetError {
    let name = name.to_owned();
    move |source| FitAssetError::Spline {
        name: name.clone(),
        source,
    }
}

fn of_folder(
    folder: &Path,
    params: &FitParams,
    observer: &dyn Observer,
) -> Result<Splines, FitAssetError> {
    let folders = component_folders(folder)?;
    if params.size != Size::Default {
        return Err(FitAssetError::HasGrid {
            path: folder.to_owned(),
        });
    }
    let splines = folders.iter().enumerate().map(|(index, folder)| {
        enter(observer, "spline", index, folders.len())?;
        let name = folder_name(folder);
        let gridded = gridded(folder).map_err(FitAssetError::from);
        let spline = gridded.and_then(|gridded| spline::fit(&gridded).map_err(of_spline(&name)));
        Ok((name, spline))
    });
    splines.collect()
}

/// The surface of one component's folder with its grid.
///
/// # Errors
/// A folder without a grid, and files that are missing, damaged, or do not fit each other.
pub fn gridded(folder: &Path) -> Result<Gridded, FolderError> {
    let surface = read_gridded(folder)?;
    Ok(Gridded {
        positions: surface.positions,
        faces: surface.faces,
        block: surface.patch,
        uv: surface.patch_uv,
        points: surface.quads.points,
        cells: surface.quads.cells,
        cell_block: surface.quads.patch,
        cell_at: surface.quads.at,
    })
}

impl Unfitted {
    fn described(&self) -> document::Unfitted {
        document::Unfitted {
            name: self.name.clone(),
            reason: self.failure.message.clone(),
        }
    }
}

impl FittedAsset {
    /// All figures.
    pub fn document(&self) -> Document {
        let components = self.components.iter().map(|c| {
            let FittedComponent {
                name,
                inside_out,
                void_of,
                spline,
                faces,
                patches,
            } = c;
            let void_of = void_of.map(|i| self.components[i].name.clone());
            Component {
                inside_out: *inside_out,
                void_of,
                ..Component::new(name, spline, faces, patches)
            }
        });
        Document {
            format: "affine-atlas-fit".to_owned(),
            version: 3,
            generator: concat!("affine-atlas ", env!("CARGO_PKG_VERSION")).to_owned(),
            unit: self.params.unit.name().to_owned(),
            angle_degrees: self.params.angle.to_degrees(),
            components: components.collect(),
            unfitted: self.unfitted.iter().map(Unfitted::described).collect(),
        }
    }
}
