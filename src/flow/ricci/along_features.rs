//! Metrics with quarter turns whose cones, turnings and features are those of a cross field.
//!
//! *Enters:* a surface and what a field says of it. *Leaves:* a [`FlatMetric`]. *Guaranteed:* cones and turnings to the tolerance, features that are said to be lines straight and
//! as long on one side as on the other, or an error. *Not guaranteed:* that all features are lines: a cycle of them may ask for more than any metric has. Those that are not are named.

use super::error::FlowError;
use super::flat_metric::FlatMetric;
use super::flipping::{self, Surface};
use super::params::FlowParams;
use super::seamless_metric::Sought;
use crate::flow::features::Feature;
use crate::flow::looped::LoopedSurface;
use crate::flow::metric::face_lengths;
use crate::flow::opened::Opened;
use crate::flow::prescription::FromField;
use crate::flow::seamless::SeamlessError;
use crate::flow::signature::{FULL_TURN, Infeasible, Signature};
use crate::flow::straighten::StraightenError;
use crate::flow::surface_delaunay::SurfaceDelaunay;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeId, VertexVec};
use crate::geometry::triangle;
use crate::observe::Observer;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;

/// Most Newton steps as long as features may be given up: those that can be met are met in fewer.
const STEPS_WITH_FEATURES: usize = 40;

/// Most features that are tried again one by one, after they were given up with others, …
const MOST_AGAIN: usize = 8;
/// … on surfaces of at most so many vertices, where an attempt takes little time.
const MOST_VERTICES: usize = 5_000;

/// Cones and turnings of a field, with as many of its features as lines as Newton's method can meet.
pub(super) fn flow(
    surface: Surface,
    from: &FromField,
    params: &FlowParams,
    observer: &dyn Observer,
) -> Result<FlatMetric, FlowError> {
    let c = surface.connectivity;
    let mut is_held = vec![true; from.features.len()];
    let attempt = |is_held: &[bool]| attempt(&surface, from, is_held, params, observer);
    // Twice as many every time, so that few attempts are needed.
    let mut given_up = 1;
    let (mut metric, mut ground) = loop {
        match attempt(&is_held) {
            Ok(found) => break found,
            Err(Failed { error, first }) if first.is_empty() => return Err(error),
            Err(Failed { error, first }) => {
                tracing::debug!(%error, lines = first.len(), "with fewer features");
                for which in first.into_iter().take(given_up) {
                    is_held[which] = false;
                }
                given_up *= 2;
            }
        }
    };
    let others: Vec<usize> = (0..is_held.len()).filter(|&i| !is_held[i]).collect();
    if others.len() > 1 && c.vertex_count() <= MOST_VERTICES {
        for which in others.into_iter().take(MOST_AGAIN) {
            is_held[which] = true;
            match attempt(&is_held) {
                Ok(found) => (metric, ground) = found,
                Err(Failed { error, .. }) => {
                    tracing::debug!(%error, which, "a feature is given up again");
                    let cancelled = FlowError::Seamless(SeamlessError::Cancelled);
                    if error == FlowError::Cancelled || error == cancelled {
                        return Err(error);
                    }
                    is_held[which] = false;
                }
            }
        }
    }
    let opened = &ground.0;
    let features = from.features.iter().zip(&is_held);
    let (lines, others): (Vec<_>, Vec<_>) = features.partition(|(_, held)| **held);
    let cloned = |features: &[(&Feature, &bool)]| -> Vec<Feature> {
        features.iter().map(|(f, _)| (*f).clone()).collect()
    };
    if let Some(record) = &mut metric.quarter_turns {
        record.moved = from.moved;
        record.lines = cloned(&lines);
        record.given_up = [cloned(&others), from.crowded.clone()].concat();
        record.left_out = from.left_out;
    }
    if !lines.is_empty() {
        metric.log_scale = joined_scale(&metric.log_scale, opened, c.vertex_count());
        metric.curvature = joined_curvature(&metric.curvature, opened, c);
        metric.opened = Some(Box::new(opened.clone()));
    }
    Ok(metric)
}

/// Why there is no metric with some features as lines.
struct Failed {
    error: FlowError,
    /// Which of them may be in the way, the likeliest first; empty where others would not help.
    first: Vec<usize>,
}

impl<E: Into<FlowError>> From<E> for Failed {
    fn from(error: E) -> Self {
        Self {
            error: error.into(),
            first: Vec::new(),
        }
    }
}

/// The metric with these features as lines, and the surface that is cut open along them.
fn attempt(
    surface: &Surface,
    from: &FromField,
    is_held: &[bool],
    params: &FlowParams,
    observer: &dyn Observer,
) -> Result<(FlatMetric, Arc<(Opened, SurfaceDelaunay)>), Failed> {
    let c = surface.connectivity;
    let held: Vec<usize> = (0..is_held.len()).filter(|&i| is_held[i]).collect();
    let is_whole = held.len() == is_held.len();
    let ground = match is_whole {
        true => from.ground.clone(),
        false => {
            let opened = Opened::new(c, &edges_of(held.iter().map(|&i| &from.features[i])))?;
            let (all, length) = (edges_of(from.features.iter()), surface.source_length);
            let ground = SurfaceDelaunay::along_features(c, length, &opened, &all)?;
            Arc::new((opened, ground))
        }
    };
    let (opened, on_it) = &*ground;
    let on = LoopedSurface::along_features(opened, on_it)?;
    let signature = match is_whole {
        true => from.signature.clone(),
        false => without(from, is_held, &on)?,
    };
    let sought = Sought {
        surface: &opened.connectivity,
        ground: on_it,
        on: &on,
        signature: &signature,
    };
    let found = match held.is_empty() {
        false => {
            let max_steps = params.max_newton_steps.min(STEPS_WITH_FEATURES);
            sought.from(&sought.log_length(), params, max_steps, observer)
        }
        true => {
            let conformal = || conformal(*surface, &signature, params, observer);
            sought.without_features(params, conformal, observer)
        }
    };
    let error = match found {
        Ok(metric) => return Ok((metric, ground)),
        Err(error) => error,
    };
    // The feature of a side.
    let of_side = |edge: EdgeId| {
        let owner = held
            .iter()
            .flat_map(|&i| from.features[i].edges.iter().map(move |_| i));
        let side = on.glued.concat().iter().position(|&e| e == edge)?;
        owner.into_iter().nth(side / 2)
    };
    let first = match &error {
        FlowError::Seamless(SeamlessError::Stalled { missing, .. }) => {
            hardest(&from.features, &held, opened, missing)
        }
        FlowError::Seamless(SeamlessError::NoLine { edge })
        | FlowError::Lines(StraightenError::Bent { edge }) => {
            let bent = of_side(*edge);
            let rest = held.iter().rev().copied().filter(|&i| Some(i) != bent);
            bent.into_iter().chain(rest).collect()
        }
        FlowError::Lines(StraightenError::Correspondence(_))
        | FlowError::Seamless(
            SeamlessError::BrokenFaces { .. }
            | SeamlessError::TooDense { .. }
            | SeamlessError::Infeasible(_)
            | SeamlessError::Solve(_),
        ) => held.iter().rev().copied().collect(),
        _ => Vec::new(),
    };
    Err(Failed { error, first })
}

/// The conformal metric with the cones of a signature; borders are straight between corners.
fn conformal(
    surface: Surface,
    signature: &Signature,
    params: &FlowParams,
    observer: &dyn Observer,
) -> Result<FlatMetric, FlowError> {
    let c = surface.connectivity;
    let of = |v| {
        let quarters = FULL_TURN - signature.cone[v];
        // The double of a border bends on both sides.
        let sides = if c.is_boundary_vertex(v) { 2.0 } else { 1.0 };
        quarters as f64 * FRAC_PI_2 / sides
    };
    let target = c.vertices().map(of).collect();
    let prescribed = VertexVec::filled(true, c.vertex_count());
    flipping::flow(surface, target, prescribed, params, observer)
}

/// Features in order of what is missing at their vertices, most first; of equal ones the least important first. `held`: by importance.
fn hardest(
    features: &[Feature],
    held: &[usize],
    opened: &Opened,
    missing: &VertexVec<f64>,
) -> Vec<usize> {
    let mut at = VertexVec::filled(0.0, opened.vertex.len());
    for (sector, &v) in opened.vertex.enumerate() {
        at[v] += missing[sector] * missing[sector];
    }
    let sum = |i: usize| features[i].vertices.iter().map(|&v| at[v]).sum::<f64>();
    let mut first: Vec<(f64, usize)> = held.iter().rev().map(|&i| (sum(i), i)).collect();
    first.sort_by(|a, b| b.0.total_cmp(&a.0));
    first.into_iter().map(|(_, i)| i).collect()
}

/// The signature of a field on a surface where some features are not cut open.
fn without(from: &FromField, is_held: &[bool], on: &LoopedSurface) -> Result<Signature, FlowError> {
    let sides = from.sides.iter().zip(is_held);
    let glued = sides.filter(|(_, held)| !**held).flat_map(|(s, _)| s);
    let field = from.field.glued(&glued.copied().collect::<Vec<_>>());
    let (own, length) = (on.own(), on.own_length());
    let angle = own.faces().map(|f| {
        let angles = triangle::angles(face_lengths(own, &length, f));
        angles.unwrap_or([f64::NAN; 3])
    });
    let mut signature = field.signature(on, &angle.collect())?;
    let checked = signature.check(on.connectivity, &on.loops);
    if let Err(Infeasible::FlatTorus { .. }) = checked {
        signature.turning.fill(0);
    }
    Ok(signature)
}

fn edges_of<'a>(features: impl Iterator<Item = &'a Feature>) -> Vec<EdgeId> {
    features.flat_map(|f| &f.edges).copied().collect()
}

/// The scale of every vertex from those of its sectors: their mean.
fn joined_scale(of_sector: &VertexVec<f64>, opened: &Opened, vertices: usize) -> VertexVec<f64> {
    let mut sum = VertexVec::filled((0.0, 0.0), vertices);
    for (sector, u) in of_sector.enumerate() {
        let (total, count) = &mut sum[opened.vertex[sector]];
        (*total, *count) = (*total + u, *count + 1.0);
    }
    let mean = sum.iter().map(|(total, count): &(f64, f64)| total / count);
    mean.collect()
}

/// The curvature of every vertex from those of its sectors.
fn joined_curvature(
    of_sector: &VertexVec<f64>,
    opened: &Opened,
    surface: &Connectivity,
) -> VertexVec<f64> {
    let flat = |c: &Connectivity, v| if c.is_boundary_vertex(v) { PI } else { TAU };
    let mut curvature: VertexVec<f64> = surface.vertices().map(|v| flat(surface, v)).collect();
    for (sector, &v) in opened.vertex.enumerate() {
        curvature[v] -= flat(&opened.connectivity, sector) - of_sector[sector];
    }
    curvature
}
