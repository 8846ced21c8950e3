//! Newton against an independent decision of (6) over all subsets: it must converge exactly where a packing exists.

use super::shapes::{self, Shape};
use super::tests::{assert_flat, run};
use super::*;
use crate::flow::feasibility::Constraint;
use crate::geometry::ids::{EdgeId, VertexId};

/// Splits the links of the regions that (6) forbids until it forbids none.
fn make_room(connectivity: &mut Connectivity, prescribe: &dyn Fn(usize) -> VertexVec<f64>) {
    for _ in 0..100 {
        let target = prescribe(connectivity.vertex_count());
        let free = BoundaryCondition::Free;
        let mut constraint = Constraint::new(connectivity, None, &target, free, 1.0);
        let regions = constraint.offending_regions();
        if regions.is_empty() {
            return;
        }
        let mut link: Vec<EdgeId> = regions
            .iter()
            .flat_map(|region| constraint.link(region))
            .map(|h| connectivity.edge(h))
            .collect();
        link.sort_unstable();
        link.dedup();
        for e in link {
            connectivity.split_edge(e);
        }
    }
    panic!("no room after 100 rounds");
}

/// Everything at one cone, tangent circles, connectivity made for it: the tutorial's Fig. 8.
fn single_cone(mut shape: Shape, vertex: usize) -> FlatMetric {
    let total = 2.0 * PI * shape.connectivity.topology().euler_characteristic as f64;
    let refused = run(
        &shape,
        &shape.prescribe(&[(vertex, total)]),
        Scheme::Tangential,
    );
    assert!(matches!(refused, Err(FlowError::Infeasible(_))));
    make_room(&mut shape.connectivity, &|count| {
        let mut target = VertexVec::filled(0.0, count);
        target[VertexId::new(vertex)] = total;
        target
    });
    shape.connectivity.validate().unwrap();
    // Tangent circles do not look at lengths; any will do.
    shape.length = EdgeVec::filled(1.0, shape.connectivity.edge_count());
    let prescription = shape.prescribe(&[(vertex, total)]);
    let flat = run(&shape, &prescription, Scheme::Tangential).unwrap();
    assert_flat(&shape, &prescription, &flat);
    let (low, high) = flat
        .log_scale
        .iter()
        .fold((0.0_f64, 0.0_f64), |r, &u| (r.0.min(u), r.1.max(u)));
    println!(
        "{}: {} vertices, {} steps, u from {low} to {high}",
        shape.name,
        flat.log_scale.len(),
        flat.history.len() - 1
    );
    assert!(flat.history.len() < 20);
    flat
}

#[test]
fn one_cone_takes_all_curvature_of_genus_three() {
    for vertex in [10, 40] {
        let flat = single_cone(shapes::plate(3, 2), vertex);
        assert!((flat.curvature[VertexId::new(vertex)] + 8.0 * PI).abs() < 1e-10);
    }
}

/// Newton converges exactly where a packing exists, whatever the curvatures.
#[test]
fn packings_are_found_where_they_exist() {
    let mut random = shapes::sequence(83);
    let mut outcomes = [0, 0];
    for round in 0..90 {
        let shape = match round % 3 {
            0 => shapes::plate(0, 1),
            1 => shapes::torus(5, 4),
            _ => shapes::plate(2, 1),
        };
        let n = shape.connectivity.vertex_count();
        // Two strong negative cones, some noise, and the rest at random vertices in steps of π/2.
        let mut quarters = vec![0i64; n];
        let mut pick = || (random() * n as f64) as usize;
        for strength in [6 + round % 14, 2 + round % 7] {
            quarters[pick()] -= strength;
        }
        for k in 0..n / 2 {
            quarters[pick()] += k as i64 % 5 - 2;
        }
        let mut missing =
            8 * shape.connectivity.topology().euler_characteristic - quarters.iter().sum::<i64>();
        while missing != 0 {
            let step = missing.clamp(-2, 2);
            quarters[pick()] += step;
            missing -= step;
        }
        if quarters.iter().any(|&q| q >= 8) {
            continue;
        }
        let cones: Vec<_> = (0..n).map(|v| (v, quarters[v] as f64 * PI / 4.0)).collect();
        let prescription = shape.prescribe(&cones);
        let (target, boundary) = (&prescription.target, prescription.boundary);
        let mut constraint = Constraint::new(&shape.connectivity, None, target, boundary, 1.0);
        let exists = constraint.offending_regions().is_empty();
        outcomes[usize::from(exists)] += 1;
        match run(&shape, &prescription, Scheme::Tangential) {
            Ok(flat) => {
                assert!(exists, "round {round}");
                assert_flat(&shape, &prescription, &flat);
            }
            Err(error) => assert!(!exists, "round {round}: {error}"),
        }
    }
    println!("{outcomes:?}");
    assert!(outcomes[0] >= 10 && outcomes[1] >= 10);
}

#[test]
fn corpus_single_cones_of_eight_and_twelve_pi() {
    for (name, vertices) in [
        ("three-holes.off", [100, 2000]),
        ("fertility.off", [100, 2000]),
    ] {
        for vertex in vertices {
            let Some(shape) = shapes::corpus_model(name) else {
                return;
            };
            single_cone(shape, vertex);
        }
    }
}
