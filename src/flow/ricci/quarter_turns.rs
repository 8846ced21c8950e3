//! Metrics whose transitions are quarter turns: cones *and* the turning of every loop are prescribed.
//!
//! *Enters:* a surface, cones of multiples of π/2; where it has a boundary, prescribed corners there, multiples too. *Leaves:* a [`FlatMetric`] like that of the
//! conformal flow, with the scale that comes nearest to it.
//! *Guaranteed:* cones and turnings to the tolerance, or an error; borders are straight between corners, and the turn from one to another is a multiple of π/2.
//! *Not guaranteed:* that the metric is conformal: where the surface has handles no conformal one need exist.
//!
//! Where the cones are those of a cross field, its turnings come with them, and features that shall be lines (`along_features`). Otherwise they are the quarter turns nearest to
//! what loops turn in the conformal metric with these cones, which is found first: so little is left to change.

use super::along_features;
use super::error::FlowError;
use super::flat_metric::FlatMetric;
use super::flipping::{self, Surface};
use super::params::FlowParams;
use super::seamless_metric::Sought;
use crate::flow::delaunay::Delaunay;
use crate::flow::looped::LoopedSurface;
use crate::flow::prescription::{BoundaryCondition, Prescription};
use crate::flow::signature::{FULL_TURN, Signature};
use crate::flow::surface_delaunay::SurfaceDelaunay;
use crate::geometry::ids::{EdgeVec, FaceVec, VertexId, VertexVec};
use crate::observe::Observer;
use std::f64::consts::FRAC_PI_2;

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
    if !c.is_closed() && prescription.boundary == BoundaryCondition::Free {
        let boundary_loops = c.boundary_loops().len();
        return Err(FlowError::QuarterTurnsOnFreeBoundary { boundary_loops });
    }
    match &prescription.field {
        Some(field) => along_features::flow(surface, field, params, observer),
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
    let sought = Sought {
        surface: c,
        ground: &ground,
        on: &on,
        signature: &signature,
    };
    sought.without_features(params, || Ok(conformal), observer)
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

/// By how much loops turn in a conformal metric, to the nearest quarter turn. `log_length`: of the surface's own metric on the triangulation of the loops. A
/// loop that crosses the mirror does so twice, so it turns by an even number.
fn nearest_turning(
    on: &LoopedSurface,
    log_length: &EdgeVec<f64>,
    conformal: &FlatMetric,
) -> Vec<i64> {
    let turned = turning_at(on, log_length, conformal.scale());
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

#[cfg(test)]
mod tests {
    use super::super::seamless_metric::with_lengths;
    use super::super::{Holonomy, flow as run, shapes};
    use super::*;
    use crate::flow::holonomy::homology_basis;
    use crate::flow::metric::face_lengths;
    use crate::geometry::triangle;
    use std::f64::consts::PI;

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

    /// An annulus with obtuse corners opposite the border, where the Delaunay triangulation of its double crosses the mirror.
    fn obtuse_at_the_border() -> shapes::Shape {
        let mut shape = shapes::sheet(9, true);
        let c = &shape.connectivity;
        for h in c.halfedges().filter(|&h| c.twin(h).is_none()) {
            let others = [c.next(h), c.prev(h)].map(|h| c.edge(h));
            if others.iter().all(|&e| !c.is_boundary_edge(e)) {
                let sum: f64 = others.iter().map(|&e| shape.length[e]).sum();
                shape.length[c.edge(h)] = 0.97 * sum;
            }
        }
        let ground = SurfaceDelaunay::new(&shape.connectivity, &shape.length).unwrap();
        assert!(!ground.symmetric.unwrap().flips.is_empty());
        shape
    }

    /// Where lengths change by a scale, everything is as the conformal flow leaves it.
    #[test]
    fn a_conformal_change_is_that_of_the_conformal_flow() {
        for shape in [
            shapes::plate(0, 2),
            shapes::torus(9, 7),
            shapes::plate(2, 2),
            shapes::sheet(9, true),
            obtuse_at_the_border(),
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
            let log_length = ground.on_symmetric(log_length);
            let on = LoopedSurface::new(c, &ground).unwrap();
            let found = with_lengths(c, &ground, &on, log_length, &[]).unwrap();
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
