//! From a folder of images back to a mesh: what `affine-atlas rebuild` does.
//!
//! Uses the images, the seam samples and `atlas.json`, never the surface that the folder holds too.

use crate::export::ExportError;
use crate::export::glb::plain::{self, Component};
use crate::geometry::connectivity::Topology;
use crate::geometry::deviation::{Deviation, Sampling, Triangles, deviation};
use crate::geometry::mesh::{bounding_box, distance};
use crate::outcome::{Failure, FailureKind};
use crate::read::atlas::{FolderError, component_folders, read_images};
use crate::read::{self, ReadError, ReadParams};
use crate::rebuild::{RebuildError, Rebuilt, rebuild_stored};
use crate::repair::{self, ComponentError, RepairError, RepairParams};
use std::fmt;
use std::path::Path;

/// How densely the rebuilt mesh is compared with another.
const SAMPLING: Sampling = Sampling {
    samples: 200_000,
    vertices: usize::MAX,
};

/// A component that was rebuilt.
#[derive(Clone, Debug)]
pub struct RebuiltComponent {
    /// Name of its folder.
    pub name: String,
    /// The mesh.
    pub mesh: Rebuilt,
    /// Images it was made of.
    pub images: usize,
    /// Their texels together.
    pub texels: usize,
    origin: [f64; 3],
}

/// How far a rebuilt mesh is from the one it was compared with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compared {
    /// Distances and angles.
    pub deviation: Deviation,
    /// Diagonal of the other mesh's bounding box, source units.
    pub diagonal: f64,
}

/// The meshes of an asset.
#[derive(Clone, Debug)]
pub struct RebuiltAsset {
    /// One a component.
    pub components: Vec<RebuiltComponent>,
    /// Against another mesh, where one was given.
    pub compared: Option<Compared>,
}

/// Why there is no mesh.
#[derive(Debug, thiserror::Error)]
pub enum RebuildAssetError {
    /// The folder was refused.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The images do not make a mesh.
    #[error("{name}: {source}")]
    Rebuild {
        /// Name of the component's folder.
        name: String,
        /// Why.
        source: RebuildError,
    },
    /// The mesh to compare with was refused.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// Its triangles were refused.
    #[error(transparent)]
    Repair(#[from] RepairError),
    /// A component of it was refused.
    #[error(transparent)]
    Component(#[from] ComponentError),
    /// The mesh cannot be written.
    #[error(transparent)]
    Export(#[from] ExportError),
}

impl From<&RebuildAssetError> for Failure {
    fn from(error: &RebuildAssetError) -> Self {
        Failure {
            kind: match error {
                RebuildAssetError::Export(_) => FailureKind::Output,
                _ => FailureKind::Input,
            },
            message: error.to_string(),
        }
    }
}

/// Rebuilds every component of an asset's folder, and compares them with a mesh where one is given.
///
/// # Errors
/// See [`RebuildAssetError`].
pub fn rebuild(folder: &Path, against: Option<&Path>) -> Result<RebuiltAsset, RebuildAssetError> {
    let mut components = Vec::new();
    for folder in component_folders(folder)? {
        let name = folder.file_name().unwrap_or(folder.as_os_str());
        let name = name.to_string_lossy().into_owned();
        let stored = read_images(&folder)?;
        let mesh = rebuild_stored(&stored).map_err(|source| RebuildAssetError::Rebuild {
            name: name.clone(),
            source,
        })?;
        components.push(RebuiltComponent {
            name,
            mesh,
            images: stored.images.len(),
            texels: stored.images.iter().map(|i| i.width * i.height).sum(),
            origin: stored.image_origin,
        });
    }
    let compared = match against {
        Some(path) => compare(&components, path)?,
        None => None,
    };
    Ok(RebuiltAsset {
        components,
        compared,
    })
}

/// Several meshes as one.
#[derive(Default)]
struct Merged {
    positions: Vec<[f64; 3]>,
    faces: Vec<[u32; 3]>,
}

impl Merged {
    fn add(&mut self, positions: &[[f64; 3]], faces: &[[u32; 3]]) {
        let first = self.positions.len() as u32;
        self.positions.extend(positions);
        self.faces
            .extend(faces.iter().map(|f| f.map(|v| first + v)));
    }

    fn triangles(&self) -> Triangles<'_> {
        Triangles {
            positions: &self.positions,
            faces: &self.faces,
        }
    }
}

/// All components together against a whole file, repaired as a build would.
fn compare(
    components: &[RebuiltComponent],
    path: &Path,
) -> Result<Option<Compared>, RebuildAssetError> {
    let asset = read::read(path, &ReadParams::default())?;
    let repaired = repair::repair(&asset.soup, &RepairParams::default())?;
    let (mut ours, mut theirs) = (Merged::default(), Merged::default());
    for component in components {
        ours.add(&component.mesh.positions, &component.mesh.faces);
    }
    for component in repaired.components {
        let mut mesh = component.mesh?;
        component.frame.leave_all(&mut mesh.positions);
        theirs.add(mesh.positions.as_slice(), &mesh.connectivity.to_faces());
    }
    let (low, high) = bounding_box(&theirs.positions);
    let measured = deviation(theirs.triangles(), ours.triangles(), SAMPLING);
    Ok(measured.map(|deviation| Compared {
        deviation,
        diagonal: distance(low, high),
    }))
}

impl RebuiltAsset {
    /// All meshes as one GLB.
    ///
    /// # Errors
    /// More bytes than the format can hold.
    pub fn glb(&self) -> Result<Vec<u8>, ExportError> {
        let components: Vec<Component> = self
            .components
            .iter()
            .map(|c| Component {
                name: &c.name,
                positions: &c.mesh.positions,
                normals: None,
                faces: &c.mesh.faces,
                origin: c.origin,
            })
            .collect();
        plain::encode(&components)
    }

    /// The same figures as `Display`, for programs.
    pub fn json(&self) -> serde_json::Value {
        let components = self.components.iter().map(|c| {
            serde_json::json!({
                "name": c.name,
                "images": c.images,
                "texels": c.texels,
                "vertices": c.mesh.topology.vertices,
                "faces": c.mesh.topology.faces,
                "euler_characteristic": c.mesh.topology.euler_characteristic,
                "genus": c.mesh.topology.genus,
                "boundary_loops": c.mesh.topology.boundary_loops,
            })
        });
        let compared = self.compared.map(|c| {
            serde_json::json!({
                "psnr_db": c.deviation.psnr(c.diagonal),
                "rms": c.deviation.rms,
                "hausdorff": c.deviation.hausdorff,
                "normal_error": { "mean": c.deviation.mean_normal_angle, "max": c.deviation.max_normal_angle },
                "diagonal": c.diagonal,
            })
        });
        serde_json::json!({ "components": components.collect::<Vec<_>>(), "compared": compared })
    }
}

impl fmt::Display for RebuiltAsset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for component in &self.components {
            let Topology {
                vertices,
                faces,
                genus,
                boundary_loops,
                ..
            } = component.mesh.topology;
            let (images, texels) = (component.images, component.texels);
            let plural = |n: usize| if n == 1 { "" } else { "s" };
            writeln!(
                f,
                "{}: {images} image{}, {texels} texels -> {vertices} vertices, {faces} faces, genus {genus}, {boundary_loops} boundary loop{}",
                component.name,
                plural(images),
                plural(boundary_loops),
            )?;
        }
        if let Some(Compared {
            deviation,
            diagonal,
        }) = self.compared
        {
            let part = |x: f64| x / diagonal;
            match deviation.psnr(diagonal) {
                Some(psnr) => write!(f, "PSNR {psnr:.2} dB, ")?,
                None => write!(f, "no difference, ")?,
            }
            writeln!(
                f,
                "RMS {:.3e}, Hausdorff {:.3e} (of the diagonal {diagonal:.6}); normals off by {:.2} degrees on average, {:.1} at most",
                part(deviation.rms),
                part(deviation.hausdorff),
                deviation.mean_normal_angle.to_degrees(),
                deviation.max_normal_angle.to_degrees(),
            )?;
        }
        Ok(())
    }
}
