//! `atlas.json`: what was computed, from what, and how well.
//!
//! The structs of [`Document`] are the file, key by key. Every float is written with the shortest decimals that read back to the same 64 bits.

mod document;
mod grid;
mod text;

pub use document::*;
pub use grid::{Grid, Irregular, SidePiece};

use crate::atlas::charts::ChartKind;
use crate::atlas::geometry_image::ImageParams;
use crate::atlas::plane::{RigidMotion, wrap_angle};
use crate::export::{ExportError, Provenance, periods};
use crate::flow::prescription::BoundaryCondition;
use crate::geometry::ids::NONE;
use crate::product::AffineAtlas;
use std::f64::consts::FRAC_PI_2;

/// Largest distance from a multiple of π/2 at which a rotation counts as a quarter turn, radians.
pub const QUARTER_TURN_TOLERANCE: f64 = 1e-8;

/// Name of the image of all patches inside the component's folder.
const PACKED_IMAGE: &str = "images/packed.exr";

/// Name of the image of a patch inside the component's folder.
pub fn image_path(patch: usize) -> String {
    format!("images/{patch:04}.exr")
}

/// The number of quarter turns, 0 to 3, of a rotation that is one to [`QUARTER_TURN_TOLERANCE`].
pub fn quarter_turns(rotation: f64) -> Option<u8> {
    let turns = (rotation / FRAC_PI_2).round();
    let near = (rotation - turns * FRAC_PI_2).abs() <= QUARTER_TURN_TOLERANCE;
    near.then(|| turns.rem_euclid(4.0) as u8)
}

fn motion(m: &RigidMotion, residual: f64) -> Motion {
    let rotation = wrap_angle(m.rotation);
    Motion {
        rotation,
        quarter_turns: quarter_turns(rotation),
        translation: m.translation,
        residual,
    }
}

/// Describes an atlas. Errors where a number is not finite; expects [`super::check_shapes`] to hold.
pub fn describe(atlas: &AffineAtlas, provenance: &Provenance) -> Result<Document, ExportError> {
    let document = Document {
        format: "affine-atlas".into(),
        version: FORMAT_VERSION,
        generator: Generator {
            name: env!("CARGO_PKG_NAME").into(),
            version: env!("CARGO_PKG_VERSION").into(),
        },
        source: source(provenance),
        units: Units {
            length: "source".into(),
            angle: "radian".into(),
        },
        topology: Topology {
            vertices: atlas.topology.vertices,
            edges: atlas.topology.edges,
            faces: atlas.topology.faces,
            euler_characteristic: atlas.topology.euler_characteristic,
            genus: atlas.topology.genus,
            boundary_loops: atlas.topology.boundary_loops,
        },
        repair: atlas.repair.clone(),
        connectivity: atlas.connectivity_repair,
        metric: metric(atlas),
        cones: cones(atlas),
        features: features(atlas),
        segments: segments(atlas),
        charts: charts(atlas),
        transitions: transitions(atlas),
        periods: periods::period_vectors(atlas),
        grid: atlas.grid.as_ref().map(grid::grid),
        no_grid: atlas.no_grid.clone(),
        patches: patches(atlas),
        images: images(atlas),
        quality: atlas.quality,
        image_origin: atlas.image_origin,
        flags: Flags {
            seamless: atlas.seamless,
        },
    };
    document.check_finite()?;
    Ok(document)
}

fn source(provenance: &Provenance) -> Source {
    Source {
        path: provenance.public_path(),
        blake3: provenance.blake3.into(),
        config_blake3: provenance.config_blake3.into(),
        component: provenance.component,
        components: provenance.components,
        parts: provenance
            .parts
            .iter()
            .map(|p| SourcePart {
                name: p.name.clone(),
                first_vertex: p.first_vertex,
                vertices: p.vertices,
                first_face: p.first_face,
                faces: p.faces,
            })
            .collect(),
    }
}

fn metric(atlas: &AffineAtlas) -> Metric {
    let boundary = match atlas.prescription.boundary {
        _ if atlas.topology.boundary_loops == 0 => Boundary::None,
        BoundaryCondition::Free => Boundary::Free,
        BoundaryCondition::Uniform => Boundary::Uniform,
        BoundaryCondition::Corners => Boundary::Corners,
        BoundaryCondition::Prescribed => Boundary::Prescribed,
    };
    let history = &atlas.metric.history;
    Metric {
        scheme: atlas.flow.scheme,
        solver: atlas.flow.solver,
        boundary,
        iterations: history.last().map_or(0, |step| step.iteration),
        flips: history.iter().map(|step| step.flips).sum(),
        max_curvature_error: atlas.metric.max_curvature_error,
        curvature_tolerance: atlas.flow.curvature_tolerance,
        limited_by_float64: atlas.limited_by_float64(),
        fit: atlas.metric.fit,
        holonomy: atlas.metric.quarter_turns.as_ref().map(|met| Holonomy {
            loops: (met.loops.iter())
                .map(|&(turns, residual)| Loop { turns, residual })
                .collect(),
            conformality: atlas.flow.conformality,
            adjusted: met.moved.to_least,
            merged: met.moved.merged,
            left_out: met.left_out,
        }),
        history: history.clone(),
    }
}

fn features(atlas: &AffineAtlas) -> Vec<Feature> {
    let Some(met) = &atlas.metric.quarter_turns else {
        return Vec::new();
    };
    let lines = met.lines.iter().map(|f| (f, true));
    let all = lines.chain(met.given_up.iter().map(|f| (f, false)));
    all.map(|(feature, is_line)| Feature {
        vertices: feature.vertices.iter().map(|v| v.index()).collect(),
        length: feature.length,
        angle: feature.angle,
        is_line,
    })
    .collect()
}

/// What the images hold, unless it is what they hold by default.
fn images(atlas: &AffineAtlas) -> Option<Images> {
    let (own, default) = (&atlas.image_params, ImageParams::default());
    let packed = atlas.patches.packed.as_ref().map(|places| Packed {
        image: PACKED_IMAGE.into(),
        side: places.side,
        corners: places.corners.clone(),
    });
    let differs = packed.is_some()
        || own.channels != default.channels
        || own.normal_precision != default.normal_precision;
    differs.then(|| Images {
        channels: own.channels.iter().copied().collect(),
        normal_precision: own.normal_precision,
        packed,
    })
}

fn cones(atlas: &AffineAtlas) -> Vec<Cone> {
    let source_vertex = |v| Some(atlas.mesh.source_vertex[v]).filter(|&s| s != NONE);
    atlas
        .prescription
        .cones
        .iter()
        .map(|c| Cone {
            vertex: c.vertex.index(),
            source_vertex: source_vertex(c.vertex),
            curvature: c.curvature,
        })
        .collect()
}

fn segments(atlas: &AffineAtlas) -> Vec<Segment> {
    let connectivity = &atlas.mesh.connectivity;
    let gluings = &atlas.charts.gluings;
    atlas
        .cut
        .segments
        .iter()
        .zip(gluings)
        .enumerate()
        .map(|(id, (segment, gluing))| {
            let tails = segment.halfedges.iter().map(|&h| connectivity.tail(h));
            let end = segment.halfedges.last().map(|&h| connectivity.head(h));
            let vertices: Vec<u32> = tails.chain(end).map(|v| v.raw()).collect();
            Segment {
                id,
                from: vertices.first().copied().unwrap_or(NONE),
                to: vertices.last().copied().unwrap_or(NONE),
                vertices,
                gluing: motion(&gluing.motion, gluing.residual),
            }
        })
        .collect()
}

fn charts(atlas: &AffineAtlas) -> Vec<Chart> {
    let domain = |kind| match kind {
        ChartKind::Central => ChartDomain::Central,
        ChartKind::Boundary(segment) => ChartDomain::Boundary {
            segment: segment.raw(),
        },
        ChartKind::Node(vertex) => ChartDomain::Node {
            vertex: vertex.raw(),
        },
    };
    let charts = atlas.charts.charts.iter().enumerate();
    charts
        .map(|(id, chart)| Chart {
            id,
            domain: domain(chart.kind),
        })
        .collect()
}

fn transitions(atlas: &AffineAtlas) -> Vec<Transition> {
    let transitions = atlas.charts.transitions.iter();
    transitions
        .map(|t| Transition {
            from: t.from.raw(),
            to: t.to.raw(),
            sector: t.sector,
            motion: motion(&t.motion, t.residual),
            faces: t.faces,
        })
        .collect()
}

fn patches(atlas: &AffineAtlas) -> Vec<Patch> {
    let patches = atlas.patches.patches.iter().enumerate();
    patches
        .map(|(id, patch)| Patch {
            id,
            image: image_path(id),
            domain: patch.domain,
            width: patch.width,
            height: patch.height,
            texel_to_patch: patch.texel_to_patch,
            cells: atlas.grid.as_ref().map(|grid| grid.blocks.blocks[id].cells),
            samples_per_cell: atlas.grid.as_ref().map(|grid| grid.samples_per_cell),
            sides: atlas.grid.as_ref().map(|grid| grid::sides(grid, id)),
            island: atlas.grid.as_ref().map(|grid| grid.islands.place[id].0),
            patch_to_chart: patch.to_chart.map(|map| Similarity {
                scale: map.scale,
                rotation: wrap_angle(map.rotation),
                translation: map.translation,
            }),
            patch_to_packed: Packing {
                scale: patch.packed_scale,
                translation: patch.packed_offset,
            },
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::sample;
    use crate::geometry::mesh::Appearance;
    use std::f64::consts::PI;

    fn document() -> Document {
        let appearance = Appearance::default();
        describe(&sample::torus(5, 3), &sample::provenance(&appearance)).unwrap()
    }

    #[test]
    fn a_document_reads_back_the_same() {
        let document = document();
        let text = document.to_text();
        let back: Document = serde_json::from_str(&text).unwrap();
        assert_eq!(back, document);
        assert_eq!(back.to_text(), text);
    }

    #[test]
    fn every_key_of_the_contract_is_there() {
        let value: serde_json::Value = serde_json::from_str(&document().to_text()).unwrap();
        for pointer in [
            "/format",
            "/version",
            "/generator/name",
            "/generator/version",
            "/source/path",
            "/source/blake3",
            "/source/config_blake3",
            "/source/component",
            "/source/components",
            "/source/parts/0/first_vertex",
            "/topology/vertices",
            "/topology/edges",
            "/topology/faces",
            "/topology/euler_characteristic",
            "/topology/genus",
            "/topology/boundary_loops",
            "/repair/welded_vertices",
            "/connectivity/splits",
            "/connectivity/flips",
            "/connectivity/hausdorff",
            "/metric/scheme",
            "/metric/solver",
            "/metric/boundary",
            "/metric/iterations",
            "/metric/flips",
            "/metric/max_curvature_error",
            "/metric/history/0/iteration",
            "/metric/history/0/max_error",
            "/metric/history/0/energy",
            "/metric/history/0/step",
            "/metric/history/0/flips",
            "/metric/history/0/flow_time",
            "/segments/0/id",
            "/segments/0/from",
            "/segments/0/to",
            "/segments/0/vertices/0",
            "/segments/0/gluing/rotation",
            "/segments/0/gluing/quarter_turns",
            "/segments/0/gluing/translation/1",
            "/segments/0/gluing/residual",
            "/charts/0/kind",
            "/charts/1/segment",
            "/charts/3/vertex",
            "/transitions/0/from",
            "/transitions/0/to",
            "/transitions/0/sector",
            "/transitions/0/rotation",
            "/transitions/0/translation/0",
            "/transitions/0/residual",
            "/transitions/0/faces",
            "/patches/0/image",
            "/patches/0/domain",
            "/patches/0/width",
            "/patches/0/height",
            "/patches/0/texel_to_patch/1/2",
            "/patches/0/patch_to_chart/scale",
            "/quality/area_distortion",
            "/quality/log_scale/std",
            "/quality/angle_error/max",
            "/quality/layout_closing_error",
            "/quality/cut_length",
            "/image_origin/2",
            "/flags/seamless",
            "/periods/1/0",
            "/units/length",
        ] {
            assert!(value.pointer(pointer).is_some(), "{pointer} is missing");
        }
        assert_eq!(value["metric"]["boundary"], "none");
        assert_eq!(value["charts"][1]["kind"], "boundary");
        assert_eq!(
            value["segments"][0]["vertices"].as_array().unwrap().len(),
            6
        );
        assert_eq!(value["segments"][0]["from"], value["segments"][0]["to"]);
    }

    #[test]
    fn cones_name_their_source_vertex() {
        let mut atlas = sample::torus(5, 3);
        let cone = |v| crate::flow::cones::Cone {
            vertex: crate::geometry::ids::VertexId::new(v),
            curvature: PI / 2.0,
        };
        atlas.prescription.cones = vec![cone(2), cone(3)];
        atlas.mesh.source_vertex.as_mut_slice()[2] = 77;
        atlas.mesh.source_vertex.as_mut_slice()[3] = NONE;
        let appearance = Appearance::default();
        let document = describe(&atlas, &sample::provenance(&appearance)).unwrap();
        assert_eq!(document.cones[0].source_vertex, Some(77));
        assert_eq!(document.cones[1].source_vertex, None);
        assert_eq!(document.periods, None);
    }

    #[test]
    fn numbers_that_json_cannot_hold_are_refused() {
        let appearance = Appearance::default();
        let mut atlas = sample::torus(4, 3);
        atlas.charts.gluings[1].motion.translation[0] = f64::NAN;
        let error = describe(&atlas, &sample::provenance(&appearance)).unwrap_err();
        let ExportError::NotFinite { place } = error else {
            panic!("{error}");
        };
        assert_eq!(place, "atlas.json.segments[1].gluing.translation[0]");
    }

    #[test]
    fn quarter_turns_are_counted_counterclockwise() {
        assert_eq!(quarter_turns(0.0), Some(0));
        assert_eq!(quarter_turns(FRAC_PI_2 + 9e-9), Some(1));
        assert_eq!(quarter_turns(PI), Some(2));
        assert_eq!(quarter_turns(-PI + 1e-9), Some(2));
        assert_eq!(quarter_turns(-FRAC_PI_2), Some(3));
        assert_eq!(quarter_turns(-1e-9), Some(0));
        assert_eq!(quarter_turns(FRAC_PI_2 + 2e-8), None);
        assert_eq!(quarter_turns(f64::NAN), None);
    }
}
