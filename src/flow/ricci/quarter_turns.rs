//! Metrics whose transitions are quarter turns: cones *and* the turning of every loop are prescribed.
//!
//! *Enters:* a closed surface, cones of multiples of π/2. *Leaves:* a [`FlatMetric`] like that of the conformal flow, with the scale that comes nearest to it.
//! *Guaranteed:* cones and turnings to the tolerance, or an error. *Not guaranteed:* that the metric is conformal: where the surface has handles no
//! conformal one need exist.
//!
//! Where the cones are those of a cross field, its turnings come with them ([`Prescription::turning`]). Otherwise they are the quarter turns nearest to
//! what loops turn in the conformal metric with these cones, which is found first: so little is left to change.

use super::error::FlowError;
use super::flat_metric::FlatMetric;
use super::flipping::{self, Surface};
use super::params::FlowParams;
use crate::flow::correspondence::Correspondence;
use crate::flow::delaunay::Delaunay;
use crate::flow::holonomy::{DualLoops, homology_basis};
use crate::flow::prescription::Prescription;
use crate::flow::scale::at_unit_scale;
use crate::flow::schemes::FaceShape;
use crate::flow::seamless::{SeamlessParams, SeamlessStep, seamless};
use crate::flow::signature::{FULL_TURN, Signature};
use crate::flow::step::FlowStep;
use crate::flow::surface_delaunay::SurfaceDelaunay;
use crate::flow::vertex_scale::nearest_scale;
use crate::geometry::ids::{EdgeVec, FaceVec, VertexId, VertexVec};
use crate::observe::Observer;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Curvatures that are multiples of π/2 up to rounding are so to this, radians.
const ROUNDING: f64 = 1e-9;

/// See the module docs.
pub(super) fn flow(
    surface: Surface,
    prescription: &Prescription,
    params: &FlowParams,
    observer: &dyn Observer,
) -> Result<FlatMetric, FlowError> {
    let c = surface.connectivity;
    if !c.is_closed() {
        let boundary_loops = c.boundary_loops().len();
        return Err(FlowError::QuarterTurnsOnBoundary { boundary_loops });
    }
    let cone = quarters(&prescription.target)?;
    let ground = SurfaceDelaunay::new(c, surface.source_length)?;
    let loops = homology_basis(&ground.delaunay)?;
    let turning = match &prescription.turning {
        Some(turning) => turning.clone(),
        None => {
            let prescribed = VertexVec::filled(true, c.vertex_count());
            let target = prescription.target.clone();
            let conformal = flipping::flow(surface, target, prescribed, params, observer)?;
            let turning = turning_at(&ground, &conformal.log_scale, &loops);
            turning.iter().map(|t| (t / FRAC_PI_2).round() as i64).collect()
        }
    };
    let signature = Signature { cone, turning };
    let found = seamless(
        &ground.delaunay,
        &ground.length(),
        &loops,
        &signature,
        &SeamlessParams {
            tolerance: params.curvature_tolerance,
            conformality: params.conformality,
            max_steps: params.max_newton_steps,
        },
        observer,
    )?;
    let log_length: EdgeVec<f64> = found.penner.iter().map(|l| 0.5 * l).collect();
    let parts = log_length.iter().zip(ground.log_length.iter());
    let change: EdgeVec<f64> = parts.map(|(to, from)| to - from).collect();
    let u = nearest_scale(&ground.delaunay, &change)?;
    let delaunay_penner = at_unit_scale(&ground.delaunay, &log_length, &u);
    let (flat, shape) = flipped(&ground, log_length);
    let mut curvature = VertexVec::filled(TAU, c.vertex_count());
    for (f, shape) in shape.enumerate() {
        let corners = flat.connectivity.face_vertices(f).into_iter();
        corners.zip(shape.angle).for_each(|(v, angle)| curvature[v] -= angle);
    }
    let penner = at_unit_scale(&flat.connectivity, &flat.log_lengths(), &u);
    Ok(FlatMetric {
        log_scale: u.clone(),
        length: flat.log_lengths().iter().map(|l| l.exp()).collect(),
        curvature,
        history: found.history.iter().map(line).collect(),
        max_curvature_error: found.max_error,
        fit: None,
        intrinsic: Some(Box::new(ground.leave(
            c.face_count(),
            flat,
            penner,
            u,
            Some(delaunay_penner),
        ))),
    })
}

/// Cone angles in quarter turns.
fn quarters(target: &VertexVec<f64>) -> Result<VertexVec<i64>, FlowError> {
    let of = |(vertex, &curvature): (VertexId, &f64)| {
        let turns = (curvature / FRAC_PI_2).round();
        match (curvature - turns * FRAC_PI_2).abs() <= ROUNDING {
            true => Ok(FULL_TURN - turns as i64),
            false => Err(FlowError::NoQuarterTurns { vertex, curvature }),
        }
    };
    target.enumerate().map(of).collect()
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

/// By how much loops on B turn in the metric with the scale `u`, radians.
fn turning_at(ground: &SurfaceDelaunay, u: &VertexVec<f64>, loops: &DualLoops) -> Vec<f64> {
    let b = &ground.delaunay;
    let mut flat = Delaunay::from_logs(b.clone(), ground.log_length.clone(), Vec::new());
    flat.record = Some(Vec::new());
    let mut shape = FaceVec::default();
    flat.evaluate(u, &mut shape);
    let c = &flat.connectivity;
    let mut loops = loops.clone();
    for flip in flat.record.iter().flatten() {
        loops.flipped(c, &flip.flip);
    }
    loops.turning(c, |corner| shape[c.face(corner)].angle[c.corner(corner)])
}

/// A line of the convergence record.
fn line(step: &SeamlessStep) -> FlowStep {
    FlowStep {
        iteration: step.iteration,
        max_error: step.max_error,
        energy: step.energy,
        step: step.step,
        flips: step.flips,
        flow_time: step.iteration as f64,
    }
}
