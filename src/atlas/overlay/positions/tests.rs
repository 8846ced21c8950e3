mod driver;

use super::*;
use crate::geometry::ids::VertexId;
use driver::{Driver, Random, octahedron, promised, random_lengths, surfaces, torus};

type Point = [f64; 2];

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}
fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}
/// Where the line cd crosses the line ab, as a fraction from a.
fn along(a: Point, b: Point, c: Point, d: Point) -> f64 {
    cross(minus(c, a), minus(d, c)) / cross(minus(b, a), minus(d, c))
}

/// Lengths from places in space.
fn lengths(base: &Connectivity, places: &[[f64; 3]]) -> EdgeVec<f64> {
    base.edges()
        .map(|e| {
            let [a, b] = base.edge_vertices(e).map(|v| places[v.index()]);
            let d = [0, 1, 2].map(|k| b[k] - a[k]);
            (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt()
        })
        .collect()
}

/// A fan over the polygon 0, 1, …, n − 1 from vertex 0, and a pyramid below it with the apex n. Flipping edges that have two
/// front faces keeps everything flat in front.
fn polygon(places: &[Point]) -> (Driver, Vec<EdgeId>) {
    let n = places.len() as u32;
    let mut faces: Vec<[u32; 3]> = (1..n - 1).map(|i| [0, i, i + 1]).collect();
    faces.extend((0..n).map(|i| [(i + 1) % n, i, n]));
    let base = Connectivity::from_faces(&faces, n as usize + 1).unwrap();
    let mut space: Vec<[f64; 3]> = places.iter().map(|p| [p[0], p[1], 0.0]).collect();
    space.push([0.0, 0.0, -1.0]);
    let diagonals = base
        .edges()
        .filter(|&e| {
            let h = base.edge_halfedge(e);
            let back = |h| base.face(h).index() >= n as usize - 2;
            !back(h) && !back(base.twin(h).unwrap())
        })
        .collect();
    let length = lengths(&base, &space);
    (Driver::new(base, length), diagonals)
}

/// `flat` places, `base` places: every crossing must be where the straight lines cross in both planes.
fn compare(x: &Driver, in_base: &[Point], in_flat: &[Point], tolerance: f64) -> usize {
    let (curves, got) = x.checked();
    let x = &x.intrinsic;
    for e in x.base.edges() {
        for i in curves.range(e) {
            let c = x.flat.edge(curves.crossing[i].halfedge);
            let ([a, b], [p, q]) = (x.base.edge_vertices(e), x.flat.edge_vertices(c));
            let [a, b, p, q] = [a, b, p, q].map(VertexId::index);
            let on_base = along(in_base[a], in_base[b], in_base[p], in_base[q]);
            let on_flat = along(in_flat[p], in_flat[q], in_flat[a], in_flat[b]);
            assert!(
                (got.on_base[i] - on_base).abs() < tolerance,
                "{} {on_base}",
                got.on_base[i]
            );
            assert!(
                (got.on_flat[i] - on_flat).abs() < tolerance,
                "{} {on_flat}",
                got.on_flat[i]
            );
        }
    }
    curves.crossing.len()
}

/// Points of the unit circle at increasing angles.
fn on_circle(n: usize, random: &mut Random) -> Vec<Point> {
    let mut angle = 0.0;
    let steps: Vec<f64> = (0..n).map(|_| 0.2 + random.next()).collect();
    let total: f64 = steps.iter().sum();
    steps
        .iter()
        .map(|step| {
            angle += std::f64::consts::TAU * step / total;
            [angle.cos(), angle.sin()]
        })
        .collect()
}

/// A Möbius map of the unit disk onto itself, and half the logarithm of the scale at the places: |f(z) − f(w)|² = e^{u(z) + u(w)} |z − w|².
fn moebius(places: &[Point], center: Point) -> (Vec<Point>, Vec<f64>) {
    let [cx, cy] = center;
    let shrink = 1.0 - cx * cx - cy * cy;
    places
        .iter()
        .map(|&[x, y]| {
            // (z − c) / (1 − c̄ z).
            let (nx, ny) = (x - cx, y - cy);
            let (dx, dy) = (1.0 - cx * x - cy * y, cy * x - cx * y);
            let size = dx * dx + dy * dy;
            (
                [(nx * dx + ny * dy) / size, (ny * dx - nx * dy) / size],
                (shrink / size).ln(),
            )
        })
        .unzip()
}

#[test]
fn nothing_flipped_nothing_crossed() {
    let (x, _) = polygon(&on_circle(5, &mut Random(1)));
    let (curves, got) = x.checked();
    assert!(curves.crossing.is_empty() && got.on_base.is_empty() && got.on_flat.is_empty());
}

/// Every triangulation of points on one circle has straight edges, whichever way it was reached, and a Möbius map of the
/// disk moves all of them as the projective map that keeps the circle does.
#[test]
fn points_on_a_circle_know_everything() {
    let mut random = Random(2);
    let mut crossings = 0;
    for round in 0..60 {
        let n = 4 + round % 12;
        let places = on_circle(n, &mut random);
        let (mut x, diagonals) = polygon(&places);
        // The base is a random triangulation too.
        for _ in 0..3 * n {
            x.euclidean_flip(diagonals[random.below(diagonals.len())]);
        }
        x = Driver::new(x.intrinsic.delaunay, x.intrinsic.delaunay_length);
        let flips = [(0, 1), (1, 0), (4, 4)][round % 3];
        for _ in 0..flips.0 * n {
            x.euclidean_flip(diagonals[random.below(diagonals.len())]);
        }
        x.start_flat();
        for _ in 0..flips.1 * n {
            x.ptolemy_flip(diagonals[random.below(diagonals.len())]);
        }
        crossings += compare(&x, &places, &places, 1e-10);
        let (moved, u) = moebius(&places, [0.6 * random.next(), -0.6 * random.next()]);
        for (i, &u) in u.iter().enumerate() {
            x.intrinsic.u[VertexId::new(i)] = u;
        }
        crossings += compare(&x, &places, &moved, 1e-9);
    }
    assert!(crossings > 1000, "{crossings}");
}

/// One diagonal of a quad that is not cocircular, scaled so that it is: there its diagonals are straight, and
/// the place on the old one is known through the weights.
#[test]
fn scale_enters_with_the_right_sign() {
    let places = [[0.0, 0.0], [2.0, -0.3], [2.5, 1.5], [-0.4, 1.1]];
    let (mut x, diagonals) = polygon(&places);
    assert_eq!(diagonals.len(), 1);
    let e = diagonals[0];
    for (i, u) in [0.0, 0.7, -0.4, 1.3, 0.0].into_iter().enumerate() {
        x.intrinsic.u[VertexId::new(i)] = u;
    }
    // u at vertex 1 that makes the quad cocircular.
    let excess = |x: &Driver, u: f64| {
        let x = &x.intrinsic;
        let scaled = |e| {
            let [i, j] = x.flat.edge_vertices(e);
            let of = |v: VertexId| if v.index() == 1 { u } else { x.u[v] };
            x.penner[e] + 0.5 * (of(i) + of(j))
        };
        Driver::cosines(&x.flat, scaled, e)
    };
    let (mut low, mut high) = (-5.0, 5.0);
    let sign = excess(&x, low).signum();
    assert_ne!(sign, excess(&x, high).signum());
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if excess(&x, middle).signum() == sign {
            low = middle;
        } else {
            high = middle;
        }
    }
    x.intrinsic.u[VertexId::new(1)] = low;
    let u: Vec<f64> = x.intrinsic.u.iter().copied().collect();
    // The scaled quad in the plane: 0 at the origin, 2 on the axis.
    let scaled = |i: usize, j: usize| {
        let d = minus(places[i], places[j]);
        d[0].hypot(d[1]) * (0.5 * (u[i] + u[j])).exp()
    };
    let put = |i: usize, side: f64| {
        let (a, b, c) = (scaled(0, 2), scaled(0, i), scaled(2, i));
        let x = (a * a + b * b - c * c) / (2.0 * a);
        [x, side * (b * b - x * x).sqrt()]
    };
    let flat = [[0.0, 0.0], put(1, -1.0), [scaled(0, 2), 0.0], put(3, 1.0)];
    assert!(x.ptolemy_flip(e));
    let (curves, got) = x.checked();
    assert_eq!(curves.crossing.len(), 1);
    let ([a, b], [p, q]) = (
        x.intrinsic.base.edge_vertices(e),
        x.intrinsic.flat.edge_vertices(e),
    );
    let [a, b, p, q] = [a, b, p, q].map(VertexId::index);
    let on_flat = along(flat[p], flat[q], flat[a], flat[b]);
    assert!((got.on_flat[0] - on_flat).abs() < 1e-12);
    let scaled_base = along(flat[a], flat[b], flat[p], flat[q]);
    let odds = (scaled_base / (1.0 - scaled_base)).ln() + u[b] - u[a];
    assert!((got.on_base[0] - 1.0 / (1.0 + (-odds).exp())).abs() < 1e-12);
    // The quad was not cocircular to begin with.
    assert!((got.on_base[0] - along(places[a], places[b], places[p], places[q])).abs() > 1e-3);
}

/// Without Ptolemy flips all edges are straight in the plane, for any points.
#[test]
fn euclidean_flips_alone_give_euclidean_positions() {
    let mut random = Random(3);
    let mut crossings = 0;
    for _ in 0..20 {
        // A convex polygon with random points inside, by splitting faces; then flips that keep it planar.
        let n = 6;
        let outer: Vec<Point> = on_circle(n, &mut random)
            .iter()
            .map(|p| [3.0 * p[0], p[1]])
            .collect();
        let (start, _) = polygon(&outer);
        let (mut base, mut places) = (start.intrinsic.base, outer.clone());
        places.push([0.0, 0.0]);
        let mut front: Vec<_> = base.faces().take(n - 2).collect();
        for _ in 0..25 {
            let f = front[random.below(front.len())];
            let corners = base.face_vertices(f).map(|v| places[v.index()]);
            let split = base.split_face(f);
            let w = [0.0; 3].map(|_| 0.1 + random.next());
            let total: f64 = w.iter().sum();
            places.push([0, 1].map(|k| (0..3).map(|i| w[i] * corners[i][k]).sum::<f64>() / total));
            front.extend(&split.faces[1..]);
        }
        let mut space: Vec<[f64; 3]> = places.iter().map(|p| [p[0], p[1], 0.0]).collect();
        space[n][2] = -1.0;
        let length = lengths(&base, &space);
        let apex = VertexId::new(n);
        let inner: Vec<bool> = base
            .edges()
            .map(|e| {
                let h = base.edge_halfedge(e);
                ![
                    base.tail(h),
                    base.head(h),
                    base.apex(h),
                    base.apex(base.twin(h).unwrap()),
                ]
                .contains(&apex)
            })
            .collect();
        let mut x = Driver::new(base, length);
        x.delaunay(|e| inner[e.index()]);
        crossings += compare(&x, &places, &places, 1e-9);
    }
    assert!(crossings > 200, "{crossings}");
}

#[test]
fn delaunay_for_random_scales() {
    let mut random = Random(4);
    let mut crossings = 0;
    for round in 0..40 {
        for base in surfaces() {
            let length = random_lengths(&base, &mut random);
            let mut x = Driver::new(base, length);
            x.delaunay(|_| true);
            let size = [0.5, 2.0, 8.0, 100.0][round % 4];
            for v in x.intrinsic.base.vertices() {
                x.intrinsic.u[v] = size * (2.0 * random.next() - 1.0);
            }
            x.flat_delaunay();
            crossings += x.checked().0.crossing.len();
        }
    }
    assert!(crossings > 1000, "{crossings}");
}

/// Neither B nor C need be Delaunay, and base edges may run around the surface many times.
#[test]
fn any_flips_at_all() {
    let mut random = Random(5);
    let mut crossings = 0;
    for round in 0..40 {
        for base in surfaces() {
            let length = random_lengths(&base, &mut random);
            let edges = base.edge_count();
            let mut x = Driver::new(base, length);
            for _ in 0..round % 5 * edges {
                x.euclidean_flip(EdgeId::new(random.below(edges)));
            }
            x.start_flat();
            for _ in 0..round % 4 * edges {
                x.ptolemy_flip(EdgeId::new(random.below(edges)));
            }
            crossings += x.checked().0.crossing.len();
            // Lengths that have nothing to do with the surface draw wild curves, but homotopic ones.
            for length in x.intrinsic.delaunay_length.as_mut_slice() {
                *length = (40.0 * random.next() - 20.0).exp();
            }
            x.checked();
        }
    }
    assert!(crossings > 10_000, "{crossings}");
}

/// A torus in space, squashed until its faces are a million times longer than wide, and scales of e^±100.
#[test]
fn needles_and_wild_scales() {
    let mut random = Random(6);
    for aspect in [1e3, 1e6] {
        let (n, m) = (12, 9);
        let base = torus(n, m);
        let mut places = Vec::new();
        for i in 0..n {
            for j in 0..m {
                let turn = std::f64::consts::TAU;
                let (a, b) = (turn * i as f64 / n as f64, turn * j as f64 / m as f64);
                let r = 2.0 + b.cos() + 0.1 * random.next();
                let z = b.sin() + 0.1 * random.next();
                places.push([r * a.cos() * aspect, r * a.sin(), z]);
            }
        }
        let length = lengths(&base, &places);
        let mut x = Driver::new(base, length);
        x.delaunay(|_| true);
        assert!(!x.checked().0.crossing.is_empty());
        for v in x.intrinsic.base.vertices() {
            x.intrinsic.u[v] = 200.0 * random.next() - 100.0;
        }
        x.flat_delaunay();
        assert!(!x.checked().0.crossing.is_empty());
    }
}

#[test]
fn threads_change_nothing() {
    let mut random = Random(7);
    let base = torus(60, 50);
    let length = random_lengths(&base, &mut random);
    let mut x = Driver::new(base, length);
    x.delaunay(|_| true);
    for v in x.intrinsic.base.vertices() {
        x.intrinsic.u[v] = 2.0 * random.next();
    }
    x.flat_delaunay();
    let curves = x.curves();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| positions(&x.intrinsic, &curves, SPACING).unwrap())
    };
    assert_eq!(with(1), with(5));
}

/// What does not belong together is refused or guessed, and never breaks a promise.
#[test]
fn nonsense_is_survived() {
    let mut random = Random(8);
    let mut x = Driver::new(octahedron(), random_lengths(&octahedron(), &mut random));
    for _ in 0..30 {
        x.ptolemy_flip(EdgeId::new(random.below(12)));
    }
    let curves = x.curves();
    let mut short = curves.clone();
    short.first.pop();
    assert_eq!(
        positions(&x.intrinsic, &short, SPACING),
        Err(PositionsError::Sizes)
    );
    let mut doubled = curves.clone();
    let twice = (0..curves.crossing.len())
        .find(|&i| (0..i).any(|j| curves.crossing[j].halfedge == curves.crossing[i].halfedge))
        .unwrap();
    let first = (0..twice)
        .find(|&j| curves.crossing[j].halfedge == curves.crossing[twice].halfedge)
        .unwrap();
    doubled.crossing[twice].rank = doubled.crossing[first].rank;
    assert!(matches!(
        positions(&x.intrinsic, &doubled, SPACING),
        Err(PositionsError::Ranks { .. })
    ));
    let mut flat = x.intrinsic.clone();
    flat.delaunay_length[EdgeId::new(3)] = 0.0;
    assert_eq!(
        positions(&flat, &curves, SPACING),
        Err(PositionsError::Length {
            edge: 3,
            length: 0.0
        })
    );
    // A curve that has lost its way: the places of the rest are found all the same.
    let mut astray = curves.clone();
    let e = x
        .intrinsic
        .base
        .edges()
        .max_by_key(|&e| curves.range(e).len())
        .unwrap();
    let range = curves.range(e);
    assert!(range.len() > 2);
    let (i, j) = (range.start, range.start + 1);
    astray.crossing.swap(i, j);
    let got = positions(&x.intrinsic, &astray, SPACING).unwrap();
    assert!(got.unmatched > 0 && got.unmatched <= range.len());
    promised(&x.intrinsic, &astray, &got);
}
