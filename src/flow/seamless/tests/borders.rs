//! Surfaces with boundary: symmetric metrics on the double.

use super::super::normal::Normal;
use super::*;
use crate::flow::surface_delaunay::SurfaceDelaunay;

/// Disks, annuli, and surfaces with handles and up to three holes.
fn bounded() -> Vec<Shape> {
    vec![
        shapes::sheet(7, false),
        shapes::sheet(9, true),
        shapes::plate(0, 4).pierced(2),
        shapes::plate(1, 3).pierced(1),
        shapes::plate(2, 3).pierced(3),
    ]
}

/// What is found on one surface.
struct Bounded {
    shape: Shape,
    ground: SurfaceDelaunay,
    log_length: EdgeVec<f64>,
}

impl Bounded {
    fn new(shape: Shape) -> Self {
        let ground = SurfaceDelaunay::new(&shape.connectivity, &shape.length).unwrap();
        let log_length = ground.on_symmetric(ground.log_length.clone());
        Self {
            shape,
            ground,
            log_length,
        }
    }

    fn looped(&self) -> LoopedSurface<'_> {
        LoopedSurface::new(&self.shape.connectivity, &self.ground).unwrap()
    }

    fn start<'a>(&'a self, on: &'a LoopedSurface) -> Start<'a> {
        Start {
            connectivity: on.connectivity,
            length: &on.length,
            log_length: Some(&self.log_length),
            reflection: on.reflection(),
            glued: &on.glued,
        }
    }

    fn penner(&self) -> EdgeVec<f64> {
        self.log_length.iter().map(|l| 2.0 * l).collect()
    }
}

#[test]
fn borders_become_straight_and_every_loop_of_the_double_turns_by_quarters() {
    for shape in bounded() {
        let bounded = Bounded::new(shape);
        let (c, on) = (&bounded.shape.connectivity, bounded.looped());
        let reflection = on.reflection().unwrap();
        let signature = signature(&on);
        let (genus, loops) = (c.topology().genus, c.boundary_loops().len());
        assert_eq!(on.loops.len(), 2 * genus as usize + loops - 1);
        for (v, &quarters) in signature.cone.enumerate() {
            assert_eq!(quarters, signature.cone[reflection.vertex[v]]);
            match reflection.vertex[v] == v {
                true => assert!(quarters >= 2 && quarters % 2 == 0),
                false => assert!(quarters >= 3),
            }
        }
        let params = SeamlessParams::default();
        let found = seamless(&bounded.start(&on), &on.loops, &signature, &params, &()).unwrap();
        let name = &bounded.shape.name;
        assert!(found.max_error <= 1e-10, "{name}: {}", found.max_error);
        assert_eq!(reflection.symmetric(&found.penner), found.penner);
        let flat = &found.flat;
        let angle: FaceVec<[f64; 3]> = flat
            .faces()
            .map(|f| triangle::angles(face_lengths(flat, &found.length, f)).unwrap())
            .collect();
        let at = |h: HalfedgeId| angle[flat.face(h)][flat.corner(h)];
        for v in flat.vertices() {
            let theta: f64 = flat.outgoing(v).map(at).sum();
            let wanted = signature.cone[v] as f64 * FRAC_PI_2;
            assert!((theta - wanted).abs() < 1e-9, "{name}");
        }
        // All loops, those behind the mirror and those beside a border too.
        let all = homology_basis(flat).unwrap();
        assert_eq!(all.len() as i64, 2 * flat.topology().genus);
        for turned in all.turning(flat, at) {
            let quarters = turned / FRAC_PI_2;
            assert!((quarters - quarters.round()).abs() < 1e-8, "{name}");
        }
    }
}

/// The shortest of all steps on the double is symmetric, so it is the shortest of the symmetric ones.
#[test]
fn the_symmetric_step_is_that_of_the_whole_double() {
    for shape in bounded() {
        let bounded = Bounded::new(shape);
        let on = bounded.looped();
        let half = signature(&on);
        let whole = LoopedSurface {
            loops: homology_basis(on.connectivity).unwrap(),
            ..on.clone()
        };
        let all = signature(&whole);
        for conformality in [0.0, 3.0] {
            let norm = Norm::by_area(on.connectivity, &on.length, conformality);
            let step = |on: &LoopedSurface, signature, reflection, norm: &Norm| {
                let start = Start {
                    reflection,
                    ..bounded.start(on)
                };
                let problem = Problem::new(&start, &on.loops, signature);
                let state = problem.evaluate(&bounded.penner());
                let mut normal = Normal::new(&problem, &state, norm, None).unwrap();
                normal.direction(&problem, norm, &state.missing).0
            };
            let reflection = on.reflection();
            let folded = norm.clone().by_images(reflection);
            let one = step(&on, &half, reflection, &folded);
            let other = step(&whole, &all, None, &norm);
            let largest = other.iter().fold(0.0_f64, |m, d| m.max(d.abs()));
            assert!(largest > 1e-3);
            for (a, b) in one.iter().zip(other.iter()) {
                assert!((a - b).abs() < 1e-7 * largest, "{a} against {b}");
            }
        }
    }
}

#[test]
fn the_jacobian_of_symmetric_changes_agrees_with_finite_differences() {
    let mut random = shapes::sequence(83);
    for shape in bounded() {
        let bounded = Bounded::new(shape);
        let on = bounded.looped();
        let reflection = on.reflection().unwrap();
        let signature = signature(&on);
        let problem = Problem::new(&bounded.start(&on), &on.loops, &signature);
        let penner = reflection.symmetric(&disturbed(&bounded.penner(), 0.8, &mut random));
        let state = problem.evaluate(&penner);
        assert!(state.flips.len() > 20);
        let jacobian = state.by_edges(&problem).unwrap();
        let edges = on.connectivity.edges().step_by(7);
        let edges = edges.map(|e| problem.shares[e]);
        assert_derivatives(&problem, &jacobian, edges, |e, step| {
            let mut moved = penner.clone();
            moved[e] += step;
            reflection.symmetric(&moved)
        });
    }
}

/// The surface's own metric, in Penner coordinates there, is its Delaunay triangulation's again.
#[test]
fn lengths_go_to_the_symmetric_triangulation_and_back() {
    let mut flips = 0;
    for shape in bounded() {
        let bounded = Bounded::new(shape);
        let on = bounded.looped();
        let reflection = on.reflection().unwrap();
        for (e, &image) in reflection.edge.enumerate() {
            let pair = [e, image].map(|e| (on.length[e], bounded.log_length[e]));
            assert!((pair[0].0 / pair[1].0 - 1.0).abs() < 1e-15);
            assert!((pair[0].1 - pair[1].1).abs() < 1e-12);
        }
        let back = bounded.ground.on_delaunay(bounded.log_length.clone());
        for (a, b) in back.iter().zip(bounded.ground.log_length.iter()) {
            assert!((a - b).abs() < 1e-13);
        }
        flips += bounded.ground.symmetric.as_ref().unwrap().flips.len();
    }
    assert!(flips > 0, "no border has an obtuse corner opposite");
}
