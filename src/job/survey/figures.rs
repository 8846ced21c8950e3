//! What one choice of cones costs and gains.

use super::super::flatten::Flattened;
use super::first_vertices;
use crate::flow::cones::{Cone, ConeSpec};
use crate::geometry::frame::Frame;
use crate::geometry::mesh::Mesh;
use crate::product::{MeanMax, Spread};
use crate::report;

/// The figures of one row.
#[derive(Clone, Debug)]
pub struct Figures {
    /// The cones inside the surface: vertex of the input file (2³²−1 for one that repair made) and curvature, radians.
    pub cones: Vec<(u32, f64)>,
    /// The same as a list that the configuration accepts; none where the file has no number for one of the vertices.
    pub list: Option<Vec<ConeSpec>>,
    /// (9), both areas normalised to 1.
    pub area_distortion: f64,
    /// ½ ln(flat area / source area) a face, both totals 1, weighted by source area.
    pub log_scale: Spread,
    /// Difference of corner angles, radians.
    pub angle_error: MeanMax,
    /// Length of the cut in space, source units.
    pub cut_length: f64,
    /// max |K − K̄| over the prescribed vertices, radians.
    pub max_curvature_error: f64,
    /// What a picture of it shows.
    pub scene: Scene,
}

/// A cone in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Marked {
    /// Where, source units.
    pub position: [f64; 3],
    /// K̄, radians.
    pub curvature: f64,
}

/// What a picture shows, on the component's own mesh.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Logarithm of the length scale at every vertex of the mesh, up to a constant.
    pub log_scale: Vec<f64>,
    /// Edges of the cut, source units.
    pub cut: Vec<[[f64; 3]; 2]>,
    /// Cones, those on the boundary included.
    pub cones: Vec<Marked>,
}

impl Figures {
    /// Measures a flat surface that was made from `mesh`, both in `frame`; `inside` are its cones inside the surface.
    pub(super) fn measure(
        mesh: &Mesh,
        flat: &Flattened,
        inside: Vec<Cone>,
        list: Option<Vec<ConeSpec>>,
        frame: &Frame,
    ) -> Self {
        let distortion = report::distortion(&flat.mesh, &flat.metric);
        let place = |v| frame.leave(flat.mesh.positions[v]);
        let cut = flat.cut.is_cut.enumerate().filter(|&(_, &is_cut)| is_cut);
        let cones = flat.prescription.cones.iter().map(|cone| Marked {
            position: place(cone.vertex),
            curvature: cone.curvature,
        });
        let vertices = mesh.connectivity.vertex_count();
        Self {
            cones: (inside.iter())
                .map(|cone| (mesh.source_vertex[cone.vertex], cone.curvature))
                .collect(),
            list,
            area_distortion: distortion.area_distortion,
            log_scale: distortion.log_scale,
            angle_error: distortion.angle_error,
            cut_length: frame.length(report::cut_length(&flat.mesh, &flat.cut)),
            max_curvature_error: flat.metric.max_curvature_error,
            scene: Scene {
                log_scale: first_vertices(&flat.metric.log_scale, vertices),
                cut: cut
                    .map(|(e, _)| flat.mesh.connectivity.edge_vertices(e).map(place))
                    .collect(),
                cones: cones.collect(),
            },
        }
    }
}
