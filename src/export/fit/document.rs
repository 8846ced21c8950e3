//! `fit.json`.

use crate::spline::Spline;
use crate::spline::cad::{Faces, Jump};
use crate::spline::patches::Patches;
use schemars::JsonSchema;
use serde::Serialize;

/// Figures of the spline surfaces of an asset.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Document {
    /// `affine-atlas-fit`.
    pub format: String,
    /// Of this format.
    pub version: u32,
    /// Program and version.
    pub generator: String,
    /// What source units are taken for: `millimetre`, `centimetre`, `metre` or `inch`.
    pub unit: String,
    /// Most by which normals of faces in the STEP file were to differ beside irregular points, degrees.
    pub angle_degrees: f64,
    /// One a component that has a surface.
    pub components: Vec<Component>,
    /// The others.
    pub unfitted: Vec<Unfitted>,
}

/// A component without a surface.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Unfitted {
    /// Name.
    pub name: String,
    /// Why it has none.
    pub reason: String,
}

/// Figures of one surface.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Component {
    /// Name, that its files begin with.
    pub name: String,
    /// True where it has no boundary.
    pub closed: bool,
    /// True where the mesh is closed and inside out: the surface is turned over and looks outward.
    pub inside_out: bool,
    /// Name of the component whose cavity it bounds: its faces are in the STEP file of that one, and it has none of its own. Absent where it bounds none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub void_of: Option<String>,
    /// Cells of the control mesh.
    pub cells: usize,
    /// Control points of the limit surface.
    pub control_points: usize,
    /// Control points that a number of edges other than four, or a crease, meets irregularly.
    pub irregular_points: usize,
    /// Edges of cells that are creases, those on the boundary left out.
    pub crease_edges: usize,
    /// Control points that the surface passes through, sharp in every direction.
    pub corners: usize,
    /// Of the bounding box of the surface that was given, source units.
    pub diagonal_source_units: f64,
    /// From places all over the surface that was given to the nearest ones on this.
    pub from_source: Distance,
    /// Between both, each sampled and measured from the other; absent where one has no area.
    pub both_ways: Option<Distance>,
    /// Angle between the normals of both at nearest places.
    pub normal_deviation: NormalDeviation,
    /// Part of the area that is folded, or bent as much as if it were, by a right angle within an eighth of a cell: 0.
    pub turned_over_area: f64,
    /// Least |∂s × ∂t| over its mean.
    pub least_jacobian: f64,
    /// The faces of the STEP file.
    pub step: Step,
    /// The patches of the XML file.
    pub gismo: Gismo,
}

/// A distance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Distance {
    /// Root mean square, source units.
    pub rms_source_units: f64,
    /// The largest, source units.
    pub max_source_units: f64,
    /// Root mean square over the diagonal.
    pub rms_of_diagonal: f64,
    /// The largest over the diagonal.
    pub max_of_diagonal: f64,
}

impl Distance {
    fn new(rms: f64, max: f64, diagonal: f64) -> Self {
        Self {
            rms_source_units: rms,
            max_source_units: max,
            rms_of_diagonal: rms / diagonal,
            max_of_diagonal: max / diagonal,
        }
    }
}

/// Angles by area.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct NormalDeviation {
    /// Mean.
    pub mean_degrees: f64,
    /// No larger on 95 % of the area.
    pub p95_degrees: f64,
}

/// The STEP file.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Step {
    /// B-spline faces.
    pub faces: usize,
    /// Edges.
    pub edges: usize,
    /// Control points of all faces.
    pub control_points: usize,
    /// Halvings of knots towards irregular points.
    pub halvings: u32,
    /// How far normals turn across edges that are no creases, between cells without irregular points.
    pub normal_jump_regular: JumpDegrees,
    /// The same beside irregular points and where creases end.
    pub normal_jump_irregular: JumpDegrees,
    /// The same at corners, where the surface itself is sharp, and where three cells or more lie between two creases.
    pub normal_jump_corners: JumpDegrees,
}

/// Angles at places along edges.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct JumpDegrees {
    /// Mean.
    pub mean_degrees: f64,
    /// 95 % are no larger.
    pub p95_degrees: f64,
    /// The largest.
    pub max_degrees: f64,
}

impl From<Jump> for JumpDegrees {
    fn from(jump: Jump) -> Self {
        Self {
            mean_degrees: jump.mean.to_degrees(),
            p95_degrees: jump.p95.to_degrees(),
            max_degrees: jump.max.to_degrees(),
        }
    }
}

/// The XML file.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Gismo {
    /// Patches.
    pub patches: usize,
    /// Sides that two patches share.
    pub interfaces: usize,
    /// Sides on the boundary.
    pub boundary_sides: usize,
    /// Control points of all patches.
    pub control_points: usize,
}

impl Component {
    /// Figures of a surface.
    pub fn new(name: &str, spline: &Spline, faces: &Faces, patches: &Patches) -> Self {
        let cage = &spline.cage;
        let distance = |rms, max| Distance::new(rms, max, spline.diagonal);
        let [regular, irregular, corners] = faces.jumps();
        let points = |size: [usize; 2]| size[0] * size[1];
        let (errors, shape) = (spline.errors, spline.shape);
        Self {
            name: name.to_owned(),
            closed: faces.shell.is_closed,
            inside_out: false,
            void_of: None,
            cells: cage.cells.len(),
            control_points: cage.vertices,
            irregular_points: cage.irregular().iter().filter(|x| **x).count(),
            crease_edges: cage.chains().iter().map(|chain| chain.len() - 1).sum(),
            corners: cage.is_corner.iter().filter(|x| **x).count(),
            diagonal_source_units: spline.diagonal,
            from_source: distance(errors.rms, errors.max),
            both_ways: spline.deviation.map(|d| distance(d.rms, d.hausdorff)),
            normal_deviation: NormalDeviation {
                mean_degrees: errors.mean_normal_angle.to_degrees(),
                p95_degrees: errors.p95_normal_angle.to_degrees(),
            },
            turned_over_area: shape.turned_over,
            least_jacobian: shape.least_jacobian,
            step: Step {
                faces: faces.shell.faces.len(),
                edges: faces.shell.edges.len(),
                control_points: faces
                    .shell
                    .faces
                    .iter()
                    .map(|f| points(f.surface.size()))
                    .sum(),
                halvings: faces.halvings,
                normal_jump_regular: regular.into(),
                normal_jump_irregular: irregular.into(),
                normal_jump_corners: corners.into(),
            },
            gismo: Gismo {
                patches: patches.surfaces.len(),
                interfaces: patches.interfaces.len(),
                boundary_sides: patches.boundary.len(),
                control_points: patches.surfaces.iter().map(|s| points(s.size())).sum(),
            },
        }
    }
}
