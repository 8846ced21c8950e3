//! The images and seams of a folder, as rebuilding takes them.

use super::{Images, PatchImage, RebuildError, Rebuilt};
use crate::atlas::patches::{Domain, Seam, SeamSample};
use crate::geometry::ids::PatchId;
use crate::read::atlas::{BOUNDARY, ImageFolder, StatedTopology};

/// The seams of a folder.
///
/// # Errors
/// A seam of a patch that is not there.
pub fn stored_seams(folder: &ImageFolder) -> Result<Vec<Seam>, RebuildError> {
    folder
        .seam_patch
        .iter()
        .zip(folder.seam_offset.windows(2))
        .enumerate()
        .map(|(id, (patches, range))| {
            let rows = range[0] as usize..range[1] as usize;
            let samples = folder.seam_position[rows.clone()].iter();
            let known = |patch: u32| match (patch as usize) < folder.images.len() {
                true => Ok(PatchId::new(patch as usize)),
                false => Err(RebuildError::SeamPatch {
                    seam: id,
                    patch: patch as usize,
                    patches: folder.images.len(),
                }),
            };
            Ok(Seam {
                left: known(patches[0])?,
                right: match patches[1] {
                    BOUNDARY => None,
                    patch => Some(known(patch)?),
                },
                samples: samples
                    .zip(&folder.seam_uv[rows])
                    .map(|(&position, &[left, right])| SeamSample {
                        position,
                        left,
                        right,
                    })
                    .collect(),
            })
        })
        .collect::<Result<Vec<Seam>, _>>()
}

/// Rebuilds the mesh of a folder and compares its topology with the one that is stated there.
///
/// # Errors
/// As [`super::rebuild`], and another topology.
pub fn rebuild_stored(folder: &ImageFolder) -> Result<Rebuilt, RebuildError> {
    let seams = stored_seams(folder)?;
    let images = Images {
        patches: folder
            .images
            .iter()
            .map(|image| {
                let domain = match image.is_rectangle {
                    true => Domain::Grid,
                    false => Domain::Flat,
                };
                PatchImage {
                    width: image.width,
                    height: image.height,
                    domain,
                    texel_to_patch: domain.to_centres(image.texel_to_patch),
                    position: &image.position,
                    alpha: &image.alpha,
                }
            })
            .collect(),
        seams: &seams,
        origin: folder.image_origin,
    };
    if let Some(&value) = folder.image_origin.iter().find(|x| !x.is_finite()) {
        return Err(RebuildError::OriginNotFinite { value });
    }
    let mesh = super::rebuild(&images)?;
    let StatedTopology {
        euler_characteristic,
        genus,
        boundary_loops,
    } = folder.topology;
    mesh.expect_topology(euler_characteristic, genus, boundary_loops)?;
    Ok(mesh)
}
