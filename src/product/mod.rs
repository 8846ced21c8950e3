//! What a job yields for one component: the affine atlas with everything that is written of it, in source units.

mod units;

use crate::atlas::charts::Charts;
use crate::atlas::cut::CutGraph;
use crate::atlas::develop::Development;
use crate::atlas::geometry_image::{GeometryImage, ImageParams};
use crate::atlas::patches::PatchLayout;
use crate::flow::prescription::Prescription;
use crate::flow::refine::ConnectivityRepair;
use crate::flow::ricci::{FlatMetric, FlowParams};
use crate::geometry::connectivity::Topology;
use crate::geometry::ids::VertexVec;
use crate::geometry::mesh::Mesh;
use crate::grid::Grid;
use crate::repair::RepairLog;
use crate::spline::Gridded;
use serde::{Deserialize, Serialize};

/// A built component.
#[derive(Clone, Debug)]
pub struct AffineAtlas {
    /// Surface after repair and connectivity repair; where the flow flipped edges, refined by those of the flat triangulation.
    pub mesh: Mesh,
    /// Its counts.
    pub topology: Topology,
    /// Prescribed curvature.
    pub prescription: Prescription,
    /// How the flow was asked to run.
    pub flow: FlowParams,
    /// Flat cone metric.
    pub metric: FlatMetric,
    /// Cut graph.
    pub cut: CutGraph,
    /// Central chart.
    pub central: Development,
    /// Boundary and node charts, transitions, gluings.
    pub charts: Charts,
    /// Patches and seams.
    pub patches: PatchLayout,
    /// The integer grid that the patches are blocks of, where there is one.
    pub grid: Option<Grid>,
    /// Why there is none, where one was asked for.
    pub no_grid: Option<String>,
    /// One image a patch.
    pub images: Vec<GeometryImage>,
    /// What of them is stored, and how.
    pub image_params: ImageParams,
    /// Added to image positions to give source coordinates.
    pub image_origin: [f64; 3],
    /// What repair changed: counts by name, as `atlas.json` lists them.
    pub repair: std::collections::BTreeMap<String, u64>,
    /// The same change by change.
    pub repair_log: RepairLog,
    /// What connectivity repair changed.
    pub connectivity_repair: ConnectivityRepair,
    /// Measured from the data above, not taken from any stage.
    pub quality: Quality,
    /// Distance of every vertex from the mesh rebuilt from the images, source units; absent where nobody asked for it or the images
    /// do not make a mesh.
    pub image_distance: Option<VertexVec<f64>>,
    /// True where every gluing is a quarter turn to 1e-8.
    pub seamless: bool,
}

impl AffineAtlas {
    /// True where rounding stopped the flow above the curvature tolerance; the achieved error is in `metric`.
    #[must_use]
    pub fn limited_by_float64(&self) -> bool {
        self.metric.max_curvature_error > self.flow.curvature_tolerance
    }

    /// What a spline surface is fitted to ([`fit`](crate::spline::fit())), where there is a grid.
    #[must_use]
    pub fn gridded(&self) -> Option<Gridded> {
        let grid = self.grid.as_ref()?;
        Some(Gridded::new(&self.mesh, &self.patches, grid))
    }
}

/// Minimum, maximum and standard deviation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Spread {
    /// Least value.
    pub min: f64,
    /// Greatest value.
    pub max: f64,
    /// Standard deviation, weighted by source area.
    pub std: f64,
}

/// Mean and maximum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct MeanMax {
    /// Mean, weighted by source area.
    pub mean: f64,
    /// Greatest value.
    pub max: f64,
}

/// Root of the mean square, and maximum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct RmsMax {
    /// Root of the mean square.
    pub rms: f64,
    /// Greatest magnitude.
    pub max: f64,
}

/// The distortion in a word: the standard deviation σ of the log scale, which a factor of e^σ in lengths stands for.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// σ ≤ 0.25: two thirds of the surface are drawn within 28 % of the mean size.
    #[default]
    Good,
    /// σ ≤ 0.5: within 65 %.
    Fair,
    /// More: parts of the surface are drawn very large or very small.
    Poor,
}

impl Verdict {
    /// The verdict on a log scale.
    #[must_use]
    pub fn of(log_scale: &Spread) -> Self {
        match log_scale.std {
            std if std <= 0.25 => Self::Good,
            std if std <= 0.5 => Self::Fair,
            _ => Self::Poor,
        }
    }
}

/// How well the atlas turned out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Quality {
    /// (9), both areas normalised to 1.
    pub area_distortion: f64,
    /// ½ ln(flat area / source area) a face, both totals 1, weighted by source area.
    pub log_scale: Spread,
    /// The distortion in a word.
    #[serde(default)]
    pub verdict: Verdict,
    /// Difference of corner angles, radians.
    pub angle_error: MeanMax,
    /// How far the metric is from a conformal one, of λ* − λ⁰ − (u_i + u_j) over the edges of the intrinsic Delaunay triangulation; absent where it is conformal by construction.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub conformal_error: Option<RmsMax>,
    /// Worst mismatch of the development, source units.
    pub layout_closing_error: f64,
    /// Length of the cut in space, source units.
    pub cut_length: f64,
    /// Worst residual of all transitions and gluings, relative to the chart's diameter.
    pub transition_residual: f64,
    /// Worst |holonomy − K̄| (mod 2π) around a vertex of the cut, radians.
    pub holonomy_error: f64,
    /// Worst mismatch of the cocycle over shared faces, relative to the chart's diameter.
    pub cocycle_error: f64,
    /// 20 log10(bounding-box diagonal / symmetric RMS distance) of the mesh rebuilt from the images to the surface as it came
    /// in, estimated over samples; absent where not measured.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub image_psnr_db: Option<f64>,
    /// Largest distance between the two over samples and vertices on both, source units: a lower bound of the Hausdorff distance.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub image_hausdorff: Option<f64>,
    /// Angle between normals of the two, radians; near creases the largest is large however near the surfaces are.
    #[serde(skip_serializing_if = "Option::is_none", default)]
    pub image_normal_error: Option<MeanMax>,
}
