//! Vertex scaling with flips, from the base mesh A to the final triangulation C (`docs/method.md`, 2, "Flips").
//!
//! *Enters:* connectivity A and its lengths, curvatures. *Leaves:* a [`FlatMetric`] with the three triangulations and the
//! correspondences between them. *Guaranteed:* in exact arithmetic a solution for every prescription that meets Gauss–Bonnet with
//! positive cone angles (Gu, Luo, Sun, Wu 2018; Springborn 2019); on a surface with boundary `u` is symmetric, to rounding.
//! *Not guaranteed:* more than float64 holds: where rounding stops the flow above the tolerance, the achieved error is stated.
//!
//! A surface with boundary is doubled. A boundary vertex of curvature K̄ becomes an interior one of 2K̄; a free boundary keeps u = 0 there.

use super::error::FlowError;
use super::flat_metric::FlatMetric;
use super::minimise::minimise;
use super::params::FlowParams;
use super::problem::{Problem, Solution};
use crate::flow::correspondence::Correspondence;
use crate::flow::delaunay::Delaunay;
use crate::flow::metric::{self, Metric};
use crate::flow::scale::{at_unit_scale, shift};
use crate::flow::surface_delaunay::SurfaceDelaunay;
use crate::geometry::connectivity::Connectivity;
use crate::geometry::ids::{EdgeVec, VertexVec};
use crate::observe::Observer;

/// What flows.
#[derive(Clone, Copy)]
pub(super) struct Surface<'a> {
    pub(super) connectivity: &'a Connectivity,
    pub(super) source_length: &'a EdgeVec<f64>,
}

/// `target` and `prescribed` as in [`Problem`], by vertices of the surface.
pub(super) fn flow(
    surface: Surface,
    target: VertexVec<f64>,
    prescribed: VertexVec<bool>,
    params: &FlowParams,
    observer: &dyn Observer,
) -> Result<FlatMetric, FlowError> {
    let ground = SurfaceDelaunay::new(surface.connectivity, surface.source_length)?;
    // B to C.
    let identity = Correspondence::identity(&ground.delaunay);
    let mut delaunay = Delaunay::from_logs(
        ground.delaunay.clone(),
        ground.log_length.clone(),
        vec![ground.base_on_delaunay.clone(), identity],
    );
    delaunay.flips = ground.flips;
    let on_boundary = |v| surface.connectivity.is_boundary_vertex(v);
    let mut problem = Problem {
        metric: Metric::flipping(&mut delaunay),
        target: ground
            .original
            .iter()
            .map(|&v| target[v] * if on_boundary(v) { 2.0 } else { 1.0 })
            .collect(),
        scale_free: prescribed.iter().all(|&p| p),
        prescribed: ground.original.iter().map(|&v| prescribed[v]).collect(),
        shares: ground.original.clone(),
        params,
        observer,
    };
    let Solution {
        mut u,
        evaluation,
        mut history,
    } = minimise(&mut problem)?;
    // A trial that was rejected last may have flipped edges too, and no line has counted them.
    let counted: usize = history.iter().map(|step| step.flips).sum();
    if let Some(last) = history.last_mut() {
        last.flips += problem.metric.flips() - counted;
    }
    let max_curvature_error = problem.max_error(&evaluation);
    let scale_free = problem.scale_free;
    // Newton has taken u into the lengths, the gradient flow has not.
    let rest = u.iter().zip(delaunay.scale().iter()).map(|(u, s)| u - s);
    let mut rest: VertexVec<f64> = rest.collect();
    if scale_free {
        let largest = u.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        shift(&mut rest, -largest);
        delaunay.rebase(&rest);
        let flat = metric::total_area(
            &delaunay.connectivity,
            &exponential(&delaunay.log_lengths()),
        );
        let source = metric::total_area(&ground.base, &ground.base_length);
        let constant = 0.5 * (source / flat).ln();
        let constant = if constant.is_finite() { constant } else { 0.0 };
        rest.as_mut_slice().fill(constant);
        shift(&mut u, constant - largest);
    }
    delaunay.rebase(&rest);
    let length = delaunay.log_lengths();
    let penner = at_unit_scale(&delaunay.connectivity, &length, &u);
    let own = surface.connectivity.vertex_count();
    let curvature = evaluation.curvature.enumerate().take(own);
    let curvature = curvature
        .map(|(v, k)| k * if on_boundary(v) { 0.5 } else { 1.0 })
        .collect();
    Ok(FlatMetric {
        log_scale: u.as_slice()[..own].to_vec().into(),
        length: exponential(&length),
        curvature,
        history,
        max_curvature_error,
        fit: None,
        opened: None,
        quarter_turns: None,
        intrinsic: Some(Box::new(ground.leave(
            surface.connectivity.face_count(),
            delaunay,
            penner,
            u,
            None,
        ))),
    })
}

fn exponential(values: &EdgeVec<f64>) -> EdgeVec<f64> {
    values.iter().map(|l| l.exp()).collect()
}

#[cfg(test)]
mod tests {
    use super::super::shapes::{self, Shape};
    use super::super::{Scheme, Solver, flow as run};
    use super::*;
    use crate::flow::cones::{BoundaryCondition, Prescription};
    use crate::flow::doubled::Doubled;
    use crate::geometry::ids::VertexId;
    use std::f64::consts::PI;

    fn solve(shape: &Shape, prescription: &Prescription, solver: Solver) -> FlatMetric {
        let params = FlowParams {
            scheme: Scheme::VertexScaling,
            solver,
            ..FlowParams::default()
        };
        run(
            &shape.connectivity,
            &shape.length,
            prescription,
            &params,
            &(),
        )
        .unwrap()
    }

    /// Curvature of the final triangulation from its lengths alone is the target, on both halves of a double.
    fn assert_flat(shape: &Shape, prescription: &Prescription, flat: &FlatMetric) {
        let x = flat.intrinsic.as_ref().unwrap();
        let double = Doubled::new(&shape.connectivity).unwrap();
        let measured = metric::curvature(&x.flat, &flat.length).unwrap();
        let free = prescription.boundary == BoundaryCondition::Free;
        for (v, &own) in double.original.enumerate() {
            let boundary = shape.connectivity.is_boundary_vertex(own);
            assert!((x.u[v] - flat.log_scale[own]).abs() < 1e-9);
            let factor = if boundary { 2.0 } else { 1.0 };
            assert!((measured[v] - factor * flat.curvature[own]).abs() < 1e-9);
            if boundary && free {
                assert_eq!(x.u[v], 0.0);
            } else {
                assert!((measured[v] - factor * prescription.target[own]).abs() < 1e-9);
            }
        }
        let total: f64 = flat.curvature.iter().sum();
        let required = 2.0 * PI * shape.connectivity.topology().euler_characteristic as f64;
        assert!((total - required).abs() < 1e-9);
    }

    #[test]
    fn small_surfaces_of_every_kind() {
        for shape in shapes::small() {
            let mut prescriptions = vec![shape.prescribe_default()];
            if !shape.connectivity.is_closed() {
                prescriptions.push(shape.prescribe_uniform_boundary());
            }
            for prescription in prescriptions {
                let flat = solve(&shape, &prescription, Solver::Newton);
                assert!(flat.max_curvature_error <= 1e-10);
                assert_flat(&shape, &prescription, &flat);
            }
        }
    }

    #[test]
    fn newton_and_the_flow_agree() {
        let shapes = [
            shapes::plate(0, 2),
            shapes::torus(9, 7),
            shapes::sheet(7, false),
        ];
        for shape in shapes {
            let prescription = shape.prescribe_default();
            let newton = solve(&shape, &prescription, Solver::Newton);
            let gradient = solve(&shape, &prescription, Solver::Gradient);
            assert_flat(&shape, &prescription, &gradient);
            for (a, b) in newton.log_scale.iter().zip(gradient.log_scale.iter()) {
                assert!((a - b).abs() < 1e-7, "{}: {a} against {b}", shape.name);
            }
        }
    }

    /// A closed tube of `rings` octagons.
    fn tube(rings: usize) -> Shape {
        let mut positions = vec![[0.0, 0.0, -1.0]];
        for i in 0..rings {
            for j in 0..8 {
                let angle = (j as f64 + 0.5 * (i % 2) as f64) * PI / 4.0;
                positions.push([1.3 * angle.cos(), 1.3 * angle.sin(), i as f64]);
            }
        }
        let last = positions.len() as u32;
        positions.push([0.0, 0.0, rings as f64]);
        let at = |i: usize, j: usize| (1 + 8 * i + j % 8) as u32;
        let mut faces = Vec::new();
        for j in 0..8 {
            faces.push([0, at(0, j + 1), at(0, j)]);
            faces.push([last, at(rings - 1, j), at(rings - 1, j + 1)]);
            for i in 0..rings - 1 {
                let q = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
                let odd = i % 2 == 1;
                faces.extend(match odd {
                    true => [[q[0], q[1], q[2]], [q[0], q[2], q[3]]],
                    false => [[q[0], q[1], q[3]], [q[1], q[2], q[3]]],
                });
            }
        }
        Shape::new("tube", &faces, &positions)
    }

    /// Along a tube of length L and girth G whose end holds the curvature k, u changes by (2π − k) L / G.
    #[test]
    fn a_long_tube_scales_by_hundreds_of_orders() {
        let shape = tube(240);
        let last = shape.connectivity.vertex_count() - 1;
        let mut cones = vec![(0, -4.0 * PI)];
        cones.extend((0..5).map(|i| (last - 2 * i, 1.6 * PI)));
        let prescription = shape.prescribe(&cones);
        let flat = solve(&shape, &prescription, Solver::Newton);
        assert!(flat.max_curvature_error <= 1e-10);
        let range = flat.log_scale[VertexId::new(9)] - flat.log_scale[VertexId::new(last - 16)];
        assert!(range.abs() > 300.0, "{range}");
        assert_flat(&shape, &prescription, &flat);
    }

    #[test]
    fn a_scale_range_beyond_float64_is_refused_with_the_reason() {
        let shape = tube(500);
        let last = shape.connectivity.vertex_count() - 1;
        let mut cones = vec![(0, -4.0 * PI)];
        cones.extend((0..5).map(|i| (last - 2 * i, 1.6 * PI)));
        let params = FlowParams {
            scheme: Scheme::VertexScaling,
            ..FlowParams::default()
        };
        let (c, length) = (&shape.connectivity, &shape.length);
        let error = run(c, length, &shape.prescribe(&cones), &params, &()).unwrap_err();
        assert!(matches!(error, FlowError::ScaleRange { range, .. } if range > 600.0));
    }

    #[test]
    fn all_curvature_at_one_vertex_without_repair() {
        for (genus, level) in [(2, 2), (3, 2), (4, 1)] {
            let shape = shapes::plate(genus, level);
            let total = -4.0 * PI * (genus as f64 - 1.0);
            let prescription = shape.prescribe(&[(5, total)]);
            let flat = solve(&shape, &prescription, Solver::Newton);
            assert!(flat.max_curvature_error <= 1e-10);
            assert_flat(&shape, &prescription, &flat);
        }
    }
}
