//! Every way in which a build can end without an atlas.

use super::checks::{failed_of, listed};
use super::precision::Precision;
use crate::atlas::charts::ChartError;
use crate::atlas::cut::CutError;
use crate::atlas::develop::DevelopError;
use crate::atlas::overlay::OverlayError;
use crate::atlas::patches::PatchError;
use crate::config::ConfigError;
use crate::export::ExportError;
use crate::flow::cones::ConeError;
use crate::flow::refine::{self, RefineError};
use crate::flow::ricci::FlowError;
use crate::geometry::ids::{FaceId, VertexId};
use crate::geometry::mesh::Mesh;
use crate::grid::GridError;
use crate::outcome::{Failure, FailureKind};
use crate::read::ReadError;
use crate::repair::{ComponentError, RepairError};
use crate::verify::{Check, Verdicts};

/// Why there is no atlas: the error of the stage that stopped.
#[derive(Debug, thiserror::Error)]
pub enum BuildError {
    /// Settings contradict each other.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The file was refused.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The triangles were refused.
    #[error(transparent)]
    Repair(#[from] RepairError),
    /// This component was refused.
    #[error(transparent)]
    Component(#[from] ComponentError),
    /// The curvature asked for cannot exist.
    #[error(transparent)]
    Cones(#[from] ConeError),
    /// Connectivity could not be repaired.
    #[error(transparent)]
    Refine(#[from] RefineError),
    /// The flow found no metric.
    #[error(transparent)]
    Flow(FlowError),
    /// The mesh could not be refined by the final triangulation.
    #[error(transparent)]
    Overlay(#[from] OverlayError),
    /// The surface could not be slit.
    #[error(transparent)]
    Cut(#[from] CutError),
    /// The metric could not be developed.
    #[error(transparent)]
    Develop(#[from] DevelopError),
    /// The charts could not be made.
    #[error(transparent)]
    Chart(#[from] ChartError),
    /// The surface is too fine for a grid.
    #[error(transparent)]
    Grid(GridError),
    /// The patches could not be made.
    #[error(transparent)]
    Patch(#[from] PatchError),
    /// What was written did not pass its own checks, and was not published.
    #[error(transparent)]
    Unverified(#[from] Unverified),
    /// The same, because float64 is too coarse for the surface.
    #[error(transparent)]
    Precision(#[from] Precision),
    /// Nothing could be written.
    #[error(transparent)]
    Export(ExportError),
    /// Somebody asked to stop.
    #[error("stopped before it was finished: nothing was written")]
    Cancelled,
}

/// An atlas that does not pass [`verify`](crate::verify): the checks that failed, with their figures.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "the atlas did not pass {} of its {checks} checks and was not published ({}), though nothing of the mesh is too thin or too small; please report the mesh with its configuration, and try other cones (cones.count) or flow.scheme = \"vertex-scaling\" with flow.delaunay = true, if others are set",
    failed.len(),
    listed(failed)
)]
pub struct Unverified {
    /// The checks that failed.
    pub failed: Vec<Check>,
    /// How many there were.
    pub checks: usize,
}

impl Unverified {
    /// What failed of these verdicts; `None` where nothing did.
    pub fn of(verdicts: &Verdicts) -> Option<Self> {
        (!verdicts.all_passed()).then(|| Self {
            failed: failed_of(verdicts),
            checks: verdicts.checks.len(),
        })
    }
}

impl From<GridError> for BuildError {
    fn from(error: GridError) -> Self {
        match error {
            GridError::Cancelled => Self::Cancelled,
            error => Self::Grid(error),
        }
    }
}

impl BuildError {
    /// An error of the flow, with the indices of the input file in place of the mesh's own.
    pub(super) fn flow(error: FlowError, mesh: &Mesh) -> Self {
        match error {
            FlowError::Cancelled => BuildError::Cancelled,
            other => BuildError::Flow(in_source(other, mesh)),
        }
    }

    /// The word of the manifest.
    pub fn kind(&self) -> FailureKind {
        match self {
            BuildError::Read(_) | BuildError::Repair(_) | BuildError::Component(_) => {
                FailureKind::Input
            }
            BuildError::Config(_)
            | BuildError::Cones(_)
            | BuildError::Refine(_)
            | BuildError::Grid(_) => FailureKind::Prescription,
            BuildError::Flow(
                FlowError::Infeasible(_)
                | FlowError::BadTarget { .. }
                | FlowError::NoQuarterTurns { .. }
                | FlowError::QuarterTurnsOnFreeBoundary { .. }
                | FlowError::QuarterTurnsWithout { .. },
            ) => FailureKind::Prescription,
            BuildError::Flow(FlowError::GaussBonnet { .. }) => FailureKind::Prescription,
            BuildError::Flow(FlowError::BadLength { .. }) => FailureKind::Input,
            BuildError::Flow(_) | BuildError::Develop(_) => FailureKind::NotConverged,
            BuildError::Overlay(OverlayError::TooManyCrossings { .. }) => FailureKind::Input,
            BuildError::Overlay(_) => FailureKind::Internal,
            BuildError::Cut(CutError::NothingToCutAlong) => FailureKind::Prescription,
            BuildError::Cut(_) => FailureKind::Internal,
            BuildError::Chart(ChartError::TooManySectors { .. }) => FailureKind::Prescription,
            BuildError::Chart(ChartError::Develop(_)) => FailureKind::NotConverged,
            BuildError::Patch(PatchError::NotFinite { .. }) => FailureKind::NotConverged,
            BuildError::Patch(_) => FailureKind::Prescription,
            BuildError::Unverified(_) => FailureKind::Unverified,
            BuildError::Precision(_) => FailureKind::NotConverged,
            BuildError::Export(ExportError::NotFinite { .. }) => FailureKind::NotConverged,
            BuildError::Export(error) if error.is_internal() => FailureKind::Internal,
            BuildError::Export(_) => FailureKind::Output,
            BuildError::Cancelled => FailureKind::Cancelled,
        }
    }
}

/// The same error with indices of the input file. A vertex that repair put in is named by one of the face it
/// was put into.
fn in_source(error: FlowError, mesh: &Mesh) -> FlowError {
    let vertex = |v: VertexId| VertexId::new(refine::source_vertex(mesh, v) as usize);
    let face = |f: FaceId| FaceId::new(mesh.source_face[f] as usize);
    match error {
        FlowError::BadLength {
            edge,
            vertices,
            length,
        } => FlowError::BadLength {
            edge,
            vertices: vertices.map(vertex),
            length,
        },
        FlowError::BadTarget {
            vertex: v,
            curvature,
            bound,
        } => FlowError::BadTarget {
            vertex: vertex(v),
            curvature,
            bound,
        },
        FlowError::NoQuarterTurns {
            vertex: v,
            curvature,
        } => FlowError::NoQuarterTurns {
            vertex: vertex(v),
            curvature,
        },
        FlowError::Infeasible(violation) => {
            FlowError::Infeasible(refine::in_source(violation, mesh))
        }
        FlowError::NotConverged {
            method,
            iterations,
            max_error,
            tolerance,
            broken,
            faces,
        } => FlowError::NotConverged {
            method,
            iterations,
            max_error,
            tolerance,
            broken,
            faces: {
                // Several faces of the mesh can lie in one of the file.
                let mut faces: Vec<FaceId> = faces.into_iter().map(face).collect();
                faces.sort_unstable();
                faces.dedup();
                faces
            },
        },
        other => other,
    }
}

impl From<ExportError> for BuildError {
    fn from(error: ExportError) -> Self {
        match error {
            ExportError::Interrupted => BuildError::Cancelled,
            other => BuildError::Export(other),
        }
    }
}

impl From<&BuildError> for Failure {
    fn from(error: &BuildError) -> Self {
        Failure {
            kind: error.kind(),
            message: error.to_string(),
        }
    }
}
