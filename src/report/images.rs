//! How well the images hold the surface, against the surface that came in: images of blocks by themselves, flat images by the mesh rebuilt from them.

use super::blocks::SurfaceImages;
use crate::atlas::patch::Domain;
use crate::geometry::connectivity::Topology;
use crate::geometry::deviation::{Deviation, Sampling, Triangles, deviation_and_distances};
use crate::geometry::mesh::{bounding_box, distance};
use crate::product::{MeanMax, Quality};
use crate::rebuild::{Images, rebuild};

/// Samples on each side for each face of the source, and the range that they are held to. On six models the PSNR is then within 1.1 dB of what
/// 400,000 samples give, on five of them within 0.7 dB; where the error sits in few places it is off by more than where it is spread.
const SAMPLES_OF_FACE: usize = 4;
const SAMPLES: [usize; 2] = [1_500, 10_000];
/// But no more than texels, above this number: hundreds of small components are to cost no more than one large one.
const LEAST_SAMPLES: usize = 500;
/// Samples for each vertex that is tested: these matter for the largest distance only.
const SAMPLES_OF_VERTEX: usize = 4;

/// Images of so many texels are measured whatever was asked for, …
const MEASURED_TEXELS: usize = 3_500_000;
/// … and so many times what was asked for: tens of thousands of patches have images of many more texels, and the mesh rebuilt from these fills the memory.
const MEASURED_BUDGETS: usize = 2;

/// Fills in what is measured on images against `source`, the surface after repair; and gives the distances of the mesh's vertices from them where
/// `with_vertices`. Flat images that do not make a mesh of the surface's topology, or have far more texels than the `budget` that was asked for, are not
/// measured, which is said as a warning: charts and transitions are as good as they are.
pub fn measure_images(
    quality: Quality,
    source: Triangles<'_>,
    surface: &SurfaceImages<'_>,
    topology: Topology,
    budget: usize,
    with_vertices: bool,
) -> (Quality, Option<Vec<f64>>) {
    let texels = surface
        .images
        .iter()
        .map(|image| image.width * image.height);
    let samples = (SAMPLES_OF_FACE * source.faces.len())
        .clamp(SAMPLES[0], SAMPLES[1])
        .min(texels.sum::<usize>().max(LEAST_SAMPLES));
    let is_grid = (surface.layout.patches.iter()).all(|patch| patch.domain == Domain::Grid);
    let found = match is_grid {
        true => surface.deviation_of_blocks(source, samples),
        false => deviation_of_flat(source, surface, topology, budget, samples, with_vertices),
    };
    let Some((found, distances)) = found else {
        return (quality, None);
    };
    let (low, high) = bounding_box(source.positions);
    let quality = Quality {
        image_psnr_db: found.psnr(distance(low, high)),
        image_hausdorff: Some(found.hausdorff),
        image_normal_error: Some(MeanMax {
            mean: found.mean_normal_angle,
            max: found.max_normal_angle,
        }),
        ..quality
    };
    (quality, Some(distances).filter(|_| with_vertices))
}

/// Measures the mesh that flat images make.
fn deviation_of_flat(
    source: Triangles<'_>,
    surface: &SurfaceImages<'_>,
    topology: Topology,
    budget: usize,
    samples: usize,
    with_vertices: bool,
) -> Option<(Deviation, Vec<f64>)> {
    let images = Images::new(surface.layout, surface.images, surface.origin);
    let (texels, most) = (
        images.texels(),
        MEASURED_TEXELS.max(MEASURED_BUDGETS * budget),
    );
    if texels > most {
        tracing::warn!(
            texels,
            most,
            "the images were not measured: they have too many texels"
        );
        return None;
    }
    let rebuilt = rebuild(&images).and_then(|mesh| {
        let loops = topology.boundary_loops as i64;
        mesh.expect_topology(topology.euler_characteristic, topology.genus, loops)?;
        Ok(mesh)
    });
    let (positions, faces) = match rebuilt {
        Ok(mesh) => (mesh.positions, mesh.faces),
        Err(error) => {
            tracing::warn!(%error, "the images could not be measured");
            return None;
        }
    };
    let rebuilt = Triangles {
        positions: &positions,
        faces: &faces,
    };
    let sampling = Sampling {
        samples,
        vertices: samples / SAMPLES_OF_VERTEX,
    };
    let vertices = match with_vertices {
        true => surface.mesh.positions.as_slice(),
        false => &[],
    };
    deviation_and_distances(source, rebuilt, sampling, vertices)
}
