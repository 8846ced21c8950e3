use super::*;
use crate::flow::field::cross_field;
use crate::flow::metric::face_lengths;
use crate::geometry::ids::{FaceId, VertexId};
use crate::geometry::triangle;
use std::f64::consts::TAU;

/// A surface with its angles and areas.
struct Rough {
    c: Connectivity,
    angle: FaceVec<[f64; 3]>,
    area: FaceVec<f64>,
}

/// A torus of radii 2 and 1 with every vertex moved by up to `noise` in any direction; `is_open`: without the faces of the last row.
fn torus(noise: f64, is_open: bool) -> Rough {
    const SIZE: [usize; 2] = [84, 42];
    let mut state = 7u64;
    let mut random = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    let mut at = Vec::new();
    let mut faces = Vec::new();
    for i in 0..SIZE[0] {
        for j in 0..SIZE[1] {
            let [u, v] = [(i, SIZE[0]), (j, SIZE[1])].map(|(k, n)| TAU * k as f64 / n as f64);
            let r = 2.0 + v.cos();
            let p = [r * u.cos(), r * u.sin(), v.sin()];
            at.push(p.map(|x| x + noise * random()));
            let number = |i: usize, j: usize| (i % SIZE[0] * SIZE[1] + j % SIZE[1]) as u32;
            let [a, b, c, d] = [
                number(i, j),
                number(i + 1, j),
                number(i + 1, j + 1),
                number(i, j + 1),
            ];
            if !(is_open && i + 1 == SIZE[0]) {
                faces.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    let c = Connectivity::from_faces(&faces, at.len()).unwrap();
    let span = |h| {
        let [p, q]: [[f64; 3]; 2] = [c.tail(h), c.head(h)].map(|v: VertexId| at[v.index()]);
        let square: f64 = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum();
        square.sqrt()
    };
    let length: EdgeVec<f64> = c.edges().map(|e| span(c.edge_halfedge(e))).collect();
    let sides = |f: FaceId| face_lengths(&c, &length, f);
    let angle = c
        .faces()
        .map(|f| triangle::angles(sides(f)).unwrap())
        .collect();
    let area = c
        .faces()
        .map(|f| triangle::area(sides(f)).unwrap())
        .collect();
    Rough { c, angle, area }
}

impl Rough {
    /// Curvature of every vertex, on the border that of the line.
    fn curvature(&self) -> VertexVec<f64> {
        let c = &self.c;
        let whole = |v| {
            if c.is_boundary_vertex(v) {
                0.5 * TAU
            } else {
                TAU
            }
        };
        let mut curvature: VertexVec<f64> = c.vertices().map(whole).collect();
        for h in c.halfedges() {
            curvature[c.tail(h)] -= self.angle[c.face(h)][c.corner(h)];
        }
        curvature
    }

    /// What is left of it.
    fn left(&self, lean: &HalfedgeVec<f64>) -> VertexVec<f64> {
        let mut left = self.curvature();
        // Counterclockwise around the head.
        let c = &self.c;
        c.halfedges().for_each(|h| left[c.head(h)] -= lean[h]);
        left
    }

    fn cones(&self, lean: &HalfedgeVec<f64>) -> usize {
        let c = &self.c;
        let pull = FaceVec::filled([0.0; 2], c.face_count());
        let field = cross_field(c, &self.angle, &self.area, &pull, lean).unwrap();
        let cones = field.cones(c, &self.angle).unwrap();
        c.vertices()
            .filter(|&v| !c.is_boundary_vertex(v) && cones[v] != 4)
            .count()
    }
}

#[test]
fn curvature_is_spread_and_stays() {
    for is_open in [false, true] {
        let rough = torus(0.03, is_open);
        let c = &rough.c;
        let lean = diffused(c, &rough.angle, &rough.area, 0.4).unwrap();
        for h in c.halfedges() {
            match c.twin(h) {
                Some(t) => assert_eq!(lean[h], -lean[t]),
                None => assert_eq!(lean[h], 0.0),
            }
        }
        let (before, after) = (rough.curvature(), rough.left(&lean));
        let total = |k: &VertexVec<f64>| k.iter().sum::<f64>();
        assert!((total(&before) - total(&after)).abs() < 1e-9);
        let border = c.vertices().filter(|&v| c.is_boundary_vertex(v));
        border.for_each(|v| assert!((before[v] - after[v]).abs() < 1e-9, "{v}"));
        // Noise is gone, the torus is there: more on the outside than on the inside.
        let largest = |k: &VertexVec<f64>| {
            let inside = c.vertices().filter(|&v| !c.is_boundary_vertex(v));
            inside.map(|v| k[v].abs()).fold(0.0, f64::max)
        };
        assert!(largest(&after) < 0.1 * largest(&before));
        let outside = c.vertices().filter(|v| (v.index() % 42) % 41 < 10);
        let outside: f64 = outside.map(|v| after[v]).sum();
        assert!(outside > 2.0, "{outside}");
    }
}

#[test]
fn noise_makes_no_cones() {
    let rough = torus(0.07, false);
    let none = HalfedgeVec::filled(0.0, rough.c.halfedge_count());
    let lean = diffused(&rough.c, &rough.angle, &rough.area, 0.5).unwrap();
    let (with, without) = (rough.cones(&lean), rough.cones(&none));
    assert!(without > 40 && with < without / 5, "{with} of {without}");
}

/// Faces without width, and a piece of the surface without a vertex inside.
#[test]
fn anything_has_finite_turns() {
    let one = Connectivity::from_faces(&[[0, 1, 2]], 3).unwrap();
    let angle = FaceVec::filled([1.0, 1.0, TAU / 2.0 - 2.0], 1);
    let lean = diffused(&one, &angle, &FaceVec::filled(1.0, 1), 0.1).unwrap();
    assert!(lean.iter().all(|x| *x == 0.0));
    let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
    let thin = Connectivity::from_faces(&faces, 4).unwrap();
    let angle = FaceVec::filled([0.0, 0.0, TAU / 2.0], 4);
    let lean = diffused(&thin, &angle, &FaceVec::filled(1e-9, 4), 0.1).unwrap();
    assert!(lean.iter().all(|x| x.is_finite()));
}
