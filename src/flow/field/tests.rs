use super::*;
use crate::flow::holonomy::{DualLoops, homology_basis};
use crate::flow::metric::face_lengths;
use crate::flow::ricci::shapes::{self, Shape};
use crate::flow::signature::FULL_TURN;
use crate::geometry::ids::{EdgeVec, FaceId};
use crate::geometry::triangle;

struct Fielded {
    c: Connectivity,
    length: EdgeVec<f64>,
    angle: FaceVec<[f64; 3]>,
    area: FaceVec<f64>,
    pull: FaceVec<[f64; 2]>,
    lean: HalfedgeVec<f64>,
    loops: DualLoops,
}

impl Fielded {
    fn looped(&self) -> LoopedSurface<'_> {
        LoopedSurface {
            connectivity: &self.c,
            length: self.length.clone(),
            half: None,
            loops: self.loops.clone(),
            sector: None,
            glued: Vec::new(),
        }
    }
}

fn prepare(shape: &Shape) -> Fielded {
    let (c, length) = (&shape.connectivity, &shape.length);
    let sides = |f: FaceId| face_lengths(c, length, f);
    Fielded {
        c: c.clone(),
        length: length.clone(),
        angle: c
            .faces()
            .map(|f| triangle::angles(sides(f)).unwrap())
            .collect(),
        area: c
            .faces()
            .map(|f| triangle::area(sides(f)).unwrap())
            .collect(),
        pull: FaceVec::filled([0.0; 2], c.face_count()),
        lean: HalfedgeVec::filled(0.0, c.halfedge_count()),
        loops: homology_basis(c).unwrap(),
    }
}

fn closed() -> Vec<Shape> {
    vec![
        shapes::plate(0, 3),
        shapes::torus(9, 7),
        shapes::plate(2, 2),
        shapes::plate(3, 2),
    ]
}

fn energy(field: &CrossField) -> f64 {
    field.matching.iter().map(|w| w * w).sum()
}

#[test]
fn signatures_are_integers_that_meet_gauss_bonnet() {
    for shape in closed() {
        let x = prepare(&shape);
        let field = cross_field(&x.c, &x.angle, &x.area, &x.pull, &x.lean).unwrap();
        let signature = field.signature(&x.looped(), &x.angle).unwrap();
        let curvature: i64 = signature.cone.iter().map(|k| FULL_TURN - k).sum();
        let chi = x.c.topology().euler_characteristic;
        assert_eq!(curvature, FULL_TURN * chi, "{}", shape.name);
        assert_eq!(signature.turning.len(), x.loops.len());
        for h in x.c.halfedges() {
            let t = x.c.twin(h).unwrap();
            assert_eq!(field.matching[h], -field.matching[t]);
            assert!(field.matching[h].abs() <= 0.5 * FRAC_PI_2 + 1e-12);
        }
    }
}

/// A torus of squares has a parallel field: no cones, and none of its loops turns.
#[test]
fn the_field_of_a_flat_torus_is_parallel() {
    let mut shape = shapes::torus(12, 9);
    let c = &shape.connectivity;
    let is_diagonal = |e| {
        let steps = c.edge_vertices(e).map(|v| [v.index() / 9, v.index() % 9]);
        (0..2).all(|k| steps[0][k] != steps[1][k])
    };
    let length = c
        .edges()
        .map(|e| if is_diagonal(e) { 2.0_f64.sqrt() } else { 1.0 });
    shape.length = length.collect();
    let x = prepare(&shape);
    let field = cross_field(&x.c, &x.angle, &x.area, &x.pull, &x.lean).unwrap();
    assert!(field.matching.iter().all(|w| w.abs() < 1e-6));
    let signature = field.signature(&x.looped(), &x.angle).unwrap();
    assert!(signature.cone.iter().all(|&k| k == FULL_TURN));
    assert!(signature.turning.iter().all(|&k| k == 0));
}

/// Turning single faces raises the energy: the eigenvector is a least one.
#[test]
fn no_face_can_turn_to_make_the_field_smoother() {
    let x = prepare(&shapes::plate(2, 3));
    let field = cross_field(&x.c, &x.angle, &x.area, &x.pull, &x.lean).unwrap();
    let mut smoother = 0;
    for f in x.c.faces() {
        let around = x.c.face_halfedges(f);
        let now: f64 = around.iter().map(|&h| field.matching[h].powi(2)).sum();
        let least = [-0.15, 0.15].map(|turn| {
            let turned = around.iter().map(|&h| {
                let w = field.matching[h] - turn;
                (w - (w / FRAC_PI_2).round() * FRAC_PI_2).powi(2)
            });
            turned.sum::<f64>()
        });
        smoother += usize::from(least[0].min(least[1]) < now - 0.02);
    }
    // The lengths of the vectors count too, near cones; a field without pattern has a third of such faces.
    assert!(
        20 * smoother < x.c.face_count(),
        "{smoother} of {}",
        x.c.face_count()
    );
    assert!(energy(&field) < 0.02 * x.c.edge_count() as f64 * 2.0);
}

/// A matching that is no field's is found out.
#[test]
fn a_broken_matching_is_refused() {
    let x = prepare(&shapes::torus(9, 7));
    let field = cross_field(&x.c, &x.angle, &x.area, &x.pull, &x.lean).unwrap();
    let mut broken = field.clone();
    broken.matching[x.c.corner_halfedge(FaceId::new(3), 0)] += 0.1;
    let error = broken.signature(&x.looped(), &x.angle).unwrap_err();
    assert!(
        matches!(error, FieldError::BrokenCone { residual, .. } if (residual.abs() - 0.1).abs() < 1e-9)
    );
}

/// A sphere with spikes, whose tips the field makes sharp cones.
fn spiky() -> Shape {
    let shape = shapes::plate(0, 6);
    let c = &shape.connectivity;
    let mut length = shape.length.clone();
    let mean = length.iter().sum::<f64>() / length.len() as f64;
    for v in shape.spread(6) {
        for h in c.outgoing(VertexId::new(v)) {
            length[c.edge(h)] = 4.0 * mean;
        }
    }
    Shape { length, ..shape }
}

#[test]
fn sharp_cones_are_given_quarter_turns() {
    let x = prepare(&spiky());
    let mut field = cross_field(&x.c, &x.angle, &x.area, &x.pull, &x.lean).unwrap();
    let before = field.signature(&x.looped(), &x.angle).unwrap();
    let lacking: i64 = before.cone.iter().map(|k| (3 - k).max(0)).sum();
    assert!(lacking > 0, "the spikes are no sharp cones");
    let (signature, moved) = field
        .grid_signature(&x.looped(), &x.angle, &GridCones::at_least(3))
        .unwrap();
    assert_eq!(moved.to_least as i64, lacking);
    assert!(signature.cone.iter().all(|&k| k >= 3));
    signature.check(&x.c, &x.loops).unwrap();
    // The changed field is a field still.
    assert_eq!(field.signature(&x.looped(), &x.angle).unwrap(), signature);
    let mut again = cross_field(&x.c, &x.angle, &x.area, &x.pull, &x.lean).unwrap();
    assert_eq!(
        again
            .grid_signature(&x.looped(), &x.angle, &GridCones::at_least(3))
            .unwrap()
            .0,
        signature
    );
}

#[test]
fn four_vertices_are_too_few_for_a_grid() {
    let positions = [
        [1.0, 1.0, 1.0],
        [1.0, -1.0, -1.0],
        [-1.0, 1.0, -1.0],
        [-1.0, -1.0, 1.0],
    ];
    let faces = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]];
    let x = prepare(&Shape::new("tetrahedron", &faces, &positions));
    let mut field = cross_field(&x.c, &x.angle, &x.area, &x.pull, &x.lean).unwrap();
    let error = field
        .grid_signature(&x.looped(), &x.angle, &GridCones::at_least(3))
        .unwrap_err();
    assert_eq!(
        error,
        FieldError::TooFewVertices {
            vertices: 4,
            least: 3
        }
    );
    assert!(
        field
            .grid_signature(&x.looped(), &x.angle, &GridCones::at_least(1))
            .is_ok()
    );
}

/// Distances along edges from a vertex to all others, by relaxing until nothing changes.
fn distances(x: &Fielded, from: VertexId) -> VertexVec<f64> {
    let mut distance = VertexVec::filled(f64::INFINITY, x.c.vertex_count());
    distance[from] = 0.0;
    loop {
        let before = distance.clone();
        for e in x.c.edges() {
            let [a, b] = x.c.edge_vertices(e);
            distance[a] = distance[a].min(distance[b] + x.length[e]);
            distance[b] = distance[b].min(distance[a] + x.length[e]);
        }
        if before == distance {
            return distance;
        }
    }
}

#[test]
fn near_cones_of_opposite_curvature_cancel() {
    let mut merged = 0;
    for shape in [spiky(), shapes::plate(2, 3), shapes::plate(3, 2)] {
        let x = prepare(&shape);
        let start = cross_field(&x.c, &x.angle, &x.area, &x.pull, &x.lean).unwrap();
        for near in [0.1, 0.3, 0.6].map(|part| part * x.area.iter().sum::<f64>().sqrt()) {
            let mut field = start.clone();
            let asked = GridCones {
                near,
                ..GridCones::at_least(3)
            };
            let (signature, moved) = field.grid_signature(&x.looped(), &x.angle, &asked).unwrap();
            merged += moved.merged;
            assert_eq!(field.signature(&x.looped(), &x.angle).unwrap(), signature);
            let kind = |v: VertexId| (signature.cone[v] - FULL_TURN).signum();
            for v in x.c.vertices().filter(|&v| kind(v) > 0) {
                let distance = distances(&x, v);
                for w in x.c.vertices().filter(|&w| kind(w) < 0) {
                    assert!(distance[w] > near, "{v} and {w} are {} apart", distance[w]);
                }
            }
        }
    }
    assert!(merged > 10, "only {merged} quarter turns were moved");
}

#[test]
fn cones_are_as_few_as_asked() {
    // Bounds of the grid: eight cones of three quads on a sphere; one on a surface of more handles than one.
    for (shape, fewest) in [
        (spiky(), 8),
        (shapes::plate(2, 3), 1),
        (shapes::plate(3, 2), 1),
    ] {
        let x = prepare(&shape);
        let start = cross_field(&x.c, &x.angle, &x.area, &x.pull, &x.lean).unwrap();
        let inside = |s: &Signature| s.cone.iter().filter(|&&k| k != FULL_TURN).count();
        let free = inside(&start.signature(&x.looped(), &x.angle).unwrap());
        for most in [free, (free + fewest) / 2, fewest] {
            let mut field = start.clone();
            let asked = GridCones {
                most,
                ..GridCones::at_least(3)
            };
            let (signature, _) = field.grid_signature(&x.looped(), &x.angle, &asked).unwrap();
            assert!(
                inside(&signature) <= most,
                "{} of {most}",
                inside(&signature)
            );
            assert!(signature.cone.iter().all(|&k| k >= 3));
            assert_eq!(field.signature(&x.looped(), &x.angle).unwrap(), signature);
        }
        if fewest > 1 {
            let asked = GridCones {
                most: fewest - 1,
                ..GridCones::at_least(3)
            };
            let error = (start.clone().grid_signature(&x.looped(), &x.angle, &asked)).unwrap_err();
            let (left, most) = (fewest, fewest - 1);
            assert_eq!(error, FieldError::TooManyCones { left, most });
        }
    }
}

/// A pull of great weight is followed, and one of none leaves the smoothest field.
#[test]
fn a_field_is_drawn_to_what_pulls() {
    let x = prepare(&shapes::plate(2, 2));
    let wanted = |f: FaceId| 0.3 + f.index() as f64;
    let pull = |weight: f64| {
        let cross = |f| [(4.0 * wanted(f)).cos(), (4.0 * wanted(f)).sin()].map(|p| weight * p);
        x.c.faces().map(cross).collect()
    };
    let drawn = cross_field(&x.c, &x.angle, &x.area, &pull(1e6), &x.lean).unwrap();
    for f in x.c.faces() {
        let off = (drawn.direction[f] - wanted(f)) / FRAC_PI_2;
        assert!((off - off.round()).abs() < 1e-4, "{f}: {off}");
    }
    let smooth = cross_field(&x.c, &x.angle, &x.area, &x.pull, &x.lean).unwrap();
    assert!(energy(&smooth) < 0.5 * energy(&drawn));
}
