//! What a user may choose about the flow, with the defaults.

use super::error::FlowError;
use crate::flow::schemes::Scheme;

/// How the minimum of the energy is found.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Solver {
    /// Newton with line search.
    #[default]
    Newton,
    /// (8) with adaptive step.
    Gradient,
}

/// Parameters of the flow.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FlowParams {
    /// Conformal structure. `vertex-scaling` starts from the lengths in space and, with `delaunay`, always arrives. The packings are
    /// the tutorial's and exist where (6) holds: `tangential` ignores the shape, `thurston` keeps the lengths as well as circles
    /// can. `inversive-distance` keeps them exactly, but may meet broken triangles, as does `vertex-scaling` without `delaunay`.
    pub scheme: Scheme,
    /// With `vertex-scaling`: flip edges so that the triangulation is Delaunay at every `u`. Then a flat metric exists for every
    /// prescription that meets Gauss–Bonnet with positive cone angles, on every mesh. The other schemes never flip.
    pub delaunay: bool,
    /// What loops around handles may turn by; `quarter-turns` needs `vertex-scaling` with `delaunay`.
    pub holonomy: Holonomy,
    /// With `quarter-turns`: how much cheaper a change of scale is than one of shape. 0 keeps lengths as they are as well as possible, large values keep
    /// angles. Without any, Newton's steps become short on fine meshes (`benches/README.md`).
    pub conformality: f64,
    /// Minimiser. `newton` takes a handful of steps; `gradient` follows the flow itself, thousands of times slower on large meshes.
    pub solver: Solver,
    /// Bound on max |K − K̄|, radians; rounding reaches about 1e-14, so nothing below 1e-13 is sensible.
    pub curvature_tolerance: f64,
    /// Most Newton steps; 4 to 15 are usual.
    pub max_newton_steps: usize,
    /// Most gradient steps; their number grows with the number of vertices, some 1000 for a mesh of 100.
    pub max_gradient_steps: usize,
}

/// What loops around handles may turn by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Holonomy {
    /// Whatever the conformal metric makes them turn by.
    #[default]
    Free,
    /// Multiples of π/2, as cones do: every transition is a quarter turn. Where the surface has handles the metric is then conformal only nearly.
    QuarterTurns,
}

impl Default for FlowParams {
    fn default() -> Self {
        Self {
            scheme: Scheme::default(),
            delaunay: true,
            holonomy: Holonomy::default(),
            conformality: 0.1,
            solver: Solver::default(),
            curvature_tolerance: 1e-10,
            max_newton_steps: 200,
            max_gradient_steps: 1_000_000,
        }
    }
}

impl FlowParams {
    /// Refuses settings that contradict each other.
    pub(super) fn check(&self) -> Result<(), FlowError> {
        let contradicts = match (self.scheme, self.delaunay, self.solver) {
            _ if self.holonomy == Holonomy::Free => return Ok(()),
            (Scheme::VertexScaling, true, Solver::Newton) => return Ok(()),
            (Scheme::VertexScaling, true, Solver::Gradient) => "flow.solver = \"gradient\"",
            (Scheme::VertexScaling, false, _) => "flow.delaunay = false",
            (Scheme::Tangential, ..) => "flow.scheme = \"tangential\"",
            (Scheme::Thurston, ..) => "flow.scheme = \"thurston\"",
            (Scheme::InversiveDistance, ..) => "flow.scheme = \"inversive-distance\"",
        };
        Err(FlowError::QuarterTurnsWithout {
            setting: contradicts,
        })
    }

    /// Whether the flow flips edges.
    pub fn flips(&self) -> bool {
        self.scheme == Scheme::VertexScaling && self.delaunay
    }
}
