//! How well the images hold the surface: the mesh rebuilt from them, against the surface that came in.

use crate::geometry::connectivity::Topology;
use crate::geometry::deviation::{Sampling, Triangles, deviation};
use crate::geometry::mesh::{bounding_box, distance};
use crate::product::{MeanMax, Quality};
use crate::rebuild::{Images, Rebuilt, rebuild};

/// Samples on each side. The RMS of so many is off by a few per cent at most (0.2 dB); more would cost more than they tell.
const SAMPLING: Sampling = Sampling {
    samples: 20_000,
    vertices: 20_000,
};

/// Images of so many texels are measured whatever was asked for, …
const MEASURED_TEXELS: usize = 4_500_000;
/// … and so many times what was asked for: tens of thousands of patches have images of many more texels, and the mesh rebuilt from these fills the memory.
const MEASURED_BUDGETS: usize = 2;

/// Fills in what is measured on images, and gives the mesh rebuilt from them; `source` is the surface after repair. Nothing where
/// the images do not make a mesh of the surface's topology, or have far more texels than the `budget` that was asked for, which is said as a warning: charts and transitions
/// are as good as they are.
pub fn measure_images(
    quality: Quality,
    source: Triangles<'_>,
    images: &Images<'_>,
    topology: Topology,
    budget: usize,
) -> (Quality, Option<Rebuilt>) {
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
        return (quality, None);
    }
    let rebuilt = rebuild(images).and_then(|mesh| {
        let Topology {
            euler_characteristic,
            genus,
            boundary_loops,
            ..
        } = topology;
        mesh.expect_topology(euler_characteristic, genus, boundary_loops as i64)?;
        Ok(mesh)
    });
    let mesh = match rebuilt {
        Ok(mesh) => mesh,
        Err(error) => {
            tracing::warn!(%error, "the images could not be measured");
            return (quality, None);
        }
    };
    let rebuilt = Triangles {
        positions: &mesh.positions,
        faces: &mesh.faces,
    };
    let Some(found) = deviation(source, rebuilt, SAMPLING) else {
        return (quality, Some(mesh));
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
    (quality, Some(mesh))
}
