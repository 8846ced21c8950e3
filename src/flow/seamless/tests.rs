use super::jacobian::Columns;
use super::newton::Reuse;
use super::norm::Norm;
use super::state::Problem;
use super::*;
use crate::flow::delaunay::Delaunay;
use crate::flow::field::{CrossField, GridCones, cross_field};
use crate::flow::holonomy::homology_basis;
use crate::flow::looped::LoopedSurface;
use crate::flow::metric::face_lengths;
use crate::flow::ricci::shapes::{self, Shape};
use crate::flow::signature::{FULL_TURN, Infeasible};
use crate::flow::solve::SymmetricSolver;
use crate::geometry::ids::{EdgeId, FaceId, FaceVec, HalfedgeId, HalfedgeVec, VertexId, VertexVec};
use crate::geometry::triangle;
use std::f64::consts::{FRAC_PI_2, TAU};

mod borders;
mod lines;
mod oracle;
mod signatures;

/// The intrinsic Delaunay triangulation of a shape with loops and the signature of its field.
struct Prepared {
    name: String,
    c: Connectivity,
    length: EdgeVec<f64>,
    loops: DualLoops,
    signature: Signature,
}

/// The smoothest field on the own part of a surface, with the angles there.
fn field_of(on: &LoopedSurface) -> (CrossField, FaceVec<[f64; 3]>) {
    let (own, length) = (on.own(), on.own_length());
    let sides = |f: FaceId| face_lengths(own, &length, f);
    let angle: FaceVec<[f64; 3]> = own
        .faces()
        .map(|f| triangle::angles(sides(f)).unwrap())
        .collect();
    let area = own.faces().map(|f| triangle::area(sides(f)).unwrap());
    let pull = FaceVec::filled([0.0; 2], own.face_count());
    let lean = HalfedgeVec::filled(0.0, own.halfedge_count());
    let field = cross_field(own, &angle, &area.collect(), &pull, &lean).unwrap();
    (field, angle)
}

/// The signature of that field that a grid can have.
fn signature(on: &LoopedSurface) -> Signature {
    let (mut field, angle) = field_of(on);
    field
        .grid_signature(on, &angle, &GridCones::at_least(3))
        .unwrap()
        .0
}

fn prepare(shape: &Shape) -> Prepared {
    let mut delaunay = Delaunay::new(shape.connectivity.clone(), &shape.length, Vec::new());
    delaunay.flip_in_the_surface();
    let length: EdgeVec<f64> = delaunay.log_lengths().iter().map(|l| l.exp()).collect();
    let c = delaunay.connectivity;
    let loops = homology_basis(&c).unwrap();
    let looped = LoopedSurface {
        connectivity: &c,
        length: length.clone(),
        half: None,
        loops: loops.clone(),
        sector: None,
        glued: Vec::new(),
    };
    let signature = signature(&looped);
    Prepared {
        name: shape.name.clone(),
        c,
        length,
        loops,
        signature,
    }
}

fn closed<'a>(connectivity: &'a Connectivity, length: &'a EdgeVec<f64>) -> Start<'a> {
    Start {
        connectivity,
        length,
        log_length: None,
        reflection: None,
        glued: &[],
    }
}

impl Prepared {
    fn problem(&self) -> Problem<'_> {
        Problem::new(&closed(&self.c, &self.length), &self.loops, &self.signature)
    }

    fn start(&self) -> EdgeVec<f64> {
        self.length.iter().map(|l| 2.0 * l.ln()).collect()
    }

    fn solve(&self, params: &SeamlessParams) -> Result<SeamlessMetric, SeamlessError> {
        seamless(
            &closed(&self.c, &self.length),
            &self.loops,
            &self.signature,
            params,
            &(),
        )
    }

    /// What must hold of a result, from its lengths alone: cone angles, turnings of these loops and of others, and the area.
    fn assert_seamless(&self, metric: &SeamlessMetric) {
        assert!(metric.max_error <= 1e-10);
        let c = &metric.flat;
        c.validate().unwrap();
        let angle: FaceVec<[f64; 3]> = c
            .faces()
            .map(|f| triangle::angles(face_lengths(c, &metric.length, f)).expect("a triangle"))
            .collect();
        let at = |h: HalfedgeId| angle[c.face(h)][c.corner(h)];
        for v in c.vertices() {
            let theta: f64 = c.outgoing(v).map(at).sum();
            let wanted = self.signature.cone[v] as f64 * FRAC_PI_2;
            assert!((theta - wanted).abs() < 1e-9, "{}", self.name);
        }
        let turned = metric.loops.turning(c, at);
        for (turned, &wanted) in turned.iter().zip(&self.signature.turning) {
            assert!(
                (turned - wanted as f64 * FRAC_PI_2).abs() < 1e-9,
                "{}",
                self.name
            );
        }
        for turned in homology_basis(c).unwrap().turning(c, at) {
            let quarters = turned / FRAC_PI_2;
            assert!((quarters - quarters.round()).abs() < 1e-8, "{}", self.name);
        }
        let ratio = total_area(c, &metric.length) / total_area(&self.c, &self.length);
        assert!((ratio - 1.0).abs() < 1e-12);
    }
}

/// λ away from the start by up to `range`, where edges are flipped.
fn disturbed(start: &EdgeVec<f64>, range: f64, random: &mut impl FnMut() -> f64) -> EdgeVec<f64> {
    let moved = start.iter().map(|l| l + range * (2.0 * random() - 1.0));
    moved.collect()
}

#[test]
fn the_jacobian_agrees_with_finite_differences() {
    let mut random = shapes::sequence(61);
    for shape in [
        shapes::plate(0, 2),
        shapes::torus(9, 7),
        shapes::plate(2, 2),
    ] {
        let prepared = prepare(&shape);
        let problem = prepared.problem();
        let penner = disturbed(&prepared.start(), 0.8, &mut random);
        let state = problem.evaluate(&penner);
        assert!(state.flips.len() > 20);
        let jacobian = state.by_edges(&problem).unwrap();
        let edges = (0..penner.len()).step_by(3).map(EdgeId::new);
        assert_derivatives(&problem, &jacobian, edges, |e, step| {
            let mut moved = penner.clone();
            moved[e] += step;
            moved
        });
    }
}

/// The columns of some edges against differences of the angles; `moved`: λ with an edge changed by so much.
fn assert_derivatives(
    problem: &Problem,
    jacobian: &Columns,
    edges: impl Iterator<Item = EdgeId>,
    moved: impl Fn(EdgeId, f64) -> EdgeVec<f64>,
) {
    let h = 1e-5;
    for e in edges {
        let mut direction = EdgeVec::filled(0.0, problem.base.edge_count());
        direction[e] = 1.0;
        let exact = jacobian.times(&direction, problem.equations());
        let [up, down] = [h, -h].map(|step| problem.evaluate(&moved(e, step)).missing);
        let scale = exact.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        for (i, x) in exact.iter().enumerate() {
            let difference = (down[i] - up[i]) / (2.0 * h);
            assert!(
                (x - difference).abs() < 1e-6 * scale,
                "{x} against {difference}"
            );
        }
    }
}

/// Where the Delaunay triangulation changes, derivatives of both sides are the same.
#[test]
fn the_jacobian_is_continuous_across_flips() {
    let mut random = shapes::sequence(67);
    let prepared = prepare(&shapes::plate(2, 2));
    let problem = prepared.problem();
    let edges = |penner: &EdgeVec<f64>| -> Vec<EdgeId> {
        problem
            .evaluate(penner)
            .flips
            .iter()
            .map(|f| f.edge)
            .collect()
    };
    for _ in 0..10 {
        let (mut low, mut high) = (
            disturbed(&prepared.start(), 0.5, &mut random),
            disturbed(&prepared.start(), 0.5, &mut random),
        );
        let direction: Vec<f64> = high.iter().zip(low.iter()).map(|(h, l)| h - l).collect();
        let direction: EdgeVec<f64> = direction.into();
        // Flips come and go on the way: halve it where they do.
        for _ in 0..50 {
            let middle: EdgeVec<f64> = low
                .iter()
                .zip(high.iter())
                .map(|(l, h)| 0.5 * (l + h))
                .collect();
            match edges(&low) == edges(&middle) {
                true => low = middle,
                false => high = middle,
            }
        }
        assert_ne!(edges(&low), edges(&high));
        let slopes = [&low, &high].map(|penner| {
            let jacobian = problem.evaluate(penner).by_edges(&problem).unwrap();
            jacobian.times(&direction, problem.equations())
        });
        let h = 1e-6;
        let at = |step: f64| {
            let moved = low.iter().zip(direction.iter()).map(|(l, d)| l + step * d);
            problem.evaluate(&moved.collect()).missing
        };
        let (up, down) = (at(h), at(-h));
        let scale = slopes[0].iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        for i in 0..problem.equations() {
            assert!((slopes[0][i] - slopes[1][i]).abs() < 1e-8 * scale);
            let difference = (down[i] - up[i]) / (2.0 * h);
            assert!((slopes[0][i] - difference).abs() < 1e-6 * scale * 10.0);
        }
    }
}

/// Scales change both ends of every edge, flipped or not.
#[test]
fn derivatives_by_scales_are_sums_of_those_by_lengths() {
    let mut random = shapes::sequence(71);
    let prepared = prepare(&shapes::plate(3, 2));
    let problem = prepared.problem();
    let state = problem.evaluate(&disturbed(&prepared.start(), 0.8, &mut random));
    assert!(state.flips.len() > 20);
    let equations = problem.equations();
    let by_edges = state.by_edges(&problem).unwrap();
    let by_scales = state.by_scales(&problem, &by_edges);
    let u: VertexVec<f64> = prepared.c.vertices().map(|_| random()).collect();
    let ends = |e: EdgeId| prepared.c.edge_vertices(e).map(|v| u[v]);
    let sums: EdgeVec<f64> = prepared
        .c
        .edges()
        .map(|e| ends(e)[0] + ends(e)[1])
        .collect();
    let exact = by_edges.times(&sums, equations);
    let mut found = vec![0.0; equations];
    for (v, u) in u.iter().enumerate() {
        let (rows, values) = by_scales.column(v);
        rows.iter()
            .zip(values)
            .for_each(|(&r, x)| found[r as usize] += x * u);
    }
    for (a, b) in exact.iter().zip(&found) {
        assert!((a - b).abs() < 1e-10, "{a} against {b}");
    }
}

#[test]
fn small_surfaces_of_every_genus_become_seamless() {
    for shape in [
        shapes::plate(0, 2),
        shapes::torus(9, 7),
        shapes::plate(1, 3),
        shapes::plate(2, 2),
        shapes::plate(5, 3),
    ] {
        let prepared = prepare(&shape);
        let metric = prepared.solve(&SeamlessParams::default()).unwrap();
        prepared.assert_seamless(&metric);
        assert!(
            metric.history.len() <= 16,
            "{}: {}",
            shape.name,
            metric.history.len() - 1
        );
    }
}

#[test]
fn many_handles_are_no_obstacle() {
    for genus in [24, 100] {
        let prepared = prepare(&shapes::plate(genus, 2));
        let metric = prepared.solve(&SeamlessParams::default()).unwrap();
        prepared.assert_seamless(&metric);
        assert!(
            metric.history.len() <= 16,
            "{genus}: {}",
            metric.history.len() - 1
        );
    }
}

/// A torus of whose vertices every fifth or so nearly coincides with another, as vertices do that marching cubes make.
fn with_thin_faces() -> Shape {
    let [n, m] = [36, 20];
    let mut random = shapes::sequence(71);
    let number = |i: usize, j: usize| ((i % n) * m + j % m) as u32;
    let mut positions = Vec::new();
    let mut faces = Vec::new();
    for i in 0..n {
        for j in 0..m {
            let aside = match random() < 0.2 {
                true => 1.0 - 10.0_f64.powf(-1.0 - 5.0 * random()),
                false => 0.3 * random(),
            };
            let [s, t] = [(i as f64 + aside) / n as f64, j as f64 / m as f64].map(|x| TAU * x);
            let r = 2.0 + (0.8 + 0.2 * (3.0 * s).sin()) * t.cos();
            positions.push([r * s.cos(), r * s.sin(), 0.8 * t.sin()]);
            let [a, b, c, d] =
                [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]].map(|[i, j]| number(i, j));
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    Shape::new("thin faces", &faces, &positions)
}

#[test]
fn thin_faces_do_not_shorten_steps() {
    let prepared = prepare(&with_thin_faces());
    let metric = prepared.solve(&SeamlessParams::default()).unwrap();
    prepared.assert_seamless(&metric);
    let steps = &metric.history[1..];
    assert!(steps.len() <= 8, "{steps:?}");
}

/// By how much the change of λ is none of scales: least squares, edges weighed by area.
fn nonconformality(prepared: &Prepared, metric: &SeamlessMetric) -> f64 {
    let c = &prepared.c;
    let start = prepared.start();
    let weight: Vec<f64> = Norm::by_area(c, &prepared.length, 0.0)
        .edge
        .iter()
        .map(|w| 1.0 / w)
        .collect();
    let change: Vec<f64> = metric
        .penner
        .iter()
        .zip(start.iter())
        .map(|(a, b)| a - b)
        .collect();
    let pairs: Vec<[u32; 2]> = c
        .edges()
        .map(|e| c.edge_vertices(e).map(VertexId::raw))
        .collect();
    let mut diagonal = vec![0.0; c.vertex_count()];
    let mut u = diagonal.clone();
    for (e, ends) in pairs.iter().enumerate() {
        for v in ends {
            diagonal[*v as usize] += weight[e];
            u[*v as usize] += weight[e] * change[e];
        }
    }
    let mut solver = SymmetricSolver::new(u.len(), &pairs).unwrap();
    solver.factorize(&diagonal, &weight).unwrap();
    solver.solve(&mut u);
    let rest = pairs
        .iter()
        .enumerate()
        .map(|(e, [i, j])| weight[e] * (change[e] - u[*i as usize] - u[*j as usize]).powi(2));
    (rest.sum::<f64>() / weight.iter().sum::<f64>()).sqrt()
}

#[test]
fn conformality_makes_the_change_one_of_scales() {
    for shape in [shapes::torus(9, 7), shapes::plate(2, 3)] {
        let prepared = prepare(&shape);
        let mut found: Vec<f64> = Vec::new();
        for conformality in [0.0, 1.0, 10.0, 100.0, 1e4] {
            let params = SeamlessParams {
                conformality,
                ..SeamlessParams::default()
            };
            let metric = prepared.solve(&params).unwrap();
            prepared.assert_seamless(&metric);
            let now = nonconformality(&prepared, &metric);
            // The end depends on the way, so where hardly anything changes it may rise a little.
            if let Some(last) = found.last() {
                assert!(
                    now < 1.01 * last,
                    "{}: {now} at {conformality}, {last} before",
                    shape.name
                );
            }
            found.push(now);
        }
        assert!(found[4] < 0.85 * found[0], "{}: {found:?}", shape.name);
    }
}

/// A metric that is seamless already stays.
#[test]
fn nothing_is_done_where_nothing_is_to_do() {
    let prepared = prepare(&shapes::plate(2, 2));
    let metric = prepared.solve(&SeamlessParams::default()).unwrap();
    let again = Prepared {
        name: "again".into(),
        c: metric.flat.clone(),
        length: metric.length.clone(),
        loops: metric.loops.clone(),
        signature: prepared.signature.clone(),
    };
    let same = again.solve(&SeamlessParams::default()).unwrap();
    assert_eq!(same.history.len(), 1);
    assert_eq!(same.flat, metric.flat);
    again.assert_seamless(&same);
}

#[test]
fn the_result_does_not_depend_on_the_number_of_threads() {
    let prepared = prepare(&shapes::plate(2, 8));
    let results = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| prepared.solve(&SeamlessParams::default()).unwrap().penner)
    });
    assert_eq!(results[0], results[1]);
}

#[test]
fn steps_that_share_a_factor_lead_to_the_tolerance_too() {
    let prepared = prepare(&shapes::plate(2, 3));
    let problem = prepared.problem();
    let norm = Norm::by_area(&prepared.c, &prepared.length, 0.0);
    let params = SeamlessParams::default();
    let counts = [Reuse::AtTheEnd, Reuse::WhereFast].map(|reuse| {
        let found = newton::solve(&problem, prepared.start(), &norm, reuse, &params, &()).unwrap();
        assert!(found.state.max_error < 1e-11);
        found.history.len()
    });
    assert!(counts[1] < counts[0], "{counts:?}");
}

#[test]
fn what_is_no_closed_surface_with_lengths_is_refused() {
    let prepared = prepare(&shapes::torus(9, 7));
    let run = |c: &Connectivity, length: &EdgeVec<f64>| {
        let (loops, signature) = (&prepared.loops, &prepared.signature);
        seamless(
            &closed(c, length),
            loops,
            signature,
            &SeamlessParams::default(),
            &(),
        )
        .unwrap_err()
    };
    let mut length = prepared.length.clone();
    length[EdgeId::new(5)] = f64::NAN;
    assert!(matches!(
        run(&prepared.c, &length),
        SeamlessError::BadLength { .. }
    ));
    let few = EdgeVec::filled(1.0, 3);
    assert!(matches!(
        run(&prepared.c, &few),
        SeamlessError::Count { given: 3, .. }
    ));
    let small = prepare(&shapes::torus(5, 4));
    let error = run(&small.c, &small.length);
    assert!(matches!(error, SeamlessError::Loops(_)), "{error}");
    let sheet = shapes::sheet(7, false);
    let error = run(&sheet.connectivity, &sheet.length);
    assert_eq!(error, SeamlessError::NotClosed { boundary_loops: 1 });
}

#[test]
#[cfg_attr(not(corpus), ignore = "needs AFFINE_ATLAS_CORPUS")]
fn every_closed_model_becomes_seamless() {
    closed_ones_become_seamless(shapes::corpus());
}

#[test]
#[ignore = "long"]
fn large_models_become_seamless() {
    closed_ones_become_seamless(shapes::large_models());
}

fn closed_ones_become_seamless(models: Vec<Shape>) {
    for shape in models {
        if !shape.connectivity.is_closed() {
            continue;
        }
        let prepared = prepare(&shape);
        let metric = prepared.solve(&SeamlessParams::default()).unwrap();
        prepared.assert_seamless(&metric);
        let steps = metric.history.len() - 1;
        println!("{}: {steps} steps, {:.1e}", shape.name, metric.max_error);
        assert!(steps <= 15, "{}: {steps}", shape.name);
    }
}
