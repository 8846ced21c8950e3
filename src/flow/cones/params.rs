//! What a user may ask of cones and of the boundary, with the defaults.

use crate::flow::pi_multiple::PiMultiple;
use crate::flow::prescription::BoundaryCondition;
use std::path::PathBuf;

/// Cones where their number is not given.
pub(super) const DEFAULT_COUNT: usize = 8;

/// How cones are chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ConeStrategy {
    /// The list where there is one, else places and curvatures that distort areas least; see [the module docs](super).
    #[default]
    Auto,
    /// Those of the list.
    Listed,
    /// The singular vertices of the smoothest cross field, and corners of borders.
    Field,
    /// All curvature at one interior vertex.
    Single,
    /// Equal cones, far from each other.
    Spread,
    /// No cones in the interior.
    None,
}

/// A cone that the user names by vertex or by point.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConeSpec {
    /// Vertex of the input file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertex: Option<u32>,
    /// A point in source units: the nearest vertex is taken.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point: Option<[f64; 3]>,
    /// K̄ in multiples of π.
    pub curvature: PiMultiple,
}

/// Which cones.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ConeParams {
    /// How they are chosen.
    pub strategy: ConeStrategy,
    /// Cones by name; not empty means strategy `listed`.
    pub list: Vec<ConeSpec>,
    /// Number of cones for `spread`, at least 1; the most that `auto` and `field` place in the interior. Absent: 8, and for `auto` and `field` as many as the
    /// surface needs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub count: Option<usize>,
    /// For `auto`: as few cones as keep |log scale − mean| below this where `count` allows; absent: as many as pay.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub log_scale_bound: Option<f64>,
    /// For `auto`: K̄ of every cone is a multiple of this; 0: any.
    pub quantum: PiMultiple,
    /// For `auto`: least K̄ of a cone, in multiples of π.
    pub min_curvature: PiMultiple,
    /// For `auto`: greatest K̄ of a cone, in multiples of π, below 2.
    pub max_curvature: PiMultiple,
    /// For `auto`: least distance of a cone to the boundary, in square roots of the component's area.
    pub boundary_distance: f64,
    /// File with cones, one a line: vertex and curvature in radians. [`crate::config::load`] puts them into `list`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// The line of `file` that each cone of `list` stands on; empty where none was read.
    #[serde(skip)]
    pub file_lines: Vec<u32>,
    /// Number of the first vertex in `file`: 0 or 1.
    pub file_first_vertex: u32,
    /// K̄ of each cone for `spread`, in multiples of π; absent: what Gauss–Bonnet leaves, in equal parts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub curvature: Option<PiMultiple>,
    /// Vertex of the input file for `single`; absent: the most central one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vertex: Option<u32>,
}

impl Default for ConeParams {
    fn default() -> Self {
        Self {
            strategy: ConeStrategy::Auto,
            list: Vec::new(),
            count: None,
            log_scale_bound: None,
            quantum: PiMultiple::literal(0, 1),
            min_curvature: PiMultiple::literal(-4, 1),
            max_curvature: PiMultiple::literal(9, 8),
            boundary_distance: 0.0,
            file: None,
            file_lines: Vec::new(),
            file_first_vertex: 0,
            curvature: None,
            vertex: None,
        }
    }
}

/// A corner that the user names by vertex or by point.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CornerSpec {
    /// Vertex of the input file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertex: Option<u32>,
    /// A point in source units: the nearest boundary vertex is taken.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point: Option<[f64; 3]>,
}

/// The curvature of a boundary vertex that the user names by vertex or by point.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoundarySpec {
    /// Vertex of the input file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertex: Option<u32>,
    /// A point in source units: the nearest boundary vertex is taken.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point: Option<[f64; 3]>,
    /// K̄ in multiples of π, below 1; the interior angle there is π − K̄. 0 keeps the border straight there.
    pub curvature: PiMultiple,
}

/// What happens on the boundary.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BoundaryParams {
    /// Absent: `corners` where corners are named, `prescribed` where there is a list, `uniform` where totals are given, else
    /// `free`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub condition: Option<BoundaryCondition>,
    /// For `uniform` and `prescribed`: total curvature of each loop, in multiples of π, loops in the order of their first face
    /// in the file. Empty: what Gauss–Bonnet leaves, over all loops together.
    pub totals: Vec<PiMultiple>,
    /// For `prescribed`: the curvature of single boundary vertices.
    pub list: Vec<BoundarySpec>,
    /// For `corners`: four boundary vertices. Empty: four that divide the boundary's length best.
    pub corners: Vec<CornerSpec>,
}

impl BoundaryParams {
    /// The condition on a component that has a boundary.
    pub fn effective_condition(&self) -> BoundaryCondition {
        let given = (
            self.corners.is_empty(),
            self.list.is_empty(),
            self.totals.is_empty(),
        );
        let implied = match given {
            (false, _, _) => BoundaryCondition::Corners,
            (true, false, _) => BoundaryCondition::Prescribed,
            (true, true, false) => BoundaryCondition::Uniform,
            (true, true, true) => BoundaryCondition::Free,
        };
        self.condition.unwrap_or(implied)
    }
}
