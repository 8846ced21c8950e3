//! Metrics whose transitions are quarter turns: cones *and* the turning of every loop are prescribed.
//!
//! *Enters:* a surface, cones of multiples of π/2; where it has a boundary, prescribed corners there, multiples too. *Leaves:* a [`FlatMetric`] like that of the
//! conformal flow, with the scale that comes nearest to it.
//! *Guaranteed:* cones and turnings to the tolerance, or an error; borders are straight between corners, and the turn from one to another is a multiple of π/2.
//! *Not guaranteed:* that the metric is conformal: where the surface has handles no conformal one need exist.
//!
//! Where the cones are those of a cross field, its turnings come with them ([`Prescription::turning`]). Otherwise they are the quarter turns nearest to
//! what loops turn in the conformal metric with these cones, which is found first: so little is left to change.

use super::error::FlowError;
use super::flat_metric::{FlatMetric, QuarterTurns};
use super::flipping::{self, Surface};
use super::params::FlowParams;
use crate::flow::correspondence::Correspondence;
use crate::flow::delaunay::Delaunay;
use crate::flow::features::Feature;
use crate::flow::looped::LoopedSurface;
use crate::flow::metric::face_lengths;
use crate::flow::mirror::Reflection;
use crate::flow::opened::Opened;
use crate::flow::prescription::{BoundaryCondition, FromField, Prescription};
use crate::flow::scale::at_unit_scale;
use crate::flow::schemes::FaceShape;
use crate::flow::seamless::{
    SeamlessError, SeamlessMetric, SeamlessParams, SeamlessStep, Start, seamless,
};
use crate::flow::signature::{FULL_TURN, Signature};
use crate::flow::step::FlowStep;
use crate::flow::straighten::{StraightenError, straighten};
use crate::flow::surface_delaunay::SurfaceDelaunay;
use crate::flow::vertex_scale::nearest_scale;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeId, EdgeVec, FaceVec, VertexId, VertexVec};
use crate::geometry::triangle;
use crate::observe::Observer;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Curvatures that are multiples of π/2 up to rounding are so to this, radians.
const ROUNDING: f64 = 1e-9;

/// Most Newton steps, and as long as features may be given up: metrics that exist are met in far fewer.
const MOST_STEPS: usize = 100;
const STEPS_WITH_FEATURES: usize = 40;

/// See the module docs.
pub(super) fn flow(
    surface: Surface,
    prescription: &Prescription,
    params: &FlowParams,
    observer: &dyn Observer,
) -> Result<FlatMetric, FlowError> {
    let c = surface.connectivity;
    if !c.is_closed() && prescription.boundary == BoundaryCondition::Free {
        let boundary_loops = c.boundary_loops().len();
        return Err(FlowError::QuarterTurnsOnFreeBoundary { boundary_loops });
    }
    match &prescription.field {
        Some(field) => along_features(surface, field, params, observer),
        None => with_cones(surface, prescription, params, observer),
    }
}

/// Cones and corners that are given, with the nearest turnings.
fn with_cones(
    surface: Surface,
    prescription: &Prescription,
    params: &FlowParams,
    observer: &dyn Observer,
) -> Result<FlatMetric, FlowError> {
    let c = surface.connectivity;
    let ground = SurfaceDelaunay::new(c, surface.source_length)?;
    let on = LoopedSurface::new(c, &ground)?;
    let own = quarters(&prescription.target)?;
    let doubled = |&v: &VertexId| match c.is_boundary_vertex(v) {
        true => FULL_TURN - 2 * own[v],
        false => FULL_TURN - own[v],
    };
    let log_length = ground.on_symmetric(ground.log_length.clone());
    let prescribed = VertexVec::filled(true, c.vertex_count());
    let target = prescription.target.clone();
    let conformal = flipping::flow(surface, target, prescribed, params, observer)?;
    let signature = Signature {
        cone: ground.original.iter().map(doubled).collect(),
        turning: nearest_turning(&on, &log_length, &conformal),
    };
    let max_steps = params.max_newton_steps.min(MOST_STEPS);
    let found = solved(&on, &log_length, &signature, params, max_steps, observer)?;
    let log_length = found.penner.iter().map(|l| 0.5 * l).collect();
    let log_length = ground.on_delaunay(log_length);
    let metric = with_lengths(c, ground, log_length, &[])?;
    Ok(recorded(metric, found, &signature, QuarterTurns::default()))
}

/// Cones and turnings of a field, with as many of its features as lines as Newton's method can meet.
fn along_features(
    surface: Surface,
    from: &FromField,
    params: &FlowParams,
    observer: &dyn Observer,
) -> Result<FlatMetric, FlowError> {
    let c = surface.connectivity;
    let all = edges_of(from.features.iter());
    let mut is_held = vec![true; from.features.len()];
    loop {
        let held = || {
            let features = from.features.iter().zip(&is_held);
            features.filter(|(_, held)| **held).map(|(f, _)| f)
        };
        let opened = Opened::new(c, &edges_of(held()))?;
        let ground = SurfaceDelaunay::along_features(c, surface.source_length, &opened, &all)?;
        let on = LoopedSurface::along_features(&opened, &ground)?;
        let signature = match is_held.iter().all(|held| *held) {
            true => from.signature.clone(),
            false => without(from, &is_held, &on)?,
        };
        let log_length = ground.on_symmetric(ground.log_length.clone());
        let max_steps = match held().next() {
            Some(_) => params.max_newton_steps.min(STEPS_WITH_FEATURES),
            None => params.max_newton_steps.min(MOST_STEPS),
        };
        // The feature of every pair of sides.
        let features = from
            .features
            .iter()
            .enumerate()
            .filter(|(i, _)| is_held[*i]);
        let owner = features.flat_map(|(i, f)| f.edges.iter().map(move |_| i));
        let (owner, glued): (Vec<usize>, _) = (owner.collect(), on.glued.concat());
        let found = match solved(&on, &log_length, &signature, params, max_steps, observer) {
            Ok(found) => {
                let log_length = found.penner.iter().map(|l| 0.5 * l).collect();
                let log_length = ground.on_delaunay(log_length);
                with_lengths(&opened.connectivity, ground, log_length, &glued)
                    .map(|metric| (metric, found))
            }
            Err(error) => Err(error.into()),
        };
        let (mut metric, found) = match found {
            Ok(found) => found,
            Err(error) => {
                let Some(least) = is_held.iter().rposition(|held| *held) else {
                    return Err(error);
                };
                let of_side = |edge: EdgeId| {
                    let side = glued.iter().position(|&e| e == edge)?;
                    owner.get(side / 2).copied()
                };
                let which = match &error {
                    FlowError::Seamless(SeamlessError::Stalled { missing, .. }) => {
                        hardest(&from.features, &is_held, &opened, missing)
                    }
                    FlowError::Seamless(SeamlessError::NoLine { edge })
                    | FlowError::Lines(StraightenError::Bent { edge }) => {
                        of_side(*edge).unwrap_or(least)
                    }
                    FlowError::Lines(StraightenError::Correspondence(_))
                    | FlowError::Seamless(
                        SeamlessError::BrokenFaces { .. }
                        | SeamlessError::TooDense { .. }
                        | SeamlessError::Infeasible(_)
                        | SeamlessError::Solve(_),
                    ) => least,
                    _ => return Err(error),
                };
                is_held[which] = false;
                continue;
            }
        };
        let (features, is_held) = (from.features.iter(), is_held.iter());
        let (lines, others): (Vec<_>, Vec<_>) = features.zip(is_held).partition(|(_, held)| **held);
        let cloned = |features: Vec<(&Feature, &bool)>| -> Vec<Feature> {
            features.into_iter().map(|(f, _)| f.clone()).collect()
        };
        let met = QuarterTurns {
            adjusted: from.adjusted,
            lines: cloned(lines),
            given_up: [cloned(others), from.crowded.clone()].concat(),
            ..QuarterTurns::default()
        };
        if !met.lines.is_empty() {
            metric.log_scale = joined_scale(&metric.log_scale, &opened, c.vertex_count());
            metric.curvature = joined_curvature(&metric.curvature, &opened, c);
            metric.opened = Some(Box::new(opened));
        }
        return Ok(recorded(metric, found, &signature, met));
    }
}

/// The feature where most is missing; of equal ones the least important.
fn hardest(
    features: &[Feature],
    is_held: &[bool],
    opened: &Opened,
    missing: &VertexVec<f64>,
) -> usize {
    let mut at = VertexVec::filled(0.0, opened.vertex.len());
    for (sector, &v) in opened.vertex.enumerate() {
        at[v] += missing[sector] * missing[sector];
    }
    let (mut worst, mut most) = (is_held.iter().rposition(|held| *held).unwrap_or(0), 0.0);
    for (which, feature) in features.iter().enumerate().filter(|(i, _)| is_held[*i]) {
        let sum: f64 = feature.vertices.iter().map(|&v| at[v]).sum();
        if sum >= most && sum > 0.0 {
            (worst, most) = (which, sum);
        }
    }
    worst
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
    Ok(field.signature(on, &angle.collect())?)
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

fn solved(
    on: &LoopedSurface,
    log_length: &EdgeVec<f64>,
    signature: &Signature,
    params: &FlowParams,
    max_steps: usize,
    observer: &dyn Observer,
) -> Result<SeamlessMetric, SeamlessError> {
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
        max_steps,
    };
    seamless(&start, &on.loops, signature, &params, observer)
}

/// The metric with the record of how it was found.
fn recorded(
    mut metric: FlatMetric,
    found: SeamlessMetric,
    signature: &Signature,
    met: QuarterTurns,
) -> FlatMetric {
    metric.history = found.history.iter().map(line).collect();
    metric.max_curvature_error = found.max_error;
    if let Some(record) = &mut metric.quarter_turns {
        let turns = signature.turning.iter().copied();
        **record = QuarterTurns {
            loops: turns.zip(found.residual).collect(),
            conformal_error: record.conformal_error,
            ..met
        };
    }
    metric
}

/// The metric that B has with other lengths (natural logarithms, Penner coordinates), whose Delaunay triangulation must be flat but for cones, and symmetric on a
/// double. `lines`: edges of A on the mirror that shall be edges of C. The record of how it was found is empty.
pub(crate) fn with_lengths(
    surface: &Connectivity,
    ground: SurfaceDelaunay,
    log_length: EdgeVec<f64>,
    lines: &[EdgeId],
) -> Result<FlatMetric, FlowError> {
    let parts = log_length.iter().zip(ground.log_length.iter());
    let change: EdgeVec<f64> = parts.map(|(to, from)| to - from).collect();
    let mut u = nearest_scale(&ground.delaunay, &change)?;
    if !surface.is_closed() {
        // Vertices are those of the double as it was made, whatever was flipped.
        u = Reflection::new(&ground.base, surface.face_count()).mean(&u);
    }
    let conformal_error = conformal_error(&ground.delaunay, &change, &u);
    let delaunay_penner = at_unit_scale(&ground.delaunay, &log_length, &u);
    let (mut flat, mut shape) = flipped(&ground, log_length);
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
        intrinsic: Some(Box::new(ground.leave(
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
        Ok(_) => *flat = whole,
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

/// Curvatures in quarter turns.
fn quarters(target: &VertexVec<f64>) -> Result<VertexVec<i64>, FlowError> {
    let of = |(vertex, &curvature): (VertexId, &f64)| {
        let turns = (curvature / FRAC_PI_2).round();
        match (curvature - turns * FRAC_PI_2).abs() <= ROUNDING {
            true => Ok(turns as i64),
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

/// By how much loops turn in a conformal metric, to the nearest quarter turn. `log_length`: of the surface's own metric on the triangulation of the loops. A
/// loop that crosses the mirror does so twice, so it turns by an even number.
fn nearest_turning(
    on: &LoopedSurface,
    log_length: &EdgeVec<f64>,
    conformal: &FlatMetric,
) -> Vec<i64> {
    let u = match &conformal.intrinsic {
        Some(intrinsic) => &intrinsic.u,
        None => &conformal.log_scale,
    };
    let turned = turning_at(on, log_length, u);
    let turned = turned.iter().enumerate().map(|(of, turned)| {
        let crosses = |h| {
            on.reflection()
                .is_some_and(|r| on.connectivity.twin(h) == Some(r.halfedge[h]))
        };
        let step = match on.loops.passages(of).any(|way| crosses(way.leave)) {
            true => 2,
            false => 1,
        };
        step * (turned / (FRAC_PI_2 * step as f64)).round() as i64
    });
    turned.collect()
}

/// By how much loops turn in the metric with the scale `u`, radians.
fn turning_at(on: &LoopedSurface, log_length: &EdgeVec<f64>, u: &VertexVec<f64>) -> Vec<f64> {
    let base = on.connectivity;
    let mut flat = Delaunay::from_logs(base.clone(), log_length.clone(), Vec::new());
    flat.record = Some(Vec::new());
    let mut shape = FaceVec::default();
    flat.evaluate(u, &mut shape);
    let c = &flat.connectivity;
    let mut loops = on.loops.clone();
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

#[cfg(test)]
mod tests {
    use super::super::{Holonomy, flow as run, shapes};
    use super::*;
    use crate::flow::holonomy::homology_basis;

    fn params(holonomy: Holonomy) -> FlowParams {
        FlowParams {
            holonomy,
            ..FlowParams::default()
        }
    }

    /// The metric of a shape with quarter turns: curvatures are met, and by its lengths alone every loop of the surface or its double turns by quarters.
    fn assert_quarter_turns(shape: &shapes::Shape, prescription: &Prescription) {
        let (c, length) = (&shape.connectivity, &shape.length);
        let quarter_turns = params(Holonomy::QuarterTurns);
        let found = run(c, length, prescription, &quarter_turns, &()).unwrap();
        assert!(found.max_curvature_error <= 1e-10);
        let parts = found.curvature.iter().zip(prescription.target.iter());
        parts.for_each(|(a, b)| assert!((a - b).abs() < 1e-9, "{a} against {b}"));
        let flat = &found.intrinsic.as_ref().unwrap().flat;
        let angles = |f| triangle::angles(face_lengths(flat, &found.length, f)).unwrap();
        let angle: FaceVec<[f64; 3]> = flat.faces().map(angles).collect();
        let loops = homology_basis(flat).unwrap();
        for turned in loops.turning(flat, |h| angle[flat.face(h)][flat.corner(h)]) {
            let quarters = turned / FRAC_PI_2;
            assert!((quarters - quarters.round()).abs() < 1e-8, "{turned}");
        }
    }

    /// Where lengths change by a scale, everything is as the conformal flow leaves it.
    #[test]
    fn a_conformal_change_is_that_of_the_conformal_flow() {
        for shape in [
            shapes::plate(0, 2),
            shapes::torus(9, 7),
            shapes::plate(2, 2),
            shapes::sheet(9, true),
        ] {
            let (c, length) = (&shape.connectivity, &shape.length);
            let prescription = match c.is_closed() {
                true => shape.prescribe_default(),
                false => shape.prescribe_uniform_boundary(),
            };
            let expected = run(c, length, &prescription, &params(Holonomy::Free), &()).unwrap();
            let x = expected.intrinsic.as_ref().unwrap();
            let ground = SurfaceDelaunay::new(c, length).unwrap();
            let scaled = |(e, l): (_, &f64)| {
                let [i, j] = x.delaunay.edge_vertices(e);
                l + 0.5 * (x.u[i] + x.u[j])
            };
            let log_length = ground.log_length.enumerate().map(scaled).collect();
            let found = with_lengths(c, ground, log_length, &[]).unwrap();
            let y = found.intrinsic.as_ref().unwrap();
            let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} against {b}");
            x.u.iter().zip(y.u.iter()).for_each(|(a, b)| close(*a, *b));
            let unit = y.delaunay_penner.as_ref().unwrap();
            x.delaunay_length
                .iter()
                .zip(unit.iter())
                .for_each(|(a, b)| close(a.ln(), *b));
            expected
                .curvature
                .iter()
                .zip(found.curvature.iter())
                .for_each(|(a, b)| {
                    assert!((a - b).abs() < 1e-9, "{a} against {b}");
                });
        }
    }

    /// Cones that are given, on a surface with handles: the loops turn by quarters too, which they do not in the conformal metric.
    #[test]
    fn loops_turn_by_the_nearest_quarters() {
        let shape = shapes::plate(2, 2);
        let (c, length) = (&shape.connectivity, &shape.length);
        let count = 8;
        let places = shape.spread(count);
        let cones: Vec<(usize, f64)> = places.iter().map(|&v| (v, -0.5 * PI)).collect();
        let prescription = shape.prescribe(&cones);
        let conformal = run(c, length, &prescription, &params(Holonomy::Free), &()).unwrap();
        assert_quarter_turns(&shape, &prescription);
        let ground = SurfaceDelaunay::new(c, length).unwrap();
        let on = LoopedSurface::new(c, &ground).unwrap();
        let before = turning_at(&on, &ground.log_length, &conformal.log_scale);
        let off = |t: &f64| (t / FRAC_PI_2 - (t / FRAC_PI_2).round()).abs();
        assert!(
            before.iter().any(|t| off(t) > 1e-3),
            "no loop is off: {before:?}"
        );
    }

    /// Corners that are given, on an annulus: the way from border to border turns by a multiple of π/2 too, which a conformal metric does not make it do.
    #[test]
    fn given_corners_make_straight_borders() {
        let shape = shapes::sheet(9, true);
        let (c, length) = (&shape.connectivity, &shape.length);
        let corners = |of: usize, curvature: f64| {
            let chain = &c.boundary_loops()[of];
            let tails = (0..4).map(|k| c.tail(chain[k * chain.len() / 4]).index());
            tails.map(move |v| (v, curvature)).collect::<Vec<_>>()
        };
        let cones = [corners(0, 0.5 * PI), corners(1, -0.5 * PI)].concat();
        let prescription = Prescription {
            boundary: BoundaryCondition::Prescribed,
            ..shape.prescribe(&cones)
        };
        assert_quarter_turns(&shape, &prescription);
        let ground = SurfaceDelaunay::new(c, length).unwrap();
        let on = LoopedSurface::new(c, &ground).unwrap();
        let log_length = ground.on_symmetric(ground.log_length.clone());
        let free = run(c, length, &prescription, &params(Holonomy::Free), &()).unwrap();
        let before = turning_at(&on, &log_length, &free.intrinsic.unwrap().u);
        let off = |t: f64| (t / PI - (t / PI).round()).abs();
        assert!(before.len() == 1 && off(before[0]) > 1e-4, "{before:?}");
    }

    #[test]
    fn what_cannot_be_is_refused_in_words() {
        let sphere = shapes::plate(0, 2);
        let places = sphere.spread(3);
        let cones: Vec<(usize, f64)> = places.iter().map(|&v| (v, 4.0 / 3.0 * PI)).collect();
        let quarter_turns = params(Holonomy::QuarterTurns);
        let refuse = |shape: &shapes::Shape, cones: &[(usize, f64)], params: &FlowParams| {
            let (c, length) = (&shape.connectivity, &shape.length);
            run(c, length, &shape.prescribe(cones), params, &())
                .unwrap_err()
                .to_string()
        };
        let said = refuse(&sphere, &cones, &quarter_turns);
        assert!(
            said.contains("4/3π") && said.contains("cones.quantum"),
            "{said}"
        );
        let said = refuse(&shapes::sheet(5, false), &[], &quarter_turns);
        assert!(
            said.contains("1 boundary loop is \"free\"") && said.contains("boundary.condition"),
            "{said}"
        );
        let gradient = FlowParams {
            solver: super::super::Solver::Gradient,
            ..quarter_turns
        };
        let said = refuse(&sphere, &cones, &gradient);
        assert!(said.contains("flow.solver = \"gradient\""), "{said}");
        let torus = shapes::torus(9, 7);
        let said = refuse(&torus, &[(0, 0.5 * PI), (30, -0.5 * PI)], &quarter_turns);
        assert!(said.contains("no torus has just two cones"), "{said}");
    }
}
