//! Newton against an independent decision of (6) over all subsets: it must converge exactly where a packing exists.

use super::shapes::{self, Shape};
use super::tests::{assert_flat, run};
use super::*;
use crate::flow::feasibility::{Constraint, Side};
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

/// Newton alone, without asking whether a packing exists.
fn newton_alone(shape: &Shape, prescription: &Prescription) -> Result<(Solution, f64), FlowError> {
    let c = &shape.connectivity;
    let structure = ConformalStructure::new(Scheme::Tangential, c, &shape.length)?;
    let free = prescription.boundary == BoundaryCondition::Free;
    let params = FlowParams {
        scheme: Scheme::Tangential,
        ..FlowParams::default()
    };
    let prescribed: VertexVec<bool> = c
        .vertices()
        .map(|v| !(free && c.is_boundary_vertex(v)))
        .collect();
    let mut problem = Problem {
        metric: Metric::new(c, &structure),
        target: prescription.target.clone(),
        scale_free: prescribed.iter().all(|&p| p),
        prescribed,
        shares: c.vertices().collect(),
        params: &params,
        observer: &(),
    };
    let solution = minimise(&mut problem)?;
    let error = problem.max_error(&solution.evaluation);
    Ok((solution, error))
}

/// A copy with a third of its edges flipped, none doubled, no valence below 4.
fn shaken(mut shape: Shape, random: &mut impl FnMut() -> f64) -> Shape {
    let c = &mut shape.connectivity;
    let edges = c.edge_count();
    for _ in 0..edges / 3 {
        let e = EdgeId::new((random() * edges as f64) as usize);
        let h = c.edge_halfedge(e);
        let Some(t) = c.twin(h) else { continue };
        let (a, b) = (c.apex(h), c.apex(t));
        let high = |v: VertexId| c.valence(v) > 4;
        if a != b && c.edge_vertices(e).into_iter().all(high) && !c.neighbours(a).any(|v| v == b) {
            c.flip(e);
        }
    }
    shape.length = EdgeVec::filled(1.0, edges);
    shape
}

/// K̄ = start + t direction, where `start` are the curvatures of equal circles.
struct Ray {
    start: VertexVec<f64>,
    direction: VertexVec<f64>,
    boundary: BoundaryCondition,
}

impl Ray {
    /// Towards some strong cones, positive or negative, made up for by all others.
    fn draw(shape: &Shape, boundary: BoundaryCondition, random: &mut impl FnMut() -> f64) -> Self {
        let c = &shape.connectivity;
        let full = full_angles(c);
        let equal = |v| full[v] - c.outgoing(v).count() as f64 * PI / 3.0;
        let counted: Vec<VertexId> = c
            .vertices()
            .filter(|&v| boundary != BoundaryCondition::Free || !c.is_boundary_vertex(v))
            .collect();
        let mut direction = VertexVec::filled(0.0, c.vertex_count());
        for _ in 0..1 + (6.0 * random()) as usize {
            let v = counted[(random() * counted.len() as f64) as usize];
            let strength = (1.0 + 3.0 * random()) * if random() < 0.3 { 1.0 } else { -1.0 };
            // At the vertex, or around it, so that regions count.
            let ring = random() < 0.5;
            for w in c.neighbours(v).filter(|_| ring).chain([v]) {
                if counted.binary_search(&w).is_ok() {
                    direction[w] += strength;
                }
            }
        }
        let total: f64 = direction.iter().sum();
        for &v in &counted {
            direction[v] -= total / counted.len() as f64;
        }
        Self {
            start: c.vertices().map(equal).collect(),
            direction,
            boundary,
        }
    }

    fn at(&self, t: f64) -> Prescription {
        let along = self.start.iter().zip(self.direction.iter());
        Prescription::new(along.map(|(k, d)| k + t * d).collect(), self.boundary)
    }

    /// Where it leaves what is possible, and how fast the slack falls there. By Newton: the slack of every set is affine in t.
    fn exit(&self, shape: &Shape) -> Option<(f64, f64)> {
        let full = full_angles(&shape.connectivity);
        // Cone angles stay positive.
        let mut t = f64::INFINITY;
        for (v, d) in self.direction.enumerate() {
            if *d > 0.0 {
                t = t.min((full[v] - self.start[v]) / d);
            }
        }
        t = (0.999_999 * t).min(30.0);
        let mut slope = None;
        loop {
            let now = self.at(t);
            let mut constraint =
                Constraint::new(&shape.connectivity, None, &now.target, self.boundary, 1.0);
            let regions = constraint.offending_regions();
            let Some(worst) = regions.iter().min_by(|a, b| a.slack.total_cmp(&b.slack)) else {
                return slope.map(|s| (t, s));
            };
            let fall: f64 = worst.vertices.iter().map(|&v| self.direction[v]).sum();
            let fall = if worst.side == Side::Below {
                -fall
            } else {
                fall
            };
            let next = t + worst.slack / fall;
            slope = Some(fall);
            // At equality, or as near as doubles come.
            if next >= t - 1e-13 * t {
                return slope.map(|s| (next, s));
            }
            t = next;
        }
    }
}

/// With two thousand vertices, on both sides of the limit and as near to it as is shown: Newton, which knows nothing of (6),
/// converges exactly where it is said to.
#[test]
fn newton_converges_on_larger_surfaces_exactly_where_packings_exist() {
    let mut random = shapes::sequence(1789);
    let mut outcomes = [0, 0];
    let gaps = [1e-1, 1e-3, 1e-6, 1e-8, 1e-9, 1e-10, 3e-11];
    let (mut round, mut widest) = (0, 0.0_f64);
    while outcomes[0] + outcomes[1] < 50 {
        round += 1;
        let (shape, boundary) = match round % 5 {
            0 => (shapes::torus(50, 40), BoundaryCondition::Free),
            1 => (shapes::plate(0, 12), BoundaryCondition::Free),
            2 => (shapes::plate(2, 6), BoundaryCondition::Free),
            3 => (shapes::sheet(44, false), BoundaryCondition::Free),
            _ => (shapes::sheet(46, true), BoundaryCondition::Prescribed),
        };
        let shape = shaken(shape, &mut random);
        let ray = Ray::draw(&shape, boundary, &mut random);
        let Some((t, fall)) = ray.exit(&shape) else {
            continue;
        };
        let number = outcomes[0] + outcomes[1];
        let gap = gaps[number / 2 % gaps.len()] * PI;
        let feasible = number % 2 == 0;
        let step = if feasible { gap } else { -gap };
        let prescription = ray.at((t - step / fall).max(0.0));
        let (target, boundary) = (&prescription.target, prescription.boundary);
        let mut constraint = Constraint::new(&shape.connectivity, None, target, boundary, 1.0);
        let exists = constraint.offending_regions().is_empty();
        assert_eq!(exists, feasible, "round {round}, gap {gap:e}");
        outcomes[usize::from(exists)] += 1;
        match newton_alone(&shape, &prescription) {
            Ok((solution, error)) => {
                assert!(exists, "round {round}, slack {:e}π", step / PI);
                assert!(error <= 1e-10);
                widest = widest.max(crate::flow::scale::spread(&solution.u));
            }
            Err(error) => assert!(!exists, "round {round}, slack {:e}π: {error}", step / PI),
        }
    }
    println!("{outcomes:?}, u over {widest:.0} at most");
    assert_eq!(outcomes, [25, 25]);
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
