use super::*;
use crate::flow::field::cross_field;
use crate::flow::metric::face_lengths;
use crate::geometry::ids::FaceId;
use crate::geometry::triangle;

/// A plane mesh.
struct Plane {
    c: Connectivity,
    at: Vec<[f64; 2]>,
    length: EdgeVec<f64>,
    angle: FaceVec<[f64; 3]>,
}

/// The triangles with sides 1 of a plane whose middles are inside, cut out face by face.
fn lattice(is_inside: impl Fn([f64; 2]) -> bool) -> Plane {
    const N: i32 = 40;
    let at = |[i, j]: [i32; 2]| {
        [
            f64::from(i) + 0.5 * f64::from(j),
            0.75f64.sqrt() * f64::from(j),
        ]
    };
    let pairs = (-N..N).flat_map(|i| (-N..N).map(move |j| [i, j]));
    let triangles = pairs.flat_map(|[i, j]| {
        let (right, above) = ([i + 1, j], [i, j + 1]);
        [[[i, j], right, above], [right, [i + 1, j + 1], above]]
    });
    let triangles = triangles.filter(|t| {
        let p = t.map(at);
        is_inside([0, 1].map(|k| (p[0][k] + p[1][k] + p[2][k]) / 3.0))
    });
    let triangles: Vec<[[i32; 2]; 3]> = triangles.collect();
    let mut corners: Vec<[i32; 2]> = triangles.iter().flatten().copied().collect();
    corners.sort_unstable();
    corners.dedup();
    let number = |p: [i32; 2]| corners.binary_search(&p).unwrap() as u32;
    let faces: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(number)).collect();
    plane(&faces, corners.into_iter().map(at).collect())
}

fn plane(faces: &[[u32; 3]], at: Vec<[f64; 2]>) -> Plane {
    let c = Connectivity::from_faces(faces, at.len()).unwrap();
    let span = |h: HalfedgeId| {
        let [p, q] = [c.tail(h), c.head(h)].map(|v| at[v.index()]);
        [q[0] - p[0], q[1] - p[1]]
    };
    let length: EdgeVec<f64> = c
        .edges()
        .map(|e| span(c.edge_halfedge(e)))
        .map(|[x, y]| x.hypot(y))
        .collect();
    let sides = |f: FaceId| face_lengths(&c, &length, f);
    let angle = c
        .faces()
        .map(|f| triangle::angles(sides(f)).unwrap())
        .collect();
    Plane {
        c,
        at,
        length,
        angle,
    }
}

impl Plane {
    fn leans(&self, reach: f64) -> HalfedgeVec<f64> {
        leans(&self.c, &self.angle, &self.length, |_| Some(0), reach)
    }

    /// Corners that the smoothest field makes of the border.
    fn corners(&self, reach: f64) -> usize {
        let c = &self.c;
        let area = FaceVec::filled(1.0, c.face_count());
        let pull = FaceVec::filled([0.0; 2], c.face_count());
        let field = cross_field(c, &self.angle, &area, &pull, &self.leans(reach)).unwrap();
        let cones = field.cones(c, &self.angle).unwrap();
        c.vertices()
            .filter(|&v| c.is_boundary_vertex(v) && cones[v] != 2)
            .count()
    }
}

/// Directions of teeth are those of the line that they are on.
#[test]
fn teeth_count_as_the_line_through_them() {
    // Above and below teeth of 60°, on the left and on the right of 30°.
    let strip = lattice(|[x, y]| x.abs() < 12.1 && y.abs() < 5.7);
    let reach = 3.0;
    let leans = strip.leans(reach);
    let mut seen = 0;
    for h in strip.c.halfedges().filter(|&h| strip.c.twin(h).is_none()) {
        let [p, q] = [strip.c.tail(h), strip.c.head(h)].map(|v| strip.at[v.index()]);
        let heading = (q[1] - p[1]).atan2(q[0] - p[0]) + leans[h];
        // Away from the corners.
        let middle = [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
        if middle[0].abs() < 8.0 || middle[1].abs() < 2.0 {
            let off = heading / FRAC_PI_2 - (heading / FRAC_PI_2).round();
            assert!(off.abs() < 0.12, "{middle:?}: {off}");
            seen += 1;
        }
    }
    assert!(seen > 60, "{seen}");
}

/// The window is one of length: a border with more vertices has the same directions.
#[test]
fn directions_are_those_of_borders_that_do_not_turn_back() {
    // A regular polygon, and a square.
    for (sides, per_side) in [(60, 1), (4, 8), (3, 5)] {
        let corner = |k: usize| (k as f64 / sides as f64 * 2.0 * PI).sin_cos();
        let count = sides * per_side;
        let mut at: Vec<[f64; 2]> = (0..count)
            .map(|i| {
                let (k, t) = (i / per_side, (i % per_side) as f64 / per_side as f64);
                let ((s, c), (u, d)) = (corner(k), corner(k + 1));
                [c + t * (d - c), s + t * (u - s)]
            })
            .collect();
        at.push([0.0, 0.0]);
        let n = count as u32;
        let faces: Vec<[u32; 3]> = (0..n).map(|i| [i, (i + 1) % n, n]).collect();
        let plane = plane(&faces, at);
        assert!(plane.leans(0.7).iter().all(|lean| lean.abs() < 1e-9));
    }
}

/// The field goes along holes of a scan, and makes no corners of their teeth.
#[test]
fn ragged_borders_have_few_corners() {
    let ring = lattice(|[x, y]| (6.0..16.0).contains(&x.hypot(y)));
    let (with, without) = (ring.corners(2.0), ring.corners(0.0));
    assert!(without > 40 && with < without / 8, "{with} of {without}");
}

/// What is of no line keeps its own directions, and parts lines.
#[test]
fn only_lines_lean() {
    let ring = lattice(|[x, y]| (6.0..16.0).contains(&x.hypot(y)));
    let c = &ring.c;
    let is_left = |h: HalfedgeId| ring.at[c.tail(h).index()][0] < 0.0;
    let line = |h| is_left(h).then_some(0);
    let leans = leans(c, &ring.angle, &ring.length, line, 2.0);
    let border = c.halfedges().filter(|&h| c.twin(h).is_none());
    let (left, right): (Vec<HalfedgeId>, Vec<HalfedgeId>) = border.partition(|&h| is_left(h));
    assert!(right.iter().all(|&h| leans[h] == 0.0));
    assert!(left.iter().filter(|&&h| leans[h] != 0.0).count() > left.len() / 2);
}

/// Where lines follow each other, each is looked at by itself.
#[test]
fn a_corner_between_two_lines_stays() {
    // Crenels of 60°: every edge is a line of its own, or all are one.
    let strip = lattice(|[x, y]| x.abs() < 12.1 && y.abs() < 5.7);
    let (c, reach) = (&strip.c, 3.0);
    let lean = |line: &dyn Fn(HalfedgeId) -> Option<usize>| {
        let leans = leans(c, &strip.angle, &strip.length, line, reach);
        leans.iter().filter(|lean| lean.abs() > 0.1).count()
    };
    assert_eq!(lean(&|h| Some(h.index())), 0);
    assert!(lean(&|_| Some(7)) > 60);
}
