//! From lengths found by Newton's method on all edges to a [`FlatMetric`], whatever was prescribed.
//!
//! *Enters:* a triangulation with loops and a signature. *Leaves:* a [`FlatMetric`] like that of the conformal flow, with the scale that
//! comes nearest to it. *Guaranteed:* borders and features are edges of C, so nothing crosses them, but for borders beside faces without width, and where the conformal metric is taken as it is.

use super::error::FlowError;
use super::flat_metric::{FlatMetric, QuarterTurns};
use super::params::FlowParams;
use crate::flow::correspondence::Correspondence;
use crate::flow::delaunay::Delaunay;
use crate::flow::looped::LoopedSurface;
use crate::flow::scale::at_unit_scale;
use crate::flow::schemes::FaceShape;
use crate::flow::seamless::{SeamlessError, SeamlessParams, Start, seamless};
use crate::flow::signature::Signature;
use crate::flow::step::FlowStep;
use crate::flow::straighten::{StraightenError, Straightened, straighten};
use crate::flow::surface_delaunay::SurfaceDelaunay;
use crate::flow::vertex_scale::nearest_scale;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeId, EdgeVec, FaceVec, VertexId, VertexVec};
use crate::observe::Observer;
use std::f64::consts::TAU;

/// Most Newton steps: metrics that exist are met in far fewer.
const MOST_STEPS: usize = 100;

/// What a metric is sought on: a surface, or what is left of it along features, with its Delaunay triangulation, its loops and what they shall turn by.
#[derive(Clone, Copy)]
pub(super) struct Sought<'a> {
    pub(super) surface: &'a Connectivity,
    pub(super) ground: &'a SurfaceDelaunay,
    pub(super) on: &'a LoopedSurface<'a>,
    pub(super) signature: &'a Signature,
}

impl Sought<'_> {
    /// ln of the lengths of the surface's own metric on the triangulation of the loops (Penner coordinates).
    pub(super) fn log_length(&self) -> EdgeVec<f64> {
        self.ground.on_symmetric(self.ground.log_length.clone())
    }

    /// The metric that Newton's method finds from Penner coordinates, in `max_steps` steps at the most.
    pub(super) fn from(
        &self,
        log_length: &EdgeVec<f64>,
        params: &FlowParams,
        max_steps: usize,
        observer: &dyn Observer,
    ) -> Result<FlatMetric, FlowError> {
        let on = self.on;
        let start = Start {
            connectivity: on.connectivity,
            length: &on.length,
            log_length: Some(log_length),
            reflection: on.reflection(),
            glued: &on.glued,
        };
        let params = SeamlessParams {
            tolerance: params.curvature_tolerance,
            conformality: params.conformality,
            max_steps: max_steps.min(MOST_STEPS),
        };
        let found = seamless(&start, &on.loops, self.signature, &params, observer)?;
        let log_length = found.penner.iter().map(|l| 0.5 * l).collect();
        let lines = on.glued.as_flattened();
        let mut metric = with_lengths(self.surface, self.ground, on, log_length, lines)?;
        metric.history = found.history.iter().map(FlowStep::from).collect();
        metric.max_curvature_error = found.max_error;
        if let Some(record) = &mut metric.quarter_turns {
            let turns = self.signature.turning.iter().copied();
            record.loops = turns.zip(found.residual).collect();
        }
        Ok(metric)
    }

    /// The same where no features are lines: from the surface's own metric and, where Newton does not arrive from there, from the `conformal` one with these cones. That one exists
    /// always, and turnings alone are left to change from there; where there are no loops, it is what is sought.
    pub(super) fn without_features(
        &self,
        params: &FlowParams,
        conformal: impl FnOnce() -> Result<FlatMetric, FlowError>,
        observer: &dyn Observer,
    ) -> Result<FlatMetric, FlowError> {
        let max_steps = params.max_newton_steps;
        let own = self.log_length();
        match self.from(&own, params, max_steps, observer) {
            Err(
                FlowError::Seamless(
                    SeamlessError::Stalled { .. }
                    | SeamlessError::BrokenFaces { .. }
                    | SeamlessError::TooDense { .. }
                    | SeamlessError::Solve(_),
                )
                | FlowError::Lines(_),
            ) => {
                let mut conformal = conformal()?;
                if self.signature.turning.is_empty() {
                    conformal.quarter_turns = Some(Box::default());
                    return Ok(conformal);
                }
                let (c, u) = (self.on.connectivity, conformal.scale());
                let scaled = |(e, l): (EdgeId, &f64)| {
                    let [i, j] = c.edge_vertices(e);
                    l + 0.5 * (u[i] + u[j])
                };
                let scaled = own.enumerate().map(scaled).collect();
                self.from(&scaled, params, max_steps, observer)
            }
            result => result,
        }
    }
}

/// The metric that the triangulation of loops has with other lengths (natural logarithms, Penner coordinates), whose Delaunay triangulation must be flat but for cones, and
/// symmetric on a double. `on` must be that of `surface` and `ground`; `lines`: edges of A on the mirror that shall be edges of C. The record of how it was found is
/// empty.
pub(crate) fn with_lengths(
    surface: &Connectivity,
    ground: &SurfaceDelaunay,
    on: &LoopedSurface,
    log_length: EdgeVec<f64>,
    lines: &[EdgeId],
) -> Result<FlatMetric, FlowError> {
    let own = on.own();
    // Penner coordinates as well: T need not be Delaunay, so its lengths in the surface are others.
    let from = ground.on_symmetric(ground.log_length.clone());
    let change = own.edges().map(|e| {
        let whole = on.connectivity.edge(own.edge_halfedge(e));
        log_length[whole] - from[whole]
    });
    let mut u = nearest_scale(own, &change.collect())?;
    if let Some(reflection) = on.reflection() {
        let own = |(v, image): (VertexId, &VertexId)| u[v.min(*image)];
        u = reflection.vertex.enumerate().map(own).collect();
    }
    let log_length = ground.on_delaunay(log_length);
    let parts = log_length.iter().zip(ground.log_length.iter());
    let change: EdgeVec<f64> = parts.map(|(to, from)| to - from).collect();
    let conformal_error = conformal_error(&ground.delaunay, &change, &u);
    let delaunay_penner = at_unit_scale(&ground.delaunay, &log_length, &u);
    let (mut flat, mut shape) = flipped(ground, log_length);
    if !surface.is_closed() {
        straighten_mirror(&mut flat, &ground.base, surface, lines)?;
        let still = VertexVec::filled(0.0, ground.base.vertex_count());
        flat.update_shapes(&still, &mut shape);
    }
    let c = &flat.connectivity;
    let mut curvature = VertexVec::filled(TAU, c.vertex_count());
    for (f, shape) in shape.enumerate() {
        let corners = c.face_vertices(f).into_iter().zip(shape.angle);
        corners.for_each(|(v, angle)| curvature[v] -= angle);
    }
    let half = |(v, k): (VertexId, &f64)| match surface.is_boundary_vertex(v) {
        true => 0.5 * k,
        false => *k,
    };
    let own = surface.vertex_count();
    let log_length = flat.log_lengths();
    let penner = at_unit_scale(c, &log_length, &u);
    Ok(FlatMetric {
        log_scale: u.as_slice()[..own].to_vec().into(),
        length: log_length.iter().map(|l| l.exp()).collect(),
        curvature: curvature.enumerate().take(own).map(half).collect(),
        history: Vec::new(),
        max_curvature_error: 0.0,
        fit: None,
        opened: None,
        quarter_turns: Some(Box::new(QuarterTurns {
            conformal_error,
            ..QuarterTurns::default()
        })),
        intrinsic: Some(Box::new(ground.clone().leave(
            surface.face_count(),
            flat,
            penner,
            u,
            Some(delaunay_penner),
        ))),
    })
}

/// Makes the mirror an edge of the flat triangulation everywhere, so that nothing crosses it; where faces without width do not allow that, `lines` alone.
fn straighten_mirror(
    flat: &mut Delaunay,
    base: &Connectivity,
    surface: &Connectivity,
    lines: &[EdgeId],
) -> Result<(), StraightenError> {
    let border = surface.halfedges().filter(|&h| surface.twin(h).is_none());
    let mirror: Vec<EdgeId> = border.map(|h| base.edge(h)).collect();
    let mut whole = flat.clone();
    match straighten(&mut whole, base, &mirror) {
        Ok(Straightened { flips, edge }) => {
            if !flips.is_empty() {
                // Faces beside the mirror may have their corners on one line now: Delaunay, but for the mirror.
                let mut held = EdgeVec::filled(false, whole.connectivity.edge_count());
                edge.into_iter().for_each(|e| held[e] = true);
                whole = whole.holding(held);
                whole.flip_in_the_surface();
            }
            *flat = whole;
        }
        Err(_) => {
            straighten(flat, base, lines)?;
        }
    }
    Ok(())
}

/// Root of the mean square and maximum of λ* − λ⁰ − (u_i + u_j) over all edges; `change`: of half the λ.
fn conformal_error(c: &Connectivity, change: &EdgeVec<f64>, u: &VertexVec<f64>) -> [f64; 2] {
    let of = |(e, change): (EdgeId, &f64)| {
        let [i, j] = c.edge_vertices(e);
        2.0 * change - (u[i] + u[j])
    };
    let (sum, most) = change
        .enumerate()
        .map(of)
        .fold((0.0, 0.0), |(sum, most), x| {
            (sum + x * x, f64::max(most, x.abs()))
        });
    [(sum / c.edge_count().max(1) as f64).sqrt(), most]
}

/// B with other lengths, flipped until it is Delaunay, with the shapes of its faces; told are the correspondences of A and of B with it.
fn flipped(ground: &SurfaceDelaunay, log_length: EdgeVec<f64>) -> (Delaunay, FaceVec<FaceShape>) {
    let b = &ground.delaunay;
    let correspondences = vec![ground.base_on_delaunay.clone(), Correspondence::identity(b)];
    let mut flat = Delaunay::from_logs(b.clone(), log_length, correspondences);
    let mut shape = FaceVec::default();
    flat.evaluate(&VertexVec::filled(0.0, b.vertex_count()), &mut shape);
    (flat, shape)
}
