//! Surfaces cut open along features, whose sides are to be straight and as long as each other.

use super::*;
use crate::flow::opened::Opened;
use crate::flow::surface_delaunay::SurfaceDelaunay;

/// A surface with a chain of edges, and what is left when it is cut open.
struct Cut {
    shape: Shape,
    opened: Opened,
    ground: SurfaceDelaunay,
    log_length: EdgeVec<f64>,
}

impl Cut {
    fn new(shape: Shape, edges: &[EdgeId]) -> Self {
        let (c, length) = (&shape.connectivity, &shape.length);
        let opened = Opened::new(c, edges).unwrap();
        let ground = SurfaceDelaunay::along_features(c, length, &opened, edges).unwrap();
        let log_length = ground.on_symmetric(ground.log_length.clone());
        Self {
            shape,
            opened,
            ground,
            log_length,
        }
    }

    fn looped(&self) -> LoopedSurface<'_> {
        LoopedSurface::along_features(&self.opened, &self.ground).unwrap()
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
}

/// The edges of the shortest way between two vertices.
fn way(c: &Connectivity, from: VertexId, to: VertexId) -> Vec<EdgeId> {
    let mut before = VertexVec::filled(None, c.vertex_count());
    let mut reached = vec![from];
    let mut next = 0;
    while let Some(&v) = reached.get(next) {
        next += 1;
        for h in c.outgoing(v).filter(|&h| c.head(h) != from) {
            if before[c.head(h)].is_none() {
                before[c.head(h)] = Some(h);
                reached.push(c.head(h));
            }
        }
    }
    let mut edges = Vec::new();
    let mut v = to;
    while let Some(h) = before[v] {
        edges.push(c.edge(h));
        v = c.tail(h);
    }
    edges
}

/// A slit, a loop that makes a tube of a torus, a junction, two pieces, and a chain from border to border.
fn cut() -> Vec<Cut> {
    let torus = shapes::torus(9, 7);
    let edges = |shape: &Shape, pairs: &[[usize; 2]]| -> Vec<EdgeId> {
        let c = &shape.connectivity;
        let between = |&[p, q]: &[usize; 2]| way(c, VertexId::new(p), VertexId::new(q));
        pairs.iter().flat_map(between).collect()
    };
    let around: Vec<[usize; 2]> = (0..7).map(|j| [j, (j + 1) % 7]).collect();
    let twice: Vec<[usize; 2]> = around
        .iter()
        .flat_map(|&[a, b]| [[a, b], [a + 28, b + 28]])
        .collect();
    let plate = shapes::plate(2, 3);
    let places = plate.spread(4);
    let sheet = shapes::sheet(9, false);
    let ends = [[0, sheet.connectivity.vertex_count() - 1]];
    [
        (torus.clone(), edges(&torus, &[[0, 3]])),
        (torus.clone(), edges(&torus, &around)),
        (torus.clone(), edges(&torus, &twice)),
        (
            plate.clone(),
            edges(&plate, &[[places[0], places[1]], [places[0], places[2]]]),
        ),
        (sheet.clone(), edges(&sheet, &ends)),
    ]
    .into_iter()
    .map(|(shape, edges)| Cut::new(shape, &edges))
    .collect()
}

/// Angles of all sectors are met, and both sides of every edge of a feature are edges of the metric, of one length. Each vertex has what its sectors have.
#[test]
fn features_become_lines_of_one_length_on_both_sides() {
    for cut in cut() {
        let on = cut.looped();
        let name = &cut.shape.name;
        let signature = signature(&on);
        let params = SeamlessParams::default();
        let found = seamless(&cut.start(&on), &on.loops, &signature, &params, &()).unwrap();
        assert!(found.max_error <= 1e-10, "{name}: {}", found.max_error);
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
        // Between the same two vertices on the mirror there is an edge of this length on either side.
        let own = &cut.opened.connectivity;
        assert!(!cut.opened.glued.is_empty());
        for pair in &cut.opened.glued {
            let lengths = pair.map(|h| {
                let mut ways = flat.outgoing(own.tail(h));
                let along = ways.find(|&g| flat.head(g) == own.head(h)).unwrap();
                found.length[flat.edge(along)]
            });
            assert!(
                (lengths[0] / lengths[1] - 1.0).abs() < 1e-9,
                "{name}: {lengths:?}"
            );
        }
    }
}

/// Also where sides of features were flipped away and came back by flips that keep the metric.
#[test]
fn the_jacobian_with_features_agrees_with_finite_differences() {
    let mut random = shapes::sequence(91);
    let mut straightened = 0;
    for cut in cut() {
        let on = cut.looped();
        let reflection = on.reflection().unwrap();
        let signature = signature(&on);
        let problem = Problem::new(&cut.start(&on), &on.loops, &signature);
        let penner = cut.log_length.iter().map(|l| 2.0 * l).collect();
        let penner = reflection.symmetric(&disturbed(&penner, 0.8, &mut random));
        let state = problem.evaluate(&penner);
        assert!(state.max_error.is_finite());
        straightened += state.straightened.len();
        let jacobian = state.by_edges(&problem).unwrap();
        let edges = on.connectivity.edges().step_by(3);
        let edges = edges.map(|e| problem.shares[e]);
        assert_derivatives(&problem, &jacobian, edges, |e, step| {
            let mut moved = penner.clone();
            moved[e] += step;
            reflection.symmetric(&moved)
        });
        // A scale moves both ends of every edge, with their images.
        let by_scales = state.by_scales(&problem, &jacobian);
        let u: VertexVec<f64> = on.connectivity.vertices().map(|_| random()).collect();
        let u: VertexVec<f64> = problem.vertex_shares.iter().map(|&v| u[v]).collect();
        let ends = |e: EdgeId| on.connectivity.edge_vertices(e).map(|v| u[v]);
        let sums = on.connectivity.edges().map(|e| ends(e)[0] + ends(e)[1]);
        let exact = jacobian.times(&sums.collect(), problem.equations());
        let mut found = vec![0.0; problem.equations()];
        for (v, u) in u.iter().enumerate() {
            let (rows, values) = by_scales.column(v);
            let parts = rows.iter().zip(values);
            parts.for_each(|(&r, x)| found[r as usize] += x * u);
        }
        for (a, b) in exact.iter().zip(&found) {
            assert!((a - b).abs() < 1e-9, "{a} against {b}");
        }
    }
    assert!(straightened > 10, "{straightened} flips");
}

/// Features that are given up are glued again: the field stays what it is, on the same triangulation, whether they are Delaunay there or not.
#[test]
fn a_field_stays_where_features_are_glued_again() {
    let shape = shapes::plate(2, 3);
    let (c, length) = (&shape.connectivity, &shape.length);
    let mut delaunay = Delaunay::new(c.clone(), length, Vec::new());
    delaunay.record = Some(Vec::new());
    delaunay.flip_in_the_surface();
    let flips = delaunay.record.take().unwrap();
    let mut edges: Vec<EdgeId> = flips.iter().map(|f| f.edge).collect();
    edges.sort_unstable();
    edges.dedup();
    edges.truncate(3);
    assert!(!edges.is_empty(), "every edge is Delaunay");
    let cut = Cut::new(shape, &edges);
    let on = cut.looped();
    let (mut field, angle) = field_of(&on);
    let (apart, _) = field
        .grid_signature(&on, &angle, &GridCones::at_least(3))
        .unwrap();
    let own = on.own();
    let own_side = |e: EdgeId| {
        let h = on.connectivity.edge_halfedge(e);
        let ways = [h, on.connectivity.twin(h).unwrap()];
        let is_own = |h: &HalfedgeId| h.index() < own.halfedge_count();
        ways.into_iter().find(is_own).unwrap()
    };
    let glued: Vec<[HalfedgeId; 2]> = on.glued.iter().map(|pair| pair.map(own_side)).collect();
    let (c, length) = (&cut.shape.connectivity, &cut.shape.length);
    let whole = Opened::new(c, &[]).unwrap();
    let ground = SurfaceDelaunay::along_features(c, length, &whole, &edges).unwrap();
    assert!(!ground.symmetric.as_ref().unwrap().flips.is_empty());
    let closed = LoopedSurface::along_features(&whole, &ground).unwrap();
    let signature = field.glued(&glued).signature(&closed, &angle).unwrap();
    // Each vertex has what its sectors had; on the mirror these are there twice.
    let mut quarters = VertexVec::filled(0, c.vertex_count());
    for (sector, &v) in cut.opened.vertex.enumerate() {
        let halves = match cut.opened.connectivity.is_boundary_vertex(sector) {
            true => 2,
            false => 1,
        };
        quarters[v] += apart.cone[sector] / halves;
    }
    assert_eq!(signature.cone, quarters);
    let log_length = ground.on_symmetric(ground.log_length.clone());
    let start = Start {
        connectivity: closed.connectivity,
        length: &closed.length,
        log_length: Some(&log_length),
        reflection: None,
        glued: &closed.glued,
    };
    let params = SeamlessParams::default();
    let found = seamless(&start, &closed.loops, &signature, &params, &()).unwrap();
    assert!(found.max_error <= 1e-10);
}
