//! Arrays that fit each other, so that the writers can index them.

use crate::export::ExportError;
use crate::product::AffineAtlas;

/// Checks that all arrays of an atlas have the lengths that the files imply, so that the writers can index.
pub fn check_shapes(atlas: &AffineAtlas) -> Result<(), ExportError> {
    let connectivity = &atlas.mesh.connectivity;
    let (vertices, edges, faces) = (
        connectivity.vertex_count(),
        connectivity.edge_count(),
        connectivity.face_count(),
    );
    if faces == 0 {
        return Err(ExportError::Inconsistent {
            what: "faces",
            found: 0,
            expected: 1,
        });
    }
    let mut lengths = vec![
        ("vertex positions", atlas.mesh.positions.len(), vertices),
        ("source vertices", atlas.mesh.source_vertex.len(), vertices),
        ("source faces", atlas.mesh.source_face.len(), faces),
        ("face materials", atlas.mesh.face_material.len(), faces),
        (
            "target curvatures",
            atlas.prescription.target.len(),
            vertices,
        ),
        ("log scales", atlas.metric.log_scale.len(), vertices),
        ("curvatures", atlas.metric.curvature.len(), vertices),
        ("flat lengths", atlas.metric.length.len(), edges),
        ("cut flags", atlas.cut.is_cut.len(), edges),
        ("segment numbers", atlas.cut.segment.len(), edges),
        ("developed faces", atlas.central.uv.len(), faces),
        ("slit corners", atlas.central.copy.len(), 3 * faces),
        (
            "gluings",
            atlas.charts.gluings.len(),
            atlas.cut.segments.len(),
        ),
        ("patch numbers", atlas.patches.face_patch.len(), faces),
        ("patch coordinates", atlas.patches.uv.len(), faces),
        ("images", atlas.images.len(), atlas.patches.patches.len()),
    ];
    if let Some(packed) = &atlas.patches.packed {
        let images = atlas.images.len();
        lengths.push(("places of packed images", packed.corners.len(), images));
    }
    for attribute in &atlas.mesh.attributes {
        lengths.push((
            "attribute values",
            attribute.values.len(),
            3 * faces * attribute.components,
        ));
    }
    for (image, patch) in atlas.images.iter().zip(&atlas.patches.patches) {
        let texels = patch.width.saturating_mul(patch.height);
        lengths.extend([
            ("image columns", image.width, patch.width),
            ("image rows", image.height, patch.height),
            ("texel positions", image.position.len(), texels),
            ("texel alphas", image.alpha.len(), texels),
            ("texel normals", image.normal.len(), texels),
            ("texel faces", image.face.len(), texels),
            ("texel log scales", image.log_scale.len(), texels),
        ]);
        for sampled in &image.attributes {
            lengths.push(("texel attributes", sampled.values.texels(), texels));
        }
    }
    for (what, found, expected) in lengths {
        if found != expected {
            return Err(ExportError::Inconsistent {
                what,
                found,
                expected,
            });
        }
    }
    let packed = atlas.patches.packed.as_ref();
    let ends = packed.map(|packed| {
        let boxes = atlas.images.iter().zip(&packed.corners);
        let ends = boxes.map(|(image, at)| (at[0] + image.width).max(at[1] + image.height));
        (ends.max(), packed.side)
    });
    let (end, side) = ends.unwrap_or_default();
    let bounds = [
        (
            "columns and rows of the packed image",
            end.map(|end| end.saturating_sub(1)),
            side,
        ),
        (
            "patches",
            atlas.patches.face_patch.iter().map(|p| p.index()).max(),
            atlas.patches.patches.len(),
        ),
        (
            "faces that charts name",
            atlas
                .charts
                .charts
                .iter()
                .flat_map(|c| &c.faces)
                .map(|c| c.face.index())
                .max(),
            faces,
        ),
        (
            "cones",
            atlas
                .prescription
                .cones
                .iter()
                .map(|c| c.vertex.index())
                .max(),
            vertices,
        ),
        (
            "halfedges that segments name",
            atlas
                .cut
                .segments
                .iter()
                .flat_map(|s| &s.halfedges)
                .map(|h| h.index())
                .max(),
            3 * faces,
        ),
    ];
    for (what, largest, count) in bounds {
        if let Some(largest) = largest.filter(|&i| i >= count) {
            return Err(ExportError::Inconsistent {
                what,
                found: largest + 1,
                expected: count,
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::sample;

    #[test]
    fn arrays_that_do_not_fit_are_refused() {
        let atlas = sample::torus(4, 3);
        check_shapes(&atlas).unwrap();
        let mut short = atlas.clone();
        short.images[0].alpha.pop();
        assert!(matches!(
            check_shapes(&short),
            Err(ExportError::Inconsistent {
                what: "texel alphas",
                ..
            })
        ));
        let mut wild = atlas;
        wild.patches.face_patch.as_mut_slice()[2] = crate::geometry::ids::PatchId::new(7);
        assert!(matches!(
            check_shapes(&wild),
            Err(ExportError::Inconsistent {
                what: "patches",
                found: 8,
                expected: 1
            })
        ));
    }
}
